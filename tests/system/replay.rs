//! Flights of real processes, with a ground station that sends at arbitrary times, replayed from their logs.

use crate::ground;
use crate::programs;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use ground::Ground;
use mavlink::dialects::common::{
    MANUAL_CONTROL_DATA, MavCmd, MavMessage, MavMissionResult, MavParamType, MavResult,
    PARAM_SET_DATA, SET_ATTITUDE_TARGET_DATA,
};
use programs::{Program, autopilot, program};
use ulog::reader::Log;

/// The only log of a folder.
fn log(folder: &Path) -> PathBuf {
    let entries = fs::read_dir(folder).expect("the folder of the logs");
    let mut paths = entries.map(|entry| entry.expect("a folder that can be read").path());
    paths.find(|path| path.extension().is_some_and(|e| e == "ulg")).expect("a log")
}

/// Exit code of `sitl` with these arguments, and its output.
fn sitl(words: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(program("sitl")).args(words).output().expect("a built program");
    let printed = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8_lossy(&printed).into_owned())
}

fn replay(log: &Path) -> (Option<i32>, String) {
    sitl(&["replay", log.to_str().expect("a readable path")])
}

/// Random numbers (splitmix64). The seed is wall time on purpose: each run is different.
struct Dice(u64);

impl Dice {
    fn new() -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970");
        Self(u64::try_from(now.as_nanos() & u128::from(u64::MAX)).expect("64 bits"))
    }

    fn roll(&mut self, sides: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) % sides
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.roll(10_001) as f32 / 10_000.0
    }
}

/// A random action of an operator.
fn do_something(ground: &mut Ground, dice: &mut Dice) {
    let zero = [0.0; 7];
    match dice.roll(8) {
        0 => {
            let p = [dice.between(4_000.0, 6_000.0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            ground.command(MavCmd::MAV_CMD_DO_CHANGE_ALTITUDE, p);
        }
        1 => {
            let p = [0.0, dice.between(220.0, 290.0), -1.0, 0.0, 0.0, 0.0, 0.0];
            ground.command(MavCmd::MAV_CMD_DO_CHANGE_SPEED, p);
        }
        2 => {
            // SERVO, STUCK, any surface, an angle, at once.
            let surface = 1.0 + dice.roll(5) as f32;
            let p = [102.0, 2.0, surface, 1.0, dice.between(-8.0, 8.0), 0.0, 0.0];
            ground.command(MavCmd::MAV_CMD_USER_1, p);
        }
        3 => {
            // Clears the faults of all servos.
            let p = [102.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            ground.command(MavCmd::MAV_CMD_INJECT_FAILURE, p);
        }
        4 => ground.send(&MavMessage::PARAM_SET(PARAM_SET_DATA {
            param_value: dice.between(35.0, 45.0),
            target_system: 1,
            target_component: 1,
            param_id: "OBS_W0".into(),
            param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
        })),
        5 => {
            ground.command(MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH, zero);
        }
        6 => {
            ground.command(MavCmd::MAV_CMD_DO_PAUSE_CONTINUE, zero);
        }
        _ => {
            // The simulation pauses, commands arrive meanwhile, and time runs again.
            ground.command(MavCmd::MAV_CMD_USER_2, zero);
            let jam = [102.0, 2.0, 3.0, 1.0, dice.between(-8.0, 8.0), 0.0, 0.0];
            ground.command(MavCmd::MAV_CMD_USER_1, jam);
            let p = [dice.between(4_000.0, 6_000.0), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            ground.command(MavCmd::MAV_CMD_DO_CHANGE_ALTITUDE, p);
            ground.command(MavCmd::MAV_CMD_USER_2, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        }
    }
}

#[test]
fn a_flight_with_inputs_at_any_moment_is_flown_again_bit_for_bit() {
    let mut dice = Dice::new();
    let seed = dice.0;
    let folder = tempfile::tempdir().expect("a folder for the test");
    let text = folder.path().to_str().expect("a readable path");
    let mut ground = Ground::new();
    let (mut autopilot, link) = autopilot(ground.address(), &["--log-dir", text]);
    let noise = ["--gyro-noise-deg-s", "0.1", "--turbulence-m-s", "1.5"];
    let plant = Program::start("plant-sim", &[&["--autopilot", &link][..], &noise].concat());
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.2);
    for _ in 0..25 {
        do_something(&mut ground, &mut dice);
        ground.listen_for(Duration::from_micros(dice.roll(200_000)));
    }
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    drop(plant);
    let path = log(folder.path());
    let (code, printed) = replay(&path);
    assert_eq!(code, Some(0), "dice {seed}: {printed}");
    let hash = Log::open(&path).expect("readable").info_text("run_hash").map(str::to_owned);
    assert!(printed.contains(&format!("same run hash {}", hash.expect("a footer"))), "{printed}");

    // The page of the same flight.
    let page = folder.path().join("page.html");
    let words =
        ["plot", path.to_str().expect("readable"), "--out", page.to_str().expect("readable")];
    let (code, printed) = sitl(&words);
    assert_eq!(code, Some(0), "{printed}");
    let page = fs::read_to_string(page).expect("a page");
    assert!(page.contains("The log is complete.") && !page.contains("Not in this log"));
}

#[test]
fn a_log_that_was_tampered_with_gives_the_first_tick_and_signal() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let text = folder.path().to_str().expect("a readable path");
    let mut ground = Ground::new();
    let (mut autopilot, link) = autopilot(ground.address(), &["--log-dir", text]);
    let noise = ["--gyro-noise-deg-s", "0.1"];
    let plant = Program::start("plant-sim", &[&["--autopilot", &link][..], &noise].concat());
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    let jam = [102.0, 2.0, 3.0, 1.0, 7.0, 0.0, 0.0];
    ground.command(MavCmd::MAV_CMD_USER_1, jam);
    ground.listen_until("a second more", |ground| ground.time_s > 1.5);
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    drop(plant);
    let path = log(folder.path());
    let bytes = fs::read(&path).expect("a log");

    // One bit of one gyro value; its noise makes it unique.
    let log = Log::open(&path).expect("readable");
    let rates = log.column("sensors", "body_rate_q_rad_s").expect("a topic");
    let (row, times) = (rates.len() / 2, log.times_us("sensors").expect("a topic"));
    let (value, step) = (rates[row], times[row] / 2_000);
    let place = bytes.windows(8).position(|w| w == value.to_le_bytes()).expect("it is there");
    let mut changed = bytes.clone();
    changed[place] ^= 1;
    fs::write(&path, changed).expect("the folder is there");
    let (code, printed) = replay(&path);
    assert_eq!(code, Some(1), "{printed}");
    assert!(printed.contains(&format!("control step {step} (t = ")), "{printed}");
    assert!(printed.contains("sensors.body_rate_q_rad_s"), "{printed}");

    // Another target in the input.
    let from = br#""target":2"#;
    let place = bytes.windows(from.len()).position(|w| w == from).expect("the fault is there");
    let mut changed = bytes;
    changed[place..place + from.len()].copy_from_slice(br#""target":0"#);
    fs::write(&path, changed).expect("the folder is there");
    let (code, printed) = replay(&path);
    assert_eq!(code, Some(1), "{printed}");
    assert!(printed.contains("request to the plant"), "{printed}");
}

#[test]
fn a_killed_recording_is_flown_again_up_to_its_cut_and_drawn() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let text = folder.path().to_str().expect("a readable path");
    let mut ground = Ground::new();
    let (mut autopilot, link) = autopilot(ground.address(), &["--log-dir", text]);
    let _plant = Program::start("plant-sim", &["--autopilot", &link, "--turbulence-m-s", "1.5"]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 1.0);
    ground.command(MavCmd::MAV_CMD_USER_1, [102.0, 2.0, 3.0, 1.0, 7.0, 0.0, 0.0]);
    ground.listen_until("a second more", |ground| ground.time_s > 2.5);
    autopilot.signal(9);
    autopilot.end();
    let path = log(folder.path());
    let (code, printed) = replay(&path);
    assert_eq!(code, Some(0), "{printed}");
    assert!(printed.contains("it was cut off before its run hash"), "{printed}");
    let (code, printed) = sitl(&["plot", path.to_str().expect("a readable path")]);
    assert_eq!(code, Some(0), "{printed}");
    let page = fs::read_to_string(path.with_extension("html")).expect("a page");
    assert!(page.contains("The log was cut off"));
}

/// The logs of a folder, oldest first.
fn logs(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("the folder of the logs");
    let paths = entries.map(|entry| entry.expect("a folder that can be read").path());
    let mut logs: Vec<_> =
        paths.filter(|path| path.extension().is_some_and(|e| e == "ulg")).collect();
    logs.sort_by_key(|path| fs::metadata(path).and_then(|meta| meta.modified()).ok());
    logs
}

/// An autopilot that records into the folder, and a plant with noise; `options` are those of the plant.
fn flight(folder: &Path, options: &[&str]) -> (Ground, Program, Program) {
    let mut ground = Ground::new();
    let text = folder.to_str().expect("a readable path");
    let (autopilot, link) = autopilot(ground.address(), &["--log-dir", text]);
    let noise = ["--autopilot", &link, "--gyro-noise-deg-s", "0.1", "--turbulence-m-s", "1.5"];
    let plant = Program::start("plant-sim", &[&noise, options].concat());
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.2);
    (ground, autopilot, plant)
}

/// Ends the autopilot; each of its logs replays to the same flight and ends as expected.
fn all_again(folder: &Path, mut autopilot: Program, ends: &[&str]) {
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    let logs = logs(folder);
    assert_eq!(logs.len(), ends.len(), "{logs:?}");
    for (path, end) in logs.iter().zip(ends) {
        assert_eq!(Log::open(path).expect("readable").info_text("end"), Some(*end));
        let (code, printed) = replay(path);
        assert_eq!(code, Some(0), "{printed}");
        assert!(printed.contains("same run hash"), "{printed}");
    }
}

/// The recorded inputs of the only or last flight, as JSON.
fn recorded(folder: &Path) -> String {
    let log = Log::open(logs(folder).last().expect("a log")).expect("readable");
    let topic = log.topic("recorded").expect("a topic");
    let mut json = String::new();
    for row in topic.rows() {
        let length = row.unsigned("length").and_then(|length| usize::try_from(length).ok());
        let bytes = row.bytes("text").expect("a column");
        json.push_str(&String::from_utf8_lossy(&bytes[..length.expect("a column")]));
    }
    json
}

const ZERO: [f32; 7] = [0.0; 7];

#[test]
fn a_plan_that_was_uploaded_is_flown_again_and_so_is_the_flight_after_a_restart_that_still_has_it()
{
    let folder = tempfile::tempdir().expect("a folder for the test");
    let (mut ground, autopilot, _plant) = flight(folder.path(), &["--speed", "5"]);
    ground.listen_until("a place", |ground| ground.place_e7 != [0; 2]);
    let [lat, lon] = ground.place_e7;
    // About 2.2 km to the north, and then to the east.
    let plan = [(lat + 200_000, lon, 5_000.0), (lat + 250_000, lon + 250_000, 5_050.0)];
    assert_eq!(ground.upload(&plan), MavMissionResult::MAV_MISSION_ACCEPTED);
    ground.command(MavCmd::MAV_CMD_MISSION_START, ZERO);
    ground.listen_until("the end of the plan", |ground| ground.has_text("Mission complete"));
    ground.texts.clear();
    let reboot = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    ground.command(MavCmd::MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, reboot);
    ground.listen_until("the next flight", |ground| ground.has_text("Flight began"));
    ground.command(MavCmd::MAV_CMD_MISSION_START, ZERO);
    ground.listen_until("the plan of the flight before", |ground| ground.has_text("Mode Mission"));
    let start_s = ground.time_s;
    ground.listen_until("some of it", |ground| ground.time_s > start_s + 3.0);
    all_again(folder.path(), autopilot, &["restart", "stopped"]);
    let recorded = recorded(folder.path());
    assert!(recorded.contains("\"command\":{\"Plan\":"), "{recorded}");
}

#[test]
fn a_silence_of_the_plant_is_flown_again() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let (mut ground, autopilot, plant) = flight(folder.path(), &[]);
    ground.command(MavCmd::MAV_CMD_USER_1, [102.0, 2.0, 3.0, 1.0, 7.0, 0.0, 0.0]);
    plant.signal(19);
    ground.listen_until("a silent plant", |ground| ground.has_text("Plant link lost"));
    // Commands without a flight.
    let climb = [5_100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    ground.send_command(MavCmd::MAV_CMD_DO_CHANGE_ALTITUDE, climb);
    ground.send_command(MavCmd::MAV_CMD_USER_1, [102.0, 2.0, 1.0, 1.0, 5.0, 0.0, 0.0]);
    ground.listen_for(Duration::from_secs(1));
    plant.signal(18);
    ground.listen_until("a plant again", |ground| ground.has_text("Plant link is back"));
    ground.command(MavCmd::MAV_CMD_USER_1, [102.0, 2.0, 2.0, 1.0, -4.0, 0.0, 0.0]);
    let back_s = ground.time_s;
    ground.listen_until("a second more", |ground| ground.time_s > back_s + 1.0);
    all_again(folder.path(), autopilot, &["stopped"]);
    let recorded = recorded(folder.path());
    assert!(recorded.contains("PlantLost") && recorded.contains("PlantBack"), "{recorded}");
}

#[test]
fn a_plant_that_died_ends_its_log_and_the_next_one_begins_another() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let mut ground = Ground::new();
    let text = folder.path().to_str().expect("a readable path");
    let (autopilot, link) = autopilot(ground.address(), &["--log-dir", text]);
    let plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    plant.signal(9);
    ground.listen_until("a silent plant", |ground| ground.has_text("Plant link lost"));
    let _next = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("the next flight", |ground| ground.time_s < 0.4);
    ground.listen_until("some of it", |ground| ground.time_s > 0.6);
    all_again(folder.path(), autopilot, &["plant lost", "stopped"]);
}

#[test]
fn streams_of_setpoints_and_of_sticks_are_flown_again() {
    let mut dice = Dice::new();
    let seed = dice.0;
    let folder = tempfile::tempdir().expect("a folder for the test");
    let (mut ground, autopilot, _plant) = flight(folder.path(), &[]);
    // PX4's main modes: 6 is Offboard, 2 is Altitude.
    for (mode, main) in [("Offboard", 6.0), ("Altitude", 2.0)] {
        for count in 0..60 {
            if main == 6.0 {
                let half = dice.between(-0.2, 0.2);
                ground.send(&MavMessage::SET_ATTITUDE_TARGET(SET_ATTITUDE_TARGET_DATA {
                    q: [half.cos(), half.sin(), 0.0, 0.0],
                    target_system: 1,
                    target_component: 1,
                    ..Default::default()
                }));
            } else {
                let stick = |dice: &mut Dice, middle| middle + dice.between(-300.0, 300.0) as i16;
                ground.send(&MavMessage::MANUAL_CONTROL(MANUAL_CONTROL_DATA {
                    x: stick(&mut dice, 0),
                    y: stick(&mut dice, 0),
                    z: stick(&mut dice, 500),
                    target: 1,
                    ..Default::default()
                }));
            }
            if count == 5 {
                let p = [1.0, main, 0.0, 0.0, 0.0, 0.0, 0.0];
                let result = ground.command(MavCmd::MAV_CMD_DO_SET_MODE, p);
                assert_eq!(result, MavResult::MAV_RESULT_ACCEPTED, "{mode}: {:?}", ground.texts);
            }
            ground.listen_for(Duration::from_micros(dice.roll(60_000)));
        }
        assert!(ground.has_text(&format!("Mode {mode}")), "{:?}", ground.texts);
    }
    eprintln!("dice {seed}");
    all_again(folder.path(), autopilot, &["stopped"]);
    let recorded = recorded(folder.path());
    assert!(recorded.contains("Setpoint") && recorded.contains("Sticks"), "dice {seed}");
}

#[test]
fn the_end_on_the_ground_and_commands_there_are_flown_again() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let low = folder.path().join("low.toml");
    let scenario = "[plant]\nseed = 1\nearth = \"wgs84\"\n[plant.start]\naltitude_m = 600.0\n";
    fs::write(&low, scenario).expect("the folder is there");
    let scenario = ["--scenario", low.to_str().expect("a readable path"), "--speed", "4"];
    let (mut ground, autopilot, _plant) = flight(folder.path(), &scenario);
    ground.command(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    ground.listen_until("the ground", |ground| ground.has_text("Ground contact"));
    ground.send_command(MavCmd::MAV_CMD_USER_1, [102.0, 2.0, 3.0, 1.0, 7.0, 0.0, 0.0]);
    ground.listen_for(Duration::from_millis(500));
    all_again(folder.path(), autopilot, &["stopped"]);
    let log = Log::open(&log(folder.path())).expect("readable");
    let rows = |name| log.topic(name).map(|topic| topic.len()).expect("a topic");
    assert_eq!(rows("truth"), rows("control") + 1, "the state on the ground");
    let on_ground = log.column("truth", "on_ground").expect("a column");
    assert_eq!(on_ground.last(), Some(&1.0));
}

#[test]
fn a_file_that_is_no_log_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join("no.ulg");
    fs::write(&path, "something else altogether").expect("the folder is there");
    let (code, printed) = replay(&path);
    assert_eq!(code, Some(2), "{printed}");
    assert!(printed.contains("no ULog file"), "{printed}");
    let (code, printed) = sitl(&["plot", path.to_str().expect("a readable path")]);
    assert_eq!(code, Some(1), "{printed}");
    assert!(printed.contains("no ULog file"), "{printed}");
}
