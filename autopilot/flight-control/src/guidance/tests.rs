use super::*;
use icd::units::STANDARD_GRAVITY_M_S2;
use proptest::prelude::*;

const GAINS: GuidanceGains =
    GuidanceGains { period_s: 25.0, damping: 0.75, bank_max_rad: core::f64::consts::FRAC_PI_4 };
const DT_S: f64 = 0.02;
/// Largest roll rate of the simulated aircraft, rad/s (20 deg/s).
const ROLL_RATE_RAD_S: f64 = 0.35;
/// Time constant of its roll angle, s.
const ROLL_LAG_S: f64 = 0.6;

/// A point that turns by its bank angle in a steady wind.
struct Point {
    at: Horizontal,
    heading: f64,
    bank: f64,
    airspeed: f64,
    wind: Horizontal,
}

impl Point {
    fn new(north: f64, east: f64, heading_deg: f64) -> Self {
        Self {
            at: Horizontal::new(north, east),
            heading: heading_deg.to_radians(),
            bank: 0.0,
            airspeed: 264.0,
            wind: Horizontal::zeros(),
        }
    }

    fn velocity(&self) -> Horizontal {
        let (sin, cos) = libm::sincos(self.heading);
        Horizontal::new(cos, sin) * self.airspeed + self.wind
    }

    /// Flies for a time; the largest and the last distance from the path after `settle_s`.
    fn fly(
        &mut self,
        duration_s: f64,
        settle_s: f64,
        law: &mut dyn FnMut(&Self) -> Steering,
    ) -> (f64, f64) {
        let (mut worst, mut last, mut t) = (0.0_f64, 0.0, 0.0);
        while t < duration_s {
            let steering = law(self);
            let error = (steering.bank_rad - self.bank) / ROLL_LAG_S;
            self.bank += error.clamp(-ROLL_RATE_RAD_S, ROLL_RATE_RAD_S) * DT_S;
            self.heading += STANDARD_GRAVITY_M_S2 * libm::tan(self.bank) / self.airspeed * DT_S;
            self.at += self.velocity() * DT_S;
            t += DT_S;
            last = steering.cross_track_m.abs();
            if t > settle_s {
                worst = worst.max(last);
            }
        }
        (worst, last)
    }
}

/// North along the meridian through the origin.
fn northwards(point: &Point) -> Steering {
    let a = Horizontal::new(0.0, 0.0) - point.at;
    let b = Horizontal::new(50_000.0, 0.0) - point.at;
    follow_line(&a, &b, &point.velocity(), &GAINS)
}

fn around(point: &Point, radius_m: f64, clockwise: bool) -> Steering {
    follow_circle(&-point.at, radius_m, clockwise, &point.velocity(), &GAINS)
}

#[test]
fn the_look_ahead_of_the_paper_comes_out_at_its_damping() {
    // Park: K = 2 at a damping of 0.707, natural frequency √2 V / L1.
    let gains = GuidanceGains { damping: core::f64::consts::FRAC_1_SQRT_2, ..GAINS };
    let omega = core::f64::consts::SQRT_2 * 264.0 / gains.look_ahead_m(264.0);
    assert!((2.0 * core::f64::consts::PI / omega - 25.0).abs() < 1.0e-9);
}

#[test]
fn a_line_is_captured_from_both_sides_from_far_away_from_behind_and_from_the_wrong_direction() {
    for north in [-30_000.0, 0.0, 10_000.0] {
        for east in [-40_000.0, -9_000.0, -2_000.0, 0.0, 300.0, 5_000.0, 20_000.0] {
            for heading_deg in [0.0, 45.0, 90.0, 135.0, 180.0, -90.0] {
                let mut point = Point::new(north, east, heading_deg);
                let (_, last) = point.fly(400.0, 0.0, &mut northwards);
                assert!(last < 1.0, "from {north} {east} at {heading_deg} deg: {last} m off");
            }
        }
    }
}

#[test]
fn the_approach_of_a_line_does_not_overshoot_by_more_than_a_roll_in() {
    for east in [3_000.0, 10_000.0, 30_000.0] {
        let mut point = Point::new(0.0, east, 0.0);
        let mut most = 0.0_f64;
        point.fly(400.0, 0.0, &mut |point| {
            let steering = northwards(point);
            most = most.max(-steering.cross_track_m);
            steering
        });
        // 60 deg at 264 m/s cross the line with 230 m/s; half a second of roll-in is 115 m.
        assert!(most < 120.0, "from {east} m: {most} m beyond the line");
    }
}

#[test]
fn a_line_is_held_in_a_strong_wind_from_any_side() {
    for towards_deg in [0.0_f64, 60.0, 90.0, 150.0, 180.0, 270.0] {
        let (sin, cos) = libm::sincos(towards_deg.to_radians());
        let mut point = Point::new(0.0, 500.0, 0.0);
        point.wind = Horizontal::new(cos, sin) * 60.0;
        let (worst, _) = point.fly(300.0, 150.0, &mut northwards);
        assert!(worst < 0.5, "wind towards {towards_deg} deg: {worst} m");
    }
}

#[test]
fn small_deviations_decay_with_the_set_period_and_damping() {
    let mut point = Point::new(0.0, 10.0, 0.0);
    let mut crossings = std::vec::Vec::new();
    let mut before = 1.0;
    for step in 0..3_000_i32 {
        // Without roll dynamics: the bank is there at once.
        let steering = northwards(&point);
        point.heading +=
            STANDARD_GRAVITY_M_S2 * libm::tan(steering.bank_rad) / point.airspeed * DT_S;
        point.at += point.velocity() * DT_S;
        if before * point.at.y < 0.0 {
            crossings.push(f64::from(step) * DT_S);
        }
        before = point.at.y;
    }
    // Half a damped period between crossings: 25 s / √(1 - 0.75²) / 2 = 18.9 s.
    let half = crossings[1] - crossings[0];
    assert!((half - 18.9).abs() < 0.2, "{half} s");
}

#[test]
fn a_circle_is_captured_from_everywhere_and_flown_without_a_steady_error() {
    for clockwise in [true, false] {
        for (north, east) in
            [(60_000.0, 5_000.0), (0.0, 12_000.0), (0.0, 9_000.0), (3_000.0, 0.0), (0.0, 0.0)]
        {
            for heading_deg in [0.0, 90.0, 180.0, 225.0] {
                let mut point = Point::new(north, east, heading_deg);
                let (worst, _) =
                    point.fly(1_200.0, 900.0, &mut |point| around(point, 10_000.0, clockwise));
                assert!(worst < 5.0, "from {north} {east} at {heading_deg} deg: {worst} m off");
            }
        }
    }
}

#[test]
fn a_circle_in_a_wind_stays_a_circle_over_the_ground() {
    let mut point = Point::new(0.0, 12_000.0, 180.0);
    point.wind = Horizontal::new(-30.0, 52.0);
    let (worst, _) = point.fly(2_000.0, 800.0, &mut |point| around(point, 12_500.0, true));
    // The bank changes all the way round, and the roll lags behind by half a second.
    assert!(worst < 20.0, "{worst} m off at 60 m/s of wind");
}

#[test]
fn a_circle_that_is_too_tight_is_flown_as_tight_as_the_bank_allows_around_its_centre() {
    let mut point = Point::new(20_000.0, 0.0, 180.0);
    let (mut nearest, mut farthest) = (f64::INFINITY, 0.0_f64);
    point.fly(1_500.0, 0.0, &mut |point| around(point, 100.0, true));
    point.fly(200.0, 0.0, &mut |point| {
        nearest = nearest.min(point.at.norm());
        farthest = farthest.max(point.at.norm());
        around(point, 100.0, true)
    });
    let tightest = GAINS.turn_radius_m(264.0);
    assert!(farthest < 2.0 * tightest, "{nearest} to {farthest} m, tightest {tightest} m");
}

#[test]
fn a_course_is_held_over_the_ground() {
    let mut point = Point::new(0.0, 0.0, 200.0);
    point.wind = Horizontal::new(0.0, 60.0);
    point.fly(120.0, 0.0, &mut |point| hold_course(1.0, &point.velocity(), &GAINS));
    let velocity = point.velocity();
    let course = libm::atan2(velocity.y, velocity.x);
    assert!((course - 1.0).abs() < 1.0e-3, "{course} rad");
}

#[test]
fn straight_behind_is_a_turn_to_the_right_at_the_largest_bank() {
    let steering = follow_line(&Horizontal::zeros(), &NORTH, &Horizontal::new(-264.0, 0.0), &GAINS);
    assert!((steering.bank_rad - GAINS.bank_max_rad).abs() < 1.0e-12);
}

#[test]
fn points_and_speeds_of_zero_are_flown() {
    let zero = Horizontal::zeros();
    let velocity = Horizontal::new(100.0, 200.0);
    for steering in [
        follow_line(&zero, &zero, &velocity, &GAINS),
        follow_line(&zero, &zero, &zero, &GAINS),
        follow_circle(&zero, 0.0, true, &zero, &GAINS),
        hold_course(0.0, &zero, &GAINS),
    ] {
        assert!(steering.bank_rad.is_finite() && steering.course_rad.is_finite());
    }
    let onwards = follow_line(&zero, &zero, &velocity, &GAINS);
    assert_eq!((onwards.bank_rad, onwards.cross_track_m), (0.0, 0.0));
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1.0e6..1.0e6,
        1 => Just(0.0),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(-1.0e300),
        1 => Just(1.0e-300),
    ]
}

proptest! {
    #[test]
    fn whatever_comes_in_the_bank_is_finite_and_limited(v in prop::array::uniform8(number())) {
        let (a, b) = (Horizontal::new(v[0], v[1]), Horizontal::new(v[2], v[3]));
        let velocity = Horizontal::new(v[4], v[5]);
        for steering in [
            follow_line(&a, &b, &velocity, &GAINS),
            follow_circle(&a, v[6], v[7] > 0.0, &velocity, &GAINS),
            hold_course(v[6], &velocity, &GAINS),
        ] {
            prop_assert!(steering.bank_rad.abs() <= GAINS.bank_max_rad, "{steering:?}");
            prop_assert!(steering.course_rad.is_finite() && steering.cross_track_m.is_finite());
        }
    }

    #[test]
    fn the_mirrored_situation_gives_the_mirrored_bank(
        v in prop::array::uniform6(-5.0e4..5.0e4), radius_m in 1.0..2.0e4,
    ) {
        let mirror = |v: &Horizontal| Horizontal::new(v.x, -v.y);
        let (a, b) = (Horizontal::new(v[0], v[1]), Horizontal::new(v[2], v[3]));
        let velocity = Horizontal::new(v[4], v[5]) / 150.0;
        let pairs = [
            (
                follow_line(&a, &b, &velocity, &GAINS),
                follow_line(&mirror(&a), &mirror(&b), &mirror(&velocity), &GAINS),
            ),
            (
                follow_circle(&a, radius_m, true, &velocity, &GAINS),
                follow_circle(&mirror(&a), radius_m, false, &mirror(&velocity), &GAINS),
            ),
        ];
        for (one, other) in pairs {
            prop_assert!((one.bank_rad + other.bank_rad).abs() < 1.0e-9, "{one:?} {other:?}");
        }
    }
}
