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
        config::script_file(path).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_an_end_is_too_long_and_one_that_cannot_be_read_is_named() {
        let error = |path: &str| {
            let args = ScriptArgs { script: Some(path.into()) };
            args.read(None).unwrap_err().to_string()
        };
        let endless = error("/dev/zero");
        assert!(endless.contains("/dev/zero") && endless.contains("16385 bytes"), "{endless}");
        assert!(error("/nowhere/x.txt").contains("/nowhere/x.txt"));
    }
}
