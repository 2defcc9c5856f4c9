//! Faults on request: whoever asks, one order ([`order::FaultOrder`]) becomes the requests to the plant.
//!
//! ```text
//!  INJECT_FAILURE (420), USER_1 (31010) ─> command ─┐
//!  shell ───────────────────────────────────────────┼─> order ──> requests ──> plant
//!  parameters FLT_SERVO1.., FLT_MOTOR1 ─────────────┘     ^
//!                                     FLT_*, belief ──────┘
//! ```
//!
//! | | INJECT_FAILURE (420) | USER_1 (31010) |
//! |---|---|---|
//! | p1 | unit: 102 servo, 101 motor | the same |
//! | p2 | type: 0 ok, 1 off, 2 stuck, 3 garbage, 4 wrong, 5 slow, 6 delayed, 7 intermittent, 8 drift | the same |
//! | p3 | instance, 0 all; NaN: see p4 | instance, 0 all |
//! | p4 | instances as bits, bit 0 the first | what p5 is, see below; 0 or NaN: as 420 |
//! | p5 | - | value |
//! | p6 | - | ramp, s; 0 or NaN: as 420 |
//! | p7 | - | onset in seconds of simulation time; 0 or NaN: at once |
//!
//! | p4 of USER_1 | type | p5 |
//! |---|---|---|
//! | 1 | stuck | angle, deg |
//! | 2 | wrong | effect left, percent |
//! | 3 | wrong | bias, deg |
//! | 4 | slow | largest speed, deg/s |
//! | 5 | delayed | delay, s |
//! | 6 | garbage | amplitude, deg |
//! | 7 | intermittent | part of each period in which commands get through, percent |
//! | 8 | drift | deg/s |
//! | 9 | wrong | largest deflection, deg |
//! | 10 | wrong | end of the travel, 1 or -1 |
//!
//! Of the engine, deg means percent of the largest thrust. Instances are those of the model file; of `tvc_jet` servos
//! are 1 left aileron, 2 right aileron, 3 left elevator, 4 right elevator, 5 rudder, 6 nozzle pitch, 7 nozzle yaw, and
//! motor 1 is the engine.
//! What 420 has no room for comes from the parameters FLT_*, read when the command arrives. An order that
//! one of its effectors cannot take is refused as a whole; else the requests go to the plant, one for each
//! effector, which has the last word.

use flight_control::Belief;
use icd::fault::Refusal;
use icd::{Effector, EffectorList};

use super::codec::Command;
use super::refused::Refused;
use crate::parameters::Parameters;

mod command;
pub mod order;
mod value;
mod words;

pub use order::Requests;

/// MAV_CMD_INJECT_FAILURE.
pub const INJECT_FAILURE: u16 = 420;
/// MAV_CMD_USER_1.
pub const USER_1: u16 = 31_010;

/// Unit and instance of an effector, in PX4's words.
#[must_use]
pub fn unit_and_instance(effector: Effector, effectors: &EffectorList) -> (&'static str, u8) {
    let unit = order::Unit::of(effectors.is_angle(effector));
    (unit.name().unwrap_or("effector"), effectors.instance(effector))
}

/// A refusal of the plant in the units of the effector that it is about.
#[must_use]
pub fn refused(refusal: &Refusal, effector: Option<Effector>, effectors: &EffectorList) -> String {
    let is_angle = effector.is_none_or(|effector| effectors.is_angle(effector));
    refusal.described(is_angle).to_string()
}

/// Effectors by name, all servos together by that.
#[must_use]
pub fn names(some: &[Effector], effectors: &EffectorList) -> String {
    let servos = effectors.by_unit(true);
    if some.len() == servos.len() && some.iter().all(|one| servos.contains(one)) {
        return "all servos".to_owned();
    }
    some.iter().map(|effector| effectors.name(*effector)).collect::<Vec<_>>().join(", ")
}

/// The requests in a fault command; `belief` says how far the effectors travel.
///
/// # Errors
/// Why nothing is asked of the plant.
pub fn requests(
    command: &Command,
    parameters: &Parameters,
    belief: &Belief,
) -> Result<Requests, Refused> {
    let order = command::order(command, &belief.effectors.list)?;
    order::requests(&order, parameters, belief)
}
