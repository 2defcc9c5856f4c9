//! Component metadata: files that describe parameters, effectors and events to a ground station. Stations
//! fetch them by MAVLink FTP; COMPONENT_METADATA names the first one.
//!
//! Formats: mavlink/component_metadata/*.schema.json and libevents. One departure: the version in
//! `parameter.json` is 1, since QGroundControl accepts no other, although the latest schema counts from 3.

use std::sync::Arc;

use ::mavlink::dialects::common::{COMPONENT_METADATA_DATA, CompMetadataType};
use icd::{Effector, EffectorKind, EffectorList};
use serde_json::{Map, Value, json};

use crate::codec::Encoded;
use flight_management::parameters::{
    COMPATIBILITY, COMPATIBILITY_GROUP, Choice, CompatibilityParameter, FAULT_CHOICES,
    FaultParameter, Kind, Parameter, Parameters, fault_parameters, table,
};

/// The file that a ground station reads first.
const GENERAL: &str = "general.json";
/// Kind and file of each description.
const DESCRIPTIONS: [(CompMetadataType, &str); 3] = [
    (CompMetadataType::COMP_METADATA_TYPE_PARAMETER, "parameter.json"),
    (CompMetadataType::COMP_METADATA_TYPE_EVENTS, "events.json"),
    (CompMetadataType::COMP_METADATA_TYPE_ACTUATORS, "actuators.json"),
];

/// The files for one aircraft; they stay the same for the life of the process.
#[derive(Debug)]
pub struct Metadata {
    files: Vec<(&'static str, Arc<str>)>,
    /// CRC-32 of the file that a ground station reads first.
    general_crc: u32,
}

impl Metadata {
    /// For an aircraft with these effectors and these defaults of its parameters.
    pub fn new(effectors: &EffectorList, defaults: &Parameters) -> Self {
        let parameters = parameter_file(effectors, defaults);
        let contents = [parameters, events(), actuator_file(effectors)];
        let texts = contents.map(|content| Arc::from(content.to_string()));
        let names = DESCRIPTIONS.map(|(_, name)| name);
        let descriptions: Vec<_> = names.into_iter().zip(texts).collect();
        let general: Arc<str> = general(&descriptions).to_string().into();
        let general_crc = crc32(general.as_bytes());
        let files = core::iter::once((GENERAL, general)).chain(descriptions).collect();
        Self { files, general_crc }
    }

    pub fn files(&self) -> &[(&'static str, Arc<str>)] {
        &self.files
    }

    /// COMPONENT_METADATA at this time since the start, ms.
    pub fn message(&self, time_boot_ms: u32) -> Encoded {
        let uri = uri(GENERAL).as_str().into();
        Encoded::new(&COMPONENT_METADATA_DATA { time_boot_ms, file_crc: self.general_crc, uri })
    }
}

fn general(descriptions: &[(&'static str, Arc<str>)]) -> Value {
    let types: Vec<Value> = DESCRIPTIONS
        .iter()
        .zip(descriptions)
        .map(|((kind, name), (_, text))| {
            json!({ "type": *kind as u8, "uri": uri(name), "fileCrc": crc32(text.as_bytes()) })
        })
        .collect();
    json!({
        "version": 1,
        "vendorName": "Two-Step",
        "modelName": "Jet with thrust vectoring",
        "firmwareVersion": env!("CARGO_PKG_VERSION"),
        "metadataTypes": types,
    })
}

/// The autopilot reports events by STATUSTEXT and by dedicated messages. It sends no EVENT, so there is
/// none to describe, and the list is empty.
fn events() -> Value {
    json!({
        "version": 1,
        "components": [{ "component_id": 1, "namespace": "two_step", "enums": [], "event_groups": [] }],
    })
}

fn uri(name: &str) -> String {
    format!("mftp:///{name}")
}

/// The checksum of MAVLink FTP and of component metadata: CRC-32 with its register zero at the start and not
/// inverted at the end.
pub fn crc32(content: &[u8]) -> u32 {
    // The library inverts both.
    let mut hasher = crc32fast::Hasher::new_with_initial(u32::MAX);
    hasher.update(content);
    !hasher.finalize()
}

/// Significant figures to show of a value, its default and its smallest value included.
const FIGURES: i32 = 4;
/// Most decimal places to show.
const PLACES_MAX: i32 = 12;

fn parameter_file(effectors: &EffectorList, defaults: &Parameters) -> Value {
    let own = table().iter().map(|row| tunable(row, row.value(defaults)));
    let others = COMPATIBILITY.iter().map(|row| compatibility(row, defaults));
    let others = others.chain(fault_parameters(effectors).map(|row| fault(&row, effectors)));
    let all: Vec<Value> = own.chain(others).collect();
    json!({ "version": 1, "parameters": all })
}

fn tunable(row: &Parameter, default: f64) -> Value {
    let mut entry = json!({
        "name": row.name,
        "type": type_name(row.kind),
        "group": row.group,
        "category": "Standard",
        "shortDesc": row.meaning,
        "longDesc": long_text(row),
        "min": row.min,
        "max": row.max,
        "default": default,
        "decimalPlaces": decimal_places(row, default),
        "rebootRequired": row.at_restart,
    });
    if row.unit != "-" {
        entry["units"] = row.unit.into();
    }
    if !row.choices.is_empty() {
        entry["values"] = choices(row.choices);
    }
    entry
}

fn choices(choices: &[Choice]) -> Value {
    let value = |choice: &Choice| json!({"value": choice.value, "description": choice.label});
    choices.iter().map(value).collect()
}

fn long_text(row: &Parameter) -> String {
    let Parameter { meaning, min, max, unit, .. } = row;
    let range = if row.choices.is_empty() {
        let unit = if *unit == "-" { "" } else { unit };
        format!("From {min} to {max} {unit}").trim_end().to_owned()
    } else {
        let labels = row.choices.iter().map(|choice| format!("{} {}", choice.value, choice.label));
        labels.collect::<Vec<_>>().join("; ")
    };
    let when = if row.at_restart { "when the vehicle starts again" } else { "at once" };
    format!("{meaning}. {range}. A change acts {when}.")
}

fn compatibility(row: &CompatibilityParameter, defaults: &Parameters) -> Value {
    if let Some(meant) = row.meant() {
        let mut entry = tunable(meant, meant.value(defaults));
        entry["name"] = row.name.into();
        entry["group"] = COMPATIBILITY_GROUP.into();
        entry["shortDesc"] = format!("{}: {}", meant.name, meant.meaning).into();
        return entry;
    }
    let mut entry = json!({
        "name": row.name,
        "type": type_name(row.kind),
        "group": COMPATIBILITY_GROUP,
        "category": "System",
        "shortDesc": row.title,
        "longDesc": format!(
            "Read-only: a parameter of PX4 that ground stations look for. Its value is there for the station and has no \
             effect. {}.",
            row.reason
        ),
        "default": row.value,
        "decimalPlaces": if row.kind == Kind::Int { 0 } else { 2 },
        "readOnly": true,
    });
    if !row.label.is_empty() {
        entry["values"] = json!([{ "value": row.value, "description": row.label }]);
    }
    entry
}

fn fault(row: &FaultParameter, effectors: &EffectorList) -> Value {
    let what = row.target.name(effectors);
    json!({
        "name": row.name.as_str(),
        "type": type_name(Kind::Int),
        "group": "Break something",
        "category": "Standard",
        "shortDesc": format!("What acts on the {what}"),
        "longDesc": format!(
            "Setting it breaks the {what} as the command INJECT_FAILURE does, with the sizes and times of FLT_*; 0 mends \
             it. The value is what acts, else what acts next, whoever ordered it. Each flight begins with 0."
        ),
        "min": 0,
        "max": FAULT_CHOICES.len() - 1,
        "default": 0,
        "decimalPlaces": 0,
        "rebootRequired": false,
        "values": choices(&FAULT_CHOICES),
    })
}

fn type_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Int => "Int32",
        Kind::Real => "Float",
    }
}

/// Decimal places with which the smallest value of interest shows its significant figures.
fn decimal_places(row: &Parameter, default: f64) -> i32 {
    if row.kind == Kind::Int {
        return 0;
    }
    let sizes = [default, row.min].map(f64::abs);
    let smallest = sizes.into_iter().filter(|size| *size > 0.0).fold(row.max.abs(), f64::min);
    let exponent = libm::floor(libm::log10(smallest)) as i32;
    (FIGURES - 1 - exponent).clamp(1, PLACES_MAX)
}

/// A group of effectors: label, type, kinds.
type Group = (&'static str, &'static str, fn(EffectorKind) -> bool);

const GROUPS: [Group; 3] = [
    ("Aerodynamic surfaces", "servo", EffectorKind::is_surface),
    ("Nozzle", "servo", EffectorKind::is_nozzle),
    ("Engine", "motor", |kind| matches!(kind, EffectorKind::Engine)),
];

/// The file for an aircraft with these effectors.
fn actuator_file(effectors: &EffectorList) -> Value {
    let places = || (1_usize..).zip(effectors.all());
    let channels: Vec<Value> = places()
        .map(|(place, effector)| json!({ "label": title(effectors, effector), "param-index": place }))
        .collect();
    let functions: Map<String, Value> = places()
        .map(|(place, effector)| {
            let label = title(effectors, effector);
            let function = json!({ "label": label, "exclude-from-actuator-testing": true });
            (place.to_string(), function)
        })
        .collect();
    let mut types = json!({ "DEFAULT": { "values": { "min": -1, "max": 1, "default": 0 } } });
    for (name, is_angle, min) in [("servo", true, -1), ("motor", false, 0)] {
        let of_unit: Vec<usize> = places()
            .filter(|(_, effector)| effectors.is_angle(*effector) == is_angle)
            .map(|(place, _)| place)
            .collect();
        if let (Some(first), Some(last)) = (of_unit.first(), of_unit.last()) {
            types[name] = json!({
                "values": { "min": min, "max": 1, "default": 0 },
                "function-min": first,
                "function-max": last,
            });
        }
    }
    let is_jet = effectors.only(EffectorKind::NozzlePitch).is_some();
    let aircraft = if is_jet { "Jet with thrust vectoring" } else { "Aircraft with surfaces" };
    let groups: Vec<Value> =
        GROUPS.iter().filter_map(|group| self::group(effectors, group)).collect();
    json!({
        "version": 2,
        "show-ui-if": "false",
        "outputs_v1": [{
            "label": "Effectors",
            "subgroups": [{ "per-channel-parameters": [], "channels": channels }],
        }],
        "functions_v1": functions,
        "mixer_v1": {
            "actuator-types": types,
            "config": [{
                "title": aircraft,
                "actuators": groups,
            }],
        },
    })
}

fn group(effectors: &EffectorList, (label, kind, is_in): &Group) -> Option<Value> {
    let members: Vec<String> = effectors
        .all()
        .filter(|effector| effectors.kind(*effector).is_some_and(is_in))
        .map(|effector| title(effectors, effector))
        .collect();
    (!members.is_empty()).then(|| {
        json!({
            "group-label": label,
            "actuator-type": kind,
            "count": members.len(),
            "item-label-prefix": members,
            "per-item-parameters": [],
        })
    })
}

/// The name with a capital letter.
fn title(effectors: &EffectorList, effector: Effector) -> String {
    let mut letters = effectors.name(effector).chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

#[cfg(test)]
mod tests;
