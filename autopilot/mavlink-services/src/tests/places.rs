//! Commands with a target point: reposition, orbit, loiter, pause, home.

use super::world::*;
use crate::convert;
use ::mavlink::dialects::common::{HOME_POSITION_DATA, MavResult};
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::{Mode, Place, Reposition};

const NAN: f32 = f32::NAN;
const NOT_GIVEN: [i32; 2] = [i32::MAX; 2];
const DESERT: [i32; 2] = [349_500_000, -1_178_500_000];
const ACCEPTED: MavResult = MavResult::MAV_RESULT_ACCEPTED;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
const LATER: MavResult = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;

fn desert() -> Place {
    place(34.95, -117.85)
}

fn place(latitude_deg: f64, longitude_deg: f64) -> Place {
    Place {
        latitude_rad: convert::radians(latitude_deg),
        longitude_rad: convert::radians(longitude_deg),
    }
}

fn repositions(world: &mut World) -> Vec<Reposition> {
    let commands = world.take_commands().into_iter();
    commands
        .filter_map(|command| match command {
            Command::Vehicle(VehicleCommand::Reposition(reposition)) => Some(reposition),
            _ => None,
        })
        .collect()
}

fn homes(world: &mut World) -> Vec<Place> {
    let commands = world.take_commands().into_iter();
    commands
        .filter_map(|command| match command {
            Command::Vehicle(VehicleCommand::Home(place)) => Some(place),
            _ => None,
        })
        .collect()
}

/// Keeps everything but the mode.
const PAUSE: Reposition = Reposition {
    place: None,
    altitude_m: None,
    radius_m: None,
    clockwise: None,
    airspeed_m_s: None,
    change_mode: true,
};

#[test]
fn each_ground_stations_way_to_go_somewhere_works() {
    let goal = Reposition { place: Some(desert()), altitude_m: Some(6_000.0), ..PAUSE };
    for (frame, params, expected) in [
        // QGroundControl, then MAVSDK with a yaw angle and with a radius, then MAVProxy.
        (0, [-1.0, 1.0, 0.0, NAN], goal),
        (0, [NAN, 1.0, NAN, 0.7], goal),
        (
            0,
            [NAN, 1.0, 9_000.0, NAN],
            Reposition { radius_m: Some(9_000.0), clockwise: Some(true), ..goal },
        ),
        (
            0,
            [NAN, 1.0, -10_000.0, NAN],
            Reposition { radius_m: Some(10_000.0), clockwise: Some(false), ..goal },
        ),
        (3, [-1.0, 1.0, 0.0, 0.0], Reposition { clockwise: Some(true), ..goal }),
        (5, [250.0, 1.0, 0.0, NAN], Reposition { airspeed_m_s: Some(250.0), ..goal }),
        (6, [NAN, 1.0, 0.0, 1.0], Reposition { clockwise: Some(false), ..goal }),
    ] {
        let mut world = World::flying();
        world.send_command_at(192, frame, params, DESERT, 6_000.0);
        assert_eq!(repositions(&mut world), [expected], "frame {frame}, {params:?}");
        assert_eq!(world.take_acks(), [ack(192, ACCEPTED)], "frame {frame}, {params:?}");
    }
    let mut world = World::flying();
    world.send_command(192, [-1.0, 1.0, 0.0, NAN, 34.95, -117.85, 6_000.0]);
    assert_eq!(repositions(&mut world), [goal], "as a COMMAND_LONG");
}

#[test]
fn a_reposition_without_values_keeps_them() {
    let mut world = World::flying();
    world.send_command(192, [-1.0, 1.0, NAN, NAN, NAN, NAN, NAN]);
    assert_eq!(repositions(&mut world), [PAUSE], "QGroundControl's pause");
    world.send_command(192, [-1.0, 1.0, NAN, NAN, NAN, NAN, 6_000.0]);
    let climb = Reposition { altitude_m: Some(6_000.0), ..PAUSE };
    assert_eq!(repositions(&mut world), [climb], "QGroundControl's change of altitude");
    world.send_command_at(192, 0, [NAN, 1.0, NAN, NAN], NOT_GIVEN, NAN);
    assert_eq!(repositions(&mut world), [PAUSE]);
    assert_eq!(world.take_acks(), [ack(192, ACCEPTED); 3]);
}

#[test]
fn a_reposition_that_may_not_change_the_mode_is_denied_outside_hold() {
    let mut world = World::flying();
    for flags in [0.0, NAN] {
        world.send_command_at(192, 0, [-1.0, flags, 0.0, NAN], DESERT, 6_000.0);
        assert_eq!(world.take_acks(), [ack(192, DENIED)], "in Reference");
    }
    world.send_command(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
    world.take_acks();
    world.send_command_at(192, 0, [-1.0, 0.0, 0.0, NAN], DESERT, 6_000.0);
    assert_eq!(world.take_acks(), [ack(192, ACCEPTED)], "in Hold");
}

#[test]
fn places_off_the_earth_other_frames_and_odd_values_are_denied_with_the_reason() {
    let inf = f32::INFINITY;
    for (frame, params, xy, z) in [
        (1, [-1.0, 1.0, 0.0, NAN], DESERT, 6_000.0),
        (2, [-1.0, 1.0, 0.0, NAN], DESERT, 6_000.0),
        (10, [-1.0, 1.0, 0.0, NAN], DESERT, 6_000.0),
        (255, [-1.0, 1.0, 0.0, NAN], DESERT, 6_000.0),
        (0, [-1.0, 1.0, 0.0, NAN], [900_000_001, 0], 6_000.0),
        (0, [-1.0, 1.0, 0.0, NAN], [0, -1_800_000_001], 6_000.0),
        (0, [-1.0, 1.0, 0.0, NAN], [i32::MAX, 0], 6_000.0),
        (0, [-1.0, 1.0, 0.0, NAN], DESERT, inf),
        (0, [-1.0, 1.0, 0.0, NAN], DESERT, 20.0),
        (0, [-1.0, 1.0, 0.0, NAN], DESERT, 30_000.0),
        (0, [20.0, 1.0, 0.0, NAN], DESERT, 6_000.0),
        (0, [-inf, 1.0, 0.0, NAN], DESERT, 6_000.0),
        (0, [-1.0, 0.5, 0.0, NAN], DESERT, 6_000.0),
        (0, [-1.0, 1.0, inf, NAN], DESERT, 6_000.0),
        (0, [-1.0, 1.0, 0.0, inf], DESERT, 6_000.0),
    ] {
        let mut world = World::flying();
        world.send_command_at(192, frame, params, xy, z);
        let expected = match frame {
            0 => DENIED,
            _ => MavResult::MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME,
        };
        assert_eq!(world.take_acks(), [ack(192, expected)], "{frame} {params:?} {xy:?} {z}");
        assert!(world.has_text("efused"), "{frame} {params:?} {xy:?} {z}");
        assert!(world.take_commands().is_empty());
    }
    let mut world = World::flying();
    world.send_command(192, [-1.0, 1.0, 0.0, NAN, 34.95, NAN, 6_000.0]);
    assert_eq!(world.take_acks(), [ack(192, DENIED)], "latitude alone");
}

#[test]
fn the_refusal_of_an_altitude_names_value_and_range() {
    let mut world = World::flying();
    world.send_command_at(192, 0, [-1.0, 1.0, 0.0, NAN], DESERT, 20.0);
    assert!(world.has_text("altitude 20.0 m is outside 500.0 to 12000.0 m"), "{:?}", world.texts());
}

#[test]
fn an_orbit_turns_by_the_sign_of_its_radius_and_has_no_end() {
    let goal = Reposition { place: Some(desert()), altitude_m: Some(6_000.0), ..PAUSE };
    for (params, expected) in [
        ([NAN, NAN, 0.0, 0.0], goal),
        (
            [9_000.0, NAN, 0.0, NAN],
            Reposition { radius_m: Some(9_000.0), clockwise: Some(true), ..goal },
        ),
        (
            [-9_000.0, 250.0, 0.0, 0.0],
            Reposition {
                radius_m: Some(9_000.0),
                clockwise: Some(false),
                airspeed_m_s: Some(250.0),
                ..goal
            },
        ),
    ] {
        let mut world = World::flying();
        world.send_command_at(34, 0, params, DESERT, 6_000.0);
        assert_eq!(repositions(&mut world), [expected], "{params:?}");
        assert_eq!(world.take_acks(), [ack(34, ACCEPTED)]);
    }
    let mut world = World::flying();
    world.send_command_at(34, 0, [9_000.0, NAN, 0.0, 6.3], DESERT, 6_000.0);
    assert_eq!(world.take_acks(), [ack(34, DENIED)]);
    assert!(world.has_text("only without an end"), "{:?}", world.texts());
}

#[test]
fn loitering_without_a_place_is_loitering_here() {
    let mut world = World::flying();
    for command in [17, 31] {
        world.send_command(command, [0.0; 7]);
        assert_eq!(repositions(&mut world), [PAUSE], "{command}: MAVProxy's loiter");
        world.send_command_int(command, 0, [0.0; 4], 6_000.0);
        let climb = Reposition { altitude_m: Some(6_000.0), ..PAUSE };
        assert_eq!(repositions(&mut world), [climb], "{command}");
        assert_eq!(world.take_acks(), [ack(command, ACCEPTED); 2]);
    }
    world.send_command_at(17, 3, [0.0, 0.0, -9_000.0, NAN], DESERT, NAN);
    let left = Reposition {
        place: Some(desert()),
        radius_m: Some(9_000.0),
        clockwise: Some(false),
        ..PAUSE
    };
    assert_eq!(repositions(&mut world), [left]);
    world.send_command_at(31, 3, [0.0, 9_000.0, 0.0, NAN], DESERT, 6_000.0);
    let right = Reposition { altitude_m: Some(6_000.0), clockwise: Some(true), ..left };
    assert_eq!(repositions(&mut world), [right]);
}

#[test]
fn pause_circles_here_and_continue_needs_a_paused_plan() {
    let mut world = World::flying();
    world.send_command(193, [0.0; 7]);
    assert_eq!(repositions(&mut world), [PAUSE]);
    world.send_command(193, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(193, ACCEPTED), ack(193, LATER)]);
    assert!(world.has_text("no plan is paused"), "{:?}", world.texts());
    assert!(
        matches!(world.take_commands()[..], [Command::Vehicle(VehicleCommand::Continue)]),
        "the aircraft knows"
    );
    for bad in [2.0, 0.5, NAN, -1.0] {
        world.send_command(193, [bad, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(193, DENIED)], "{bad}");
    }
    assert!(world.take_commands().is_empty());
}

#[test]
fn repositioning_leads_to_hold() {
    let mut world = World::flying();
    world.send_command_at(192, 0, [-1.0, 1.0, 0.0, NAN], DESERT, 6_000.0);
    world.run_ms(10);
    let snapshot = world.autopilot.snapshot().unwrap();
    assert_eq!(snapshot.mode, Mode::Hold);
    assert_eq!(snapshot.demand.altitude_m, 6_000.0);
    let target = snapshot.navigation.target.expect("a place to go to");
    assert!((target.place.latitude_rad - desert().latitude_rad).abs() < 1.0e-9, "{target:?}");
}

#[test]
fn home_is_below_the_aircraft_or_where_it_is_put() {
    let mut world = World::flying();
    world.send_command(179, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(homes(&mut world), [place(34.9, -117.9)]);
    world.send_command_at(179, 0, [0.0; 4], DESERT, 0.0);
    assert_eq!(homes(&mut world), [desert()]);
    world.send_command(179, [0.0, 0.0, 0.0, 0.0, 34.95, -117.85, 700.0]);
    assert_eq!(homes(&mut world), [desert()]);
    assert_eq!(world.take_acks(), [ack(179, ACCEPTED); 3]);
    assert!(world.has_text("700 m is not used"), "{:?}", world.texts());
}

#[test]
fn a_moved_home_is_broadcast_at_once() {
    let mut world = World::flying();
    world.send_command_at(179, 0, [0.0; 4], DESERT, 0.0);
    world.got.clear();
    world.run_ms(60);
    let sent = world.got.iter().filter(|got| got.to == address(14_550));
    let sent: Vec<HOME_POSITION_DATA> = sent.filter_map(Got::read).collect();
    let [home] = &sent[..] else { panic!("{sent:?}") };
    assert_eq!([home.latitude, home.longitude, home.altitude], [DESERT[0], DESERT[1], 0]);
    // 0.05 deg of latitude are 5.55 km; 0.3 % for the shape of the Earth.
    assert!((home.x - 5_548.0).abs() < 20.0, "{} m north", home.x);
    assert!(home.y > 4_500.0, "{} m east", home.y);
}

#[test]
fn a_moved_home_is_known_with_its_acknowledgement_and_a_leftover_state_does_not_move_it_back() {
    let mut world = World::flying();
    let leftover = *world.autopilot.snapshot().unwrap();
    world.send_command_at(179, 0, [0.0; 4], DESERT, 0.0);
    for _ in 0..2 {
        world.got.clear();
        world.send_command(512, [242.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let home: HOME_POSITION_DATA = world.got.iter().find_map(Got::read).expect("requested");
        assert_eq!([home.latitude, home.longitude], DESERT);
        world.ground.handle_snapshot(&leftover, world.now);
    }
    // Two in a row are not leftovers.
    world.ground.handle_snapshot(&leftover, world.now);
    world.got.clear();
    world.send_command(512, [242.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let home: HOME_POSITION_DATA = world.got.iter().find_map(Got::read).expect("requested");
    assert_eq!(home.latitude, 349_000_000);
}

#[test]
fn a_home_that_is_no_place_is_denied() {
    let mut world = World::flying();
    world.send_command(179, [0.0, 0.0, 0.0, 0.0, NAN, NAN, NAN]);
    world.send_command(179, [0.0, 0.0, 0.0, 0.0, 91.0, 0.0, 0.0]);
    world.send_command(179, [2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    world.send_command(179, [0.0, 0.0, 0.0, 0.0, 34.0, 0.0, f32::INFINITY]);
    world.send_command_at(179, 9, [0.0; 4], DESERT, 0.0);
    let frame = ack(179, MavResult::MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME);
    let denied = ack(179, DENIED);
    assert_eq!(world.take_acks(), [denied, denied, denied, denied, frame]);
    assert!(world.take_commands().is_empty());
}

#[test]
fn a_circle_that_is_too_small_is_accepted_with_a_note_and_one_that_fits_without() {
    for (command, params) in [
        (34, [500.0, 0.0, 0.0, 0.0]),
        (192, [NAN, 1.0, 500.0, NAN]),
        (17, [0.0, 0.0, -500.0, 0.0]),
        (31, [0.0, 500.0, 0.0, 0.0]),
    ] {
        let params = if command == 34 { [500.0, NAN, NAN, NAN] } else { params };
        let mut world = World::flying();
        world.send_command_at(command, 0, params, DESERT, 6_000.0);
        world.run_ms(20);
        assert_eq!(world.take_acks(), [ack(command, ACCEPTED)]);
        assert!(world.has_text("Radius 500 m is flown as "), "{command}: {:?}", world.texts());
        let wide = params.map(|value| if value.abs() == 500.0 { 90_000.0 } else { value });
        let mut world = World::flying();
        world.send_command_at(command, 0, wide, DESERT, 6_000.0);
        world.run_ms(20);
        assert!(!world.has_text("Radius"), "{command}: {:?}", world.texts());
    }
}
