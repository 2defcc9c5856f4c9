//! COMMAND_LONG and COMMAND_INT: exactly one final COMMAND_ACK for each copy received.
//!
//! A command is answered at once, or, where the aircraft has to say something, when it has. SET_MODE takes
//! the same way without an acknowledgement: the next heartbeat shows the mode, and a text says why it was refused.

#![expect(deprecated, reason = "ground stations still send SET_MODE")]

use ::mavlink::dialects::common::{MavModeFlag, MavResult, MavSeverity, SET_MODE_DATA};
use arrayvec::ArrayVec;
use flight_management::command::ScriptCommand;
use flight_management::command::VehicleCommand;
use icd::FaultRequest;

use super::codec::{CommandMessage, Encoded};
use super::context::{Context, From};
use super::modes;
use super::peers::Peers;
use super::pending::{OnAcceptance, Part, Pending};
use super::refused::Refused;
use crate::wall_time::WallTime;
use flight_management::command::{Command, Outcome};
use flight_management::vehicle::Mode;

mod fields;
mod home;
mod messages;
mod mission;
mod places;
mod references;
mod script;
mod simulation;
mod state;
pub mod table;

/// What a rule may look at and use.
struct Asking<'a, 'b> {
    from: From,
    now: WallTime,
    ctx: &'a mut Context<'b>,
}

/// What a command comes to.
#[derive(Debug, Default)]
struct Decision {
    /// Messages that answer it.
    shown: Vec<Encoded>,
    /// What is up to the aircraft; without any the command is accepted at once.
    asked: Vec<Asked>,
    /// What the operator should know once it is accepted.
    note: Option<String>,
}

#[derive(Debug)]
struct Asked {
    command: Command,
    /// What it breaks or mends.
    fault: Option<FaultRequest>,
}

impl Decision {
    /// Accepted, nothing more to do.
    fn accept() -> Self {
        Self::default()
    }

    /// Accepted, and these messages are the answer.
    fn show(shown: Vec<Encoded>) -> Self {
        Self { shown, ..Self::default() }
    }

    /// Up to the aircraft.
    fn ask(command: impl Into<Command>) -> Self {
        Self::ask_all([command.into()])
    }

    fn ask_all(commands: impl IntoIterator<Item = Command>) -> Self {
        let asked = commands.into_iter().map(|command| Asked { command, fault: None });
        Self { asked: asked.collect(), ..Self::default() }
    }

    fn noting(self, note: impl Into<Option<String>>) -> Self {
        Self { note: note.into(), ..self }
    }
}

/// Answers commands.
#[derive(Debug, Default)]
pub struct CommandService {
    pending: Pending,
    /// The latest step of the simulation that had a number and was taken.
    numbered_step: Option<(From, CommandMessage)>,
}

impl CommandService {
    /// Takes one copy of a command.
    pub fn handle(
        &mut self,
        from: From,
        command: &CommandMessage,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        let result = match self.pending.join(from, command) {
            Some(joined) => joined.map(|()| None),
            // The one command that does more each time it comes.
            None if self.numbered_step == Some((from, *command)) => {
                Ok(Some(MavResult::MAV_RESULT_ACCEPTED))
            }
            None => table::decide(command, &mut Asking { from, now, ctx })
                .and_then(|decision| self.begin(from, Some(command), decision, now, ctx, out)),
        };
        let result = match result {
            Ok(None) => return,
            Ok(Some(result)) => result,
            Err(refused) => report_refusal(refused, now, ctx),
        };
        out.answer(from.peer, Encoded::command_ack(command.id, result, from.sender));
    }

    /// SET_MODE.
    pub fn handle_set_mode(
        &mut self,
        from: From,
        data: &SET_MODE_DATA,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        let [_, _, main, sub] = data.custom_mode.to_le_bytes();
        let has_custom_flag =
            data.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED);
        self.ask_for_mode(from, has_custom_flag, (main, sub), now, ctx, out);
    }

    /// Asks for PX4's main and sub mode without an acknowledgement: SET_MODE, and the mode switch.
    pub fn ask_for_mode(
        &mut self,
        from: From,
        has_custom_flag: bool,
        (main, sub): (u8, u8),
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        let begun = modes::requested(has_custom_flag, main, sub, ctx.streams()).and_then(|mode| {
            self.begin(from, None, Decision::ask(VehicleCommand::Mode(mode)), now, ctx, out)
        });
        if let Err(refused) = begun {
            report_refusal(refused, now, ctx);
        }
    }

    /// `None`: the acknowledgement comes later.
    fn begin(
        &mut self,
        from: From,
        command: Option<&CommandMessage>,
        decision: Decision,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) -> Result<Option<MavResult>, Refused> {
        let Decision { shown, asked, note } = decision;
        if !asked.is_empty() && (!self.pending.has_room() || ctx.intents.room() < asked.len()) {
            return Err(Refused::for_now("Too many commands are waiting"));
        }
        for message in shown {
            out.answer(from.peer, message);
        }
        if asked.is_empty() {
            if let Some(note) = note {
                ctx.texts.reply(MavSeverity::MAV_SEVERITY_INFO, now, note);
            }
            return Ok(Some(MavResult::MAV_RESULT_ACCEPTED));
        }
        let steers = asked.iter().any(|asked| steers(&asked.command, ctx.aircraft.mode()));
        let mode = asked.iter().find_map(|asked| match asked.command {
            Command::Vehicle(VehicleCommand::Mode(mode)) => Some(mode),
            _ => None,
        });
        let mut parts = ArrayVec::new();
        for Asked { command, fault } in asked {
            if let Some(number) = ctx.intents.push(command) {
                parts.push(Part { number, fault });
            }
        }
        self.pending.open(from, command, parts, OnAcceptance { note, steers, mode }, now);
        Ok(None)
    }

    /// Takes a change of mode: if somebody has asked for it, it has control before the outcome says so.
    pub fn handle_mode(&mut self, mode: Mode, ctx: &mut Context) {
        if let Some(from) = self.pending.asker_of(mode) {
            ctx.control.take(from.sender);
        }
    }

    /// Takes the outcome of an intent.
    pub fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        let accepted = self.pending.resolve(number, outcome, now, ctx, out);
        if let Some((from, command)) = accepted
            && simulation::is_numbered_step(&command)
        {
            self.numbered_step = Some((from, command));
        }
    }

    /// Reports progress to waiting ground stations, and answers the commands that got no outcome in time.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context, out: &mut Peers) {
        self.pending.poll(now, ctx, out);
    }

    /// When the next answer or progress report is due.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        self.pending.next_deadline()
    }
}

/// The result for the acknowledgement; the reason goes to the operators.
fn report_refusal(refused: Refused, now: WallTime, ctx: &mut Context) -> MavResult {
    if let Some(reason) = refused.reason {
        ctx.texts.refuse(now, reason);
    }
    refused.result
}

/// Whether a command steers the aircraft. Breaking or mending it does not, nor does the pace of the simulation; an
/// item of the plan and home steer only the mode that flies to them.
pub(super) fn steers(command: &Command, mode: Mode) -> bool {
    match command {
        Command::Vehicle(command) => match command {
            VehicleCommand::Mode(_)
            | VehicleCommand::Refer(_)
            | VehicleCommand::Reposition(_)
            | VehicleCommand::Continue
            | VehicleCommand::Terminate => true,
            VehicleCommand::PlanItem(_) => matches!(mode, Mode::Mission),
            VehicleCommand::Home(_) => matches!(mode, Mode::Return),
            _ => false,
        },
        Command::Script(ScriptCommand::Run(script)) => script.steers(),
        _ => false,
    }
}
