//! Modes: by DO_SET_MODE, by SET_MODE, as standard modes; the messages about them.

#![expect(deprecated, reason = "ground stations still use SET_MODE")]

use super::world::*;
use crate::codec::{self, Encoded, OWN, Skipped};
use crate::modes;
use ::mavlink::MavlinkVersion;
use ::mavlink::MessageData;
use ::mavlink::dialects::common::{
    AVAILABLE_MODES_DATA, AVAILABLE_MODES_MONITOR_DATA, CURRENT_MODE_DATA, HEARTBEAT_DATA,
    MavMessage, MavModeFlag, MavModeProperty, MavResult, SET_MODE_DATA,
};
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Mode;

const NAN: f32 = f32::NAN;
const ACCEPTED: MavResult = MavResult::MAV_RESULT_ACCEPTED;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
const LATER: MavResult = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;

fn commanded_modes(world: &mut World) -> Vec<Mode> {
    let commands = world.take_commands().into_iter();
    commands
        .filter_map(|command| match command {
            Command::Vehicle(VehicleCommand::Mode(mode)) => Some(mode),
            _ => None,
        })
        .collect()
}

fn read<D: MessageData>(message: &Encoded) -> D {
    let (bytes, mut skipped) = (message.frame(OWN, 0), Skipped::default());
    let frame = codec::next_frame(&mut &bytes[..], &mut skipped).unwrap();
    assert_eq!(frame.id, D::ID);
    D::deser(MavlinkVersion::V2, frame.payload).unwrap()
}

#[test]
fn a_mode_change_shows_in_a_heartbeat_at_once() {
    let mut world = World::flying();
    world.run_ms(500);
    world.send(&super::offboard::setpoint(0.0));
    for (main, sub, custom_mode) in [(6.0, 0.0, 393_216), (4.0, 3.0, 50_593_792)] {
        world.got.clear();
        world.send_command(176, [129.0, main, sub, NAN, NAN, NAN, NAN]);
        let beats: Vec<HEARTBEAT_DATA> = world
            .got
            .iter()
            .filter(|got| got.to == address(14_550))
            .filter_map(Got::read)
            .collect();
        assert_eq!(beats.len(), 1, "one extra heartbeat");
        assert_eq!(beats[0].custom_mode, custom_mode);
        assert_eq!(world.take_acks(), [ack(176, ACCEPTED)]);
    }
}

#[test]
fn set_mode_works_without_an_acknowledgement_and_reports_a_refusal() {
    let mut world = World::flying();
    let base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
    let set = |custom_mode| {
        MavMessage::SET_MODE(SET_MODE_DATA { custom_mode, target_system: 1, base_mode })
    };
    world.send(&set(50_593_792));
    world.send(&set(393_216));
    world.send(&set(100_925_440));
    assert_eq!(world.take_acks(), []);
    assert!(world.has_text("Offboard refused: no setpoint"), "{:?}", world.texts());
    assert!(world.has_text("Land is not flown here: use Return"), "{:?}", world.texts());
    let commands = world.take_commands();
    assert!(
        matches!(commands[..], [Command::Vehicle(VehicleCommand::Mode(Mode::Hold))]),
        "{commands:?}"
    );
}

#[test]
fn set_mode_reports_also_refusals_of_the_vehicle() {
    let mut world = World::flying();
    let base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
    let mission = SET_MODE_DATA { custom_mode: 67_371_008, target_system: 1, base_mode };
    world.send(&MavMessage::SET_MODE(mission));
    assert_eq!(world.take_all_acks(), []);
    assert!(world.has_text("Refused: there is no plan"), "{:?}", world.texts());
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Position);
}

#[test]
fn every_mode_can_be_requested_by_both_commands_and_nan_is_no_sub_mode() {
    for (params, mode) in [
        ([1.0, 4.0, 3.0], Mode::Hold),
        ([129.0, 4.0, 4.0], Mode::Mission),
        ([1.0, 4.0, 5.0], Mode::Return),
        ([1.0, 3.0, 0.0], Mode::Position),
        ([129.0, 6.0, 0.0], Mode::Offboard),
        ([129.0, 6.0, NAN], Mode::Offboard),
    ] {
        let mut world = World::flying();
        world.send(&super::offboard::setpoint(0.0));
        let [p1, p2, p3] = params;
        world.send_command(176, [p1, p2, p3, NAN, NAN, NAN, NAN]);
        world.send_command_int(176, 0, [p1, p2, p3, NAN], NAN);
        assert_eq!(commanded_modes(&mut world), [mode, mode]);
        assert_eq!(world.take_acks().len(), 2);
    }
}

#[test]
fn a_mode_that_is_none_is_denied_and_one_that_waits_for_a_stream_is_rejected_for_now() {
    let mut world = World::flying();
    for (params, expected) in [
        ([0.0, 4.0, 3.0], DENIED),
        ([1.0, 1.0, 0.0], DENIED),
        ([1.0, 4.0, 6.0], DENIED),
        ([1.0, 4.0, 11.0], DENIED),
        ([1.0, 3.0, 1.0], DENIED),
        ([1.0, 4.5, 3.0], DENIED),
        ([NAN, 4.0, 3.0], DENIED),
        ([1.0, 6.0, 0.0], LATER),
        ([1.0, 2.0, 0.0], LATER),
    ] {
        world.got.clear();
        let [p1, p2, p3] = params;
        world.send_command(176, [p1, p2, p3, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(176, expected)], "{params:?}");
        assert_eq!(world.texts().len(), 1, "the reason is reported: {params:?}");
    }
    assert!(world.take_commands().is_empty());
}

#[test]
fn standard_modes_are_the_modes_that_mean_the_same_and_others_have_failed() {
    let mut world = World::flying();
    for (standard, mode) in [(3.0, Mode::Position), (5.0, Mode::Return), (6.0, Mode::Mission)] {
        world.send_command(262, [standard, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(commanded_modes(&mut world), [mode]);
    }
    world.take_acks();
    for standard in [0.0, 1.0, 2.0, 7.0, 99.0] {
        world.send_command(262, [standard, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(262, MavResult::MAV_RESULT_FAILED)], "{standard}");
    }
}

#[test]
fn return_to_launch_is_a_mode() {
    let mut world = World::flying();
    world.send_command(20, [0.0; 7]);
    assert_eq!(commanded_modes(&mut world), [Mode::Return]);
    assert_eq!(world.take_acks(), [ack(20, ACCEPTED)]);
}

#[test]
fn the_listed_modes_are_those_that_can_be_flown() {
    let listed: Vec<AVAILABLE_MODES_DATA> =
        (1..=modes::COUNT).map(|i| read(&modes::available_modes(i).unwrap())).collect();
    for (i, (mode, shown)) in Mode::ALL.into_iter().zip(&listed).enumerate() {
        assert_eq!((shown.number_modes, usize::from(shown.mode_index)), (7, i + 1), "{mode}");
        assert_eq!(shown.custom_mode, modes::custom_mode(mode), "{mode}");
        let is_auto = shown.properties.contains(MavModeProperty::MAV_MODE_PROPERTY_AUTO_MODE);
        assert_eq!(is_auto, mode != Mode::Altitude, "{mode}: only a pilot flies Altitude");
        let is_hidden =
            shown.properties.contains(MavModeProperty::MAV_MODE_PROPERTY_NOT_USER_SELECTABLE);
        assert!(!is_hidden, "{mode}");
    }
}

#[test]
fn the_current_mode_is_that_of_the_heartbeat_and_the_list_never_changes() {
    let mut world = World::flying();
    let current: CURRENT_MODE_DATA = read(&modes::current_mode(&world.ground.shared.aircraft));
    assert_eq!(current.custom_mode, modes::custom_mode(Mode::Position));
    world.send_command(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
    let current: CURRENT_MODE_DATA = read(&modes::current_mode(&world.ground.shared.aircraft));
    assert_eq!(current.custom_mode, modes::custom_mode(Mode::Hold));
    let monitor: AVAILABLE_MODES_MONITOR_DATA =
        read(&modes::monitor(&crate::aircraft::Aircraft::default()));
    assert_eq!(monitor.seq, 0);
}
