//! The parameters: what QGroundControl shows beside each value.

use icd::EffectorList;
use serde_json::{Map, Value, json};

use flight_management::parameters::{
    COMPATIBILITY, COMPATIBILITY_GROUP, CompatibilityParameter, FAULT_CHOICES, FaultParameter,
    Kind, Parameter, Parameters, fault_parameters, table,
};

/// Figures that a value should show, its default and its smallest value included.
const FIGURES: i32 = 4;
/// Most places behind the point that are shown.
const PLACES_MAX: i32 = 12;

/// The file.
pub(super) fn description(effectors: &EffectorList, defaults: &Parameters) -> Value {
    let own = table().iter().map(|row| tunable(row, row.value(defaults)));
    let others = COMPATIBILITY.iter().map(compatibility);
    let others = others.chain(fault_parameters(effectors).map(|row| fault(&row, effectors)));
    let all: Vec<Value> = own.chain(others).collect();
    json!({ "version": 1, "parameters": all })
}

fn tunable(row: &Parameter, default: f64) -> Value {
    let mut entry = Map::new();
    let mut put = |key: &str, value: Value| drop(entry.insert(key.to_owned(), value));
    put("name", row.name.into());
    put("type", type_name(row.kind).into());
    put("group", row.group.into());
    put("category", "Standard".into());
    put("shortDesc", row.meaning.into());
    put("longDesc", long_text(row).into());
    put("min", row.min.into());
    put("max", row.max.into());
    put("default", default.into());
    put("decimalPlaces", decimal_places(row, default).into());
    put("rebootRequired", row.at_restart.into());
    if row.unit != "-" {
        put("units", row.unit.into());
    }
    if !row.choices.is_empty() {
        let values = row.choices.iter();
        let values =
            values.map(|choice| json!({"value": choice.value, "description": choice.label}));
        put("values", values.collect());
    }
    Value::Object(entry)
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

fn compatibility(row: &CompatibilityParameter) -> Value {
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
    if !row.label.is_empty()
        && let Some(entry) = entry.as_object_mut()
    {
        let only = json!([{ "value": row.value, "description": row.label }]);
        entry.insert("values".to_owned(), only);
    }
    entry
}

fn fault(row: &FaultParameter, effectors: &EffectorList) -> Value {
    let what = effectors.name(row.effector);
    let values = FAULT_CHOICES.iter();
    let values: Vec<Value> =
        values.map(|choice| json!({"value": choice.value, "description": choice.label})).collect();
    json!({
        "name": row.name.as_str(),
        "type": type_name(Kind::Int),
        "group": "Break an effector",
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
        "values": values,
    })
}

fn type_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Int => "Int32",
        Kind::Real => "Float",
    }
}

/// Places behind the point with which the smallest value of interest shows its figures.
fn decimal_places(row: &Parameter, default: f64) -> i32 {
    if row.kind == Kind::Int {
        return 0;
    }
    let sizes = [default, row.min].map(f64::abs);
    let smallest = sizes.into_iter().filter(|size| *size > 0.0).fold(row.max.abs(), f64::min);
    #[expect(clippy::cast_possible_truncation, reason = "the exponent of a finite number is small")]
    let exponent = libm::floor(libm::log10(smallest)) as i32;
    (FIGURES - 1 - exponent).clamp(1, PLACES_MAX)
}
