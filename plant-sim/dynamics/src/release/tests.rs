//! Initial states and released flights, without the reference data of other simulators.

use super::*;
use crate::earth::ROTATION_RAD_S;
use crate::wind::WindLevel;
use crate::{Plant, SetupError};
use icd::{Actuators, SimTime};

const SPHERE: &str = include_str!("../../../checkcases/sphere.toml");
const BRICK: &str = include_str!("../../../checkcases/brick.toml");

fn airframe(text: &str) -> Airframe {
    Airframe::from_toml("body.toml", text).unwrap()
}

fn at(latitude_deg: f64, longitude_deg: f64, altitude_m: f64) -> Geodetic {
    Geodetic {
        latitude_rad: latitude_deg.to_radians(),
        longitude_rad: longitude_deg.to_radians(),
        altitude_m,
    }
}

fn initial(here: Geodetic) -> InitialState {
    InitialState {
        position: InitialPosition::Geodetic(here),
        velocity: InitialVelocity::Ned(Ned::zero()),
        attitude: EulerAngles { phi: 0.0, theta: 0.0, psi: 0.0 },
        rates: InitialRates::Inertial(Body::zero()),
        is_trimmed: false,
    }
}

fn setup(body: &str, earth: EarthModel, initial: InitialState) -> ReleaseSetup {
    ReleaseSetup {
        airframe: airframe(body),
        earth,
        flat_gravity: None,
        wind: WindSettings::default(),
        temperature_offset_k: 0.0,
        gusts: Vec::new(),
        profile: WindProfile::default(),
        initial,
        controls: Controls::default(),
        faults: Vec::new(),
        seed: 0,
        step_us: 10_000,
    }
}

fn flown(setup: &ReleaseSetup, seconds: u64) -> Plant {
    let mut plant = Plant::release(setup).unwrap();
    while plant.time() < SimTime::from_micros(seconds * 1_000_000) && !plant.on_ground() {
        plant.advance(&Actuators::new(plant.controls().positions));
    }
    plant
}

#[test]
fn rates_relative_to_the_earth_and_to_ned_are_turned_into_inertial_ones() {
    let here = at(60.0, 20.0, 1_000.0);
    let earth = Earth::new(EarthModel::Wgs84, here);
    let state = InitialState {
        velocity: InitialVelocity::Ned(Ned::new(0.0, 300.0, 0.0)),
        attitude: EulerAngles { phi: 0.0, theta: 0.0, psi: 0.0 },
        ..initial(here)
    };
    let rates = |rates| InitialState { rates, ..state }.rigid(&earth, 0.0).rates.0;
    assert_eq!(rates(InitialRates::Inertial(Body::zero())), Vector3::zeros());
    // North and down parts of the Earth's rotation at 60 deg.
    let of_earth = ROTATION_RAD_S * Vector3::new(0.5, 0.0, -(0.75_f64).sqrt());
    let error = (rates(InitialRates::Earth(Body::zero())) - of_earth).norm();
    assert!(error < 1e-15, "{error} rad/s");
    // Eastward motion turns NED about the Earth's axis as well: by V / (N + h) in units of its north part.
    let radius = 6_394_209.0 + 1_000.0;
    let transport = 300.0 / radius * Vector3::new(1.0, 0.0, -(3.0_f64).sqrt());
    let error = (rates(InitialRates::Ned(Body::zero())) - of_earth - transport).norm();
    // Six digits of the radius.
    assert!(error < 1e-10, "{error} rad/s");
}

#[test]
fn geodetic_and_ned_terms_describe_the_same_state_on_every_earth() {
    for model in EarthModel::ALL {
        let name = model.key();
        let origin = at(36.0, -75.0, 0.0);
        let earth = Earth::new(model, origin);
        let euler = EulerAngles { phi: 0.2, theta: -0.1, psi: 2.0 };
        let local = InitialState {
            position: InitialPosition::Local { origin, position: Ned::new(0.0, 0.0, -9_144.0) },
            attitude: euler,
            velocity: InitialVelocity::Ned(Ned::new(10.0, 20.0, 30.0)),
            ..initial(origin)
        };
        let body = Attitude::from_euler(euler).to_body(Ned::new(10.0, 20.0, 30.0));
        let geodetic = InitialState {
            position: InitialPosition::Geodetic(Geodetic { altitude_m: 9_144.0, ..origin }),
            velocity: InitialVelocity::Body(body),
            ..local
        };
        let [a, b] = [local, geodetic].map(|state| state.rigid(&earth, euler.theta));
        // Rounding of positions of 6.4e6 m.
        assert!((a.position - b.position).norm() < 1e-8, "{name}");
        assert!((a.velocity.0 - b.velocity.0).norm() < 1e-12, "{name}");
        let turned = a.q_e_from_body.iter().zip(b.q_e_from_body).map(|(a, b)| (a - b).abs());
        assert!(turned.sum::<f64>() < 1e-11, "{name}");
    }
}

#[test]
fn a_drop_over_a_sphere_that_does_not_rotate_is_straight_and_follows_the_energy_integral() {
    let here = at(0.0, 0.0, 9_144.0);
    let plant = flown(&setup(BRICK, EarthModel::RoundNonRotating, initial(here)), 30);
    let truth = plant.truth();
    assert!(truth.latitude_rad.abs() < 1e-15 && truth.longitude_rad.abs() < 1e-15);
    let radius = |altitude_m: f64| crate::earth::SPHERE_RADIUS_M + altitude_m;
    let gm = crate::earth::GRAVITATIONAL_PARAMETER;
    let speed = (2.0 * gm * (1.0 / radius(truth.altitude_m) - 1.0 / radius(9_144.0))).sqrt();
    // 1e-7 of 293 m/s: the difference of two radii of 6.4e6 m cancels nine digits.
    assert!((truth.velocity.0.z / speed - 1.0).abs() < 1e-7, "{} m/s", truth.velocity.0.z);
}

#[test]
fn a_rotating_sphere_turns_a_falling_body_to_the_east() {
    let here = at(0.0, 0.0, 9_144.0);
    let drift = |model| {
        let truth = *flown(&setup(BRICK, model, initial(here)), 30).truth();
        truth.longitude_rad * crate::earth::SPHERE_RADIUS_M
    };
    // Coriolis: w g t^3 / 3, with gravity reduced by the centrifugal part; the next term is 1e-3 of it.
    let expected = ROTATION_RAD_S * 9.75 * 30.0_f64.powi(3) / 3.0;
    let ours = drift(EarthModel::Round);
    assert!((ours / expected - 1.0).abs() < 0.01, "{ours} m instead of {expected}");
    assert_eq!(drift(EarthModel::RoundNonRotating), 0.0);
}

#[test]
fn a_flat_earth_with_the_gravity_of_a_place_has_the_air_of_that_place() {
    let here = at(0.0, 0.0, 9_144.0);
    let round = Plant::release(&setup(SPHERE, EarthModel::Wgs84, initial(here))).unwrap();
    let flat = setup(SPHERE, EarthModel::Flat, initial(here));
    // Gravitation of WGS-84 there, less the centrifugal acceleration of a point on the equator.
    let tangent = ReleaseSetup { flat_gravity: Some(9.786_072 - 0.033_964), ..flat.clone() };
    let plant = Plant::release(&tangent).unwrap();
    assert_eq!(plant.truth().density_kg_m3, round.truth().density_kg_m3);
    assert!(Plant::release(&flat).unwrap().truth().density_kg_m3 < round.truth().density_kg_m3);
    let fallen = |setup: &ReleaseSetup| flown(setup, 30).truth().altitude_m;
    let on_round = fallen(&setup(SPHERE, EarthModel::Wgs84, initial(here)));
    // Gravity grows by a thousandth on the way: half a metre with this drag. With standard gravity it is 21 m.
    assert!((fallen(&tangent) - on_round).abs() < 1.5, "{} m", fallen(&tangent) - on_round);
    assert!((fallen(&flat) - on_round).abs() > 20.0);
    let absurd = ReleaseSetup { flat_gravity: Some(f64::NAN), ..flat };
    let message = Plant::release(&absurd).unwrap_err().to_string();
    assert_eq!(message, "[checkcase] flat_gravity_m_s2 = NaN is outside 0.1 to 30");
}

#[test]
fn drag_of_a_sphere_points_against_the_airflow_whatever_its_attitude() {
    let forces = |phi: f64, theta: f64, psi: f64| {
        let state = InitialState {
            velocity: InitialVelocity::Ned(Ned::new(30.0, -120.0, 50.0)),
            attitude: EulerAngles { phi, theta, psi },
            ..initial(at(0.0, 0.0, 5_000.0))
        };
        let plant = Plant::release(&setup(SPHERE, EarthModel::Flat, state)).unwrap();
        let truth = plant.truth();
        (truth.attitude.to_ned(truth.specific_force).0, truth.density_kg_m3)
    };
    for angles in [(0.0, 0.0, 0.0), (0.0, 0.0, 1.6), (2.0, -1.0, 0.3), (0.5, 1.2, -2.0)] {
        let (force, density) = forces(angles.0, angles.1, angles.2);
        let velocity = Vector3::new(30.0_f64, -120.0, 50.0);
        // 1/2 rho V S C_D against the velocity; 0.1963495 ft2, one slug.
        let per_velocity = 0.5 * density * velocity.norm() * 0.018_241_465 * 0.1 / 14.593_903;
        let expected = velocity * -per_velocity;
        // Seven digits of area and mass.
        assert!((force - expected).norm() < 1e-6 * expected.norm(), "{angles:?}: {force}");
    }
}

#[test]
fn shear_carries_a_sphere_with_the_wind_of_its_altitude_and_the_step_does_not_matter() {
    let level =
        |altitude_m: f64, east: f64| WindLevel { altitude_m, velocity_ned_m_s: [0.0, east, 0.0] };
    let profile = WindProfile::new(vec![level(0.0, -6.096), level(9_144.0, 21.336)]).unwrap();
    for model in EarthModel::ALL {
        let name = model.key();
        let calm = setup(SPHERE, model, initial(at(0.0, 0.0, 9_144.0)));
        let windy = ReleaseSetup { profile: profile.clone(), ..calm.clone() };
        let plant = Plant::release(&windy).unwrap();
        assert!((plant.truth().airspeed_m_s - 21.336).abs() < 1e-9, "{name}");
        assert!((plant.truth().wind.0.y - 21.336).abs() < 1e-9, "{name}");
        let coarse = *flown(&windy, 30).truth();
        let fine = *flown(&ReleaseSetup { step_us: 1_000, ..windy.clone() }, 30).truth();
        let still = *flown(&calm, 30).truth();
        assert!(coarse.velocity.0.y - still.velocity.0.y > 1.0, "{name}");
        // Fourth order: with a wind that is constant during a step it would be 1e-4 m/s.
        let error = (coarse.velocity.0 - fine.velocity.0).norm();
        assert!(error < 1e-7, "{name}: {error} m/s between steps of 1 and 10 ms");
    }
}

#[test]
fn val_trim_of_the_f16_is_that_of_the_nesc_check_cases() {
    // NASA/TM-2015-218675, case 11: 10 013 ft, 400 ft/s north and east; pitch 2.63894 deg, elevator -3.23276 deg, lever 13.87 %.
    let f16 = aircraft::F16_AIRFRAME;
    let speed = 400.0 * 0.304_8;
    let state = InitialState {
        velocity: InitialVelocity::Ned(Ned::new(speed, speed, 0.0)),
        attitude: EulerAngles { phi: 0.0, theta: 0.0, psi: 45_f64.to_radians() },
        rates: InitialRates::Ned(Body::zero()),
        is_trimmed: true,
        ..initial(at(36.019_166_67, -75.674_444_44, 10_013.0 * 0.304_8))
    };
    let plant = Plant::release(&setup(f16, EarthModel::Wgs84, state)).unwrap();
    let trim = plant.trim();
    let [theta, elevator] = [trim.theta_rad, trim.elevator_rad].map(f64::to_degrees);
    assert!((theta - 2.638_94).abs() < 1e-5, "pitch {theta} deg");
    assert!((elevator + 3.232_76).abs() < 1e-5, "elevator {elevator} deg");
    let lever = plant.controls().lever.unwrap();
    // The source's engine takes the geometric altitude, ours the geopotential one: 1.5 m of 3052.
    assert!((100.0 * lever - 13.873_8).abs() < 2e-3, "lever {lever}");
    // With the lever held the thrust follows the air: higher and thinner air, less of it.
    let before = plant.truth().deflections;
    let engine = plant.dynamics().jet().engine().unwrap();
    let climbing = InitialState {
        velocity: InitialVelocity::Ned(Ned::new(speed, speed, -30.0)),
        is_trimmed: false,
        attitude: EulerAngles { theta: 0.2, ..state.attitude },
        ..state
    };
    let controls = plant.controls();
    let mut climbing = setup(f16, EarthModel::Wgs84, climbing);
    climbing.controls = controls;
    let later = *flown(&climbing, 10).truth();
    assert!(later.altitude_m > 3_200.0, "{} m", later.altitude_m);
    assert!((later.deflections[engine] / before[engine] - 1.0).abs() > 1e-3);
}

#[test]
fn controls_move_at_once_and_stay() {
    let f16 = aircraft::F16_AIRFRAME;
    let state = InitialState {
        velocity: InitialVelocity::Ned(Ned::new(180.0, 0.0, 0.0)),
        rates: InitialRates::Ned(Body::zero()),
        is_trimmed: true,
        ..initial(at(30.0, 10.0, 4_000.0))
    };
    let mut plant = Plant::release(&setup(f16, EarthModel::Wgs84, state)).unwrap();
    let start = plant.controls();
    let rudder = plant.dynamics().airframe().effectors.by_key("rudder").unwrap();
    let mut change = Controls { lever: Some(0.1), ..Controls::default() };
    change.positions[rudder] = 0.05;
    let stepped = start.plus(&change);
    assert_eq!(stepped.lever, start.lever.map(|lever| lever + 0.1));
    let thrust = plant.truth().specific_force.0.x;
    plant.set_controls(&stepped);
    assert_eq!(plant.truth().deflections[rudder], 0.05);
    assert!(plant.truth().specific_force.0.x > thrust + 0.1, "more thrust at once");
    plant.advance(&Actuators::new(plant.controls().positions));
    assert_eq!(plant.truth().deflections[rudder], 0.05);
}

#[test]
fn a_state_that_cannot_be_is_refused_with_key_value_and_range() {
    let here = at(0.0, 0.0, 9_144.0);
    let good = setup(BRICK, EarthModel::Wgs84, initial(here));
    let refusal = |initial: InitialState| {
        Plant::release(&ReleaseSetup { initial, ..good.clone() }).unwrap_err().to_string()
    };
    assert_eq!(
        refusal(initial(at(0.0, 0.0, -1.0))),
        "[plant.initial_state] altitude_m = -1 is outside 0 to 80000"
    );
    let fast = InitialVelocity::Ned(Ned::new(f64::INFINITY, 0.0, 0.0));
    let fast = refusal(InitialState { velocity: fast, ..initial(here) });
    assert_eq!(fast, "[plant.initial_state] velocity_ned_m_s = inf is outside -10000 to 10000");
    let spin = InitialRates::Earth(Body::new(0.0, f64::NAN, 0.0));
    let spin = refusal(InitialState { rates: spin, ..initial(here) });
    assert!(spin.starts_with("[plant.initial_state] rates_earth_deg_s = NaN"), "{spin}");
    let trimmed = refusal(InitialState { is_trimmed: true, ..initial(here) });
    assert!(trimmed.starts_with("no pitch angle, elevator and thrust"), "{trimmed}");
    let step = ReleaseSetup { step_us: 0, ..good.clone() };
    let step = Plant::release(&step).unwrap_err();
    assert_eq!(step.to_string(), "[checkcase] step_ms = 0 is outside 0.1 to 100");
}

#[test]
fn a_body_without_effectors_is_refused_where_a_controller_would_fly_it() {
    let setup = crate::tests::nominal(&airframe(BRICK), 1_000);
    assert!(matches!(Plant::new(&setup), Err(SetupError::NoEffector(_))));
}
