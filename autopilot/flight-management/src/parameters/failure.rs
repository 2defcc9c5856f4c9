//! Parameters of fault injection: the values for which MAV_CMD_INJECT_FAILURE has no field, and those that inject a fault into
//! an effector, a sensor or a part of the airframe.
//!
//! The first are read on receipt of a command, so a later change leaves an active fault unchanged. The catalogue of faults
//! lists the numbers and choices. Setting one of the others requests the fault from the plant, and the value is its fault. They
//! are not tunables: they are never saved, each flight begins with 0, and the command line cannot set them.

use core::fmt::Write as _;
use std::sync::LazyLock;

use arrayvec::ArrayString;
use icd::fault::{
    CATALOGUE, ChoiceParameter, FailureType, KindInfo, NumberParameter, Target, TargetClass,
    Targets,
};
use icd::{Effector, EffectorList};

use super::{Access, Choice, Kind, Parameter};

/// What the parameters of the catalogue have in common.
const FAULT: Parameter =
    Parameter { group: "Fault injection", default: Some(0.0), ..Parameter::NUMBER };

/// Most settings of kinds that the set can hold.
const SETTINGS_MAX: usize = 64;

/// Sizes and times of faults. Sizes in degrees are for effectors that turn; `engine_pct` is the engine's for all of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FailureParameters {
    /// Fault injection is allowed.
    pub enabled: bool,
    /// Numbers and choices of the kinds, in the order of [`settings`].
    pub(super) settings: [f64; SETTINGS_MAX],
    /// The engine's bias, limit and amplitude, percent of its largest thrust; its speed and drift, percent/s.
    pub engine_pct: f64,
    /// Time from nothing to the full fault, s; not used for kinds without a size.
    pub ramp_s: f64,
    /// Duration of each action of a fault, s; 0 for ever.
    pub duration_s: f64,
    /// Time from one onset to the next, s; 0 once only.
    pub every_s: f64,
    /// Number of onsets; 0 without end.
    pub times: u32,
}

/// The parameters that the catalogue needs: choices, then numbers.
pub(super) fn settings() -> &'static [Parameter] {
    static SETTINGS: LazyLock<Vec<Parameter>> = LazyLock::new(|| {
        let choices = FailureType::ALL.into_iter().flat_map(choices_of);
        // The place is an index of an array of this length.
        let all = choices.chain(CATALOGUE.iter().flat_map(numbers_of)).take(SETTINGS_MAX);
        let place = |(place, row)| Parameter { access: Access::Fault(place), ..row };
        all.enumerate().map(place).collect()
    });
    &SETTINGS
}

/// The mode of a type, and the choices of its kinds.
fn choices_of(failure_type: FailureType) -> Vec<Parameter> {
    let kinds = || CATALOGUE.iter().filter(|kind| kind.mavlink.failure_type == failure_type);
    let mode = failure_type.mode().map(|mode| {
        let labels = kinds().flat_map(|KindInfo { mavlink, .. }| {
            (mavlink.first_mode.into()..).zip(mavlink.mode.iter().copied())
        });
        choice(mode.name, mode.meaning, labels.collect())
    });
    let others = kinds().filter_map(|kind| kind.choice).filter_map(|all| {
        let ChoiceParameter { name, meaning } = all.parameter?;
        let labels = all.alternatives.iter().map(|one| one.label);
        Some(choice(name, meaning, (0..).zip(labels).collect()))
    });
    mode.into_iter().chain(others).collect()
}

fn choice(
    name: &'static str,
    meaning: &'static str,
    mut labels: Vec<(i32, &'static str)>,
) -> Parameter {
    // By rising numbers, of which the last is the upper end of the range.
    labels.sort_unstable();
    let max = labels.last().map_or(0.0, |(value, _)| f64::from(*value));
    let choices: Vec<_> =
        labels.into_iter().map(|(value, label)| Choice { value, label }).collect();
    let kind = Kind::Int;
    // The table is made once.
    Parameter { name, meaning, kind, max, choices: choices.leak(), ..FAULT }
}

fn numbers_of(kind: &KindInfo) -> impl Iterator<Item = Parameter> {
    kind.numbers.iter().map(|number| {
        let NumberParameter { name, min, max, default, meaning } = number.parameter;
        // One parameter for all sensors, whose units differ.
        let of_sensors = kind.targets == Targets::SENSORS;
        let unit = number.quantity.measure().unit(TargetClass::Angle).name;
        let unit = if of_sensors { "-" } else { unit };
        Parameter { name, meaning, unit, min, max, default: Some(default), ..FAULT }
    })
}

/// The parameter with the size of every fault of a sensor, in the operator's unit of the sensor.
const SENSOR_SIZE: &str = "FLT_SENSOR";

impl FailureParameters {
    /// Size of a fault of a sensor, in the operator's unit of the sensor.
    pub fn sensor_size(&self) -> f64 {
        self.number(SENSOR_SIZE)
    }

    /// Without defaults: those are in the table.
    pub(super) const NONE: Self = Self {
        enabled: false,
        settings: [0.0; SETTINGS_MAX],
        engine_pct: 0.0,
        ramp_s: 0.0,
        duration_s: 0.0,
        every_s: 0.0,
        times: 0,
    };

    /// A number of a kind by the name of its parameter, in its unit; of a choice the number of the alternative.
    pub fn number(&self, name: &str) -> f64 {
        let mut all = settings().iter().zip(self.settings);
        all.find(|(row, _)| row.name == name).map_or(0.0, |(_, number)| number)
    }

    /// The selected alternative of a choice.
    pub fn choice(&self, name: &str) -> u8 {
        // Checked against the choices when it was set.
        self.number(name) as u8
    }
}

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
    // Without a digit the unit is empty, and no unit has that name.
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
    // A constant cannot be made with `for`.
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
