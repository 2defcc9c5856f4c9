//! The reference belief and level flight at the design point, for the tests of this crate.

use icd::{Attitude, Body, EulerAngles, Ned, Sensors};

use crate::belief::Belief;
use crate::estimator::{Estimator, State};
use crate::main_controller::Demand;

/// The shipped belief.
pub fn belief() -> Belief {
    toml::from_str(include_str!("../../models/tvc_jet.toml")).unwrap()
}

/// Level flight at 264 m/s and 5000 m.
pub fn level_flight() -> Sensors {
    let trim = belief().trim;
    let euler = EulerAngles { phi: 0.0, theta: trim.theta_rad, psi: 0.0 };
    Sensors {
        body_rates: Body::zero(),
        specific_force: Body::new(0.0, 0.0, -9.8),
        attitude: Attitude::from_euler(euler),
        velocity: Ned::new(264.0, 0.0, 0.0),
        position: Ned::new(0.0, 0.0, -5_000.0),
        latitude_rad: 0.609,
        longitude_rad: -2.058,
        altitude_m: 5_000.0,
        airspeed_m_s: 264.0,
        angle_of_attack_rad: trim.theta_rad,
        sideslip_rad: 0.0,
        thrust_n: trim.thrust_n,
    }
}

/// The state of [`level_flight`].
pub fn level_state() -> State {
    Estimator::default().step(&level_flight()).0
}

/// Keep doing that.
pub fn level_demand() -> Demand {
    Demand { altitude_m: 5_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 }
}
