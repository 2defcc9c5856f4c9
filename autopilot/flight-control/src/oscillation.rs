//! Not in the paper: notices that the compensation oscillates, and slows it down to what is steady.
//!
//! A late effector answers a quick demand when the demand has changed its sign already. The observer, whose model has
//! the effector in time, takes the difference for a fault, and the compensation drives what it means to cancel.
//! Neither the effector nor the delay can be known here. What can be seen is an estimate that turns back and
//! forth without becoming smaller, although all of it is compensated. Then only the slow part of the estimate is:
//! a fault that is steady stays compensated, and the loop is too slow for the delay. If the roll oscillates on, large
//! enough for the servos' rate limits to keep it alive, the main controller's aileron command is made smaller too.
//! Pitch and yaw yield together where one nozzle gives both: if it is late, it is late on both axes.
//!
//! What swings in turbulence anyway does not count: the threshold is above what the estimate did while the compensator slept.
//!
//! ```text
//!            N half cycles of nearly the same size, above the threshold; a large one is two
//!   quick ----------------------------------------------------------> yields: slow part only
//!         <----------------------------------------------------------
//!          the oscillation has ended, and the time of the retry is over; the quick part comes back over 4 s
//! ```

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::Visitor;
use crate::relief::gains::ReliefGains;

/// Longest half cycle that counts, s: an effector at the end of its travel holds one side longer than the other.
const HALF_CYCLE_MAX_S: f64 = 2.0;
/// Longest time of two half cycles in a row, s: slower motion is the aircraft's own, and the compensator can follow it.
const CYCLE_MAX_S: f64 = 2.4;
/// A half cycle of so many thresholds counts as [`LARGE_COUNTS`]: until three of them have been seen the aircraft is lost.
const LARGE: f64 = 5.0;
/// As how many half cycles a large one counts.
const LARGE_COUNTS: f64 = 2.0;
/// The threshold lies so many standard deviations of the estimate in quiet flight above that of the gains.
const NOISE: f64 = 3.0;
/// Time over which this deviation is taken, s.
const NOISE_S: f64 = 5.0;
/// Shortest half cycle that counts, s: quicker ones are noise.
const HALF_CYCLE_MIN_S: f64 = 0.05;
/// A half cycle with less than this part of the one before ends the count: the oscillation dies down by itself.
const DECAY: f64 = 0.8;
/// Time in which the quick part goes, s.
const YIELD_S: f64 = 0.1;
/// Time in which it comes back, s.
const RETURN_S: f64 = 4.0;
/// Half cycles after the compensator has yielded, after which the main controller has to yield too.
const PERSISTS_AFTER: f64 = 3.0;
/// Longest time until the next retry, s.
const RETRY_MAX_S: f64 = 320.0;

/// One axis.
#[derive(Debug, Clone, Copy, Default)]
struct AxisOscillation {
    /// The slow part of the estimate, rad/s².
    slow: f64,
    /// Largest or smallest estimate since the last turn, by `rises`, rad/s².
    extreme: f64,
    /// The estimate at the last turn, rad/s².
    turn: f64,
    /// Size of the half cycle before, rad/s².
    swing_before: f64,
    /// Time since the last turn was seen, s.
    since_s: f64,
    /// Time between the last two turns, s.
    before_s: f64,
    /// Mean and variance of the estimate while nothing is compensated, rad/s² and its square.
    asleep: [f64; 2],
    /// Half cycles in a row.
    count: f64,
    /// Is yielding.
    yields: bool,
    /// How much of the quick part is held back, 0 to 1.
    quiet: f64,
    /// How much of what may be held back of the main controller's command is, 0 to 1.
    calm: f64,
    /// It oscillated on after it yielded.
    persists: bool,
    /// Time since it yielded, or since the oscillation was seen last, s.
    rest_s: f64,
    /// Time of the next rest, as a multiple of that of the gains; 0 before the first one.
    rests: f64,
    rises: bool,
}

/// Watches the three axes.
#[derive(Debug, Clone, Default)]
pub struct OscillationWatch {
    axes: [AxisOscillation; 3],
}

/// How much of the quick part of each axis is held back.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Quiet {
    /// Roll, pitch, yaw: 0 none, 1 all.
    pub axes: Vector3<f64>,
    /// How much of what may be held back of the main controller's aileron command is: 0 none, 1 all.
    pub main_roll: f64,
}

impl Quiet {
    /// Whether any axis yields.
    pub fn any(&self) -> bool {
        self.axes.iter().any(|axis| *axis > 0.0)
    }
}

impl OscillationWatch {
    /// Forgets everything.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Shows the continuous states: the slow parts of the estimate.
    pub fn states(&mut self, visit: &mut Visitor<'_>) {
        for axis in &mut self.axes {
            visit(&mut axis.slow);
        }
    }

    /// One period of `h` s with the estimate `z2`, rad/s², of which `fade` is compensated; `levels` are those of the activation, rad/s².
    /// With `one_nozzle`, the same nozzle turns in pitch and in yaw. Returns the estimate to compensate, and how much of its
    /// quick part is held back.
    pub fn step(
        &mut self,
        z2: &Vector3<f64>,
        levels: &Vector3<f64>,
        fade: f64,
        one_nozzle: bool,
        gains: &ReliefGains,
        h: f64,
    ) -> (Vector3<f64>, Quiet) {
        let mut quiet = Quiet::default();
        for (index, axis) in self.axes.iter_mut().enumerate() {
            axis.step(z2[index], levels[index], fade, gains, h);
            quiet.axes[index] = axis.quiet;
        }
        if one_nozzle {
            let both = quiet.axes.y.max(quiet.axes.z);
            (quiet.axes.y, quiet.axes.z) = (both, both);
        }
        quiet.main_roll = self.axes[0].calm;
        let slow = Vector3::from_fn(|index, _| self.axes[index].slow);
        let used = z2.zip_zip_map(&slow, &quiet.axes, |z2, slow, quiet| {
            // The estimate itself, to the bit, while nothing yields.
            if quiet == 0.0 { z2 } else { z2 - quiet * (z2 - slow) }
        });
        (used, quiet)
    }
}

impl AxisOscillation {
    fn step(&mut self, z2: f64, level: f64, fade: f64, gains: &ReliefGains, h: f64) {
        // Followed at all times, so that a yield begins with the slow part of before it.
        self.slow += (z2 - self.slow) * (h / (h + gains.yield_lag_s));
        let [mean, variance] = &mut self.asleep;
        // Once compensated, the swings of a late effector would raise the very threshold that they have to pass.
        if fade == 0.0 {
            let (deviation, way) = (z2 - *mean, h / (h + NOISE_S));
            *mean += deviation * way;
            *variance += (deviation * deviation - *variance) * way;
        }
        let noise = NOISE * libm::sqrt(*variance);
        self.count_half_cycles(z2, gains.oscillation_level * level + noise, h);
        let oscillates = self.count >= gains.oscillation_count;
        if oscillates && fade > 0.0 && !self.yields {
            self.yields = true;
            self.rests = (2.0 * self.rests).max(1.0);
            self.rest_s = 0.0;
        }
        if self.yields {
            self.rest_s = if oscillates { 0.0 } else { self.rest_s + h };
            let rest_s = (self.rests * gains.retry_s).min(RETRY_MAX_S);
            self.yields = self.rest_s < rest_s;
        }
        self.persists = self.yields
            && (self.persists || self.count >= gains.oscillation_count + PERSISTS_AFTER);
        let (target, time_s) = if self.persists { (1.0, YIELD_S) } else { (0.0, RETURN_S) };
        let way = h / time_s;
        self.calm += (target - self.calm).clamp(-way, way);
        let (target, time_s) = if self.yields { (1.0, YIELD_S) } else { (0.0, RETURN_S) };
        let way = h / time_s;
        self.quiet += (target - self.quiet).clamp(-way, way);
    }

    /// Counts half cycles, from one turn of the estimate to the next, of nearly the same size or growing; anything else
    /// starts the count again. A turn counts when the estimate has come back by the threshold.
    fn count_half_cycles(&mut self, z2: f64, threshold: f64, h: f64) {
        self.since_s += h;
        if self.since_s > HALF_CYCLE_MAX_S {
            self.count = 0.0;
        }
        let sign = if self.rises { 1.0 } else { -1.0 };
        if sign * (z2 - self.extreme) >= 0.0 {
            self.extreme = z2;
        } else if sign * (self.extreme - z2) > threshold {
            let swing = (self.extreme - self.turn).abs();
            let counts = swing >= threshold.max(DECAY * self.swing_before)
                && (HALF_CYCLE_MIN_S..=HALF_CYCLE_MAX_S).contains(&self.since_s)
                && (self.count == 0.0 || self.before_s + self.since_s <= CYCLE_MAX_S);
            let by = if swing > LARGE * threshold { LARGE_COUNTS } else { 1.0 };
            self.count = if counts { self.count + by } else { 0.0 };
            self.before_s = self.since_s;
            (self.swing_before, self.turn, self.extreme) = (swing, self.extreme, z2);
            (self.since_s, self.rises) = (0.0, !self.rises);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 0.002;
    const LEVELS: Vector3<f64> = Vector3::new(1.0, 0.3, 0.2);

    /// Steps through a roll estimate for so many seconds; returns what was held back at the end, and the last estimate.
    fn run(
        watch: &mut OscillationWatch,
        seconds: f64,
        signal: impl Fn(f64) -> f64,
    ) -> (Quiet, f64) {
        run_axes(watch, seconds, 1.0, |t| Vector3::new(signal(t), 0.0, 0.0))
    }

    fn run_axes(
        watch: &mut OscillationWatch,
        seconds: f64,
        fade: f64,
        signal: impl Fn(f64) -> Vector3<f64>,
    ) -> (Quiet, f64) {
        let mut last = (Quiet::default(), 0.0);
        let mut t = 0.0;
        while t < seconds {
            let gains = &ReliefGains::REFERENCE;
            let (used, quiet) = watch.step(&signal(t), &LEVELS, fade, true, gains, H);
            (last, t) = ((quiet, used.x), t + H);
        }
        last
    }

    #[test]
    fn a_steady_fault_and_one_that_settles_are_compensated_in_full() {
        let mut watch = OscillationWatch::default();
        let (quiet, used) = run(&mut watch, 10.0, |t| if t < 1.0 { 0.0 } else { 5.0 });
        assert_eq!((quiet, used), (Quiet::default(), 5.0));
        let (quiet, _) = run(&mut watch, 10.0, |t| 5.0 + 4.0 * libm::exp(-t) * libm::sin(6.0 * t));
        assert_eq!(quiet, Quiet::default());
    }

    #[test]
    fn an_oscillation_that_stays_is_answered_by_its_slow_part_and_the_quick_part_comes_back() {
        let mut watch = OscillationWatch::default();
        let (quiet, used) = run(&mut watch, 4.0, |t| 3.0 + 2.0 * libm::sin(8.0 * t));
        assert_eq!(quiet.axes, Vector3::new(1.0, 0.0, 0.0));
        assert!((used - 3.0).abs() < 0.5, "{used} rad/s2");
        let retry_s = ReliefGains::REFERENCE.retry_s;
        assert!(run(&mut watch, retry_s - 1.0, |_| 3.0).0.any());
        assert!(!run(&mut watch, 1.0 + HALF_CYCLE_MAX_S + RETURN_S, |_| 3.0).0.any());
        // Once more: the next time is twice as long.
        run(&mut watch, 4.0, |t| 3.0 + 2.0 * libm::sin(8.0 * t));
        assert!(run(&mut watch, 2.0 * retry_s - 1.0, |_| 3.0).0.any());
    }

    #[test]
    fn one_late_nozzle_yields_on_both_of_its_axes_after_two_large_half_cycles() {
        let mut watch = OscillationWatch::default();
        // At the end of the travel for 1.4 s, and back within 0.7 s, as a nozzle 300 ms late swings with a jammed elevator.
        let swings = |t: f64| if t.rem_euclid(2.1) < 1.4 { -1.4 } else { 0.7 };
        let pitch = |t: f64| Vector3::new(0.0, swings(t), 0.1);
        assert!(!run_axes(&mut watch, 2.0, 1.0, pitch).0.any());
        let (quiet, _) = run_axes(&mut watch, 2.0, 1.0, pitch);
        assert_eq!(quiet.axes, Vector3::new(0.0, 1.0, 1.0));
    }

    #[test]
    fn what_turbulence_did_before_does_not_count_afterwards() {
        let air = |t: f64| Vector3::new(0.5 * libm::sin(8.0 * t), 0.0, 0.0);
        let mut calm = OscillationWatch::default();
        assert!(run_axes(&mut calm, 4.0, 1.0, air).0.any());
        let mut rough = OscillationWatch::default();
        run_axes(&mut rough, 20.0, 0.0, air);
        assert!(!run_axes(&mut rough, 20.0, 1.0, air).0.any());
        // What swings by more than that still does.
        assert!(run_axes(&mut rough, 4.0, 1.0, |t| 4.0 * air(t)).0.any());
    }

    #[test]
    fn what_is_small_or_slow_does_not_count() {
        let mut watch = OscillationWatch::default();
        assert!(!run(&mut watch, 20.0, |t| 0.15 * libm::sin(8.0 * t)).0.any());
        assert!(!run(&mut watch, 20.0, |t| 3.0 * libm::sin(1.5 * t)).0.any());
    }
}
