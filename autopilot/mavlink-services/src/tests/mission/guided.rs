//! Items that do not belong to a plan.

use super::client::*;
use crate::tests::world::*;
use ::mavlink::dialects::common::{MISSION_ACK_DATA, MavCmd, MavMessage, MavMissionResult as R};
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::{Mode, Reference};

/// MISSION_ITEM with a waypoint above home.
pub fn floats(seq: u16, current: u8, x: f32, y: f32, z: f32) -> MavMessage {
    // The crate marks the message as deprecated; ground stations send it.
    #[expect(deprecated, reason = "ground stations still send MISSION_ITEM")]
    let item = ::mavlink::dialects::common::MISSION_ITEM_DATA {
        x,
        y,
        z,
        seq,
        command: MavCmd::MAV_CMD_NAV_WAYPOINT,
        frame: ::mavlink::dialects::common::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
        current,
        autocontinue: 1,
        target_system: 1,
        target_component: 1,
        ..Default::default()
    };
    #[expect(deprecated, reason = "ground stations still send MISSION_ITEM")]
    MavMessage::MISSION_ITEM(item)
}

fn results(world: &World) -> Vec<R> {
    world
        .got
        .iter()
        .filter_map(Got::read::<MISSION_ACK_DATA>)
        .map(|answer| answer.mavtype)
        .collect()
}

#[test]
fn a_guided_item_sends_the_aircraft_to_a_place_in_hold() {
    let mut world = World::flying();
    world.send(&floats(0, 2, 35.1, -117.8, 6_000.0));
    assert_eq!(results(&world), [ACCEPTED], "{:?}", world.texts());
    let commands = world.take_commands();
    let [Command::Vehicle(VehicleCommand::Reposition(reposition))] = &commands[..] else {
        panic!("{commands:?}")
    };
    let place = reposition.place.unwrap();
    // 1e-8 rad are 6 cm: the field has seven digits of a degree.
    assert!((place.latitude_rad.to_degrees() - 35.1).abs() < 1.0e-7);
    assert!((place.longitude_rad.to_degrees() + 117.8).abs() < 1.0e-7);
    assert_eq!(reposition.altitude_m, Some(6_000.0));
    world.run_ms(100);
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Hold);
}

#[test]
fn an_altitude_by_an_item_is_a_reference() {
    let mut world = World::flying();
    world.send(&floats(0, 3, 0.0, 0.0, 6_500.0));
    assert_eq!(results(&world), [ACCEPTED], "{:?}", world.texts());
    let commands = world.take_commands();
    assert!(
        matches!(commands[..], [Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(altitude)))] if altitude == 6_500.0),
        "{commands:?}"
    );
}

#[test]
fn guided_items_outside_the_limits_are_refused_with_the_range() {
    let mut world = World::flying();
    for current in [2, 3] {
        world.got.clear();
        world.send(&floats(0, current, 35.1, -117.8, 50.0));
        assert_eq!(results(&world), [R::MAV_MISSION_INVALID_PARAM7]);
        assert!(
            world.has_text("altitude 50.0 m is outside 500.0 to 12000.0 m"),
            "{:?}",
            world.texts()
        );
    }
    let other = item(0, MavCmd::MAV_CMD_NAV_LAND, [0.0; 4]);
    world.got.clear();
    world.send(&MavMessage::MISSION_ITEM_INT(::mavlink::dialects::common::MISSION_ITEM_INT_DATA {
        current: 2,
        ..other
    }));
    assert_eq!(results(&world), [R::MAV_MISSION_UNSUPPORTED]);
    assert!(world.take_commands().is_empty());
}

#[test]
fn a_guided_item_does_not_disturb_an_upload() {
    let mut world = World::flying();
    world.send(&count(1));
    world.send(&floats(0, 2, 35.1, -117.8, 6_000.0));
    world.got.clear();
    world.send(&MavMessage::MISSION_ITEM_INT(waypoint(0)));
    assert_eq!(results(&world), [ACCEPTED]);
    let plan = world.take_commands().into_iter().find_map(|command| match command {
        Command::Vehicle(VehicleCommand::Plan(plan)) => Some(plan.items.len()),
        _ => None,
    });
    assert_eq!(plan, Some(1));
}
