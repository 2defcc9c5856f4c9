use std::sync::Arc;

use super::plane::{Plane, at, item, plan, waypoint};
use super::*;
use crate::vehicle::fence::{
    Area, AreaShape, Breach, Fence, FenceAction, FenceChange, FenceProblem, RallyPoint,
};
use crate::vehicle::plan::Action;

fn polygon(inclusion: bool, corners: &[[f64; 2]]) -> Area {
    let places = corners.iter().map(|[north_km, east_km]| at(*north_km, *east_km)).collect();
    Area { inclusion, shape: AreaShape::Polygon(places) }
}

const SQUARE: [[f64; 2]; 4] = [[-20.0, -20.0], [-20.0, 20.0], [20.0, 20.0], [20.0, -20.0]];

/// North at 264 m/s, in a square of 40 km.
fn fenced(action: FenceAction) -> Plane {
    let mut plane = Plane::flying();
    plane.rules.navigation.fence_action = action;
    plane.vehicle.replace_fence(&Arc::new(Fence::new(vec![polygon(true, &SQUARE)]).unwrap()));
    plane
}

const OUTSIDE: VehicleEvent = VehicleEvent::Fence(FenceChange::Breached(Breach::Outside));

#[test]
fn a_place_is_inside_any_inclusion_and_no_exclusion() {
    let concave = [[0.0, 0.0], [0.0, 10.0], [5.0, 5.0], [10.0, 10.0], [10.0, 0.0]];
    let circle = AreaShape::Circle { centre: at(30.0, 0.0), radius_m: 2_000.0 };
    let hole = Area {
        inclusion: false,
        shape: AreaShape::Circle { centre: at(2.0, 2.0), radius_m: 500.0 },
    };
    let far = Area { inclusion: true, shape: circle };
    let fence = Fence::new(vec![polygon(true, &concave), far, hole]).unwrap();
    for (place, breach) in [
        ([5.0, 2.0], None),
        ([5.0, 7.0], Some(Breach::Outside)),
        ([30.0, 1.9], None),
        ([30.0, 2.1], Some(Breach::Outside)),
        ([2.0, 2.4], Some(Breach::Exclusion)),
        ([-0.1, 5.0], Some(Breach::Outside)),
    ] {
        assert_eq!(fence.breach(at(place[0], place[1])), breach, "{place:?}");
    }
    assert_eq!(Fence::default().breach(at(0.0, 0.0)), None);
}

#[test]
fn polygons_that_are_none_are_refused_with_the_vertex() {
    let [a, b, c, d] = SQUARE;
    for (corners, item, problem) in [
        (vec![a, b], 0, FenceProblem::Count { vertices: 2 }),
        (vec![a, a, a], 1, FenceProblem::Same { other: 0 }),
        (vec![a, c, b, d], 2, FenceProblem::Crossing { other: 0 }),
        (vec![a, c, [0.0, 0.0]], 2, FenceProblem::OnEdge { other: 0 }),
        (vec![a, b, c, d, [-20.0, 5.0]], 4, FenceProblem::OnEdge { other: 0 }),
        (vec![a; 1_000], 0, FenceProblem::TooMany { vertices: 1_000 }),
    ] {
        assert_eq!(Fence::new(vec![polygon(true, &corners)]), Err(vec![(item, problem)]));
    }
    let poles = AreaShape::Circle { centre: at(0.0, 0.0), radius_m: f64::NAN };
    assert!(Fence::new(vec![Area { inclusion: true, shape: poles }]).is_err());
}

#[test]
fn an_aircraft_on_its_wheels_breaches_no_fence() {
    let mut plane = fenced(FenceAction::Hold);
    (plane.on_wheels, plane.place) = (true, at(30.0, 0.0));
    plane.fly(10.0);
    assert!(!plane.events.contains(&OUTSIDE), "{:?}", plane.events);
    plane.on_wheels = false;
    plane.fly(10.0);
    assert!(plane.events.contains(&OUTSIDE), "{:?}", plane.events);
}

#[test]
fn the_lower_limit_counts_once_the_aircraft_has_been_above_it_and_not_for_a_landing() {
    const LOW: VehicleEvent = VehicleEvent::Fence(FenceChange::Breached(Breach::Low));
    let mut plane = Plane::flying();
    plane.rules.navigation.fence_min_m = 5_100.0;
    plane.on_wheels = true;
    plane.tick();
    plane.on_wheels = false;
    plane.fly(10.0);
    assert!(!plane.events.contains(&LOW), "a takeoff: {:?}", plane.events);
    plane.altitude_m = 5_150.0;
    plane.vehicle.refer(Reference::Altitude(5_150.0), &rules()).unwrap();
    plane.fly(5.0);
    plane.altitude_m = 5_050.0;
    plane.fly(2.0);
    assert!(plane.events.contains(&LOW), "{:?}", plane.events);
    // A takeoff as an item that is lower than what follows.
    let mut plane = Plane::flying();
    plane.rules.ground_m = 4_900.0;
    plane.rules.navigation.fence_min_m = 300.0;
    plane.rules.limits.altitude_min_m = 5_150.0;
    (plane.on_wheels, plane.airspeed_m_s) = (true, 0.1);
    plane.tick();
    let items = vec![item(Action::Takeoff { altitude_m: 5_040.0 }), waypoint(30.0, 0.0, 5_400.0)];
    plane.vehicle.replace_plan(&plan(items), &plane.rules, &mut |_| {}).unwrap();
    plane.change(Mode::Mission).unwrap();
    plane.tick();
    (plane.on_wheels, plane.airspeed_m_s) = (false, 264.0);
    plane.fly(25.0);
    assert!(plane.altitude_m > 5_050.0 && !plane.events.contains(&LOW), "{:?}", plane.events);
    // Return to the runway of a takeoff.
    let mut plane = Plane::flying();
    plane.rules.ground_m = 5_000.0;
    (plane.on_wheels, plane.airspeed_m_s) = (true, 0.1);
    plane.tick();
    plane.change(Mode::Takeoff).unwrap();
    plane.tick();
    (plane.on_wheels, plane.airspeed_m_s) = (false, 264.0);
    plane.fly(5.0);
    let rally = RallyPoint { place: plane.place, altitude_m: 6_000.0 };
    plane.vehicle.replace_rally(&Arc::from([rally])).unwrap();
    plane.change(Mode::Return).unwrap();
    let altitude_m = plane.vehicle.demand().unwrap().altitude_m;
    assert_eq!(altitude_m, plane.rules.return_altitude_m(), "not that of the rally point");
    let back = VehicleEvent::Fence(FenceChange::Back);
    plane.rules.navigation.fence_min_m = 1_000.0;
    plane.altitude_m = 6_200.0;
    plane.fly(1.0);
    plane.altitude_m = 5_050.0;
    plane.fly(2.0);
    assert!(!plane.events.contains(&LOW), "{:?}", plane.events);
    // Below it and not landing, it is no better by a landing.
    plane.change(Mode::Hold).unwrap();
    plane.fly(2.0);
    assert!(plane.events.contains(&LOW), "{:?}", plane.events);
    plane.change(Mode::Return).unwrap();
    plane.fly(8.0);
    assert!(!plane.events.contains(&back), "{:?}", plane.events);
}

#[test]
fn a_breach_has_its_action_once_and_ends_inside() {
    for (action, mode) in [
        (FenceAction::Report, Mode::Position),
        (FenceAction::Hold, Mode::Hold),
        (FenceAction::Return, Mode::Return),
        // There is no landing in the plan.
        (FenceAction::Land, Mode::Return),
    ] {
        let mut plane = fenced(action);
        plane.fly_until(80.0, OUTSIDE);
        assert_eq!(plane.vehicle.mode(), mode);
        if action != FenceAction::Report {
            plane.fly_until(600.0, VehicleEvent::Fence(FenceChange::Back));
        }
        assert_eq!(plane.events.iter().filter(|kind| **kind == OUTSIDE).count(), 1);
    }
    let mut plane = fenced(FenceAction::Terminate);
    plane.fly_until(80.0, OUTSIDE);
    assert!(plane.vehicle.is_terminated());
    let mut plane = fenced(FenceAction::Nothing);
    plane.fly(100.0);
    assert!(!plane.events.contains(&OUTSIDE));
    let mut plane = fenced(FenceAction::Hold);
    plane.vehicle.enable_fence(false);
    plane.fly(100.0);
    assert!(!plane.events.contains(&OUTSIDE));
}

#[test]
fn the_fence_has_altitudes() {
    let mut plane = Plane::flying();
    plane.rules.navigation.fence_max_m = 5_100.0;
    plane.vehicle.refer(Reference::Altitude(5_300.0), &rules()).unwrap();
    plane.fly_until(60.0, VehicleEvent::Fence(FenceChange::Breached(Breach::High)));
    assert!(plane.altitude_m < 5_110.0);
}

#[test]
fn return_flies_to_the_nearest_of_home_and_the_rally_points_inside_the_fence() {
    let point =
        |north_km, east_km| RallyPoint { place: at(north_km, east_km), altitude_m: 6_000.0 };
    let mut plane = fenced(FenceAction::Report);
    let beyond: Arc<[RallyPoint]> = [point(0.0, 0.0), point(60.0, 0.0)].into();
    let refused = plane.vehicle.replace_rally(&beyond).unwrap_err();
    assert_eq!(refused, VehicleRefusal::RallyBeyondFence { item: 1 });
    plane.vehicle.replace_rally(&[point(15.0, 0.0), point(-15.0, 0.0)].into()).unwrap();
    plane.change(Mode::Return).unwrap();
    plane.fly(1.0);
    assert_eq!(plane.demand().altitude_m, plane.rules.navigation.return_altitude_m, "home");
    plane.change(Mode::Position).unwrap();
    plane.fly(55.0);
    plane.change(Mode::Return).unwrap();
    plane.fly(600.0);
    assert!((plane.distance_m(at(15.0, 0.0)) - 10_000.0).abs() < 20.0);
    assert_eq!(plane.demand().altitude_m, 6_000.0);
}
