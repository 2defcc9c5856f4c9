//! The faults that the plant has told of and that are not over.

use icd::fault::FaultEntry;

use crate::event::EventKind;

/// Faults that are remembered; the oldest makes room. More than the plant's own list has.
const FAULTS_MAX: usize = 256;

/// A mirror of the plant's list.
#[derive(Debug, Default)]
pub(super) struct Faults {
    entries: Vec<FaultEntry>,
}

impl Faults {
    /// Takes what happened.
    pub(super) fn handle_event(&mut self, kind: &EventKind) {
        match kind {
            EventKind::FlightBegan { .. } => self.entries.clear(),
            EventKind::Fault(entry) => {
                self.entries.retain(|known| known.id != entry.id);
                if entry.state.is_over() {
                    return;
                }
                if self.entries.len() >= FAULTS_MAX {
                    self.entries.remove(0);
                }
                self.entries.push(*entry);
                self.entries.sort_by_key(|entry| entry.id);
            }
            _ => {}
        }
    }

    /// In the order in which they were put on the list.
    pub(super) fn iter(&self) -> impl Iterator<Item = &FaultEntry> {
        self.entries.iter()
    }
}
