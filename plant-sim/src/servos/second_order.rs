//! A servo with inertia: it overshoots, and its rate is a state.

use icd::{Effector, PerEffector};
use serde::{Deserialize, Serialize};

use super::Servo;

/// δ̈ = ω²(δ_c − δ) − 2ζω δ̇, with |δ̇| up to the rate limit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SecondOrder {
    /// Natural frequency ω, rad/s.
    pub natural_frequency_rad_s: f64,
    pub damping_ratio: f64,
}

impl SecondOrder {
    /// The first-order lag that delays slow commands as much, s: 2ζ/ω. For models that have a lag only.
    pub fn lag_s(&self) -> f64 {
        2.0 * self.damping_ratio / self.natural_frequency_rad_s
    }

    /// Largest rate in the response to a unit step without a rate limit, 1/s: ω e^(−ζ φ / sin φ) with cos φ = ζ.
    pub fn fastest(&self) -> f64 {
        let zeta = self.damping_ratio;
        let root = (1.0 - zeta * zeta).abs().sqrt();
        // The ratio of angle and sine goes to 1 at critical damping, where both vanish.
        let ratio = match root {
            root if root < 1.0e-6 => 1.0,
            root if zeta < 1.0 => libm::acos(zeta) / root,
            root => libm::acosh(zeta) / root,
        };
        self.natural_frequency_rad_s * libm::exp(-zeta * ratio)
    }
}

/// Dynamics of one second-order servo in the form that the derivative needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Inert {
    pub effector: Effector,
    /// ω², 1/s².
    stiffness: f64,
    /// 2ζω, 1/s.
    damping: f64,
    /// Rate limit, rad/s or N/s.
    rate_limit: f64,
    /// Stops at the ends of the travel, rad or N.
    stops: [f64; 2],
}

impl Inert {
    /// Those among these servos.
    pub fn all(servos: &PerEffector<Servo>) -> Vec<Self> {
        let of = |(effector, servo): (Effector, &Servo)| {
            let order = servo.second_order?;
            let omega = order.natural_frequency_rad_s;
            Some(Self {
                effector,
                stiffness: omega * omega,
                damping: 2.0 * order.damping_ratio * omega,
                rate_limit: servo.rate_limit,
                stops: [servo.min, servo.max],
            })
        };
        servos.iter().filter_map(of).collect()
    }

    /// Its rate, and what changes the rate, with this command, position and rate; `fault_limit` is a rate limit of a fault.
    #[inline]
    pub fn derivative(&self, command: f64, at: f64, rate: f64, fault_limit: f64) -> [f64; 2] {
        let limit = self.rate_limit.min(fault_limit);
        let free = self.stiffness * (command - at) - self.damping * rate;
        let pushes_on = rate.abs() >= limit && free * rate > 0.0;
        [rate.max(-limit).min(limit), if pushes_on { 0.0 } else { free }]
    }

    /// After a step: the rate keeps its limit and ends at a stop. A command beyond a stop, as that of an engine that is out,
    /// moves the stop.
    pub fn settle(&self, command: f64, at: &mut f64, rate: &mut f64, fault_limit: f64) {
        let limit = self.rate_limit.min(fault_limit);
        *rate = rate.max(-limit).min(limit);
        let [low, high] = [self.stops[0].min(command), self.stops[1].max(command)];
        if (*at > high && *rate > 0.0) || (*at < low && *rate < 0.0) {
            *at = at.max(low).min(high);
            *rate = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::rk4;
    use crate::servos::Imperfections;

    const OMEGA: f64 = 30.0;

    fn servo(damping_ratio: f64, rate_limit: f64) -> Servo {
        let order = SecondOrder { natural_frequency_rad_s: OMEGA, damping_ratio };
        let (imperfections, lag_s) = (Imperfections::default(), order.lag_s());
        Servo { lag_s, rate_limit, min: -0.5, max: 0.5, second_order: Some(order), imperfections }
    }

    /// Positions and rates every millisecond after a step of the command.
    fn step(servo: Servo, command: f64, ticks: usize) -> Vec<[f64; 2]> {
        let inert = Inert::all(&PerEffector::from_fn(|_| servo))[0];
        let slope = |x: &[f64; 2]| inert.derivative(command, x[0], x[1], f64::INFINITY);
        let mut x = [0.0; 2];
        let mut all = vec![x];
        for _ in 0..ticks {
            x = rk4(&x, &slope(&x), 1.0e-3, slope);
            let [at, rate] = &mut x;
            inert.settle(command, at, rate, f64::INFINITY);
            all.push(x);
        }
        all
    }

    #[test]
    fn val_the_step_response_is_the_formula_below_at_and_above_critical_damping() {
        for zeta in [0.3, 0.7, 1.0, 1.5] {
            let formula = |t: f64| {
                let (x, decay) = (OMEGA * t, libm::exp(-zeta * OMEGA * t));
                let root = (zeta * zeta - 1.0).abs().sqrt();
                // K. Ogata, Modern Control Engineering, 5th ed., section 5-3.
                let (even, odd) = match zeta {
                    1.0 => (1.0, x),
                    zeta if zeta < 1.0 => (libm::cos(root * x), libm::sin(root * x) * zeta / root),
                    _ => (libm::cosh(root * x), libm::sinh(root * x) * zeta / root),
                };
                1.0 - decay * (even + odd)
            };
            for (tick, [at, _]) in step(servo(zeta, f64::INFINITY), 0.1, 400).iter().enumerate() {
                let expected = 0.1 * formula(1.0e-3 * tick as f64);
                // RK4 at a thirtieth of 1/ω: (0.03)^4 of the step.
                assert!((at - expected).abs() < 1.0e-7, "zeta {zeta}, {tick} ms: {at}, {expected}");
            }
        }
    }

    #[test]
    fn the_largest_rate_is_that_of_the_step_response() {
        for zeta in [0.3, 0.7, 1.0, 1.5] {
            let rates = step(servo(zeta, f64::INFINITY), 0.1, 400);
            let largest = rates.iter().fold(0.0_f64, |most, [_, rate]| most.max(*rate));
            let order = servo(zeta, f64::INFINITY).second_order.unwrap();
            // The largest sample is up to half a millisecond beside the peak.
            let apart = largest / (0.1 * order.fastest()) - 1.0;
            assert!(apart.abs() < 1.0e-3, "zeta {zeta}: {apart}");
        }
    }

    #[test]
    fn the_rate_limit_holds_and_the_servo_leaves_it_without_a_delay() {
        let moved = step(servo(0.7, 1.0), 0.3, 600);
        let largest = moved.iter().fold(0.0_f64, |most, [_, rate]| most.max(rate.abs()));
        assert_eq!(largest, 1.0);
        // A rate that wound up beyond its limit would carry the servo far beyond the command.
        let most = moved.iter().fold(0.0_f64, |most, [at, _]| most.max(*at));
        assert!((0.3..0.31).contains(&most), "{most} rad");
        assert!((moved[600][0] - 0.3).abs() < 1.0e-4);
    }

    #[test]
    fn an_overshoot_ends_at_the_stop() {
        let moved = step(servo(0.2, f64::INFINITY), 0.5, 400);
        assert!(moved.iter().all(|[at, _]| *at <= 0.5));
        assert!(moved.contains(&[0.5, 0.0]), "it reaches the stop and rests there");
    }
}
