//! A channel of RC_CHANNELS_OVERRIDE that selects flight modes.

use super::params::set_int;
use super::world::*;
use ::mavlink::dialects::common::{MavMessage, RC_CHANNELS_OVERRIDE_DATA};
use flight_management::vehicle::Mode;

/// Channel 6 at this position, the others not given.
fn switch(chan6_raw: u16) -> MavMessage {
    MavMessage::RC_CHANNELS_OVERRIDE(RC_CHANNELS_OVERRIDE_DATA {
        chan6_raw,
        target_system: 1,
        target_component: 1,
        ..RC_CHANNELS_OVERRIDE_DATA::default()
    })
}

fn mode(world: &World) -> Mode {
    world.autopilot.snapshot().unwrap().mode
}

fn move_to(world: &mut World, pulse_us: u16) -> Mode {
    world.send(&switch(pulse_us));
    world.run_ms(20);
    mode(world)
}

/// Channel 6: Hold below the middle, Return above.
fn with_switch() -> World {
    let mut world = World::flying();
    for (name, value) in
        [("RC_MAP_FLTMODE", 6), ("COM_FLTMODE3", 4), ("COM_FLTMODE5", 5), ("COM_FLTMODE6", -1)]
    {
        world.send(&set_int(name, value));
    }
    world.run_ms(20);
    world.got.clear();
    world
}

#[test]
fn a_changed_slot_selects_its_mode_and_the_first_position_none() {
    let mut world = with_switch();
    let before = mode(&world);
    assert_eq!(move_to(&mut world, 1_700), before, "the first position");
    assert_eq!(move_to(&mut world, 1_400), Mode::Hold);
    assert_eq!(move_to(&mut world, 1_700), Mode::Return);
    assert_eq!(move_to(&mut world, 2_000), Mode::Return, "unassigned");
    assert_eq!(move_to(&mut world, 0), Mode::Return, "released");
    assert_eq!(move_to(&mut world, 1_400), Mode::Hold);
}

#[test]
fn a_slot_that_stays_leaves_the_mode_to_others() {
    let mut world = with_switch();
    move_to(&mut world, 1_000);
    assert_eq!(move_to(&mut world, 1_400), Mode::Hold);
    world.send_command(20, [0.0; 7]);
    world.run_ms(20);
    assert_eq!(move_to(&mut world, 1_450), Mode::Return);
}

#[test]
fn a_mode_that_cannot_be_entered_is_refused_with_the_text_of_a_request() {
    let mut world = with_switch();
    world.send(&set_int("COM_FLTMODE1", 7));
    move_to(&mut world, 1_400);
    move_to(&mut world, 1_000);
    assert!(world.has_text("Offboard refused: no setpoint a moment ago"), "{:?}", world.texts());
}

#[test]
fn without_a_channel_no_switch_selects_anything() {
    let mut world = World::flying();
    let before = mode(&world);
    move_to(&mut world, 1_000);
    assert_eq!(move_to(&mut world, 1_400), before);
    for channel in [1, 4, 9] {
        world.send(&set_int("RC_MAP_FLTMODE", channel));
    }
    assert!(world.has_text("RC_MAP_FLTMODE = 1 is none of 0, 5, 6, 7, 8"), "{:?}", world.texts());
}
