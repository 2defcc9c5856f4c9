//! Silence of ground stations, in wall time.

use super::world::*;
use crate::Service as _;
use crate::codec::Identity;
use ::mavlink::dialects::common::{HEARTBEAT_DATA, MavMessage, MavType};
use flight_management::command::Command;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::LinkLossAction;

const OTHER: Identity = Identity { system: 245, component: 190 };

fn beat_as(world: &mut World, sender: Identity, mavtype: MavType) {
    let beat = MavMessage::HEARTBEAT(HEARTBEAT_DATA { mavtype, ..HEARTBEAT_DATA::default() });
    let bytes = world.encode(sender, &beat);
    world.send_bytes(address(14_550), &bytes);
}

fn beat(world: &mut World, sender: Identity) {
    beat_as(world, sender, MavType::MAV_TYPE_GCS);
}

/// Flying, with a return after ten seconds of silence, and a heartbeat of the first station.
fn watched() -> World {
    let mut world = World::flying();
    world.ground.shared.parameters.link.loss_s = 10.0;
    world.ground.shared.parameters.link.loss_action = LinkLossAction::Return;
    beat(&mut world, STATION);
    world.take_commands();
    world
}

#[derive(Debug, PartialEq)]
enum LinkChange {
    Lost(LinkLossAction),
    Back,
}

fn link_changes(world: &mut World) -> Vec<LinkChange> {
    let commands = world.take_commands().into_iter();
    commands
        .filter_map(|command| match command {
            Command::Vehicle(VehicleCommand::LinkLost(action)) => Some(LinkChange::Lost(action)),
            Command::Vehicle(VehicleCommand::LinkBack) => Some(LinkChange::Back),
            _ => None,
        })
        .collect()
}

#[test]
fn silence_leads_to_the_configured_action_once_and_its_end_undoes_it_once() {
    let mut world = watched();
    world.run_ms(9_990);
    assert_eq!(link_changes(&mut world), []);
    world.run_ms(20);
    assert_eq!(link_changes(&mut world), [LinkChange::Lost(LinkLossAction::Return)]);
    world.run_ms(30_000);
    assert_eq!(link_changes(&mut world), [], "once");
    for _ in 0..3 {
        beat(&mut world, STATION);
        world.run_ms(1_000);
    }
    assert_eq!(link_changes(&mut world), [LinkChange::Back], "once");
}

#[test]
fn heartbeats_keep_the_link_and_other_messages_do_not() {
    let mut world = watched();
    for _ in 0..30 {
        world.run_ms(1_000);
        beat(&mut world, STATION);
    }
    assert_eq!(link_changes(&mut world), []);
    for _ in 0..12 {
        world.run_ms(1_000);
        beat_as(&mut world, STATION, MavType::MAV_TYPE_ONBOARD_CONTROLLER);
        world.send_command(410, [0.0; 7]);
    }
    assert_eq!(link_changes(&mut world), [LinkChange::Lost(LinkLossAction::Return)]);
}

#[test]
fn no_link_is_lost_before_the_first_heartbeat() {
    let mut world = World::flying();
    beat_as(&mut world, STATION, MavType::MAV_TYPE_ONBOARD_CONTROLLER);
    world.send_command(186, [6_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    world.run_ms(60_000);
    assert_eq!(link_changes(&mut world), []);
}

#[test]
fn another_active_station_takes_over_and_its_silence_is_the_loss() {
    let mut world = watched();
    for _ in 0..15 {
        world.run_ms(1_000);
        beat(&mut world, OTHER);
    }
    assert_eq!(link_changes(&mut world), []);
    let takes_over = "Ground station 255 is silent: 245 takes over";
    let count = world.texts().iter().filter(|text| *text == takes_over).count();
    assert_eq!(count, 1, "{:?}", world.texts());
    world.run_ms(10_010);
    assert_eq!(link_changes(&mut world), [LinkChange::Lost(LinkLossAction::Return)]);
    beat(&mut world, STATION);
    assert_eq!(link_changes(&mut world), [LinkChange::Back], "any station brings the link back");
}

#[test]
fn a_paused_simulation_loses_no_link_and_does_not_hide_a_loss() {
    let mut world = watched();
    for _ in 0..60 {
        // Wall time only.
        world.now = world.now + STEP * 500;
        beat(&mut world, STATION);
    }
    assert_eq!(link_changes(&mut world), []);
    world.now = world.now + STEP * 5_001;
    world.settle();
    assert_eq!(link_changes(&mut world), [LinkChange::Lost(LinkLossAction::Return)]);
}

#[test]
fn a_link_that_is_still_lost_is_reported_again_to_a_new_flight() {
    let mut world = watched();
    world.run_ms(10_010);
    assert_eq!(link_changes(&mut world), [LinkChange::Lost(LinkLossAction::Return)]);
    world.autopilot.begin_flight(icd::ControlPeriod::DEFAULT, icd::SimTime::ZERO, false);
    world.run_ms(10);
    assert_eq!(link_changes(&mut world), [LinkChange::Lost(LinkLossAction::Return)]);
}

#[test]
fn without_a_flight_no_loss_is_reported_and_no_deadline_is_in_the_past() {
    let mut world = watched();
    world.autopilot.plant_lost();
    world.settle();
    world.now = world.now + STEP * 10_000;
    world.settle();
    assert_eq!(link_changes(&mut world), []);
    let ground = &world.ground;
    let deadline = ground.services.link_loss.next_deadline(&ground.shared);
    assert_eq!(deadline, None);
}

#[test]
fn the_deadline_is_the_moment_of_the_loss() {
    let world = watched();
    let ground = &world.ground;
    let deadline = ground.services.link_loss.next_deadline(&ground.shared);
    assert_eq!(deadline, Some(world.now + STEP * 5_000));
}

#[test]
fn a_station_that_has_steered_is_lost_although_another_is_active_and_ends_the_loss_itself() {
    let mut world = watched();
    world.send_command(186, [6_000.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    for _ in 0..15 {
        world.run_ms(1_000);
        beat(&mut world, OTHER);
    }
    assert_eq!(link_changes(&mut world), [LinkChange::Lost(LinkLossAction::Return)]);
    assert!(!world.has_text("takes over"), "{:?}", world.texts());
    beat(&mut world, STATION);
    assert_eq!(link_changes(&mut world), [LinkChange::Back]);
}

#[test]
fn an_accepted_command_of_another_station_ends_the_loss_and_stands() {
    let mut world = watched();
    world.send_command(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
    for _ in 0..11 {
        world.run_ms(1_000);
        beat(&mut world, OTHER);
    }
    assert_eq!(link_changes(&mut world), [LinkChange::Lost(LinkLossAction::Return)]);
    // The loss has chosen Return already: now a command requests it.
    let mode = [1.0, 4.0, 5.0, 0.0, 0.0, 0.0, 0.0];
    let bytes = command_long(176, mode, crate::codec::OWN);
    world.send_bytes(address(14_550), &sent_by(OTHER, bytes, 152));
    world.run_ms(100);
    assert_eq!(link_changes(&mut world), [LinkChange::Back]);
    assert_eq!(world.autopilot.snapshot().unwrap().mode, flight_management::vehicle::Mode::Return);
    world.run_ms(10_010);
    assert_eq!(
        link_changes(&mut world),
        [LinkChange::Lost(LinkLossAction::Return)],
        "of the new one"
    );
}
