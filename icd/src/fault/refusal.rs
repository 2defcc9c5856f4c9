//! Why the plant did not do what was asked.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::text::Tidy;
use super::{Quantity, TargetClass};
use crate::time::SimTime;

/// Why the plant did not do what was asked.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Refusal {
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
    /// Sensors do not fail yet.
    NoSensorFaults,
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

impl Refusal {
    /// In words, with the units of what it is about.
    #[must_use]
    pub const fn described(&self, class: TargetClass) -> DescribedRefusal {
        DescribedRefusal { refusal: *self, class }
    }
}

/// A refusal in words, with the units of its effector.
#[derive(Debug, Clone, Copy)]
pub struct DescribedRefusal {
    refusal: Refusal,
    class: TargetClass,
}

impl fmt::Display for DescribedRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use Refusal as R;
        match self.refusal {
            R::OutOfRange { what: Quantity::Ramp, max: 0.0, .. } => {
                f.write_str("this kind of fault has no ramp")
            }
            R::OutOfRange { what, value, min, max } => {
                let unit = what.measure().unit(self.class);
                let [value, min, max] = [value, min, max].map(|number| Tidy(unit.from_si(number)));
                let (what, unit) = (what.name(), unit.name);
                write!(f, "{what} {value} {unit} is outside {min} to {max} {unit}")
            }
            R::NotForThisEffector => f.write_str("this effector has no such fault"),
            R::NoSensorFaults => f.write_str("the sensors of this aircraft do not fail"),
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
