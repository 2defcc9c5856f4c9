//! Fault requests, and the plant's answers.
//!
//! A ground station, a script or a scenario sends a request to the plant. The control laws never see it.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::effector_list::PerEffector;
use crate::pace::Pace;
use crate::time::SimTime;

mod catalogue;
mod failure;
mod grammar;
mod kind;
mod quantity;
mod target;

pub use crate::sensors::SensorKind;
pub use catalogue::{CATALOGUE, FaultKind, Side, Travel};
pub use failure::{Failure, Size, SizeError, SizedKind};
pub use grammar::{
    FaultDraft, FaultError, FaultField, FaultValue, Numbers, Refusal, check, check_timing,
};
pub use kind::{
    Alternative, Choice, ChoiceParameter, FailureType, KindInfo, Mavlink, NUMBERS_MAX, NumberInfo,
    NumberParameter, Piece, SIZE_OPTION, Targets,
};
pub use quantity::{Measure, Quantity, Range, Reach, Unit};
pub use target::{AirframePart, Target, TargetClass};

/// Longest ramp, s.
pub const RAMP_MAX_S: f64 = 3_600.0;

/// One change to the faults of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FaultRequest {
    /// Inject a fault. At its onset it replaces the present fault of the target.
    Inject {
        /// The target.
        target: Target,
        /// The kind.
        kind: FaultKind,
        /// Onset, ramp, duration and repetitions.
        timing: Timing,
    },
    /// Clear the fault of a target, and cancel the faults scheduled for it.
    Clear {
        /// The target.
        target: Target,
    },
    /// Clear all faults, and cancel all scheduled ones.
    ClearAll,
}

impl FaultRequest {
    /// The target of the request; `None` for all.
    pub const fn target(&self) -> Option<Target> {
        match self {
            Self::Inject { target, .. } | Self::Clear { target } => Some(*target),
            Self::ClearAll => None,
        }
    }
}

/// When a requested change takes effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Onset {
    /// At the tick in which the request reaches the plant.
    AtOnce,
    /// At this simulation time, exactly, also between ticks.
    At(SimTime),
}

/// Onset, ramp, duration and repetitions of a fault.
///
/// ```text
///  1        ________              ________
///          /        |            /        |
///  0 _____/         |___________/         |______
///       onset                onset + every
///         <-ramp->
///         <----duration---->
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// First onset.
    pub onset: Onset,
    /// Time from nothing to the full fault, s; 0 for at once. A fault without a size has no ramp.
    pub ramp_s: f64,
    /// Duration of each action, s, the ramp included; `None` for ever.
    pub duration_s: Option<f64>,
    /// Repetitions; only with a duration.
    pub repeat: Option<Repeat>,
}

/// Repetitions of a fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Repeat {
    /// From one onset to the next, s; longer than the duration.
    pub every_s: f64,
    /// Number of onsets, at least 2; `None` without end.
    pub times: Option<u32>,
}

impl Timing {
    /// At once and for ever.
    pub const NOW: Self = Self::from_onset(Onset::AtOnce);

    /// From this onset on, for ever, without a ramp.
    pub const fn from_onset(onset: Onset) -> Self {
        Self { onset, ramp_s: 0.0, duration_s: None, repeat: None }
    }

    /// From this time on, for ever, without a ramp.
    pub const fn at(time: SimTime) -> Self {
        Self::from_onset(Onset::At(time))
    }
}

/// All parts except the onset, each after a comma.
impl fmt::Display for Timing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.ramp_s > 0.0 {
            write!(f, ", ramp {} s", self.ramp_s)?;
        }
        if let Some(duration_s) = self.duration_s {
            write!(f, ", for {duration_s} s")?;
        }
        match self.repeat {
            None => Ok(()),
            Some(Repeat { every_s, times: None }) => write!(f, ", every {every_s} s"),
            Some(Repeat { every_s, times: Some(times) }) => {
                write!(f, ", every {every_s} s, {times} times")
            }
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
    /// Its target.
    pub target: Target,
    /// Its kind.
    pub kind: FaultKind,
    /// Onset, ramp, duration and repetitions. The onset is a time, even if it was requested "at once".
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
    pub const fn time(&self) -> SimTime {
        match *self {
            Self::Scheduled { at } | Self::Ended { at } | Self::Cancelled { at } => at,
            Self::Active { since } | Self::Resting { since, .. } => since,
        }
    }

    /// Number of the state in packets, in MAVLink and in the log, from 1.
    pub const fn code(&self) -> u8 {
        match self {
            Self::Scheduled { .. } => 1,
            Self::Active { .. } => 2,
            Self::Resting { .. } => 3,
            Self::Ended { .. } => 4,
            Self::Cancelled { .. } => 5,
        }
    }

    /// The state with this number, since this time; `next` is the onset after a pause.
    pub const fn from_code(code: u8, at: SimTime, next: SimTime) -> Option<Self> {
        Some(match code {
            1 => Self::Scheduled { at },
            2 => Self::Active { since: at },
            3 => Self::Resting { since: at, next },
            4 => Self::Ended { at },
            5 => Self::Cancelled { at },
            _ => return None,
        })
    }

    /// Simulation time of the next onset of a fault that does not act.
    pub const fn next_onset(&self) -> Option<SimTime> {
        match *self {
            Self::Scheduled { at } => Some(at),
            Self::Resting { next, .. } => Some(next),
            Self::Active { .. } | Self::Ended { .. } | Self::Cancelled { .. } => None,
        }
    }

    /// Whether the plant has removed the fault from its list.
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
        /// The answer.
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

/// The reason in texts for a request without an answer.
pub const NO_ANSWER: &str = "the aircraft does not answer";

/// A request of the flight computer to the plant, in addition to the commands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PlantRequest {
    /// Number that identifies the answer.
    pub number: u32,
    /// The action.
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
