//! Scripts on the control side.

use super::*;
use crate::command::Configuration;
use crate::command::ScriptCommand;
use icd::fault::PlantReport;
use icd::tvc_jet;

fn with_script(text: &str) -> Autopilot {
    let mut settings = settings();
    settings.script = Some(Arc::new(Script::parse("s", text, &tvc_jet::effectors()).unwrap()));
    Autopilot::new(&settings)
}

/// Script events published since the last call.
fn script_events(autopilot: &mut Autopilot) -> Vec<ScriptEvent> {
    std::iter::from_fn(|| autopilot.pop_event())
        .filter_map(|event| match event.kind {
            EventKind::Script { event, .. } => Some(event),
            _ => None,
        })
        .collect()
}

#[test]
fn the_script_of_the_settings_begins_with_each_flight_and_not_with_one_under_way() {
    let mut autopilot = with_script("say now\nat 1 min: say late");
    for _ in 0..2 {
        autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
        assert_eq!(script_events(&mut autopilot).last(), Some(&ScriptEvent::Began));
        autopilot.step(SimTime::ZERO, &sensors());
        assert_eq!(script_events(&mut autopilot), [ScriptEvent::Line(1)]);
    }
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::from_micros(9_000_000), true);
    let published = script_events(&mut autopilot);
    let not_begun = ScriptEvent::NotBegun(NotBegun::JoinedInFlight);
    assert_eq!(published, [ScriptEvent::Stopped, not_begun]);
    autopilot.step(SimTime::from_micros(9_000_000), &sensors());
    assert_eq!(script_events(&mut autopilot), []);
}

#[test]
fn a_script_does_not_move_while_time_stands_still() {
    let mut autopilot = with_script("say now");
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    autopilot.hold(&sensors(), false);
    autopilot.hold(&sensors(), false);
    assert_eq!(script_events(&mut autopilot), [ScriptEvent::Began]);
    autopilot.step(SimTime::ZERO, &sensors());
    assert_eq!(script_events(&mut autopilot), [ScriptEvent::Line(1), ScriptEvent::Done]);
}

#[test]
fn faults_of_a_script_are_requests_with_their_own_numbers_and_a_refusal_names_the_line() {
    let mut autopilot = with_script("fail rudder stuck at 90 deg\nfail engine stuck");
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    autopilot.step(SimTime::ZERO, &sensors());
    let requests: Vec<_> = std::iter::from_fn(|| autopilot.next_request()).collect();
    assert_eq!(requests.len(), 2);
    assert!(requests.iter().all(|request| request.number >= FIRST_SCRIPT_REQUEST), "{requests:?}");
    let done = [ScriptEvent::Began, ScriptEvent::Line(1), ScriptEvent::Line(2), ScriptEvent::Done];
    assert_eq!(script_events(&mut autopilot), done);
    let what = icd::fault::Quantity::Angle;
    let refusal = Refusal::OutOfRange { what, value: 1.6, min: -0.5, max: 0.5 };
    for (request, reply) in requests
        .iter()
        .zip([FaultReply::Refused(refusal), FaultReply::Applied { at: SimTime::ZERO }])
    {
        let request = request.number;
        autopilot.handle_report(&PlantReport::FaultReply { request, reply });
    }
    let published: Vec<_> = std::iter::from_fn(|| autopilot.pop_event()).map(|e| e.kind).collect();
    let why = LineRefusal::Plant { target: Some(tvc_jet::RUDDER.into()), refusal };
    let [EventKind::Script { event, .. }] = published[..] else { panic!("{published:?}") };
    assert_eq!(event, ScriptEvent::LineRefused { line: 1, why });
}

#[test]
fn a_request_of_a_script_that_the_plant_leaves_without_an_answer_is_reported() {
    let mut autopilot = with_script("fail rudder stuck");
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    autopilot.step(SimTime::ZERO, &sensors());
    autopilot.next_request();
    script_events(&mut autopilot);
    autopilot.plant_lost();
    let why = LineRefusal::NoAnswer;
    assert_eq!(script_events(&mut autopilot), [ScriptEvent::LineRefused { line: 1, why }]);
}

#[test]
fn a_script_leaves_the_plant_room_for_others_and_goes_on_when_it_has_answered() {
    let text = "fail rudder stuck\n".repeat(20);
    let mut autopilot = with_script(&text);
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    let (mut time, mut requests) = (SimTime::ZERO, Vec::new());
    for _ in 0..3 {
        autopilot.step(time, &sensors());
        requests.extend(std::iter::from_fn(|| autopilot.next_request()));
        time = time + ControlPeriod::DEFAULT;
    }
    assert_eq!(requests.len(), 8, "unanswered at most");
    for _ in 0..20 {
        for PlantRequest { number: request, .. } in core::mem::take(&mut requests) {
            let reply = FaultReply::Applied { at: time };
            autopilot.handle_report(&PlantReport::FaultReply { request, reply });
        }
        autopilot.step(time, &sensors());
        requests.extend(std::iter::from_fn(|| autopilot.next_request()));
        time = time + ControlPeriod::DEFAULT;
    }
    let published = script_events(&mut autopilot);
    assert_eq!(published.last(), Some(&ScriptEvent::Done));
    assert_eq!(published.len(), 22, "began, 20 lines, done");
}

#[test]
fn a_script_flies_roll_in_reference_and_changes_modes_and_references() {
    let mut autopilot = with_script(
        "roll 15 deg\naltitude 6000 m\nairspeed 250 m/s\nat 2 ms: mode hold\nroll 5 deg",
    );
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    autopilot.step(SimTime::ZERO, &sensors());
    let demand = autopilot.snapshot().unwrap().demand;
    assert_eq!(demand.roll_rad, 15.0_f64.to_radians());
    assert_eq!((demand.altitude_m, demand.airspeed_m_s), (6_000.0, 250.0));
    script_events(&mut autopilot);
    autopilot.step(SimTime::ZERO + ControlPeriod::DEFAULT, &sensors());
    assert_eq!(autopilot.snapshot().unwrap().mode, Mode::Hold);
    let why = LineRefusal::Vehicle(VehicleRefusal::NoRollHere);
    let refused = ScriptEvent::LineRefused { line: 5, why };
    assert!(script_events(&mut autopilot).contains(&refused));
}

#[test]
fn without_fault_injection_the_scenarios_script_does_not_begin_if_it_has_faults() {
    for (text, expected) in [
        ("clear all", ScriptEvent::NotBegun(NotBegun::FaultInjectionOff)),
        ("say words", ScriptEvent::Began),
    ] {
        let mut autopilot = with_script(text);
        autopilot.handle_intent(Intent {
            number: 1,
            command: Command::Configuration(Configuration::FaultInjection(false)),
        });
        autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
        assert_eq!(script_events(&mut autopilot), [expected]);
    }
}

#[test]
fn a_script_ends_with_its_flight() {
    let mut autopilot = with_script("at 1 min: say late");
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    autopilot.step(SimTime::ZERO, &sensors());
    script_events(&mut autopilot);
    autopilot.handle_report(&PlantReport::GroundContact { at: SimTime::ZERO });
    assert_eq!(script_events(&mut autopilot), [ScriptEvent::Stopped]);
    autopilot.handle_intent(Intent { number: 1, command: Command::Script(ScriptCommand::Stop) });
    let outcome = Outcome::Refused(VehicleRefusal::NoScript);
    assert_eq!(outcomes(&mut autopilot), [(1, outcome)]);
}

#[test]
fn a_script_executes_a_limited_number_of_lines_in_a_tick_and_the_rest_in_the_next_ones() {
    let mut autopilot = with_script(&"say x\n".repeat(100));
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    script_events(&mut autopilot);
    let mut time = SimTime::ZERO;
    let mut all = Vec::new();
    for lines in [32, 32, 32, 4] {
        autopilot.step(time, &sensors());
        let published = script_events(&mut autopilot);
        let count = published.iter().filter(|event| matches!(event, ScriptEvent::Line(_))).count();
        assert_eq!(count, lines);
        all.extend(published);
        time = time + ControlPeriod::DEFAULT;
    }
    let expected: Vec<_> = (1..=100).map(ScriptEvent::Line).chain([ScriptEvent::Done]).collect();
    assert_eq!(all, expected);
}

#[test]
fn a_crossing_during_the_turn_of_other_lines_is_not_missed() {
    let lines = "say x\n".repeat(100);
    // The crossing there and back ends before the first sequence.
    let mut autopilot =
        with_script(&format!("{lines}sequence b\nwhen altitude rises above 5500 m: say high\n"));
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    let mut time = SimTime::ZERO;
    for altitude_m in [5_000.0, 6_000.0, 5_000.0, 5_000.0] {
        let mut sensors = sensors();
        sensors.barometer.value.altitude_m = altitude_m;
        autopilot.step(time, &sensors);
        time = time + ControlPeriod::DEFAULT;
    }
    assert!(script_events(&mut autopilot).contains(&ScriptEvent::Line(102)));
}

#[test]
fn lines_of_a_script_give_way_to_reports_of_faults_and_the_loss_is_reported_last() {
    use icd::fault::{FaultEntry, FaultState, Timing};
    let mut autopilot = with_script(&"say x\n".repeat(256));
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    let mut time = SimTime::ZERO;
    for id in 1..=20 {
        autopilot.step(time, &sensors());
        autopilot.handle_report(&PlantReport::Fault(FaultEntry {
            id,
            target: tvc_jet::RUDDER.into(),
            kind: FaultKind::StuckHere,
            timing: Timing::NOW,
            state: FaultState::Active { since: time },
        }));
        time = time + ControlPeriod::DEFAULT;
    }
    let published: Vec<_> = std::iter::from_fn(|| autopilot.pop_event()).map(|e| e.kind).collect();
    let count = |is_it: fn(&EventKind) -> bool| published.iter().filter(|kind| is_it(kind)).count();
    assert_eq!(count(|kind| matches!(kind, EventKind::Fault(_))), 20);
    let began = |kind: &EventKind| {
        matches!(kind, EventKind::Script { event: ScriptEvent::Began | ScriptEvent::Done, .. })
    };
    assert_eq!(count(began), 2);
    assert_eq!(published.len(), EVENTS_MAX + 1);
    assert!(matches!(published.last(), Some(EventKind::EventsLost(1..))), "{:?}", published.last());
    assert_eq!(autopilot.pop_event(), None, "published once");
}
