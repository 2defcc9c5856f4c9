//! The target of a fault: an effector, a sensor, or a part of the airframe.

use serde::{Deserialize, Serialize};

use crate::effector_list::{Effector, EffectorList};
use crate::named;
use crate::sensors::SensorKind;

/// The target of a fault. In data and packets it is one number: effectors by their place, sensors from 128 on, parts from 192 on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub enum Target {
    /// An effector of the aircraft.
    Effector(Effector),
    /// A sensor.
    Sensor(SensorKind),
    /// A part of the airframe.
    Part(AirframePart),
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
    /// Part of the airframe: %.
    Part,
}

named! {
    /// A part of the airframe that can be torn off, from its tip inwards.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
    AirframePart {
        /// Left half of the wing.
        LeftWing = "left_wing",
        /// Right half of the wing.
        RightWing = "right_wing",
        /// Left half of the horizontal tail.
        LeftTail = "left_tail",
        /// Right half of the horizontal tail.
        RightTail = "right_tail",
        /// Vertical tail.
        Fin = "fin",
    }
}

/// A number that stands for no target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoSuchTarget(u8);

/// Number of the first sensor.
const SENSORS_FROM: u8 = 128;
/// Number of the first part.
const PARTS_FROM: u8 = 192;

impl core::fmt::Display for NoSuchTarget {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} is the number of no effector, of no sensor and of no part", self.0)
    }
}

impl core::error::Error for NoSuchTarget {}

impl TryFrom<u8> for Target {
    type Error = NoSuchTarget;

    fn try_from(code: u8) -> Result<Self, NoSuchTarget> {
        let target = match (code.checked_sub(PARTS_FROM), code.checked_sub(SENSORS_FROM)) {
            (Some(part), _) => AirframePart::ALL.get(usize::from(part)).copied().map(Self::Part),
            (None, Some(sensor)) => {
                SensorKind::ALL.get(usize::from(sensor)).copied().map(Self::Sensor)
            }
            (None, None) => Effector::from_index(code.into()).map(Self::Effector),
        };
        target.ok_or(NoSuchTarget(code))
    }
}

impl From<Target> for u8 {
    fn from(target: Target) -> Self {
        match target {
            Target::Effector(effector) => effector.code(),
            Target::Sensor(sensor) => SENSORS_FROM + sensor as Self,
            Target::Part(part) => PARTS_FROM + part as Self,
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

impl From<AirframePart> for Target {
    fn from(part: AirframePart) -> Self {
        Self::Part(part)
    }
}

impl Target {
    /// The unit of engines.
    pub const MOTOR: (u16, &'static str) = (101, "motor");
    /// The unit of effectors that deflect.
    pub const SERVO: (u16, &'static str) = (102, "servo");

    /// Most targets of an aircraft.
    pub const MAX: usize = Effector::MAX + SensorKind::ALL.len() + AirframePart::ALL.len();

    /// Its place in a list of all of them: effectors, then sensors, then parts.
    pub const fn slot(self) -> usize {
        match self {
            Self::Effector(effector) => effector.index(),
            Self::Sensor(sensor) => Effector::MAX + sensor as usize,
            Self::Part(part) => Effector::MAX + SensorKind::ALL.len() + part as usize,
        }
    }

    /// The effector, if it is one.
    pub const fn effector(self) -> Option<Effector> {
        match self {
            Self::Effector(effector) => Some(effector),
            Self::Sensor(_) | Self::Part(_) => None,
        }
    }

    /// Display name.
    pub fn name(self, effectors: &EffectorList) -> &str {
        match self {
            Self::Effector(effector) => effectors.name(effector),
            Self::Sensor(sensor) => sensor.name(),
            Self::Part(part) => part.name(),
        }
    }

    /// What can fail: the effectors of an aircraft, the sensors, and the parts of the airframe.
    pub fn all(effectors: &EffectorList) -> impl Iterator<Item = Self> + '_ {
        let others = SensorKind::ALL.into_iter().map(Self::Sensor);
        let others = others.chain(AirframePart::ALL.into_iter().map(Self::Part));
        effectors.all().map(Self::Effector).chain(others)
    }

    /// Name in files.
    pub fn key(self, effectors: &EffectorList) -> &str {
        match self {
            Self::Effector(effector) => effectors.key(effector),
            Self::Sensor(sensor) => sensor.key(),
            Self::Part(part) => part.key(),
        }
    }

    /// FAILURE_UNIT of MAVLink and its name in PX4's shell.
    pub fn unit(self, effectors: &EffectorList) -> (u16, &'static str) {
        match self {
            Self::Effector(effector) if effectors.is_angle(effector) => Self::SERVO,
            Self::Effector(_) => Self::MOTOR,
            Self::Sensor(sensor) => sensor.failure_unit(),
            Self::Part(part) => (part.failure_unit(), part.key()),
        }
    }

    /// All of these.
    pub fn units() -> impl Iterator<Item = (u16, &'static str)> {
        let sensors = SensorKind::ALL.into_iter().map(SensorKind::failure_unit);
        let parts = AirframePart::ALL.into_iter().map(|part| (part.failure_unit(), part.key()));
        [Self::MOTOR, Self::SERVO].into_iter().chain(sensors).chain(parts)
    }

    /// Number within its unit, from 1.
    pub fn instance(self, effectors: &EffectorList) -> u8 {
        self.effector().map_or(1, |effector| effectors.instance(effector))
    }

    /// The class, which determines the units.
    pub fn class(self, effectors: &EffectorList) -> TargetClass {
        match self {
            Self::Effector(effector) => TargetClass::of(effectors.is_angle(effector)),
            Self::Sensor(sensor) => TargetClass::Sensor(sensor),
            Self::Part(_) => TargetClass::Part,
        }
    }
}

impl TargetClass {
    /// Of an effector, by whether its values are angles.
    pub const fn of(is_angle: bool) -> Self {
        if is_angle { Self::Angle } else { Self::Thrust }
    }

    /// The class of a request's target; [`Self::Angle`] where the request has none.
    pub fn of_request(target: Option<Target>, effectors: &EffectorList) -> Self {
        target.map_or(Self::Angle, |target| target.class(effectors))
    }
}

impl AirframePart {
    /// Display name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::LeftWing => "left wing",
            Self::RightWing => "right wing",
            Self::LeftTail => "left tail",
            Self::RightTail => "right tail",
            Self::Fin => "fin",
        }
    }

    /// FAILURE_UNIT: a number of this project, because MAVLink has none.
    pub const fn failure_unit(self) -> u16 {
        1_010 + self as u16
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
        assert!(known.iter().copied().eq((0..16).chain(128..140).chain(192..197)), "{known:?}");
        for part in AirframePart::ALL {
            assert_eq!(Target::try_from(u8::from(Target::from(part))), Ok(part.into()));
        }
        for sensor in SensorKind::ALL {
            assert_eq!(Target::try_from(u8::from(Target::from(sensor))), Ok(sensor.into()));
            assert_eq!(SensorKind::by_key(sensor.key()), Some(sensor));
        }
    }
}
