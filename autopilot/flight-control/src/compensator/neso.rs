//! The paper's compensator, step two a: three nonlinear extended state observers, one for each axis.
//!
//! Each follows one body rate and estimates as its extended state z2 the angular acceleration that the
//! design model does not explain: F = g u_f + Δ, a fault or a disturbance.

use core::fmt;

use icd::ControlPeriod;
use nalgebra::Vector3;

use super::{Estimate, Estimator, Handover};
use crate::Visitor;

gain_set! {
    /// Gains of the nonlinear extended state observer.
    ///
    /// The set with which every outcome of the paper occurs; docs/paper.md gives the reasons.
    NesoGains at neso {
        /// ω₀, rad/s: bandwidth of the linear zone.
        bandwidth = 50.0, "OBS_W0" "rad/s", 1.0 to 500.0, "Observer bandwidth in the linear zone";
        /// k_b: β₁ = k_b ω₀. Twice the damping ratio of the linear zone.
        rate_factor = 2.2, "OBS_KB" "-", 0.1 to 20.0, "Observer beta1 as a multiple of the bandwidth";
        /// δ, rad/s: half width of the linear zone of `fal`.
        fal_width = 0.02, "OBS_WIDTH" "rad/s", 1.0e-5 to 10.0, "Half width of the linear zone of fal";
    }
}

/// The paper's α of g₂. The closed-form solution below needs exactly one half.
pub const FAL_EXPONENT: f64 = 0.5;

/// Feedback shaping of the observer error: linear near zero, a root farther out.
///
/// Implements Eq. (23): g₁(e) = e, and g₂(e) = fal(e, 1/2, δ), which is this function. `width` is the
/// paper's δ, in the unit of `e`.
pub fn fal(e: f64, width: f64) -> f64 {
    if e.abs() > width {
        libm::copysign(libm::pow(e.abs(), FAL_EXPONENT), e)
    } else {
        e / libm::pow(width, 1.0 - FAL_EXPONENT)
    }
}

/// One axis: rate estimate z and extended state z2.
#[derive(Debug, Clone, Copy, Default)]
pub struct Channel {
    /// z: estimated body rate, rad/s.
    pub z: f64,
    /// z2: estimated fault acceleration, rad/s².
    pub z2: f64,
    /// a: modelled acceleration at the last tick, rad/s².
    a: f64,
}

/// β₁, β₂, δ and the period, with what the implicit step needs.
#[derive(Debug, Clone, Copy)]
struct NesoStep {
    h: f64,
    h_beta_2: f64,
    /// A = 1 + h β₁.
    a: f64,
    /// B = h² β₂.
    b: f64,
    sqrt_width: f64,
    /// e⁻ up to which the solution lies in the linear zone.
    linear_max: f64,
    /// 1 / (1 + h β₁ + h² β₂ / √δ).
    linear_gain: f64,
}

impl NesoStep {
    fn new(gains: &NesoGains, period: ControlPeriod) -> Self {
        let h = period.as_seconds();
        let (beta_1, beta_2) = (gains.beta_1(), gains.beta_2());
        let sqrt_width = libm::sqrt(gains.fal_width);
        let (a, b) = (1.0 + h * beta_1, h * h * beta_2);
        Self {
            h,
            h_beta_2: h * beta_2,
            a,
            b,
            sqrt_width,
            linear_max: a * gains.fal_width + b * sqrt_width,
            linear_gain: 1.0 / (a + b / sqrt_width),
        }
    }

    /// Solves e + h β₁ e + h² β₂ fal(e) = e⁻ for e; returns e and g₂ = fal(e).
    fn solve(&self, e_minus: f64) -> (f64, f64) {
        let magnitude = e_minus.abs();
        // The left side of the equation grows with e, so e⁻ alone tells the zone, and no iteration is needed.
        if magnitude <= self.linear_max {
            let e = e_minus * self.linear_gain;
            (e, e / self.sqrt_width)
        } else {
            let Self { a, b, .. } = *self;
            // s = √|e| solves A s² + B s = |e⁻|.
            let s = (-b + libm::sqrt(b * b + 4.0 * a * magnitude)) / (2.0 * a);
            (libm::copysign(s * s, e_minus), libm::copysign(s, e_minus))
        }
    }
}

impl Channel {
    /// One implicit Euler step of the observer.
    ///
    /// Implements Eq. (22): e = z - y, ż = z2 + f + U - β₁ g₁(e), ż2 = -β₂ g₂(e), with `a_k` = f + U now
    /// and the trapezoidal mean of it over the period. Implicit, because the steep root near zero would
    /// make an explicit step chatter.
    fn step(&mut self, y: f64, a_k: f64, step: &NesoStep) {
        let prediction = self.z + step.h * (self.z2 + 0.5 * (a_k + self.a));
        let (e, g_2) = step.solve(prediction - y);
        self.z = y + e;
        self.z2 -= step.h_beta_2 * g_2;
        self.a = a_k;
    }
}

/// Three channels: roll, pitch, yaw.
///
/// Implements Eq. (21): the vector equation of the aircraft taken apart into one observer an axis.
#[derive(Debug, Clone)]
pub struct Neso {
    channels: [Channel; 3],
    started: bool,
    step: NesoStep,
    period: ControlPeriod,
}

impl Neso {
    /// Waits for its first measurement.
    pub fn new(gains: &NesoGains, period: ControlPeriod) -> Self {
        Self {
            channels: [Channel::default(); 3],
            started: false,
            step: NesoStep::new(gains, period),
            period,
        }
    }

    /// Takes new gains; the estimates stay.
    pub fn set_gains(&mut self, gains: &NesoGains) {
        self.step = NesoStep::new(gains, self.period);
    }

    /// z: estimated body rates, rad/s.
    pub fn z(&self) -> Vector3<f64> {
        let [p, q, r] = &self.channels;
        Vector3::new(p.z, q.z, r.z)
    }

    /// z2: estimated fault acceleration, rad/s².
    ///
    /// Implements Eq. (24): the extended state is the estimate of F.
    pub fn z2(&self) -> Vector3<f64> {
        let [p, q, r] = &self.channels;
        Vector3::new(p.z2, q.z2, r.z2)
    }
}

impl Estimator for Neso {
    fn step(&mut self, y: &Vector3<f64>, modelled_acceleration: &Vector3<f64>) -> Estimate {
        for (axis, channel) in self.channels.iter_mut().enumerate() {
            let (y, a) = (y[axis], modelled_acceleration[axis]);
            if self.started {
                channel.step(y, a, &self.step);
            } else {
                *channel = Channel { z: y, z2: 0.0, a };
            }
        }
        self.started = true;
        Estimate { z: self.z(), z2: self.z2() }
    }

    fn start_from(&mut self, from: &Handover) {
        for (axis, channel) in self.channels.iter_mut().enumerate() {
            let (z, z2) = (from.estimate.z[axis], from.estimate.z2[axis]);
            *channel = Channel { z, z2, a: from.modelled_acceleration[axis] };
        }
        self.started = true;
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        for Channel { z, z2, a } in &mut self.channels {
            for state in [z, z2, a] {
                visit(state);
            }
        }
    }
}

impl NesoGains {
    /// β₁, 1/s.
    pub fn beta_1(&self) -> f64 {
        self.rate_factor * self.bandwidth
    }

    /// β₂, (rad/s)^(1/2)/s²: the linear zone is s² + k_b ω₀ s + ω₀².
    pub fn beta_2(&self) -> f64 {
        self.bandwidth * self.bandwidth * libm::sqrt(self.fal_width)
    }

    /// The condition of Lemma 1, β₁² > 4 k β₂ dg₂/de for some k > 1, at the steepest slope 1/√δ of g₂.
    ///
    /// The condition is sufficient, not necessary, so a violation is a warning.
    pub fn lemma_1(&self) -> Option<Lemma1Warning> {
        let beta_1_squared = self.beta_1() * self.beta_1();
        let bound = 4.0 * self.beta_2() / libm::sqrt(self.fal_width);
        // "For some k > 1" means: larger than the bound with k = 1.
        (beta_1_squared <= bound).then_some(Lemma1Warning { beta_1_squared, bound })
    }
}

/// Observer gains outside Lemma 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lemma1Warning {
    /// β₁², 1/s².
    pub beta_1_squared: f64,
    /// 4 β₂ max dg₂/de, 1/s²; Lemma 1 requires that β₁² is larger.
    pub bound: f64,
}

impl fmt::Display for Lemma1Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { beta_1_squared, bound } = self;
        write!(
            f,
            "outside Lemma 1 (sufficient, not necessary): beta1^2 {beta_1_squared:.0} <= {bound:.0}"
        )
    }
}

#[cfg(test)]
mod tests;
