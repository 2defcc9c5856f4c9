//! Derives the controller's belief from the plant at its design trim.
//!
//! The belief is a file, because the controller may not look at the plant: `sitl linearize` writes it, and
//! a test keeps it current. Derivatives are central differences of the plant's own aerodynamics.

use flight_control::Belief;
use flight_control::belief::{
    AirframeBelief, EffectorBelief, GeometryBelief, LiftBelief, MassBelief, NozzleBelief,
    ServoBelief, TrimBelief,
};
use icd::{Body, Effector, PerEffector};
use plant_sim::aerodynamics::{self, AirState, Coefficients, Surfaces};
use plant_sim::{Airframe, Plant, PlantSetup, SetupError, Trim};

/// By this line a model is recognised as one of this program, which it may write over.
pub const MARK: &str = "# Written by `sitl linearize`";

/// Half width of the differences in angles, rad.
const ANGLE_STEP_RAD: f64 = 1.0e-3;
/// Half width of the differences in body rates, rad/s.
const RATE_STEP_RAD_S: f64 = 1.0e-2;
/// Digits that are kept: the differences are good to about eleven.
const DIGITS: i32 = 9;

/// Linearises the plant of a setup at its trim.
///
/// # Errors
/// [`SetupError`] if the plant has no trim.
pub fn linearize(setup: &PlantSetup) -> Result<Belief, SetupError> {
    let plant = Plant::new(setup)?;
    let trim = plant.trim();
    let airframe = &setup.airframe;
    let surfaces = airframe.surfaces();
    let airspeed_m_s = setup.start.airspeed_m_s;
    let local = Local { airframe, surfaces, airspeed_m_s, trim };
    let mass = &airframe.mass;
    Ok(Belief {
        aircraft: airframe.name,
        mass: MassBelief {
            mass_kg: mass.mass_kg,
            ixx_kg_m2: mass.ixx_kg_m2,
            iyy_kg_m2: mass.iyy_kg_m2,
            izz_kg_m2: mass.izz_kg_m2,
            ixz_kg_m2: mass.ixz_kg_m2,
        },
        geometry: GeometryBelief {
            wing_area_m2: airframe.aero.area_m2,
            span_m: airframe.aero.span_m,
            chord_m: airframe.aero.chord_m,
        },
        airframe: local.airframe_belief(),
        lift: local.lift_belief(),
        nozzle: airframe.nozzle.map(|nozzle| NozzleBelief {
            arm_m: nozzle.arm_m,
            thrust_floor_n: nozzle.thrust_floor_n,
        }),
        effectors: local.effector_belief(),
        trim: TrimBelief {
            airspeed_m_s: setup.start.airspeed_m_s,
            altitude_m: setup.start.altitude_m,
            theta_rad: rounded(trim.theta_rad),
            elevator_rad: rounded(trim.elevator_rad),
            thrust_n: rounded(trim.thrust_n),
        },
    })
}

/// The plant around its trim.
struct Local<'a> {
    airframe: &'a Airframe,
    surfaces: Surfaces,
    airspeed_m_s: f64,
    trim: &'a Trim,
}

impl Local<'_> {
    fn at(
        &self,
        alpha_rad: f64,
        beta_rad: f64,
        rates: Body,
        positions: &PerEffector<f64>,
    ) -> Coefficients {
        let air = AirState { airspeed_m_s: self.airspeed_m_s, alpha_rad, beta_rad, rates };
        aerodynamics::coefficients(&self.airframe.aero, &self.surfaces, &air, positions)
    }

    fn clean(&self, alpha_rad: f64, beta_rad: f64, rates: Body) -> Coefficients {
        self.at(alpha_rad, beta_rad, rates, &PerEffector::default())
    }

    fn airframe_belief(&self) -> AirframeBelief {
        let alpha = self.trim.alpha_rad;
        let still = Body::zero();
        let d_alpha = difference(ANGLE_STEP_RAD, |d| self.clean(alpha + d, 0.0, still));
        let d_beta = difference(ANGLE_STEP_RAD, |d| self.clean(alpha, d, still));
        let rate =
            |axis: Body| difference(RATE_STEP_RAD_S, |d| self.clean(alpha, 0.0, Body(axis.0 * d)));
        let (d_p, d_q, d_r) = (
            rate(Body::new(1.0, 0.0, 0.0)),
            rate(Body::new(0.0, 1.0, 0.0)),
            rate(Body::new(0.0, 0.0, 1.0)),
        );
        let aero = &self.airframe.aero;
        let per_span = 2.0 * self.airspeed_m_s / aero.span_m;
        let per_chord = 2.0 * self.airspeed_m_s / aero.chord_m;
        AirframeBelief {
            c_roll_beta: rounded(d_beta.roll),
            c_roll_p: rounded(d_p.roll * per_span),
            c_roll_r: rounded(d_r.roll * per_span),
            c_pitch_0: rounded(self.clean(alpha, 0.0, still).pitch - d_alpha.pitch * alpha),
            c_pitch_alpha: rounded(d_alpha.pitch),
            c_pitch_q: rounded(d_q.pitch * per_chord),
            c_yaw_beta: rounded(d_beta.yaw),
            c_yaw_p: rounded(d_p.yaw * per_span),
            c_yaw_r: rounded(d_r.yaw * per_span),
            stall_onset_rad: rounded(aero.alpha_linear_rad),
            stall_ceiling_rad: rounded(aero.alpha_max_rad),
        }
    }

    fn lift_belief(&self) -> LiftBelief {
        let (alpha, still) = (self.trim.alpha_rad, Body::zero());
        let d_alpha = difference(ANGLE_STEP_RAD, |d| self.clean(alpha + d, 0.0, still));
        let d_q = difference(RATE_STEP_RAD_S, |d| self.clean(alpha, 0.0, Body::new(0.0, d, 0.0)));
        let per_chord = 2.0 * self.airspeed_m_s / self.airframe.aero.chord_m;
        LiftBelief {
            c_lift_0: rounded(self.clean(alpha, 0.0, still).lift - d_alpha.lift * alpha),
            c_lift_alpha: rounded(d_alpha.lift),
            c_lift_q: rounded(d_q.lift * per_chord),
        }
    }

    fn effector_belief(&self) -> EffectorBelief {
        let Airframe { effectors: list, servos, gains, .. } = self.airframe;
        let alpha = self.trim.alpha_rad;
        let slopes = PerEffector::from_fn(|effector: Effector| {
            difference(ANGLE_STEP_RAD, |d| {
                let mut positions = PerEffector::default();
                positions[effector] = d;
                self.at(alpha, 0.0, Body::zero(), &positions)
            })
        });
        let column = |of: fn(&Slopes) -> f64| {
            PerEffector::from_fn(|effector| rounded(of(&slopes[effector])))
        };
        let servo = |effector: Effector| {
            let servo = &servos[effector];
            if list.is_angle(effector) {
                ServoBelief {
                    lag_s: servo.lag_s,
                    rate_limit: rounded(servo.rate_limit),
                    min: rounded(servo.min),
                    max: rounded(servo.max),
                }
            } else {
                let (lag_s, min, max) = (servo.lag_s, servo.min, servo.max);
                ServoBelief { lag_s, rate_limit: servo.rate_limit, min, max }
            }
        };
        let mut beliefs = PerEffector::default();
        for effector in list.all() {
            beliefs[effector] = servo(effector);
        }
        EffectorBelief {
            list: *list,
            servos: beliefs,
            c_lift: column(|slopes| slopes.lift),
            c_roll: column(|slopes| slopes.roll),
            c_pitch: column(|slopes| slopes.pitch),
            c_yaw: column(|slopes| slopes.yaw),
            gains: *gains,
        }
    }
}

#[derive(Clone, Copy)]
struct Slopes {
    lift: f64,
    roll: f64,
    pitch: f64,
    yaw: f64,
}

/// Central difference of the coefficients of lift and moments.
fn difference(step: f64, at: impl Fn(f64) -> Coefficients) -> Slopes {
    let (above, below) = (at(step), at(-step));
    let slope = |a: f64, b: f64| (a - b) / (2.0 * step);
    Slopes {
        lift: slope(above.lift, below.lift),
        roll: slope(above.roll, below.roll),
        pitch: slope(above.pitch, below.pitch),
        yaw: slope(above.yaw, below.yaw),
    }
}

/// Keeps [`DIGITS`] significant digits, so that the file does not carry rounding noise.
fn rounded(value: f64) -> f64 {
    if value.abs() < 1.0e-12 {
        return 0.0;
    }
    let text = format!("{value:.*e}", usize::try_from(DIGITS - 1).unwrap_or(0));
    text.parse().unwrap_or(value)
}

/// The belief as the file that the autopilot reads.
///
/// # Errors
/// Only if a number cannot be written as TOML, which a validated belief has none of.
pub fn to_toml(belief: &Belief) -> Result<String, toml::ser::Error> {
    let body = toml::to_string_pretty(belief)?;
    Ok(format!(
        "# What the controller believes about the aircraft: the plant's airframe linearised at its design trim.\n\
         {MARK}; do not edit. Angles in rad, coefficients per rad.\n\n{body}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_keeps_nine_digits() {
        assert_eq!(rounded(0.123_456_789_123), 0.123_456_789);
        assert_eq!(rounded(-27_120.123_456_7), -27_120.123_5);
        assert_eq!(rounded(1.0e-17), 0.0);
    }
}
