//! Parameters that inject a fault into an effector, a sensor or a part of the airframe: setting one requests the fault from the plant, and the value is
//! its fault.
//!
//! They are not tunables: they are never saved, each flight begins with 0, and the command line cannot set them.

use core::fmt::Write as _;

use arrayvec::ArrayString;
use icd::fault::{FailureType, Target};
use icd::{Effector, EffectorList};

use super::Choice;

#[derive(Debug, Clone, Copy)]
pub struct FaultParameter {
    /// Name, at most 16 characters.
    pub name: ParameterName,
    /// Its effector, sensor or part.
    pub target: Target,
}

/// Name of a parameter.
pub type ParameterName = ArrayString<16>;

/// The fault parameter of an effector, a sensor or a part of the airframe.
pub fn fault_of(target: Target, effectors: &EffectorList) -> FaultParameter {
    let mut name = ParameterName::new();
    // Cannot fail: the longest is FLT_ENGINE_MON1.
    let _fits = write!(name, "FLT_{}{}", target.unit(effectors).1, target.instance(effectors));
    name.make_ascii_uppercase();
    FaultParameter { name, target }
}

/// The fault parameters of an aircraft, in the order of [`Target::all`].
pub fn fault_parameters(effectors: &EffectorList) -> impl Iterator<Item = FaultParameter> + '_ {
    Target::all(effectors).map(|target| fault_of(target, effectors))
}

/// Whether a name is that of a fault parameter, of this aircraft or another.
pub fn is_fault(name: &str) -> bool {
    let Some(name) = name.strip_prefix("FLT_") else { return false };
    let (unit, number) = name.split_at(name.find(|c: char| c.is_ascii_digit()).unwrap_or(0));
    let is_it = |(_, known): &(u16, &str)| known.eq_ignore_ascii_case(unit);
    let last = match Target::units().find(is_it) {
        Some(Target::SERVO | Target::MOTOR) => Effector::MAX,
        Some(_) => 1,
        None => 0,
    };
    number.parse().is_ok_and(|number: usize| (1..=last).contains(&number))
}

/// Their values: FAILURE_TYPE.
pub const FAULT_CHOICES: [Choice; FailureType::ALL.len()] = {
    let mut choices = [Choice { value: 0, label: "" }; FailureType::ALL.len()];
    let mut place = 0;
    while place < choices.len() {
        let failure_type = FailureType::ALL[place];
        choices[place] = Choice { value: failure_type.code() as i32, label: failure_type.label() };
        place += 1;
    }
    choices
};

#[cfg(test)]
mod tests {
    use crate::parameters::Parameters;

    #[test]
    fn they_cannot_be_set_without_a_flight() {
        let error = Parameters::default().set("FLT_SERVO1", 2.0).unwrap_err();
        assert!(error.to_string().contains("only in flight"), "{error}");
    }
}
