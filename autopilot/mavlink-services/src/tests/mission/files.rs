//! Files of plans of the kinds that people have, each taken as it is by a slow aircraft.

use crate::mission::file::PlanFile;
use flight_management::configuration;
use flight_management::vehicle::plan::Action;
use flight_management::vehicle::rules::Rules;

macro_rules! files {
    ($($name:literal)*) => { [$(($name, include_str!(concat!("files/", $name)))),*] };
}

const FILES: [(&str, &str); 12] = files! {
    "camera.plan" "circles_to_altitudes.waypoints" "circuit_for_ever.waypoints" "every_kind.waypoints"
    "exchanged_radius.plan" "fence_and_rally.plan" "survey_and_landing_pattern.plan"
    "takeoff_circle_land.plan" "there_and_back.waypoints" "tilt_rotor.waypoints"
    "tilt_rotor_with_land_start.plan" "trigger_only.plan"
};

/// The limits of the Aerosonde.
fn rules() -> Rules {
    let model = configuration::model("aerosonde.toml", aircraft::AEROSONDE_MODEL).unwrap();
    let parameters = model.defaults;
    Rules::new(parameters.limits, parameters.navigation, &parameters.gains)
}

fn read(name: &str) -> PlanFile {
    let (_, text) = FILES.iter().find(|(known, _)| *known == name).unwrap();
    PlanFile::read(text).unwrap()
}

fn actions(name: &str) -> Vec<Action> {
    let (plan, _) = read(name).plan(&rules()).unwrap();
    plan.items.iter().map(|item| item.action).collect()
}

#[test]
fn every_file_is_taken_unedited() {
    for (name, text) in FILES {
        let file = PlanFile::read(text).unwrap_or_else(|why| panic!("{name}: {why}"));
        let (plan, _) = file.plan(&rules()).unwrap_or_else(|why| panic!("{name}: {why:#?}"));
        assert_eq!(plan.items.is_empty(), name == "fence_and_rally.plan", "{name}");
    }
}

#[test]
fn altitudes_above_sea_level_count_from_the_home_of_the_file() {
    let altitude_m = actions("every_kind.waypoints")[10].altitude_m().unwrap();
    assert!((altitude_m - 110.0).abs() < 1.0e-9, "187 m, and home at 77 m: {altitude_m} m");
}

#[test]
fn jumps_lead_where_the_file_says() {
    let to = |name, item: usize| match actions(name)[item] {
        Action::Jump { to, times } => (to, times),
        other => panic!("{other:?}"),
    };
    assert_eq!(to("circuit_for_ever.waypoints", 6), (2, None));
    assert_eq!(to("every_kind.waypoints", 18), (14, Some(1)), "to the tag");
    assert_eq!(to("survey_and_landing_pattern.plan", 8), (2, Some(1)), "by the id of the target");
}

#[test]
fn fence_and_rally_points_of_a_file_are_taken() {
    let (fence, rally) = read("fence_and_rally.plan").fence().unwrap();
    let inclusions: Vec<bool> = fence.areas().iter().map(|area| area.inclusion).collect();
    assert_eq!(inclusions, [true, false, false]);
    assert_eq!(rally.len(), 2);
    let (_, text) = FILES[5];
    let beyond = text.replace("\"points\": [", "\"points\": [[45.3, 9.1, 80],");
    let refused = PlanFile::read(&beyond).unwrap().fence().unwrap_err();
    assert_eq!(
        refused,
        ["item 0: NAV_RALLY_POINT (5100): beyond the fence; expected a place inside it"]
    );
}

#[test]
fn a_landing_pattern_becomes_its_items() {
    let actions = actions("survey_and_landing_pattern.plan");
    let [.., Action::LandStart, Action::LoiterToAltitude(circle), Action::Land { .. }] =
        actions[..]
    else {
        panic!("{actions:?}")
    };
    assert_eq!((circle.radius_m, circle.clockwise), (Some(75.0), false));
}

#[test]
fn a_damaged_file_is_refused_with_line_or_key() {
    let (_, text) = FILES[1];
    for (text, words) in [
        (text.replace("\t31\t", "\tx\t"), "command \"x\" is no whole number"),
        (text.replace("\n3\t", "\n4\t"), "line 5: item number 4; expected 3"),
        ("QGC WPL 110\n0\t1\t0\n".to_owned(), "line 2: 3 columns; expected 12"),
        ("{".to_owned(), "EOF"),
        ("{}".to_owned(), "mission.items"),
        (r#"{"mission":{"items":[{"command":16}]}}"#.to_owned(), "mission.items[0]: frame"),
        (
            r#"{"mission":{"items":[{"command":16,"frame":3,"params":["1"]}]}}"#.to_owned(),
            "mission.items[0]: params: \"1\" is no number",
        ),
        (
            r#"{"mission":{"items":[{"type":"ComplexItem","complexItemType":"StructureScan"}]}}"#
                .to_owned(),
            "a complex item StructureScan cannot be read",
        ),
    ] {
        let refused = PlanFile::read(&text).unwrap_err();
        assert!(refused.contains(words), "{words}: {refused}");
    }
}
