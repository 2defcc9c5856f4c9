//! Parameters that break an effector: what a ground station sets is ordered from the plant, and the value is
//! what acts on the effector.
//!
//! They are no tunables: nothing keeps them, each flight begins with 0, and the command line cannot set them.

use icd::Effector;

use super::Choice;

/// One such parameter.
#[derive(Debug, Clone, Copy)]
pub struct FaultParameter {
    /// Name, at most 16 characters.
    pub name: &'static str,
    /// What it breaks.
    pub effector: Effector,
    /// The effector in words.
    pub what: &'static str,
}

const fn row(name: &'static str, effector: Effector, what: &'static str) -> FaultParameter {
    FaultParameter { name, effector, what }
}

/// All of them.
pub const FAULTS: [FaultParameter; Effector::COUNT] = [
    row("FLT_SERVO1", Effector::LeftAileron, "left aileron"),
    row("FLT_SERVO2", Effector::RightAileron, "right aileron"),
    row("FLT_SERVO3", Effector::LeftElevator, "left elevator"),
    row("FLT_SERVO4", Effector::RightElevator, "right elevator"),
    row("FLT_SERVO5", Effector::Rudder, "rudder"),
    row("FLT_SERVO6", Effector::NozzlePitch, "nozzle pitch"),
    row("FLT_SERVO7", Effector::NozzleYaw, "nozzle yaw"),
    row("FLT_MOTOR1", Effector::Engine, "engine"),
];

const fn choice(value: i32, label: &'static str) -> Choice {
    Choice { value, label }
}

/// Their values: FAILURE_TYPE.
pub const FAULT_CHOICES: [Choice; 9] = [
    choice(0, "ok"),
    choice(1, "off: floats, flame-out"),
    choice(2, "stuck"),
    choice(3, "garbage: oscillates"),
    choice(4, "wrong: see FLT_WRONG_MODE"),
    choice(5, "slow"),
    choice(6, "delayed"),
    choice(7, "intermittent"),
    choice(8, "drift"),
];

/// The one with this name.
#[must_use]
pub fn fault(name: &str) -> Option<&'static FaultParameter> {
    FAULTS.iter().find(|row| row.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mavlink::failure;
    use crate::mavlink::failure::order::FailureType;
    use crate::parameters::{Parameters, compatibility, table};

    #[test]
    fn each_has_the_name_of_its_effector_and_hides_no_other_parameter() {
        for row in &FAULTS {
            let (unit, instance) = failure::unit_and_instance(row.effector);
            assert_eq!(row.name, format!("FLT_{}{instance}", unit.to_uppercase()));
            assert!(table().iter().all(|other| other.name != row.name), "{}", row.name);
            assert!(compatibility(row.name).is_none(), "{}", row.name);
        }
    }

    #[test]
    fn every_choice_is_a_type_of_failure() {
        for choice in &FAULT_CHOICES {
            let name = FailureType::of_code(choice.value).unwrap().name();
            assert!(choice.label.starts_with(name), "{}", choice.label);
        }
        assert_eq!(FailureType::of_code(9), None);
    }

    #[test]
    fn they_cannot_be_set_without_a_flight() {
        let error = Parameters::default().set("FLT_SERVO1", 2.0).unwrap_err();
        assert!(error.to_string().contains("only in flight"), "{error}");
    }
}
