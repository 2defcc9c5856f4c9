//! Component metadata: files that tell a ground station what parameters, effectors and events mean. They are
//! fetched by MAVLink FTP; COMPONENT_METADATA says where to begin.
//!
//! Formats: mavlink/component_metadata/*.schema.json and libevents. One departure: the version in
//! `parameter.json` is 1, since QGroundControl takes no other, although the latest schema counts from 3.

use std::sync::Arc;

use ::mavlink::dialects::common::{COMPONENT_METADATA_DATA, CompMetadataType};
use icd::EffectorList;
use serde_json::{Value, json};

use super::codec::Encoded;
use flight_management::parameters::Parameters;

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

/// The files for one aircraft; they are the same for the life of the process.
#[derive(Debug)]
pub struct Metadata {
    files: Vec<(&'static str, Arc<str>)>,
    /// CRC-32 of the file with which a ground station begins.
    general_crc: u32,
}

impl Metadata {
    /// For an aircraft with these effectors and these defaults of its parameters.
    #[must_use]
    pub fn new(effectors: &EffectorList, defaults: &Parameters) -> Self {
        let parameters = parameters::description(effectors, defaults);
        let contents = [parameters, events(), actuators::description(effectors)];
        let texts = contents.map(|content| Arc::from(content.to_string()));
        let names = DESCRIPTIONS.map(|(_, name)| name);
        let descriptions: Vec<_> = names.into_iter().zip(texts).collect();
        let general: Arc<str> = general(&descriptions).to_string().into();
        let general_crc = crc32(general.as_bytes());
        let files = core::iter::once((GENERAL, general)).chain(descriptions).collect();
        Self { files, general_crc }
    }

    /// Names and contents.
    #[must_use]
    pub fn files(&self) -> &[(&'static str, Arc<str>)] {
        &self.files
    }

    /// COMPONENT_METADATA at this time since the start, ms.
    #[must_use]
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

/// The checksum of MAVLink FTP and of component metadata: CRC-32 with its register zero at the start and not
/// inverted at the end.
pub fn crc32(content: &[u8]) -> u32 {
    // The library inverts both.
    let mut hasher = crc32fast::Hasher::new_with_initial(u32::MAX);
    hasher.update(content);
    !hasher.finalize()
}

#[cfg(test)]
mod tests;
