//! A fault of the list, and where the one that an effector has stands.

use icd::fault::{FaultEntry, FaultKind, FaultState, PlantReport, Timing};
use icd::{Effector, SimTime};

use super::acting::Acting;
use super::plan::Plan;

/// A fault of the list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fault {
    pub id: u32,
    pub effector: Effector,
    pub kind: FaultKind,
    /// The onset is a time.
    pub timing: Timing,
    pub plan: Plan,
}

/// The fault that an effector has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Present {
    pub fault: Fault,
    /// How often it has acted before.
    pub cycle: u32,
    /// `None` between two repetitions.
    pub acting: Option<Acting>,
}

impl Fault {
    pub fn entry(&self, state: FaultState) -> PlantReport {
        let Self { id, effector, kind, timing, .. } = *self;
        PlantReport::Fault(FaultEntry { id, target: effector.into(), kind, timing, state })
    }

    /// The same order, the onset apart.
    pub fn is_like(&self, kind: &FaultKind, timing: &Timing) -> bool {
        self.kind == *kind && Timing { onset: self.timing.onset, ..*timing } == self.timing
    }
}

impl Present {
    pub fn state(&self) -> FaultState {
        let Self { fault: Fault { plan, .. }, cycle, .. } = *self;
        match &self.acting {
            Some(acting) => FaultState::Acting { since: acting.since() },
            None => {
                let since = plan.end(cycle).unwrap_or_default();
                FaultState::Resting { since, next: plan.onset(cycle + 1) }
            }
        }
    }

    /// Since when it acts, or when it will again.
    pub fn at(&self) -> SimTime {
        match self.state() {
            FaultState::Resting { next, .. } => next,
            state => state.time(),
        }
    }

    /// When it changes from acting to resting, or back, or is over.
    pub fn turn(&self) -> Option<SimTime> {
        let plan = &self.fault.plan;
        if self.acting.is_some() { plan.end(self.cycle) } else { Some(plan.onset(self.cycle + 1)) }
    }
}
