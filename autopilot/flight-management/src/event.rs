//! Events and snapshots that the control thread publishes for the ground-station side, and the events from the signals of every
//! step: compensator, its authority, saturation, sensors. Commands go in the other direction ([`crate::command`]).

use core::time::Duration;

use flight_control::isolation::Verdict;
use flight_control::relief::CompensationHealth;
use flight_control::{AltitudeLimit, Authority, Demand, Health, NavigationState, StepLog};
use icd::fault::FaultEntry;
use icd::pace::Pace;
use icd::sensors::SensorKind;
use icd::{ControlPeriod, Sensors, SimTime};

use crate::command::Outcome;
use crate::script::ScriptEvent;
use crate::vehicle::{Mode, Navigation, VehicleEvent};

/// An event of the flight; the autopilot publishes it once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Simulation time at which it took effect.
    pub time: SimTime,
    pub kind: EventKind,
}

/// The kinds of [`Event`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EventKind {
    /// An intent is complete.
    Outcome {
        number: u32,
        outcome: Outcome,
    },
    FlightBegan {
        /// The autopilot joined a flight in progress.
        joined_in_flight: bool,
    },
    /// A change of mode, plan, home or link that the vehicle reports.
    Vehicle(VehicleEvent),
    CompensatorActive {
        /// Axis with the largest estimate relative to its level.
        axis: Axis,
        /// The effectors at their limit at that moment.
        at_limit: Limits,
    },
    /// The compensator has been asleep again for a while.
    CompensatorReleased {
        /// Simulation time for which it was active.
        after: Duration,
    },
    /// An axis has had no authority left for compensation for a while.
    AuthorityExhausted {
        axis: Axis,
        /// Cause: the travel of its effector, or thrust for the nozzle.
        by: Limit,
    },
    /// An axis has authority again.
    AuthorityRestored(Axis),
    /// An effector's demand has exceeded its limit for a while.
    Saturated(Limit),
    /// It is within its limits again.
    SaturationEnded(Limit),
    /// The aircraft does not hold its altitude, because this limit is reached.
    AltitudeNotHeld(AltitudeLimit),
    /// It is held again, or the aircraft climbs or descends to its reference.
    AltitudeHeld,
    /// The law keeps more thrust than the speed asks for, because the compensation needs it.
    ThrustFloorTaken,
    /// It no longer does.
    ThrustFloorReleased,
    /// The compensation has oscillated; only what is steady is compensated.
    CompensatorYields,
    /// All of it is compensated again.
    CompensatorResumes,
    /// The isolation names an effector, or another one than before.
    Isolated(Verdict),
    /// It names none any more.
    IsolationWithdrawn,
    /// A sensor gives no samples that count any more.
    SensorLost(SensorKind),
    SensorBack(SensorKind),
    /// A fault entered the plant's list or left it, by a report of the plant.
    Fault(FaultEntry),
    /// The aircraft touched the ground.
    GroundContact,
    /// No packet from the plant for a second.
    PlantLost,
    /// The flight log was removed while it was written: the rest of the flight is not recorded.
    LogRemoved,
    /// The plant is back.
    PlantBack,
    /// The simulation is paused, runs, or runs at another speed, by a report of the plant.
    Paced(Pace),
    /// Number of events dropped because they were not fetched in time; their contents are lost.
    EventsLost(u64),
    /// An event of the script with this [`crate::script::Script::id`].
    Script {
        script: u32,
        event: ScriptEvent,
    },
}

icd::named! {
    #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
    Axis {
        Roll = "roll",
        Pitch = "pitch",
        Yaw = "yaw",
    }
}

icd::named! {
    /// Limits that can be reached.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
    Limit {
        Aileron = "aileron",
        Elevator = "elevator",
        Rudder = "rudder",
        /// The nozzle's pitch angle.
        NozzlePitch = "nozzle pitch",
        /// The nozzle's yaw angle.
        NozzleYaw = "nozzle yaw",
        Thrust = "thrust",
    }
}

/// A set of limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Limits([bool; Limit::ALL.len()]);

impl Limits {
    /// The limits for which `contains` is true.
    pub fn from_fn(contains: impl FnMut(Limit) -> bool) -> Self {
        Self(Limit::ALL.map(contains))
    }

    /// The limits in the set.
    pub fn iter(self) -> impl Iterator<Item = Limit> {
        Limit::ALL.into_iter().zip(self.0).filter(|(_, is_in)| *is_in).map(|(limit, _)| limit)
    }
}

impl Axis {
    /// The limit of the effector by which the compensator acts on this axis.
    pub const fn compensated_by(self) -> Limit {
        match self {
            Self::Roll => Limit::Aileron,
            Self::Pitch => Limit::NozzlePitch,
            Self::Yaw => Limit::NozzleYaw,
        }
    }

    /// Remaining authority of the compensator on this axis, percent.
    pub const fn authority_pct(self, authority: &Authority) -> f64 {
        match self {
            Self::Roll => authority.roll_pct,
            Self::Pitch => authority.pitch_pct,
            Self::Yaw => authority.yaw_pct,
        }
    }
}

/// The state of the flight at one tick, for telemetry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Snapshot {
    /// Simulation time of the tick.
    pub time: SimTime,
    /// Control period of the flight.
    pub period: ControlPeriod,
    /// The aircraft is on the ground and the flight is over.
    pub on_ground: bool,
    pub mode: Mode,
    pub demand: Demand,
    /// Guidance of the vehicle.
    pub navigation: Navigation,
    /// The flight was terminated.
    pub terminated: bool,
    /// The engine may run.
    pub is_armed: bool,
    /// The samples of the tick.
    pub sensors: Sensors,
    /// Signals of the step; during a pause, with the state of that moment.
    pub log: StepLog,
}

impl Snapshot {
    /// Position and motion of the aircraft.
    pub const fn motion(&self) -> &NavigationState {
        &self.log.state
    }
}

/// A limit is reported when it has been reached for this long, us.
const AT_LIMIT_AFTER_US: u64 = 200_000;
/// The same for an axis without authority while the compensator sleeps, us: a healthy aircraft that begins or ends a
/// bank has its ailerons at their limit for a moment, when no authority for compensation is needed.
const ASLEEP_EXHAUSTED_AFTER_US: u64 = 3_000_000;
/// A sensor is reported as lost when its samples have not counted for this long, us.
const SENSOR_LOST_AFTER_US: u64 = 500_000;
/// The end of a limit is reported after this time without it, us; longer, so that a demand that brushes its limit
/// does not fill the operator's screen.
const INSIDE_AFTER_US: u64 = 2_000_000;
/// The compensator must sleep this long before its release is reported, us: a flag that flickers is reported once.
const ASLEEP_AFTER_US: u64 = 1_000_000;
/// An axis with less than this left counts as without authority, percent.
const EXHAUSTED_PCT: f64 = 1.0;
/// It has authority again from this value on, percent.
const RESTORED_PCT: f64 = 10.0;

/// Limits that are reported directly; those of the compensating effectors are reported as the authority of their axis.
const REPORTED_LIMITS: [Limit; 3] = [Limit::Elevator, Limit::Rudder, Limit::Thrust];

/// State of the reports.
#[derive(Debug, Clone, Default)]
pub struct Transitions {
    compensator: CompensatorTransition,
    limits: [Debounced; REPORTED_LIMITS.len()],
    exhausted: [Debounced; Axis::ALL.len()],
    not_held: Debounced,
    thrust_floor: Debounced,
    yields: Debounced,
    isolation: IsolationTransition,
    /// Of the sensors that have given a sample.
    sensors: [Option<Debounced>; SensorKind::ALL.len()],
}

#[derive(Debug, Clone, Copy, Default)]
struct CompensatorTransition {
    reported: bool,
    /// Time since it was reported active, us.
    active_us: u64,
    /// Asleep without a break, us.
    asleep_us: u64,
}

/// What the isolation names.
#[derive(Debug, Clone, Copy, Default)]
struct IsolationTransition {
    reported: Option<Verdict>,
    /// Time without a verdict, us.
    without_us: u64,
}

/// A state that is reported when it has lasted.
#[derive(Debug, Clone, Copy, Default)]
struct Debounced {
    reported: bool,
    since_us: u64,
}

impl Debounced {
    /// Updates the state; true when it has to be reported: when it has lasted `after_us`.
    fn step(&mut self, is_there: bool, after_us: u64, elapsed_us: u64) -> bool {
        if is_there == self.reported {
            self.since_us = 0;
            return false;
        }
        self.since_us += elapsed_us;
        if self.since_us < if self.reported { INSIDE_AFTER_US } else { after_us } {
            return false;
        }
        self.reported = is_there;
        self.since_us = 0;
        true
    }

    /// The event of a state that begins or ends.
    fn event(&self, begins: EventKind, ends: EventKind) -> EventKind {
        if self.reported { begins } else { ends }
    }
}

impl CompensatorTransition {
    fn step(&mut self, log: &StepLog, elapsed_us: u64) -> Option<EventKind> {
        if !self.reported {
            self.reported = log.compensator_active;
            return self.reported.then(|| EventKind::CompensatorActive {
                axis: loudest_axis(log),
                at_limit: Limits::from_fn(|limit| is_saturated(&log.health, limit)),
            });
        }
        self.active_us += elapsed_us;
        self.asleep_us = if log.compensator_active { 0 } else { self.asleep_us + elapsed_us };
        if self.asleep_us < ASLEEP_AFTER_US {
            return None;
        }
        // Without the sleep that it took to be sure.
        let after = Duration::from_micros(self.active_us - self.asleep_us);
        *self = Self::default();
        Some(EventKind::CompensatorReleased { after })
    }
}

impl IsolationTransition {
    /// Reports other effectors or another behaviour at once, the end of a verdict when it has lasted.
    fn step(&mut self, verdict: Option<&Verdict>, elapsed_us: u64) -> Option<EventKind> {
        let named = |verdict: &Verdict| (verdict.effectors, verdict.behaviour);
        if let Some(verdict) = verdict {
            self.without_us = 0;
            let is_new = self.reported.as_ref().map(named) != Some(named(verdict));
            self.reported = Some(*verdict);
            return is_new.then_some(EventKind::Isolated(*verdict));
        }
        self.reported.as_ref()?;
        self.without_us += elapsed_us;
        let ended = self.without_us >= ASLEEP_AFTER_US;
        ended.then(|| {
            *self = Self::default();
            EventKind::IsolationWithdrawn
        })
    }
}

impl Transitions {
    /// Evaluates one step and publishes the changes. `alive`: whether the samples of each sensor count.
    pub fn step(
        &mut self,
        log: &StepLog,
        alive: &[bool; SensorKind::ALL.len()],
        period: ControlPeriod,
        mut publish: impl FnMut(EventKind),
    ) {
        let elapsed_us = u64::from(period.as_micros());
        self.compensator.step(log, elapsed_us).into_iter().for_each(&mut publish);
        for (limit, state) in REPORTED_LIMITS.into_iter().zip(&mut self.limits) {
            if state.step(is_saturated(&log.health, limit), AT_LIMIT_AFTER_US, elapsed_us) {
                publish(
                    state.event(EventKind::Saturated(limit), EventKind::SaturationEnded(limit)),
                );
            }
        }
        if self.not_held.step(log.altitude_limit.is_some(), AT_LIMIT_AFTER_US, elapsed_us) {
            publish(log.altitude_limit.map_or(EventKind::AltitudeHeld, EventKind::AltitudeNotHeld));
        }
        for (sensor, (state, alive)) in
            SensorKind::ALL.into_iter().zip(self.sensors.iter_mut().zip(alive))
        {
            // A sensor that the aircraft does not have is never lost.
            if state.is_none() && *alive {
                *state = Some(Debounced::default());
            }
            if let Some(state) = state
                && state.step(!alive, SENSOR_LOST_AFTER_US, elapsed_us)
            {
                publish(state.event(EventKind::SensorLost(sensor), EventKind::SensorBack(sensor)));
            }
        }
        let CompensationHealth { thrust_floor, yields } = log.health.compensation;
        if self.thrust_floor.step(thrust_floor, AT_LIMIT_AFTER_US, elapsed_us) {
            let floor = &self.thrust_floor;
            publish(floor.event(EventKind::ThrustFloorTaken, EventKind::ThrustFloorReleased));
        }
        if self.yields.step(yields, 0, elapsed_us) {
            let yields = &self.yields;
            publish(yields.event(EventKind::CompensatorYields, EventKind::CompensatorResumes));
        }
        let verdict = log.isolation.verdict.as_ref();
        self.isolation.step(verdict, elapsed_us).into_iter().for_each(&mut publish);
        let after_us =
            if self.compensator.reported { AT_LIMIT_AFTER_US } else { ASLEEP_EXHAUSTED_AFTER_US };
        for (axis, state) in Axis::ALL.into_iter().zip(&mut self.exhausted) {
            let threshold = if state.reported { RESTORED_PCT } else { EXHAUSTED_PCT };
            let is_exhausted = axis.authority_pct(&log.authority) < threshold;
            if state.step(is_exhausted, after_us, elapsed_us) {
                let by = exhausted_by(axis, &log.health);
                let exhausted = EventKind::AuthorityExhausted { axis, by };
                publish(state.event(exhausted, EventKind::AuthorityRestored(axis)));
            }
        }
    }
}

/// Why an axis has no authority: the travel of its effector, or thrust for the nozzle.
fn exhausted_by(axis: Axis, health: &Health) -> Limit {
    let effector = axis.compensated_by();
    // The ailerons need no thrust.
    if axis == Axis::Roll || is_saturated(health, effector) { effector } else { Limit::Thrust }
}

fn is_saturated(health: &Health, limit: Limit) -> bool {
    match limit {
        Limit::Aileron => health.aileron_saturated,
        Limit::Elevator => health.elevator_saturated,
        Limit::Rudder => health.rudder_saturated,
        Limit::NozzlePitch => health.nozzle_pitch_saturated,
        Limit::NozzleYaw => health.nozzle_yaw_saturated,
        Limit::Thrust => health.thrust_saturated,
    }
}

fn loudest_axis(log: &StepLog) -> Axis {
    let (roll, pitch, yaw) = (log.levels.x, log.levels.y, log.levels.z);
    if roll >= pitch && roll >= yaw {
        Axis::Roll
    } else if pitch >= yaw {
        Axis::Pitch
    } else {
        Axis::Yaw
    }
}

#[cfg(test)]
mod tests;
