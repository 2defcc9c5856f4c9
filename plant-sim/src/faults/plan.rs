//! When a fault acts, in whole microseconds: first onset, ends, repetitions.

use icd::SimTime;
use icd::fault::{Onset, Timing};

/// A [`Timing`] worked out. The onset of every repetition is exact: rounding does not add up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Plan {
    onset: SimTime,
    /// From nothing to the whole fault, µs.
    pub ramp_us: u64,
    duration_us: Option<u64>,
    every_us: u64,
    /// How often it acts in all; `None` without end.
    times: Option<u32>,
}

impl Plan {
    /// Of a timing that has passed the checks; "at once" means `now`.
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

    /// When it acts for the time number `cycle`, from 0.
    pub fn onset(&self, cycle: u32) -> SimTime {
        SimTime::from_micros(
            self.onset.as_micros().saturating_add(self.every_us * u64::from(cycle)),
        )
    }

    /// When that is over; `None` for never.
    pub fn end(&self, cycle: u32) -> Option<SimTime> {
        let duration_us = self.duration_us?;
        Some(SimTime::from_micros(self.onset(cycle).as_micros().saturating_add(duration_us)))
    }

    /// Whether it acts again after that.
    pub fn comes_again(&self, cycle: u32) -> bool {
        self.times.is_none_or(|times| cycle + 1 < times)
    }
}

/// Seconds to the nearest microsecond; the checks have limited them.
pub(super) fn micros(seconds: f64) -> u64 {
    SimTime::from_seconds(seconds.clamp(0.0, SimTime::MAX_SECONDS)).unwrap_or_default().as_micros()
}
