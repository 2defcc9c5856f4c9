//! Failures as ground stations name them: types of MAVLink with the names of PX4's shell, and the sizes of faults in the
//! operator's units. The engine's own sizes can be in percent of its largest thrust.

use core::fmt;

use arrayvec::ArrayVec;

use super::catalogue::CATALOGUE;
use super::kind::{FailureType, KindInfo};
use super::quantity::Measure;
use super::target::TargetClass;

/// Action of a command on its targets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Failure {
    /// A type of MAVLink: clears, or is one of its kinds, selected by the value or by the mode parameter of the type.
    Type(FailureType),
    /// This kind and no other of its type.
    Kind(&'static KindInfo),
}

/// A kind of fault with its size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizedKind {
    /// The kind.
    pub kind: &'static KindInfo,
    /// Its size.
    pub size: Size,
}

/// Size of a fault of a kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// No size: stuck at its present position, whatever the value of FLT_STUCK_MODE.
    None,
    /// In the unit of USER_1; for an engine percent of the largest thrust.
    Number(f64),
    /// In SI units.
    Si(f64),
    /// One of its alternatives, from 0.
    Alternative(u8),
}

/// Why a text or a number is not a valid size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SizeError<'a> {
    /// The type has no size, another one, or signs instead.
    NotOfType(Failure, &'a str),
    /// The text has no number.
    NotANumber(&'a str),
    /// No kind of value has this number; the last valid one.
    NoKind(i32, u8),
    /// No alternative of this kind has this number.
    NoAlternative(&'static KindInfo),
}

impl Failure {
    /// Clears the faults.
    pub const OK: Self = Self::Type(FailureType::Ok);

    /// The one with this name.
    pub fn parse(name: &str) -> Option<Self> {
        Self::all().find(|failure| failure.name() == name)
    }

    /// The types of MAVLink by number, then those that mean one kind.
    pub fn all() -> impl Iterator<Item = Self> {
        let kinds = CATALOGUE.iter().filter(|kind| kind.mavlink.word.is_some());
        FailureType::ALL.into_iter().map(Self::Type).chain(kinds.map(Self::Kind))
    }

    /// Name in the shell.
    pub fn name(self) -> &'static str {
        match self {
            Self::Type(failure_type) => failure_type.key(),
            Self::Kind(kind) => kind.mavlink.word.unwrap_or(kind.key),
        }
    }

    /// The kinds it can be, in the order of the mode parameter.
    pub fn kinds(self) -> impl Iterator<Item = &'static KindInfo> {
        let is_it = |kind: &&KindInfo| match self {
            Self::Type(failure_type) => kind.mavlink.failure_type == failure_type,
            Self::Kind(this) => kind.code == this.code,
        };
        let mut kinds: ArrayVec<&KindInfo, { CATALOGUE.len() }> =
            CATALOGUE.iter().filter(is_it).collect();
        // The order of the mode parameter's values, in which a size also tries the kinds.
        kinds.sort_unstable_by_key(|kind| (kind.mavlink.first_mode, kind.code));
        kinds.into_iter()
    }

    /// Whether one of its kinds has a size.
    fn has_size(self) -> bool {
        self.kinds().any(|kind| kind.size().is_some())
    }
}

impl SizedKind {
    /// Reads a size as operators write it: `5deg`, `-3`, `40%`, `10deg/s`, `200ms`, `20kN`, `here`, of a sensor in the unit of
    /// its output; `+` and `-` are the ends of the travel. It means the first kind of the type that accepts it: for WRONG,
    /// percent are an effect left, degrees a bias and a sign a hard over.
    pub fn read(failure: Failure, text: &str, class: TargetClass) -> Result<Self, SizeError<'_>> {
        let is_for = move |kind: &&'static KindInfo| {
            !matches!(class, TargetClass::Sensor(_)) || kind.targets.allow(class)
        };
        let kinds = || failure.kinds().filter(is_for);
        let not_of_type = SizeError::NotOfType(failure, text);
        // Before the numbers: `+` and `-` alone are ends of the travel.
        if let Some(kind) = kinds().find_map(|kind| alternative(kind, |(word, _)| word == text)) {
            return Ok(kind);
        }
        if text == "here" {
            let bare = kinds().find(|kind| kind.numbers.is_empty() && kind.choice.is_none());
            // Where a target has the choice between its place and a size.
            let has_choice = |bare: &&'static KindInfo| {
                kinds().any(|kind| kind.size().is_some() && kind.targets.overlap(bare.targets))
            };
            let kind = bare.filter(has_choice).ok_or(not_of_type)?;
            return Ok(Self { kind, size: Size::None });
        }
        let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c)));
        let (number, suffix) = text.split_at(end.unwrap_or(text.len()));
        let number: f64 = number.parse().map_err(|_| SizeError::NotANumber(text))?;
        let sized =
            kinds().find_map(|kind| Some(Self { kind, size: size(kind, number, suffix, class)? }));
        let named = || {
            let is_it = |(_, one): (&str, f64)| suffix.is_empty() && one == number;
            kinds().filter(|_| !failure.has_size()).find_map(|kind| alternative(kind, is_it))
        };
        sized.or_else(named).ok_or(not_of_type)
    }

    /// The size with this number (p4) in USER_1.
    pub fn of_user_1(code: i32, number: f64) -> Result<Self, SizeError<'static>> {
        let kinds = CATALOGUE.iter();
        let mut known = kinds.filter_map(|kind| Some((kind, kind.mavlink.user_1?)));
        let last = known.clone().map(|(_, known)| known).max().unwrap_or(0);
        let (kind, _) = known
            .find(|(_, known)| i32::from(*known) == code)
            .ok_or(SizeError::NoKind(code, last))?;
        if kind.size().is_some() {
            return Ok(Self { kind, size: Size::Number(number) });
        }
        alternative(kind, |(_, one)| one == number).ok_or(SizeError::NoAlternative(kind))
    }

    /// Name of what its size is, for refusals.
    pub fn name(&self) -> &'static str {
        let choice = self.kind.choice.map(|choice| choice.key);
        let size = self.kind.size().map(|(_, number)| number.quantity.name());
        size.or(choice).unwrap_or("place")
    }
}

/// Words and numbers for the alternatives of a kind.
fn signs(kind: &'static KindInfo) -> impl Iterator<Item = (&'static str, f64)> {
    let alternatives = kind.choice.map_or(&[][..], |choice| choice.alternatives);
    alternatives.iter().filter_map(|one| one.value)
}

fn alternative(
    kind: &'static KindInfo,
    is_it: impl Fn((&'static str, f64)) -> bool,
) -> Option<SizedKind> {
    let alternatives = kind.choice?.alternatives;
    let place = alternatives.iter().position(|one| one.value.is_some_and(&is_it))?;
    Some(SizedKind { kind, size: Size::Alternative(u8::try_from(place).ok()?) })
}

/// A number with this suffix as the size of a kind; `None` if the suffix is not one of its units. A bare number is always valid.
fn size(kind: &KindInfo, number: f64, suffix: &str, class: TargetClass) -> Option<Size> {
    let measure = kind.size()?.1.quantity.measure();
    if class == TargetClass::Thrust && measure.is_own() {
        let per_second = if measure == Measure::Speed { "/s" } else { "" };
        let is = |unit: &str| suffix.strip_suffix(per_second) == Some(unit);
        if suffix.is_empty() || is("%") || is("deg") {
            return Some(Size::Number(number));
        }
    }
    let units = measure.units(class);
    let unit = units.iter().find(|unit| suffix.is_empty() || unit.name == suffix)?;
    Some(Size::Si(unit.to_si(number)))
}

impl fmt::Display for SizeError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let numbers = |f: &mut fmt::Formatter<'_>, kind| {
            let mut between = "";
            signs(kind).try_for_each(|(_, number)| {
                write!(f, "{between}{number}")?;
                between = " or ";
                Ok(())
            })
        };
        match self {
            Self::NotOfType(failure, text) => {
                let signed = failure.kinds().find(|kind| signs(kind).next().is_some());
                let Some(kind) = signed.filter(|_| !failure.has_size()) else {
                    return write!(f, "type {} takes no value \"{text}\"", failure.name());
                };
                write!(f, "type {} takes ", failure.name())?;
                signs(kind).try_for_each(|(word, _)| write!(f, "{word}, "))?;
                numbers(f, kind)?;
                write!(f, ", not \"{text}\"")
            }
            Self::NotANumber(text) => write!(
                f,
                "\"{text}\" is no number with deg, deg/s, %, %/s, kN, kN/s, N, N/s, s or ms, and none of +, -, here"
            ),
            Self::NoKind(code, last) => write!(f, "no value of kind {code}, p4 is 1 to {last}"),
            Self::NoAlternative(kind) => {
                write!(f, "p5 of {} is ", kind.key)?;
                numbers(f, kind)
            }
        }
    }
}

impl core::error::Error for SizeError<'_> {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sensors::SensorKind;

    #[test]
    fn every_type_comes_back_by_its_name_and_has_kinds() {
        for failure in Failure::all() {
            assert_eq!(Failure::parse(failure.name()), Some(failure));
            let kinds = failure.kinds().count();
            assert!((failure == Failure::OK) == (kinds == 0), "{}: {kinds} kinds", failure.name());
        }
        assert_eq!(Failure::parse("broken"), None);
        assert_eq!((FailureType::from_code(9), FailureType::from_code(-1)), (None, None));
    }

    fn failure(name: &str) -> Failure {
        Failure::parse(name).unwrap()
    }

    #[test]
    fn values_are_read_as_people_write_them() {
        use Size::{Alternative, None, Number, Si};
        use TargetClass::{Angle, Thrust};
        let gnss = TargetClass::Sensor(SensorKind::Gnss);
        let deg = f64::to_radians;
        for (class, name, text, kind, size) in [
            (Angle, "stuck", "5deg", "stuck_at", Si(deg(5.0))),
            (Angle, "stuck", "-5.5", "stuck_at", Si(deg(-5.5))),
            (Angle, "stuck", "here", "stuck_here", None),
            (Thrust, "stuck", "here", "stuck_here", None),
            (Angle, "wrong", "40%", "partial_loss", Si(0.4)),
            (Thrust, "wrong", "40", "partial_loss", Si(0.4)),
            (Angle, "wrong", "3deg", "biased", Si(deg(3.0))),
            (Angle, "wrong", "-", "hard_over", Alternative(1)),
            (Angle, "hardover", "+", "hard_over", Alternative(0)),
            (Angle, "hardover", "-1", "hard_over", Alternative(1)),
            (Angle, "hardover", "1", "hard_over", Alternative(0)),
            (Angle, "slow", "10deg/s", "slow", Si(deg(10.0))),
            (Thrust, "slow", "10%/s", "slow", Number(10.0)),
            (Thrust, "slow", "2kN/s", "slow", Si(2_000.0)),
            (Angle, "delayed", "200ms", "delayed", Si(0.2)),
            (Thrust, "delayed", "0.2s", "delayed", Si(0.2)),
            (Angle, "delayed", "0.2", "delayed", Si(0.2)),
            (Angle, "intermittent", "30%", "intermittent", Si(0.3)),
            (Angle, "garbage", "2deg", "oscillating", Si(deg(2.0))),
            (Angle, "drift", "-1", "drifting", Si(deg(-1.0))),
            (Angle, "bias", "+4deg", "biased", Si(deg(4.0))),
            (Thrust, "bias", "-4%", "biased", Number(-4.0)),
            (Thrust, "bias", "-4deg", "biased", Number(-4.0)),
            (Angle, "limit", "6deg", "limited_travel", Si(deg(6.0))),
            (Thrust, "limit", "20kN", "limited_travel", Si(20_000.0)),
            (Thrust, "limit", "20N", "limited_travel", Si(20.0)),
            (gnss, "wrong", "50m", "biased", Si(50.0)),
            (gnss, "wrong", "50", "biased", Si(50.0)),
        ] {
            let kind = KindInfo::by_key(kind).unwrap();
            assert_eq!(
                SizedKind::read(failure(name), text, class),
                Ok(SizedKind { kind, size }),
                "{name} {text}"
            );
        }
    }

    #[test]
    fn a_value_that_is_not_of_the_type_is_refused() {
        for (name, text) in [
            ("stuck", "5%"),
            ("stuck", "5kN"),
            ("bias", "5%"),
            ("limit", "20kN"),
            ("slow", "5deg"),
            ("slow", "5kN"),
            ("delayed", "5deg"),
            ("ok", "1"),
            ("off", "5deg"),
            ("off", "here"),
            ("stuck", ""),
            ("stuck", "deg"),
            ("stuck", "1.2.3"),
            ("stuck", "nan"),
            ("hardover", "3deg"),
            ("hardover", "5"),
            ("hardover", "-0"),
            ("hardover", "0"),
            ("hardover", "-1deg"),
        ] {
            let value = SizedKind::read(failure(name), text, TargetClass::Angle);
            assert!(value.is_err(), "{name} {text}");
        }
    }

    #[test]
    fn each_kind_with_a_size_has_a_number_in_user_1() {
        for kind in &CATALOGUE {
            let has_value = kind.size().is_some() || kind.choice.is_some();
            assert_eq!(kind.mavlink.user_1.is_some(), has_value, "{}", kind.key);
            let Some(code) = kind.mavlink.user_1 else { continue };
            assert_eq!(SizedKind::of_user_1(code.into(), 1.0).map(|value| value.kind), Ok(kind));
        }
    }
}
