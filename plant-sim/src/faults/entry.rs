//! A fault of the list, and the present fault of an effector with its state.

use icd::fault::{FaultEntry, FaultKind, FaultState, PlantReport, Timing};
use icd::{Effector, SimTime};

use super::active::ActiveFault;
use super::plan::Plan;

/// A fault of the list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fault {
    pub id: u32,
    pub effector: Effector,
    pub kind: FaultKind,
    /// Its onset is a time, never "at once".
    pub timing: Timing,
    pub plan: Plan,
}

/// The present fault of an effector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CurrentFault {
    pub fault: Fault,
    /// Number of the repetition, from 0.
    pub cycle: u32,
    /// `None` during the pause between two repetitions.
    pub active: Option<ActiveFault>,
}

impl Fault {
    pub fn entry(&self, state: FaultState) -> PlantReport {
        let Self { id, effector, kind, timing, .. } = *self;
        PlantReport::Fault(FaultEntry { id, target: effector.into(), kind, timing, state })
    }

    /// Whether the request was the same, apart from the onset.
    pub fn is_like(&self, kind: &FaultKind, timing: &Timing) -> bool {
        self.kind == *kind && Timing { onset: self.timing.onset, ..*timing } == self.timing
    }
}

impl CurrentFault {
    pub fn state(&self) -> FaultState {
        let Self { fault: Fault { plan, .. }, cycle, .. } = *self;
        match &self.active {
            Some(active) => FaultState::Active { since: active.since() },
            None => {
                let since = plan.end(cycle).unwrap_or_default();
                FaultState::Resting { since, next: plan.onset(cycle + 1) }
            }
        }
    }

    /// The time since which it acts, or the next time at which it will.
    pub fn at(&self) -> SimTime {
        match self.state() {
            FaultState::Resting { next, .. } => next,
            state => state.time(),
        }
    }

    /// When it changes between active and pausing, or ends.
    pub fn next_change(&self) -> Option<SimTime> {
        let plan = &self.fault.plan;
        if self.active.is_some() { plan.end(self.cycle) } else { Some(plan.onset(self.cycle + 1)) }
    }
}
