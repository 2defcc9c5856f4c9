use super::*;
use crate::tests::{nominal, tactical};
use crate::{Airframe, EarthModel, ScheduledFault};
use icd::fault::{FaultKind, FaultState, Timing, Travel};
use icd::tvc_jet;
use icd::{Body, ControlPeriod, Effector, FlowAngles, PerEffector, Sample, Stamp};
use nalgebra::Vector3;

mod actuators;
mod air_and_sensors;
mod effectiveness;
mod faults;
mod losses;
mod other_aircraft;
mod sensor_faults;

fn setup(earth: EarthModel) -> PlantSetup {
    PlantSetup { earth, ..nominal(&Airframe::paper(), 1_000) }
}

fn flat() -> PlantSetup {
    setup(EarthModel::Flat)
}

/// In flight: the report of the start is fetched.
fn plant(setup: &PlantSetup) -> Plant {
    let mut plant = Plant::new(setup).unwrap();
    assert!(matches!(plant.pop_report(), Some(PlantReport::Started { .. })));
    plant
}

/// Flies `ticks` periods with the trim commands plus `extra`.
fn fly(plant: &mut Plant, ticks: u32, extra: impl Fn(SimTime, &mut PerEffector<f64>)) {
    for _ in 0..ticks {
        let mut commands = plant.trim().positions();
        extra(plant.time(), &mut commands);
        plant.advance(&Actuators::new(commands));
    }
}

fn coast(plant: &mut Plant, ticks: u32) {
    fly(plant, ticks, |_, _| {});
}

fn wiggle(time: SimTime, commands: &mut PerEffector<f64>) {
    let s = libm::sin(5.0 * time.as_seconds());
    commands[tvc_jet::LEFT_ELEVATOR] += 0.02 * s;
    commands[tvc_jet::RIGHT_ELEVATOR] += 0.02 * s;
    commands[tvc_jet::RIGHT_AILERON] += 0.01 * s;
    commands[tvc_jet::RUDDER] -= 0.01 * s;
}

fn numbers(truth: &Truth) -> [f64; 12] {
    let (w, v, r, e) = (truth.body_rates.0, truth.velocity.0, truth.position.0, truth.euler());
    [w.x, w.y, w.z, v.x, v.y, v.z, r.x, r.y, r.z, e.phi, e.theta, e.psi]
}

fn apart(a: &Truth, b: &Truth) -> f64 {
    numbers(a).iter().zip(numbers(b)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn stuck(effector: Effector, angle_rad: f64, at_us: u64) -> ScheduledFault {
    let kind = FaultKind::StuckAt { angle_rad, travel: Travel::Jump };
    ScheduledFault {
        target: effector.into(),
        kind,
        timing: Timing::at(SimTime::from_micros(at_us)),
    }
}

#[test]
fn trimmed_flight_stays_level_for_ten_seconds() {
    // The phugoid is slow and stable here; what is left of the trim is rounding on the flat Earth, and the
    // changing latitude and heading on the round one.
    for (earth, metres) in [(EarthModel::Flat, 1e-6), (EarthModel::Wgs84, 0.05)] {
        let mut plant = plant(&setup(earth));
        coast(&mut plant, 5_000);
        let truth = plant.truth();
        assert!((truth.altitude_m - 5_000.0).abs() < metres, "{earth:?}: {} m", truth.altitude_m);
        assert!(truth.euler().phi.abs() < 1e-4, "{earth:?}: roll {} rad", truth.euler().phi);
        assert!((truth.normal_load_factor_g - 1.0).abs() < 0.01, "{earth:?}");
    }
}

#[test]
fn steady_wind_carries_the_aircraft_and_nothing_else() {
    let calm = flat();
    let mut windy = flat();
    windy.wind.speed_m_s = 20.0;
    windy.wind.towards_rad = 1.0;
    let (mut a, mut b) = (plant(&calm), plant(&windy));
    coast(&mut a, 1_000);
    coast(&mut b, 1_000);
    let (a, b) = (a.truth(), b.truth());
    assert!((a.airspeed_m_s - b.airspeed_m_s).abs() < 1e-9);
    let drift = b.position.0 - a.position.0;
    let expected = Vector3::new(libm::cos(1.0), libm::sin(1.0), 0.0) * 40.0;
    // 1 um: rounding of 500 m over a thousand steps.
    assert!((drift - expected).norm() < 1e-6, "drift {drift:?} m");
}

#[test]
fn quarter_steps_change_the_flight_by_a_millionth() {
    for earth in [EarthModel::Flat, EarthModel::Wgs84] {
        let coarse = setup(earth);
        let fine = PlantSetup { step_us: 250, ..coarse.clone() };
        let (mut a, mut b) = (plant(&coarse), plant(&fine));
        fly(&mut a, 1_500, wiggle);
        fly(&mut b, 1_500, wiggle);
        let error = apart(a.truth(), b.truth());
        // Rad, rad/s, m/s, m alike; the servos' rate limit is not smooth, so it is not RK4's 1e-12.
        assert!(error < 1e-6, "{earth:?}: {error} apart");
        assert!(a.truth().euler().phi.abs() > 0.01, "the flight must not be trivial");
    }
}

#[test]
fn the_same_setup_and_commands_give_the_same_bits() {
    let mut setup = setup(EarthModel::Wgs84);
    setup.wind.turbulence_m_s = 1.5;
    setup.sensors.gyro_noise_rad_s = 0.001;
    let (mut a, mut b) = (plant(&setup), plant(&setup));
    for _ in 0..500 {
        assert_eq!(a.sense(), b.sense());
        fly(&mut a, 1, wiggle);
        fly(&mut b, 1, wiggle);
        assert_eq!(a.truth(), b.truth());
    }
}

#[test]
fn angular_acceleration_is_the_slope_of_the_rates() {
    for earth in [EarthModel::Flat, EarthModel::Wgs84] {
        let setup =
            PlantSetup { period: ControlPeriod::from_micros(1_000).unwrap(), ..setup(earth) };
        let mut plant = plant(&setup);
        fly(&mut plant, 200, wiggle);
        let before = *plant.truth();
        fly(&mut plant, 1, wiggle);
        let middle = *plant.truth();
        fly(&mut plant, 1, wiggle);
        let slope = (plant.truth().body_rates.0 - before.body_rates.0) / 0.002;
        let error = (slope - middle.angular_acceleration.0).norm();
        // The commands step at the tick: the slope bends there by rate times step.
        assert!(error < 2e-3, "{earth:?}: {error} rad/s2");
        assert!(slope.norm() > 0.02, "{earth:?}: the flight must not be trivial");
    }
}

#[test]
fn the_flight_ends_on_the_ground_and_stays_there() {
    let mut setup = flat();
    setup.start.altitude_m = 50.0;
    setup.start.airspeed_m_s = 200.0;
    let mut plant = plant(&setup);
    let dive = |_: SimTime, commands: &mut PerEffector<f64>| {
        commands[tvc_jet::LEFT_ELEVATOR] = 0.3;
        commands[tvc_jet::RIGHT_ELEVATOR] = 0.3;
    };
    fly(&mut plant, 3_000, dive);
    assert!(plant.on_ground());
    let (truth, time) = (*plant.truth(), plant.time());
    assert!(truth.altitude_m <= 0.0 && truth.altitude_m > -2.0, "{} m", truth.altitude_m);
    assert_eq!(plant.pop_report(), Some(PlantReport::GroundContact { at: time }));
    fly(&mut plant, 10, dive);
    assert_eq!((*plant.truth(), plant.time(), plant.pop_report()), (truth, time, None));
    let request = FaultRequest::Clear { target: tvc_jet::RUDDER.into() };
    assert_eq!(plant.request(&request), FaultReply::Refused(Refusal::FlightOver));
    assert!(!plant.is_broken());
}

#[test]
fn commands_that_are_no_numbers_change_nothing() {
    let (mut a, mut b) = (plant(&flat()), plant(&flat()));
    fly(&mut a, 10, wiggle);
    fly(&mut b, 10, wiggle);
    for _ in 0..10 {
        a.advance(&Actuators::new(a.inputs.commands));
        b.advance(&Actuators::new(PerEffector::from_fn(|_| f64::NAN)));
    }
    assert_eq!(a.truth(), b.truth());
}

#[test]
fn the_wildest_commands_keep_every_number_finite() {
    let mut setup = setup(EarthModel::Wgs84);
    setup.wind.turbulence_m_s = 3.0;
    let mut plant = plant(&setup);
    let mut worst = 0.0_f64;
    fly(&mut plant, 15_000, |time, commands| {
        let sign = if (time.as_micros() / 700_000).is_multiple_of(2) { 1.0 } else { -1.0 };
        *commands =
            PerEffector::from_fn(|e| if e.index() % 2 == 0 { sign * 1e9 } else { -sign * 1e9 });
    });
    for number in numbers(plant.truth()) {
        assert!(number.is_finite());
        worst = worst.max(number.abs());
    }
    assert!(!plant.is_broken() && worst > 1.0);
}

#[test]
fn an_airframe_that_blows_up_ends_the_flight_in_its_last_good_state() {
    let mut setup = flat();
    assert!(setup.airframe.change_derivative("Cmq", |value| *value = 100.0));
    assert!(setup.airframe.change_derivative("Clp", |value| *value = 50.0));
    let mut plant = plant(&setup);
    fly(&mut plant, 20_000, wiggle);
    assert!(plant.on_ground());
    assert!(plant.is_broken(), "altitude {} m", plant.truth().altitude_m);
    assert!(plant.broken_by().is_some_and(|quantity| !quantity.is_empty()));
    assert!(numbers(plant.truth()).iter().all(|x| x.is_finite()));
}

#[test]
fn a_setup_that_cannot_be_is_refused_with_the_reason() {
    let refusal = |change: fn(&mut PlantSetup)| {
        let mut setup = flat();
        change(&mut setup);
        Plant::new(&setup).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(|s| s.step_us = 300),
        "integration step 300 us does not divide the control period of 2000 us"
    );
    assert_eq!(
        refusal(|s| s.airframe.mass.mass_kg = f64::NAN),
        "[mass] mass_kg = NaN is outside 1 to 1000000"
    );
    assert_eq!(
        refusal(|s| s.faults = vec![stuck(tvc_jet::ENGINE, 0.1, 0)]),
        "fault 1 (engine, stuck at 5.7 deg): this effector has no such fault"
    );
    assert_eq!(
        refusal(|s| {
            let timing = Timing { duration_s: Some(0.0), ..Timing::NOW };
            s.faults = vec![ScheduledFault { timing, ..stuck(tvc_jet::RUDDER, 0.1, 5) }];
        }),
        "fault 1 (rudder, stuck at 5.7 deg): duration 0 s is outside 0.0001 to 2592000 s"
    );
    assert!(refusal(|s| s.start.airspeed_m_s = 40.0).contains("level flight"));
}

#[test]
fn every_step_that_divides_the_period_is_allowed() {
    for (period, step_us) in
        [(1_000, 1_000), (2_500, 500), (2_500, 2_500), (4_000, 1), (3_001, 3_001)]
    {
        let period = ControlPeriod::from_micros(period).unwrap();
        let mut plant = plant(&PlantSetup { period, step_us, ..flat() });
        coast(&mut plant, 3);
        assert_eq!(plant.time().as_micros(), 3 * u64::from(period.as_micros()));
    }
}

#[test]
fn body_rates_of_level_flight_on_the_round_earth_are_those_of_the_earth_and_the_way() {
    let plant = plant(&setup(EarthModel::Wgs84));
    let truth = plant.truth();
    let rate = truth.attitude.to_ned(truth.body_rates).0;
    let radius = crate::geodesy::radii(libm::sin(truth.latitude_rad)).meridian_m + 5_000.0;
    let expected = -truth.velocity.0.x / radius;
    // Northbound: the nose follows the curvature, about the axis to the east.
    assert!((rate.y / expected - 1.0).abs() < 1e-9, "{} rad/s instead of {expected}", rate.y);
    assert_ne!(truth.body_rates, Body::zero());
}
