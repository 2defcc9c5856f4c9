//! Steady level flight: the start of every flight.

use icd::{Attitude, Body, EulerAngles, Ned, PerEffector};
use nalgebra::{SMatrix, SVector, Vector3};

use crate::airframe::Airframe;
use crate::atmosphere::LocalDensity;
use crate::dynamics::{Dynamics, State};
use crate::range::{RangeError, check_range};
use crate::rigid_body::RigidState;
use crate::start::Start;
use crate::wind::Gust;

pub mod longitudinal;
mod nearest;

pub use nearest::{AtLimit, Nearest};

/// Newton steps before the search gives up; it needs five.
const STEPS_MAX: u32 = 40;

/// Largest accepted residual, m/s² and rad/s²: a thousand roundings of one g.
const TOLERANCE: f64 = 1.0e-11;

/// Singular values below this count as zero, as for a missing control.
const SINGULAR: f64 = 1.0e-9;

/// Longest Newton step in angle of attack, rad: the bent aerodynamics must not make the search diverge.
const ALPHA_STEP_MAX_RAD: f64 = 0.1;

/// Steady flight at constant altitude: wings level, no sideslip, still nozzle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trim {
    /// Angle of attack, rad.
    pub alpha_rad: f64,
    /// Pitch angle, rad; the angle of attack unless the air rises or sinks.
    pub theta_rad: f64,
    /// Main command to the elevators, rad.
    pub elevator_rad: f64,
    /// Main command to the ailerons, rad. Zero on the flat Earth.
    pub aileron_rad: f64,
    /// Main command to the rudder, rad. Zero on the flat Earth.
    pub rudder_rad: f64,
    /// Thrust, N.
    pub thrust_n: f64,
    /// The effectors in this flight, rad and N.
    pub positions: PerEffector<f64>,
    /// Rate of the heading, rad/s: on a rotating Earth the turn that balances the Coriolis force. Zero on the
    /// flat Earth.
    pub turn_rate_rad_s: f64,
    /// The body in this flight.
    pub rigid: RigidState,
}

impl Trim {
    /// The effectors in this flight, rad and N.
    pub fn positions(&self) -> PerEffector<f64> {
        self.positions
    }

    /// Body and effectors together.
    pub fn state(&self) -> State {
        State { rigid: self.rigid, positions: self.positions() }
    }
}

/// Why there is no steady flight.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrimError {
    /// The aircraft can hold none.
    #[error("no steady level flight found at {airspeed_m_s} m/s and {altitude_m} m: {nearest}")]
    NotConverged {
        /// Requested airspeed, m/s.
        airspeed_m_s: f64,
        /// Requested altitude, m.
        altitude_m: f64,
        nearest: Box<Nearest>,
    },
    /// No pitch angle, elevator and thrust hold a given velocity.
    #[error(
        "no pitch angle, elevator and thrust make the initial state steady: the nearest one still has {along_m_s2:.3e} m/s2 along \
         the track, {down_m_s2:.3e} m/s2 down and {pitch_rad_s2:.3e} rad/s2 in pitch"
    )]
    NoLongitudinal {
        /// Acceleration along the track, m/s².
        along_m_s2: f64,
        /// Acceleration downwards, m/s².
        down_m_s2: f64,
        /// Pitch acceleration, rad/s².
        pitch_rad_s2: f64,
    },
    /// It exists, but an effector cannot hold it.
    #[error(
        "steady level flight at {airspeed_m_s} m/s and {altitude_m} m needs more than the aircraft has: {source}"
    )]
    OutOfReach {
        /// Requested airspeed, m/s.
        airspeed_m_s: f64,
        /// Requested altitude, m.
        altitude_m: f64,
        /// The quantity and its range.
        source: Box<RangeError>,
    },
}

/// In the order of the unknowns: angle of attack, elevator, thrust, aileron, rudder, turn rate.
type Unknowns = SVector<f64, 6>;

/// Inputs of the search besides the aircraft.
struct Problem<'a> {
    dynamics: &'a Dynamics,
    start: &'a Start,
    /// Steady wind without that of the levels, m/s, and with it.
    wind: &'a Ned,
    total_wind: Ned,
    /// Slope of the flight path through the air, rad: against a vertical wind.
    climb_rad: f64,
    density: LocalDensity,
    /// Geopotential altitude, m.
    altitude_m: f64,
}

/// Searches steady level flight at the start, in this steady wind (m/s, where it blows to).
///
/// Airspeed and heading are those of the aircraft in the air; over the ground the wind is added. Newton's
/// method with a numerical Jacobian. On the flat Earth the lateral unknowns come out exactly zero, because
/// mirrored flights have mirrored bits.
pub fn solve(dynamics: &Dynamics, start: &Start, wind: &Ned) -> Result<Trim, TrimError> {
    let earth = dynamics.earth();
    let place = earth.place(&earth.position(&start.geodetic()));
    let altitude_m = place.geopotential_altitude_m;
    let total_wind = dynamics.wind(wind, altitude_m);
    let sine = (total_wind.0.z / start.airspeed_m_s).clamp(-1.0, 1.0);
    let density = dynamics.density_around(altitude_m);
    let (dynamics, climb_rad) = (&dynamics.with_any_thrust(), libm::asin(sine));
    let problem = Problem { dynamics, start, wind, total_wind, climb_rad, density, altitude_m };
    let mut x = Unknowns::zeros();
    x[0] = 0.03;
    if let Some(engine) = dynamics.jet().engine() {
        let engine = &dynamics.airframe().servos[engine];
        x[2] = 0.5 * (engine.min + engine.max);
    }
    let mut residual = problem.residual(&x);
    for _ in 0..STEPS_MAX {
        if residual.amax() < TOLERANCE {
            return problem.held(&x);
        }
        let jacobian = problem.jacobian(&x);
        // An aircraft that lacks a control has a singular Jacobian; then the shortest step is used.
        let shortest = || jacobian.svd(true, true).solve(&residual, SINGULAR).ok();
        let Some(step) = jacobian.lu().solve(&residual).or_else(shortest) else { break };
        let scale = (ALPHA_STEP_MAX_RAD / step[0].abs()).min(1.0);
        x -= step * scale;
        residual = problem.residual(&x);
    }
    let (x, nearest) = problem.nearest();
    if Unknowns::from(nearest.residuals.0).amax() < TOLERANCE {
        return problem.held(&x);
    }
    let Start { airspeed_m_s, altitude_m, .. } = *start;
    Err(TrimError::NotConverged { airspeed_m_s, altitude_m, nearest: Box::new(nearest) })
}

impl Problem<'_> {
    /// The trim, if the aircraft can hold it.
    fn held(&self, x: &Unknowns) -> Result<Trim, TrimError> {
        let trim = self.trim(x);
        let Start { airspeed_m_s, altitude_m, .. } = *self.start;
        let refused =
            |source| TrimError::OutOfReach { airspeed_m_s, altitude_m, source: Box::new(source) };
        self.in_reach(&trim).map_err(refused)?;
        Ok(trim)
    }

    /// Checks that the effectors can reach the positions of the trim.
    fn in_reach(&self, trim: &Trim) -> Result<(), RangeError> {
        let airframe = self.dynamics.airframe();
        let pressure_pa = self.pressure_pa();
        check_reach(airframe, &trim.positions, self.thrust_range_n(), pressure_pa, trim.alpha_rad)
    }

    /// Dynamic pressure, Pa.
    fn pressure_pa(&self) -> f64 {
        0.5 * self.density.at(self.altitude_m) * self.start.airspeed_m_s * self.start.airspeed_m_s
    }

    fn thrust_range_n(&self) -> [f64; 2] {
        let altitude_m = self.altitude_m;
        let density = self.density.at(altitude_m);
        self.dynamics.thrust_range_n(self.start.airspeed_m_s, density, altitude_m)
    }

    fn trim(&self, x: &Unknowns) -> Trim {
        let theta_rad = x[0] + self.climb_rad;
        let (rigid, _) = self.rigid(x[0], x[5]);
        Trim {
            alpha_rad: x[0],
            theta_rad,
            elevator_rad: x[1],
            aileron_rad: x[3],
            rudder_rad: x[4],
            thrust_n: x[2],
            positions: self.dynamics.airframe().follow([x[3], x[1], x[4], x[2]]),
            turn_rate_rad_s: x[5],
            rigid,
        }
    }

    /// The body at this angle of attack and turn rate, and its rates relative to the local NED axes.
    fn rigid(&self, alpha_rad: f64, turn_rate: f64) -> (RigidState, Vector3<f64>) {
        let (start, earth) = (self.start, self.dynamics.earth());
        let here = start.geodetic();
        let attitude = Attitude::from_euler(EulerAngles {
            phi: 0.0,
            theta: alpha_rad + self.climb_rad,
            psi: start.heading_rad,
        });
        let (sin_alpha, cos_alpha) = libm::sincos(alpha_rad);
        let air = Vector3::new(start.airspeed_m_s * cos_alpha, 0.0, start.airspeed_m_s * sin_alpha);
        let wind = attitude.to_body(self.total_wind).0;
        let velocity = Body(air + wind);
        let ground = attitude.to_ned(velocity).0;
        let relative = attitude.to_body(Ned::new(0.0, 0.0, turn_rate)).0;
        let q_e_from_body = earth.q_e_from_body(&here, &attitude);
        let position = earth.position(&here);
        let e_from_ned = earth.place(&position).e_from_ned;
        let frame =
            e_from_ned.tr_mul(&earth.rotation()) + earth.transport_rate(&here, &Ned(ground));
        let rates = Body(attitude.to_body(Ned(frame)).0 + relative);
        (RigidState { position, q_e_from_body, velocity, rates }, relative)
    }

    /// Accelerations that are zero in steady flight: of the air-relative velocity, because a steady wind
    /// is constant in NED and so rotates in body axes; and of the rates.
    fn residual(&self, x: &Unknowns) -> Unknowns {
        let (rigid, relative) = self.rigid(x[0], x[5]);
        let positions = self.trim(x).positions();
        let e = self.dynamics.evaluate(&rigid, &positions, self.wind, &Gust::none(), &self.density);
        let wind_body = e.motion.e_from_body.tr_mul(&(e.place.e_from_ned * self.total_wind.0));
        let linear = e.motion.derivative.velocity.0 + relative.cross(&wind_body);
        let angular = e.motion.derivative.rates.0;
        Unknowns::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    }

    fn jacobian(&self, x: &Unknowns) -> SMatrix<f64, 6, 6> {
        // Large enough to be above rounding, small against the curvature; central differences.
        const STEPS: [f64; 6] = [1.0e-5, 1.0e-5, 1.0, 1.0e-5, 1.0e-5, 1.0e-6];
        let mut jacobian = SMatrix::<f64, 6, 6>::zeros();
        for (i, step) in STEPS.into_iter().enumerate() {
            let (mut above, mut below) = (*x, *x);
            above[i] += step;
            below[i] -= step;
            let slope = (self.residual(&above) - self.residual(&below)) / (2.0 * step);
            jacobian.set_column(i, &slope);
        }
        jacobian
    }
}

/// Checks that effectors and angle of attack (rad) are inside their limits; `thrust_range` is that of the engine, N,
/// and the dynamic pressure (Pa) that of the flight, whose hinge moments may limit the travel.
fn check_reach(
    airframe: &Airframe,
    positions: &PerEffector<f64>,
    thrust_range: [f64; 2],
    pressure_pa: f64,
    alpha_rad: f64,
) -> Result<(), RangeError> {
    let list = &airframe.effectors;
    for effector in list.all() {
        let servo = &airframe.servos[effector];
        let (key, unit, [min, max]) = if list.is_angle(effector) {
            ("deflection_deg", 1.0_f64.to_degrees(), servo.travel_at(pressure_pa))
        } else {
            ("thrust_n", 1.0, thrust_range)
        };
        let value = positions[effector] * unit;
        check_range(list.key(effector), key, value, min * unit, max * unit)?;
    }
    let most = airframe.limits.alpha_rad.to_degrees();
    check_range("limits", "angle_of_attack_deg", alpha_rad.to_degrees(), -most, most)
}

#[cfg(test)]
mod tests;
