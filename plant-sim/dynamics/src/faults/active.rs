//! The effect of each kind of fault while it is active, on effectors and sensors; the entry of the kind is in [`icd::fault::CATALOGUE`].

use icd::SimTime;
use icd::fault::{FaultKind, Side, Travel};

use super::effects::FaultEffect;
use super::micros;
use crate::servos::Servo;

/// What an engine without fuel has.
pub(super) const STARVED: FaultKind = FaultKind::FlameOut;

/// A fault that acts on an effector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ActiveFault {
    pub kind: FaultKind,
    since: SimTime,
    ramp_us: u64,
    /// Ends of the reachable range, rad or N: the servo's travel, extended to the position at the onset.
    ends: [f64; 2],
    /// Fastest speed of the healthy servo, rad/s or N/s.
    fastest: f64,
    slew: Option<Slew>,
}

/// The present effect of a fault on a sensor, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SensorEffect {
    None,
    /// No valid samples; the last value stands in.
    Off,
    /// Valid samples with the value of the onset.
    Stuck,
    /// Every axis is off by this much.
    Offset(f64),
    /// White noise on every axis.
    Noise {
        rms: f64,
    },
    /// Samples of so long ago.
    Delayed {
        /// The delay, µs.
        delay_us: u64,
    },
}

/// The motion of an effector to the position where it sticks.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Slew {
    /// Speed, rad/s.
    rate: f64,
    /// First whole microsecond at which it has arrived.
    arrival: SimTime,
    /// Where it sticks, rad.
    target: f64,
}

impl ActiveFault {
    /// A fault that begins at `now` on an effector whose servo is at `position`; a fault that moves the effector at
    /// once changes `position`. `reach` is the travel that the hinge moment leaves now, `effective` the effective deflection
    /// so far: an effector that sticks keeps it.
    pub fn begin(
        kind: FaultKind,
        ramp_us: u64,
        now: SimTime,
        servo: &Servo,
        [low, high]: [f64; 2],
        effective: f64,
        position: &mut f64,
    ) -> Self {
        let rate = servo.rate_limit;
        let slew = match kind {
            FaultKind::StuckHere => slew_to(effective, effective, None, 0, now),
            FaultKind::StuckAt { angle_rad, travel } => {
                let limit = (travel == Travel::AtActuatorRate).then_some(rate);
                slew_to(effective, angle_rad, limit, ramp_us, now)
            }
            FaultKind::HardOver { side } => {
                let end = match side {
                    Side::Positive => high,
                    Side::Negative => low,
                };
                slew_to(effective, end, Some(rate), 0, now)
            }
            FaultKind::Float => slew_to(effective, 0.0, None, ramp_us, now),
            _ => None,
        };
        if slew.is_some() {
            // What the air has felt goes on, also where the fault before took part of the effect.
            *position = effective;
        }
        let mut active = Self {
            kind,
            since: now,
            ramp_us,
            // An engine that is out is below its travel.
            ends: [servo.min.min(*position), servo.max],
            fastest: servo.fastest(),
            slew,
        };
        active.arrive(now, position);
        active
    }

    /// A fault of a sensor or of a part of the airframe that begins at `now`.
    pub fn of_others(kind: FaultKind, ramp_us: u64, now: SimTime) -> Self {
        // A sensor has no travel that would end a drift.
        let ends = [f64::NEG_INFINITY, f64::INFINITY];
        Self { kind, since: now, ramp_us, ends, fastest: f64::INFINITY, slew: None }
    }

    /// Its effect on a sensor at `now`.
    pub fn on_sensor(&self, now: SimTime) -> SensorEffect {
        match self.kind {
            FaultKind::Off => SensorEffect::Off,
            FaultKind::StuckHere => SensorEffect::Stuck,
            FaultKind::Delayed { delay_s } => {
                SensorEffect::Delayed { delay_us: micros(delay_s * self.size(now)) }
            }
            FaultKind::Intermittent { period_s, present } => {
                let [gap_end, _] = self.period(period_s, present, now);
                if now < gap_end { SensorEffect::Off } else { SensorEffect::None }
            }
            FaultKind::Biased { .. } | FaultKind::Drifting { .. } => {
                SensorEffect::Offset(self.deviation(now))
            }
            FaultKind::Noisy { rms } => SensorEffect::Noise { rms: self.size(now) * rms },
            // The others are only of effectors.
            _ => SensorEffect::None,
        }
    }

    /// Fraction of a part of the airframe that is gone at `now`.
    pub fn torn_off(&self, now: SimTime) -> f64 {
        match self.kind {
            FaultKind::TornOff { lost } => self.size(now) * lost,
            _ => 0.0,
        }
    }

    /// Since when it acts.
    pub fn since(&self) -> SimTime {
        self.since
    }

    /// Stops an effector that has arrived where it sticks, and moves one beyond its limited travel back to the limit.
    pub fn arrive(&mut self, now: SimTime, position: &mut f64) {
        if let Some(slew) = self.slew
            && slew.arrival <= now
        {
            *position = slew.target;
            self.slew = None;
        }
        if let FaultKind::LimitedTravel { limit } = self.kind {
            let [low, high] = self.limits(limit, now);
            *position = position.max(low).min(high);
        }
    }

    /// Its effect at `now`.
    pub fn effect(&self, now: SimTime) -> FaultEffect {
        let healthy = FaultEffect::HEALTHY;
        let size = self.size(now);
        match self.kind {
            FaultKind::StuckHere
            | FaultKind::StuckAt { .. }
            | FaultKind::HardOver { .. }
            | FaultKind::Float => {
                let runaway = self.slew.map_or(0.0, |slew| slew.rate);
                FaultEffect { following: 0.0, runaway, ..healthy }
            }
            FaultKind::PartialLoss { remaining } => {
                FaultEffect { remaining: ramped(size, 1.0, remaining), ..healthy }
            }
            FaultKind::Slow { rate } => {
                // From the fastest rate of the healthy servo, as nothing can be interpolated from
                // infinity.
                FaultEffect { rate_limit: ramped(size, self.fastest, rate), ..healthy }
            }
            FaultKind::Delayed { .. }
            | FaultKind::FlameOut
            | FaultKind::Off
            | FaultKind::TornOff { .. }
            | FaultKind::Noisy { .. } => healthy,
            FaultKind::Intermittent { period_s, present } => {
                let [gap_end, _] = self.period(period_s, present, now);
                FaultEffect { following: if now < gap_end { 0.0 } else { 1.0 }, ..healthy }
            }
            FaultKind::Oscillating { .. }
            | FaultKind::Drifting { .. }
            | FaultKind::Biased { .. } => {
                let [low, high] = self.ends;
                FaultEffect { offset: self.deviation(now), low, high, ..healthy }
            }
            FaultKind::LimitedTravel { limit } => {
                let [low, high] = self.limits(limit, now);
                FaultEffect { low, high, ..healthy }
            }
        }
    }

    /// Whether it delays commands.
    pub fn is_delayed(&self) -> bool {
        matches!(self.kind, FaultKind::Delayed { .. })
    }

    /// Whether the servo receives something other than the command.
    pub fn alters_commands(&self) -> bool {
        let alters = matches!(self.kind, FaultKind::FlameOut | FaultKind::LimitedTravel { .. });
        alters || self.is_delayed()
    }

    /// What the servo receives instead of `command`, rad or N. [`Faults`](super::Faults) keeps the commands of a
    /// delayed effector.
    pub fn command(&self, command: f64, now: SimTime) -> f64 {
        match self.kind {
            // Below the travel of the engine, whose lower end is its idle thrust.
            FaultKind::FlameOut => 0.0,
            FaultKind::LimitedTravel { limit } => {
                let [low, high] = self.limits(limit, now);
                command.max(low).min(high)
            }
            _ => command,
        }
    }

    /// When a command of `now` reaches a delayed effector; `None` if the fault does not delay commands.
    pub fn due(&self, now: SimTime) -> Option<SimTime> {
        let FaultKind::Delayed { delay_s } = self.kind else { return None };
        let delay_us = micros(delay_s * self.size(now));
        Some(SimTime::from_micros(now.as_micros() + delay_us))
    }

    /// Whether it changes from step to step.
    pub fn varies(&self, now: SimTime) -> bool {
        let is_ramping = now.micros_since(self.since) < self.ramp_us;
        match self.kind {
            FaultKind::Oscillating { .. } => true,
            FaultKind::Drifting { .. } => self.deviation(now).abs() < self.span(),
            FaultKind::PartialLoss { .. }
            | FaultKind::TornOff { .. }
            | FaultKind::Slow { .. }
            | FaultKind::Biased { .. }
            | FaultKind::LimitedTravel { .. } => is_ramping,
            _ => false,
        }
    }

    /// The next event after `now`, which the integration must not step over.
    pub fn next_event(&self, now: SimTime) -> Option<SimTime> {
        let arrival = self.slew.map(|slew| slew.arrival);
        // The end of the ramp is an event, so that the full fault acts from its microsecond on.
        let whole = SimTime::from_micros(self.since.as_micros() + self.ramp_us);
        let switch = match self.kind {
            FaultKind::Intermittent { period_s, present } => {
                self.period(period_s, present, now).into_iter().find(|at| *at > now)
            }
            _ => None,
        };
        [arrival, switch, Some(whole).filter(|at| *at > now)].into_iter().flatten().min()
    }

    /// Progress of the ramp, 0 to 1.
    fn size(&self, now: SimTime) -> f64 {
        let elapsed_us = now.micros_since(self.since);
        // Without a ramp this also spares a division of zero by zero.
        if elapsed_us >= self.ramp_us { 1.0 } else { seconds(elapsed_us) / seconds(self.ramp_us) }
    }

    /// Deviation of the effector from its servo, rad or N.
    fn deviation(&self, now: SimTime) -> f64 {
        let elapsed_s = seconds(now.micros_since(self.since));
        match self.kind {
            FaultKind::Biased { bias } => self.size(now) * bias,
            FaultKind::Oscillating { amplitude, frequency_hz } => {
                // Removing whole periods first keeps the sine exact on a long flight.
                let turn = libm::fmod(frequency_hz * elapsed_s, 1.0);
                self.size(now) * amplitude * libm::sin(core::f64::consts::TAU * turn)
            }
            FaultKind::Drifting { rate } => {
                // The integral of a rate that grows during the ramp.
                let whole_s = 0.5 * self.size(now) * elapsed_s.min(seconds(self.ramp_us))
                    + (elapsed_s - seconds(self.ramp_us)).max(0.0);
                (rate * whole_s).max(-self.span()).min(self.span())
            }
            _ => 0.0,
        }
    }

    /// From one end of the travel to the other, rad or N.
    fn span(&self) -> f64 {
        self.ends[1] - self.ends[0]
    }

    /// Ends of a limited travel, rad or N.
    fn limits(&self, limit: f64, now: SimTime) -> [f64; 2] {
        let size = self.size(now);
        let [low, high] = self.ends;
        // An engine has no negative thrust; its idle thrust stays.
        let least = if low < 0.0 { low.max(-limit) } else { low };
        [ramped(size, low, least), ramped(size, high, high.min(limit))]
    }

    /// End of the gap and end of the period in which `now` lies.
    fn period(&self, period_s: f64, present: f64, now: SimTime) -> [SimTime; 2] {
        let since_us = self.since.as_micros();
        // It is a divisor.
        let period_us = micros(period_s).max(1);
        let start_us = since_us + now.micros_since(self.since) / period_us * period_us;
        // By the ramp at the start of the period: within a period the events must not move.
        let absent = self.size(SimTime::from_micros(start_us)) * (1.0 - present);
        let gap_us = micros(absent * period_s).min(period_us);
        [start_us + gap_us, start_us + period_us].map(SimTime::from_micros)
    }
}

/// Whether a fault of this kind makes the effector deviate from its servo.
pub(super) fn deviates(kind: &FaultKind) -> bool {
    matches!(
        kind,
        FaultKind::Oscillating { .. } | FaultKind::Drifting { .. } | FaultKind::Biased { .. }
    )
}

/// Interpolates from the healthy value to that of the full fault, which is exact at size 1.
fn ramped(size: f64, healthy: f64, whole: f64) -> f64 {
    whole + (1.0 - size) * (healthy - whole)
}

/// The motion of an effector to where it sticks: within the ramp time, but no faster than `rate_limit` (rad/s)
/// if there is one.
fn slew_to(
    from: f64,
    target: f64,
    rate_limit: Option<f64>,
    ramp_us: u64,
    now: SimTime,
) -> Option<Slew> {
    let length = target - from;
    let least_us = rate_limit.map_or(0, |rate| whole_micros(length.abs() / rate));
    let (rate, time_us) = match rate_limit {
        Some(rate) if least_us > ramp_us => (libm::copysign(rate, length), least_us),
        _ if ramp_us > 0 => (length / seconds(ramp_us), ramp_us),
        _ => (0.0, 0),
    };
    Some(Slew { rate, arrival: SimTime::from_micros(now.as_micros() + time_us), target })
}

/// `time_s` seconds, rounded up to whole microseconds.
fn whole_micros(time_s: f64) -> u64 {
    micros(libm::ceil(time_s.min(SimTime::MAX_SECONDS) * 1.0e6) / 1.0e6)
}

fn seconds(micros: u64) -> f64 {
    SimTime::from_micros(micros).as_seconds()
}
