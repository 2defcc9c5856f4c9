//! Commands whose outcome is still open.

use core::time::Duration;

use ::mavlink::dialects::common::MavResult;
use arrayvec::ArrayVec;
use icd::fault::{FaultReply, NO_ANSWER, Refusal, Target};
use icd::{EffectorList, FaultRequest};

use crate::codec::{CommandError, CommandMessage, Encoded, Identity};
use crate::failure::Reasons;
use crate::peers::From;
use crate::queues::OpenCommand;
use crate::statustext::StatusTexts;
use crate::wall_time::WallTime;
use crate::{Shared, failure};
use flight_management::command::Outcome;
use flight_management::vehicle::Mode;

/// Commands that may be open at the same time.
const OPEN_MAX: usize = 32;
/// Copies of one command that may wait for its outcome.
const COPIES_MAX: u32 = 32;
/// A command without an outcome fails after this time. Ground stations give up after two or three seconds.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);
/// Interval of progress reports for a command in execution: MAVSDK repeats it after 0.5 s.
const PROGRESS: Duration = Duration::from_millis(400);
/// Actions once a command is accepted.
#[derive(Debug, Default)]
pub struct OnAcceptance {
    /// Note to the operator.
    pub note: Option<String>,
    /// The command steers the aircraft: its sender gets control.
    pub steers: bool,
    /// The mode that it requests.
    pub mode: Option<Mode>,
}

#[derive(Debug)]
struct Open {
    from: From,
    /// `None` for a SET_MODE, which has no acknowledgement.
    command: Option<CommandMessage>,
    copies: u32,
    since: WallTime,
    /// Time of the last progress report, or of the command.
    reported: WallTime,
    on_acceptance: OnAcceptance,
    parts: ArrayVec<OpenCommand, { Target::MAX }>,
    verdict: Verdict,
}

/// Outcome of a command, from the parts answered so far.
#[derive(Debug)]
struct Verdict {
    /// Accepted until a part is not; once denied, the command stays denied.
    result: MavResult,
    reasons: Reasons,
    /// A part was refused, not merely left without an answer.
    refused: bool,
    /// The targets for which the plant did what was requested.
    done: Vec<Target>,
    /// Faults that were cleared while scheduled or pausing: no event reports their end.
    cleared_without_event: Vec<Target>,
    /// Effectors that had no fault to clear.
    healthy: Vec<Target>,
    /// A fault was cleared, and an event reports it.
    cleared_active: bool,
}

/// The table of open commands.
#[derive(Debug, Default)]
pub struct Pending {
    open: Vec<Open>,
}

impl Pending {
    /// Adds a copy of an open command: it gets its own answer together with the first.
    ///
    /// `None` if no such command is open.
    pub fn join(
        &mut self,
        from: From,
        command: &CommandMessage,
    ) -> Option<Result<(), CommandError>> {
        let open = self
            .open
            .iter_mut()
            .find(|open| open.from == from && open.command == Some(*command))?;
        if open.copies >= COPIES_MAX {
            return Some(Err(CommandError::without_text(
                MavResult::MAV_RESULT_TEMPORARILY_REJECTED,
            )));
        }
        open.copies += 1;
        Some(Ok(()))
    }

    /// The first station that has requested this mode and waits for it.
    pub fn requester_of(&self, mode: Mode) -> Option<Identity> {
        let requests = self.open.iter().filter(|open| open.on_acceptance.mode == Some(mode));
        requests.min_by_key(|open| open.since).map(|open| open.from.sender)
    }

    /// Another command can be opened.
    pub fn has_room(&self) -> bool {
        self.open.len() < OPEN_MAX
    }

    /// Opens a command, or a SET_MODE without one, that waits for the outcome of `parts`.
    pub fn open(
        &mut self,
        from: From,
        command: Option<&CommandMessage>,
        parts: ArrayVec<OpenCommand, { Target::MAX }>,
        on_acceptance: OnAcceptance,
        now: WallTime,
    ) {
        self.open.push(Open {
            from,
            command: command.copied(),
            copies: 1,
            since: now,
            reported: now,
            on_acceptance,
            parts,
            verdict: Verdict::default(),
        });
    }

    /// Records the outcome of one intent; acknowledges the command after the last one, and returns it if
    /// it was accepted.
    pub fn resolve(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        shared: &mut Shared,
    ) -> Option<(From, CommandMessage)> {
        let place = self.open.iter().enumerate().find_map(|(index, open)| {
            let part = open.parts.iter().position(|part| part.number == number)?;
            Some((index, part))
        });
        // Outcomes of intents without a waiting command are expected.
        let (index, part) = place?;
        let open = &mut self.open[index];
        let part = open.parts.remove(part);
        open.verdict.take(part, outcome, now, shared);
        if !open.parts.is_empty() {
            return None;
        }
        let open = self.open.swap_remove(index);
        let is_accepted = open.verdict.result == MavResult::MAV_RESULT_ACCEPTED;
        let accepted = open.command.filter(|_| is_accepted).map(|command| (open.from, command));
        close(open, now, shared);
        accepted
    }

    /// Reports progress to the senders of open commands, and gives up those that have been open for too long.
    pub fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        let is_over = |open: &mut Open| now.since(open.since) >= ANSWER_TIMEOUT;
        for open in self.open.extract_if(.., is_over) {
            close(open, now, shared);
        }
        for open in &mut self.open {
            if let Some(command) = open.command.filter(|_| now.since(open.reported) >= PROGRESS) {
                open.reported = now;
                let result = MavResult::MAV_RESULT_IN_PROGRESS;
                shared.peers.answer(
                    open.from.peer,
                    Encoded::command_ack(command.id, result, open.from.sender),
                );
            }
        }
    }

    /// When the next command needs a progress report or times out.
    pub fn next_deadline(&self) -> Option<WallTime> {
        let due = |open: &Open| {
            let over = open.since + ANSWER_TIMEOUT;
            if open.command.is_some() { over.min(open.reported + PROGRESS) } else { over }
        };
        self.open.iter().map(due).min()
    }
}

/// Reports in one text what was not done, and acknowledges each copy. Parts still open count as unanswered.
fn close(mut open: Open, now: WallTime, shared: &mut Shared) {
    for part in &open.parts {
        open.verdict.not_now(part.target(), NO_ANSWER);
    }
    open.verdict.report(now, &mut shared.texts, &shared.model.effectors.list);
    let result = open.verdict.result;
    if result == MavResult::MAV_RESULT_ACCEPTED {
        if open.on_acceptance.steers {
            shared.control.take(open.from.sender);
        }
        if let Some(note) = open.on_acceptance.note {
            shared.texts.inform(now, note);
        }
    }
    let Some(command) = open.command else { return };
    let ack = Encoded::command_ack(command.id, result, open.from.sender);
    for _ in 0..open.copies {
        shared.peers.answer(open.from.peer, ack.clone());
    }
}

impl Default for Verdict {
    fn default() -> Self {
        Self {
            result: MavResult::MAV_RESULT_ACCEPTED,
            reasons: Reasons::default(),
            refused: false,
            done: Vec::new(),
            cleared_without_event: Vec::new(),
            healthy: Vec::new(),
            cleared_active: false,
        }
    }
}

impl Verdict {
    /// Records the outcome of one part.
    fn take(&mut self, part: OpenCommand, outcome: &Outcome, now: WallTime, shared: &mut Shared) {
        let target = part.target();
        match outcome {
            Outcome::Done => {}
            Outcome::Plant(reply) => self.take_reply(part, reply, now, shared),
            Outcome::Refused(refusal) => {
                self.refused = true;
                if refusal.is_temporary() {
                    self.not_now(target, refusal);
                } else {
                    self.never(target, refusal);
                }
            }
            Outcome::NoAnswer => self.not_now(target, NO_ANSWER),
        }
    }

    /// Records the reply of the plant; sends a text at once for what neither an event nor a refusal reports.
    fn take_reply(
        &mut self,
        part: OpenCommand,
        reply: &FaultReply,
        now: WallTime,
        shared: &mut Shared,
    ) {
        let target = part.target();
        match reply {
            FaultReply::Refused(refusal) => {
                self.refused = true;
                match refusal {
                    Refusal::FlightOver | Refusal::ScheduleFull { .. } => {
                        self.not_now(target, failure::refused(refusal, target, shared.effectors()));
                    }
                    _ => self.never(target, failure::refused(refusal, target, shared.effectors())),
                }
                return;
            }
            FaultReply::Scheduled { at } => {
                if let Some(FaultRequest::Inject { target, kind, timing }) = part.fault {
                    let effectors = shared.effectors();
                    let kind = kind.described(target.class(effectors));
                    let target = target.name(effectors);
                    let at_s = at.as_seconds();
                    let text = format!("Scheduled: {target} {kind}, at {at_s} s{timing}");
                    shared.texts.inform(now, text);
                }
            }
            FaultReply::Cleared { .. } => {
                // The end of an active fault is an event, which follows this answer.
                let faults = shared.aircraft.faults();
                match target {
                    Some(target) if faults.acting(target).is_some() => self.cleared_active = true,
                    Some(target) if faults.names(target) => self.cleared_without_event.push(target),
                    target => self.healthy.extend(target),
                }
            }
            FaultReply::Applied { .. } | FaultReply::Unchanged { .. } => {}
        }
        self.done.extend(target);
    }

    fn not_now(&mut self, target: Option<Target>, reason: impl ToString) {
        if self.result != MavResult::MAV_RESULT_DENIED {
            self.result = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;
        }
        self.reasons.add(reason.to_string(), target);
    }

    fn never(&mut self, target: Option<Target>, reason: impl ToString) {
        self.result = MavResult::MAV_RESULT_DENIED;
        self.reasons.add(reason.to_string(), target);
    }

    fn report(&self, now: WallTime, texts: &mut StatusTexts, effectors: &EffectorList) {
        if !self.cleared_without_event.is_empty() {
            let text = format!(
                "Nothing scheduled: {}",
                failure::names(&self.cleared_without_event, effectors)
            );
            texts.inform(now, text);
        } else if !self.healthy.is_empty() && !self.cleared_active {
            // Besides an active fault that was cleared, it needs no text.
            let text = format!("Nothing to mend: {}", failure::names(&self.healthy, effectors));
            texts.inform(now, text);
        }
        if self.reasons.is_empty() {
            return;
        }
        let head = match (self.refused, self.reasons.names_targets()) {
            (true, true) => "Fault refused",
            (true, false) => "Refused",
            (false, _) => "Not confirmed",
        };
        let mut text = format!("{head}: {}", self.reasons.text(effectors));
        if !self.done.is_empty() {
            text = format!("Done: {}. {text}", failure::names(&self.done, effectors));
        }
        texts.warn(now, text);
    }
}
