//! Reaction to the silence of the controlling ground station.

use super::Mode;
use super::request::LinkLossAction;

/// The loss and the changes that it has caused.
#[derive(Debug, Clone, Copy, Default)]
pub struct Link {
    lost: bool,
    undo: Option<Undo>,
}

/// A mode that the loss has selected.
#[derive(Debug, Clone, Copy)]
struct Undo {
    chosen: Mode,
    before: Mode,
}

impl Link {
    /// The station is silent: the mode to change to, if any. `None` if the loss is known already.
    pub fn lose(&mut self, action: LinkLossAction, mode: Mode) -> Option<Option<Mode>> {
        if core::mem::replace(&mut self.lost, true) {
            return None;
        }
        let chosen = match action {
            LinkLossAction::Continue => None,
            LinkLossAction::Hold => Some(Mode::Hold),
            LinkLossAction::Return => Some(Mode::Return),
        };
        let chosen = chosen.filter(|chosen| *chosen != mode);
        self.undo = chosen.map(|chosen| Undo { chosen, before: mode });
        Some(chosen)
    }

    /// The operator or the plan has selected a mode: there is nothing left to undo.
    pub fn forget(&mut self) {
        self.undo = None;
    }

    /// The station is back: the mode to return to. `None` if it was not lost.
    ///
    /// A mode that depends on a stream is not restored: the stream has to command it again.
    pub fn regain(&mut self, mode: Mode) -> Option<Mode> {
        if !core::mem::take(&mut self.lost) {
            return None;
        }
        let undo = self.undo.take().filter(|undo| undo.chosen == mode);
        Some(match undo.map(|undo| undo.before) {
            Some(Mode::Offboard | Mode::Altitude) => Mode::Hold,
            Some(before) => before,
            None => mode,
        })
    }
}
