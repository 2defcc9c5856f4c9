//! When the compensator wakes: level, persistence, hysteresis, fade.
//!
//! The paper says "after the residual error increases to a certain level". The residual z - y returns to
//! zero once the observer has converged, so it cannot hold the compensator on; |z2| is used instead.

use icd::ControlPeriod;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::design_model::doubt::ModelDoubt;

/// Whether the compensator acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CompensatorMode {
    /// Never; the observer and the detector still run.
    Off,
    /// When the activation logic wakes it (normal).
    Armed,
    /// All the time, independent of the activation logic.
    AlwaysOn,
}

impl CompensatorMode {
    /// All of them with their names on a command line.
    pub const NAMES: &[(&'static str, Self)] =
        &[("off", Self::Off), ("armed", Self::Armed), ("always", Self::AlwaysOn)];
}

gain_set! {
    /// Gains of the activation logic.
    ///
    /// The set with which every outcome of the paper occurs; docs/estimation.md gives the reasons.
    ActivationGains at activation {
        /// Roll level of |z2|, rad/s².
        // False alarms set the three levels: at most one an hour of healthy flight in 3 m/s of turbulence, as the
        // upper 95 % bound (docs/decisions/147-activation-levels.md). A fault that makes less is not noticed.
        level_roll = 1.05, "ACT_LVL_P" "rad/s^2", 0.001 to 100.0, "Roll level of the estimate that wakes the compensator";
        /// Pitch level of |z2|, rad/s².
        level_pitch = 0.30, "ACT_LVL_Q" "rad/s^2", 0.001 to 100.0, "Pitch level of the estimate that wakes the compensator";
        /// Yaw level of |z2|, rad/s².
        level_yaw = 0.18, "ACT_LVL_R" "rad/s^2", 0.001 to 100.0, "Yaw level of the estimate that wakes the compensator";
        /// Standard deviations of the modelled acceleration that add to the levels.
        deviations = 2.0, "ACT_STD" "-", 0.0 to 20.0, "Standard deviations of the modelled acceleration, by those of the flow angles, that add to the levels";
        /// The level must be exceeded this long without a break, s.
        // A longer dwell, or a lag on z2, would allow lower levels, but would delay the detection of every fault by
        // 30 ms and more.
        on_dwell_s = 0.02, "ACT_T_ON" "s", 0.001 to 10.0, "Time above the level before the compensator wakes";
        /// Release below this fraction of the level.
        hysteresis = 0.25, "ACT_HYST" "-", 0.01 to 0.99, "Release below this fraction of the level";
        /// The estimate must stay below the release level this long without a break, s.
        off_dwell_s = 5.0, "ACT_T_OFF" "s", 0.001 to 600.0, "Time below the release level before it sleeps again";
        // A compensation that appears at once is a step on three effectors.
        /// The compensation fades in and out over this time, s.
        fade_s = 0.05, "ACT_FADE" "s", 0.001 to 10.0, "Time in which the compensation fades in and out";
    }
}

impl ActivationGains {
    /// Levels of roll, pitch and yaw where the model was made and the state is exact, rad/s².
    pub fn levels(&self) -> Vector3<f64> {
        Vector3::new(self.level_roll, self.level_pitch, self.level_yaw)
    }

    /// Levels where the model may be wrong by so much, rad/s²: they grow as the moments do, and the errors of the state add to
    /// them as independent ones.
    pub fn levels_with(&self, doubt: &ModelDoubt) -> Vector3<f64> {
        let grown = self.levels() * doubt.growth;
        grown.zip_map(&doubt.spread, |level, spread| libm::hypot(level, self.deviations * spread))
    }
}

/// State of the activation logic.
///
/// ```text
///            level > 1 for on_dwell
///   asleep ------------------------> awake        fade runs to 1 in fade_s
///          <------------------------
///      level < hysteresis for off_dwell           fade runs to 0 in fade_s
/// ```
#[derive(Debug, Clone)]
pub struct Activation {
    period: ControlPeriod,
    active: bool,
    /// Time above the level (asleep) or below the release level (awake) without a break, us.
    dwell_us: u64,
    fade: f64,
}

/// Output of the activation logic in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wakefulness {
    /// |z2| of roll, pitch and yaw in units of their levels.
    pub levels: Vector3<f64>,
    /// Largest |z2| in units of its level.
    pub level: f64,
    /// The detector's flag, whatever the mode.
    pub active: bool,
    /// How much of the compensation is let through, 0 to 1.
    pub fade: f64,
}

impl Activation {
    /// Asleep.
    pub fn new(period: ControlPeriod) -> Self {
        Self { period, active: false, dwell_us: 0, fade: 0.0 }
    }

    /// Back to sleep, at once.
    pub fn reset(&mut self) {
        *self = Self::new(self.period);
    }

    /// One step with the estimated fault acceleration and its levels, rad/s².
    pub fn step(
        &mut self,
        z2: &Vector3<f64>,
        levels: &Vector3<f64>,
        gains: &ActivationGains,
        mode: CompensatorMode,
    ) -> Wakefulness {
        let levels = z2.abs().component_div(levels);
        let level = levels.x.max(levels.y).max(levels.z);
        // Runs in every mode: the flag is reported with the compensator off, and it is up to date when the mode
        // changes in flight.
        self.detect(level, gains);
        let h = self.period.as_seconds();
        let rate = h / gains.fade_s;
        self.fade = match mode {
            CompensatorMode::Off => 0.0,
            CompensatorMode::AlwaysOn => 1.0,
            // The fade ends exactly at 0 and at 1: whoever uses it tests for zero by equality.
            CompensatorMode::Armed if self.active => (self.fade + rate).min(1.0),
            CompensatorMode::Armed => (self.fade - rate).max(0.0),
        };
        Wakefulness { levels, level, active: self.active, fade: self.fade }
    }

    fn detect(&mut self, level: f64, gains: &ActivationGains) {
        let (crossed, dwell_s) = if self.active {
            (level < gains.hysteresis, gains.off_dwell_s)
        } else {
            (level > 1.0, gains.on_dwell_s)
        };
        if !crossed {
            self.dwell_us = 0;
            return;
        }
        self.dwell_us += u64::from(self.period.as_micros());
        // Half a microsecond of slack: the dwell is a float, the count is not.
        // Far below 2^53.
        if self.dwell_us as f64 + 0.5 >= dwell_s * 1.0e6 {
            self.active = !self.active;
            self.dwell_us = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gains::Gains;

    /// One step with an estimate in roll, in units of its level.
    fn step(activation: &mut Activation, level: f64) -> Wakefulness {
        let gains = Gains::REFERENCE.activation;
        let z2 = Vector3::new(level * gains.level_roll, 0.0, 0.0);
        activation.step(&z2, &gains.levels(), &gains, CompensatorMode::Armed)
    }

    fn awake() -> Activation {
        let mut activation = Activation::new(ControlPeriod::DEFAULT);
        for _ in 0..50 {
            step(&mut activation, 1.5);
        }
        activation
    }

    #[test]
    fn it_wakes_after_20_ms_above_the_level_and_not_before() {
        let mut activation = Activation::new(ControlPeriod::DEFAULT);
        for tick in 1..=9 {
            assert!(!step(&mut activation, 1.01).active, "tick {tick}");
        }
        assert!(step(&mut activation, 1.01).active);
    }

    #[test]
    fn a_break_starts_the_count_again() {
        let mut activation = Activation::new(ControlPeriod::DEFAULT);
        for _ in 0..20 {
            for _ in 0..9 {
                assert!(!step(&mut activation, 1.01).active);
            }
            assert!(!step(&mut activation, 0.99).active);
        }
    }

    #[test]
    fn it_fades_in_over_50_ms() {
        let mut activation = Activation::new(ControlPeriod::DEFAULT);
        let ticks = (1..200).find(|_| step(&mut activation, 1.5).fade >= 1.0 - 1.0e-9);
        // 10 ticks to wake, the tenth of which already fades, then 25 of 2 ms.
        assert_eq!(ticks, Some(34));
    }

    #[test]
    fn it_releases_only_after_five_seconds_below_a_quarter_of_the_level() {
        let mut activation = awake();
        for _ in 0..10_000 {
            assert!(
                step(&mut activation, 0.26).active,
                "between release level and level it stays on"
            );
        }
        for _ in 0..2_499 {
            assert!(step(&mut activation, 0.24).active);
        }
        assert!(!step(&mut activation, 0.24).active);
        for _ in 0..25 {
            step(&mut activation, 0.0);
        }
        assert_eq!(step(&mut activation, 0.0).fade, 0.0, "exactly zero when asleep");
    }

    #[test]
    fn the_switch_overrides_the_fade_but_not_the_detector() {
        let gains = Gains::REFERENCE.activation;
        let mut activation = awake();
        let z2 = Vector3::new(1.0, 0.0, 0.0);
        let off = activation.step(&z2, &gains.levels(), &gains, CompensatorMode::Off);
        assert_eq!((off.active, off.fade), (true, 0.0));
        activation.reset();
        let on =
            activation.step(&Vector3::zeros(), &gains.levels(), &gains, CompensatorMode::AlwaysOn);
        assert_eq!((on.active, on.fade), (false, 1.0));
    }
}
