//! The control side of a flight at its start: everything that a replay needs of it.

use std::sync::Arc;

use flight_control::{AircraftModel, Gains};
use icd::wire;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::hash::hex;
use flight_management::autopilot::Settings;
use flight_management::parameters::{NavigationParameters, ReferenceLimits};
use flight_management::script::Script;
use flight_management::vehicle::schedule::ReferenceSchedule;

/// Version of the rules that a flight follows. It is raised whenever a program of the same version would fly the
/// same inputs differently, so that a replay refuses an older log instead of comparing it.
pub const FLIGHT_RULES: u32 = 4;

/// The control side of a flight at its first packet; JSON in the info message `control_header`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ControlHeader {
    /// Version of this program.
    pub version: String,
    /// Version of the plant link's packets.
    pub wire_version: u16,
    /// [`FLIGHT_RULES`] of this program.
    pub flight_rules: u32,
    /// Short form of the flight's session: the beginning of its hash.
    pub session: String,
    /// Control period, us.
    pub period_us: u32,
    /// Interval of rows away from events, control steps ([`super::LogRate`]).
    pub row_every: u32,
    /// The first packet was not the flight's first: such a log cannot be replayed.
    pub joined_in_flight: bool,
    /// The controller's model of the aircraft.
    pub model: AircraftModel,
    pub gains: Gains,
    pub limits: ReferenceLimits,
    pub navigation: NavigationParameters,
    pub references: ReferenceSchedule,
    /// The script that begins with the flight.
    pub script: Option<Arc<Script>>,
    /// Scripts may break the aircraft.
    pub fault_injection: bool,
    /// SHA-256 of the parameters ([`parameter_hash`]).
    pub parameter_hash: String,
}

impl ControlHeader {
    /// For a flight of this program that begins with `settings`. [`super::Encoder`] fills in the parameter hash and the interval of
    /// rows.
    pub fn new(
        settings: Settings,
        session: String,
        period_us: u32,
        joined_in_flight: bool,
    ) -> Self {
        let Settings {
            model, gains, limits, navigation, references, script, fault_injection, ..
        } = settings;
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            wire_version: wire::VERSION,
            flight_rules: FLIGHT_RULES,
            session,
            period_us,
            row_every: 1,
            joined_in_flight,
            model,
            gains,
            limits,
            navigation,
            references,
            script,
            fault_injection,
            parameter_hash: String::new(),
        }
    }

    /// The control side as it was at the first packet.
    pub fn settings(&self) -> Settings {
        Settings {
            model: self.model,
            gains: self.gains,
            limits: self.limits,
            navigation: self.navigation,
            references: self.references.clone(),
            script: self.script.clone(),
            fault_injection: self.fault_injection,
            own_law: None,
        }
    }
}

/// SHA-256 over a line `NAME=VALUE` for each parameter, 64 hexadecimal digits. The values are written so that they
/// can be read back bit for bit.
pub fn parameter_hash<'a>(values: impl IntoIterator<Item = (&'a str, f64)>) -> String {
    let mut sha = Sha256::new();
    for (name, value) in values {
        sha.update(format!("{name}={value}\n"));
    }
    hex(&sha.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parameter_hash_is_that_of_lines_of_name_and_value() {
        let lines = "A=1\nB=0.1\n";
        assert_eq!(parameter_hash([("A", 1.0), ("B", 0.1)]), hex(&Sha256::digest(lines)));
    }
}
