//! The moving air: steady wind and Dryden turbulence.

use icd::{Body, Ned};

use crate::noise::{Normals, Source};
use crate::setup::WindSettings;

/// Turbulence length above 2000 ft for every axis, m: 1750 ft (MIL-F-8785C, 3.7.2.1).
pub const LENGTH_M: f64 = 533.4;

/// Airspeed below which the turbulence does not change more slowly, m/s.
const SLOWEST_M_S: f64 = 20.0;

/// Steady wind as a velocity of the air over the ground, m/s: it points to where the wind blows.
#[must_use]
pub fn steady(settings: &WindSettings) -> Ned {
    let (sin, cos) = libm::sincos(settings.towards_rad);
    Ned::new(settings.speed_m_s * cos, settings.speed_m_s * sin, settings.down_m_s)
}

/// Dryden turbulence (MIL-F-8785C, form for altitudes above 2000 ft), velocity of the air in body axes, m/s.
///
/// White noise through first order along x and second order along y and z:
/// σ √(2T) / (1 + T s) and σ √T (1 + √3 T s) / (1 + T s)², T = L / V, for white noise of one unit²·s.
/// The filters are advanced by their exact solution from one control tick to the next, so that the gusts have
/// the rms σ at any period; between ticks the gust stands still.
///
/// Left out: the low-altitude form (σ and L would change with height below 2000 ft) and the angular gusts.
/// The flight begins in calm air and reaches the full rms after some 2 T (4 s at 264 m/s), because a jump of
/// the wind at the start would not be turbulence.
#[derive(Debug, Clone)]
pub struct Turbulence {
    intensity_m_s: f64,
    period_s: f64,
    normals: Normals,
    along: f64,
    across: [SecondOrder; 2],
}

/// Two lags T in a row, each state scaled to unit variance of the first; the gust is √3 y1 + (1 − √3) y2.
#[derive(Debug, Clone, Copy, Default)]
struct SecondOrder {
    y1: f64,
    y2: f64,
}

/// How the filters move in one period: transition and Cholesky factor of what the noise adds.
struct Transition {
    /// exp(-h/T).
    decay: f64,
    /// h/T.
    ratio: f64,
    l11: f64,
    l21: f64,
    l22: f64,
}

impl Transition {
    /// Of a double pole at -1/T over h = ratio T. Stationary covariance of (y1, y2): ((1, ½), (½, ½)).
    fn new(ratio: f64) -> Self {
        let decay = libm::exp(-ratio);
        let e2 = decay * decay;
        let q11 = 1.0 - e2;
        let q12 = 0.5 - e2 * (ratio + 0.5);
        let q22 = 0.5 - e2 * (ratio * ratio + ratio + 0.5);
        let l11 = q11.sqrt();
        let l21 = q12 / l11;
        // q22 is a small difference of large terms; rounding must not make the root imaginary.
        Self { decay, ratio, l11, l21, l22: (q22 - l21 * l21).max(0.0).sqrt() }
    }
}

impl SecondOrder {
    fn step(&mut self, t: &Transition, n1: f64, n2: f64) {
        let (y1, y2) = (self.y1, self.y2);
        self.y1 = t.decay * y1 + t.l11 * n1;
        self.y2 = t.decay * (t.ratio * y1 + y2) + (t.l21 * n1 + t.l22 * n2);
    }

    /// The gust for unit intensity: variance 3 + √3 (1 − √3) + ½ (1 − √3)² = 2 before the scaling.
    fn output(&self) -> f64 {
        let root3 = 3.0_f64.sqrt();
        (root3 * self.y1 + (1.0 - root3) * self.y2) * core::f64::consts::FRAC_1_SQRT_2
    }
}

impl Turbulence {
    /// Calm air that turbulence of rms `intensity_m_s` will move, advanced every `period_s`.
    #[must_use]
    pub fn new(intensity_m_s: f64, period_s: f64, seed: u64, run: u64) -> Self {
        Self {
            intensity_m_s,
            period_s,
            normals: Normals::new(seed, run, Source::Turbulence),
            along: 0.0,
            across: [SecondOrder::default(); 2],
        }
    }

    /// One control tick on at this true airspeed (m/s); the gust until the next tick.
    ///
    /// Without intensity nothing is drawn and the gust is exactly zero.
    pub fn step(&mut self, airspeed_m_s: f64) -> Body {
        if self.intensity_m_s <= 0.0 {
            return Body::zero();
        }
        let t = Transition::new(airspeed_m_s.max(SLOWEST_M_S) * self.period_s / LENGTH_M);
        self.along = t.decay * self.along + t.l11 * self.normals.draw();
        for axis in &mut self.across {
            let (n1, n2) = (self.normals.draw(), self.normals.draw());
            axis.step(&t, n1, n2);
        }
        let [y, z] = self.across.map(|axis| axis.output());
        Body(nalgebra::Vector3::new(self.along, y, z) * self.intensity_m_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 0.002;
    const AIRSPEED: f64 = 264.0;

    /// Mean of f(gust, gust `lag` ticks before) for each axis over many lengths of turbulence.
    fn statistics(lag: usize) -> ([f64; 3], [f64; 3]) {
        // 0.2 s ticks, so that 2e5 of them are 2e4 turbulence times.
        let mut turbulence = Turbulence::new(1.5, 0.2, 1, 0);
        let mut past = vec![[0.0; 3]; lag];
        let (mut square, mut product) = ([0.0; 3], [0.0; 3]);
        let n = 200_000;
        for k in 0..n + 1_000 {
            let gust: [f64; 3] = turbulence.step(AIRSPEED).0.into();
            let before = past[k % lag];
            past[k % lag] = gust;
            if k >= 1_000 {
                for i in 0..3 {
                    square[i] += gust[i] * gust[i] / f64::from(200_000);
                    product[i] += gust[i] * before[i] / f64::from(200_000);
                }
            }
        }
        (square, product)
    }

    #[test]
    fn rms_on_each_axis_is_the_intensity() {
        let (square, _) = statistics(1);
        for (axis, square) in ["u", "v", "w"].into_iter().zip(square) {
            // About 1e4 independent samples: the rms is good to 0.7 %, four times that allowed.
            assert!((square.sqrt() / 1.5 - 1.0).abs() < 0.03, "{axis}: {} m/s", square.sqrt());
        }
    }

    #[test]
    fn correlation_is_that_of_the_dryden_spectra() {
        // Longitudinal exp(-x/L), lateral (1 - x/2L) exp(-x/L), with x = V t the distance flown.
        let lag = 5;
        let x = AIRSPEED * 0.2 * 5.0 / LENGTH_M;
        let (square, product) = statistics(lag);
        let expected =
            [libm::exp(-x), (1.0 - 0.5 * x) * libm::exp(-x), (1.0 - 0.5 * x) * libm::exp(-x)];
        for i in 0..3 {
            let ours = product[i] / square[i];
            // 1e4 independent samples: 0.01, three times that allowed.
            assert!(
                (ours - expected[i]).abs() < 0.03,
                "axis {i}: {ours} instead of {}",
                expected[i]
            );
        }
    }

    #[test]
    fn two_short_ticks_spread_like_one_long_tick() {
        // Covariance that one tick adds, against that of two half ticks.
        let (one, half) = (Transition::new(0.02), Transition::new(0.01));
        let added = |t: &Transition| [t.l11 * t.l11, t.l11 * t.l21, t.l21 * t.l21 + t.l22 * t.l22];
        let [a, b, c] = added(&half);
        let (e2, r) = (half.decay * half.decay, half.ratio);
        let twice = [a + e2 * a, b + e2 * (r * a + b), c + e2 * (r * r * a + 2.0 * r * b + c)];
        for (two, one) in twice.into_iter().zip(added(&one)) {
            // The last term is 5e-6 as a difference of halves: 1e-16 / 5e-6.
            assert!((two / one - 1.0).abs() < 1e-8, "{two} against {one}");
        }
    }

    #[test]
    fn without_intensity_the_air_is_exactly_calm() {
        let mut turbulence = Turbulence::new(0.0, PERIOD_S, 1, 0);
        assert_eq!(turbulence.step(AIRSPEED), Body::zero());
    }

    #[test]
    fn the_first_gusts_are_small() {
        let mut turbulence = Turbulence::new(1.5, PERIOD_S, 1, 0);
        // sigma sqrt(3) sqrt(2 h/T) = 0.12 m/s is one deviation of the first lateral gust.
        assert!(turbulence.step(AIRSPEED).0.norm() < 0.6);
    }

    #[test]
    fn wind_blows_to_where_its_direction_points() {
        let east = WindSettings {
            speed_m_s: 10.0,
            towards_rad: core::f64::consts::FRAC_PI_2,
            down_m_s: -1.0,
            turbulence_m_s: 0.0,
        };
        assert!((steady(&east).0 - nalgebra::Vector3::new(0.0, 10.0, -1.0)).norm() < 1e-14);
    }
}
