//! Conversion of the items of a plan.

use super::client::*;
use crate::tests::world::*;
use ::mavlink::dialects::common::{MISSION_ITEM_INT_DATA, MavCmd, MavFrame};
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Airspeed;
use flight_management::vehicle::plan::{Action, Circle, Point};
use proptest::prelude::*;

/// The action of an item after a waypoint, and the texts about it.
fn taken(item: MISSION_ITEM_INT_DATA) -> (Action, World) {
    let mut client = Client::new(MAVSDK);
    let plan = [waypoint(0), MISSION_ITEM_INT_DATA { seq: 1, current: 0, ..item }];
    assert_eq!(client.upload(&plan).unwrap().0, ACCEPTED, "{:?}", client.world.texts());
    let plan = client.world.take_commands().into_iter().find_map(|command| match command {
        Command::Vehicle(VehicleCommand::Plan(plan)) => Some(plan),
        _ => None,
    });
    client.world.run_ms(4);
    (plan.unwrap().items[1].action, client.world)
}

fn command(command: MavCmd, params: [f32; 4]) -> Action {
    taken(item(1, command, params)).0
}

fn is_at(point: &Point, latitude_deg: f64, altitude_m: f64) -> bool {
    let place = point.place.unwrap();
    // 1e-9 deg: a hundredth of the field's last digit.
    (place.latitude_rad.to_degrees() - latitude_deg).abs() < 1.0e-9
        && point.altitude_m == Some(altitude_m)
}

#[test]
fn a_waypoint_keeps_place_altitude_and_radius() {
    let action = command(MavCmd::MAV_CMD_NAV_WAYPOINT, [0.0, 800.0, 0.0, 90.0]);
    let Action::Waypoint { point, acceptance_m: Some(800.0) } = action else {
        panic!("{action:?}")
    };
    assert!(is_at(&point, 35.1, 5_100.0), "{point:?}");
}

#[test]
fn a_waypoint_without_place_and_altitude_leaves_both_as_they_are() {
    let mut here = waypoint(1);
    (here.x, here.y, here.z) = (i32::MAX, i32::MAX, f32::NAN);
    let (action, _) = taken(here);
    let nothing = Point { place: None, altitude_m: None };
    assert_eq!(action, Action::Waypoint { point: nothing, acceptance_m: None });
}

#[test]
fn the_sign_of_a_radius_is_the_direction_and_none_is_the_parameter() {
    for (radius, radius_m, clockwise) in [
        (9_000.0, Some(9_000.0), true),
        (-9_000.0, Some(9_000.0), false),
        (0.0, None, true),
        (f32::NAN, None, true),
    ] {
        let params = [2.0, 0.0, radius, f32::NAN];
        let Action::LoiterTurns { circle, turns: 2.0 } =
            command(MavCmd::MAV_CMD_NAV_LOITER_TURNS, params)
        else {
            panic!("turns")
        };
        assert_eq!((circle.radius_m, circle.clockwise), (radius_m, clockwise));
        assert!(is_at(&circle.centre, 35.1, 5_100.0));
        let params = [0.0, radius, 0.0, f32::NAN];
        let Action::LoiterToAltitude(circle) = command(MavCmd::MAV_CMD_NAV_LOITER_TO_ALT, params)
        else {
            panic!("to altitude")
        };
        assert_eq!((circle.radius_m, circle.clockwise), (radius_m, clockwise));
    }
}

#[test]
fn latitude_and_longitude_zero_of_a_circle_are_where_the_aircraft_is() {
    let mut here = item(1, MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0; 4]);
    (here.x, here.y) = (0, 0);
    let centre = Point { place: None, altitude_m: Some(5_100.0) };
    let expected = Circle { centre, radius_m: None, clockwise: true };
    assert_eq!(taken(here).0, Action::LoiterUnlimited(expected));
}

#[test]
fn speeds_altitudes_and_jumps_keep_their_numbers() {
    assert_eq!(
        command(MavCmd::MAV_CMD_DO_CHANGE_SPEED, [0.0, 230.0, 0.0, f32::NAN]),
        Action::ChangeSpeed { airspeed: Airspeed::Calibrated(230.0) }
    );
    assert_eq!(
        command(MavCmd::MAV_CMD_NAV_CONTINUE_AND_CHANGE_ALT, [1.0, 0.0, 0.0, 0.0]),
        Action::ChangeAltitude { altitude_m: 5_100.0 }
    );
    let jump = |times| command(MavCmd::MAV_CMD_DO_JUMP, [0.0, times, 0.0, 0.0]);
    assert_eq!(jump(3.0), Action::Jump { to: 0, times: Some(3) });
    assert_eq!(jump(-1.0), Action::Jump { to: 0, times: None });
}

#[test]
fn a_takeoff_climbs_to_its_altitude_wherever_its_place_is() {
    let (action, _) = taken(item(1, MavCmd::MAV_CMD_NAV_TAKEOFF, [15.0, 0.0, 0.0, f32::NAN]));
    assert_eq!(action, Action::Takeoff { altitude_m: 5_100.0 });
    let mut here = item(1, MavCmd::MAV_CMD_NAV_VTOL_TAKEOFF, [0.0; 4]);
    (here.x, here.y) = (i32::MAX, i32::MAX);
    assert_eq!(taken(here).0, Action::Takeoff { altitude_m: 5_100.0 });
}

#[test]
fn what_stations_write_where_nothing_is_meant_is_taken() {
    for (command, params) in [
        (MavCmd::MAV_CMD_NAV_WAYPOINT, [3.0, 0.0, -100.0, 0.0]),
        // Radius and "heading required" exchanged, as in a plan of PX4.
        (MavCmd::MAV_CMD_NAV_LOITER_TO_ALT, [75.0, 1.0, 0.0, f32::NAN]),
        (MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0, 0.0, 50.0, f32::NAN]),
        (MavCmd::MAV_CMD_NAV_SPLINE_WAYPOINT, [0.0; 4]),
    ] {
        let (action, world) = taken(item(1, command, params));
        assert!(action.place().is_some_and(|place| place.latitude_rad > 0.6), "{action:?}");
        assert!(world.has_text("Mission item 1: "), "{:?}", world.texts());
    }
    for (command, params) in [
        (MavCmd::MAV_CMD_DO_CHANGE_SPEED, [1.0, -1.0, 60.0, 0.0]),
        (MavCmd::MAV_CMD_DO_CHANGE_SPEED, [f32::NAN, f32::NAN, f32::NAN, f32::NAN]),
        (MavCmd::MAV_CMD_DO_VTOL_TRANSITION, [4.0, 0.0, 0.0, 0.0]),
        (MavCmd::MAV_CMD_CONDITION_YAW, [90.0, 10.0, 1.0, 0.0]),
        (MavCmd::MAV_CMD_JUMP_TAG, [7.0, 0.0, 0.0, 0.0]),
    ] {
        assert_eq!(self::command(command, params), Action::Nothing);
    }
}

#[test]
fn an_altitude_above_the_terrain_counts_from_home() {
    let mut above = waypoint(1);
    above.frame = MavFrame::MAV_FRAME_GLOBAL_TERRAIN_ALT;
    let (action, world) = taken(above);
    assert_eq!(action.altitude_m(), Some(5_100.0));
    assert!(world.has_text("Mission item 1: altitude above terrain"), "{:?}", world.texts());
}

#[test]
fn items_for_equipment_that_is_not_on_board_are_reported_once_each_when_they_are_passed() {
    let mut client = Client::new(QGC);
    let camera = item(0, MavCmd::MAV_CMD_IMAGE_START_CAPTURE, [0.0; 4]);
    let gripper = item(1, MavCmd::MAV_CMD_DO_GRIPPER, [1.0, 0.0, 0.0, 0.0]);
    let circle = item(2, MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0; 4]);
    assert_eq!(client.upload(&[camera, gripper, circle]).unwrap().0, ACCEPTED);
    client.world.run_ms(100);
    assert!(!client.world.has_text("passed"), "{:?}", client.world.texts());
    client.world.send_command(300, [0.0; 7]);
    client.world.run_ms(500);
    let texts = client.world.texts();
    let passed: Vec<&String> = texts.iter().filter(|text| text.contains("passed")).collect();
    assert_eq!(
        passed,
        [
            "Mission item 0 passed: IMAGE_START_CAPTURE (2000), not on board",
            "Mission item 1 passed: DO_GRIPPER (211), not on board",
        ]
    );
}

#[test]
fn a_circle_too_small_for_the_speed_by_then_is_accepted_with_a_note() {
    let mut client = Client::new(MAVSDK);
    let mut fast = item(0, MavCmd::MAV_CMD_DO_CHANGE_SPEED, [0.0, 250.0, -1.0, 0.0]);
    fast.frame = MavFrame::MAV_FRAME_MISSION;
    let circle = item(1, MavCmd::MAV_CMD_NAV_LOITER_UNLIM, [0.0, 0.0, 5_000.0, 0.0]);
    assert_eq!(client.upload(&[fast, circle]).unwrap().0, ACCEPTED);
    client.world.run_ms(4);
    assert!(
        client.world.has_text("Mission item 1: at 309 m/s the circle needs"),
        "{:?}",
        client.world.texts()
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn no_item_does_more_than_be_taken_or_refused(
        bits in any::<[u32; 5]>(),
        x in any::<i32>(),
        y in any::<i32>(),
        command in prop::sample::select(vec![
            16_u16, 17, 18, 19, 20, 21, 22, 30, 31, 36, 84, 85, 93, 112, 114, 177, 178, 179, 189, 601,
        ]),
        frame in 0_u8..12,
        current in 0_u8..5,
    ) {
        let mut world = World::flying();
        let mut payload: Vec<u8> = bits[..4].iter().flat_map(|bits| bits.to_le_bytes()).collect();
        payload.extend_from_slice(&x.to_le_bytes());
        payload.extend_from_slice(&y.to_le_bytes());
        payload.extend_from_slice(&bits[4].to_le_bytes());
        payload.extend_from_slice(&0_u16.to_le_bytes());
        payload.extend_from_slice(&command.to_le_bytes());
        payload.extend_from_slice(&[1, 1, frame, current, 1, 0]);
        world.send(&count(1));
        world.got.clear();
        world.send_bytes(address(14_550), &crate::tests::world::frame(73, 38, &payload));
        let acks = world.got.iter().filter(|got| got.id == 47).count();
        prop_assert_eq!(acks, 1);
    }
}
