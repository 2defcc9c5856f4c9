//! Files that the autopilot reads at start: its model of the aircraft, its part of a scenario, scripts.
//!
//! Their texts are parsed by [`crate::configuration`], without files.

use std::error::Error;
use std::path::Path;

use host_io::file::{self, FileProblem};
use icd::EffectorList;

pub use flight_management::configuration::*;
use flight_management::script::{Script, TEXT_MAX};

/// Why the autopilot cannot continue: a sentence that names the option, the file or the link.
pub type RunError = Box<dyn Error + Send + Sync>;

/// Reads a whole text file.
pub fn read(path: &Path) -> Result<String, ConfigError> {
    file::read_text(path, file::TEXT_MAX)
        .map_err(|source| ConfigError::Read { path: path.to_path_buf(), source: source.into() })
}

/// The model that comes with the program under this name, or else the model in this file.
pub fn named_model(name: &Path) -> Result<Model, ConfigError> {
    let (name, text) = file::shipped_or_read(name, &MODELS)
        .map_err(|source| ConfigError::Read { path: name.to_path_buf(), source: source.into() })?;
    model(&name, &text)
}

/// Reads a script for an aircraft with these effectors; a file over the limit is not read.
pub fn script_file(path: &Path, effectors: &EffectorList) -> Result<Script, ConfigError> {
    let name = path.display().to_string();
    match file::read_text(path, TEXT_MAX as u64) {
        Ok(text) => Ok(Script::parse(&name, &text, effectors)?),
        Err(FileProblem::TooLong { bytes, .. }) => {
            Err(Script::too_long(&name, usize::try_from(bytes).unwrap_or(usize::MAX)).into())
        }
        Err(source) => Err(ConfigError::Read { path: path.to_path_buf(), source: source.into() }),
    }
}
