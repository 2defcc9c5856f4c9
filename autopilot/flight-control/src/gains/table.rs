//! The table of tunables: name, unit, range, meaning, and where the value lives in [`Gains`].
//!
//! The rows are in the file of each law, as one `gain_set` with the fields and the values of [`Gains::REFERENCE`].

use super::{
    ActivationGains, EstimatorGains, Gains, GroundGains, IncrementalGains, IsolationGains,
    LinearEsoGains, NdiGains, NesoGains, ReferenceGains, ReliefGains,
};
use crate::main_controller::pid::{AltitudeGains, RollGains, SpeedGains, YawGains};

/// One tunable gain.
#[derive(Debug, Clone, Copy)]
pub struct Tunable {
    /// Parameter name, at most 16 characters.
    pub name: &'static str,
    /// Unit; `-` for none.
    pub unit: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// What it does.
    pub meaning: &'static str,
    /// Reads it.
    pub get: fn(&Gains) -> f64,
    /// Writes it; check the set with [`Gains::validate`] afterwards.
    pub set: fn(&mut Gains, f64),
}

/// A part of [`Gains`], each gain stated once: field and value, parameter name and unit, range, meaning.
macro_rules! gain_set {
    ($(#[$about:meta])* $set:ident at $($place:ident).+ {
        $($(#[$doc:meta])* $field:ident = $value:literal, $name:literal $unit:literal, $min:literal to $max:literal, $meaning:literal;)*
    }) => {
        #[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
        $(#[$about])*
        pub struct $set {
            $($(#[$doc])* pub $field: f64,)*
        }

        impl $set {
            /// The documented values.
            pub const REFERENCE: Self = Self { $($field: $value),* };

            /// Rows of the parameter table.
            pub(crate) const ROWS: &[$crate::gains::Tunable] = &[$($crate::gains::Tunable {
                name: $name,
                unit: $unit,
                min: $min,
                max: $max,
                meaning: $meaning,
                get: |gains| Self::of(gains).$field,
                set: |gains, value| Self::of_mut(gains).$field = value,
            }),*];

            fn of(gains: &$crate::Gains) -> &Self {
                &gains.$($place).+
            }

            fn of_mut(gains: &mut $crate::Gains) -> &mut Self {
                &mut gains.$($place).+
            }
        }

        impl Default for $set {
            fn default() -> Self {
                Self::REFERENCE
            }
        }
    };
}

/// Rows of [`super::LqrGains`], whose inputs share the type of their gains: name, unit, range, field, meaning.
macro_rules! lqr_rows {
    ($($name:literal, $unit:literal, $min:literal, $max:literal, $($field:ident).+, $meaning:literal;)*) => {
        &[$(Tunable {
            name: $name,
            unit: $unit,
            min: $min,
            max: $max,
            meaning: $meaning,
            get: |gains| gains.lqr.$($field).+,
            set: |gains, value| gains.lqr.$($field).+ = value,
        }),*]
    };
}

/// The rows of each block, in the order of the parameters.
const BLOCKS: &[&[Tunable]] = &[
    ReferenceGains::ROWS,
    AltitudeGains::ROWS,
    RollGains::ROWS,
    YawGains::ROWS,
    SpeedGains::ROWS,
    NdiGains::ROWS,
    LQR,
    NesoGains::ROWS,
    LinearEsoGains::ROWS,
    IncrementalGains::ROWS,
    ActivationGains::ROWS,
    ReliefGains::ROWS,
    IsolationGains::ROWS,
    EstimatorGains::ROWS,
    GroundGains::ROWS,
];

/// Rows of [`super::LqrGains`].
pub const LQR: &[Tunable] = lqr_rows! {
    "LQR_E_CLB", "rad s/m", -1.0, 1.0, elevator.climb, "Elevator per climb rate";
    "LQR_E_V", "rad s/m", -1.0, 1.0, elevator.airspeed, "Elevator per airspeed error";
    "LQR_E_TH", "-", -50.0, 50.0, elevator.theta, "Elevator per pitch angle";
    "LQR_E_Q", "s", -50.0, 50.0, elevator.q, "Elevator per pitch rate";
    "LQR_E_H", "rad/m", -1.0, 1.0, elevator.altitude, "Elevator per altitude error";
    "LQR_E_HI", "rad/(m s)", -1.0, 1.0, elevator.altitude_i, "Elevator per integral of the altitude error";
    "LQR_E_VI", "rad/m", -1.0, 1.0, elevator.airspeed_i, "Elevator per integral of the airspeed error";
    "LQR_T_CLB", "1/s", -50.0, 50.0, thrust.climb, "Thrust per mass and climb rate";
    "LQR_T_V", "1/s", -50.0, 50.0, thrust.airspeed, "Thrust per mass and airspeed error";
    "LQR_T_TH", "m/s^2", -1000.0, 1000.0, thrust.theta, "Thrust per mass and pitch angle";
    "LQR_T_Q", "m/s", -1000.0, 1000.0, thrust.q, "Thrust per mass and pitch rate";
    "LQR_T_H", "1/s^2", -50.0, 50.0, thrust.altitude, "Thrust per mass and altitude error";
    "LQR_T_HI", "1/s^3", -50.0, 50.0, thrust.altitude_i, "Thrust per mass and integral of the altitude error";
    "LQR_T_VI", "1/s^2", -50.0, 50.0, thrust.airspeed_i, "Thrust per mass and integral of the airspeed error";
    "LQR_A_B", "-", -50.0, 50.0, aileron.beta, "Aileron per sideslip";
    "LQR_A_P", "s", -50.0, 50.0, aileron.p, "Aileron per roll rate";
    "LQR_A_R", "s", -50.0, 50.0, aileron.r, "Aileron per yaw rate";
    "LQR_A_PHI", "-", -50.0, 50.0, aileron.phi, "Aileron per roll angle error";
    "LQR_A_PHII", "1/s", -50.0, 50.0, aileron.phi_i, "Aileron per integral of the roll angle error";
    "LQR_R_B", "-", -50.0, 50.0, rudder.beta, "Rudder per sideslip";
    "LQR_R_P", "s", -50.0, 50.0, rudder.p, "Rudder per roll rate";
    "LQR_R_R", "s", -50.0, 50.0, rudder.r, "Rudder per yaw rate";
    "LQR_R_PHI", "-", -50.0, 50.0, rudder.phi, "Rudder per roll angle error";
    "LQR_R_PHII", "1/s", -50.0, 50.0, rudder.phi_i, "Rudder per integral of the roll angle error";
    "LQR_ERR_MAX", "m", 1.0, 5000.0, error_max_m, "Largest altitude error that the regulator sees";
};

/// All tunable gains.
pub fn tunables() -> impl Iterator<Item = &'static Tunable> {
    BLOCKS.iter().copied().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_fit_a_mavlink_parameter_and_are_unique() {
        for (i, tunable) in tunables().enumerate() {
            assert!(tunable.name.len() <= 16, "{}", tunable.name);
            assert!(tunables().take(i).all(|other| other.name != tunable.name), "{}", tunable.name);
        }
    }

    #[test]
    fn each_entry_reads_what_it_writes_and_nothing_else() {
        for tunable in tunables() {
            let mut gains = Gains::REFERENCE;
            (tunable.set)(&mut gains, 0.123_456);
            for other in tunables() {
                let expected = if other.name == tunable.name {
                    0.123_456
                } else {
                    (other.get)(&Gains::REFERENCE)
                };
                assert_eq!(
                    (other.get)(&gains),
                    expected,
                    "{} through {}",
                    other.name,
                    tunable.name
                );
            }
        }
    }
}
