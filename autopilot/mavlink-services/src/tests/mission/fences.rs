//! The lists of the fence and of the rally points.

use super::client::*;
use crate::tests::world::Got;
use ::mavlink::dialects::common::{
    FENCE_STATUS_DATA, FenceBreach, MISSION_ITEM_INT_DATA, MavCmd, MavFrame, MavMissionResult as R,
    MavMissionType as Kind, MavSysStatusSensor, SYS_STATUS_DATA,
};
use flight_management::command::{Command, VehicleCommand};
use flight_management::vehicle::Mode;

pub const FENCE: Kind = Kind::MAV_MISSION_TYPE_FENCE;
pub const RALLY: Kind = Kind::MAV_MISSION_TYPE_RALLY;
const IN: MavCmd = MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION;
const OUT: MavCmd = MavCmd::MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION;

/// An item at a place, deg from that of the aircraft.
fn at(kind: Kind, command: MavCmd, p1: f32, [north, east]: [f64; 2]) -> MISSION_ITEM_INT_DATA {
    let e7 = |degrees: f64| (degrees * 1.0e7) as i32;
    MISSION_ITEM_INT_DATA {
        x: e7(34.9 + north),
        y: e7(-117.9 + east),
        z: if kind == RALLY { 5_500.0 } else { 0.0 },
        frame: MavFrame::MAV_FRAME_GLOBAL,
        mission_type: kind,
        current: 0,
        ..item(0, command, [p1, 0.0, 0.0, 0.0])
    }
}

fn polygon(command: MavCmd, corners: &[[f64; 2]]) -> Vec<MISSION_ITEM_INT_DATA> {
    corners.iter().map(|corner| at(FENCE, command, corners.len() as f32, *corner)).collect()
}

fn numbered(mut items: Vec<MISSION_ITEM_INT_DATA>) -> Vec<MISSION_ITEM_INT_DATA> {
    (0..).zip(&mut items).for_each(|(seq, item)| item.seq = seq);
    items
}

/// Half a degree around the aircraft.
const SQUARE: [[f64; 2]; 4] = [[-0.5, -0.5], [-0.5, 0.5], [0.5, 0.5], [0.5, -0.5]];

pub fn some_fence() -> Vec<MISSION_ITEM_INT_DATA> {
    numbered(polygon(IN, &SQUARE))
}

pub fn some_rally() -> Vec<MISSION_ITEM_INT_DATA> {
    numbered(vec![at(RALLY, MavCmd::MAV_CMD_NAV_RALLY_POINT, 0.0, [0.3, 0.1]); 2])
}

fn client(list: Kind) -> Client {
    Client { list, ..Client::new(QGC) }
}

#[test]
fn a_fence_and_rally_points_come_back_as_they_were_uploaded_and_can_be_cleared() {
    let mut client = client(FENCE);
    let circle = at(FENCE, MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, 2_000.0, [0.2, 0.2]);
    let fence = numbered([polygon(IN, &SQUARE), vec![circle]].concat());
    let (result, id) = client.upload(&fence).unwrap();
    assert_eq!(result, ACCEPTED, "{:?}", client.world.texts());
    let (got, got_id) = client.download().unwrap();
    assert_eq!((bytes(&got), got_id), (bytes(&fence), id));
    client.list = RALLY;
    let rally = some_rally();
    assert_eq!(client.upload(&rally).unwrap().0, ACCEPTED);
    assert_eq!(bytes(&client.download().unwrap().0), bytes(&rally));
    for list in [FENCE, RALLY] {
        client.list = list;
        assert_eq!(client.clear(), Some(ACCEPTED));
        assert_eq!(client.download().unwrap().0.len(), 0);
    }
    assert!(client.world.has_text("Fence cleared"), "{:?}", client.world.texts());
}

#[test]
fn a_bad_fence_is_refused_by_item_field_value_and_range_and_the_old_one_stays() {
    let good = numbered(polygon(IN, &SQUARE));
    let [a, b, c, d] = SQUARE;
    let radius = at(FENCE, MavCmd::MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION, -5.0, a);
    let mut pole = polygon(IN, &SQUARE);
    pole[2].x = 910_000_000;
    for (items, result, words) in [
        (
            polygon(IN, &[a, a, a]),
            R::MAV_MISSION_INVALID_PARAM5_X,
            "Fence refused: item 1: NAV_FENCE_POLYGON_VERTEX_INCLUSION (5001): same place as vertex 0",
        ),
        (
            polygon(OUT, &[a, c, b, d]),
            R::MAV_MISSION_INVALID_PARAM5_X,
            "item 2: NAV_FENCE_POLYGON_VERTEX_EXCLUSION (5002): its edge to the next vertex crosses that from vertex 0",
        ),
        (
            polygon(IN, &[a, b]),
            R::MAV_MISSION_INVALID_PARAM1,
            "item 0: NAV_FENCE_POLYGON_VERTEX_INCLUSION (5001): the polygon has 2 vertices; expected 3 to 200",
        ),
        (
            polygon(IN, &SQUARE)[..3].to_vec(),
            R::MAV_MISSION_INVALID_PARAM1,
            "item 0: NAV_FENCE_POLYGON_VERTEX_INCLUSION (5001): 3 vertices; expected 4",
        ),
        (
            vec![radius],
            R::MAV_MISSION_INVALID_PARAM1,
            "item 0: NAV_FENCE_CIRCLE_INCLUSION (5003): radius -5.0 m is outside 1.0 to 200000.0 m",
        ),
        (pole, R::MAV_MISSION_INVALID_PARAM5_X, "latitude 91.0000000 deg is outside -90 to 90 deg"),
        (
            vec![at(FENCE, MavCmd::MAV_CMD_NAV_RALLY_POINT, 0.0, a)],
            R::MAV_MISSION_UNSUPPORTED,
            "item 0: NAV_RALLY_POINT (5100): not an item of a fence",
        ),
    ] {
        let mut client = client(FENCE);
        let (_, id) = client.upload(&good).unwrap();
        assert_eq!(client.upload(&numbered(items)).unwrap().0, result, "{words}");
        assert!(client.world.has_text(words), "{words}: {:?}", client.world.texts());
        assert_eq!(client.download().unwrap().1, id, "{words}");
    }
    let mut client = client(FENCE);
    client.send(&count_of(1_000, FENCE));
    assert!(client.world.has_text("Fence refused: 1000 items are more than 200"));
}

#[test]
fn a_rally_point_beyond_the_fence_is_refused() {
    let mut client = client(FENCE);
    client.upload(&numbered(polygon(IN, &SQUARE))).unwrap();
    client.list = RALLY;
    let point = |place| at(RALLY, MavCmd::MAV_CMD_NAV_RALLY_POINT, 0.0, place);
    let points = numbered(vec![point([0.0, 0.1]), point([0.0, 0.7])]);
    assert_eq!(client.upload(&points).unwrap().0, R::MAV_MISSION_INVALID_PARAM5_X);
    let words = "Rally points refused: item 1: NAV_RALLY_POINT (5100): beyond the fence";
    assert!(client.world.has_text(words), "{:?}", client.world.texts());
    assert_eq!(client.download().unwrap().0.len(), 0);
}

#[test]
fn beyond_the_fence_the_aircraft_holds_and_the_operator_hears_it() {
    let mut client = client(FENCE);
    let keep_out = [[-0.1, -0.1], [-0.1, 0.1], [0.1, 0.1], [0.1, -0.1]];
    assert_eq!(client.upload(&numbered(polygon(OUT, &keep_out))).unwrap().0, ACCEPTED);
    client.world.run_ms(500);
    assert!(client.world.has_text("Fence breached: in an exclusion area"));
    assert_eq!(client.world.autopilot.snapshot().unwrap().mode, Mode::Hold);
}

/// Whether the fence is present, enabled and healthy in SYS_STATUS, and FENCE_STATUS.
fn state_of_fence(client: &mut Client) -> ([bool; 3], FENCE_STATUS_DATA) {
    client.world.got.clear();
    client.world.run_ms(1_100);
    let got = &client.world.got;
    let status = got.iter().rev().find_map(Got::read::<SYS_STATUS_DATA>).unwrap();
    let bits = [
        status.onboard_control_sensors_present,
        status.onboard_control_sensors_enabled,
        status.onboard_control_sensors_health,
    ];
    let fence = got.iter().rev().find_map(Got::read::<FENCE_STATUS_DATA>).unwrap();
    (bits.map(|bits| bits.contains(MavSysStatusSensor::MAV_SYS_STATUS_GEOFENCE)), fence)
}

#[test]
fn ground_stations_see_the_fence_and_its_breach() {
    let mut client = client(FENCE);
    let (bits, fence) = state_of_fence(&mut client);
    assert_eq!(bits, [true, false, true], "nothing to watch");
    assert_eq!((fence.breach_status, fence.breach_count, fence.breach_time), (0, 0, 0));
    assert_eq!(fence.breach_type, FenceBreach::FENCE_BREACH_NONE);
    client.upload(&some_fence()).unwrap();
    assert_eq!(state_of_fence(&mut client).0, [true; 3]);
    client.world.send_command(207, [0.0; 7]);
    assert_eq!(state_of_fence(&mut client).0, [true, false, true], "switched off");

    let keep_out = [[-0.1, -0.1], [-0.1, 0.1], [0.1, 0.1], [0.1, -0.1]];
    client.upload(&numbered(polygon(OUT, &keep_out))).unwrap();
    let (bits, fence) = state_of_fence(&mut client);
    assert_eq!(bits, [true, true, false]);
    assert_eq!((fence.breach_status, fence.breach_count), (1, 1));
    assert_eq!(fence.breach_type, FenceBreach::FENCE_BREACH_BOUNDARY);
    assert!(fence.breach_time > 2_000, "{fence:?}");
    client.clear().unwrap();
    let (bits, cleared) = state_of_fence(&mut client);
    assert_eq!(bits, [true, false, true]);
    assert_eq!((cleared.breach_status, cleared.breach_count), (0, 1), "the last one stays");
    assert_eq!(cleared.breach_time, fence.breach_time);

    client.world.got.clear();
    client.world.send_command(512, [162.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    client.world.run_ms(10);
    assert!(client.world.got.iter().any(|got| got.read::<FENCE_STATUS_DATA>().is_some()));
}

#[test]
fn rally_points_above_sea_level_count_from_the_home_of_the_plan() {
    let mut client = client(Kind::MAV_MISSION_TYPE_MISSION);
    let home = MISSION_ITEM_INT_DATA {
        z: 702.0,
        frame: MavFrame::MAV_FRAME_GLOBAL,
        ..item(0, MavCmd::MAV_CMD_NAV_WAYPOINT, [0.0; 4])
    };
    assert_eq!(client.upload(&[home, waypoint(1), waypoint(2)]).unwrap().0, ACCEPTED);
    client.list = RALLY;
    client.world.take_commands();
    assert_eq!(client.upload(&some_rally()).unwrap().0, ACCEPTED);
    let altitudes_m = client.world.take_commands().into_iter().find_map(|command| match command {
        Command::Vehicle(VehicleCommand::Rally(points)) => {
            Some(points.iter().map(|point| point.altitude_m).collect::<Vec<_>>())
        }
        _ => None,
    });
    assert_eq!(altitudes_m, Some(vec![4_798.0; 2]), "5500 m, and home at 702 m");
}
