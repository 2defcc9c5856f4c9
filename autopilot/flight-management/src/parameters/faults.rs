//! Parameters that break an effector: what a ground station sets is ordered from the plant, and the value is
//! what acts on the effector.
//!
//! They are no tunables: nothing keeps them, each flight begins with 0, and the command line cannot set them.

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
    /// What it breaks.
    pub effector: Effector,
}

/// Name of a parameter.
pub type ParameterName = ArrayString<16>;

/// What the names begin with: of servos and of motors.
const BEGINNINGS: [(&str, bool); 2] = [("FLT_SERVO", true), ("FLT_MOTOR", false)];

/// The one that breaks an effector.
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

/// All of an aircraft, in the order of its effectors.
pub fn fault_parameters(
    effectors: &EffectorList,
) -> impl ExactSizeIterator<Item = FaultParameter> + '_ {
    effectors.all().map(|effector| fault_of(effector, effectors))
}

/// Whether a name is that of such a parameter, of this aircraft or another.
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
