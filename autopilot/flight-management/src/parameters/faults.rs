//! Parameters that inject a fault into an effector: setting one requests the fault from the plant, and the value is
//! the fault on the effector.
//!
//! They are not tunables: they are never saved, each flight begins with 0, and the command line cannot set them.

use core::fmt::Write as _;

use arrayvec::ArrayString;
use icd::fault::FailureType;
use icd::{Effector, EffectorList};

use super::Choice;

/// One such parameter.
#[derive(Debug, Clone, Copy)]
pub struct FaultParameter {
    /// Name, at most 16 characters.
    pub name: ParameterName,
    /// Its effector.
    pub effector: Effector,
}

/// Name of a parameter.
pub type ParameterName = ArrayString<16>;

/// Beginning of the names: of servos and of motors.
const BEGINNINGS: [(&str, bool); 2] = [("FLT_SERVO", true), ("FLT_MOTOR", false)];

/// The fault parameter of an effector.
#[must_use]
pub fn fault_of(effector: Effector, effectors: &EffectorList) -> FaultParameter {
    let is_angle = effectors.is_angle(effector);
    let beginning = BEGINNINGS.into_iter().find(|(_, of_angles)| *of_angles == is_angle);
    let mut name = ParameterName::new();
    let (beginning, _) = beginning.unwrap_or(BEGINNINGS[0]);
    // Cannot fail: numbers have at most three digits.
    let _fits = write!(name, "{beginning}{}", effectors.instance(effector));
    FaultParameter { name, effector }
}

/// The fault parameters of an aircraft, in the order of its effectors.
pub fn fault_parameters(
    effectors: &EffectorList,
) -> impl ExactSizeIterator<Item = FaultParameter> + '_ {
    effectors.all().map(|effector| fault_of(effector, effectors))
}

/// Whether a name is that of a fault parameter, of this aircraft or another.
#[must_use]
pub fn is_fault(name: &str) -> bool {
    let number = BEGINNINGS.into_iter().find_map(|(beginning, _)| name.strip_prefix(beginning));
    let number = number.and_then(|number| number.parse::<usize>().ok());
    number.is_some_and(|number| (1..=Effector::MAX).contains(&number))
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
