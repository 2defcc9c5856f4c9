//! What may be asked of the vehicle: values in SI and radians, already finite, not yet checked against limits.

use flight_control::NavigationState;
use icd::Ned;
use serde::{Deserialize, Serialize};

/// A point on the Earth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
}

impl Place {
    /// Where the aircraft is.
    #[must_use]
    pub const fn of(state: &NavigationState) -> Self {
        Self { latitude_rad: state.latitude_rad, longitude_rad: state.longitude_rad }
    }
}

/// A reference that the operator may change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Reference {
    /// Altitude above the ellipsoid, m.
    Altitude(f64),
    /// True airspeed, m/s.
    Airspeed(f64),
    /// Roll angle, rad; in Position and Offboard.
    Roll(f64),
    /// Course over the ground, rad from north; only in Position.
    Course(f64),
}

/// Go somewhere and circle there. What is `None` stays as it is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Reposition {
    /// Centre of the circle; `None`: where the aircraft circles already, or else where it is now.
    pub place: Option<Place>,
    /// Altitude above the ellipsoid, m.
    pub altitude_m: Option<f64>,
    /// Radius of the circle, m, positive.
    pub radius_m: Option<f64>,
    /// Direction of the circle, seen from above.
    pub clockwise: Option<bool>,
    /// True airspeed, m/s.
    pub airspeed_m_s: Option<f64>,
    /// Change to Hold first; without it the request is refused outside Hold.
    pub change_mode: bool,
}

/// One setpoint of an offboard stream; only in Offboard.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Setpoint {
    /// Roll angle, rad; altitude and airspeed references stay.
    Roll(f64),
    /// Fly to a place and circle there.
    Position {
        /// Where.
        place: Place,
        /// Altitude above the ellipsoid, m; `None`: as it is.
        altitude_m: Option<f64>,
    },
    /// The same in the local axes of the flight, m.
    LocalPosition(Ned),
    /// Fly in a direction.
    Velocity {
        /// Course over the ground, rad from north; `None`: as it is.
        course_rad: Option<f64>,
        /// Speed, m/s, flown as true airspeed; `None`: as it is.
        speed_m_s: Option<f64>,
        /// Climb rate, m/s, positive up.
        climb_m_s: f64,
    },
}

/// Positions of a pilot's sticks; in Position and Altitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sticks {
    /// -1 left to 1 right: roll reference up to the limit.
    pub roll: f64,
    /// -1 down to 1 up: climb rate.
    pub climb: f64,
    /// 0 to 1: airspeed reference between its limits; `None`: as it is.
    pub throttle: Option<f64>,
}

impl Sticks {
    /// Centred, without a throttle.
    pub const CENTRED: Self = Self { roll: 0.0, climb: 0.0, throttle: None };
}

/// What happens when the controlling ground station falls silent (parameter `NAV_DLL_ACT`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum LinkLossAction {
    /// The flight goes on.
    Continue,
    /// Circle where the aircraft is.
    Hold,
    /// Fly home.
    Return,
}
