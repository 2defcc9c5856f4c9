//! Commands on their way: of a late actuator, or one whose fault delays it.

use std::collections::VecDeque;

use icd::SimTime;

use super::COMMANDS_MAX;

/// The commands of one effector that are not due yet, oldest first.
#[derive(Debug, Clone)]
pub(crate) struct Delayed(VecDeque<(SimTime, f64)>);

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

    /// The pending commands, oldest first.
    pub fn commands(&mut self) -> impl Iterator<Item = &mut f64> {
        self.0.iter_mut().map(|(_, command)| command)
    }
}
