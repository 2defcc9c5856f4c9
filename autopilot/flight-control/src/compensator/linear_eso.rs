//! Three linear extended state observers, one for each axis: the NESO without its root.
//!
//! Z. Gao, "Scaling and bandwidth-parameterization based controller tuning", American Control Conference 2003,
//! p. 4989: all poles of the observer at -ω_o, so that one number tunes it.

use icd::ControlPeriod;
use nalgebra::Vector3;

use super::{Estimate, Estimator, Handover};
use crate::Visitor;

gain_set! {
    /// Gain of the linear extended state observer.
    ///
    /// The bandwidth of the NESO's linear zone, so that a comparison is one of the shaping alone.
    LinearEsoGains at linear_eso {
        /// ω_o, rad/s: both poles of each axis are at -ω_o.
        bandwidth = 50.0, "LES_W0" "rad/s", 1.0 to 500.0, "Bandwidth of the linear observer";
    }
}

/// z, z2 and the modelled acceleration of the last tick of one axis.
#[derive(Debug, Clone, Copy, Default)]
struct LinearChannel {
    z: f64,
    z2: f64,
    a: f64,
}

/// Three channels: roll, pitch, yaw.
#[derive(Debug, Clone)]
pub struct LinearEso {
    channels: [LinearChannel; 3],
    started: bool,
    h: f64,
    /// h ω_o²: h times the gain of the extended state.
    h_l2: f64,
    /// 1 / (1 + 2 h ω_o + h² ω_o²).
    gain: f64,
}

impl LinearEso {
    /// Waits for its first measurement.
    pub fn new(gains: &LinearEsoGains, period: ControlPeriod) -> Self {
        let mut new = Self {
            channels: [LinearChannel::default(); 3],
            started: false,
            h: period.as_seconds(),
            h_l2: 0.0,
            gain: 0.0,
        };
        new.set_gains(gains);
        new
    }

    /// Takes new gains; the estimates stay.
    pub fn set_gains(&mut self, gains: &LinearEsoGains) {
        let (h, w) = (self.h, gains.bandwidth);
        self.h_l2 = h * w * w;
        self.gain = 1.0 / (1.0 + 2.0 * h * w + h * h * w * w);
    }
}

impl Estimator for LinearEso {
    /// One implicit Euler step of ż = z2 + a - 2 ω_o e, ż2 = -ω_o² e, with e = z - y and the mean of the modelled
    /// acceleration a over the period.
    fn step(&mut self, y: &Vector3<f64>, modelled_acceleration: &Vector3<f64>) -> Estimate {
        for (axis, channel) in self.channels.iter_mut().enumerate() {
            let (y, a) = (y[axis], modelled_acceleration[axis]);
            if self.started {
                // The mean of both ends of the period: a step of the modelled acceleration then looks like the ramp
                // that the gyros see.
                let prediction = channel.z + self.h * (channel.z2 + 0.5 * (a + channel.a));
                let e = self.gain * (prediction - y);
                *channel = LinearChannel { z: y + e, z2: channel.z2 - self.h_l2 * e, a };
            } else {
                *channel = LinearChannel { z: y, z2: 0.0, a };
            }
        }
        self.started = true;
        let [p, q, r] = &self.channels;
        Estimate { z: Vector3::new(p.z, q.z, r.z), z2: Vector3::new(p.z2, q.z2, r.z2) }
    }

    fn start_from(&mut self, from: &Handover) {
        for (axis, channel) in self.channels.iter_mut().enumerate() {
            let (z, z2) = (from.estimate.z[axis], from.estimate.z2[axis]);
            *channel = LinearChannel { z, z2, a: from.modelled_acceleration[axis] };
        }
        self.started = true;
    }

    fn states(&mut self, visit: &mut Visitor<'_>) {
        for LinearChannel { z, z2, a } in &mut self.channels {
            for state in [z, z2, a] {
                visit(state);
            }
        }
    }
}
