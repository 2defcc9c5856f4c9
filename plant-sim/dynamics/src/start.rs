//! The start of a flight.

use host_io::problem::Problem;
use serde::{Deserialize, Serialize};

use crate::geodesy::Geodetic;
use crate::range::check_range;

/// The start of a flight: wings level, no sideslip, level flight, trimmed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Start {
    /// Altitude above the ellipsoid or the plane, m.
    pub altitude_m: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Heading of the nose, rad, clockwise from north.
    pub heading_rad: f64,
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
}

/// The keys of a start: in an airframe file all of them have values, in a scenario some.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StartKeys<T> {
    /// Altitude, m.
    pub altitude_m: T,
    /// True airspeed, m/s.
    pub airspeed_m_s: T,
    /// Heading of the nose, deg.
    pub heading_deg: T,
    /// Geodetic latitude, deg.
    pub latitude_deg: T,
    /// Longitude, deg.
    pub longitude_deg: T,
}

/// The start in a scenario; missing values are those of the design point of the airframe.
pub type StartPart = StartKeys<Option<f64>>;

impl<T: Copy + Into<Option<f64>>> StartKeys<T> {
    /// The start of a flight with this design point.
    pub fn over(&self, design_point: &Start) -> Start {
        let number = |value: T, other| value.into().unwrap_or(other);
        let angle = |degrees: T, other| degrees.into().map_or(other, f64::to_radians);
        Start {
            altitude_m: number(self.altitude_m, design_point.altitude_m),
            airspeed_m_s: number(self.airspeed_m_s, design_point.airspeed_m_s),
            heading_rad: angle(self.heading_deg, design_point.heading_rad),
            latitude_rad: angle(self.latitude_deg, design_point.latitude_rad),
            longitude_rad: angle(self.longitude_deg, design_point.longitude_rad),
        }
    }
}

impl Start {
    /// In the place of the design point of a body that no controller flies.
    pub const NOT_USED: Self = Self {
        altitude_m: 1_000.0,
        airspeed_m_s: 100.0,
        heading_rad: 0.0,
        latitude_rad: 0.0,
        longitude_rad: 0.0,
    };

    pub fn geodetic(&self) -> Geodetic {
        Geodetic {
            latitude_rad: self.latitude_rad,
            longitude_rad: self.longitude_rad,
            altitude_m: self.altitude_m,
        }
    }

    /// Checks every number; `section` is its table in the file.
    pub fn check(&self, section: &'static str) -> Result<(), Problem> {
        check_range(section, "altitude_m", self.altitude_m, 1.0, 25_000.0)?;
        check_range(section, "airspeed_m_s", self.airspeed_m_s, 1.0, 1_000.0)?;
        check_range(section, "heading_deg", self.heading_rad.to_degrees(), -360.0, 360.0)?;
        // North and east lose their meaning at the poles.
        check_range(section, "latitude_deg", self.latitude_rad.to_degrees(), -89.0, 89.0)?;
        check_range(section, "longitude_deg", self.longitude_rad.to_degrees(), -180.0, 180.0)
    }
}
