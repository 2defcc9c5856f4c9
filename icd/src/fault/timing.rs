//! When a fault acts: onset, ramp, duration, repetition.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::time::SimTime;

/// When a requested change acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Onset {
    /// At the tick in which the request reaches the plant.
    AtOnce,
    /// At this simulation time, exactly, also between ticks.
    At(SimTime),
}

/// When a fault acts, how fast it comes, how long it stays, and how often it comes again.
///
/// ```text
///  1        ________              ________
///          /        |            /        |
///  0 _____/         |___________/         |______
///       onset                onset + every
///         <-ramp->
///         <----duration---->
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// When it acts first.
    pub onset: Onset,
    /// Time from nothing to the whole fault, s; 0 for at once. A fault without a size has no ramp.
    pub ramp_s: f64,
    /// How long it acts, s, the ramp included; `None` for ever.
    pub duration_s: Option<f64>,
    /// How it comes again; only with a duration.
    pub repeat: Option<Repeat>,
}

/// How a fault comes again.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Repeat {
    /// From one onset to the next, s; longer than the duration.
    pub every_s: f64,
    /// How often it acts in all, at least 2; `None` without end.
    pub times: Option<u32>,
}

impl Timing {
    /// At once and for ever.
    pub const NOW: Self = Self::from_onset(Onset::AtOnce);

    /// From this onset on, for ever, without a ramp.
    #[must_use]
    pub const fn from_onset(onset: Onset) -> Self {
        Self { onset, ramp_s: 0.0, duration_s: None, repeat: None }
    }

    /// From this time on, for ever, without a ramp.
    #[must_use]
    pub const fn at(time: SimTime) -> Self {
        Self::from_onset(Onset::At(time))
    }
}

/// What is beyond the onset, each part with a comma before it.
impl fmt::Display for Timing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.ramp_s > 0.0 {
            write!(f, ", ramp {} s", self.ramp_s)?;
        }
        if let Some(duration_s) = self.duration_s {
            write!(f, ", for {duration_s} s")?;
        }
        match self.repeat {
            None => Ok(()),
            Some(Repeat { every_s, times: None }) => write!(f, ", every {every_s} s"),
            Some(Repeat { every_s, times: Some(times) }) => {
                write!(f, ", every {every_s} s, {times} times")
            }
        }
    }
}
