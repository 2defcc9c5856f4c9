//! How simulation time passes: requested by an operator, done by the plant, of no account to the laws.
//!
//! Standing still and speed are two things: a speed that is asked for while time stands still is the one at
//! which it will run.

use serde::{Deserialize, Serialize};

/// How simulation time passes against wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Pace {
    /// It stands still; steps that were under way end here.
    Pause,
    /// It runs, at the speed that was asked for last.
    Run,
    /// It runs for exactly this many control periods and stands still again. Steps that are asked for while
    /// others are under way come after them.
    Step(u32),
    /// Where it runs, it runs this many times as fast as wall time.
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
