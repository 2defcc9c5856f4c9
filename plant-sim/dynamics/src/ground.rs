//! The ground of a flight: a runway in a field that is level beside it, from `[plant.ground]` of a scenario.

use host_io::problem::Problem;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::earth::{Earth, Place};
use crate::geodesy::Geodetic;
use crate::range::check_range;

/// Table of a scenario that has the ground.
pub const SECTION: &str = "plant.ground";

/// The ground and how the flight begins on it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct GroundSetup {
    /// Threshold of the runway.
    pub threshold: Geodetic,
    /// Direction of the runway, rad, clockwise from north.
    pub heading_rad: f64,
    pub length_m: f64,
    /// Rise over length.
    pub slope: f64,
    /// Friction over that of a dry runway.
    pub friction: f64,
    pub start: GroundStart,
}

/// How a flight over this ground begins.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GroundStart {
    /// In steady flight.
    Air,
    /// As this aircraft begins a flight: parked if it has wheels, else on its catapult.
    Ready { along_m: f64 },
    /// At rest on the runway, this far from its threshold, m.
    Parked { along_m: f64 },
    /// Out of a hand, the engine at idle.
    Launched(Launch),
    /// At the lower end of a rail of this length, m, along the nose. The catapult holds it there until the engine gives
    /// [`CATAPULT_THRUST`] of its largest thrust; then it accelerates it evenly to the speed of the launch.
    Catapult { launch: Launch, rail_m: f64 },
}

/// The catapult lets go at this part of the largest thrust.
pub const CATAPULT_THRUST: f64 = 0.8;
/// Highest catapult, m: on a higher one the autopilot would take itself for flying.
const CATAPULT_HEIGHT_MAX_M: f64 = 10.0;
/// Largest acceleration of a catapult, m/s²: thirty g.
const CATAPULT_MAX_M_S2: f64 = 300.0;

/// The state in which a launch begins, wings level along the runway.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Launch {
    /// Distance from the threshold, m.
    pub along_m: f64,
    /// Height of the centre of gravity above the ground, m.
    pub height_m: f64,
    /// Speed over the ground along the nose at the end of the launch, m/s.
    pub speed_m_s: f64,
    pub pitch_rad: f64,
}

impl GroundStart {
    /// Checks the numbers of a start on a runway of this length, m.
    pub fn check(&self, section: &str, length_m: f64) -> Result<(), Problem> {
        check_range(section, "along_m", self.along_m().unwrap_or(0.0), 0.0, length_m)?;
        if let Self::Launched(launch) | Self::Catapult { launch, .. } = self {
            check_range(section, "height_m", launch.height_m, 0.0, 100.0)?;
            check_range(section, "speed_m_s", launch.speed_m_s, 0.0, 200.0)?;
            check_range(section, "pitch_deg", launch.pitch_rad.to_degrees(), -45.0, 80.0)?;
        }
        if let Self::Catapult { launch, rail_m } = self {
            check_range(section, "height_m", launch.height_m, 0.0, CATAPULT_HEIGHT_MAX_M)?;
            let least_m = launch.speed_m_s * launch.speed_m_s / (2.0 * CATAPULT_MAX_M_S2);
            check_range(section, "rail_m", *rail_m, least_m.max(0.1), 500.0)?;
        }
        Ok(())
    }

    /// Distance from the threshold, m; `None` in the air.
    pub fn along_m(mut self) -> Option<f64> {
        self.along_mut().copied()
    }

    fn along_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Air => None,
            Self::Parked { along_m }
            | Self::Ready { along_m }
            | Self::Launched(Launch { along_m, .. })
            | Self::Catapult { launch: Launch { along_m, .. }, .. } => Some(along_m),
        }
    }
}

impl GroundSetup {
    pub const SLOPE_MAX: f64 = 0.1;

    /// Checks every number.
    pub fn check(&self) -> Result<(), Problem> {
        let Self { threshold, heading_rad, length_m, slope, friction, start } = self;
        let most_percent = 100.0 * Self::SLOPE_MAX;
        for (key, value, min, max) in [
            ("latitude_deg", threshold.latitude_rad.to_degrees(), -89.0, 89.0),
            ("longitude_deg", threshold.longitude_rad.to_degrees(), -180.0, 180.0),
            ("elevation_m", threshold.altitude_m, -450.0, 9_000.0),
            ("heading_deg", heading_rad.to_degrees(), -360.0, 360.0),
            ("length_m", *length_m, 10.0, 20_000.0),
            ("slope_percent", 100.0 * slope, -most_percent, most_percent),
            ("friction", *friction, 0.0, 2.0),
        ] {
            check_range(SECTION, key, value, min, max)?;
        }
        start.check(SECTION, *length_m)
    }

    /// The same runway elsewhere, with the aircraft at its threshold.
    pub fn move_to(&mut self, threshold: Geodetic, heading_rad: f64) {
        (self.threshold, self.heading_rad) = (threshold, heading_rad);
        if let Some(along_m) = self.start.along_mut() {
            *along_m = 0.0;
        }
    }

    /// The point of the runway this far from its threshold.
    pub fn at(&self, earth: &Earth, along_m: f64) -> Geodetic {
        let surface = Surface::new(self, earth);
        let mut here = earth.geodetic(&(surface.threshold + along_m * surface.along));
        here.altitude_m = self.threshold.altitude_m + self.slope * along_m;
        here
    }
}

/// The ground as the contact points meet it.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    threshold: Vector3<f64>,
    /// Direction of the runway at its threshold, level, frame E.
    along: Vector3<f64>,
    elevation_m: f64,
    length_m: f64,
    slope: f64,
    /// Friction over that of a dry runway.
    pub friction: f64,
}

/// The ground under a position, as a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Under {
    /// Distance of the position from the plane, m; negative below it.
    pub height_m: f64,
    /// Unit vector out of the plane, frame E.
    pub up: Vector3<f64>,
    pub elevation_m: f64,
}

impl Surface {
    pub fn new(setup: &GroundSetup, earth: &Earth) -> Self {
        let threshold = earth.position(&setup.threshold);
        let (sin, cos) = libm::sincos(setup.heading_rad);
        Self {
            along: earth.place(&threshold).e_from_ned * Vector3::new(cos, sin, 0.0),
            threshold,
            elevation_m: setup.threshold.altitude_m,
            length_m: setup.length_m,
            slope: setup.slope,
            friction: setup.friction,
        }
    }

    /// How far a position is along the runway from its threshold and to the right of its centre line, m.
    pub fn on_runway_m(&self, position: &Vector3<f64>, place: &Place) -> (f64, f64) {
        let from = position - self.threshold;
        let down = place.e_from_ned.column(2).into_owned();
        (self.along.dot(&from), down.cross(&self.along).dot(&from))
    }

    /// The ground under a position, m, frame E. It follows the Earth, and beyond the ends of the runway it is level.
    pub fn under(&self, position: &Vector3<f64>, place: &Place) -> Under {
        let level_up = -place.e_from_ned.column(2).into_owned();
        if self.slope == 0.0 {
            let height_m = place.altitude_m - self.elevation_m;
            return Under { height_m, up: level_up, elevation_m: self.elevation_m };
        }
        let along_m = self.along.dot(&(position - self.threshold));
        let on_runway_m = along_m.max(0.0).min(self.length_m);
        let slope = if along_m == on_runway_m { self.slope } else { 0.0 };
        // The direction of the threshold, turned into the horizon of this place.
        let along = self.along - level_up * level_up.dot(&self.along);
        let steep = 1.0 / (1.0 + slope * slope).sqrt();
        let elevation_m = self.elevation_m + self.slope * on_runway_m;
        Under {
            height_m: (place.altitude_m - elevation_m) * steep,
            up: (level_up - along * slope) * steep,
            elevation_m,
        }
    }
}
