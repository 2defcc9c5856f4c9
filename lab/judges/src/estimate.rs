//! How wrong the estimator is about the air, and how wrong it says it is.

use flight_control::estimator::covariance::WIND;
use lab_engine::flight::Tick;

use crate::Judge;

/// The estimate is judged from this time on, s.
pub const SETTLED_S: f64 = 20.0;

/// Numbers of the judge.
pub const COLUMNS: [(&str, &str); 5] = [
    ("airspeed_estimate_rms", "m/s"),
    ("airspeed_estimate_stated_rms", "m/s"),
    ("airspeed_estimate_largest", "m/s"),
    ("attitude_estimate_largest", "rad"),
    ("wind_nees", "1"),
];

/// Sums over the seconds of a flight on estimated states.
#[derive(Debug, Clone, Copy, Default)]
pub struct EstimateJudge {
    from_s: f64,
    seconds: f64,
    /// Sums of squares: error of the airspeed, and what the estimator says of it, m²/s².
    squares: [f64; 2],
    nees: f64,
    /// Largest errors: airspeed, m/s; attitude, rad.
    pub largest: [f64; 2],
}

impl EstimateJudge {
    /// Judged from this time on, s.
    pub fn from(from_s: f64) -> Self {
        Self { from_s, ..Self::default() }
    }

    /// Seconds that were judged.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    fn mean(&self, sum: f64) -> f64 {
        sum / self.seconds.max(1.0)
    }

    /// Mean squares: error of the airspeed, and what the estimator says of it, m²/s².
    pub fn airspeed(&self) -> [f64; 2] {
        self.squares.map(|sum| self.mean(sum))
    }

    /// Normalised square of the error of the wind, its mean; three for a consistent estimator.
    pub fn wind_nees(&self) -> f64 {
        self.mean(self.nees)
    }
}

impl Judge for EstimateJudge {
    fn look(&mut self, tick: &Tick<'_>) {
        let (truth, state) = (tick.plant.truth(), &tick.log.state);
        let is_due = tick.exchange.time.as_micros().is_multiple_of(1_000_000);
        let (Some(estimator), Some(status)) = (tick.estimator, &state.estimate) else { return };
        if !is_due || truth.time.as_seconds() < self.from_s {
            return;
        }
        let airspeed = truth.airspeed_m_s - state.airspeed_m_s;
        let turned = truth.attitude.q_ned_from_body * state.orientation.q_ned_from_body.inverse();
        for (largest, error) in self.largest.iter_mut().zip([airspeed.abs(), turned.angle().abs()])
        {
            *largest = largest.max(error);
        }
        let stated = f64::from(status.airspeed_m_s);
        self.squares[0] += airspeed * airspeed;
        self.squares[1] += stated * stated;
        let wind = truth.wind.0 - estimator.estimate().wind;
        let inverse = estimator.covariance().block(WIND).try_inverse().unwrap_or_default();
        self.nees += wind.dot(&(inverse * wind));
        self.seconds += 1.0;
    }

    fn values(&self) -> Vec<Option<f64>> {
        let [error, stated] = self.airspeed().map(f64::sqrt);
        let all = [error, stated, self.largest[0], self.largest[1], self.wind_nees()];
        all.map(|value| (self.seconds > 0.0).then_some(value)).into()
    }
}
