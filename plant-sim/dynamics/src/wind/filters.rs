//! The filters of the turbulence: gusts across the flight path, and their rotation around an aircraft with a span.
//!
//! Across the path a gust passes two equal lags and a zero. Spectra of the rotation by MIL-F-8785C 3.7 over the spatial frequency Ω
//! (rad/m), one-sided, b the span, L the length:
//!
//! ```text
//! Φ_p = σ²/L · 0.8 (πL/4b)^(1/3) / (1 + (4bΩ/π)²)        independent of the other five
//! Φ_q = Ω² / (1 + (4bΩ/π)²) · Φ_w                         made of w_g
//! Φ_r = Ω² / (1 + (3bΩ/π)²) · Φ_v                         made of v_g
//! ```
//!
//! The field is frozen and the aircraft flies through it, so a gradient along x is a rate of change over V. With
//! x' = (w_g − x)/τ, τ = 4b/(πV), the lagged gradient of w_g is (w_g − x)/(τV), and q_g is minus that; r_g is the
//! lagged gradient of v_g with 3b in place of 4b. The lags are solved exactly, together with the gusts that drive them.

use icd::Body;
use nalgebra::{Matrix3, Vector3};

use super::Gust;
use crate::noise::{Normals, Source};

/// Two lags T in a row, each state scaled to unit variance of the first; the gust is √3 y1 + (1 − √3) y2.
#[derive(Debug, Clone, Copy, Default)]
struct SecondOrderFilter {
    pub y1: f64,
    pub y2: f64,
}

/// Motion of the filters in one period: transition and Cholesky factor of the noise.
#[derive(Debug, Clone, Copy)]
struct FilterTransition {
    /// exp(-h/T).
    pub decay: f64,
    /// h/T.
    pub ratio: f64,
    pub l11: f64,
    pub l21: f64,
    pub l22: f64,
}

impl FilterTransition {
    /// Of a double pole at -1/T over h = ratio T. Stationary covariance of (y1, y2): ((1, ½), (½, ½)).
    pub fn new(ratio: f64) -> Self {
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

impl SecondOrderFilter {
    pub fn step(&mut self, t: &FilterTransition, n1: f64, n2: f64) {
        let (y1, y2) = (self.y1, self.y2);
        self.y1 = t.decay * y1 + t.l11 * n1;
        self.y2 = t.decay * (t.ratio * y1 + y2) + (t.l21 * n1 + t.l22 * n2);
    }

    /// The gust for unit intensity: variance 3 + √3 (1 − √3) + ½ (1 − √3)² = 2 before the scaling.
    pub fn output(&self) -> f64 {
        let [c1, c2] = OUTPUT;
        (c1 * self.y1 + c2 * self.y2) * core::f64::consts::FRAC_1_SQRT_2
    }
}

/// √3.
const ROOT_3: f64 = 1.732_050_807_568_877_2;

/// Weights of y1 and y2 in the gust, times √2.
const OUTPUT: [f64; 2] = [ROOT_3, 1.0 - ROOT_3];

/// Multiple of the span in the lag of p_g and q_g.
pub(super) const SPANS_ROLL_PITCH: f64 = 4.0;
/// The same in that of r_g.
pub(super) const SPANS_YAW: f64 = 3.0;

/// Intensities and lengths at one height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scales {
    /// L_u = L_v, m.
    pub horizontal_m: f64,
    /// L_w, m.
    pub vertical_m: f64,
    /// σ_u = σ_v, m/s rms.
    pub horizontal_m_s: f64,
    /// σ_w, m/s rms.
    pub vertical_m_s: f64,
}

impl Scales {
    pub(super) fn isotropic(length_m: f64, intensity_m_s: f64) -> Self {
        Self {
            horizontal_m: length_m,
            vertical_m: length_m,
            horizontal_m_s: intensity_m_s,
            vertical_m_s: intensity_m_s,
        }
    }

    /// The lags of v_g, from which r_g is made, and of w_g, from which q_g is made, around an aircraft of this span.
    fn lags(&self, span_m: f64) -> [Lag; 2] {
        let lag = |length_m: f64, spans: f64| {
            Lag::new(core::f64::consts::PI * length_m / (spans * span_m))
        };
        [lag(self.horizontal_m, SPANS_YAW), lag(self.vertical_m, SPANS_ROLL_PITCH)]
    }
}

/// The random streams of the turbulence.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    pub velocity: Normals,
    roll: Normals,
    pitch: Normals,
    yaw: Normals,
}

impl Noise {
    pub fn new(seed: u64, run: u64) -> Self {
        let stream = |source| Normals::new(seed, run, source);
        Self {
            velocity: stream(Source::Turbulence),
            roll: stream(Source::TurbulenceRoll),
            pitch: stream(Source::TurbulencePitch),
            yaw: stream(Source::TurbulenceYaw),
        }
    }

    /// What excites the gusts across the flight path in a period.
    pub fn across(&mut self) -> [[f64; 2]; 2] {
        [(); 2].map(|()| [self.velocity.draw(), self.velocity.draw()])
    }
}

/// State of the filters of one field of turbulence, each of unit rms.
#[derive(Debug, Clone, Default)]
pub(super) struct Field {
    along: f64,
    across: [SecondOrderFilter; 2],
    roll: f64,
    /// v_g and w_g behind the lags of r_g and q_g.
    lagged: [f64; 2],
}

impl Field {
    /// Advances the filters while the aircraft flies `way_m` through the air; the gust in the axes of the field. `excitation` is that
    /// of the gusts along and across the flight path.
    pub fn step(
        &mut self,
        scales: &Scales,
        span_m: f64,
        way_m: f64,
        (along, across): (f64, [[f64; 2]; 2]),
        noise: &mut Noise,
    ) -> Gust {
        let horizontal = FilterTransition::new(way_m / scales.horizontal_m);
        // Equal lengths need the exponential once.
        let vertical = match scales.vertical_m == scales.horizontal_m {
            true => horizontal,
            false => FilterTransition::new(way_m / scales.vertical_m),
        };
        self.along = horizontal.decay * self.along + horizontal.l11 * along;
        // Kept, because the lags are driven by the gusts as they were.
        let before = self.across;
        let [of_v, of_w] = scales.lags(span_m);
        let [lagged_v, lagged_w] = self.lagged;
        self.lagged = [
            of_v.next(&horizontal, &before[0], lagged_v, &across[0], &mut noise.yaw),
            of_w.next(&vertical, &before[1], lagged_w, &across[1], &mut noise.pitch),
        ];
        let transitions = [&horizontal, &vertical];
        for ((axis, t), [n1, n2]) in self.across.iter_mut().zip(transitions).zip(across) {
            axis.step(t, n1, n2);
        }
        let decay = libm::exp(-of_w.speed * vertical.ratio);
        self.roll = decay * self.roll + (1.0 - decay * decay).sqrt() * noise.roll.draw();
        let [v, w] = self.across.map(|axis| axis.output());
        let p = roll_rms(of_w.speed, scales.vertical_m) * self.roll;
        // The lagged slopes of the field, (gust − x) / (τ V) with τ V = L / speed.
        let slope = |gust, lagged, lag: &Lag, length_m| (gust - lagged) * lag.speed / length_m;
        let q = -slope(w, self.lagged[1], &of_w, scales.vertical_m);
        let r = slope(v, self.lagged[0], &of_v, scales.horizontal_m);
        let (horizontal, vertical) = (scales.horizontal_m_s, scales.vertical_m_s);
        Gust {
            velocity: Body::new(horizontal * self.along, horizontal * v, vertical * w),
            rates: Body::new(vertical * p, vertical * q, horizontal * r),
        }
    }
}

/// rms of p_g for unit intensity, rad/m, with k = πL/4b and the length L in m: the root of the integral of Φ_p, which is
/// σ²/L · 0.8 k^(1/3) · (π/2) k/L.
fn roll_rms(roll_speed: f64, length_m: f64) -> f64 {
    let variance = 0.4 * core::f64::consts::PI * roll_speed * libm::cbrt(roll_speed);
    variance.sqrt() / length_m
}

/// How a gust across the flight path and its lag belong together; the state is the lagged gust x, of the unit of the gust.
#[derive(Debug, Clone, Copy)]
struct Lag {
    /// How much faster than the gust's own filter: T/τ = πL/(4b) or πL/(3b).
    pub speed: f64,
    /// Stationary covariance of (y1, y2, x).
    stationary: Matrix3<f64>,
}

impl Lag {
    pub fn new(speed: f64) -> Self {
        let output = OUTPUT.map(|c| c * core::f64::consts::FRAC_1_SQRT_2);
        let gust_y1 = output[0] + 0.5 * output[1];
        let gust_y2 = 0.5 * (output[0] + output[1]);
        // Lyapunov's equation of y1' = -y1 + noise, y2' = y1 - y2, x' = k (gust - x), time in T.
        let x_y1 = speed * gust_y1 / (speed + 1.0);
        let x_y2 = (speed * gust_y2 + x_y1) / (speed + 1.0);
        let x_x = output[0] * x_y1 + output[1] * x_y2;
        #[rustfmt::skip]
        let stationary = Matrix3::new(
            1.0,  0.5,  x_y1,
            0.5,  0.5,  x_y2,
            x_y1, x_y2, x_x,
        );
        Self { speed, stationary }
    }

    /// The lagged gust one period after it was `lagged`: `before` is the gust then, `noise` its excitation since.
    pub fn next(
        &self,
        t: &FilterTransition,
        before: &SecondOrderFilter,
        lagged: f64,
        [n1, n2]: &[f64; 2],
        own: &mut Normals,
    ) -> f64 {
        let row = self.row(t);
        let [l31, l32, l33] = self.spread(t, &row);
        let from = Vector3::new(before.y1, before.y2, lagged);
        row.dot(&from) + (l31 * n1 + l32 * n2 + l33 * own.draw())
    }

    /// Row of the transition matrix that makes the next x of (y1, y2, x): variation of constants with
    /// y1 = e^-s, y2 = s e^-s.
    fn row(&self, t: &FilterTransition) -> Vector3<f64> {
        let k = self.speed;
        let own = libm::exp(-k * t.ratio);
        let (response, ramp) = if (k - 1.0).abs() < NEARLY_EQUAL {
            let x = (k - 1.0) * t.ratio;
            let [first, second] = divided_differences(x);
            (k * t.decay * t.ratio * first, k * t.decay * t.ratio * t.ratio * second)
        } else {
            let response = k / (k - 1.0) * (t.decay - own);
            let ramp = k / (k - 1.0) * (t.ratio * t.decay - (t.decay - own) / (k - 1.0));
            (response, ramp)
        };
        let [c1, c2] = OUTPUT.map(|c| c * core::f64::consts::FRAC_1_SQRT_2);
        Vector3::new(c1 * response + c2 * ramp, c2 * response, own)
    }

    /// Third row of the Cholesky factor of the noise in a period; the first two are those of `t`.
    ///
    /// The noise adds the stationary covariance less its transition over the period.
    fn spread(&self, t: &FilterTransition, row: &Vector3<f64>) -> [f64; 3] {
        let first = Vector3::new(t.decay, 0.0, 0.0);
        let second = Vector3::new(t.decay * t.ratio, t.decay, 0.0);
        let p = &self.stationary;
        let left = p * row;
        let q31 = p[(2, 0)] - first.dot(&left);
        let q32 = p[(2, 1)] - second.dot(&left);
        let q33 = p[(2, 2)] - row.dot(&left);
        let l31 = q31 / t.l11;
        let l32 = if t.l22 > 0.0 { (q32 - l31 * t.l21) / t.l22 } else { 0.0 };
        // A small difference of large terms; rounding must not make the root imaginary.
        [l31, l32, (q33 - l31 * l31 - l32 * l32).max(0.0).sqrt()]
    }
}

/// Nearer than this to the gust's own lag, the second lag is solved by series: the closed form divides by the difference.
const NEARLY_EQUAL: f64 = 0.5;

/// (1 − e^−x)/x and (1 − (1 − e^−x)/x)/x, also where x is nearly zero.
fn divided_differences(x: f64) -> [f64; 2] {
    if x.abs() > 0.1 {
        let first = -libm::expm1(-x) / x;
        return [first, (1.0 - first) / x];
    }
    // 1/2 − x/6 + x²/24 …, by Horner; the tenth power of 0.1 is below the rounding.
    let mut second = 0.0;
    for n in (2..=11).rev() {
        second = (1.0 - x * second) / f64::from(n);
    }
    [1.0 - x * second, second]
}

#[cfg(test)]
mod tests;
