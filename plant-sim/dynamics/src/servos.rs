//! Command to position: lag or second order, rate limit, travel. This is the healthy actuator; [`crate::faults`] has its faults.
//!
//! ```text
//! command ─> travel ─> delay ─> deadband ─> hysteresis ─> bias ─> faults ─> stall ─> lag or second order, rate ─> position
//! ```
//!
//! Delay to bias are [`Imperfections`], which act on commands; the plant passes the commands through them only where an
//! actuator has one.

use std::collections::VecDeque;

use icd::fault::{Reach, TargetClass};
use icd::{ControlPeriod, Effector, PerEffector, SimTime};
use serde::{Deserialize, Serialize};

/// Longest transport delay of an actuator, s: what the buffer of its commands holds.
pub const DELAY_MAX_S: f64 = 1.0;

/// Most commands that can be pending: those of the longest delay at the shortest control period, and the latest one.
// A thousand and one, from two constants.
pub const COMMANDS_MAX: usize =
    (DELAY_MAX_S * 1.0e6) as usize / ControlPeriod::MIN_MICROS as usize + 1;

/// One actuator: angles in rad, the engine in newton. An unused slot is all zeros and stays at zero.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Servo {
    /// Time constant of the first-order lag, s; of a second-order servo [`SecondOrder::lag_s`].
    pub lag_s: f64,
    /// Rate limit in either direction, rad/s or N/s; infinite for none.
    #[serde(with = "limit")]
    pub rate_limit: f64,
    /// Lower end of the travel, rad or N.
    pub min: f64,
    /// Upper end of the travel, rad or N.
    pub max: f64,
    /// Second-order dynamics in the place of the lag.
    pub second_order: Option<SecondOrder>,
    /// What happens to a command before it reaches the servo.
    #[serde(default)]
    pub imperfections: Imperfections,
}

/// Errors of an actuator, all zero or `None` in an ideal one.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Imperfections {
    /// Transport delay of a command, s, 0 to [`DELAY_MAX_S`].
    pub delay_s: f64,
    /// A command that differs by no more than this from the last one that was followed is not followed, rad.
    pub deadband: f64,
    /// Width of the play between command and servo (backlash), rad.
    pub hysteresis: f64,
    /// Added to the command, rad.
    pub bias: f64,
    /// Dynamic pressure at which the hinge moment leaves just the full travel, Pa.
    pub stall_pressure_pa: Option<f64>,
}

impl Imperfections {
    /// Whether commands reach the servo unchanged.
    pub fn are_none(&self) -> bool {
        *self == Self::default()
    }
}

impl Servo {
    /// The command limited to the travel.
    #[inline]
    pub fn limited(&self, command: f64) -> f64 {
        // Comparisons instead of max and min: one instruction each. Unlike clamp they never panic.
        let above = if command < self.min { self.min } else { command };
        if above > self.max { self.max } else { above }
    }

    /// Largest rate, rad/s or N/s. Without a rate limit it is that in a step over the whole travel.
    pub fn fastest(&self) -> f64 {
        let span = self.max - self.min;
        let free = self.second_order.map_or(span / self.lag_s, |order| span * order.fastest());
        self.rate_limit.min(free)
    }

    /// Ends of the travel that the hinge moment leaves at a dynamic pressure (Pa), rad or N.
    ///
    /// The hinge moment q S c C_hδ δ of a deflection δ grows with the dynamic pressure q, the moment of the actuator does not
    /// (B. Etkin, L. D. Reid, Dynamics of Flight, 3rd ed., chapter 2: hinge moments). Beyond the pressure q_s of the full
    /// travel a fraction q_s/q of it is left, to either side.
    pub fn travel_at(&self, pressure_pa: f64) -> [f64; 2] {
        match self.imperfections.stall_pressure_pa {
            Some(stall_pa) if pressure_pa > stall_pa => {
                [self.min, self.max].map(|end| end * (stall_pa / pressure_pa))
            }
            _ => [self.min, self.max],
        }
    }

    /// Its travel and largest rate; `class` is that of its effector.
    pub fn reach(&self, class: TargetClass) -> Reach {
        Reach { class, min: self.min, max: self.max, fastest: Some(self.fastest()) }
    }
}

/// A limit that JSON, which has no infinity, represents as null if there is none.
mod limit {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(limit: &f64, to: S) -> Result<S::Ok, S::Error> {
        if to.is_human_readable() {
            Some(*limit).filter(|limit| limit.is_finite()).serialize(to)
        } else {
            limit.serialize(to)
        }
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        if from.is_human_readable() {
            Ok(Option::deserialize(from)?.unwrap_or(f64::INFINITY))
        } else {
            f64::deserialize(from)
        }
    }
}

/// Dynamics of all healthy actuators in the form that the derivative needs: one array for each quantity and no
/// division, because the integrator evaluates it in every stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServoDynamics {
    /// 1 over the lag, 1/s.
    per_lag: PerEffector<f64>,
    /// Rate limit, rad/s or N/s.
    rate_limit: PerEffector<f64>,
}

impl ServoDynamics {
    pub fn new(servos: &PerEffector<Servo>) -> Self {
        Self {
            per_lag: PerEffector::from_fn(|e| {
                let lag_s = servos[e].lag_s;
                // An unused slot has no lag and stays where it is.
                if lag_s > 0.0 { 1.0 / lag_s } else { 0.0 }
            }),
            rate_limit: PerEffector::from_fn(|e| servos[e].rate_limit),
        }
    }

    /// Rates of the first `count` healthy actuators at these positions with these commands (inside the travel).
    #[inline]
    pub fn rates(
        &self,
        count: usize,
        commands: &PerEffector<f64>,
        positions: &PerEffector<f64>,
    ) -> PerEffector<f64> {
        PerEffector::first_from_fn(count, |e| {
            let free = (commands[e] - positions[e]) * self.per_lag[e];
            let limit = self.rate_limit[e];
            // Comparisons instead of max and min: one instruction each.
            let above = if free < -limit { -limit } else { free };
            if above > limit { limit } else { above }
        })
    }
}

/// Commands of the first `count` effectors, limited to their travel.
///
/// If a command is not finite, the effector keeps its `previous` one, as a real servo does with an invalid frame.
pub fn accepted(
    count: usize,
    servos: &PerEffector<Servo>,
    commands: &PerEffector<f64>,
    previous: &PerEffector<f64>,
) -> PerEffector<f64> {
    PerEffector::first_from_fn(count, |e| {
        if commands[e].is_finite() { servos[e].limited(commands[e]) } else { previous[e] }
    })
}

/// The commands of one effector that are not due yet, oldest first.
#[derive(Debug, Clone)]
pub(crate) struct Delayed(VecDeque<(SimTime, f64)>);

impl Delayed {
    /// Empty; it allocates its memory here and not in flight.
    pub fn new() -> Self {
        Self(VecDeque::with_capacity(COMMANDS_MAX))
    }

    /// Drops all pending commands.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Adds a command, rad or N, that is due at `due`; if the queue is full, it drops the oldest.
    pub fn push(&mut self, due: SimTime, command: f64) {
        if self.0.len() == COMMANDS_MAX {
            self.0.pop_front();
        }
        self.0.push_back((due, command));
    }

    /// Removes the newest command that is due by `now` and all older ones, and returns the newest.
    pub fn due(&mut self, now: SimTime) -> Option<f64> {
        // A servo holds one set point, so of several due commands only the newest counts.
        let mut newest = None;
        while let Some((_, command)) = self.0.pop_front_if(|(due, _)| *due <= now) {
            newest = Some(command);
        }
        newest
    }

    /// When the next command is due.
    pub fn next(&self) -> Option<SimTime> {
        self.0.front().map(|(due, _)| *due)
    }

    /// The pending commands, oldest first.
    pub fn commands(&mut self) -> impl Iterator<Item = &mut f64> {
        self.0.iter_mut().map(|(_, command)| command)
    }
}

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
        // Of an overdamped servo the root is that of ζ² - 1.
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
        // At its limit the rate does not grow on, so that it turns as soon as the command does.
        let pushes_on = rate.abs() >= limit && free * rate > 0.0;
        // A stage of the integration may try a rate beyond the limit.
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
    use icd::tvc_jet;

    const SERVO: Servo = Servo {
        lag_s: 0.05,
        rate_limit: 1.4,
        min: -0.5,
        max: 0.5,
        second_order: None,
        imperfections: Imperfections {
            delay_s: 0.0,
            deadband: 0.0,
            hysteresis: 0.0,
            bias: 0.0,
            stall_pressure_pa: None,
        },
    };

    /// Speed of one of these servos.
    fn rate(command: f64, position: f64) -> f64 {
        let all = |value| PerEffector::from_fn(|_| value);
        let servos = PerEffector::from_fn(|_| SERVO);
        ServoDynamics::new(&servos).rates(8, &all(command), &all(position))[tvc_jet::RUDDER]
    }

    #[test]
    fn a_small_step_is_a_first_order_lag() {
        // One rounding of 1 / lag.
        assert!((rate(0.01, 0.0) / (0.01 / 0.05) - 1.0).abs() < 3e-16, "{}", rate(0.01, 0.0));
    }

    #[test]
    fn a_large_step_moves_at_the_rate_limit_either_way() {
        assert_eq!(rate(0.5, -0.5), 1.4);
        assert_eq!(rate(-0.5, 0.5), -1.4);
    }

    #[test]
    fn commands_end_at_the_travel() {
        assert_eq!((SERVO.limited(9.0), SERVO.limited(-9.0), SERVO.limited(0.1)), (0.5, -0.5, 0.1));
    }

    #[test]
    fn the_hinge_moment_leaves_a_travel_that_falls_with_the_dynamic_pressure() {
        let imperfections =
            Imperfections { stall_pressure_pa: Some(20.0e3), ..Imperfections::default() };
        let servo = Servo { min: -0.3, imperfections, ..SERVO };
        assert_eq!(servo.travel_at(0.0), [-0.3, 0.5]);
        assert_eq!(servo.travel_at(20.0e3), [-0.3, 0.5]);
        assert_eq!(servo.travel_at(40.0e3), [-0.15, 0.25]);
        assert_eq!(SERVO.travel_at(1.0e6), [-0.5, 0.5]);
    }

    #[test]
    fn a_command_that_is_no_number_holds_only_its_own_effector() {
        let servos = PerEffector::from_fn(|_| SERVO);
        let inputs = PerEffector::from_fn(|_| 0.2);
        let mut commands = PerEffector::from_fn(|_| 0.3);
        commands[tvc_jet::RUDDER] = f64::NAN;
        commands[tvc_jet::ENGINE] = f64::INFINITY;
        let accepted = accepted(8, &servos, &commands, &inputs);
        assert_eq!(accepted[tvc_jet::RUDDER], 0.2);
        assert_eq!(accepted[tvc_jet::ENGINE], 0.2);
        assert_eq!(accepted[tvc_jet::LEFT_AILERON], 0.3);
    }
}

#[cfg(test)]
mod second_order_tests {
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
