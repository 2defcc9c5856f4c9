//! MAV_SYS_ID: the vehicle sends and receives under the id that it had at the start.

use super::params::set_int;
use super::world::*;
use crate::codec::Identity;
use ::mavlink::dialects::common::MavResult;
use flight_management::parameters::Parameters;

/// System id in the header of a MAVLink 2 frame.
fn senders(world: &World) -> Vec<u8> {
    let mut ids: Vec<u8> = world.got.iter().map(|got| got.bytes[5]).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

fn hold(world: &mut World, system: u8) -> usize {
    let target = Identity { system, component: 1 };
    let bytes = command_long(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0], target);
    world.send_bytes(address(14_550), &bytes);
    world.run_ms(20);
    let accepted = ack(176, MavResult::MAV_RESULT_ACCEPTED);
    world.take_acks().iter().filter(|got| **got == accepted).count()
}

#[test]
fn the_vehicle_uses_the_id_that_it_has_at_the_start() {
    let mut parameters = Parameters::default();
    parameters.set("MAV_SYS_ID", 7.0).unwrap();
    let mut world = World::flying_with(&parameters);
    world.run_ms(1_000);
    assert_eq!(senders(&world), [7]);
    assert_eq!(hold(&mut world, 7), 1);
    assert_eq!(hold(&mut world, 0), 1, "all systems");
    assert_eq!(hold(&mut world, 1), 0, "another vehicle");
}

#[test]
fn a_change_in_flight_waits_for_the_next_start() {
    let mut world = World::flying();
    world.send(&set_int("MAV_SYS_ID", 9));
    world.run_ms(1_000);
    assert_eq!(senders(&world), [1]);
    assert_eq!(hold(&mut world, 1), 1);
    world.send(&set_int("MAV_SYS_ID", 251));
    assert!(world.has_text("MAV_SYS_ID = 251 is outside 1 to 250"), "{:?}", world.texts());
}
