//! Commands whose outcome is still open.

use core::time::Duration;

use ::mavlink::dialects::common::{MavResult, MavSeverity};
use arrayvec::ArrayVec;
use icd::Effector;
use icd::fault::{FaultReply, Refusal};

use super::codec::{Command, Encoded};
use super::context::From;
use super::failure;
use super::peers::Peers;
use super::refused::Refused;
use super::statustext::StatusTexts;
use crate::clock::WallTime;
use crate::event::Outcome;

/// Commands that may be open at the same time.
const OPEN_MAX: usize = 32;
/// Copies of one command that may wait for its outcome.
const COPIES_MAX: u32 = 32;
/// After this the answer is that there was none. Ground stations give up after two or three seconds.
const PATIENCE: Duration = Duration::from_secs(3);

/// One intent of an open command.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    /// Number of the intent.
    pub number: u32,
    /// The effector that it breaks or mends, for the text.
    pub effector: Option<Effector>,
}

#[derive(Debug)]
struct Open {
    from: From,
    command: Command,
    copies: u32,
    since: WallTime,
    parts: ArrayVec<Part, { Effector::COUNT }>,
    /// Accepted, until a part says otherwise.
    result: MavResult,
}

/// The table of open commands.
#[derive(Debug, Default)]
pub struct Pending {
    open: Vec<Open>,
}

impl Pending {
    /// Joins a copy of an open command: it gets its own answer together with the first.
    ///
    /// `None` if no such command is open.
    pub fn join(&mut self, from: From, command: &Command) -> Option<Result<(), Refused>> {
        let open =
            self.open.iter_mut().find(|open| open.from == from && open.command == *command)?;
        if open.copies >= COPIES_MAX {
            return Some(Err(Refused::silent(MavResult::MAV_RESULT_TEMPORARILY_REJECTED)));
        }
        open.copies += 1;
        Some(Ok(()))
    }

    /// One more command may be opened.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.open.len() < OPEN_MAX
    }

    /// Opens a command that waits for the outcome of `parts`.
    pub fn open(
        &mut self,
        from: From,
        command: &Command,
        parts: ArrayVec<Part, { Effector::COUNT }>,
        now: WallTime,
    ) {
        let result = MavResult::MAV_RESULT_ACCEPTED;
        self.open.push(Open { from, command: *command, copies: 1, since: now, parts, result });
    }

    /// Takes the outcome of one intent; acknowledges the command when it was the last one.
    pub fn resolve(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        texts: &mut StatusTexts,
        out: &mut Peers,
    ) {
        let place = self.open.iter().enumerate().find_map(|(index, open)| {
            let part = open.parts.iter().position(|part| part.number == number)?;
            Some((index, part))
        });
        // Outcomes of intents that nobody waits for, or no longer, are expected.
        let Some((index, part)) = place else { return };
        let open = &mut self.open[index];
        let part = open.parts.remove(part);
        let refusal = match outcome {
            Outcome::Done => None,
            Outcome::Plant(reply) => told(part.effector, reply, now, texts),
            Outcome::Refused(refusal) => Some(match refusal {
                crate::vehicle::VehicleRefusal::NoFlight => Refused::for_now(refusal.to_string()),
                _ => Refused::denied(refusal.to_string()),
            }),
            Outcome::NoAnswer => Some(Refused::for_now("The aircraft does not answer")),
        };
        if let Some(Refused { result, reason }) = refusal {
            open.result = result;
            if let Some(reason) = reason {
                texts.refuse(now, reason);
            }
        }
        if open.parts.is_empty() {
            let open = self.open.swap_remove(index);
            acknowledge(&open, open.result, out);
        }
    }

    /// Gives up what has been open for too long.
    pub fn poll(&mut self, now: WallTime, texts: &mut StatusTexts, out: &mut Peers) {
        let is_over = |open: &mut Open| now.since(open.since) >= PATIENCE;
        for open in self.open.extract_if(.., is_over) {
            texts.refuse(now, "The aircraft does not answer");
            acknowledge(&open, MavResult::MAV_RESULT_TEMPORARILY_REJECTED, out);
        }
    }

    /// When the next command will be given up.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        self.open.iter().map(|open| open.since + PATIENCE).min()
    }
}

fn acknowledge(open: &Open, result: MavResult, out: &mut Peers) {
    for _ in 0..open.copies {
        out.answer(open.from.peer, Encoded::command_ack(open.command.id, result, open.from.sender));
    }
}

/// What the plant said; a text for what is not told by an event of its own.
fn told(
    effector: Option<Effector>,
    reply: &FaultReply,
    now: WallTime,
    texts: &mut StatusTexts,
) -> Option<Refused> {
    let name = effector.map_or(String::new(), |effector| {
        let (unit, instance) = failure::unit_and_instance(effector);
        format!("{unit} {instance}")
    });
    match reply {
        FaultReply::Applied { .. } | FaultReply::Unchanged { .. } | FaultReply::Cleared { .. } => {
            None
        }
        FaultReply::Scheduled { at } => {
            let text = format!("Scheduled: {name} at {at}");
            texts.reply(MavSeverity::MAV_SEVERITY_INFO, now, text);
            None
        }
        FaultReply::Refused(refusal) => {
            let reason = format!("Fault refused: {name}: {refusal}");
            Some(match refusal {
                Refusal::FlightOver | Refusal::ScheduleFull { .. } => Refused::for_now(reason),
                _ => Refused::denied(reason),
            })
        }
    }
}
