//! The parameter protocol. Integers travel byte-wise, as with PX4.

use core::fmt::Display;
use core::time::Duration;

use ::mavlink::dialects::common::{
    MavParamError, MavParamType, MavResult, MavSeverity, PARAM_ERROR_DATA, PARAM_REQUEST_READ_DATA,
    PARAM_VALUE_DATA,
};
use ::mavlink::types::CharArray;
use icd::EffectorList;
use icd::fault::Target;

use crate::codec::{CommandMessage, Encoded, Message, ParamSet};
use crate::param::faults::{Answer, FaultParameters};
use crate::peers::{From, Peer};
use crate::wall_time::WallTime;
use crate::{Service, Shared, convert};
use flight_management::command::{Configuration, Outcome};
use flight_management::event::EventKind;
use flight_management::parameters::{
    COMPATIBILITY, CompatibilityParameter, FaultParameter, Kind, ParameterError, ParameterName,
    Parameters, compatibility, fault_of, fault_parameters, table, to_text,
};

mod faults;

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

/// Requests that may wait for their save.
const WAITING_MAX: usize = 16;

/// A content to be saved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Save {
    /// Number that [`Saved`] repeats; later contents have larger ones.
    pub number: u64,
    pub text: String,
    /// A client waits for it.
    pub at_once: bool,
}

/// Result of a save.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Saved {
    /// The latest save that it covers.
    pub number: u64,
    /// Reason of a failure, as a text for the operator.
    pub result: Result<(), String>,
}

/// The next content of one file; a later one replaces it. `autopilot::io::store` writes it.
#[derive(Debug, Default)]
pub struct SaveQueue {
    last_number: u64,
    next: Option<Save>,
}

impl SaveQueue {
    pub fn push(&mut self, text: String, at_once: bool) {
        self.last_number += 1;
        // Whoever waits for the replaced content waits for this one.
        let at_once = at_once || self.next.as_ref().is_some_and(|next| next.at_once);
        self.next = Some(Save { number: self.last_number, text, at_once });
    }

    pub fn pop(&mut self) -> Option<Save> {
        self.next.take()
    }
}

/// Destinations of changed parameters: the control thread, and the file.
#[derive(Debug)]
pub struct ParameterStore {
    /// Those that the control thread has.
    passed_on: Parameters,
    /// The saved set; `None` where nothing is saved. Values from the command line are not saved, so this set can be
    /// inconsistent although the active set is valid.
    pub kept: Option<Parameters>,
    pub saves: SaveQueue,
    /// Clients that wait for a save.
    waiting: Vec<(From, u64)>,
    has_failed: bool,
}

impl ParameterStore {
    /// Saves nothing; the control thread starts with these parameters.
    pub fn new(passed_on: Parameters) -> Self {
        let saves = SaveQueue::default();
        Self { passed_on, kept: None, saves, waiting: Vec::new(), has_failed: false }
    }

    /// Records a value that was set.
    fn keep(
        &mut self,
        name: &str,
        value: f64,
        defaults: &Parameters,
    ) -> Result<(), ParameterError> {
        let Some(kept) = self.kept.as_mut() else { return Ok(()) };
        let before = *kept;
        kept.set(name, value)?;
        // A value that is set again costs no write.
        if *kept != before {
            self.saves.push(to_text(kept, defaults), false);
        }
        Ok(())
    }

    /// Adds a client that waits until everything is saved. False where nothing is saved.
    fn wait(&mut self, from: From, defaults: &Parameters) -> bool {
        let Some(kept) = &self.kept else { return false };
        self.saves.push(to_text(kept, defaults), true);
        self.waiting.push((from, self.saves.last_number));
        true
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
        // Tries again what found no room among the intents.
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
        let Parameters { gains, limits, navigation, failure, .. } = &shared.parameters;
        let old = &shared.store.passed_on;
        let has_changes = (gains, limits, navigation, failure.enabled)
            != (&old.gains, &old.limits, &old.navigation, old.failure.enabled);
        let is_busy = !self.lists.is_empty() || has_changes;
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
        let unsupported = |what: &dyn Display| {
            let reason = format!("{what}: type {} is not supported", set.kind);
            Err((MavParamError::MAV_PARAM_ERROR_TYPE_UNSUPPORTED, reason))
        };
        let done = match (old.source, number(set)) {
            (Source::Fault(target), Some(value)) => {
                self.set_fault(from, target, value, now, shared)
            }
            (_, Some(value)) => change(&old, value, now, shared),
            (Source::Fault(_), None) => unsupported(&"Fault refused"),
            (_, None) => unsupported(&format_args!("{} not set", old.name)),
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
        value: f64,
        now: WallTime,
        shared: &mut Shared,
    ) -> Result<(), (MavParamError, String)> {
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
        // First, because a target whose command is answered may publish its value.
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
            // A set that was valid but names a law that is not here.
            shared.parameters = before;
            refusal(error)
        })?;
        if let Some(warning) = warning {
            shared.texts.warn(now, format!("{name} set {warning}"));
        }
        let radius_m = shared.parameters.navigation.loiter_radius_m;
        if before.navigation.loiter_radius_m != radius_m
            && let Some(note) = shared.aircraft.widened(radius_m, None, &shared.parameters)
        {
            shared.texts.warn(now, note);
        }
    }
    // The exact value: what came over the wire has seven digits.
    let value = if same { old.value } else { value };
    if !is_fixed && let Err(error) = shared.store.keep(&name, value, &shared.defaults) {
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
    } else if shared.store.waiting.len() >= WAITING_MAX {
        let reason = "Not done: too many wait for a save";
        refuse(MavResult::MAV_RESULT_TEMPORARILY_REJECTED, reason)
    } else {
        if !saves {
            reset(now, shared);
        }
        if shared.store.wait(from, &shared.defaults) {
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
    // Whether there is a law belongs to the program, not to the parameters.
    shared.parameters = Parameters { brings_law: before.brings_law, ..shared.defaults };
    if let Some(kept) = &mut shared.store.kept {
        *kept = shared.defaults;
        // At once, so that the defaults hold after a crash, too.
        shared.store.saves.push(to_text(kept, &shared.defaults), true);
    }
    let rows = table().iter().enumerate();
    let changed = rows.filter(|(_, row)| row.value(&shared.parameters) != row.value(&before));
    let changed: Vec<Row> = changed.filter_map(|(index, _)| row(index, shared)).collect();
    for row in &changed {
        announce(row, shared);
    }
    let text = format!("Parameters are at their defaults: {} changed", changed.len());
    shared.texts.inform(now, text);
    pass_on(shared);
}

/// Handles the result of a save, and answers the stations that waited for it.
pub fn handle_saved(saved: &Saved, shared: &mut Shared) {
    let ParameterStore { waiting, has_failed, .. } = &mut shared.store;
    let had_failed = core::mem::replace(has_failed, saved.result.is_err());
    let result = match &saved.result {
        Ok(()) => MavResult::MAV_RESULT_ACCEPTED,
        Err(_) => MavResult::MAV_RESULT_FAILED,
    };
    match &saved.result {
        // One text for each series of failures: every change of a parameter would repeat it.
        Err(reason) if !had_failed => {
            let text = format!("Parameters are not saved: {reason}");
            shared.texts.publish(MavSeverity::MAV_SEVERITY_WARNING, text);
        }
        Ok(()) if had_failed => {
            shared.texts.publish(MavSeverity::MAV_SEVERITY_INFO, "Parameters are saved again");
        }
        _ => {}
    }
    for (from, _) in waiting.extract_if(.., |(_, number)| *number <= saved.number) {
        let ack = Encoded::command_ack(PREFLIGHT_STORAGE, result, from.sender);
        shared.peers.answer(from.peer, ack);
    }
}

/// Forwards the latest values to the control thread; the next poll tries again if there is no room.
fn pass_on(shared: &mut Shared) {
    let Shared { store: ParameterStore { passed_on: old, .. }, parameters: new, intents, .. } =
        shared;
    if old.gains != new.gains && intents.push(Configuration::Gains(Box::new(new.gains))).is_some() {
        old.gains = new.gains;
    }
    if old.limits != new.limits && intents.push(Configuration::Limits(new.limits)).is_some() {
        old.limits = new.limits;
    }
    if old.navigation != new.navigation
        && intents.push(Configuration::Navigation(new.navigation)).is_some()
    {
        old.navigation = new.navigation;
    }
    if old.failure.enabled != new.failure.enabled
        && intents.push(Configuration::FaultInjection(new.failure.enabled)).is_some()
    {
        old.failure.enabled = new.failure.enabled;
    }
}

/// Sends the unchanged value to the station that requested another one, with the reason.
fn answer_fault(answer: Answer, now: WallTime, shared: &mut Shared) {
    let Answer { from, target, refused } = answer;
    let Some(row) = row_of(target, shared) else { return };
    shared.peers.answer(from.peer, value_message(&row, &shared.model.effectors.list));
    if let Some(reason) = refused {
        shared.texts.warn(now, reason);
        let index = i16::try_from(row.index).unwrap_or(-1);
        let error = MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE;
        shared.peers.answer(from.peer, error_message(from, row.name.as_str(), index, error));
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
        | ParameterError::NoOwnLaw(_)
        | ParameterError::Order { .. }
        | ParameterError::Gains(_) => MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE,
    };
    (kind, format!("Not set: {error}"))
}

/// One row of the list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Row {
    /// Index in the list.
    pub index: usize,
    pub name: ParameterName,
    pub kind: Kind,
    pub value: f64,
    pub source: Source,
}

/// Table that a row comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    /// A tunable of the autopilot.
    Own,
    /// Present for ground stations only, without effect.
    Compatibility,
    /// A fault of this effector or sensor.
    Fault(Target),
}

/// Rows of all tables.
fn count(effectors: &EffectorList) -> usize {
    table().len() + COMPATIBILITY.len() + Target::all(effectors).count()
}

/// A name of a table; none of the tables has a longer one.
fn name_of(name: &str) -> ParameterName {
    ParameterName::from(name).unwrap_or_default()
}

/// The row at `index`: first the tunables, then those for ground stations, then the fault parameters.
fn row(index: usize, shared: &Shared) -> Option<Row> {
    let (rows, parameters) = (table(), &shared.parameters);
    if let Some(row) = rows.get(index) {
        let (name, kind, value) = (name_of(row.name), row.kind, row.value(parameters));
        return Some(Row { index, name, kind, value, source: Source::Own });
    }
    let place = index.checked_sub(rows.len())?;
    if let Some(row) = COMPATIBILITY.get(place) {
        let (name, kind, value) = (name_of(row.name), row.kind, row.value_in(parameters));
        return Some(Row { index, name, kind, value, source: Source::Compatibility });
    }
    let effectors = shared.effectors();
    let target = Target::all(effectors).nth(place.checked_sub(COMPATIBILITY.len())?)?;
    let FaultParameter { name, target } = fault_of(target, effectors);
    let value = faults::value(target, shared.aircraft.faults()).into();
    Some(Row { index, name, kind: Kind::Int, value, source: Source::Fault(target) })
}

pub(crate) fn rows(shared: &Shared) -> impl Iterator<Item = Row> {
    (0..count(shared.effectors())).filter_map(|index| row(index, shared))
}

/// The row with this name, which has 16 characters or ends with NUL.
fn find(id: &[u8; 16], shared: &Shared) -> Option<Row> {
    let name = id.split(|byte| *byte == 0).next().unwrap_or(id);
    let own = table().iter().map(|row| name_of(row.name));
    let others = COMPATIBILITY.iter().map(|row| name_of(row.name));
    let faults = fault_parameters(shared.effectors()).map(|row| row.name);
    let mut all = own.chain(others).chain(faults);
    row(all.position(|candidate| candidate.as_bytes() == name)?, shared)
}

/// The row that a second name means, and the rows that are a second name of it.
fn meant(named: &Row, shared: &Shared) -> (Row, Vec<usize>) {
    let own = compatibility(&named.name).and_then(CompatibilityParameter::meant);
    let place = own.and_then(|own| table().iter().position(|row| row.name == own.name));
    let meant = place.and_then(|index| row(index, shared)).unwrap_or(*named);
    let names = COMPATIBILITY.iter().enumerate();
    let names = names.filter(|(_, other)| !other.stands_for.is_empty());
    let names = names.filter(|(_, other)| *other.stands_for == *meant.name);
    (meant, names.map(|(place, _)| table().len() + place).collect())
}

/// The fault parameter of a target.
fn row_of(target: Target, shared: &Shared) -> Option<Row> {
    let effectors = shared.effectors();
    let place = Target::all(effectors).position(|other| other == target)?;
    row(table().len() + COMPATIBILITY.len() + place, shared)
}

fn value_message(row: &Row, effectors: &EffectorList) -> Encoded {
    let (param_value, param_type) = match row.kind {
        Kind::Int => {
            // Whole and small, by the table.
            let bits = (row.value as i32).to_le_bytes();
            (f32::from_le_bytes(bits), MavParamType::MAV_PARAM_TYPE_INT32)
        }
        Kind::Real => (convert::float(row.value), MavParamType::MAV_PARAM_TYPE_REAL32),
    };
    Encoded::new(&PARAM_VALUE_DATA {
        param_value,
        param_count: u16::try_from(count(effectors)).unwrap_or(u16::MAX),
        param_index: u16::try_from(row.index).unwrap_or(u16::MAX),
        param_id: row.name.as_str().into(),
        param_type,
    })
}

/// PARAM_ERROR; `index` -1 means that the name counts.
fn error_message(
    from: From,
    id: impl Into<CharArray<16>>,
    index: i16,
    error: MavParamError,
) -> Encoded {
    Encoded::new(&PARAM_ERROR_DATA {
        param_index: index,
        target_system: from.sender.system,
        target_component: from.sender.component,
        param_id: id.into(),
        error,
    })
}

/// The number that a PARAM_SET carries; `None` for a type that does not fit four bytes.
fn number(set: &ParamSet) -> Option<f64> {
    let [a, b, ..] = set.value;
    Some(match set.kind {
        1 => f64::from(a),
        2 => f64::from(i8::from_le_bytes([a])),
        3 => f64::from(u16::from_le_bytes([a, b])),
        4 => f64::from(i16::from_le_bytes([a, b])),
        5 => f64::from(u32::from_le_bytes(set.value)),
        6 => f64::from(i32::from_le_bytes(set.value)),
        9 => convert::decimal(f32::from_le_bytes(set.value)),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use flight_management::parameters::is_fault;
    use icd::tvc_jet;

    #[test]
    fn each_parameter_of_a_fault_has_the_name_of_its_effector_and_hides_no_other_parameter() {
        let list = tvc_jet::effectors();
        for row in fault_parameters(&list) {
            let (unit, instance) = (row.target.unit(&list).1, row.target.instance(&list));
            assert_eq!(&row.name, format!("FLT_{}{instance}", unit.to_uppercase()).as_str());
            assert!(table().iter().all(|other| *other.name != *row.name), "{}", row.name);
            assert!(compatibility(&row.name).is_none() && is_fault(&row.name), "{}", row.name);
        }
        assert!(!is_fault("FLT_SERVO0") && !is_fault("FLT_SERVO17") && !is_fault("FLT_STUCK_DEG"));
    }
}
