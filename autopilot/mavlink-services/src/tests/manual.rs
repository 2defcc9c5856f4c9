//! A pilot's sticks: joystick and overridden channels.

use super::params::set_int;
use super::world::*;
use crate::Service as _;
use crate::codec::Identity;
use ::mavlink::dialects::common::{
    MANUAL_CONTROL_DATA, MavMessage, MavResult, RC_CHANNELS_OVERRIDE_DATA,
};
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::{Mode, Sticks};

const ALTITUDE: [f32; 7] = [1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0];
const OTHER: Identity = Identity { system: 245, component: 190 };

fn joystick_of(target: u8, [x, y, z, r]: [i16; 4]) -> MavMessage {
    MavMessage::MANUAL_CONTROL(MANUAL_CONTROL_DATA {
        x,
        y,
        z,
        r,
        target,
        ..MANUAL_CONTROL_DATA::default()
    })
}

fn joystick(axes: [i16; 4]) -> MavMessage {
    joystick_of(1, axes)
}

/// Channels 1 to 3; the others released, as MAVProxy has it.
fn channels(first: [u16; 3]) -> MavMessage {
    let [chan1_raw, chan2_raw, chan3_raw] = first;
    MavMessage::RC_CHANNELS_OVERRIDE(RC_CHANNELS_OVERRIDE_DATA {
        chan1_raw,
        chan2_raw,
        chan3_raw,
        target_system: 1,
        target_component: 1,
        ..RC_CHANNELS_OVERRIDE_DATA::default()
    })
}

fn send_as(world: &mut World, sender: Identity, message: &MavMessage) {
    let bytes = world.encode(sender, message);
    world.send_bytes(address(14_550), &bytes);
}

/// In Altitude by joystick, with 14550's station in control.
fn by_joystick() -> World {
    let mut world = World::flying();
    world.send(&joystick([0, 0, 500, 0]));
    world.send_command(176, ALTITUDE);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_ACCEPTED)]);
    world.run_ms(20);
    world.take_commands();
    world
}

fn mode(world: &World) -> Mode {
    world.autopilot.snapshot().unwrap().mode
}

fn sticks(world: &mut World) -> Vec<Sticks> {
    let commands = world.take_commands().into_iter();
    commands
        .filter_map(|command| match command {
            Command::Vehicle(VehicleCommand::Sticks(sticks)) => Some(sticks),
            _ => None,
        })
        .collect()
}

/// Outcome of one message.
fn becomes(message: &MavMessage) -> Vec<Sticks> {
    let mut world = by_joystick();
    world.send(message);
    sticks(&mut world)
}

#[test]
fn altitude_is_refused_until_sticks_are_received() {
    let mut world = World::flying();
    world.send_command(176, ALTITUDE);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_TEMPORARILY_REJECTED)]);
    assert!(world.has_text("Altitude refused: no sticks"), "{:?}", world.texts());
    assert!(world.has_text("use Position"), "{:?}", world.texts());
    world.send(&joystick([0, 0, 500, 0]));
    world.run_ms(600);
    world.send_command(176, ALTITUDE);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_TEMPORARILY_REJECTED)]);
    assert_eq!(mode(&world), Mode::Position);
}

#[test]
fn the_sticks_count_from_the_mode_change_on() {
    let mut world = World::flying();
    world.send(&joystick([0, 500, 500, 0]));
    world.send_command(176, ALTITUDE);
    world.run_ms(4);
    assert_eq!(mode(&world), Mode::Altitude);
    let first = sticks(&mut world);
    assert_eq!(first.len(), 1, "{first:?}");
    assert_eq!(first[0], Sticks { roll: 0.5, climb: 0.0, throttle: Some(0.5) });
}

#[test]
fn a_joystick_pushed_forward_descends_and_moved_right_rolls_right() {
    for (axes, expected) in [
        ([1000, 0, 0, 0], Sticks { roll: 0.0, climb: -1.0, throttle: Some(0.0) }),
        ([-500, 1000, 1000, 900], Sticks { roll: 1.0, climb: 0.5, throttle: Some(1.0) }),
        ([0, -250, 250, 0], Sticks { roll: -0.25, climb: 0.0, throttle: Some(0.25) }),
        ([0, 0, -1000, 0], Sticks { roll: 0.0, climb: 0.0, throttle: Some(0.0) }),
        ([2000, -32_768, 0, 0], Sticks { roll: -1.0, climb: -1.0, throttle: Some(0.0) }),
        ([i16::MAX, 100, i16::MAX, 0], Sticks { roll: 0.1, climb: 0.0, throttle: None }),
    ] {
        assert_eq!(becomes(&joystick(axes)), [expected], "{axes:?}");
    }
    assert_eq!(becomes(&joystick([i16::MAX; 4])), [], "no axis at all");
    for target in [0, 2] {
        assert_eq!(becomes(&joystick_of(target, [0, 500, 500, 0])), [], "for system {target}");
    }
}

#[test]
fn overridden_channels_are_sticks_and_a_released_one_stands_in_the_middle() {
    for (first, expected) in [
        ([1600, 0, 0], Sticks { roll: 0.2, climb: 0.0, throttle: None }),
        ([1500, 2000, 1500], Sticks { roll: 0.0, climb: 1.0, throttle: Some(0.5) }),
        ([1000, 1000, 1000], Sticks { roll: -1.0, climb: -1.0, throttle: Some(0.0) }),
        ([500, 2500, 65_000], Sticks { roll: -1.0, climb: 1.0, throttle: Some(1.0) }),
    ] {
        assert_eq!(becomes(&channels(first)), [expected], "{first:?}");
    }
}

#[test]
fn an_ignored_channel_stays_and_a_released_one_does_not() {
    let mut world = by_joystick();
    world.send(&channels([1600, 1700, 1500]));
    world.run_ms(20);
    world.take_commands();
    world.send(&channels([u16::MAX, u16::MAX, 2000]));
    world.run_ms(20);
    let kept = Sticks { roll: 0.2, climb: 0.4, throttle: Some(1.0) };
    assert_eq!(sticks(&mut world), [kept]);
    world.send(&channels([0, u16::MAX, u16::MAX]));
    world.run_ms(20);
    assert_eq!(sticks(&mut world), [Sticks { roll: 0.0, ..kept }]);
}

#[test]
fn channels_that_are_all_released_are_no_sticks() {
    let mut world = World::flying();
    world.send(&channels([1600, 0, 0]));
    world.send(&channels([0, 0, 0]));
    world.send_command(176, ALTITUDE);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_TEMPORARILY_REJECTED)]);
}

#[test]
fn sticks_that_stop_lead_to_hold_once() {
    let mut world = by_joystick();
    world.send(&joystick([0, 100, 500, 0]));
    world.run_ms(498);
    assert_eq!(mode(&world), Mode::Altitude);
    world.run_ms(10);
    assert_eq!(mode(&world), Mode::Hold);
    world.run_ms(3_000);
    let count = world.texts().iter().filter(|text| text.contains("Sticks stopped")).count();
    assert_eq!(count, 1, "{:?}", world.texts());
    world.send(&joystick([0, 100, 500, 0]));
    world.run_ms(10);
    assert_eq!(mode(&world), Mode::Hold, "late sticks do not set_own_law Altitude back");
}

#[test]
fn a_flood_of_sticks_becomes_a_trickle_and_the_last_one_counts() {
    let mut world = by_joystick();
    for i in 0..1_000 {
        world.send(&joystick([0, i, 500, 0]));
    }
    world.run_ms(20);
    let passed_on = sticks(&mut world);
    assert!(passed_on.len() <= 2, "{passed_on:?}");
    assert_eq!(passed_on.last().map(|sticks| sticks.roll), Some(0.999));
}

#[test]
fn only_the_sticks_of_the_station_in_control_count_and_others_are_reported_once() {
    let mut world = by_joystick();
    for i in 0..100 {
        world.run_ms(20);
        world.send(&joystick([0, 0, 500, 0]));
        send_as(&mut world, OTHER, &joystick([0, 1000 - i, 500, 0]));
    }
    assert!(sticks(&mut world).iter().all(|sticks| sticks.roll == 0.0));
    assert_eq!(mode(&world), Mode::Altitude);
    let count = world.texts().iter().filter(|text| text.contains("it has no control")).count();
    assert_eq!(count, 1, "{:?}", world.texts());
}

#[test]
fn the_station_that_commands_altitude_flies_it() {
    let mut world = by_joystick();
    send_as(&mut world, OTHER, &joystick([0, 700, 500, 0]));
    let mut bytes = command_long(176, ALTITUDE, crate::codec::OWN);
    // The same command from the other system.
    bytes[5] = OTHER.system;
    let end = bytes.len() - 2;
    let crc = ::mavlink::calculate_crc(&bytes[1..end], 152);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
    world.send_bytes(address(14_550), &bytes);
    world.take_commands();
    world.run_ms(20);
    send_as(&mut world, OTHER, &joystick([0, 700, 500, 0]));
    world.send(&joystick([0, -700, 500, 0]));
    world.run_ms(20);
    let passed_on = sticks(&mut world);
    assert!(!passed_on.is_empty());
    assert!(passed_on.iter().all(|sticks| sticks.roll == 0.7), "{passed_on:?}");
}

#[test]
fn sticks_that_stop_lead_home_if_nav_rcl_act_is_return() {
    let mut world = by_joystick();
    world.send(&set_int("NAV_RCL_ACT", 2));
    world.send(&joystick([0, 100, 500, 0]));
    world.run_ms(520);
    assert_eq!(mode(&world), Mode::Return);
    assert!(world.has_text("Sticks stopped: Return"), "{:?}", world.texts());
    for number in [0, 3] {
        world.send(&set_int("NAV_RCL_ACT", number));
    }
    assert!(world.has_text("NAV_RCL_ACT = 3 is outside 1 to 2"), "{:?}", world.texts());
}

#[test]
fn sticks_are_silent_by_wall_time_also_while_the_simulation_stands_still() {
    let mut world = by_joystick();
    for _ in 0..100 {
        world.now = world.now + STEP * 50;
        world.send(&joystick([0, 0, 500, 0]));
    }
    assert!(!world.has_text("Sticks stopped"));
    world.now = world.now + STEP * 251;
    world.settle();
    assert!(world.has_text("Sticks stopped"));
}

#[test]
fn without_a_flight_sticks_are_ignored_quietly_and_no_deadline_waits() {
    let mut world = by_joystick();
    world.autopilot.plant_lost();
    world.settle();
    world.take_commands();
    world.got.clear();
    for _ in 0..100 {
        world.now = world.now + STEP;
        world.send(&joystick([0, 0, 500, 0]));
    }
    world.now = world.now + STEP * 500;
    world.settle();
    assert!(world.take_commands().is_empty());
    assert_eq!(world.texts(), [""; 0]);
    let ground = &world.ground;
    let deadline = ground.services.manual.next_deadline(&ground.shared);
    assert_eq!(deadline, None);
}

#[test]
fn a_station_that_requests_altitude_has_control_before_the_outcome() {
    let mut world = World::flying();
    world.send_command(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
    send_as(&mut world, OTHER, &joystick([0, 700, 500, 0]));
    let request = command_long(176, ALTITUDE, crate::codec::OWN);
    world.ground.handle_datagram(address(14_550), &sent_by(OTHER, request, 152), world.now);
    while let Some(intent) = world.ground.pop_intent() {
        world.autopilot.handle_intent(intent);
    }
    // A poll between any two events.
    while let Some(event) = world.autopilot.pop_event() {
        world.ground.handle_event(&event, world.now);
        world.ground.poll(world.now);
    }
    world.settle();
    world.run_ms(100);
    assert_eq!(mode(&world), Mode::Altitude);
    assert!(!world.has_text("Sticks stopped"), "{:?}", world.texts());
}

#[test]
fn in_position_sticks_count_from_the_start_and_when_they_stop_the_mode_stays() {
    let mut world = World::flying();
    for _ in 0..20 {
        world.send(&joystick([0, 500, 500, 0]));
        world.run_ms(20);
    }
    assert_eq!(mode(&world), Mode::Position);
    let roll_rad = world.autopilot.snapshot().unwrap().demand.roll_rad;
    assert!((roll_rad - 22.5_f64.to_radians()).abs() < 1.0e-9, "{roll_rad} rad");
    world.take_commands();
    world.run_ms(5_000);
    assert_eq!(sticks(&mut world), [Sticks::CENTRED], "once");
    assert_eq!(mode(&world), Mode::Position);
    let snapshot = *world.autopilot.snapshot().unwrap();
    assert_eq!(snapshot.demand.roll_rad, 0.0);
    assert!(snapshot.navigation.course_rad.is_some(), "the course is held");
    let count = world.texts().iter().filter(|text| text.contains("Sticks stopped")).count();
    assert_eq!(count, 1, "{:?}", world.texts());
}

#[test]
fn without_sticks_position_waits_for_nothing() {
    let mut world = World::flying();
    for _ in 0..2 {
        world.send_command(176, [1.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        world.run_ms(100);
        let ground = &world.ground;
        let deadline = ground.services.manual.next_deadline(&ground.shared);
        assert_eq!(deadline, None);
        world.send_command(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
        // Sticks from before the mode are too old to count in it.
        world.send(&joystick([0, 500, 500, 0]));
        world.run_ms(1_000);
    }
    assert_eq!(sticks(&mut world), []);
    assert_eq!(mode(&world), Mode::Hold);
}

#[test]
fn a_new_flight_in_position_does_not_wait_for_what_altitude_waited_for() {
    let mut world = by_joystick();
    world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
    world.run_ms(2_000);
    assert_eq!(mode(&world), Mode::Position);
    let ground = &world.ground;
    let deadline = ground.services.manual.next_deadline(&ground.shared);
    assert_eq!(deadline, None);
}

#[test]
fn sticks_take_control_only_where_no_station_has_it() {
    let mut world = World::flying();
    send_as(&mut world, OTHER, &joystick([0, 500, 500, 0]));
    world.run_ms(20);
    assert_eq!(sticks(&mut world).len(), 1);
    assert_eq!(world.ground.shared.control.holder(), Some(OTHER.system));
    world.send(&joystick([0, -500, 500, 0]));
    world.run_ms(20);
    assert_eq!(sticks(&mut world), []);
    assert!(world.has_text("it has no control"), "{:?}", world.texts());
}
