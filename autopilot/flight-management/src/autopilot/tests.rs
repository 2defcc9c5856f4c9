use super::*;
use crate::command::Configuration;
use crate::command::FIRST_SCRIPT_REQUEST;
use crate::command::VehicleCommand;
use crate::configuration;
use crate::parameters::Parameters;
use crate::script::{LineRefusal, NotBegun, ScriptEvent};
use crate::vehicle::{Mode, Reference, VehicleEvent};
use aircraft::DEFAULT_MODEL;
use icd::fault::{FaultReply, FaultRequest, Refusal};
use icd::fault::{PlantAction, PlantReport, PlantRequest};
use icd::pace::Pace;
use icd::sensors::SensorKind;
use icd::tvc_jet;
use icd::{FaultKind, PerEffector};

mod scripts;

fn settings() -> Settings {
    Settings {
        model: configuration::aircraft_model("model", DEFAULT_MODEL).unwrap(),
        gains: Gains::REFERENCE,
        limits: Parameters::default().limits,
        navigation: Parameters::default().navigation,
        references: ReferenceSchedule::default(),
        script: None,
        own_law: None,
        fault_injection: true,
    }
}

fn autopilot() -> Autopilot {
    Autopilot::new(&settings())
}

fn sensors() -> Sensors {
    let mut values = [0.0; Sensors::COUNT];
    values[6] = 1.0;
    let mut level = Sensors::at(SimTime::ZERO, &values);
    level.barometer.value.altitude_m = 5_000.0;
    level.pitot.value.airspeed_m_s = 264.0;
    level.engine_n.value = 27_000.0;
    level.keep(&SensorKind::ALL.map(|kind| kind <= SensorKind::Magnetometer));
    level
}

fn flying() -> Autopilot {
    let mut autopilot = autopilot();
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    autopilot.step(SimTime::ZERO, &sensors());
    while autopilot.pop_event().is_some() {}
    autopilot
}

fn break_rudder(number: u32) -> Intent {
    let kind = FaultKind::StuckHere;
    let timing = icd::fault::Timing::NOW;
    Intent {
        number,
        command: Command::Plant(PlantAction::Fault(FaultRequest::Inject {
            target: tvc_jet::RUDDER.into(),
            kind,
            timing,
        })),
    }
}

fn outcomes(autopilot: &mut Autopilot) -> Vec<(u32, Outcome)> {
    std::iter::from_fn(|| autopilot.pop_event())
        .filter_map(|event| match event.kind {
            EventKind::Outcome { number, outcome } => Some((number, outcome)),
            _ => None,
        })
        .collect()
}

#[test]
fn a_fault_has_no_outcome_before_the_plant_answers() {
    let mut autopilot = flying();
    autopilot.handle_intent(break_rudder(7));
    assert_eq!(outcomes(&mut autopilot), []);
    assert_eq!(autopilot.next_request().map(|request| request.number), Some(7));
    assert_eq!(outcomes(&mut autopilot), []);
    let reply = FaultReply::Refused(Refusal::FlightOver);
    autopilot.handle_report(&PlantReport::FaultReply { request: 7, reply });
    assert_eq!(outcomes(&mut autopilot), [(7, Outcome::Plant(reply))]);
    autopilot.handle_report(&PlantReport::FaultReply { request: 7, reply });
    assert_eq!(outcomes(&mut autopilot), [], "one outcome an intent");
}

#[test]
fn every_open_request_is_answered_when_the_plant_goes_away() {
    let mut autopilot = flying();
    autopilot.handle_intent(break_rudder(1));
    autopilot.next_request();
    autopilot.handle_intent(break_rudder(2));
    autopilot.handle_intent(Intent { number: 3, command: Command::Plant(PlantAction::Restart) });
    autopilot.plant_lost();
    let mut numbers: Vec<u32> = outcomes(&mut autopilot)
        .into_iter()
        .map(|(number, outcome)| {
            assert_eq!(outcome, Outcome::NoAnswer);
            number
        })
        .collect();
    numbers.sort_unstable();
    assert_eq!(numbers, [1, 2, 3]);
    autopilot.handle_intent(break_rudder(4));
    assert_eq!(outcomes(&mut autopilot), [(4, Outcome::Refused(VehicleRefusal::NoFlight))]);
}

#[test]
fn a_restart_is_done_when_the_new_flight_begins() {
    let mut autopilot = flying();
    autopilot.handle_intent(Intent { number: 5, command: Command::Plant(PlantAction::Restart) });
    autopilot.next_request();
    assert_eq!(outcomes(&mut autopilot), []);
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    assert_eq!(outcomes(&mut autopilot), [(5, Outcome::Done)]);
}

#[test]
fn a_pace_takes_effect_when_the_plant_reports_it_and_is_published() {
    let mut autopilot = flying();
    autopilot.handle_intent(Intent {
        number: 5,
        command: Command::Plant(PlantAction::Pace(Pace::Step(3))),
    });
    let request = PlantRequest { number: 5, action: PlantAction::Pace(Pace::Step(3)) };
    assert_eq!(autopilot.next_request(), Some(request));
    assert_eq!(outcomes(&mut autopilot), []);
    let at = SimTime::from_micros(6_000);
    let report = PlantReport::Paced { request: Some(5), pace: Pace::Step(3), at };
    autopilot.handle_report(&report);
    let published: Vec<_> = std::iter::from_fn(|| autopilot.pop_event()).collect();
    let outcome = EventKind::Outcome { number: 5, outcome: Outcome::Done };
    assert_eq!(published[0].kind, outcome);
    assert_eq!(published[1], Event { time: at, kind: EventKind::Paced(Pace::Step(3)) });
    // A request at the plant itself: an event, without an outcome.
    autopilot.handle_report(&PlantReport::Paced { request: None, pace: Pace::Run, at });
    assert_eq!(outcomes(&mut autopilot), []);
}

#[test]
fn a_pace_that_cannot_be_does_not_reach_the_plant() {
    let mut autopilot = flying();
    let paces = [Pace::Step(0), Pace::Step(Pace::STEPS_MAX + 1), Pace::Speed(f64::NAN)];
    for (number, pace) in (0..).zip(paces) {
        autopilot
            .handle_intent(Intent { number, command: Command::Plant(PlantAction::Pace(pace)) });
    }
    assert_eq!(autopilot.next_request(), None);
    let refused = outcomes(&mut autopilot);
    assert_eq!(refused.len(), paces.len());
    let out_of_range =
        |outcome: &Outcome| matches!(outcome, Outcome::Refused(VehicleRefusal::OutOfRange { .. }));
    assert!(refused.iter().all(|(_, outcome)| out_of_range(outcome)), "{refused:?}");
    autopilot.hold(&sensors(), true);
    autopilot.handle_intent(Intent {
        number: 7,
        command: Command::Plant(PlantAction::Pace(Pace::Step(1))),
    });
    let over = Outcome::Refused(VehicleRefusal::FlightOver);
    assert_eq!(outcomes(&mut autopilot), [(7, over)]);
}

#[test]
fn a_full_queue_to_the_plant_is_reported_and_does_not_grow() {
    let mut autopilot = flying();
    for number in 0..100 {
        autopilot.handle_intent(break_rudder(number));
    }
    let refused = outcomes(&mut autopilot);
    assert_eq!(refused.len(), 100 - REQUESTS_MAX);
    assert!(refused.iter().all(|(_, outcome)| *outcome == Outcome::NoAnswer));
}

#[test]
fn outcomes_survive_a_flood_of_other_events() {
    let mut autopilot = flying();
    autopilot.handle_intent(Intent {
        number: 9,
        command: Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(6_000.0))),
    });
    for _ in 0..1000 {
        autopilot.handle_report(&PlantReport::GroundContact { at: SimTime::ZERO });
    }
    let published: Vec<_> = std::iter::from_fn(|| autopilot.pop_event()).map(|e| e.kind).collect();
    let outcomes = published.iter().filter(|kind| matches!(kind, EventKind::Outcome { .. }));
    let done = EventKind::Outcome { number: 9, outcome: Outcome::Done };
    assert_eq!(outcomes.collect::<Vec<_>>(), [&done]);
    assert!(matches!(published.last(), Some(EventKind::EventsLost(1..))), "{:?}", published.last());
}

#[test]
fn holding_changes_nothing_that_flies() {
    let mut one = flying();
    let mut other = flying();
    for _ in 0..10 {
        other.hold(&sensors(), false);
    }
    let time = SimTime::from_micros(2_000);
    assert_eq!(one.step(time, &sensors()), other.step(time, &sensors()));
}

#[test]
fn a_new_flight_is_flown_like_the_first_whatever_the_commands_before() {
    let mut used = flying();
    used.handle_intent(Intent {
        number: 1,
        command: Command::Vehicle(VehicleCommand::Mode(Mode::Offboard)),
    });
    used.handle_intent(Intent {
        number: 2,
        command: Command::Vehicle(VehicleCommand::Refer(Reference::Roll(0.3))),
    });
    used.step(SimTime::from_micros(2_000), &sensors());
    used.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    let mut fresh = autopilot();
    fresh.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    assert_eq!(used.step(SimTime::ZERO, &sensors()), fresh.step(SimTime::ZERO, &sensors()));
}

#[test]
fn two_commands_for_a_new_flight_are_one_request_and_each_has_its_outcome() {
    for lost in [false, true] {
        let mut autopilot = flying();
        autopilot
            .handle_intent(Intent { number: 5, command: Command::Plant(PlantAction::Restart) });
        autopilot
            .handle_intent(Intent { number: 6, command: Command::Plant(PlantAction::Restart) });
        assert_eq!(autopilot.next_request().map(|request| request.number), Some(5));
        assert_eq!(autopilot.next_request(), None, "requested once");
        let outcome = if lost {
            autopilot.plant_lost();
            Outcome::NoAnswer
        } else {
            autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
            Outcome::Done
        };
        assert_eq!(outcomes(&mut autopilot), [(5, outcome), (6, outcome)]);
        autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
        assert_eq!(outcomes(&mut autopilot), [], "one outcome an intent");
        autopilot
            .handle_intent(Intent { number: 7, command: Command::Plant(PlantAction::Restart) });
        assert_eq!(autopilot.next_request().map(|request| request.number), Some(7));
    }
}

#[test]
fn commands_for_a_new_flight_are_bounded() {
    let mut autopilot = flying();
    for number in 0..100 {
        autopilot.handle_intent(Intent { number, command: Command::Plant(PlantAction::Restart) });
    }
    let refused = outcomes(&mut autopilot);
    assert_eq!(refused.len(), 100 - REQUESTS_MAX);
    assert!(refused.iter().all(|(_, outcome)| *outcome == Outcome::NoAnswer));
}

fn outcomes_of_commands(autopilot: &mut Autopilot) -> Vec<Outcome> {
    let limits = Parameters::default().limits;
    for command in [
        Command::Vehicle(VehicleCommand::Mode(Mode::Offboard)),
        Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(6_000.0))),
        Command::Configuration(Configuration::Gains(Box::new(Gains::REFERENCE))),
        Command::Configuration(Configuration::Limits(limits)),
    ] {
        autopilot.handle_intent(Intent { number: 1, command });
    }
    outcomes(autopilot).into_iter().map(|(_, outcome)| outcome).collect()
}

#[test]
fn modes_and_references_need_a_flying_aircraft_and_parameters_do_not() {
    let with = |outcome| [outcome, outcome, Outcome::Done, Outcome::Done];
    let mut autopilot = flying();
    autopilot.plant_lost();
    let refused = Outcome::Refused(VehicleRefusal::NoFlight);
    assert_eq!(outcomes_of_commands(&mut autopilot), with(refused), "plant lost");
    autopilot.plant_back();
    assert_eq!(outcomes_of_commands(&mut autopilot), with(Outcome::Done), "plant back");

    let over = Outcome::Refused(VehicleRefusal::FlightOver);
    let mut autopilot = flying();
    autopilot.handle_report(&PlantReport::GroundContact { at: SimTime::ZERO });
    assert_eq!(outcomes_of_commands(&mut autopilot), with(over), "ground contact reported");
    assert_eq!(autopilot.snapshot().map(|snapshot| snapshot.mode), Some(Mode::Position));
    let mut autopilot = flying();
    autopilot.hold(&sensors(), true);
    assert_eq!(outcomes_of_commands(&mut autopilot), with(over), "held on the ground");
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    autopilot.step(SimTime::ZERO, &sensors());
    assert_eq!(outcomes_of_commands(&mut autopilot), with(Outcome::Done), "a new flight");
}

#[test]
fn on_the_ground_the_snapshot_shows_the_contact_and_the_commands_stay() {
    let mut autopilot = flying();
    let before = autopilot.snapshot().unwrap().log.commands;
    let mut contact = sensors();
    contact.barometer.value.altitude_m = -0.2;
    contact.pitot.value.airspeed_m_s = 190.0;
    let held = autopilot.hold(&contact, true);
    let snapshot = autopilot.snapshot().unwrap();
    let motion = snapshot.motion();
    assert_eq!([motion.altitude_m, motion.airspeed_m_s], [-0.2, 190.0]);
    assert!(snapshot.on_ground);
    assert_eq!(held.commands, before);
}

#[test]
fn sensors_read_while_time_stands_still_are_shown_and_leave_no_trace() {
    let mut autopilot = flying();
    let mut slow = sensors();
    slow.pitot.value.airspeed_m_s = 190.0;
    autopilot.hold(&slow, false);
    assert_eq!(autopilot.snapshot().unwrap().motion().airspeed_m_s, 190.0);
    slow.pitot.valid = false;
    let state = autopilot.step(SimTime::from_micros(2_000), &slow).state;
    assert_eq!((state.airspeed_m_s, state.valid.airspeed), (264.0, false));
}

#[test]
fn a_terminated_flight_commands_the_stops_from_the_next_tick_on_until_the_next_flight() {
    let mut autopilot = flying();
    let stops = termination::commands(autopilot.model());
    autopilot
        .handle_intent(Intent { number: 1, command: Command::Vehicle(VehicleCommand::Terminate) });
    let log = *autopilot.step(SimTime::from_micros(2_000), &sensors());
    assert_eq!(log.actuators().commands, stops);
    assert!(autopilot.snapshot().unwrap().terminated);
    assert_eq!(autopilot.hold(&sensors(), false).commands, stops, "also while time stands still");
    for command in [
        Command::Vehicle(VehicleCommand::Mode(Mode::Hold)),
        Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(6_000.0))),
    ] {
        autopilot.handle_intent(Intent { number: 2, command });
    }
    let refused = Outcome::Refused(VehicleRefusal::Terminated);
    assert_eq!(outcomes(&mut autopilot), [(1, Outcome::Done), (2, refused), (2, refused)]);
    autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    let log = *autopilot.step(SimTime::ZERO, &sensors());
    assert_ne!(log.actuators().commands, stops);
    assert!(!autopilot.snapshot().unwrap().terminated);
}

#[test]
fn a_plan_is_taken_before_a_flight_and_a_home_is_not() {
    let mut autopilot = autopilot();
    let plan = Arc::new(Plan::default());
    autopilot
        .handle_intent(Intent { number: 1, command: Command::Vehicle(VehicleCommand::Plan(plan)) });
    let home = crate::vehicle::Place { latitude_rad: 0.1, longitude_rad: 0.1 };
    autopilot
        .handle_intent(Intent { number: 2, command: Command::Vehicle(VehicleCommand::Home(home)) });
    let refused = Outcome::Refused(VehicleRefusal::NoFlight);
    assert_eq!(outcomes(&mut autopilot), [(1, Outcome::Done), (2, refused)]);
}

#[test]
fn the_mode_changes_before_its_outcome_is_published() {
    let mut autopilot = flying();
    autopilot.handle_intent(Intent {
        number: 1,
        command: Command::Vehicle(VehicleCommand::Mode(Mode::Hold)),
    });
    let kinds: Vec<EventKind> =
        std::iter::from_fn(|| autopilot.pop_event()).map(|event| event.kind).collect();
    let done = EventKind::Outcome { number: 1, outcome: Outcome::Done };
    assert_eq!(kinds, [EventKind::Vehicle(VehicleEvent::Mode(Mode::Hold)), done]);
}

#[test]
fn a_mode_chosen_while_time_stands_still_is_shown_and_flies_the_same() {
    use crate::vehicle::Place;
    use crate::vehicle::plan::{Action, Item, Plan, Point, Progress};
    let point = Point { place: None, altitude_m: Some(6_000.0) };
    let action = Action::Waypoint { point, acceptance_m: None };
    let items = vec![Item { action, autocontinue: true }; 3];
    let home = Place { latitude_rad: 0.1, longitude_rad: 0.2 };
    let (mut shown, mut unseen) = (flying(), flying());
    let commands = [
        Command::Vehicle(VehicleCommand::Plan(Arc::new(Plan { id: 9, items }))),
        Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(6_000.0))),
        Command::Vehicle(VehicleCommand::Home(home)),
        Command::Vehicle(VehicleCommand::Mode(Mode::Mission)),
        Command::Vehicle(VehicleCommand::PlanItem(2)),
        Command::Vehicle(VehicleCommand::Mode(Mode::Hold)),
    ];
    let log = shown.snapshot().unwrap().log;
    for (number, command) in (0..).zip(commands) {
        shown.handle_intent(Intent { number, command: command.clone() });
        shown.hold(&sensors(), false);
        unseen.handle_intent(Intent { number, command });
    }
    let snapshot = *shown.snapshot().unwrap();
    let plan = snapshot.navigation;
    assert_eq!((plan.plan_id, plan.items, plan.item), (9, 3, 2));
    assert_eq!((plan.progress, plan.home), (Progress::Paused, Some(home)));
    assert_eq!((snapshot.demand.altitude_m, snapshot.mode), (6_000.0, Mode::Hold));
    assert_eq!(snapshot.log, log, "the step was what it was");
    for tick in 1..100 {
        let time = SimTime::from_micros(2_000 * tick);
        assert_eq!(shown.step(time, &sensors()), unseen.step(time, &sensors()));
    }
}

#[test]
fn a_new_home_is_published_before_its_outcome() {
    let mut autopilot = flying();
    let home = crate::vehicle::Place { latitude_rad: 0.1, longitude_rad: 0.2 };
    autopilot
        .handle_intent(Intent { number: 1, command: Command::Vehicle(VehicleCommand::Home(home)) });
    let kinds: Vec<EventKind> =
        std::iter::from_fn(|| autopilot.pop_event()).map(|event| event.kind).collect();
    let done = EventKind::Outcome { number: 1, outcome: Outcome::Done };
    assert_eq!(kinds, [EventKind::Vehicle(VehicleEvent::Home(home)), done]);
}

#[test]
fn the_positions_of_the_start_count_before_the_first_control_step_and_never_after() {
    let modelled = |before: bool, after: bool| {
        let positions = PerEffector::from_fn(|_| -0.1);
        let mut autopilot = autopilot();
        autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
        if before {
            autopilot.handle_report(&PlantReport::Started { positions });
        }
        let first = autopilot.step(SimTime::ZERO, &sensors()).modelled;
        if after {
            autopilot.handle_report(&PlantReport::Started { positions });
        }
        let second = autopilot.step(SimTime::from_micros(2_000), &sensors()).modelled;
        while let Some(event) = autopilot.pop_event() {
            assert!(matches!(event.kind, EventKind::FlightBegan { .. }), "{event:?}");
        }
        [first, second]
    };
    assert_eq!(modelled(true, false)[0][tvc_jet::LEFT_ELEVATOR], -0.1);
    assert_eq!(modelled(false, true), modelled(false, false));
}
