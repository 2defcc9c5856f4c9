//! The parameter tables as one list, and its messages.

use ::mavlink::dialects::common::{
    MavParamError, MavParamType, PARAM_ERROR_DATA, PARAM_VALUE_DATA,
};

use crate::mavlink::codec::{Encoded, ParamSet};
use crate::mavlink::context::{Context, From};
use crate::mavlink::convert;
use crate::mavlink::fault_list::FaultList;
use crate::parameters::{COMPATIBILITY, FAULTS, Kind, Parameters, table};
use icd::Effector;

use super::faults;

/// One row of the list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::mavlink) struct Row {
    /// Place in the list.
    pub index: usize,
    pub name: &'static str,
    pub kind: Kind,
    pub value: f64,
    pub source: Source,
}

/// Which table a row comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::mavlink) enum Source {
    /// It means something.
    Own,
    /// It is there for ground stations.
    Compatibility,
    /// It breaks this effector.
    Fault(Effector),
}

/// Rows of all tables.
pub(super) fn count() -> usize {
    table().len() + COMPATIBILITY.len() + FAULTS.len()
}

/// The row at `index`: first the tunables, then those for ground stations, then those that break something.
pub(super) fn row(index: usize, parameters: &Parameters, faults: &FaultList) -> Option<Row> {
    let rows = table();
    if let Some(row) = rows.get(index) {
        let (name, kind, value) = (row.name, row.kind, row.value(parameters));
        return Some(Row { index, name, kind, value, source: Source::Own });
    }
    let place = index.checked_sub(rows.len())?;
    if let Some(row) = COMPATIBILITY.get(place) {
        let source = Source::Compatibility;
        return Some(Row { index, name: row.name, kind: row.kind, value: row.value, source });
    }
    let row = FAULTS.get(place.checked_sub(COMPATIBILITY.len())?)?;
    let value = faults::value(row.effector, faults).into();
    Some(Row { index, name: row.name, kind: Kind::Int, value, source: Source::Fault(row.effector) })
}

/// All rows.
pub(in crate::mavlink) fn rows(ctx: &Context) -> impl Iterator<Item = Row> {
    (0..count()).filter_map(|index| row(index, ctx.parameters, ctx.aircraft.faults()))
}

/// The row with this name, which has 16 characters or ends with NUL.
pub(super) fn find(id: &[u8; 16], parameters: &Parameters, faults: &FaultList) -> Option<Row> {
    let name = id.split(|byte| *byte == 0).next().unwrap_or(id);
    let own = table().iter().map(|row| row.name);
    let others = COMPATIBILITY.iter().map(|row| row.name);
    let mut all = own.chain(others).chain(FAULTS.iter().map(|row| row.name));
    row(all.position(|candidate| candidate.as_bytes() == name)?, parameters, faults)
}

/// The row that breaks an effector.
pub(super) fn row_of(effector: Effector, ctx: &Context) -> Option<Row> {
    let place = FAULTS.iter().position(|row| row.effector == effector)?;
    row(count() - FAULTS.len() + place, ctx.parameters, ctx.aircraft.faults())
}

/// PARAM_VALUE.
pub(super) fn value_message(row: &Row) -> Encoded {
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
        param_index: u16::try_from(row.index).unwrap_or(u16::MAX),
        param_id: row.name.into(),
        param_type,
    })
}

/// PARAM_ERROR; `index` -1 means that the name counts.
pub(super) fn error_message(from: From, id: [u8; 16], index: i16, error: MavParamError) -> Encoded {
    Encoded::new(&PARAM_ERROR_DATA {
        param_index: index,
        target_system: from.sender.system,
        target_component: from.sender.component,
        param_id: id.into(),
        error,
    })
}

/// The number that a PARAM_SET carries; `None` for a type that does not fit four bytes.
pub(super) fn number(set: &ParamSet) -> Option<f64> {
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
