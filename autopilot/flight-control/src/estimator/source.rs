//! Watches the samples of one sensor: which are new, which are believed, and since when not.

use icd::SimTime;

use crate::estimator_status::SourceHealth;

/// Without a valid new sample for this long a sensor is lost, µs.
const LOST_US: u64 = 1_000_000;
/// Samples that repeat one value for this long, and at least so often, are stuck, µs.
const STUCK_US: u64 = 1_000_000;
const STUCK_SAMPLES: u32 = 5;
/// Most values of a sample.
const VALUES: usize = 6;

/// The samples of one sensor.
#[derive(Debug, Clone, Copy, Default)]
pub struct Source {
    /// Time of measurement of the last sample.
    measured: Option<SimTime>,
    /// When the last new sample came.
    came: SimTime,
    values: [u64; VALUES],
    /// Since when its samples have these values, and how many.
    same_since: SimTime,
    same: u32,
    /// Since when every sample has been rejected.
    rejected_since: Option<SimTime>,
    late: bool,
    /// Its samples are wrong in the mean.
    doubted: bool,
    /// Samples that were rejected.
    pub rejections: u32,
    /// Innovation of the last one, of its gate.
    pub ratio: f64,
}

impl Source {
    /// Shows it a sample; true if it is new, valid and plausible, and does not repeat the ones before.
    pub fn is_new(
        &mut self,
        now: SimTime,
        measured: SimTime,
        is_good: bool,
        values: &[f64],
    ) -> bool {
        // The last sample of a slow sensor comes with every packet until there is a newer one.
        if !is_good || self.measured.is_some_and(|last| measured <= last) {
            return false;
        }
        let mut bits = [0; VALUES];
        for (bits, value) in bits.iter_mut().zip(values) {
            *bits = value.to_bits();
        }
        if self.measured.is_none() || bits != self.values {
            (self.values, self.same_since, self.same) = (bits, now, 0);
        }
        self.same = self.same.saturating_add(1);
        (self.measured, self.came) = (Some(measured), now);
        !self.is_stuck(now)
    }

    /// Whether its samples have repeated one value for too long.
    pub fn is_stuck(&self, now: SimTime) -> bool {
        self.same > STUCK_SAMPLES && micros(self.same_since, now) >= STUCK_US
    }

    /// Samples that repeat one value are in order, as those of a vane in still air.
    pub fn forget_repeats(&mut self) {
        self.same = 0;
    }

    /// Remembers that a sample was believed, with its innovation over its gate.
    pub fn believe(&mut self, ratio: f64) {
        (self.ratio, self.rejected_since, self.late) = (ratio, None, false);
    }

    /// Remembers that a sample was rejected; true if all have been for this long, s, and it is to be believed again.
    pub fn reject(&mut self, now: SimTime, ratio: f64, patience_s: f64) -> bool {
        (self.ratio, self.late) = (ratio, false);
        self.rejections = self.rejections.saturating_add(1);
        let since = *self.rejected_since.get_or_insert(now);
        micros(since, now) as f64 * 1.0e-6 >= patience_s
    }

    /// Remembers that a sample came too late.
    pub fn mark_late(&mut self) {
        self.late = true;
    }

    /// Says whether its samples are wrong in the mean; then none is believed.
    pub fn doubt(&mut self, doubted: bool) {
        self.doubted = doubted;
    }

    /// Whether they are.
    pub fn is_doubted(&self) -> bool {
        self.doubted
    }

    /// Seconds since the last new sample; infinite before the first.
    pub fn silence_s(&self, now: SimTime) -> f64 {
        self.measured.map_or(f64::INFINITY, |_| micros(self.came, now) as f64 * 1.0e-6)
    }

    /// What is to be said of it.
    pub fn health(&self, now: SimTime) -> SourceHealth {
        if self.measured.is_none() {
            SourceHealth::Unused
        // The worst that holds is said: who is silent is not called stuck or late any more.
        } else if micros(self.came, now) >= LOST_US {
            SourceHealth::Lost
        } else if self.is_stuck(now) {
            SourceHealth::Stuck
        } else if self.late {
            SourceHealth::Late
        } else if self.doubted
            || self.rejected_since.is_some_and(|since| micros(since, now) >= LOST_US / 2)
        {
            SourceHealth::Rejected
        } else {
            SourceHealth::Used
        }
    }
}

fn micros(from: SimTime, to: SimTime) -> u64 {
    to.as_micros().saturating_sub(from.as_micros())
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn ms(millis: u64) -> SimTime {
        SimTime::from_micros(1_000 * millis)
    }

    #[test]
    fn a_repeated_sample_is_not_new_and_silence_is_a_loss() {
        let mut source = Source::default();
        assert_eq!(source.health(ms(0)), SourceHealth::Unused);
        assert!(source.is_new(ms(0), ms(0), true, &[1.0]));
        assert!(!source.is_new(ms(2), ms(0), true, &[1.0]), "the same measurement");
        assert!(!source.is_new(ms(4), ms(4), false, &[2.0]), "not valid");
        assert_eq!(source.health(ms(900)), SourceHealth::Used);
        assert_eq!(source.health(ms(1_000)), SourceHealth::Lost);
        assert!(source.is_new(ms(1_100), ms(1_100), true, &[2.0]));
        assert_eq!(source.health(ms(1_100)), SourceHealth::Used);
    }

    #[test]
    fn new_samples_with_one_value_are_stuck_until_it_changes() {
        let mut source = Source::default();
        let news: u32 = (0..200)
            .map(|step| u32::from(source.is_new(ms(10 * step), ms(10 * step), true, &[3.0])))
            .sum();
        assert_eq!(news, 100, "one second");
        assert_eq!(source.health(ms(2_000)), SourceHealth::Stuck);
        assert!(source.is_new(ms(2_000), ms(2_000), true, &[3.1]));
        assert_eq!(source.health(ms(2_000)), SourceHealth::Used);
    }

    #[test]
    fn steady_rejection_is_forgiven_after_the_patience() {
        let mut source = Source::default();
        assert!(source.is_new(ms(0), ms(0), true, &[0.0]));
        for step in 0..30 {
            let now = ms(100 * step);
            source.is_new(now, now, true, &[step as f64]);
            assert!(!source.reject(now, 2.0, 3.0), "{step}");
        }
        assert_eq!(source.health(ms(2_900)), SourceHealth::Rejected);
        assert!(source.reject(ms(3_000), 2.0, 3.0));
        source.believe(0.5);
        assert_eq!(source.health(ms(2_900)), SourceHealth::Used);
        assert_eq!(source.rejections, 31);
    }
}
