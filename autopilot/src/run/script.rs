//! The option of the script that begins with the flight.

use std::path::PathBuf;

use icd::EffectorList;

use crate::config::{self, ConfigError};
use flight_management::script::Script;

/// What begins with the flight.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct ScriptArgs {
    /// Script of faults and events that begins with each flight, instead of the scenario's
    #[arg(long, value_name = "FILE")]
    pub script: Option<PathBuf>,
}

impl ScriptArgs {
    /// For an aircraft with these effectors: the script of the option, or else that of the scenario.
    ///
    /// # Errors
    /// [`ConfigError`] names file, line and column.
    pub fn read(
        &self,
        scenario: Option<Script>,
        effectors: &EffectorList,
    ) -> Result<Option<Script>, ConfigError> {
        let Some(path) = &self.script else { return Ok(scenario) };
        config::script_file(path, effectors).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::tvc_jet;

    #[test]
    fn a_file_that_is_too_long_or_no_file_or_not_there_is_named() {
        let error = |path: &str| {
            let args = ScriptArgs { script: Some(path.into()) };
            args.read(None, &tvc_jet::effectors()).unwrap_err().to_string()
        };
        let endless = error("/dev/zero");
        assert_eq!(endless, "/dev/zero: this is a device, and an ordinary file is needed");
        let folder = tempfile::tempdir().unwrap();
        let long = folder.path().join("long");
        std::fs::write(&long, [b'#'; 16_385]).unwrap();
        let long = error(long.to_str().unwrap());
        assert!(long.contains("16385 bytes"), "{long}");
        assert!(error("/nowhere/x.txt").contains("/nowhere/x.txt"));
    }
}
