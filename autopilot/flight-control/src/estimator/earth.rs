//! The Earth of the estimator: fixed axes at the start point, gravity and vertical at a place.
//!
//! The estimate is kept in the north, east and down axes of the start point, which turn with the Earth and not with the
//! aircraft. So no transport rate appears in the equations of motion; it is in the change of the local axes.

use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{Attitude, GnssFix, Ned};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::gains::EarthShape;

/// Semi-major axis of WGS-84, m (NIMA TR8350.2).
const SEMI_MAJOR_M: f64 = 6_378_137.0;
/// Flattening of WGS-84 (NIMA TR8350.2).
const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared.
const E2: f64 = FLATTENING * (2.0 - FLATTENING);
/// Gravitational parameter, m³/s² (WGS-84).
const GM: f64 = 3.986_004_418e14;
/// Oblateness of the gravity field (EGM96, as of the NESC check cases, NASA/TM-2015-218675).
const J2: f64 = 0.001_082_629_82;
/// Rate of rotation, rad/s (WGS-84).
const ROTATION_RAD_S: f64 = 7.292_115e-5;
/// Steps of the search for the start point; each gains a factor of the Earth's radius over the distance.
const START_STEPS: usize = 6;
/// Steps of the search for a latitude; each gains three digits.
const LATITUDE_STEPS: usize = 4;
/// Smallest cosine of a latitude: at a pole east has no meaning.
const COSINE_MIN: f64 = 1.0e-4;

/// Latitude and longitude, rad, and altitude above the ellipsoid or the flat ground, m.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Coordinates {
    latitude: f64,
    longitude: f64,
    altitude: f64,
}

/// The Earth under a flight.
#[derive(Debug, Clone)]
pub struct Earth {
    shape: EarthShape,
    /// The start point at altitude zero, m, Earth-centred axes.
    origin: Vector3<f64>,
    /// Turns start axes into Earth-centred ones.
    centred_from_start: Matrix3<f64>,
    /// The start point of a flat Earth.
    start: Coordinates,
    /// Rotation of the Earth, rad/s, start axes.
    pub rotation: Vector3<f64>,
}

/// The properties of the Earth at a place, and the local axes there.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    position: Vector3<f64>,
    at: Coordinates,
    /// Metres per rad of latitude and of longitude.
    metres: [f64; 2],
    /// Gravity, m/s², start axes.
    pub gravity: Vector3<f64>,
    /// Turns local NED axes into start axes.
    pub start_from_ned: Matrix3<f64>,
    ned_from_start: UnitQuaternion<f64>,
}

impl Earth {
    /// The Earth on which both forms of the position of a fix agree.
    pub fn through(shape: EarthShape, fix: &GnssFix) -> Self {
        let here = Coordinates {
            latitude: fix.latitude_rad,
            longitude: fix.longitude_rad,
            altitude: fix.altitude_m,
        };
        match shape {
            EarthShape::Flat => {
                let mut start = here;
                // The scale of a radian depends on the start that is sought.
                for _ in 0..START_STEPS {
                    let [north_m, east_m] = metres_per_radian(start.latitude);
                    start.latitude = here.latitude - fix.position.0.x / north_m;
                    start.longitude = here.longitude - fix.position.0.y / east_m;
                }
                let (origin, axes) = (Vector3::zeros(), Matrix3::identity());
                let rotation = Vector3::zeros();
                Self { shape, origin, centred_from_start: axes, start, rotation }
            }
            EarthShape::Wgs84 => {
                let centred = centred(&here);
                let mut start = here;
                let mut origin = centred;
                // The axes in which the offset is given depend on the start that is sought.
                for _ in 0..START_STEPS {
                    origin = centred - axes(&start) * fix.position.0;
                    start = geodetic(&origin);
                }
                let axes = axes(&start);
                let rotation = axes.transpose() * Vector3::new(0.0, 0.0, ROTATION_RAD_S);
                Self { shape, origin, centred_from_start: axes, start, rotation }
            }
        }
    }

    /// The place at a position, m, start axes.
    pub fn place(&self, position: &Vector3<f64>) -> Place {
        if self.shape == EarthShape::Flat {
            let [north_m, east_m] = metres_per_radian(self.start.latitude);
            let at = Coordinates {
                latitude: self.start.latitude + position.x / north_m,
                longitude: self.start.longitude + position.y / east_m,
                altitude: -position.z,
            };
            return Place {
                position: *position,
                at,
                metres: [north_m, east_m],
                gravity: Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_S2),
                start_from_ned: Matrix3::identity(),
                ned_from_start: UnitQuaternion::identity(),
            };
        }
        let centred = self.origin + self.centred_from_start * position;
        let at = geodetic(&centred);
        let start_from_ned = self.centred_from_start.transpose() * axes(&at);
        let rotation = Rotation3::from_matrix_unchecked(start_from_ned.transpose());
        let [north_m, east_m] = metres_per_radian(at.latitude);
        let cosine = libm::cos(at.latitude).max(COSINE_MIN);
        Place {
            position: *position,
            at,
            // Up here a radian is longer by the altitude.
            metres: [north_m + at.altitude, east_m + at.altitude * cosine],
            gravity: self.centred_from_start.transpose() * gravity(&centred),
            start_from_ned,
            ned_from_start: UnitQuaternion::from_rotation_matrix(&rotation),
        }
    }
}

impl Place {
    /// A vector from start axes to local ones.
    pub fn ned(&self, v: &Vector3<f64>) -> Ned {
        Ned(self.start_from_ned.tr_mul(v))
    }

    /// Attitude relative to the local axes, from that relative to start axes.
    pub fn attitude(&self, start_from_body: &UnitQuaternion<f64>) -> Attitude {
        Attitude { q_ned_from_body: self.ned_from_start * start_from_body }
    }

    /// Up, start axes.
    pub fn up(&self) -> Vector3<f64> {
        -self.start_from_ned.column(2)
    }

    /// Latitude and longitude, rad, and altitude, m, of a position near this place.
    pub fn coordinates(&self, position: &Vector3<f64>) -> [f64; 3] {
        // The place is of the last update, 10 ms ago at most; so near, a plane is good enough and needs no sine.
        let away = self.ned(&(position - self.position)).0;
        [
            self.at.latitude + away.x / self.metres[0],
            self.at.longitude + away.y / self.metres[1],
            self.at.altitude - away.z,
        ]
    }
}

/// Metres per rad of latitude and of longitude at altitude zero.
pub fn metres_per_radian(latitude: f64) -> [f64; 2] {
    let (sin, cos) = libm::sincos(latitude);
    let w2 = 1.0 - E2 * sin * sin;
    let normal = SEMI_MAJOR_M / libm::sqrt(w2);
    [normal * (1.0 - E2) / w2, normal * cos.max(COSINE_MIN)]
}

/// Earth-centred, Earth-fixed position, m.
fn centred(at: &Coordinates) -> Vector3<f64> {
    let (sin, cos) = libm::sincos(at.latitude);
    let (sin_l, cos_l) = libm::sincos(at.longitude);
    let normal = SEMI_MAJOR_M / libm::sqrt(1.0 - E2 * sin * sin);
    let out = (normal + at.altitude) * cos;
    Vector3::new(out * cos_l, out * sin_l, (normal * (1.0 - E2) + at.altitude) * sin)
}

/// Coordinates of an Earth-centred position.
fn geodetic(position: &Vector3<f64>) -> Coordinates {
    let (x, y, z) = (position.x, position.y, position.z);
    // On the axis of the Earth there is no distance from it to divide by.
    let out = libm::sqrt(x * x + y * y).max(1.0);
    // tan of the latitude by iteration; near the surface each step gains a factor of 1/E2.
    let mut tan = z / (out * (1.0 - E2));
    for _ in 0..LATITUDE_STEPS {
        let sin2 = tan * tan / (1.0 + tan * tan);
        let normal = SEMI_MAJOR_M / libm::sqrt(1.0 - E2 * sin2);
        tan = (z + E2 * normal * tan / libm::sqrt(1.0 + tan * tan)) / out;
    }
    let cos = 1.0 / libm::sqrt(1.0 + tan * tan);
    let sin = tan * cos;
    let normal = SEMI_MAJOR_M / libm::sqrt(1.0 - E2 * sin * sin);
    // p cos + z sin - N (1 - e² sin²): without a division by a small number at any latitude.
    let altitude = out * cos + z * sin - normal * (1.0 - E2 * sin * sin);
    Coordinates { latitude: libm::atan(tan), longitude: libm::atan2(y, x), altitude }
}

/// Columns: north, east, down in Earth-centred axes.
fn axes(at: &Coordinates) -> Matrix3<f64> {
    let (sp, cp) = libm::sincos(at.latitude);
    let (sl, cl) = libm::sincos(at.longitude);
    Matrix3::new(-sp * cl, -sl, -cp * cl, -sp * sl, cl, -cp * sl, cp, 0.0, -sp)
}

/// Gravitation with J2 and centrifugal acceleration, m/s², Earth-centred axes.
fn gravity(position: &Vector3<f64>) -> Vector3<f64> {
    let (x, y, z) = (position.x, position.y, position.z);
    // Only a position that is no aircraft's is so near the centre; it must not divide by zero.
    let r2 = position.norm_squared().max(1.0e12);
    let strength = -GM / (r2 * libm::sqrt(r2));
    let oblate = 1.5 * J2 * SEMI_MAJOR_M * SEMI_MAJOR_M / r2;
    let polar = 5.0 * z * z / r2;
    let equatorial = strength * (1.0 - oblate * (polar - 1.0));
    let spin = ROTATION_RAD_S * ROTATION_RAD_S;
    Vector3::new(
        (equatorial + spin) * x,
        (equatorial + spin) * y,
        strength * (1.0 - oblate * (polar - 3.0)) * z,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fix(position: [f64; 3], coordinates: [f64; 3]) -> GnssFix {
        let [latitude_rad, longitude_rad, altitude_m] = coordinates;
        let position = Ned(position.into());
        let velocity = Ned::zero();
        let decimal_year = 2_026.0;
        GnssFix { velocity, position, latitude_rad, longitude_rad, altitude_m, decimal_year }
    }

    #[test]
    fn the_earth_through_a_fix_gives_its_coordinates_back() {
        for shape in [EarthShape::Wgs84, EarthShape::Flat] {
            for latitude in [-1.2, 0.0, 0.609, 1.3] {
                for position in [[0.0, 0.0, -5_000.0], [60_000.0, -40_000.0, -4_600.0]] {
                    let rough = fix(position, [latitude, -2.058, 5_000.0]);
                    // The altitude that the position has on this Earth, so that the start point is at altitude zero.
                    let mut altitude = -position[2];
                    for _ in 0..5 {
                        let fix = GnssFix { altitude_m: altitude, ..rough };
                        if shape == EarthShape::Wgs84 {
                            let start = Earth::through(shape, &fix).place(&Vector3::zeros());
                            altitude -= start.at.altitude;
                        }
                    }
                    let fix = GnssFix { altitude_m: altitude, ..rough };
                    let earth = Earth::through(shape, &fix);
                    let at = earth.place(&fix.position.0).coordinates(&fix.position.0);
                    for (found, expected) in at.iter().zip([latitude, -2.058, altitude]) {
                        let room = 1.0e-9 * expected.abs().max(1.0);
                        assert!((found - expected).abs() < room, "{shape:?} {found} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn gravity_is_that_of_the_normal_ellipsoid_and_points_down() {
        // Normal gravity of WGS-84 (NIMA TR8350.2): 9.7803 m/s² at the equator, 9.8322 m/s² at the poles.
        for (latitude, expected) in [(0.0, 9.7803), (1.5, 9.8322)] {
            let at = fix([0.0; 3], [latitude, 0.4, 0.0]);
            let place = Earth::through(EarthShape::Wgs84, &at).place(&Vector3::zeros());
            assert!((place.gravity.norm() - expected).abs() < 4.0e-4, "{}", place.gravity.norm());
            assert!((place.up() * place.gravity.norm() + place.gravity).norm() < 1.0e-4);
        }
    }

    #[test]
    fn the_ellipsoid_falls_away_from_the_start_axes() {
        let earth = Earth::through(EarthShape::Wgs84, &fix([0.0; 3], [0.6, 0.1, 0.0]));
        // d²/2R after 10 km: 7.8 m.
        let [.., altitude] =
            earth.place(&Vector3::zeros()).coordinates(&Vector3::new(10_000.0, 0.0, 0.0));
        assert!(altitude.abs() < 1.0e-6, "in the plane of the place: {altitude}");
        let away = Vector3::new(10_000.0, 0.0, 0.0);
        let [.., altitude] = earth.place(&away).coordinates(&away);
        assert!((altitude - 7.86).abs() < 0.02, "{altitude}");
    }
}
