//! Files that the autopilot reads at start: its model of the aircraft, its part of a scenario, scripts.
//!
//! Their texts are parsed by [`crate::configuration`], without files.

use std::path::Path;

use host_io::file::{self, FileProblem};
use host_io::problem::{At as _, Problem};
use icd::EffectorList;

pub use flight_management::configuration::*;
use flight_management::script::{Script, TEXT_MAX};

/// Reads a whole text file.
pub fn read(path: &Path) -> Result<String, Problem> {
    file::read_text(path, file::TEXT_MAX).at(path.display())
}

/// The model that comes with the program under this name, or else the model in this file.
pub fn named_model(name: &Path) -> Result<Model, Problem> {
    let read = file::shipped_or_read(name, aircraft::MODELS);
    let (file, text) = read.at(format_args!("--model {}", name.display()))?;
    Ok(model(&file, &text)?)
}

/// Reads a script for an aircraft with these effectors; a file over the limit is not read.
pub fn script_file(path: &Path, effectors: &EffectorList) -> Result<Script, Problem> {
    let name = path.display().to_string();
    match file::read_text(path, TEXT_MAX as u64) {
        Ok(text) => Ok(Script::parse(&name, &text, effectors)?),
        Err(FileProblem::TooLong { bytes, .. }) => Err(Script::too_long(&name, bytes).into()),
        Err(problem) => Err(problem).at(format_args!("--script {name}")),
    }
}
