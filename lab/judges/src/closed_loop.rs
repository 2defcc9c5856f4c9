//! What of a flight the design model does not explain, and the flight itself ([`lab_engine`]).

use flight_control::{DesignModel, NavigationState};
use icd::{EulerAngles, PerEffector};
use nalgebra::Vector3;
use plant_sim::Truth;

pub use lab_engine::flight::{End, Exchange, Flight, FlightSetup, Held, Record, Tick};
pub use lab_engine::watch::{TimedCommand, fly, watch, watch_with_commands};

/// F: the truth that z2 estimates, rad/s².
///
/// True angular acceleration minus what the design model gives at the true state for healthy effectors
/// at their modelled positions.
///
/// Implements Eq. (17): faults and disturbances as one acceleration, F = g u_f + Δ.
/// Implements Eq. (18), solved for F, with the compensation inside the modelled positions.
pub fn fault_acceleration(model: &DesignModel, record: &Record) -> Vector3<f64> {
    let Record { truth, log } = record;
    let expected = expected_acceleration(model, truth, &truth.euler(), &log.modelled);
    truth.angular_acceleration.0 - expected
}

/// What the design model expects at the true state, with `attitude` as angles, for healthy effectors at their modelled
/// positions, rad/s².
pub fn expected_acceleration(
    model: &DesignModel,
    truth: &Truth,
    attitude: &EulerAngles,
    modelled: &PerEffector<f64>,
) -> Vector3<f64> {
    let state = NavigationState {
        rates: truth.body_rates.0,
        attitude: *attitude,
        alpha: truth.alpha_rad,
        beta: truth.beta_rad,
        airspeed_m_s: truth.airspeed_m_s,
        altitude_m: truth.altitude_m,
        thrust_n: model.engine().map_or(0.0, |engine| truth.deflections[engine]),
        ..NavigationState::at_rest()
    };
    expected_at(model, &state, modelled)
}

/// What of a true angular acceleration the design model does not explain, rad/s²: see Eq. (18).
pub fn beyond_model(
    model: &DesignModel,
    state: &NavigationState,
    angular_acceleration: &Vector3<f64>,
    modelled: &PerEffector<f64>,
) -> Vector3<f64> {
    angular_acceleration - expected_at(model, state, modelled)
}

fn expected_at(
    model: &DesignModel,
    state: &NavigationState,
    modelled: &PerEffector<f64>,
) -> Vector3<f64> {
    // A scheduled model is taken at the true state, as the observer takes it at the measured one.
    let adapted = model.at(state);
    let model = adapted.as_ref().unwrap_or(model);
    model.acceleration(state, &model.condition(state), modelled)
}
