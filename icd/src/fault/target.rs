//! The target of a fault: an effector or a sensor.

use serde::{Deserialize, Serialize};

use crate::effector::Effector;
use crate::effector_list::EffectorList;
use crate::sensors::SensorKind;

/// The target of a fault. In data and packets it is one number: effectors by their place, sensors from 128 on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub enum Target {
    /// An effector of the aircraft.
    Effector(Effector),
    /// A sensor.
    Sensor(SensorKind),
}

/// The units of a fault's numbers, in reports and in commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TargetClass {
    /// Turns: deg.
    Angle,
    /// Engine: kN.
    Thrust,
    /// Sensor: the unit of its output.
    Sensor(SensorKind),
}

/// A number that stands for no target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoSuchTarget(u8);

/// Number of the first sensor.
const SENSORS_FROM: u8 = 128;

impl core::fmt::Display for NoSuchTarget {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} is the number of no effector and of no sensor", self.0)
    }
}

impl core::error::Error for NoSuchTarget {}

impl TryFrom<u8> for Target {
    type Error = NoSuchTarget;

    fn try_from(code: u8) -> Result<Self, NoSuchTarget> {
        let target = match code.checked_sub(SENSORS_FROM) {
            Some(sensor) => SensorKind::ALL.get(usize::from(sensor)).copied().map(Self::Sensor),
            None => Effector::from_index(code.into()).map(Self::Effector),
        };
        target.ok_or(NoSuchTarget(code))
    }
}

impl From<Target> for u8 {
    fn from(target: Target) -> Self {
        match target {
            Target::Effector(effector) => effector.code(),
            Target::Sensor(sensor) => SENSORS_FROM + sensor as Self,
        }
    }
}

impl From<Effector> for Target {
    fn from(effector: Effector) -> Self {
        Self::Effector(effector)
    }
}

impl From<SensorKind> for Target {
    fn from(sensor: SensorKind) -> Self {
        Self::Sensor(sensor)
    }
}

impl Target {
    /// Most targets of an aircraft.
    pub const MAX: usize = Effector::MAX + SensorKind::ALL.len();

    /// The effector, if it is one.
    #[must_use]
    pub const fn effector(self) -> Option<Effector> {
        match self {
            Self::Effector(effector) => Some(effector),
            Self::Sensor(_) => None,
        }
    }

    /// Display name.
    #[must_use]
    pub fn name(self, effectors: &EffectorList) -> &str {
        match self {
            Self::Effector(effector) => effectors.name(effector),
            Self::Sensor(sensor) => sensor.name(),
        }
    }

    /// The class, which determines the units.
    #[must_use]
    pub fn class(self, effectors: &EffectorList) -> TargetClass {
        match self {
            Self::Effector(effector) => TargetClass::of(effectors.is_angle(effector)),
            Self::Sensor(sensor) => TargetClass::Sensor(sensor),
        }
    }
}

impl TargetClass {
    /// Of an effector, by whether its values are angles.
    #[must_use]
    pub const fn of(is_angle: bool) -> Self {
        if is_angle { Self::Angle } else { Self::Thrust }
    }

    /// The class of a request's target; [`Self::Angle`] where the request has none.
    #[must_use]
    pub fn of_request(target: Option<Target>, effectors: &EffectorList) -> Self {
        target.map_or(Self::Angle, |target| target.class(effectors))
    }
}

impl SensorKind {
    /// FAILURE_UNIT of MAVLink and its name in PX4's shell. Sensors without a number in MAVLink have one of this project, from 1000 on.
    #[must_use]
    pub const fn failure_unit(self) -> (u16, &'static str) {
        match self {
            Self::Gyro => (0, "gyro"),
            Self::Accelerometer => (1, "accel"),
            Self::Magnetometer => (2, "mag"),
            Self::Barometer => (3, "baro"),
            Self::Gnss => (4, "gps"),
            Self::Pitot => (8, "airspeed"),
            Self::Attitude => (1_000, "attitude"),
            Self::Vanes => (1_001, "vanes"),
            Self::EngineMonitor => (1_002, "engine_mon"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_target_has_a_number_and_comes_back() {
        let known: std::vec::Vec<u8> = (0..=u8::MAX)
            .filter(|code| {
                let target = Target::try_from(*code);
                target.is_ok_and(|target| u8::from(target) == *code)
            })
            .collect();
        assert!(known.iter().copied().eq((0..16).chain(128..137)), "{known:?}");
        for sensor in SensorKind::ALL {
            assert_eq!(Target::try_from(u8::from(Target::from(sensor))), Ok(sensor.into()));
            assert_eq!(SensorKind::by_key(sensor.key()), Some(sensor));
        }
    }
}
