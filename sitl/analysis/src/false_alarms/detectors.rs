//! Many detectors at once on the estimate of one flight, and how sure one can be of how often they wake.
//!
//! The detector of `flight_control::activation` wakes when the level was above one for its dwell without a break,
//! which is when the smallest level in a window of that length is above one. So one sliding minimum for each filter
//! and dwell serves all heights of the level.

use std::collections::VecDeque;

use icd::ControlPeriod;
use nalgebra::Vector3;

/// Time constants of the lag on z2, s; zero is none.
pub const FILTERS_S: [f64; 4] = [0.0, 0.05, 0.1, 0.2];
/// Times above the level before the detector wakes, s.
pub const DWELLS_S: [f64; 4] = [0.02, 0.05, 0.1, 0.2];
/// Heights of the levels, in units of those in the gains.
pub const SCALES: usize = 29;
/// Pairs of filter and dwell.
pub const KINDS: usize = FILTERS_S.len() * DWELLS_S.len();

/// Height of number `index`: from 0.4 to 3.2 by tenths.
pub fn scale(index: usize) -> f64 {
    f64::from(u32::try_from(index).unwrap_or(u32::MAX) + 4) / 10.0
}

/// A number for each detector: filter and dwell (the dwell runs fastest), then height.
pub type PerDetector<T> = [[T; SCALES]; KINDS];

/// The detectors on one flight.
pub struct Detectors {
    keep: [f64; FILTERS_S.len()],
    lagged: [Vector3<f64>; FILTERS_S.len()],
    windows: [Window; KINDS],
    tick: u32,
    started: bool,
}

/// Smallest value of the last so many ticks.
struct Window {
    ticks: u32,
    /// (tick, value), rising from the smallest of the window on.
    rising: VecDeque<(u32, f64)>,
}

impl Window {
    /// The smallest value with this one; before the window is full, nothing has lasted long enough: zero.
    fn smallest(&mut self, tick: u32, value: f64) -> f64 {
        while self.rising.back().is_some_and(|(_, last)| *last >= value) {
            self.rising.pop_back();
        }
        self.rising.push_back((tick, value));
        while self.rising.front().is_some_and(|(first, _)| *first + self.ticks <= tick) {
            self.rising.pop_front();
        }
        if tick + 1 < self.ticks { 0.0 } else { self.rising.front().map_or(0.0, |(_, v)| *v) }
    }
}

impl Detectors {
    /// Before the first tick.
    pub fn new(period: ControlPeriod) -> Self {
        let h = period.as_seconds();
        let keep = |tau_s: f64| if tau_s > 0.0 { libm::exp(-h / tau_s) } else { 0.0 };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a dwell has at most some hundred ticks"
        )]
        let window = |dwell_s: f64| Window {
            ticks: libm::round(dwell_s / h).max(1.0) as u32,
            rising: VecDeque::new(),
        };
        Self {
            keep: FILTERS_S.map(keep),
            lagged: [Vector3::zeros(); FILTERS_S.len()],
            windows: std::array::from_fn(|kind| window(DWELLS_S[kind % DWELLS_S.len()])),
            tick: 0,
            started: false,
        }
    }

    /// One tick with the estimate z2 in units of its levels; `awake` gets each detector that is above its level for its dwell.
    pub fn step(&mut self, z2: &Vector3<f64>, mut awake: impl FnMut(usize, usize)) {
        for (filter, lagged) in self.lagged.iter_mut().enumerate() {
            let keep = if self.started { self.keep[filter] } else { 0.0 };
            *lagged = *z2 + (*lagged - *z2) * keep;
            let level = lagged.amax();
            for dwell in 0..DWELLS_S.len() {
                let kind = filter * DWELLS_S.len() + dwell;
                let smallest = self.windows[kind].smallest(self.tick, level);
                for index in (0..SCALES).take_while(|index| smallest > scale(*index)) {
                    awake(kind, index);
                }
            }
        }
        self.started = true;
        self.tick += 1;
    }
}

/// Chance that the true rate lies above the bound.
const RISK: f64 = 0.05;

/// One-sided 95 % upper bound of a mean count, from `events` counted: Poisson.
///
/// It is the mean for which so few events or fewer have a probability of 5 %, which is half the 95 % quantile of the
/// chi-square distribution with 2 (events + 1) degrees of freedom.
pub fn upper_95(events: u32) -> f64 {
    let n = f64::from(events);
    let (mut low, mut high) = (n, n + 10.0 + 5.0 * n.sqrt());
    // Each step halves the interval; sixty of them reach the last bit.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at_most(events, middle) > RISK {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Probability of at most `events` where `mean` are expected; in logarithms, so that large means do not underflow.
fn at_most(events: u32, mean: f64) -> f64 {
    let mut logarithm = -mean;
    let mut sum = libm::exp(logarithm);
    for k in 1..=events {
        logarithm += libm::log(mean / f64::from(k));
        sum += libm::exp(logarithm);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use flight_control::activation::Activation;
    use flight_control::gains::ActivationGains;
    use flight_control::{CompensatorMode, Gains};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_detector_at_scale_one_wakes_at_the_tick_of_the_one_that_flies(
            jumps in proptest::collection::vec((-1.5..1.5_f64, 1_usize..40), 1..60),
        ) {
            let gains = ActivationGains { on_dwell_s: 0.02, ..Gains::REFERENCE.activation };
            let mut flown = Activation::new(ControlPeriod::DEFAULT);
            let mut ours = Detectors::new(ControlPeriod::DEFAULT);
            let (mut theirs_at, mut ours_at) = (None, None);
            let series = jumps.iter().flat_map(|(value, ticks)| std::iter::repeat_n(*value, *ticks));
            for (tick, roll) in series.enumerate() {
                let z2 = Vector3::new(roll * gains.level_roll, 0.0, 0.0);
                if flown.step(&z2, &gains.levels(), &gains, CompensatorMode::Off).active && theirs_at.is_none() {
                    theirs_at = Some(tick);
                }
                ours.step(&Vector3::new(roll, 0.0, 0.0), |kind, index| {
                    // No filter, a dwell of 20 ms, the levels of the gains.
                    if kind == 0 && (scale(index) - 1.0).abs() < 1e-9 && ours_at.is_none() {
                        ours_at = Some(tick);
                    }
                });
            }
            prop_assert_eq!(ours_at, theirs_at);
        }
    }

    #[test]
    fn the_lag_takes_its_time_constant_for_most_of_a_step() {
        let mut detectors = Detectors::new(ControlPeriod::DEFAULT);
        detectors.step(&Vector3::zeros(), |_, _| {});
        for _ in 0..50 {
            detectors.step(&Vector3::new(1.0, 0.0, 0.0), |_, _| {});
        }
        // 100 ms with time constants of 0, 0.05, 0.1 and 0.2 s.
        for (lagged, tau_s) in detectors.lagged.iter().zip(FILTERS_S) {
            let expected = if tau_s > 0.0 { 1.0 - libm::exp(-0.1 / tau_s) } else { 1.0 };
            assert!((lagged.x - expected).abs() < 1e-12, "{tau_s} s: {}", lagged.x);
        }
    }

    #[test]
    fn the_bound_is_that_of_published_tables() {
        // Half of the 95 % quantile of chi-square with 2, 4, 22 and 202 degrees of freedom.
        for (events, bound) in [(0, 2.9957), (1, 4.7439), (10, 16.9622), (100, 118.08)] {
            let ours = upper_95(events);
            assert!((ours - bound).abs() < 0.01, "{events}: {ours}");
        }
    }

    #[test]
    fn a_hundred_hours_may_have_at_most_83_alarms_for_one_an_hour() {
        let most = (0..200).take_while(|events| upper_95(*events) <= 100.0).last();
        assert_eq!(most, Some(83));
    }

    #[test]
    fn the_bound_holds_where_a_single_probability_underflows() {
        let bound = upper_95(5_000);
        // Normal approximation: n + 1.645 sqrt(n), some units more for the skew.
        assert!((bound - (5_000.0 + 1.645 * 5_000.0_f64.sqrt())).abs() < 4.0, "{bound}");
    }
}
