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
#[rustfmt::skip]
const COEFFICIENTS: [[f64; 4]; 90] = [
    [-29_351.8, 0.0, 12.0, 0.0], // 1 0
    [-1_410.8, 4_545.4, 9.7, -21.5], // 1 1
    [-2_556.6, 0.0, -11.6, 0.0], // 2 0
    [2_951.1, -3_133.6, -5.2, -27.7], // 2 1
    [1_649.3, -815.1, -8.0, -12.1], // 2 2
    [1_361.0, 0.0, -1.3, 0.0], // 3 0
    [-2_404.1, -56.6, -4.2, 4.0], // 3 1
    [1_243.8, 237.5, 0.4, -0.3], // 3 2
    [453.6, -549.5, -15.6, -4.1], // 3 3
    [895.0, 0.0, -1.6, 0.0], // 4 0
    [799.5, 278.6, -2.4, -1.1], // 4 1
    [55.7, -133.9, -6.0, 4.1], // 4 2
    [-281.1, 212.0, 5.6, 1.6], // 4 3
    [12.1, -375.6, -7.0, -4.4], // 4 4
    [-233.2, 0.0, 0.6, 0.0], // 5 0
    [368.9, 45.4, 1.4, -0.5], // 5 1
    [187.2, 220.2, 0.0, 2.2], // 5 2
    [-138.7, -122.9, 0.6, 0.4], // 5 3
    [-142.0, 43.0, 2.2, 1.7], // 5 4
    [20.9, 106.1, 0.9, 1.9], // 5 5
    [64.4, 0.0, -0.2, 0.0], // 6 0
    [63.8, -18.4, -0.4, 0.3], // 6 1
    [76.9, 16.8, 0.9, -1.6], // 6 2
    [-115.7, 48.8, 1.2, -0.4], // 6 3
    [-40.9, -59.8, -0.9, 0.9], // 6 4
    [14.9, 10.9, 0.3, 0.7], // 6 5
    [-60.7, 72.7, 0.9, 0.9], // 6 6
    [79.5, 0.0, -0.0, 0.0], // 7 0
    [-77.0, -48.9, -0.1, 0.6], // 7 1
    [-8.8, -14.4, -0.1, 0.5], // 7 2
    [59.3, -1.0, 0.5, -0.8], // 7 3
    [15.8, 23.4, -0.1, 0.0], // 7 4
    [2.5, -7.4, -0.8, -1.0], // 7 5
    [-11.1, -25.1, -0.8, 0.6], // 7 6
    [14.2, -2.3, 0.8, -0.2], // 7 7
    [23.2, 0.0, -0.1, 0.0], // 8 0
    [10.8, 7.1, 0.2, -0.2], // 8 1
    [-17.5, -12.6, 0.0, 0.5], // 8 2
    [2.0, 11.4, 0.5, -0.4], // 8 3
    [-21.7, -9.7, -0.1, 0.4], // 8 4
    [16.9, 12.7, 0.3, -0.5], // 8 5
    [15.0, 0.7, 0.2, -0.6], // 8 6
    [-16.8, -5.2, -0.0, 0.3], // 8 7
    [0.9, 3.9, 0.2, 0.2], // 8 8
    [4.6, 0.0, -0.0, 0.0], // 9 0
    [7.8, -24.8, -0.1, -0.3], // 9 1
    [3.0, 12.2, 0.1, 0.3], // 9 2
    [-0.2, 8.3, 0.3, -0.3], // 9 3
    [-2.5, -3.3, -0.3, 0.3], // 9 4
    [-13.1, -5.2, 0.0, 0.2], // 9 5
    [2.4, 7.2, 0.3, -0.1], // 9 6
    [8.6, -0.6, -0.1, -0.2], // 9 7
    [-8.7, 0.8, 0.1, 0.4], // 9 8
    [-12.9, 10.0, -0.1, 0.1], // 9 9
    [-1.3, 0.0, 0.1, 0.0], // 10 0
    [-6.4, 3.3, 0.0, 0.0], // 10 1
    [0.2, 0.0, 0.1, -0.0], // 10 2
    [2.0, 2.4, 0.1, -0.2], // 10 3
    [-1.0, 5.3, -0.0, 0.1], // 10 4
    [-0.6, -9.1, -0.3, -0.1], // 10 5
    [-0.9, 0.4, 0.0, 0.1], // 10 6
    [1.5, -4.2, -0.1, 0.0], // 10 7
    [0.9, -3.8, -0.1, -0.1], // 10 8
    [-2.7, 0.9, -0.0, 0.2], // 10 9
    [-3.9, -9.1, -0.0, -0.0], // 10 10
    [2.9, 0.0, 0.0, 0.0], // 11 0
    [-1.5, 0.0, -0.0, -0.0], // 11 1
    [-2.5, 2.9, 0.0, 0.1], // 11 2
    [2.4, -0.6, 0.0, -0.0], // 11 3
    [-0.6, 0.2, 0.0, 0.1], // 11 4
    [-0.1, 0.5, -0.1, -0.0], // 11 5
    [-0.6, -0.3, 0.0, -0.0], // 11 6
    [-0.1, -1.2, -0.0, 0.1], // 11 7
    [1.1, -1.7, -0.1, -0.0], // 11 8
    [-1.0, -2.9, -0.1, 0.0], // 11 9
    [-0.2, -1.8, -0.1, 0.0], // 11 10
    [2.6, -2.3, -0.1, 0.0], // 11 11
    [-2.0, 0.0, 0.0, 0.0], // 12 0
    [-0.2, -1.3, 0.0, -0.0], // 12 1
    [0.3, 0.7, -0.0, 0.0], // 12 2
    [1.2, 1.0, -0.0, -0.1], // 12 3
    [-1.3, -1.4, -0.0, 0.1], // 12 4
    [0.6, -0.0, -0.0, -0.0], // 12 5
    [0.6, 0.6, 0.1, -0.0], // 12 6
    [0.5, -0.1, -0.0, -0.0], // 12 7
    [-0.1, 0.8, 0.0, 0.0], // 12 8
    [-0.4, 0.1, 0.0, -0.0], // 12 9
    [-0.2, -1.0, -0.1, -0.0], // 12 10
    [-1.3, 0.1, -0.0, 0.0], // 12 11
    [-0.7, 0.2, -0.1, -0.1], // 12 12
];

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
