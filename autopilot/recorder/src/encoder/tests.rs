use super::*;
use crate::ControlHeader;
use aircraft::DEFAULT_MODEL;
use flight_management::autopilot::Settings;
use flight_management::command::Intent;
use flight_management::command::VehicleCommand;
use flight_management::configuration;
use flight_management::vehicle::{Reference, VehicleRefusal};
use flight_management::vehicle::{VehicleEvent, schedule::ReferenceSchedule};
use icd::fault::PlantAction;
use icd::fault::{FaultEntry, FaultKind, FaultState, Timing};
use icd::tvc_jet;
use ulog::reader::Log;

mod selection;

const SYNC_MESSAGE: [u8; 6] = [8, 0, b'S', 0x2F, 0x73, 0x13];

fn at(ms: u64) -> SimTime {
    SimTime::from_micros(ms * 1_000)
}

fn encoder() -> Encoder<Vec<u8>> {
    let parameters = Parameters::default();
    let settings = Settings {
        model: configuration::aircraft_model("model", DEFAULT_MODEL).unwrap(),
        gains: parameters.gains,
        limits: parameters.limits,
        navigation: parameters.navigation,
        references: ReferenceSchedule::default(),
        script: None,
        own_law: None,
        fault_injection: false,
    };
    let header = ControlHeader::new(settings, "00000001".to_owned(), 2_000, false);
    let begin = Begin { time: SimTime::ZERO, header };
    Encoder::begin(Vec::new(), begin, &parameters, LogRate::Full).unwrap()
}

fn bytes(entries: Vec<Entry>) -> Vec<u8> {
    let mut encoder = encoder();
    for entry in entries {
        encoder.add(entry).unwrap();
    }
    encoder.end(End::Stopped).unwrap()
}

fn texts(entries: Vec<Entry>) -> Vec<(u64, String)> {
    let log = Log::from_bytes(bytes(entries)).unwrap();
    log.texts().iter().map(|text| (text.timestamp_us, text.text.clone())).collect()
}

fn event(ms: u64, kind: EventKind) -> Entry {
    Entry::Event(Event { time: at(ms), kind })
}

fn command(ms: u64, number: u32, command: Command) -> Entry {
    let what = Recorded::Intent(Intent { number, command });
    Entry::Recorded { time: at(ms), moment: Moment::Step, what }
}

fn jam(state: FaultState) -> FaultEntry {
    let kind = FaultKind::StuckHere;
    FaultEntry { id: 3, target: tvc_jet::RUDDER.into(), kind, timing: Timing::NOW, state }
}

#[test]
fn a_fault_is_logged_once_however_often_the_plant_falls_silent() {
    let acting = jam(FaultState::Active { since: at(2) });
    let reported =
        |ms, entry| [Entry::Fault { time: at(ms), entry }, event(ms, EventKind::Fault(entry))];
    let mut entries: Vec<Entry> = reported(2, acting).into();
    for silence in [10, 20] {
        entries.push(event(silence, EventKind::PlantLost));
        entries.push(event(silence, EventKind::PlantBack));
    }
    entries.extend(reported(30, acting));
    entries.extend(reported(40, jam(FaultState::Ended { at: at(40) })));
    let log = Log::from_bytes(bytes(entries)).unwrap();
    let texts: Vec<&str> = log.texts().iter().map(|text| text.text.as_str()).collect();
    let count = |part: &str| texts.iter().filter(|text| text.starts_with(part)).count();
    assert_eq!((count("Injected"), count("Cleared")), (1, 1), "{texts:?}");
    assert_eq!(log.topic("fault").unwrap().len(), 2);
}

#[test]
fn the_autopilots_own_request_is_not_logged_as_a_command_of_an_operator() {
    let texts = texts(vec![command(2, 1, Command::Plant(PlantAction::ListFaults))]);
    assert_eq!(texts[0].1, "Input: the autopilot asks for the faults");
}

#[test]
fn texts_are_in_the_order_of_time_and_a_refusal_names_the_input() {
    let climb = Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(99_000.0)));
    let why = VehicleRefusal::OutOfRange {
        what: "altitude",
        unit: "m",
        value: 99_000.0,
        min: 0.0,
        max: 20_000.0,
    };
    let outcome = EventKind::Outcome { number: 7, outcome: Outcome::Refused(why) };
    let text = |text: &str| Entry::Text { time: at(6), severity: 4, text: text.to_owned() };
    let texts = texts(vec![
        command(4, 7, climb),
        // Events have the time of the step before.
        event(2, outcome),
        event(2, EventKind::Vehicle(VehicleEvent::PlanComplete)),
        text(&why.to_string()),
        text("something else"),
    ]);
    let expected = [
        (4_000, "Input: altitude 99000.0 m".to_owned()),
        (4_000, format!("Input refused: altitude 99000.0 m: {why}")),
        (4_000, "Mission complete".to_owned()),
        (6_000, "something else".to_owned()),
    ];
    assert_eq!(texts, expected);
}

#[test]
fn a_place_to_read_on_from_comes_every_64_kib() {
    let text = |k: u64| Entry::Text { time: at(k), severity: 6, text: "x".repeat(200) };
    let bytes = bytes((0..3_000).map(text).collect());
    let places: Vec<usize> = bytes
        .windows(SYNC_MESSAGE.len())
        .enumerate()
        .filter(|(_, window)| **window == SYNC_MESSAGE)
        .map(|(place, _)| place)
        .collect();
    assert!(places.len() >= bytes.len() / 66_000, "{places:?} of {}", bytes.len());
    assert!(places.windows(2).all(|pair| pair[1] - pair[0] < 66_000), "{places:?}");
}
