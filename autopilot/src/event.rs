//! What crosses between the control thread and the ground-station side: intents in, events and snapshots out.

use flight_control::{Demand, Gains, StepLog};
use icd::fault::FaultReply;
use icd::{ControlPeriod, Effector, FaultKind, FaultRequest, Sensors, SimTime};

use crate::parameters::ReferenceLimits;
use crate::vehicle::{Mode, Reference, VehicleRefusal};

/// Something the operator wants, numbered so that the outcome finds its way back.
#[derive(Debug, Clone)]
pub struct Intent {
    /// Number that [`EventKind::Outcome`] repeats.
    pub number: u32,
    /// What.
    pub wish: Wish,
}

/// The kinds of [`Intent`].
#[derive(Debug, Clone)]
pub enum Wish {
    /// Change the mode.
    Mode(Mode),
    /// Change a reference.
    Refer(Reference),
    /// Take a validated set of gains.
    Gains(Box<Gains>),
    /// Take new reference limits.
    Limits(ReferenceLimits),
    /// Break or mend an effector; goes to the plant unopened.
    Fault(FaultRequest),
    /// Start the flight anew.
    Restart,
}

/// What became of an intent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// Done, effective from the next control step on.
    Done,
    /// Not done.
    Refused(VehicleRefusal),
    /// What the plant says.
    Plant(FaultReply),
    /// The plant went away before it answered, or its queue was full.
    NoAnswer,
}

/// Something that happened, told once.
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
    /// The mode changed.
    Mode(Mode),
    /// The compensator woke.
    CompensatorActive {
        /// Axis with the largest estimate relative to its level.
        axis: Axis,
    },
    /// The compensator went back to sleep.
    CompensatorReleased,
    /// An effector's demand is beyond its limit, and has been for a while.
    Saturated(Limit),
    /// It is inside its limits again.
    SaturationEnded(Limit),
    /// A fault began to act (the plant says).
    FaultActs {
        /// Which effector.
        effector: Effector,
        /// How.
        kind: FaultKind,
    },
    /// A fault ended (the plant says).
    FaultEnded {
        /// Which effector.
        effector: Effector,
    },
    /// The aircraft touched the ground.
    GroundContact,
    /// No packet from the plant for a second.
    PlantLost,
    /// The plant is back.
    PlantBack,
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

impl Axis {
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
    /// What the sensors said.
    pub sensors: Sensors,
    /// Signals of the step.
    pub log: StepLog,
}
