//! The parameter protocol. Integers travel byte-wise, as with PX4.

use core::time::Duration;
use flight_management::command::Configuration;

use ::mavlink::dialects::common::{MavParamError, MavResult, MavSeverity, PARAM_REQUEST_READ_DATA};
use icd::Effector;

use super::codec::{CommandMessage, Encoded, ParamSet};
use super::context::{Context, From};
use super::convert;
use super::peers::{Peer, Peers};
use crate::wall_time::WallTime;
use faults::{Answer, FaultOrders};
use flight_management::command::Outcome;
use flight_management::parameters::{ParameterError, Parameters, table};
use keeper::{Keeper, Turn};
use rows::{Source, error_message, find, number, row, row_of, value_message};

mod faults;
mod keeper;
mod rows;

pub use keeper::{Save, Saved};
pub(super) use rows::{Row, rows};

/// MAV_CMD_PREFLIGHT_STORAGE.
pub const PREFLIGHT_STORAGE: u16 = 245;

/// A list is sent in bursts: five parameters each 10 ms are the 500 a second that a socket's buffer takes.
const BURST: usize = 5;
/// Time between two bursts.
const BURST_INTERVAL: Duration = Duration::from_millis(10);
/// A burst waits while a peer has less room than this for answers.
const ROOM_MIN: usize = 64;

/// A list that is being sent.
#[derive(Debug)]
struct List {
    peer: Peer,
    next: usize,
}

/// What the control thread does not know yet.
#[derive(Debug, Default)]
struct Changed {
    gains: bool,
    limits: bool,
    navigation: bool,
    fault_injection: bool,
}

impl Changed {
    fn note(&mut self, before: &Parameters, after: &Parameters) {
        self.gains |= before.gains != after.gains;
        self.limits |= before.limits != after.limits;
        self.navigation |= before.navigation != after.navigation;
        self.fault_injection |= before.failure.enabled != after.failure.enabled;
    }

    fn any(&self) -> bool {
        self.gains || self.limits || self.navigation || self.fault_injection
    }
}

/// Answers reads and writes.
#[derive(Debug, Default)]
pub struct ParamService {
    /// At most one for each peer.
    lists: Vec<List>,
    next_burst: WallTime,
    changed: Changed,
    keeper: Keeper,
    faults: FaultOrders,
}

impl ParamService {
    /// From now on changes are saved; `kept` is what is saved already.
    pub fn keep(&mut self, kept: Parameters) {
        self.keeper.begin(kept);
    }

    /// PARAM_REQUEST_LIST: starts the list of this peer, from the beginning if one was being sent.
    pub fn handle_list(&mut self, from: From) {
        self.lists.retain(|list| list.peer != from.peer);
        self.lists.push(List { peer: from.peer, next: 0 });
    }

    /// PARAM_REQUEST_READ, by index or, where that is negative, by name.
    pub fn handle_read(
        &mut self,
        from: From,
        data: &PARAM_REQUEST_READ_DATA,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        let found = match usize::try_from(data.param_index) {
            Ok(index) => row(index, ctx.parameters, ctx.aircraft.faults(), ctx.effectors()),
            Err(_) => find(&data.param_id, ctx.parameters, ctx.aircraft.faults(), ctx.effectors()),
        };
        let message = match found {
            Some(row) => value_message(&row, ctx.effectors()),
            None => {
                let error = MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST;
                error_message(from, *data.param_id, data.param_index, error)
            }
        };
        out.answer(from.peer, message);
    }

    /// PARAM_SET. What is set is told to every peer; what is refused echoes the old value to the sender.
    pub fn handle_set(
        &mut self,
        from: From,
        set: &ParamSet,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        let Some(old) = find(&set.id, ctx.parameters, ctx.aircraft.faults(), ctx.effectors())
        else {
            let error = MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST;
            out.answer(from.peer, error_message(from, set.id, -1, error));
            return;
        };
        let done = match old.source {
            Source::Fault(effector) => self.order_fault(from, effector, set, now, ctx, out),
            _ => self.set(&old, set, now, ctx).map(|()| {
                if let Some(row) =
                    row(old.index, ctx.parameters, ctx.aircraft.faults(), ctx.effectors())
                {
                    out.announce(&value_message(&row, ctx.effectors()));
                }
            }),
        };
        match done {
            Ok(()) => {}
            Err((error, reason)) => {
                ctx.texts.refuse(now, reason);
                out.answer(from.peer, value_message(&old, ctx.effectors()));
                let index = i16::try_from(old.index).unwrap_or(-1);
                out.answer(from.peer, error_message(from, set.id, index, error));
            }
        }
        self.pass_on(ctx);
    }

    /// A fault: the answer comes when the plant has given its own.
    fn order_fault(
        &mut self,
        from: From,
        effector: Effector,
        set: &ParamSet,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) -> Result<(), (MavParamError, String)> {
        let Some(value) = number(set) else {
            let reason = format!("Fault refused: type {} is not supported", set.kind);
            return Err((MavParamError::MAV_PARAM_ERROR_TYPE_UNSUPPORTED, reason));
        };
        let ordered = self
            .faults
            .set(from, effector, value, now, ctx)
            .map_err(|reason| (MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, reason))?;
        if !ordered {
            publish_fault(Answer { from, effector, refused: None }, now, ctx, out);
        }
        Ok(())
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
        if let Some(answer) = self.faults.handle_outcome(number, outcome, ctx.effectors()) {
            publish_fault(answer, now, ctx, out);
        }
    }

    /// Tells the fault parameters that have changed, and answers who waits for one.
    pub fn follow_faults(&mut self, now: WallTime, ctx: &mut Context, out: &mut Peers) {
        let answers = self.faults.answers(now, ctx.aircraft.faults(), ctx.effectors());
        let changed = self.faults.changed(ctx.aircraft.faults(), ctx.effectors());
        for row in changed.iter().filter_map(|effector| row_of(*effector, ctx)) {
            out.announce(&value_message(&row, ctx.effectors()));
        }
        for answer in answers {
            // A change has been told to everybody.
            if answer.refused.is_some() || !changed.contains(&answer.effector) {
                publish_fault(answer, now, ctx, out);
            }
        }
    }

    fn set(
        &mut self,
        old: &Row,
        set: &ParamSet,
        now: WallTime,
        ctx: &mut Context,
    ) -> Result<(), (MavParamError, String)> {
        let name = old.name;
        let Some(value) = number(set) else {
            let reason = format!("{name} not set: type {} is not supported", set.kind);
            return Err((MavParamError::MAV_PARAM_ERROR_TYPE_UNSUPPORTED, reason));
        };
        self.change(old, value, now, ctx)
    }

    /// Sets a parameter as PARAM_SET does: checked, told to every peer, saved.
    ///
    /// # Errors
    /// Why it keeps its old value.
    pub(super) fn write(
        &mut self,
        old: &Row,
        value: f64,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) -> Result<(), String> {
        self.change(old, value, now, ctx).map_err(|(_, reason)| reason)?;
        if let Some(row) = row(old.index, ctx.parameters, ctx.aircraft.faults(), ctx.effectors()) {
            out.announce(&value_message(&row, ctx.effectors()));
        }
        self.pass_on(ctx);
        Ok(())
    }

    fn change(
        &mut self,
        old: &Row,
        value: f64,
        now: WallTime,
        ctx: &mut Context,
    ) -> Result<(), (MavParamError, String)> {
        let name = old.name;
        // What the wire cannot tell apart is the same, so an echo of a default leaves it exact.
        let same = convert::float(value).to_bits() == convert::float(old.value).to_bits();
        if same && old.source == Source::Compatibility {
            return Ok(());
        }
        if !same {
            let before = *ctx.parameters;
            let set = ctx.parameters.set(&name, value);
            let set = set.and_then(|warning| ctx.parameters.check_law().map(|()| warning));
            let warning = set.map_err(|error| {
                *ctx.parameters = before;
                refusal(error)
            })?;
            if let Some(warning) = warning {
                let text = format!("{name} set {warning}");
                ctx.texts.reply(MavSeverity::MAV_SEVERITY_WARNING, now, text);
            }
            self.changed.note(&before, ctx.parameters);
        }
        let value = if same { old.value } else { value };
        if let Err(error) = self.keeper.keep(&name, value, ctx.defaults) {
            let text = format!("{name} set, but not saved: {error}");
            ctx.texts.reply(MavSeverity::MAV_SEVERITY_WARNING, now, text);
        }
        Ok(())
    }

    /// PREFLIGHT_STORAGE: p1 1 saves now, 2 and 4 go back to the defaults. Acknowledged when it is on the
    /// disk. Changes are saved without it as well.
    pub fn handle_storage(
        &mut self,
        from: From,
        command: &CommandMessage,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        let [action, ..] = command.params;
        let saves = action == 1.0;
        let result = if saves || action == 2.0 || action == 4.0 {
            if self.keeper.is_crowded() {
                ctx.texts.refuse(now, "Not done: too many wait for a save");
                MavResult::MAV_RESULT_TEMPORARILY_REJECTED
            } else {
                if !saves {
                    self.reset(now, ctx, out);
                }
                if self.keeper.wait(from, ctx.defaults) {
                    return;
                }
                // Nothing is kept: the defaults are there all the same.
                if saves {
                    ctx.texts.refuse(now, "Not saved: there is no parameter file");
                    MavResult::MAV_RESULT_UNSUPPORTED
                } else {
                    MavResult::MAV_RESULT_ACCEPTED
                }
            }
        } else {
            let reason =
                "Storage refused: p1 is not 1 (save) or 2 (defaults); the file is read at start";
            ctx.texts.refuse(now, reason);
            MavResult::MAV_RESULT_UNSUPPORTED
        };
        out.answer(from.peer, Encoded::command_ack(PREFLIGHT_STORAGE, result, from.sender));
    }

    /// All parameters at their defaults, also those that the command line set.
    fn reset(&mut self, now: WallTime, ctx: &mut Context, out: &mut Peers) {
        let before = *ctx.parameters;
        *ctx.parameters = Parameters { brings_law: before.brings_law, ..*ctx.defaults };
        self.changed.note(&before, ctx.parameters);
        self.keeper.reset(ctx.defaults);
        let effectors = ctx.effectors();
        let faults = ctx.aircraft.faults();
        let differs = |index: &usize| {
            row(*index, &before, faults, effectors)
                != row(*index, ctx.parameters, faults, effectors)
        };
        let changed: Vec<usize> = (0..table().len()).filter(differs).collect();
        for row in changed.iter().filter_map(|index| row(*index, ctx.parameters, faults, effectors))
        {
            out.announce(&value_message(&row, ctx.effectors()));
        }
        let text = format!("Parameters are at their defaults: {} changed", changed.len());
        ctx.texts.reply(MavSeverity::MAV_SEVERITY_INFO, now, text);
        self.pass_on(ctx);
    }

    /// Next text to be saved.
    pub fn pop_save(&mut self) -> Option<Save> {
        self.keeper.pop()
    }

    /// Takes what became of a save, and answers those who waited for it.
    pub fn handle_saved(&mut self, saved: &Saved, ctx: &mut Context, out: &mut Peers) {
        let (answered, turn) = self.keeper.handle(saved);
        match (turn, &saved.result) {
            (Some(Turn::Fails), Err(reason)) => {
                let text = format!("Parameters are not saved: {reason}");
                ctx.texts.say(MavSeverity::MAV_SEVERITY_WARNING, text);
            }
            (Some(Turn::Works), _) => {
                ctx.texts.say(MavSeverity::MAV_SEVERITY_INFO, "Parameters are saved again");
            }
            _ => {}
        }
        let result = match &saved.result {
            Ok(()) => MavResult::MAV_RESULT_ACCEPTED,
            Err(_) => MavResult::MAV_RESULT_FAILED,
        };
        for from in answered {
            out.answer(from.peer, Encoded::command_ack(PREFLIGHT_STORAGE, result, from.sender));
        }
    }

    /// Tells the control thread the latest values; tried again with the next poll if there is no room.
    fn pass_on(&mut self, ctx: &mut Context) {
        if self.changed.gains {
            let command = Configuration::Gains(Box::new(ctx.parameters.gains));
            self.changed.gains = ctx.intents.push(command).is_none();
        }
        if self.changed.limits {
            let command = Configuration::Limits(ctx.parameters.limits);
            self.changed.limits = ctx.intents.push(command).is_none();
        }
        if self.changed.navigation {
            let command = Configuration::Navigation(ctx.parameters.navigation);
            self.changed.navigation = ctx.intents.push(command).is_none();
        }
        if self.changed.fault_injection {
            let command = Configuration::FaultInjection(ctx.parameters.failure.enabled);
            self.changed.fault_injection = ctx.intents.push(command).is_none();
        }
    }

    /// Sends the next burst of each list.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context, out: &mut Peers) {
        self.pass_on(ctx);
        self.follow_faults(now, ctx, out);
        if self.lists.is_empty() || now < self.next_burst {
            return;
        }
        self.next_burst = now + BURST_INTERVAL;
        self.lists.retain_mut(|list| {
            if !out.knows(list.peer) {
                return false;
            }
            if out.room(list.peer) < ROOM_MIN {
                return true;
            }
            for _ in 0..BURST {
                let row = row(list.next, ctx.parameters, ctx.aircraft.faults(), ctx.effectors());
                let Some(row) = row else { return false };
                out.answer(list.peer, value_message(&row, ctx.effectors()));
                list.next += 1;
            }
            true
        });
    }

    /// When the next burst is due.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        let burst = (!self.lists.is_empty() || self.changed.any()).then_some(self.next_burst);
        burst.into_iter().chain(self.faults.next_deadline()).min()
    }
}

/// The value as it is, to who wanted another, and why it is so.
fn publish_fault(answer: Answer, now: WallTime, ctx: &mut Context, out: &mut Peers) {
    let Answer { from, effector, refused } = answer;
    let Some(row) = row_of(effector, ctx) else { return };
    out.answer(from.peer, value_message(&row, ctx.effectors()));
    if let Some(reason) = refused {
        ctx.texts.refuse(now, reason);
        let index = i16::try_from(row.index).unwrap_or(-1);
        let mut id = [0; 16];
        for (place, byte) in id.iter_mut().zip(row.name.bytes()) {
            *place = byte;
        }
        let error = MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE;
        out.answer(from.peer, error_message(from, id, index, error));
    }
}

fn refusal(error: ParameterError) -> (MavParamError, String) {
    let kind = match error {
        ParameterError::Unknown { .. } => MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST,
        ParameterError::ReadOnly { .. } | ParameterError::OnlyInFlight { .. } => {
            MavParamError::MAV_PARAM_ERROR_READ_ONLY
        }
        ParameterError::OutOfRange { .. }
        | ParameterError::NotAChoice { .. }
        | ParameterError::NoOwnLaw
        | ParameterError::Order { .. }
        | ParameterError::Gains(_) => MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE,
    };
    (kind, format!("Not set: {error}"))
}
