#![expect(deprecated, reason = "ground stations still use PING and SET_MODE")]

use super::world::*;
use crate::codec::Identity;
use ::mavlink::dialects::common::{
    AUTOPILOT_VERSION_DATA, HEARTBEAT_DATA, HOME_POSITION_DATA, MavMessage, MavModeFlag, MavResult,
    MavState, PING_DATA, SET_MODE_DATA, TIMESYNC_DATA,
};

const NAN: f32 = f32::NAN;
const ACCEPTED: MavResult = MavResult::MAV_RESULT_ACCEPTED;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
const LATER: MavResult = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;
const UNSUPPORTED: MavResult = MavResult::MAV_RESULT_UNSUPPORTED;

#[test]
fn an_unknown_command_is_unsupported_at_once() {
    let mut world = World::flying();
    for command in [54_321, 0, 1, 16, 115, 32_100, 65_535] {
        world.ground.handle_datagram(
            address(14_550),
            &command_long(command, [0.0; 7], Identity { system: 1, component: 1 }),
            world.now,
        );
        world.settle();
        assert_eq!(world.take_acks(), [ack(command, UNSUPPORTED)]);
    }
    world.send_command_int(54_321, 0, [0.0; 4], 0.0);
    assert_eq!(world.take_acks(), [ack(54_321, UNSUPPORTED)]);
}

#[test]
fn every_copy_of_a_command_gets_one_acknowledgement() {
    let mut world = World::flying();
    for _ in 0..3 {
        world.send_command(186, [6_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
    world.run_ms(5_000);
    assert_eq!(world.take_acks(), [ack(186, ACCEPTED); 3]);
    assert_eq!(world.autopilot.snapshot().unwrap().demand.altitude_m, 6_000.0);
}

#[test]
fn several_commands_in_one_datagram_are_each_acknowledged() {
    let mut world = World::flying();
    let all = Identity { system: 0, component: 0 };
    let mut datagram = command_long(186, [6_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], all);
    datagram.extend(command_long(54_321, [0.0; 7], all));
    datagram.extend(command_long(178, [0.0, 250.0, -1.0, 0.0, 0.0, 0.0, 0.0], all));
    world.send_bytes(address(14_550), &datagram);
    world.run_ms(10);
    let mut acks = world.take_acks();
    acks.sort_by_key(|ack| ack.command);
    assert_eq!(acks, [ack(178, ACCEPTED), ack(186, ACCEPTED), ack(54_321, UNSUPPORTED)]);
}

#[test]
fn commands_for_another_system_are_ignored() {
    let mut world = World::flying();
    for (system, component) in [(2, 1), (1, 2), (255, 190), (2, 0), (0, 190)] {
        let bytes = command_long(54_321, [0.0; 7], Identity { system, component });
        world.send_bytes(address(14_550), &bytes);
    }
    assert_eq!(world.take_acks(), []);
    for (system, component) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let bytes = command_long(54_321, [0.0; 7], Identity { system, component });
        world.send_bytes(address(14_550), &bytes);
        assert_eq!(world.take_acks().len(), 1, "{system}/{component}");
    }
}

#[test]
fn modes_and_references_are_rejected_for_now_while_nothing_flies() {
    let base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
    let hold = SET_MODE_DATA { custom_mode: 50_593_792, target_system: 1, base_mode };
    for (is_lost, words) in [
        (true, "Refused: no aircraft is connected"),
        (false, "The flight is over: a reboot begins a new one"),
    ] {
        let mut world = World::flying();
        if is_lost {
            world.autopilot.plant_lost();
        } else {
            let at = world.sim;
            world.autopilot.handle_report(&icd::fault::PlantReport::GroundContact { at });
        }
        world.settle();
        for (command, params) in [
            (176, [129.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]),
            (178, [0.0, 250.0, -1.0, 0.0, 0.0, 0.0, 0.0]),
            (186, [6_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ] {
            world.got.clear();
            world.send_command(command, params);
            assert_eq!(world.take_acks(), [ack(command, LATER)], "{words}");
            assert_eq!(world.texts(), [words], "{command}");
        }
        world.got.clear();
        world.send(&MavMessage::SET_MODE(hold.clone()));
        assert_eq!(world.take_acks(), []);
        assert_eq!(world.texts(), [words]);
    }
}

#[test]
fn without_an_aircraft_nothing_is_accepted_that_needs_one() {
    let mut world = World::waiting();
    world.settle();
    for (command, params) in [
        (176, [129.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]),
        (186, [6_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (420, [102.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
        (246, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (400, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (410, [0.0; 7]),
    ] {
        world.send_command(command, params);
        assert_eq!(world.take_acks(), [ack(command, LATER)]);
    }
    assert!(world.has_text("PreArm: no aircraft is connected"));
}

#[test]
fn a_restart_is_acknowledged_when_the_new_flight_has_begun() {
    let mut world = World::flying();
    world.send_command(246, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(246, ACCEPTED)]);
    assert!(world.has_text("Flight began"));
    for _ in 0..2 {
        let restart = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let all = Identity { system: 1, component: 1 };
        // Not settled in between: both reach the aircraft in the same tick.
        world.ground.handle_datagram(address(14_550), &command_long(246, restart, all), world.now);
        world.ground.handle_datagram(address(14_540), &command_long(246, restart, all), world.now);
    }
    world.settle();
    assert_eq!(world.take_acks(), [ack(246, ACCEPTED); 2], "one for each copy");
    world.send_command(246, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(246, DENIED)]);
}

#[test]
fn the_heartbeat_has_the_agreed_identity_and_comes_once_a_second() {
    let mut world = World::flying();
    world.run_ms(10_000);
    let beats: Vec<HEARTBEAT_DATA> =
        world.got.iter().filter(|got| got.to == address(14_540)).filter_map(Got::read).collect();
    assert_eq!(beats.len(), 10);
    for beat in beats {
        assert_eq!(beat.custom_mode, 196_608, "a flight begins in Position");
        assert_eq!(beat.mavtype as u8, 1);
        assert_eq!(beat.autopilot as u8, 12);
        assert_eq!(beat.base_mode.bits() & 0x81, 0x81, "custom mode and armed");
        assert_eq!(beat.system_status, MavState::MAV_STATE_ACTIVE);
    }
}

#[test]
fn version_and_home_are_shown_on_request_and_other_messages_are_unsupported() {
    let mut world = World::flying();
    for (id, expected) in
        [(148.0, ACCEPTED), (242.0, ACCEPTED), (9_999.0, UNSUPPORTED), (NAN, DENIED)]
    {
        world.send_command(512, [id, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(512, expected)], "message {id}");
    }
    let version: AUTOPILOT_VERSION_DATA = world.got.iter().find_map(Got::read).unwrap();
    assert_eq!(version.flight_sw_version >> 16, 0x0111);
    let home: HOME_POSITION_DATA = world.got.iter().find_map(Got::read).unwrap();
    assert_eq!((home.latitude, home.longitude, home.altitude), (349_000_000, -1_179_000_000, 0));
}

#[test]
fn pings_and_time_questions_are_answered_to_the_sender() {
    let mut world = World::flying();
    let question = PING_DATA { time_usec: 77, seq: 5, target_system: 0, target_component: 0 };
    world.send(&MavMessage::PING(question));
    let answer: PING_DATA = world.got.iter().find_map(Got::read).unwrap();
    assert_eq!((answer.seq, answer.target_system, answer.target_component), (5, 255, 190));
    let question = TIMESYNC_DATA { tc1: 0, ts1: 99, target_system: 0, target_component: 0 };
    world.send(&MavMessage::TIMESYNC(question));
    let answer: TIMESYNC_DATA = world.got.iter().find_map(Got::read).unwrap();
    assert_eq!(answer.ts1, 99);
    assert_eq!(answer.tc1, i64::try_from(world.now.as_micros() * 1000).unwrap());
}

#[test]
fn commands_that_no_aircraft_answers_are_given_up_and_the_table_of_them_is_bounded() {
    let mut world = World::flying();
    world.plant = PlantManner::Silent;
    for i in 0..100_u8 {
        // Different onsets, so that none is a copy of another.
        let onset = 100.0 + f32::from(i);
        world.send_command(31_010, [102.0, 2.0, 1.0, 0.0, 0.0, 0.0, onset]);
    }
    let at_once = world.take_acks();
    assert_eq!(at_once, vec![ack(31_010, LATER); 100 - 32]);
    world.run_ms(3_100);
    assert_eq!(world.take_acks(), vec![ack(31_010, LATER); 32]);
}
