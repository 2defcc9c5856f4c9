//! The effectors. Their numbers are those of SERVO_OUTPUT_RAW and of fault injection.
//!
//! The format describes a page on which outputs are assigned and tested. Here both are fixed: nothing can be
//! assigned, and a jet in the air tests no servo. So the file names the effectors and asks for no page.

use icd::Effector;
use serde_json::{Map, Value, json};

/// Groups of effectors: label, type, first and last place.
const GROUPS: [(&str, &str, usize, usize); 3] =
    [("Aerodynamic surfaces", "servo", 1, 5), ("Nozzle", "servo", 6, 7), ("Engine", "motor", 8, 8)];

/// The file.
pub(super) fn description() -> Value {
    let places = || (1_usize..).zip(Effector::ALL);
    let channels: Vec<Value> = places()
        .map(|(place, effector)| json!({ "label": title(effector), "param-index": place }))
        .collect();
    let functions: Map<String, Value> = places()
        .map(|(place, effector)| {
            let function =
                json!({ "label": title(effector), "exclude-from-actuator-testing": true });
            (place.to_string(), function)
        })
        .collect();
    json!({
        "version": 2,
        "show-ui-if": "false",
        "outputs_v1": [{
            "label": "Effectors",
            "subgroups": [{ "per-channel-parameters": [], "channels": channels }],
        }],
        "functions_v1": functions,
        "mixer_v1": {
            "actuator-types": {
                "DEFAULT": { "values": { "min": -1, "max": 1, "default": 0 } },
                "servo": {
                    "values": { "min": -1, "max": 1, "default": 0 },
                    "function-min": 1,
                    "function-max": 7,
                },
                "motor": {
                    "values": { "min": 0, "max": 1, "default": 0 },
                    "function-min": 8,
                    "function-max": 8,
                },
            },
            "config": [{
                "title": "Jet with thrust vectoring",
                "actuators": GROUPS.map(group),
            }],
        },
    })
}

fn group((label, kind, first, last): (&str, &str, usize, usize)) -> Value {
    let members = Effector::ALL.into_iter().skip(first - 1).take(last + 1 - first);
    json!({
        "group-label": label,
        "actuator-type": kind,
        "count": last + 1 - first,
        "item-label-prefix": members.map(title).collect::<Vec<_>>(),
        "per-item-parameters": [],
    })
}

/// The name with a capital letter.
fn title(effector: Effector) -> String {
    let mut letters = effector.name().chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
