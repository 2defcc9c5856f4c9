//! The parameters FLT_SERVO1 to FLT_SERVO7 and FLT_MOTOR1: setting one injects a fault or clears it.
//!
//! ```text
//!  PARAM_SET ─> command ─> plant ─> outcome ─> its fault on the list ─> PARAM_VALUE, to everybody
//!                 └refused───────────┴refused, silent──> PARAM_VALUE as it is, and a text with the reason
//! ```
//!
//! The value is the fault on the list, whichever client injected it: the active one, else the next one. So 0 always clears it. The
//! service publishes every change.

use core::time::Duration;

use icd::fault::{FailureType, FaultEntry, FaultReply, PlantAction, TargetClass};
use icd::{Effector, EffectorList, PerEffector};

use crate::failure::command;
use crate::failure::command::{Failure, FaultCommand, Instances, Unit};
use crate::peers::From;
use crate::wall_time::WallTime;
use crate::{Shared, failure};
use flight_management::command::Outcome;
use flight_management::fault_list::FaultList;

/// Commands that may be open.
const OPEN_MAX: usize = 32;
/// Ground stations wait for an answer for about a second.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(700);

/// A command that waits for the plant.
#[derive(Debug)]
struct Open {
    from: From,
    /// Number of the intent.
    number: u32,
    effector: Effector,
    /// The value that was set.
    target: u8,
    since: WallTime,
    /// The plant has executed it, but its report has not arrived yet.
    is_done: bool,
}

/// An answer due for a fault parameter.
#[derive(Debug)]
pub(super) struct Answer {
    pub(super) from: From,
    pub(super) effector: Effector,
    /// Why it was not set; `None` if it was.
    pub(super) refused: Option<String>,
}

/// The commands that wait for the plant, and the values as published.
#[derive(Debug, Default)]
pub(super) struct FaultParameters {
    open: Vec<Open>,
    published: PerEffector<u8>,
}

/// FAILURE_TYPE of the active fault of an effector, else of the next one; 0 for none.
pub(super) fn value(effector: Effector, faults: &FaultList) -> u8 {
    faults.foremost(effector).map_or(0, |entry| entry.kind.info().mavlink.failure_type.code())
}

/// The plant has accepted the command, but the list shows another fault, or none.
fn not_as_set(effector: Effector, faults: &FaultList, effectors: &EffectorList) -> String {
    let name = effectors.name(effector);
    match faults.foremost(effector) {
        Some(FaultEntry { kind, state, .. }) => {
            let kind = kind.described(TargetClass::of(effectors.is_angle(effector)));
            format!("Not as set: {name}: there is another fault, {kind}, {state}")
        }
        None => format!("Not as set: {name}: the fault is over already"),
    }
}

impl FaultParameters {
    /// Requests the fault of a PARAM_SET from the plant; false if the plant has it already.
    ///
    /// # Errors
    /// Why the command yields no request.
    pub(super) fn set(
        &mut self,
        from: From,
        effector: Effector,
        value: f64,
        now: WallTime,
        shared: &mut Shared,
    ) -> Result<bool, String> {
        let (unit, instance) = failure::unit_and_instance(effector, shared.effectors());
        let is_it = |known: &FailureType| f64::from(known.code()) == libm::round(value);
        let Some(failure_type) = FailureType::ALL.into_iter().find(is_it) else {
            let (name, last) = (unit.to_ascii_uppercase(), FailureType::ALL.len() - 1);
            return Err(format!("Not set: FLT_{name}{instance} = {value} is outside 0 to {last}"));
        };
        let target = failure_type.code();
        if target == 0 && !shared.aircraft.faults().names(effector) {
            // Nothing to clear: sending a whole parameter table back changes nothing.
            return Ok(false);
        }
        let instances = Instances::One(instance.into());
        let command = FaultCommand::new(
            Unit::of(effector.into(), shared.effectors()),
            Failure::Type(failure_type),
            instances,
        );
        let requests = command::requests(&command, &shared.parameters, &shared.model)
            .map_err(|refused| refused.reason.unwrap_or_default())?;
        if self.open.len() >= OPEN_MAX {
            return Err("Not set: too many faults are waiting".to_owned());
        }
        for request in requests {
            let number = shared.intents.push(PlantAction::Fault(request));
            let number = number.ok_or("Not set: too many commands are waiting")?;
            self.open.push(Open { from, number, effector, target, since: now, is_done: false });
        }
        Ok(true)
    }

    /// Handles the outcome of an intent; returns an answer that is due.
    pub(super) fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        effectors: &EffectorList,
    ) -> Option<Answer> {
        let place = self.open.iter().position(|open| open.number == number)?;
        let open = self.open.get_mut(place)?;
        let refused = match outcome {
            Outcome::Plant(FaultReply::Refused(refusal)) => {
                failure::refused(refusal, Some(open.effector.into()), effectors)
            }
            Outcome::Refused(refusal) => refusal.to_string(),
            Outcome::NoAnswer => "the aircraft does not answer".to_owned(),
            Outcome::Done | Outcome::Plant(_) => {
                open.is_done = true;
                return None;
            }
        };
        let Open { from, effector, .. } = self.open.remove(place);
        let refused = Some(format!("Fault refused: {}: {refused}", effectors.name(effector)));
        Some(Answer { from, effector, refused })
    }

    /// Answers that are due: values that are on the list as they were set, and commands that have waited for too long.
    pub(super) fn answers(
        &mut self,
        now: WallTime,
        faults: &FaultList,
        effectors: &EffectorList,
    ) -> Vec<Answer> {
        let is_over = |open: &mut Open| {
            let is_there = open.is_done && value(open.effector, faults) == open.target;
            is_there || now.since(open.since) >= ANSWER_TIMEOUT
        };
        let over = self.open.extract_if(.., is_over);
        over.map(|Open { from, effector, is_done, target, .. }| {
            let refused = if is_done {
                (value(effector, faults) != target).then(|| not_as_set(effector, faults, effectors))
            } else {
                let name = effectors.name(effector);
                Some(format!("Not confirmed: {name}: the aircraft does not answer"))
            };
            Answer { from, effector, refused }
        })
        .collect()
    }

    /// Effectors whose value differs from the published one. One with an open command waits for its answer:
    /// the value between the end of a fault and the onset of its replacement is not worth publishing.
    pub(super) fn changed(
        &mut self,
        faults: &FaultList,
        effectors: &EffectorList,
    ) -> Vec<Effector> {
        let Self { open, published } = self;
        let is_free = |effector: &Effector| open.iter().all(|open| open.effector != *effector);
        let changed = effectors.all().filter(is_free).filter(|effector| {
            let value = value(*effector, faults);
            std::mem::replace(&mut published[*effector], value) != value
        });
        changed.collect()
    }

    /// When the first command will have waited for too long.
    pub(super) fn next_deadline(&self) -> Option<WallTime> {
        self.open.iter().map(|open| open.since + ANSWER_TIMEOUT).min()
    }
}
