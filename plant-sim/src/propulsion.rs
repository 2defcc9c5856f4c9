//! Thrust and nozzle angles to force and moment.

use icd::{Body, Effector, EffectorKind, EffectorList, PerEffector, angle};

use crate::rigid_body::Wrench;

/// The engine and what turns its jet.
#[derive(Debug, Clone, Copy)]
pub struct Jet {
    arm_m: f64,
    engine: Option<Effector>,
    /// Pitch and yaw angle of the nozzle.
    nozzle: [Option<Effector>; 2],
}

impl Jet {
    /// Of these effectors, with the nozzle `arm_m` behind the centre of gravity.
    #[must_use]
    pub fn new(list: &EffectorList, arm_m: f64) -> Self {
        let nozzle = [EffectorKind::NozzlePitch, EffectorKind::NozzleYaw];
        let nozzle = nozzle.map(|kind| list.only(kind));
        Self { arm_m, engine: list.only(EffectorKind::Engine), nozzle }
    }

    /// The engine; `None` for a glider.
    #[must_use]
    pub fn engine(&self) -> Option<Effector> {
        self.engine
    }

    /// Force and moment of the jet about the centre of gravity.
    ///
    /// Implements Eq. (4) with exact trigonometry: T_x = T cos δz cos δy, T_y = −T cos δz sin δy, T_z = T sin δz
    /// at the nozzle, `arm_m` behind the centre of gravity.
    /// Implements Eq. (5): l = 0, m = T_z arm, n = −T_y arm.
    /// Positive nozzle angles give positive pitch and yaw; without a nozzle the thrust is along x. `effective` holds
    /// δz and δy in rad and the thrust in N.
    #[inline]
    #[must_use]
    pub fn wrench(&self, effective: &PerEffector<f64>) -> Wrench {
        let of = |effector: Option<Effector>| effector.map_or(0.0, |effector| effective[effector]);
        let thrust = of(self.engine);
        let [(sin_z, cos_z), (sin_y, cos_y)] = angle::sincos_pair(self.nozzle.map(of));
        let side = -thrust * cos_z * sin_y;
        let down = thrust * sin_z;
        Wrench {
            force: Body::new(thrust * cos_z * cos_y, side, down),
            moment: Body::new(0.0, down * self.arm_m, -side * self.arm_m),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::tvc_jet;

    fn jet(pitch: f64, yaw: f64) -> Wrench {
        let mut effective = PerEffector::default();
        effective[tvc_jet::ENGINE] = 27_000.0;
        effective[tvc_jet::NOZZLE_PITCH] = pitch;
        effective[tvc_jet::NOZZLE_YAW] = yaw;
        Jet::new(&tvc_jet::effectors(), 6.5).wrench(&effective)
    }

    #[test]
    fn positive_nozzle_pitch_pushes_the_tail_down_and_the_nose_up() {
        let w = jet(0.1, 0.0);
        assert!(w.force.0.z > 0.0 && w.moment.0.y > 0.0, "{w:?}");
        assert_eq!((w.moment.0.x, w.moment.0.z), (0.0, 0.0));
    }

    #[test]
    fn positive_nozzle_yaw_pushes_the_tail_left_and_the_nose_right() {
        let w = jet(0.0, 0.1);
        assert!(w.force.0.y < 0.0 && w.moment.0.z > 0.0, "{w:?}");
        assert_eq!((w.moment.0.x, w.moment.0.y), (0.0, 0.0));
    }

    #[test]
    fn a_straight_jet_has_no_moment_and_turning_it_takes_no_thrust() {
        assert_eq!(jet(0.0, 0.0).moment.0.norm(), 0.0);
        // Rounding of four products.
        assert!((jet(0.2, -0.15).force.0.norm() - 27_000.0).abs() < 1e-10);
    }

    #[test]
    fn the_moment_is_that_of_the_force_at_the_nozzle() {
        let w = jet(0.2, -0.15);
        let arm = nalgebra::Vector3::new(-6.5, 0.0, 0.0);
        assert!((arm.cross(&w.force.0) - w.moment.0).norm() < 1e-9, "{w:?}");
    }
}
