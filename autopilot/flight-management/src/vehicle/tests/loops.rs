//! Plans that lead back to where the aircraft is, and plans of items that take no time.

use super::plane::{Plane, at, circle, item, plan, waypoint};
use super::*;
use crate::vehicle::VehicleEvent;
use crate::vehicle::plan::{Action, Item, Point, Progress};

/// Item events that one tick may set_own_law.
const EVENTS_MAX: usize = 8;

fn jump(to: u16, times: Option<u16>) -> Item {
    item(Action::Jump { to, times })
}

fn speed(airspeed_m_s: f64) -> Item {
    item(Action::ChangeSpeed { airspeed: Airspeed::True(airspeed_m_s) })
}

/// Flies on and returns the most item events of one tick.
fn most_events(plane: &mut Plane, seconds: f64) -> usize {
    let end = plane.now.as_seconds() + seconds;
    let mut most = 0;
    while plane.now.as_seconds() < end {
        let before = plane.begun().len() + plane.reached().len();
        plane.tick();
        most = most.max(plane.begun().len() + plane.reached().len() - before);
    }
    most
}

#[test]
fn a_jump_back_to_the_only_point_flies_through_it_again_and_again() {
    let mut plane = Plane::begin(vec![waypoint(20.0, 0.0, 5_000.0), jump(0, None)]);
    let mut passes = Vec::new();
    let mut farthest_m = 0.0_f64;
    while plane.now.as_seconds() < 3_000.0 {
        let before = plane.reached().len();
        plane.tick();
        if plane.reached().len() > before {
            passes.push(plane.distance_m(at(20.0, 0.0)));
        } else if !passes.is_empty() {
            farthest_m = farthest_m.max(plane.distance_m(at(20.0, 0.0)));
        }
    }
    assert!((4..30).contains(&passes.len()), "{} passes", passes.len());
    assert!(passes.iter().all(|distance_m| *distance_m < 600.0), "{passes:?}");
    assert!((10_000.0..100_000.0).contains(&farthest_m), "{farthest_m} m");
    assert_eq!(plane.vehicle.mode(), Mode::Mission);
    assert_eq!(plane.vehicle.navigation().progress, Progress::Active);
}

#[test]
fn no_endless_plan_floods_anybody_with_events_or_ever_completes() {
    let here = Point { place: None, altitude_m: None };
    let at_once = Action::LoiterTime { circle: circle(20.0, 0.0, 5_000.0), seconds: 0.0 };
    for items in [
        vec![waypoint(20.0, 0.0, 5_000.0), jump(0, None)],
        vec![waypoint(20.0, 0.0, 5_000.0), waypoint(20.0, 0.1, 5_000.0), jump(0, None)],
        vec![item(Action::Waypoint { point: here, acceptance_m: None }), jump(0, None)],
        vec![item(Action::Waypoint { point: here, acceptance_m: Some(1.0e5) }), jump(0, None)],
        vec![item(Action::ChangeAltitude { altitude_m: 5_000.0 }), speed(240.0), jump(0, None)],
        vec![item(at_once), jump(0, None)],
    ] {
        let mut plane = Plane::begin(items.clone());
        assert!(most_events(&mut plane, 600.0) <= EVENTS_MAX, "{items:?}");
        assert!(
            (1..=1_300).contains(&plane.reached().len()),
            "{} {items:?}",
            plane.reached().len()
        );
        assert_eq!(plane.vehicle.mode(), Mode::Mission, "{items:?}");
        assert!(!plane.events.contains(&VehicleEvent::PlanComplete), "{items:?}");
    }
}

#[test]
fn a_thousand_items_that_take_no_time_are_done_a_few_a_tick_while_the_aircraft_flies_on() {
    let mut plane = Plane::begin(vec![speed(240.0); 999]);
    assert!(most_events(&mut plane, 5.0) <= EVENTS_MAX);
    assert_eq!(plane.vehicle.navigation().progress, Progress::Active, "not complete yet");
    assert!(plane.roll.abs() < 1.0e-3, "straight on: {} rad", plane.roll);
    plane.fly_until(30.0, VehicleEvent::PlanComplete);
    let every: Vec<u16> = (0..999).collect();
    assert_eq!((plane.begun(), plane.reached()), (every.clone(), every));
}

#[test]
fn a_counted_jump_over_items_that_take_no_time_comes_to_its_end() {
    let mut plane = Plane::flying();
    plane.load(&plan(vec![speed(240.0), jump(0, Some(3)), waypoint(20.0, 0.0, 5_000.0)])).unwrap();
    plane.change(Mode::Mission).unwrap();
    plane.fly_until(200.0, VehicleEvent::PlanComplete);
    assert_eq!(plane.begun(), [0, 0, 0, 0, 2]);
}

#[test]
fn only_a_plan_that_was_begun_and_is_not_complete_can_be_continued() {
    let mut plane = Plane::flying();
    let go_on = |plane: &mut Plane| {
        let events = &mut plane.events;
        plane.vehicle.continue_plan(&plane.rules, &mut |kind| events.push(kind))
    };
    assert_eq!(go_on(&mut plane), Err(VehicleRefusal::NoPausedPlan));
    plane.load(&plan(vec![waypoint(20.0, 0.0, 5_000.0)])).unwrap();
    assert_eq!(go_on(&mut plane), Err(VehicleRefusal::NoPausedPlan), "not begun");
    plane.change(Mode::Mission).unwrap();
    assert_eq!(go_on(&mut plane), Ok(()), "under way");
    plane.change(Mode::Hold).unwrap();
    assert_eq!(go_on(&mut plane), Ok(()), "paused, without a tick between");
    assert_eq!(plane.vehicle.mode(), Mode::Mission);
    plane.fly_until(200.0, VehicleEvent::PlanComplete);
    assert_eq!(go_on(&mut plane), Err(VehicleRefusal::NoPausedPlan), "complete");
}
