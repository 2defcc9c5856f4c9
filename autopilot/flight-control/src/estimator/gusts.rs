//! How strong the gusts are, and whether the pitot tube still agrees with velocity over the ground and steady wind.
//!
//! The wind is a steady part, which walks slowly, and gusts: a Gauss-Markov process with the length of turbulence over the airspeed
//! as its time. The size of the gusts is not known before a flight.

use icd::SimTime;
use nalgebra::Vector3;

use super::covariance::{Row, STEADY_WIND, VELOCITY, WIND};
use super::updates::{PitotReading, Present};
use super::{Estimator, GroundFix, air};
use crate::design_model::doubt::GUST_LENGTH_MIN_M;

/// The change of the gusts over this time shows their size, µs: long against what the filter needs to follow them.
const LOOK_EVERY_US: u64 = 1_000_000;
/// The size is a mean over so many looks, and at the start as if so many had shown the assumed size.
const LOOKS: f64 = 30.0;
const LOOKS_ASSUMED: f64 = 4.0;
/// A step of the size counts for at least this part of what is observed.
const OBSERVED_MIN: f64 = 0.25;
/// Bounds of the size, m/s rms: what tactical air data can tell from calm air, and a thunderstorm.
const GUST_MIN_M_S: f64 = 0.15;
const GUST_MAX_M_S: f64 = 20.0;
/// Below this airspeed gusts do not change more slowly, m/s.
const SLOWEST_M_S: f64 = 20.0;
/// Time over which measured airspeed and that of steady wind are compared, s.
const CONTRAST_S: f64 = 10.0;
/// A steady wind that the pitot tube has agreed with is remembered every so many looks, and the one before it.
const REMEMBER_LOOKS: u32 = 30;
/// The pitot tube is wrong when their difference is beyond so many standard deviations, and right again within this part of it.
const CONTRAST_MAX: f64 = 5.0;
const CONTRAST_AGAIN: f64 = 0.4;

/// Size of the gusts, and what the pitot tube shows against steady wind.
#[derive(Debug, Clone, Default)]
pub struct Gusts {
    /// Mean square along an axis, m²/s².
    square: f64,
    looks: f64,
    before: Option<Vector3<f64>>,
    due: SimTime,
    /// Steady winds of the past, the older one last, and looks since the first of them.
    past: [Option<Vector3<f64>>; 2],
    since_past: u32,
    /// Measured airspeed minus that of steady wind, m/s.
    contrast: Contrast,
}

/// Mean of the last [`CONTRAST_S`] of a difference, and when it was last updated.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Contrast {
    mean: f64,
    compared: Option<SimTime>,
}

impl Contrast {
    /// The mean with one more value.
    pub(super) fn follow(&mut self, now: SimTime, value: f64) -> f64 {
        // The first value has no time behind it and does not count yet.
        let before = self.compared.replace(now).unwrap_or(now);
        let seconds = now.as_micros().saturating_sub(before.as_micros()) as f64 * 1.0e-6;
        self.mean += (value - self.mean) * (1.0 - libm::exp(-seconds / CONTRAST_S));
        self.mean
    }
}

impl Gusts {
    /// Before the first look.
    pub fn new(size_m_s: f64) -> Self {
        Self { square: size_m_s * size_m_s, looks: LOOKS_ASSUMED, ..Self::default() }
    }

    /// Mean square along an axis, m²/s².
    pub fn square(&self) -> f64 {
        self.square
    }

    /// Looks at estimated gusts whose errors have the mean variance `unknown`, m²/s².
    ///
    /// For a Gauss-Markov process with factor φ the estimate changes with the mean square (1 - φ²)(σ² - P), so σ² is that change
    /// over 1 - φ² plus P. What nothing observes has P = σ², and changes nothing.
    fn look(&mut self, gusts: &Vector3<f64>, unknown: f64, factor: f64) {
        if let Some(before) = self.before.replace(*gusts) {
            let changed = (gusts - before * factor).norm_squared() / 3.0;
            // No more of the gusts can be unknown than there is.
            let seen = changed / (1.0 - factor * factor) + unknown.min(self.square);
            self.looks = (self.looks + 1.0).min(LOOKS);
            // Where little is observed, little of a wrong size shows.
            let observed = (1.0 - unknown / self.square).max(OBSERVED_MIN);
            self.square += (seen - self.square) / (self.looks * observed);
            let bounds = [GUST_MIN_M_S, GUST_MAX_M_S].map(|size| size * size);
            self.square = self.square.clamp(bounds[0], bounds[1]);
        }
    }
}

impl Estimator {
    /// Correlation time of the gusts, s.
    pub(super) fn gust_s(&self) -> f64 {
        let height_m = self.near_ground.height_m.unwrap_or(f64::INFINITY);
        self.passing_s(self.gains.gust_length_m.min(height_m.max(GUST_LENGTH_MIN_M)))
    }

    /// Time in which a length passes, s.
    fn passing_s(&self, length_m: f64) -> f64 {
        let airspeed = self.estimate.velocity - self.estimate.steady_wind;
        length_m / airspeed.norm().max(SLOWEST_M_S)
    }

    /// The wind is the steady one and unknown gusts.
    pub(super) fn forget_gusts(&mut self) {
        // The vertical wind has no steady part.
        for axis in 0..2 {
            self.estimate.wind[axis] = self.estimate.steady_wind[axis];
            self.covariance.derive(WIND + axis, STEADY_WIND + axis, self.gusts.square);
        }
    }

    /// Learns the size of the gusts from their estimate.
    pub(super) fn follow_gusts(&mut self, now: SimTime) {
        if now < self.gusts.due {
            return;
        }
        self.gusts.due = SimTime::from_micros(now.as_micros() + LOOK_EVERY_US);
        let factor = libm::exp(-(LOOK_EVERY_US as f64) * 1.0e-6 / self.gust_s());
        let gusts = self.estimate.wind - self.estimate.steady_wind;
        let variance = |row: Row| self.covariance.variance_of_changing(&row);
        let across = |axis| Row::empty().with(WIND + axis, 1.0).with(STEADY_WIND + axis, -1.0);
        let down = variance(Row::empty().with(WIND + 2, 1.0));
        let unknown = (variance(across(0)) + variance(across(1)) + down) / 3.0;
        self.gusts.look(&gusts, unknown, factor);
        if self.sources.pitot.health(now) == super::SourceHealth::Used {
            self.gusts.since_past += 1;
        }
        if self.gusts.since_past >= REMEMBER_LOOKS {
            self.gusts.past = [Some(self.estimate.steady_wind), self.gusts.past[0]];
            self.gusts.since_past = 0;
        }
    }

    /// Compares a measured airspeed with that of steady wind, and says whether the pitot tube agrees with it in the mean.
    ///
    /// Gusts of a Gauss-Markov process with time τ have the variance σ² τ / (τ + T) after a lag T. A drift that is slow against the
    /// filter goes into the gusts first, and stays there.
    pub(super) fn pitot_agrees(
        &mut self,
        now: SimTime,
        present: &Present,
        reading: &PitotReading,
    ) -> bool {
        let Some(GroundFix { place, .. }) = &self.ground else { return true };
        let steady = self.estimate.velocity - place.start_from_ned * self.estimate.steady_wind;
        let Some(flow) = air::speed(&present.matrix.tr_mul(&steady)) else { return true };
        let along = present.matrix * flow.gradient;
        let wind = -place.start_from_ned.tr_mul(&along);
        let row = Row::empty()
            .with_vector(VELOCITY, &along)
            .with(STEADY_WIND, wind.x)
            .with(STEADY_WIND + 1, wind.y);
        let row = reading.with_errors(row, 1.0);
        let known = self.covariance.compare(&row, 0.0, 0.0).variance;
        // The long ones, that are also near the ground.
        let time = self.passing_s(self.gains.gust_length_m);
        let gusts = self.gusts.square * time / (time + CONTRAST_S);
        let contrast = self.gusts.contrast.follow(now, reading.airspeed_m_s - flow.value);
        self.is_within(contrast, known + gusts)
    }

    /// Whether a difference of the pitot tube with this variance lets it be right.
    pub(super) fn is_within(&self, contrast: f64, variance: f64) -> bool {
        let limit = match self.sources.pitot.is_doubted() {
            true => CONTRAST_MAX * CONTRAST_AGAIN,
            false => CONTRAST_MAX,
        };
        contrast.abs() <= limit * libm::sqrt(variance)
    }

    /// The airspeed goes on with the steady wind of a time when the pitot tube was right: the present one has followed it a little.
    pub(super) fn doubt_pitot(&mut self) {
        // The older one: a slow drift may have begun before the younger was remembered.
        if let Some(wind) = self.gusts.past[1] {
            self.estimate.steady_wind = wind;
        }
        self.forget_gusts();
        self.sources.pitot.doubt(true);
    }

    /// Variance of a quantity of the flow.
    pub(super) fn flow_variance(&self, present: &Present, of: air::FlowOf) -> f64 {
        let parts = of(&present.through_air).and_then(|flow| self.vectors(present, &flow.gradient));
        parts.map_or(0.0, |parts| self.covariance.variance_of_vectors(&parts))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_nothing_observes_leaves_the_size_of_the_gusts_as_it_is() {
        let mut gusts = Gusts::new(2.0);
        for _ in 0..100 {
            gusts.look(&Vector3::zeros(), 4.0, 0.6);
        }
        assert!((gusts.square() - 4.0).abs() < 1.0e-12);
    }
}
