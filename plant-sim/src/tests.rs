//! Helpers for several tests of this crate: parts of airframe files, reference data.

use serde::de::DeserializeOwned;

/// The F-16's airframe file.
pub use aircraft::F16_AIRFRAME as F16;

/// One table of an airframe file.
pub fn part<T: DeserializeOwned>(text: &str, name: &str) -> T {
    let file: toml::Table = toml::from_str(text).unwrap();
    file[name].clone().try_into().unwrap()
}

/// Check points of the F-16 (`aero` or `prop`) from the folder in `TWO_STEP_REFERENCE_DATA`; `None` without it.
pub fn check_points(kind: &str) -> Option<Vec<serde_json::Value>> {
    let folder = std::env::var_os("TWO_STEP_REFERENCE_DATA")?;
    let path = std::path::Path::new(&folder).join("checkcases/f16_s119.json");
    let text = std::fs::read_to_string(path).expect("the reference data can be read");
    let data: serde_json::Value = serde_json::from_str(&text).unwrap();
    Some(data["check_data"][kind].as_array().unwrap().clone())
}
