//! Where the aircraft is and how it moves over the ground: what the guidance sees of the sensors.

use flight_control::guidance::Horizontal;
use icd::{Body, Sensors};

use super::geodesy::Horizon;
use super::request::Place;
use super::rules::Rules;

/// Time constant of the wind estimate, s: so slow that turbulence does not move the circles that depend on it.
const WIND_LAG_S: f64 = 30.0;

/// What the guidance sees at one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Situation {
    /// Time since the tick before, s.
    pub dt_s: f64,
    /// The axes at the aircraft.
    pub horizon: Horizon,
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
    /// Takes the sensors of one tick. The first estimate is what they say.
    pub fn step(&mut self, sensors: &Sensors, dt_s: f64) {
        let now = wind(sensors);
        let estimate = self.0.get_or_insert(now);
        let share = dt_s / (WIND_LAG_S + dt_s);
        *estimate += (now - *estimate) * share;
    }

    /// The estimate, m/s over the ground; zero before there is one.
    #[must_use]
    pub fn value(&self) -> Horizontal {
        self.0.unwrap_or_default()
    }
}

/// Ground velocity minus velocity through the air.
fn wind(sensors: &Sensors) -> Horizontal {
    let (sin_alpha, cos_alpha) = libm::sincos(sensors.angle_of_attack_rad);
    let (sin_beta, cos_beta) = libm::sincos(sensors.sideslip_rad);
    let through_air = Body::new(cos_alpha * cos_beta, sin_beta, sin_alpha * cos_beta);
    let through_air = sensors.attitude.to_ned(through_air).0 * sensors.airspeed_m_s;
    (sensors.velocity.0 - through_air).xy()
}

impl Situation {
    /// From the sensors of a tick; `None` if they are no numbers.
    #[must_use]
    pub fn new(sensors: &Sensors, wind: &WindEstimate, dt_s: f64) -> Option<Self> {
        let place =
            Place { latitude_rad: sensors.latitude_rad, longitude_rad: sensors.longitude_rad };
        let velocity = sensors.velocity.0.xy();
        let bank_rad = sensors.attitude.euler().phi;
        let numbers = [
            place.latitude_rad,
            place.longitude_rad,
            velocity.x,
            velocity.y,
            sensors.velocity.0.z,
            sensors.altitude_m,
            sensors.airspeed_m_s,
            bank_rad,
        ];
        numbers.iter().all(|number| number.is_finite()).then(|| Self {
            dt_s,
            horizon: Horizon::at(place),
            velocity,
            speed_m_s: velocity.norm(),
            altitude_m: sensors.altitude_m,
            climb_m_s: -sensors.velocity.0.z,
            bank_rad,
            wind_m_s: wind.value().norm(),
        })
    }

    /// Course over the ground, rad from north.
    #[must_use]
    pub fn course_rad(&self) -> f64 {
        libm::atan2(self.velocity.y, self.velocity.x)
    }

    /// Radius of the smallest circle that can be flown in this wind, m, at an airspeed reference.
    #[must_use]
    pub fn smallest_circle_m(&self, airspeed_reference_m_s: f64, rules: &Rules) -> f64 {
        let fastest = airspeed_reference_m_s + self.wind_m_s;
        rules.smallest_circle_m(fastest)
    }
}
