//! Offboard positions and velocities.

use super::offboard::setpoint as attitude;
use super::world::*;
use ::mavlink::dialects::common::{
    MavFrame, MavMessage, MavResult, PositionTargetTypemask, SET_POSITION_TARGET_GLOBAL_INT_DATA,
    SET_POSITION_TARGET_LOCAL_NED_DATA,
};
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::{Mode, Setpoint};
use proptest::prelude::*;

const OFFBOARD: [f32; 7] = [1.0, 6.0, 0.0, 0.0, 0.0, 0.0, 0.0];
/// MAVSDK's masks: position with yaw, velocity with yaw.
const POSITION: u16 = 0x9F8;
const VELOCITY: u16 = 0x9C7;
const ALTITUDE_IGNORED: u16 = POSITION | 4;
const CLIMB_ONLY: u16 = VELOCITY | 8 | 16;

const GLOBAL: u8 = 0;
const LOCAL: u8 = 1;

/// SET_POSITION_TARGET_GLOBAL_INT (86) or _LOCAL_NED (84) by hand, so that any frame can be sent.
fn target(id: u8, xyz: [[u8; 4]; 3], velocity: [f32; 3], ignored: u16, frame_type: u8) -> Vec<u8> {
    let mut payload = vec![0; 4];
    payload.extend(xyz.concat());
    payload.extend(velocity.iter().flat_map(|v| v.to_le_bytes()));
    // Accelerations, yaw and yaw rate are not used: NaN must not matter.
    payload.extend([f32::NAN; 5].iter().flat_map(|v| v.to_le_bytes()));
    payload.extend_from_slice(&ignored.to_le_bytes());
    payload.extend_from_slice(&[1, 1, frame_type]);
    frame(id, if id == 86 { 5 } else { 143 }, &payload)
}

fn global(xy: [i32; 2], z: f32, velocity: [f32; 3], ignored: u16, frame_type: u8) -> Vec<u8> {
    let [x, y] = xy.map(i32::to_le_bytes);
    target(86, [x, y, z.to_le_bytes()], velocity, ignored, frame_type)
}

fn local(xyz: [f32; 3], velocity: [f32; 3], ignored: u16, frame_type: u8) -> Vec<u8> {
    target(84, xyz.map(f32::to_le_bytes), velocity, ignored, frame_type)
}

const DESERT: [i32; 2] = [349_500_000, -1_178_500_000];

fn desert(z: f32) -> Vec<u8> {
    global(DESERT, z, [0.0; 3], POSITION, GLOBAL)
}

fn in_offboard() -> World {
    let mut world = World::flying();
    world.send(&attitude(0.0));
    world.send_command(176, OFFBOARD);
    assert_eq!(world.take_acks(), [ack(176, MavResult::MAV_RESULT_ACCEPTED)]);
    world.run_ms(20);
    world.take_commands();
    world.got.clear();
    world
}

fn setpoints(world: &mut World) -> Vec<Setpoint> {
    let commands = world.take_commands().into_iter();
    commands
        .filter_map(|command| match command {
            Command::Vehicle(VehicleCommand::Setpoint(setpoint)) => Some(setpoint),
            _ => None,
        })
        .collect()
}

/// Outcome of one message, and the texts about it.
fn becomes(bytes: &[u8]) -> (Vec<Setpoint>, Vec<String>) {
    let mut world = in_offboard();
    world.send_bytes(address(14_550), bytes);
    (setpoints(&mut world), world.texts())
}

fn velocity_of(bytes: &[u8]) -> (Option<f64>, Option<f64>, f64) {
    match becomes(bytes).0[..] {
        [Setpoint::Velocity { course_rad, speed_m_s, climb_m_s }] => {
            (course_rad.map(f64::to_degrees), speed_m_s, climb_m_s)
        }
        ref other => panic!("{other:?}"),
    }
}

#[test]
fn the_crates_own_messages_are_those_of_this_test() {
    let message = MavMessage::SET_POSITION_TARGET_GLOBAL_INT(SET_POSITION_TARGET_GLOBAL_INT_DATA {
        lat_int: DESERT[0],
        lon_int: DESERT[1],
        alt: 6_000.0,
        target_system: 1,
        target_component: 1,
        coordinate_frame: MavFrame::MAV_FRAME_GLOBAL,
        type_mask: PositionTargetTypemask::from_bits_retain(POSITION),
        ..SET_POSITION_TARGET_GLOBAL_INT_DATA::default()
    });
    let mut world = in_offboard();
    world.send(&message);
    assert_eq!(setpoints(&mut world), becomes(&desert(6_000.0)).0);
    let message = MavMessage::SET_POSITION_TARGET_LOCAL_NED(SET_POSITION_TARGET_LOCAL_NED_DATA {
        x: 1.0,
        y: 2.0,
        z: -6_000.0,
        target_system: 1,
        target_component: 1,
        coordinate_frame: MavFrame::MAV_FRAME_LOCAL_NED,
        type_mask: PositionTargetTypemask::from_bits_retain(POSITION),
        ..SET_POSITION_TARGET_LOCAL_NED_DATA::default()
    });
    world.run_ms(20);
    world.take_commands();
    world.send(&message);
    let expected = becomes(&local([1.0, 2.0, -6_000.0], [0.0; 3], POSITION, LOCAL)).0;
    assert_eq!(setpoints(&mut world), expected);
    assert_eq!(expected.len(), 1);
}

#[test]
fn a_global_position_is_a_place_with_an_altitude_or_without() {
    for frame_type in [0, 3, 5, 6, 10, 11] {
        for (ignored, altitude) in [(POSITION, Some(6_000.0)), (ALTITUDE_IGNORED, None)] {
            let (setpoints, texts) =
                becomes(&global(DESERT, 6_000.0, [f32::NAN; 3], ignored, frame_type));
            let [Setpoint::Position { place, altitude_m }] = setpoints[..] else {
                panic!("frame {frame_type}: {setpoints:?}")
            };
            assert!((place.latitude_rad.to_degrees() - 34.95).abs() < 1.0e-9);
            assert!((place.longitude_rad.to_degrees() + 117.85).abs() < 1.0e-9);
            assert_eq!(altitude_m, altitude);
            assert_eq!(texts, [""; 0]);
        }
    }
}

#[test]
fn a_velocity_is_course_speed_and_climb() {
    for bytes in [
        global([0; 2], f32::NAN, [200.0, 150.0, -5.0], VELOCITY, GLOBAL),
        local([f32::NAN; 3], [200.0, 150.0, -5.0], VELOCITY, LOCAL),
    ] {
        let (course, speed, climb) = velocity_of(&bytes);
        assert!((course.unwrap() - 36.869_897_645_844).abs() < 1.0e-9, "{course:?} deg");
        assert_eq!((speed, climb), (Some(250.0), 5.0));
    }
    let up = local([0.0; 3], [f32::NAN, f32::NAN, -5.0], CLIMB_ONLY, LOCAL);
    assert_eq!(velocity_of(&up), (None, None, 5.0));
    let level = local([0.0; 3], [0.0, -250.0, f32::NAN], VELOCITY | 32, LOCAL);
    assert_eq!(velocity_of(&level), (Some(-90.0), Some(250.0), 0.0));
}

#[test]
fn a_velocity_of_the_body_is_turned_by_the_heading() {
    for frame_type in [8, 12] {
        let mut world = in_offboard();
        let east = icd::EulerAngles { phi: 0.0, theta: 0.0, psi: 90_f64.to_radians() };
        world.sensors.attitude.value = icd::Attitude::from_euler(east);
        world.run_ms(300);
        world.send(&attitude(0.0));
        world.run_ms(300);
        world.take_commands();
        let bytes = local([f32::NAN; 3], [200.0, 150.0, -5.0], 0xFC7, frame_type);
        world.send_bytes(address(14_550), &bytes);
        let [Setpoint::Velocity { course_rad: Some(course), speed_m_s, climb_m_s }] =
            setpoints(&mut world)[..]
        else {
            panic!("{:?}", world.texts())
        };
        let course_deg = course.to_degrees();
        assert!((course_deg - 126.869_897_645_844).abs() < 1.0e-6, "{course_deg} deg");
        assert!((speed_m_s.unwrap() - 250.0).abs() < 1.0e-9);
        assert_eq!(climb_m_s, 5.0);
    }
}

#[test]
fn values_beyond_the_limits_are_limited_and_reported() {
    let (setpoints, texts) = becomes(&desert(100_000.0));
    assert!(matches!(setpoints[..], [Setpoint::Position { altitude_m: Some(12_000.0), .. }]));
    assert_eq!(texts, ["Setpoint limited: altitude 100000.0 m is flown as 12000.0 m"]);
    let (_, texts) = becomes(&local([0.0; 3], [100.0, 0.0, 0.0], VELOCITY, LOCAL));
    assert_eq!(texts, ["Setpoint limited: speed 100.0 m/s is flown as 177.6 m/s"]);
    let dive = local([0.0; 3], [250.0, 0.0, 500.0], VELOCITY, LOCAL);
    assert_eq!(velocity_of(&dive).2, -30.0);
    assert_eq!(becomes(&dive).1, ["Setpoint limited: climb -500.0 m/s is flown as -30.0 m/s"]);
}

#[test]
fn a_stream_that_is_limited_is_reported_once() {
    let mut world = in_offboard();
    for _ in 0..50 {
        world.send_bytes(address(14_550), &desert(100_000.0));
        world.run_ms(20);
    }
    let count = world.texts().iter().filter(|text| text.contains("Setpoint limited")).count();
    assert_eq!(count, 1, "{:?}", world.texts());
}

#[test]
fn a_setpoint_that_the_vehicle_refuses_is_reported_once_until_one_is_accepted() {
    let mut world = in_offboard();
    let into_space = local([0.0, 0.0, -100_000.0], [0.0; 3], POSITION, LOCAL);
    let fine = local([0.0, 0.0, -6_000.0], [0.0; 3], POSITION, LOCAL);
    for bytes in [&into_space, &fine, &into_space] {
        for _ in 0..10 {
            world.send_bytes(address(14_550), bytes);
            world.run_ms(20);
        }
    }
    let count = world.texts().iter().filter(|text| text.contains("Setpoint refused")).count();
    assert_eq!(count, 2, "{:?}", world.texts());
}

#[test]
fn setpoints_that_cannot_be_flown_do_not_count_and_the_reason_is_reported_once() {
    let inf = f32::INFINITY;
    for (bytes, reason) in [
        (global(DESERT, 6_000.0, [0.0; 3], POSITION, 1), "frame"),
        (global(DESERT, inf, [0.0; 3], POSITION, GLOBAL), "not finite"),
        (global([900_000_001, 0], 6_000.0, [0.0; 3], POSITION, GLOBAL), "no place"),
        (global(DESERT, 6_000.0, [0.0; 3], POSITION | 1, GLOBAL), "only together"),
        (global(DESERT, 6_000.0, [250.0, 0.0, 0.0], VELOCITY & !4, GLOBAL), "needs a place"),
        (local([0.0; 3], [250.0, 0.0, 0.0], VELOCITY, 9), "frame"),
        (local([0.0, 0.0, -6_000.0], [0.0; 3], POSITION, 8), "needs frame 1"),
        (local([0.0, 0.0, -6_000.0], [0.0; 3], POSITION, 12), "needs frame 1"),
        (local([0.0, f32::NAN, -6_000.0], [0.0; 3], POSITION, LOCAL), "not finite"),
        (local([0.0; 3], [0.0; 3], ALTITUDE_IGNORED, LOCAL), "needs x, y and z"),
        (local([0.0; 3], [0.0; 3], VELOCITY, LOCAL), "stand still"),
        (local([0.0; 3], [inf, 0.0, 0.0], VELOCITY, LOCAL), "not finite"),
        (local([0.0; 3], [250.0, 0.0, 0.0], VELOCITY | 8, LOCAL), "only together"),
        (local([0.0; 3], [250.0, 0.0, f32::NAN], VELOCITY, LOCAL), "not finite"),
        (local([0.0; 3], [250.0, 0.0, 0.0], 0xFFF, LOCAL), "neither position nor velocity"),
    ] {
        let mut world = World::flying();
        for _ in 0..10 {
            world.send_bytes(address(14_550), &bytes);
        }
        let texts = world.texts();
        assert_eq!(texts.len(), 1, "{texts:?}");
        assert!(texts[0].contains(reason), "{texts:?} for {reason}");
        world.send_command(176, OFFBOARD);
        let later = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;
        assert_eq!(world.take_acks(), [ack(176, later)], "{reason}");
        assert!(world.take_commands().is_empty());
    }
}

#[test]
fn a_stream_of_positions_keeps_offboard_and_its_end_leads_to_hold() {
    let mut world = in_offboard();
    for _ in 0..40 {
        world.send_bytes(address(14_550), &desert(6_000.0));
        world.run_ms(50);
    }
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Offboard);
    world.run_ms(520);
    assert_eq!(world.autopilot.snapshot().unwrap().mode, Mode::Hold);
    assert!(world.has_text("setpoints stopped"));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 512, ..ProptestConfig::default() })]

    #[test]
    fn no_setpoint_of_any_bytes_is_passed_on_that_is_not_finite(
        xyz in any::<[[u8; 4]; 3]>(),
        velocity in any::<[f32; 3]>(),
        ignored in any::<u16>(),
        is_global in any::<bool>(),
        frame_type in 0_u8..12,
    ) {
        let mut world = World::waiting();
        world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
        world.step();
        world.send(&attitude(0.0));
        world.send_command(176, OFFBOARD);
        world.run_ms(20);
        let id = if is_global { 86 } else { 84 };
        world.send_bytes(address(14_550), &target(id, xyz, velocity, ignored, frame_type));
        for command in world.take_commands() {
            let text = format!("{command:?}");
            prop_assert!(!text.contains("NaN") && !text.contains("inf"), "{}", text);
        }
    }
}
