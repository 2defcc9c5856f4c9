//! The parameters saved for the next start. `autopilot::io::store` knows which file, and
//! writes it.

use crate::peers::From;
use flight_management::parameters::{ParameterError, Parameters, to_text};

/// Requests that may wait for their save.
const WAITING_MAX: usize = 16;

/// A content to be saved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Save {
    /// Number that [`Saved`] repeats; later contents have larger ones.
    pub number: u64,
    pub text: String,
    /// A client waits for it.
    pub at_once: bool,
}

/// Result of a save.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Saved {
    /// The latest save that it covers.
    pub number: u64,
    /// Reason of a failure, as a text for the operator.
    pub result: Result<(), String>,
}

/// The set to save, and the clients that wait for it.
#[derive(Debug, Default)]
pub(super) struct Keeper {
    /// `None` where nothing is saved.
    kept: Option<Parameters>,
    last_number: u64,
    next: Option<Save>,
    waiting: Vec<(From, u64)>,
    has_failed: bool,
}

/// Saving has begun to fail, or to work again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Transition {
    Fails,
    Works,
}

impl Keeper {
    /// Saves changes from now on; `kept` is the saved set.
    pub(super) fn begin(&mut self, kept: Parameters) {
        self.kept = Some(kept);
    }

    /// Records a value that was set. Values from the command line are not saved, so the saved set can be
    /// inconsistent although the active set is valid.
    pub(super) fn keep(
        &mut self,
        name: &str,
        value: f64,
        defaults: &Parameters,
    ) -> Result<(), ParameterError> {
        let Some(kept) = self.kept.as_mut() else { return Ok(()) };
        let before = *kept;
        kept.set(name, value)?;
        if *kept != before {
            self.save(false, defaults);
        }
        Ok(())
    }

    /// Resets the saved set to the defaults.
    pub(super) fn reset(&mut self, defaults: &Parameters) {
        if let Some(kept) = self.kept.as_mut() {
            *kept = *defaults;
            self.save(true, defaults);
        }
    }

    fn save(&mut self, at_once: bool, defaults: &Parameters) {
        let Some(kept) = &self.kept else { return };
        self.last_number += 1;
        let at_once = at_once || self.next.as_ref().is_some_and(|next| next.at_once);
        let text = to_text(kept, defaults);
        self.next = Some(Save { number: self.last_number, text, at_once });
    }

    /// Whether the list of waiting clients is full.
    pub(super) fn is_crowded(&self) -> bool {
        self.waiting.len() >= WAITING_MAX
    }

    /// Adds a client that waits until everything is saved. False where nothing is saved, or too many wait.
    pub(super) fn wait(&mut self, from: From, defaults: &Parameters) -> bool {
        if self.kept.is_none() || self.is_crowded() {
            return false;
        }
        self.save(true, defaults);
        self.waiting.push((from, self.last_number));
        true
    }

    /// Next content to be saved.
    pub(super) fn pop(&mut self) -> Option<Save> {
        self.next.take()
    }

    /// Handles the result of a save; returns the clients that waited for it.
    pub(super) fn handle(&mut self, saved: &Saved) -> (Vec<From>, Option<Transition>) {
        let done = self.waiting.extract_if(.., |(_, number)| *number <= saved.number);
        let answered = done.map(|(from, _)| from).collect();
        let failed = std::mem::replace(&mut self.has_failed, saved.result.is_err());
        let transition = match (failed, self.has_failed) {
            (false, true) => Some(Transition::Fails),
            (true, false) => Some(Transition::Works),
            _ => None,
        };
        (answered, transition)
    }
}
