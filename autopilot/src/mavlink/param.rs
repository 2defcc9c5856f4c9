//! The parameter protocol. Integers travel byte-wise, as with PX4.

use core::time::Duration;

use ::mavlink::dialects::common::{
    MavParamError, MavParamType, MavSeverity, PARAM_ERROR_DATA, PARAM_REQUEST_READ_DATA,
    PARAM_VALUE_DATA,
};

use super::codec::{Encoded, ParamSet};
use super::compatibility;
use super::context::{Context, From};
use super::convert;
use super::peers::{Peer, Peers};
use crate::clock::WallTime;
use crate::event::Wish;
use crate::parameters::{Kind, Parameters, table};

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

/// Answers reads and writes.
#[derive(Debug, Default)]
pub struct ParamService {
    /// At most one for each peer.
    lists: Vec<List>,
    next_burst: WallTime,
    /// The control thread does not know the latest gains, limits.
    gains_changed: bool,
    limits_changed: bool,
}

/// One row of either table.
#[derive(Debug, Clone, Copy)]
struct Row {
    name: &'static str,
    kind: Kind,
    value: f64,
    is_compatibility: bool,
}

fn count() -> usize {
    table().len() + compatibility::TABLE.len()
}

fn row(index: usize, parameters: &Parameters) -> Option<Row> {
    let rows = table();
    if let Some(row) = rows.get(index) {
        let value = row.value(parameters);
        return Some(Row { name: row.name, kind: row.kind, value, is_compatibility: false });
    }
    let row = compatibility::TABLE.get(index - rows.len())?;
    Some(Row { name: row.name, kind: row.kind, value: row.value, is_compatibility: true })
}

fn find(id: &[u8; 16]) -> Option<usize> {
    let end = id.iter().position(|byte| *byte == 0).unwrap_or(id.len());
    let name = &id[..end];
    let own = table().iter().map(|row| row.name);
    let all = own.chain(compatibility::TABLE.iter().map(|row| row.name));
    all.into_iter().position(|candidate| candidate.as_bytes() == name)
}

fn value_message(index: usize, row: &Row) -> Encoded {
    let (param_value, param_type) = match row.kind {
        Kind::Int => {
            #[expect(clippy::cast_possible_truncation, reason = "whole and small, by the table")]
            let bits = (row.value as i32).to_le_bytes();
            (f32::from_le_bytes(bits), MavParamType::MAV_PARAM_TYPE_INT32)
        }
        Kind::Real => (convert::float(row.value), MavParamType::MAV_PARAM_TYPE_REAL32),
    };
    Encoded::new(&PARAM_VALUE_DATA {
        param_value,
        param_count: u16::try_from(count()).unwrap_or(u16::MAX),
        param_index: u16::try_from(index).unwrap_or(u16::MAX),
        param_id: row.name.into(),
        param_type,
    })
}

fn error_message(from: From, id: [u8; 16], index: i16, error: MavParamError) -> Encoded {
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

impl ParamService {
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
        let index = match usize::try_from(data.param_index) {
            Ok(index) => Some(index),
            Err(_) => find(&data.param_id),
        };
        let found = index.and_then(|index| Some((index, row(index, ctx.parameters)?)));
        let message = match found {
            Some((index, row)) => value_message(index, &row),
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
        let Some((index, old)) =
            find(&set.id).and_then(|index| Some((index, row(index, ctx.parameters)?)))
        else {
            let error = MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST;
            out.answer(from.peer, error_message(from, set.id, -1, error));
            return;
        };
        match self.set(&old, set, now, ctx) {
            Ok(()) => {
                if let Some(row) = row(index, ctx.parameters) {
                    out.announce(&value_message(index, &row));
                }
            }
            Err((error, reason)) => {
                ctx.texts.refuse(now, reason);
                out.answer(from.peer, value_message(index, &old));
                let index = i16::try_from(index).unwrap_or(-1);
                out.answer(from.peer, error_message(from, set.id, index, error));
            }
        }
        self.pass_on(ctx);
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
        // What the wire cannot tell apart is the same, so an echo of a default leaves it exact.
        if convert::float(value).to_bits() == convert::float(old.value).to_bits() {
            return Ok(());
        }
        if old.is_compatibility {
            let reason = format!("{name} not set: it is read-only");
            return Err((MavParamError::MAV_PARAM_ERROR_READ_ONLY, reason));
        }
        let before = *ctx.parameters;
        match ctx.parameters.set(name, value) {
            Ok(warning) => {
                if let Some(warning) = warning {
                    let text = format!("{name} set {warning}");
                    ctx.texts.reply(MavSeverity::MAV_SEVERITY_WARNING, now, text);
                }
            }
            Err(error) => {
                let reason = format!("Not set: {error}");
                return Err((MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, reason));
            }
        }
        self.gains_changed |= ctx.parameters.gains != before.gains;
        self.limits_changed |= ctx.parameters.limits != before.limits;
        Ok(())
    }

    /// Tells the control thread the latest values; tried again with the next poll if there is no room.
    fn pass_on(&mut self, ctx: &mut Context) {
        if self.gains_changed {
            let wish = Wish::Gains(Box::new(ctx.parameters.gains));
            self.gains_changed = ctx.intents.push(wish).is_none();
        }
        if self.limits_changed {
            let wish = Wish::Limits(ctx.parameters.limits);
            self.limits_changed = ctx.intents.push(wish).is_none();
        }
    }

    /// Sends the next burst of each list.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context, out: &mut Peers) {
        self.pass_on(ctx);
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
                let Some(row) = row(list.next, ctx.parameters) else { return false };
                out.answer(list.peer, value_message(list.next, &row));
                list.next += 1;
            }
            true
        });
    }

    /// When the next burst is due.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        let has_work = !self.lists.is_empty() || self.gains_changed || self.limits_changed;
        has_work.then_some(self.next_burst)
    }
}
