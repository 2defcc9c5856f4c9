//! Sensors to state: the first block of a step.
//!
//! The aircraft carries an ideal inertial navigation unit and air-data vanes, so this block only picks
//! what the laws need and guards them against values that no aircraft has.

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

/// Largest body rate that is believed, rad/s: sixteen turns a second.
const RATE_MAX_RAD_S: f64 = 100.0;
/// Largest angle that is believed, rad: a little more than half a turn.
const ANGLE_MAX_RAD: f64 = 3.2;
/// Largest speed that is believed, m/s.
const SPEED_MAX_M_S: f64 = 5_000.0;
/// Largest altitude either way that is believed, m.
const ALTITUDE_MAX_M: f64 = 200_000.0;
/// Largest thrust that is believed, N.
const THRUST_MAX_N: f64 = 1.0e8;

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

    /// One step. The flag says that a value was implausible and the last good state stands in.
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
        if state.is_plausible() {
            self.last = Some(state);
            (state, false)
        } else {
            (self.last.unwrap_or(State::AT_REST), true)
        }
    }
}

impl State {
    /// Stands in when the first sensor values of a flight are not finite.
    pub(crate) const AT_REST: Self = Self {
        rates: Vector3::new(0.0, 0.0, 0.0),
        attitude: EulerAngles { phi: 0.0, theta: 0.0, psi: 0.0 },
        alpha: 0.0,
        beta: 0.0,
        airspeed_m_s: 0.0,
        altitude_m: 0.0,
        climb_rate_m_s: 0.0,
        thrust_n: 0.0,
    };

    /// Every number inside what an aircraft can have; NaN and infinity are not. Inside these ranges no law
    /// can overflow.
    fn is_plausible(&self) -> bool {
        let inside = |value: f64, max: f64| value.abs() <= max;
        let angles = &self.attitude;
        inside(self.rates.x, RATE_MAX_RAD_S)
            && inside(self.rates.y, RATE_MAX_RAD_S)
            && inside(self.rates.z, RATE_MAX_RAD_S)
            && inside(angles.phi, ANGLE_MAX_RAD)
            && inside(angles.theta, ANGLE_MAX_RAD)
            && inside(angles.psi, ANGLE_MAX_RAD)
            && inside(self.alpha, ANGLE_MAX_RAD)
            && inside(self.beta, ANGLE_MAX_RAD)
            && inside(self.airspeed_m_s, SPEED_MAX_M_S)
            && inside(self.altitude_m, ALTITUDE_MAX_M)
            && inside(self.climb_rate_m_s, SPEED_MAX_M_S)
            && inside(self.thrust_n, THRUST_MAX_N)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn a_value_that_cannot_be_is_replaced_by_the_last_good_set() {
        let mut estimator = Estimator::default();
        let good = testing::level_flight();
        let (state, flag) = estimator.step(&good);
        assert!(!flag);
        for bad in [f64::NAN, f64::INFINITY, 1.0e200, -1.0e200] {
            for sensors in [
                Sensors { sideslip_rad: bad, ..good },
                Sensors { airspeed_m_s: bad, ..good },
                Sensors { thrust_n: bad, ..good },
                Sensors { altitude_m: bad, ..good },
            ] {
                assert_eq!(estimator.step(&sensors), (state, true), "{bad}");
            }
        }
    }

    #[test]
    fn a_bad_first_set_gives_a_finite_state() {
        let sensors = Sensors { airspeed_m_s: f64::NAN, ..testing::level_flight() };
        let (state, flag) = Estimator::default().step(&sensors);
        assert!(flag && state.is_plausible());
    }
}
