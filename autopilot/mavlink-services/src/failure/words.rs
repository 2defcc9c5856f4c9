//! Units and types of failures: number in MAVLink, name in PX4's shell. One table for both directions.
//!
//! They are integers on the wire, and some are newer than any library: they are not read as its enums.

use core::fmt;

use arrayvec::ArrayVec;
use icd::fault::{CATALOGUE, FailureType, KindInfo, Refusal, SensorKind, Target, TargetClass};
use icd::{Effector, EffectorList};

use crate::refused::Refused;

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
    const TABLE: [(Self, &'static str, &'static str); 11] = [
        (Self::MOTOR, "motor", ""),
        (Self::SERVO, "servo", ""),
        (Self(5), "optical_flow", "there is no such sensor"),
        (Self(6), "vio", "there is no such sensor"),
        (Self(7), "distance_sensor", "there is no such sensor"),
        (Self(100), "battery", "there is no battery"),
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
        Self::all().find(|(_, known)| *known == name).map(|(unit, _)| unit)
    }

    /// The unit that a target belongs to.
    #[must_use]
    pub fn of(target: Target, effectors: &EffectorList) -> Self {
        match target {
            Target::Effector(effector) if effectors.is_angle(effector) => Self::SERVO,
            Target::Effector(_) => Self::MOTOR,
            Target::Sensor(sensor) => Self(sensor.failure_unit().0.into()),
        }
    }

    fn sensor(self) -> Option<SensorKind> {
        let is_it = |sensor: &SensorKind| i32::from(sensor.failure_unit().0) == self.0;
        SensorKind::ALL.into_iter().find(is_it)
    }

    /// Number in MAVLink.
    #[must_use]
    pub const fn code(self) -> i32 {
        self.0
    }

    /// Name, if it has one.
    #[must_use]
    pub fn name(self) -> Option<&'static str> {
        Self::all().find(|(unit, _)| *unit == self).map(|(_, name)| name)
    }

    /// Names of all units, those included that do not fail here.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::all().map(|(_, name)| name)
    }

    fn all() -> impl Iterator<Item = (Self, &'static str)> {
        let sensors = SensorKind::ALL.into_iter().map(SensorKind::failure_unit);
        let others = Self::TABLE.iter().map(|(unit, name, _)| (*unit, *name));
        let all = others.chain(sensors.map(|(code, name)| (Self(code.into()), name)));
        let mut all: Vec<_> = all.collect();
        all.sort_unstable_by_key(|(unit, _)| unit.0);
        all.into_iter()
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
        if self.sensor().is_some() {
            let why = Refusal::NoSensorFaults.described(TargetClass::Sensor);
            return Err(Refused::unsupported(format!(
                "Fault refused: no failures of unit {self}: {why}"
            )));
        }
        let row = Self::TABLE.iter().find(|(unit, ..)| *unit == self);
        let why = row.map_or("it is not known", |(.., why)| *why);
        let why = if why.is_empty() { "this aircraft has none" } else { why };
        Err(Refused::unsupported(format!("Fault refused: no failures of unit {self}: {why}")))
    }
}

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

/// What an order does to its targets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Failure {
    /// A type of MAVLink: mends, or is one of its kinds, by the value or by the parameter of its mode.
    Type(FailureType),
    /// This kind, and no other of its type.
    Kind(&'static KindInfo),
}

impl Failure {
    /// Mended.
    pub const OK: Self = Self::Type(FailureType::Ok);

    /// The one with this name.
    #[must_use]
    pub fn parse(name: &str) -> Option<Self> {
        Self::all().find(|failure| failure.name() == name)
    }

    /// Those of MAVLink by their number, then those that mean one kind.
    pub fn all() -> impl Iterator<Item = Self> {
        let kinds = CATALOGUE.iter().filter(|kind| kind.mavlink.word.is_some());
        FailureType::ALL.into_iter().map(Self::Type).chain(kinds.map(Self::Kind))
    }

    /// Name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Type(failure_type) => failure_type.name(),
            Self::Kind(kind) => kind.mavlink.word.unwrap_or(kind.key),
        }
    }

    /// The kinds that it can be, in the order of the type's mode.
    pub fn kinds(self) -> impl Iterator<Item = &'static KindInfo> {
        let mut kinds: Vec<&KindInfo> = Vec::new();
        kinds.extend(CATALOGUE.iter().filter(|kind| match self {
            Self::Type(failure_type) => kind.mavlink.failure_type == failure_type,
            Self::Kind(this) => kind.code == this.code,
        }));
        kinds.sort_by_key(|kind| kind.mavlink.first_mode);
        kinds.into_iter()
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
        for failure in Failure::all() {
            assert_eq!(Failure::parse(failure.name()), Some(failure));
            let kinds = failure.kinds().count();
            assert!((failure == Failure::OK) == (kinds == 0), "{}: {kinds} kinds", failure.name());
        }
        assert_eq!((Unit::parse("GPS"), Failure::parse("broken")), (None, None));
        assert_eq!((FailureType::from_code(9), FailureType::from_code(-1)), (None, None));
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
