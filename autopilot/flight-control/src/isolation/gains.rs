//! Gains of the isolation.

use serde::{Deserialize, Serialize};

/// What the verdict of the isolation is good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum IsolationMode {
    /// It is reported, and changes no command.
    #[default]
    Report,
    /// The same, and small test deflections where two effectors look alike.
    Test,
    /// The same, and the allocation `relief` uses what is known of the effectors that are healthy.
    Use,
}

/// Gains of [`super::Isolation`]; rows `ISO_*` of the parameter table.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct IsolationGains {
    /// Time after which what was seen counts e times less, s.
    pub memory_s: f64,
    /// Time between two samples of the estimate that count as independent, s.
    pub correlation_s: f64,
    /// Deviation of the estimate that no hypothesis has to explain, in activation levels.
    pub noise_level: f64,
    /// The same as a part of the estimate: how wrong the design model may be.
    pub model_error: f64,
    /// Probability from which on an effector is named.
    pub confidence: f64,
    /// It has to be exceeded this long without a break, s.
    pub persistence_s: f64,
    /// Size of a test deflection, rad.
    pub test_rad: f64,
}

impl Default for IsolationGains {
    fn default() -> Self {
        Self::REFERENCE
    }
}

impl IsolationGains {
    /// This project's choice; docs/isolation.md says what they were chosen with.
    pub const REFERENCE: Self = Self {
        memory_s: 10.0,
        correlation_s: 0.2,
        noise_level: 0.1,
        model_error: 0.05,
        confidence: 0.9,
        persistence_s: 0.3,
        test_rad: 0.05,
    };
}
