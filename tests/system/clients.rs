//! Ground stations of other projects, against the real programs: pymavlink, MAVSDK, MAVProxy, and a
//! stand-in that plays QGroundControl's connect from a table.
//!
//! They need a Python with tests/clients/requirements.txt and MAVProxy; its path is in TWO_STEP_PYTHON.
//! Without it these tests print a note and pass.

use crate::programs;

use std::ffi::OsString;
use std::process::{Command, Output};

use programs::{Program, free_port, program};

/// Output of a script and whether it succeeded; `None` without a Python.
type Ended = Option<(Option<i32>, String)>;

/// The Python to use; prints a note if there is none.
fn python() -> Option<OsString> {
    let python = std::env::var_os("TWO_STEP_PYTHON");
    if python.is_none() {
        eprintln!("skipped: TWO_STEP_PYTHON does not name a Python with the client libraries");
    }
    python
}

fn ended(output: &Output) -> (Option<i32>, String) {
    let printed = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    (output.status.code(), printed)
}

/// Runs a script together with a flying aircraft. `connect` is the form of the address that its library expects.
fn run(script: &str, connect: &str, options: &[&str], arguments: &[&str]) -> Ended {
    let python = python()?;
    let link = format!("127.0.0.1:{}", free_port());
    let gcs = format!("127.0.0.1:{}", free_port());
    let mut all = vec!["--plant-link", &link, "--gcs", &gcs, "--gcs-udp-server", "none"];
    all.extend(["--gcs-tcp", "none", "--parameter-file", "none"]);
    all.extend(options);
    let sitl = Program::start("sitl", &all);
    sitl.wait_for("altitude");
    let path = format!("{}/{script}", env!("CARGO_MANIFEST_DIR"));
    let output = Command::new(python)
        .args([path, "--connect".to_owned(), format!("{connect}{gcs}")])
        .args(arguments)
        .output()
        .expect("TWO_STEP_PYTHON runs");
    Some(ended(&output))
}

/// The script must succeed. Its output is shown with `--nocapture`.
fn holds(ended: Ended) {
    if let Some((code, printed)) = ended {
        println!("{printed}");
        assert_eq!(code, Some(0), "{printed}");
    }
}

/// Runs one of the flight scripts.
fn fly(script: &str, ftc: &str) -> Ended {
    let path = format!("../gcs-scripts/{script}");
    run(&path, "udpin:", &["--speed", "10", "--ftc", ftc], &[])
}

#[test]
fn fly_case1_survives_with_the_compensator() {
    holds(fly("fly_case1.py", "armed"));
}

#[test]
fn fly_case2_survives_with_the_compensator() {
    holds(fly("fly_case2.py", "armed"));
}

#[test]
fn both_cases_are_lost_without_the_compensator() {
    for script in ["fly_case1.py", "fly_case2.py"] {
        if let Some((code, printed)) = fly(script, "off") {
            assert_eq!(code, Some(1), "{printed}");
        }
    }
}

#[test]
fn the_example_drives_the_aircraft_by_mavlink() {
    holds(run("../examples/drive_by_mavlink.py", "udpin:", &["--speed", "5"], &[]));
}

#[test]
fn pymavlink_holds_the_whole_conversation() {
    holds(run("clients/pymavlink_conversation.py", "udpin:", &["--speed", "5"], &[]));
}

#[test]
fn pymavlink_sees_the_estimate_become_less_accurate_without_satellites() {
    let scenario = tempfile::NamedTempFile::with_suffix(".toml").expect("a file");
    let tactical = "[plant]\nseed = 1\n[plant.sensors]\ngrade = \"tactical\"\n";
    std::fs::write(scenario.path(), tactical).expect("it is written");
    let scenario = scenario.path().to_str().expect("a path in UTF-8");
    let options = ["--speed", "5", "--scenario", scenario];
    holds(run("clients/estimator_status.py", "udpin:", &options, &[]));
}

#[test]
fn no_station_is_sent_the_value_of_a_dead_sensor_as_alive() {
    holds(run("clients/dead_sensors.py", "udpin:", &["--speed", "2"], &["--grade", "ideal"]));
    let scenario = tempfile::NamedTempFile::with_suffix(".toml").expect("a file");
    let tactical = "[plant]\nseed = 1\n[plant.sensors]\ngrade = \"tactical\"\n";
    std::fs::write(scenario.path(), tactical).expect("it is written");
    let scenario = scenario.path().to_str().expect("a path in UTF-8");
    let options = ["--speed", "2", "--scenario", scenario];
    holds(run("clients/dead_sensors.py", "udpin:", &options, &["--grade", "tactical"]));
}

#[test]
fn mavsdk_flies_a_mission_and_sees_a_healthy_aircraft() {
    holds(run("clients/mavsdk_flight.py", "udpin://", &["--speed", "5"], &[]));
}

#[test]
fn mavsdk_takes_off_flies_a_mission_inside_a_fence_and_lands() {
    let options = ["--speed", "10", "--scenario", "field", "--airframe", "aerosonde"];
    holds(run("clients/mavsdk_takeoff.py", "udpin://", &options, &[]));
}

#[test]
fn qgroundcontrols_buttons_fly_from_the_ground_and_back() {
    let options = ["--speed", "10", "--scenario", "field", "--airframe", "aerosonde"];
    holds(run("clients/qgc_buttons.py", "udpin:", &options, &[]));
}

#[test]
fn mavsdk_injects_and_clears_faults_and_receives_refusals() {
    holds(run("clients/mavsdk_failure.py", "udpin://", &["--speed", "5"], &[]));
}

#[test]
fn every_fault_on_every_effector_agrees_with_the_truth_in_the_log() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().to_str().expect("a path in UTF-8");
    // Turbulence moves every effector; the test checks the truth of every tick.
    let options =
        ["--log-dir", folder, "--log-rate", "full", "--speed", "10", "--turbulence-m-s", "3"];
    holds(run("clients/every_fault.py", "udpin:", &options, &options[..2]));
}

#[test]
fn a_flight_with_commands_at_random_moments_is_flown_again_to_the_same_hash() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().to_str().expect("a path in UTF-8");
    let sitl = program("sitl");
    let options = ["--log-dir", folder, "--speed", "4"];
    let sitl = sitl.to_str().expect("a path in UTF-8");
    holds(run("clients/replayed.py", "udpin:", &options, &["--log-dir", folder, "--sitl", sitl]));
}

#[test]
fn fmpy_validates_the_fmus_and_flies_them_to_the_same_bits() {
    let Some(python) = python() else { return };
    let test = std::env::current_exe().expect("a test has a path");
    // Built beside the tests, which depend on it.
    let name =
        format!("{}two_step_fmu{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/clients/fmu.py");
    let output = Command::new(python)
        .args([script.as_ref(), "--sitl".as_ref(), program("sitl").as_os_str()])
        .args(["--library".as_ref(), test.with_file_name(name).as_os_str()])
        .output()
        .expect("TWO_STEP_PYTHON runs");
    holds(Some(ended(&output)));
}

#[test]
fn mavproxy_connects_commands_and_loads_a_mission() {
    holds(run("clients/mavproxy_session.py", "udpin:", &[], &[]));
}

#[test]
fn qgroundcontrols_connect_is_answered_step_by_step() {
    holds(run("clients/qgc_connect.py", "udpin:", &[], &[]));
}

#[test]
fn the_shell_answers_pymavlink_and_mavsdk() {
    holds(run("clients/shell_session.py", "udpin:", &[], &[]));
}

#[test]
fn logs_are_fetched_byte_for_byte_and_the_traffic_log_is_read_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().to_str().expect("a path in UTF-8");
    let options = ["--log-dir", folder];
    holds(run("clients/log_download.py", "udpin:", &options, &options));
}

#[test]
fn scripts_are_uploaded_started_and_stopped_by_mavsdk_pymavlink_mavproxy_and_the_shell() {
    holds(run("clients/script_upload.py", "udpin:", &["--speed", "2"], &[]));
}

#[test]
fn traffic_has_no_malformed_or_unexpected_message() {
    holds(run("clients/traffic.py", "udpin:", &[], &["--seconds", "15"]));
}

#[test]
fn signing_with_pymavlink_and_mavproxy_keeps_out_stations_without_a_key() {
    let Some(python) = python() else { return };
    let port = free_port().to_string();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/clients/signing.py");
    let output = Command::new(python)
        .args([script, "--port", &port, "--autopilot"])
        .arg(program("autopilot"))
        .output()
        .expect("TWO_STEP_PYTHON runs");
    holds(Some(ended(&output)));
}
