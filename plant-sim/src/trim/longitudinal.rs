//! Trim of an initial state: pitch angle, elevator and thrust for a given velocity, roll and yaw.

use host_io::problem::{Problem, problem};
use icd::{Body, Ned, PerEffector};
use nalgebra::Vector3;

use super::{STEPS_MAX, TOLERANCE, check_reach, jacobian, out_of_reach};
use crate::atmosphere::LocalDensity;
use crate::dynamics::{Dynamics, Evaluation};
use crate::release::{Controls, InitialState};
use crate::wind::Gust;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LongitudinalTrim {
    /// Pitch angle, rad.
    pub theta_rad: f64,
    /// Main command to the elevators, rad.
    pub elevator_rad: f64,
    /// The controls, with those that were given.
    pub controls: Controls,
}

struct LongitudinalSearch<'a> {
    dynamics: &'a Dynamics,
    initial: &'a InitialState,
    given: &'a Controls,
    wind: &'a Ned,
    density: LocalDensity,
}

/// Searches the pitch angle, the elevator and the thrust with which the acceleration along the track, the one downwards and the
/// pitch acceleration are zero. Roll, yaw, velocity in NED and rates are those of `initial`; `given` holds the other controls.
///
/// Definition of the NESC check cases (NASA/TM-2015-218675): the accelerations are those of the velocity in local NED axes, and on a
/// rotating Earth the one across the track, and those in roll and yaw, are left as they are.
pub fn solve(
    dynamics: &Dynamics,
    initial: &InitialState,
    given: &Controls,
    wind: &Ned,
) -> Result<LongitudinalTrim, Problem> {
    let free = dynamics.with_any_thrust();
    let place = dynamics.earth().place(&initial.place(dynamics.earth()));
    let density = dynamics.density_around(place.geopotential_altitude_m);
    let search = LongitudinalSearch { dynamics: &free, initial, given, wind, density };
    let thrust_n = dynamics.jet().engine().map_or(0.0, |engine| {
        let servo = &dynamics.airframe().servos[engine];
        0.5 * (servo.min + servo.max)
    });
    let mut x = Vector3::new(0.03, 0.0, thrust_n);
    let (mut residual, mut present) = search.residual(&x);
    for _ in 0..STEPS_MAX {
        if residual.amax() < TOLERANCE {
            return search.held(dynamics, &x, &present);
        }
        let jacobian = jacobian(&x, [1.0e-5, 1.0e-5, 1.0], |x| search.residual(x).0);
        let Some(step) = jacobian.lu().solve(&residual) else { break };
        x -= step * (super::ALPHA_STEP_MAX_RAD / step.x.abs()).min(1.0);
        (residual, present) = search.residual(&x);
    }
    Err(problem!(
        "no pitch angle, elevator and thrust make the initial state steady: the nearest one still has {:.3e} m/s2 along \
         the track, {:.3e} m/s2 down and {:.3e} rad/s2 in pitch",
        residual.x,
        residual.y,
        residual.z
    ))
}

impl LongitudinalSearch<'_> {
    fn controls(&self, x: &Vector3<f64>) -> Controls {
        let followed = self.dynamics.airframe().follow([0.0, x.y, 0.0, x.z]);
        let positions = PerEffector::from_fn(|e| self.given.positions[e] + followed[e]);
        Controls { positions, lever: None }
    }

    fn residual(&self, x: &Vector3<f64>) -> (Vector3<f64>, Evaluation) {
        let rigid = self.initial.rigid(self.dynamics.earth(), x.x);
        let positions = self.controls(x).positions;
        let e = self.dynamics.evaluate(&rigid, &positions, self.wind, &Gust::none(), &self.density);
        let ned = |body: &Body| e.place.e_from_ned.tr_mul(&(e.motion.e_from_body * body.0));
        let velocity = ned(&rigid.velocity);
        let earth = self.dynamics.earth();
        let transport = earth.transport_rate(&earth.geodetic(&rigid.position), &Ned(velocity));
        let frame = earth.rotation() + e.place.e_from_ned * transport;
        // Rates of the body relative to the local NED axes.
        let turning = rigid.rates.0 - e.motion.e_from_body.tr_mul(&frame);
        let acceleration =
            ned(&Body(e.motion.derivative.velocity.0 + turning.cross(&rigid.velocity.0)));
        let track = Vector3::new(velocity.x, velocity.y, 0.0);
        let along = match track.norm() {
            speed if speed > 0.0 => acceleration.dot(&track) / speed,
            _ => acceleration.x,
        };
        (Vector3::new(along, acceleration.z, e.motion.derivative.rates.0.y), e)
    }

    /// The trim, if the aircraft (`dynamics`, with the limits of its thrust) can hold it.
    fn held(
        &self,
        dynamics: &Dynamics,
        x: &Vector3<f64>,
        present: &Evaluation,
    ) -> Result<LongitudinalTrim, Problem> {
        let mut controls = self.controls(x);
        let airspeed_m_s = present.motion.air.airspeed_m_s;
        let altitude_m = present.place.geopotential_altitude_m;
        let thrust_range = dynamics.thrust_range_n(airspeed_m_s, present.density, altitude_m);
        check_reach(
            dynamics.airframe(),
            &controls.positions,
            thrust_range,
            0.5 * present.density * airspeed_m_s * airspeed_m_s,
            present.motion.air.alpha_rad,
        )
        .map_err(|source| out_of_reach(airspeed_m_s, present.place.altitude_m, &source))?;
        let air = dynamics.engine_air(airspeed_m_s, present.density, altitude_m);
        controls.lever = dynamics.jet().lever_at(x.z, &air);
        Ok(LongitudinalTrim { theta_rad: x.x, elevator_rad: x.y, controls })
    }
}
