//! Step two b: the command that cancels the estimated fault with ailerons and nozzle.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::design_model::{DesignModel, FlightCondition};

/// u_cf: the redundant commands [Δδa, δz, δy], rad.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Compensation {
    /// Δδa: added to the aileron command.
    pub aileron_rad: f64,
    /// δz: nozzle pitch.
    pub nozzle_pitch_rad: f64,
    /// δy: nozzle yaw.
    pub nozzle_yaw_rad: f64,
}

impl Compensation {
    /// No compensation, to the bit.
    pub const NONE: Self = Self { aileron_rad: 0.0, nozzle_pitch_rad: 0.0, nozzle_yaw_rad: 0.0 };
}

/// Demand that cancels the estimated fault acceleration, before limits.
///
/// Implements Eq. (25): u_cf = -g_c⁻¹ z2, times `fade`. The inverse is written out: the moment that z2
/// means is taken apart into roll (ailerons), pitch and yaw (nozzle), and the nozzle also takes the yaw
/// of the ailerons. While `fade` is zero the result is exactly zero. An aircraft without nozzle has only its
/// ailerons for it.
#[must_use]
pub fn compensate(
    z2: &Vector3<f64>,
    fade: f64,
    model: &DesignModel,
    at: &FlightCondition,
) -> Compensation {
    if fade == 0.0 {
        return Compensation::NONE;
    }
    let mass = &model.belief().mass;
    let roll = mass.ixx_kg_m2 * z2.x - mass.ixz_kg_m2 * z2.z;
    let pitch = mass.iyy_kg_m2 * z2.y;
    let yaw = -mass.ixz_kg_m2 * z2.x + mass.izz_kg_m2 * z2.z;

    let (c_roll, c_yaw) = model.aileron_pair();
    let aileron_rad = -fade * roll / (at.q_s_b * c_roll);
    let Some(nozzle) = &model.belief().nozzle else {
        return Compensation { aileron_rad, ..Compensation::NONE };
    };
    let t_x_t = at.t_x_t.max(nozzle.thrust_floor_n * nozzle.arm_m);
    Compensation {
        aileron_rad,
        nozzle_pitch_rad: -fade * pitch / t_x_t,
        nozzle_yaw_rad: -(fade * yaw + at.q_s_b * c_yaw * aileron_rad) / t_x_t,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use proptest::prelude::*;

    fn setup() -> (DesignModel, FlightCondition) {
        let model = DesignModel::new(testing::belief());
        let at = model.condition(&testing::level_state());
        (model, at)
    }

    proptest! {
        #[test]
        fn the_demand_cancels_the_estimate_through_g_c(p in -5.0..5.0, q in -1.0..1.0, r in -1.0..1.0) {
            let (model, at) = setup();
            let z2 = Vector3::new(p, q, r);
            let u = compensate(&z2, 1.0, &model, &at);
            // See Eq. (19): g_c u_cf = -F.
            let effect = model.redundant_effectiveness(&at)
                * Vector3::new(u.aileron_rad, u.nozzle_pitch_rad, u.nozzle_yaw_rad);
            prop_assert!((effect + z2).norm() < 1.0e-12 * (1.0 + z2.norm()));
        }
    }

    #[test]
    fn asleep_means_exactly_zero() {
        let (model, at) = setup();
        assert_eq!(compensate(&Vector3::new(1.0, 2.0, 3.0), 0.0, &model, &at), Compensation::NONE);
    }

    #[test]
    fn the_demand_stays_finite_without_thrust() {
        let (model, at) = setup();
        let at = FlightCondition { t_x_t: 0.0, ..at };
        let u = compensate(&Vector3::new(1.0, 1.0, 1.0), 1.0, &model, &at);
        assert!(u.nozzle_pitch_rad.is_finite() && u.nozzle_yaw_rad.is_finite());
    }

    #[test]
    fn a_roll_to_the_right_is_met_by_positive_aileron() {
        let (model, at) = setup();
        assert!(compensate(&Vector3::new(1.0, 0.0, 0.0), 1.0, &model, &at).aileron_rad > 0.0);
    }
}
