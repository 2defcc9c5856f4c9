//! Drops, stands and rolls of whole aircraft on their contact points.

use icd::units::STANDARD_GRAVITY_M_S2 as G;
use icd::{Actuators, Attitude, Body, ControlPeriod, EulerAngles, Ned, PerEffector};

use super::*;
use crate::Plant;
use crate::aerodynamics::Aerodynamics;
use crate::airframe::Airframe;
use crate::dynamics::State;
use crate::earth::EarthModel;
use crate::geodesy::Geodetic;
use crate::ground::{GroundStart, Launch};
use crate::setup::PlantSetup;
use crate::tests::{F16, nominal};

const ELEVATION_M: f64 = 700.0;

fn runway() -> GroundSetup {
    let [latitude_rad, longitude_rad] = [34.9_f64, -117.9].map(f64::to_radians);
    GroundSetup {
        threshold: Geodetic { latitude_rad, longitude_rad, altitude_m: ELEVATION_M },
        heading_rad: 0.3,
        length_m: 3_000.0,
        slope: 0.0,
        friction: 1.0,
        start: GroundStart::Air,
    }
}

fn parked() -> GroundSetup {
    GroundSetup { start: GroundStart::Parked { along_m: 100.0 }, ..runway() }
}

fn aircraft(name: &str) -> Airframe {
    match name {
        "tvc_jet" => Airframe::paper(),
        "f16" => Airframe::from_toml("f16.toml", F16).unwrap(),
        _ => Airframe::from_toml("aerosonde.toml", aircraft::AEROSONDE_AIRFRAME).unwrap(),
    }
}

/// An aircraft without a limit and with an engine that gives no thrust.
fn unbreakable(name: &str) -> Airframe {
    let mut airframe = aircraft(name);
    let gear = airframe.gear.as_mut().unwrap();
    gear.sink_max_m_s = 100.0;
    gear.bank_max_rad = std::f64::consts::PI;
    gear.contacts.iter_mut().for_each(|contact| contact.load_max_n = 1.0e9);
    airframe.propulsion = None;
    for effector in airframe.effectors.all() {
        if !airframe.effectors.is_angle(effector) {
            airframe.servos[effector].min = airframe.servos[effector].min.min(0.0);
        }
    }
    airframe
}

/// The jet in a vacuum, nearly, on one point under its centre of gravity.
fn on_one_point(spring_n_m: f64, damper_n_s_m: f64) -> Airframe {
    let mut airframe = unbreakable("tvc_jet");
    empty_air(&mut airframe);
    let gear = airframe.gear.as_mut().unwrap();
    let point = ContactPoint {
        at_m: [0.0, 0.0, 1.8],
        spring_n_m,
        damper_n_s_m,
        rolling_friction: None,
        brake_friction: 0.0,
        steering: None,
        ..gear.contacts[0]
    };
    gear.contacts = vec![point];
    airframe
}

fn empty_air(airframe: &mut Airframe) {
    match &mut airframe.aero {
        Aerodynamics::Derivatives(aero) => aero.area_m2 = 0.01,
        Aerodynamics::Tables(aero) => aero.area_m2 = 0.01,
    }
}

fn setup(airframe: Airframe, ground: GroundSetup, step_us: u32) -> PlantSetup {
    let mut setup = PlantSetup {
        earth: EarthModel::Flat,
        ground: Some(ground),
        period: ControlPeriod::from_micros(step_us.max(1_000)).unwrap(),
        ..nominal(&airframe, step_us)
    };
    setup.start.altitude_m = setup.start.altitude_m.max(ELEVATION_M + 300.0);
    setup
}

/// In a state over the ground: height of the centre of gravity, m, attitude, velocity NED, m/s, rates, rad/s, its engine off.
fn released(
    setup: &PlantSetup,
    height_m: f64,
    attitude: EulerAngles,
    velocity: Ned,
    rates: Body,
) -> Plant {
    // Any flight will do, since the state is another one.
    let any = PlantSetup { earth: setup.earth, ..nominal(&Airframe::paper(), 1_000) };
    let trim = *Plant::new(&any).unwrap().trim();
    let mut plant = Plant::with_trim(setup, &trim).unwrap();
    let mut rigid = plant.state().rigid;
    let attitude = Attitude::from_euler(attitude);
    let earth = plant.dynamics().earth();
    let here = Geodetic { altitude_m: ELEVATION_M + height_m, ..setup.start.geodetic() };
    rigid.position = earth.position(&here);
    rigid.q_e_from_body = earth.q_e_from_body(&here, &attitude);
    rigid.velocity = attitude.to_body(velocity);
    let earth_rate = earth.rotation_in(&rigid.e_from_body());
    rigid.rates = Body(earth_rate.0 + rates.0);
    plant.resume_from(&State { rigid, positions: PerEffector::default() });
    plant
}

const LEVEL: EulerAngles = EulerAngles { phi: 0.0, theta: 0.0, psi: 0.3 };
const OFF: Actuators = Actuators::new(PerEffector::new([0.0; Effector::MAX]));
const BRAKED: Actuators = Actuators { brakes: 1.0, ..OFF };

fn height_m(plant: &Plant) -> f64 {
    plant.truth().altitude_m - ELEVATION_M
}

fn seconds(plant: &mut Plant, seconds: f64, each: impl FnMut(&mut Plant)) {
    seconds_with(plant, &BRAKED, seconds, each);
}

fn seconds_with(
    plant: &mut Plant,
    actuators: &Actuators,
    seconds: f64,
    mut each: impl FnMut(&mut Plant),
) {
    let end = plant.time().as_seconds() + seconds;
    while plant.time().as_seconds() < end - 1.0e-9 {
        plant.advance(actuators);
        let (broken, crash) = (plant.broken_by(), plant.crash());
        assert!(!plant.on_ground(), "the flight is over: {broken:?} {crash:?}");
        each(plant);
    }
}

/// Largest growth of the energy in a tick over the energy at the start.
fn growth(plant: &mut Plant, duration_s: f64) -> f64 {
    let start = plant.mechanical_energy_j().unwrap();
    let (mut last, mut growth) = (start, 0.0_f64);
    seconds(plant, duration_s, |plant| {
        let now = plant.mechanical_energy_j().unwrap();
        growth = growth.max((now - last) / start);
        last = now;
    });
    growth
}

#[test]
fn without_thrust_and_wind_the_energy_never_grows() {
    let turns = [
        (LEVEL, Body::zero()),
        (EulerAngles { phi: 0.4, theta: 0.1, psi: 2.0 }, Body::new(0.5, -0.3, 0.2)),
        (EulerAngles { phi: -2.8, theta: -0.6, psi: 0.0 }, Body::zero()),
        (EulerAngles { phi: 0.0, theta: 1.2, psi: 0.0 }, Body::new(0.0, 1.0, 0.0)),
    ];
    let mut worst = (0.0, String::new());
    for name in ["tvc_jet", "f16", "aerosonde"] {
        let airframe = unbreakable(name);
        let size_m = if name == "aerosonde" { 1.5 } else { 8.5 };
        for step_us in [1_000, 2_000, 4_000] {
            for (attitude, rates) in turns {
                // Falling on its back or tail it is far beyond its tables, and the air there pushes it on.
                if name == "f16" && attitude.theta.abs() > 0.5 {
                    continue;
                }
                for (above_m, velocity) in [
                    (0.02, Ned::zero()),
                    (0.5, Ned::new(5.0, 3.0, 0.0)),
                    (0.1, Ned::new(20.0, -2.0, 1.0)),
                ] {
                    let setup = setup(airframe.clone(), runway(), step_us);
                    let mut plant = released(&setup, size_m + above_m, attitude, velocity, rates);
                    let lift_m = lift_m(&plant);
                    let height_m = size_m + lift_m + above_m;
                    plant = released(&setup, height_m, attitude, velocity, rates);
                    let growth = growth(&mut plant, 4.0);
                    let label = format!("{name} {step_us} {attitude:?} {above_m}");
                    if growth > worst.0 {
                        worst = (growth, label);
                    }
                }
            }
        }
    }
    // Rounding of the energy itself; the requirement is 1e-6.
    assert!(worst.0 < 1.0e-9, "{worst:?}");
}

/// Depth of the deepest point in the ground, m.
fn lift_m(plant: &Plant) -> f64 {
    plant.contacts().unwrap().deepest(plant.dynamics(), &plant.state().rigid).1
}

#[test]
fn parked_with_brakes_in_wind_it_does_not_creep() {
    for name in ["tvc_jet", "f16", "aerosonde"] {
        for towards_deg in [0.0_f64, 45.0, 90.0, 180.0] {
            let mut setup = setup(aircraft(name), parked(), 1_000);
            setup.period = ControlPeriod::DEFAULT;
            setup.earth = EarthModel::Wgs84;
            setup.wind.speed_m_s = 10.0;
            setup.wind.towards_rad = towards_deg.to_radians();
            let mut plant =
                Plant::new(&setup).unwrap_or_else(|e| panic!("{name} {towards_deg}: {e}"));
            let commands = plant.trim().positions();
            let start = plant.truth().position;
            while plant.time().as_seconds() < 60.0 && !plant.on_ground() {
                plant.advance(&Actuators { commands, brakes: 1.0 });
            }
            let crept_mm = 1.0e3 * (plant.truth().position.0 - start.0).norm();
            assert!(crept_mm < 1.0 && !plant.on_ground(), "{name}: {crept_mm} mm");
        }
    }
}

#[test]
fn a_drop_onto_a_spring_has_the_period_and_the_deflection_of_the_formula() {
    let (spring_n_m, mass_kg) = (4.0e5, Airframe::paper().mass.mass_kg);
    let setup_ = setup(on_one_point(spring_n_m, 0.0), runway(), 1_000);
    let mut plant = released(&setup_, 1.8, LEVEL, Ned::zero(), Body::zero());
    let mut heights = Vec::new();
    seconds(&mut plant, 2.0, |plant| heights.push(height_m(plant)));
    let lowest = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let sag_m = mass_kg * G / spring_n_m;
    // The air that is left takes less than 1e-4 of it.
    assert!(((1.8 - lowest) / (2.0 * sag_m) - 1.0).abs() < 1.0e-4, "{lowest} m, {sag_m} m");
    let mean_m = 1.8 - sag_m;
    let crossings = (1..heights.len()).filter(|i| heights[i - 1] > mean_m && heights[*i] <= mean_m);
    let times: Vec<f64> = crossings
        .map(|i| {
            let (a, b) = (heights[i - 1] - mean_m, heights[i] - mean_m);
            1.0e-3 * (i as f64 + a / (a - b))
        })
        .collect();
    let period_s = times[1] - times[0];
    let expected_s = std::f64::consts::TAU * (mass_kg / spring_n_m).sqrt();
    // The midpoint rule lengthens the period by (omega h)^2 / 12 of it, 4e-6.
    assert!((period_s / expected_s - 1.0).abs() < 2.0e-5, "{period_s} s, {expected_s} s");

    let setup_ = setup(on_one_point(spring_n_m, 4.0e4), runway(), 1_000);
    let mut plant = released(&setup_, 1.8, LEVEL, Ned::zero(), Body::zero());
    // Any longer and it tips over on its one point.
    seconds(&mut plant, 8.0, |_| {});
    let is_m = 1.8 - height_m(&plant);
    assert!((is_m - sag_m).abs() < 1.0e-7, "{is_m} m, {sag_m} m");
}

#[test]
fn the_braking_distance_is_that_of_the_formula() {
    let mut airframe = unbreakable("tvc_jet");
    empty_air(&mut airframe);
    for contact in &mut airframe.gear.as_mut().unwrap().contacts {
        contact.rolling_friction = contact.rolling_friction.map(|_| 0.0);
        contact.brake_friction = contact.rolling_friction.map_or(0.0, |_| 0.4);
    }
    let mut plant = Plant::new(&setup(airframe, parked(), 1_000)).unwrap();
    let mut state = *plant.state();
    state.positions = PerEffector::default();
    let velocity = Ned::new(30.0 * 0.3_f64.cos(), 30.0 * 0.3_f64.sin(), 0.0);
    state.rigid.velocity = plant.truth().attitude.to_body(velocity);
    plant.resume_from(&state);
    let start = plant.truth().position.0;
    seconds(&mut plant, 25.0, |_| {});
    let way_m = (plant.truth().position.0 - start).norm();
    let expected_m = 30.0 * 30.0 / (2.0 * 0.4 * G);
    assert!(plant.truth().velocity.0.norm() < 1.0e-3, "{:?}", plant.truth().velocity);
    // The springs along the ground stretch by up to 9 cm before a wheel slips, and pull back at the end.
    assert!((way_m - expected_m).abs() < 0.15, "{way_m} m, {expected_m} m");
}

#[test]
fn a_side_force_moves_it_only_by_what_exceeds_the_friction() {
    // The side force is that of a slope across the aircraft, whose wheels are skids.
    let slope = 0.1_f64;
    let angle = slope.atan();
    for friction in [0.2, 0.05] {
        let mut airframe = unbreakable("tvc_jet");
        empty_air(&mut airframe);
        for contact in &mut airframe.gear.as_mut().unwrap().contacts {
            *contact = ContactPoint {
                friction,
                rolling_friction: None,
                brake_friction: 0.0,
                steering: None,
                ..*contact
            };
        }
        let ground = GroundSetup { slope, ..runway() };
        let across = EulerAngles { psi: 0.3 + 90.0_f64.to_radians(), ..LEVEL };
        let mut setup = setup(airframe, ground, 1_000);
        // On the runway, not at its end.
        setup.start.latitude_rad += 1_000.0 / 6.4e6;
        let height_m = 1.75 + 0.1 * 1_000.0 * 0.3_f64.cos();
        let mut plant = released(&setup, height_m, across, Ned::zero(), Body::zero());
        seconds(&mut plant, 25.0, |_| {});
        let (before, moved_from) = (plant.truth().velocity.0, plant.truth().position.0);
        seconds(&mut plant, 2.0, |_| {});
        let is_m_s2 = (plant.truth().velocity.0 - before).norm() / 2.0;
        let way_m = (plant.truth().position.0 - moved_from).norm();
        let expected_m_s2 = G * (angle.sin() - friction * angle.cos());
        if expected_m_s2 > 0.0 {
            assert!((is_m_s2 - expected_m_s2).abs() < 1.0e-3, "{is_m_s2}, {expected_m_s2} m/s2");
        } else {
            assert!(way_m < 1.0e-6, "{way_m} m");
        }
    }
}

#[test]
fn half_the_step_moves_the_touchdown_by_less_than_a_decimetre() {
    let touchdown = |name: &str, speed_m_s: f64, step_us| {
        let setup = setup(unbreakable(name), runway(), step_us);
        let attitude = EulerAngles { theta: 0.12, ..LEVEL };
        let velocity =
            Ned::new(speed_m_s * 0.3_f64.cos(), speed_m_s * 0.3_f64.sin(), 0.02 * speed_m_s);
        let start_m = if name == "aerosonde" { 1.0 } else { 4.0 };
        let mut plant = released(&setup, start_m, attitude, velocity, Body::zero());
        let (mut last, mut down) = ((0.0, Ned::zero()), None);
        seconds(&mut plant, 6.0, |plant| {
            let now = (lift_m(plant), plant.truth().position);
            if down.is_none() && now.0 > 0.0 {
                let part = last.0 / (last.0 - now.0);
                down = Some(last.1.0 + (now.1.0 - last.1.0) * part);
            }
            last = now;
        });
        (down.unwrap(), plant.truth().position.0)
    };
    for (name, speed_m_s) in [("tvc_jet", 95.0), ("f16", 80.0), ("aerosonde", 16.0)] {
        let [coarse, fine] = [2_000, 1_000].map(|step_us| touchdown(name, speed_m_s, step_us));
        let [moved_m, after_m] = [(coarse.0 - fine.0).norm(), (coarse.1 - fine.1).norm()];
        assert!(moved_m < 0.1 && after_m < 0.1, "{name}: {moved_m} m, after 6 s {after_m} m");
    }
}

/// Advances until the flight is over, at most for so long.
fn crash(plant: &mut Plant, duration_s: f64) -> Option<String> {
    while plant.time().as_seconds() < duration_s && !plant.on_ground() {
        plant.advance(&BRAKED);
    }
    plant.crash().map(|failure| failure.to_string())
}

#[test]
fn a_limit_of_the_gear_ends_the_flight_with_its_reason() {
    let setup_ = setup(aircraft("tvc_jet"), runway(), 1_000);
    let drop = |phi: f64, sink_m_s: f64| {
        let attitude = EulerAngles { phi: phi.to_radians(), ..LEVEL };
        let velocity = Ned::new(70.0 * 0.3_f64.cos(), 70.0 * 0.3_f64.sin(), sink_m_s);
        let mut plant = released(&setup_, 2.5, attitude, velocity, Body::zero());
        let end = crash(&mut plant, 3.0);
        (end.unwrap_or_default(), plant)
    };
    let (end, plant) = drop(0.0, 5.0);
    assert!(end.starts_with("touchdown at a rate of descent of 5."), "{end}");
    assert!(plant.on_ground() && !plant.is_broken());
    let (end, _) = drop(25.0, 0.0);
    assert!(end.starts_with("roll angle of 2") && end.ends_with("limit 20.0 deg"), "{end}");
    let (end, plant) = drop(0.0, 1.0);
    assert!(end.is_empty() && !plant.on_ground(), "{end}");
    let mut airframe = aircraft("tvc_jet");
    airframe.gear.as_mut().unwrap().contacts[0].load_max_n = 1.0e4;
    let setup = setup(airframe, runway(), 1_000);
    let mut plant = released(&setup, 1.9, LEVEL, Ned::zero(), Body::zero());
    let end = crash(&mut plant, 3.0).unwrap();
    assert!(end.starts_with("nose wheel: load of 1") && end.ends_with("limit 10000 N"), "{end}");
}

#[test]
fn a_spring_that_is_too_stiff_for_the_step_is_refused_at_its_effective_mass() {
    let mut airframe = aircraft("aerosonde");
    // The wing tip turns the aircraft: 0.37 kg, so 4000 N/m is 104 rad/s.
    airframe.gear.as_mut().unwrap().contacts[4].spring_n_m = 4.0e5;
    let refused = Plant::new(&setup(airframe.clone(), runway(), 1_000)).unwrap_err().to_string();
    assert!(
        refused
            .starts_with("[gear.contact.left wing tip] spring_n_m = 400000 is too large for its"),
        "{refused}"
    );
    assert!(refused.contains("can follow 1000 1/s"), "{refused}");
    assert!(Plant::new(&setup(airframe, runway(), 500)).is_ok());
}

#[test]
fn an_aircraft_that_nothing_holds_is_refused_by_what_moves() {
    let ground = GroundSetup { friction: 0.0, ..parked() };
    let refused = Plant::new(&setup(aircraft("tvc_jet"), ground, 1_000)).unwrap_err().to_string();
    assert!(refused.contains("does not come to rest on its gear in 60 s"), "{refused}");
    let mut airframe = aircraft("tvc_jet");
    airframe.gear = None;
    let refused = Plant::new(&setup(airframe, parked(), 1_000)).unwrap_err().to_string();
    assert_eq!(refused, "[plant.ground] needs [gear] in the airframe file; tvc_jet has none");
}

#[test]
fn at_rest_everything_is_finite_and_the_accelerometers_feel_the_weight() {
    for name in ["tvc_jet", "f16", "aerosonde"] {
        let mut setup = setup(aircraft(name), parked(), 1_000);
        setup.earth = EarthModel::Wgs84;
        setup.sensors = crate::tests::tactical();
        setup.wind.turbulence_m_s = 1.5;
        let mut plant = Plant::new(&setup).unwrap();
        let commands = plant.trim().positions();
        for _ in 0..500 {
            let sensors = plant.sense();
            assert!(sensors.to_array().iter().all(|x| x.is_finite()), "{name}: {sensors:?}");
            plant.advance(&Actuators::new(commands));
        }
        let truth = plant.truth();
        let force = truth.specific_force.0.norm();
        assert!((force - 9.8).abs() < 0.3, "{name}: {force} m/s2");
        assert!(truth.to_row(false, false).iter().all(|x| x.is_finite()), "{name}: {truth:?}");
    }
}

/// JSBSim 1.3.3 (PyPI `jsbsim`) with the mass, the inertia and the three wheels of the jet, no air forces, steps of 0.1 ms, latitude
/// 34.9 deg: height of the centre of gravity after a level drop from 2.1 m, time in s and height in m.
const JSBSIM_DROP: [(f64, f64); 8] = [
    (0.2, 1.90405),
    (0.3, 1.68937),
    (0.4, 1.59402),
    (0.5, 1.62109),
    (0.6, 1.68551),
    (0.8, 1.72906),
    (1.0, 1.70042),
    (2.0, 1.70312),
];
/// The same rolling at 30 m/s, brakes and way to the stop, m. A braked wheel has 0.8 of the load.
const JSBSIM_BRAKING: [(f64, f64); 2] = [(0.5, 154.219), (1.0, 91.385)];

fn as_in_jsbsim(height_m: f64, attitude: EulerAngles, velocity: Ned) -> Plant {
    let mut airframe = unbreakable("tvc_jet");
    empty_air(&mut airframe);
    airframe.mass.ixz_kg_m2 = 0.0;
    let contacts = &mut airframe.gear.as_mut().unwrap().contacts;
    contacts.truncate(3);
    contacts[1..].iter_mut().for_each(|wheel| wheel.brake_friction = 0.78);
    let threshold = Geodetic { altitude_m: 0.0, ..runway().threshold };
    let ground = GroundSetup { threshold, heading_rad: 0.0, ..runway() };
    let setup = PlantSetup { earth: EarthModel::Wgs84, ..setup(airframe, ground, 1_000) };
    released(&setup, height_m - ELEVATION_M, attitude, velocity, Body::zero())
}

#[test]
fn val_a_drop_and_a_braked_roll_are_those_of_jsbsim() {
    let level = EulerAngles { phi: 0.0, theta: 0.0, psi: 0.0 };
    let mut plant = as_in_jsbsim(2.1, level, Ned::zero());
    for (time_s, expected_m) in JSBSIM_DROP {
        let left_s = time_s - plant.time().as_seconds();
        seconds(&mut plant, left_s, |_| {});
        let is_m = plant.truth().altitude_m;
        // JSBSim finds forces once a step; from 0.5 to 0.1 ms its heights still change by 0.2 mm.
        assert!((is_m - expected_m).abs() < 1.0e-3, "{time_s} s: {is_m} m");
    }
    for (brakes, expected_m) in JSBSIM_BRAKING {
        let attitude = EulerAngles { theta: -0.013_f64.to_radians(), ..level };
        let mut plant = as_in_jsbsim(1.703_1, attitude, Ned::new(30.0, 0.0, 0.0));
        let mut way_m = 0.0_f64;
        let braked = Actuators { brakes, ..OFF };
        seconds_with(&mut plant, &braked, 14.0, |plant| {
            way_m = way_m.max(plant.truth().position.0.x);
        });
        // Before a wheel slips its spring along the ground stretches by up to 8 cm, which JSBSim has none of.
        assert!((way_m - expected_m).abs() < 0.3, "{way_m} m, JSBSim {expected_m} m");
    }
}

#[test]
fn a_launch_releases_it_over_the_runway_and_not_in_the_ground() {
    let launch = Launch { along_m: 10.0, height_m: 1.5, speed_m_s: 18.0, pitch_rad: 0.15 };
    let ground = |launch| GroundSetup { start: GroundStart::Launched(launch), ..runway() };
    let mut plant = Plant::new(&setup(aircraft("aerosonde"), ground(launch), 1_000)).unwrap();
    let (truth, expected) =
        (plant.truth(), Ned::new(0.3_f64.cos(), 0.3_f64.sin(), -0.15_f64.tan()));
    assert!((height_m(&plant) - 1.5).abs() < 1.0e-9, "{} m", height_m(&plant));
    let velocity = expected.0 * (18.0 * 0.15_f64.cos());
    assert!((truth.velocity.0 - velocity).norm() < 1.0e-9, "{:?}", truth.velocity);
    seconds(&mut plant, 1.0, |_| {});
    assert!(height_m(&plant) > 1.0, "{} m", height_m(&plant));

    let low = Launch { height_m: 0.05, ..launch };
    let refused = Plant::new(&setup(aircraft("aerosonde"), ground(low), 1_000)).unwrap_err();
    let refused = refused.to_string();
    assert!(
        refused.starts_with("[plant.ground] height_m = 0.05 puts the rear left skid 0.08"),
        "{refused}"
    );
    let mut buried = setup(aircraft("tvc_jet"), runway(), 1_000);
    buried.start.altitude_m = 701.0;
    buried.start.airspeed_m_s = 150.0;
    let refused = Plant::new(&buried).unwrap_err().to_string();
    assert!(refused.starts_with("[plant.start] altitude_m = 701 puts the"), "{refused}");
}

#[test]
fn a_catapult_holds_until_the_engine_is_up_and_then_gives_the_speed_of_the_launch() {
    let launch = Launch { along_m: 10.0, height_m: 1.5, speed_m_s: 18.0, pitch_rad: 0.15 };
    let start = GroundStart::Catapult { launch, rail_m: 3.0 };
    for step_us in [1_000, 4_000] {
        let mut setup = setup(unbreakable("aerosonde"), GroundSetup { start, ..runway() }, step_us);
        setup.wind.speed_m_s = 4.0;
        setup.wind.towards_rad = 1.5;
        setup.earth = EarthModel::Wgs84;
        let mut plant = Plant::new(&setup).unwrap();
        let from = plant.truth().position.0;
        let way_m = |plant: &Plant| (plant.truth().position.0 - from).norm();
        let weight_n = 11.0 * G;
        seconds_with(&mut plant, &OFF, 2.0, |plant| {
            assert!(way_m(plant) < 1.0e-4, "{} m on the rail", way_m(plant));
            let load_n = plant.sense().weight_on_wheels_n.value;
            assert!((load_n / weight_n - 1.0).abs() < 1.0e-9, "{load_n} N");
        });
        let mut commands = OFF.commands;
        let engine = setup.airframe.effectors.only(icd::EffectorKind::Engine).unwrap();
        commands[engine] = 1.0e3;
        let (mut speed_m_s, mut tilt) = (0.0_f64, 0.0_f64);
        seconds_with(&mut plant, &Actuators::new(commands), 2.0, |plant| {
            if plant.contacts().unwrap().is_bearing() {
                speed_m_s = plant.truth().velocity.0.norm();
                let euler = plant.truth().euler();
                tilt = tilt.max((euler.theta - 0.15).abs()).max(euler.phi.abs());
            }
        });
        assert!(!plant.contacts().unwrap().is_bearing() && plant.crash().is_none());
        let late = 18.0 * 18.0 / 6.0 * f64::from(step_us) * 1.0e-6;
        assert!((speed_m_s - 18.0).abs() < 1.0e-2 + late, "{speed_m_s} m/s");
        assert!(tilt < 1.0e-3, "{tilt} rad");
    }
}

#[test]
fn height_and_load_are_those_of_the_contact_points_and_ground_idle_holds_only_there() {
    let mut plant = Plant::new(&setup(aircraft("tvc_jet"), parked(), 1_000)).unwrap();
    let weight_n = plant.dynamics().mass().mass_kg * G;
    let sensors = plant.sense();
    let (height_m, load_n) = (sensors.radar_altimeter_m.value, sensors.weight_on_wheels_n.value);
    assert!((load_n / weight_n - 1.0).abs() < 1.0e-2, "{load_n} N of {weight_n}");
    assert!((-0.2..0.0).contains(&height_m), "{height_m} m: springs give in");
    let engine = plant.dynamics().airframe().effectors.only(icd::EffectorKind::Engine).unwrap();
    seconds(&mut plant, 10.0, |_| {});
    assert!((plant.state().positions[engine] - 2_500.0).abs() < 10.0);
    let attitude = EulerAngles { phi: 0.2, ..LEVEL };
    let setup_ = setup(aircraft("tvc_jet"), runway(), 1_000);
    let mut plant = released(&setup_, 60.0, attitude, Ned::new(90.0, 0.0, 0.0), Body::zero());
    let height_m = plant.sense().radar_altimeter_m.value;
    // The right wing tip is the lowest point: 4.57 sin 0.2 - 1.8 cos 0.2 is less than the wheel below the wing.
    let wheel_m = 1.8 * 0.2_f64.cos() + 1.18 * 0.2_f64.sin();
    assert!((height_m - (60.0 - wheel_m)).abs() < 0.05, "{height_m} m");
    seconds(&mut plant, 1.0, |_| {});
    assert!(plant.state().positions[engine] > 4_000.0, "flight idle is 8 kN");
}
