//! What a fault of a sensor does to the state that the laws read.

use flight_control::estimator_status::SourceHealth;
use icd::fault::Target;
use icd::sensors::SensorKind;
use lab_engine::FlightSetup;
use lab_engine::flight::Tick;

use crate::{Judge, onset_s};

/// Numbers of the judge: largest errors of the state from the onset of the first fault on, and those of the last ten seconds; the part of
/// that time in which the compensator is active; what the estimator reports of the sensor while it fails, a [`SourceHealth`] as a number.
pub const COLUMNS: [(&str, &str); 8] = [
    ("attitude_error", "rad"),
    ("attitude_error_end", "rad"),
    ("airspeed_error", "m/s"),
    ("airspeed_error_end", "m/s"),
    ("altitude_error", "m"),
    ("altitude_error_end", "m"),
    ("compensator_active", "1"),
    ("sensor_health", "1"),
];

/// The end of a flight is its last seconds.
const END_S: f64 = 10.0;

/// Sums and maxima from the onset on.
#[derive(Debug, Clone, Copy, Default)]
pub struct SensorFaultJudge {
    sensor: Option<SensorKind>,
    /// Onset, repair and end of the flight, s.
    times_s: [f64; 3],
    /// Attitude, airspeed and altitude: since the onset, and at the end.
    errors: [[f64; 2]; 3],
    active: f64,
    ticks: f64,
    reported: SourceHealth,
}

impl SensorFaultJudge {
    pub fn of(setup: &FlightSetup) -> Self {
        let fault = setup.plant.faults.first();
        let onset_s = fault.map_or(0.0, onset_s);
        let lasts_s = fault.and_then(|fault| fault.timing.duration_s).unwrap_or(f64::INFINITY);
        let sensor = fault.and_then(|fault| match fault.target {
            Target::Sensor(sensor) => Some(sensor),
            Target::Effector(_) | Target::Part(_) => None,
        });
        let times_s = [onset_s, onset_s + lasts_s, setup.duration.as_seconds()];
        Self { sensor, times_s, ..Self::default() }
    }
}

impl Judge for SensorFaultJudge {
    fn look(&mut self, tick: &Tick<'_>) {
        let (truth, state) = (tick.plant.truth(), &tick.log.state);
        let now_s = truth.time.as_seconds();
        let [onset_s, repair_s, end_s] = self.times_s;
        if now_s < onset_s {
            return;
        }
        let turned = truth.attitude.q_ned_from_body * state.orientation.q_ned_from_body.inverse();
        let errors = [
            turned.angle(),
            (truth.airspeed_m_s - state.airspeed_m_s).abs(),
            (truth.altitude_m - state.altitude_m).abs(),
        ];
        for ([since, at_end], error) in self.errors.iter_mut().zip(errors) {
            *since = since.max(error);
            if now_s > end_s - END_S {
                *at_end = at_end.max(error);
            }
        }
        self.ticks += 1.0;
        self.active += f64::from(u8::from(tick.log.compensator_active));
        if let (Some(sensor), Some(status)) = (self.sensor, &state.estimate)
            && now_s < repair_s
        {
            let health = status.source(sensor);
            // The first report, or a loss that follows it: a sensor that comes back hides no loss.
            if health.is_gone() || self.reported == SourceHealth::Unused {
                self.reported = health;
            }
        }
    }

    fn values(&self) -> Vec<Option<f64>> {
        let part = self.active / self.ticks;
        let all = self.errors.iter().flatten().copied();
        let all = all.chain([part, f64::from(self.reported as u8)]);
        all.map(|value| (self.ticks > 0.0).then_some(value)).collect()
    }
}
