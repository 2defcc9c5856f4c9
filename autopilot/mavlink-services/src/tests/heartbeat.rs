//! Heartbeats as ground stations receive them.

use ::mavlink::dialects::common::{
    HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag, MavState, PARAM_REQUEST_LIST_DATA,
};

use super::world::{Got, STATION, World, address};
use crate::Ground;
use crate::heartbeat::HeartbeatIdentity;
use crate::modes;
use crate::telemetry::Host;
use flight_management::event::{Event, EventKind};
use flight_management::parameters::Parameters;
use flight_management::vehicle::{Mode, VehicleEvent};

fn heartbeats_at(world: &World, port: u16) -> Vec<HEARTBEAT_DATA> {
    world.got.iter().filter(|got| got.to == address(port)).filter_map(Got::read).collect()
}

fn heartbeat_after(world: &mut World, kind: EventKind) -> HEARTBEAT_DATA {
    world.got.clear();
    world.ground.handle_event(&Event { time: world.sim, kind }, world.now);
    world.settle();
    heartbeats_at(world, 14_550).into_iter().next().expect("a heartbeat at once")
}

#[test]
fn a_heartbeat_comes_once_a_second_to_everybody() {
    let mut world = World::flying();
    world.run_ms(10_000);
    for port in [14_550, 14_540] {
        let got = heartbeats_at(&world, port).len();
        assert!((9..=11).contains(&got), "{got} in ten seconds at {port}");
    }
}

#[test]
fn a_new_peer_gets_one_heartbeat_at_once() {
    let mut world = World::flying();
    world.run_ms(300);
    world.got.clear();
    let data = PARAM_REQUEST_LIST_DATA { target_system: 9, target_component: 9 };
    let hello = world.encode(STATION, &MavMessage::PARAM_REQUEST_LIST(data));
    world.send_bytes(address(9_000), &hello);
    assert_eq!(heartbeats_at(&world, 9_000).len(), 1, "in the same moment");
    assert!(heartbeats_at(&world, 14_550).is_empty(), "the others wait for theirs");
    world.send_bytes(address(9_000), &hello);
    assert_eq!(heartbeats_at(&world, 9_000).len(), 1);
}

#[test]
fn each_change_of_content_is_sent_at_once() {
    let mut world = World::flying();
    let hold = heartbeat_after(&mut world, EventKind::Vehicle(VehicleEvent::Mode(Mode::Hold)));
    assert_eq!(hold.custom_mode, 50_593_792);
    let sticks =
        heartbeat_after(&mut world, EventKind::Vehicle(VehicleEvent::Mode(Mode::Altitude)));
    assert!(sticks.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_MANUAL_INPUT_ENABLED));
    assert!(!sticks.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_AUTO_ENABLED));
    let down = heartbeat_after(&mut world, EventKind::GroundContact);
    assert_eq!(down.system_status, MavState::MAV_STATE_STANDBY);
    assert!(!down.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED));
}

#[test]
fn the_aircraft_is_armed_before_the_plant_calls_so_that_no_station_sees_the_end_of_a_mission() {
    let mut world = World::waiting();
    world.settle();
    let heartbeats = heartbeats_at(&world, 14_550);
    let heartbeat = heartbeats.last().unwrap();
    assert_eq!(heartbeat.system_status, MavState::MAV_STATE_BOOT);
    assert!(heartbeat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED));
}

#[test]
fn a_silent_plant_is_no_emergency_of_the_aircraft() {
    let mut world = World::flying();
    world.settle();
    world.autopilot.plant_lost();
    world.run_ms(1_100);
    let heartbeats = heartbeats_at(&world, 14_550);
    let heartbeat = heartbeats.last().unwrap();
    assert_eq!(heartbeat.system_status, MavState::MAV_STATE_ACTIVE);
    assert!(heartbeat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED));
}

#[test]
fn a_terminated_flight_is_shown_as_one_and_is_not_armed() {
    let mut world = World::flying();
    let heartbeat = heartbeat_after(&mut world, EventKind::Vehicle(VehicleEvent::Terminated));
    assert_eq!(heartbeat.system_status, MavState::MAV_STATE_FLIGHT_TERMINATION);
    assert!(!heartbeat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED));
    let again = heartbeat_after(&mut world, EventKind::FlightBegan { joined_in_flight: false });
    assert_eq!(again.system_status, MavState::MAV_STATE_ACTIVE);
}

#[test]
fn every_mode_has_its_custom_mode_and_the_custom_flag() {
    let mut world = World::flying();
    // A flight begins in the first one, so begin with the second: only changes are sent at once.
    let [first, rest @ ..] = Mode::ALL;
    for mode in rest.into_iter().chain([first]) {
        let heartbeat = heartbeat_after(&mut world, EventKind::Vehicle(VehicleEvent::Mode(mode)));
        assert!(heartbeat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED));
        assert_eq!(heartbeat.custom_mode, modes::custom_mode(mode), "{mode}");
    }
}

#[test]
fn the_autopilot_it_names_can_be_chosen() {
    for (identity, expected) in [
        (HeartbeatIdentity::Px4, MavAutopilot::MAV_AUTOPILOT_PX4),
        (HeartbeatIdentity::Generic, MavAutopilot::MAV_AUTOPILOT_GENERIC),
    ] {
        let mut world = World::waiting();
        let model = *world.autopilot.model();
        let host = Host { identity, ..Host::default() };
        world.ground =
            Ground::new(&Parameters::default(), &model, &[address(14_550)]).with_host(host);
        world.settle();
        let heartbeat = heartbeats_at(&world, 14_550).pop().unwrap();
        assert_eq!(heartbeat.autopilot, expected);
    }
}
