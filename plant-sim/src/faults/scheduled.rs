//! A fault of the scenario, and whether an aircraft can have it.

use icd::fault::{FaultKind, Refusal, Target, Timing};
use icd::{Effector, EffectorList, PerEffector, SimTime, fault};
use serde::{Deserialize, Serialize};

use super::plan::Plan;
use crate::servos::Servo;

/// A fault of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScheduledFault {
    /// The effector that fails.
    #[serde(alias = "effector")]
    pub target: Target,
    /// How it fails.
    pub kind: FaultKind,
    /// When, how fast, for how long, how often; at once means at the start of the flight.
    pub timing: Timing,
}

impl ScheduledFault {
    /// In words: `rudder, stuck at 7.0 deg`.
    #[must_use]
    pub fn described(&self, effectors: &EffectorList) -> String {
        let Self { target, kind, .. } = *self;
        format!("{}, {}", target.name(effectors), kind.described(target.class(effectors)))
    }

    /// When it first acts.
    #[must_use]
    pub fn onset(&self) -> SimTime {
        Plan::new(&self.timing, SimTime::ZERO).onset(0)
    }
}

/// The effector of a fault, if this aircraft can have the fault.
///
/// # Errors
/// [`Refusal`] with the first reason found.
pub fn check(
    list: &EffectorList,
    servos: &PerEffector<Servo>,
    target: Target,
    kind: &FaultKind,
    timing: &Timing,
) -> Result<Effector, Refusal> {
    let effector = effector_of(list, target)?;
    fault::check(kind, timing, &servos[effector].reach(list.is_angle(effector)))?;
    Ok(effector)
}

/// The effector that a target names.
///
/// # Errors
/// [`Refusal`] if the aircraft does not have it, or if the target is a sensor: sensors cannot fail yet.
pub(super) fn effector_of(list: &EffectorList, target: Target) -> Result<Effector, Refusal> {
    let effector = target.effector().ok_or(Refusal::NoSensorFaults)?;
    #[expect(clippy::cast_possible_truncation, reason = "at most 16")]
    let count = list.len() as u8;
    if list.contains(effector) { Ok(effector) } else { Err(Refusal::NoSuchEffector { count }) }
}
