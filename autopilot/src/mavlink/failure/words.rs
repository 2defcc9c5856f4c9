//! Units and types of failures: number in MAVLink, name in PX4's shell. One table for both directions.
//!
//! They are integers on the wire, and some are newer than any library: they are not read as its enums.

use core::fmt;

use arrayvec::ArrayVec;
use icd::fault::FaultKind;
use icd::{Effector, EffectorList};

use crate::mavlink::refused::Refused;

/// FAILURE_UNIT: what can fail, here or elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit(i32);

impl Unit {
    /// The engine.
    pub const MOTOR: Self = Self(101);
    /// What moves: surfaces and nozzle.
    pub const SERVO: Self = Self(102);
    /// Every effector, only to mend and only in MAV_CMD_USER_1: a ground station's button is one command.
    pub const EVERYTHING: Self = Self(-1);

    /// Number, name, and why it does not fail here.
    const TABLE: [(Self, &'static str, &'static str); 17] = [
        (Self(0), "gyro", SENSOR),
        (Self(1), "accel", SENSOR),
        (Self(2), "mag", SENSOR),
        (Self(3), "baro", SENSOR),
        (Self(4), "gps", SENSOR),
        (Self(5), "optical_flow", SENSOR),
        (Self(6), "vio", SENSOR),
        (Self(7), "distance_sensor", SENSOR),
        (Self(8), "airspeed", SENSOR),
        (Self(100), "battery", "there is no battery"),
        (Self::MOTOR, "motor", ""),
        (Self::SERVO, "servo", ""),
        (Self(103), "avoidance", "there is no obstacle avoidance"),
        (Self(104), "rc_signal", "there is no radio, switch the joystick off instead"),
        (Self(105), "mavlink_signal", "stop the ground station instead"),
        (Self(106), "esc", "there are no speed controllers, the engine is motor 1"),
        (Self(107), "traffic_avoidance", "there is no traffic avoidance"),
    ];

    /// The unit with this number, known or not.
    #[must_use]
    pub const fn of_code(code: i32) -> Self {
        Self(code)
    }

    /// The unit with this name.
    #[must_use]
    pub fn parse(name: &str) -> Option<Self> {
        Self::TABLE.iter().find(|(_, known, _)| *known == name).map(|(unit, ..)| *unit)
    }

    /// The unit that an effector belongs to, by whether its values are angles.
    #[must_use]
    pub const fn of(is_angle: bool) -> Self {
        if is_angle { Self::SERVO } else { Self::MOTOR }
    }

    /// Number in MAVLink.
    #[must_use]
    pub const fn code(self) -> i32 {
        self.0
    }

    /// Name, if it has one.
    #[must_use]
    pub fn name(self) -> Option<&'static str> {
        self.row().map(|(_, name, _)| *name)
    }

    /// Names of all units, those included that do not fail here.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::TABLE.iter().map(|(_, name, _)| *name)
    }

    /// Its effectors, by their instances. Empty: it does not fail here.
    #[must_use]
    pub fn effectors(self, all: &EffectorList) -> Effectors {
        match self {
            Self::SERVO => all.by_unit(true),
            Self::MOTOR => all.by_unit(false),
            Self::EVERYTHING => all.all().collect(),
            _ => Effectors::new(),
        }
    }

    /// Its effectors.
    ///
    /// # Errors
    /// Why the unit does not fail here.
    pub fn check(self, all: &EffectorList) -> Result<Effectors, Refused> {
        let effectors = self.effectors(all);
        if !effectors.is_empty() {
            return Ok(effectors);
        }
        let why = self.row().map_or("it is not known", |(.., why)| *why);
        let why = if why.is_empty() { "this aircraft has none" } else { why };
        Err(Refused::unsupported(format!("Fault refused: no failures of unit {self}: {why}")))
    }

    fn row(self) -> Option<&'static (Self, &'static str, &'static str)> {
        Self::TABLE.iter().find(|(unit, ..)| *unit == self)
    }
}

const SENSOR: &str = "the sensors of this aircraft do not fail";

/// Some effectors.
pub type Effectors = ArrayVec<Effector, { Effector::MAX }>;

/// `GPS (4)`; without a name the number.
impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{} ({})", name.to_ascii_uppercase(), self.0),
            None => self.0.fmt(f),
        }
    }
}

/// FAILURE_TYPE, and types of our own, which MAVLink has no numbers for: each says one thing where WRONG,
/// OFF and GARBAGE leave a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureType {
    /// Mended.
    Ok,
    /// Servo: floats. Motor: flame-out.
    Off,
    /// Stuck.
    Stuck,
    /// Oscillates.
    Garbage,
    /// Loss of effect, bias, hard over or limited travel, by the value or by FLT_WRONG_MODE.
    Wrong,
    /// Slow.
    Slow,
    /// Late.
    Delayed,
    /// Follows now and then.
    Intermittent,
    /// Drifts off.
    Drift,
    /// Runs to an end of its travel.
    HardOver,
    /// Off by a constant.
    Bias,
    /// Moves only so far.
    Limit,
    /// The same as GARBAGE.
    Oscillate,
    /// Has lost effect.
    Loss,
    /// Disconnected.
    Float,
    /// The engine is out.
    FlameOut,
}

impl FailureType {
    /// Type, name, and number in MAVLink.
    const TABLE: [(Self, &'static str, Option<u8>); 16] = [
        (Self::Ok, "ok", Some(0)),
        (Self::Off, "off", Some(1)),
        (Self::Stuck, "stuck", Some(2)),
        (Self::Garbage, "garbage", Some(3)),
        (Self::Wrong, "wrong", Some(4)),
        (Self::Slow, "slow", Some(5)),
        (Self::Delayed, "delayed", Some(6)),
        (Self::Intermittent, "intermittent", Some(7)),
        (Self::Drift, "drift", Some(8)),
        (Self::HardOver, "hardover", None),
        (Self::Bias, "bias", None),
        (Self::Limit, "limit", None),
        (Self::Oscillate, "oscillate", None),
        (Self::Loss, "loss", None),
        (Self::Float, "float", None),
        (Self::FlameOut, "flameout", None),
    ];

    /// The type with this number.
    #[must_use]
    pub fn of_code(code: i32) -> Option<Self> {
        let mut rows = Self::TABLE.iter();
        rows.find(|(.., known)| known.is_some_and(|known| i32::from(known) == code))
            .map(|row| row.0)
    }

    /// The type with this name.
    #[must_use]
    pub fn parse(name: &str) -> Option<Self> {
        Self::TABLE.iter().find(|(_, known, _)| *known == name).map(|row| row.0)
    }

    /// The type with a number that stands for a kind of fault.
    #[must_use]
    pub const fn of(kind: &FaultKind) -> Self {
        match kind {
            FaultKind::StuckHere | FaultKind::StuckAt { .. } => Self::Stuck,
            FaultKind::HardOver { .. }
            | FaultKind::PartialLoss { .. }
            | FaultKind::Biased { .. }
            | FaultKind::LimitedTravel { .. } => Self::Wrong,
            FaultKind::Float | FaultKind::FlameOut => Self::Off,
            FaultKind::Slow { .. } => Self::Slow,
            FaultKind::Delayed { .. } => Self::Delayed,
            FaultKind::Intermittent { .. } => Self::Intermittent,
            FaultKind::Oscillating { .. } => Self::Garbage,
            FaultKind::Drifting { .. } => Self::Drift,
        }
    }

    /// Number in MAVLink, for those that have one.
    #[must_use]
    pub fn code(self) -> Option<u8> {
        self.row().and_then(|row| row.2)
    }

    /// Name.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.row().map_or("", |row| row.1)
    }

    /// Names of all types.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::TABLE.iter().map(|(_, name, _)| *name)
    }

    fn row(self) -> Option<&'static (Self, &'static str, Option<u8>)> {
        Self::TABLE.iter().find(|(known, ..)| *known == self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::tvc_jet;

    #[test]
    fn every_name_and_number_comes_back() {
        let all = tvc_jet::effectors();
        for name in Unit::names() {
            let unit = Unit::parse(name).unwrap();
            assert_eq!(unit.name(), Some(name));
            assert_eq!(Unit::of_code(unit.code()), unit);
            assert_eq!(unit.check(&all).is_ok(), !unit.effectors(&all).is_empty(), "{name}");
        }
        for name in FailureType::names() {
            let failure_type = FailureType::parse(name).unwrap();
            assert_eq!(failure_type.name(), name);
            if let Some(code) = failure_type.code() {
                assert_eq!(FailureType::of_code(code.into()), Some(failure_type));
            }
        }
        assert_eq!((Unit::parse("GPS"), FailureType::parse("broken")), (None, None));
        assert_eq!((FailureType::of_code(9), FailureType::of_code(-1)), (None, None));
    }

    #[test]
    fn each_kind_of_fault_has_a_type_with_a_number() {
        for kind in (1..=15).filter_map(|code| FaultKind::from_code(code, [0.5, 0.5])) {
            assert!(FailureType::of(&kind).code().is_some(), "{kind:?}");
        }
    }

    #[test]
    fn a_unit_that_does_not_fail_is_told_by_name_and_number_with_the_reason() {
        let said =
            |code| Unit::of_code(code).check(&tvc_jet::effectors()).unwrap_err().reason.unwrap();
        assert_eq!(
            said(4),
            "Fault refused: no failures of unit GPS (4): the sensors of this aircraft do not fail"
        );
        assert_eq!(said(77), "Fault refused: no failures of unit 77: it is not known");
    }
}
