//! What is known of the aircraft at one tick: between the snapshot and every message that says something measured.

use flight_control::NavigationState;
use flight_control::design_model::atmosphere;
use icd::sensors::SensorKind;
use icd::{Attitude, EulerAngles, Ned};

use flight_management::event::Snapshot;

/// Whether the samples of a sensor count.
pub fn is_alive(state: &Snapshot, sensor: SensorKind) -> bool {
    state.motion().alive(&state.sensors)[sensor as usize]
}

/// The navigation state with NaN in each part that is not known. Among samples, rates and attitude give each other exactly, and the
/// satellites the altitude.
pub fn known(state: &Snapshot) -> NavigationState {
    let mut motion = *state.motion();
    let valid = motion.valid;
    let is_exact = motion.estimate.is_none();
    let nothing = Ned::new(f64::NAN, f64::NAN, f64::NAN);
    if !(valid.rates || is_exact && valid.attitude) {
        motion.rates = nothing.0;
    }
    if !(valid.attitude || is_exact && valid.rates) {
        motion.orientation = Attitude::from_unit_wxyz([f64::NAN; 4]);
        motion.attitude = EulerAngles { phi: f64::NAN, theta: f64::NAN, psi: f64::NAN };
    }
    if !valid.velocity {
        motion.velocity = nothing;
    }
    if !valid.position {
        motion.position = nothing;
        (motion.latitude_rad, motion.longitude_rad) = (f64::NAN, f64::NAN);
    }
    if !(valid.altitude || is_exact && valid.position) {
        motion.altitude_m = f64::NAN;
    }
    if !valid.airspeed {
        motion.airspeed_m_s = f64::NAN;
    }
    if !valid.flow_angles {
        (motion.alpha, motion.beta) = (f64::NAN, f64::NAN);
    }
    motion
}

/// Calibrated airspeed of a true one, m/s; NaN without an altitude.
pub fn calibrated_m_s(true_m_s: f64, altitude_m: f64) -> f64 {
    if altitude_m.is_nan() {
        f64::NAN
    } else {
        atmosphere::calibrated_airspeed(true_m_s, altitude_m)
    }
}
