//! The two laws that docs/own-law.md goes through: one in Rust, one in Python.

use std::io::{BufRead as _, BufReader, Read as _};
use std::net::UdpSocket;
use std::process::{Child, ChildStdout, Command, Stdio};

use autopilot::config;
use flight_control::{
    CompensatorMode, Demand, FlightControl, Gains, GroundDemand, MainLaw, Navigator,
};
use icd::ControlPeriod;
use icd::wire::VERSION;
use plant_sim::{Airframe, Plant, ReadAirframe as _, Scenario};

#[path = "../../../examples/own_law.rs"]
#[allow(dead_code, reason = "its main is started by cargo run")]
mod example;

/// Altitude error and roll angle, m and rad, after 60 s of a scenario that asks for 100 m more.
fn fly(name: &str, text: &str, compensator: CompensatorMode) -> (f64, f64) {
    let scenario =
        Scenario::from_toml(name, text, &Airframe::paper().effectors).expect("a shipped scenario");
    let setup = scenario.plant.setup(Airframe::paper(), 0, ControlPeriod::DEFAULT, 1_000);
    let model =
        config::aircraft_model("tvc_jet.toml", aircraft::DEFAULT_MODEL).expect("the shipped model");
    let mut gains = Gains::REFERENCE;
    gains.selection.main = MainLaw::Own;
    gains.selection.compensator = compensator;
    let mut plant = Plant::new(&setup).expect("the shipped aircraft");
    let mut flight = FlightControl::new(setup.period, &model, &gains);
    flight.start_at(&plant.trim().positions());
    let mut navigator = Navigator::default();
    let demand = Demand { altitude_m: 5_100.0, roll_rad: 0.0, airspeed_m_s: 264.0 };
    let mut law = example::MyLaw::default();
    for _ in 0..30_000 {
        let state = navigator.step(plant.time(), &plant.sense());
        let log = flight.step_with(&state, &demand, &GroundDemand::STAND, Some(&mut law));
        assert!(!log.health.implausible_command);
        plant.advance(&log.actuators());
    }
    let truth = plant.truth();
    (truth.altitude_m - demand.altitude_m, truth.euler().phi)
}

#[test]
fn the_law_of_the_example_climbs_and_with_the_compensator_survives_a_jammed_elevator() {
    let (altitude_m, roll_rad) = fly("nominal.toml", scenarios::NOMINAL, CompensatorMode::Armed);
    assert!(altitude_m.abs() < 5.0 && roll_rad.abs() < 0.01, "{altitude_m} m, {roll_rad} rad");
    let (altitude_m, roll_rad) = fly("case1.toml", scenarios::CASE1, CompensatorMode::Armed);
    assert!(altitude_m.abs() < 50.0 && roll_rad.abs() < 0.2, "{altitude_m} m, {roll_rad} rad");
    let (altitude_m, _) = fly("case1.toml", scenarios::CASE1, CompensatorMode::Off);
    assert!(altitude_m < -500.0, "without the compensator it is lost: {altitude_m} m");
}

/// Ends its process when it goes.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        // It has ended already, or it ends now.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The script of the page and the address at which it listens.
fn python_law(options: &[&str]) -> (Process, BufReader<ChildStdout>, String) {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../gcs-scripts/own_law.py");
    let child = Command::new("python3")
        .args([script, "--listen", "127.0.0.1:0"])
        .args(options)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("python3, for the scripts of gcs-scripts");
    let mut law = Process(child);
    let mut said = BufReader::new(law.0.stdout.take().expect("piped"));
    let mut line = String::new();
    said.read_line(&mut line).expect("text");
    let address = line.trim().rsplit(' ').next().expect("a word").to_owned();
    (law, said, address)
}

/// The frame of a packet of samples around a body.
fn framed(body: &[u8]) -> Vec<u8> {
    let mut packet = b"2STP".to_vec();
    packet.extend(VERSION.to_le_bytes());
    packet.extend([1, 0]);
    packet.extend([0; 24]);
    packet.extend(body);
    packet.extend(crc32fast::hash(&packet).to_le_bytes());
    packet
}

#[test]
fn packets_that_are_no_samples_do_not_end_the_python_law() {
    let (mut law, _, address) = python_law(&[]);
    let aircraft = b"\x07tvc_jet\x08\0\0\0\0";
    let times = [0; 4 + 9 * 9];
    let of = |value: f64| [&aircraft[..], &times[..], &value.to_le_bytes().repeat(30)].concat();
    let foreign =
        [b"\x03f16\x05\0\0\0\0".as_slice(), &times, &0.5_f64.to_le_bytes().repeat(30)].concat();
    let bodies = [vec![], vec![0xff], aircraft.to_vec(), of(f64::NAN), foreign, of(1.0e300)];
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut errors = BufReader::new(law.0.stderr.take().unwrap());
    // No two in a row get the same line, which the law would not repeat.
    for body in bodies {
        let packet = framed(&body);
        socket.send_to(&packet, &address).unwrap();
        let mut line = String::new();
        errors.read_line(&mut line).unwrap();
        assert!(line.starts_with(&format!("ignored: {} bytes", packet.len())), "{line}");
    }
    assert!(law.0.try_wait().unwrap().is_none(), "it goes on");
}

#[test]
fn the_python_law_ends_after_a_flight_and_says_so_where_there_is_none() {
    let (mut alone, ..) = python_law(&["--wait-s", "0.5"]);
    let (_law, mut said, address) = python_law(&[]);
    let plant = Command::new(env!("CARGO_BIN_EXE_sitl"))
        .args(["plant-sim", "--autopilot", &address, "--speed", "max", "--until-s", "2"])
        .output()
        .unwrap();
    assert!(plant.status.success());
    let mut line = String::new();
    said.read_line(&mut line).unwrap();
    assert!(line.starts_with("2.0 s: altitude 5000."), "{line}");
    let mut message = String::new();
    alone.0.stderr.take().unwrap().read_to_string(&mut message).unwrap();
    assert!(message.starts_with("no plant has spoken to 127.0.0.1:"), "{message}");
    assert_eq!(alone.0.wait().unwrap().code(), Some(1));
}

#[test]
fn the_python_law_flies_the_plant_over_the_link() {
    let (_law, mut said, address) = python_law(&["--altitude", "5100", "--for-s", "60"]);
    let plant = Command::new(env!("CARGO_BIN_EXE_sitl"))
        .args(["plant-sim", "--autopilot", &address, "--speed", "max"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let _plant = Process(plant);
    let mut rest = String::new();
    said.read_to_string(&mut rest).unwrap();
    // 60.0 s: altitude 5100.9 m, airspeed 264.0 m/s
    let words: Vec<&str> = rest.split_whitespace().collect();
    let number = |after: &str| {
        let at = words.iter().position(|word| *word == after).unwrap_or_else(|| panic!("{rest}"));
        words[at + 1].parse::<f64>().unwrap()
    };
    assert_eq!(words[0], "60.0", "{rest}");
    assert!((number("altitude") - 5_100.0).abs() < 5.0, "{rest}");
    assert!((number("airspeed") - 264.0).abs() < 1.0, "{rest}");
}

#[test]
fn a_script_without_its_package_says_what_is_missing() {
    let folder = tempfile::tempdir().expect("a folder");
    for package in ["ray", "pymavlink"] {
        std::fs::write(folder.path().join(format!("{package}.py")), "raise ImportError").unwrap();
    }
    let program = env!("CARGO_BIN_EXE_sitl");
    for (script, package) in [
        ("campaign_ray.py", "ray"),
        ("break_elevator.py", "pymavlink"),
        ("fly_case1.py", "pymavlink"),
    ] {
        let script = format!("{}/../gcs-scripts/{script}", env!("CARGO_MANIFEST_DIR"));
        let mut command = Command::new("python3");
        command.env("PYTHONPATH", folder.path()).arg(script);
        if package == "ray" {
            command.args(["smoke", "--shards", "2", "--program", program, "--out"]);
            command.arg(folder.path().join("out"));
        }
        let done = command.output().unwrap();
        let errors = String::from_utf8_lossy(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{errors}");
        let is_clear = errors.contains(&format!("pip install {package}"));
        assert!(is_clear && !errors.contains("Traceback"), "{errors}");
    }
}
