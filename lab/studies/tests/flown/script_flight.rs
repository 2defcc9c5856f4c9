//! The shipped scenario with a script, flown in one process and judged by the truth.

use autopilot::event::EventKind;
use autopilot::run::AutopilotArgs;
use autopilot::script::ScriptEvent;
use clap::{Args, Command};
use core::ops::ControlFlow;
use icd::tvc_jet;
use icd::{Effector, SimTime};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::{FlightSetup, watch};
use plant_sim::Truth;
use plant_sim::io::PlantArgs;

const CHAIN: &str =
    concat!("--scenario=", env!("CARGO_MANIFEST_DIR"), "/../../scenarios/chain.toml");

fn parse<T: Args>(words: &[&str]) -> T {
    let matches = T::augment_args(Command::new("test")).get_matches_from(words);
    T::from_arg_matches(&matches).unwrap()
}

fn flight() -> FlightSetup {
    let plant: PlantArgs = parse(&["plant-sim", CHAIN]);
    let autopilot: AutopilotArgs = parse(&["autopilot", CHAIN]);
    let (control, parameters) = autopilot.control_setup().unwrap();
    FlightSetup {
        plant: plant.plant_setup().unwrap(),
        model: control.model,
        parameters,
        references: control.references,
        script: control.script,
        duration: SimTime::from_micros(40_000_000),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    }
}

struct Seen {
    truths: Vec<Truth>,
    events: Vec<(SimTime, ScriptEvent)>,
    on_ground: bool,
}

fn seen() -> Seen {
    let setup = flight();
    let (mut truths, mut events) = (Vec::new(), Vec::new());
    let end = watch(&setup, |tick| {
        truths.push(*tick.plant.truth());
        events.extend(tick.events.iter().filter_map(|event| match event.kind {
            EventKind::Script { event: kind, .. } => Some((event.time, kind)),
            _ => None,
        }));
        ControlFlow::Continue(())
    });
    Seen { truths, events, on_ground: end.unwrap().on_ground }
}

fn is_broken(truth: &Truth, effector: Effector) -> bool {
    truth.fault_codes[effector] != 0
}

#[test]
fn the_right_effector_fails_when_roll_passes_ten_degrees_and_the_next_one_two_seconds_later() {
    let seen = seen();
    assert!(!seen.on_ground);
    let onset = |effector| {
        seen.truths.iter().position(|truth| is_broken(truth, effector)).expect("it fails")
    };
    let elevator = onset(tvc_jet::LEFT_ELEVATOR);
    let roll_deg = |tick: usize| seen.truths[tick].euler().phi.to_degrees();
    // Asked for at the tick at which roll is beyond, acting between that tick and the next.
    assert!(roll_deg(elevator - 2) <= 10.0 && roll_deg(elevator) > 10.0, "{}", roll_deg(elevator));
    let rudder = onset(tvc_jet::RUDDER);
    let between = seen.truths[rudder].time.micros_since(seen.truths[elevator].time);
    assert_eq!(between, 2_000_000, "2 s after the line before");
    for truth in &seen.truths {
        for effector in tvc_jet::ALL {
            let may = matches!(effector, tvc_jet::LEFT_ELEVATOR | tvc_jet::RUDDER);
            assert!(may || !is_broken(truth, effector), "{effector:?} at {}", truth.time);
        }
    }
}

#[test]
fn every_line_of_the_script_is_executed_and_nothing_is_refused() {
    let seen = seen();
    let script = flight().script.unwrap();
    let mut lines: Vec<u16> = Vec::new();
    for (time, event) in &seen.events {
        match event {
            ScriptEvent::Line(line) => lines.push(*line),
            ScriptEvent::Began | ScriptEvent::Done => {}
            other => panic!("{other:?} at {time}"),
        }
    }
    lines.sort_unstable();
    assert_eq!(lines, script.lines().map(|line| line.number).collect::<Vec<_>>());
    assert_eq!(seen.events.last().map(|(_, event)| *event), Some(ScriptEvent::Done));
    let last = seen.truths.last().unwrap();
    assert!(tvc_jet::ALL.into_iter().all(|effector| !is_broken(last, effector)), "mended");
    assert!(last.euler().phi.abs() < 0.05, "wings level: {} rad", last.euler().phi);
    assert!((last.altitude_m - 5_200.0).abs() < 50.0, "altitude {} m", last.altitude_m);
}

#[test]
fn a_flight_with_a_script_that_is_repeated_is_the_same_to_the_bit() {
    let (first, second) = (seen(), seen());
    assert_eq!(first.events, second.events);
    let bits = |seen: &Seen| postcard::to_stdvec(&seen.truths).unwrap();
    assert_eq!(bits(&first), bits(&second));
}
