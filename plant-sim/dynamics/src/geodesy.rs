//! The WGS-84 ellipsoid and a sphere: geodetic coordinates to Earth-centred ones and back.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Semi-major axis a, m (NIMA TR8350.2).
pub const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Flattening f (NIMA TR8350.2).
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Semi-minor axis b, m.
pub const SEMI_MINOR_M: f64 = SEMI_MAJOR_M * (1.0 - FLATTENING);
pub const ECCENTRICITY_SQUARED: f64 = FLATTENING * (2.0 - FLATTENING);
const SECOND_ECCENTRICITY_SQUARED: f64 = ECCENTRICITY_SQUARED / (1.0 - ECCENTRICITY_SQUARED);

/// Nearer to the axis of rotation than this, m, the longitude counts as zero.
const AXIS_M: f64 = 1.0e-6;

/// Latitude, longitude and height above the ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Geodetic {
    /// Geodetic latitude, rad, north positive.
    pub latitude_rad: f64,
    /// Longitude, rad, east positive.
    pub longitude_rad: f64,
    /// Height above the ellipsoid, m.
    pub altitude_m: f64,
}

/// Direction of the local vertical and height, without an angle: the form that a derivative needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vertical {
    /// Sine of the geodetic latitude.
    pub sin_latitude: f64,
    /// Cosine of the geodetic latitude, not negative.
    pub cos_latitude: f64,
    /// Sine of the longitude.
    pub sin_longitude: f64,
    /// Cosine of the longitude.
    pub cos_longitude: f64,
    /// Height above the ellipsoid, m.
    pub altitude_m: f64,
}

impl Vertical {
    /// The same as angles.
    pub fn geodetic(&self) -> Geodetic {
        Geodetic {
            latitude_rad: libm::atan2(self.sin_latitude, self.cos_latitude),
            longitude_rad: libm::atan2(self.sin_longitude, self.cos_longitude),
            altitude_m: self.altitude_m,
        }
    }
}

/// Radii of curvature of the ellipsoid at a latitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radii {
    /// Of the meridian (north-south), m.
    pub meridian_m: f64,
    /// Of the prime vertical (east-west), m.
    pub prime_vertical_m: f64,
}

/// Radii of curvature at the latitude with this sine.
pub fn radii(sin_latitude: f64) -> Radii {
    let w2 = 1.0 - ECCENTRICITY_SQUARED * sin_latitude * sin_latitude;
    let prime_vertical_m = SEMI_MAJOR_M / w2.sqrt();
    Radii { meridian_m: prime_vertical_m * (1.0 - ECCENTRICITY_SQUARED) / w2, prime_vertical_m }
}

/// Earth-centred, Earth-fixed position, m: z to the north pole, x to latitude and longitude zero.
pub fn ecef(geodetic: &Geodetic) -> Vector3<f64> {
    let (sin_latitude, cos_latitude) = libm::sincos(geodetic.latitude_rad);
    let (sin_longitude, cos_longitude) = libm::sincos(geodetic.longitude_rad);
    let n = radii(sin_latitude).prime_vertical_m;
    let horizontal = (n + geodetic.altitude_m) * cos_latitude;
    Vector3::new(
        horizontal * cos_longitude,
        horizontal * sin_longitude,
        (n * (1.0 - ECCENTRICITY_SQUARED) + geodetic.altitude_m) * sin_latitude,
    )
}

/// Vertical and height at an Earth-centred, Earth-fixed position in m.
///
/// Bowring's formula with his improved first guess (Survey Review 28, 1985), closed and without an angle;
/// the height depends on the remaining error in second order only. Better than 1e-8 m from -1 to 100 km.
/// At the centre of the Earth, where there is no vertical, the result is finite and meaningless.
#[inline]
pub fn vertical(position: &Vector3<f64>) -> Vertical {
    let (x, y, z) = (position.x, position.y, position.z);
    let horizontal = (x * x + y * y).sqrt();
    // The radius is a divisor, and zero at the centre of the Earth.
    let radius = (x * x + y * y + z * z).sqrt().max(AXIS_M);
    // Reduced latitude, as sine and cosine times an unknown length.
    let reduced_sin =
        SEMI_MINOR_M * z * (1.0 + SECOND_ECCENTRICITY_SQUARED * SEMI_MINOR_M / radius);
    let reduced_cos = SEMI_MAJOR_M * horizontal;
    let (sin_reduced, cos_reduced) = unit(reduced_sin, reduced_cos);
    let (sin_latitude, cos_latitude) = unit(
        z + SECOND_ECCENTRICITY_SQUARED * SEMI_MINOR_M * sin_reduced * sin_reduced * sin_reduced,
        horizontal - ECCENTRICITY_SQUARED * SEMI_MAJOR_M * cos_reduced * cos_reduced * cos_reduced,
    );
    let w = (1.0 - ECCENTRICITY_SQUARED * sin_latitude * sin_latitude).sqrt();
    let (cos_longitude, sin_longitude) = if horizontal > AXIS_M {
        let per_horizontal = 1.0 / horizontal;
        (x * per_horizontal, y * per_horizontal)
    } else {
        (1.0, 0.0)
    };
    Vertical {
        sin_latitude,
        cos_latitude,
        sin_longitude,
        cos_longitude,
        // Along the normal: p / cos φ - N would divide by zero at the poles.
        altitude_m: horizontal * cos_latitude + z * sin_latitude - SEMI_MAJOR_M * w,
    }
}

/// Earth-centred, Earth-fixed position over a sphere, m; the latitude is geocentric.
pub fn on_sphere(geocentric: &Geodetic, radius_m: f64) -> Vector3<f64> {
    let (sin_latitude, cos_latitude) = libm::sincos(geocentric.latitude_rad);
    let (sin_longitude, cos_longitude) = libm::sincos(geocentric.longitude_rad);
    let radius = radius_m + geocentric.altitude_m;
    let horizontal = radius * cos_latitude;
    Vector3::new(horizontal * cos_longitude, horizontal * sin_longitude, radius * sin_latitude)
}

/// Vertical and height over a sphere at an Earth-centred, Earth-fixed position in m.
pub fn vertical_of_sphere(position: &Vector3<f64>, radius_m: f64) -> Vertical {
    let horizontal = (position.x * position.x + position.y * position.y).sqrt();
    let (sin_latitude, cos_latitude) = unit(position.z, horizontal);
    let (sin_longitude, cos_longitude) =
        if horizontal > AXIS_M { unit(position.y, position.x) } else { (0.0, 1.0) };
    Vertical {
        sin_latitude,
        cos_latitude,
        sin_longitude,
        cos_longitude,
        altitude_m: position.norm() - radius_m,
    }
}

/// Sine and cosine of the angle of a right triangle with these legs; angle zero if both are.
#[inline]
fn unit(opposite: f64, adjacent: f64) -> (f64, f64) {
    let length = (opposite * opposite + adjacent * adjacent).sqrt();
    if length <= 0.0 {
        return (0.0, 1.0);
    }
    // One division: every stage of the integration runs this.
    let per_length = 1.0 / length;
    (opposite * per_length, adjacent * per_length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Latitude and height by fixed-point iteration to the last digit: slow, and independent of Bowring.
    fn iterated(position: &Vector3<f64>) -> (f64, f64) {
        let p = libm::hypot(position.x, position.y);
        let mut latitude = libm::atan2(position.z, p * (1.0 - ECCENTRICITY_SQUARED));
        for _ in 0..50 {
            let n = radii(libm::sin(latitude)).prime_vertical_m;
            let sin = libm::sin(latitude);
            latitude = libm::atan2(position.z + ECCENTRICITY_SQUARED * n * sin, p);
        }
        let (sin, cos) = libm::sincos(latitude);
        let w = (1.0 - ECCENTRICITY_SQUARED * sin * sin).sqrt();
        (latitude, p * cos + position.z * sin - SEMI_MAJOR_M * w)
    }

    proptest! {
        #[test]
        fn closed_height_agrees_with_the_iterated_one(
            latitude_rad in -1.570..1.570, longitude_rad in -3.1..3.1, altitude_m in -1.0e3..1.0e5,
        ) {
            let position = ecef(&Geodetic { latitude_rad, longitude_rad, altitude_m });
            let ours = vertical(&position);
            let (latitude, altitude) = iterated(&position);
            // 1e-8 m: ten roundings of a 6.4e6 m number (9e-10 m each).
            prop_assert!((ours.altitude_m - altitude).abs() < 1e-8, "{} m", ours.altitude_m - altitude);
            // 1e-9 rad are 6 mm on the ground.
            prop_assert!((ours.geodetic().latitude_rad - latitude).abs() < 1e-9);
        }

        #[test]
        fn geodetic_coordinates_survive_the_round_trip(
            latitude_rad in -1.57..1.57, longitude_rad in -3.1..3.1, altitude_m in -1.0e3..1.0e5,
        ) {
            let back = vertical(&ecef(&Geodetic { latitude_rad, longitude_rad, altitude_m })).geodetic();
            // 1e-9 rad are 6 mm, 1e-8 m as above.
            prop_assert!((back.latitude_rad - latitude_rad).abs() < 1e-9);
            prop_assert!((back.longitude_rad - longitude_rad).abs() < 1e-9);
            prop_assert!((back.altitude_m - altitude_m).abs() < 1e-8);
        }
    }

    #[test]
    fn the_poles_have_a_vertical() {
        let pole = vertical(&Vector3::new(0.0, 0.0, -(SEMI_MINOR_M + 100.0)));
        assert!((pole.altitude_m - 100.0).abs() < 1e-8, "{} m", pole.altitude_m);
        assert_eq!(pole.sin_latitude, -1.0);
    }

    #[test]
    fn the_centre_of_the_earth_gives_finite_numbers() {
        let centre = vertical(&Vector3::zeros());
        assert!(centre.altitude_m.is_finite() && centre.sin_latitude.is_finite());
    }
}
