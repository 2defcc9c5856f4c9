//! The list of faults as DEBUG_FLOAT_ARRAY, and its source.

use super::world::*;
use ::mavlink::dialects::common::{DEBUG_FLOAT_ARRAY_DATA, MavResult};
use flight_management::command::Command;
use icd::fault::PlantAction;
use icd::fault::{FaultEntry, FaultState, PlantReport, Repeat, Timing, Travel};
use icd::tvc_jet;
use icd::{ControlPeriod, FaultKind, SimTime};

fn lists(world: &World) -> Vec<Vec<f32>> {
    let arrays = world.got.iter().filter(|got| got.to == address(14_550));
    let arrays = arrays.filter_map(Got::read::<DEBUG_FLOAT_ARRAY_DATA>);
    let lists = arrays.filter(|array| array.array_id == 2);
    lists
        .map(|array| {
            assert_eq!(array.name.to_str().unwrap(), "FAULTS");
            array.data[..15].to_vec()
        })
        .collect()
}

fn requested(world: &mut World, index: f32) -> Vec<Vec<f32>> {
    world.got.clear();
    world.send_command(512, [350.0, index, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(512, MavResult::MAV_RESULT_ACCEPTED)]);
    lists(world)
}

fn rudder(id: u32, state: FaultState) -> PlantReport {
    let angle_rad = 7.0_f64.to_radians();
    let repeat = Some(Repeat { every_s: 20.0, times: Some(3) });
    let onset = SimTime::from_micros(2_500_000);
    PlantReport::Fault(FaultEntry {
        id,
        target: tvc_jet::RUDDER.into(),
        kind: FaultKind::StuckAt { angle_rad, travel: Travel::Jump },
        timing: Timing { ramp_s: 1.0, duration_s: Some(5.0), repeat, ..Timing::at(onset) },
        state,
    })
}

#[test]
fn each_fault_is_one_message_and_none_is_a_count_of_zero() {
    let mut world = World::flying();
    assert_eq!(requested(&mut world, 2.0), [vec![0.0; 15]]);
    let since = SimTime::from_micros(2_500_000);
    world.autopilot.handle_report(&rudder(9, FaultState::Active { since }));
    world.send_command(31_010, [101.0, 4.0, 1.0, 2.0, 40.0, 0.0, 99.0]);
    world.run_ms(150);
    world.take_acks();
    let list = requested(&mut world, 2.0);
    let stuck = 7.0_f32.to_radians();
    let of_rudder =
        [2.0, 2.0, 9.0, 102.0, 5.0, 2.0, 2.0, 2.0, 2.5, stuck, 0.0, 1.0, 5.0, 20.0, 3.0];
    let of_engine = [2.0, 1.0, 8.0, 101.0, 1.0, 4.0, 6.0, 1.0, 99.0, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0];
    assert_eq!(list, [of_engine, of_rudder]);
    // Together with the other array of this number, and never with one that does not exist.
    assert_eq!(requested(&mut world, 0.0), list);
    world.send_command(512, [350.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(512, MavResult::MAV_RESULT_DENIED)]);
}

#[test]
fn the_list_comes_each_second_and_soon_after_a_change() {
    let mut world = World::flying();
    world.run_ms(10_000);
    let calm = lists(&world).len();
    assert!((9..=11).contains(&calm), "{calm} lists in ten seconds");
    world.got.clear();
    world.send_command(420, [102.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    world.run_ms(110);
    assert!(lists(&world).iter().any(|list| list[0] == 1.0), "{:?}", lists(&world));
    // Many changes do not cause a flood.
    world.got.clear();
    for _ in 0..50 {
        for failure_type in [2.0, 0.0] {
            world.send_command(420, [102.0, failure_type, 1.0, 0.0, 0.0, 0.0, 0.0]);
            world.run_ms(10);
        }
    }
    assert!(lists(&world).len() <= 12, "{} lists in a second", lists(&world).len());
}

#[test]
fn joining_a_flight_requests_the_faults_of_the_plant_and_a_new_flight_does_not() {
    let mut world = World::flying();
    let list_requests = |world: &mut World| {
        world
            .take_commands()
            .iter()
            .filter(|command| **command == Command::Plant(PlantAction::ListFaults))
            .count()
    };
    assert_eq!(list_requests(&mut world), 0);
    world.listed = vec![rudder(4, FaultState::Active { since: SimTime::from_micros(2_500_000) })];
    world.autopilot.begin_flight(ControlPeriod::DEFAULT, world.sim, true);
    world.run_ms(100);
    assert_eq!(list_requests(&mut world), 1);
    assert_eq!(requested(&mut world, 2.0).first().map(|list| list[2]), Some(4.0));
    world.got.clear();
    // After a silence the autopilot requests the list again; known faults cause no events.
    world.autopilot.plant_lost();
    world.run_ms(10);
    world.autopilot.plant_back();
    world.run_ms(100);
    assert_eq!(list_requests(&mut world), 1);
    assert!(!world.has_text("Injected"), "{:?}", world.texts());
    assert_eq!(requested(&mut world, 2.0).len(), 1);
    world.autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
    world.run_ms(100);
    assert_eq!(list_requests(&mut world), 0);
    assert_eq!(requested(&mut world, 2.0), [vec![0.0; 15]]);
}

#[test]
fn a_pausing_fault_is_sent_with_its_next_onset() {
    let mut world = World::flying();
    let at = |seconds: u64| SimTime::from_micros(seconds * 1_000_000);
    world.autopilot.handle_report(&rudder(1, FaultState::Active { since: at(2) }));
    world.settle();
    let text =
        "Injected: rudder stuck at 7.0 deg, from 2 s, ramp 1 s, for 5 s, every 20 s, 3 times";
    assert!(world.has_text(text), "{:?}", world.texts());
    world.autopilot.handle_report(&rudder(1, FaultState::Resting { since: at(7), next: at(22) }));
    world.settle();
    let text = "Cleared: rudder stuck at 7.0 deg, again at 22 s";
    assert!(world.has_text(text), "{:?}", world.texts());
}

#[test]
fn lost_events_are_reported_and_the_faults_requested_again() {
    let mut world = World::flying();
    let since = SimTime::from_micros(2_500_000);
    world.autopilot.handle_report(&rudder(4, FaultState::Active { since }));
    world.settle();
    world.take_commands();
    world.got.clear();
    // The client fetches nothing for a while. Number 4 has ended and 5 continues.
    world.listed = vec![rudder(5, FaultState::Active { since })];
    let at = SimTime::ZERO;
    for _ in 0..400 {
        let report = PlantReport::Paced { request: None, pace: icd::pace::Pace::Run, at };
        world.autopilot.handle_report(&report);
    }
    world.run_ms(100);
    assert!(world.has_text("144 events were lost"), "{:?}", world.texts());
    assert!(world.has_text(" texts were not shown"), "{:?}", world.texts());
    assert_eq!(world.take_commands(), [Command::Plant(PlantAction::ListFaults)]);
    let ids: Vec<f32> = requested(&mut world, 2.0).iter().map(|list| list[2]).collect();
    assert_eq!(ids, [5.0]);
}
