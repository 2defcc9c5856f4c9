//! How much of its effectors the compensator still has: the reserve of each axis.

use icd::{EffectorKind, PerEffector};
use serde::{Deserialize, Serialize};

use crate::belief::{Belief, ServoBelief};

/// Remaining authority of each axis, 0 (nothing left) to 100 (the effector is at neutral), percent.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Authority {
    /// Left in δ_a, the aileron pair, percent.
    pub roll_pct: f64,
    /// Left in δ_z, the nozzle's pitch angle, percent.
    pub pitch_pct: f64,
    /// Left in δ_y, the nozzle's yaw angle, percent.
    pub yaw_pct: f64,
}

impl Authority {
    /// Nothing is left on any axis.
    pub const NONE: Self = Self { roll_pct: 0.0, pitch_pct: 0.0, yaw_pct: 0.0 };
}

/// Way that is left to the effectors by which the compensator acts, in the direction in which they stand.
///
/// With δ the total command after limits, steps one and two together, and δ_max the travel of the effector:
///
/// * roll: 100 (1 - |δ_a| / δ_a,max), δ_a + Δδ_a being the command of the ailerons, by the one with most left;
/// * pitch: 100 (1 - |δ_z| / δ_z,max);
/// * yaw: 100 (1 - |δ_y| / δ_y,max).
///
/// The nozzle works by thrust alone. Below T_min, the thrust that Eq. (25) divides by at least, it gives only
/// the part T / T_min of the moment that is counted on; pitch and yaw are multiplied by that. `thrust_n` is the
/// measured T, N.
#[must_use]
pub fn authority(commands: &PerEffector<f64>, thrust_n: f64, belief: &Belief) -> Authority {
    let effectors = &belief.effectors;
    let left = |effector| left(commands[effector], &effectors.servos[effector]);
    let nozzle = |kind| {
        let (Some(nozzle), Some(effector)) = (&belief.nozzle, effectors.list.only(kind)) else {
            return 0.0;
        };
        let floor_n = nozzle.thrust_floor_n;
        // The order makes zero of a thrust that is not a number.
        let effect = if thrust_n >= floor_n { 1.0 } else { (thrust_n / floor_n).max(0.0) };
        effect * left(effector)
    };
    let rolls = effectors.list.all().filter(|effector| effectors.gains[*effector].roll != 0.0);
    Authority {
        roll_pct: rolls.map(left).fold(0.0, f64::max),
        pitch_pct: nozzle(EffectorKind::NozzlePitch),
        yaw_pct: nozzle(EffectorKind::NozzleYaw),
    }
}

fn left(command: f64, servo: &ServoBelief) -> f64 {
    let travel = if command < 0.0 { -servo.min } else { servo.max };
    100.0 * (1.0 - command.abs() / travel).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use icd::tvc_jet;
    use proptest::prelude::*;

    /// The reserve with each compensating effector at this fraction of its travel.
    fn at(fraction: f64, thrust_n: f64) -> [f64; 3] {
        let belief = testing::belief();
        let mut commands = PerEffector::default();
        for effector in [tvc_jet::LEFT_AILERON, tvc_jet::RIGHT_AILERON] {
            commands[effector] = fraction * belief.effectors.servos[effector].max;
        }
        for effector in [tvc_jet::NOZZLE_PITCH, tvc_jet::NOZZLE_YAW] {
            commands[effector] = fraction * belief.effectors.servos[effector].max;
        }
        let Authority { roll_pct, pitch_pct, yaw_pct } = authority(&commands, thrust_n, &belief);
        [roll_pct, pitch_pct, yaw_pct]
    }

    #[test]
    fn all_is_left_at_neutral_half_at_half_the_travel_and_nothing_at_the_limit() {
        assert_eq!(at(0.0, 27_000.0), [100.0; 3]);
        assert_eq!(at(0.5, 27_000.0), [50.0; 3]);
        assert_eq!(at(-0.5, 27_000.0), [50.0; 3], "either way");
        assert_eq!(at(1.0, 27_000.0), [0.0; 3]);
        assert_eq!(at(-1.0, 27_000.0), [0.0; 3]);
    }

    #[test]
    fn below_the_thrust_floor_the_nozzle_has_less_without_thrust_nothing_and_the_ailerons_all() {
        let floor_n = testing::belief().nozzle.unwrap().thrust_floor_n;
        assert_eq!(at(0.0, floor_n), [100.0; 3]);
        assert_eq!(at(0.0, floor_n / 2.0), [100.0, 50.0, 50.0]);
        assert_eq!(at(0.0, 0.0), [100.0, 0.0, 0.0]);
        assert_eq!(at(0.0, -1.0), [100.0, 0.0, 0.0]);
        assert_eq!(at(0.0, f64::NAN), [100.0, 0.0, 0.0]);
    }

    #[test]
    fn elevators_and_rudder_do_not_count() {
        let mut commands = PerEffector::default();
        for effector in [tvc_jet::LEFT_ELEVATOR, tvc_jet::RIGHT_ELEVATOR, tvc_jet::RUDDER] {
            commands[effector] = 0.3;
        }
        let left = authority(&commands, 27_000.0, &testing::belief());
        assert_eq!(left, Authority { roll_pct: 100.0, pitch_pct: 100.0, yaw_pct: 100.0 });
    }

    proptest! {
        #[test]
        fn it_is_always_a_percentage(fraction in -10.0..10.0_f64, thrust_n in -1.0e5..1.0e5_f64) {
            for percent in at(fraction, thrust_n) {
                prop_assert!((0.0..=100.0).contains(&percent), "{percent} %");
            }
        }
    }
}
