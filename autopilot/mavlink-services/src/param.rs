//! The parameter protocol. Integers travel byte-wise, as with PX4.

use core::time::Duration;

use ::mavlink::dialects::common::{MavParamError, MavResult, MavSeverity, PARAM_REQUEST_READ_DATA};
use icd::fault::Target;

use crate::codec::{CommandMessage, Encoded, Message, ParamSet};
use crate::param::faults::{Answer, FaultParameters};
use crate::param::keeper::{Keeper, Transition};
use crate::param::rows::{
    Source, error_message, find, meant, number, row, row_of, row_with, value_message,
};
use crate::peers::{From, Peer};
use crate::wall_time::WallTime;
use crate::{Service, Shared, convert};
use flight_management::command::{Configuration, Outcome};
use flight_management::event::EventKind;
use flight_management::parameters::{ParameterError, ParameterName, Parameters, table};

pub use crate::param::keeper::{Save, Saved};
pub(super) use crate::param::rows::{Row, rows};

mod faults;
mod keeper;
mod rows;

pub const PREFLIGHT_STORAGE: u16 = 245;

/// A list is sent in bursts: five parameters each 10 ms are the 500 a second that a socket's buffer takes.
const BURST: usize = 5;
/// Time between two bursts.
const BURST_INTERVAL: Duration = Duration::from_millis(10);
/// A read-only parameter is explained again after this time without an attempt to set it.
const REFUSED_AGAIN_AFTER: Duration = Duration::from_secs(10);
/// A burst waits while a peer has less room than this for answers.
const ROOM_MIN: usize = 64;

/// A list that is being sent.
#[derive(Debug)]
struct List {
    peer: Peer,
    next: usize,
}

/// Changes that the control thread has not received yet.
#[derive(Debug, Default)]
struct Changed {
    gains: bool,
    limits: bool,
    navigation: bool,
    fault_injection: bool,
}

/// Destinations of changed parameters: the control thread, and the file.
#[derive(Debug, Default)]
pub struct ParameterStore {
    changed: Changed,
    keeper: Keeper,
}

impl ParameterStore {
    /// Saves changes from now on; `kept` is the saved set.
    pub fn keep(&mut self, kept: Parameters) {
        self.keeper.begin(kept);
    }

    /// Next text to be saved.
    pub fn pop_save(&mut self) -> Option<Save> {
        self.keeper.pop()
    }

    fn note_change(&mut self, before: &Parameters, after: &Parameters) {
        let changed = &mut self.changed;
        changed.gains |= before.gains != after.gains;
        changed.limits |= before.limits != after.limits;
        changed.navigation |= before.navigation != after.navigation;
        changed.fault_injection |= before.failure.enabled != after.failure.enabled;
    }

    fn has_changes(&self) -> bool {
        let Changed { gains, limits, navigation, fault_injection } = self.changed;
        gains || limits || navigation || fault_injection
    }
}

/// Handles reads and writes.
#[derive(Debug, Default)]
pub struct ParamService {
    /// At most one for each peer.
    lists: Vec<List>,
    next_burst: WallTime,
    faults: FaultParameters,
    /// The last read-only parameter that was to be set, and when.
    refused: Option<(ParameterName, WallTime)>,
}

impl Service for ParamService {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        match message {
            Message::ParamRequestRead(data) => handle_read(from, data, shared),
            // From the beginning if a list was being sent.
            Message::ParamRequestList => {
                self.lists.retain(|list| list.peer != from.peer);
                self.lists.push(List { peer: from.peer, next: 0 });
            }
            Message::ParamSet(set) => self.handle_set(from, set, now, shared),
            Message::Command(command) if command.id == PREFLIGHT_STORAGE => {
                handle_storage(from, command, now, shared);
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
        if let Some(answer) = self.faults.handle_outcome(number, outcome, shared.effectors()) {
            answer_fault(answer, now, shared);
        }
    }

    fn handle_event(&mut self, _: &EventKind, now: WallTime, shared: &mut Shared) {
        self.follow_faults(now, shared);
    }

    /// Sends the next burst of each list.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        pass_on(shared);
        self.follow_faults(now, shared);
        if self.lists.is_empty() || now < self.next_burst {
            return;
        }
        self.next_burst = now + BURST_INTERVAL;
        self.lists.retain_mut(|list| {
            if !shared.peers.knows(list.peer) {
                return false;
            }
            if shared.peers.room(list.peer) < ROOM_MIN {
                return true;
            }
            for _ in 0..BURST {
                let Some(row) = row(list.next, shared) else { return false };
                shared.peers.answer(list.peer, value_message(&row, &shared.model.effectors.list));
                list.next += 1;
            }
            true
        });
    }

    fn next_deadline(&self, shared: &Shared) -> Option<WallTime> {
        let is_busy = !self.lists.is_empty() || shared.store.has_changes();
        let burst = is_busy.then_some(self.next_burst);
        burst.into_iter().chain(self.faults.next_deadline()).min()
    }
}

impl ParamService {
    /// PARAM_SET. A new value goes to every peer; after a refusal the sender gets the old one.
    fn handle_set(&mut self, from: From, set: &ParamSet, now: WallTime, shared: &mut Shared) {
        let Some(old) = find(&set.id, shared) else {
            let error = MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST;
            return shared.peers.answer(from.peer, error_message(from, set.id, -1, error));
        };
        let done = match old.source {
            Source::Fault(target) => self.set_fault(from, target, set, now, shared),
            _ => set_value(&old, set, now, shared),
        };
        if let Err((error, reason)) = done {
            // A slider that is dragged sends many values.
            let is_fixed = error == MavParamError::MAV_PARAM_ERROR_READ_ONLY;
            let is_repeated = self.refused.is_some_and(|(name, since)| {
                name == old.name && now.since(since) < REFUSED_AGAIN_AFTER
            });
            if !is_fixed {
                shared.texts.warn(now, reason);
            } else if !is_repeated {
                shared.texts.inform(now, reason);
            }
            self.refused = is_fixed.then_some((old.name, now));
            shared.peers.answer(from.peer, value_message(&old, &shared.model.effectors.list));
            let index = i16::try_from(old.index).unwrap_or(-1);
            shared.peers.answer(from.peer, error_message(from, set.id, index, error));
        }
        pass_on(shared);
    }

    /// A fault parameter: the answer follows the answer of the plant.
    fn set_fault(
        &mut self,
        from: From,
        target: Target,
        set: &ParamSet,
        now: WallTime,
        shared: &mut Shared,
    ) -> Result<(), (MavParamError, String)> {
        let Some(value) = number(set) else {
            let reason = format!("Fault refused: type {} is not supported", set.kind);
            return Err((MavParamError::MAV_PARAM_ERROR_TYPE_UNSUPPORTED, reason));
        };
        let requested = self
            .faults
            .set(from, target, value, now, shared)
            .map_err(|reason| (MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, reason))?;
        if !requested {
            answer_fault(Answer { from, target, refused: None }, now, shared);
        }
        Ok(())
    }

    /// Publishes the fault parameters that have changed, and answers the stations that wait for one.
    fn follow_faults(&mut self, now: WallTime, shared: &mut Shared) {
        let answers = self.faults.answers(now, shared.aircraft.faults(), shared.effectors());
        let changed = self.faults.changed(shared.aircraft.faults(), shared.effectors());
        for row in changed.iter().filter_map(|target| row_of(*target, shared)).collect::<Vec<_>>() {
            announce(&row, shared);
        }
        for answer in answers {
            // A change has been announced to all.
            if answer.refused.is_some() || !changed.contains(&answer.target) {
                answer_fault(answer, now, shared);
            }
        }
    }
}

/// PARAM_VALUE to every peer.
fn announce(row: &Row, shared: &mut Shared) {
    shared.peers.announce(&value_message(row, &shared.model.effectors.list));
}

/// PARAM_REQUEST_READ, by index or, where that is negative, by name.
fn handle_read(from: From, data: &PARAM_REQUEST_READ_DATA, shared: &mut Shared) {
    let found = match usize::try_from(data.param_index) {
        Ok(index) => row(index, shared),
        Err(_) => find(&data.param_id, shared),
    };
    let message = match found {
        Some(row) => value_message(&row, shared.effectors()),
        None => {
            let error = MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST;
            error_message(from, *data.param_id, data.param_index, error)
        }
    };
    shared.peers.answer(from.peer, message);
}

fn set_value(
    old: &Row,
    set: &ParamSet,
    now: WallTime,
    shared: &mut Shared,
) -> Result<(), (MavParamError, String)> {
    let Some(value) = number(set) else {
        let reason = format!("{} not set: type {} is not supported", old.name, set.kind);
        return Err((MavParamError::MAV_PARAM_ERROR_TYPE_UNSUPPORTED, reason));
    };
    change(old, value, now, shared)
}

/// Sets a parameter as PARAM_SET does: checked, announced to every peer, saved.
pub(super) fn write(
    old: &Row,
    value: f64,
    now: WallTime,
    shared: &mut Shared,
) -> Result<(), String> {
    change(old, value, now, shared).map_err(|(_, reason)| reason)?;
    pass_on(shared);
    Ok(())
}

fn change(
    old: &Row,
    value: f64,
    now: WallTime,
    shared: &mut Shared,
) -> Result<(), (MavParamError, String)> {
    let (old, second_names) = meant(old, shared);
    let name = old.name;
    // Values that are equal on the wire are equal, so a default that a station sends back stays exact.
    let same = convert::float(value).to_bits() == convert::float(old.value).to_bits();
    let is_fixed = same && old.source == Source::Compatibility;
    if !same {
        let before = shared.parameters;
        let set = shared.parameters.set(&name, value);
        let set = set.and_then(|warning| shared.parameters.check_law().map(|()| warning));
        let warning = set.map_err(|error| {
            shared.parameters = before;
            refusal(error)
        })?;
        if let Some(warning) = warning {
            shared.texts.warn(now, format!("{name} set {warning}"));
        }
        shared.store.note_change(&before, &shared.parameters);
        let radius_m = shared.parameters.navigation.loiter_radius_m;
        if before.navigation.loiter_radius_m != radius_m
            && let Some(note) = shared.aircraft.widened(radius_m, None, &shared.parameters)
        {
            shared.texts.warn(now, note);
        }
    }
    let value = if same { old.value } else { value };
    if !is_fixed && let Err(error) = shared.store.keeper.keep(&name, value, &shared.defaults) {
        shared.texts.warn(now, format!("{name} set, but not saved: {error}"));
    }
    for index in core::iter::once(old.index).chain(second_names) {
        if let Some(row) = row(index, shared) {
            announce(&row, shared);
        }
    }
    Ok(())
}

/// PREFLIGHT_STORAGE: p1 1 saves now, 2 and 4 restore the defaults. Acknowledged when the file is on the
/// disk. The autopilot saves changes without it as well.
fn handle_storage(from: From, command: &CommandMessage, now: WallTime, shared: &mut Shared) {
    let [action, ..] = command.params;
    let saves = action == 1.0;
    let mut refuse = |result, reason| {
        shared.texts.warn(now, reason);
        result
    };
    let result = if !saves && action != 2.0 && action != 4.0 {
        let reason =
            "Storage refused: p1 is not 1 (save) or 2 (defaults); the file is read at start";
        refuse(MavResult::MAV_RESULT_UNSUPPORTED, reason)
    } else if shared.store.keeper.is_crowded() {
        let reason = "Not done: too many wait for a save";
        refuse(MavResult::MAV_RESULT_TEMPORARILY_REJECTED, reason)
    } else {
        if !saves {
            reset(now, shared);
        }
        if shared.store.keeper.wait(from, &shared.defaults) {
            return;
        }
        // There is no file, but the parameters have their defaults.
        if saves {
            shared.texts.warn(now, "Not saved: there is no parameter file");
            MavResult::MAV_RESULT_UNSUPPORTED
        } else {
            MavResult::MAV_RESULT_ACCEPTED
        }
    };
    let ack = Encoded::command_ack(PREFLIGHT_STORAGE, result, from.sender);
    shared.peers.answer(from.peer, ack);
}

/// Sets all parameters to their defaults, including those that the command line set.
fn reset(now: WallTime, shared: &mut Shared) {
    let before = shared.parameters;
    shared.parameters = Parameters { brings_law: before.brings_law, ..shared.defaults };
    shared.store.note_change(&before, &shared.parameters);
    shared.store.keeper.reset(&shared.defaults);
    let rows = (0..table().len()).filter_map(|index| row(index, shared));
    let changed: Vec<Row> =
        rows.filter(|new| row_with(new.index, &before, shared).as_ref() != Some(new)).collect();
    for row in &changed {
        announce(row, shared);
    }
    let text = format!("Parameters are at their defaults: {} changed", changed.len());
    shared.texts.inform(now, text);
    pass_on(shared);
}

/// Handles the result of a save, and answers the stations that waited for it.
pub fn handle_saved(saved: &Saved, shared: &mut Shared) {
    let (waiting, transition) = shared.store.keeper.handle(saved);
    match (transition, &saved.result) {
        (Some(Transition::Fails), Err(reason)) => {
            let text = format!("Parameters are not saved: {reason}");
            shared.texts.publish(MavSeverity::MAV_SEVERITY_WARNING, text);
        }
        (Some(Transition::Works), _) => {
            shared.texts.publish(MavSeverity::MAV_SEVERITY_INFO, "Parameters are saved again");
        }
        _ => {}
    }
    let result = match &saved.result {
        Ok(()) => MavResult::MAV_RESULT_ACCEPTED,
        Err(_) => MavResult::MAV_RESULT_FAILED,
    };
    for from in waiting {
        let ack = Encoded::command_ack(PREFLIGHT_STORAGE, result, from.sender);
        shared.peers.answer(from.peer, ack);
    }
}

/// Forwards the latest values to the control thread; the next poll tries again if there is no room.
fn pass_on(shared: &mut Shared) {
    let Shared { store: ParameterStore { changed, .. }, parameters, intents, .. } = shared;
    let mut push = |is_due: &mut bool, command: fn(&Parameters) -> Configuration| {
        *is_due = *is_due && intents.push(command(parameters)).is_none();
    };
    push(&mut changed.gains, |new| Configuration::Gains(Box::new(new.gains)));
    push(&mut changed.limits, |new| Configuration::Limits(new.limits));
    push(&mut changed.navigation, |new| Configuration::Navigation(new.navigation));
    push(&mut changed.fault_injection, |new| Configuration::FaultInjection(new.failure.enabled));
}

/// Sends the unchanged value to the station that requested another one, with the reason.
fn answer_fault(answer: Answer, now: WallTime, shared: &mut Shared) {
    let Answer { from, target, refused } = answer;
    let Some(row) = row_of(target, shared) else { return };
    shared.peers.answer(from.peer, value_message(&row, &shared.model.effectors.list));
    if let Some(reason) = refused {
        shared.texts.warn(now, reason);
        let index = i16::try_from(row.index).unwrap_or(-1);
        let mut id = [0; 16];
        for (place, byte) in id.iter_mut().zip(row.name.bytes()) {
            *place = byte;
        }
        let error = MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE;
        shared.peers.answer(from.peer, error_message(from, id, index, error));
    }
}

fn refusal(error: ParameterError) -> (MavParamError, String) {
    let kind = match error {
        ParameterError::Unknown { .. } => MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST,
        ParameterError::ReadOnly { .. } | ParameterError::OnlyInFlight { .. } => {
            MavParamError::MAV_PARAM_ERROR_READ_ONLY
        }
        ParameterError::OutOfRange { .. }
        | ParameterError::NotWhole { .. }
        | ParameterError::NotAChoice { .. }
        | ParameterError::NoOwnLaw
        | ParameterError::Order { .. }
        | ParameterError::Gains(_) => MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE,
    };
    (kind, format!("Not set: {error}"))
}
