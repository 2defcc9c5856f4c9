//! The times of a fault in whole microseconds: onset, end, repetitions.

use icd::SimTime;
use icd::fault::{Onset, Timing};

/// A [`Timing`] in absolute times. The onset of every repetition is exact: rounding errors do not accumulate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plan {
    onset: SimTime,
    /// Time from no effect to the full fault, µs.
    pub ramp_us: u64,
    duration_us: Option<u64>,
    every_us: u64,
    /// Number of times that it acts; `None` without end.
    times: Option<u32>,
}

impl Plan {
    /// From a checked timing; "at once" means `now`.
    pub fn new(timing: &Timing, now: SimTime) -> Self {
        Self {
            onset: match timing.onset {
                Onset::AtOnce => now,
                Onset::At(at) => at,
            },
            ramp_us: micros(timing.ramp_s),
            duration_us: timing.duration_s.map(micros),
            every_us: timing.repeat.map_or(0, |repeat| micros(repeat.every_s)),
            times: timing.repeat.map_or(Some(1), |repeat| repeat.times),
        }
    }

    /// Onset of repetition `cycle`, from 0.
    pub fn onset(&self, cycle: u32) -> SimTime {
        SimTime::from_micros(
            self.onset.as_micros().saturating_add(self.every_us * u64::from(cycle)),
        )
    }

    /// End of repetition `cycle`; `None` for a fault without end.
    pub fn end(&self, cycle: u32) -> Option<SimTime> {
        let duration_us = self.duration_us?;
        Some(SimTime::from_micros(self.onset(cycle).as_micros().saturating_add(duration_us)))
    }

    /// Whether another repetition follows repetition `cycle`.
    pub fn repeats_after(&self, cycle: u32) -> bool {
        self.times.is_none_or(|times| cycle + 1 < times)
    }
}

/// Seconds, rounded to the nearest microsecond; the caller has checked their range.
pub(crate) fn micros(seconds: f64) -> u64 {
    SimTime::from_seconds(seconds.clamp(0.0, SimTime::MAX_SECONDS)).unwrap_or_default().as_micros()
}
