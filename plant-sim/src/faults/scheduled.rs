//! A fault of the scenario, and whether an aircraft can have it.

use icd::fault::{FaultKind, Refusal, Timing};
use icd::{Effector, EffectorList, PerEffector, SimTime, fault};
use serde::{Deserialize, Serialize};

use super::plan::Plan;
use crate::servos::Servo;

/// A fault of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScheduledFault {
    /// Which effector.
    pub effector: Effector,
    /// How it fails.
    pub kind: FaultKind,
    /// When, how fast, for how long, how often; at once means at the start of the flight.
    pub timing: Timing,
}

impl ScheduledFault {
    /// In words: `rudder, stuck at 7.0 deg`.
    #[must_use]
    pub fn described(&self, effectors: &EffectorList) -> String {
        let Self { effector, kind, .. } = *self;
        let name = effectors.name(effector);
        format!("{name}, {}", kind.described(effectors.is_angle(effector)))
    }

    /// When it acts first.
    #[must_use]
    pub fn onset(&self) -> SimTime {
        Plan::new(&self.timing, SimTime::ZERO).onset(0)
    }
}

/// Checks that an aircraft can have a fault.
///
/// # Errors
/// [`Refusal`] with the first reason found.
pub fn check(
    list: &EffectorList,
    servos: &PerEffector<Servo>,
    effector: Effector,
    kind: &FaultKind,
    timing: &Timing,
) -> Result<(), Refusal> {
    if !list.contains(effector) {
        #[expect(clippy::cast_possible_truncation, reason = "at most 16")]
        return Err(Refusal::NoSuchEffector { count: list.len() as u8 });
    }
    fault::check(kind, timing, &servos[effector].reach(list.is_angle(effector)))
}
