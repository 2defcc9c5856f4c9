//! The Earth's magnetic field: the World Magnetic Model 2025 (NOAA/NCEI and BGS, degree and order 12, valid from 2025.0 to 2030.0).
//!
//! Formulas and symbols are those of its technical report (Chulliat et al., The US/UK World Magnetic Model for 2025-2030, section 1.2),
//! with the Schmidt semi-normalised associated Legendre functions of the colatitude θ'. The coefficients are those of its file
//! WMM.COF of 2024-11-13, which is in the public domain.

use crate::frames::Ned;

/// First date of the model, years.
pub const FROM_YEAR: f64 = 2_025.0;

/// Last date of the model, years.
pub const TO_YEAR: f64 = 2_030.0;

/// Degree and order of the model.
const DEGREE: usize = 12;

/// Geomagnetic reference radius, m.
const RADIUS_M: f64 = 6_371_200.0;

/// Semi-major axis of the WGS-84 ellipsoid, m.
const SEMI_MAJOR_M: f64 = 6_378_137.0;

/// First eccentricity squared of the WGS-84 ellipsoid, f (2 - f) with 1/f = 298.257223563.
const ECCENTRICITY_2: f64 = 0.006_694_379_990_141_32;

/// Least sine of the colatitude: at the poles east and north have no meaning, and this stands in.
const SINE_MIN: f64 = 1.0e-9;

/// g, h in nT and their change, nT/year, for n from 1 and m from 0 to n.
const COEFFICIENTS: [[f64; 4]; 90] = include!("../data/wmm2025.in");

/// Magnetic field, nT, in the NED axes of a place: geodetic latitude and longitude, rad, altitude above the ellipsoid, m, date in years.
///
/// A date outside [`FROM_YEAR`] to [`TO_YEAR`] counts as the nearer end; every finite place gives a finite field.
pub fn field_ned_nt(latitude_rad: f64, longitude_rad: f64, altitude_m: f64, year: f64) -> Ned {
    let (sin, cos) = libm::sincos(latitude_rad);
    // Geocentric radius and latitude φ' of the place; above its altitude no aircraft flies.
    let normal_m = SEMI_MAJOR_M / libm::sqrt(1.0 - ECCENTRICITY_2 * sin * sin);
    let altitude_m = altitude_m.clamp(-1.0e4, 1.0e6);
    let out_m = (normal_m + altitude_m) * cos;
    let up_m = (normal_m * (1.0 - ECCENTRICITY_2) + altitude_m) * sin;
    let radius_m = libm::hypot(out_m, up_m);
    let (cosine, sine) = (up_m / radius_m, (out_m / radius_m).max(SINE_MIN));

    let years = year.clamp(FROM_YEAR, TO_YEAR) - FROM_YEAR;
    let [north, east, down] = spherical(cosine, sine, RADIUS_M / radius_m, longitude_rad, years);

    // From geocentric to geodetic axes, by φ' - φ.
    let (sin_turn, cos_turn) = (cosine * cos - sine * sin, sine * cos + cosine * sin);
    Ned::new(north * cos_turn - down * sin_turn, east, north * sin_turn + down * cos_turn)
}

/// Field along geocentric north, east and down, nT, from cosine and sine of the colatitude and the ratio of the radii.
fn spherical(cosine: f64, sine: f64, ratio: f64, longitude_rad: f64, years: f64) -> [f64; 3] {
    // Cosine and sine of m λ.
    let (sin, cos) = libm::sincos(longitude_rad);
    let mut multiples = [(1.0, 0.0); DEGREE + 1];
    // By the addition theorem: one sine and one cosine serve all orders.
    for m in 1..=DEGREE {
        let (c, s) = multiples[m - 1];
        multiples[m] = (c * cos - s * sin, s * cos + c * sin);
    }
    // P and dP/dθ' of the degrees n - 1 and n - 2.
    let mut last = [[0.0; 2]; DEGREE + 1];
    let mut before = last;
    last[0] = [1.0, 0.0];
    let (mut north, mut east, mut down) = (0.0, 0.0, 0.0);
    let mut power = ratio * ratio;
    let mut coefficients = COEFFICIENTS.iter();
    for n in 1..=DEGREE {
        power *= ratio;
        let mut present = [[0.0; 2]; DEGREE + 1];
        for m in 0..=n {
            let legendre = legendre(n, m, cosine, sine, &last, &before);
            present[m] = legendre;
            let [p, slope] = legendre;
            let Some([g, h, g_dot, h_dot]) = coefficients.next() else { break };
            let (g, h) = (g + years * g_dot, h + years * h_dot);
            let (c, s) = multiples[m];
            let along = g * c + h * s;
            north += power * along * slope;
            east += power * m as f64 * (g * s - h * c) * p / sine;
            down -= power * (n + 1) as f64 * along * p;
        }
        (before, last) = (last, present);
    }
    [north, east, down]
}

/// P and dP/dθ' of degree n and order m, from those of the two degrees before.
fn legendre(
    n: usize,
    m: usize,
    cosine: f64,
    sine: f64,
    last: &[[f64; 2]; DEGREE + 1],
    before: &[[f64; 2]; DEGREE + 1],
) -> [f64; 2] {
    let (degree, order) = (n as f64, m as f64);
    if n == m {
        let [p, slope] = last[n - 1];
        let factor = if n == 1 { 1.0 } else { libm::sqrt(1.0 - 0.5 / degree) };
        return [factor * sine * p, factor * (sine * slope + cosine * p)];
    }
    let ([p1, slope1], [p2, slope2]) = (last[m], before[m]);
    let (first, second) = (2.0 * degree - 1.0, (degree - 1.0) * (degree - 1.0) - order * order);
    // For m = n - 1 there is no second term.
    let second = libm::sqrt(second.max(0.0));
    let scale = 1.0 / libm::sqrt(degree * degree - order * order);
    [
        scale * (first * cosine * p1 - second * p2),
        scale * (first * (cosine * slope1 - sine * p1) - second * slope2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Latitude, longitude, deg; altitude, m; year; north, east and down, nT. The first three places are among those of the report's
    /// table of test values; all numbers are those of pygeomag 1.1.0, another implementation, with the file of the model.
    #[rustfmt::skip]
    const POINTS: [[f64; 7]; 7] = [
        [80.0, 0.0, 0.0, 2_025.0, 6_521.6, 145.9, 54_791.5],
        [0.0, 120.0, 0.0, 2_025.0, 39_677.8, -109.6, -10_580.2],
        [-80.0, 240.0, 100_000.0, 2_025.0, 5_907.6, 14_780.3, -49_540.7],
        [34.9, -117.9, 5_000.0, 2_026.9, 23_031.4, 4_645.5, 39_938.6],
        [52.0, 13.0, 15_000.0, 2_029.5, 18_773.3, 1_758.1, 46_018.2],
        [-33.0, 151.0, 300.0, 2_027.25, 24_540.2, 5_400.0, -50_635.7],
        [89.9, -45.0, 0.0, 2_028.0, 1_671.6, -773.5, 56_906.1],
    ];

    #[test]
    fn val_the_field_agrees_with_another_implementation() {
        for [latitude, longitude, altitude_m, year, north, east, down] in POINTS {
            let field =
                field_ned_nt(latitude.to_radians(), longitude.to_radians(), altitude_m, year).0;
            let difference = (field - nalgebra::Vector3::new(north, east, down)).norm();
            // Rounded to 0.1 nT.
            assert!(difference < 0.2, "{latitude} {longitude}: {field} differs by {difference} nT");
        }
    }

    #[test]
    fn every_place_and_date_has_a_finite_field() {
        for latitude_rad in [-core::f64::consts::FRAC_PI_2, 0.0, core::f64::consts::FRAC_PI_2, 3.0]
        {
            for year in [0.0, 2_025.0, 3_000.0] {
                let field = field_ned_nt(latitude_rad, 1.0, 1.0e9, year).0;
                assert!(field.iter().all(|part| part.abs() < 1.0e5), "{field}");
            }
        }
    }
}
