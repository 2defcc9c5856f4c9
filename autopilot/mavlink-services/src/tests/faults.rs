use super::world::*;
use ::mavlink::dialects::common::MavResult;
use flight_management::command::Command;
use icd::fault::PlantAction;
use icd::fault::{FaultEntry, FaultReply, FaultState, PlantReport, Refusal, Timing};
use icd::tvc_jet;
use icd::{Effector, FaultKind, SimTime};

const ACCEPTED: MavResult = MavResult::MAV_RESULT_ACCEPTED;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
const LATER: MavResult = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;

const STUCK_LEFT_AILERON: [f32; 7] = [102.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0];

fn answer_open_requests(world: &mut World, reply: FaultReply) {
    for intent in world.intents.clone() {
        if let Command::Plant(PlantAction::Fault(_)) = intent.command {
            world
                .autopilot
                .handle_report(&PlantReport::FaultReply { request: intent.number, reply });
        }
    }
    world.settle();
}

#[test]
fn a_fault_is_acknowledged_after_the_plants_answer_and_not_before() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    world.send_command(420, STUCK_LEFT_AILERON);
    world.run_ms(100);
    assert_eq!(world.take_acks(), []);
    let at = world.sim;
    answer_open_requests(&mut world, FaultReply::Applied { at });
    assert_eq!(world.take_acks(), [ack(420, ACCEPTED)]);
}

#[test]
fn an_identical_copy_that_comes_while_the_first_waits_gets_its_own_answer() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    world.send_command(420, STUCK_LEFT_AILERON);
    world.run_ms(500);
    world.send_command(420, STUCK_LEFT_AILERON);
    world.run_ms(10);
    assert_eq!(world.intents.len(), 1, "one request to the plant");
    assert_eq!(world.take_acks(), []);
    let at = world.sim;
    answer_open_requests(&mut world, FaultReply::Applied { at });
    assert_eq!(world.take_acks(), [ack(420, ACCEPTED); 2]);
    let at = world.sim;
    answer_open_requests(&mut world, FaultReply::Applied { at });
    assert_eq!(world.take_acks(), [], "one answer a copy");
}

#[test]
fn the_reply_of_the_plant_becomes_the_result_and_the_reason() {
    let at = SimTime::from_micros(1_000_000);
    let what = icd::fault::Quantity::Angle;
    let angle = Refusal::OutOfRange { what, value: 2.0, min: -0.5, max: 0.5 };
    for (reply, expected, words) in [
        (FaultReply::Unchanged { at }, ACCEPTED, ""),
        (FaultReply::Scheduled { at }, ACCEPTED, "Scheduled: left aileron stuck, at 1 s"),
        (FaultReply::Cleared { at }, ACCEPTED, ""),
        (FaultReply::Refused(angle), DENIED, "Fault refused: left aileron: angle 114.5916 deg"),
        (FaultReply::Refused(Refusal::NotForThisEffector), DENIED, "no such fault"),
        (
            FaultReply::Refused(Refusal::OnsetInThePast { onset: at, now: at }),
            DENIED,
            "in the past",
        ),
        (FaultReply::Refused(Refusal::ScheduleFull { capacity: 64 }), LATER, "64 faults"),
        (FaultReply::Refused(Refusal::FlightOver), LATER, "the flight is over"),
    ] {
        let mut world = World::flying();
        world.plant = PlantManner::Answers(reply);
        world.send_command(420, STUCK_LEFT_AILERON);
        assert_eq!(world.take_acks(), [ack(420, expected)], "{reply:?}");
        assert!(words.is_empty() || world.has_text(words), "{words}: {:?}", world.texts());
    }
}

#[test]
fn an_applied_and_a_cleared_fault_are_reported_as_text() {
    let mut world = World::flying();
    world.send_command(420, STUCK_LEFT_AILERON);
    assert!(world.has_text("Injected: left aileron stuck"), "{:?}", world.texts());
    world.send_command(420, [102.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    assert!(world.has_text("Cleared: left aileron stuck"), "{:?}", world.texts());
    assert_eq!(world.take_acks(), [ack(420, ACCEPTED); 2]);
}

#[test]
fn a_scheduled_fault_is_reported_again_when_it_acts() {
    let mut world = World::flying();
    world.send_command(31_010, [102.0, 2.0, 3.0, 1.0, 30.0, 0.0, 12.5]);
    assert_eq!(world.take_acks(), [ack(31_010, ACCEPTED)]);
    assert!(
        world.has_text("Scheduled: left elevator stuck at 30.0 deg, at 12.5 s"),
        "{:?}",
        world.texts()
    );
    let kind =
        FaultKind::StuckAt { angle_rad: 30.0_f64.to_radians(), travel: icd::fault::Travel::Jump };
    let since = SimTime::from_micros(12_500_000);
    world.autopilot.handle_report(&PlantReport::Fault(FaultEntry {
        id: 1,
        target: tvc_jet::LEFT_ELEVATOR.into(),
        kind,
        timing: Timing::at(since),
        state: FaultState::Active { since },
    }));
    world.settle();
    assert!(world.has_text("Injected: left elevator stuck at 30.0 deg"), "{:?}", world.texts());
}

#[test]
fn all_instances_are_seven_requests_and_one_acknowledgement() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    world.send_command(420, [102.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.intents.len(), 7);
    let numbers: Vec<u32> = world.intents.iter().map(|intent| intent.number).collect();
    let (last, others) = numbers.split_last().unwrap();
    let reply = FaultReply::Applied { at: world.sim };
    for request in others {
        world.autopilot.handle_report(&PlantReport::FaultReply { request: *request, reply });
    }
    world.settle();
    assert_eq!(world.take_acks(), []);
    let reply = FaultReply::Refused(Refusal::NotForThisEffector);
    world.autopilot.handle_report(&PlantReport::FaultReply { request: *last, reply });
    world.settle();
    assert_eq!(world.take_acks(), [ack(420, DENIED)], "accepted only if all were");
}

#[test]
fn with_fault_injection_off_faults_are_denied_with_the_reason_and_nothing_is_requested() {
    let mut world = World::flying();
    world.send(&super::params::set_int("SYS_FAILURE_EN", 0));
    world.take_commands();
    world.send_command(420, STUCK_LEFT_AILERON);
    world.send_command(31_010, [102.0, 2.0, 3.0, 1.0, 30.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(420, DENIED), ack(31_010, DENIED)]);
    assert!(world.has_text("SYS_FAILURE_EN 0"), "{:?}", world.texts());
    assert!(world.take_commands().is_empty());
}

#[test]
fn user_1_in_a_command_int_must_come_as_a_command_long() {
    let mut world = World::flying();
    world.send_command_int(31_010, 0, [102.0, 2.0, 3.0, 0.0], 0.0);
    assert_eq!(world.take_acks(), [ack(31_010, MavResult::MAV_RESULT_COMMAND_LONG_ONLY)]);
    world.send_command_int(420, 0, [102.0, 2.0, 3.0, 0.0], 0.0);
    assert_eq!(world.take_acks(), [ack(420, ACCEPTED)]);
}

#[test]
fn faults_of_a_plant_that_goes_away_are_rejected_for_now() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    world.send_command(420, STUCK_LEFT_AILERON);
    world.autopilot.plant_lost();
    world.settle();
    assert_eq!(world.take_acks(), [ack(420, LATER)]);
    assert!(world.has_text("Plant link lost"), "{:?}", world.texts());
}

fn stuck_at_28_deg() -> World {
    let mut world = World::flying();
    world.ground.shared.parameters.set("FLT_STUCK_MODE", 1.0).unwrap();
    world.ground.shared.parameters.set("FLT_STUCK_DEG", 28.0).unwrap();
    world
}

#[test]
fn an_angle_that_one_instance_cannot_take_is_denied_for_all_and_nothing_is_requested() {
    let mut world = stuck_at_28_deg();
    world.send_command(420, [102.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(420, DENIED)]);
    assert!(world.take_commands().is_empty(), "nothing goes to the plant");
    // Travel of the design model: ailerons 25 deg, elevators and rudder 30 deg, nozzle 15 deg.
    let expected = "Fault refused: left aileron, right aileron: angle 28 deg is outside -25 to 25 deg; \
                    nozzle pitch, nozzle yaw: angle 28 deg is outside -15 to 15 deg";
    assert_eq!(world.texts(), [expected]);
    world.got.clear();
    // Bits 2 to 4: elevators and rudder.
    world.send_command(420, [102.0, 2.0, f32::NAN, 28.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(420, ACCEPTED)]);
    assert_eq!(world.take_commands().len(), 3);
}

#[test]
fn an_angle_at_the_very_limit_is_left_to_the_plant() {
    for (instance, limit_deg) in [(1.0, 25.0), (3.0, 30.0), (5.0, 30.0), (6.0, 15.0)] {
        for sign in [1.0, -1.0] {
            let mut world = World::flying();
            world.send_command(31_010, [102.0, 2.0, instance, 1.0, sign * limit_deg, 0.0, 0.0]);
            assert_eq!(world.take_acks(), [ack(31_010, ACCEPTED)], "instance {instance}");
            let beyond = sign * (limit_deg + 0.01);
            world.send_command(31_010, [102.0, 2.0, instance, 1.0, beyond, 0.0, 0.0]);
            assert_eq!(world.take_acks(), [ack(31_010, DENIED)], "instance {instance}");
        }
    }
}

#[test]
fn a_command_that_the_plant_does_in_part_lists_successes_and_refusals() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    world.send_command(420, [102.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let numbers: Vec<u32> = world.intents.iter().map(|intent| intent.number).collect();
    let full = Refusal::ScheduleFull { capacity: 64 };
    for (place, request) in numbers.into_iter().enumerate() {
        let reply = match place {
            1 => FaultReply::Refused(Refusal::NotForThisEffector),
            4 | 6 => FaultReply::Refused(full),
            _ => FaultReply::Applied { at: world.sim },
        };
        world.autopilot.handle_report(&PlantReport::FaultReply { request, reply });
    }
    world.settle();
    assert_eq!(world.take_acks(), [ack(420, DENIED)]);
    let expected = "Done: left aileron, left elevator, right elevator, nozzle pitch. Fault refused: right aileron: this effector has no such \
                    fault; rudder, nozzle yaw: 64 faults are scheduled already, no more fit";
    assert_eq!(world.texts(), [expected]);
}

#[test]
fn a_refused_command_is_one_text_however_many_effectors_it_names() {
    let mut world = World::waiting();
    world.settle();
    world.got.clear();
    world.send_command(420, [102.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(420, LATER)]);
    let expected = "Fault refused: all servos: no aircraft is connected";
    assert_eq!(world.texts(), [expected]);

    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    world.send_command(420, [102.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    world.run_ms(3_100);
    assert_eq!(world.take_acks(), [ack(420, LATER)]);
    let texts = world.texts();
    let reported: Vec<_> = texts.iter().filter(|text| text.contains("does not answer")).collect();
    let expected = "Not confirmed: all servos: the aircraft does not answer";
    assert_eq!(reported, [expected]);
}

#[test]
fn a_repair_is_reported_once_whether_a_fault_acted_or_was_only_scheduled() {
    let clear = [102.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    let mut world = World::flying();
    world.send_command(420, STUCK_LEFT_AILERON);
    world.got.clear();
    world.send_command(420, clear);
    assert_eq!(world.texts(), ["Cleared: left aileron stuck"]);
    world.got.clear();
    // A plant reports no end when nothing acts.
    world.plant = PlantManner::Answers(FaultReply::Cleared { at: world.sim });
    for effector in [tvc_jet::LEFT_AILERON, tvc_jet::LEFT_ELEVATOR] {
        schedule(&mut world, effector);
    }
    world.send_command(420, [102.0, 0.0, f32::NAN, 5.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.texts(), ["Nothing scheduled: left aileron, left elevator"]);
    assert_eq!(world.take_acks(), [ack(420, ACCEPTED)]);
}

fn schedule(world: &mut World, effector: Effector) {
    let at = SimTime::from_micros(99_000_000);
    world.autopilot.handle_report(&PlantReport::Fault(FaultEntry {
        id: 100 + u32::from(effector.code()),
        target: effector.into(),
        kind: FaultKind::StuckHere,
        timing: Timing::at(at),
        state: FaultState::Scheduled { at },
    }));
    world.settle();
}

#[test]
fn a_repair_of_a_healthy_effector_is_accepted_with_a_note() {
    let mut world = World::flying();
    world.plant = PlantManner::Answers(FaultReply::Cleared { at: world.sim });
    world.send_command(420, [102.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(420, ACCEPTED)]);
    assert_eq!(world.texts(), ["No active fault: rudder"]);
    world.got.clear();
    world.send_command(420, [102.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.texts(), ["No active fault: all servos"]);
    world.got.clear();
    // Beside a fault that was cleared, healthy effectors need no text.
    schedule(&mut world, tvc_jet::RUDDER);
    world.send_command(420, [102.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.texts(), ["Nothing scheduled: rudder"]);
}

#[test]
fn a_size_that_one_instance_cannot_take_is_denied_for_all_in_its_own_units() {
    for (params, expected) in [
        // A bias of 20 deg: more than half the travel of the nozzle.
        (
            [102.0, 4.0, 0.0, 3.0, 20.0],
            "nozzle pitch, nozzle yaw: bias 20 deg is outside -15 to 15 deg",
        ),
        (
            [102.0, 5.0, 0.0, 4.0, 70.0],
            "nozzle pitch, nozzle yaw: rate 70 deg/s is outside 0.06 to 60 deg/s",
        ),
        (
            [102.0, 3.0, 0.0, 6.0, 28.0],
            "nozzle pitch, nozzle yaw: amplitude 28 deg is outside 0 to 15 deg",
        ),
        (
            [102.0, 4.0, 0.0, 9.0, 20.0],
            "nozzle pitch, nozzle yaw: travel limit 20 deg is outside 0 to 15 deg",
        ),
        (
            [102.0, 8.0, 0.0, 8.0, 70.0],
            "nozzle pitch, nozzle yaw: rate 70 deg/s is outside -60 to 60 deg/s",
        ),
    ] {
        let mut world = World::flying();
        let [p1, p2, p3, p4, p5] = params;
        world.send_command(31_010, [p1, p2, p3, p4, p5, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(31_010, DENIED)], "{expected}");
        assert!(world.take_commands().is_empty(), "nothing goes to the plant: {expected}");
        assert!(world.has_text(expected), "{expected}: {:?}", world.texts());
    }
}

#[test]
fn numbers_of_a_refusal_are_in_the_units_of_the_effector() {
    let bias = Refusal::OutOfRange {
        what: icd::fault::Quantity::Bias,
        value: 20.0_f64.to_radians(),
        min: -0.5,
        max: 15.0_f64.to_radians(),
    };
    let thrust = Refusal::OutOfRange {
        what: icd::fault::Quantity::Rate,
        value: 70_000.0,
        min: -30_000.0,
        max: 30_000.0,
    };
    let ramp =
        Refusal::OutOfRange { what: icd::fault::Quantity::Ramp, value: 1.0, min: 0.0, max: 0.0 };
    for (unit, refusal, words) in [
        (102.0, bias, "left aileron: bias 20 deg is outside -28.6479 to 15 deg"),
        (101.0, thrust, "engine: rate 70 kN/s is outside -30 to 30 kN/s"),
        (102.0, ramp, "left aileron: this kind of fault has no ramp"),
    ] {
        let mut world = World::flying();
        world.plant = PlantManner::Answers(FaultReply::Refused(refusal));
        world.send_command(420, [unit, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(world.has_text(words), "{words}: {:?}", world.texts());
    }
}
