//! Whether an effector can have a fault: the ranges of the catalogue with the reach of the effector, and the times.
//!
//! NaN is outside every range. The plant checks a request with its own servos; the autopilot can check it beforehand
//! with those of its model.

use super::{FaultKind, Quantity, Refusal, TargetClass, Timing};
use crate::time::SimTime;

/// Longest ramp, s.
pub const RAMP_MAX_S: f64 = 3_600.0;
/// Shortest duration, s.
const DURATION_MIN_S: f64 = 1.0e-4;
/// Shortest time from onset to onset, s: each repetition sends two reports to the ground stations.
const EVERY_MIN_S: f64 = 0.1;
/// Smallest difference between two times, s.
const MICROSECOND_S: f64 = 1.0e-6;
/// Smallest and largest number of repetitions, if it is limited.
const TIMES: [f64; 2] = [2.0, 1_000.0];

/// Travel and rate of a healthy effector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// Whether its values are angles, rad; those of an engine are thrusts, N.
    pub is_angle: bool,
    /// Lower end of its travel, rad or N.
    pub min: f64,
    /// Upper end of its travel, rad or N.
    pub max: f64,
    /// Largest rate, rad/s or N/s; `None` if unknown, and then the check accepts every rate.
    pub fastest: Option<f64>,
}

/// Checks kind and times of a fault for an effector.
///
/// # Errors
/// [`Refusal`] with the first reason found.
pub fn check(kind: &FaultKind, timing: &Timing, reach: &Reach) -> Result<(), Refusal> {
    of_kind(kind, reach)?;
    check_timing(kind, timing)
}

fn of_kind(kind: &FaultKind, reach: &Reach) -> Result<(), Refusal> {
    let info = kind.info();
    if !info.targets.allow(TargetClass::of(reach.is_angle)) {
        return Err(Refusal::NotForThisEffector);
    }
    let mut numbers = info.numbers.iter().zip(kind.values());
    numbers.try_for_each(|(number, value)| range(number.quantity, value, number.range.of(reach)))
}

/// Checks the times of a fault.
///
/// # Errors
/// [`Refusal::OutOfRange`] for the first time outside its range.
pub fn check_timing(kind: &FaultKind, timing: &Timing) -> Result<(), Refusal> {
    let longest_ramp = if kind.has_size() { RAMP_MAX_S } else { 0.0 };
    range(Quantity::Ramp, timing.ramp_s, [0.0, longest_ramp])?;
    let durations = [DURATION_MIN_S.max(timing.ramp_s), SimTime::MAX_SECONDS];
    if let Some(duration_s) = timing.duration_s {
        range(Quantity::Duration, duration_s, durations)?;
    }
    if let Some(repeat) = timing.repeat {
        // A repetition needs a duration; a missing one counts as zero, which is too short.
        let duration_s = timing.duration_s.unwrap_or(0.0);
        range(Quantity::Duration, duration_s, durations)?;
        let shortest = EVERY_MIN_S.max(duration_s + MICROSECOND_S);
        range(Quantity::Every, repeat.every_s, [shortest, SimTime::MAX_SECONDS])?;
        if let Some(times) = repeat.times {
            range(Quantity::Times, f64::from(times), TIMES)?;
        }
    }
    Ok(())
}

fn range(what: Quantity, value: f64, [min, max]: [f64; 2]) -> Result<(), Refusal> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(Refusal::OutOfRange { what, value, min, max })
    }
}
