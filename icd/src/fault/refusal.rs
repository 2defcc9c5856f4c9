//! Why the plant did not do what was asked.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::time::SimTime;

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
    /// A number of the fault or of its timing is outside its range.
    OutOfRange {
        /// Which one.
        what: Quantity,
        /// Requested, in SI units.
        value: f64,
        /// Smallest allowed.
        min: f64,
        /// Largest allowed.
        max: f64,
    },
    /// The effector has no such fault (an angle for the engine, a flame-out of a surface).
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

/// A number of a fault or of its timing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Quantity {
    /// Fraction of the effect that remains.
    Remaining = 1,
    /// Rate limit or drift, rad/s or N/s.
    Rate = 2,
    /// Delay, s.
    Delay = 3,
    /// Period of an intermittent fault, s.
    Period = 4,
    /// Fraction of a period in which commands get through.
    Present = 5,
    /// Amplitude, rad or N.
    Amplitude = 6,
    /// Frequency, Hz.
    Frequency = 7,
    /// Bias, rad or N.
    Bias = 8,
    /// Limit of the travel, rad or N.
    Limit = 9,
    /// Ramp, s.
    Ramp = 10,
    /// Duration, s.
    Duration = 11,
    /// Time from one onset to the next, s.
    Every = 12,
    /// How often.
    Times = 13,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::Remaining,
        Self::Rate,
        Self::Delay,
        Self::Period,
        Self::Present,
        Self::Amplitude,
        Self::Frequency,
        Self::Bias,
        Self::Limit,
        Self::Ramp,
        Self::Duration,
        Self::Every,
        Self::Times,
    ];

    /// The one with this number.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|quantity| *quantity as u8 == code)
    }

    /// Name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Remaining => "remaining effect",
            Self::Rate => "rate",
            Self::Delay => "delay",
            Self::Period => "period",
            Self::Present => "present fraction",
            Self::Amplitude => "amplitude",
            Self::Frequency => "frequency",
            Self::Bias => "bias",
            Self::Limit => "travel limit",
            Self::Ramp => "ramp",
            Self::Duration => "duration",
            Self::Every => "repetition",
            Self::Times => "number of repetitions",
        }
    }

    /// Factor and unit for people: percent, and SI units for the rest. An effector's own quantity is in rad
    /// or N.
    const fn scale(self) -> (f64, &'static str) {
        match self {
            Self::Remaining | Self::Present => (100.0, "%"),
            Self::Rate => (1.0, "rad/s (engine N/s)"),
            Self::Delay | Self::Period | Self::Ramp | Self::Duration | Self::Every => (1.0, "s"),
            Self::Amplitude | Self::Bias | Self::Limit => (1.0, "rad (engine N)"),
            Self::Frequency => (1.0, "Hz"),
            Self::Times => (1.0, "times"),
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
            Self::OutOfRange { what, value, min, max } => {
                let (scale, unit) = what.scale();
                let (value, min, max) = (value * scale, min * scale, max * scale);
                write!(f, "{} {value:.4} is outside {min:.4} to {max:.4} {unit}", what.name())
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
