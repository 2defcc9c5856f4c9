//! What is kept of the parameters for the next start. Which file, and writing it, is the business of
//! `autopilot::io::store`.

use crate::peers::From;
use flight_management::parameters::{ParameterError, Parameters, to_text};

/// Requests that may wait for their save.
const WAITING_MAX: usize = 16;

/// A text to be saved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Save {
    /// Number that [`Saved`] repeats; later texts have larger ones.
    pub number: u64,
    /// The whole file.
    pub text: String,
    /// Somebody waits for it.
    pub at_once: bool,
}

/// What became of a save.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Saved {
    /// The latest save that it is about.
    pub number: u64,
    /// Why not, as a text for the operator.
    pub result: Result<(), String>,
}

/// What is kept, and who waits for it.
#[derive(Debug, Default)]
pub(super) struct Keeper {
    /// `None` where nothing is kept.
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
    /// From now on changes are kept; `kept` is what is kept already.
    pub(super) fn begin(&mut self, kept: Parameters) {
        self.kept = Some(kept);
    }

    /// Keeps a value that was set. What the command line set is not kept, so the kept set can be one that
    /// does not fit together although the set that flies does.
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

    /// Keeps nothing but defaults.
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

    /// So many wait for a save that nobody else can.
    pub(super) fn is_crowded(&self) -> bool {
        self.waiting.len() >= WAITING_MAX
    }

    /// A station waits until everything is saved. False where nothing is kept, or too many wait.
    pub(super) fn wait(&mut self, from: From, defaults: &Parameters) -> bool {
        if self.kept.is_none() || self.is_crowded() {
            return false;
        }
        self.save(true, defaults);
        self.waiting.push((from, self.last_number));
        true
    }

    /// Next text to be saved.
    pub(super) fn pop(&mut self) -> Option<Save> {
        self.next.take()
    }

    /// Takes what became of a save; gives those who waited for it.
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
