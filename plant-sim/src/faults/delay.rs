//! Pending commands of a delayed effector.

use std::collections::VecDeque;

use icd::fault::FaultKind;
use icd::{ControlPeriod, SimTime};

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
