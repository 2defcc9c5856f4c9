use super::plane::{Plane, at, plan, start, waypoint};
use super::*;
use crate::vehicle::VehicleEvent;

fn reposition(plane: &mut Plane, wanted: &Reposition) -> Result<(), VehicleRefusal> {
    let events = &mut plane.events;
    plane.vehicle.reposition(wanted, &plane.rules, &mut |kind| events.push(kind))
}

fn lose(plane: &mut Plane, action: LinkLossAction) {
    let events = &mut plane.events;
    plane.vehicle.lose_link(action, &plane.rules, &mut |kind| events.push(kind));
}

fn regain(plane: &mut Plane) {
    let events = &mut plane.events;
    plane.vehicle.regain_link(&plane.rules, &mut |kind| events.push(kind));
}

fn set(plane: &mut Plane, setpoint: Setpoint) -> Result<(), VehicleRefusal> {
    plane.vehicle.take_setpoint(setpoint, &plane.rules)
}

#[test]
fn hold_circles_to_the_right_on_a_circle_that_the_track_touches() {
    let mut plane = Plane::flying();
    plane.fly(10.0);
    plane.change(Mode::Hold).unwrap();
    plane.tick();
    let target = plane.vehicle.navigation().target.unwrap();
    assert_eq!(target.radius_m, Some(10_000.0));
    assert!((target.bearing_rad - 1.518).abs() < 0.01, "abeam: {} rad", target.bearing_rad);
    let mut farthest = 0.0_f64;
    for _ in 0..600 {
        plane.fly(1.0);
        farthest = farthest.max((plane.distance_m(target.place) - 10_000.0).abs());
    }
    assert!(farthest < 150.0, "{farthest} m off the circle at the worst");
}

#[test]
fn a_new_position_needs_hold_or_the_flag() {
    let mut plane = Plane::flying();
    let there = Reposition { place: Some(at(20.0, 20.0)), ..Reposition::default() };
    assert_eq!(reposition(&mut plane, &there), Err(VehicleRefusal::NotHold));
    assert_eq!(plane.vehicle.mode(), Mode::Position);
    let wanted = Reposition {
        altitude_m: Some(6_000.0),
        airspeed_m_s: Some(250.0),
        radius_m: Some(12_000.0),
        clockwise: Some(false),
        change_mode: true,
        ..there
    };
    reposition(&mut plane, &wanted).unwrap();
    assert_eq!(plane.events, [VehicleEvent::Mode(Mode::Hold)]);
    plane.fly(700.0);
    assert!((plane.distance_m(at(20.0, 20.0)) - 12_000.0).abs() < 10.0);
    assert!((plane.altitude_m - 6_000.0).abs() < 10.0);
    assert!(plane.roll < 0.0, "to the left");
    // Values not named stay.
    reposition(&mut plane, &Reposition { altitude_m: Some(5_000.0), ..Reposition::default() })
        .unwrap();
    plane.fly(200.0);
    assert!((plane.distance_m(at(20.0, 20.0)) - 12_000.0).abs() < 10.0);
}

#[test]
fn a_position_that_cannot_be_changes_nothing() {
    let mut plane = Plane::flying();
    let nowhere = Place { latitude_rad: f64::NAN, longitude_rad: 0.0 };
    let good = Reposition { change_mode: true, ..Reposition::default() };
    for bad in [
        Reposition { place: Some(nowhere), ..good },
        Reposition { altitude_m: Some(50_000.0), ..good },
        Reposition { airspeed_m_s: Some(f64::NAN), ..good },
        Reposition { radius_m: Some(-5.0), ..good },
        Reposition { radius_m: Some(f64::INFINITY), ..good },
    ] {
        let before = plane.demand();
        assert!(reposition(&mut plane, &bad).is_err(), "{bad:?}");
        assert_eq!((plane.vehicle.mode(), plane.demand()), (Mode::Position, before));
    }
}

#[test]
fn a_radius_that_is_too_small_is_flown_as_the_smallest_that_can_be() {
    let mut plane = Plane::flying();
    let wanted = Reposition { radius_m: Some(80.0), change_mode: true, ..Reposition::default() };
    reposition(&mut plane, &wanted).unwrap();
    plane.fly(300.0);
    let radius_m = plane.vehicle.navigation().target.unwrap().radius_m.unwrap();
    // 1.1 * 264² / g at 45 deg of bank.
    assert!((radius_m - 7_818.0).abs() < 5.0, "{radius_m} m");
    assert!(plane.vehicle.navigation().cross_track_m.abs() < 20.0);
}

#[test]
fn return_flies_home_at_its_altitude_and_home_can_be_moved() {
    let mut plane = Plane::flying();
    plane.fly(100.0);
    plane.rules.navigation.return_altitude_m = 20_000.0;
    plane.change(Mode::Return).unwrap();
    assert_eq!(plane.demand().altitude_m, 12_000.0, "no higher than references may be");
    plane.fly(600.0);
    assert!((plane.distance_m(start()) - 10_000.0).abs() < 20.0);
    plane.vehicle.set_home(at(0.0, 50.0), &mut |_| {}).unwrap();
    plane.fly(900.0);
    assert!((plane.distance_m(at(0.0, 50.0)) - 10_000.0).abs() < 20.0);
    assert_eq!(plane.vehicle.navigation().home, Some(at(0.0, 50.0)));
    let refused = plane.vehicle.refer(Reference::Altitude(5_000.0), &rules());
    assert_eq!(refused, Err(VehicleRefusal::AltitudeIsTaken(Mode::Return)));
}

#[test]
fn a_course_is_held_in_position_until_the_mode_is_chosen_again() {
    let mut plane = Plane::flying();
    plane.vehicle.refer(Reference::Course(1.0), &rules()).unwrap();
    plane.fly(120.0);
    assert!((plane.heading - 1.0).abs() < 1.0e-3, "{} rad", plane.heading);
    plane.vehicle.refer(Reference::Course(2.0), &rules()).unwrap();
    plane.fly(5.0);
    plane.change(Mode::Position).unwrap();
    plane.fly(60.0);
    let course_rad = plane.vehicle.navigation().course_rad.unwrap();
    assert!((1.1..1.6).contains(&course_rad), "that of the moment: {course_rad} rad");
    assert!((plane.heading - course_rad).abs() < 1.0e-3, "{} rad", plane.heading);
    plane.change(Mode::Hold).unwrap();
    let refused = plane.vehicle.refer(Reference::Course(1.0), &rules());
    assert_eq!(refused, Err(VehicleRefusal::NoCourseHere));
}

#[test]
fn a_scheduled_roll_angle_ends_a_course() {
    let text = "[[autopilot.reference]]\nat_s = 5.0\nroll_deg = 15.0\n";
    let mut plane = Plane::flying();
    plane.vehicle = Vehicle::new(configuration::references("s.toml", text).unwrap());
    plane.tick();
    plane.vehicle.refer(Reference::Course(0.5), &rules()).unwrap();
    plane.fly(6.0);
    assert_eq!(plane.demand().roll_rad, 15.0_f64.to_radians());
}

#[test]
fn setpoints_need_offboard_and_are_checked() {
    let mut plane = Plane::flying();
    let there = Setpoint::Position { place: at(20.0, 0.0), altitude_m: Some(5_500.0) };
    assert_eq!(set(&mut plane, there), Err(VehicleRefusal::NotOffboard));
    plane.change(Mode::Offboard).unwrap();
    let before = plane.demand();
    for bad in [
        Setpoint::Roll(1.5),
        Setpoint::Roll(f64::NAN),
        Setpoint::Position { place: at(0.0, 0.0), altitude_m: Some(100.0) },
        Setpoint::LocalPosition(icd::Ned::new(f64::NAN, 0.0, -5_000.0)),
        Setpoint::LocalPosition(icd::Ned::new(0.0, 0.0, 5_000.0)),
        Setpoint::Velocity { course_rad: Some(f64::NAN), speed_m_s: None, climb_m_s: 0.0 },
        Setpoint::Velocity { course_rad: None, speed_m_s: None, climb_m_s: f64::INFINITY },
    ] {
        assert!(set(&mut plane, bad).is_err(), "{bad:?}");
    }
    plane.tick();
    assert_eq!(plane.demand(), before);
    set(&mut plane, there).unwrap();
    plane.fly(600.0);
    assert!((plane.distance_m(at(20.0, 0.0)) - 10_000.0).abs() < 20.0);
}

#[test]
fn a_local_position_is_a_place_in_the_axes_of_the_flight() {
    let mut plane = Plane::flying();
    plane.change(Mode::Offboard).unwrap();
    set(&mut plane, Setpoint::LocalPosition(icd::Ned::new(20_000.0, 10_000.0, -6_000.0))).unwrap();
    plane.tick();
    let place = plane.vehicle.navigation().target.unwrap().place;
    let off_m = plane.distance_m(place) - plane.distance_m(at(20.0, 10.0));
    assert!(off_m.abs() < 30.0, "{off_m} m");
    // 39 m: the plane of the local axes leaves the Earth behind.
    assert!((plane.demand().altitude_m - 6_039.0).abs() < 2.0, "{:?}", plane.demand());
}

#[test]
fn a_velocity_is_flown_as_course_speed_and_climb_within_the_limits() {
    let mut plane = Plane::flying();
    plane.change(Mode::Offboard).unwrap();
    let velocity =
        Setpoint::Velocity { course_rad: Some(-1.0), speed_m_s: Some(900.0), climb_m_s: 5.0 };
    let [_, fastest_m_s] = rules().limits.airspeeds_m_s(plane.demand().altitude_m);
    set(&mut plane, velocity).unwrap();
    plane.fly(100.0);
    assert_eq!(plane.demand().airspeed_m_s, fastest_m_s);
    assert!((plane.heading + 1.0).abs() < 0.01, "{} rad", plane.heading);
    assert!((plane.climb_m_s - 5.0).abs() < 0.2, "{} m/s", plane.climb_m_s);
    let level = Setpoint::Velocity { course_rad: None, speed_m_s: None, climb_m_s: 0.0 };
    set(&mut plane, level).unwrap();
    plane.tick();
    let levelled_at = plane.altitude_m;
    plane.fly(100.0);
    assert!((plane.altitude_m - levelled_at).abs() < 30.0, "levels off");
    assert!((plane.heading + 1.0).abs() < 0.01, "the course stays");
}

#[test]
fn sticks_need_a_mode_for_pilots_and_give_roll_climb_and_airspeed() {
    let mut plane = Plane::flying();
    let sticks = Sticks { roll: -0.5, climb: 1.0, throttle: Some(1.0) };
    plane.change(Mode::Hold).unwrap();
    assert_eq!(plane.vehicle.take_sticks(sticks), Err(VehicleRefusal::NotPiloted));
    plane.change(Mode::Altitude).unwrap();
    for bad in [
        Sticks { roll: f64::NAN, ..sticks },
        Sticks { climb: 1.5, ..sticks },
        Sticks { throttle: Some(-0.1), ..sticks },
    ] {
        assert!(plane.vehicle.take_sticks(bad).is_err(), "{bad:?}");
    }
    plane.vehicle.take_sticks(sticks).unwrap();
    plane.fly(60.0);
    let demand = plane.demand();
    assert!((demand.roll_rad + 22.5_f64.to_radians()).abs() < 1.0e-12);
    assert_eq!(demand.airspeed_m_s, rules().limits.airspeeds_m_s(demand.altitude_m)[1]);
    assert!((plane.climb_m_s - 30.0).abs() < 1.0, "{} m/s", plane.climb_m_s);
    plane.fly(600.0);
    assert!(plane.demand().altitude_m <= 12_000.0, "not beyond the limit");
}

#[test]
fn the_mode_after_a_link_loss_is_undone_when_the_link_is_back() {
    let mut plane = Plane::flying();
    plane.load(&plan(vec![waypoint(90.0, 0.0, 5_000.0)])).unwrap();
    for (before, action, during, after) in [
        (Mode::Position, LinkLossAction::Continue, Mode::Position, Mode::Position),
        (Mode::Mission, LinkLossAction::Hold, Mode::Hold, Mode::Mission),
        (Mode::Mission, LinkLossAction::Return, Mode::Return, Mode::Mission),
        (Mode::Hold, LinkLossAction::Hold, Mode::Hold, Mode::Hold),
        (Mode::Offboard, LinkLossAction::Return, Mode::Return, Mode::Hold),
        (Mode::Altitude, LinkLossAction::Hold, Mode::Hold, Mode::Hold),
    ] {
        plane.change(before).unwrap();
        plane.fly(1.0);
        plane.events.clear();
        lose(&mut plane, action);
        lose(&mut plane, action);
        plane.fly(1.0);
        assert_eq!(plane.vehicle.mode(), during);
        regain(&mut plane);
        regain(&mut plane);
        assert_eq!(plane.vehicle.mode(), after);
        let published = |kind| plane.events.iter().filter(|event| **event == kind).count();
        assert_eq!(published(VehicleEvent::LinkLost(action)), 1, "published once");
        assert_eq!(published(VehicleEvent::LinkBack(after)), 1, "published once");
    }
}

#[test]
fn a_mode_chosen_while_the_link_was_lost_stays() {
    let mut plane = Plane::flying();
    lose(&mut plane, LinkLossAction::Return);
    plane.change(Mode::Hold).unwrap();
    regain(&mut plane);
    assert_eq!(plane.vehicle.mode(), Mode::Hold);
    assert_eq!(plane.events.last(), Some(&VehicleEvent::LinkBack(Mode::Hold)));
}

#[test]
fn a_terminated_flight_obeys_no_command_until_the_next_one() {
    let mut plane = Plane::flying();
    plane.change(Mode::Hold).unwrap();
    for _ in 0..2 {
        let events = &mut plane.events;
        plane.vehicle.terminate(&mut |kind| events.push(kind));
    }
    let published = plane.events.iter().filter(|kind| **kind == VehicleEvent::Terminated).count();
    assert_eq!(published, 1, "published once");
    assert_eq!(plane.change(Mode::Return), Err(VehicleRefusal::Terminated));
    let refused = plane.vehicle.refer(Reference::Altitude(5_000.0), &rules());
    assert_eq!(refused, Err(VehicleRefusal::Terminated));
    lose(&mut plane, LinkLossAction::Return);
    regain(&mut plane);
    assert_eq!(plane.vehicle.mode(), Mode::Hold);
    plane.vehicle.begin_flight();
    assert!(!plane.vehicle.is_terminated());
    plane.tick();
    plane.change(Mode::Hold).unwrap();
}
