//! Level flight that goes on by itself: where every flight starts.

use core::fmt;

use icd::{Attitude, Body, EulerAngles, Ned, PerEffector};
use nalgebra::{SMatrix, SVector, Vector3};

use crate::atmosphere::LocalDensity;
use crate::config::{RangeError, check_range};
use crate::dynamics::{Dynamics, State};
use crate::geodesy;
use crate::rigid_body::RigidState;
use crate::setup::Start;
use crate::wind::Gust;

/// Newton steps before the search is given up; it needs five.
const STEPS_MAX: u32 = 40;

/// Largest accepted residual, m/s² and rad/s²: a thousand roundings of one g.
const TOLERANCE: f64 = 1.0e-11;

/// Singular values below this are none, as a control that is not there.
const SINGULAR: f64 = 1.0e-9;

/// Longest Newton step in angle of attack, rad: the bent aerodynamics must not throw the search away.
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
    #[must_use]
    pub fn positions(&self) -> PerEffector<f64> {
        self.positions
    }

    /// Body and effectors together.
    #[must_use]
    pub fn state(&self) -> State {
        State { rigid: self.rigid, positions: self.positions() }
    }
}

/// Why there is no steady flight.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TrimError {
    /// The search did not end; the accelerations that are left over.
    #[error("no steady level flight found at {airspeed_m_s} m/s and {altitude_m} m: {residuals}")]
    NotConverged {
        /// Airspeed asked for, m/s.
        airspeed_m_s: f64,
        /// Altitude asked for, m.
        altitude_m: f64,
        /// What is left over.
        residuals: Residuals,
    },
    /// It was found, but an effector cannot hold it.
    #[error("steady level flight needs more than the aircraft has: {0}")]
    OutOfReach(#[from] RangeError),
}

/// Accelerations that should be zero: u', v', w' in m/s² and p', q', r' in rad/s².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residuals(pub [f64; 6]);

impl fmt::Display for Residuals {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = ["u'", "v'", "w'", "p'", "q'", "r'"];
        let units = ["m/s2", "m/s2", "m/s2", "rad/s2", "rad/s2", "rad/s2"];
        for (i, ((value, name), unit)) in self.0.iter().zip(names).zip(units).enumerate() {
            write!(f, "{}{name} = {value:.3e} {unit}", if i == 0 { "" } else { ", " })?;
        }
        Ok(())
    }
}

/// In the order of the unknowns: angle of attack, elevator, thrust, aileron, rudder, turn rate.
type Unknowns = SVector<f64, 6>;

/// What the search needs to know beside the aircraft.
struct Problem<'a> {
    dynamics: &'a Dynamics,
    start: &'a Start,
    wind: &'a Ned,
    /// Slope of the flight path through the air, rad: against a vertical wind.
    climb_rad: f64,
    density: LocalDensity,
}

/// Searches steady level flight at the start, in this steady wind (m/s, where it blows to).
///
/// Airspeed and heading are those of the aircraft in the air; over the ground the wind is added. Newton's
/// method with a numerical Jacobian. On the flat Earth the lateral unknowns come out exactly zero, because
/// mirrored flights have mirrored bits.
///
/// # Errors
/// [`TrimError`] if there is none, or the aircraft cannot hold it.
pub fn solve(dynamics: &Dynamics, start: &Start, wind: &Ned) -> Result<Trim, TrimError> {
    let sine = (wind.0.z / start.airspeed_m_s).clamp(-1.0, 1.0);
    let earth = dynamics.earth();
    let place = earth.place(&earth.position(&start.geodetic()));
    let density = LocalDensity::around(place.geopotential_altitude_m);
    let problem = Problem { dynamics, start, wind, climb_rad: libm::asin(sine), density };
    let mut x = Unknowns::zeros();
    x[0] = 0.03;
    if let Some(engine) = dynamics.jet().engine() {
        let engine = &dynamics.airframe().servos[engine];
        x[2] = 0.5 * (engine.min + engine.max);
    }
    let mut residual = problem.residual(&x);
    for _ in 0..STEPS_MAX {
        if residual.amax() < TOLERANCE {
            let trim = problem.trim(&x);
            in_reach(dynamics, &trim)?;
            return Ok(trim);
        }
        let jacobian = problem.jacobian(&x);
        // An aircraft that lacks a control has a singular one; then the shortest step serves.
        let shortest = || jacobian.svd(true, true).solve(&residual, SINGULAR).ok();
        let Some(step) = jacobian.lu().solve(&residual).or_else(shortest) else { break };
        let scale = (ALPHA_STEP_MAX_RAD / step[0].abs()).min(1.0);
        x -= step * scale;
        residual = problem.residual(&x);
    }
    Err(TrimError::NotConverged {
        airspeed_m_s: start.airspeed_m_s,
        altitude_m: start.altitude_m,
        residuals: Residuals(residual.into()),
    })
}

fn in_reach(dynamics: &Dynamics, trim: &Trim) -> Result<(), RangeError> {
    let positions = trim.positions();
    let airframe = dynamics.airframe();
    let list = &airframe.effectors;
    for effector in list.all() {
        let servo = &airframe.servos[effector];
        let (key, unit) = if list.is_angle(effector) {
            ("deflection_deg", 1.0_f64.to_degrees())
        } else {
            ("thrust_n", 1.0)
        };
        let value = positions[effector] * unit;
        check_range(list.key(effector), key, value, servo.min * unit, servo.max * unit)?;
    }
    Ok(())
}

impl Problem<'_> {
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
        let wind = attitude.to_body(*self.wind).0;
        let velocity = Body(air + wind);
        let ground = attitude.to_ned(velocity).0;
        let relative = attitude.to_body(Ned::new(0.0, 0.0, turn_rate)).0;
        let q_e_from_body = earth.q_e_from_body(&here, &attitude);
        let position = earth.position(&here);
        let e_from_ned = earth.place(&position).e_from_ned;
        let frame = e_from_ned.tr_mul(&earth.rotation()) + self.transport_rate(&ground);
        let rates = Body(attitude.to_body(Ned(frame)).0 + relative);
        (RigidState { position, q_e_from_body, velocity, rates }, relative)
    }

    /// Rate at which the local NED axes turn over a round Earth because the aircraft moves, rad/s, NED.
    fn transport_rate(&self, ground: &Vector3<f64>) -> Vector3<f64> {
        if self.dynamics.earth().model() == crate::earth::EarthModel::Flat {
            return Vector3::zeros();
        }
        let (sin, cos) = libm::sincos(self.start.latitude_rad);
        let radii = geodesy::radii(sin);
        let east = ground.y / (radii.prime_vertical_m + self.start.altitude_m);
        let north = ground.x / (radii.meridian_m + self.start.altitude_m);
        Vector3::new(east, -north, -east * sin / cos)
    }

    /// Accelerations that are zero in steady flight: of the air-relative velocity, because a steady wind
    /// stands still in NED and so turns in body axes; and of the rates.
    fn residual(&self, x: &Unknowns) -> Unknowns {
        let (rigid, relative) = self.rigid(x[0], x[5]);
        let positions = self.trim(x).positions();
        let e = self.dynamics.evaluate(&rigid, &positions, self.wind, &Gust::none(), &self.density);
        let wind_body = e.motion.e_from_body.tr_mul(&(e.place.e_from_ned * self.wind.0));
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::earth::{Earth, EarthModel};
    use crate::{Airframe, WindSettings, wind};

    const START: Start = Start {
        altitude_m: 5_000.0,
        airspeed_m_s: 264.0,
        heading_rad: 0.0,
        latitude_rad: 0.8,
        longitude_rad: 0.1,
    };

    fn trimmed(model: EarthModel, start: Start, wind: WindSettings) -> (Dynamics, Trim) {
        let earth = Earth::new(model, start.geodetic());
        let dynamics = Dynamics::new(Airframe::paper(), earth).unwrap();
        let trim = solve(&dynamics, &start, &wind::steady(&wind)).unwrap();
        (dynamics, trim)
    }

    fn crosswind() -> WindSettings {
        WindSettings { speed_m_s: 20.0, towards_rad: 1.2, ..WindSettings::CALM }
    }

    #[test]
    fn val_the_design_point_is_that_of_the_parameter_set() {
        let (_, trim) = trimmed(EarthModel::Flat, START, WindSettings::CALM);
        // Printed as 1.997 deg and 27.12 kN.
        assert!((trim.alpha_rad.to_degrees() - 1.997).abs() < 5e-4, "{} rad", trim.alpha_rad);
        assert!((trim.thrust_n - 27_120.0).abs() < 5.0, "{} N", trim.thrust_n);
        // Cm0 was calibrated with a gas constant that differs in the seventh digit.
        assert!(trim.elevator_rad.abs() < 1e-6, "{} rad", trim.elevator_rad);
        assert_eq!(trim.theta_rad, trim.alpha_rad);
    }

    #[test]
    fn on_the_flat_earth_the_lateral_trim_is_exactly_zero() {
        for (heading_rad, wind) in
            [(0.0, WindSettings::CALM), (0.0, crosswind()), (2.0, crosswind())]
        {
            let (_, trim) = trimmed(EarthModel::Flat, Start { heading_rad, ..START }, wind);
            let lateral = [trim.aileron_rad, trim.rudder_rad, trim.turn_rate_rad_s];
            if heading_rad == 0.0 {
                assert_eq!(lateral, [0.0; 3], "wind {wind:?}");
            }
            // At other headings the mirror is turned, and rounding shows.
            assert!(lateral.iter().all(|x| x.abs() < 1e-12), "{lateral:?} at {heading_rad} rad");
        }
    }

    #[test]
    fn on_the_rotating_earth_a_slow_turn_balances_the_coriolis_force() {
        let (_, trim) = trimmed(EarthModel::Wgs84, START, WindSettings::CALM);
        // Northbound, Coriolis pushes right with 2 W V sin(lat): a turn to the right with 2 W sin(lat).
        let expected = 2.0 * crate::earth::ROTATION_RAD_S * libm::sin(START.latitude_rad);
        let turn = trim.turn_rate_rad_s;
        // The rudder that holds the turn and the yaw damping push sideways a little.
        assert!((turn / expected - 1.0).abs() < 0.01, "{turn} instead of {expected} rad/s");
        assert!(trim.aileron_rad.abs() < 1e-3 && trim.rudder_rad.abs() < 1e-3, "{trim:?}");
    }

    #[test]
    fn trim_flies_level_at_the_airspeed_in_any_steady_wind() {
        for model in [EarthModel::Flat, EarthModel::Wgs84] {
            let updraught = WindSettings { down_m_s: -3.0, ..crosswind() };
            for wind in [WindSettings::CALM, crosswind(), updraught] {
                let (dynamics, trim) = trimmed(model, START, wind);
                let state = trim.state();
                let air = wind::steady(&wind);
                let density = LocalDensity::around(5_000.0);
                let (rigid, gust) = (&state.rigid, Gust::none());
                let e = dynamics.evaluate(rigid, &state.positions, &air, &gust, &density);
                let ground = e.place.e_from_ned.tr_mul(&e.motion.derivative.position);
                // On WGS-84 the vertical of the position comes from Bowring's formula, good to 1e-12 rad.
                assert!(ground.z.abs() < 1e-9, "{model:?} sinks with {} m/s", ground.z);
                assert!((e.motion.air.airspeed_m_s - 264.0).abs() < 1e-11);
                assert!(
                    e.motion.air.beta_rad.abs() < 1e-13,
                    "sideslip {} rad",
                    e.motion.air.beta_rad
                );
                assert!(e.motion.derivative.rates.0.norm() < 1e-10);
            }
        }
    }

    #[test]
    fn too_slow_a_flight_is_refused_with_what_is_missing() {
        let start = Start { airspeed_m_s: 60.0, ..START };
        let earth = Earth::new(EarthModel::Flat, start.geodetic());
        let dynamics = Dynamics::new(Airframe::paper(), earth).unwrap();
        let error = solve(&dynamics, &start, &Ned::zero()).unwrap_err().to_string();
        assert!(error.contains("level flight"), "{error}");
        assert!(error.contains("w' = ") || error.contains("is outside"), "{error}");
    }
}
