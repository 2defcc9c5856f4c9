//! Properties of plant and controller together.

use crate::flights;

use autopilot::autopilot::Autopilot;
use flight_control::{CompensatorMode, Gains};
use flights::{case_1, case_2, fly, healthy};
use icd::FaultKind;
use icd::tvc_jet;
use lab_judges::closed_loop::{FlightSetup, Record};
use plant_sim::{EarthModel, Plant};

/// The mirrored flight: faults on the other side, roll references and rudder reversed.
fn mirrored(setup: &FlightSetup, references: &str) -> FlightSetup {
    let mut mirrored = setup.clone();
    for fault in &mut mirrored.plant.faults {
        let effector = fault.target.effector().expect("only effectors fail here");
        fault.target = tvc_jet::effectors().mirrored(effector).into();
        if let (tvc_jet::RUDDER, FaultKind::StuckAt { angle_rad, .. }) = (effector, &mut fault.kind)
        {
            *angle_rad = -*angle_rad;
        }
    }
    mirrored.references =
        autopilot::config::references("mirrored", references).expect("written here");
    mirrored
}

/// Quantities that change their sign in a mirror, and those that do not.
fn mirror_pairs(a: &Record, b: &Record) -> [(&'static str, f64, f64); 12] {
    let (t, u) = (&a.truth, &b.truth);
    [
        ("p", t.body_rates.0.x, -u.body_rates.0.x),
        ("q", t.body_rates.0.y, u.body_rates.0.y),
        ("r", t.body_rates.0.z, -u.body_rates.0.z),
        ("phi", t.euler().phi, -u.euler().phi),
        ("theta", t.euler().theta, u.euler().theta),
        ("airspeed", t.airspeed_m_s, u.airspeed_m_s),
        ("alpha", t.alpha_rad, u.alpha_rad),
        ("beta", t.beta_rad, -u.beta_rad),
        ("altitude", t.altitude_m, u.altitude_m),
        ("z2_p", a.log.z2.x, -b.log.z2.x),
        ("z2_q", a.log.z2.y, b.log.z2.y),
        ("z2_r", a.log.z2.z, -b.log.z2.z),
    ]
}

fn assert_mirrored(setup: &FlightSetup, other: &FlightSetup) {
    let (one, other) = (fly(setup), fly(other));
    assert_eq!(one.len(), other.len(), "both flights end at the same tick");
    for (a, b) in one.iter().zip(&other) {
        for (name, value, mirrored) in mirror_pairs(a, b) {
            // Left and right are added in another order here and there; nothing amplifies the rounding
            // of a compensated flight.
            let tolerance = 1.0e-9 * (1.0 + value.abs());
            assert!(
                (value - mirrored).abs() <= tolerance,
                "{name} at {}: {value} against {mirrored}",
                a.truth.time
            );
        }
    }
}

#[test]
fn on_the_flat_earth_the_mirrored_elevator_fault_flies_the_mirrored_trajectory() {
    let setup = case_1(EarthModel::Flat);
    let references = "[[autopilot.reference]]\nat_s = 0.0\nroll_deg = 0.0\naltitude_m = 6000.0\n";
    assert_mirrored(&setup, &mirrored(&setup, references));
}

#[test]
fn on_the_flat_earth_the_mirrored_rudder_fault_flies_the_mirrored_trajectory() {
    let setup = case_2(EarthModel::Flat);
    let references = "[[autopilot.reference]]\nat_s = 0.0\nroll_deg = -15.0\n";
    assert_mirrored(&setup, &mirrored(&setup, references));
}

#[test]
fn the_model_is_current() {
    let setup = healthy(EarthModel::Wgs84);
    let model = lab_studies::linearize::linearize(&setup.plant, &[])
        .expect("the shipped aircraft can be trimmed");
    let text = lab_studies::linearize::to_toml(&model, "").expect("finite numbers");
    assert_eq!(
        text,
        aircraft::DEFAULT_MODEL,
        "aircraft/tvc_jet/model.toml is out of date: run `cargo run --release -- aircraft linearize`"
    );
}

#[test]
fn the_nominal_model_explains_the_nominal_plant() {
    for earth in [EarthModel::Flat, EarthModel::Wgs84] {
        let mut setup = healthy(earth);
        setup.references = autopilot::config::references(
            "s",
            "[[autopilot.reference]]\nat_s = 0.0\nroll_deg = 30.0\n",
        )
        .expect("written here");
        let model = flight_control::DesignModel::new(setup.model);
        for record in fly(&setup) {
            let f = lab_judges::closed_loop::fault_acceleration(&model, &record);
            // 0.003 rad/s²: the linear nozzle, the rounding of the model, and the turning Earth.
            assert!(f.norm() < 3.0e-3, "{earth:?} {}: {f}", record.truth.time);
        }
    }
}

#[test]
fn a_model_that_is_wrong_shows_in_the_estimate() {
    let mut setup = case_2(EarthModel::Flat);
    setup.plant.faults.clear();
    setup.model.airframe.c_roll_p *= 0.5;
    let worst = fly(&setup).iter().map(|record| record.log.z2.x.abs()).fold(0.0, f64::max);
    assert!(worst > 0.05, "largest |z2_p| {worst} rad/s2");
}

#[test]
fn smaller_plant_steps_change_nothing_that_matters() {
    let at = |step_us: u32| {
        let mut setup = case_1(EarthModel::Wgs84);
        setup.plant.step_us = step_us;
        fly(&setup)
    };
    let (fine, coarse) = (at(250), at(2_000));
    for (a, b) in fine.iter().zip(&coarse) {
        let difference = (a.truth.euler().phi - b.truth.euler().phi).abs().to_degrees();
        // The commands are held for the period, so only the integration error is left.
        assert!(difference < 1.0e-3, "{} deg at {}", difference, a.truth.time);
    }
}

#[test]
fn without_the_compensator_the_detector_still_reports() {
    let mut setup = case_1(EarthModel::Wgs84);
    setup.parameters.gains = Gains::REFERENCE;
    setup.parameters.gains.selection.compensator = CompensatorMode::Off;
    let records = fly(&setup);
    assert!(records.iter().any(|record| record.log.compensator_active));
    assert!(records.iter().all(|record| record.log.fade == 0.0));
}

/// Largest level of the estimate in the first two seconds of a flight that starts trimmed here, with and without
/// the plant's report of the start.
fn level_after_start(
    earth: EarthModel,
    airspeed_m_s: f64,
    altitude_m: f64,
    with_report: bool,
) -> f64 {
    let mut setup = healthy(earth);
    setup.plant.start.airspeed_m_s = airspeed_m_s;
    setup.plant.start.altitude_m = altitude_m;
    let text = format!(
        "[[autopilot.reference]]\nat_s = 0.0\naltitude_m = {altitude_m}\nairspeed_m_s = {airspeed_m_s}\n"
    );
    setup.references = autopilot::config::references("start", &text).expect("written here");
    let mut plant = Plant::new(&setup.plant).expect("there is a trim");
    let mut autopilot = Autopilot::new(&setup.settings());
    autopilot.begin_flight(setup.plant.period, plant.time(), false);
    while let Some(report) = plant.pop_report().filter(|_| with_report) {
        autopilot.handle_report(&report);
    }
    let mut worst = 0.0_f64;
    for _ in 0..1_000 {
        let sensors = plant.sense();
        let log = *autopilot.step(plant.time(), &sensors);
        worst = worst.max(log.level);
        plant.advance(&log.actuators());
    }
    worst
}

#[test]
fn off_the_design_point_the_estimate_begins_near_zero_and_not_at_half_its_level() {
    for (airspeed_m_s, altitude_m) in [(180.0, 10_000.0), (180.0, 5_000.0), (320.0, 2_000.0)] {
        for earth in [EarthModel::Flat, EarthModel::Wgs84] {
            let [with, without] = [true, false]
                .map(|report| level_after_start(earth, airspeed_m_s, altitude_m, report));
            println!("{earth:?}, {airspeed_m_s} m/s, {altitude_m} m: {with} instead of {without}");
            // The estimate of a turn of 30 deg at the design point is 0.003 rad/s2, 0.015 of a level.
            assert!(with < 0.02, "{earth:?}, {airspeed_m_s} m/s, {altitude_m} m: {with}");
            assert!(without > 5.0 * with, "without the report {without}");
        }
    }
}

#[test]
fn sensors_with_different_rates_and_one_that_fails_for_a_second_keep_level_flight() {
    let setup = healthy(EarthModel::Wgs84);
    let mut plant = Plant::new(&setup.plant).expect("the shipped aircraft");
    let mut autopilot = Autopilot::new(&setup.settings());
    autopilot.begin_flight(setup.plant.period, plant.time(), false);
    let mut last = plant.sense();
    for tick in 0..10_000_u32 {
        let mut sensors = plant.sense();
        // GNSS 5 Hz, barometer 25 Hz: a sample stays, with its time, until there is a new one.
        if !tick.is_multiple_of(100) {
            sensors.gnss = last.gnss;
        }
        if !tick.is_multiple_of(20) {
            sensors.barometer = last.barometer;
        }
        sensors.vanes.valid = !(2_500..3_000).contains(&tick);
        last = sensors;
        let log = *autopilot.step(plant.time(), &sensors);
        let state = log.state;
        assert_eq!(state.altitude_m, sensors.barometer.value.altitude_m);
        assert_eq!(state.velocity, sensors.gnss.value.velocity);
        assert_eq!(state.valid.flow_angles, sensors.vanes.valid, "tick {tick}");
        assert_eq!(log.health.implausible_input, !sensors.vanes.valid, "tick {tick}");
        plant.advance(&log.actuators());
    }
    let truth = plant.truth();
    assert!((truth.altitude_m - 5_000.0).abs() < 1.0, "altitude {} m", truth.altitude_m);
    assert!(truth.euler().phi.abs() < 0.01, "roll {} rad", truth.euler().phi);
}
