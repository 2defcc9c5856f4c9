//! The checks of references and commands on receipt.

use flight_control::{Gains, GuidanceGains};

use super::VehicleRefusal;
use super::limits::{NavigationParameters, ReferenceLimits};
use super::request::{Airspeed, Place, Reference};

/// Largest radius of a circle, m.
pub const RADIUS_MAX_M: f64 = 200_000.0;
/// Largest latitude either way, deg: at a pole no direction is north.
const LATITUDE_MAX_DEG: f64 = 89.9;

/// Circles have at least this multiple of the radius of the tightest turn, which leaves bank for following
/// them.
const CIRCLE_RESERVE: f64 = 1.1;

/// At this change of the roll reference, deg/s and rad/s (nine digits), rolling into a turn takes [`ROLL_IN_S`].
const ROLL_SLEW_DEG_S: f64 = 20.0;
const ROLL_SLEW_RAD_S: f64 = 0.349_065_85;
const ROLL_IN_S: f64 = 2.0;

/// The parameters of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rules {
    pub limits: ReferenceLimits,
    pub navigation: NavigationParameters,
    /// The altitude laws see no larger error (`ALT_ERR_MAX`), m.
    pub altitude_error_max_m: f64,
}

/// A number, its name and unit, and its range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Checked {
    pub what: &'static str,
    /// Unit of the numbers.
    pub unit: &'static str,
    pub value: f64,
    pub min: f64,
    pub max: f64,
}

impl Checked {
    /// NaN is outside every range.
    pub fn check(self) -> Result<(), VehicleRefusal> {
        let Self { what, unit, value, min, max } = self;
        if (min..=max).contains(&value) {
            Ok(())
        } else {
            Err(VehicleRefusal::OutOfRange { what, unit, value, min, max })
        }
    }
}

/// Latitude and longitude of a place.
fn coordinates(place: Place) -> [Checked; 2] {
    let angle = |what, radians: f64, max: f64| Checked {
        what,
        unit: "deg",
        value: radians.to_degrees(),
        min: -max,
        max,
    };
    [
        angle("latitude", place.latitude_rad, LATITUDE_MAX_DEG),
        // Slightly more, since a conversion to radians and back rounds.
        angle("longitude", place.longitude_rad, 180.000_001),
    ]
}

pub fn check_place(place: Place) -> Result<(), VehicleRefusal> {
    coordinates(place).into_iter().try_for_each(Checked::check)
}

/// Radius of a circle, m.
pub fn radius(value: f64) -> Checked {
    Checked { what: "radius", unit: "m", value, min: 1.0, max: RADIUS_MAX_M }
}

/// A number between zero and `max`.
pub fn up_to(what: &'static str, unit: &'static str, value: f64, max: f64) -> Checked {
    Checked { what, unit, value, min: 0.0, max }
}

impl Rules {
    /// The rules of a set of parameters.
    pub fn new(limits: ReferenceLimits, navigation: NavigationParameters, gains: &Gains) -> Self {
        Self { limits, navigation, altitude_error_max_m: gains.pid.altitude.error_max_m }
    }

    /// Takes the values that it needs from new gains.
    pub fn obey(&mut self, gains: &Gains) {
        *self = Self::new(self.limits, self.navigation, gains);
    }

    /// An altitude counts as reached within this, m: the climb of the aircraft in a second.
    pub fn altitude_reached_m(&self) -> f64 {
        self.navigation.climb_max_m_s
    }

    /// Tuning of the guidance: it commands no more bank than a reference may have.
    pub fn guidance(&self) -> GuidanceGains {
        let NavigationParameters { l1_period_s, l1_damping, bank_max_deg, .. } = self.navigation;
        GuidanceGains {
            period_s: l1_period_s,
            damping: l1_damping,
            bank_max_rad: bank_max_deg.min(self.limits.roll_max_deg).to_radians(),
        }
    }

    /// Radius of the smallest circle that is flown at a ground speed, m.
    pub fn smallest_circle_m(&self, ground_speed_m_s: f64) -> f64 {
        CIRCLE_RESERVE * self.guidance().turn_radius_m(ground_speed_m_s)
    }

    /// Fastest change of a roll reference that the guidance commands, rad/s.
    pub fn roll_slew_rad_s(&self) -> f64 {
        ROLL_SLEW_RAD_S * self.slews()
    }

    /// Time to roll into a turn of a right angle or more, s.
    pub fn roll_in_s(&self) -> f64 {
        ROLL_IN_S / self.slews()
    }

    /// Fastest change of the roll reference in units of [`ROLL_SLEW_RAD_S`].
    fn slews(&self) -> f64 {
        self.navigation.roll_slew_deg_s / ROLL_SLEW_DEG_S
    }

    /// Largest roll reference, rad.
    pub fn roll_max_rad(&self) -> f64 {
        self.limits.roll_max_deg.to_radians()
    }

    /// Airspeed of a throttle stick at an altitude, m/s: its range, 0 to 1, is that of the limits.
    pub fn airspeed_of_throttle(&self, throttle: f64, altitude_m: f64) -> f64 {
        let [low, high] = self.limits.airspeeds_m_s(altitude_m);
        low + throttle * (high - low)
    }

    /// Checks an optional place and altitude.
    pub fn check_some(
        &self,
        place: Option<Place>,
        altitude_m: Option<f64>,
    ) -> Result<(), VehicleRefusal> {
        place.map_or(Ok(()), check_place)?;
        altitude_m.map_or(Ok(()), |value| self.limits.check(Reference::Altitude(value), value))
    }

    /// The nearest allowed altitude, m.
    pub fn nearest_altitude_m(&self, altitude_m: f64) -> f64 {
        altitude_m.min(self.limits.altitude_max_m).max(self.limits.altitude_min_m)
    }

    /// The nearest true airspeed that is allowed at an altitude, m/s.
    pub fn nearest_airspeed_m_s(&self, airspeed: Airspeed, altitude_m: f64) -> f64 {
        let [low, high] = self.limits.airspeeds_m_s(altitude_m);
        airspeed.true_m_s(altitude_m).min(high).max(low)
    }
}
