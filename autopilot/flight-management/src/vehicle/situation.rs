//! Position and motion of the aircraft: the part of the navigation state that the guidance uses.

use flight_control::NavigationState;
use flight_control::guidance::Horizontal;

use super::geodesy::Horizon;
use super::request::Place;
use super::rules::Rules;

/// Time constant of the wind estimate, s: so slow that turbulence does not move the circles that depend on it.
const WIND_LAG_S: f64 = 30.0;

/// Input of the guidance at one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Situation {
    /// Time since the previous tick, s.
    pub dt_s: f64,
    /// Below or above the aircraft.
    pub place: Place,
    /// Over the ground, m/s.
    pub velocity: Horizontal,
    /// Ground speed, m/s.
    pub speed_m_s: f64,
    /// Altitude above the ellipsoid, m.
    pub altitude_m: f64,
    /// Climb rate, m/s.
    pub climb_m_s: f64,
    /// Roll angle, rad, positive to the right.
    pub bank_rad: f64,
    /// Speed of the wind over the ground, m/s, smoothed.
    pub wind_m_s: f64,
}

/// A slow estimate of the steady wind.
#[derive(Debug, Clone, Copy, Default)]
pub struct WindEstimate(Option<Horizontal>);

impl WindEstimate {
    /// Updates with the wind of one tick. The first one is the estimate.
    pub fn step(&mut self, state: &NavigationState, dt_s: f64) {
        let now = state.wind().0.xy();
        let estimate = self.0.get_or_insert(now);
        let share = dt_s / (WIND_LAG_S + dt_s);
        *estimate += (now - *estimate) * share;
    }

    /// The estimate, m/s over the ground; zero before there is one.
    pub fn value(&self) -> Horizontal {
        self.0.unwrap_or_default()
    }
}

impl Situation {
    /// From the navigation state of a tick.
    pub fn new(state: &NavigationState, wind: &WindEstimate, dt_s: f64) -> Self {
        let velocity = state.velocity.0.xy();
        Self {
            dt_s,
            place: Place::of(state),
            velocity,
            speed_m_s: velocity.norm(),
            altitude_m: state.altitude_m,
            climb_m_s: state.climb_rate_m_s(),
            bank_rad: state.attitude.phi,
            wind_m_s: wind.value().norm(),
        }
    }

    /// The axes at the aircraft; computed on demand.
    pub fn horizon(&self) -> Horizon {
        Horizon::at(self.place)
    }

    /// Course over the ground, rad from north.
    pub fn course_rad(&self) -> f64 {
        libm::atan2(self.velocity.y, self.velocity.x)
    }

    /// Radius of the smallest circle that can be flown in this wind, m, at an airspeed reference.
    pub fn smallest_circle_m(&self, airspeed_reference_m_s: f64, rules: &Rules) -> f64 {
        let fastest = airspeed_reference_m_s + self.wind_m_s;
        rules.smallest_circle_m(fastest)
    }
}
