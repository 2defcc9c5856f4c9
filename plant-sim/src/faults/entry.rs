//! The faults of the scenario, of the list, and the present one of a target.

use icd::fault::{
    AirframePart, FaultEntry, FaultKind, FaultState, PlantReport, Reach, Refusal, Target, Timing,
};
use icd::{EffectorList, PerEffector, Sensors, SimTime, fault};
use serde::{Deserialize, Serialize};

use super::active::ActiveFault;
use super::times::Plan;
use crate::servos::Servo;

/// A fault of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScheduledFault {
    /// The effector, sensor or part that fails.
    pub target: Target,
    pub kind: FaultKind,
    /// When, how fast, for how long, how often; at once means at the start of the flight.
    pub timing: Timing,
}

impl ScheduledFault {
    /// In words: `rudder, stuck at 7.0 deg`.
    pub fn described(&self, effectors: &EffectorList) -> String {
        let Self { target, kind, .. } = *self;
        format!("{}, {}", target.name(effectors), kind.described(target.class(effectors)))
    }

    /// When it first acts.
    pub fn onset(&self) -> SimTime {
        Plan::new(&self.timing, SimTime::ZERO).onset(0)
    }
}

/// What an aircraft has besides its effectors, in the order of the kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fitted {
    pub sensors: [bool; Sensors::SENSORS],
    /// Parts of the airframe whose loss its file describes.
    pub parts: [bool; AirframePart::ALL.len()],
}

/// Whether this aircraft can have the fault.
pub fn check(
    list: &EffectorList,
    servos: &PerEffector<Servo>,
    has: &Fitted,
    target: Target,
    kind: &FaultKind,
    timing: &Timing,
) -> Result<(), Refusal> {
    check_target(list, has, target)?;
    let reach = match target {
        Target::Effector(effector) => servos[effector].reach(target.class(list)),
        Target::Sensor(sensor) => Reach::of_sensor(sensor),
        Target::Part(_) => Reach::PART,
    };
    fault::check(kind, timing, &reach)
}

/// Whether this aircraft has the target.
pub(super) fn check_target(
    list: &EffectorList,
    has: &Fitted,
    target: Target,
) -> Result<(), Refusal> {
    #[expect(clippy::cast_possible_truncation, reason = "at most 16")]
    let count = list.len() as u8;
    match target {
        Target::Effector(effector) if !list.contains(effector) => {
            Err(Refusal::NoSuchEffector { count })
        }
        Target::Sensor(sensor) if !has.sensors[sensor as usize] => Err(Refusal::NoSuchSensor),
        Target::Part(part) if !has.parts[part as usize] => Err(Refusal::NoSuchPart),
        Target::Effector(_) | Target::Sensor(_) | Target::Part(_) => Ok(()),
    }
}

/// Place of a target in a list of all of them.
pub(super) fn slot(target: impl Into<Target>) -> usize {
    target.into().slot()
}

/// A fault of the list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fault {
    pub id: u32,
    pub target: Target,
    pub kind: FaultKind,
    /// Its onset is a time, never "at once".
    pub timing: Timing,
    pub plan: Plan,
}

/// The present fault of a target.
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
        let Self { id, target, kind, timing, .. } = *self;
        PlantReport::Fault(FaultEntry { id, target, kind, timing, state })
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
