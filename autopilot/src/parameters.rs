//! The parameter table: every tunable of the autopilot with name, unit, range and meaning.

use flight_control::gains::{GainError, Lemma1Warning, TUNABLES};
use flight_control::{CompensatorMode, Gains, MainLaw, ObserverMode};

use crate::vehicle::{LinkLossAction, Reference, VehicleRefusal};

mod table;

pub use table::table;

/// All parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// What the laws read.
    pub gains: Gains,
    /// References that are accepted.
    pub limits: ReferenceLimits,
    /// Fault injection.
    pub failure: FailureParameters,
    /// Guidance.
    pub navigation: NavigationParameters,
    /// Silence of ground stations.
    pub link: LinkParameters,
    /// Rates of the streams.
    pub streams: StreamParameters,
}

/// Parameters of the guidance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NavigationParameters {
    /// Period of the lateral guidance, s.
    pub l1_period_s: f64,
    /// Damping of the lateral guidance.
    pub l1_damping: f64,
    /// Largest bank angle that the guidance asks for, deg.
    pub bank_max_deg: f64,
    /// Radius of circles that have none of their own, m.
    pub loiter_radius_m: f64,
    /// Smallest acceptance radius of waypoints, m.
    pub acceptance_m: f64,
    /// Largest climb rate of stick and offboard references, m/s.
    pub climb_max_m_s: f64,
    /// Altitude of the return, m above the ellipsoid.
    pub return_altitude_m: f64,
}

/// What silence of ground stations leads to, and when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkParameters {
    /// What happens when the controlling ground station falls silent.
    pub loss_action: LinkLossAction,
    /// Silence after which it happens, wall time, s.
    pub loss_s: f64,
    /// Silence of an offboard stream after which Offboard ends, wall time, s.
    pub offboard_loss_s: f64,
    /// Silence of a pilot's sticks after which Altitude ends, wall time, s.
    pub sticks_loss_s: f64,
}

/// Default rates of the streams, Hz of wall time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StreamParameters {
    /// Attitude.
    pub attitude_hz: f64,
    /// Position and speed.
    pub position_hz: f64,
    /// Commands of the effectors.
    pub actuators_hz: f64,
    /// What the compensator does.
    pub compensator_hz: f64,
}

/// References that are accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceLimits {
    /// Lowest altitude, m.
    pub altitude_min_m: f64,
    /// Highest altitude, m.
    pub altitude_max_m: f64,
    /// Lowest true airspeed, m/s.
    pub airspeed_min_m_s: f64,
    /// Highest true airspeed, m/s.
    pub airspeed_max_m_s: f64,
    /// Largest roll angle either way, deg.
    pub roll_max_deg: f64,
}

/// Parameters of fault injection: what MAV_CMD_INJECT_FAILURE has no room for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FailureParameters {
    /// Fault injection is allowed.
    pub enabled: bool,
    /// STUCK means stuck at `stuck_deg` instead of where it is.
    pub stuck_at_angle: bool,
    /// Angle of STUCK, deg.
    pub stuck_deg: f64,
    /// A stuck effector travels to its angle at the actuator's rate instead of jumping.
    pub stuck_travels: bool,
    /// Effect that is left after WRONG, percent.
    pub remaining_pct: f64,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            gains: Gains::REFERENCE,
            limits: ReferenceLimits {
                altitude_min_m: 500.0,
                altitude_max_m: 12_000.0,
                airspeed_min_m_s: 180.0,
                airspeed_max_m_s: 320.0,
                roll_max_deg: 45.0,
            },
            failure: FailureParameters {
                enabled: true,
                stuck_at_angle: false,
                stuck_deg: 0.0,
                stuck_travels: false,
                remaining_pct: 50.0,
            },
            navigation: NavigationParameters {
                l1_period_s: 25.0,
                l1_damping: 0.75,
                bank_max_deg: 45.0,
                loiter_radius_m: 10_000.0,
                acceptance_m: 500.0,
                climb_max_m_s: 30.0,
                return_altitude_m: 5_000.0,
            },
            link: LinkParameters {
                loss_action: LinkLossAction::Continue,
                loss_s: 10.0,
                offboard_loss_s: 0.5,
                sticks_loss_s: 0.5,
            },
            streams: StreamParameters {
                attitude_hz: 25.0,
                position_hz: 10.0,
                actuators_hz: 10.0,
                compensator_hz: 10.0,
            },
        }
    }
}

/// How a parameter travels over MAVLink.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// MAV_PARAM_TYPE_INT32.
    Int,
    /// MAV_PARAM_TYPE_REAL32.
    Real,
}

/// One row of the parameter table.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Name, at most 16 characters.
    pub name: &'static str,
    /// Wire type.
    pub kind: Kind,
    /// Unit; `-` for none.
    pub unit: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// What it does.
    pub meaning: &'static str,
    get: Get,
    set: Set,
}

#[derive(Debug, Clone, Copy)]
enum Get {
    Gain(fn(&Gains) -> f64),
    Own(fn(&Parameters) -> f64),
}

#[derive(Debug, Clone, Copy)]
enum Set {
    Gain(fn(&mut Gains, f64)),
    Own(fn(&mut Parameters, f64)),
}

/// Why a parameter was not set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParameterError {
    /// No such name.
    #[error("there is no parameter {name}")]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// Not finite or outside the range.
    #[error("{name} = {value} is outside {min} to {max} {unit}")]
    OutOfRange {
        /// Parameter.
        name: &'static str,
        /// Refused value.
        value: f64,
        /// Smallest allowed.
        min: f64,
        /// Largest allowed.
        max: f64,
        /// Unit of the numbers.
        unit: &'static str,
    },
    /// The set as a whole cannot be flown.
    #[error("{0}")]
    Gains(#[from] GainError),
}

impl Parameter {
    /// Value now.
    #[must_use]
    pub fn value(&self, parameters: &Parameters) -> f64 {
        match self.get {
            Get::Gain(get) => get(&parameters.gains),
            Get::Own(get) => get(parameters),
        }
    }
}

impl Parameters {
    /// Sets one parameter and checks the whole set. Integers are rounded.
    ///
    /// # Errors
    /// [`ParameterError`]; nothing changes then. `Ok(Some(warning))` means set, with a warning.
    pub fn set(&mut self, name: &str, value: f64) -> Result<Option<Lemma1Warning>, ParameterError> {
        let parameter = table()
            .iter()
            .find(|parameter| parameter.name == name)
            .ok_or_else(|| ParameterError::Unknown { name: name.to_owned() })?;
        let value = match parameter.kind {
            Kind::Int => libm::round(value),
            Kind::Real => value,
        };
        let Parameter { name, unit, min, max, .. } = *parameter;
        if !(min..=max).contains(&value) {
            return Err(ParameterError::OutOfRange { name, value, min, max, unit });
        }
        let mut changed = *self;
        match parameter.set {
            Set::Gain(set) => set(&mut changed.gains, value),
            Set::Own(set) => set(&mut changed, value),
        }
        changed.limits.check_order()?;
        let warning = changed.gains.validate()?;
        *self = changed;
        Ok(warning)
    }
}

impl ReferenceLimits {
    /// Checks a reference; NaN is outside every range.
    ///
    /// # Errors
    /// [`VehicleRefusal::OutOfRange`].
    pub fn check(&self, reference: Reference) -> Result<(), VehicleRefusal> {
        let (what, unit, value, min, max) = match reference {
            Reference::Altitude(value) => {
                ("altitude", "m", value, self.altitude_min_m, self.altitude_max_m)
            }
            Reference::Airspeed(value) => {
                ("airspeed", "m/s", value, self.airspeed_min_m_s, self.airspeed_max_m_s)
            }
            Reference::Roll(value) => {
                ("roll", "deg", value.to_degrees(), -self.roll_max_deg, self.roll_max_deg)
            }
            Reference::Course(value) => ("course", "deg", value.to_degrees(), -180.0, 360.0),
        };
        if (min..=max).contains(&value) {
            Ok(())
        } else {
            Err(VehicleRefusal::OutOfRange { what, unit, value, min, max })
        }
    }

    fn check_order(&self) -> Result<(), ParameterError> {
        for (name, value, max, unit) in [
            ("REF_ALT_MIN", self.altitude_min_m, self.altitude_max_m, "m"),
            ("FW_AIRSPD_MIN", self.airspeed_min_m_s, self.airspeed_max_m_s, "m/s"),
        ] {
            if value > max {
                return Err(ParameterError::OutOfRange { name, value, min: 0.0, max, unit });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_short_enough_and_defaults_are_inside_their_range() {
        for (i, row) in table().iter().enumerate() {
            assert!(row.name.len() <= 16, "{}", row.name);
            assert!(table()[..i].iter().all(|other| other.name != row.name), "{}", row.name);
            let value = row.value(&Parameters::default());
            assert!((row.min..=row.max).contains(&value), "{} = {value} {}", row.name, row.unit);
        }
    }

    #[test]
    fn every_parameter_reads_what_was_set_and_refuses_what_is_outside() {
        for row in table() {
            let mut parameters = Parameters::default();
            let middle = if row.kind == Kind::Int { row.max } else { 0.5 * (row.min + row.max) };
            if parameters.set(row.name, middle).is_ok() {
                assert!((row.value(&parameters) - middle).abs() < 1e-9, "{}", row.name);
            }
            let before = parameters;
            for bad in [f64::NAN, f64::INFINITY, row.max * 1.01 + 1.0, row.min - 1.0] {
                assert!(parameters.set(row.name, bad).is_err(), "{} = {bad}", row.name);
            }
            assert_eq!(parameters, before);
        }
    }

    #[test]
    fn a_lower_limit_above_its_upper_limit_is_refused() {
        let mut parameters = Parameters::default();
        parameters.set("FW_AIRSPD_MAX", 250.0).unwrap();
        assert!(parameters.set("FW_AIRSPD_MIN", 260.0).is_err());
    }

    #[test]
    fn a_set_outside_lemma_1_is_accepted_with_a_warning() {
        let mut parameters = Parameters::default();
        assert!(parameters.set("OBS_KB", 1.5).unwrap().is_some());
        assert!((parameters.gains.observer.rate_factor - 1.5).abs() < 1e-12);
    }
}
