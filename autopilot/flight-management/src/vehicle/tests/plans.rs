use super::plane::{Plane, at, circle, item, plan, point, start, waypoint};
use super::*;
use crate::vehicle::Target;
use crate::vehicle::VehicleEvent;
use crate::vehicle::geodesy::{Horizon, Site};
use crate::vehicle::plan::{Action, Circle, Item, Point, Progress, WaitCondition};

const COMPLETE: VehicleEvent = VehicleEvent::PlanComplete;

fn jump(to: u16, times: Option<u16>) -> Item {
    item(Action::Jump { to, times })
}

fn target(plane: &Plane) -> Target {
    plane.vehicle.navigation().target.unwrap()
}

#[test]
fn items_are_flown_in_their_order_and_after_the_last_the_aircraft_circles_around_its_point() {
    let mut plane = Plane::begin(vec![
        waypoint(30.0, 0.0, 5_500.0),
        item(Action::ChangeSpeed { airspeed: Airspeed::True(240.0) }),
        waypoint(30.0, 30.0, 6_000.0),
    ]);
    plane.fly_until(400.0, COMPLETE);
    assert_eq!(plane.begun(), [0, 1, 2]);
    assert_eq!(plane.reached(), [0, 1, 2]);
    assert_eq!(plane.vehicle.mode(), Mode::Hold);
    assert_eq!(plane.events.last(), Some(&VehicleEvent::Mode(Mode::Hold)));
    assert_eq!(plane.vehicle.navigation().progress, Progress::Complete);
    assert_eq!(plane.demand().airspeed_m_s, 240.0);
    plane.fly(600.0);
    assert!((plane.distance_m(at(30.0, 30.0)) - 10_000.0).abs() < 20.0);
    assert!((plane.altitude_m - 6_000.0).abs() < 10.0, "{} m", plane.altitude_m);
}

#[test]
fn the_altitude_changes_linearly_along_a_leg() {
    let mut plane = Plane::begin(vec![waypoint(30.0, 0.0, 6_000.0), waypoint(60.0, 0.0, 6_000.0)]);
    while plane.distance_m(at(30.0, 0.0)) > 15_000.0 {
        plane.tick();
    }
    // Half-way, and complete at the acceptance radius of 500 m.
    assert!((plane.demand().altitude_m - 5_508.0).abs() < 5.0, "{:?}", plane.demand());
}

#[test]
fn a_turn_begins_before_the_point_and_ends_on_the_next_leg() {
    let mut plane = Plane::begin(vec![waypoint(30.0, 0.0, 5_000.0), waypoint(30.0, 60.0, 5_000.0)]);
    plane.fly_until(200.0, VehicleEvent::PlanItem(1));
    let early_m = plane.distance_m(at(30.0, 0.0));
    assert!((9_000.0..11_000.0).contains(&early_m), "{early_m} m before the point");
    plane.fly(90.0);
    let cross_track_m = plane.vehicle.navigation().cross_track_m;
    assert!(cross_track_m.abs() < 20.0, "{cross_track_m} m");
}

#[test]
fn the_acceptance_radius_of_an_item_is_flown_into() {
    let acceptance_m = Some(100.0);
    let through = Action::Waypoint { point: point(30.0, 0.0, 5_000.0), acceptance_m };
    let mut plane = Plane::begin(vec![item(through), waypoint(30.0, 60.0, 5_000.0)]);
    plane.fly_until(200.0, VehicleEvent::PlanItem(1));
    assert!(plane.distance_m(at(30.0, 0.0)) < 120.0);
}

#[test]
fn a_jump_is_done_as_often_as_its_count() {
    let items = vec![waypoint(20.0, 0.0, 5_000.0), waypoint(20.0, 40.0, 5_000.0), jump(0, Some(2))];
    let mut plane = Plane::begin(items);
    plane.fly_until(3_000.0, COMPLETE);
    assert_eq!(plane.begun(), [0, 1, 0, 1, 0, 1]);
    // Started again after the end: everything from the beginning.
    plane.events.clear();
    plane.change(Mode::Mission).unwrap();
    plane.fly_until(3_000.0, COMPLETE);
    assert_eq!(plane.begun(), [0, 1, 0, 1, 0, 1]);
}

#[test]
fn jumps_without_an_end_and_without_anything_to_fly_are_refused() {
    let mut plane = Plane::flying();
    let speed = item(Action::ChangeSpeed { airspeed: Airspeed::True(240.0) });
    for items in [
        vec![jump(0, None)],
        vec![speed, jump(0, None)],
        vec![jump(1, None), jump(0, None)],
        // Used up, the first jump leads to the second and that back.
        vec![jump(2, Some(1)), jump(0, None), waypoint(5.0, 0.0, 5_000.0)],
    ] {
        let refused = plane.load(&plan(items)).unwrap_err();
        assert!(matches!(refused, VehicleRefusal::EndlessJump { .. }), "{refused}");
    }
}

#[test]
fn turns_and_time_are_counted_on_the_circle() {
    let turns = Action::LoiterTurns { circle: circle(30.0, 0.0, 5_000.0), turns: 1.5 };
    let mut plane = Plane::begin(vec![item(turns)]);
    plane.fly_until(1_000.0, COMPLETE);
    // To the tangent 28 km, and one and a half times 2 pi 10 km, at 264 m/s.
    let took_s = plane.now.as_seconds();
    assert!((took_s - 464.0).abs() < 15.0, "{took_s} s");

    let time = Action::LoiterTime { circle: circle(30.0, 0.0, 5_000.0), seconds: 100.0 };
    let mut plane = Plane::begin(vec![item(time)]);
    plane.fly_until(1_000.0, COMPLETE);
    let took_s = plane.now.as_seconds();
    assert!((took_s - 207.0).abs() < 15.0, "{took_s} s");
}

#[test]
fn a_circle_that_the_aircraft_cannot_hold_ends_as_well() {
    let turns = Action::LoiterTurns { circle: circle(30.0, 0.0, 5_000.0), turns: 1.0 };
    let mut plane = Plane::begin(vec![item(turns)]);
    (plane.roll_error_rad, plane.rules.navigation.l1_period_s) = (-0.3, 100.0);
    plane.fly_until(2_000.0, COMPLETE);
    let offset = Horizon::at(at(30.0, 0.0)).offset(&Site::at(plane.place));
    // Beside the 10 km of the circle by more than counts as on it.
    assert!((offset.norm() - 10.0e3).abs() > 550.0, "{} m", offset.norm());
}

#[test]
fn a_circle_is_left_towards_the_next_point() {
    let time = Action::LoiterTime { circle: circle(30.0, 0.0, 5_000.0), seconds: 10.0 };
    let mut plane = Plane::begin(vec![item(time), waypoint(30.0, 60.0, 5_000.0)]);
    plane.fly_until(1_000.0, VehicleEvent::PlanItem(1));
    let to_next = target(&plane).bearing_rad;
    let off = libm::remainder(plane.heading - to_next, core::f64::consts::TAU);
    assert!(off.abs() < 0.08, "{off} rad beside the next point");
}

#[test]
fn a_circle_to_an_altitude_is_left_at_it() {
    let climb = Action::LoiterToAltitude(circle(20.0, 0.0, 7_000.0));
    let mut plane = Plane::begin(vec![item(climb)]);
    plane.fly_until(1_000.0, COMPLETE);
    assert!((plane.altitude_m - 7_000.0).abs() < 30.0, "{} m", plane.altitude_m);
}

#[test]
fn a_change_of_altitude_is_flown_straight_ahead() {
    let mut plane = Plane::begin(vec![item(Action::ChangeAltitude { altitude_m: 6_000.0 })]);
    plane.fly_until(200.0, COMPLETE);
    assert!((plane.altitude_m - 6_000.0).abs() < 31.0);
    assert!(plane.heading.abs() < 1.0e-3, "{} rad", plane.heading);
}

#[test]
fn after_a_pause_the_current_item_goes_on_from_where_the_aircraft_is() {
    let mut plane = Plane::begin(vec![waypoint(30.0, 0.0, 5_000.0), waypoint(30.0, 60.0, 5_000.0)]);
    plane.fly_until(200.0, VehicleEvent::PlanItem(1));
    plane.fly(60.0);
    plane.change(Mode::Hold).unwrap();
    plane.fly(200.0);
    assert_eq!(plane.vehicle.navigation().progress, Progress::Paused);
    plane.change(Mode::Mission).unwrap();
    plane.fly(1.0);
    assert_eq!(plane.vehicle.navigation().item, 1);
    plane.fly_until(1_000.0, COMPLETE);
    assert_eq!(plane.reached(), [0, 1]);
}

#[test]
fn time_on_a_circle_counts_on_after_a_pause() {
    let time = Action::LoiterTime { circle: circle(12.0, 10.0, 5_000.0), seconds: 200.0 };
    let mut plane = Plane::begin(vec![item(time)]);
    plane.fly(120.0);
    plane.change(Mode::Hold).unwrap();
    plane.fly(400.0);
    assert!(plane.reached().is_empty());
    plane.change(Mode::Mission).unwrap();
    let resumed_s = plane.now.as_seconds();
    plane.fly_until(600.0, COMPLETE);
    let rest_s = plane.now.as_seconds() - resumed_s;
    assert!(rest_s < 200.0, "{rest_s} s: the first part counts");
}

#[test]
fn an_item_that_does_not_go_on_by_itself_is_circled_until_another_is_chosen() {
    let stop = Item { autocontinue: false, ..waypoint(20.0, 0.0, 5_000.0) };
    let mut plane = Plane::begin(vec![stop, waypoint(60.0, 0.0, 5_000.0)]);
    plane.fly(700.0);
    assert_eq!((plane.vehicle.mode(), plane.reached()), (Mode::Mission, vec![0]));
    assert!((plane.distance_m(at(20.0, 0.0)) - 10_000.0).abs() < 20.0);
    plane.select(1).unwrap();
    plane.fly_until(600.0, COMPLETE);
    assert_eq!(plane.reached(), [0, 1]);
}

#[test]
fn an_item_can_be_chosen_before_and_during_the_mission_and_must_exist() {
    let items = vec![waypoint(30.0, 0.0, 5_000.0), waypoint(60.0, 0.0, 5_000.0)];
    let mut plane = Plane::flying();
    let none = VehicleRefusal::NoSuchItem { item: 0, items: 0 };
    assert_eq!(plane.select(0), Err(none));
    plane.load(&plan(items)).unwrap();
    assert_eq!(plane.select(2), Err(VehicleRefusal::NoSuchItem { item: 2, items: 2 }));
    plane.select(1).unwrap();
    plane.change(Mode::Mission).unwrap();
    plane.fly(1.0);
    assert_eq!(plane.vehicle.navigation().item, 1);
    plane.select(0).unwrap();
    plane.fly(1.0);
    assert_eq!(plane.vehicle.navigation().item, 0);
    assert_eq!(plane.begun(), [1, 1, 0], "chosen, begun, chosen in flight");
}

#[test]
fn mission_without_a_plan_is_refused_and_a_cleared_plan_ends_in_hold() {
    let mut plane = Plane::flying();
    assert_eq!(plane.change(Mode::Mission), Err(VehicleRefusal::NoPlan));
    assert_eq!(plane.vehicle.mode(), Mode::Position);
    plane.load(&plan(vec![waypoint(30.0, 0.0, 5_000.0)])).unwrap();
    plane.change(Mode::Mission).unwrap();
    plane.fly(5.0);
    plane.load(&plan(Vec::new())).unwrap();
    assert_eq!(plane.vehicle.mode(), Mode::Hold);
    plane.fly(1.0);
    assert_eq!(plane.vehicle.navigation().progress, Progress::NoPlan);
}

#[test]
fn a_new_plan_in_flight_begins_with_its_first_item() {
    let mut plane = Plane::begin(vec![waypoint(10.0, 0.0, 5_000.0), waypoint(60.0, 0.0, 5_000.0)]);
    plane.fly_until(100.0, VehicleEvent::PlanItem(1));
    plane.load(&plan(vec![waypoint(40.0, 40.0, 5_000.0)])).unwrap();
    plane.fly(0.1);
    let navigation = plane.vehicle.navigation();
    assert_eq!((navigation.item, navigation.items), (0, 1));
    assert_eq!(target(&plane).place, at(40.0, 40.0));
}

#[test]
fn a_plan_that_cannot_be_flown_is_refused_with_its_item_and_the_old_plan_stays() {
    let mut plane = Plane::flying();
    plane.load(&plan(vec![waypoint(30.0, 0.0, 5_000.0)])).unwrap();
    let good = waypoint(10.0, 0.0, 5_000.0);
    let north_of_the_pole = Place { latitude_rad: 2.0, longitude_rad: 0.0 };
    let nowhere = Point { place: Some(north_of_the_pole), altitude_m: None };
    let around = circle(0.0, 0.0, 5_000.0);
    for bad in [
        Action::Waypoint { point: point(0.0, 0.0, 20_000.0), acceptance_m: None },
        Action::Waypoint { point: point(0.0, 0.0, f64::NAN), acceptance_m: None },
        Action::Waypoint { point: nowhere, acceptance_m: None },
        Action::Waypoint { point: point(0.0, 0.0, 5_000.0), acceptance_m: Some(-1.0) },
        Action::ChangeSpeed { airspeed: Airspeed::Calibrated(100.0) },
        Action::ChangeAltitude { altitude_m: f64::INFINITY },
        Action::LoiterTurns { circle: around, turns: f64::NAN },
        Action::LoiterTime { circle: around, seconds: -1.0 },
        Action::LoiterUnlimited(Circle { radius_m: Some(0.0), ..around }),
    ] {
        let refused = plane.load(&plan(vec![good, item(bad)])).unwrap_err();
        assert!(matches!(refused, VehicleRefusal::ItemOutOfRange { item: 1, .. }), "{refused}");
        assert!(refused.to_string().starts_with("item 1: "), "{refused}");
    }
    let lost = plane.load(&plan(vec![good, jump(2, None)])).unwrap_err();
    assert_eq!(lost, VehicleRefusal::NoSuchItem { item: 2, items: 2 });
    let long = plane.load(&plan(vec![good; 1_001])).unwrap_err();
    assert!(matches!(long, VehicleRefusal::PlanTooLong { items: 1_001, max: 1_000 }));
    plane.fly(0.1);
    assert_eq!(plane.vehicle.navigation().items, 1, "the plan before");
}

#[test]
fn return_as_an_item_flies_home_and_completes_the_plan() {
    let mut plane = Plane::begin(vec![waypoint(20.0, 0.0, 6_000.0), item(Action::Return)]);
    plane.fly_until(300.0, COMPLETE);
    assert_eq!(plane.vehicle.mode(), Mode::Return);
    assert_eq!(plane.demand().altitude_m, plane.rules.navigation.return_altitude_m);
    plane.fly(600.0);
    assert!((plane.distance_m(start()) - 10_000.0).abs() < 20.0);
}

#[test]
fn an_altitude_of_the_operator_holds_until_the_next_item_that_sets_one() {
    let mut plane = Plane::begin(vec![waypoint(30.0, 0.0, 6_000.0), waypoint(60.0, 0.0, 6_500.0)]);
    plane.fly(20.0);
    plane.vehicle.refer(Reference::Altitude(4_500.0), &rules()).unwrap();
    plane.fly(50.0);
    assert_eq!(plane.demand().altitude_m, 4_500.0);
    plane.fly_until(200.0, COMPLETE);
    assert_eq!(plane.demand().altitude_m, 6_500.0);
}

#[test]
fn points_at_the_same_place_and_items_without_a_place_do_not_hold_the_plan_up() {
    let here =
        Action::Waypoint { point: Point { place: None, altitude_m: None }, acceptance_m: None };
    let twice = waypoint(20.0, 0.0, 5_000.0);
    let mut plane = Plane::begin(vec![item(here), twice, twice, twice]);
    plane.fly_until(300.0, COMPLETE);
    assert_eq!(plane.reached(), [0, 1, 2, 3]);
}

#[test]
fn a_new_flight_keeps_the_plan_and_restarts_it() {
    let mut plane = Plane::begin(vec![waypoint(5.0, 0.0, 5_000.0), waypoint(60.0, 0.0, 5_000.0)]);
    plane.fly_until(100.0, VehicleEvent::PlanItem(1));
    plane.vehicle.begin_flight();
    plane.fly(0.1);
    let navigation = plane.vehicle.navigation();
    assert_eq!(plane.vehicle.mode(), Mode::Position);
    assert_eq!((navigation.item, navigation.items), (0, 2));
    assert_eq!(navigation.progress, Progress::NotStarted);
}

#[test]
fn a_takeoff_in_the_air_climbs_straight_ahead_to_its_altitude_and_never_descends() {
    let climb = item(Action::Takeoff { altitude_m: 5_600.0 });
    let mut plane = Plane::begin(vec![climb, waypoint(0.0, 60.0, 5_600.0)]);
    plane.fly_until(60.0, VehicleEvent::PlanItem(1));
    assert!((plane.altitude_m - 5_600.0).abs() < 31.0, "{} m", plane.altitude_m);
    assert!(plane.heading.abs() < 1.0e-3, "{} rad", plane.heading);
    let mut plane = Plane::begin(vec![item(Action::Takeoff { altitude_m: 50.0 })]);
    plane.fly_until(1.0, COMPLETE);
    assert_eq!(plane.demand().altitude_m, 5_000.0);
}

#[test]
fn items_below_the_limit_are_flown_beside_a_takeoff_or_a_landing_only() {
    let land = item(Action::Land { place: at(60.0, 0.0), altitude_m: 0.0, abort_m: None });
    let takeoff = item(Action::Takeoff { altitude_m: 100.0 });
    let (low, high) = (waypoint(20.0, 0.0, 200.0), waypoint(30.0, 0.0, 5_000.0));
    let mut plane = Plane::flying();
    for good in [vec![takeoff, low, high], vec![high, low, low, land], vec![takeoff, low, land]] {
        plane.load(&plan(good)).unwrap();
    }
    for bad in [vec![low, high], vec![takeoff, high, low, high, land], vec![high, low]] {
        let refused = plane.load(&plan(bad)).unwrap_err();
        assert!(refused.to_string().contains("altitude 200.0 m is outside"), "{refused}");
    }
}

#[test]
fn a_landing_glides_along_its_line_and_flares() {
    let land = item(Action::Land { place: at(60.0, 0.0), altitude_m: 0.0, abort_m: None });
    let mut plane = Plane::begin(vec![waypoint(20.0, 0.0, 600.0), land]);
    plane.fly_until(400.0, VehicleEvent::PlanItem(1));
    while plane.altitude_m > 300.0 {
        plane.tick();
    }
    let left_m = plane.distance_m(at(60.0, 0.0));
    assert!((left_m - 300.0 / libm::tan(3_f64.to_radians())).abs() < 3_000.0, "{left_m} m");
    while plane.altitude_m > 0.0 {
        plane.tick();
    }
    assert!((-2.0..-0.1).contains(&plane.climb_m_s), "{} m/s", plane.climb_m_s);
    assert!(plane.vehicle.navigation().cross_track_m.abs() < 5.0);
    plane.vehicle.touch_down(&mut |kind| plane.events.push(kind));
    assert!(plane.events.ends_with(&[VehicleEvent::ItemReached(1), COMPLETE]));
}

#[test]
fn a_go_around_climbs_straight_ahead_and_flies_the_landing_again() {
    let land = item(Action::Land { place: at(60.0, 0.0), altitude_m: 0.0, abort_m: None });
    let items = vec![item(Action::LandStart), waypoint(20.0, 0.0, 600.0), land];
    let mut plane = Plane::begin(items);
    let rules = plane.rules;
    assert_eq!(plane.vehicle.go_around(None, &rules), Err(VehicleRefusal::NoApproach));
    plane.fly_until(600.0, VehicleEvent::PlanItem(2));
    while plane.altitude_m > 100.0 {
        plane.tick();
    }
    plane.events.clear();
    plane.vehicle.go_around(None, &rules).unwrap();
    plane.fly_until(60.0, VehicleEvent::PlanItem(1));
    assert!((plane.altitude_m - 600.0).abs() < 31.0, "{} m", plane.altitude_m);
    assert_eq!(plane.begun(), [0, 1]);
}

#[test]
fn a_command_to_land_leaves_an_endless_loop() {
    let land = item(Action::Land { place: at(60.0, 0.0), altitude_m: 0.0, abort_m: None });
    let mut plane = Plane::begin(vec![
        waypoint(10.0, 0.0, 5_000.0),
        waypoint(30.0, 0.0, 5_000.0),
        jump(0, None),
        item(Action::LandStart),
        waypoint(20.0, 0.0, 600.0),
        land,
    ]);
    plane.fly(200.0);
    let rules = plane.rules;
    plane.vehicle.land(&rules, &mut |_| {}).unwrap();
    plane.fly(1.0);
    assert_eq!(plane.vehicle.navigation().item, 4);
    plane
        .load(&plan(vec![waypoint(10.0, 0.0, 5_000.0), waypoint(20.0, 0.0, 600.0), land]))
        .unwrap();
    plane.vehicle.land(&rules, &mut |_| {}).unwrap();
    plane.fly(0.1);
    assert_eq!(plane.vehicle.navigation().item, 1, "the point before");
    plane.load(&plan(vec![waypoint(10.0, 0.0, 5_000.0)])).unwrap();
    assert_eq!(plane.vehicle.land(&rules, &mut |_| {}), Err(VehicleRefusal::NoLanding));
}

#[test]
fn items_behind_a_condition_wait_for_it_while_the_aircraft_flies_on() {
    let speed = item(Action::ChangeSpeed { airspeed: Airspeed::True(240.0) });
    let home = item(Action::SetHome { place: None });
    for (until, left_km) in
        [(WaitCondition::Seconds(50.0), 46.8), (WaitCondition::Within(20_000.0), 20.0)]
    {
        let plan = vec![item(Action::Wait(until)), speed, home, waypoint(60.0, 0.0, 5_000.0)];
        let mut plane = Plane::begin(plan);
        plane.fly(1.0);
        assert_eq!(plane.vehicle.navigation().item, 3);
        assert_eq!(plane.demand().airspeed_m_s, 264.0);
        while plane.demand().airspeed_m_s > 240.0 {
            plane.tick();
        }
        let left_m = plane.distance_m(at(60.0, 0.0));
        assert!((left_m - 1.0e3 * left_km).abs() < 300.0, "{left_m} m");
        let home = plane.vehicle.navigation().home.unwrap();
        assert!(plane.distance_m(home) < 300.0);
    }
    let mut plane = Plane::begin(vec![
        item(Action::Wait(WaitCondition::Seconds(1_000.0))),
        speed,
        waypoint(20.0, 0.0, 5_000.0),
    ]);
    plane.fly_until(200.0, COMPLETE);
    plane.fly(1_000.0);
    assert_eq!(plane.demand().airspeed_m_s, 264.0, "the point came first");
}

#[test]
fn an_item_without_its_equipment_is_reported_once_however_often_it_is_passed() {
    let items =
        vec![item(Action::Pass), waypoint(20.0, 0.0, 5_000.0), waypoint(20.0, 40.0, 5_000.0)];
    let mut plane = Plane::begin([items, vec![jump(0, Some(2))]].concat());
    plane.fly_until(3_000.0, COMPLETE);
    let passed = plane.events.iter().filter(|kind| **kind == VehicleEvent::ItemPassed(0)).count();
    assert_eq!(passed, 1);
}
