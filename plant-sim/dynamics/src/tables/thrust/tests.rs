use super::*;
use crate::tests::{F16, check_points, part};
use proptest::prelude::*;

const FT: f64 = 0.3048;
const LBF: f64 = 4.448_221_615_260_5;

/// Thrust, N, and roll moment on the airframe, N m.
#[derive(Debug, PartialEq)]
struct Push {
    thrust_n: f64,
    roll_n_m: f64,
}

impl Engine {
    /// The output at a commanded thrust, as far as the ends of the lever allow.
    fn push(&self, thrust_n: f64, at: &EngineAir) -> Push {
        let [least, most] = self.ends(at);
        let thrust_n = thrust_n.min(most).max(least);
        Push { thrust_n, roll_n_m: self.roll_n_m(thrust_n, at) }
    }
}

fn f16() -> Engine {
    part::<Propulsion>(F16, "propulsion").build().unwrap()
}

fn air(mach: f64, altitude_m: f64) -> EngineAir {
    EngineAir { airspeed_m_s: 300.0 * mach, density: 1.0, mach, altitude_m }
}

/// Lever in percent, altitude in ft, Mach number, thrust in lbf.
fn check(lever_pct: f64, altitude_ft: f64, mach: f64, expected_lbf: f64) {
    let ours = f16().thrust_at(lever_pct / 100.0, &air(mach, altitude_ft * FT)) / LBF;
    // The tolerance of the source.
    assert!(
        (ours - expected_lbf).abs() < 6.0e-4,
        "{ours} lbf at {lever_pct} %, expected {expected_lbf}"
    );
}

#[test]
fn val_the_f16_has_the_thrust_of_its_check_points() {
    // F16_prop.dml, checkData.
    check(0.0, 0.0, 0.0, 1_060.0);
    check(100.0, 0.0, 1.0, 28_885.0);
    check(88.3, 33_537.0, 0.895, 9_298.892_6);
}

#[test]
fn val_the_f16_has_the_thrust_of_all_check_points_of_the_reference_data() {
    let Some(points) = check_points("prop") else { return };
    assert_eq!(points.len(), 9);
    for point in &points {
        let input = |key: &str| point["in"][key].as_f64().unwrap();
        let expected = point["out"]["thrustBodyForce_X"][0].as_f64().unwrap();
        check(input("powerLeverAngle"), input("altitudeMSL"), input("mach"), expected);
    }
}

#[test]
fn the_thrust_is_the_commanded_one_between_the_ends_of_the_lever() {
    let (engine, at) = (f16(), air(0.6, 6_096.0));
    assert_eq!(engine.push(30_000.0, &at), Push { thrust_n: 30_000.0, roll_n_m: 0.0 });
    assert!((engine.push(1.0e6, &at).thrust_n - 13_760.0 * LBF).abs() < 1.0e-6);
    assert!((engine.push(-1.0e6, &at).thrust_n + 300.0 * LBF).abs() < 1.0e-6, "idle has drag");
}

#[test]
fn only_the_lever_itself_is_taken_for_the_other_one() {
    let term = "2 throttle throttle_max(throttle, mach) mach";
    let renamed = "2 other_throttle throttle_max(other_throttle, mach) mach";
    assert_eq!(at_other_lever(term), renamed);
    assert_eq!(at_other_lever("throttle"), "other_throttle");
}

/// The propeller of the Aerosonde.
const PROPELLER: Propeller = Propeller {
    diameter_m: 0.508,
    c_thrust: [0.093_57, -0.060_44, -0.107_9],
    c_torque: [0.005_23, 0.004_97, -0.016_64],
    motor_constant_v_s: 0.065_859,
    resistance_ohm: 0.042,
    no_load_current_a: 1.5,
    voltage_max_v: 44.4,
};

fn slow(airspeed_m_s: f64, density: f64) -> EngineAir {
    EngineAir { airspeed_m_s, density, mach: airspeed_m_s / 340.0, altitude_m: 100.0 }
}

#[test]
fn propeller_and_motor_balance() {
    let at = slow(25.0, 1.2682);
    for throttle in [0.4, 0.7, 1.0] {
        let speed = PROPELLER.speed_at_throttle(throttle, &at);
        // The balance as in the source, with the advance ratio.
        let turns = speed / core::f64::consts::TAU;
        let j = 25.0 / (turns * 0.508);
        let torque = 1.2682
            * turns.powi(2)
            * 0.508_f64.powi(5)
            * (0.005_23 + 0.004_97 * j - 0.016_64 * j * j);
        let motor = 0.065_859 * ((throttle * 44.4 - 0.065_859 * speed) / 0.042 - 1.5);
        assert!((torque - motor).abs() < 1.0e-9 * (1.0 + motor.abs()), "{torque} and {motor} N m");
        let thrust = 1.2682
            * turns.powi(2)
            * 0.508_f64.powi(4)
            * (0.093_57 - 0.060_44 * j - 0.107_9 * j * j);
        let engine = Engine::Propeller(PROPELLER);
        assert!((engine.thrust_at(throttle, &at) - thrust).abs() < 1.0e-9, "{thrust} N");
        let push = engine.push(thrust, &at);
        assert!(
            (push.roll_n_m + torque).abs() < 1.0e-9,
            "the airframe turns against the propeller"
        );
    }
}

#[test]
fn more_thrust_than_the_motor_has_is_cut_and_a_closed_lever_brakes() {
    let (engine, at) = (Engine::Propeller(PROPELLER), slow(25.0, 1.2));
    let most = engine.thrust_at(1.0, &at);
    assert_eq!(engine.push(1.0e4, &at).thrust_n, most);
    assert!((30.0..200.0).contains(&most), "{most} N");
    assert!(engine.thrust_at(0.0, &at) < 0.0);
}

#[test]
fn numbers_that_no_propeller_has_are_refused() {
    let refused = Propeller { c_torque: [-0.1, 0.0, 0.0], ..PROPELLER };
    let message = Propulsion::Propeller(refused).build().unwrap_err().to_string();
    assert_eq!(message, "[propulsion] c_torque = -0.1 is outside 0.000001 to 10");
}

proptest! {
    #[test]
    fn a_propeller_is_finite_in_any_air_and_pulls_more_with_more_throttle(
        airspeed in 0.0..80.0_f64, density in 0.05..1.5_f64, throttle in 0.0..1.0_f64, thrust in -1.0e3..1.0e3_f64,
    ) {
        let (engine, at) = (Engine::Propeller(PROPELLER), slow(airspeed, density));
        let (less, more) = (engine.thrust_at(throttle, &at), engine.thrust_at(throttle + 0.01, &at));
        // A windmilling propeller brakes most at some speed, not at the lowest.
        prop_assert!(less.is_finite() && (more >= less || less < 0.0), "{less} and {more} N");
        let push = engine.push(thrust, &at);
        prop_assert!(push.thrust_n.is_finite() && push.roll_n_m.is_finite(), "{push:?}");
    }
}
