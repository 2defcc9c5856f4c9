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

gain_set! {
    /// Gains of [`super::Isolation`]; rows `ISO_*` of the parameter table.
    ///
    /// This project's choice; docs/estimation.md says what they were chosen with.
    IsolationGains at isolation {
        /// Time after which what was seen counts e times less, s.
        memory_s = 10.0, "ISO_MEMORY" "s", 0.5 to 60.0, "Time after which what was seen counts e times less";
        /// Time between two samples of the estimate that count as independent, s.
        correlation_s = 0.2, "ISO_CORR" "s", 0.02 to 5.0, "Time between two samples of the estimate that count as independent";
        /// Deviation of the estimate that no hypothesis has to explain, in activation levels.
        noise_level = 0.1, "ISO_NOISE" "-", 0.01 to 10.0, "Deviation of the estimate that needs no explanation, in activation levels";
        /// The same as a part of the estimate: how wrong the design model may be.
        model_error = 0.05, "ISO_MODEL" "-", 0.0 to 1.0, "The same as a part of the estimate: how wrong the design model may be";
        /// Probability from which on an effector is named.
        confidence = 0.9, "ISO_CONF" "-", 0.5 to 0.9999, "Probability from which on an effector is named";
        /// It has to be exceeded this long without a break, s.
        persistence_s = 0.3, "ISO_PERSIST" "s", 0.1 to 60.0, "The probability has to be exceeded this long";
        /// Size of a test deflection, rad.
        test_rad = 0.05, "ISO_TEST" "rad", 0.001 to 0.2, "Size of a test deflection";
    }
}
