//! COMMAND_LONG and COMMAND_INT: exactly one final COMMAND_ACK for each received copy.
//!
//! The service answers a command at once or, where the aircraft decides, when its outcome arrives. SET_MODE is handled in the
//! same way without an acknowledgement: the next heartbeat shows the mode, and a text gives the reason of a refusal.

use core::time::Duration;

use ::mavlink::dialects::common::MavResult;
use arrayvec::ArrayVec;
use icd::fault::{FaultReply, NO_ANSWER, Refusal, Target};
use icd::{EffectorList, FaultRequest};

use crate::aircraft::Phase;
use crate::codec::{CommandError, CommandMessage, Encoded, Identity, Message, SetMode};
use crate::failure::Reasons;
use crate::param::PREFLIGHT_STORAGE;
use crate::peers::From;
use crate::queues::OpenCommand;
use crate::statustext::StatusTexts;
use crate::wall_time::WallTime;
use crate::{Caller, Service, Shared, failure, modes};
use flight_management::command::{Command, Outcome, ScriptCommand, VehicleCommand};
use flight_management::vehicle::Mode;

mod rules;

pub use crate::command::rules::known;

/// Commands that may be open at the same time.
const OPEN_MAX: usize = 32;
/// Copies of one command that may wait for its outcome.
const COPIES_MAX: u32 = 32;
/// A command without an outcome fails after this time. Ground stations give up after two or three seconds.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);
/// Interval of progress reports for a command in execution: MAVSDK repeats it after 0.5 s.
const PROGRESS: Duration = Duration::from_millis(400);

/// Decision of a rule about a command; by default it is accepted, with nothing more to do.
#[derive(Debug, Default)]
struct Decision {
    /// Accepted, with these messages as the answer.
    answers: Vec<Encoded>,
    /// Commands to the aircraft; without any the command is accepted at once.
    intents: Vec<Command>,
    /// Note to the operator once it is accepted.
    note: Option<String>,
}

impl Decision {
    /// Accepted, with these messages as the answer.
    fn answer(answers: Vec<Encoded>) -> Self {
        Self { answers, ..Self::default() }
    }

    fn pass_on(command: impl Into<Command>) -> Self {
        Self { intents: vec![command.into()], ..Self::default() }
    }

    fn with_note(self, note: impl Into<Option<String>>) -> Self {
        Self { note: note.into(), ..self }
    }
}

/// A command whose outcome is still open.
#[derive(Debug)]
struct PendingCommand {
    from: From,
    /// `None` for a SET_MODE, which has no acknowledgement.
    command: Option<CommandMessage>,
    copies: u32,
    since: WallTime,
    /// Time of the last progress report, or of the command.
    reported: WallTime,
    /// Note to the operator once it is accepted.
    note: Option<String>,
    /// The command steers the aircraft: its sender gets control once it is accepted.
    steers: bool,
    /// The mode that it requests.
    mode: Option<Mode>,
    parts: ArrayVec<OpenCommand, { Target::MAX }>,
    verdict: CommandVerdict,
}

/// Outcome of a command, from the parts answered so far.
#[derive(Debug, Default)]
struct CommandVerdict {
    /// Accepted (the default) until a part is not; once denied, the command stays denied.
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

#[derive(Debug, Default)]
pub struct CommandService {
    open: Vec<PendingCommand>,
    /// The latest numbered simulation step that was accepted.
    numbered_step: Option<(From, CommandMessage)>,
}

impl Service for CommandService {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        match message {
            // The parameter service answers that one.
            Message::Command(command) if command.id != PREFLIGHT_STORAGE => {
                let result = match self.handle_command(from, command, now, shared) {
                    Ok(None) => return,
                    Ok(Some(result)) => result,
                    Err(error) => report(error, now, shared),
                };
                let ack = Encoded::command_ack(command.id, result, from.sender);
                shared.peers.answer(from.peer, ack);
            }
            Message::SetMode(SetMode { is_custom, main, sub }) => {
                let begun = check_not_over(shared)
                    .and_then(|()| modes::requested(*is_custom, *main, *sub, shared.streams))
                    .map(|mode| Decision::pass_on(VehicleCommand::Mode(mode)))
                    .and_then(|decision| self.begin(from, None, decision, now, shared));
                if let Err(error) = begun {
                    report(error, now, shared);
                }
            }
            _ => {}
        }
    }

    /// Records the outcome of one intent; acknowledges the command after the last one.
    fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        shared: &mut Shared,
    ) {
        let part_of =
            |open: &PendingCommand| open.parts.iter().position(|part| part.number == number);
        // Outcomes of intents without a waiting command are expected.
        let Some(index) = self.open.iter().position(|open| part_of(open).is_some()) else { return };
        let open = &mut self.open[index];
        if let Some(part) = part_of(open).map(|part| open.parts.remove(part)) {
            open.verdict.take(part, outcome, now, shared);
        }
        if !open.parts.is_empty() {
            return;
        }
        let open = self.open.swap_remove(index);
        // Only an accepted one counts: what was refused may come again with its number.
        if let Some(command) = open.command
            && open.verdict.result == MavResult::MAV_RESULT_ACCEPTED
            && rules::is_numbered_step(&command)
        {
            self.numbered_step = Some((open.from, command));
        }
        close(open, now, shared);
    }

    /// The first station that has requested this mode and waits for it.
    fn requester_of(&self, mode: Mode) -> Option<Identity> {
        let requests = self.open.iter().filter(|open| open.mode == Some(mode));
        requests.min_by_key(|open| open.since).map(|open| open.from.sender)
    }

    /// Reports progress to the senders of open commands, and gives up those that have been open for too long.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        let is_over = |open: &mut PendingCommand| now.since(open.since) >= ANSWER_TIMEOUT;
        for open in self.open.extract_if(.., is_over) {
            close(open, now, shared);
        }
        for open in &mut self.open {
            if let Some(command) = open.command.filter(|_| now.since(open.reported) >= PROGRESS) {
                open.reported = now;
                let result = MavResult::MAV_RESULT_IN_PROGRESS;
                let ack = Encoded::command_ack(command.id, result, open.from.sender);
                shared.peers.answer(open.from.peer, ack);
            }
        }
    }

    /// When the next command needs a progress report or times out.
    fn next_deadline(&self, _: &Shared) -> Option<WallTime> {
        let due = |open: &PendingCommand| {
            let over = open.since + ANSWER_TIMEOUT;
            if open.command.is_some() { over.min(open.reported + PROGRESS) } else { over }
        };
        self.open.iter().map(due).min()
    }
}

impl CommandService {
    /// Handles one copy of a command. `None`: the acknowledgement comes later.
    fn handle_command(
        &mut self,
        from: From,
        command: &CommandMessage,
        now: WallTime,
        shared: &mut Shared,
    ) -> Result<Option<MavResult>, CommandError> {
        let is_copy =
            |open: &&mut PendingCommand| open.from == from && open.command == Some(*command);
        if let Some(open) = self.open.iter_mut().find(is_copy) {
            // It gets its own answer together with the first.
            if open.copies >= COPIES_MAX {
                return Ok(Some(MavResult::MAV_RESULT_TEMPORARILY_REJECTED));
            }
            open.copies += 1;
            return Ok(None);
        }
        // The one command that has an additional effect with each copy.
        if self.numbered_step == Some((from, *command)) {
            return Ok(Some(MavResult::MAV_RESULT_ACCEPTED));
        }
        let decision = rules::decide(command, &mut Caller { from, now, shared })?;
        self.begin(from, Some(command), decision, now, shared)
    }

    /// Executes a decision about a command, or about a SET_MODE without one. `None`: the acknowledgement comes later.
    fn begin(
        &mut self,
        from: From,
        command: Option<&CommandMessage>,
        decision: Decision,
        now: WallTime,
        shared: &mut Shared,
    ) -> Result<Option<MavResult>, CommandError> {
        let Decision { answers, intents, note } = decision;
        let needs_flight = |command: &Command| match command {
            Command::Vehicle(command) => {
                !matches!(command, VehicleCommand::PlanItem(_) | VehicleCommand::EnableFence(_))
            }
            _ => false,
        };
        if intents.iter().any(needs_flight) {
            check_not_over(shared)?;
        }
        // All intents of a command or none: half of one could not be acknowledged.
        let has_room = self.open.len() < OPEN_MAX && shared.intents.room() >= intents.len();
        if !intents.is_empty() && !has_room {
            return Err(CommandError::temporary("Too many commands are waiting"));
        }
        for message in answers {
            shared.peers.answer(from.peer, message);
        }
        if intents.is_empty() {
            if let Some(note) = note {
                shared.texts.inform(now, note);
            }
            return Ok(Some(MavResult::MAV_RESULT_ACCEPTED));
        }
        let steers = intents.iter().any(|command| steers(command, shared.aircraft.mode()));
        let mode = intents.iter().find_map(mode_of);
        let parts = intents.into_iter().filter_map(|command| shared.intents.open(command));
        self.open.push(PendingCommand {
            from,
            command: command.copied(),
            copies: 1,
            since: now,
            reported: now,
            note,
            steers,
            mode,
            parts: parts.collect(),
            verdict: CommandVerdict::default(),
        });
        Ok(None)
    }
}

/// After ground contact nothing can be flown.
fn check_not_over(shared: &Shared) -> Result<(), CommandError> {
    if shared.aircraft.phase() == Phase::OnGround {
        return Err(CommandError::temporary("The flight is over: a reboot begins a new one"));
    }
    Ok(())
}

/// The result for the acknowledgement; the operators get the reason.
fn report(error: CommandError, now: WallTime, shared: &mut Shared) -> MavResult {
    if let Some(reason) = error.reason {
        shared.texts.warn(now, reason);
    }
    error.result
}

/// The mode that a command requests.
pub(super) fn mode_of(command: &Command) -> Option<Mode> {
    match command {
        Command::Vehicle(VehicleCommand::Mode(mode)) => Some(*mode),
        Command::Vehicle(VehicleCommand::Land) => Some(Mode::Mission),
        _ => None,
    }
}

/// Whether a command steers the aircraft. Faults and the pace of the simulation do not; an item of the
/// plan and home steer only the mode that flies to them.
pub(super) fn steers(command: &Command, mode: Mode) -> bool {
    match command {
        Command::Vehicle(command) => match command {
            VehicleCommand::Mode(_)
            | VehicleCommand::Refer(_)
            | VehicleCommand::Reposition(_)
            | VehicleCommand::Continue
            | VehicleCommand::Land
            | VehicleCommand::GoAround(_)
            | VehicleCommand::Terminate => true,
            VehicleCommand::PlanItem(_) => matches!(mode, Mode::Mission),
            VehicleCommand::Home(_) => matches!(mode, Mode::Return),
            _ => false,
        },
        Command::Script(ScriptCommand::Run(script)) => script.steers(),
        _ => false,
    }
}

/// Reports in one text what was not done, and acknowledges each copy. Parts still open count as unanswered.
fn close(mut open: PendingCommand, now: WallTime, shared: &mut Shared) {
    for part in &open.parts {
        open.verdict.not_now(part.target(), NO_ANSWER);
    }
    open.verdict.report(now, &mut shared.texts, &shared.model.effectors.list);
    let result = open.verdict.result;
    if result == MavResult::MAV_RESULT_ACCEPTED {
        if open.steers {
            shared.control.take(open.from.sender);
        }
        if let Some(note) = open.note {
            shared.texts.inform(now, note);
        }
    }
    let Some(command) = open.command else { return };
    let ack = Encoded::command_ack(command.id, result, open.from.sender);
    for _ in 0..open.copies {
        shared.peers.answer(open.from.peer, ack.clone());
    }
}

impl CommandVerdict {
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
            let text = format!("No active fault: {}", failure::names(&self.healthy, effectors));
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
