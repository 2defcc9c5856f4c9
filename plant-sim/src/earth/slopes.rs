//! Change of the Earth's properties from one place to the next: what a stage of the integration needs between two ticks.
//!
//! At every tick the vertical, the height and the gravity are computed in full. Inside a step the
//! aircraft moves by a metre, a ten-millionth of the radius, and there the first or second term of a series is
//! all that an f64 can resolve; it needs no root and no division.

use std::f64::consts::{PI, TAU};

use icd::Ned;
use nalgebra::{Matrix3, Vector3};

use super::{
    Earth, EarthModel, GEOPOTENTIAL_RADIUS_M, GRAVITATIONAL_PARAMETER, J2, Nearby, Place,
    ROTATION_RAD_S,
};
use crate::geodesy::{self, Geodetic, SEMI_MAJOR_M};

/// The slopes are valid within this distance of the place that they were computed for, m.
const GOOD_FOR_M: f64 = 10.0;
/// Farther than this from its start a step uses the full formulas, m: the third term of the height
/// would reach 1e-8 m.
const REACH_M: f64 = 100.0;
/// Nearer than this to the axis of rotation, m, north and east turn too quickly for a series.
const AXIS_M: f64 = 1.0e5;

/// 1/m.
const PER_GEOPOTENTIAL_RADIUS: f64 = 1.0 / GEOPOTENTIAL_RADIUS_M;

/// First derivatives of gravity and vertical, second ones of the height.
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
        if (position - self.position).norm_squared() >= self.reach_m2 {
            return earth.geodetic(position);
        }
        let (latitude, longitude) = place.angles();
        let longitude_rad = self.geodetic.longitude_rad + difference(longitude, self.longitude);
        Geodetic {
            latitude_rad: self.geodetic.latitude_rad + difference(latitude, self.latitude),
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

/// Derivative of [`super::gravitation`] and [`super::centrifugal`] with the position, 1/s².
///
/// With s = -GM/r³, o = 3/2 J2 a²/r² and p = 5 z²/r², the radial part of the gravitation is s (1 - o (p - 1)),
/// and along the axis there is s 2 o more.
fn gravity_gradient(position: &Vector3<f64>) -> Matrix3<f64> {
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
mod tests {
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
