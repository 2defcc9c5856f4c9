//! Altitude, speed and heading references by command.

use super::world::*;
use ::mavlink::dialects::common::MavResult;
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::{Airspeed, Reference};

const NAN: f32 = f32::NAN;
const ACCEPTED: MavResult = MavResult::MAV_RESULT_ACCEPTED;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;

fn references(world: &mut World) -> Vec<Reference> {
    let commands = world.take_commands().into_iter();
    commands
        .filter_map(|command| match command {
            Command::Vehicle(VehicleCommand::Refer(reference)) => Some(reference),
            _ => None,
        })
        .collect()
}

const FRAME: MavResult = MavResult::MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME;

/// A calibrated airspeed as the laws fly it at 5000 m.
fn calibrated(airspeed_m_s: f64) -> Reference {
    Reference::Airspeed(Airspeed::Calibrated(airspeed_m_s).true_m_s(5_000.0))
}

#[test]
fn altitude_commands_take_the_frames_of_sea_level_and_home_and_no_other() {
    let mut world = World::flying();
    for (frame, expected) in [
        (0, ACCEPTED),
        (3, ACCEPTED),
        (5, ACCEPTED),
        (6, ACCEPTED),
        (1, FRAME),
        (10, FRAME),
        (200, FRAME),
    ] {
        world.send_command(186, [5_500.0, f32::from(frame), 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(186, expected)], "186 frame {frame}");
        world.send_command_int(43_001, frame, [0.0, 0.0, 5.0, 0.0], 5_600.0);
        assert_eq!(world.take_acks(), [ack(43_001, expected)], "43001 frame {frame}");
    }
    world.take_commands();
    world.send_command(43_001, [NAN, NAN, NAN, NAN, NAN, NAN, 5_700.0]);
    assert_eq!(world.take_acks(), [ack(43_001, ACCEPTED)]);
    assert_eq!(references(&mut world), [Reference::Altitude(5_700.0)]);
}

#[test]
fn references_outside_the_limits_are_denied_with_the_range() {
    let mut world = World::flying();
    world.send_command(186, [50_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    world.send_command(178, [0.0, 20.0, -1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(186, DENIED), ack(178, DENIED)]);
    assert!(
        world.has_text("altitude 50000.0 m is outside 500.0 to 12000.0 m"),
        "{:?}",
        world.texts()
    );
    assert!(world.has_text("airspeed 20.0 m/s is outside"), "{:?}", world.texts());
    assert!(world.take_commands().is_empty());
}

#[test]
fn each_ground_stations_way_to_change_speed_works() {
    let mut world = World::flying();
    for (params, speed) in [
        ([0.0, 250.0, -1.0, 0.0, NAN, NAN, NAN], 250.0),
        ([0.0, 251.0, 0.0, 0.0, 0.0, 0.0, 0.0], 251.0),
        ([0.0, 252.0, NAN, NAN, NAN, NAN, NAN], 252.0),
    ] {
        world.send_command(178, params);
        assert_eq!(world.take_acks(), [ack(178, ACCEPTED)]);
        assert_eq!(references(&mut world), [calibrated(speed)]);
    }
    for keep in [NAN, -1.0] {
        world.send_command(178, [0.0, keep, -1.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(178, ACCEPTED)], "{keep} m/s keeps the speed");
        assert_eq!(references(&mut world), []);
    }
    for bad in [
        [2.0, 250.0, -1.0],
        [NAN, 250.0, -1.0],
        [0.0, 250.0, 0.5],
        [0.0, f32::INFINITY, -1.0],
        [0.0, -2.0, -1.0],
        [0.0, -3.0, -1.0],
    ] {
        let [p1, p2, p3] = bad;
        world.send_command(178, [p1, p2, p3, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(178, DENIED)], "{bad:?}");
    }
}

#[test]
fn a_relative_speed_is_denied_with_the_reason() {
    for relative in [1.0, -1.0, 0.5, f32::INFINITY] {
        let mut world = World::flying();
        world.send_command(178, [0.0, 250.0, -1.0, relative, 0.0, 0.0, 0.0]);
        world.send_command_int(178, 0, [0.0, 250.0, -1.0, relative], 0.0);
        assert_eq!(world.take_acks(), [ack(178, DENIED); 2], "p4 = {relative}");
        assert!(world.has_text("only an absolute speed (p4 = 0)"), "{:?}", world.texts());
        assert!(world.take_commands().is_empty());
    }
}

#[test]
fn a_ground_speed_is_flown_as_true_airspeed_with_a_note() {
    for command in [178, 43_000] {
        let mut world = World::flying();
        world.send_command(command, [1.0, 250.0, -0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(command, ACCEPTED)]);
        assert_eq!(references(&mut world), [Reference::Airspeed(250.0)]);
        assert!(world.has_text("A ground speed is flown as true airspeed"), "{:?}", world.texts());
    }
}

#[test]
fn guided_speed_takes_airspeed_and_reports_an_unused_rate() {
    let mut world = World::flying();
    world.send_command_int(43_000, 0, [0.0, 240.0, 0.0, 0.0], 0.0);
    assert_eq!(references(&mut world), [calibrated(240.0)]);
    assert_eq!(world.texts(), [""; 0]);
    world.send_command_int(43_000, 0, [0.0, 245.0, 2.0, 0.0], 0.0);
    assert_eq!(references(&mut world), [calibrated(245.0)]);
    assert!(world.has_text("The rate is not used"), "{:?}", world.texts());
    assert_eq!(world.take_acks(), [ack(43_000, ACCEPTED); 2]);
    for bad in [[2.0, 240.0, 0.0], [0.0, NAN, 0.0], [0.0, 240.0, -1.0], [0.0, 20.0, 0.0]] {
        let [p1, p2, p3] = bad;
        world.send_command(43_000, [p1, p2, p3, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(43_000, DENIED)], "{bad:?}");
    }
}

#[test]
fn a_heading_is_flown_as_course_with_a_note() {
    let mut world = World::flying();
    for (kind, has_note) in [(0.0, false), (2.0, false), (1.0, true)] {
        world.got.clear();
        world.send_command(43_002, [kind, 90.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(43_002, ACCEPTED)], "type {kind}");
        assert_eq!(references(&mut world), [Reference::Course(90.0_f64.to_radians())]);
        assert_eq!(world.has_text("flown as course over the ground"), has_note, "type {kind}");
    }
    world.send_command(43_002, [0.0, 360.0, 0.5, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(references(&mut world), [Reference::Course(0.0)], "north");
    assert!(world.has_text("The rate is not used"), "{:?}", world.texts());
    world.take_acks();
    for bad in [[0.0, 361.0, 0.0], [0.0, -1.0, 0.0], [0.0, NAN, 0.0], [3.0, 90.0, 0.0]] {
        let [p1, p2, p3] = bad;
        world.send_command_int(43_002, 0, [p1, p2, p3, 0.0], 0.0);
        assert_eq!(world.take_acks(), [ack(43_002, DENIED)], "{bad:?}");
        assert_eq!(references(&mut world), []);
    }
}
