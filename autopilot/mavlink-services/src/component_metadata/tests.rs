use icd::tvc_jet;
use std::collections::BTreeSet;

use serde_json::Value;

use super::*;
use flight_management::parameters::{COMPATIBILITY, Kind, Parameters, fault_parameters, table};

fn metadata() -> Metadata {
    Metadata::new(&tvc_jet::effectors(), &Parameters::default())
}

fn file(name: &str) -> Value {
    let metadata = metadata();
    let (_, text) = metadata.files().iter().find(|(other, _)| *other == name).unwrap();
    serde_json::from_str(text).unwrap()
}

fn keys(object: &Value) -> BTreeSet<&str> {
    object.as_object().unwrap().keys().map(String::as_str).collect()
}

/// An object with all of `required` and nothing else but `optional`.
fn assert_keys(object: &Value, required: &[&str], optional: &[&str]) {
    let keys = keys(object);
    for key in required {
        assert!(keys.contains(key), "{key} is missing in {object}");
    }
    for key in keys {
        assert!(required.contains(&key) || optional.contains(&key), "{key} is no key of {object}");
    }
}

#[test]
fn the_general_file_leads_to_the_others_and_knows_their_checksums() {
    let general = file(GENERAL);
    let optional = ["vendorName", "modelName", "firmwareVersion", "hardwareVersion"];
    assert_keys(&general, &["version", "metadataTypes"], &optional);
    assert_eq!(general["version"], 1, "QGroundControl takes no other");
    let version = general["firmwareVersion"].as_str().unwrap();
    assert!(version.split('.').all(|part| part.parse::<u32>().is_ok()), "{version}");
    let types = general["metadataTypes"].as_array().unwrap();
    assert_eq!(types.len(), metadata().files().len() - 1);
    for entry in types {
        assert_keys(entry, &["type", "uri", "fileCrc"], &[]);
        let name = entry["uri"].as_str().unwrap().strip_prefix("mftp:///").unwrap();
        let metadata = metadata();
        let (_, text) = metadata.files().iter().find(|(other, _)| *other == name).unwrap();
        assert_eq!(entry["fileCrc"], crc32(text.as_bytes()), "{name}");
    }
    let kinds: Vec<u64> = types.iter().map(|entry| entry["type"].as_u64().unwrap()).collect();
    assert_eq!(kinds, [1, 4, 5], "COMP_METADATA_TYPE of parameters, events, actuators");
}

#[test]
fn every_parameter_on_the_wire_is_described_once() {
    let description = file("parameter.json");
    assert_keys(&description, &["version", "parameters"], &[]);
    assert_eq!(description["version"], 1, "QGroundControl takes no other");
    let entries = description["parameters"].as_array().unwrap();
    let described: Vec<&str> =
        entries.iter().map(|entry| entry["name"].as_str().unwrap()).collect();
    let list = tvc_jet::effectors();
    let own = table().iter().map(|row| row.name.to_owned());
    let others = COMPATIBILITY.iter().map(|row| row.name.to_owned());
    let others = others.chain(fault_parameters(&list).map(|row| row.name.to_string()));
    let expected: Vec<String> = own.chain(others).collect();
    assert_eq!(described, expected);
    let required = ["name", "type", "group", "category", "shortDesc", "longDesc", "default"];
    let optional = ["min", "max", "units", "decimalPlaces", "rebootRequired", "values", "readOnly"];
    for entry in entries {
        assert_keys(entry, &required, &optional);
        assert!(["Int32", "Float"].contains(&entry["type"].as_str().unwrap()), "{entry}");
        assert!(!entry["shortDesc"].as_str().unwrap().is_empty());
        assert!(entry["default"].is_number());
        assert!(entry["decimalPlaces"].is_u64(), "{entry}");
        for value in entry["values"].as_array().into_iter().flatten() {
            assert_keys(value, &["value", "description"], &[]);
        }
    }
}

#[test]
fn ranges_defaults_units_and_choices_are_those_of_the_table() {
    let description = file("parameter.json");
    let entries = description["parameters"].as_array().unwrap();
    for (row, entry) in table().iter().zip(entries) {
        let name = row.name;
        assert_eq!(entry["min"].as_f64(), Some(row.min), "{name}");
        assert_eq!(entry["max"].as_f64(), Some(row.max), "{name}");
        assert_eq!(entry["default"].as_f64(), Some(row.value(&Parameters::default())), "{name}");
        let unit = if row.unit == "-" { Value::Null } else { row.unit.into() };
        assert_eq!(entry["units"], unit, "{name}");
        let choices = entry["values"].as_array().map_or(0, Vec::len);
        assert_eq!(choices, row.choices.len(), "{name}");
        if row.kind == Kind::Real {
            let places = i32::try_from(entry["decimalPlaces"].as_u64().unwrap()).unwrap();
            let shown = format!("{:.*}", usize::try_from(places).unwrap(), row.default_value());
            let shown: f64 = shown.parse().unwrap();
            let error = (shown - row.default_value()).abs();
            // Half a unit of the fourth figure.
            assert!(error <= 5.0e-4 * row.default_value().abs(), "{name} shows as {shown}");
        }
    }
}

#[test]
fn compatibility_parameters_stand_apart_and_are_read_only() {
    let description = file("parameter.json");
    let entries = description["parameters"].as_array().unwrap();
    let (own, others) = entries.split_at(table().len());
    let (compatibility, faults) = others.split_at(COMPATIBILITY.len());
    for (entry, row) in compatibility.iter().zip(COMPATIBILITY) {
        assert_eq!(entry["group"], "Compatibility");
        let same = compatibility.iter().filter(|other| other["shortDesc"] == entry["shortDesc"]);
        assert_eq!(same.count(), 1, "a label that QGroundControl prints: {}", entry["shortDesc"]);
        if let Some(meant) = row.meant() {
            assert_eq!((&entry["readOnly"], &entry["max"]), (&Value::Null, &meant.max.into()));
            continue;
        }
        assert_eq!(entry["readOnly"], true);
        assert!(entry["longDesc"].as_str().unwrap().contains("there for the station"), "{entry}");
    }
    assert!(own.iter().chain(faults).all(|entry| entry["readOnly"].is_null()));
}

#[test]
fn the_actuator_file_names_the_eight_effectors_and_needs_no_page() {
    let actuators = file("actuators.json");
    let required = ["version", "outputs_v1", "functions_v1", "mixer_v1"];
    assert_keys(&actuators, &required, &["show-ui-if"]);
    assert_eq!(actuators["show-ui-if"], "false");
    assert_eq!(actuators["functions_v1"].as_object().unwrap().len(), 8);
    assert_eq!(actuators["functions_v1"]["1"]["label"], "Left aileron");
    assert_eq!(actuators["functions_v1"]["8"]["label"], "Engine");
    let output = &actuators["outputs_v1"][0];
    assert_keys(output, &["label", "subgroups"], &[]);
    let subgroup = &output["subgroups"][0];
    assert_keys(subgroup, &["per-channel-parameters", "channels"], &[]);
    for channel in subgroup["channels"].as_array().unwrap() {
        assert_keys(channel, &["label", "param-index"], &[]);
    }
    let mixer = &actuators["mixer_v1"];
    assert_keys(mixer, &["actuator-types", "config"], &[]);
    let mut described = 0;
    for group in mixer["config"][0]["actuators"].as_array().unwrap() {
        let required = ["group-label", "count", "actuator-type", "per-item-parameters"];
        assert_keys(group, &required, &["item-label-prefix"]);
        let labels = group["item-label-prefix"].as_array().unwrap().len();
        assert_eq!(group["count"], labels, "a label for each");
        assert!(mixer["actuator-types"][group["actuator-type"].as_str().unwrap()].is_object());
        described += labels;
    }
    assert_eq!(described, 8);
}

#[test]
fn the_event_file_describes_what_is_sent_which_is_nothing() {
    let events = file("events.json");
    assert_keys(&events, &["version", "components"], &[]);
    let component = &events["components"][0];
    assert_keys(component, &["component_id", "namespace"], &["enums", "event_groups"]);
    assert_eq!(component["event_groups"].as_array().map(Vec::len), Some(0));
}

#[test]
fn the_checksum_is_the_one_that_ground_stations_compute() {
    // Bit by bit, as the definition has it.
    let plain = |content: &[u8]| {
        content.iter().fold(0_u32, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
                if crc & 1 == 0 { crc >> 1 } else { (crc >> 1) ^ 0xEDB8_8320 }
            })
        })
    };
    for content in [&b""[..], b"\0", b"123456789", &[0xFF; 300]] {
        assert_eq!(crc32(content), plain(content), "{content:?}");
    }
    assert_eq!(crc32(b"123456789"), 0x2DFD_2D88);
}
