//! The start of a flight without a controller.

use icd::Ned;

use crate::dynamics::Dynamics;
use crate::release::ReleaseSetup;
use crate::setup::SetupError;
use crate::start::Start;
use crate::step_limit;
use crate::trim::{Trim, longitudinal};
use crate::wind::Gust;

/// A body slower than this, m/s, has no aerodynamic motion that the integration would have to follow.
const SLOWEST_CHECKED_M_S: f64 = 1.0;

/// The state in which a flight without a controller begins: steady only if it asks for that.
pub(super) struct Released {
    pub(super) trim: Trim,
    /// True airspeed, m/s.
    pub(super) airspeed_m_s: f64,
}

/// The beginning of a flight without a controller; `dynamics` gets the lever of its engine.
pub(super) fn released(
    dynamics: &mut Dynamics,
    setup: &ReleaseSetup,
    steady: &Ned,
) -> Result<Released, SetupError> {
    let ReleaseSetup { initial, controls, .. } = setup;
    let earth = dynamics.earth();
    let (theta_rad, elevator_rad, controls) = if initial.is_trimmed {
        let trim = longitudinal::solve(dynamics, initial, controls, steady)?;
        (trim.theta_rad, trim.elevator_rad, trim.controls)
    } else {
        (initial.attitude.theta, 0.0, *controls)
    };
    let rigid = initial.rigid(earth, theta_rad);
    let here = earth.geodetic(&rigid.position);
    dynamics.hold_lever(controls.lever);
    let place = dynamics.earth().place(&rigid.position);
    let density = dynamics.density_around(place.geopotential_altitude_m);
    let e = dynamics.evaluate(&rigid, &controls.positions, steady, &Gust::none(), &density);
    let airspeed_m_s = e.motion.air.airspeed_m_s;
    let start = Start {
        altitude_m: place.altitude_m,
        airspeed_m_s,
        heading_rad: initial.attitude.psi,
        latitude_rad: here.latitude_rad,
        longitude_rad: here.longitude_rad,
    };
    if airspeed_m_s >= SLOWEST_CHECKED_M_S {
        step_limit::check(dynamics, &start, e.density, setup.step_us)
            .map_err(|found| SetupError::TooQuick(Box::new(found)))?;
    }
    let mut positions = controls.positions;
    if let Some(engine) = dynamics.jet().engine() {
        // The thrust that a lever gives, so that the log begins with it.
        positions[engine] = e.motion.thrust_n;
    }
    let trim = Trim {
        alpha_rad: e.motion.air.alpha_rad,
        theta_rad,
        elevator_rad,
        aileron_rad: 0.0,
        rudder_rad: 0.0,
        thrust_n: e.motion.thrust_n,
        positions,
        turn_rate_rad_s: 0.0,
        rigid,
    };
    Ok(Released { trim, airspeed_m_s })
}
