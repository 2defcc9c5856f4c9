//! A catapult: it holds the aircraft on a rail and accelerates it evenly, by forces like those of a contact.

use nalgebra::{Matrix3, Vector3};

use crate::dynamics::{Dynamics, Evaluation};
use crate::ground::CATAPULT_THRUST;
use crate::rigid_body::{HeldForces, RigidState};

/// Errors of place and motion are corrected with this part of the critically damped rate at which one step would, so that no
/// step overshoots.
const CORRECTION: f64 = 0.2;

/// The rail under the aircraft.
#[derive(Debug, Clone)]
pub struct Rail {
    /// Where the aircraft stands, m, frame E, and its attitude there.
    from: Vector3<f64>,
    e_from_body: Matrix3<f64>,
    acceleration_m_s2: f64,
    length_m: f64,
    /// Time since the catapult was released, s.
    moving_s: Option<f64>,
    /// Weight of the aircraft, N.
    weight_n: f64,
}

impl Rail {
    /// From this place along the nose, of an aircraft of this weight, N.
    pub fn new(at: &RigidState, speed_m_s: f64, length_m: f64, weight_n: f64) -> Self {
        Self {
            from: at.position,
            e_from_body: at.e_from_body(),
            acceleration_m_s2: speed_m_s * speed_m_s / (2.0 * length_m),
            length_m,
            moving_s: None,
            weight_n,
        }
    }

    /// What a switch of the launcher says, as a load, N: the weight whatever the wind lifts, as long as the aircraft is held.
    pub fn load_n(&self) -> f64 {
        self.weight_n
    }

    /// The force and the moment of the rail in the step to come; `None` behind its end. `turning` is the rotation over the ground, rad/s.
    pub fn solve(
        &mut self,
        dynamics: &Dynamics,
        rigid: &RigidState,
        turning: &Vector3<f64>,
        e: &Evaluation,
        step_s: f64,
    ) -> Option<HeldForces> {
        let air = &e.motion.air;
        let [_, most_n] =
            dynamics.thrust_range_n(air.airspeed_m_s, e.density, e.place.geopotential_altitude_m);
        if self.moving_s.is_none() && e.motion.thrust_n >= CATAPULT_THRUST * most_n {
            self.moving_s = Some(0.0);
        }
        let (acceleration, time_s) = match &mut self.moving_s {
            None => (0.0, 0.0),
            Some(time_s) => (self.acceleration_m_s2, core::mem::replace(time_s, *time_s + step_s)),
        };
        let moved_m = 0.5 * acceleration * time_s * time_s;
        if moved_m >= self.length_m {
            return None;
        }
        let mass = dynamics.mass();
        let nose = self.e_from_body.column(0).into_owned();
        let free = &e.motion.derivative;
        let to_body = &e.motion.e_from_body;
        let rate = CORRECTION / step_s;
        let late = to_body.tr_mul(&(self.from + nose * moved_m - rigid.position));
        let slow = to_body.tr_mul(&(nose * (acceleration * time_s))) - rigid.velocity.0;
        let wanted =
            to_body.tr_mul(&(nose * acceleration)) + slow * (2.0 * rate) + late * (rate * rate);
        let force = (wanted - free.velocity.0 - turning.cross(&rigid.velocity.0)) / mass.per_mass;
        // The small rotation from the present attitude to that of the rail.
        let turn = to_body.tr_mul(&self.e_from_body);
        let turn =
            Vector3::new(turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12) * 0.5;
        let moment = mass.inertia * (turn * (rate * rate) - turning * (2.0 * rate) - free.rates.0);
        let mut held = HeldForces::default();
        held.add(&Vector3::zeros(), &(to_body * force));
        // A couple of two forces half a metre on either side of the centre of gravity.
        if let Some(axis) = moment.try_normalize(0.0) {
            let aside = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize() * 0.5;
            let pull = to_body * moment.cross(&aside) * 2.0;
            held.add(&aside, &pull);
            held.add(&-aside, &-pull);
        }
        Some(held)
    }
}
