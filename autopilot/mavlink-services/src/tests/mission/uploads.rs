//! Uploads with repetitions, gaps and interruptions.

use super::client::*;
use crate::codec::Identity;
use crate::tests::world::*;
use ::mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_ITEM_INT_DATA, MavMessage, MavMissionResult as R, MavMissionType,
    MavResult,
};
use flight_management::command::Command;
use flight_management::command::VehicleCommand;

fn requests(world: &mut World) -> Vec<u16> {
    let requests = world.got.iter().filter_map(requested).collect();
    world.got.retain(|got| requested(got).is_none());
    requests
}

fn results(world: &mut World) -> Vec<R> {
    let acks = world.got.iter().filter_map(Got::read::<MISSION_ACK_DATA>);
    let results = acks.map(|answer| answer.mavtype).collect();
    world.got.retain(|got| got.id != 47);
    results
}

fn message(item: MISSION_ITEM_INT_DATA) -> MavMessage {
    MavMessage::MISSION_ITEM_INT(item)
}

fn plans(world: &mut World) -> usize {
    world
        .take_commands()
        .iter()
        .filter(|command| matches!(command, Command::Vehicle(VehicleCommand::Plan(_))))
        .count()
}

#[test]
fn an_item_that_does_not_come_is_requested_each_second_and_given_up_after_five() {
    let mut client = Client::new(QGC);
    client.upload(&waypoints(2)).unwrap();
    let before = client.download().unwrap();
    let world = &mut client.world;
    world.got.clear();
    world.send(&count(4));
    world.send(&message(waypoint(0)));
    assert_eq!(requests(world), [0, 1]);
    world.run_ms(4_500);
    assert_eq!((requests(world), results(world)), (vec![1; 4], vec![]));
    world.run_ms(1_000);
    assert_eq!(
        (requests(world), results(world)),
        (vec![], vec![R::MAV_MISSION_OPERATION_CANCELLED])
    );
    assert!(world.has_text("item 1 did not come"), "{:?}", world.texts());
    let after = client.download().unwrap();
    assert_eq!((bytes(&after.0), after.1), (bytes(&before.0), before.1), "the old plan stays");
}

#[test]
fn a_cancelled_upload_ends_in_silence_and_the_old_plan_stays() {
    let mut client = Client::new(QGC);
    client.upload(&waypoints(2)).unwrap();
    let world = &mut client.world;
    world.got.clear();
    world.take_commands();
    world.send(&count(3));
    world.send(&message(waypoint(0)));
    world.send(&mission_ack(R::MAV_MISSION_OPERATION_CANCELLED));
    requests(world);
    world.run_ms(10_000);
    assert_eq!((requests(world), results(world), plans(world)), (vec![], vec![], 0));
    assert_eq!(client.download().unwrap().0.len(), 2);
}

#[test]
fn a_second_ground_station_is_denied_until_the_first_is_done() {
    let mut world = World::flying();
    let other = address(14_540);
    world.send(&count(2));
    world.got.clear();
    let begin = world.encode(STATION, &count(1));
    world.send_bytes(other, &begin);
    let acks: Vec<(_, R)> = world
        .got
        .iter()
        .filter_map(|got| Some((got.to, got.read::<MISSION_ACK_DATA>()?.mavtype)))
        .collect();
    assert_eq!(acks, [(other, R::MAV_MISSION_DENIED)]);
    // An item of the second one does not get into the plan of the first.
    let foreign = MISSION_ITEM_INT_DATA { z: 9_000.0, ..waypoint(0) };
    let foreign = world.encode(STATION, &message(foreign));
    world.send_bytes(other, &foreign);
    world.got.clear();
    world.send(&message(waypoint(0)));
    world.send(&message(waypoint(1)));
    assert_eq!(results(&mut world), [ACCEPTED]);
    let begin = world.encode(STATION, &count(1));
    world.send_bytes(other, &begin);
    assert_eq!(requests(&mut world), [1, 0]);
    let client = Client {
        world,
        address: address(14_550),
        identity: STATION,
        manner: QGC,
        list: MavMissionType::MAV_MISSION_TYPE_MISSION,
        lost: 0,
        count: 0,
    };
    let mut client = client;
    assert_eq!(bytes(&client.download().unwrap().0), bytes(&waypoints(2)));
}

#[test]
fn another_program_on_the_same_link_is_another_ground_station() {
    let mut world = World::flying();
    world.send(&count(2));
    world.got.clear();
    let begin = world.encode(Identity { system: 254, component: 190 }, &count(1));
    world.send_bytes(address(14_550), &begin);
    assert_eq!(results(&mut world), [R::MAV_MISSION_DENIED]);
    assert!(requests(&mut world).is_empty());
}

#[test]
fn a_ground_station_may_restart_an_upload_in_the_middle() {
    let mut world = World::flying();
    world.send(&count(5));
    for item in waypoints(3) {
        world.send(&message(item));
    }
    assert_eq!(requests(&mut world), [0, 1, 2, 3]);
    world.take_commands();
    world.send(&count(2));
    assert_eq!(requests(&mut world), [0]);
    world.send(&message(waypoint(0)));
    world.send(&message(waypoint(1)));
    assert_eq!((requests(&mut world), results(&mut world)), (vec![1], vec![ACCEPTED]));
    assert_eq!(plans(&mut world), 1);
}

#[test]
fn a_repeated_last_item_is_acknowledged_again_and_changes_nothing() {
    let mut world = World::flying();
    world.send(&count(2));
    world.send(&message(waypoint(0)));
    world.send(&message(waypoint(1)));
    assert_eq!((results(&mut world), plans(&mut world)), (vec![ACCEPTED], 1));
    world.run_ms(500);
    world.send(&message(waypoint(1)));
    assert_eq!((results(&mut world), plans(&mut world)), (vec![ACCEPTED], 0));
    // A late copy of an earlier item has no effect.
    world.send(&message(waypoint(0)));
    assert_eq!((results(&mut world), plans(&mut world)), (vec![], 0));
}

#[test]
fn copies_and_items_out_of_order_are_dropped_and_do_not_multiply() {
    let mut world = World::flying();
    world.send(&count(4));
    for seq in [2, 0, 0, 3, 0, 1, 0, 1] {
        world.send(&message(waypoint(seq)));
    }
    // One request for each item, since all of them arrived at once.
    assert_eq!(requests(&mut world), [0, 1, 2]);
    world.run_ms(300);
    // The copy shows that the request for item 2 was lost.
    world.send(&message(waypoint(1)));
    assert_eq!(requests(&mut world), [2]);
    world.send(&message(waypoint(2)));
    world.send(&message(waypoint(3)));
    assert_eq!(results(&mut world), [ACCEPTED]);
}

#[test]
fn a_repeated_count_repeats_the_first_request_and_a_copy_of_it_does_not() {
    let mut world = World::flying();
    world.send(&count(2));
    world.send(&count(2));
    assert_eq!(requests(&mut world), [0]);
    world.run_ms(500);
    world.send(&count(2));
    assert_eq!(requests(&mut world), [0]);
    world.send(&count(3));
    assert_eq!(requests(&mut world), [0], "another plan restarts the upload");
}

#[test]
fn an_item_without_an_upload_is_an_error() {
    let mut world = World::flying();
    world.send(&message(waypoint(0)));
    assert_eq!(results(&mut world), [R::MAV_MISSION_ERROR]);
    assert!(world.has_text("no upload is under way"));
}

#[test]
fn a_ground_station_without_integer_items_gets_mission_request() {
    let mut world = World::flying();
    world.send(&count(1));
    assert!(world.got.iter().any(|got| got.id == 51));
    world.got.clear();
    world.send(&mission_ack(R::MAV_MISSION_UNSUPPORTED));
    let ids: Vec<u32> =
        world.got.iter().filter(|got| requested(got).is_some()).map(|got| got.id).collect();
    assert_eq!(ids, [40], "MISSION_REQUEST");
    let old = super::guided::floats(0, 0, 35.0, -117.9, 6_000.0);
    world.send(&old);
    assert_eq!(results(&mut world), [ACCEPTED], "{:?}", world.texts());
    let mut client = Client::new(QGC);
    client.world = world;
    let (items, _) = client.download().unwrap();
    assert_eq!((items[0].x, items[0].y), (350_000_000, -1_179_000_000));
}

#[test]
fn a_plan_of_a_thousand_items_fits_and_one_more_does_not() {
    let mut client = Client::new(MAVSDK);
    let items: Vec<MISSION_ITEM_INT_DATA> =
        (0..1000).map(|seq| MISSION_ITEM_INT_DATA { seq, ..waypoint(0) }).collect();
    assert_eq!(client.upload(&items).unwrap().0, ACCEPTED);
    client.world.send(&count(1001));
    assert_eq!(results(&mut client.world), [R::MAV_MISSION_NO_SPACE]);
    assert!(client.world.has_text("1001 items are more than 1000"));
    assert_eq!(client.download().unwrap().0.len(), 1000);
}

#[test]
fn the_plan_survives_a_new_flight() {
    let mut client = Client::new(QGC);
    let (_, id) = client.upload(&waypoints(3)).unwrap();
    client.world.send_command(246, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    client.world.run_ms(100);
    let navigation = client.world.autopilot.snapshot().unwrap().navigation;
    assert_eq!((navigation.plan_id, navigation.items, navigation.item), (id, 3, 0));
    assert_eq!(bytes(&client.download().unwrap().0), bytes(&waypoints(3)));
}

#[test]
fn a_plan_is_started_in_the_moment_of_its_acknowledgement() {
    let mut world = World::flying();
    world.send(&count(2));
    world.send(&message(waypoint(0)));
    world.send(&message(waypoint(1)));
    assert_eq!(results(&mut world), [R::MAV_MISSION_ACCEPTED]);
    // No control step and no state in between.
    world.take_acks();
    world.send_command(300, [0.0; 7]);
    assert_eq!(world.take_acks(), [ack(300, MavResult::MAV_RESULT_ACCEPTED)]);
}

#[test]
fn a_shorter_plan_is_started_by_its_own_length_in_the_moment_of_its_acknowledgement() {
    let mut client = Client::new(QGC);
    client.upload(&waypoints(5)).unwrap();
    let world = &mut client.world;
    world.run_ms(200);
    world.got.clear();
    world.send(&count(2));
    world.send(&message(waypoint(0)));
    world.send(&message(waypoint(1)));
    assert_eq!(results(world), [R::MAV_MISSION_ACCEPTED]);
    world.take_acks();
    world.send_command(300, [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(300, MavResult::MAV_RESULT_ACCEPTED)]);
}
