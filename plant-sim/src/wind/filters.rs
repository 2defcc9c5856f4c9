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

use nalgebra::{Matrix3, Vector3};

use super::LENGTH_M;
use crate::noise::{Normals, Source};

/// Two lags T in a row, each state scaled to unit variance of the first; the gust is √3 y1 + (1 − √3) y2.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SecondOrder {
    pub y1: f64,
    pub y2: f64,
}

/// Motion of the filters in one period: transition and Cholesky factor of the noise.
#[derive(Debug, Clone, Copy)]
pub(super) struct Transition {
    /// exp(-h/T).
    pub decay: f64,
    /// h/T.
    pub ratio: f64,
    pub l11: f64,
    pub l21: f64,
    pub l22: f64,
}

impl Transition {
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

impl SecondOrder {
    pub fn step(&mut self, t: &Transition, n1: f64, n2: f64) {
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

/// Filters of the three angular gusts, for a gust velocity of unit rms.
#[derive(Debug, Clone)]
pub(super) struct Rotary {
    roll: f64,
    roll_noise: Normals,
    /// rms of p_g for unit intensity, rad/m.
    roll_rms: f64,
    roll_speed: f64,
    /// Of v_g, from which r_g is made, and of w_g, from which q_g is made.
    gradients: [Gradient; 2],
}

/// The lag after one gust across the flight path.
#[derive(Debug, Clone)]
struct Gradient {
    lag: Lag,
    noise: Normals,
    lagged: f64,
}

/// How a gust across the flight path and its lag belong together; the state is the lagged gust x, of the unit of the gust.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lag {
    /// How much faster than the gust's own filter: T/τ = πL/(4b) or πL/(3b).
    pub speed: f64,
    /// Stationary covariance of (y1, y2, x).
    stationary: Matrix3<f64>,
}

impl Rotary {
    pub fn new(span_m: f64, seed: u64, run: u64) -> Self {
        let speed = |spans: f64| core::f64::consts::PI * LENGTH_M / (spans * span_m);
        let noise = |source| Normals::new(seed, run, source);
        let roll_speed = speed(SPANS_ROLL_PITCH);
        Self {
            roll: 0.0,
            roll_noise: noise(Source::TurbulenceRoll),
            roll_rms: roll_rms(roll_speed, LENGTH_M),
            roll_speed,
            gradients: [
                Gradient::new(Lag::new(speed(SPANS_YAW)), noise(Source::TurbulenceYaw)),
                Gradient::new(Lag::new(speed(SPANS_ROLL_PITCH)), noise(Source::TurbulencePitch)),
            ],
        }
    }

    /// One period: `before` are the gusts v_g and w_g at its start, `noise` is their excitation since then.
    pub fn step(&mut self, t: &Transition, before: &[SecondOrder; 2], noise: &[[f64; 2]; 2]) {
        let decay = libm::exp(-self.roll_speed * t.ratio);
        self.roll = decay * self.roll + (1.0 - decay * decay).sqrt() * self.roll_noise.draw();
        for (axis, (before, noise)) in self.gradients.iter_mut().zip(before.iter().zip(noise)) {
            axis.step(t, before, noise);
        }
    }

    /// p_g, q_g, r_g, rad/s for an intensity of 1 m/s, where v_g and w_g (of unit rms) have reached `v` and `w`.
    pub fn rates(&self, v: f64, w: f64) -> Vector3<f64> {
        let [of_v, of_w] = &self.gradients;
        Vector3::new(self.roll_rms * self.roll, -of_w.slope(w), of_v.slope(v))
    }
}

/// rms of p_g for unit intensity, rad/m, with k = πL/4b and the length L in m: the root of the integral of Φ_p, which is
/// σ²/L · 0.8 k^(1/3) · (π/2) k/L.
pub(super) fn roll_rms(roll_speed: f64, length_m: f64) -> f64 {
    let variance = 0.4 * core::f64::consts::PI * roll_speed * libm::cbrt(roll_speed);
    variance.sqrt() / length_m
}

impl Gradient {
    fn new(lag: Lag, noise: Normals) -> Self {
        Self { lag, noise, lagged: 0.0 }
    }

    fn step(&mut self, t: &Transition, before: &SecondOrder, noise: &[f64; 2]) {
        self.lagged = self.lag.next(t, before, self.lagged, noise, &mut self.noise);
    }

    /// Lagged slope of the gust along x, 1/m for unit rms: (gust − x) / (τ V), and τ V = L / speed.
    fn slope(&self, gust: f64) -> f64 {
        (gust - self.lagged) * self.lag.speed / LENGTH_M
    }
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
        t: &Transition,
        before: &SecondOrder,
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
    fn row(&self, t: &Transition) -> Vector3<f64> {
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
    fn spread(&self, t: &Transition, row: &Vector3<f64>) -> [f64; 3] {
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
