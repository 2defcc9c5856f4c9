//! The Earth: shape, rotation, gravity, and the definitions of "north", "down" and "altitude" at a place.
//!
//! The equations of motion know one formulation: an Earth-fixed frame E that turns with the rate Ω, and a
//! gravity in it. The flat Earth is the case Ω = 0 with constant gravity.

use std::f64::consts::{PI, TAU};

use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{Attitude, Body, Ned, named};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::geodesy::{self, Geodetic, Radii, SEMI_MAJOR_M, Vertical};

/// Gravitational parameter GM, m³/s² (WGS-84 as of the NESC check cases, NASA/TM-2015-218675).
pub const GRAVITATIONAL_PARAMETER: f64 = 3.986_004_418e14;
/// Oblateness J2 of the gravity field (same source).
pub const J2: f64 = 0.001_082_629_82;
/// Rate of rotation, rad/s (same source).
pub const ROTATION_RAD_S: f64 = 7.292_115e-5;
/// Radius of the spherical Earth, m: 20 902 255.199 ft (same source).
pub const SPHERE_RADIUS_M: f64 = 6_371_007.384_655_2;
/// Radius that turns geometric into geopotential height, m (US-1976).
const GEOPOTENTIAL_RADIUS_M: f64 = 6_356_766.0;

named! {
    /// Models of the Earth.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
    EarthModel {
        /// A plane that does not rotate, gravity 9.80665 m/s² downwards: the paper's.
        Flat = "flat",
        /// The WGS-84 ellipsoid, rotating, with J2 gravity.
        Wgs84 = "wgs84",
        /// A rotating sphere, gravitation GM/r² towards its centre; latitude is geocentric.
        Round = "round",
        /// The same sphere without rotation.
        RoundNonRotating = "round_non_rotating",
    }
}

/// The Earth of one flight: the model and where the flight starts.
///
/// Frame E of the flat Earth is NED at the start point, altitude zero; that of the others is Earth-centred,
/// Earth-fixed (z north pole, x latitude and longitude zero).
#[derive(Debug, Clone)]
pub struct Earth {
    model: EarthModel,
    rotation: Vector3<f64>,
    start: Geodetic,
    /// The start point at altitude zero, m, frame E.
    origin: Vector3<f64>,
    e_from_start_ned: Matrix3<f64>,
    /// Metres per radian of latitude and of longitude: only the flat Earth needs them.
    flat_scale_m: (f64, f64),
    /// Gravity of the flat Earth, m/s².
    flat_gravity: f64,
    /// Whether the altitudes over the flat Earth are geometric ones for the standard atmosphere, as over the others.
    is_flat_air_geometric: bool,
}

/// The properties of the Earth at one position.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    /// Height above the ellipsoid or the plane, m.
    pub altitude_m: f64,
    /// Height for the standard atmosphere, m.
    pub geopotential_altitude_m: f64,
    /// Gravitation and centrifugal acceleration together, m/s², frame E: the direction of a plumb line.
    pub gravity: Vector3<f64>,
    /// Columns: local north, east, down in frame E.
    pub e_from_ned: Matrix3<f64>,
}

/// The part of a [`Place`] that affects the motion of an aircraft there, and the steady wind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearby {
    /// Height for the standard atmosphere, m.
    pub geopotential_altitude_m: f64,
    /// Gravity, m/s², frame E.
    pub gravity: Vector3<f64>,
    /// Velocity of the air, m/s, frame E, where it blows to.
    pub wind: Vector3<f64>,
}

impl Earth {
    /// The Earth under a flight that starts at `start`; its altitude does not matter here.
    pub fn new(model: EarthModel, start: Geodetic) -> Self {
        let ground = Geodetic { altitude_m: 0.0, ..start };
        let (sin_latitude, cos_latitude) = libm::sincos(start.latitude_rad);
        let radii = geodesy::radii(sin_latitude);
        let rotation_rad_s = match model {
            EarthModel::Flat | EarthModel::RoundNonRotating => 0.0,
            EarthModel::Wgs84 | EarthModel::Round => ROTATION_RAD_S,
        };
        let mut earth = Self {
            model,
            rotation: Vector3::new(0.0, 0.0, rotation_rad_s),
            start,
            origin: Vector3::zeros(),
            e_from_start_ned: Matrix3::identity(),
            flat_scale_m: (radii.meridian_m, radii.prime_vertical_m * cos_latitude),
            flat_gravity: STANDARD_GRAVITY_M_S2,
            is_flat_air_geometric: false,
        };
        // Frame E of the flat Earth is NED at the start already.
        if model != EarthModel::Flat {
            earth.origin = earth.position(&ground);
            earth.e_from_start_ned = earth.place(&earth.origin).e_from_ned;
        }
        earth
    }

    /// The same with the gravity of a place (m/s²) and the air over it, for a flat Earth that stands for a round one there.
    #[must_use]
    pub fn tangent(self, gravity: f64) -> Self {
        Self { flat_gravity: gravity, is_flat_air_geometric: true, ..self }
    }

    pub fn model(&self) -> EarthModel {
        self.model
    }

    /// Rate Ω of frame E relative to inertial space, rad/s, in E axes.
    #[inline]
    pub fn rotation(&self) -> Vector3<f64> {
        self.rotation
    }

    /// The same in body axes, for a matrix that turns them into frame E: the axis of rotation is the third of E.
    #[inline]
    pub fn rotation_in(&self, e_from_body: &Matrix3<f64>) -> Body {
        let rate = self.rotation.z;
        Body::new(rate * e_from_body.m31, rate * e_from_body.m32, rate * e_from_body.m33)
    }

    /// Vertical, height and gravity at a position (m, frame E). Total: a finite position gives finite values.
    #[inline]
    pub fn place(&self, position: &Vector3<f64>) -> Place {
        match self.model {
            EarthModel::Flat => Place {
                altitude_m: -position.z,
                geopotential_altitude_m: match self.is_flat_air_geometric {
                    true => geopotential_altitude_m(-position.z),
                    false => -position.z,
                },
                gravity: Vector3::new(0.0, 0.0, self.flat_gravity),
                e_from_ned: Matrix3::identity(),
            },
            EarthModel::Wgs84 => {
                let gravity = gravitation(position) + centrifugal(position);
                Place::below(&geodesy::vertical(position), gravity)
            }
            EarthModel::Round | EarthModel::RoundNonRotating => {
                let gravitation = spherical_gravitation(position);
                let rate = self.rotation.z;
                let outwards = Vector3::new(position.x, position.y, 0.0) * (rate * rate);
                let vertical = geodesy::vertical_of_sphere(position, SPHERE_RADIUS_M);
                Place::below(&vertical, gravitation + outwards)
            }
        }
    }

    /// Magnitude of the gravitation at a position (m, frame E), without the centrifugal part, m/s².
    pub fn gravitation_m_s2(&self, position: &Vector3<f64>) -> f64 {
        match self.model {
            EarthModel::Flat => self.flat_gravity,
            EarthModel::Wgs84 => gravitation(position).norm(),
            EarthModel::Round | EarthModel::RoundNonRotating => {
                spherical_gravitation(position).norm()
            }
        }
    }

    /// Radii of curvature at the latitude with this sine; infinite on the flat Earth.
    pub fn radii(&self, sin_latitude: f64) -> Radii {
        let both = |radius_m| Radii { meridian_m: radius_m, prime_vertical_m: radius_m };
        match self.model {
            EarthModel::Flat => both(f64::INFINITY),
            EarthModel::Wgs84 => geodesy::radii(sin_latitude),
            EarthModel::Round | EarthModel::RoundNonRotating => both(SPHERE_RADIUS_M),
        }
    }

    /// Rate at which the local NED axes turn over a round Earth because the aircraft moves, rad/s, NED. `velocity` is that over
    /// the ground, m/s.
    pub fn transport_rate(&self, here: &Geodetic, velocity: &Ned) -> Vector3<f64> {
        if self.model == EarthModel::Flat {
            return Vector3::zeros();
        }
        let (sin, cos) = libm::sincos(here.latitude_rad);
        let radii = self.radii(sin);
        let east = velocity.0.y / (radii.prime_vertical_m + here.altitude_m);
        let north = velocity.0.x / (radii.meridian_m + here.altitude_m);
        Vector3::new(east, -north, -east * sin / cos)
    }

    /// Altitude of a geopotential altitude for the standard atmosphere, m: the inverse of that of [`Place`].
    pub fn altitude_m(&self, geopotential_altitude_m: f64) -> f64 {
        if self.model == EarthModel::Flat && !self.is_flat_air_geometric {
            return geopotential_altitude_m;
        }
        GEOPOTENTIAL_RADIUS_M * geopotential_altitude_m
            / (GEOPOTENTIAL_RADIUS_M - geopotential_altitude_m)
    }

    /// Position of geodetic coordinates, m, frame E.
    ///
    /// On the flat Earth, latitude and longitude are read with the radii of curvature at the start.
    pub fn position(&self, geodetic: &Geodetic) -> Vector3<f64> {
        match self.model {
            EarthModel::Flat => Vector3::new(
                (geodetic.latitude_rad - self.start.latitude_rad) * self.flat_scale_m.0,
                (geodetic.longitude_rad - self.start.longitude_rad) * self.flat_scale_m.1,
                -geodetic.altitude_m,
            ),
            EarthModel::Wgs84 => geodesy::ecef(geodetic),
            EarthModel::Round | EarthModel::RoundNonRotating => {
                geodesy::on_sphere(geodetic, SPHERE_RADIUS_M)
            }
        }
    }

    /// Position of a point in the NED axes of the start point at altitude zero, m, frame E; the inverse of
    /// [`Earth::local_position`].
    pub fn position_of_local(&self, local: &Ned) -> Vector3<f64> {
        self.origin + self.e_from_start_ned * local.0
    }

    /// Geodetic coordinates of a position (m, frame E); the inverse of [`Earth::position`].
    pub fn geodetic(&self, position: &Vector3<f64>) -> Geodetic {
        match self.model {
            EarthModel::Flat => Geodetic {
                latitude_rad: self.start.latitude_rad + position.x / self.flat_scale_m.0,
                longitude_rad: self.start.longitude_rad + position.y / self.flat_scale_m.1,
                altitude_m: -position.z,
            },
            EarthModel::Wgs84 => geodesy::vertical(position).geodetic(),
            EarthModel::Round | EarthModel::RoundNonRotating => {
                geodesy::vertical_of_sphere(position, SPHERE_RADIUS_M).geodetic()
            }
        }
    }

    /// Position from the start point at altitude zero, m, in the NED axes of that point.
    pub fn local_position(&self, position: &Vector3<f64>) -> Ned {
        Ned(self.e_from_start_ned.tr_mul(&(position - self.origin)))
    }

    /// Attitude relative to the local NED axes of a place, from the quaternion (w, x, y, z) that turns body
    /// axes into frame E.
    pub fn attitude(&self, place: &Place, q_e_from_body: &[f64; 4]) -> Attitude {
        match self.model {
            // Frame E is NED at every place of the plane, so the state is the attitude, to the bit.
            EarthModel::Flat => Attitude::from_unit_wxyz(*q_e_from_body),
            _ => {
                let (latitude, longitude) = place.angles();
                let [w, x, y, z] = q_e_from_ned(latitude, longitude);
                // The conjugate of a unit quaternion is its inverse.
                let [w, x, y, z] = product(&[w, -x, -y, -z], q_e_from_body);
                Attitude::from_quaternion(w, x, y, z)
            }
        }
    }

    /// Quaternion (w, x, y, z) that turns body axes into frame E; the inverse of [`Earth::attitude`].
    pub fn q_e_from_body(&self, here: &Geodetic, attitude: &Attitude) -> [f64; 4] {
        match self.model {
            EarthModel::Flat => attitude.wxyz(),
            _ => {
                let latitude = libm::sincos(here.latitude_rad);
                let longitude = libm::sincos(here.longitude_rad);
                product(&q_e_from_ned(latitude, longitude), &attitude.wxyz())
            }
        }
    }
}

/// Gravitation with J2, m/s², Earth-centred axes; without the centrifugal part.
///
/// Formula of the NESC check cases (NASA/TM-2015-218675). Inside the innermost kilometre the radius is held,
/// so that the function stays finite.
#[inline]
pub fn gravitation(position: &Vector3<f64>) -> Vector3<f64> {
    let (x, y, z) = (position.x, position.y, position.z);
    let r2 = (x * x + y * y + z * z).max(1.0e6);
    let per_r2 = 1.0 / r2;
    let strength = -GRAVITATIONAL_PARAMETER * per_r2 / r2.sqrt();
    let oblate = 1.5 * J2 * SEMI_MAJOR_M * SEMI_MAJOR_M * per_r2;
    let polar = 5.0 * z * z * per_r2;
    let equatorial = strength * (1.0 - oblate * (polar - 1.0));
    Vector3::new(equatorial * x, equatorial * y, strength * (1.0 - oblate * (polar - 3.0)) * z)
}

/// Gravitation GM/r² of a sphere, m/s², Earth-centred axes; the radius is held inside the innermost kilometre.
fn spherical_gravitation(position: &Vector3<f64>) -> Vector3<f64> {
    let r2 = position.norm_squared().max(1.0e6);
    position * (-GRAVITATIONAL_PARAMETER / (r2 * r2.sqrt()))
}

/// Centrifugal acceleration -Ω×(Ω×r), m/s², Earth-centred axes.
#[inline]
pub fn centrifugal(position: &Vector3<f64>) -> Vector3<f64> {
    const W2: f64 = ROTATION_RAD_S * ROTATION_RAD_S;
    Vector3::new(W2 * position.x, W2 * position.y, 0.0)
}

/// Geopotential altitude of a geometric one, m (US-1976).
#[inline]
fn geopotential_altitude_m(altitude_m: f64) -> f64 {
    GEOPOTENTIAL_RADIUS_M * altitude_m / (GEOPOTENTIAL_RADIUS_M + altitude_m)
}

impl Place {
    /// The place with this vertical and gravity (m/s², frame E) on a round Earth.
    #[inline]
    fn below(v: &Vertical, gravity: Vector3<f64>) -> Self {
        let (sp, cp) = (v.sin_latitude, v.cos_latitude);
        let (sl, cl) = (v.sin_longitude, v.cos_longitude);
        #[rustfmt::skip]
        let e_from_ned = Matrix3::new(
            -sp * cl, -sl, -cp * cl,
            -sp * sl,  cl, -cp * sl,
                  cp, 0.0,      -sp,
        );
        Self {
            altitude_m: v.altitude_m,
            geopotential_altitude_m: geopotential_altitude_m(v.altitude_m),
            gravity,
            e_from_ned,
        }
    }

    /// The effect on the motion of an aircraft here, in a steady wind (m/s, local NED).
    #[inline]
    pub fn nearby(&self, wind: &Ned) -> Nearby {
        Nearby {
            geopotential_altitude_m: self.geopotential_altitude_m,
            gravity: self.gravity,
            wind: self.e_from_ned * wind.0,
        }
    }

    /// Sine and cosine of the geodetic latitude, and of the longitude (round Earth).
    fn angles(&self) -> ((f64, f64), (f64, f64)) {
        // The matrix has them already; signs and places are those of `below`.
        let m = &self.e_from_ned;
        ((-m.m33, m.m31), (-m.m12, m.m22))
    }
}

/// Turns NED axes into Earth-centred ones: longitude about z, then -(90° + latitude) about y. Both angles
/// by sine and cosine.
fn q_e_from_ned(latitude: (f64, f64), longitude: (f64, f64)) -> [f64; 4] {
    let (sin_l, cos_l) = half(longitude);
    // sin and cos of 90° + latitude.
    let (sin_p, cos_p) = half((latitude.1, -latitude.0));
    [cos_l * cos_p, sin_l * sin_p, -cos_l * sin_p, sin_l * cos_p]
}

/// Sine and cosine of half an angle in (-180°, 180°], without trigonometry and without cancellation.
fn half((sin, cos): (f64, f64)) -> (f64, f64) {
    // The root is taken of a half at least, so nothing cancels near 180 degrees.
    if cos >= 0.0 {
        let cos_half = (0.5 * (1.0 + cos)).sqrt();
        (0.5 * sin / cos_half, cos_half)
    } else {
        let sin_half = (0.5 * (1.0 - cos)).sqrt().copysign(sin);
        (sin_half, 0.5 * sin / sin_half)
    }
}

/// Quaternion product a b, scalar part first.
fn product(a: &[f64; 4], b: &[f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The slopes are valid within this distance of the place that they were computed for, m.
const GOOD_FOR_M: f64 = 10.0;
/// Farther than this from its start a step uses the full formulas, m: the third term of the height
/// would reach 1e-8 m.
const REACH_M: f64 = 100.0;
/// Nearer than this to the axis of rotation, m, north and east turn too quickly for a series.
const AXIS_M: f64 = 1.0e5;

/// 1/m.
const PER_GEOPOTENTIAL_RADIUS: f64 = 1.0 / GEOPOTENTIAL_RADIUS_M;

/// First derivatives of gravity and vertical, second ones of the height: what a stage of the integration needs between two ticks.
///
/// At every tick the vertical, the height and the gravity are computed in full. Inside a step the aircraft moves by a metre, a
/// ten-millionth of the radius, and there the first or second term of a series is all that an f64 can resolve; it needs no root and
/// no division.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slopes {
    position: Vector3<f64>,
    /// Square of the range of the series, m²; zero for none.
    reach_m2: f64,
    /// Change of the gravity with the position, 1/s².
    gravity: Matrix3<f64>,
    /// Curvature of the ellipsoid's parallel surface to the north and to the east, 1/m.
    curvature: (f64, f64),
    tan_latitude: f64,
    geodetic: Geodetic,
    /// Sine and cosine of latitude and longitude.
    latitude: (f64, f64),
    longitude: (f64, f64),
}

impl Slopes {
    /// At a position (m, frame E) where the Earth is `place`.
    pub fn at(earth: &Earth, position: &Vector3<f64>, place: &Place) -> Self {
        let (latitude, longitude) = place.angles();
        let (sin, cos) = latitude;
        let radii = geodesy::radii(sin);
        let horizontal = (position.x * position.x + position.y * position.y).sqrt();
        // The slopes are derived for the ellipsoid alone.
        let usable = earth.model == EarthModel::Wgs84 && horizontal > AXIS_M;
        Self {
            position: *position,
            reach_m2: if usable { REACH_M * REACH_M } else { 0.0 },
            gravity: gravity_gradient(position),
            curvature: (
                1.0 / (radii.meridian_m + place.altitude_m),
                1.0 / (radii.prime_vertical_m + place.altitude_m),
            ),
            tan_latitude: sin / cos,
            geodetic: earth.geodetic(position),
            latitude,
            longitude,
        }
    }

    /// Whether they are valid at this position (m, frame E); otherwise they have to be computed again.
    #[inline]
    pub fn cover(&self, position: &Vector3<f64>) -> bool {
        (position - self.position).norm_squared() <= GOOD_FOR_M * GOOD_FOR_M
    }

    /// Geodetic coordinates of a position (m, frame E) where the Earth is `place`: those of
    /// [`Earth::geodetic`] to rounding.
    #[inline]
    pub fn geodetic(&self, earth: &Earth, position: &Vector3<f64>, place: &Place) -> Geodetic {
        // Where there is no series the reach is zero, and every place is beyond it.
        if (position - self.position).norm_squared() >= self.reach_m2 {
            return earth.geodetic(position);
        }
        let (latitude, longitude) = place.angles();
        let longitude_rad = self.geodetic.longitude_rad + difference(longitude, self.longitude);
        Geodetic {
            latitude_rad: self.geodetic.latitude_rad + difference(latitude, self.latitude),
            // A flight over the date line leaves (-180°, 180°].
            longitude_rad: if longitude_rad.abs() > PI {
                longitude_rad - TAU.copysign(longitude_rad)
            } else {
                longitude_rad
            },
            altitude_m: place.altitude_m,
        }
    }

    /// The Earth at `position`, a step away from `start` where it is `here`, and the steady wind (m/s, NED).
    ///
    /// Within a metre the height is exact to rounding and the gravity to 1e-11 m/s²; far away, and on the
    /// flat Earth, both are those of [`Earth::place`].
    #[inline]
    pub fn nearby(
        &self,
        earth: &Earth,
        start: &Vector3<f64>,
        here: &Place,
        position: &Vector3<f64>,
        wind: &Ned,
    ) -> Nearby {
        let way = position - start;
        if way.norm_squared() < self.reach_m2 {
            self.along(here, &way, wind)
        } else {
            earth.place(position).nearby(wind)
        }
    }

    #[inline]
    fn along(&self, here: &Place, way: &Vector3<f64>, wind: &Ned) -> Nearby {
        let ned = here.e_from_ned.tr_mul(way);
        let (north, east) = (ned.x * self.curvature.0, ned.y * self.curvature.1);
        // Along a tangent the height grows by half of the curvature times the square of the way.
        let rise = 0.5 * (ned.x * north + ned.y * east) - ned.z;
        // R / (R + h), whose square is the change of R h / (R + h) with h.
        let ratio = 1.0 - PER_GEOPOTENTIAL_RADIUS * here.geopotential_altitude_m;
        let potential = ratio * ratio * rise * (1.0 - PER_GEOPOTENTIAL_RADIUS * ratio * rise);
        Nearby {
            geopotential_altitude_m: here.geopotential_altitude_m + potential,
            gravity: here.gravity + self.gravity * way,
            wind: if *wind == Ned::zero() {
                wind.0
            } else {
                // The axes turn about west when the aircraft moves north, and about the pole when it moves east.
                let turn = Vector3::new(east, -north, -east * self.tan_latitude);
                here.e_from_ned * (wind.0 + turn.cross(&wind.0))
            },
        }
    }
}

/// Difference of two angles (sine and cosine) that are no more than 1e-3 rad apart, rad: the arc sine of its
/// sine, whose next term would be 1e-16.
#[inline]
fn difference((sin, cos): (f64, f64), (sin_0, cos_0): (f64, f64)) -> f64 {
    let x = sin * cos_0 - cos * sin_0;
    x + x * x * x / 6.0
}

/// Derivative of [`gravitation`] and [`centrifugal`] with the position, 1/s².
///
/// With s = -GM/r³, o = 3/2 J2 a²/r² and p = 5 z²/r², the radial part of the gravitation is s (1 - o (p - 1)),
/// and along the axis there is s 2 o more.
fn gravity_gradient(position: &Vector3<f64>) -> Matrix3<f64> {
    // The bound of `gravitation`, whose derivative this is.
    let r2 = position.norm_squared().max(1.0e6);
    let strength = -GRAVITATIONAL_PARAMETER / (r2 * r2.sqrt());
    let oblate = 1.5 * J2 * SEMI_MAJOR_M * SEMI_MAJOR_M / r2;
    let polar = 5.0 * position.z * position.z / r2;
    let radial = 1.0 - oblate * (polar - 1.0);
    let outer = (strength / r2) * (position * position.transpose());
    let all = oblate * (4.0 * polar - 2.0) - 3.0 * radial;
    let mut gradient = outer * all + Matrix3::from_diagonal_element(strength * radial);
    for i in 0..3 {
        // Twice on the diagonal: once as the row, once as the column of z.
        gradient[(2, i)] -= 10.0 * oblate * outer[(2, i)];
        gradient[(i, 2)] -= 10.0 * oblate * outer[(i, 2)];
    }
    let turning = ROTATION_RAD_S * ROTATION_RAD_S;
    gradient + Matrix3::from_diagonal(&Vector3::new(turning, turning, 2.0 * strength * oblate))
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod slopes_tests {
    use super::*;
    use crate::geodesy::Geodetic;
    use proptest::prelude::*;

    const WIND: Ned = Ned::new(12.0, -9.0, 2.0);

    fn earth(model: EarthModel, latitude_deg: f64, altitude_m: f64) -> (Earth, Vector3<f64>) {
        let start =
            Geodetic { latitude_rad: latitude_deg.to_radians(), longitude_rad: -1.3, altitude_m };
        let earth = Earth::new(model, start);
        let position = earth.position(&start);
        (earth, position)
    }

    proptest! {
        #[test]
        fn within_a_step_the_series_is_the_earth(
            latitude_deg in -85.0..85.0, altitude_m in 0.0..20_000.0,
            since in proptest::array::uniform3(-5.5..5.5), way in proptest::array::uniform3(-1.0..1.0),
        ) {
            let (earth, at) = earth(EarthModel::Wgs84, latitude_deg, altitude_m);
            let slopes = Slopes::at(&earth, &at, &earth.place(&at));
            let start = at + Vector3::from(since);
            prop_assert!(slopes.cover(&start));
            let position = start + Vector3::from(way);
            let ours = slopes.nearby(&earth, &start, &earth.place(&start), &position, &WIND);
            let place = earth.place(&position);
            let exact = place.nearby(&WIND);
            // Rounding of distances to the centre of the Earth, numbers with a spacing of 9.3e-10 m; 5.03e-9 m is
            // the largest error found, and none of 30 million positions has 6e-9. Without the square of the distance over the
            // radius it would be up to 2e-7.
            let rise = ours.geopotential_altitude_m - exact.geopotential_altitude_m;
            prop_assert!(rise.abs() < 6e-9, "{} m", rise);
            // Square of distance over radius, and slopes from some metres away.
            let gravity = (ours.gravity - exact.gravity).norm();
            prop_assert!(gravity < 2e-11, "{} m/s2", gravity);
            // Distance flown and distance to the slopes over radius, tangent of the latitude squared, wind.
            let wind = (ours.wind - exact.wind).norm();
            prop_assert!(wind < 1e-9, "{} m/s", wind);
            let (ours, exact) = (slopes.geodetic(&earth, &position, &place), earth.geodetic(&position));
            // Rounding of sines, cosines and the angle itself.
            prop_assert!((ours.latitude_rad - exact.latitude_rad).abs() < 1e-15);
            prop_assert!((ours.longitude_rad - exact.longitude_rad).abs() < 2e-15);
        }
    }

    #[test]
    fn the_longitude_goes_round_at_the_date_line() {
        for (degrees, way) in [(180.0, -0.5), (-180.0, 0.5)] {
            let start = Geodetic {
                latitude_rad: 0.5,
                longitude_rad: f64::to_radians(degrees),
                altitude_m: 0.0,
            };
            let earth = Earth::new(EarthModel::Wgs84, start);
            let at = earth.position(&start) + Vector3::new(0.0, -way, 0.0);
            let slopes = Slopes::at(&earth, &at, &earth.place(&at));
            let position = at + Vector3::new(0.0, 2.0 * way, 0.0);
            let ours = slopes.geodetic(&earth, &position, &earth.place(&position)).longitude_rad;
            let exact = earth.geodetic(&position).longitude_rad;
            assert!((ours - exact).abs() < 2e-15, "{ours} instead of {exact} rad");
            assert!(
                exact * earth.geodetic(&at).longitude_rad < 0.0,
                "{exact} rad is on the same side"
            );
        }
    }

    #[test]
    fn far_away_at_the_pole_and_on_the_flat_earth_the_full_formulas_apply() {
        let far = Vector3::new(300.0, -200.0, 100.0);
        for (model, latitude_deg, way) in [
            (EarthModel::Wgs84, 50.0, far),
            (EarthModel::Wgs84, 90.0, 0.001 * far),
            (EarthModel::Flat, 50.0, 0.001 * far),
        ] {
            let (earth, start) = earth(model, latitude_deg, 5_000.0);
            let here = earth.place(&start);
            let position = start + way;
            let slopes = Slopes::at(&earth, &start, &here);
            let ours = slopes.nearby(&earth, &start, &here, &position, &WIND);
            let exact = earth.place(&position).nearby(&WIND);
            assert_eq!(ours, exact, "{model:?}, {latitude_deg} deg");
        }
    }
}
