//! What can be broken on request, and the plant's truthful answer.
//!
//! Requests start at a ground station, a script or a scenario and end in the plant. The control laws never see
//! them.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::effector::PerEffector;
use crate::pace::Pace;
use crate::time::SimTime;

#[macro_use]
mod macros;

mod allowed;
mod catalogue;
pub mod kind;
pub mod mavlink;
mod measure;
mod parts;
mod refusal;
mod target;
mod text;
mod timing;

pub use crate::sensors::SensorKind;
pub use allowed::{RAMP_MAX_S, Reach, check, check_timing};
pub use catalogue::{CATALOGUE, FaultKind, Quantity, Side, Travel};
pub use kind::KindInfo;
pub use refusal::Refusal;
pub use target::{Target, TargetClass};
pub use timing::{Onset, Repeat, Timing};

/// One change to the faults of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FaultRequest {
    /// Break something. When it begins to act it replaces the fault that the target has.
    Inject {
        /// What.
        #[serde(alias = "effector")]
        target: Target,
        /// How.
        kind: FaultKind,
        /// When, how fast, for how long, how often.
        timing: Timing,
    },
    /// Mend it and forget what is scheduled for it.
    Clear {
        /// What.
        #[serde(alias = "effector")]
        target: Target,
    },
    /// Mend everything and forget all that is scheduled.
    ClearAll,
}

impl FaultRequest {
    /// What the request is about; `None` for everything.
    #[must_use]
    pub const fn target(&self) -> Option<Target> {
        match self {
            Self::Inject { target, .. } | Self::Clear { target } => Some(*target),
            Self::ClearAll => None,
        }
    }
}

/// The plant's answer to one [`FaultRequest`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FaultReply {
    /// The fault acts since this time.
    Applied {
        /// Simulation time of the onset.
        at: SimTime,
    },
    /// The same fault was there already, or is scheduled for that time already; nothing changed.
    Unchanged {
        /// Simulation time since when it acts, or for which it is scheduled.
        at: SimTime,
    },
    /// The fault will act at this time.
    Scheduled {
        /// Simulation time of the onset.
        at: SimTime,
    },
    /// It is healthy since this time, and nothing is scheduled for it.
    Cleared {
        /// Simulation time of the repair.
        at: SimTime,
    },
    /// Nothing was done.
    Refused(Refusal),
}

/// One fault of the plant's list.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FaultEntry {
    /// Number of the fault in this flight, from 1; never used twice.
    pub id: u32,
    /// What has it.
    #[serde(alias = "effector")]
    pub target: Target,
    /// How it fails.
    pub kind: FaultKind,
    /// When, how fast, for how long, how often. The onset is a time, also where it was "at once".
    pub timing: Timing,
    /// Where it stands.
    pub state: FaultState,
}

/// Where a fault stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultState {
    /// It will act from this time on.
    Scheduled {
        /// Simulation time of the onset.
        at: SimTime,
    },
    /// It acts.
    #[serde(rename = "Acting")]
    Active {
        /// Simulation time since when.
        since: SimTime,
    },
    /// Between two repetitions: it does not act, and will again.
    Resting {
        /// Simulation time since when.
        since: SimTime,
        /// Simulation time of the next onset.
        next: SimTime,
    },
    /// It has acted and does not any more: its time is over, it was cleared, or another one took its place.
    Ended {
        /// Simulation time since when.
        at: SimTime,
    },
    /// It never acted and never will: it was cleared before its onset.
    Cancelled {
        /// Simulation time of the order.
        at: SimTime,
    },
}

impl FaultState {
    /// Simulation time since which the fault stands so; of a scheduled one the time at which it will act.
    #[must_use]
    pub const fn time(&self) -> SimTime {
        match *self {
            Self::Scheduled { at } | Self::Ended { at } | Self::Cancelled { at } => at,
            Self::Active { since } | Self::Resting { since, .. } => since,
        }
    }

    /// The fault is off the list.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        matches!(self, Self::Ended { .. } | Self::Cancelled { .. })
    }
}

impl fmt::Display for FaultState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Scheduled { at } => write!(f, "from {at} on"),
            Self::Active { since } => write!(f, "since {since}"),
            Self::Resting { next, .. } => write!(f, "again at {next}"),
            Self::Ended { at } => write!(f, "ended at {at}"),
            Self::Cancelled { at } => write!(f, "cancelled at {at}"),
        }
    }
}

/// Something that happened in the plant, told once.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum PlantReport {
    /// The flight starts: the first report of the first packet, and of no other.
    Started {
        /// Where the effectors of the healthy aircraft stand in the steady flight of the start, rad; engine N.
        /// A fault that acts from time zero on is not in it.
        positions: PerEffector<f64>,
    },
    /// Answer to the request with this number.
    FaultReply {
        /// Number of the request.
        request: u32,
        /// What became of it.
        reply: FaultReply,
    },
    /// A fault was put on the list, began to act, rests, or is over; or somebody asked for the list
    /// ([`PlantAction::ListFaults`]).
    Fault(FaultEntry),
    /// The aircraft touched the ground; the plant has stopped.
    GroundContact {
        /// When.
        at: SimTime,
    },
    /// How simulation time passes from here on. [`Pace::Step`] says that so many periods have been flown and
    /// time stands still again.
    Paced {
        /// Number of the request that this answers; `None` if somebody at the plant wanted it, or if it was
        /// answered before.
        request: Option<u32>,
        /// What is in force now: what was asked for, or what came in between.
        pace: Pace,
        /// Since when.
        at: SimTime,
    },
}

/// What the flight computer can ask of the plant, beside the commands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlantRequest {
    /// Number that the answer repeats.
    pub number: u32,
    /// What to do.
    pub action: PlantAction,
}

/// The kinds of [`PlantRequest`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum PlantAction {
    /// Change the faults.
    Fault(FaultRequest),
    /// Tell every fault that acts, rests or is scheduled; the answers are [`PlantReport::Fault`].
    ListFaults,
    /// Start the flight anew; the new session is the answer.
    Restart,
    /// Let simulation time pass in another way.
    Pace(Pace),
}
