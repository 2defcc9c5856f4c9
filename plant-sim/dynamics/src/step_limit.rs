//! Whether the integration can follow an aircraft: its fastest motion in the air against the step.

use host_io::problem::{Problem, problem};
use icd::{Body, PerEffector};
use nalgebra::Vector3;

use crate::aerodynamics::{Aerodynamics, AirState, Geometry};
use crate::airframe::Airframe;
use crate::contact;
use crate::dynamics::Dynamics;
use crate::gear::Gear;
use crate::rigid_body::MassProperties;
use crate::start::Start;

/// Largest product of rate and step. RK4 is stable up to 2.78; the rest is room for flight that is faster and lower than
/// the start.
const RATE_TIMES_STEP_MAX: f64 = 1.0;

/// An aircraft that moves faster than the integration can follow.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{problem}")]
pub struct TooQuick {
    /// Key of the airframe file whose value is too small, of a contact point too large.
    pub key: &'static str,
    /// Smallest value with which the motion is slow enough, of a contact point the largest.
    pub limit: f64,
    pub problem: Problem,
}

/// Checks the rates of the single motions at the start: damping of heave, sideslip, roll, pitch and yaw, 1/s, and the
/// natural frequencies of pitch and yaw, rad/s (B. Etkin, Dynamics of Atmospheric Flight, 1972, sections 5.9 and 5.10:
/// dimensional derivatives). `density` in kg/m3.
///
/// # Errors
/// [`TooQuick`] with the key whose value would have to be larger.
pub fn check(
    dynamics: &Dynamics,
    start: &Start,
    density: f64,
    step_us: u32,
) -> Result<(), Box<TooQuick>> {
    let Airframe { mass, aero, .. } = dynamics.airframe();
    let Geometry { area_m2, span_m, chord_m } = aero.geometry();
    let v = start.airspeed_m_s;
    let force = 0.5 * density * v * v * area_m2;
    let (per_chord, per_span) = (0.5 * chord_m / v, 0.5 * span_m / v);
    let (pitch, lateral) = (force * chord_m, force * span_m);
    let slopes = slopes(dynamics, start, [per_chord, per_span]);
    let (m, ixx, iyy, izz) = (mass.mass_kg, mass.ixx_kg_m2, mass.iyy_kg_m2, mass.izz_kg_m2);
    let (roll_damping, pitch_damping) = (lateral * per_span, pitch * per_chord);
    // Value and derivative with their keys, the quantity divided by the value, and whether that is a rate or its square; in the order
    // of the slopes.
    let motions = [
        ("mass_kg", m, "heave", "c_lift_alpha", force / v, false),
        ("mass_kg", m, "sideslip", "c_side_beta", force / v, false),
        ("ixx_kg_m2", ixx, "roll rate", "c_roll_p", roll_damping, false),
        ("iyy_kg_m2", iyy, "pitch rate", "c_pitch_q", pitch_damping, false),
        ("iyy_kg_m2", iyy, "pitch", "c_pitch_alpha", pitch, true),
        ("izz_kg_m2", izz, "yaw rate", "c_yaw_r", roll_damping, false),
        ("izz_kg_m2", izz, "yaw", "c_yaw_beta", lateral, true),
    ];
    let rate_max = RATE_TIMES_STEP_MAX * 1.0e6 / f64::from(step_us);
    for ((key, value, motion, derivative_key, factor, is_square), derivative) in
        motions.into_iter().zip(slopes)
    {
        let quotient = (derivative * factor).abs() / value;
        let (rate, limit) = match is_square {
            true => (quotient.sqrt(), rate_max * rate_max),
            false => (quotient, rate_max),
        };
        if rate > rate_max {
            // The quotient is inverse to the value, so this value brings it down to the limit.
            let (min, altitude_m) = (value * quotient / limit, start.altitude_m);
            let problem = problem!(
                "[mass] {key} = {value} is too small for [aerodynamics] {derivative_key} = {derivative}: in flight at {v} m/s and \
                 {altitude_m} m the {motion} would change at {rate:.0} 1/s, and an integration step of {step_us} us can follow \
                 {rate_max:.0} 1/s; at least {min:.4} is needed"
            );
            return Err(Box::new(TooQuick { key, limit: min, problem }));
        }
    }
    Ok(())
}

/// Checks each contact point at its effective mass: the natural frequencies of its springs across and along the ground and the rate of
/// its damper, 1/s, against the step.
///
/// # Errors
/// [`TooQuick`] with the key whose value would have to be smaller.
pub fn check_contacts(
    gear: &Gear,
    mass: &MassProperties,
    step_us: u32,
) -> Result<(), Box<TooQuick>> {
    let rate_max = RATE_TIMES_STEP_MAX * 1.0e6 / f64::from(step_us);
    for contact in &gear.contacts {
        let at = contact.at_m.into();
        let (across, along) = (
            contact::per_effective_mass(mass, &at, &Vector3::z()),
            contact::per_effective_mass_along(mass, &at),
        );
        for (key, value, per_kg, is_square) in [
            ("spring_n_m", contact.spring_n_m, across, true),
            ("damper_n_s_m", contact.damper_n_s_m, across, false),
            ("grip_spring_n_m", contact.grip_spring_n_m, along, true),
        ] {
            let rate = if is_square { (value * per_kg).sqrt() } else { value * per_kg };
            if rate > rate_max {
                let most = if is_square { rate_max * rate_max } else { rate_max } / per_kg;
                let (name, kg) = (contact.name, 1.0 / per_kg);
                let problem = problem!(
                    "[gear.contact.{name}] {key} = {value} is too large for its effective mass of {kg:.4} kg: the point would move \
                     at {rate:.0} 1/s, and an integration step of {step_us} us can follow {rate_max:.0} 1/s; at most {most:.4} is \
                     possible"
                );
                return Err(Box::new(TooQuick { key, limit: most, problem }));
            }
        }
    }
    Ok(())
}

/// The derivatives that the rates follow from: those of the file; for tables the central differences at an angle of attack of zero.
fn slopes(dynamics: &Dynamics, start: &Start, [per_chord, per_span]: [f64; 2]) -> [f64; 7] {
    if let Aerodynamics::Derivatives(a) = &dynamics.airframe().aero {
        return [
            a.c_lift_alpha,
            a.c_side_beta,
            a.c_roll_p,
            a.c_pitch_q,
            a.c_pitch_alpha,
            a.c_yaw_r,
            a.c_yaw_beta,
        ];
    }
    let (airspeed_m_s, altitude_m) = (start.airspeed_m_s, start.altitude_m);
    let at = |alpha_rad, beta_rad, rates| {
        let air = AirState { airspeed_m_s, alpha_rad, beta_rad, rates };
        dynamics.coefficients(&air, altitude_m, &PerEffector::default())
    };
    let still = Body::zero();
    [
        difference(|d| at(d, 0.0, still).lift),
        difference(|d| at(0.0, d, still).side),
        difference(|d| at(0.0, 0.0, Body::new(d / per_span, 0.0, 0.0)).roll),
        difference(|d| at(0.0, 0.0, Body::new(0.0, d / per_chord, 0.0)).pitch),
        difference(|d| at(d, 0.0, still).pitch),
        difference(|d| at(0.0, 0.0, Body::new(0.0, 0.0, d / per_span)).yaw),
        difference(|d| at(0.0, d, still).yaw),
    ]
}

/// Central difference of a coefficient over an angle, or a rate over 2V.
fn difference(at: impl Fn(f64) -> f64) -> f64 {
    const STEP: f64 = 1.0e-2;
    (at(STEP) - at(-STEP)) / (2.0 * STEP)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::nominal;
    use crate::{Plant, SetupError};
    use icd::Actuators;

    /// Flies a tenth of a second with fixed effectors; whether the state stayed finite, or why it did not start.
    fn fly(change: impl Fn(&mut Airframe), step_us: u32) -> Result<bool, SetupError> {
        let mut airframe = Airframe::paper();
        change(&mut airframe);
        let mut setup = nominal(&airframe, step_us);
        setup.wind.turbulence_m_s = 3.0;
        let mut plant = Plant::new(&setup)?;
        let commands = Actuators::new(plant.trim().positions());
        for _ in 0..50 {
            plant.advance(&commands);
        }
        Ok(!plant.is_broken())
    }

    #[test]
    fn a_motion_that_is_too_quick_is_refused_and_a_slower_one_stays_finite() {
        for (key, value) in
            [("mass_kg", 3.0), ("ixx_kg_m2", 1.0), ("iyy_kg_m2", 0.01), ("izz_kg_m2", 0.01)]
        {
            for step_us in [500, 1_000, 2_000] {
                // The product of inertia must fit the small moments.
                let change = |airframe: &mut Airframe, value: f64| {
                    let mass = &mut airframe.mass;
                    mass.ixz_kg_m2 = 0.0;
                    match key {
                        "mass_kg" => mass.mass_kg = value,
                        "ixx_kg_m2" => mass.ixx_kg_m2 = value,
                        "iyy_kg_m2" => mass.iyy_kg_m2 = value,
                        _ => mass.izz_kg_m2 = value,
                    }
                };
                let refused = match fly(|airframe| change(airframe, value), step_us) {
                    Err(SetupError::TooQuick(refused)) => refused,
                    other => panic!("{key} = {value}: {other:?}"),
                };
                assert_eq!(refused.key, key);
                assert!(refused.limit > value, "{refused}");
                let enough = refused.limit * 1.001;
                let flown = fly(|airframe| change(airframe, enough), step_us);
                // Another motion may be the next one.
                match flown {
                    Err(SetupError::TooQuick(next)) => {
                        assert!(next.limit > enough || next.key != key);
                    }
                    // So light an aircraft may have no level flight.
                    Err(SetupError::Trim(_)) => {}
                    other => assert_eq!(other, Ok(true), "{key} = {enough}, {step_us} us"),
                }
            }
        }
    }
}
