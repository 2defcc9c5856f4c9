//! Sensors to state: the first block of a step.
//!
//! The aircraft carries an ideal inertial navigation unit and air-data vanes, so this block only picks
//! what the laws need and guards them against values that are not finite.

use icd::{EulerAngles, Sensors};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// What the laws know of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// p, q, r: body rates, rad/s.
    pub rates: Vector3<f64>,
    /// φ, θ, ψ, rad.
    pub attitude: EulerAngles,
    /// α: angle of attack, rad, air-relative.
    pub alpha: f64,
    /// β: sideslip, rad, air-relative.
    pub beta: f64,
    /// V: true airspeed, m/s.
    pub airspeed_m_s: f64,
    /// H: altitude, m.
    pub altitude_m: f64,
    /// Ḣ: climb rate, m/s.
    pub climb_rate_m_s: f64,
    /// T: thrust, N, measured.
    pub thrust_n: f64,
}

/// Sensors to [`State`].
#[derive(Debug, Clone, Default)]
pub struct Estimator {
    last: Option<State>,
}

impl Estimator {
    /// Forgets everything.
    pub fn reset(&mut self) {
        self.last = None;
    }

    /// One step. The flag says that a value was not finite and the last good state stands in.
    pub fn step(&mut self, sensors: &Sensors) -> (State, bool) {
        let state = State {
            rates: sensors.body_rates.0,
            attitude: sensors.attitude.euler(),
            alpha: sensors.angle_of_attack_rad,
            beta: sensors.sideslip_rad,
            airspeed_m_s: sensors.airspeed_m_s,
            altitude_m: sensors.altitude_m,
            climb_rate_m_s: -sensors.velocity.0.z,
            thrust_n: sensors.thrust_n,
        };
        if state.is_finite() {
            self.last = Some(state);
            (state, false)
        } else {
            (self.last.unwrap_or(State::AT_REST), true)
        }
    }
}

impl State {
    /// Stands in when the first sensor values of a flight are not finite.
    const AT_REST: Self = Self {
        rates: Vector3::new(0.0, 0.0, 0.0),
        attitude: EulerAngles { phi: 0.0, theta: 0.0, psi: 0.0 },
        alpha: 0.0,
        beta: 0.0,
        airspeed_m_s: 0.0,
        altitude_m: 0.0,
        climb_rate_m_s: 0.0,
        thrust_n: 0.0,
    };

    fn is_finite(&self) -> bool {
        // Any NaN or infinity survives the multiplication by zero and the sum.
        let sum = 0.0 * self.rates.x
            + 0.0 * self.rates.y
            + 0.0 * self.rates.z
            + 0.0 * self.attitude.phi
            + 0.0 * self.attitude.theta
            + 0.0 * self.attitude.psi
            + 0.0 * self.alpha
            + 0.0 * self.beta
            + 0.0 * self.airspeed_m_s
            + 0.0 * self.altitude_m
            + 0.0 * self.climb_rate_m_s
            + 0.0 * self.thrust_n;
        sum == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn a_value_that_is_not_finite_is_replaced_by_the_last_good_set() {
        let mut estimator = Estimator::default();
        let good = testing::level_flight();
        let (state, flag) = estimator.step(&good);
        assert!(!flag);
        for bad in [f64::NAN, f64::INFINITY] {
            let sensors = Sensors { sideslip_rad: bad, ..good };
            assert_eq!(estimator.step(&sensors), (state, true));
        }
    }

    #[test]
    fn a_bad_first_set_gives_a_finite_state() {
        let sensors = Sensors { airspeed_m_s: f64::NAN, ..testing::level_flight() };
        let (state, flag) = Estimator::default().step(&sensors);
        assert!(flag && state.is_finite());
    }
}
