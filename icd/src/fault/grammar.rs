//! The grammar of faults: fields and values, whatever the syntax they were written in, become a kind and its times.
//!
//! A scenario's table, a line of a script, a line of the shell and a message of MAVLink are split into fields and values by
//! their readers. What a field means, which units and words it takes, its range, and what a kind needs is decided here.
//!
//! Whether an effector can have a fault is decided here too, by the ranges of the catalogue with the reach of the effector, and by
//! the times. NaN is outside every range. The plant checks a request with its own servos; the autopilot can check it before with
//! those of its model.

use core::fmt;

use arrayvec::ArrayVec;
use serde::{Deserialize, Serialize};

use super::catalogue::{Described, FaultKind};
use super::kind::{Choice, KindInfo, NUMBERS_MAX};
use super::quantity::{Measure, Quantity, Reach, Tidy, Unit};
use super::target::TargetClass;
use super::{Onset, RAMP_MAX_S, Repeat, Timing};
use crate::time::SimTime;

/// A fault while it is read.
#[derive(Debug, Clone, Copy)]
pub struct FaultDraft {
    /// Its kind.
    pub info: &'static KindInfo,
    /// The class of its target, which determines the units.
    pub class: TargetClass,
    alternative: Option<u8>,
    numbers: Numbers,
}

/// Numbers of a fault, each at most once, in any unit that the owner defines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers([Option<f64>; Quantity::ALL.len()]);

impl Numbers {
    /// No number.
    pub const NONE: Self = Self([None; Quantity::ALL.len()]);

    /// The number, if it is given.
    pub fn get(&self, what: Quantity) -> Option<f64> {
        self.0.get(what.place()).copied().flatten()
    }

    /// Gives a number.
    pub fn set(&mut self, what: Quantity, value: f64) {
        if let Some(place) = self.0.get_mut(what.place()) {
            *place = Some(value);
        }
    }

    /// The quantities that have a number.
    pub fn given(&self) -> impl Iterator<Item = Quantity> + '_ {
        Quantity::ALL.into_iter().filter(|what| self.get(*what).is_some())
    }
}

/// The value of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultValue<'a> {
    /// A number, in the unit of its key.
    Number(f64),
    /// A word.
    Word(&'a str),
}

/// A field of a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultField {
    /// A number.
    Number(Quantity),
    /// A choice.
    Choice(&'static Choice),
}

/// Why something is no fault: the field, its value and the allowed range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FaultError {
    /// No kind of fault has this alternative.
    NoSuchAlternative,
    /// A number is outside the range for any aircraft; NaN is outside every range.
    OutOfRange {
        /// The quantity.
        what: Quantity,
        /// The value as written.
        value: f64,
        /// Smallest allowed.
        min: f64,
        /// Largest allowed.
        max: f64,
        /// Unit of all three.
        unit: Unit,
    },
    /// A number that counts is not whole.
    NotWhole(Quantity, f64),
    /// The kind or another field needs this one.
    Missing(FaultField),
    /// Only one of the two is possible.
    Excludes(Quantity, Quantity),
    /// The choice has no such word.
    NoSuchWord(&'static Choice),
}

impl FaultField {
    /// Key in scenario files.
    pub const fn key(self, class: TargetClass) -> &'static str {
        match self {
            Self::Number(quantity) => quantity.key(class),
            Self::Choice(choice) => choice.key,
        }
    }

    /// Display name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Number(quantity) => quantity.name(),
            Self::Choice(choice) => choice.key,
        }
    }
}

impl FaultDraft {
    /// A fault of this kind for a target of this class.
    pub const fn new(info: &'static KindInfo, class: TargetClass) -> Self {
        Self { info, class, alternative: None, numbers: Numbers::NONE }
    }

    /// Gives the field with this key its value; false if the kind has no such field for a target of this class.
    pub fn put(&mut self, key: &str, value: FaultValue<'_>) -> Result<bool, FaultError> {
        match value {
            FaultValue::Number(value) => {
                let own = self.info.numbers.iter().map(|number| number.quantity);
                let mut all = own.chain(Quantity::TIMING);
                let Some(what) = all.find(|what| what.key(self.class) == key) else {
                    return Ok(false);
                };
                self.set(what, value, what.measure().unit(self.class)).map(|()| true)
            }
            FaultValue::Word(word) => {
                let choice = self.info.choice.as_ref().filter(|choice| choice.key == key);
                let Some(choice) = choice else { return Ok(false) };
                let place = choice.alternatives.iter().position(|one| one.key == word);
                let place = place.and_then(|place| u8::try_from(place).ok());
                self.choose(place.ok_or(FaultError::NoSuchWord(choice))?);
                Ok(true)
            }
        }
    }

    /// Gives a number with its unit.
    pub fn set(&mut self, what: Quantity, value: f64, unit: Unit) -> Result<(), FaultError> {
        let measure = what.measure();
        let number = self.info.numbers.iter().find(|number| number.quantity == what);
        // The ranges of times depend on each other.
        if let Some(number) = number {
            let usual = measure.unit(self.class);
            // In the usual unit as it stands: a conversion to SI units and back would cost the last
            // digits.
            let as_written = |end| if unit == usual { end } else { unit.from_si(usual.to_si(end)) };
            let [min, max] = number.range.anywhere(measure, self.class).map(as_written);
            if !(min..=max).contains(&value) {
                return Err(FaultError::OutOfRange { what, value, min, max, unit });
            }
        }
        self.set_si(what, unit.to_si(value));
        Ok(())
    }

    /// Gives a number in SI units, which the plant checks.
    pub fn set_si(&mut self, what: Quantity, value: f64) {
        self.numbers.set(what, value);
    }

    /// Gives the alternative, from 0.
    pub const fn choose(&mut self, alternative: u8) {
        self.alternative = Some(alternative);
    }

    /// The kind; each of its numbers has to be given.
    pub fn kind(&self) -> Result<FaultKind, FaultError> {
        let mut values = [0.0; NUMBERS_MAX];
        for (value, number) in values.iter_mut().zip(self.info.numbers) {
            let missing = FaultError::Missing(FaultField::Number(number.quantity));
            *value = self.numbers.get(number.quantity).ok_or(missing)?;
        }
        let usual = match &self.info.choice {
            Some(choice) => choice.default.ok_or(FaultError::Missing(FaultField::Choice(choice))),
            None => Ok(0),
        };
        let alternative = self.alternative.map_or(usual, Ok)?;
        self.info.with(alternative, values).ok_or(FaultError::NoSuchAlternative)
    }

    /// Kind and times, checked as far as it is possible without the aircraft.
    pub fn finish(&self) -> Result<(FaultKind, Timing), FaultError> {
        let (kind, timing) = (self.kind()?, self.timing()?);
        match check_timing(&kind, &timing) {
            Ok(()) => Ok((kind, timing)),
            Err(Refusal::OutOfRange { what, value, min, max }) => {
                Err(self.outside(what, value, [min, max]))
            }
            Err(_) => Err(FaultError::NoSuchAlternative),
        }
    }

    /// The times; without an onset at once.
    fn timing(&self) -> Result<Timing, FaultError> {
        use Quantity::{Duration, End, Every, Ramp};
        let onset = match self.time(Quantity::Onset)? {
            Some(at) => Onset::At(at),
            None => Onset::AtOnce,
        };
        let given = |what| self.numbers.get(what);
        let duration_s = match (self.time(End)?, given(Duration), onset) {
            (None, duration_s, _) => duration_s,
            (Some(_), Some(_), _) => return Err(FaultError::Excludes(End, Duration)),
            (Some(_), None, Onset::AtOnce) => {
                return Err(FaultError::Missing(FaultField::Number(Quantity::Onset)));
            }
            (Some(end), None, Onset::At(at)) if end <= at => {
                let range = [at.as_seconds() + 1.0e-6, SimTime::MAX_SECONDS];
                return Err(self.outside(End, end.as_seconds(), range));
            }
            (Some(end), None, Onset::At(at)) => {
                Some(SimTime::from_micros(end.micros_since(at)).as_seconds())
            }
        };
        let repeat = match (given(Every), self.times()?) {
            (None, None) => None,
            (None, Some(_)) => return Err(FaultError::Missing(FaultField::Number(Every))),
            (Some(_), _) if duration_s.is_none() => {
                return Err(FaultError::Missing(FaultField::Number(Duration)));
            }
            (Some(every_s), times) => Some(Repeat { every_s, times }),
        };
        Ok(Timing { onset, ramp_s: given(Ramp).unwrap_or(0.0), duration_s, repeat })
    }

    fn time(&self, what: Quantity) -> Result<Option<SimTime>, FaultError> {
        let Some(value) = self.numbers.get(what) else { return Ok(None) };
        let range = [0.0, SimTime::MAX_SECONDS];
        SimTime::from_seconds(value).map(Some).ok_or_else(|| self.outside(what, value, range))
    }

    fn times(&self) -> Result<Option<u32>, FaultError> {
        let Some(value) = self.numbers.get(Quantity::Times) else { return Ok(None) };
        if !(TIMES[0]..=TIMES[1]).contains(&value) {
            return Err(self.outside(Quantity::Times, value, TIMES));
        }
        // Searched and not cast: a cast would drop a fraction without a word.
        let whole = (0..=1_000).find(|times| f64::from(*times) == value);
        whole.map(Some).ok_or(FaultError::NotWhole(Quantity::Times, value))
    }

    /// A number outside its range, all in SI units.
    fn outside(&self, what: Quantity, value: f64, [min, max]: [f64; 2]) -> FaultError {
        // One unit for all three numbers, so that the operator can compare them.
        let unit = what.measure().shown_unit(self.class, max);
        let [value, min, max] = [value, min, max].map(|si| unit.from_si(si));
        FaultError::OutOfRange { what, value, min, max, unit }
    }
}

impl Measure {
    /// The units that a number can be written with, the most common one first.
    pub fn units(self, class: TargetClass) -> ArrayVec<Unit, 3> {
        match self {
            Self::Seconds | Self::Milliseconds => Unit::TIMES.into(),
            other => {
                let unit = other.unit(class);
                core::iter::once(unit).chain(unit.for_small()).collect()
            }
        }
    }
}

impl fmt::Display for FaultError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoSuchAlternative => f.write_str("there is no such alternative"),
            Self::OutOfRange { what: Quantity::Ramp, max: 0.0, .. } => {
                f.write_str("this kind of fault has no ramp")
            }
            Self::OutOfRange { what, value, min, max, unit } => {
                // Without the last digits, in which a conversion shows.
                let [value, min, max] = [value, min, max].map(|number| {
                    let rounded = libm::round(number * 1.0e6) / 1.0e6;
                    if rounded.is_finite() { rounded } else { *number }
                });
                let (what, unit) = (what.name(), unit.name);
                write!(f, "{what} {value} {unit} is outside {min} to {max} {unit}")
            }
            Self::NotWhole(what, value) => {
                write!(f, "{} {value} is no whole number", what.name())
            }
            Self::Missing(FaultField::Number(Quantity::Duration)) => {
                f.write_str("a repetition needs a duration")
            }
            Self::Missing(field) => write!(f, "{} is missing", field.name()),
            Self::Excludes(what, other) => write!(f, "{} excludes {}", what.name(), other.name()),
            Self::NoSuchWord(choice) => {
                write!(f, "{} is one of", choice.key)?;
                choice.alternatives.iter().try_for_each(|one| write!(f, " {}", one.key))
            }
        }
    }
}

impl core::error::Error for FaultError {}

/// Shortest duration, s.
const DURATION_MIN_S: f64 = 1.0e-4;
/// Shortest time from onset to onset, s: each repetition sends two reports to the ground stations.
const EVERY_MIN_S: f64 = 0.1;
/// Smallest difference between two times, s.
const MICROSECOND_S: f64 = 1.0e-6;
/// Smallest and largest number of repetitions, if it is limited.
const TIMES: [f64; 2] = [2.0, 1_000.0];

/// Checks kind and times of a fault for an effector.
pub fn check(kind: &FaultKind, timing: &Timing, reach: &Reach) -> Result<(), Refusal> {
    let info = kind.info();
    if !info.targets.allow(reach.class) {
        return Err(Refusal::NotForThisEffector);
    }
    for (number, value) in info.numbers.iter().zip(kind.values()) {
        range(number.quantity, value, number.range.of(reach))?;
    }
    check_timing(kind, timing)
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
        // The end and the next onset are two events, at least a microsecond apart.
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
    pub const fn described(&self, class: TargetClass) -> Described<Self> {
        Described { what: *self, class }
    }
}

impl fmt::Display for Described<Refusal> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        use Refusal as R;
        match self.what {
            R::OutOfRange { what: Quantity::Ramp, max: 0.0, .. } => {
                f.write_str("this kind of fault has no ramp")
            }
            R::OutOfRange { what, value, min, max } => {
                let unit = what.measure().shown_unit(self.class, max);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::CATALOGUE;
    use std::string::{String, ToString as _};
    use std::vec::Vec;

    /// What the grammar makes of these fields of a surface's fault, or says of them.
    fn read(kind: &str, fields: &[(&str, FaultValue<'_>)]) -> Result<(FaultKind, Timing), String> {
        let info = CATALOGUE.iter().find(|info| info.key == kind).expect("a kind");
        let mut draft = FaultDraft::new(info, TargetClass::Angle);
        for (key, value) in fields {
            assert!(draft.put(key, *value).map_err(|error| error.to_string())?, "{key}");
        }
        draft.finish().map_err(|error| error.to_string())
    }

    fn numbers<'a>(fields: &[(&'a str, f64)]) -> Vec<(&'a str, FaultValue<'static>)> {
        fields.iter().map(|(key, value)| (*key, FaultValue::Number(*value))).collect()
    }

    #[test]
    fn fields_become_a_kind_and_its_times() {
        let fields = [("angle_deg", 30.0), ("onset_s", 2.0), ("clear_s", 5.0)];
        let (kind, timing) = read("stuck_at", &numbers(&fields)).expect("a fault");
        let FaultKind::StuckAt { angle_rad, .. } = kind else { panic!("{kind:?}") };
        assert_eq!(angle_rad, 30.0_f64.to_radians());
        assert_eq!(timing.onset, Onset::At(SimTime::from_micros(2_000_000)));
        assert_eq!(timing.duration_s, Some(3.0));
    }

    #[test]
    fn what_is_no_fault_is_refused_with_field_value_and_range() {
        type Case<'a> = (&'a [(&'a str, f64)], &'a [&'a str]);
        let angle = ("angle_deg", 10.0);
        let cases: [Case<'_>; 9] = [
            (&[], &["angle is missing"]),
            (&[("angle_deg", f64::NAN)], &["angle NaN deg", "-90 to 90 deg"]),
            (&[("angle_deg", f64::INFINITY)], &["angle inf deg", "-90 to 90 deg"]),
            (&[("angle_deg", 400.0)], &["angle 400 deg is outside -90 to 90 deg"]),
            (&[angle, ("onset_s", -1.0)], &["onset -1 s is outside 0 to "]),
            (&[angle, ("onset_s", 4.0), ("clear_s", 3.0)], &["end 3 s is outside 4.000001 to "]),
            (&[angle, ("clear_s", 3.0)], &["onset is missing"]),
            (&[angle, ("every_s", 3.0)], &["a repetition needs a duration"]),
            (
                &[angle, ("duration_s", 1.0), ("every_s", 3.0), ("times", 2.5)],
                &["number of repetitions 2.5 is no whole number"],
            ),
        ];
        for (fields, parts) in cases {
            let text = read("stuck_at", &numbers(fields)).expect_err("no fault");
            assert!(parts.iter().all(|part| text.contains(part)), "{fields:?}: {text}");
        }
        let text = read("hard_over", &[("side", FaultValue::Word("left"))]).expect_err("no fault");
        assert_eq!(text, "side is one of positive negative");
    }
}
