//! Units of failures: numbers of MAVLink and names of PX4's shell. Types and sizes are read by [`icd::fault::SizedKind`].
//!
//! Units and types are integers on the wire, and some are newer than any library, so they are not read as the library's enums.

use core::fmt;

use arrayvec::ArrayVec;
use icd::EffectorList;
use icd::fault::{Measure, Target, TargetClass};

use crate::codec::CommandError;
use crate::convert;

/// FAILURE_UNIT: what can fail, on this vehicle or others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Unit(i32);

impl Unit {
    pub const MOTOR: Self = Self(Target::MOTOR.0 as i32);
    /// The actuators that deflect: surfaces and nozzle.
    pub const SERVO: Self = Self(Target::SERVO.0 as i32);
    /// Every effector, sensor and part of the airframe, only to clear faults and only in MAV_CMD_USER_1, so that a button of a ground station needs one command.
    pub const EVERYTHING: Self = Self(-1);

    /// Those that cannot fail here: number, name, and why.
    const TABLE: [(Self, &'static str, &'static str); 9] = [
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
    pub const fn of_code(code: i32) -> Self {
        Self(code)
    }

    /// The unit with this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::all().find(|(_, known)| *known == name).map(|(unit, _)| unit)
    }

    /// The unit of a target.
    pub fn of(target: Target, effectors: &EffectorList) -> Self {
        Self(target.unit(effectors).0.into())
    }

    pub const fn code(self) -> i32 {
        self.0
    }

    /// Name, if it has one.
    pub fn name(self) -> Option<&'static str> {
        Self::all().find(|(unit, _)| *unit == self).map(|(_, name)| name)
    }

    /// Names of all units, including those that cannot fail here.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::all().map(|(_, name)| name)
    }

    fn all() -> impl Iterator<Item = (Self, &'static str)> {
        let others = Self::TABLE.iter().map(|(unit, name, _)| (*unit, *name));
        let all = others.chain(Target::units().map(|(code, name)| (Self(code.into()), name)));
        let mut all: Vec<_> = all.collect();
        all.sort_unstable_by_key(|(unit, _)| unit.0);
        all.into_iter()
    }

    /// The class of its targets, which determines the units of a size.
    pub fn class(self, all: &EffectorList) -> TargetClass {
        TargetClass::of_request(self.targets(all).first().copied(), all)
    }

    /// Its targets, by instance. Empty if the unit cannot fail here.
    pub fn targets(self, all: &EffectorList) -> Targets {
        let is_meant = |target: &Target| self == Self::EVERYTHING || Self::of(*target, all) == self;
        let mut targets: Targets = Target::all(all).filter(is_meant).collect();
        if self != Self::EVERYTHING {
            targets.sort_by_key(|target| target.instance(all));
        }
        targets
    }

    pub fn check(self, all: &EffectorList) -> Result<Targets, CommandError> {
        let targets = self.targets(all);
        if !targets.is_empty() {
            return Ok(targets);
        }
        let row = Self::TABLE.iter().find(|(unit, ..)| *unit == self);
        let why = match (row, self.name()) {
            (Some((.., why)), _) => why,
            (None, Some(_)) => "this aircraft has none",
            (None, None) => "it is not known",
        };
        Err(CommandError::unsupported(format!("Fault refused: no failures of unit {self}: {why}")))
    }
}

/// Some effectors, sensors and parts of the airframe.
pub type Targets = ArrayVec<Target, { Target::MAX }>;

/// `GPS (4)`; the bare number if there is no name.
impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.name() {
            Some(name) => write!(f, "{} ({})", name.to_ascii_uppercase(), self.0),
            None => self.0.fmt(f),
        }
    }
}

/// A number of a command or of the shell in SI units; for an engine with this largest thrust, N, percent of it.
pub(super) fn to_si(
    number: f64,
    measure: Measure,
    class: TargetClass,
    engine_n: Option<f64>,
) -> f64 {
    match (measure, engine_n) {
        (measure, Some(largest_n)) if measure.is_own() => convert::fraction(number) * largest_n,
        // Parameters and texts use milliseconds, commands seconds.
        (Measure::Milliseconds, _) => number,
        (measure, _) => measure.unit(class).to_si(number),
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
            assert_eq!(unit.check(&all).is_ok(), !unit.targets(&all).is_empty(), "{name}");
        }
        assert_eq!(Unit::parse("GPS"), None);
    }

    #[test]
    fn a_unit_that_does_not_fail_is_refused_by_name_and_number_with_the_reason() {
        let text =
            |code| Unit::of_code(code).check(&tvc_jet::effectors()).unwrap_err().reason.unwrap();
        assert_eq!(
            text(5),
            "Fault refused: no failures of unit OPTICAL_FLOW (5): there is no such sensor"
        );
        assert_eq!(text(77), "Fault refused: no failures of unit 77: it is not known");
    }
}
