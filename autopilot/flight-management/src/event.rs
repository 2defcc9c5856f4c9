//! What the control thread publishes for the ground-station side: events and snapshots. Commands come the other way
//! ([`crate::command`]).

use core::time::Duration;

use flight_control::{AltitudeLimit, Authority, Demand, NavigationState, StepLog};
use icd::fault::FaultEntry;
use icd::pace::Pace;
use icd::{ControlPeriod, SimTime};

use crate::command::Outcome;
use crate::script::ScriptEvent;
use crate::vehicle::{Mode, Navigation, VehicleEvent};

/// Something that happened; the autopilot publishes it once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Simulation time at which it took effect.
    pub time: SimTime,
    /// What.
    pub kind: EventKind,
}

/// The kinds of [`Event`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EventKind {
    /// An intent is dealt with.
    Outcome {
        /// Its number.
        number: u32,
        /// What became of it.
        outcome: Outcome,
    },
    /// A flight began.
    FlightBegan {
        /// The autopilot came in while the aircraft was flying already.
        joined_in_flight: bool,
    },
    /// Something about mode, plan, home or link that the vehicle reports.
    Vehicle(VehicleEvent),
    /// The compensator woke.
    CompensatorActive {
        /// Axis with the largest estimate relative to its level.
        axis: Axis,
        /// What is at its limit at that moment.
        at_limit: Limits,
    },
    /// The compensator went back to sleep, and stayed so for a while.
    CompensatorReleased {
        /// Simulation time for which it was active.
        after: Duration,
    },
    /// An axis has nothing left to compensate with, and has not had for a while.
    AuthorityExhausted {
        /// Which.
        axis: Axis,
        /// What it lacks: the travel of its effector, or thrust for the nozzle.
        by: Limit,
    },
    /// An axis has authority again.
    AuthorityRestored(Axis),
    /// An effector's demand is beyond its limit, and has been for a while.
    Saturated(Limit),
    /// It is inside its limits again.
    SaturationEnded(Limit),
    /// The altitude is not held, because this is at its limit.
    AltitudeNotHeld(AltitudeLimit),
    /// It is held again, or the aircraft climbs or descends to its reference.
    AltitudeHeld,
    /// A fault is on the plant's list, or off it (the plant says).
    Fault(FaultEntry),
    /// The aircraft touched the ground.
    GroundContact,
    /// No packet from the plant for a second.
    PlantLost,
    /// The flight log was removed while it was written: the rest of the flight is not recorded.
    LogRemoved,
    /// The plant is back.
    PlantBack,
    /// Simulation time stands still, runs, or runs at another speed (the plant says).
    Paced(Pace),
    /// So many events were dropped because nobody fetched them; their contents are lost.
    EventsLost(u64),
    /// Something about the script with this [`crate::script::Script::id`].
    Script {
        /// Which script.
        script: u32,
        /// What.
        event: ScriptEvent,
    },
}

/// A body axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// About x.
    Roll,
    /// About y.
    Pitch,
    /// About z.
    Yaw,
}

/// What can saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// The aileron pair.
    Aileron,
    /// The elevators.
    Elevator,
    /// The rudder.
    Rudder,
    /// The nozzle's pitch angle.
    NozzlePitch,
    /// The nozzle's yaw angle.
    NozzleYaw,
    /// The engine.
    Thrust,
}

impl Limit {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Aileron,
        Self::Elevator,
        Self::Rudder,
        Self::NozzlePitch,
        Self::NozzleYaw,
        Self::Thrust,
    ];

    /// Name for people.
    #[must_use]
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
    /// Those for which `contains` holds.
    #[must_use]
    pub fn from_fn(contains: impl FnMut(Limit) -> bool) -> Self {
        Self(Limit::ALL.map(contains))
    }

    /// The limits in the set.
    pub fn iter(self) -> impl Iterator<Item = Limit> {
        Limit::ALL.into_iter().zip(self.0).filter(|(_, is_in)| *is_in).map(|(limit, _)| limit)
    }
}

impl Axis {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Roll, Self::Pitch, Self::Yaw];

    /// The effector by which the compensator acts on this axis.
    #[must_use]
    pub const fn compensated_by(self) -> Limit {
        match self {
            Self::Roll => Limit::Aileron,
            Self::Pitch => Limit::NozzlePitch,
            Self::Yaw => Limit::NozzleYaw,
        }
    }

    /// What the compensator has left on this axis, percent.
    #[must_use]
    pub const fn authority_pct(self, authority: &Authority) -> f64 {
        match self {
            Self::Roll => authority.roll_pct,
            Self::Pitch => authority.pitch_pct,
            Self::Yaw => authority.yaw_pct,
        }
    }

    /// Name for people.
    #[must_use]
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
    /// Mode.
    pub mode: Mode,
    /// References.
    pub demand: Demand,
    /// Where the vehicle is going.
    pub navigation: Navigation,
    /// The flight was terminated.
    pub terminated: bool,
    /// Signals of the step; while time stands still, with the state of that moment.
    pub log: StepLog,
}

impl Snapshot {
    /// Where the aircraft is and how it moves.
    #[must_use]
    pub const fn motion(&self) -> &NavigationState {
        &self.log.state
    }
}
