//! The fault parameters of the effectors.

use super::params::{set_int, set_real};
use super::world::*;
use ::mavlink::dialects::common::PARAM_ERROR_DATA;
use flight_management::command::Command;
use flight_management::parameters::{fault_parameters, is_fault};
use icd::fault::{FaultEntry, FaultReply, FaultState, PlantReport, Refusal, Timing};
use icd::fault::{PlantAction, Target};
use icd::tvc_jet;
use icd::{ControlPeriod, FaultKind, FaultRequest, SimTime};

/// Name and value of each PARAM_VALUE of a fault parameter since the last call.
fn values(world: &mut World) -> Vec<(String, i32)> {
    let values = world.values(address(14_550));
    let values = values.iter().map(|value| {
        let bits = value.param_value.to_le_bytes();
        (value.param_id.to_str().unwrap().to_owned(), i32::from_le_bytes(bits))
    });
    let values = values.filter(|(name, _)| is_fault(name)).collect();
    world.got.retain(|got| got.id != 22);
    values
}

fn one(name: &str, value: i32) -> Vec<(String, i32)> {
    vec![(name.to_owned(), value)]
}

#[test]
fn each_parameter_breaks_its_effector_with_each_type_and_mends_it() {
    for row in fault_parameters(&tvc_jet::effectors()) {
        for code in 1..=8 {
            // A sensor is not slow, and a part is torn off or whole.
            match row.target {
                Target::Sensor(_) if code == 5 => continue,
                Target::Part(_) if code != 1 => continue,
                _ => {}
            }
            let mut world = World::flying();
            world.take_commands();
            world.send(&set_int(&row.name, code));
            assert_eq!(values(&mut world), one(&row.name, code), "one answer");
            let commands = world.take_commands();
            let [Command::Plant(PlantAction::Fault(request))] = &commands[..] else {
                panic!("{commands:?}")
            };
            assert_eq!(request.target(), Some(row.target));
            world.send(&set_int(&row.name, 0));
            assert_eq!(values(&mut world), one(&row.name, 0), "mended");
        }
    }
}

#[test]
fn the_sizes_are_latched_when_it_is_set() {
    let mut world = World::flying();
    world.send(&set_int("FLT_WRONG_MODE", 1));
    world.send(&set_real("FLT_BIAS_DEG", 3.0));
    world.take_commands();
    world.send(&set_int("FLT_SERVO5", 4));
    let commands = world.take_commands();
    let bias = 3.0_f64.to_radians();
    assert!(
        matches!(commands[..], [Command::Plant(PlantAction::Fault(FaultRequest::Inject {
            kind: FaultKind::Biased { bias: commanded }, ..
        }))] if commanded == bias),
        "{commands:?}"
    );
    world.send(&set_real("FLT_BIAS_DEG", 9.0));
    world.run_ms(100);
    assert!(
        !world
            .take_commands()
            .iter()
            .any(|command| matches!(command, Command::Plant(PlantAction::Fault(_))))
    );
}

#[test]
fn the_value_follows_faults_commanded_in_another_way_and_ends_with_the_flight() {
    let mut world = World::flying();
    world.send_command(420, [102.0, 5.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(values(&mut world), one("FLT_SERVO3", 5));
    world.send_command(420, [102.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(values(&mut world), one("FLT_SERVO3", 0));
    world.send_command(420, [101.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(values(&mut world), one("FLT_MOTOR1", 1));
    world.autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    world.settle();
    assert_eq!(values(&mut world), one("FLT_MOTOR1", 0));
}

#[test]
fn a_refused_value_is_answered_with_the_present_value_and_the_reason() {
    let no_fault = FaultReply::Refused(Refusal::NotForThisEffector);
    for (plant, before, value, words) in [
        (PlantManner::Answers(no_fault), 1, 2, "this effector has no such fault"),
        (PlantManner::Willing, 0, 2, "SYS_FAILURE_EN 0"),
        (PlantManner::Willing, 1, 9, "is outside 0 to 8"),
        (PlantManner::Willing, 1, -1, "is outside 0 to 8"),
    ] {
        let mut world = World::flying();
        world.plant = plant;
        world.send(&set_int("SYS_FAILURE_EN", before));
        world.got.clear();
        world.send(&set_int("FLT_SERVO1", value));
        assert!(world.got.iter().any(|got| got.read::<PARAM_ERROR_DATA>().is_some()));
        assert_eq!(values(&mut world), one("FLT_SERVO1", 0), "{words}");
        assert!(world.has_text(words), "{words}: {:?}", world.texts());
    }
}

#[test]
fn one_fault_in_the_place_of_another_is_one_answer_with_the_new_value() {
    let mut world = World::flying();
    world.send(&set_int("FLT_SERVO1", 1));
    assert_eq!(values(&mut world), one("FLT_SERVO1", 1));
    let at = world.sim;
    world.plant = PlantManner::Answers(FaultReply::Applied { at });
    world.send(&set_int("FLT_SERVO1", 2));
    assert_eq!(values(&mut world), [], "its report is not there yet");
    // The plant reports the end of the old one first.
    let report = |id, kind, state| {
        let effector = tvc_jet::LEFT_AILERON;
        PlantReport::Fault(FaultEntry {
            id,
            target: effector.into(),
            kind,
            timing: Timing::at(at),
            state,
        })
    };
    for report in [
        report(1, FaultKind::Float, FaultState::Ended { at }),
        report(2, FaultKind::StuckHere, FaultState::Active { since: at }),
    ] {
        world.autopilot.handle_report(&report);
    }
    world.settle();
    assert_eq!(values(&mut world), one("FLT_SERVO1", 2));
}

#[test]
fn a_silent_plant_is_answered_for_within_a_second() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    world.send(&set_int("FLT_SERVO2", 2));
    world.run_ms(600);
    assert_eq!(values(&mut world), []);
    world.run_ms(300);
    assert_eq!(values(&mut world), one("FLT_SERVO2", 0));
    assert!(world.has_text("Not confirmed: right aileron: the aircraft does not answer"));
    // Without a flight at once.
    let mut world = World::waiting();
    world.settle();
    world.got.clear();
    world.send(&set_int("FLT_SERVO2", 2));
    assert_eq!(values(&mut world), one("FLT_SERVO2", 0));
    assert!(world.has_text("no aircraft is connected"), "{:?}", world.texts());
}

#[test]
fn a_flood_of_commands_is_refused_and_each_is_answered() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    for _ in 0..100 {
        world.send(&set_int("FLT_SERVO2", 2));
    }
    world.run_ms(1_000);
    assert_eq!(values(&mut world).len(), 100);
}

#[test]
fn fault_parameters_are_never_saved() {
    let mut world = World::flying();
    world.ground.keep_parameters(*world.ground.parameters());
    world.send(&set_int("FLT_SERVO1", 2));
    assert_eq!(values(&mut world), one("FLT_SERVO1", 2));
    assert_eq!(world.ground.pop_save(), None);
}

/// The plant's report of a fault of the first servo.
fn report(world: &mut World, id: u32, kind: FaultKind, state: FaultState) {
    let effector = tvc_jet::LEFT_AILERON;
    let timing = Timing::at(world.sim);
    let entry = FaultEntry { id, target: effector.into(), kind, timing, state };
    world.autopilot.handle_report(&PlantReport::Fault(entry));
    world.settle();
}

#[test]
fn a_resting_and_a_scheduled_fault_have_their_value_and_0_mends_them() {
    for state in [
        FaultState::Resting { since: SimTime::ZERO, next: SimTime::from_micros(123_900_000) },
        FaultState::Scheduled { at: SimTime::from_micros(123_900_000) },
    ] {
        let mut world = World::flying();
        report(&mut world, 1, FaultKind::StuckHere, state);
        assert_eq!(values(&mut world), one("FLT_SERVO1", 2), "{state:?}");
        let at = world.sim;
        // The plant has the same fault already.
        world.plant = PlantManner::Answers(FaultReply::Unchanged { at });
        world.send(&set_int("FLT_SERVO1", 2));
        assert_eq!(values(&mut world), one("FLT_SERVO1", 2), "{state:?}");
        world.plant = PlantManner::Answers(FaultReply::Cleared { at });
        world.take_commands();
        world.send(&set_int("FLT_SERVO1", 0));
        let commands = world.take_commands();
        assert!(
            matches!(
                commands[..],
                [Command::Plant(PlantAction::Fault(FaultRequest::Clear { .. }))]
            ),
            "{commands:?}"
        );
        report(&mut world, 1, FaultKind::StuckHere, FaultState::Cancelled { at });
        assert_eq!(values(&mut world), one("FLT_SERVO1", 0), "{state:?}");
    }
}

#[test]
fn an_active_fault_goes_before_a_scheduled_one() {
    let mut world = World::flying();
    let at = SimTime::from_micros(99_000_000);
    report(&mut world, 1, FaultKind::StuckHere, FaultState::Scheduled { at });
    report(&mut world, 2, FaultKind::Float, FaultState::Active { since: SimTime::ZERO });
    assert_eq!(values(&mut world).last(), one("FLT_SERVO1", 1).last());
    let next = SimTime::from_micros(123_900_000);
    let resting = FaultState::Resting { since: SimTime::ZERO, next };
    report(&mut world, 2, FaultKind::Float, resting);
    assert_eq!(values(&mut world), one("FLT_SERVO1", 2), "the next one");
}

#[test]
fn a_value_that_is_another_than_the_one_that_was_set_comes_with_the_reason() {
    let mut world = World::flying();
    let at = world.sim;
    world.plant = PlantManner::Answers(FaultReply::Applied { at });
    world.send(&set_int("FLT_SERVO1", 2));
    report(&mut world, 1, FaultKind::StuckHere, FaultState::Active { since: at });
    assert_eq!(values(&mut world), one("FLT_SERVO1", 2));
    // It ends before its parameter is published.
    world.send(&set_int("FLT_SERVO1", 3));
    world.run_ms(800);
    assert_eq!(values(&mut world), one("FLT_SERVO1", 2));
    let words = "Not as set: left aileron: there is another fault, stuck, since";
    assert!(world.has_text(words), "{:?}", world.texts());
    report(&mut world, 1, FaultKind::StuckHere, FaultState::Ended { at });
    values(&mut world);
    world.send(&set_int("FLT_SERVO1", 3));
    world.run_ms(800);
    assert_eq!(values(&mut world), one("FLT_SERVO1", 0));
    assert!(
        world.has_text("Not as set: left aileron: the fault is over already"),
        "{:?}",
        world.texts()
    );
}
