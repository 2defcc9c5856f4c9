//! From MAV_CMD_INJECT_FAILURE and MAV_CMD_USER_1 to an order.

use icd::EffectorList;
use icd::SimTime;
use icd::fault::{FailureType, Onset};

use super::USER_1;
use super::order::{Failure, FaultOrder, Instances, Unit, Value, ValueError};
use crate::codec::CommandMessage;
use crate::convert;
use crate::refused::Refused;

/// The order in a fault command, for an aircraft with these effectors.
///
/// # Errors
/// What is not a whole number, not known or does not fit together.
pub fn order(command: &CommandMessage, effectors: &EffectorList) -> Result<FaultOrder, Refused> {
    let [unit, failure_type, ..] = command.params;
    let unit = Unit::of_code(integer("unit", unit)?);
    let code = integer("type", failure_type)?;
    unit.check(effectors)?;
    let failure = FailureType::from_code(code).map(Failure::Type).ok_or_else(|| {
        let last = FailureType::ALL.len() - 1;
        let reason = format!("Fault refused: no failures of type {code}, there are 0 to {last}");
        Refused::unsupported(reason)
    })?;
    let instances = instances(command)?;
    if unit == Unit::EVERYTHING {
        check_everything(command, failure, instances)?;
    }
    let order = FaultOrder::new(unit, failure, instances);
    if command.id == USER_1 { with_numbers(order, command) } else { Ok(order) }
}

/// Everything at once is only mended.
fn check_everything(
    command: &CommandMessage,
    failure: Failure,
    instances: Instances,
) -> Result<(), Refused> {
    if command.id != USER_1 {
        return Err(Refused::unsupported("Fault refused: unit -1 is only known to USER_1 (31010)"));
    }
    if failure != Failure::OK || instances != Instances::All {
        return Err(Refused::denied(
            "Fault refused: unit -1 mends everything, with type 0 and instance 0",
        ));
    }
    Ok(())
}

/// What USER_1 says beyond 420.
fn with_numbers(order: FaultOrder, command: &CommandMessage) -> Result<FaultOrder, Refused> {
    let [_, _, _, kind, value, ramp, onset] = command.params;
    let ramp_s = is_given(ramp).then(|| convert::decimal(ramp));
    let onset = if is_given(onset) {
        let seconds = convert::decimal(onset);
        let at = SimTime::from_seconds(seconds).ok_or_else(|| {
            Refused::denied(format!("Fault refused: onset p7 = {seconds} s is no time"))
        })?;
        Onset::At(at)
    } else {
        Onset::AtOnce
    };
    let value = if is_given(kind) {
        let code = integer("kind of value", kind)?;
        let number = convert::decimal(value);
        if !number.is_finite() {
            return Err(Refused::denied("Fault refused: the value p5 is not finite"));
        }
        Some(Value::of_user_1(code, number).map_err(|error| {
            let reason = format!("Fault refused: {error}");
            match error {
                ValueError::NoKind { .. } => Refused::unsupported(reason),
                _ => Refused::denied(reason),
            }
        })?)
    } else if is_given(value) {
        return Err(Refused::denied("Fault refused: p5 has a value, but p4 no kind"));
    } else {
        None
    };
    Ok(FaultOrder { value, ramp_s, onset, ..order })
}

/// p3 goes before p4, which counts only where p3 is NaN.
fn instances(command: &CommandMessage) -> Result<Instances, Refused> {
    let [_, _, instance, mask, ..] = command.params;
    if !instance.is_nan() {
        let number = integer("instance", instance)?;
        let number = u32::try_from(number)
            .map_err(|_| Refused::denied(format!("Fault refused: no instance {number}")))?;
        return Ok(if number == 0 { Instances::All } else { Instances::One(number) });
    }
    if command.id == USER_1 {
        return Err(Refused::denied("Fault refused: instance p3 is not given"));
    }
    let bits = integer("mask of instances", mask)?;
    let bits = u32::try_from(bits)
        .map_err(|_| Refused::denied(format!("Fault refused: mask {bits} names no instances")))?;
    Ok(Instances::Mask(bits))
}

/// Both zero and NaN mean "not given" in p4 to p7.
fn is_given(value: f32) -> bool {
    !value.is_nan() && value != 0.0
}

/// A parameter that stands for a whole number.
fn integer(what: &str, value: f32) -> Result<i32, Refused> {
    let value = f64::from(value);
    if value.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&value) {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "whole and in range, as just checked"
        )]
        return Ok(value as i32);
    }
    Err(Refused::denied(format!("Fault refused: {what} {value} is no whole number")))
}

#[cfg(test)]
mod tests;
