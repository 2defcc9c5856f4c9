//! Refused plans: the result, the text, and the old plan that stays.

use super::client::*;
use crate::tests::world::*;
use ::mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_CLEAR_ALL_DATA, MISSION_ITEM_INT_DATA,
    MISSION_WRITE_PARTIAL_LIST_DATA, MavCmd, MavFrame, MavMessage, MavMissionResult as R,
    MavMissionType,
};

fn with(
    item: MISSION_ITEM_INT_DATA,
    change: fn(&mut MISSION_ITEM_INT_DATA),
) -> MISSION_ITEM_INT_DATA {
    let mut item = item;
    change(&mut item);
    item
}

/// Second item, result and text.
fn refused() -> Vec<(MISSION_ITEM_INT_DATA, R, &'static str)> {
    let of = |command, params| item(1, command, params);
    let point = || waypoint(1);
    vec![
        (
            with(point(), |item| item.z = 50.0),
            R::MAV_MISSION_INVALID_PARAM7,
            "item 1: NAV_WAYPOINT (16): altitude 50.0 m is outside 500.0 to 12000.0 m",
        ),
        (
            with(point(), |item| item.z = f32::INFINITY),
            R::MAV_MISSION_INVALID_PARAM7,
            "item 1: NAV_WAYPOINT (16): altitude is not finite",
        ),
        (
            with(point(), |item| item.x = 910_000_000),
            R::MAV_MISSION_INVALID_PARAM5_X,
            "item 1: NAV_WAYPOINT (16): latitude 91.0000000 deg is outside -90 to 90 deg",
        ),
        (
            with(point(), |item| item.y = -1_810_000_000),
            R::MAV_MISSION_INVALID_PARAM6_Y,
            "item 1: NAV_WAYPOINT (16): longitude -181.0000000 deg is outside -180 to 180 deg",
        ),
        (
            with(point(), |item| item.y = i32::MAX),
            R::MAV_MISSION_INVALID_PARAM6_Y,
            "item 1: NAV_WAYPOINT (16): a latitude without longitude",
        ),
        (
            with(point(), |item| (item.x, item.y) = (0, 0)),
            R::MAV_MISSION_INVALID_PARAM5_X,
            "km, is longer than 5000 km",
        ),
        (
            with(point(), |item| item.frame = MavFrame::MAV_FRAME_LOCAL_NED),
            R::MAV_MISSION_UNSUPPORTED_FRAME,
            "item 1: NAV_WAYPOINT (16): frame 1 is not 0, 3, 5, 6, 10 or 11",
        ),
        (
            with(point(), |item| item.param1 = -1.0),
            R::MAV_MISSION_INVALID_PARAM1,
            "hold time -1 is below 0",
        ),
        (
            with(point(), |item| item.param2 = -1.0),
            R::MAV_MISSION_INVALID_PARAM2,
            "acceptance radius -1",
        ),
        (
            of(MavCmd::MAV_CMD_NAV_LAND, [0.0; 4]),
            R::MAV_MISSION_INVALID_PARAM7,
            "item 1: NAV_LAND (21): landing point: altitude 5100.0 m is outside -10.0 to 10.0 m",
        ),
        (
            of(MavCmd::MAV_CMD_DO_CHANGE_ALTITUDE, [0.0; 4]),
            R::MAV_MISSION_UNSUPPORTED,
            "item 1: DO_CHANGE_ALTITUDE (186): not for plans",
        ),
        (
            with(of(MavCmd::MAV_CMD_NAV_LOITER_TO_ALT, [0.0; 4]), |item| item.z = f32::NAN),
            R::MAV_MISSION_INVALID_PARAM7,
            "item 1: NAV_LOITER_TO_ALT (31): it needs an altitude",
        ),
        (
            of(MavCmd::MAV_CMD_NAV_LOITER_TURNS, [-2.0, 0.0, 0.0, 0.0]),
            R::MAV_MISSION_INVALID_PARAM1,
            "number of turns -2 is below 0",
        ),
        (
            of(MavCmd::MAV_CMD_NAV_CONTINUE_AND_CHANGE_ALT, [3.0, 0.0, 0.0, 0.0]),
            R::MAV_MISSION_INVALID_PARAM1,
            "direction 3 is not 0, 1 or 2",
        ),
        (
            of(MavCmd::MAV_CMD_NAV_DELAY, [-1.0, 12.0, 0.0, 0.0]),
            R::MAV_MISSION_INVALID_PARAM2,
            "time of day",
        ),
        (
            of(MavCmd::MAV_CMD_DO_JUMP, [7.0, 1.0, 0.0, 0.0]),
            R::MAV_MISSION_INVALID_PARAM1,
            "item 1: DO_JUMP (177): jump to item 7 is outside 0 to 2",
        ),
        (
            of(MavCmd::MAV_CMD_DO_CHANGE_SPEED, [0.0, 30.0, -1.0, 0.0]),
            R::MAV_MISSION_INVALID_PARAM2,
            "item 1: DO_CHANGE_SPEED (178): calibrated airspeed 30.0 m/s is outside 140.0 to 280.0 m/s",
        ),
        (
            of(MavCmd::MAV_CMD_DO_CHANGE_SPEED, [2.0, 250.0, -1.0, 0.0]),
            R::MAV_MISSION_INVALID_PARAM1,
            "type of speed 2",
        ),
        (
            of(MavCmd::MAV_CMD_DO_CHANGE_SPEED, [0.0, 250.0, -1.0, 1.0]),
            R::MAV_MISSION_INVALID_PARAM4,
            "only an absolute speed",
        ),
    ]
}

#[test]
fn every_refusal_names_item_field_value_and_range_and_the_old_plan_stays() {
    let mut client = Client::new(MAVSDK);
    let (_, id) = client.upload(&waypoints(2)).unwrap();
    for (bad, result, words) in refused() {
        // Texts in reply to requests are limited in rate.
        client.world.run_ms(500);
        client.world.got.clear();
        let plan = [waypoint(0), bad.clone(), waypoint(2)];
        assert_eq!(client.upload(&plan).unwrap().0, result, "{bad:?}");
        assert!(client.world.has_text(words), "{words}: {:?}", client.world.texts());
        let count = client.world.texts().iter().filter(|text| text.contains("refused")).count();
        assert_eq!(count, 1, "one text: {:?}", client.world.texts());
        assert_eq!(client.download().unwrap().1, id, "{bad:?}");
    }
}

#[test]
fn a_refused_item_that_comes_again_gets_the_same_answer() {
    let mut world = World::flying();
    world.send(&count(1));
    let bad = MavMessage::MISSION_ITEM_INT(with(waypoint(0), |item| item.z = 50.0));
    for _ in 0..2 {
        world.got.clear();
        world.send(&bad);
        let acks: Vec<MISSION_ACK_DATA> = world.got.iter().filter_map(Got::read).collect();
        assert_eq!(acks.len(), 1);
        assert_eq!(acks[0].mavtype, R::MAV_MISSION_INVALID_PARAM7);
    }
    world.got.clear();
    world.run_ms(3_000);
    assert_eq!(world.got.iter().filter_map(requested).count(), 0, "the upload is over");
}

#[test]
fn all_that_is_wrong_is_listed_at_once_by_item_and_command_up_to_a_limit() {
    let mut client = Client::new(MAVSDK);
    let bad = [
        waypoint(0),
        item(1, MavCmd::MAV_CMD_NAV_GUIDED_ENABLE, [0.0; 4]),
        with(waypoint(2), |item| item.z = 50.0),
        item(3, MavCmd::MAV_CMD_DO_JUMP, [9.0, 1.0, 0.0, 0.0]),
        item(4, MavCmd::MAV_CMD_DO_CHANGE_SPEED, [0.0, 30.0, -1.0, 0.0]),
    ];
    let (result, _) = client.upload(&bad).unwrap();
    assert_eq!(result, R::MAV_MISSION_UNSUPPORTED, "that of the first problem");
    let texts = client.world.texts();
    let refused: Vec<&String> = texts.iter().filter(|text| text.contains("refused")).collect();
    let starts = [
        "item 1: NAV_GUIDED_ENABLE (92): not flown",
        "item 2: NAV_WAYPOINT (16): altitude 50.0 m",
        "item 3: DO_JUMP (177): jump to item 9 is outside 0 to 4",
        "item 4: DO_CHANGE_SPEED (178): calibrated airspeed 30.0 m/s",
    ];
    assert_eq!(refused.len(), starts.len(), "{texts:?}");
    for (text, start) in refused.iter().zip(starts) {
        assert!(text.starts_with(&format!("Mission refused: {start}")), "{text}");
    }
    let many: Vec<_> =
        (0..100).map(|seq| item(seq, MavCmd::MAV_CMD_NAV_GUIDED_ENABLE, [0.0; 4])).collect();
    client.world.got.clear();
    client.world.run_ms(5_000);
    client.upload(&many).unwrap();
    let texts = client.world.texts();
    assert_eq!(texts.iter().filter(|text| text.contains("refused: item")).count(), 8);
    assert!(client.world.has_text("Mission refused: and 92 more"), "{texts:?}");
}

#[test]
fn jumps_that_only_lead_to_jumps_are_refused() {
    let mut client = Client::new(QGC);
    let jump = |seq, to| item(seq, MavCmd::MAV_CMD_DO_JUMP, [to, -1.0, 0.0, 0.0]);
    let result = client.upload(&[waypoint(0), jump(1, 2.0), jump(2, 1.0)]).unwrap().0;
    assert_eq!(result, R::MAV_MISSION_INVALID);
    assert!(client.world.has_text("Mission refused: item"), "{:?}", client.world.texts());
    assert_eq!(client.download().unwrap().0.len(), 0);
}

#[test]
fn clearing_all_lists_clears_the_plan() {
    let mut client = Client::new(QGC);
    client.upload(&waypoints(2)).unwrap();
    let clear = MISSION_CLEAR_ALL_DATA {
        target_system: 1,
        target_component: 1,
        mission_type: MavMissionType::MAV_MISSION_TYPE_ALL,
    };
    let acked = client
        .exchange(&MavMessage::MISSION_CLEAR_ALL(clear), Got::read::<MISSION_ACK_DATA>)
        .unwrap();
    assert_eq!(
        (acked.mavtype, acked.mission_type),
        (ACCEPTED, MavMissionType::MAV_MISSION_TYPE_ALL)
    );
    assert_eq!(client.download().unwrap().0.len(), 0);
}

#[test]
fn a_part_of_a_plan_is_neither_read_nor_written() {
    let mut world = World::flying();
    let partial = MISSION_WRITE_PARTIAL_LIST_DATA {
        start_index: 0,
        end_index: 1,
        target_system: 1,
        target_component: 1,
        ..Default::default()
    };
    world.send(&MavMessage::MISSION_WRITE_PARTIAL_LIST(partial));
    let acks: Vec<MISSION_ACK_DATA> = world.got.iter().filter_map(Got::read).collect();
    assert_eq!(acks.len(), 1);
    assert_eq!(acks[0].mavtype, R::MAV_MISSION_UNSUPPORTED);
}
