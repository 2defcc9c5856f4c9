//! Files of plans of the kinds that people have, each taken as it is by a slow aircraft.

use crate::mission::file::PlanFile;
use flight_management::configuration;
use flight_management::vehicle::Airspeed;
use flight_management::vehicle::plan::Action;
use flight_management::vehicle::rules::Rules;

macro_rules! files {
    ($($name:literal)*) => { [$(($name, include_str!(concat!("files/", $name)))),*] };
}

const FILES: [(&str, &str); 17] = files! {
    "all_at_one_place.waypoints" "landing_point_in_the_air.waypoints"
    "before_fences.mission" "camera.plan" "circles_to_altitudes.waypoints" "circuit_for_ever.waypoints"
    "every_kind.waypoints" "exchanged_radius.plan" "fence_and_rally.plan" "fence_and_rally.waypoints"
    "home_on_the_ground.waypoints" "survey_and_landing_pattern.plan" "takeoff_circle_land.plan"
    "there_and_back.waypoints" "tilt_rotor.waypoints" "tilt_rotor_with_land_start.plan"
    "trigger_only.plan"
};

/// The limits of the Aerosonde.
fn rules() -> Rules {
    let model = configuration::model("aerosonde.toml", aircraft::AEROSONDE_MODEL).unwrap();
    let parameters = model.defaults;
    Rules::new(parameters.limits, parameters.navigation, &parameters.gains)
}

fn text(name: &str) -> &'static str {
    FILES.iter().find(|(known, _)| *known == name).unwrap().1
}

fn read(name: &str) -> PlanFile {
    PlanFile::read(text(name)).unwrap()
}

fn actions(name: &str) -> Vec<Action> {
    let (plan, _) = read(name).plan(&rules(), None).unwrap();
    plan.items.iter().map(|item| item.action).collect()
}

#[test]
fn every_file_is_taken_unedited() {
    for (name, text) in FILES {
        let file = PlanFile::read(text).unwrap_or_else(|why| panic!("{name}: {why}"));
        let (plan, _) = file.plan(&rules(), None).unwrap_or_else(|why| panic!("{name}: {why:#?}"));
        assert_eq!(plan.items.is_empty(), name.starts_with("fence_and_rally"), "{name}");
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
    assert_eq!(to("before_fences.mission", 3), (1, Some(1)), "by the id of the target");
    assert_eq!(to("home_on_the_ground.waypoints", 4), (2, Some(1)), "to the line of this number");
}

#[test]
fn fence_and_rally_points_of_a_file_are_taken() {
    let (fence, rally) = read("fence_and_rally.plan").fence().unwrap();
    let inclusions: Vec<bool> = fence.areas().iter().map(|area| area.inclusion).collect();
    assert_eq!(inclusions, [true, false, false]);
    assert_eq!(rally.len(), 2);
    let beyond =
        text("fence_and_rally.plan").replace("\"points\": [", "\"points\": [[45.3, 9.1, 80],");
    let refused = PlanFile::read(&beyond).unwrap().fence().unwrap_err();
    assert_eq!(
        refused,
        ["item 0: NAV_RALLY_POINT (5100): beyond the fence; expected a place inside it"]
    );
}

#[test]
fn a_text_of_waypoints_may_have_a_fence_and_rally_points() {
    let file = read("fence_and_rally.waypoints");
    let (fence, rally) = file.fence().unwrap();
    assert_eq!((fence.areas().len(), rally.len()), (2, 1));
    assert_eq!(file.home().map(|(_, altitude_m)| altitude_m), Some(77.0));
    let behind =
        format!("{}8\t0\t3\t16\t0\t0\t0\t0\t45.2\t9.1\t80\t1\n", text("fence_and_rally.waypoints"));
    let refused = PlanFile::read(&behind).unwrap_err();
    assert_eq!(refused, "line 10: an item of the mission behind a fence or rally points");
}

#[test]
fn a_file_from_before_the_fence_has_its_places_apart() {
    let file = read("before_fences.mission");
    assert_eq!(file.home().map(|(_, altitude_m)| altitude_m), Some(77.0));
    let actions = actions("before_fences.mission");
    assert_eq!(actions[1].altitude_m(), Some(80.0), "above home");
    assert_eq!(actions[4].altitude_m(), Some(45.0), "122 m above sea level, and home at 77 m");
    let first = r#"{"items":[{"command":18,"frame":3,"id":1,"coordinate":[45.2,9.1,80],"param1":2,
        "param2":0,"param3":-150,"param4":0,"autoContinue":true,"type":"missionItem"}],
        "plannedHomePosition":{"command":16,"coordinate":[45.2,9.1,77]},"version":"1.0"}"#;
    let file = PlanFile::read(first).unwrap();
    assert_eq!(file.home().map(|(_, altitude_m)| altitude_m), Some(77.0));
    let (plan, _) = file.plan(&rules(), None).unwrap();
    let circle = plan.items[0].action.circle().copied().unwrap();
    assert_eq!((circle.radius_m, circle.clockwise), (Some(150.0), false));
}

#[test]
fn lines_are_counted_whatever_their_numbers_and_home_may_be_on_the_ground() {
    let (plan, notes) = read("home_on_the_ground.waypoints").plan(&rules(), None).unwrap();
    assert_eq!(plan.items[0].action, Action::Jump { to: 1, times: None });
    assert_eq!(
        notes[..2],
        ["line 5: item number 2 is taken as 3", "line 6: item number 3 is taken as 4"]
    );
    assert!(notes.contains(&"Mission item 0: taken as home and not flown".to_owned()), "{notes:?}");
}

#[test]
fn a_waypoint_before_a_takeoff_is_home_whatever_its_frame() {
    let item = |number: u8, rest: &str| format!("{number}\t0\t3\t{rest}\t1\n").replace(' ', "\t");
    let [home, takeoff] = ["16 0 0 0 0 34.9 -117.9 21.8", "22 15 0 0 0 34.9 -117.89 100"];
    let [before, behind] = ["16 0 0 0 0 34.91 -117.9 21.8", "16 0 0 0 0 34.95 -117.9 600"];
    let file = |lines: &[&str]| {
        let lines: String = (0..).zip(lines).map(|(number, rest)| item(number, rest)).collect();
        PlanFile::read(&format!("QGC WPL 110\n{lines}")).unwrap()
    };
    let found = file(&[home, takeoff, behind]);
    assert_eq!(found.home().map(|(_, altitude_m)| altitude_m), Some(21.8));
    let (plan, notes) = found.plan(&rules(), None).unwrap();
    assert_eq!(plan.items[0].action, Action::Jump { to: 1, times: None });
    assert_eq!(notes, ["Mission item 0: taken as home and not flown"]);
    // Of its altitude nobody knows above what, so absolute ones do not count from it.
    let absolute = item(2, behind).replacen("0\t3", "0\t0", 1);
    let text = format!("QGC WPL 110\n{}{}{absolute}", item(0, home), item(1, takeoff));
    let (plan, _) = PlanFile::read(&text).unwrap().plan(&rules(), None).unwrap();
    assert_eq!(plan.items[2].action.altitude_m(), Some(600.0));
    // Before another waypoint it is one.
    let problems = file(&[before, behind]).plan(&rules(), None).unwrap_err();
    assert!(problems[0].starts_with("item 0: NAV_WAYPOINT (16): altitude"), "{problems:?}");
}

#[test]
fn a_text_may_begin_with_a_home_that_is_not_set() {
    let home = "0\t1\t0\t0\t0\t0\t0\t0\t0\t0\t0\t1";
    let text = waypoints(&[[0.0, 0.0], [0.01, 0.0]]);
    let (before, rest) = text.split_once("0\t1").unwrap();
    let (_, behind) = rest.split_once('\n').unwrap();
    let file = PlanFile::read(&format!("{before}{home}\n{behind}")).unwrap();
    assert_eq!(file.home(), None);
    let (plan, _) = file.plan(&rules(), None).unwrap();
    assert_eq!(plan.items[0].action, Action::Jump { to: 1, times: None });
}

#[test]
fn a_home_may_lack_its_altitude_or_its_place_and_a_file_may_begin_with_its_byte_order() {
    let text = text("takeoff_circle_land.plan");
    let (before, rest) = text.split_once("\"plannedHomePosition\": [").unwrap();
    let (_, behind) = rest.split_once(']').unwrap();
    for (home, altitude_m) in
        [("45.2, 9.1", Some(0.0)), ("45.2, 9.1, null", Some(0.0)), ("null, null, null", None)]
    {
        let file = format!("\u{feff}{before}\"plannedHomePosition\": [{home}]{behind}");
        let file = PlanFile::read(&file).unwrap_or_else(|why| panic!("{home}: {why}"));
        assert_eq!(file.home().map(|(_, altitude_m)| altitude_m), altitude_m, "{home}");
        file.plan(&rules(), None).unwrap();
    }
}

#[test]
fn a_landing_pattern_of_the_first_version_has_a_key_for_each_altitude() {
    let file = r#"{"mission":{"plannedHomePosition":[45.2,9.1,77],"items":[{"type":"ComplexItem",
        "complexItemType":"fwLandingPattern","loiterCoordinate":[45.21,9.1,137],"loiterRadius":75,
        "loiterClockwise":true,"loiterAltitudeRelative":false,"landCoordinate":[45.2,9.1,0],
        "landAltitudeRelative":true}]}}"#;
    let (plan, _) = PlanFile::read(file).unwrap().plan(&rules(), None).unwrap();
    let altitudes = plan.items.iter().map(|item| item.action.altitude_m());
    assert_eq!(altitudes.collect::<Vec<_>>(), [None, Some(60.0), Some(0.0)]);
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
    let text = text("circles_to_altitudes.waypoints");
    for (text, words) in [
        (text.replace("\t31\t", "\tx\t"), "command \"x\" is no whole number"),
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
            "a complex item StructureScan without items cannot be read",
        ),
    ] {
        let refused = PlanFile::read(&text).unwrap_err();
        assert!(refused.contains(words), "{words}: {refused}");
    }
}

/// Waypoints at 100 m above home, this far north and east of it, deg.
fn waypoints(places: &[[f64; 2]]) -> String {
    let line = |(seq, [north, east]): (usize, &[f64; 2])| {
        let (latitude, longitude) = (45.2 + north, 9.1 + east);
        format!("{seq}\t0\t3\t16\t0\t0\t0\t0\t{latitude:.7}\t{longitude:.7}\t100\t1\n")
    };
    let lines: String = (1..).zip(places).map(line).collect();
    format!("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t45.2\t9.1\t77\t1\n{lines}")
}

#[test]
fn corners_that_the_speed_cannot_fly_are_named_once_and_accepted() {
    let notes = |places: &[[f64; 2]], airspeed: Airspeed| {
        let file = PlanFile::read(&waypoints(places)).unwrap();
        let (plan, notes) = file.plan(&rules(), Some(airspeed)).unwrap();
        assert_eq!(plan.items.len(), places.len() + 1);
        notes[1..].to_vec()
    };
    // Right angles with legs of 1100, 110, 1100 and 1100 m.
    let bent =
        [[0.0, 0.0], [0.01, 0.0], [0.01, 0.0014], [0.02, 0.0014], [0.02, 0.0154], [0.03, 0.0154]];
    let found = notes(&bent, Airspeed::True(25.0));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].starts_with("Mission items 2, 3: at 25 m/s the turn needs legs of "),
        "{found:?}"
    );
    assert!(found[0].ends_with(" m, has 110 m and is flown wide"), "{found:?}");
    // The same without the short leg, and straight on.
    let straight = [[0.0, 0.0], [0.01, 0.0], [0.011, 0.0], [0.021, 0.0]];
    for places in [&[bent[0], bent[1], bent[4]][..], &straight] {
        assert_eq!(notes(places, Airspeed::True(25.0)), <[String; 0]>::default());
    }
    let zigzag: Vec<[f64; 2]> =
        (0..20).map(|k: u8| [f64::from(k % 2) * 0.001, f64::from(k) * 0.001]).collect();
    let found = notes(&zigzag, Airspeed::True(25.0));
    assert!(
        found[0].starts_with("Mission items 2, 3, 4, 5, 6, 7, 8, 9 and 10 more: "),
        "{found:?}"
    );
}

#[test]
fn a_glide_too_steep_to_be_flown_is_named_and_accepted() {
    let notes = |north: f64| {
        let text = waypoints(&[[0.02, 0.0], [north, 0.0], [0.0, 0.0]]).replace(
            "\t16\t0\t0\t0\t0\t45.2000000\t9.1000000\t100\t1\n",
            "\t21\t0\t0\t0\t0\t45.2000000\t9.1000000\t0\t1\n",
        );
        let (plan, notes) = PlanFile::read(&text).unwrap().plan(&rules(), None).unwrap();
        assert!(matches!(plan.items[3].action, Action::Land { .. }), "{:?}", plan.items);
        notes[1..].to_vec()
    };
    // 100 m down with 10 deg take 568 m.
    let found = notes(0.005);
    let expected = "Mission item 3: from 100 m above it the glide needs 568 m, has 556 m and leads behind the point";
    assert_eq!(found, [expected]);
    assert_eq!(notes(0.0052), <[String; 0]>::default());
}

#[test]
fn rally_points_above_sea_level_count_from_the_home_of_the_file() {
    let text = text("fence_and_rally.waypoints").replace("7\t0\t3\t5100", "7\t0\t0\t5100");
    let (_, rally) = PlanFile::read(&text).unwrap().fence().unwrap();
    assert!((rally[0].altitude_m - 3.0).abs() < 1.0e-9, "80 m, and home at 77 m: {rally:?}");
}
