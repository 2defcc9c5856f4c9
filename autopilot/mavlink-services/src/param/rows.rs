//! The parameter tables as one list, and its messages.

use ::mavlink::dialects::common::{
    MavParamError, MavParamType, PARAM_ERROR_DATA, PARAM_VALUE_DATA,
};

use crate::Shared;
use crate::codec::{Encoded, ParamSet};
use crate::convert;
use crate::peers::From;
use flight_management::parameters::{
    COMPATIBILITY, CompatibilityParameter, FaultParameter, Kind, ParameterName, Parameters,
    compatibility, fault_of, fault_parameters, table,
};
use icd::EffectorList;
use icd::fault::Target;

use super::faults;

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
pub(super) fn count(effectors: &EffectorList) -> usize {
    table().len() + COMPATIBILITY.len() + Target::all(effectors).count()
}

/// A name of a table; none of the tables has a longer one.
fn name_of(name: &str) -> ParameterName {
    ParameterName::from(name).unwrap_or_default()
}

/// The row at `index`: first the tunables, then those for ground stations, then the fault parameters.
pub(super) fn row(index: usize, shared: &Shared) -> Option<Row> {
    row_with(index, &shared.parameters, shared)
}

/// The same row with the values of other parameters.
pub(super) fn row_with(index: usize, parameters: &Parameters, shared: &Shared) -> Option<Row> {
    let rows = table();
    if let Some(row) = rows.get(index) {
        let (name, kind, value) = (name_of(row.name), row.kind, row.value(parameters));
        return Some(Row { index, name, kind, value, source: Source::Own });
    }
    let place = index.checked_sub(rows.len())?;
    if let Some(row) = COMPATIBILITY.get(place) {
        let source = Source::Compatibility;
        let name = name_of(row.name);
        let value = row.value_in(parameters);
        return Some(Row { index, name, kind: row.kind, value, source });
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
pub(super) fn find(id: &[u8; 16], shared: &Shared) -> Option<Row> {
    let name = id.split(|byte| *byte == 0).next().unwrap_or(id);
    let own = table().iter().map(|row| name_of(row.name));
    let others = COMPATIBILITY.iter().map(|row| name_of(row.name));
    let faults = fault_parameters(shared.effectors()).map(|row| row.name);
    let mut all = own.chain(others).chain(faults);
    row(all.position(|candidate| candidate.as_bytes() == name)?, shared)
}

/// The row that a second name means, and the rows that are a second name of it.
pub(super) fn meant(named: &Row, shared: &Shared) -> (Row, Vec<usize>) {
    let own = compatibility(&named.name).and_then(CompatibilityParameter::meant);
    let place = own.and_then(|own| table().iter().position(|row| row.name == own.name));
    let meant = place.and_then(|index| row(index, shared)).unwrap_or(*named);
    let names = COMPATIBILITY.iter().enumerate();
    let names = names.filter(|(_, other)| !other.stands_for.is_empty());
    let names = names.filter(|(_, other)| *other.stands_for == *meant.name);
    (meant, names.map(|(place, _)| table().len() + place).collect())
}

/// The fault parameter of a target.
pub(super) fn row_of(target: Target, shared: &Shared) -> Option<Row> {
    let effectors = shared.effectors();
    let place = Target::all(effectors).position(|other| other == target)?;
    row(table().len() + COMPATIBILITY.len() + place, shared)
}

pub(super) fn value_message(row: &Row, effectors: &EffectorList) -> Encoded {
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
        param_count: u16::try_from(count(effectors)).unwrap_or(u16::MAX),
        param_index: u16::try_from(row.index).unwrap_or(u16::MAX),
        param_id: row.name.as_str().into(),
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
