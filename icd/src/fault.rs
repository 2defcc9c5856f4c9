//! Fault requests, and the plant's answers.
//!
//! A ground station, a script or a scenario sends a request to the plant. The control laws never see it.

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
    /// Inject a fault. At its onset it replaces the present fault of the target.
    Inject {
        /// What.
        #[serde(alias = "effector")]
        target: Target,
        /// How.
        kind: FaultKind,
        /// When, how fast, for how long, how often.
        timing: Timing,
    },
    /// Clear the fault of a target, and cancel the faults scheduled for it.
    Clear {
        /// What.
        #[serde(alias = "effector")]
        target: Target,
    },
    /// Clear all faults, and cancel all scheduled ones.
    ClearAll,
}

impl FaultRequest {
    /// The target of the request; `None` for all.
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
    /// The fault acts from this time on.
    Applied {
        /// Simulation time of the onset.
        at: SimTime,
    },
    /// The same fault already acts, or is already scheduled for that time; nothing changed.
    Unchanged {
        /// Simulation time since which it acts, or for which it is scheduled.
        at: SimTime,
    },
    /// The fault will act at this time.
    Scheduled {
        /// Simulation time of the onset.
        at: SimTime,
    },
    /// The target is healthy from this time on, and no fault is scheduled for it.
    Cleared {
        /// Simulation time of the repair.
        at: SimTime,
    },
    /// The plant refuses the request and has changed nothing.
    Refused(Refusal),
}

/// An entry of the plant's list of faults.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FaultEntry {
    /// Number of the fault in this flight, from 1; never used twice.
    pub id: u32,
    /// The target that has it.
    #[serde(alias = "effector")]
    pub target: Target,
    /// How it fails.
    pub kind: FaultKind,
    /// When, how fast, for how long, how often. The onset is a time, also where it was "at once".
    pub timing: Timing,
    /// Its state.
    pub state: FaultState,
}

/// State of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum FaultState {
    /// It is scheduled: it will act from this time on.
    Scheduled {
        /// Simulation time of the onset.
        at: SimTime,
    },
    /// It acts. Recorded logs call this state `Acting`.
    #[serde(rename = "Acting")]
    Active {
        /// Simulation time since then.
        since: SimTime,
    },
    /// It pauses between two repetitions.
    Resting {
        /// Simulation time since then.
        since: SimTime,
        /// Simulation time of the next onset.
        next: SimTime,
    },
    /// It has ended: its duration is over, a request cleared it, or another fault replaced it.
    Ended {
        /// Simulation time since then.
        at: SimTime,
    },
    /// A request cleared it before its onset; it never acted.
    Cancelled {
        /// Simulation time of that request.
        at: SimTime,
    },
}

impl FaultState {
    /// Simulation time since which the fault is in this state; for a scheduled fault the time of its onset.
    #[must_use]
    pub const fn time(&self) -> SimTime {
        match *self {
            Self::Scheduled { at } | Self::Ended { at } | Self::Cancelled { at } => at,
            Self::Active { since } | Self::Resting { since, .. } => since,
        }
    }

    /// Whether the plant has removed the fault from its list.
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

/// An event in the plant, which it reports once.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum PlantReport {
    /// The flight starts: the first report of the first packet, and of no other.
    Started {
        /// Positions of the healthy effectors in the trimmed flight at the start, rad; engine N. Faults that act from
        /// time zero on are not included.
        positions: PerEffector<f64>,
    },
    /// Answer to the request with this number.
    FaultReply {
        /// Number of the request.
        request: u32,
        /// What became of it.
        reply: FaultReply,
    },
    /// A fault was scheduled, became active, pauses, or ended; or it is the answer to a request for the list
    /// ([`PlantAction::ListFaults`]).
    Fault(FaultEntry),
    /// The aircraft touched the ground; the plant has stopped.
    GroundContact {
        /// When.
        at: SimTime,
    },
    /// How simulation time passes from now on. [`Pace::Step`] reports that the plant has flown this many periods and
    /// pauses again.
    Paced {
        /// Number of the request that this answers; `None` if the change came from the plant's console, or if the plant
        /// has answered the request before.
        request: Option<u32>,
        /// The pace in force now: the requested one, or one that came in between.
        pace: Pace,
        /// Since when.
        at: SimTime,
    },
}

/// A request of the flight computer to the plant, in addition to the commands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlantRequest {
    /// Number that identifies the answer.
    pub number: u32,
    /// What to do.
    pub action: PlantAction,
}

/// The kinds of [`PlantRequest`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum PlantAction {
    /// Change the faults.
    Fault(FaultRequest),
    /// Report every active, pausing or scheduled fault; the answers are [`PlantReport::Fault`].
    ListFaults,
    /// Restart the flight; the new session is the answer.
    Restart,
    /// Change how simulation time passes.
    Pace(Pace),
}
