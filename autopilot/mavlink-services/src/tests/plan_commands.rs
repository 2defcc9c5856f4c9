//! Commands about a loaded plan: begin, continue, another item.

use flight_management::command::VehicleCommand;
use std::sync::Arc;

use super::world::*;
use ::mavlink::dialects::common::MavResult;
use flight_management::command::{Command, Intent};
use flight_management::vehicle::plan::{Action, Item, Plan, Point, Progress};
use flight_management::vehicle::{Mode, Place};

const NAN: f32 = f32::NAN;
const ACCEPTED: MavResult = MavResult::MAV_RESULT_ACCEPTED;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
const FAILED: MavResult = MavResult::MAV_RESULT_FAILED;
const LATER: MavResult = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;

fn waypoint(latitude_deg: f64) -> Item {
    let place =
        Place { latitude_rad: latitude_deg.to_radians(), longitude_rad: (-117.9_f64).to_radians() };
    let point = Point { place: Some(place), altitude_m: Some(5_000.0) };
    Item { action: Action::Waypoint { point, acceptance_m: None }, autocontinue: true }
}

/// Flying, with a plan of three waypoints to the north.
fn with_a_plan() -> World {
    let mut world = World::flying();
    let items = [35.2, 35.4, 35.6].map(waypoint).to_vec();
    let command = Command::Vehicle(VehicleCommand::Plan(Arc::new(Plan { id: 7, items })));
    world.autopilot.handle_intent(Intent { number: 1_000_000, command });
    world.run_ms(200);
    world.got.clear();
    world
}

fn two(p1: f32, p2: f32) -> [f32; 7] {
    [p1, p2, 0.0, 0.0, 0.0, 0.0, 0.0]
}

fn mode_and_item(world: &mut World) -> (Mode, u16) {
    world.run_ms(10);
    let snapshot = world.autopilot.snapshot().unwrap();
    (snapshot.mode, snapshot.navigation.item)
}

fn progress(world: &World) -> Progress {
    world.autopilot.snapshot().unwrap().navigation.progress
}

#[test]
fn a_mission_begins_with_the_requested_item() {
    for (p1, p2, item) in [(0.0, 0.0, 0), (1.0, NAN, 1), (2.0, 2.0, 2), (NAN, 0.0, 0)] {
        let mut world = with_a_plan();
        world.send_command(300, two(p1, p2));
        assert_eq!(world.take_acks(), [ack(300, ACCEPTED)], "{p1} {p2}");
        assert_eq!(mode_and_item(&mut world), (Mode::Mission, item), "{p1} {p2}");
    }
}

#[test]
fn items_that_are_not_there_and_a_plan_cut_short_are_denied() {
    let mut world = with_a_plan();
    for (p1, p2) in [(3.0, 0.0), (-1.0, 0.0), (0.5, 0.0), (0.0, 1.0), (0.0, 65_535.0)] {
        world.send_command(300, two(p1, p2));
        assert_eq!(world.take_acks(), [ack(300, DENIED)], "{p1} {p2}");
    }
    assert_eq!(mode_and_item(&mut world), (Mode::Position, 0));
}

#[test]
fn without_a_plan_there_is_no_mission_and_the_reason_is_reported() {
    let mut world = World::flying();
    world.send_command(300, two(0.0, 0.0));
    assert_eq!(world.take_acks(), [ack(300, LATER)]);
    assert!(world.has_text("there is no plan"), "{:?}", world.texts());
    world.send_command(224, two(0.0, 0.0));
    assert_eq!(world.take_acks(), [ack(224, FAILED)]);
    world.send_command(176, [1.0, 4.0, 4.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(176, LATER)]);
    assert_eq!(mode_and_item(&mut world).0, Mode::Position);
}

#[test]
fn the_current_item_is_changed_without_a_change_of_mode() {
    let mut world = with_a_plan();
    world.send_command(224, two(2.0, 0.0));
    world.send_command(224, two(-1.0, 0.0));
    world.send_command(224, two(-1.0, NAN));
    assert_eq!(world.take_acks(), [ack(224, ACCEPTED); 3]);
    assert_eq!(mode_and_item(&mut world), (Mode::Position, 2));
    for (p1, p2, expected) in [
        (3.0, 0.0, FAILED),
        (NAN, 0.0, FAILED),
        (-2.0, 0.0, DENIED),
        (0.5, 0.0, DENIED),
        (0.0, 2.0, DENIED),
    ] {
        world.send_command(224, two(p1, p2));
        assert_eq!(world.take_acks(), [ack(224, expected)], "{p1} {p2}");
    }
    assert_eq!(mode_and_item(&mut world), (Mode::Position, 2));
}

#[test]
fn a_paused_plan_is_continued_where_it_was() {
    let mut world = with_a_plan();
    world.send_command(300, two(1.0, 0.0));
    world.run_ms(200);
    assert_eq!(progress(&world), Progress::Active);
    world.send_command(193, two(0.0, 0.0));
    world.run_ms(200);
    assert_eq!((mode_and_item(&mut world), progress(&world)), ((Mode::Hold, 1), Progress::Paused));
    world.send_command(193, two(1.0, 0.0));
    assert_eq!(mode_and_item(&mut world), (Mode::Mission, 1));
    world.send_command(193, two(1.0, 0.0));
    assert_eq!(mode_and_item(&mut world), (Mode::Mission, 1), "a copy changes nothing");
    let acks = world.take_acks();
    assert_eq!(
        acks,
        [ack(300, ACCEPTED), ack(193, ACCEPTED), ack(193, ACCEPTED), ack(193, ACCEPTED)]
    );
}

#[test]
fn a_plan_is_paused_and_continued_between_two_states_of_the_aircraft() {
    let mut world = with_a_plan();
    for (command, p1) in [(300, 0.0), (193, 0.0), (193, 1.0)] {
        world.send_command(command, two(p1, 0.0));
        assert_eq!(world.take_acks(), [ack(command, ACCEPTED)], "{command} {p1}");
    }
    assert_eq!(mode_and_item(&mut world), (Mode::Mission, 0));
}
