//! Baseline for an honest comparison: the same PID with the nozzle ganged to it, and no observer.
//!
//! The paper gives the nozzle to the compensator alone, so part of the compensator's benefit is the
//! nozzle's. This static law shows how much: δz = -(δe - δe_trim), δy = 4 β - 0.4 r.

use crate::belief::Belief;
use crate::estimator::State;

use super::MainCommand;

/// δy per sideslip.
const NOZZLE_YAW_PER_SIDESLIP: f64 = 4.0;
/// δy per yaw rate, s.
const NOZZLE_YAW_PER_YAW_RATE_S: f64 = -0.4;

/// Adds the nozzle to a command; the elevator counts as far as it can go.
pub(super) fn gang(command: &mut MainCommand, state: &State, belief: &Belief) {
    let [min, max] = belief.effectors.command_range(|gains| gains.pitch);
    let elevator = command.elevator_rad.max(min).min(max);
    command.nozzle_pitch_rad = -(elevator - belief.trim.elevator_rad);
    command.nozzle_yaw_rad =
        NOZZLE_YAW_PER_SIDESLIP * state.beta + NOZZLE_YAW_PER_YAW_RATE_S * state.rates.z;
}
