//! COMMAND_LONG and COMMAND_INT: exactly one final COMMAND_ACK for each received copy.
//!
//! The service answers a command at once or, where the aircraft decides, when its outcome arrives. SET_MODE is handled in the
//! same way without an acknowledgement: the next heartbeat shows the mode, and a text gives the reason of a refusal.

use ::mavlink::dialects::common::MavResult;

use crate::aircraft::Phase;
use crate::codec::{CommandError, CommandMessage, Encoded, Identity, Message, SetMode};
use crate::command::pending::{OnAcceptance, Pending};
use crate::param::PREFLIGHT_STORAGE;
use crate::peers::From;
use crate::wall_time::WallTime;
use crate::{Service, Shared, failure, modes};
use flight_management::command::{Command, Outcome, ScriptCommand, VehicleCommand};
use flight_management::vehicle::Mode;

mod fields;
mod messages;
mod navigation;
mod pending;
mod references;
mod simulation;
mod state;

/// Sender of a command, and what its rule may read and use.
struct Caller<'a> {
    from: From,
    now: WallTime,
    shared: &'a mut Shared,
}

/// Decision of a rule about a command.
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
    /// Accepted, with nothing more to do.
    fn accept() -> Self {
        Self::default()
    }

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

#[derive(Debug, Default)]
pub struct CommandService {
    pending: Pending,
    /// The latest numbered simulation step that was accepted.
    numbered_step: Option<(From, CommandMessage)>,
}

impl Service for CommandService {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        match message {
            Message::Command(command) if command.id != PREFLIGHT_STORAGE => {
                self.handle_command(from, command, now, shared);
            }
            Message::SetMode(SetMode { is_custom, main, sub }) => {
                let mode = check_not_over(shared)
                    .and_then(|()| modes::requested(*is_custom, *main, *sub, shared.streams));
                let begun = mode.and_then(|mode| {
                    self.begin(
                        from,
                        None,
                        Decision::pass_on(VehicleCommand::Mode(mode)),
                        now,
                        shared,
                    )
                });
                if let Err(error) = begun {
                    report(error, now, shared);
                }
            }
            _ => {}
        }
    }

    fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        shared: &mut Shared,
    ) {
        let accepted = self.pending.resolve(number, outcome, now, shared);
        if let Some((from, command)) = accepted
            && simulation::is_numbered_step(&command)
        {
            self.numbered_step = Some((from, command));
        }
    }

    fn requester_of(&self, mode: Mode) -> Option<Identity> {
        self.pending.requester_of(mode)
    }

    /// Reports progress to waiting ground stations, and answers the commands without an outcome in time.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        self.pending.poll(now, shared);
    }

    fn next_deadline(&self, _: &Shared) -> Option<WallTime> {
        self.pending.next_deadline()
    }
}

impl CommandService {
    /// Handles one copy of a command.
    fn handle_command(
        &mut self,
        from: From,
        command: &CommandMessage,
        now: WallTime,
        shared: &mut Shared,
    ) {
        let result = match self.pending.join(from, command) {
            Some(joined) => joined.map(|()| None),
            // The one command that has an additional effect with each copy.
            None if self.numbered_step == Some((from, *command)) => {
                Ok(Some(MavResult::MAV_RESULT_ACCEPTED))
            }
            None => decide(command, &mut Caller { from, now, shared })
                .and_then(|decision| self.begin(from, Some(command), decision, now, shared)),
        };
        let result = match result {
            Ok(None) => return,
            Ok(Some(result)) => result,
            Err(error) => report(error, now, shared),
        };
        shared.peers.answer(from.peer, Encoded::command_ack(command.id, result, from.sender));
    }

    /// `None`: the acknowledgement comes later.
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
            Command::Vehicle(command) => !matches!(command, VehicleCommand::PlanItem(_)),
            _ => false,
        };
        if intents.iter().any(needs_flight) {
            check_not_over(shared)?;
        }
        if !intents.is_empty()
            && (!self.pending.has_room() || shared.intents.room() < intents.len())
        {
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
        let on_acceptance = OnAcceptance { note, steers, mode };
        self.pending.open(from, command, parts.collect(), on_acceptance, now);
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
            | VehicleCommand::Terminate => true,
            VehicleCommand::PlanItem(_) => matches!(mode, Mode::Mission),
            VehicleCommand::Home(_) => matches!(mode, Mode::Return),
            _ => false,
        },
        Command::Script(ScriptCommand::Run(script)) => script.steers(),
        _ => false,
    }
}

type Rule = fn(&CommandMessage, &mut Caller) -> Result<Decision, CommandError>;

/// Number of each command (MAV_CMD), its name and its rule.
const RULES: [(u16, &str, Rule); 34] = [
    (17, "NAV_LOITER_UNLIM", navigation::loiter),
    (20, "NAV_RETURN_TO_LAUNCH", state::return_home),
    (21, "NAV_LAND", state::land),
    (22, "NAV_TAKEOFF", state::take_off),
    (31, "NAV_LOITER_TO_ALT", navigation::loiter_to_altitude),
    (34, "DO_ORBIT", navigation::orbit),
    (176, "DO_SET_MODE", state::set_mode),
    (178, "DO_CHANGE_SPEED", references::change_speed),
    (179, "DO_SET_HOME", navigation::set_home),
    (185, "DO_FLIGHTTERMINATION", state::terminate),
    (186, "DO_CHANGE_ALTITUDE", references::change_altitude),
    (189, "DO_LAND_START", state::land),
    (192, "DO_REPOSITION", navigation::reposition),
    (193, "DO_PAUSE_CONTINUE", navigation::pause_or_continue),
    (224, "DO_SET_MISSION_CURRENT", navigation::set_mission_item),
    (241, "PREFLIGHT_CALIBRATION", state::calibrate),
    (246, "PREFLIGHT_REBOOT_SHUTDOWN", simulation::restart),
    (262, "DO_SET_STANDARD_MODE", state::set_standard_mode),
    (300, "MISSION_START", navigation::start_mission),
    (400, "COMPONENT_ARM_DISARM", state::arm_or_disarm),
    (401, "RUN_PREARM_CHECKS", state::prearm_checks),
    (410, "GET_HOME_POSITION", messages::home_position),
    (failure::INJECT_FAILURE, "INJECT_FAILURE", simulation::fault),
    (510, "GET_MESSAGE_INTERVAL", messages::interval),
    (511, "SET_MESSAGE_INTERVAL", messages::set_interval),
    (512, "REQUEST_MESSAGE", messages::request),
    (519, "REQUEST_PROTOCOL_VERSION", messages::protocol_version),
    (520, "REQUEST_AUTOPILOT_CAPABILITIES", messages::capabilities),
    (failure::USER_1, "USER_1", simulation::fault),
    (simulation::USER_2, "USER_2", simulation::pace),
    (simulation::USER_3, "USER_3", simulation::script),
    (43_000, "GUIDED_CHANGE_SPEED", references::guided_speed),
    (43_001, "GUIDED_CHANGE_ALTITUDE", references::guided_altitude),
    (43_002, "GUIDED_CHANGE_HEADING", references::guided_heading),
];

/// Outcome of a command.
fn decide(command: &CommandMessage, caller: &mut Caller) -> Result<Decision, CommandError> {
    match RULES.iter().find(|(id, ..)| *id == command.id) {
        Some((.., rule)) => rule(command, caller),
        None => Err(CommandError::without_text(MavResult::MAV_RESULT_UNSUPPORTED)),
    }
}

/// Number and name of each command that is understood.
pub fn known() -> impl Iterator<Item = (u16, &'static str)> {
    RULES.iter().map(|(id, name, _)| (*id, *name))
}
