use crate::Moment;
use crate::encoder::*;
use aircraft::DEFAULT_MODEL;
use flight_control::{Demand, FlightControl, Gains, NavigationState};
use flight_management::command::Intent;
use flight_management::command::VehicleCommand;
use flight_management::configuration;
use flight_management::event::{Axis, Event};
use flight_management::vehicle::Reference;
use icd::fault::PlantAction;
use icd::fault::{FaultEntry, FaultKind, FaultState, Timing};
use icd::tvc_jet;
use icd::{ControlPeriod, Sensors};

const PERIOD_US: u64 = 2_000;

fn at(step: u64) -> SimTime {
    SimTime::from_micros(step * PERIOD_US)
}

/// A step of level flight.
fn level() -> Step {
    let model = configuration::aircraft_model("model", DEFAULT_MODEL).unwrap();
    let mut flight = FlightControl::new(ControlPeriod::DEFAULT, &model, &Gains::REFERENCE);
    let state = NavigationState { airspeed_m_s: 264.0, ..NavigationState::at_rest() };
    let demand = Demand { altitude_m: 3_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 };
    let log = flight.step(&state, &demand);
    Step {
        time: SimTime::ZERO,
        sensors: Sensors::at(SimTime::ZERO, &[0.0; Sensors::COUNT]),
        actuators: log.actuators(),
        log,
        mode: Mode::Hold,
        references: [3_000.0, 0.0, 264.0],
        terminated: false,
        truth: None,
    }
}

fn fault(step: u64, id: u32) -> Entry {
    let state = FaultState::Active { since: at(step) };
    let (effector, kind) = (tvc_jet::RUDDER, FaultKind::StuckHere);
    let entry = FaultEntry { id, target: effector.into(), kind, timing: Timing::NOW, state };
    Entry::Fault { time: at(step), entry }
}

/// Flies `steps` steps; `change` modifies each of them and returns the entries before it. Returns the numbers of the steps
/// with rows, and the largest number of waiting entries.
fn fly(
    rate: LogRate,
    steps: u64,
    mut change: impl FnMut(u64, &mut Step) -> Vec<Entry>,
) -> Vec<u64> {
    let mut selection = Selection::new(rate, PERIOD_US as u32, SimTime::ZERO);
    let room = selection.waiting.capacity();
    let mut step = level();
    let (mut with_rows, mut left) = (Vec::new(), 0);
    let mut leave = |selection: &mut Selection| {
        while let Some((entry, has_rows)) = selection.pop() {
            let Entry::Step(step) = entry else { continue };
            assert_eq!(step.time, at(left), "out of order");
            if has_rows {
                with_rows.push(left);
            }
            left += 1;
        }
    };
    for number in 0..steps {
        step.time = at(number);
        for entry in change(number, &mut step) {
            selection.push(entry);
            leave(&mut selection);
        }
        selection.push(Entry::Step(step));
        leave(&mut selection);
    }
    assert_eq!(selection.waiting.capacity(), room, "it allocates once");
    selection.settle();
    leave(&mut selection);
    assert_eq!(left, steps);
    with_rows
}

/// Steps that have rows in a flight without events: one of 25, and the last tenth of a second.
fn quiet(steps: u64) -> Vec<u64> {
    (0..steps).filter(|n| n % 25 == 0 || *n + 55 >= steps).collect()
}

#[test]
fn a_quiet_flight_has_twenty_rows_a_second() {
    assert_eq!(fly(LogRate::Events, 10_000, |_, _| Vec::new()), quiet(10_000));
    let full = fly(LogRate::Full, 3_000, |_, _| Vec::new());
    assert_eq!(full, Vec::from_iter(0..3_000));
    assert_eq!(
        [1_000, 2_000, 3_000, 4_000].map(|us| LogRate::Events.row_every(us)),
        [50, 25, 16, 12]
    );
}

#[test]
fn a_step_waits_for_a_tenth_of_a_second_and_none_does_after_an_event() {
    let mut selection = Selection::new(LogRate::Events, PERIOD_US as u32, SimTime::ZERO);
    let step = level();
    for number in 0..600 {
        if number == 300 {
            selection.push(fault(number, 1));
        }
        selection.push(Entry::Step(Step { time: at(number), ..step }));
        while selection.pop().is_some() {}
        let waiting = match number {
            0..300 => (number + 1).min(55),
            300..=500 => 0,
            _ => (number - 500).min(55),
        };
        assert_eq!(selection.waiting.len() as u64, waiting, "step {number}");
    }
}

#[test]
fn all_steps_around_an_event_have_rows() {
    type Change = fn(u64, &mut Step) -> Vec<Entry>;
    fn input(command: Command) -> Vec<Entry> {
        let what = Recorded::Intent(Intent { number: 1, command });
        vec![Entry::Recorded { time: at(5_000), moment: Moment::Step, what }]
    }
    let event = |kind| vec![Entry::Event(Event { time: at(5_000), kind })];
    let events = [
        event(EventKind::AuthorityRestored(Axis::Yaw)),
        event(EventKind::GroundContact),
        input(Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(100.0)))),
        vec![fault(5_000, 1)],
    ];
    let expected: Vec<u64> = {
        let quiet = quiet(10_000);
        (0..10_000).filter(|n| quiet.contains(n) || (4_945..=5_200).contains(n)).collect()
    };
    for happening in events {
        let name = format!("{happening:?}");
        let mut happening = Some(happening);
        let rows = fly(LogRate::Events, 10_000, |number, _| {
            if number == 5_000 { happening.take().unwrap_or_default() } else { Vec::new() }
        });
        // The event comes before its own step, so the tenth of a second before it counts from the step before.
        let missing: Vec<_> = expected.iter().filter(|n| !rows.contains(n)).collect();
        assert!(missing.is_empty() && rows.len() <= expected.len() + 1, "{name}: {missing:?}");
    }
    let changes: [(&str, Change); 4] = [
        ("compensator", |number, step| {
            step.log.compensator_active = number >= 5_000;
            Vec::new()
        }),
        ("mode", |number, step| {
            step.mode = if number < 5_000 { Mode::Hold } else { Mode::Mission };
            Vec::new()
        }),
        ("reference", |number, step| {
            step.references[1] = if number < 5_000 { 0.0 } else { 0.1 };
            Vec::new()
        }),
        ("terminated", |number, step| {
            step.terminated = number >= 5_000;
            Vec::new()
        }),
    ];
    for (name, change) in changes {
        assert!(fly(LogRate::Events, 10_000, change) == expected, "{name}");
    }
}

#[test]
fn streams_pauses_and_slow_changes_are_no_events() {
    let stream = |number: u64, step: &mut Step| {
        step.references[0] += 0.05;
        let what = Recorded::Intent(Intent {
            number: 1,
            command: Command::Plant(PlantAction::ListFaults),
        });
        vec![Entry::Recorded { time: at(number), moment: Moment::Step, what }]
    };
    assert_eq!(fly(LogRate::Events, 10_000, stream), quiet(10_000));
}

#[test]
fn a_log_keeps_to_its_size_whatever_recurs_in_the_flight() {
    let mut id = 0;
    let minutes = 4;
    let steps = minutes * 30_000;
    let rows = fly(LogRate::Events, steps, |number, _| {
        // A change each 0.2 s, but for two quiet minutes.
        if number % 100 == 0 && !(30_000..90_000).contains(&number) {
            id += 1;
            vec![fault(number, id)]
        } else {
            Vec::new()
        }
    });
    for minute in 0..minutes {
        let of_minute = minute * 30_000..(minute + 1) * 30_000;
        let count = rows.iter().filter(|row| of_minute.contains(row)).count() as u64;
        let quiet = quiet(steps).iter().filter(|row| of_minute.contains(row)).count() as u64;
        // All that is saved up, and what comes back within the minute.
        let most = quiet + u64::from(CREDIT_MAX) + 60_000_000 / CREDIT_EVERY_US;
        assert!(most <= 1_900, "{most} rows of 2.1 kB are more than 4 MB");
        match minute {
            1 | 2 => assert!(count <= quiet + 200, "{count} rows in a quiet minute"),
            // A tenth of a second of rows belongs to the minute before, and the last one finds no credit.
            _ => assert!((most - 110..=most).contains(&count), "{count} rows, {most} at most"),
        }
    }
}

#[test]
fn waiting_entries_are_bounded_while_time_stands_still() {
    let mut selection = Selection::new(LogRate::Events, 2_000, SimTime::ZERO);
    selection.push(Entry::Step(level()));
    for number in 0..5_000 {
        let text = format!("{number}");
        selection.push(Entry::Text { time: SimTime::ZERO, severity: 6, text });
        while selection.pop().is_some() {}
        assert!(selection.waiting.len() < WAITING_MAX);
    }
    selection.settle();
    while selection.pop().is_some() {}
    assert_eq!(selection.waiting.len(), 0);
}
