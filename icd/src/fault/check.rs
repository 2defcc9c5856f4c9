//! Whether an effector can have a fault: the ranges of the catalogue with the reach of the effector, and the times.
//!
//! NaN is outside every range. The plant checks a request with its own servos; the autopilot can check it before with those of
//! its model.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::catalogue::FaultKind;
use super::quantity::{Quantity, Reach, Tidy};
use super::target::TargetClass;
use super::{RAMP_MAX_S, Timing};
use crate::time::SimTime;

/// Shortest duration, s.
const DURATION_MIN_S: f64 = 1.0e-4;
/// Shortest time from onset to onset, s: each repetition sends two reports to the ground stations.
const EVERY_MIN_S: f64 = 0.1;
/// Smallest difference between two times, s.
const MICROSECOND_S: f64 = 1.0e-6;
/// Smallest and largest number of repetitions, if it is limited.
pub(super) const TIMES: [f64; 2] = [2.0, 1_000.0];

/// Checks kind and times of a fault for an effector.
pub fn check(kind: &FaultKind, timing: &Timing, reach: &Reach) -> Result<(), Refusal> {
    of_kind(kind, reach)?;
    check_timing(kind, timing)
}

fn of_kind(kind: &FaultKind, reach: &Reach) -> Result<(), Refusal> {
    let info = kind.info();
    if !info.targets.allow(reach.class) {
        return Err(Refusal::NotForThisEffector);
    }
    let mut numbers = info.numbers.iter().zip(kind.values());
    numbers.try_for_each(|(number, value)| range(number.quantity, value, number.range.of(reach)))
}

/// Checks the times of a fault.
pub fn check_timing(kind: &FaultKind, timing: &Timing) -> Result<(), Refusal> {
    let longest_ramp = if kind.has_size() { RAMP_MAX_S } else { 0.0 };
    range(Quantity::Ramp, timing.ramp_s, [0.0, longest_ramp])?;
    let durations = [DURATION_MIN_S.max(timing.ramp_s), SimTime::MAX_SECONDS];
    if let Some(duration_s) = timing.duration_s {
        range(Quantity::Duration, duration_s, durations)?;
    }
    if let Some(repeat) = timing.repeat {
        // A repetition needs a duration; a missing one counts as zero, which is too short.
        let duration_s = timing.duration_s.unwrap_or(0.0);
        range(Quantity::Duration, duration_s, durations)?;
        let shortest = EVERY_MIN_S.max(duration_s + MICROSECOND_S);
        range(Quantity::Every, repeat.every_s, [shortest, SimTime::MAX_SECONDS])?;
        if let Some(times) = repeat.times {
            range(Quantity::Times, f64::from(times), TIMES)?;
        }
    }
    Ok(())
}

fn range(what: Quantity, value: f64, [min, max]: [f64; 2]) -> Result<(), Refusal> {
    if (min..=max).contains(&value) {
        Ok(())
    } else {
        Err(Refusal::OutOfRange { what, value, min, max })
    }
}

/// Why the plant refuses a fault.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Refusal {
    /// A number of the fault or of its timing is outside its range.
    OutOfRange {
        /// The quantity.
        what: Quantity,
        /// The requested value, in SI units.
        value: f64,
        /// Smallest allowed.
        min: f64,
        /// Largest allowed.
        max: f64,
    },
    /// The target has no such fault (an angle for the engine, a flame-out of a surface, a travel limit for a sensor).
    NotForThisEffector,
    /// The aircraft does not have the sensor.
    NoSuchSensor,
    /// The aircraft has no such effector.
    NoSuchEffector {
        /// Number of its effectors.
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
        /// Its capacity.
        capacity: u32,
    },
    /// The flight is over.
    FlightOver,
    /// The airframe does not describe the part.
    NoSuchPart,
}

impl Refusal {
    /// As text, with the units of the target's class.
    pub const fn described(&self, class: TargetClass) -> DescribedRefusal {
        DescribedRefusal { refusal: *self, class }
    }
}

/// A refusal as text.
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
            R::NotForThisEffector => f.write_str(match self.class {
                TargetClass::Sensor(_) => "this sensor has no such fault",
                TargetClass::Part => "this part has no such fault",
                TargetClass::Angle | TargetClass::Thrust => "this effector has no such fault",
            }),
            R::NoSuchSensor => f.write_str("the aircraft does not have this sensor"),
            R::NoSuchPart => f.write_str("the airframe file does not describe this part in [damage], or mass and inertia of [mass] are too small for its loss"),
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
