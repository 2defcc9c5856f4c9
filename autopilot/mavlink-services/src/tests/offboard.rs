use super::world::*;
use crate::Service as _;
use crate::codec::Identity;
use ::mavlink::MessageData;
use ::mavlink::dialects::common::{
    AttitudeTargetTypemask, MISSION_ACK_DATA, MISSION_CLEAR_ALL_DATA, MavMessage, MavResult,
    SET_ATTITUDE_TARGET_DATA,
};
use flight_management::command::Command;
use flight_management::command::Configuration;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::{Mode, Setpoint};
use icd::{Attitude, EulerAngles};

const OFFBOARD: [f32; 7] = [1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0];

fn attitude(q: [f32; 4], type_mask: u8) -> MavMessage {
    MavMessage::SET_ATTITUDE_TARGET(SET_ATTITUDE_TARGET_DATA {
        time_boot_ms: 0,
        q,
        body_roll_rate: f32::NAN,
        body_pitch_rate: f32::NAN,
        body_yaw_rate: f32::NAN,
        thrust: 0.6,
        target_system: 1,
        target_component: 1,
        type_mask: AttitudeTargetTypemask::from_bits_retain(type_mask),
        thrust_body: [0.0; 3],
    })
}

pub fn setpoint(roll_deg: f64) -> MavMessage {
    let euler = EulerAngles { phi: roll_deg.to_radians(), theta: 0.03, psi: 1.0 };
    let q = Attitude::from_euler(euler).wxyz();
    attitude(q.map(crate::convert::float), 7)
}

fn in_offboard() -> World {
    let mut world = World::flying();
    world.send(&setpoint(15.0));
    world.send_command(176, OFFBOARD);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_ACCEPTED)]);
    world
}

fn roll_deg(world: &mut World) -> f64 {
    world.step();
    world.autopilot.snapshot().unwrap().demand.roll_rad.to_degrees()
}

#[test]
fn offboard_is_refused_until_setpoints_come() {
    let mut world = World::flying();
    world.send_command(176, OFFBOARD);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_TEMPORARILY_REJECTED)]);
    world.send(&setpoint(15.0));
    world.run_ms(600);
    world.send_command(176, OFFBOARD);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_TEMPORARILY_REJECTED)]);
    assert!(world.take_commands().is_empty(), "setpoints in Hold move nothing");
}

#[test]
fn the_roll_angle_of_the_setpoint_is_flown_from_the_mode_change_on() {
    let mut world = in_offboard();
    // 1e-4 deg: the quaternion has seven digits.
    let roll = roll_deg(&mut world);
    assert!((roll - 15.0).abs() < 1.0e-4, "{roll} deg");
    world.run_ms(20);
    world.send(&setpoint(-10.0));
    let roll = roll_deg(&mut world);
    assert!((roll + 10.0).abs() < 1.0e-4, "{roll} deg");
}

#[test]
fn a_roll_beyond_the_limit_is_limited() {
    for limit in 1..=80_u8 {
        let mut world = World::flying();
        let limits = ["REF_ROLL_MAX", "NAV_BANK_MAX"].map(|name| (name, f64::from(limit)));
        world.ground.shared.parameters.set_all(limits).unwrap();
        world.autopilot.handle_intent(flight_management::command::Intent {
            number: 1_000_000,
            command: Command::Configuration(Configuration::Limits(
                world.ground.shared.parameters.limits,
            )),
        });
        world.send(&setpoint(89.0));
        world.send_command(176, OFFBOARD);
        let roll = roll_deg(&mut world);
        assert!((roll - f64::from(limit)).abs() < 1.0e-6, "limit {limit} deg: {roll} deg");
    }
}

#[test]
fn setpoints_that_stop_lead_back_to_hold_after_half_a_second_and_once() {
    let mut world = in_offboard();
    world.run_ms(498);
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Offboard);
    world.run_ms(10);
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Hold);
    world.run_ms(3_000);
    let count = world.texts().iter().filter(|text| text.contains("setpoints stopped")).count();
    assert_eq!(count, 1, "{:?}", world.texts());
    world.take_commands();
    world.send(&setpoint(15.0));
    world.run_ms(20);
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Hold, "a late setpoint is too late");
    assert!(world.take_commands().is_empty());
}

#[test]
fn a_steady_stream_keeps_offboard() {
    let mut world = in_offboard();
    for _ in 0..100 {
        world.run_ms(50);
        world.send(&setpoint(15.0));
    }
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Offboard);
}

#[test]
fn setpoints_without_a_usable_attitude_do_not_count() {
    for (q, type_mask) in [
        ([f32::NAN, 0.0, 0.0, 0.0], 7),
        ([1.0, f32::INFINITY, 0.0, 0.0], 7),
        ([0.0; 4], 7),
        ([2.0, 0.0, 0.0, 0.0], 7),
        ([1.0, 0.0, 0.0, 0.0], 7 | 128),
    ] {
        let mut world = World::flying();
        for _ in 0..10 {
            world.send(&attitude(q, type_mask));
        }
        world.send_command(176, OFFBOARD);
        assert_eq!(
            world.take_acks(),
            [ack(176, MavResult::MAV_RESULT_TEMPORARILY_REJECTED)],
            "{q:?}"
        );
        let count = world.texts().iter().filter(|text| text.contains("Setpoint refused")).count();
        assert_eq!(count, 1, "reported once: {:?}", world.texts());
    }
}

#[test]
fn a_flood_of_setpoints_becomes_a_trickle_of_references_and_the_last_one_counts() {
    let mut world = in_offboard();
    world.take_commands();
    for i in 0..1_000 {
        world.send(&setpoint(f64::from(i % 40)));
    }
    world.run_ms(20);
    let rolls: Vec<f64> = world
        .take_commands()
        .into_iter()
        .filter_map(|command| match command {
            Command::Vehicle(VehicleCommand::Setpoint(Setpoint::Roll(roll))) => {
                Some(roll.to_degrees())
            }
            _ => None,
        })
        .collect();
    assert!(rolls.len() <= 2, "{rolls:?}");
    assert!((rolls.last().unwrap() - 39.0).abs() < 1.0e-4, "{rolls:?} deg");
}

#[test]
fn without_a_flying_aircraft_setpoints_are_ignored_quietly_and_nothing_waits() {
    let mut world = in_offboard();
    world.autopilot.plant_lost();
    world.settle();
    world.take_commands();
    world.got.clear();
    for _ in 0..100 {
        world.now = world.now + STEP;
        world.send(&setpoint(20.0));
    }
    world.now = world.now + STEP * 500;
    world.settle();
    assert!(world.take_commands().is_empty(), "no aircraft, no reference and no change of mode");
    assert_eq!(world.texts(), [""; 0]);
    let ground = &world.ground;
    let offboard_deadline = ground.services.offboard.next_deadline(&ground.shared);
    assert_eq!(offboard_deadline, None, "a deadline that is never met would keep a thread busy");

    world.autopilot.plant_back();
    world.settle();
    world.step();
    world.step();
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Hold, "the stream has stopped");
}

const OTHER: Identity = Identity { system: 245, component: 190 };

fn send_as_other(world: &mut World, message: &MavMessage) {
    let bytes = world.encode(OTHER, message);
    world.send_bytes(address(14_550), &bytes);
}

#[test]
fn offboard_needs_setpoints_of_the_requesting_station() {
    let mut world = World::flying();
    send_as_other(&mut world, &setpoint(15.0));
    world.send_command(176, OFFBOARD);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_TEMPORARILY_REJECTED)]);
    world.send(&setpoint(10.0));
    send_as_other(&mut world, &setpoint(15.0));
    world.send_command(176, OFFBOARD);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_ACCEPTED)]);
    assert!((roll_deg(&mut world) - 10.0).abs() < 1.0e-4);
}

#[test]
fn setpoints_of_another_station_steer_nothing_keep_nothing_and_are_reported_once() {
    let mut world = in_offboard();
    for _ in 0..20 {
        world.run_ms(20);
        send_as_other(&mut world, &setpoint(-20.0));
        assert!((roll_deg(&mut world) - 15.0).abs() < 1.0e-4);
    }
    let refused = "Setpoints of system 245 refused: it has no control";
    let count = world.texts().iter().filter(|text| *text == refused).count();
    assert_eq!(count, 1, "{:?}", world.texts());
    for _ in 0..10 {
        world.run_ms(20);
        send_as_other(&mut world, &setpoint(-20.0));
    }
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Hold, "the own stream stopped");
}

#[test]
fn a_station_has_control_before_the_outcome_of_its_request() {
    let mut world = World::flying();
    world.send_command(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
    send_as_other(&mut world, &setpoint(15.0));
    let request = command_long(176, OFFBOARD, crate::codec::OWN);
    world.ground.handle_datagram(address(14_550), &sent_by(OTHER, request, 152), world.now);
    while let Some(intent) = world.ground.pop_intent() {
        world.autopilot.handle_intent(intent);
    }
    world.take_commands();
    // A poll between any two events.
    while let Some(event) = world.autopilot.pop_event() {
        world.ground.handle_event(&event, world.now);
        world.ground.poll(world.now);
    }
    world.settle();
    world.run_ms(100);
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Offboard);
    assert!(!world.has_text("setpoints stopped"), "{:?}", world.texts());
}

#[test]
fn a_refusal_is_reported_although_newer_setpoints_were_sent_before_it() {
    use flight_management::command::Outcome;
    use flight_management::vehicle::VehicleRefusal;
    let mut world = in_offboard();
    world.run_ms(20);
    let mut numbers = Vec::new();
    for _ in 0..4 {
        // The control side is slow: it answers none of them yet.
        world.now = world.now + STEP * 10;
        let bytes = world.encode(STATION, &setpoint(5.0));
        world.ground.handle_datagram(address(14_550), &bytes, world.now);
        while let Some(intent) = world.ground.pop_intent() {
            numbers.push(intent.number);
        }
    }
    assert_eq!(numbers.len(), 4);
    let time = world.sim;
    let outcome = Outcome::Refused(VehicleRefusal::NoPlan);
    let kind = flight_management::event::EventKind::Outcome { number: numbers[0], outcome };
    world.ground.handle_event(&flight_management::event::Event { time, kind }, world.now);
    world.settle();
    assert!(world.has_text("Setpoint refused"), "{:?}", world.texts());
}

#[test]
fn a_plan_and_a_home_of_another_station_leave_control_with_the_stream() {
    let mut world = in_offboard();
    let own = Identity { system: 1, component: 1 };
    let clear = MavMessage::MISSION_CLEAR_ALL(MISSION_CLEAR_ALL_DATA {
        target_system: 1,
        target_component: 1,
        ..Default::default()
    });
    let home = command_long(179, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], own);
    for round in 0..60 {
        world.run_ms(20);
        world.send(&setpoint(15.0));
        if round == 10 {
            send_as_other(&mut world, &clear);
            world.send_bytes(address(14_550), &sent_by(OTHER, home.clone(), 152));
        }
    }
    let accepted = world.take_all_acks().iter().any(|ack| (ack.command, ack.result) == (179, 0));
    assert!(
        accepted && world.got.iter().any(|got| got.id == MISSION_ACK_DATA::ID),
        "both are done"
    );
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Offboard, "{:?}", world.texts());
}

#[test]
fn the_request_to_fall_back_is_repeated_until_the_mode_changes_and_reported_once() {
    let mut world = in_offboard();
    world.got.clear();
    let mut commands = 0;
    for _ in 0..3 {
        world.now = world.now + core::time::Duration::from_millis(600);
        world.ground.poll(world.now);
        // The control side is slow: it has taken none of them yet.
        while let Some(intent) = world.ground.pop_intent() {
            commands += usize::from(matches!(
                intent.command,
                Command::Vehicle(VehicleCommand::Mode(Mode::Hold))
            ));
        }
    }
    world.settle();
    let count = world.texts().iter().filter(|text| text.contains("setpoints stopped")).count();
    assert_eq!((commands, count), (3, 1), "{:?}", world.texts());
}
