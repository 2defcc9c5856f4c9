//! The measures of a flight, taken tick by tick; docs/fly.md defines each.
//!
//! Nothing grows with the length of the flight: sums, the last 10 s, and the 10 s after the fault.

use std::collections::VecDeque;

use flight_control::{AircraftModel, DesignModel, ObserverMode, StepLog};
use icd::units::DEG;
use icd::{EffectorList, EulerAngles};
use nalgebra::Vector3;
use plant_sim::{Airframe, Truth};

use super::outcome::Metric;
use crate::closed_loop::expected_acceleration;
use crate::metrics::wrap;
use effectors::Used;

mod effectors;
mod lag;

/// Transients are judged for so long after the fault, s.
const TRANSIENT_S: f64 = 10.0;
/// Steady flight is judged over the last seconds.
const STEADY_S: f64 = 10.0;
/// What has recovered stays within its band for so long until the end, s.
const RECOVERED_S: f64 = 3.0;
/// Bands of recovery: roll, rad, and altitude, m.
const BANDS: [f64; 2] = [2.0 * DEG, 10.0];
/// Longest lag of the estimate that is looked for, s.
const LAG_MAX_S: f64 = 0.5;

/// Signals that are tracked, with the unit of their error, of its integral, of its square, and of time times it.
const TRACKED: [(&str, [&str; 4]); 6] = [
    ("altitude", ["m", "m s", "m2 s", "m s2"]),
    ("roll", ["rad", "rad s", "rad2 s", "rad s2"]),
    ("airspeed", ["m/s", "m", "m2/s", "m s"]),
    ("roll_rate", ["rad/s", "rad", "rad2/s", "rad s"]),
    ("pitch_rate", ["rad/s", "rad", "rad2/s", "rad s"]),
    ("yaw_rate", ["rad/s", "rad", "rad2/s", "rad s"]),
];
/// Of these, the ones that have a reference; no law has one for a rate, whose error is the rate.
const REFERRED: usize = 3;
/// Peaks of the transient.
const PEAKS: [(&str, &str); 6] = [
    ("roll_rate", "rad/s"),
    ("pitch_rate", "rad/s"),
    ("yaw_rate", "rad/s"),
    ("roll_error", "rad"),
    ("angle_of_attack", "rad"),
    ("sideslip", "rad"),
];
/// Axes of the estimate.
const AXES: [&str; 3] = ["roll", "pitch", "yaw"];

/// What a tick is measured by.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    pub truth: &'a Truth,
    /// The angles of the true attitude.
    pub attitude: &'a EulerAngles,
    /// What the controller made of it.
    pub log: &'a StepLog,
    /// Altitude, m; roll, rad; airspeed, m/s.
    pub references: [f64; 3],
}

/// Sums over a flight.
#[derive(Debug, Clone)]
pub struct Measures {
    period_s: f64,
    list: EffectorList,
    /// The controller's, against which the truth F is measured.
    model: DesignModel,
    observer: ObserverMode,
    ticks: f64,
    errors: [MeasureSums; 6],
    effectors: Used,
    /// When a fault acted first, s, and the altitude then, m.
    fault: Option<(f64, f64)>,
    peaks: [f64; 6],
    altitude_min_m: f64,
    /// When roll and altitude were last outside of their bands after the fault, s.
    outside_s: [Option<f64>; 2],
    /// Time and errors of the last seconds.
    steady: VecDeque<[f64; 1 + REFERRED]>,
    /// z2 and F of each axis in the transient.
    transient: [[Vec<f64>; 2]; 3],
    /// z2 before the fault.
    healthy: [Spread; 3],
    /// z2 - F from the fault on.
    estimate: [Spread; 3],
    activation: ActivationTimes,
    last_s: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct MeasureSums {
    absolute: f64,
    squares: f64,
    timed: f64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Spread {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Spread {
    fn add(&mut self, value: f64) {
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
    }

    /// Root of the mean square; `None` of nothing.
    fn rms(&self) -> Option<f64> {
        (self.count > 0.0).then(|| (self.squares / self.count).sqrt())
    }

    /// Standard deviation; `None` of nothing.
    fn deviation(&self) -> Option<f64> {
        let mean = self.sum / self.count;
        (self.count > 0.0).then(|| (self.squares / self.count - mean * mean).max(0.0).sqrt())
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct ActivationTimes {
    is_active: bool,
    toggles: f64,
    false_alarms: f64,
    /// First activation after the fault, s.
    detected_s: Option<f64>,
}

impl Measures {
    /// For an aircraft that is flown with this control period, s, by a controller with this model and observer.
    pub fn new(
        airframe: &Airframe,
        model: &AircraftModel,
        observer: ObserverMode,
        period_s: f64,
    ) -> Self {
        Self {
            period_s,
            list: airframe.effectors,
            model: DesignModel::new(*model),
            observer,
            ticks: 0.0,
            errors: [MeasureSums::default(); 6],
            effectors: Used::new(airframe),
            fault: None,
            peaks: [0.0; 6],
            altitude_min_m: f64::INFINITY,
            outside_s: [None; 2],
            steady: VecDeque::new(),
            transient: Default::default(),
            healthy: [Spread::default(); 3],
            estimate: [Spread::default(); 3],
            activation: ActivationTimes::default(),
            last_s: 0.0,
        }
    }

    pub fn tick(&mut self, measured: &Measured<'_>) {
        let Measured { truth, attitude, log, references: [altitude, roll, airspeed] } = *measured;
        let t_s = truth.time.as_seconds();
        let (p, q, r) = (truth.body_rates.0.x, truth.body_rates.0.y, truth.body_rates.0.z);
        let roll_error = wrap(roll - attitude.phi);
        let errors =
            [altitude - truth.altitude_m, roll_error, airspeed - truth.airspeed_m_s, p, q, r];
        if self.fault.is_none() && truth.fault_codes.iter().any(|(_, code)| *code != 0) {
            self.fault = Some((t_s, truth.altitude_m));
        }
        self.ticks += 1.0;
        self.last_s = t_s;
        let since_s = t_s - self.fault.map_or(0.0, |(at_s, _)| at_s);
        for (sums, error) in self.errors.iter_mut().zip(errors) {
            sums.absolute += error.abs() * self.period_s;
            sums.squares += error * error * self.period_s;
            sums.timed += since_s * error.abs() * self.period_s;
        }
        self.track_steady(t_s, &errors);
        self.effectors.tick(&log.commands, &truth.positions, self.period_s);
        self.track_activation(t_s, log.compensator_active);
        if self.fault.is_none() {
            for (spread, z2) in self.healthy.iter_mut().zip(&log.z2) {
                spread.add(*z2);
            }
            return;
        }
        let fault = truth.angular_acceleration.0 - self.expected(measured);
        for (spread, (z2, fault)) in self.estimate.iter_mut().zip(log.z2.iter().zip(&fault)) {
            spread.add(z2 - fault);
        }
        // In the order of the bands: roll, then altitude.
        for ((outside_s, band), error) in
            self.outside_s.iter_mut().zip(BANDS).zip([errors[1], errors[0]])
        {
            if error.abs() > band {
                *outside_s = Some(t_s);
            }
        }
        if since_s > TRANSIENT_S {
            return;
        }
        let signals = [p, q, r, roll_error, truth.alpha_rad, truth.beta_rad];
        for (peak, signal) in self.peaks.iter_mut().zip(signals) {
            *peak = peak.max(signal.abs());
        }
        self.altitude_min_m = self.altitude_min_m.min(truth.altitude_m);
        for (columns, values) in self.transient.iter_mut().zip(log.z2.iter().zip(&fault)) {
            columns[0].push(*values.0);
            columns[1].push(*values.1);
        }
    }

    /// What the design model expects at the true state for healthy effectors at their modelled positions, rad/s².
    fn expected(&self, measured: &Measured<'_>) -> Vector3<f64> {
        let Measured { truth, attitude, log, .. } = *measured;
        let of_truth = [
            truth.body_rates.0.x,
            truth.body_rates.0.y,
            truth.body_rates.0.z,
            truth.alpha_rad,
            truth.beta_rad,
            truth.airspeed_m_s,
            truth.altitude_m,
            self.model.engine().map_or(0.0, |engine| truth.deflections[engine]),
        ];
        let s = &log.state;
        let of_sensors = [
            s.rates.x,
            s.rates.y,
            s.rates.z,
            s.alpha,
            s.beta,
            s.airspeed_m_s,
            s.altitude_m,
            s.thrust_n,
        ];
        // Where the sensors report the truth, the observer has computed just that.
        let same = of_truth.map(f64::to_bits) == of_sensors.map(f64::to_bits);
        match (self.observer, same) {
            (ObserverMode::Informed, true) => log.modelled_acceleration,
            _ => expected_acceleration(&self.model, truth, attitude, &log.modelled),
        }
    }

    fn track_steady(&mut self, t_s: f64, errors: &[f64; 6]) {
        self.steady.push_back([t_s, errors[0], errors[1], errors[2]]);
        while self.steady.front().is_some_and(|[at_s, ..]| *at_s < t_s - STEADY_S) {
            self.steady.pop_front();
        }
    }

    fn track_activation(&mut self, t_s: f64, now: bool) {
        let ActivationTimes { is_active, toggles, false_alarms, detected_s } = &mut self.activation;
        *toggles += f64::from(u8::from(now != *is_active));
        match self.fault {
            None => *false_alarms += f64::from(u8::from(now && !*is_active)),
            Some((at_s, _)) if now => {
                detected_s.get_or_insert(t_s - at_s);
            }
            Some(_) => {}
        }
        *is_active = now;
    }

    /// Every measure, with `lost_s`, when the aircraft was lost.
    pub fn metrics(&self, lost_s: Option<f64>) -> Vec<Metric> {
        let mut all = Vec::new();
        self.tracking(&mut all);
        self.transient_and_steady(&mut all);
        self.control(&mut all);
        self.estimation(&mut all);
        self.detection(&mut all);
        let after_s = |lost_s: f64| lost_s - self.fault.map_or(0.0, |(at_s, _)| at_s);
        all.push(Metric::new("time_to_loss", "s", lost_s.map(after_s)));
        all
    }

    fn tracking(&self, all: &mut Vec<Metric>) {
        let flown_s = self.ticks * self.period_s;
        for ((name, [plain, integral, square, timed]), sums) in TRACKED.iter().zip(&self.errors) {
            all.push(Metric::new(format!("{name}_iae"), integral, Some(sums.absolute)));
            all.push(Metric::new(format!("{name}_ise"), square, Some(sums.squares)));
            all.push(Metric::new(format!("{name}_itae"), timed, Some(sums.timed)));
            let rmse = (sums.squares / flown_s).sqrt();
            all.push(Metric::new(format!("{name}_rmse"), plain, Some(rmse)));
        }
    }

    fn transient_and_steady(&self, all: &mut Vec<Metric>) {
        let broken = self.fault.is_some();
        for ((name, unit), peak) in PEAKS.iter().zip(self.peaks) {
            all.push(Metric::new(format!("peak_{name}"), unit, broken.then_some(peak)));
        }
        let lost_m = self.fault.map(|(_, at_m)| (at_m - self.altitude_min_m).max(0.0));
        all.push(Metric::new("altitude_lost", "m", lost_m));
        for (name, outside_s) in ["roll", "altitude"].into_iter().zip(self.outside_s) {
            let recovered = self.fault.and_then(|(at_s, _)| {
                // That tick was the last one outside, so it is back with the next.
                let back_s = outside_s.map_or(at_s, |outside_s| outside_s + self.period_s);
                (self.last_s - back_s >= RECOVERED_S).then_some(back_s - at_s)
            });
            all.push(Metric::new(format!("recovery_time_{name}"), "s", recovered));
        }
        for (index, (name, [unit, ..])) in TRACKED.iter().take(REFERRED).enumerate() {
            let sum: f64 = self.steady.iter().map(|tick| tick[1 + index]).sum();
            // Ticks of ten seconds.
            let mean = sum / self.steady.len() as f64;
            let is_long = self.last_s >= STEADY_S;
            all.push(Metric::new(format!("steady_offset_{name}"), unit, is_long.then_some(mean)));
        }
    }

    fn control(&self, all: &mut Vec<Metric>) {
        let flown_s = self.ticks * self.period_s;
        for effector in self.list.all() {
            let used = self.effectors.of(effector);
            let units =
                if self.list.is_angle(effector) { ["rad2 s", "rad"] } else { ["N2 s", "N"] };
            let key = self.list.key(effector);
            let percent = |share: f64| Some(100.0 * share);
            all.push(Metric::new(format!("effort_{key}"), units[0], Some(used.effort)));
            all.push(Metric::new(format!("travel_{key}"), units[1], Some(used.travel)));
            let reversals = used.reversals / flown_s;
            all.push(Metric::new(format!("reversals_{key}"), "1/s", Some(reversals)));
            let at_limit = percent(used.at_limit / self.ticks);
            all.push(Metric::new(format!("at_limit_{key}"), "%", at_limit));
            all.push(Metric::new(format!("authority_used_{key}"), "%", percent(used.farthest)));
        }
    }

    fn estimation(&self, all: &mut Vec<Metric>) {
        for (axis, name) in AXES.iter().enumerate() {
            let unit = "rad/s2";
            let (rmse, noise) = (self.estimate[axis].rms(), self.healthy[axis].deviation());
            all.push(Metric::new(format!("estimate_rmse_{name}"), unit, rmse));
            all.push(Metric::new(format!("estimate_noise_{name}"), unit, noise));
            all.push(Metric::new(format!("estimate_overshoot_{name}"), "%", self.overshoot(axis)));
            all.push(Metric::new(format!("estimate_lag_{name}"), "s", self.lag_s(axis)));
        }
    }

    /// How far the estimate's peak in the transient is beyond that of the truth, percent of the latter.
    fn overshoot(&self, axis: usize) -> Option<f64> {
        let [z2, fault] = &self.transient[axis];
        let peak = |values: &[f64]| values.iter().map(|value| value.abs()).fold(0.0, f64::max);
        // A truth without a peak gives no finite number, and so no measure.
        (!z2.is_empty()).then(|| 100.0 * (peak(z2) - peak(fault)) / peak(fault))
    }

    /// The shift with which the truth in the transient looks most like the estimate, s.
    fn lag_s(&self, axis: usize) -> Option<f64> {
        // A few hundred ticks.
        let longest = (LAG_MAX_S / self.period_s) as usize;
        let [z2, fault] = &self.transient[axis];
        // A few hundred ticks.
        let shift = lag::best_shift(z2, fault, longest)? as f64;
        Some(shift * self.period_s)
    }

    fn detection(&self, all: &mut Vec<Metric>) {
        let ActivationTimes { toggles, false_alarms, detected_s, .. } = self.activation;
        let broken = self.fault.is_some();
        let healthy_s = self.fault.map_or(self.ticks * self.period_s, |(at_s, _)| at_s);
        let missed = f64::from(u8::from(detected_s.is_none()));
        let per_hour = (healthy_s > 0.0).then(|| false_alarms * 3_600.0 / healthy_s);
        let per_minute = toggles * 60.0 / (self.ticks * self.period_s);
        let fault_s = self.fault.map(|(at_s, _)| at_s);
        all.push(Metric::new("fault_at", "s", fault_s));
        all.push(Metric::new("detection_delay", "s", detected_s));
        all.push(Metric::new("fault_missed", "1", broken.then_some(missed)));
        all.push(Metric::new("false_alarms", "1/h", per_hour));
        all.push(Metric::new("activation_toggles", "1/min", Some(per_minute)));
    }
}
