//! Places on the Earth as the guidance uses them: offsets from the aircraft, and back.
//!
//! Points lie on the WGS-84 ellipsoid and are stored as Earth-centred vectors, so that neither the date line
//! nor a pole is a special case. An offset has the direction of the straight line through the Earth, seen
//! from the aircraft, and the length of the arc above it. Through the aircraft a great circle is therefore a
//! straight line, and a leg between two points is a great circle to a few metres.
//!
//! Differs from a geodesic of the ellipsoid by less than 0.1 % of the length up to 500 km. The altitude of
//! the flight is left out: 5 km of it are 0.08 % of a distance. A plant with a flat Earth gives latitude and
//! longitude of a plane; 100 km from its start at 35 deg that is 1 % of a distance and half a degree.

use flight_control::guidance::Horizontal;
use icd::Ned;
use nalgebra::Vector3;

use super::request::Place;

/// Semi-major axis of WGS-84, m (NIMA TR8350.2).
const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Flattening of WGS-84 (NIMA TR8350.2).
const FLATTENING: f64 = 1.0 / 298.257_223_563;
const E2: f64 = FLATTENING * (2.0 - FLATTENING);
/// Mean radius of the Earth, m: turns a chord into an arc.
const MEAN_RADIUS_M: f64 = 6_371_008.8;
/// Steps of the search for a latitude; each gains three digits.
const LATITUDE_STEPS: usize = 5;
/// Steps of the search for the origin of the local axes; each gains a factor of ten at 600 km.
const ORIGIN_STEPS: usize = 12;

/// A point of the ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    place: Place,
    /// Earth-centred, Earth-fixed, m.
    ecef: Vector3<f64>,
}

/// The local axes at a point of the ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Horizon {
    /// Location of the axes.
    pub site: Site,
    north: Vector3<f64>,
    east: Vector3<f64>,
}

impl Site {
    /// The point with these coordinates.
    pub fn at(place: Place) -> Self {
        Self { place, ecef: ecef(place, 0.0) }
    }

    pub fn place(&self) -> Place {
        self.place
    }
}

impl Horizon {
    /// The axes at these coordinates.
    pub fn at(place: Place) -> Self {
        let (sin_phi, cos_phi) = libm::sincos(place.latitude_rad);
        let (sin_lambda, cos_lambda) = libm::sincos(place.longitude_rad);
        Self {
            site: Site::at(place),
            north: Vector3::new(-sin_phi * cos_lambda, -sin_phi * sin_lambda, cos_phi),
            east: Vector3::new(-sin_lambda, cos_lambda, 0.0),
        }
    }

    /// Offset of a point, m.
    pub fn offset(&self, to: &Site) -> Horizontal {
        let chord = to.ecef - self.site.ecef;
        let flat = Horizontal::new(self.north.dot(&chord), self.east.dot(&chord));
        let flat_length = flat.norm();
        if flat_length < f64::MIN_POSITIVE {
            // The point itself, or its antipode, where every direction is equally good.
            let length = arc(chord.norm());
            return Horizontal::new(length, 0.0);
        }
        flat * (arc(chord.norm()) / flat_length)
    }

    /// The place at an offset, m. The inverse of [`Horizon::offset`], to 0.3 % of the length up to 500 km.
    pub fn place_at(&self, offset: &Horizontal) -> Place {
        let length = offset.norm();
        if length < f64::MIN_POSITIVE || !length.is_finite() {
            return self.site.place;
        }
        let angle = length / MEAN_RADIUS_M;
        let (sin, cos) = libm::sincos(angle);
        // North cross east points down.
        let up = self.north.cross(&self.east) * -1.0;
        let along = (self.north * offset.x + self.east * offset.y) / length;
        let point = self.site.ecef + (along * sin - up * (1.0 - cos)) * MEAN_RADIUS_M;
        geodetic(&point).0
    }
}

/// The local axes of a flight: north, east and down at the start point, altitude zero.
pub type LocalAxes = Horizon;

impl LocalAxes {
    /// From the location of the aircraft and its local position.
    pub fn of(place: Place, altitude_m: f64, position: Ned) -> Self {
        let aircraft = ecef(place, altitude_m);
        let mut guess = place;
        let mut axes = Self::at(guess);
        for _ in 0..ORIGIN_STEPS {
            axes = Self::at(guess);
            guess = geodetic(&(aircraft - axes.turned(position))).0;
        }
        axes
    }

    fn turned(&self, v: Ned) -> Vector3<f64> {
        let down = self.north.cross(&self.east);
        self.north * v.0.x + self.east * v.0.y + down * v.0.z
    }

    /// Place and altitude (m) of a local position.
    pub fn place(&self, position: Ned) -> (Place, f64) {
        geodetic(&(self.site.ecef + self.turned(position)))
    }
}

/// Arc over a chord, m.
fn arc(chord_m: f64) -> f64 {
    // A point on the other side of the Earth is a little farther away than two mean radii.
    let half = (chord_m / (2.0 * MEAN_RADIUS_M)).min(1.0);
    2.0 * MEAN_RADIUS_M * libm::asin(half)
}

fn ecef(place: Place, altitude_m: f64) -> Vector3<f64> {
    let (sin_phi, cos_phi) = libm::sincos(place.latitude_rad);
    let (sin_lambda, cos_lambda) = libm::sincos(place.longitude_rad);
    let n = prime_vertical(sin_phi);
    let horizontal = (n + altitude_m) * cos_phi;
    Vector3::new(
        horizontal * cos_lambda,
        horizontal * sin_lambda,
        (n * (1.0 - E2) + altitude_m) * sin_phi,
    )
}

/// Radius of curvature of the prime vertical, m.
fn prime_vertical(sin_latitude: f64) -> f64 {
    SEMI_MAJOR_M / libm::sqrt(1.0 - E2 * sin_latitude * sin_latitude)
}

/// Place and altitude of an Earth-centred position, by iteration of the latitude.
fn geodetic(position: &Vector3<f64>) -> (Place, f64) {
    let horizontal = libm::hypot(position.x, position.y);
    let mut latitude_rad = libm::atan2(position.z, horizontal * (1.0 - E2));
    for _ in 0..LATITUDE_STEPS {
        let sin = libm::sin(latitude_rad);
        latitude_rad = libm::atan2(position.z + E2 * prime_vertical(sin) * sin, horizontal);
    }
    let (sin, cos) = libm::sincos(latitude_rad);
    let w = libm::sqrt(1.0 - E2 * sin * sin);
    let altitude_m = horizontal * cos + position.z * sin - SEMI_MAJOR_M * w;
    let longitude_rad = libm::atan2(position.y, position.x);
    (Place { latitude_rad, longitude_rad }, altitude_m)
}

#[cfg(test)]
mod tests;
