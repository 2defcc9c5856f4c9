//! The faults of the aircraft as the plant reports them: active, pausing or scheduled.
//!
//! The plant has the list; this is its mirror, built from [`EventKind::Fault`]. It is empty when a flight begins.

use icd::fault::{FaultEntry, FaultState, Target};

use crate::event::EventKind;

/// Faults that the list can hold: all that the plant schedules, and an active one on each target.
const FAULTS_MAX: usize = 64 + Target::MAX;

/// The list, by the number of the fault.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaultList {
    entries: Vec<FaultEntry>,
    /// From before a silence of the plant or a loss of events, and not confirmed since.
    doubtful: Vec<FaultEntry>,
}

impl FaultList {
    /// Applies a report; false if the plant only repeats a known state.
    pub fn handle_event(&mut self, kind: &EventKind) -> bool {
        match kind {
            EventKind::FlightBegan { .. } => *self = Self::default(),
            // All faults are unconfirmed until the plant has reported them again.
            EventKind::PlantBack | EventKind::EventsLost(_) => {
                self.doubtful.append(&mut self.entries);
                // A link that comes and goes must not let the list grow.
                self.doubtful.drain(..self.doubtful.len().saturating_sub(FAULTS_MAX));
            }
            EventKind::Fault(entry) => return self.take(entry),
            _ => {}
        }
        true
    }

    fn take(&mut self, entry: &FaultEntry) -> bool {
        let was_known = self.doubtful.extract_if(.., |known| known.id == entry.id).last();
        let place = self.entries.iter().position(|known| known.id >= entry.id);
        let place = place.unwrap_or(self.entries.len());
        let is_full = self.entries.len() >= FAULTS_MAX;
        let known = self.entries.get_mut(place).filter(|known| known.id == entry.id);
        let before = known.as_deref().copied().or(was_known);
        match (known, entry.state.is_over()) {
            (Some(_), true) => drop(self.entries.remove(place)),
            (Some(known), false) => *known = *entry,
            // The plant has no more than fit.
            (None, false) if is_full => {}
            (None, false) => self.entries.insert(place, *entry),
            (None, true) => {}
        }
        before != Some(*entry)
    }

    /// The active, pausing and scheduled faults, oldest first.
    pub fn entries(&self) -> &[FaultEntry] {
        &self.entries
    }

    /// The fault that is active on a target now.
    pub fn acting(&self, target: impl Into<Target>) -> Option<&FaultEntry> {
        let target = target.into();
        self.entries.iter().find(|entry| {
            entry.target == target && matches!(entry.state, FaultState::Active { .. })
        })
    }

    /// The first of its faults: the active one, else the one with the next onset.
    pub fn foremost(&self, target: impl Into<Target>) -> Option<&FaultEntry> {
        let target = target.into();
        let its = self.entries.iter().filter(|entry| entry.target == target);
        // `false` is less than `true`: what acts comes before what is due.
        its.min_by_key(|entry| match entry.state.next_onset() {
            Some(next) => (true, next),
            None => (false, entry.state.time()),
        })
    }

    /// Whether the target has an active, pausing or scheduled fault.
    pub fn names(&self, target: impl Into<Target>) -> bool {
        self.foremost(target).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::SimTime;
    use icd::fault::{FaultKind, Timing};
    use icd::tvc_jet;

    fn entry(id: u32, state: FaultState) -> EventKind {
        EventKind::Fault(FaultEntry {
            id,
            target: tvc_jet::RUDDER.into(),
            kind: FaultKind::StuckHere,
            timing: Timing::at(SimTime::from_micros(1_000_000)),
            state,
        })
    }

    fn at(seconds: u64) -> SimTime {
        SimTime::from_micros(seconds * 1_000_000)
    }

    #[test]
    fn the_list_follows_the_reports_and_begins_empty_with_each_flight() {
        let mut list = FaultList::default();
        assert!(list.handle_event(&entry(2, FaultState::Scheduled { at: at(5) })));
        assert!(list.handle_event(&entry(1, FaultState::Active { since: at(1) })));
        assert_eq!(list.entries().iter().map(|entry| entry.id).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(list.acting(tvc_jet::RUDDER).map(|entry| entry.id), Some(1));
        list.handle_event(&entry(1, FaultState::Ended { at: at(5) }));
        assert_eq!(list.acting(tvc_jet::RUDDER), None);
        list.handle_event(&entry(2, FaultState::Active { since: at(5) }));
        assert_eq!(list.acting(tvc_jet::RUDDER).map(|entry| entry.id), Some(2));
        let resting = FaultState::Resting { since: at(6), next: at(9) };
        list.handle_event(&entry(2, resting));
        assert_eq!((list.acting(tvc_jet::RUDDER), list.entries().len()), (None, 1));
        list.handle_event(&EventKind::FlightBegan { joined_in_flight: false });
        assert!(list.entries().is_empty());
    }

    #[test]
    fn a_repeated_report_of_the_plant_is_no_event_even_after_a_silence() {
        let mut list = FaultList::default();
        let acting = entry(1, FaultState::Active { since: at(1) });
        assert!(list.handle_event(&acting));
        assert!(!list.handle_event(&acting));
        list.handle_event(&entry(2, FaultState::Scheduled { at: at(5) }));
        list.handle_event(&EventKind::PlantBack);
        assert!(list.entries().is_empty(), "not confirmed");
        assert!(!list.handle_event(&acting));
        assert!(list.handle_event(&entry(2, FaultState::Active { since: at(5) })));
        assert_eq!(list.entries().len(), 2);
    }

    #[test]
    fn a_plant_that_reports_too_much_fills_the_list_and_no_more() {
        let mut list = FaultList::default();
        for id in 1..1_000 {
            list.handle_event(&entry(id, FaultState::Scheduled { at: at(5) }));
        }
        assert_eq!(list.entries().len(), FAULTS_MAX);
    }
}
