//! Plans whose item 0 is home, as in the files of waypoints of ArduPilot's ground stations.

use super::client::*;
use crate::tests::world::*;
use ::mavlink::dialects::common::{MISSION_ITEM_INT_DATA, MavCmd, MavFrame, MavMissionResult};
use flight_management::command::{Command, VehicleCommand};
use flight_management::vehicle::plan::Action;

const TO_ITEM_1: Action = Action::Jump { to: 1, times: None };

fn home(z: f32) -> MISSION_ITEM_INT_DATA {
    let frame = MavFrame::MAV_FRAME_GLOBAL;
    MISSION_ITEM_INT_DATA { z, frame, ..item(0, MavCmd::MAV_CMD_NAV_WAYPOINT, [0.0; 4]) }
}

fn absolute(mut items: Vec<MISSION_ITEM_INT_DATA>) -> Vec<MISSION_ITEM_INT_DATA> {
    items.iter_mut().for_each(|item| item.frame = MavFrame::MAV_FRAME_GLOBAL);
    items
}

/// `first`, two waypoints, three jumps back to item 1.
fn plan(first: MISSION_ITEM_INT_DATA) -> Vec<MISSION_ITEM_INT_DATA> {
    let jump = item(3, MavCmd::MAV_CMD_DO_JUMP, [1.0, 3.0, 0.0, 0.0]);
    vec![first, waypoint(1), waypoint(2), jump]
}

/// Actions of the plan that the aircraft gets, after the download has given every item back.
fn flown(items: &[MISSION_ITEM_INT_DATA]) -> (Vec<Action>, World) {
    let mut client = Client::new(QGC);
    assert_eq!(client.upload(items).unwrap().0, ACCEPTED, "{:?}", client.world.texts());
    let commands = client.world.take_commands();
    let actions = commands.iter().find_map(|command| match command {
        Command::Vehicle(VehicleCommand::Plan(plan)) => {
            Some(plan.items.iter().map(|item| item.action).collect())
        }
        _ => None,
    });
    assert_eq!(bytes(&client.download().unwrap().0), bytes(items));
    (actions.unwrap(), client.world)
}

#[test]
fn home_as_item_0_leads_to_item_1_and_jumps_keep_their_targets() {
    let speed = item(1, MavCmd::MAV_CMD_DO_CHANGE_SPEED, [0.0, 280.0, 0.0, 0.0]);
    let after_speed = vec![home(702.0), speed, waypoint(2)];
    let far = MISSION_ITEM_INT_DATA { x: -353_632_620, y: 1_491_652_370, ..home(584.0) };
    let nowhere = MISSION_ITEM_INT_DATA { x: 0, y: 0, ..home(0.0) };
    let relative = [home(0.0), home(702.0), home(-30.0), far, nowhere].map(plan);
    let in_absolute = [home(0.0), home(450.0)].map(plan).map(absolute);
    for items in relative.into_iter().chain(in_absolute).chain([after_speed]) {
        let (actions, world) = flown(&items);
        assert_eq!(actions[0], TO_ITEM_1, "{:?}", items[0]);
        assert!(world.has_text("Mission item 0: taken as home"), "{:?}", world.texts());
        if let Some(jump) = actions.get(3) {
            assert_eq!(*jump, Action::Jump { to: 1, times: Some(3) });
        }
    }
}

#[test]
fn a_waypoint_as_item_0_is_flown() {
    let relative = item(0, MavCmd::MAV_CMD_NAV_WAYPOINT, [0.0; 4]);
    let without_yaw = MISSION_ITEM_INT_DATA { param4: f32::NAN, ..home(5_100.0) };
    let all_absolute = absolute(plan(home(5_100.0)));
    let behind_a_speed = {
        let speed = item(1, MavCmd::MAV_CMD_DO_CHANGE_SPEED, [0.0, 280.0, 0.0, 0.0]);
        absolute(vec![home(5_100.0), speed, waypoint(2)])
    };
    let alone = vec![home(5_100.0)];
    for items in [plan(relative), plan(without_yaw), all_absolute, behind_a_speed, alone] {
        let (actions, world) = flown(&items);
        assert_eq!(actions.len(), items.len());
        assert!(matches!(actions[0], Action::Waypoint { .. }), "{actions:?}");
        assert!(!world.has_text("home"), "{:?}", world.texts());
    }
}

#[test]
fn an_item_0_that_is_neither_is_refused_with_its_number() {
    let mut client = Client::new(QGC);
    let result = client.upload(&absolute(plan(home(25_000.0)))).unwrap().0;
    assert_eq!(result, MavMissionResult::MAV_MISSION_INVALID_PARAM7);
    assert!(client.world.has_text("Mission refused: item 0: NAV_WAYPOINT (16): altitude"));
}
