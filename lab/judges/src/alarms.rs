//! How often a detector with other levels would wake on a healthy aircraft.

use flight_control::gains::ActivationGains;
use lab_engine::FlightSetup;
use lab_engine::flight::Tick;
use nalgebra::Vector3;

use crate::{Judge, onset_s};

/// Levels that are tried, in units of those that fly.
const SCALES: [f64; 8] = [0.4, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 3.0];

/// Numbers of the judge, from ten seconds after the start to the first fault: the time, how often the detector that flies woke, alarms of
/// detectors with these levels, z2 over its level.
pub const COLUMNS: [(&str, &str); 16] = [
    ("healthy_s", "s"),
    ("woken", "1"),
    ("alarms_at_0_4", "1"),
    ("alarms_at_0_6", "1"),
    ("alarms_at_0_8", "1"),
    ("alarms_at_1", "1"),
    ("alarms_at_1_2", "1"),
    ("alarms_at_1_5", "1"),
    ("alarms_at_2", "1"),
    ("alarms_at_3", "1"),
    ("z2_roll_rms", "1"),
    ("z2_pitch_rms", "1"),
    ("z2_yaw_rms", "1"),
    ("z2_roll_largest", "1"),
    ("z2_pitch_largest", "1"),
    ("z2_yaw_largest", "1"),
];

/// The turbulence builds up before this time, s.
const SETTLED_S: f64 = 10.0;
/// An alarm that goes on counts again after this time, s: as a detector that is reset would.
const AGAIN_S: f64 = 5.0;

/// Counts.
#[derive(Debug, Clone)]
pub struct AlarmsJudge {
    gains: ActivationGains,
    period_s: f64,
    /// The first fault, s.
    until_s: f64,
    ticks: f64,
    is_active: bool,
    woken: f64,
    /// Of each level: how long z2 has been above it, when it may count again, and alarms.
    above_s: [f64; SCALES.len()],
    again_s: [f64; SCALES.len()],
    alarms: [f64; SCALES.len()],
    squares: Vector3<f64>,
    largest: Vector3<f64>,
}

impl AlarmsJudge {
    pub fn of(setup: &FlightSetup) -> Self {
        let onset_s = setup.plant.faults.iter().map(onset_s);
        Self {
            gains: setup.parameters.gains.activation,
            period_s: setup.plant.period.as_seconds(),
            until_s: onset_s.fold(f64::INFINITY, f64::min),
            ticks: 0.0,
            is_active: false,
            woken: 0.0,
            above_s: [0.0; SCALES.len()],
            again_s: [SETTLED_S; SCALES.len()],
            alarms: [0.0; SCALES.len()],
            squares: Vector3::zeros(),
            largest: Vector3::zeros(),
        }
    }
}

impl Judge for AlarmsJudge {
    fn look(&mut self, tick: &Tick<'_>) {
        let now_s = tick.exchange.time.as_seconds();
        if now_s >= self.until_s {
            return;
        }
        let over_level = tick.log.levels;
        let level = over_level.amax();
        for (place, scale) in SCALES.iter().enumerate() {
            let above_s = &mut self.above_s[place];
            *above_s = if level > *scale { *above_s + self.period_s } else { 0.0 };
            // Half a step for rounding.
            let lasts = *above_s > self.gains.on_dwell_s - 0.5 * self.period_s;
            if lasts && now_s >= self.again_s[place] {
                self.alarms[place] += 1.0;
                self.again_s[place] = now_s + AGAIN_S;
            }
        }
        if now_s >= SETTLED_S {
            self.ticks += 1.0;
            self.squares += over_level.component_mul(&over_level);
            self.largest = self.largest.sup(&over_level.abs());
            let wakes = tick.log.compensator_active && !self.is_active;
            self.woken += f64::from(u8::from(wakes));
            self.is_active = tick.log.compensator_active;
        }
    }

    fn values(&self) -> Vec<Option<f64>> {
        let rms = (self.squares / self.ticks).map(f64::sqrt);
        let counts = [self.ticks * self.period_s, self.woken].into_iter().chain(self.alarms);
        let all = counts.chain(rms.iter().copied()).chain(self.largest.iter().copied());
        all.map(|value| (self.ticks > 0.0).then_some(value)).collect()
    }
}
