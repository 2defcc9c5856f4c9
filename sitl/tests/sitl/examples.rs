//! The examples of `examples/`, as a reader runs them; the law and MAVLink have tests of their own (`own_law`, `clients`).

use std::fs;
use std::path::Path;
use std::process::Command;

#[path = "../../../examples/embed_loop.rs"]
mod embed_loop;
#[path = "../../../examples/read_log.rs"]
#[allow(dead_code, reason = "its main reads the command line")]
mod read_log;

const SITL: &str = env!("CARGO_BIN_EXE_sitl");

#[test]
fn the_loop_in_another_program_flies_and_goes_on_from_a_copy() {
    embed_loop::main().unwrap();
}

#[test]
fn a_log_is_read_with_the_crate_alone() {
    let out = tempfile::tempdir().unwrap();
    let short = ["fly", "case1", "--set", "plant.duration_s=6", "--ulog", "--out"];
    let flown = Command::new(SITL).args(short).arg(out.path()).output().unwrap();
    assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    let text = read_log::summary(&out.path().join("flight.ulg")).unwrap();
    assert!(text.contains("left elevator stuck at 30.0 deg"), "{text}");
    let largest = text.lines().find_map(|line| line.strip_prefix("z2_roll_rad_s2")).unwrap();
    let value: f64 = largest.split_whitespace().next().unwrap().parse().unwrap();
    assert!(value.abs() > 1.0, "the jam rolls the aircraft: {largest}");
}

#[test]
fn an_aircraft_of_a_user_goes_from_its_file_to_its_first_flights() {
    let out = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut script = Command::new("sh");
    script.current_dir(root).arg("examples/own_aircraft.sh").arg(out.path()).arg(SITL);
    let ended = script.output().unwrap();
    let text = String::from_utf8_lossy(&ended.stdout) + String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success(), "{text}");
    for flight in ["healthy", "jammed"] {
        let outcome = fs::read_to_string(out.path().join(flight).join("outcome.json")).unwrap();
        assert!(outcome.contains("\"outcome\": \"kept\""), "{flight}: {outcome}");
    }
}
