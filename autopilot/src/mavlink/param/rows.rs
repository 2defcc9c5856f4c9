//! Both parameter tables as one list, and its messages.

use ::mavlink::dialects::common::{
    MavParamError, MavParamType, PARAM_ERROR_DATA, PARAM_VALUE_DATA,
};

use crate::mavlink::codec::{Encoded, ParamSet};
use crate::mavlink::context::From;
use crate::mavlink::convert;
use crate::parameters::{COMPATIBILITY, Kind, Parameters, table};

/// One row of either table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::mavlink) struct Row {
    /// Place in the list.
    pub index: usize,
    pub name: &'static str,
    pub kind: Kind,
    pub value: f64,
    pub is_compatibility: bool,
}

/// Rows of both tables.
pub(super) fn count() -> usize {
    table().len() + COMPATIBILITY.len()
}

/// The row at `index`: first the parameters that mean something, then the others.
pub(super) fn row(index: usize, parameters: &Parameters) -> Option<Row> {
    let rows = table();
    if let Some(row) = rows.get(index) {
        let (name, kind, value) = (row.name, row.kind, row.value(parameters));
        return Some(Row { index, name, kind, value, is_compatibility: false });
    }
    let row = COMPATIBILITY.get(index.checked_sub(rows.len())?)?;
    Some(Row { index, name: row.name, kind: row.kind, value: row.value, is_compatibility: true })
}

/// All rows.
pub(in crate::mavlink) fn rows(parameters: &Parameters) -> impl Iterator<Item = Row> {
    (0..count()).filter_map(|index| row(index, parameters))
}

/// The row with this name, which has 16 characters or ends with NUL.
pub(super) fn find(id: &[u8; 16], parameters: &Parameters) -> Option<Row> {
    let name = id.split(|byte| *byte == 0).next().unwrap_or(id);
    let own = table().iter().map(|row| row.name);
    let mut all = own.chain(COMPATIBILITY.iter().map(|row| row.name));
    row(all.position(|candidate| candidate.as_bytes() == name)?, parameters)
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
