//! Events and snapshots that the control thread publishes for the ground-station side. Commands go in the other direction
//! ([`crate::command`]).

use core::time::Duration;

use flight_control::isolation::Verdict;
use flight_control::{AltitudeLimit, Authority, Demand, NavigationState, StepLog};
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

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    Roll,
    Pitch,
    Yaw,
}

/// Limits that can be reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    Aileron,
    Elevator,
    Rudder,
    /// The nozzle's pitch angle.
    NozzlePitch,
    /// The nozzle's yaw angle.
    NozzleYaw,
    Thrust,
}

impl Limit {
    pub const ALL: [Self; 6] = [
        Self::Aileron,
        Self::Elevator,
        Self::Rudder,
        Self::NozzlePitch,
        Self::NozzleYaw,
        Self::Thrust,
    ];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Aileron => "aileron",
            Self::Elevator => "elevator",
            Self::Rudder => "rudder",
            Self::NozzlePitch => "nozzle pitch",
            Self::NozzleYaw => "nozzle yaw",
            Self::Thrust => "thrust",
        }
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
    pub const ALL: [Self; 3] = [Self::Roll, Self::Pitch, Self::Yaw];

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

    pub const fn name(self) -> &'static str {
        match self {
            Self::Roll => "roll",
            Self::Pitch => "pitch",
            Self::Yaw => "yaw",
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
