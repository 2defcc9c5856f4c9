//! The effectors. Their numbers are those of SERVO_OUTPUT_RAW and of fault injection.
//!
//! The format describes a page on which outputs are assigned and tested. Here both are fixed: nothing can be
//! assigned, and a jet in the air tests no servo. So the file names the effectors and asks for no page.

use icd::{Effector, EffectorKind, EffectorList};
use serde_json::{Map, Value, json};

/// A group of effectors: label, type, which kinds.
type Group = (&'static str, &'static str, fn(EffectorKind) -> bool);

/// All of them.
const GROUPS: [Group; 3] = [
    ("Aerodynamic surfaces", "servo", EffectorKind::is_surface),
    ("Nozzle", "servo", EffectorKind::is_nozzle),
    ("Engine", "motor", |kind| matches!(kind, EffectorKind::Engine)),
];

/// The file for an aircraft with these effectors.
pub(super) fn description(effectors: &EffectorList) -> Value {
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
    let mut types = Map::new();
    types.insert("DEFAULT".into(), json!({ "values": { "min": -1, "max": 1, "default": 0 } }));
    for (name, is_angle, min) in [("servo", true, -1), ("motor", false, 0)] {
        let of_unit: Vec<usize> = places()
            .filter(|(_, effector)| effectors.is_angle(*effector) == is_angle)
            .map(|(place, _)| place)
            .collect();
        if let (Some(first), Some(last)) = (of_unit.first(), of_unit.last()) {
            let entry = json!({
                "values": { "min": min, "max": 1, "default": 0 },
                "function-min": first,
                "function-max": last,
            });
            types.insert(name.into(), entry);
        }
    }
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
                "title": title_of_aircraft(effectors),
                "actuators": GROUPS.iter().filter_map(|group| self::group(effectors, group)).collect::<Vec<_>>(),
            }],
        },
    })
}

/// What the aircraft is, by what it has.
fn title_of_aircraft(effectors: &EffectorList) -> &'static str {
    if effectors.only(EffectorKind::NozzlePitch).is_some() {
        "Jet with thrust vectoring"
    } else {
        "Aircraft with surfaces"
    }
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
