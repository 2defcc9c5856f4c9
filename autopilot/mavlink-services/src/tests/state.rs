//! Arming, the end of a flight, takeoff and landing, the pace of the simulation.

use super::world::*;
use ::mavlink::dialects::common::MavResult;
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use icd::fault::PlantAction;
use icd::fault::PlantReport;
use icd::pace::Pace;

const NAN: f32 = f32::NAN;
const ACCEPTED: MavResult = MavResult::MAV_RESULT_ACCEPTED;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
const FAILED: MavResult = MavResult::MAV_RESULT_FAILED;
const LATER: MavResult = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;
const UNSUPPORTED: MavResult = MavResult::MAV_RESULT_UNSUPPORTED;

const FORCE: f32 = 21_196.0;

fn one(p1: f32, p2: f32) -> [f32; 7] {
    [p1, p2, 0.0, 0.0, 0.0, 0.0, 0.0]
}

fn terminations(world: &mut World) -> usize {
    world
        .take_commands()
        .iter()
        .filter(|command| matches!(command, Command::Vehicle(VehicleCommand::Terminate)))
        .count()
}

fn on_the_ground() -> World {
    let mut world = World::flying();
    let at = world.sim;
    world.autopilot.handle_report(&PlantReport::GroundContact { at });
    world.settle();
    world.got.clear();
    world
}

#[test]
fn arming_is_a_fact_in_the_air_and_disarming_is_refused_with_the_reason() {
    let mut world = World::flying();
    world.send_command(400, one(1.0, 0.0));
    world.send_command(400, one(1.0, 2_989.0));
    world.send_command(400, one(0.0, 0.0));
    world.send_command(400, one(0.0, 2_989.0));
    world.send_command(400, one(0.0, NAN));
    assert_eq!(
        world.take_acks(),
        [ack(400, ACCEPTED), ack(400, ACCEPTED), ack(400, LATER), ack(400, LATER), ack(400, LATER)]
    );
    assert!(world.has_text("Disarming refused: the aircraft is in the air"), "{:?}", world.texts());
    assert!(world.take_commands().is_empty());
    for bad in [2.0, 0.5, NAN, f32::INFINITY] {
        world.send_command(400, one(bad, 0.0));
        assert_eq!(world.take_acks(), [ack(400, DENIED)], "{bad}");
    }
}

#[test]
fn disarming_by_force_in_the_air_terminates_the_flight_with_a_text() {
    let mut world = World::flying();
    world.send_command(400, one(0.0, FORCE));
    assert_eq!(world.take_acks(), [ack(400, ACCEPTED)]);
    assert_eq!(terminations(&mut world), 1);
    assert!(world.has_text("the flight is terminated"), "{:?}", world.texts());
}

#[test]
fn disarming_on_the_ground_is_a_fact_by_force_or_not() {
    let mut world = on_the_ground();
    world.send_command(400, one(0.0, 0.0));
    world.send_command(400, one(0.0, FORCE));
    world.send_command(400, one(1.0, FORCE));
    assert_eq!(world.take_acks(), [ack(400, ACCEPTED), ack(400, ACCEPTED), ack(400, LATER)]);
    assert!(
        world.has_text("PreArm: the flight is over: a reboot begins a new one"),
        "{:?}",
        world.texts()
    );
    assert_eq!(terminations(&mut world), 0);
}

#[test]
fn only_more_than_a_half_terminates_a_flight() {
    let mut world = World::flying();
    for (p1, expected) in [(0.0, FAILED), (0.5, FAILED), (-1.0, FAILED), (NAN, DENIED)] {
        world.send_command(185, one(p1, 0.0));
        assert_eq!(world.take_acks(), [ack(185, expected)], "{p1}");
    }
    assert_eq!(terminations(&mut world), 0);
    world.send_command(185, one(1.0, 0.0));
    assert_eq!(world.take_acks(), [ack(185, ACCEPTED)]);
    assert_eq!(terminations(&mut world), 1);
    world.run_ms(10);
    assert!(world.autopilot.snapshot().unwrap().terminated);
    world.send_command(400, one(1.0, 0.0));
    assert_eq!(world.take_acks(), [ack(400, LATER)]);
    assert!(world.has_text("PreArm: flight terminated, reboot the vehicle"), "{:?}", world.texts());
}

#[test]
fn a_station_may_stop_a_calibration_and_cannot_begin_one() {
    let mut world = World::flying();
    world.send_command(241, [0.0; 7]);
    assert_eq!(world.take_acks(), [ack(241, ACCEPTED)]);
    assert!(!world.has_text("alibration"), "a page that opens: {:?}", world.texts());
    for params in [one(1.0, 0.0), one(NAN, 0.0)] {
        world.send_command(241, params);
        assert_eq!(world.take_acks(), [ack(241, UNSUPPORTED)]);
    }
    assert!(world.has_text("Calibration refused"));
}

#[test]
fn takeoff_and_landing_are_refused_with_the_reason() {
    let mut world = World::flying();
    world.send_command(22, [NAN; 7]);
    assert_eq!(world.take_acks(), [ack(22, LATER)]);
    assert!(world.has_text("Takeoff refused: the aircraft is in the air already"));
    for command in [21, 189] {
        world.send_command(command, [0.0, 0.0, 0.0, NAN, NAN, NAN, NAN]);
        assert_eq!(world.take_acks(), [ack(command, LATER)]);
    }
    assert!(world.has_text("the plan has no landing (NAV_LAND)"), "{:?}", world.texts());
    let mut world = on_the_ground();
    world.send_command(22, [NAN; 7]);
    assert_eq!(world.take_acks(), [ack(22, LATER)]);
    assert!(world.has_text("The flight is over: a reboot begins a new one"), "{:?}", world.texts());
}

#[test]
fn prearm_checks_are_rejected_in_the_air_and_report_the_reason_elsewhere() {
    let mut world = World::flying();
    world.send_command(401, [0.0; 7]);
    assert_eq!(world.take_acks(), [ack(401, LATER)]);
    let mut world = on_the_ground();
    world.send_command(401, [0.0; 7]);
    assert_eq!(world.take_acks(), [ack(401, ACCEPTED)]);
    assert!(world.has_text("PreArm: the flight is over"), "{:?}", world.texts());
}

#[test]
fn user_2_sets_the_pace_of_the_simulation() {
    for (params, expected) in [
        (one(0.0, 0.0), Pace::Pause),
        (one(1.0, NAN), Pace::Run),
        (one(2.0, 0.0), Pace::Step(1)),
        (one(2.0, NAN), Pace::Step(1)),
        (one(2.0, 25.0), Pace::Step(25)),
        (one(3.0, 0.1), Pace::Speed(0.1)),
    ] {
        let mut world = World::flying();
        world.send_command(31_011, params);
        let commands = world.take_commands();
        let [Command::Plant(PlantAction::Pace(pace))] = commands[..] else {
            panic!("{commands:?}")
        };
        assert_eq!(pace, expected);
        assert_eq!(world.take_acks(), [ack(31_011, ACCEPTED)]);
    }
}

#[test]
fn a_pace_that_is_none_is_denied_with_the_range() {
    let mut world = World::flying();
    for params in [
        one(4.0, 0.0),
        one(NAN, 0.0),
        one(2.0, -1.0),
        one(2.0, 1.5),
        one(2.0, 1.0e9),
        one(3.0, 0.0),
        one(3.0, NAN),
        one(3.0, f32::INFINITY),
        one(3.0, -1.0),
        one(3.0, 1.0e6),
    ] {
        world.send_command(31_011, params);
        assert_eq!(world.take_acks(), [ack(31_011, DENIED)], "{params:?}");
    }
    assert!(world.has_text("0.01 to 1000 times wall time"), "{:?}", world.texts());
    assert!(world.take_commands().is_empty());
}

#[test]
fn a_step_with_the_number_of_the_step_before_is_acknowledged_and_not_taken_again() {
    let mut world = World::flying();
    let step = |number| [2.0, 5.0, number, 0.0, 0.0, 0.0, 0.0];
    for (number, steps) in [(7.0, 1), (7.0, 0), (8.0, 1), (0.0, 1), (0.0, 1), (NAN, 1)] {
        world.send_command(31_011, step(number));
        assert_eq!(world.take_commands().len(), steps, "number {number}");
        assert_eq!(world.take_acks(), [ack(31_011, ACCEPTED)]);
    }
}

#[test]
fn a_numbered_step_that_was_refused_can_be_repeated() {
    let mut world = World::waiting();
    world.settle();
    let step = [2.0, 5.0, 7.0, 0.0, 0.0, 0.0, 0.0];
    for _ in 0..2 {
        world.send_command(31_011, step);
        assert_eq!(world.take_acks(), [ack(31_011, LATER)]);
    }
    world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
    world.take_commands();
    world.send_command(31_011, step);
    assert_eq!(world.take_commands().len(), 1);
    assert_eq!(world.take_acks(), [ack(31_011, ACCEPTED)]);
}
