//! What an FMU has in its resources: everything that defines its side of the flight, so that one library serves every aircraft.

use std::path::Path;

use autopilot::recorder::FLIGHT_RULES;
use host_io::file;
use host_io::problem::{At as _, Problem, problem};
use plant_sim::PlantSetup;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::autopilot::AutopilotSetup;

/// The file in the folder `resources`.
pub const SETUP_FILE: &str = "setup.json";

/// Largest such file, bytes: a hundred times that of an aircraft with tables.
const SETUP_MAX: u64 = 100_000_000;

/// Bytes of the hash in the instantiation token.
const TOKEN_BYTES: usize = 16;

/// One side of a flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum SideSetup {
    Plant(Box<PlantSetup>),
    Autopilot(Box<AutopilotSetup>),
}

/// Content of the file.
#[derive(Debug, Serialize, Deserialize)]
struct SetupFile {
    /// [`FLIGHT_RULES`] of the program that wrote it.
    flight_rules: u32,
    side: SideSetup,
}

impl SideSetup {
    /// The text of the file. The same setup gives the same bytes.
    pub fn to_json(&self) -> Result<String, Problem> {
        let file = SetupFile { flight_rules: FLIGHT_RULES, side: self.clone() };
        Ok(serde_json::to_string(&file)?)
    }

    /// Reads the folder `resources` of an FMU whose model description has this token.
    pub fn read(resources: &Path, token: &str) -> Result<Self, Problem> {
        let path = resources.join(SETUP_FILE);
        let text = file::read_text(&path, SETUP_MAX).at(path.display())?;
        if token_of(&text) != token {
            return Err(problem!("{}: not the setup of this model description", path.display()));
        }
        let SetupFile { flight_rules, side } = serde_json::from_str(&text).at(path.display())?;
        if flight_rules != FLIGHT_RULES {
            return Err(problem!(
                "the FMU has flight rules {flight_rules}, its library has rules {FLIGHT_RULES}: make it anew"
            ));
        }
        Ok(side)
    }
}

/// Instantiation token of an FMU with this setup.
pub fn token_of(setup: &str) -> String {
    Sha256::digest(setup)[..TOKEN_BYTES].iter().map(|byte| format!("{byte:02x}")).collect()
}
