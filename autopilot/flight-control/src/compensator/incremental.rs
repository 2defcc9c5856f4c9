//! Incremental compensation: the filtered derivative of the gyros against that of the model, as in incremental
//! nonlinear dynamic inversion.
//!
//! S. Sieberling, Q. P. Chu, J. A. Mulder, "Robust Flight Control Using Incremental Nonlinear Dynamic Inversion and
//! Angular Acceleration Prediction", J. Guidance, Control, and Dynamics 33(6), 2010; E. J. J. Smeur, Q. P. Chu,
//! G. C. H. E. de Croon, "Adaptive Incremental Nonlinear Dynamic Inversion for Attitude Control of Micro Air
//! Vehicles", J. Guidance, Control, and Dynamics 39(3), 2016.
//!
//! Their law is u = u_f + G⁻¹ (ν - ẇ_f): the positions of the effectors and the measured angular acceleration pass
//! the same filter H, so that both have the same delay. Here ν is what the healthy aircraft would do under the
//! main controller, f + g u, and only the redundant effectors move: u_c = u_c,f + g_c⁻¹ ((f + g u)_f - ẇ_f). With
//! z2 = H (ẇ - f - g u - g_c u_c) that is u_c = -g_c⁻¹ z2, the form which all compensators share: detector, fade
//! and limits work with it unchanged. g_c is taken at the present condition, inside and outside the filter.

use icd::ControlPeriod;
use nalgebra::Vector3;

use super::{Estimate, Estimator, Handover};
use crate::Visitor;

gain_set! {
    /// Gains of the filter.
    ///
    /// The filter of Smeur, Chu and de Croon: 50 rad/s, 0.55.
    IncrementalGains at incremental {
        /// ω_n, rad/s.
        bandwidth = 50.0, "INC_W0" "rad/s", 1.0 to 500.0, "Natural frequency of the filter of the angular acceleration";
        /// ζ.
        damping = 0.55, "INC_ZETA" "-", 0.1 to 5.0, "Damping of the filter of the angular acceleration";
    }
}

/// The filter of one axis, and what the last tick measured.
#[derive(Debug, Clone, Copy, Default)]
struct IncrementalChannel {
    z2: f64,
    z2_rate: f64,
    /// Last measured rate, rad/s.
    y: f64,
    /// Last modelled acceleration, rad/s².
    a: f64,
}

/// Three channels: roll, pitch, yaw.
#[derive(Debug, Clone)]
pub struct Incremental {
    channels: [IncrementalChannel; 3],
    started: bool,
    h: f64,
    /// h ω_n².
    h_w2: f64,
    /// 1 / (1 + 2 ζ h ω_n + h² ω_n²).
    gain: f64,
}

impl Incremental {
    /// Waits for its first measurement.
    pub fn new(gains: &IncrementalGains, period: ControlPeriod) -> Self {
        let mut new = Self {
            channels: [IncrementalChannel::default(); 3],
            started: false,
            h: period.as_seconds(),
            h_w2: 0.0,
            gain: 0.0,
        };
        new.set_gains(gains);
        new
    }

    /// Takes new gains; the estimates stay.
    pub fn set_gains(&mut self, gains: &IncrementalGains) {
        let (h, w) = (self.h, gains.bandwidth);
        self.h_w2 = h * w * w;
        self.gain = 1.0 / (1.0 + 2.0 * gains.damping * h * w + h * h * w * w);
    }
}

impl Estimator for Incremental {
    /// One implicit Euler step of the filter. Its input is the mean acceleration of the period, measured minus
    /// modelled: filtering the difference is filtering both alike.
    fn step(&mut self, y: &Vector3<f64>, modelled_acceleration: &Vector3<f64>) -> Estimate {
        for (axis, channel) in self.channels.iter_mut().enumerate() {
            let (y, a) = (y[axis], modelled_acceleration[axis]);
            if self.started {
                let unexplained = (y - channel.y) / self.h - 0.5 * (a + channel.a);
                let push = self.h_w2 * (unexplained - channel.z2);
                channel.z2_rate = self.gain * (channel.z2_rate + push);
                // With the rate just found, which makes the step implicit: it is stable for every bandwidth and
                // period.
                channel.z2 += self.h * channel.z2_rate;
            }
            (channel.y, channel.a) = (y, a);
        }
        self.started = true;
        let [p, q, r] = &self.channels;
        // This filter does not estimate the rates, so the measured ones stand for z.
        Estimate { z: *y, z2: Vector3::new(p.z2, q.z2, r.z2) }
    }

    fn start_from(&mut self, from: &Handover) {
        for (axis, channel) in self.channels.iter_mut().enumerate() {
            *channel = IncrementalChannel {
                z2: from.estimate.z2[axis],
                // No other estimator has a rate of z2 to hand over.
                z2_rate: 0.0,
                y: from.y[axis],
                a: from.modelled_acceleration[axis],
            };
        }
        self.started = true;
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        for IncrementalChannel { z2, z2_rate, y, a } in &mut self.channels {
            for state in [z2, z2_rate, y, a] {
                visit(state);
            }
        }
    }
}
