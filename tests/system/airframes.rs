//! Each shipped aircraft, flown from its files with the real binary.

use crate::programs;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use programs::program;

/// Flight conditions of the F-16: altitude, m, and airspeed, m/s, all below Mach 0.6, where its tables are valid.
const F16_CONDITIONS: [[f64; 2]; 3] = [[1_500.0, 150.0], [4_000.0, 180.0], [8_000.0, 175.0]];

/// Condition at which the shipped model of the F-16 is linearised.
const F16_POINTS: [&str; 7] =
    ["3000,100", "3000,115", "3000,135", "3000,160", "3000,190", "3000,220", "3000,260"];

fn sitl(words: &[&str]) -> Output {
    Command::new(program("sitl")).args(words).output().expect("the built program starts")
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Airframe and model file of an aircraft.
fn files(name: &str) -> [String; 2] {
    ["airframe.toml", "model.toml"]
        .map(|file| root().join("aircraft").join(name).join(file).display().to_string())
}

/// Exit status and measures of a flight at a condition with these lines after `[plant.start]`.
fn fly(
    name: &str,
    at: [f64; 2],
    lines: &str,
    options: &[&str],
) -> (Option<i32>, serde_json::Value) {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let scenario = folder.path().join("scenario.toml");
    let [altitude_m, airspeed_m_s] = at;
    let text = format!(
        "[plant]\nseed = 1\nearth = \"flat\"\nduration_s = 120.0\n[plant.start]\naltitude_m = {altitude_m:?}\n\
         airspeed_m_s = {airspeed_m_s:?}\n{lines}"
    );
    fs::write(&scenario, text).expect("a free path");
    let (scenario, out) = (scenario.display().to_string(), folder.path().join("out"));
    let [airframe, model] = files(name);
    let out_text = out.display().to_string();
    let words = ["fly", &scenario, "--airframe", &airframe, "--model", &model, "--out", &out_text];
    let output = sitl(&[&words[..], options].concat());
    let json = fs::read(out.join("outcome.json"))
        .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)));
    (output.status.code(), serde_json::from_slice(&json).expect("it is JSON"))
}

fn metric(outcome: &serde_json::Value, name: &str) -> f64 {
    outcome["metrics"][name]["value"].as_f64().unwrap_or_else(|| panic!("no {name}"))
}

/// A bank of 30 degrees there and back, 10 m/s more, 100 m higher.
fn steps([altitude_m, airspeed_m_s]: [f64; 2]) -> String {
    let (higher, faster) = (altitude_m + 100.0, airspeed_m_s + 10.0);
    format!(
        "[[autopilot.reference]]\nat_s = 2.0\nroll_deg = 30.0\n[[autopilot.reference]]\nat_s = 20.0\nroll_deg = 0.0\n\
         airspeed_m_s = {faster:?}\n[[autopilot.reference]]\nat_s = 35.0\naltitude_m = {higher:?}\n"
    )
}

#[test]
fn the_shipped_model_of_the_f16_is_its_airframe_linearised() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let [airframe, model] = files("f16");
    let shipped = fs::read_to_string(&model).expect("the shipped model");
    let again = folder.path().join("f16.toml");
    // Its table of parameters stays.
    fs::write(&again, &shipped).expect("a free path");
    let path = again.display().to_string();
    let mut words = vec!["linearize", "--airframe", &airframe, "--out", &path];
    words.extend(F16_POINTS.into_iter().flat_map(|point| ["--at", point]));
    let output = sitl(&words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(fs::read_to_string(&again).expect("it was written"), shipped);
}

#[test]
fn the_healthy_f16_follows_roll_airspeed_and_altitude_at_three_flight_conditions_with_each_law() {
    for at in F16_CONDITIONS {
        // The integrator of the PID takes long to recover from a step.
        for (law, altitude_m) in [("pid", 20.0), ("ndi", 2.0), ("lqr", 5.0)] {
            let (status, outcome) = fly("f16", at, &steps(at), &["--law", law]);
            assert_eq!(status, Some(0), "{law} at {at:?}: {outcome}");
            let off = |name: &str| metric(&outcome, &format!("steady_offset_{name}")).abs();
            assert!(off("altitude") < altitude_m, "{law} at {at:?}: {} m", off("altitude"));
            assert!(off("roll") < 0.005, "{law} at {at:?}: {} rad", off("roll"));
            assert!(off("airspeed") < 0.5, "{law} at {at:?}: {} m/s", off("airspeed"));
            assert_eq!(metric(&outcome, "false_alarms"), 0.0, "{law} at {at:?}");
        }
    }
}

#[test]
fn an_f16_with_its_left_elevator_jammed_is_kept_level_by_the_compensator() {
    let jam = "[[plant.fault]]\neffector = \"left_elevator\"\nkind = \"stuck_at\"\nangle_deg = -12.5\nonset_s = 1.0\n";
    for at in F16_CONDITIONS {
        let (status, armed) = fly("f16", at, jam, &["--ftc", "armed"]);
        assert_eq!(status, Some(0), "{at:?}: {armed}");
        let roll = metric(&armed, "steady_offset_roll").abs();
        assert!(roll < 0.01, "{roll} rad at {at:?}");
        let (_, off) = fly("f16", at, jam, &["--ftc", "off"]);
        let without = metric(&off, "roll_rmse");
        assert!(
            without > 5.0 * metric(&armed, "roll_rmse"),
            "{without} rad without the compensator"
        );
    }
}

#[test]
fn a_flight_condition_that_cannot_be_trimmed_is_refused_with_what_is_at_its_limit() {
    let [airframe, _] = files("f16");
    for (at, expected) in [
        (
            "3000,60",
            "at 60 m/s and 3000 m needs more than the aircraft has: [limits] angle_of_attack_deg",
        ),
        ("3000", "expected ALTITUDE_M,AIRSPEED_M_S"),
    ] {
        let output =
            sitl(&["linearize", "--airframe", &airframe, "--at", at, "--out", "/nowhere/f16.toml"]);
        let printed = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && printed.contains(expected), "{printed}");
    }
}

#[test]
fn without_a_place_only_the_model_of_the_default_aircraft_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = folder.path().join("aircraft/tvc_jet/model.toml");
    fs::create_dir_all(model.parent().expect("two folders")).expect("a free path");
    let [_, shipped] = files("tvc_jet");
    fs::copy(&shipped, &model).expect("a free path");
    let linearize = |words: &[&str]| {
        let mut command = Command::new(program("sitl"));
        command.current_dir(folder.path()).arg("linearize").args(words);
        command.output().expect("the built program starts")
    };
    for words in [["--airframe", "f16"], ["--at", "3000,200"]] {
        let output = linearize(&words);
        let printed = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && printed.contains("--out FILE is needed"), "{printed}");
    }
    assert!(linearize(&[]).status.success());
    assert_eq!(fs::read(&model).expect("it is there"), fs::read(&shipped).expect("it is shipped"));
}

#[test]
fn the_table_of_jams_has_a_row_for_each_surface_and_each_part_of_its_travel() {
    let [airframe, model] = files("aerosonde");
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().display().to_string();
    let own = ["--airframe", &airframe, "--model", &model, "--out", &out];
    let short = ["--set", "plant.duration_s=12"];
    let output = sitl(&[&["study", "jam-table"][..], &own, &short].concat());
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let rows = |name: &str| table.lines().filter(|line| line.contains(name)).count();
    assert_eq!(rows("_elevator |") + rows("_aileron |"), 4 * 6, "{table}");
    assert_eq!(rows("| rudder |"), 6, "{table}");
    // Kept, so it has a roll angle and an altitude; the jam is at the end of the travel.
    assert!(table.contains("| left_aileron | -25 | - | "), "{table}");
}
