//! Parameters that inject a fault into an effector, a sensor or a part of the airframe: setting one requests the fault from the plant, and the value is
//! its fault.
//!
//! They are not tunables: they are never saved, each flight begins with 0, and the command line cannot set them.

use core::fmt::Write as _;

use arrayvec::ArrayString;
use icd::fault::{AirframePart, FailureType, SensorKind, Target};
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

/// Beginning of the names: of servos and of motors.
const BEGINNINGS: [(&str, bool); 2] = [("FLT_SERVO", true), ("FLT_MOTOR", false)];

/// The name of a sensor's fault parameter: that of its unit in MAVLink, of which there is one.
fn of_sensor(sensor: SensorKind) -> ParameterName {
    let mut name = ParameterName::new();
    // Cannot fail: the longest is FLT_ENGINE_MON1.
    let _fits = write!(name, "FLT_{}1", sensor.failure_unit().1);
    name.make_ascii_uppercase();
    name
}

/// The name of the fault parameter of a part of the airframe.
fn of_part(part: AirframePart) -> ParameterName {
    let mut name = ParameterName::new();
    // Cannot fail: the longest is FLT_RIGHT_WING1.
    let _fits = write!(name, "FLT_{}1", part.key());
    name.make_ascii_uppercase();
    name
}

/// The fault parameter of an effector, a sensor or a part of the airframe.
pub fn fault_of(target: Target, effectors: &EffectorList) -> FaultParameter {
    let name = match target {
        Target::Effector(effector) => {
            let is_angle = effectors.is_angle(effector);
            let beginning = BEGINNINGS.into_iter().find(|(_, of_angles)| *of_angles == is_angle);
            let (beginning, _) = beginning.unwrap_or(BEGINNINGS[0]);
            let mut name = ParameterName::new();
            // Cannot fail: numbers have at most three digits.
            let _fits = write!(name, "{beginning}{}", effectors.instance(effector));
            name
        }
        Target::Sensor(sensor) => of_sensor(sensor),
        Target::Part(part) => of_part(part),
    };
    FaultParameter { name, target }
}

/// The fault parameters of an aircraft, in the order of its effectors, then those of the sensors and of the parts of the airframe.
pub fn fault_parameters(effectors: &EffectorList) -> impl Iterator<Item = FaultParameter> + '_ {
    targets(effectors).map(|target| fault_of(target, effectors))
}

/// What can fail: the effectors of an aircraft, the sensors, and the parts of the airframe.
pub fn targets(effectors: &EffectorList) -> impl Iterator<Item = Target> + '_ {
    let others = SensorKind::ALL.map(Target::from).into_iter();
    let others = others.chain(AirframePart::ALL.map(Target::from));
    effectors.all().map(Target::from).chain(others)
}

/// Whether a name is that of a fault parameter, of this aircraft or another.
pub fn is_fault(name: &str) -> bool {
    let number = BEGINNINGS.into_iter().find_map(|(beginning, _)| name.strip_prefix(beginning));
    let number = number.and_then(|number| number.parse::<usize>().ok());
    let of_effector = number.is_some_and(|number| (1..=Effector::MAX).contains(&number));
    of_effector
        || SensorKind::ALL.into_iter().any(|sensor| &of_sensor(sensor) == name)
        || AirframePart::ALL.into_iter().any(|part| &of_part(part) == name)
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
