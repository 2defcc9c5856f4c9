//! Position: what it holds, what replaces the course, and a pilot's sticks in it.

use super::plane::Plane;
use super::*;

fn sticks(roll: f64, climb: f64, throttle: Option<f64>) -> Sticks {
    Sticks { roll, climb, throttle }
}

fn take(plane: &mut Plane, roll: f64, climb: f64, throttle: Option<f64>) {
    plane.vehicle.take_sticks(sticks(roll, climb, throttle)).unwrap();
}

fn course_rad(plane: &Plane) -> Option<f64> {
    plane.vehicle.navigation().course_rad
}

#[test]
fn a_flight_begins_in_it_and_holds_altitude_course_and_speed_against_a_disturbance() {
    let mut plane = Plane::flying();
    assert_eq!(plane.vehicle.mode(), Mode::Position);
    plane.heading = 0.4;
    plane.altitude_m = 4_950.0;
    plane.airspeed_m_s = 250.0;
    plane.fly(120.0);
    assert!(plane.heading.abs() < 1.0e-3, "back to north: {} rad", plane.heading);
    assert!((plane.altitude_m - 5_000.0).abs() < 1.0, "{} m", plane.altitude_m);
    assert!((plane.airspeed_m_s - 264.0).abs() < 0.1, "{} m/s", plane.airspeed_m_s);
}

#[test]
fn a_roll_reference_of_zero_replaces_the_course_and_the_laws_get_what_was_given() {
    let mut plane = Plane::flying();
    plane.vehicle.refer(Reference::Roll(0.0), &rules()).unwrap();
    plane.vehicle.refer(Reference::Altitude(6_000.0), &rules()).unwrap();
    plane.heading = 0.4;
    plane.fly(10.0);
    assert_eq!((plane.heading, course_rad(&plane)), (0.4, None), "nothing turns it back");
    let state = plane.state();
    let demand = plane.vehicle.track(&state, &plane.rules, &Powerplant::default(), &mut |_| {});
    assert_eq!(demand, plane.demand(), "the altitude too");
    plane.vehicle.refer(Reference::Course(0.0), &rules()).unwrap();
    plane.fly(60.0);
    assert!(plane.heading.abs() < 1.0e-3, "{} rad", plane.heading);
}

#[test]
fn a_schedule_without_a_roll_angle_leaves_the_course_and_one_of_zero_does_not() {
    for (text, held) in [
        ("[[autopilot.reference]]\nat_s = 0.0\naltitude_m = 5200.0\n", true),
        ("[[autopilot.reference]]\nat_s = 0.0\nroll_deg = 0.0\n", false),
    ] {
        let mut plane = Plane::flying();
        plane.vehicle = Vehicle::new(configuration::references("s.toml", text).unwrap());
        plane.tick();
        assert_eq!(course_rad(&plane).is_some(), held, "{text}");
    }
}

#[test]
fn out_of_a_turn_it_levels_the_wings_first_and_takes_the_course_then() {
    let mut plane = Plane::flying();
    plane.vehicle.refer(Reference::Roll(0.7), &rules()).unwrap();
    plane.fly(20.0);
    let turning = plane.heading;
    plane.change(Mode::Position).unwrap();
    plane.tick();
    let roll = plane.demand().roll_rad;
    assert!((0.6..0.7).contains(&roll), "no faster than the guidance: {roll} rad");
    let mut lowest = roll;
    for _ in 0..600 {
        plane.tick();
        lowest = lowest.min(plane.demand().roll_rad);
    }
    assert!(plane.heading > turning + 0.02, "it turned on while it rolled out");
    assert!(lowest > -0.01, "and not back: {lowest} rad");
    assert_eq!(
        course_rad(&plane).map(|course| (course - plane.heading).abs() < 1.0e-3),
        Some(true)
    );
}

#[test]
fn wings_that_a_fault_keeps_from_being_level_do_not_keep_the_course_from_being_held() {
    let mut plane = Plane::flying();
    plane.change(Mode::Position).unwrap();
    // The aircraft stays banked by 20 deg, whatever the reference.
    let tick = |plane: &mut Plane| {
        plane.roll = 0.35;
        plane.heading += 0.001;
        let state = plane.state();
        plane.vehicle.track(&state, &plane.rules, &Powerplant::default(), &mut |_| {});
        plane.now = SimTime::from_micros(plane.now.as_micros() + 50_000);
    };
    for _ in 0..59 {
        tick(&mut plane);
    }
    assert_eq!(plane.demand().roll_rad, 0.0, "not yet");
    for _ in 0..10 {
        tick(&mut plane);
    }
    assert!(plane.demand().roll_rad < 0.0, "against the turn: {}", plane.demand().roll_rad);
}

#[test]
fn the_roll_stick_banks_and_centred_holds_the_course_that_it_has_led_to() {
    let mut plane = Plane::flying();
    take(&mut plane, 0.5, 0.0, None);
    plane.fly(30.0);
    assert!((plane.demand().roll_rad - 22.5_f64.to_radians()).abs() < 1.0e-12);
    let left_at = plane.heading;
    assert!(left_at > 0.3, "it turns: {left_at} rad");
    // A joystick is never exactly centred.
    take(&mut plane, 0.02, -0.03, None);
    plane.fly(5.0);
    let taken = course_rad(&plane).unwrap();
    assert!((left_at..left_at + 0.1).contains(&taken), "{taken} rad");
    plane.heading = taken - 0.2;
    plane.fly(60.0);
    assert!((plane.heading - taken).abs() < 1.0e-3, "{} rad", plane.heading);
    assert!((plane.altitude_m - 5_000.0).abs() < 1.0, "{} m", plane.altitude_m);
}

#[test]
fn the_pitch_stick_climbs_and_centred_holds_the_altitude() {
    let mut plane = Plane::flying();
    take(&mut plane, 0.0, 0.5, None);
    plane.fly(60.0);
    assert!((plane.climb_m_s - 15.0).abs() < 1.0, "half of NAV_CLIMB_MAX: {} m/s", plane.climb_m_s);
    let left_at = plane.altitude_m;
    take(&mut plane, 0.0, 0.0, None);
    plane.fly(100.0);
    assert!((plane.altitude_m - left_at).abs() < 60.0, "{} m", plane.altitude_m - left_at);
    assert!(plane.climb_m_s.abs() < 0.1, "{} m/s", plane.climb_m_s);
}

#[test]
fn a_throttle_stick_sets_the_airspeed_when_it_moves_and_leaves_a_reference_alone_when_it_rests() {
    let mut plane = Plane::flying();
    let [slowest_m_s, fastest_m_s] = rules().limits.airspeeds_m_s(plane.demand().altitude_m);
    take(&mut plane, 0.0, 0.0, Some(0.5));
    plane.tick();
    let middle = slowest_m_s + 0.5 * (fastest_m_s - slowest_m_s);
    assert_eq!(plane.demand().airspeed_m_s, middle);
    plane.vehicle.refer(Reference::Airspeed(250.0), &rules()).unwrap();
    take(&mut plane, 0.0, 0.0, Some(0.505));
    plane.tick();
    assert_eq!(plane.demand().airspeed_m_s, 250.0, "the stick rests");
    take(&mut plane, 0.0, 0.0, Some(1.0));
    plane.tick();
    assert_eq!(plane.demand().airspeed_m_s, fastest_m_s);
}

#[test]
fn references_are_followed_while_the_sticks_are_centred() {
    let mut plane = Plane::flying();
    take(&mut plane, 0.0, 0.0, None);
    plane.vehicle.refer(Reference::Altitude(5_300.0), &rules()).unwrap();
    plane.vehicle.refer(Reference::Roll(0.3), &rules()).unwrap();
    plane.fly(60.0);
    assert!((plane.altitude_m - 5_300.0).abs() < 5.0, "{} m", plane.altitude_m);
    assert_eq!(plane.demand().roll_rad, 0.3);
}

#[test]
fn sticks_beyond_their_stops_are_refused() {
    let mut plane = Plane::flying();
    let before = plane.demand();
    for bad in [
        sticks(f64::NAN, 0.0, None),
        sticks(0.0, 1.5, None),
        sticks(0.0, 0.0, Some(-0.1)),
        sticks(0.0, 0.0, Some(f64::NAN)),
    ] {
        assert!(plane.vehicle.take_sticks(bad).is_err(), "{bad:?}");
    }
    plane.tick();
    assert_eq!(plane.demand(), before);
}
