//! Faults on request: whoever asks, one order ([`order::FaultOrder`]) becomes the requests to the plant.
//!
//! ```text
//!  INJECT_FAILURE (420), USER_1 (31010) ─> command ─┐
//!  shell ───────────────────────────────────────────┼─> order ──> requests ──> plant
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
//! Which kinds a type has, their values and parameters stand in [`icd::fault::CATALOGUE`]; docs/commands.md has them as
//! tables. Of the engine, deg means percent of the largest thrust. Instances are those of the model file.
//! What 420 has no room for comes from the parameters FLT_*, read when the command arrives. An order that
//! one of its effectors cannot take is refused as a whole; else the requests go to the plant, one for each
//! effector, which has the last word.

use flight_control::AircraftModel;
use icd::EffectorList;
use icd::fault::{Refusal, Target, TargetClass};

use super::codec::CommandMessage;
use super::refused::Refused;
use flight_management::parameters::Parameters;

mod command;
pub mod order;
mod value;
mod words;

pub use order::Requests;

/// MAV_CMD_INJECT_FAILURE.
pub const INJECT_FAILURE: u16 = 420;
/// MAV_CMD_USER_1.
pub const USER_1: u16 = 31_010;

/// Unit and instance of a target, in PX4's words.
#[must_use]
pub fn unit_and_instance(
    target: impl Into<Target>,
    effectors: &EffectorList,
) -> (&'static str, u8) {
    let target = target.into();
    let instance = target.effector().map_or(1, |effector| effectors.instance(effector));
    (order::Unit::of(target, effectors).name().unwrap_or("unit"), instance)
}

/// A refusal of the plant in the units of what it is about.
#[must_use]
pub fn refused(refusal: &Refusal, target: Option<Target>, effectors: &EffectorList) -> String {
    refusal.described(TargetClass::of_request(target, effectors)).to_string()
}

/// Targets by name, all servos together by that.
#[must_use]
pub fn names(some: &[Target], effectors: &EffectorList) -> String {
    let servos = effectors.by_unit(true);
    let is_servo = |one: &Target| one.effector().is_some_and(|one| servos.contains(&one));
    if some.len() == servos.len() && some.iter().all(is_servo) {
        return "all servos".to_owned();
    }
    some.iter().map(|target| target.name(effectors)).collect::<Vec<_>>().join(", ")
}

/// The requests in a fault command; `model` says how far the effectors travel.
///
/// # Errors
/// Why nothing is asked of the plant.
pub fn requests(
    command: &CommandMessage,
    parameters: &Parameters,
    model: &AircraftModel,
) -> Result<Requests, Refused> {
    let order = command::order(command, &model.effectors.list)?;
    order::requests(&order, parameters, model)
}
