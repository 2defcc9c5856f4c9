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
    /// The aircraft has no such effector.
    NoSuchEffector {
        /// How many it has.
        count: u8,
    },
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

    /// Factor and unit for people, for an effector whose values are angles (deg) or thrusts (kN).
    const fn scale(self, is_angle: bool) -> (f64, &'static str) {
        match self {
            Self::Remaining | Self::Present => (100.0, "%"),
            Self::Rate if is_angle => (1.0_f64.to_degrees(), "deg/s"),
            Self::Rate => (1.0e-3, "kN/s"),
            Self::Delay | Self::Period | Self::Ramp | Self::Duration | Self::Every => (1.0, "s"),
            Self::Amplitude | Self::Bias | Self::Limit if is_angle => (1.0_f64.to_degrees(), "deg"),
            Self::Amplitude | Self::Bias | Self::Limit => (1.0e-3, "kN"),
            Self::Frequency => (1.0, "Hz"),
            Self::Times => (1.0, "times"),
        }
    }
}

impl Refusal {
    /// In words, for an effector whose values are angles (deg) or thrusts (kN).
    #[must_use]
    pub const fn described(&self, is_angle: bool) -> DescribedRefusal {
        DescribedRefusal { refusal: *self, is_angle }
    }
}

/// A refusal in words, with the units of its effector.
#[derive(Debug, Clone, Copy)]
pub struct DescribedRefusal {
    refusal: Refusal,
    is_angle: bool,
}

/// A number with the digits that somebody could have typed: up to four decimals, no zeros behind.
struct Tidy(f64);

impl fmt::Display for Tidy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Adding 0.0 makes -0 a 0.
        let rounded = libm::round(self.0 * 1.0e4) / 1.0e4 + 0.0;
        // What would vanish, and what is no number, is told as it is.
        if self.0 != 0.0 && rounded == 0.0 { write!(f, "{:e}", self.0) } else { rounded.fmt(f) }
    }
}

impl fmt::Display for DescribedRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use Refusal as R;
        match self.refusal {
            R::AngleOutOfTravel { angle_rad, limit_rad } => write!(
                f,
                "angle {:.1} deg is outside -{limit:.1} to {limit:.1} deg",
                angle_rad.to_degrees(),
                limit = limit_rad.to_degrees()
            ),
            R::OutOfRange { what: Quantity::Ramp, max: 0.0, .. } => {
                f.write_str("this kind of fault has no ramp")
            }
            R::OutOfRange { what, value, min, max } => {
                let (scale, unit) = what.scale(self.is_angle);
                let [value, min, max] = [value, min, max].map(|number| Tidy(number * scale));
                write!(f, "{} {value} {unit} is outside {min} to {max} {unit}", what.name())
            }
            R::NotForThisEffector => f.write_str("this effector has no such fault"),
            R::NoSuchEffector { count } => {
                write!(f, "the aircraft has no such effector, only {count}")
            }
            R::OnsetInThePast { onset, now } => {
                write!(f, "onset {onset} is in the past, it is {now}")
            }
            R::ScheduleFull { capacity } => {
                write!(f, "{capacity} faults are scheduled already, no more fit")
            }
            R::FlightOver => f.write_str("the flight is over"),
        }
    }
}
