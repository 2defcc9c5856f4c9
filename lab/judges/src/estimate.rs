//! How wrong the estimator is about the air, and how wrong it says it is.

use flight_control::estimator::covariance::WIND;
use icd::fault::{Onset, Target, Timing};
use lab_engine::FlightSetup;
use lab_engine::flight::Tick;
use plant_sim::ScheduledFault;

use crate::{Judge, every_second};

/// The estimate is judged from this time on, s, and from so long after a sensor failed for good.
pub const SETTLED_S: f64 = 20.0;
const AFTER_LOSS_S: f64 = 10.0;

/// Numbers of the judge.
pub const COLUMNS: [(&str, &str); 6] = [
    ("airspeed_estimate_rms", "m/s"),
    ("airspeed_estimate_stated_rms", "m/s"),
    ("airspeed_estimate_largest", "m/s"),
    ("attitude_estimate_largest", "rad"),
    ("wind_nees", "1"),
    ("altitude_deviation_largest", "m"),
];

/// Sums over the seconds of a flight on estimated states.
#[derive(Debug, Clone, Copy, Default)]
pub struct EstimateJudge {
    from_s: f64,
    seconds: f64,
    /// Sums of squares: error of the airspeed, and what the estimator says of it, m²/s².
    squares: [f64; 2],
    nees: f64,
    /// Largest errors: airspeed, m/s; attitude, rad; and the altitude from its reference, m.
    largest: [f64; 3],
}

impl EstimateJudge {
    pub fn of(setup: &FlightSetup) -> Self {
        let lost_s = |fault: &ScheduledFault| match (fault.target, fault.timing) {
            (Target::Sensor(_), Timing { onset: Onset::At(time), duration_s: None, .. }) => {
                Some(time.as_seconds() + AFTER_LOSS_S)
            }
            _ => None,
        };
        let end_s = setup.duration.as_seconds();
        // A sensor that fails near the end would leave nothing to judge.
        let lost_s = setup.plant.faults.iter().filter_map(lost_s).filter(|at_s| *at_s < end_s);
        let from_s = lost_s.fold(SETTLED_S, f64::max);
        Self { from_s, ..Self::default() }
    }
}

impl Judge for EstimateJudge {
    fn look(&mut self, tick: &Tick<'_>) {
        let (truth, state) = (tick.plant.truth(), &tick.log.state);
        let Some((estimator, status)) = every_second(tick, self.from_s) else { return };
        let airspeed = truth.airspeed_m_s - state.airspeed_m_s;
        let turned = truth.attitude.q_ned_from_body * state.orientation.q_ned_from_body.inverse();
        let altitude_m = truth.altitude_m - tick.snapshot.demand.altitude_m;
        let errors = [airspeed.abs(), turned.angle().abs(), altitude_m.abs()];
        for (largest, error) in self.largest.iter_mut().zip(errors) {
            *largest = largest.max(error);
        }
        let stated = f64::from(status.airspeed_m_s);
        self.squares[0] += airspeed * airspeed;
        self.squares[1] += stated * stated;
        let wind = truth.wind.0 - estimator.estimate().wind;
        // As of the judge `nees`: undefined where there is no inverse.
        let inverse = estimator.covariance().block(WIND).try_inverse();
        self.nees += inverse.map_or(f64::NAN, |inverse| wind.dot(&(inverse * wind)));
        self.seconds += 1.0;
    }

    fn values(&self) -> Vec<Option<f64>> {
        let [error, stated] = self.squares.map(|sum| (sum / self.seconds).sqrt());
        let [airspeed_m_s, attitude_rad, altitude_m] = self.largest;
        let wind_nees = self.nees / self.seconds;
        let all = [error, stated, airspeed_m_s, attitude_rad, wind_nees, altitude_m];
        all.map(|value| (self.seconds > 0.0).then_some(value).filter(|value| !value.is_nan()))
            .into()
    }
}
