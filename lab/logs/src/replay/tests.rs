use autopilot::command::Configuration;
use autopilot::command::ScriptCommand;
use autopilot::command::VehicleCommand;
use icd::fault::PlantAction;
use std::sync::Arc;

use autopilot::command::Command;
use autopilot::recorder::{FLIGHT_RULES, Moment};
use autopilot::script::Script;
use autopilot::vehicle::{LinkLossAction, Mode, Reference};
use flight_control::Gains;
use icd::fault::{FaultKind, Onset, Timing};
use icd::pace::Pace;
use icd::tvc_jet;
use icd::{ControlPeriod, FaultRequest, SimTime};
use ulog::reader::Log;

use super::*;
use lab_judges::closed_loop::FlightSetup;
use lab_paper::cases::{Case, Conditions};
use plant_sim::EarthModel;
use testing::{StepCommand, Without};

pub(crate) mod testing;

/// A climb with turbulence and noise for a few seconds.
pub fn setup(seconds: u64) -> FlightSetup {
    let conditions = Conditions {
        earth: EarthModel::Wgs84,
        period: ControlPeriod::DEFAULT,
        step_us: 1_000,
        gyro_noise_rad_s: 1.0e-3,
        turbulence_m_s: 1.5,
        seed: 7,
    };
    let mut setup = Case::new(1, &conditions).unwrap().setup;
    setup.plant.faults.clear();
    setup.duration = SimTime::from_micros(seconds * 1_000_000);
    setup
}

fn jam(onset: Onset) -> Command {
    let kind = FaultKind::StuckHere;
    let timing = Timing { onset, ..Timing::NOW };
    Command::Plant(PlantAction::Fault(FaultRequest::Inject {
        target: tvc_jet::LEFT_ELEVATOR.into(),
        kind,
        timing,
    }))
}

/// Everything that an operator may do, in flight and while time stands still.
pub fn commands() -> Vec<StepCommand> {
    let mut gains = Gains::REFERENCE;
    gains.pid.roll.k_p *= 1.1;
    let script = "at 1.6 s: fail rudder 50 % left\nwhen roll passes 1 deg: altitude 3200 m\n";
    let script = Arc::new(Script::parse("a test", script, &tvc_jet::effectors()).unwrap());
    let at = |step, command| (step, Moment::Step, command);
    let held = |step, command| (step, Moment::Holding, command);
    vec![
        at(0, Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(3_100.0)))),
        at(5, Command::Script(ScriptCommand::Run(script))),
        at(10, Command::Configuration(Configuration::Gains(Box::new(gains)))),
        at(20, Command::Vehicle(VehicleCommand::Mode(Mode::Hold))),
        at(20, Command::Plant(PlantAction::Pace(Pace::Pause))),
        held(21, jam(Onset::AtOnce)),
        held(21, Command::Vehicle(VehicleCommand::Refer(Reference::Airspeed(155.0)))),
        held(21, Command::Plant(PlantAction::Pace(Pace::Run))),
        at(300, Command::Plant(PlantAction::Fault(FaultRequest::ClearAll))),
        at(310, Command::Vehicle(VehicleCommand::LinkLost(LinkLossAction::Return))),
        at(400, Command::Vehicle(VehicleCommand::LinkBack)),
        at(420, jam(Onset::At(SimTime::from_micros(1_000_500)))),
        at(600, Command::Vehicle(VehicleCommand::Terminate)),
    ]
}

fn replay(bytes: Vec<u8>) -> Result<ReplayVerdict, Problem> {
    fly(&Recording::of(Log::from_bytes(bytes).unwrap())?, &mut |_| {})
}

#[test]
fn a_flight_with_every_kind_of_input_is_flown_again_bit_for_bit() {
    let bytes = testing::log(&setup(2), &commands(), Without::default());
    let recording = Recording::of(Log::from_bytes(bytes.clone()).unwrap()).unwrap();
    assert_eq!(recording.remarks(), [""; 0]);
    let verdict = replay(bytes).unwrap();
    assert!(verdict.is_same(), "{verdict}");
    assert_eq!(verdict.steps, 1_001);
    assert!(verdict.to_string().starts_with("same run hash "), "{verdict}");
}

const SPARSE: Without = Without { truth: false, footer: false, headers: false, rows: 10 };

#[test]
fn a_log_with_some_of_the_rows_is_flown_again_bit_for_bit() {
    let bytes = testing::log(&setup(2), &commands(), SPARSE);
    let verdict = replay(bytes.clone()).unwrap();
    assert!(verdict.is_same(), "{verdict}");
    // The last row is that of step 1000, as it happens.
    assert_eq!(verdict.steps, 1_001);
    let without_footer = Without { footer: true, ..SPARSE };
    let verdict = replay(testing::log(&setup(2), &commands(), without_footer)).unwrap();
    assert!(verdict.is_same() && verdict.logged_hash.is_none(), "{verdict}");
    for part in [3, 5, 7] {
        let verdict = replay(bytes[..bytes.len() * part / 8].to_vec()).unwrap();
        assert!(verdict.is_same() && verdict.steps > 100, "{part}/8: {verdict}");
    }
}

#[test]
fn between_rows_the_hash_names_the_first_interval_that_differs() {
    let mut bytes = testing::log(&setup(2), &[], SPARSE);
    let log = Log::from_bytes(bytes.clone()).unwrap();
    let hash = log.topic("hash").unwrap().row(7).unwrap();
    assert_eq!(hash.unsigned("steps"), Some(400));
    let text = hash.bytes("run_hash").unwrap().to_vec();
    let place = bytes.windows(text.len()).position(|window| window == text).unwrap();
    bytes[place] = if text[0] == b'0' { b'1' } else { b'0' };
    let difference = replay(bytes).unwrap().difference.unwrap();
    assert_eq!((difference.step, difference.time.as_micros()), (399, 798_000), "{difference}");
    assert_eq!(difference.signal, "run hash of the control steps 350 to 399");
}

#[test]
fn a_row_that_should_be_there_and_is_not_is_a_difference() {
    let mut bytes = testing::log(&setup(1), &[], SPARSE);
    let log = Log::from_bytes(bytes.clone()).unwrap();
    assert_eq!(log.times_us("sensors").unwrap().len(), 51);
    // The header claims more rows than there are.
    let (from, to) = (b"\"row_every\":10,", b"\"row_every\": 5,");
    let place = bytes.windows(from.len()).position(|window| window == from).unwrap();
    bytes[place..place + to.len()].copy_from_slice(to);
    let difference = replay(bytes).unwrap().difference.unwrap();
    assert_eq!((difference.step, difference.signal.as_str()), (5, "sensors.timestamp"));
}

#[test]
fn a_damaged_log_with_some_of_the_rows_is_the_same_flight_where_it_can_be_read() {
    let mut bytes = testing::log(&setup(2), &[], SPARSE);
    let middle = bytes.len() / 2;
    bytes[middle..middle + 3_000].fill(0xFF);
    let verdict = replay(bytes).unwrap();
    assert_eq!(verdict.outcome(), Outcome::SameWhereReadable, "{verdict}");
    assert!((1..30).contains(&verdict.missing), "{verdict}");
    let readable = 101 - verdict.missing;
    assert!(verdict.to_string().contains(&format!("all {readable} readable")), "{verdict}");
}

#[test]
fn without_its_inputs_it_is_another_flight() {
    let bytes = testing::log(&setup(1), &commands(), Without::default());
    let mut recording = Recording::of(Log::from_bytes(bytes).unwrap()).unwrap();
    recording.forget_inputs();
    let verdict = fly(&recording, &mut |_| {}).unwrap();
    let step = verdict.difference.map(|difference| difference.step);
    assert!(step.is_some_and(|step| step <= 21), "inputs begin at step 0: {step:?}");
}

#[test]
fn a_changed_sensor_value_is_found_at_its_tick_and_by_its_name() {
    let mut bytes = testing::log(&setup(1), &[], Without::default());
    let log = Log::from_bytes(bytes.clone()).unwrap();
    let logged = log.column("sensors", "airspeed_m_s").unwrap()[123];
    let place = bytes.windows(8).position(|window| window == logged.to_le_bytes()).unwrap();
    bytes[place] ^= 1;
    let verdict = replay(bytes).unwrap();
    let difference = verdict.difference.clone().unwrap();
    assert_eq!((difference.step, difference.time), (123, SimTime::from_micros(246_000)));
    assert!(difference.signal.ends_with("airspeed_m_s"), "{difference}");
    assert!(!verdict.is_same() && verdict.to_string().contains("control step 123"), "{verdict}");
}

#[test]
fn a_changed_input_is_another_request() {
    let bytes = testing::log(&setup(1), &commands(), Without::default());
    let text = String::from_utf8_lossy(&bytes).into_owned();
    assert!(text.contains("\"target\":2"));
    let from = b"\"target\":2";
    let place = bytes.windows(from.len()).position(|window| window == from).unwrap();
    let mut changed = bytes;
    changed[place..place + from.len()].copy_from_slice(b"\"target\":0");
    let difference = replay(changed).unwrap().difference.unwrap();
    assert_eq!(difference.signal, "request to the plant");
    assert_eq!(difference.step, 21);
    assert!(difference.logged.contains("Effector(2)"), "{difference}");
    assert!(difference.flown.contains("Effector(0)"), "{difference}");
}

#[test]
fn a_log_that_was_cut_off_is_compared_up_to_its_end() {
    let bytes = testing::log(&setup(2), &commands(), Without::default());
    for part in [3, 4, 5, 7] {
        let cut = bytes[..bytes.len() * part / 8 + part].to_vec();
        let recording = Recording::of(Log::from_bytes(cut).unwrap()).unwrap();
        assert!(recording.remarks().concat().contains("cut off"), "{:?}", recording.remarks());
        let verdict = fly(&recording, &mut |_| {}).unwrap();
        assert!(verdict.is_same(), "{part}/8: {verdict}");
        assert_eq!(verdict.steps, recording.steps());
        assert!(verdict.steps > 100 && verdict.steps < 1_001, "{}", verdict.steps);
        assert!(verdict.to_string().contains("cut off before its run hash"), "{verdict}");
    }
}

#[test]
fn a_flight_ends_on_the_ground() {
    let mut setup = setup(10);
    setup.plant.start.altitude_m = 60.0;
    let commands = [(0, Moment::Step, Command::Vehicle(VehicleCommand::Terminate))];
    let bytes = testing::log(&setup, &commands, Without::default());
    let verdict = replay(bytes).unwrap();
    assert!(verdict.is_same(), "{verdict}");
    assert!(verdict.steps < 5_000, "{}", verdict.steps);
}

#[test]
fn a_log_that_cannot_be_flown_gives_the_reason() {
    let without = Without { headers: true, ..Without::default() };
    let bytes = testing::log(&setup(1), &[], without);
    let reason = Recording::of(Log::from_bytes(bytes).unwrap()).unwrap_err().to_string();
    assert!(reason.contains("control_header is missing"), "{reason}");
    let bytes = testing::log(&setup(1), &[], Without::default());
    let patch = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let place = bytes.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        let mut changed = bytes.clone();
        changed[place..place + to.len()].copy_from_slice(to.as_bytes());
        Recording::of(Log::from_bytes(changed).unwrap())
    };
    let joined = patch("\"joined_in_flight\":false", "\"joined_in_flight\":true ").unwrap_err();
    assert!(joined.to_string().contains("joined a flight under way"), "{joined}");
    let other = patch("\"model\"", "\"modal\"").unwrap_err().to_string();
    assert!(other.contains("control_header cannot be read by this version"), "{other}");
    let present = format!("\"flight_rules\":{FLIGHT_RULES}");
    let rules = patch(&present, "\"flight_rules\":0").unwrap_err().to_string();
    let expected = format!("its flight follows rules 0, this program has rules {FLIGHT_RULES}");
    assert!(rules.contains(&expected), "{rules}");
    let older = patch("\"flight_rules\"", "\"flight_times\"").unwrap_err();
    assert!(older.to_string().contains("rules 0"), "a log from before the number: {older}");
    let version = patch("\"version\":\"0.1.0\"", "\"version\":\"0.0.9\"").unwrap();
    assert!(!version.remarks().is_empty());
}

/// A log with sync messages that lost some bytes in its middle.
fn damaged(commands: &[StepCommand], without: Without) -> Vec<u8> {
    let mut bytes = testing::log(&setup(2), commands, without);
    let middle = bytes.len() / 2;
    bytes[middle..middle + 3_000].fill(0xFF);
    bytes
}

#[test]
fn a_damaged_log_is_the_same_flight_where_it_can_be_read() {
    let bytes = damaged(&commands(), Without::default());
    let recording = Recording::of(Log::from_bytes(bytes).unwrap()).unwrap();
    assert!(recording.remarks().concat().contains("damaged: byte"), "{:?}", recording.remarks());
    let verdict = fly(&recording, &mut |_| {}).unwrap();
    assert_eq!(verdict.outcome(), Outcome::SameWhereReadable, "{verdict}");
    assert_eq!(verdict.steps, 1_001);
    assert!((1..100).contains(&verdict.missing), "{verdict}");
    let readable = 1_001 - verdict.missing;
    let text = verdict.to_string();
    let expected = format!("damaged; all {readable} readable control steps are the same");
    assert!(text.starts_with(&expected) && text.contains("same run hash"), "{text}");
    // Also without a footer.
    let verdict =
        replay(damaged(&commands(), Without { footer: true, ..Without::default() })).unwrap();
    assert_eq!(verdict.outcome(), Outcome::SameWhereReadable, "{verdict}");
}

#[test]
fn a_difference_before_the_damage_is_another_flight_and_one_behind_it_may_be_a_lost_input() {
    let bytes = damaged(&[], Without::default());
    let changed = |row: usize| {
        let mut bytes = bytes.clone();
        let log = Log::from_bytes(bytes.clone()).unwrap();
        let logged = log.column("sensors", "airspeed_m_s").unwrap()[row];
        let place = bytes.windows(8).position(|window| window == logged.to_le_bytes()).unwrap();
        bytes[place] ^= 1;
        replay(bytes).unwrap()
    };
    let before = changed(100);
    assert_eq!(before.outcome(), Outcome::Different, "{before}");
    assert_eq!(before.difference.unwrap().step, 100);
    let behind = changed(900);
    assert_eq!(behind.outcome(), Outcome::Unknown, "{behind}");
    assert!(behind.to_string().contains("cannot be told"), "{behind}");
}

#[test]
fn zeros_behind_a_log_cost_nothing() {
    let mut bytes = testing::log(&setup(1), &commands(), Without::default());
    bytes.extend_from_slice(&[0; 4096]);
    let recording = Recording::of(Log::from_bytes(bytes).unwrap()).unwrap();
    assert!(recording.is_damaged());
    let verdict = fly(&recording, &mut |_| {}).unwrap();
    assert!(verdict.is_same(), "{verdict}");
}
