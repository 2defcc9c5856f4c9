//! Component metadata: files that tell a ground station what parameters, effectors and events mean. They are
//! fetched by MAVLink FTP; COMPONENT_METADATA says where to begin.
//!
//! Formats: mavlink/component_metadata/*.schema.json and libevents. One departure: the version in
//! `parameter.json` is 1, since QGroundControl takes no other, although the latest schema counts from 3.

use std::sync::LazyLock;

use ::mavlink::dialects::common::{COMPONENT_METADATA_DATA, CompMetadataType};
use serde_json::{Value, json};

use super::codec::Encoded;
use super::ftp::crc32;

mod actuators;
mod parameters;

/// File with which a ground station begins.
const GENERAL: &str = "general.json";
/// Kind and file of each description.
const DESCRIPTIONS: [(CompMetadataType, &str); 3] = [
    (CompMetadataType::COMP_METADATA_TYPE_PARAMETER, "parameter.json"),
    (CompMetadataType::COMP_METADATA_TYPE_EVENTS, "events.json"),
    (CompMetadataType::COMP_METADATA_TYPE_ACTUATORS, "actuators.json"),
];

/// Names and contents of the files. They are the same for the life of the process.
pub fn files() -> &'static [(&'static str, String)] {
    static FILES: LazyLock<Vec<(&'static str, String)>> = LazyLock::new(|| {
        let contents = [parameters::description(), events(), actuators::description()];
        let texts = contents.map(|content| content.to_string());
        let names = DESCRIPTIONS.map(|(_, name)| name);
        let descriptions: Vec<_> = names.into_iter().zip(texts).collect();
        let general = general(&descriptions).to_string();
        core::iter::once((GENERAL, general)).chain(descriptions).collect()
    });
    &FILES
}

fn general(descriptions: &[(&'static str, String)]) -> Value {
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

/// What happens is told by STATUSTEXT and by messages of its own. The autopilot sends no EVENT, so there is
/// none to describe; the file says just that.
fn events() -> Value {
    json!({
        "version": 1,
        "components": [{ "component_id": 1, "namespace": "two_step", "enums": [], "event_groups": [] }],
    })
}

fn uri(name: &str) -> String {
    format!("mftp:///{name}")
}

/// COMPONENT_METADATA at this time since the start, ms.
#[must_use]
pub fn message(time_boot_ms: u32) -> Encoded {
    let general = files().iter().find(|(name, _)| *name == GENERAL);
    let file_crc = general.map_or(0, |(_, text)| crc32(text.as_bytes()));
    let uri = uri(GENERAL).as_str().into();
    Encoded::new(&COMPONENT_METADATA_DATA { time_boot_ms, file_crc, uri })
}

#[cfg(test)]
mod tests;
