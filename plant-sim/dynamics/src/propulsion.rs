//! Thrust and nozzle angles to force and moment.

use host_io::problem::Problem;
use icd::{Body, Effector, EffectorKind, EffectorList, PerEffector};

use crate::airframe::{Nozzle, NozzleShape};
use crate::rigid_body::Wrench;
use crate::tables::thrust::{Engine, EngineAir, Propulsion};

/// Halvings of the lever's travel: to the last bit.
const LEVER_HALVINGS: u32 = 60;

/// The engine and its nozzle.
#[derive(Debug, Clone)]
pub struct Jet {
    arm_m: f64,
    shape: NozzleShape,
    engine: Option<Effector>,
    /// Pitch and yaw angle of the nozzle.
    nozzle: [Option<Effector>; 2],
    /// Limits of the thrust besides the travel of the engine, and the rotating parts.
    propulsion: Option<Engine>,
    is_limited: bool,
    /// Lever of an engine that is held there, 0 to 1: then the thrust follows the air and not the command.
    lever: Option<f64>,
}

impl Jet {
    pub fn new(
        list: &EffectorList,
        nozzle: Option<&Nozzle>,
        propulsion: Option<&Propulsion>,
    ) -> Result<Self, Problem> {
        let angles = [EffectorKind::NozzlePitch, EffectorKind::NozzleYaw];
        Ok(Self {
            arm_m: nozzle.map_or(0.0, |nozzle| nozzle.arm_m),
            shape: nozzle.map_or_else(NozzleShape::default, |nozzle| nozzle.shape),
            engine: list.only(EffectorKind::Engine),
            nozzle: angles.map(|kind| list.only(kind)),
            propulsion: propulsion.map(Propulsion::build).transpose()?,
            is_limited: true,
            lever: None,
        })
    }

    /// The same with any commanded thrust, for the search of a steady flight.
    pub(crate) fn without_limits(&self) -> Self {
        Self { is_limited: false, lever: None, ..self.clone() }
    }

    /// Holds the lever of the engine at a position from 0 to 1, or lets the engine follow its command again. It has no effect on an
    /// engine without propulsion, which has no lever.
    pub(crate) fn hold_lever(&mut self, lever: Option<f64>) {
        self.lever = lever.filter(|_| self.propulsion.is_some());
    }

    /// Where the lever is held, 0 to 1; `None` if it is not.
    #[inline]
    pub fn lever(&self) -> Option<f64> {
        self.lever
    }

    /// The lever, 0 to 1, at which the engine gives this thrust (N) in this air; `None` without a lever, or out of its reach.
    pub fn lever_at(&self, thrust_n: f64, at: &EngineAir) -> Option<f64> {
        let engine = self.propulsion.as_ref()?;
        let [least, most] = engine.ends(at);
        if !(least..=most).contains(&thrust_n) {
            return None;
        }
        // Halving: the thrust grows with the lever and has edges.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..LEVER_HALVINGS {
            let middle = 0.5 * (low + high);
            if engine.thrust_at(middle, at) < thrust_n { low = middle } else { high = middle }
        }
        // The upper end, whose thrust is not below the wanted one.
        Some(high)
    }

    /// Smallest and largest thrust in this air, N; `None` where only the travel of the engine limits it.
    pub fn thrust_range_n(&self, at: &EngineAir) -> Option<[f64; 2]> {
        self.propulsion.as_ref().map(|propulsion| propulsion.ends(at))
    }

    /// The engine; `None` for a glider.
    pub fn engine(&self) -> Option<Effector> {
        self.engine
    }

    /// Roll moment of the rotating parts on the airframe at this thrust, N m.
    #[inline]
    pub(crate) fn roll_n_m(&self, thrust_n: f64, at: &EngineAir) -> f64 {
        self.propulsion.as_ref().map_or(0.0, |engine| engine.roll_n_m(thrust_n, at))
    }

    /// Limits of the thrust in this air, N.
    pub fn limits(&self, at: &EngineAir) -> [f64; 2] {
        match (&self.propulsion, self.lever) {
            (Some(engine), Some(lever)) => [engine.thrust_at(lever, at); 2],
            (Some(engine), None) if self.is_limited => engine.ends(at),
            _ => [f64::NEG_INFINITY, f64::INFINITY],
        }
    }

    /// Force and moment of the jet about the centre of gravity, and the thrust, N.
    ///
    /// Implements Eq. (4) with exact trigonometry: T_x = T cos δz cos δy, T_y = −T cos δz sin δy, T_z = T sin δz
    /// at the nozzle, `arm_m` behind the centre of gravity.
    /// Implements Eq. (5): l = 0, m = T_z arm, n = −T_y arm.
    /// Positive nozzle angles give positive pitch and yaw; without a nozzle the thrust is along x. `effective` holds
    /// δz and δy in rad and the commanded thrust in N, `limits` the possible thrust.
    #[inline]
    pub fn wrench(
        &self,
        effective: &PerEffector<f64>,
        at: &EngineAir,
        [least, most]: [f64; 2],
    ) -> (Wrench, f64) {
        let of = |effector: Option<Effector>| effector.map_or(0.0, |effector| effective[effector]);
        // Comparisons: a thrust of NaN stays NaN.
        let thrust = of(self.engine);
        let thrust = if thrust < least { least } else { thrust };
        let thrust = if thrust > most { most } else { thrust };
        let roll_n_m = self.roll_n_m(thrust, at);
        // Without a nozzle these are exactly 0 and 1, and the thrust keeps its bits.
        let [(sin_z, cos_z), (sin_y, cos_y)] = self.nozzle.map(|nozzle| libm::sincos(of(nozzle)));
        let (forward, side, down) = match self.shape {
            NozzleShape::Gimbal => {
                (thrust * cos_z * cos_y, -thrust * cos_z * sin_y, thrust * sin_z)
            }
            NozzleShape::Axisymmetric => {
                let (tan_z, tan_y) = (sin_z / cos_z, sin_y / cos_y);
                // Scaled to the length of the thrust: the jet turns without a loss.
                let forward = thrust / (1.0 + tan_z * tan_z + tan_y * tan_y).sqrt();
                (forward, -forward * tan_y, forward * tan_z)
            }
        };
        let wrench = Wrench {
            force: Body::new(forward, side, down),
            moment: Body::new(roll_n_m, down * self.arm_m, -side * self.arm_m),
        };
        (wrench, thrust)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use icd::tvc_jet;

    fn jet(pitch: f64, yaw: f64) -> Wrench {
        jet_of(NozzleShape::Gimbal, pitch, yaw)
    }

    fn jet_of(shape: NozzleShape, pitch: f64, yaw: f64) -> Wrench {
        let mut effective = PerEffector::default();
        effective[tvc_jet::ENGINE] = 27_000.0;
        effective[tvc_jet::NOZZLE_PITCH] = pitch;
        effective[tvc_jet::NOZZLE_YAW] = yaw;
        let nozzle = Nozzle { arm_m: 6.5, thrust_floor_n: 1.0, shape };
        let at = EngineAir { airspeed_m_s: 0.0, density: 0.0, mach: 0.0, altitude_m: 0.0 };
        let jet = Jet::new(&tvc_jet::effectors(), Some(&nozzle), None).unwrap();
        jet.wrench(&effective, &at, jet.limits(&at)).0
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
    fn an_axisymmetric_nozzle_turns_the_thrust_alike_in_pitch_and_yaw() {
        let of = |pitch, yaw| jet_of(NozzleShape::Axisymmetric, pitch, yaw);
        let (both, one) = (of(0.2, -0.2), of(0.2, 0.0));
        assert!((both.force.0.z - both.force.0.y).abs() < 1e-9, "{both:?}");
        assert!((both.force.0.norm() - 27_000.0).abs() < 1e-9);
        assert!((one.force.0.z - jet(0.2, 0.0).force.0.z).abs() < 1e-9, "{one:?}");
    }

    #[test]
    fn the_moment_is_that_of_the_force_at_the_nozzle() {
        let w = jet(0.2, -0.15);
        let arm = nalgebra::Vector3::new(-6.5, 0.0, 0.0);
        assert!((arm.cross(&w.force.0) - w.moment.0).norm() < 1e-9, "{w:?}");
    }
}
