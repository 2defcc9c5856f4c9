//! Faults of sensors: what they do to samples that are otherwise as good as the grade.
//!
//! | fault | the sample |
//! |---|---|
//! | off, the gap of an intermittent one | the last one from before, declared invalid |
//! | stuck | its value from before with new times, valid |
//! | bias, drift, noise | with an error on each axis |
//! | delayed | that of so long ago; at the onset the last one waits, so that none comes twice |
//!
//! The axes are the three of gyro, accelerometer and magnetometer; roll, pitch and yaw; north, east and down of a position (not of
//! the velocity); both vanes; a pressure, and with it what is computed from it; the thrust.

use std::collections::VecDeque;

use icd::fault::SensorKind;
use icd::{Body, Sensors, SimTime};

use super::real::{airspeed_m_s, moved, turned};
use crate::atmosphere::pressure_altitude_m;
use crate::faults::{DELAY_MAX_S, Faults, SensorEffect, micros};
use crate::noise::{Normals, Source};

/// What the faults of sensors need from earlier periods.
#[derive(Debug, Clone)]
pub(super) struct FaultySensors {
    /// Samples since the onset of the first delay, oldest first, with the times at which they came.
    history: VecDeque<(SimTime, Sensors)>,
    capacity: usize,
    /// Samples of the last period, as they would be without faults.
    last: Option<Sensors>,
    states: [FaultySensor; Sensors::SENSORS],
}

/// The fault of one sensor.
#[derive(Debug, Clone)]
struct FaultySensor {
    /// Onset of the fault that acts.
    onset: Option<SimTime>,
    /// The samples from before the onset, or from before the gap.
    before: Option<Sensors>,
    /// Noise of the sample with this time.
    noise: [f64; 3],
    noise_of: Option<SimTime>,
    normals: Normals,
}

impl FaultySensors {
    /// All sensors are healthy. It takes its memory here and not in flight.
    pub fn new(period_us: u32, seed: u64, run: u64) -> Self {
        // At most some thousand periods.
        let capacity = (micros(DELAY_MAX_S) / u64::from(period_us)) as usize + 2;
        let states = SensorKind::ALL.map(|sensor| FaultySensor {
            onset: None,
            before: None,
            noise: [0.0; 3],
            noise_of: None,
            normals: Normals::new(seed, run, Source::SensorFault(sensor)),
        });
        Self { history: VecDeque::with_capacity(capacity), capacity, last: None, states }
    }

    /// Gives the samples of this period the effects of the faults.
    pub fn apply(&mut self, now: SimTime, faults: &Faults, out: &mut Sensors) {
        // Kept in every period, since a fault may begin in the next one.
        if !faults.has_sensor_faults() {
            self.last = Some(*out);
            return;
        }
        let last = self.last.replace(*out);
        let healthy = *out;
        let mut is_delayed = false;
        for (sensor, state) in SensorKind::ALL.into_iter().zip(&mut self.states) {
            let Some((onset, effect)) = faults.on_sensor(sensor, now) else {
                state.onset = None;
                continue;
            };
            let before = last.unwrap_or(healthy);
            let is_new = state.onset.replace(onset) != Some(onset);
            // Between its gaps an intermittent fault renews what will stand in during the next one.
            if is_new || effect == SensorEffect::None {
                state.before = Some(before);
            }
            let before = state.before.unwrap_or(before);
            match effect {
                SensorEffect::None => {}
                SensorEffect::Off => {
                    out.copy_sample(sensor, &before);
                    out.invalidate(|other| other == sensor);
                }
                SensorEffect::Stuck => out.copy_value(sensor, &before),
                SensorEffect::Offset(offset) => add(sensor, [offset; 3], out),
                SensorEffect::Noise { rms } => {
                    let time = out.stamps()[sensor as usize].time;
                    // A slow sensor repeats its sample for some periods, and with it the noise.
                    if state.noise_of.replace(time) != Some(time) {
                        state.noise = [(); 3].map(|()| state.normals.draw());
                    }
                    add(sensor, state.noise.map(|number| rms * number), out);
                }
                SensorEffect::Delayed { delay_us } => {
                    is_delayed = true;
                    // What came before the onset has arrived already, and no sample comes twice.
                    let is_due = |(came, _): &&(SimTime, Sensors)| {
                        *came >= onset && came.as_micros() + delay_us <= now.as_micros()
                    };
                    let newest = self.history.iter().rev().find(is_due);
                    // Without a delay the sample of this period is due already.
                    let arrived = newest.map_or(&before, |(_, samples)| samples);
                    if delay_us > 0 {
                        out.copy_sample(sensor, arrived);
                    }
                }
            }
        }
        self.remember(now, is_delayed, &healthy);
    }

    fn remember(&mut self, now: SimTime, is_delayed: bool, healthy: &Sensors) {
        // Without a delay nothing reads the history, and it need not grow.
        if !is_delayed {
            self.history.clear();
            return;
        }
        if self.history.len() == self.capacity {
            self.history.pop_front();
        }
        self.history.push_back((now, *healthy));
    }
}

/// Adds an error, SI units, to the axes of a sensor.
fn add(sensor: SensorKind, error: [f64; 3], to: &mut Sensors) {
    let [x, y, z] = error;
    let on_axes = |value: &Body| Body(value.0 + Body::new(x, y, z).0);
    match sensor {
        SensorKind::Gyro => to.gyro.value = on_axes(&to.gyro.value),
        SensorKind::Accelerometer => to.accelerometer.value = on_axes(&to.accelerometer.value),
        SensorKind::Magnetometer => to.magnetometer_nt.value = on_axes(&to.magnetometer_nt.value),
        SensorKind::Attitude => to.attitude.value = turned(&to.attitude.value, error),
        SensorKind::Gnss => {
            let velocity = to.gnss.value.velocity;
            to.gnss.value = moved(&to.gnss.value, error, velocity);
        }
        SensorKind::Barometer => {
            let value = &mut to.barometer.value;
            let was_m = pressure_altitude_m(value.pressure_pa);
            value.pressure_pa += x;
            // What a changed pressure changes in the altitude, whatever the altitude refers to.
            value.altitude_m += pressure_altitude_m(value.pressure_pa) - was_m;
        }
        SensorKind::Pitot => {
            // It is a divisor, and a pressure with errors may be zero.
            let static_pa = to.barometer.value.pressure_pa.max(1.0);
            let value = &mut to.pitot.value;
            let was_m_s = airspeed_m_s(value.impact_pa, static_pa);
            value.impact_pa += x;
            let change_m_s = airspeed_m_s(value.impact_pa, static_pa) - was_m_s;
            value.airspeed_m_s = (value.airspeed_m_s + change_m_s).max(0.0);
        }
        SensorKind::Vanes => {
            to.vanes.value.angle_of_attack_rad += x;
            to.vanes.value.sideslip_rad += y;
        }
        SensorKind::EngineMonitor => to.engine_n.value += x,
        SensorKind::RadarAltimeter => to.radar_altimeter_m.value += x,
        SensorKind::WeightOnWheels => to.weight_on_wheels_n.value += x,
        SensorKind::FuelGauge => to.fuel_gauge_pct.value += x,
    }
}
