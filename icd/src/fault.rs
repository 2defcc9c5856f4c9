//! What can be broken on request, and the plant's truthful answer.
//!
//! Requests start at a ground station or a scenario and end in the plant. The control laws never see them.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::effector::Effector;
use crate::pace::Pace;
use crate::time::SimTime;

/// How an effector fails.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FaultKind {
    /// Stuck where it is when the fault acts.
    StuckHere,
    /// Stuck at an angle.
    StuckAt {
        /// Where it sticks, rad, inside the effector's travel.
        angle_rad: f64,
        /// How it gets there.
        travel: Travel,
    },
    /// Partial loss: the effector has this fraction of its effect left (the paper's x in `(x - 1) u`).
    PartialLoss {
        /// Fraction remaining, 0 to 1.
        remaining: f64,
    },
    /// Disconnected: floats to zero deflection, where it has no moment.
    Float,
}

/// How a stuck effector reaches its angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Travel {
    /// At once, as in the paper's u_f.
    Jump,
    /// At the actuator's rate limit.
    AtActuatorRate,
}

/// When a requested change acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Onset {
    /// At the tick in which the request reaches the plant.
    AtOnce,
    /// At this simulation time, exactly, also between ticks.
    At(SimTime),
}

/// One change to the faults of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FaultRequest {
    /// Break an effector; replaces the fault that it has.
    Inject {
        /// Which one.
        effector: Effector,
        /// How.
        kind: FaultKind,
        /// When.
        onset: Onset,
    },
    /// Mend an effector and forget what is scheduled for it.
    Clear {
        /// Which one.
        effector: Effector,
    },
}

impl FaultRequest {
    /// The effector that the request names.
    #[must_use]
    pub const fn effector(&self) -> Effector {
        match self {
            Self::Inject { effector, .. } | Self::Clear { effector } => *effector,
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
    /// The effector is healthy since this time.
    Cleared {
        /// Simulation time of the repair.
        at: SimTime,
    },
    /// Nothing was done.
    Refused(Refusal),
}

/// Why the plant did not do what was asked.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Refusal {
    /// The angle is outside the travel of the effector.
    AngleOutOfTravel {
        /// Requested, rad.
        angle_rad: f64,
        /// Largest angle either way, rad.
        limit_rad: f64,
    },
    /// The remaining fraction is outside 0 to 1.
    RemainingOutOfRange {
        /// Requested fraction.
        remaining: f64,
    },
    /// The effector has no such fault (an angle for the engine).
    NotForThisEffector,
    /// The onset lies in the past.
    OnsetInThePast {
        /// Requested onset.
        onset: SimTime,
        /// The plant's time.
        now: SimTime,
    },
    /// The list of scheduled faults is full.
    ScheduleFull {
        /// How many it holds.
        capacity: u32,
    },
    /// The flight is over.
    FlightOver,
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::StuckHere => f.write_str("stuck"),
            Self::StuckAt { angle_rad, travel } => {
                write!(f, "stuck at {:.1} deg", angle_rad.to_degrees())?;
                match travel {
                    Travel::Jump => Ok(()),
                    Travel::AtActuatorRate => f.write_str(" (travelling)"),
                }
            }
            Self::PartialLoss { remaining } => write!(f, "{:.0} % left", remaining * 100.0),
            Self::Float => f.write_str("floating"),
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AngleOutOfTravel { angle_rad, limit_rad } => write!(
                f,
                "angle {:.1} deg is outside -{limit:.1} to {limit:.1} deg",
                angle_rad.to_degrees(),
                limit = limit_rad.to_degrees()
            ),
            Self::RemainingOutOfRange { remaining } => {
                write!(f, "remaining {:.1} % is outside 0 to 100 %", remaining * 100.0)
            }
            Self::NotForThisEffector => f.write_str("this effector has no such fault"),
            Self::OnsetInThePast { onset, now } => {
                write!(f, "onset {onset} is in the past, it is {now}")
            }
            Self::ScheduleFull { capacity } => {
                write!(f, "{capacity} faults are scheduled already, no more fit")
            }
            Self::FlightOver => f.write_str("the flight is over"),
        }
    }
}

/// Something that happened in the plant, told once.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum PlantReport {
    /// Answer to the request with this number.
    FaultReply {
        /// Number of the request.
        request: u32,
        /// What became of it.
        reply: FaultReply,
    },
    /// A fault began to act.
    FaultActs {
        /// Which effector.
        effector: Effector,
        /// How.
        kind: FaultKind,
        /// Since when.
        at: SimTime,
    },
    /// A fault ended.
    FaultEnded {
        /// Which effector.
        effector: Effector,
        /// Since when.
        at: SimTime,
    },
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
    /// Start the flight anew; the new session is the answer.
    Restart,
    /// Let simulation time pass in another way.
    Pace(Pace),
}
