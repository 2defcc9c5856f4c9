//! The parameters FLT_SERVO1 to FLT_SERVO7, FLT_MOTOR1 and those of the sensors: setting one injects a fault or clears it.
//!
//! ```text
//!  PARAM_SET ─> command ─> plant ─> outcome ─> its fault on the list ─> PARAM_VALUE, to everybody
//!                 └refused───────────┴refused, silent──> PARAM_VALUE as it is, and a text with the reason
//! ```
//!
//! The value is the fault on the list, whichever client injected it: the active one, else the next one. So 0 always clears it. The
//! service publishes every change.

use core::time::Duration;

use icd::EffectorList;
use icd::fault::{Failure, FailureType, FaultEntry, FaultReply, NO_ANSWER, PlantAction, Target};

use crate::failure::{FaultCommand, Instances, Unit};
use crate::peers::From;
use crate::queues::OpenCommand;
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
struct OpenFault {
    from: From,
    command: OpenCommand,
    target: Target,
    /// The value that was set.
    value: u8,
    since: WallTime,
    /// The plant has executed it, but its report has not arrived yet.
    is_done: bool,
}

/// An answer due for a fault parameter.
#[derive(Debug)]
pub(super) struct Answer {
    pub(super) from: From,
    pub(super) target: Target,
    /// Why it was not set; `None` if it was.
    pub(super) refused: Option<String>,
}

/// The commands that wait for the plant, and the values as published.
#[derive(Debug, Default)]
pub(super) struct FaultParameters {
    open: Vec<OpenFault>,
    published: Vec<(Target, u8)>,
}

/// FAILURE_TYPE of the active fault of a target, else of the next one; 0 for none.
pub(super) fn value(target: Target, faults: &FaultList) -> u8 {
    faults.foremost(target).map_or(0, |entry| entry.kind.info().mavlink.failure_type.code())
}

/// The plant has accepted the command, but the list shows another fault, or none.
fn not_as_set(target: Target, faults: &FaultList, effectors: &EffectorList) -> String {
    let name = target.name(effectors);
    match faults.foremost(target) {
        Some(FaultEntry { kind, state, .. }) => {
            let kind = kind.described(target.class(effectors));
            format!("Not as set: {name}: there is another fault, {kind}, {state}")
        }
        None => format!("Not as set: {name}: the fault is over already"),
    }
}

impl FaultParameters {
    /// Requests the fault of a PARAM_SET from the plant; false if the plant has it already.
    pub(super) fn set(
        &mut self,
        from: From,
        target: Target,
        value: f64,
        now: WallTime,
        shared: &mut Shared,
    ) -> Result<bool, String> {
        let effectors = shared.effectors();
        let ((_, unit), instance) = (target.unit(effectors), target.instance(effectors));
        let is_it = |known: &FailureType| f64::from(known.code()) == libm::round(value);
        let Some(failure_type) = FailureType::ALL.into_iter().find(is_it) else {
            let (name, last) = (unit.to_ascii_uppercase(), FailureType::ALL.len() - 1);
            return Err(format!("Not set: FLT_{name}{instance} = {value} is outside 0 to {last}"));
        };
        let value = failure_type.code();
        if value == 0 && !shared.aircraft.faults().names(target) {
            // Nothing to clear: sending a whole parameter table back changes nothing.
            return Ok(false);
        }
        let instances = Instances::One(instance.into());
        let command = FaultCommand::new(
            Unit::of(target, shared.effectors()),
            Failure::Type(failure_type),
            instances,
        );
        let requests = failure::requests(&command, &shared.parameters, &shared.model)
            .map_err(|refused| refused.reason.unwrap_or_default())?;
        if self.open.len() >= OPEN_MAX {
            return Err("Not set: too many faults are waiting".to_owned());
        }
        for request in requests {
            let command = shared.intents.open(PlantAction::Fault(request).into());
            let command = command.ok_or("Not set: too many commands are waiting")?;
            self.open.push(OpenFault { from, command, target, value, since: now, is_done: false });
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
        let place = self.open.iter().position(|open| open.command.number == number)?;
        let open = self.open.get_mut(place)?;
        let refused = match outcome {
            Outcome::Plant(FaultReply::Refused(refusal)) => {
                failure::refused(refusal, Some(open.target), effectors)
            }
            Outcome::Refused(refusal) => refusal.to_string(),
            Outcome::NoAnswer => NO_ANSWER.to_owned(),
            Outcome::Done | Outcome::Plant(_) => {
                open.is_done = true;
                return None;
            }
        };
        let OpenFault { from, target, .. } = self.open.remove(place);
        let refused = Some(format!("Fault refused: {}: {refused}", target.name(effectors)));
        Some(Answer { from, target, refused })
    }

    /// Answers that are due: values that are on the list as they were set, and commands that have waited for too long.
    pub(super) fn answers(
        &mut self,
        now: WallTime,
        faults: &FaultList,
        effectors: &EffectorList,
    ) -> Vec<Answer> {
        let is_over = |open: &mut OpenFault| {
            // The reply of the plant comes before its report, and the value is that of the report.
            let is_there = open.is_done && value(open.target, faults) == open.value;
            is_there || now.since(open.since) >= ANSWER_TIMEOUT
        };
        let over = self.open.extract_if(.., is_over);
        over.map(|OpenFault { from, target, is_done, value: set, .. }| {
            let refused = if is_done {
                (value(target, faults) != set).then(|| not_as_set(target, faults, effectors))
            } else {
                let name = target.name(effectors);
                Some(format!("Not confirmed: {name}: {NO_ANSWER}"))
            };
            Answer { from, target, refused }
        })
        .collect()
    }

    /// Targets whose value differs from the published one. One with an open command waits for its answer:
    /// the value between the end of a fault and the onset of its replacement is not worth publishing.
    pub(super) fn changed(&mut self, faults: &FaultList, effectors: &EffectorList) -> Vec<Target> {
        let Self { open, published } = self;
        let is_free = |target: &Target| open.iter().all(|open| open.target != *target);
        let changed = Target::all(effectors).filter(is_free).filter(|target| {
            let value = value(*target, faults);
            match published.iter_mut().find(|(known, _)| known == target) {
                Some((_, before)) => std::mem::replace(before, value) != value,
                None => {
                    published.push((*target, value));
                    value != 0
                }
            }
        });
        changed.collect()
    }

    /// When the first command will have waited for too long.
    pub(super) fn next_deadline(&self) -> Option<WallTime> {
        self.open.iter().map(|open| open.since + ANSWER_TIMEOUT).min()
    }
}
