//! The times of a fault in whole microseconds: onset, end, repetitions; and the pending commands of a delayed effector.

use std::collections::VecDeque;

use icd::fault::{FaultKind, Onset, Timing};
use icd::{ControlPeriod, SimTime};

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
pub(super) fn micros(seconds: f64) -> u64 {
    SimTime::from_seconds(seconds.clamp(0.0, SimTime::MAX_SECONDS)).unwrap_or_default().as_micros()
}

/// Most commands that can be pending: those of the longest delay at the shortest control period, and the latest one.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a thousand and one, from two constants"
)]
pub const COMMANDS_MAX: usize =
    (FaultKind::DELAY_MAX_S * 1.0e6) as usize / ControlPeriod::MIN_MICROS as usize + 1;

/// The commands of one effector that are not due yet, oldest first.
#[derive(Debug, Clone)]
pub(super) struct Delayed(VecDeque<(SimTime, f64)>);

impl Delayed {
    /// Empty; it allocates its memory here and not in flight.
    pub fn new() -> Self {
        Self(VecDeque::with_capacity(COMMANDS_MAX))
    }

    /// Drops all pending commands.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Adds a command, rad or N, that is due at `due`; if the queue is full, it drops the oldest.
    pub fn push(&mut self, due: SimTime, command: f64) {
        if self.0.len() == COMMANDS_MAX {
            self.0.pop_front();
        }
        self.0.push_back((due, command));
    }

    /// Removes the newest command that is due by `now` and all older ones, and returns the newest.
    pub fn due(&mut self, now: SimTime) -> Option<f64> {
        let mut newest = None;
        while let Some((_, command)) = self.0.pop_front_if(|(due, _)| *due <= now) {
            newest = Some(command);
        }
        newest
    }

    /// When the next command is due.
    pub fn next(&self) -> Option<SimTime> {
        self.0.front().map(|(due, _)| *due)
    }
}
