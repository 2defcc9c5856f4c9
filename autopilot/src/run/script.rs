//! The option of the script that begins with the flight.

use std::path::PathBuf;

use crate::config::{self, ConfigError};
use crate::script::Script;

/// What begins with the flight.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ScriptArgs {
    /// Script of faults and events that begins with each flight, instead of the scenario's
    #[arg(long, value_name = "FILE")]
    pub script: Option<PathBuf>,
}

impl ScriptArgs {
    /// The script of the option, or else that of the scenario.
    ///
    /// # Errors
    /// [`ConfigError`] names file, line and column.
    pub fn read(&self, scenario: Option<Script>) -> Result<Option<Script>, ConfigError> {
        let Some(path) = &self.script else { return Ok(scenario) };
        let text = config::read(path)?;
        Ok(Some(Script::parse(&path.display().to_string(), &text)?))
    }
}
