//! What the controller believes about the aircraft: numbers only, read from a file at start.
//!
//! The plant has its own airframe file. The two share nothing, so model error can always be expressed.

use core::fmt;

use icd::{Effector, PerEffector};
use serde::{Deserialize, Serialize};

/// The controller's belief about the aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Belief {
    /// Mass and inertia.
    pub mass: MassBelief,
    /// Reference lengths and the nozzle's place.
    pub geometry: GeometryBelief,
    /// Moment coefficients with all surfaces at zero.
    pub airframe: AirframeBelief,
    /// Lift coefficients.
    pub lift: LiftBelief,
    /// Moment coefficients of each surface.
    pub surfaces: SurfaceBelief,
    /// How healthy effectors move.
    pub effectors: EffectorBelief,
    /// Steady level flight at the design point.
    pub trim: TrimBelief,
}

/// Mass and inertia.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MassBelief {
    /// m, kg.
    pub mass_kg: f64,
    /// Ixx, kg m².
    pub ixx_kg_m2: f64,
    /// Iyy, kg m².
    pub iyy_kg_m2: f64,
    /// Izz, kg m².
    pub izz_kg_m2: f64,
    /// Ixz = +∫xz dm, kg m².
    pub ixz_kg_m2: f64,
}

/// Reference lengths and the nozzle's place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeometryBelief {
    /// S: wing area, m².
    pub wing_area_m2: f64,
    /// b: span, m.
    pub span_m: f64,
    /// c: mean chord, m.
    pub chord_m: f64,
    /// x_T: nozzle to centre of gravity, m.
    pub nozzle_arm_m: f64,
}

/// Moment coefficients with all surfaces at zero, per rad; rates in rad/s times b/2V or c/2V.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirframeBelief {
    /// Roll moment per sideslip.
    pub c_roll_beta: f64,
    /// Roll moment per roll rate.
    pub c_roll_p: f64,
    /// Roll moment per yaw rate.
    pub c_roll_r: f64,
    /// Pitch moment at zero angle of attack.
    pub c_pitch_0: f64,
    /// Pitch moment per angle of attack.
    pub c_pitch_alpha: f64,
    /// Pitch moment per pitch rate.
    pub c_pitch_q: f64,
    /// Yaw moment per sideslip.
    pub c_yaw_beta: f64,
    /// Yaw moment per roll rate.
    pub c_yaw_p: f64,
    /// Yaw moment per yaw rate.
    pub c_yaw_r: f64,
    /// Angles of attack and sideslip up to here act in full, rad.
    pub stall_onset_rad: f64,
    /// No angle acts with more than this, rad.
    pub stall_ceiling_rad: f64,
}

/// Lift coefficients, per rad; the pitch rate in rad/s times c/2V.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LiftBelief {
    /// Lift at zero angle of attack.
    pub c_lift_0: f64,
    /// Lift per angle of attack.
    pub c_lift_alpha: f64,
    /// Lift per pitch rate.
    pub c_lift_q: f64,
    /// Lift per deflection of one elevator.
    pub c_lift_elevator: f64,
}

/// Moment coefficients of the five surfaces, per rad, in the order left and right aileron, left and
/// right elevator, rudder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SurfaceBelief {
    /// Roll moment per deflection.
    pub c_roll: [f64; 5],
    /// Pitch moment per deflection.
    pub c_pitch: [f64; 5],
    /// Yaw moment per deflection.
    pub c_yaw: [f64; 5],
}

/// How healthy effectors move: lag, rate limit, travel.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectorBelief {
    /// Ailerons.
    pub aileron: ServoBelief,
    /// Elevators.
    pub elevator: ServoBelief,
    /// Rudder.
    pub rudder: ServoBelief,
    /// Nozzle, both axes.
    pub nozzle: ServoBelief,
    /// Smallest thrust, N.
    pub thrust_min_n: f64,
    /// Largest thrust, N.
    pub thrust_max_n: f64,
}

/// One kind of servo.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ServoBelief {
    /// Time constant of the first-order lag, s.
    pub lag_s: f64,
    /// Rate limit, rad/s.
    pub rate_limit_rad_s: f64,
    /// Travel either way, rad.
    pub travel_rad: f64,
}

/// Steady level flight at the design point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrimBelief {
    /// Airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// Pitch angle, rad.
    pub theta_rad: f64,
    /// Elevator, both sides, rad.
    pub elevator_rad: f64,
    /// Thrust, N.
    pub thrust_n: f64,
}

/// A belief that the laws cannot fly with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeliefError {
    /// Key in the file.
    pub key: &'static str,
    /// The refused value.
    pub value: f64,
    /// Smallest allowed.
    pub min: f64,
    /// Largest allowed.
    pub max: f64,
}

impl fmt::Display for BeliefError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, value, min, max } = self;
        write!(f, "{key} = {value} is outside {min} to {max}")
    }
}

impl core::error::Error for BeliefError {}

impl Belief {
    /// The servo of an effector; `None` for the engine.
    #[must_use]
    pub const fn servo(&self, effector: Effector) -> Option<&ServoBelief> {
        match effector {
            Effector::LeftAileron | Effector::RightAileron => Some(&self.effectors.aileron),
            Effector::LeftElevator | Effector::RightElevator => Some(&self.effectors.elevator),
            Effector::Rudder => Some(&self.effectors.rudder),
            Effector::NozzlePitch | Effector::NozzleYaw => Some(&self.effectors.nozzle),
            Effector::Engine => None,
        }
    }

    /// Where each effector stands in the design trim, rad; engine N.
    #[must_use]
    pub fn trim_positions(&self) -> PerEffector<f64> {
        PerEffector::from_fn(|effector| match effector {
            Effector::LeftElevator | Effector::RightElevator => self.trim.elevator_rad,
            Effector::Engine => self.trim.thrust_n,
            _ => 0.0,
        })
    }

    /// Checks every number.
    ///
    /// # Errors
    /// [`BeliefError`] names the first key that is not finite or outside its range.
    pub fn validate(&self) -> Result<(), BeliefError> {
        for (key, value, min, max) in self.scalars() {
            check(key, value, min, max)?;
        }
        let surfaces = &self.surfaces;
        for (key, row) in [
            ("surfaces.c_roll", surfaces.c_roll),
            ("surfaces.c_pitch", surfaces.c_pitch),
            ("surfaces.c_yaw", surfaces.c_yaw),
        ] {
            row.iter().try_for_each(|value| check(key, *value, -10.0, 10.0))?;
        }
        // The compensator divides by the aileron pair's roll moment and by the inertia's determinant.
        let pair = surfaces.c_roll[1] - surfaces.c_roll[0];
        check("surfaces.c_roll (right minus left aileron)", pair, -10.0, -1.0e-6)?;
        // The trim of level flight divides by the elevators' pitching moment and by the slope of the lift with
        // the elevators that balance it.
        let pair = surfaces.c_pitch[2] + surfaces.c_pitch[3];
        check("surfaces.c_pitch (both elevators)", pair, -10.0, -1.0e-6)?;
        let trimmed = -self.airframe.c_pitch_alpha / pair;
        let slope = self.lift.c_lift_alpha + 2.0 * self.lift.c_lift_elevator * trimmed;
        check("lift.c_lift_alpha (with balanced elevators)", slope, 1.0e-3, 100.0)?;
        let MassBelief { ixx_kg_m2, izz_kg_m2, ixz_kg_m2, .. } = self.mass;
        let determinant = ixx_kg_m2 * izz_kg_m2 - ixz_kg_m2 * ixz_kg_m2;
        check("mass.ixz_kg_m2 (ixx izz - ixz^2)", determinant, 1.0e-9, 1.0e18)
    }

    fn scalars(&self) -> [(&'static str, f64, f64, f64); 43] {
        let Self { mass, geometry, airframe, lift, effectors, trim, .. } = self;
        let EffectorBelief { aileron, elevator, rudder, nozzle, .. } = effectors;
        [
            ("mass.mass_kg", mass.mass_kg, 0.1, 1.0e6),
            ("mass.ixx_kg_m2", mass.ixx_kg_m2, 1.0e-4, 1.0e9),
            ("mass.iyy_kg_m2", mass.iyy_kg_m2, 1.0e-4, 1.0e9),
            ("mass.izz_kg_m2", mass.izz_kg_m2, 1.0e-4, 1.0e9),
            ("mass.ixz_kg_m2", mass.ixz_kg_m2, -1.0e9, 1.0e9),
            ("geometry.wing_area_m2", geometry.wing_area_m2, 0.01, 1.0e4),
            ("geometry.span_m", geometry.span_m, 0.1, 1.0e3),
            ("geometry.chord_m", geometry.chord_m, 0.01, 1.0e3),
            ("geometry.nozzle_arm_m", geometry.nozzle_arm_m, 0.01, 1.0e3),
            ("airframe.c_roll_beta", airframe.c_roll_beta, -10.0, 10.0),
            ("airframe.c_roll_p", airframe.c_roll_p, -100.0, 100.0),
            ("airframe.c_roll_r", airframe.c_roll_r, -100.0, 100.0),
            ("airframe.c_pitch_0", airframe.c_pitch_0, -10.0, 10.0),
            ("airframe.c_pitch_alpha", airframe.c_pitch_alpha, -10.0, 10.0),
            ("airframe.c_pitch_q", airframe.c_pitch_q, -1.0e3, 1.0e3),
            ("airframe.c_yaw_beta", airframe.c_yaw_beta, -10.0, 10.0),
            ("airframe.c_yaw_p", airframe.c_yaw_p, -100.0, 100.0),
            ("airframe.c_yaw_r", airframe.c_yaw_r, -100.0, 100.0),
            ("lift.c_lift_0", lift.c_lift_0, -10.0, 10.0),
            ("lift.c_lift_alpha", lift.c_lift_alpha, -100.0, 100.0),
            ("lift.c_lift_q", lift.c_lift_q, -1.0e3, 1.0e3),
            ("lift.c_lift_elevator", lift.c_lift_elevator, -10.0, 10.0),
            ("airframe.stall_onset_rad", airframe.stall_onset_rad, 1.0e-3, 1.5),
            (
                "airframe.stall_ceiling_rad",
                airframe.stall_ceiling_rad,
                airframe.stall_onset_rad + 1.0e-3,
                1.6,
            ),
            ("effectors.aileron.lag_s", aileron.lag_s, 1.0e-3, 10.0),
            ("effectors.aileron.rate_limit_rad_s", aileron.rate_limit_rad_s, 1.0e-3, 100.0),
            ("effectors.aileron.travel_rad", aileron.travel_rad, 1.0e-3, 1.5),
            ("effectors.elevator.lag_s", elevator.lag_s, 1.0e-3, 10.0),
            ("effectors.elevator.rate_limit_rad_s", elevator.rate_limit_rad_s, 1.0e-3, 100.0),
            ("effectors.elevator.travel_rad", elevator.travel_rad, 1.0e-3, 1.5),
            ("effectors.rudder.lag_s", rudder.lag_s, 1.0e-3, 10.0),
            ("effectors.rudder.rate_limit_rad_s", rudder.rate_limit_rad_s, 1.0e-3, 100.0),
            ("effectors.rudder.travel_rad", rudder.travel_rad, 1.0e-3, 1.5),
            ("effectors.nozzle.lag_s", nozzle.lag_s, 1.0e-3, 10.0),
            ("effectors.nozzle.rate_limit_rad_s", nozzle.rate_limit_rad_s, 1.0e-3, 100.0),
            ("effectors.nozzle.travel_rad", nozzle.travel_rad, 1.0e-3, 1.5),
            ("effectors.thrust_min_n", effectors.thrust_min_n, 1.0e-3, 1.0e7),
            ("effectors.thrust_max_n", effectors.thrust_max_n, effectors.thrust_min_n, 1.0e7),
            ("trim.airspeed_m_s", trim.airspeed_m_s, 1.0, 1.0e3),
            ("trim.altitude_m", trim.altitude_m, 0.0, 25_000.0),
            ("trim.theta_rad", trim.theta_rad, -1.0, 1.0),
            ("trim.elevator_rad", trim.elevator_rad, -1.5, 1.5),
            ("trim.thrust_n", trim.thrust_n, effectors.thrust_min_n, effectors.thrust_max_n),
        ]
    }
}

fn check(key: &'static str, value: f64, min: f64, max: f64) -> Result<(), BeliefError> {
    if (min..=max).contains(&value) { Ok(()) } else { Err(BeliefError { key, value, min, max }) }
}

#[cfg(test)]
mod tests {
    use crate::testing;

    #[test]
    fn the_test_belief_is_valid_and_a_nan_in_it_is_named() {
        let mut belief = testing::belief();
        assert_eq!(belief.validate(), Ok(()));
        belief.geometry.span_m = f64::NAN;
        assert_eq!(belief.validate().unwrap_err().key, "geometry.span_m");
    }

    #[test]
    fn an_aileron_without_roll_moment_is_refused() {
        let mut belief = testing::belief();
        belief.surfaces.c_roll = [0.0; 5];
        assert!(belief.validate().is_err());
    }
}
