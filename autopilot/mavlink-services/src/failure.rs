//! Faults on request: any source yields a [`command::FaultCommand`], which becomes the requests to the plant.
//!
//! ```text
//!  INJECT_FAILURE (420), USER_1 (31010) ─> command ─┐
//!  shell ───────────────────────────────────────────┼─> command ─> requests ─> plant
//!  parameters FLT_SERVO1.., FLT_MOTOR1 ─────────────┘     ^
//!                                     FLT_*, model ──────┘
//! ```
//!
//! | | INJECT_FAILURE (420) | USER_1 (31010) |
//! |---|---|---|
//! | p1 | unit: 102 servo, 101 motor | the same |
//! | p2 | type: [`icd::fault::FailureType`] | the same |
//! | p3 | instance, 0 all; NaN: see p4 | instance, 0 all |
//! | p4 | instances as bits, bit 0 the first | what p5 is, by the catalogue; 0 or NaN: as 420 |
//! | p5 | - | value |
//! | p6 | - | ramp, s; 0 or NaN: as 420 |
//! | p7 | - | onset in seconds of simulation time; 0 or NaN: at once |
//!
//! [`icd::fault::CATALOGUE`] lists the kinds of each type, their values and parameters; docs/commands.md shows them as
//! tables. For the engine, deg means percent of the largest thrust. Instances are those of the model file.
//! Values that 420 has no room for come from the parameters FLT_*, read when the command arrives. A command that
//! one of its effectors cannot take is refused as a whole; otherwise the requests go to the plant, one for each
//! effector, and the plant decides.

use flight_control::AircraftModel;
use icd::EffectorList;
use icd::fault::{
    Failure, FailureType, Numbers, Quantity, Refusal, SizeError, SizedKind, Target, TargetClass,
};

use crate::codec::{CommandError, CommandMessage};
use crate::convert;
use crate::failure::command::{FaultCommand, Instances, Unit};
use flight_management::parameters::Parameters;

pub use crate::failure::command::Requests;

pub mod command;
pub mod units;

pub const INJECT_FAILURE: u16 = 420;
/// MAV_CMD_USER_1.
pub const USER_1: u16 = 31_010;

/// A refusal of the plant, in the units of its target.
pub fn refused(refusal: &Refusal, target: Option<Target>, effectors: &EffectorList) -> String {
    refusal.described(TargetClass::of_request(target, effectors)).to_string()
}

/// Names of the targets; all servos together have one name.
pub fn names(some: &[Target], effectors: &EffectorList) -> String {
    let servos = effectors.by_unit(true);
    let is_servo = |one: &Target| one.effector().is_some_and(|one| servos.contains(&one));
    if some.len() == servos.len() && some.iter().all(is_servo) {
        return "all servos".to_owned();
    }
    some.iter().map(|target| target.name(effectors)).collect::<Vec<_>>().join(", ")
}

/// The requests in a fault command; `model` has the travel of the effectors.
pub fn requests(
    command: &CommandMessage,
    parameters: &Parameters,
    model: &AircraftModel,
) -> Result<Requests, CommandError> {
    let fault = parse(command, &model.effectors.list)?;
    command::requests(&fault, parameters, model)
}

/// Reasons, each with the targets that it applies to.
#[derive(Debug, Default)]
pub struct Reasons(Vec<(String, Vec<Target>)>);

impl Reasons {
    /// Adds a reason with the name of its target; without targets the reason stands alone.
    pub fn add(&mut self, reason: String, target: Option<Target>) {
        match self.0.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, targets)) => targets.extend(target),
            None => self.0.push((reason, target.into_iter().collect())),
        }
    }

    /// Adds a refusal, in the units of its target.
    pub fn refuse(&mut self, refusal: &Refusal, target: Option<Target>, effectors: &EffectorList) {
        self.add(refused(refusal, target, effectors), target);
    }

    /// Whether the reasons name their targets.
    pub fn names_targets(&self) -> bool {
        self.0.iter().any(|(_, targets)| !targets.is_empty())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them as one text.
    pub fn text(&self, all: &EffectorList) -> String {
        let of = |(reason, targets): &(String, Vec<Target>)| {
            if targets.is_empty() {
                reason.clone()
            } else {
                format!("{}: {reason}", names(targets, all))
            }
        };
        self.0.iter().map(of).collect::<Vec<_>>().join("; ")
    }
}

/// The fault command in a message, for an aircraft with these effectors.
///
/// # Errors
/// A value that is not a whole number, not known or inconsistent with the others.
pub fn parse(
    command: &CommandMessage,
    effectors: &EffectorList,
) -> Result<FaultCommand, CommandError> {
    let [unit, failure_type, ..] = command.params;
    let unit = Unit::of_code(integer("unit", unit)?);
    let code = integer("type", failure_type)?;
    unit.check(effectors)?;
    let failure = FailureType::from_code(code).map(Failure::Type).ok_or_else(|| {
        let last = FailureType::ALL.len() - 1;
        let reason = format!("Fault refused: no failures of type {code}, there are 0 to {last}");
        CommandError::unsupported(reason)
    })?;
    let instances = instances(command)?;
    if unit == Unit::EVERYTHING {
        check_everything(command, failure, instances)?;
    }
    let fault = FaultCommand::new(unit, failure, instances);
    if command.id == USER_1 { with_numbers(fault, command) } else { Ok(fault) }
}

/// The unit "all" can only be cleared.
fn check_everything(
    command: &CommandMessage,
    failure: Failure,
    instances: Instances,
) -> Result<(), CommandError> {
    if command.id != USER_1 {
        return Err(CommandError::unsupported(
            "Fault refused: unit -1 is only known to USER_1 (31010)",
        ));
    }
    if failure != Failure::OK || instances != Instances::All {
        return Err(CommandError::denied(
            "Fault refused: unit -1 mends everything, with type 0 and instance 0",
        ));
    }
    Ok(())
}

/// The parameters of USER_1 that 420 does not have.
fn with_numbers(
    fault: FaultCommand,
    command: &CommandMessage,
) -> Result<FaultCommand, CommandError> {
    let [_, _, _, kind, value, ramp, onset] = command.params;
    let mut numbers = Numbers::NONE;
    for (what, number) in [(Quantity::Ramp, ramp), (Quantity::Onset, onset)] {
        if is_given(number) {
            numbers.set(what, convert::decimal(number));
        }
    }
    let value = if is_given(kind) {
        let code = integer("kind of value", kind)?;
        let number = convert::decimal(value);
        if !number.is_finite() {
            return Err(CommandError::denied("Fault refused: the value p5 is not finite"));
        }
        Some(SizedKind::of_user_1(code, number).map_err(|error| {
            let reason = format!("Fault refused: {error}");
            match error {
                SizeError::NoKind { .. } => CommandError::unsupported(reason),
                _ => CommandError::denied(reason),
            }
        })?)
    } else if is_given(value) {
        return Err(CommandError::denied("Fault refused: p5 has a value, but p4 no kind"));
    } else {
        None
    };
    Ok(FaultCommand { value, numbers, ..fault })
}

/// p3 takes precedence over p4, which counts only where p3 is NaN.
fn instances(command: &CommandMessage) -> Result<Instances, CommandError> {
    let [_, _, instance, mask, ..] = command.params;
    if !instance.is_nan() {
        let number = integer("instance", instance)?;
        let number = u32::try_from(number)
            .map_err(|_| CommandError::denied(format!("Fault refused: no instance {number}")))?;
        return Ok(if number == 0 { Instances::All } else { Instances::One(number) });
    }
    if command.id == USER_1 {
        return Err(CommandError::denied("Fault refused: instance p3 is not given"));
    }
    let bits = integer("mask of instances", mask)?;
    let bits = u32::try_from(bits).map_err(|_| {
        CommandError::denied(format!("Fault refused: mask {bits} names no instances"))
    })?;
    Ok(Instances::Mask(bits))
}

/// Both zero and NaN mean "not given" in p4 to p7.
fn is_given(value: f32) -> bool {
    !value.is_nan() && value != 0.0
}

/// A parameter that encodes a whole number.
fn integer(what: &str, value: f32) -> Result<i32, CommandError> {
    let value = f64::from(value);
    if value.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&value) {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "whole and in range, as just checked"
        )]
        return Ok(value as i32);
    }
    Err(CommandError::denied(format!("Fault refused: {what} {value} is no whole number")))
}

#[cfg(test)]
mod tests;
