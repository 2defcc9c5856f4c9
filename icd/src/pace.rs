//! How simulation time passes: an operator requests it, the plant executes it, and the laws do not notice.
//!
//! Pausing and speed are independent: a speed that an operator sets during a pause applies when time runs again.

use serde::{Deserialize, Serialize};

/// How simulation time passes against wall time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Pace {
    /// Simulation time pauses; steps in progress end here.
    Pause,
    /// Simulation time runs, at the speed of the latest request.
    Run,
    /// Simulation time runs for exactly this many control periods and pauses again. Steps requested during other steps
    /// follow them.
    Step(u32),
    /// Simulation time runs this many times as fast as wall time.
    Speed(f64),
}

impl Pace {
    /// Slowest and fastest speed of a request.
    pub const SPEED: (f64, f64) = (0.01, 1000.0);
    /// Most periods of one step.
    pub const STEPS_MAX: u32 = 100_000;

    /// Whether the speed or the number of periods is finite and in range.
    pub fn is_valid(self) -> bool {
        match self {
            Self::Pause | Self::Run => true,
            Self::Step(periods) => (1..=Self::STEPS_MAX).contains(&periods),
            Self::Speed(speed) => (Self::SPEED.0..=Self::SPEED.1).contains(&speed),
        }
    }
}
