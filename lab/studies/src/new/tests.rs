use super::*;
use aircraft::{AEROSONDE_AIRFRAME, MODELS};

fn shipped(name: &str) -> Airframe {
    let text = AIRFRAMES.iter().find(|(known, _)| *known == name).unwrap().1;
    Airframe::from_toml(name, text).unwrap()
}

/// A new aircraft: the Aerosonde with a canard in place of the tail's elevators, and without a rudder.
fn duck() -> String {
    let parts: Vec<&str> = AEROSONDE_AIRFRAME.split("[[effector]]\n").collect();
    let gone = ["name = \"right elevator\"", "name = \"rudder\""];
    let kept = |part: &&&str| !gone.iter().any(|name| part.starts_with(name));
    let text = parts.iter().filter(kept).copied().collect::<Vec<_>>().join("[[effector]]\n");
    text.replace("name = \"aerosonde\"", "name = \"duck\"")
        .replace(
            "name = \"left elevator\"\nkind = \"elevator\"\nside = \"left\"\npartner = \"right elevator\"",
            "name = \"canard\"\nkind = \"canard\"",
        )
        .replace("gains = { pitch = 1.0 }", "gains = { pitch = -1.0 }")
        .replace("c_pitch = -0.495", "c_pitch = 0.99")
        .replace("c_roll = 0.0045", "c_roll = 0.0")
}

#[test]
fn an_unknown_aircraft_without_a_rudder_flies_with_every_law_and_has_nothing_of_the_jet() {
    let made = New::make(Airframe::from_toml("duck.toml", &duck()).unwrap(), &[]).unwrap();
    for law in ["pid", "ndi", "lqr"] {
        assert!(made.report.contains(&format!("| {law} | kept | ")), "{}", made.report);
    }
    assert_eq!(made.weak, [""; 0], "{}", made.report);
    let model = config::model("duck", &made.text).unwrap();
    for (law, _) in LAWS {
        let mut parameters = model.defaults;
        parameters.gains.selection.main = law;
        assert_eq!(config::inherited(&model.aircraft, &parameters), None);
    }
}

#[test]
fn a_condition_takes_the_place_of_the_design_point_and_several_make_a_schedule() {
    let made = |conditions: &[&str]| {
        let conditions: Vec<Condition> =
            conditions.iter().map(|text| text.parse().unwrap()).collect();
        New::make(shipped("aerosonde_vtail"), &conditions).unwrap()
    };
    let aircraft = |made: &New| config::model("model.toml", &made.text).unwrap().aircraft;
    let fast = made(&["500,28"]);
    assert!(fast.report.contains("design point 28 m/s"), "{}", fast.report);
    assert_eq!(fast.weak, [""; 0], "{}", fast.report);
    assert_eq!(aircraft(&fast).trim.airspeed_m_s, 28.0);
    assert!(aircraft(&fast).schedule.is_empty());
    let scheduled = made(&["200,22", "200,28"]);
    assert_eq!(aircraft(&scheduled).schedule.points().count(), 2);
}

#[test]
fn wheels_that_nothing_steers_are_weak() {
    // A skid that rolls.
    let text =
        duck().replacen("[[gear.contact]]\n", "[[gear.contact]]\nrolling_friction = 0.02\n", 1);
    let made = New::make(Airframe::from_toml("duck.toml", &text).unwrap(), &[]).unwrap();
    assert!(matches!(&made.weak[..], [only] if only.contains("nothing steers")), "{:?}", made.weak);
}

#[test]
fn the_shipped_models_of_small_aircraft_are_what_the_procedure_finds() {
    for name in ["aerosonde_vtail", "skywalker_x8"] {
        let made = New::make(shipped(name), &[]).unwrap();
        assert_eq!(made.weak, [""; 0], "{}", made.report);
        let text = MODELS.iter().find(|(known, _)| *known == name).unwrap().1;
        assert!(
            made.text == text,
            "sitl aircraft new --airframe {name} --out DIR, then copy its model to aircraft/{name}/model.toml"
        );
    }
}

#[test]
fn an_aircraft_that_lacks_an_effector_is_refused_with_its_name() {
    let refused = |text: &str| {
        let airframe = Airframe::from_toml("lame.toml", text).unwrap();
        New::make(airframe, &[]).unwrap_err().to_string()
    };
    let no_pitch = refused(&duck().replace("gains = { pitch = -1.0 }", "gains = {}"));
    assert!(no_pitch.contains("no effector pitches"), "{no_pitch}");
    let no_roll =
        duck().replace("gains = { roll = -1.0 }", "").replace("gains = { roll = 1.0 }", "");
    let no_roll = refused(&no_roll);
    assert!(no_roll.contains("no effector rolls"), "{no_roll}");
}
