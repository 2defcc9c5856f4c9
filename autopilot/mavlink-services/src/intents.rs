//! Intents on their way to the control thread: numbered, bounded.

use std::collections::VecDeque;

use flight_management::command::{Command, FIRST_SCRIPT_REQUEST, Intent};

/// Intents that may wait for room in the channel.
const INTENTS_MAX: usize = 64;

/// The queue of intents.
#[derive(Debug, Default)]
pub struct Intents {
    queue: VecDeque<Intent>,
    last_number: u32,
}

impl Intents {
    /// Intents that still fit.
    #[must_use]
    pub fn room(&self) -> usize {
        INTENTS_MAX - self.queue.len()
    }

    /// Queues a command and returns its number; `None` if the queue is full.
    #[must_use]
    pub fn push(&mut self, command: impl Into<Command>) -> Option<u32> {
        if self.room() == 0 {
            return None;
        }
        self.last_number = (self.last_number + 1) % FIRST_SCRIPT_REQUEST;
        self.queue.push_back(Intent { number: self.last_number, command: command.into() });
        Some(self.last_number)
    }

    /// Next intent for the control thread.
    pub fn pop(&mut self) -> Option<Intent> {
        self.queue.pop_front()
    }

    /// None waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }
}
