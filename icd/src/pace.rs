//! How simulation time passes: requested by an operator, done by the plant, of no account to the laws.

use serde::{Deserialize, Serialize};

/// How simulation time passes against wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Pace {
    /// It stands still.
    Pause,
    /// It runs as it did before the pause.
    Run,
    /// It runs for this many control periods and stands still again.
    Step(u32),
    /// It runs this many times as fast as wall time.
    Speed(f64),
}

impl Pace {
    /// Slowest and fastest speed that can be asked for.
    pub const SPEED: (f64, f64) = (0.01, 1000.0);
    /// Most periods of one step.
    pub const STEPS_MAX: u32 = 100_000;

    /// Finite and in range.
    #[must_use]
    pub fn is_valid(self) -> bool {
        match self {
            Self::Pause | Self::Run => true,
            Self::Step(periods) => (1..=Self::STEPS_MAX).contains(&periods),
            Self::Speed(speed) => (Self::SPEED.0..=Self::SPEED.1).contains(&speed),
        }
    }
}
