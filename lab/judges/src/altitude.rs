//! Whether the altitude is held at the end of a flight, and what that costs.

use lab_engine::FlightSetup;
use lab_engine::flight::Tick;

use crate::Judge;

/// The end of a flight is its last seconds.
pub const END_S: f64 = 20.0;

/// Numbers of the judge.
pub const COLUMNS: [(&str, &str); 4] = [
    ("end_altitude_error", "m"),
    ("largest_altitude_error", "m"),
    ("end_airspeed_error", "m/s"),
    ("largest_angle_of_attack", "rad"),
];

/// Errors are what the controller knows minus its reference.
#[derive(Debug, Clone, Default)]
pub struct AltitudeJudge {
    end_s: f64,
    /// Largest altitude error of the end, m; `None` before it.
    pub error_m: Option<f64>,
    /// Largest altitude error of the whole flight, m.
    pub largest_m: Option<f64>,
    /// Airspeed minus its reference at the last tick, m/s.
    pub airspeed_error_m_s: Option<f64>,
    /// Largest angle of attack, rad.
    pub alpha_max_rad: Option<f64>,
}

impl AltitudeJudge {
    pub fn of(setup: &FlightSetup) -> Self {
        Self { end_s: setup.duration.as_seconds(), ..Self::default() }
    }
}

fn raise(largest: &mut Option<f64>, value: f64) {
    *largest = Some(largest.map_or(value, |before| before.max(value)));
}

impl Judge for AltitudeJudge {
    fn look(&mut self, tick: &Tick<'_>) {
        let (state, demand) = (&tick.log.state, &tick.snapshot.demand);
        let error_m = (state.altitude_m - demand.altitude_m).abs();
        if tick.exchange.time.as_seconds() >= self.end_s - END_S {
            raise(&mut self.error_m, error_m);
        }
        raise(&mut self.largest_m, error_m);
        raise(&mut self.alpha_max_rad, state.alpha);
        self.airspeed_error_m_s = Some(state.airspeed_m_s - demand.airspeed_m_s);
    }

    fn values(&self) -> Vec<Option<f64>> {
        vec![self.error_m, self.largest_m, self.airspeed_error_m_s, self.alpha_max_rad]
    }
}
