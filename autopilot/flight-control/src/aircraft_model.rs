//! The controller's model of the aircraft: numbers only, read from a file at start.
//!
//! The plant has its own airframe file. The two share nothing, so model error can always be expressed.

use core::fmt;

use icd::PerEffector;
use icd::effector_list::Name;
use icd::wire::Aircraft;
use serde::{Deserialize, Serialize};

mod effectors;
pub mod schedule;

pub use effectors::{EffectorFile, EffectorModel, ServoModel, TablesError};
pub use schedule::{Schedule, SchedulePoint};

/// A table of the model file: each number with the range in which the laws can fly with it.
macro_rules! table {
    ($(#[$about:meta])* $table:ident in $name:literal {
        $($(#[$doc:meta])* $key:ident: $min:literal to $max:literal;)*
    }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $table {
            $($(#[$doc])* pub $key: f64,)*
        }

        impl $table {
            fn validate(&self) -> Result<(), AircraftModelError> {
                $(check(concat!($name, ".", stringify!($key)), self.$key, $min, $max)?;)*
                Ok(())
            }

            /// Between these numbers and others, one by one.
            pub fn mixed(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
                Self { $($key: of(self.$key, other.$key)),* }
            }
        }
    };
}

/// The controller's model of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AircraftModel {
    /// Name of the aircraft, as in the airframe file that was linearised.
    pub aircraft: Name,
    /// Mass and inertia.
    pub mass: MassModel,
    /// Reference lengths.
    pub geometry: GeometryModel,
    /// Moment coefficients with all surfaces at zero.
    pub airframe: AirframeModel,
    /// Lift coefficients.
    pub lift: LiftModel,
    /// The nozzle; `None` for an aircraft without one.
    #[serde(default)]
    pub nozzle: Option<NozzleModel>,
    /// What the engine does beside its thrust; `None` where that is nothing.
    #[serde(default)]
    pub engine: Option<EngineModel>,
    /// Steady level flight at the design point.
    pub trim: TrimModel,
    /// Where the air data are measured; `None` in models of earlier versions.
    #[serde(default)]
    pub air_data: Option<AirDataModel>,
    /// The effectors: what they are, how the healthy ones move, what they do.
    #[serde(rename = "effector")]
    pub effectors: EffectorModel,
    /// What changes with the flight condition.
    #[serde(default, rename = "at")]
    pub schedule: Schedule,
}

table! {
    /// Mass and inertia.
    MassModel in "mass" {
        /// m, kg.
        mass_kg: 0.1 to 1.0e6;
        /// Ixx, kg m².
        ixx_kg_m2: 1.0e-4 to 1.0e9;
        /// Iyy, kg m².
        iyy_kg_m2: 1.0e-4 to 1.0e9;
        /// Izz, kg m².
        izz_kg_m2: 1.0e-4 to 1.0e9;
        /// Ixz = +∫xz dm, kg m².
        ixz_kg_m2: -1.0e9 to 1.0e9;
    }
}

table! {
    /// Reference lengths.
    GeometryModel in "geometry" {
        /// S: wing area, m².
        wing_area_m2: 0.01 to 1.0e4;
        /// b: span, m.
        span_m: 0.1 to 1.0e3;
        /// c: mean chord, m.
        chord_m: 0.01 to 1.0e3;
    }
}

table! {
    /// Moment coefficients with all surfaces at zero, per rad; rates in rad/s times b/2V or c/2V.
    AirframeModel in "airframe" {
        /// Roll moment per sideslip.
        c_roll_beta: -10.0 to 10.0;
        /// Roll moment per roll rate.
        c_roll_p: -100.0 to 100.0;
        /// Roll moment per yaw rate.
        c_roll_r: -100.0 to 100.0;
        /// Pitch moment at zero angle of attack.
        c_pitch_0: -10.0 to 10.0;
        /// Pitch moment per angle of attack.
        c_pitch_alpha: -10.0 to 10.0;
        /// Pitch moment per pitch rate.
        c_pitch_q: -1.0e3 to 1.0e3;
        /// Yaw moment per sideslip.
        c_yaw_beta: -10.0 to 10.0;
        /// Yaw moment per roll rate.
        c_yaw_p: -100.0 to 100.0;
        /// Yaw moment per yaw rate.
        c_yaw_r: -100.0 to 100.0;
        /// Angles of attack and sideslip up to here act in full, rad.
        stall_onset_rad: 1.0e-3 to 1.5;
        /// No angle acts with more than this, rad.
        stall_ceiling_rad: 1.0e-3 to 1.6;
    }
}

table! {
    /// Lift coefficients, per rad; the pitch rate in rad/s times c/2V.
    LiftModel in "lift" {
        /// Lift at zero angle of attack.
        c_lift_0: -10.0 to 10.0;
        /// Lift per angle of attack.
        c_lift_alpha: -100.0 to 100.0;
        /// Lift per pitch rate.
        c_lift_q: -1.0e3 to 1.0e3;
    }
}

table! {
    /// The nozzle.
    NozzleModel in "nozzle" {
        /// x_T: nozzle to centre of gravity, m.
        arm_m: 0.01 to 1.0e3;
        /// Smallest thrust that a nozzle command is computed with, N: below it the nozzle has hardly any authority.
        thrust_floor_n: 1.0e-3 to 1.0e7;
    }
}

table! {
    /// Roll moment of what turns with the engine, as a propeller: a zero and a slope over the thrust.
    EngineModel in "engine" {
        /// Roll moment without thrust, N m.
        roll_zero_n_m: -1.0e6 to 1.0e6;
        /// Roll moment per thrust, m.
        roll_per_thrust_m: -100.0 to 100.0;
    }
}

/// Where the air data are measured, and what the air tells of the sideslip: for the estimator.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirDataModel {
    /// Vanes of angle of attack and sideslip, m from the centre of gravity, body axes.
    pub vanes_m: [f64; 3],
    /// Pitot tube, m from the centre of gravity, body axes.
    pub pitot_m: [f64; 3],
    /// Side force per sideslip, per rad; zero if it is not known.
    #[serde(default)]
    pub c_side_beta: f64,
}

table! {
    /// Steady level flight at the design point.
    TrimModel in "trim" {
        /// Airspeed, m/s.
        airspeed_m_s: 1.0 to 1.0e3;
        /// Altitude, m.
        altitude_m: 0.0 to 25_000.0;
        /// Pitch angle, rad.
        theta_rad: -1.0 to 1.0;
        /// Main command to the elevators, rad.
        elevator_rad: -1.5 to 1.5;
        /// Thrust, N.
        thrust_n: -1.0e7 to 1.0e7;
    }
}

/// Sums over the effectors that each law divides by.
const ROLL_PER_COMMAND: &str = "effector.c_roll times roll (of all effectors)";
const PITCH_PER_COMMAND: &str = "effector.c_pitch times pitch (of all effectors)";

/// The first number of a model that the laws cannot fly with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AircraftModelError {
    /// Which `[[at]]` the key belongs to, counted from 1; 0 for the rest of the file.
    pub point: u8,
    /// Name of the effector that the key belongs to; empty for the keys of the other tables.
    pub effector: Name,
    /// Key in the file.
    pub key: &'static str,
    /// The refused value.
    pub value: f64,
    /// Smallest allowed.
    pub min: f64,
    /// Largest allowed.
    pub max: f64,
}

impl fmt::Display for AircraftModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { point, effector, key, value, min, max } = self;
        if *point > 0 {
            write!(f, "[[at]] number {point}: ")?;
        }
        if !effector.is_empty() {
            write!(f, "effector `{effector}`: ")?;
        }
        match *key {
            ROLL_PER_COMMAND if *value == 0.0 => f.write_str("no effector rolls: ")?,
            PITCH_PER_COMMAND if *value == 0.0 => f.write_str("no effector pitches: ")?,
            _ => {}
        }
        write!(f, "{key} = {value} is outside {min} to {max}")
    }
}

impl core::error::Error for AircraftModelError {}

impl AircraftModel {
    /// Identity of the aircraft in packets.
    pub fn aircraft(&self) -> Aircraft {
        Aircraft::new(self.aircraft, &self.effectors.list)
    }

    /// Distance of the nozzle behind the centre of gravity, m; zero without one.
    pub fn nozzle_arm_m(&self) -> f64 {
        self.nozzle.map_or(0.0, |nozzle| nozzle.arm_m)
    }

    /// Where each effector stands in the design trim, rad; engine N.
    pub fn trim_positions(&self) -> PerEffector<f64> {
        // On the rotating Earth the trim has some aileron and rudder too, which hold a slow turn. The model leaves
        // them out.
        let command = [0.0, self.trim.elevator_rad, 0.0, self.trim.thrust_n];
        PerEffector::from_fn(|effector| self.effectors.gains[effector].of(command))
    }

    /// Checks every number.
    pub fn validate(&self) -> Result<(), AircraftModelError> {
        self.mass.validate()?;
        self.geometry.validate()?;
        self.airframe.validate()?;
        let AirframeModel { stall_onset_rad, stall_ceiling_rad, .. } = self.airframe;
        check("airframe.stall_ceiling_rad", stall_ceiling_rad, stall_onset_rad + 1.0e-3, 1.6)?;
        self.lift.validate()?;
        self.trim.validate()?;
        self.nozzle.as_ref().map_or(Ok(()), NozzleModel::validate)?;
        self.engine.as_ref().map_or(Ok(()), EngineModel::validate)?;
        if let Some(air_data) = &self.air_data {
            for value in air_data.vanes_m {
                check("air_data.vanes_m", value, -100.0, 100.0)?;
            }
            for value in air_data.pitot_m {
                check("air_data.pitot_m", value, -100.0, 100.0)?;
            }
            check("air_data.c_side_beta", air_data.c_side_beta, -100.0, 100.0)?;
        }
        let effectors = &self.effectors;
        effectors.validate()?;
        let [min, max] = effectors.thrust_range_n();
        check("trim.thrust_n", self.trim.thrust_n, min, max)?;
        // The compensator divides by the aileron command's roll moment and by the inertia's determinant.
        let roll = effectors.per_command(&effectors.c_roll, |gains| gains.roll);
        // Negative, as the signs of `icd` want it: otherwise every law would feed its error back the wrong way.
        check(ROLL_PER_COMMAND, roll, -10.0, -1.0e-6)?;
        // The trim of level flight divides by the elevator command's pitching moment and by the slope of the lift
        // with the elevators that balance it.
        let pitch = effectors.per_command(&effectors.c_pitch, |gains| gains.pitch);
        check(PITCH_PER_COMMAND, pitch, -10.0, -1.0e-6)?;
        let trimmed = -self.airframe.c_pitch_alpha / pitch;
        let lift = effectors.per_command(&effectors.c_lift, |gains| gains.pitch);
        let slope = self.lift.c_lift_alpha + lift * trimmed;
        check("lift.c_lift_alpha (with balanced elevators)", slope, 1.0e-3, 100.0)?;
        let MassModel { ixx_kg_m2, izz_kg_m2, ixz_kg_m2, .. } = self.mass;
        // Ixz² must be smaller, or no body has this inertia.
        let determinant = ixx_kg_m2 * izz_kg_m2 - ixz_kg_m2 * ixz_kg_m2;
        check("mass.ixz_kg_m2 (ixx izz - ixz^2)", determinant, 1.0e-9, 1.0e18)?;
        self.schedule.validate(self)
    }
}

fn check(key: &'static str, value: f64, min: f64, max: f64) -> Result<(), AircraftModelError> {
    check_of(&Name::new(), key, value, min, max)
}

fn check_of(
    effector: &Name,
    key: &'static str,
    value: f64,
    min: f64,
    max: f64,
) -> Result<(), AircraftModelError> {
    // NaN is in no range, so this refuses it too.
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(AircraftModelError { point: 0, effector: *effector, key, value, min, max })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use icd::tvc_jet;
    use std::string::ToString;

    #[test]
    fn the_test_model_is_valid_and_a_nan_in_it_is_named() {
        let mut aircraft = testing::aircraft_model();
        assert_eq!(aircraft.validate(), Ok(()));
        aircraft.geometry.span_m = f64::NAN;
        assert_eq!(aircraft.validate().unwrap_err().key, "geometry.span_m");
    }

    #[test]
    fn a_number_of_an_effector_that_cannot_be_is_named_with_it() {
        let mut aircraft = testing::aircraft_model();
        aircraft.effectors.servos[tvc_jet::RUDDER].lag_s = -1.0;
        let error = aircraft.validate().unwrap_err().to_string();
        assert_eq!(error, "effector `rudder`: lag_s = -1 is outside 0.001 to 60");
    }

    #[test]
    fn an_aileron_without_roll_moment_is_refused() {
        let mut aircraft = testing::aircraft_model();
        aircraft.effectors.c_roll = PerEffector::default();
        let error = aircraft.validate().unwrap_err().to_string();
        assert!(error.starts_with("no effector rolls: effector.c_roll times roll"), "{error}");
    }

    #[test]
    fn the_trim_stands_in_the_elevators_and_the_engine() {
        let aircraft = testing::aircraft_model();
        let at = aircraft.trim_positions();
        assert_eq!(at[tvc_jet::LEFT_ELEVATOR], aircraft.trim.elevator_rad);
        assert_eq!(at[tvc_jet::RIGHT_ELEVATOR], aircraft.trim.elevator_rad);
        assert_eq!(at[tvc_jet::ENGINE], aircraft.trim.thrust_n);
        assert_eq!(at[tvc_jet::RUDDER], 0.0);
    }

    #[test]
    fn a_list_that_cannot_be_is_refused_when_the_file_is_read() {
        let text = aircraft::DEFAULT_MODEL;
        let text = text.replace("partner = \"right aileron\"", "partner = \"right wing\"");
        let error = toml::from_str::<AircraftModel>(&text).unwrap_err().to_string();
        assert!(error.contains("`right wing`: this file has no effector"), "{error}");
    }
}
