//! Sequences as ground stations have them.

use super::client::*;
use crate::tests::world::*;
use ::mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_COUNT_DATA, MISSION_CURRENT_DATA, MISSION_ITEM_INT_DATA,
    MISSION_REQUEST_INT_DATA, MISSION_REQUEST_LIST_DATA, MavCmd, MavFrame, MavMessage,
    MavMissionResult, MavMissionType,
};
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Airspeed;
use flight_management::vehicle::plan::Action;

fn plan_of(world: &mut World) -> Vec<Action> {
    let plans = world.take_commands().into_iter().filter_map(|command| match command {
        Command::Vehicle(VehicleCommand::Plan(plan)) => Some(plan),
        _ => None,
    });
    let plan = plans.last().expect("a plan reached the control side");
    plan.items.iter().map(|item| item.action).collect()
}

#[test]
fn a_connecting_ground_station_gets_an_empty_list_in_the_same_poll() {
    for (list, kind) in [
        MavMissionType::MAV_MISSION_TYPE_MISSION,
        MavMissionType::MAV_MISSION_TYPE_FENCE,
        MavMissionType::MAV_MISSION_TYPE_RALLY,
    ]
    .into_iter()
    .enumerate()
    {
        let mut world = World::waiting();
        let list_request =
            MISSION_REQUEST_LIST_DATA { target_system: 1, target_component: 1, mission_type: kind };
        world.send(&MavMessage::MISSION_REQUEST_LIST(list_request));
        let counts: Vec<MISSION_COUNT_DATA> = world.got.iter().filter_map(Got::read).collect();
        assert_eq!(counts.len(), 1, "list {list}");
        assert_eq!((counts[0].count, counts[0].opaque_id), (0, 0));
        assert_eq!((counts[0].target_system, counts[0].target_component), (255, 190));
        assert_eq!(counts[0].mission_type, kind);
    }
}

#[test]
fn a_downloaded_plan_is_the_uploaded_one_with_the_same_id() {
    let mut client = Client::new(QGC);
    let mut items = waypoints(3);
    items[1].frame = MavFrame::MAV_FRAME_GLOBAL;
    items[1].autocontinue = 0;
    items[2].z = 5_123.4;
    items.push(item(3, MavCmd::MAV_CMD_DO_JUMP, [0.0, 3.0, 0.0, 0.0]));
    items[3].frame = MavFrame::MAV_FRAME_MISSION;
    (items[3].x, items[3].y, items[3].z) = (0, 0, 0.0);
    let (result, id) = client.upload(&items).unwrap();
    assert_eq!(result, ACCEPTED, "{:?}", client.world.texts());
    let (got, got_id) = client.download().unwrap();
    assert_eq!(bytes(&got), bytes(&items));
    assert_eq!(got_id, id);
    assert_ne!(id, 0);
    // The same again has the same id, another plan another.
    assert_eq!(client.upload(&items), Some((ACCEPTED, id)));
    items[0].z += 1.0;
    assert_ne!(client.upload(&items).unwrap().1, id);
}

#[test]
fn each_item_is_requested_once_and_in_order_and_one_acknowledgement_ends_it() {
    let mut world = World::flying();
    let items = waypoints(3);
    world.send(&count(items.len()));
    for (seq, item) in (0..).zip(&items) {
        let requests: Vec<MISSION_REQUEST_INT_DATA> =
            world.got.iter().filter_map(Got::read).collect();
        assert_eq!(requests.len(), 1);
        assert_eq!((requests[0].seq, requests[0].target_system), (seq, 255));
        world.got.clear();
        world.send(&MavMessage::MISSION_ITEM_INT(item.clone()));
    }
    world.run_ms(10_000);
    let acks: Vec<MISSION_ACK_DATA> = world.got.iter().filter_map(Got::read).collect();
    assert_eq!(acks.len(), 1, "{acks:?}");
    assert_eq!(acks[0].mavtype, ACCEPTED);
    assert_eq!(world.got.iter().filter_map(requested).count(), 0);
    assert!(world.has_text("Mission loaded: 3 items"), "{:?}", world.texts());
}

#[test]
fn a_plan_of_mavsdk_with_speeds_delays_and_return_is_taken() {
    let mut client = Client::new(MAVSDK);
    let mut items = vec![
        item(0, MavCmd::MAV_CMD_NAV_WAYPOINT, [0.5, 1.0, 0.0, f32::NAN]),
        item(1, MavCmd::MAV_CMD_DO_CHANGE_SPEED, [1.0, 250.0, -1.0, 0.0]),
        item(2, MavCmd::MAV_CMD_NAV_DELAY, [30.0, -1.0, -1.0, -1.0]),
        item(3, MavCmd::MAV_CMD_NAV_RETURN_TO_LAUNCH, [f32::NAN; 4]),
    ];
    for item in &mut items[1..] {
        item.frame = MavFrame::MAV_FRAME_MISSION;
        (item.x, item.y, item.z) = (0, 0, f32::NAN);
    }
    assert_eq!(client.upload(&items).unwrap().0, ACCEPTED, "{:?}", client.world.texts());
    let actions = plan_of(&mut client.world);
    // A metre is too small an acceptance radius for a jet.
    let Action::Waypoint { point, acceptance_m: None } = actions[0] else {
        panic!("{:?}", actions[0])
    };
    assert_eq!(actions[1], Action::ChangeSpeed { airspeed: Airspeed::True(250.0) });
    let Action::LoiterTime { circle, seconds: 30.0 } = actions[2] else {
        panic!("{:?}", actions[2])
    };
    assert_eq!(circle.centre.place, point.place, "a delay stays at the point before it");
    assert_eq!(actions[3], Action::Return);
    client.world.run_ms(10);
    assert!(client.world.has_text("Mission item 0: hold time is not flown"));
    assert!(client.world.has_text("Mission item 0: acceptance radius is below NAV_ACC_RAD"));
    assert!(client.world.has_text("Mission item 1: ground speed is flown as true airspeed"));
}

#[test]
fn two_ground_stations_download_at_the_same_time_and_neither_sees_the_others_plan() {
    let mut client = Client::new(MAVSDK);
    client.upload(&waypoints(3)).unwrap();
    let (first, other) = (address(14_550), address(14_540));
    let list = MavMessage::MISSION_REQUEST_LIST(MISSION_REQUEST_LIST_DATA {
        target_system: 1,
        target_component: 1,
        ..Default::default()
    });
    let world = &mut client.world;
    let mut exchange = |from, message: &MavMessage| {
        world.got.clear();
        let bytes = world.encode(STATION, message);
        world.send_bytes(from, &bytes);
        let answers = world.got.iter().filter(|got| got.to == from);
        answers.filter_map(Got::read::<MISSION_ITEM_INT_DATA>).collect::<Vec<_>>()
    };
    exchange(first, &list);
    exchange(other, &list);
    for seq in 0..3 {
        assert_eq!(bytes(&exchange(first, &request(seq))), bytes(&[waypoint(seq)]));
        assert_eq!(bytes(&exchange(other, &request(seq))), bytes(&[waypoint(seq)]));
    }
    // A plan that comes between two items does not mix with the one that is being read.
    client.address = first;
    let mut changed = waypoints(3);
    changed[2].z = 7_000.0;
    client.upload(&changed).unwrap();
    let world = &mut client.world;
    world.got.clear();
    let bytes_of_request = world.encode(STATION, &request(2));
    world.send_bytes(other, &bytes_of_request);
    let got: Vec<MISSION_ITEM_INT_DATA> = world.got.iter().filter_map(Got::read).collect();
    assert_eq!(got.len(), 1);
    assert_eq!(got[0].z.to_bits(), waypoint(2).z.to_bits());
}

#[test]
fn an_item_beyond_the_list_is_an_invalid_sequence() {
    let mut client = Client::new(MAVPROXY);
    client.upload(&waypoints(2)).unwrap();
    for seq in [2, 3, u16::MAX] {
        let result =
            client.exchange(&request(seq), |got| Some(got.read::<MISSION_ACK_DATA>()?.mavtype));
        assert_eq!(result, Some(MavMissionResult::MAV_MISSION_INVALID_SEQUENCE), "{seq}");
    }
}

#[test]
fn a_new_current_item_is_broadcast_and_an_unknown_one_is_refused_with_a_text() {
    let mut client = Client::new(QGC);
    client.upload(&waypoints(3)).unwrap();
    // MISSION_SET_CURRENT by hand, since the crate marks it as deprecated.
    let set = |seq| frame(41, 28, &[seq, 0, 1, 1]);
    client.world.got.clear();
    client.world.send_bytes(address(14_550), &set(2));
    for to in [address(14_550), address(14_540)] {
        let mine = client.world.got.iter().filter(|got| got.to == to);
        let current: Vec<MISSION_CURRENT_DATA> = mine.filter_map(Got::read).collect();
        let last = current.last().expect("MISSION_CURRENT at once");
        assert_eq!((last.seq, last.total), (2, 3));
        assert_ne!(last.mission_id, 0);
    }
    client.world.send_bytes(address(14_550), &set(3));
    assert!(
        client.world.has_text("Mission refused: there is no item 3"),
        "{:?}",
        client.world.texts()
    );
}

#[test]
fn a_cleared_plan_is_gone_for_everybody_and_clearing_again_is_fine() {
    let mut client = Client::new(MAVPROXY);
    client.upload(&waypoints(3)).unwrap();
    assert_eq!(client.clear(), Some(ACCEPTED));
    assert_eq!(client.clear(), Some(ACCEPTED));
    assert_eq!(client.download(), Some((Vec::new(), 0)));
    client.upload(&waypoints(1)).unwrap();
    // An upload of nothing is the same.
    assert_eq!(client.upload(&[]), Some((ACCEPTED, 0)));
    assert_eq!(client.download(), Some((Vec::new(), 0)));
}
