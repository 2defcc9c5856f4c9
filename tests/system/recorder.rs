//! Flight logs of real processes: their content, when they end, and what remains when a process is killed.

use crate::ground;
use crate::programs;

use icd::fault::PlantAction;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use autopilot::command::Command;
use autopilot::io::plant_link::LoggedStep;
use autopilot::recorder::{
    ControlHeader, Moment, Recorded, RunHash, control_names, control_values, parameter_hash,
};
use clap::{Args, FromArgMatches};
use ground::Ground;
use host_io::tick_log::{Kind, TickLogReader};
use icd::record::{FieldName, truth_fields};
use icd::tvc_jet;
use icd::{Actuators, Effector, PerEffector, Sensors, SimTime};
use mavlink::dialects::common::{MavCmd, MavMessage, MavParamType, MavResult, PARAM_SET_DATA};
use plant_sim::Truth;
use plant_sim::io::PlantArgs;
use plant_sim::io::header::PlantHeader;
use programs::{Program, autopilot, autopilot_with};
use ulog::reader::{Log, Row, Topic};

/// MAV_CMD_USER_1: SERVO, STUCK, left elevator, angle, 30 deg, no ramp, at once.
const JAM_LEFT_ELEVATOR: [f32; 7] = [102.0, 2.0, 3.0, 1.0, 30.0, 0.0, 0.0];

/// Rows of every control step, for tests that compute the flight from them.
const FULL: [&str; 2] = ["--log-rate", "full"];

/// The logs of a folder, oldest first.
fn logs(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let paths = entries.map(|entry| entry.expect("a folder that can be read").path());
    let mut logs: Vec<_> =
        paths.filter(|path| path.extension().is_some_and(|e| e == "ulg")).collect();
    // Names begin with whole seconds, so the time of the last write decides.
    logs.sort_by_key(|path| fs::metadata(path).and_then(|m| m.modified()).ok());
    logs
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a readable path")
}

/// Numbers of a row, by name.
fn numbers(row: &Row<'_>, names: &[FieldName]) -> Vec<u64> {
    let of = |name: &FieldName| row.value(name).unwrap_or_else(|| panic!("no column {name}"));
    names.iter().map(|name| of(name).to_bits()).collect()
}

fn topic<'a>(log: &'a Log, name: &str) -> Topic<'a> {
    log.topic(name).unwrap_or_else(|| panic!("no topic {name}"))
}

/// An entry of the topic `recorded`: control steps before it, moment, content.
type Input = (u64, Moment, Recorded);

fn inputs(log: &Log) -> Vec<Input> {
    let mut inputs = Vec::new();
    let mut json = Vec::new();
    let Some(topic) = log.topic("recorded") else { return inputs };
    for row in topic.rows() {
        let number = |name| row.unsigned(name).expect("a column of the topic");
        let length = usize::try_from(number("length")).expect("a byte");
        json.extend_from_slice(&row.bytes("text").expect("a column of the topic")[..length]);
        if number("part") + 1 == number("parts") {
            let moment = u8::try_from(number("phase")).ok().and_then(Moment::from_code);
            let what = serde_json::from_slice(&json).expect("JSON");
            inputs.push((number("step"), moment.expect("a known moment"), what));
            json.clear();
        }
    }
    inputs
}

/// The run hash, computed again from the rows of the log.
fn hash(log: &Log) -> RunHash {
    let mut hash = RunHash::default();
    let requests: Vec<Input> =
        inputs(log).into_iter().filter(|(.., what)| matches!(what, Recorded::Request(_))).collect();
    let sensors = topic(log, "sensors");
    for (step, (row, commands)) in sensors.rows().zip(topic(log, "commands").rows()).enumerate() {
        let values = Sensors::NAMES.map(|name| row.value(name).expect("a sensor"));
        let fields = topic(log, "commands").fields();
        let command = |e: Effector| commands.value(&fields[1 + e.index()].name).expect("a command");
        let commands = PerEffector::from_values(tvc_jet::ALL.map(command));
        let actuators = Actuators::new(commands);
        let time = SimTime::from_micros(row.timestamp_us());
        for (steps, moment, what) in
            requests.iter().filter(|(_, moment, _)| *moment != Moment::Step)
        {
            if let (Recorded::Request(request), true) = (what, *steps == step as u64) {
                hash.request(*steps, *moment, &request.action);
            }
        }
        // Every sample of an ideal sensor is valid and belongs to its step.
        assert!(
            Sensors::TIMES[..9].iter().all(|name| row.unsigned(name) == Some(time.as_micros()))
        );
        assert!(Sensors::VALID[..9].iter().all(|name| row.unsigned(name) == Some(1)));
        let mut sensors = Sensors::at(time, &values);
        // Without those of the ground.
        sensors.keep(&std::array::from_fn(|sensor| sensor < 9));
        hash.step(time, &sensors, &actuators, tvc_jet::ALL.len());
        for (steps, moment, what) in
            requests.iter().filter(|(_, moment, _)| *moment == Moment::Step)
        {
            if let (Recorded::Request(request), true) = (what, *steps == step as u64) {
                hash.request(*steps, *moment, &request.action);
            }
        }
    }
    hash
}

#[test]
fn a_log_holds_the_whole_flight_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let [steps, truth, dir] =
        ["steps", "truth", "deeper/logs"].map(|name| folder.path().join(name));
    let mut ground = Ground::new();
    let options = ["--step-log", text(&steps), "--log-dir", text(&dir), "--param", "OBS_W0=41"];
    let options = [&options[..], &FULL].concat();
    let (mut autopilot, link) = autopilot(ground.address(), &options);
    let plant = ["--autopilot", &link, "--speed", "4", "--until-s", "12", "--gyro-noise-deg-s=0.1"];
    let plant: Vec<&str> = plant.into_iter().chain(["--truth-log", text(&truth)]).collect();
    let mut plant_sim = Program::start("plant-sim", &plant);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    ground.send(&MavMessage::PARAM_SET(PARAM_SET_DATA {
        param_value: 9_000.0,
        target_system: 1,
        target_component: 1,
        param_id: "NAV_LOITER_RAD".into(),
        param_type: MavParamType::MAV_PARAM_TYPE_REAL32,
    }));
    let jam = ground.command(MavCmd::MAV_CMD_USER_1, JAM_LEFT_ELEVATOR);
    assert_eq!(jam, MavResult::MAV_RESULT_ACCEPTED);
    assert_eq!(plant_sim.end(), Some(0), "{}", plant_sim.printed());
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    let paths = logs(&dir);
    assert_eq!(paths.len(), 1, "{paths:?}");
    assert!(autopilot.printed().contains(text(&paths[0])), "{}", autopilot.printed());
    let log = Log::open(&paths[0]).expect("a log");
    assert!(!log.is_cut() && log.damages().is_empty());

    // Every tick, bit for bit.
    let list = tvc_jet::effectors();
    let (truth_names, control_names): (Vec<_>, _) =
        (truth_fields(&list).collect(), control_names(&list));
    let mut truths = TickLogReader::open(&truth, Kind::Truth).expect("a truth log");
    let mut ticks = 0;
    for row in topic(&log, "truth").rows() {
        let truth: Truth = truths.next_entry().expect("whole").expect("as many as the plant's");
        assert_eq!(row.timestamp_us(), truth.time.as_micros());
        let flown = truth.to_row(false, false);
        assert!(
            numbers(&row, &truth_names).into_iter().eq(flown.iter().map(|value| value.to_bits()))
        );
        ticks += 1;
    }
    assert!(truths.next_entry::<Truth>().expect("whole").is_none() && ticks == 6_001, "{ticks}");
    let mut steps = TickLogReader::open(&steps, Kind::ControlSteps).expect("a step log");
    for row in topic(&log, "control").rows() {
        let (time, step): LoggedStep = steps.next_entry().expect("whole").expect("as many");
        assert_eq!(row.timestamp_us(), time.as_micros());
        let flown = control_values(&step, 8);
        assert!(numbers(&row, &control_names).into_iter().eq(flown.into_iter().map(f64::to_bits)));
    }
    assert!(steps.next_entry::<LoggedStep>().expect("whole").is_none());

    // The inputs, the steps in which they acted, and their outcomes.
    let inputs = inputs(&log);
    let command = inputs.iter().find_map(|(step, _, what)| match what {
        Recorded::Intent(intent)
            if matches!(intent.command, Command::Plant(PlantAction::Fault(_))) =>
        {
            Some((*step, intent.number))
        }
        _ => None,
    });
    let request = inputs.iter().find_map(|(step, _, what)| match what {
        Recorded::Request(request) => Some((*step, request.number)),
        _ => None,
    });
    assert!(command.is_some() && command == request, "{inputs:?}");
    let faults = topic(&log, "fault");
    let fault = faults.row(0).expect("the jam");
    let (step, _) = command.expect("found above");
    assert_eq!(fault.unsigned("effector"), Some(u64::from(tvc_jet::LEFT_ELEVATOR.code())));
    assert_eq!(fault.unsigned("at_us"), Some(step * 2_000));
    assert!((fault.value("value_1").expect("an angle").to_degrees() - 30.0).abs() < 1.0e-5);
    let has_text = |part: &str| log.texts().iter().any(|text| text.text.contains(part));
    assert!(has_text("Injected") && has_text("Input: fault: left elevator"), "{:?}", log.texts());

    // Headers, parameters, end.
    let control: ControlHeader =
        serde_json::from_str(log.info_text("control_header").expect("a header")).expect("JSON");
    assert_eq!((control.settings.gains.neso.bandwidth, control.period_us), (41.0, 2_000));
    assert_eq!(control.parameter_hash.len(), parameter_hash([]).len());
    assert_eq!(log.info_text("session"), Some(control.session.as_str()));
    assert_eq!(control.session.len(), 8, "a hash and not the number: {}", control.session);
    let header: PlantHeader =
        serde_json::from_str(log.info_text("plant_header").expect("a header")).expect("JSON");
    let command = PlantArgs::augment_args(clap::Command::new("plant-sim"));
    let words = ["plant-sim"].iter().chain(&plant);
    let args = PlantArgs::from_arg_matches(&command.get_matches_from(words)).expect("options");
    assert_eq!(header.setup, args.plant_setup().expect("a setup"));
    let radii: Vec<_> = log.parameters().iter().filter(|p| p.name == "NAV_LOITER_RAD").collect();
    assert_eq!(radii.len(), 2, "at the start and in flight: {radii:?}");
    assert_eq!(log.info_u64("control_steps"), Some(6_001));
    assert_eq!(log.info_text("end"), Some("stopped"));
    assert_eq!(log.info_text("run_hash"), Some(hash(&log).hex().as_str()));
}

/// Content of a log without `--log-rate full`.
#[test]
fn by_default_a_log_has_twenty_rows_a_second_and_all_of_them_around_a_fault() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let script = folder.path().join("script.txt");
    fs::write(&script, "at 8.001 s: fail left elevator stuck\n").expect("the folder is there");
    let fly = |name: &str, rate: &[&str]| {
        let folder = folder.path().join(name);
        let options = ["--log-dir", text(&folder), "--script", text(&script), "--no-gcs"];
        let (mut autopilot, link) = autopilot_with(&[&options[..], rate].concat());
        let plant = ["--autopilot", &link, "--speed", "max", "--until-s", "60"];
        let mut plant = Program::start("plant-sim", &plant);
        assert_eq!(plant.end(), Some(0), "{}", plant.printed());
        autopilot.signal(15);
        assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
        Log::open(&logs(&folder)[0]).expect("a log")
    };
    let (log, full) = (fly("events", &[]), fly("full", &FULL));
    assert_eq!(full.times_us("sensors").expect("a topic").len(), 30_001);
    for topic in ["sensors", "commands", "control", "truth", "vehicle"] {
        let times = log.times_us(topic).expect("a topic");
        let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
        assert!(times.is_sorted() && gaps.max() == Some(50_000), "{topic}");
        // The fault begins between two ticks; the compensator wakes after it.
        let near = |us: &u64| (7_902_000..=8_400_000).contains(us);
        assert_eq!(times.iter().filter(|us| near(us)).count(), 250, "{topic}");
        assert!(times.len() < 1_800 && times.last() == Some(&60_000_000), "{}", times.len());
    }
    // The rows are those of the full log, bit for bit, and so is the flight.
    let (some, all) = (topic(&log, "control"), topic(&full, "control"));
    let names = control_names(&tvc_jet::effectors());
    let times = all.times_us();
    for row in some.rows() {
        let place = times.binary_search(&row.timestamp_us()).expect("a row at that time");
        let same = all.row(place).expect("found");
        assert_eq!(numbers(&row, &names), numbers(&same, &names));
    }
    assert_eq!(log.info_text("run_hash"), full.info_text("run_hash"));
    let texts = |log: &Log| -> Vec<String> { log.texts().iter().map(|t| t.text.clone()).collect() };
    // Wall time decides whether the silence of the plant after its end is still in the log.
    let (some, all) = (texts(&log), texts(&full));
    let count = some.len().min(all.len());
    assert_eq!(some[..count], all[..count]);
    for log in [&log, &full] {
        assert_eq!(topic(log, "hash").len(), 600, "ten a second");
        let cause = log.texts().iter().position(|text| text.text.starts_with("Injected"));
        assert!(cause.is_some() && log.texts().is_sorted_by_key(|text| text.timestamp_us));
    }
    assert!(log.size() * 10 < full.size(), "{} bytes of {}", log.size(), full.size());
}

#[test]
fn a_killed_autopilot_leaves_a_log_up_to_its_last_second() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let mut ground = Ground::new();
    let (mut autopilot, link) = autopilot(ground.address(), &["--log-dir", text(folder.path())]);
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("a flight of some seconds", |ground| ground.time_s > 3.0);
    let seen_s = ground.time_s;
    autopilot.signal(9);
    autopilot.end();
    let logs = logs(folder.path());
    let log = Log::open(&logs[0]).expect("readable");
    assert_eq!(log.info_text("run_hash"), None);
    assert!(log.info_text("plant_header").is_some());
    let last_us = *log.times_us("truth").expect("a topic").last().expect("rows");
    let last_s = SimTime::from_micros(last_us).as_seconds();
    assert!(last_s > seen_s - 1.0, "up to {last_s} s, flown {seen_s} s");
}

#[test]
fn a_new_flight_is_a_new_log_and_the_oldest_make_room() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let old = folder.path().join("19700101-000000-00000001.ulg");
    fs::write(&old, vec![0; 999_000]).expect("the folder is there");
    let mut ground = Ground::new();
    let options = ["--log-dir", text(folder.path()), "--log-limit-mb", "1"];
    let options = [&options[..], &FULL].concat();
    let (mut autopilot, link) = autopilot(ground.address(), &options);
    let _plant = Program::start("plant-sim", &["--autopilot", &link, "--speed", "2"]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.3);
    let reboot = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    ground.command(MavCmd::MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, reboot);
    autopilot.wait_for("has reached its limit");
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    assert!(!old.exists(), "{}", autopilot.printed());
    let logs = logs(folder.path());
    let last = Log::open(logs.last().expect("a log")).expect("readable");
    assert_eq!(last.info_text("end"), Some("log full"));
    assert!(last.texts().iter().any(|text| text.text.contains("reached its limit")));
    assert_eq!(last.info_text("run_hash"), Some(hash(&last).hex().as_str()));
    assert_eq!(topic(&last, "sensors").row(0).map(|row| row.timestamp_us()), Some(0));
}

#[test]
fn a_restart_ends_the_log_and_begins_another() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let mut ground = Ground::new();
    let options = [&["--log-dir", text(folder.path())], &FULL[..]].concat();
    let (mut autopilot, link) = autopilot(ground.address(), &options);
    let _plant = Program::start("plant-sim", &["--autopilot", &link, "--speed", "2"]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.3);
    let reboot = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    ground.command(MavCmd::MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, reboot);
    ground.listen_until("the next flight", |ground| ground.time_s < 0.2);
    ground.listen_until("some of it", |ground| ground.time_s > 0.3);
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    let paths = logs(folder.path());
    let ends: Vec<_> = paths
        .iter()
        .map(|path| {
            let log = Log::open(path).expect("readable");
            assert_eq!(log.info_text("run_hash"), Some(hash(&log).hex().as_str()));
            assert_eq!(topic(&log, "sensors").row(0).map(|row| row.timestamp_us()), Some(0));
            log.info_text("end").map(str::to_owned)
        })
        .collect();
    assert_eq!(ends, ["restart", "stopped"].map(|end| Some(end.to_owned())));
}

#[test]
fn a_log_has_every_text_once_and_those_of_scripts_and_refusals_too() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let script = folder.path().join("script.txt");
    fs::write(&script, "say Hello\nat 0.5 s: fail rudder stuck\nairspeed 400 m/s\n")
        .expect("the folder is there");
    let mut ground = Ground::new();
    let options = ["--log-dir", text(folder.path()), "--script", text(&script)];
    let (mut autopilot, link) = autopilot(ground.address(), &options);
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("the end of the script", |ground| ground.has_text("Script done"));
    let no_such_servo = [102.0, 2.0, 8.0, 1.0, 30.0, 0.0, 0.0];
    ground.command(MavCmd::MAV_CMD_USER_1, no_such_servo);
    let too_fast = [0.0, 9_000.0, -1.0, 0.0, 0.0, 0.0, 0.0];
    ground.command(MavCmd::MAV_CMD_DO_CHANGE_SPEED, too_fast);
    ground.listen_for(Duration::from_millis(300));
    let seen_s = ground.time_s;
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    let log = Log::open(&logs(folder.path())[0]).expect("readable");
    let texts: Vec<&str> = log.texts().iter().map(|text| text.text.as_str()).collect();
    for received in &ground.texts {
        // Long texts are sent in chunks, and end with a blank if the last one would be full.
        let piece = received.trim_end();
        let times = texts.iter().filter(|text| text.contains(piece)).count();
        assert!(times == 1 || piece.len() < 20, "{piece}: {times} times in {texts:?}");
    }
    for part in ["Script began", "Script: Hello", "Script 2: at 0.5 s", "Script 3 refused"] {
        let found = log.texts().iter().filter(|text| text.text.starts_with(part)).count();
        assert_eq!(found, 1, "{part}: {texts:?}");
    }
    let refused = log.texts().iter().find(|text| text.text.starts_with("Fault refused"));
    let refused = refused.unwrap_or_else(|| panic!("{texts:?}"));
    assert!(refused.text.contains("no instance 8"), "{}", refused.text);
    let at_s = SimTime::from_micros(refused.timestamp_us).as_seconds();
    // The script ends in the step at 0.5 s; where the machine is slow, the command is there before the next step.
    assert!(at_s >= 0.5 && at_s <= seen_s + 0.5, "sent at {at_s} s, seen until {seen_s} s");
}

#[test]
fn a_flight_has_the_same_hash_at_every_speed() {
    let fly = |speed: &str| {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let options = ["--scenario", "case2", "--log-dir", text(folder.path()), "--no-gcs"];
        let (mut autopilot, link) = autopilot_with(&options);
        let plant = ["--autopilot", &link, "--scenario", "case2", "--until-s", "4"];
        let noise = ["--gyro-noise-deg-s", "0.1", "--speed", speed];
        let mut plant = Program::start("plant-sim", &[&plant[..], &noise].concat());
        assert_eq!(plant.end(), Some(0), "{}", plant.printed());
        autopilot.signal(15);
        assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
        let log = Log::open(&logs(folder.path())[0]).expect("readable");
        let hash = log.info_text("run_hash").expect("a footer").to_owned();
        (log.info_u64("control_steps"), hash)
    };
    let slow = fly("4");
    assert_eq!(slow.0, Some(2_001));
    assert_eq!(fly("max"), slow);
}

#[test]
fn a_folder_that_cannot_be_written_stops_the_start_and_one_that_goes_away_does_not_stop_the_flight()
{
    let folder = tempfile::tempdir().expect("a folder for the test");
    let file = folder.path().join("file");
    fs::write(&file, "").expect("the folder is there");
    let inside = file.join("logs");
    let mut refused = Program::start("autopilot", &["--log-dir", text(&inside), "--no-gcs"]);
    assert_eq!(refused.end(), Some(1));
    assert!(refused.printed().contains(text(&inside)), "{}", refused.printed());

    // Between start and flight a file replaces the folder, so that it cannot be created again.
    let gone = folder.path().join("gone");
    let (autopilot, link) = autopilot_with(&["--log-dir", text(&gone), "--no-gcs"]);
    fs::remove_dir_all(&gone).expect("it was created at the start");
    fs::write(&gone, "").expect("its parent is there");
    let plant = ["--autopilot", &link, "--speed", "max", "--until-s", "2"];
    let mut plant = Program::start("plant-sim", &plant);
    assert_eq!(plant.end(), Some(0), "{}", plant.printed());
    autopilot.wait_for("there is no log of this flight");
}

#[test]
fn without_a_folder_there_is_no_log() {
    let mut ground = Ground::new();
    let (autopilot, link) = autopilot(ground.address(), &["--log-dir", "none"]);
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    ground.listen_for(Duration::from_millis(50));
    assert!(!autopilot.printed().contains("flight log"), "{}", autopilot.printed());
}

/// Needs a Python with tests/clients/requirements.txt, named by TWO_STEP_PYTHON; prints a note and passes without.
#[test]
fn pyulog_reads_a_log() {
    let Some(python) = std::env::var_os("TWO_STEP_PYTHON") else {
        eprintln!("skipped: TWO_STEP_PYTHON does not name a Python with the client libraries");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder for the test");
    let options = ["--log-dir", text(folder.path()), "--ftc", "armed", "--no-gcs"];
    let (mut autopilot, link) = autopilot_with(&[&options[..], &FULL].concat());
    let plant = ["--autopilot", &link, "--speed", "max", "--until-s", "3"];
    let mut plant = Program::start("plant-sim", &plant);
    assert_eq!(plant.end(), Some(0), "{}", plant.printed());
    autopilot.signal(15);
    assert_eq!(autopilot.end(), Some(0), "{}", autopilot.printed());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/clients/read_log.py");
    let output = std::process::Command::new(python)
        .arg(script)
        .args([logs(folder.path())[0].as_os_str(), "1501".as_ref()])
        .output()
        .expect("TWO_STEP_PYTHON runs");
    let printed = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{printed}");
}
