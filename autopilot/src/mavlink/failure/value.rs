//! How large a fault is, in the units of people: degrees, percent, seconds. Of the engine, where there are
//! no degrees, percent of its largest thrust.

use core::fmt;

use icd::fault::{FaultKind, Side};

use super::words::FailureType;
use crate::mavlink::convert;

/// How large a fault is. "deg" is percent of the largest thrust for the engine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value {
    /// Stuck where it is, whatever FLT_STUCK_MODE says.
    Here,
    /// Stuck at this angle, deg. Not for the engine.
    Angle(f64),
    /// Effect that is left, percent.
    Effect(f64),
    /// Off by this, deg.
    Bias(f64),
    /// Largest speed, deg/s.
    Rate(f64),
    /// Delay, s.
    Delay(f64),
    /// Largest deviation of an oscillation, deg.
    Amplitude(f64),
    /// Part of each period in which commands get through, percent.
    Present(f64),
    /// Speed and direction of a drift, deg/s.
    Drift(f64),
    /// Largest deflection either way, deg.
    Limit(f64),
    /// End of the travel to which it runs. Not for the engine.
    Side(Side),
}

/// Why a text or a number is no value.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ValueError {
    /// A type without a size, or with another one.
    #[error("type {failure_type} takes no value \"{text}\"")]
    NoValue {
        /// The type.
        failure_type: &'static str,
        /// What was given.
        text: String,
    },
    /// An end of the travel is a sign.
    #[error("type hardover takes +, -, 1 or -1, not \"{text}\"")]
    NoSide {
        /// What was given.
        text: String,
    },
    /// No number.
    #[error("\"{text}\" is no number with deg, deg/s, %, %/s, s or ms, and none of +, -, here")]
    NotANumber {
        /// What was given.
        text: String,
    },
}

impl Value {
    /// The number of [`Value::Side`] in USER_1.
    pub(super) const SIDE: i32 = 10;

    /// What a bare number means for a type of failure; `None` if the type has no size, or not this one.
    #[must_use]
    pub fn of_type(failure_type: FailureType, number: f64) -> Option<Self> {
        use FailureType as T;
        Some(match failure_type {
            T::Ok | T::Off | T::Float | T::FlameOut => return None,
            T::Stuck => Self::Angle(number),
            T::Wrong | T::Loss => Self::Effect(number),
            T::Garbage | T::Oscillate => Self::Amplitude(number),
            T::Slow => Self::Rate(number),
            T::Delayed => Self::Delay(number),
            T::Intermittent => Self::Present(number),
            T::Drift => Self::Drift(number),
            T::HardOver if number == 1.0 => Self::Side(Side::Positive),
            T::HardOver if number == -1.0 => Self::Side(Side::Negative),
            T::HardOver => return None,
            T::Bias => Self::Bias(number),
            T::Limit => Self::Limit(number),
        })
    }

    /// Reads a value as people write it: `5deg`, `-3`, `40%`, `10deg/s`, `200ms`, `here`; `+` and `-` are
    /// the ends of the travel. Of WRONG, degrees are a bias and a sign a hard over.
    ///
    /// # Errors
    /// [`ValueError`].
    pub fn parse(failure_type: FailureType, text: &str) -> Result<Self, ValueError> {
        use FailureType as T;
        let no_value = || {
            let text = text.to_owned();
            match failure_type {
                T::HardOver => ValueError::NoSide { text },
                _ => ValueError::NoValue { failure_type: failure_type.name(), text },
            }
        };
        match (failure_type, text) {
            (T::HardOver | T::Wrong, "+") => return Ok(Self::Side(Side::Positive)),
            (T::HardOver | T::Wrong, "-") => return Ok(Self::Side(Side::Negative)),
            (T::Stuck, "here") => return Ok(Self::Here),
            _ => {}
        }
        let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.".contains(c)));
        let (number, suffix) = text.split_at(end.unwrap_or(text.len()));
        let number: f64 =
            number.parse().map_err(|_| ValueError::NotANumber { text: text.to_owned() })?;
        let value = match (failure_type, suffix) {
            (T::Wrong, "deg") => Self::Bias(number),
            (T::Delayed, "ms") => Self::Delay(convert::seconds(number)),
            _ => Self::of_type(failure_type, number).ok_or_else(no_value)?,
        };
        let fits = suffix.is_empty()
            || match value {
                Self::Here | Self::Side(_) => false,
                Self::Angle(_) => suffix == "deg",
                // Percent is for the engine.
                Self::Bias(_) | Self::Amplitude(_) | Self::Limit(_) => {
                    ["deg", "%"].contains(&suffix)
                }
                Self::Rate(_) | Self::Drift(_) => ["deg/s", "%/s"].contains(&suffix),
                Self::Effect(_) | Self::Present(_) => suffix == "%",
                Self::Delay(_) => ["s", "ms"].contains(&suffix),
            };
        if fits { Ok(value) } else { Err(no_value()) }
    }

    /// The kind of value with this number in USER_1 (p4).
    #[must_use]
    pub fn of_code(code: i32, number: f64) -> Option<Self> {
        Some(match code {
            1 => Self::Angle(number),
            2 => Self::Effect(number),
            3 => Self::Bias(number),
            4 => Self::Rate(number),
            5 => Self::Delay(number),
            6 => Self::Amplitude(number),
            7 => Self::Present(number),
            8 => Self::Drift(number),
            9 => Self::Limit(number),
            Self::SIDE if number == 1.0 => Self::Side(Side::Positive),
            Self::SIDE if number == -1.0 => Self::Side(Side::Negative),
            _ => return None,
        })
    }

    /// Whether the number lies where it means something; says what is allowed if not.
    pub(super) fn check(self) -> Result<(), String> {
        let (what, unit, value, min, max) = match self {
            Self::Here | Self::Side(_) => return Ok(()),
            Self::Angle(value) => ("angle", "deg", value, -MAX, MAX),
            Self::Effect(value) => ("effect left", "%", value, 0.0, 100.0),
            Self::Bias(value) => ("bias", "deg", value, -MAX, MAX),
            Self::Rate(value) => ("rate", "deg/s", value, SMALLEST, MAX),
            Self::Delay(value) => ("delay", "s", value, 0.0, FaultKind::DELAY_MAX_S),
            Self::Amplitude(value) => ("amplitude", "deg", value, SMALLEST, MAX),
            Self::Present(value) => ("present part", "%", value, 0.0, 100.0),
            Self::Drift(value) => ("drift", "deg/s", value, -MAX, MAX),
            Self::Limit(value) => ("limit", "deg", value, 0.0, MAX),
        };
        within(what, unit, value, min, max)
    }
}

/// Beyond every effector: what it means for one is up to the plant.
const MAX: f64 = 1.0e4;
/// Speeds and amplitudes must be more than nothing.
const SMALLEST: f64 = 1.0e-3;

/// A number of an order inside its range; NaN is outside every range.
pub(super) fn within(what: &str, unit: &str, value: f64, min: f64, max: f64) -> Result<(), String> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(format!("{what} {value} is outside {min} to {max} {unit}"))
}

/// What it is, for refusals.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Here => "place",
            Self::Angle(_) => "angle",
            Self::Effect(_) => "effect left",
            Self::Bias(_) => "bias",
            Self::Rate(_) => "rate",
            Self::Delay(_) => "delay",
            Self::Amplitude(_) => "amplitude",
            Self::Present(_) => "present part",
            Self::Drift(_) => "drift",
            Self::Limit(_) => "limit",
            Self::Side(_) => "end of the travel",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_read_as_people_write_them() {
        use FailureType as T;
        for (failure_type, text, value) in [
            (T::Stuck, "5deg", Value::Angle(5.0)),
            (T::Stuck, "-5.5", Value::Angle(-5.5)),
            (T::Stuck, "here", Value::Here),
            (T::Wrong, "40%", Value::Effect(40.0)),
            (T::Wrong, "3deg", Value::Bias(3.0)),
            (T::Wrong, "-", Value::Side(Side::Negative)),
            (T::HardOver, "+", Value::Side(Side::Positive)),
            (T::HardOver, "-1", Value::Side(Side::Negative)),
            (T::HardOver, "1", Value::Side(Side::Positive)),
            (T::Slow, "10deg/s", Value::Rate(10.0)),
            (T::Slow, "10%/s", Value::Rate(10.0)),
            (T::Delayed, "200ms", Value::Delay(0.2)),
            (T::Delayed, "0.2s", Value::Delay(0.2)),
            (T::Intermittent, "30%", Value::Present(30.0)),
            (T::Garbage, "2deg", Value::Amplitude(2.0)),
            (T::Drift, "-1", Value::Drift(-1.0)),
            (T::Bias, "+4deg", Value::Bias(4.0)),
            (T::Limit, "6deg", Value::Limit(6.0)),
        ] {
            assert_eq!(Value::parse(failure_type, text), Ok(value), "{text}");
        }
    }

    #[test]
    fn what_is_no_value_of_the_type_is_refused() {
        use FailureType as T;
        for (failure_type, text) in [
            (T::Stuck, "5%"),
            (T::Slow, "5deg"),
            (T::Delayed, "5deg"),
            (T::Ok, "1"),
            (T::Off, "5deg"),
            (T::Stuck, ""),
            (T::Stuck, "deg"),
            (T::Stuck, "1.2.3"),
            (T::Stuck, "nan"),
            (T::HardOver, "3deg"),
            (T::HardOver, "5"),
            (T::HardOver, "-0"),
            (T::HardOver, "0"),
            (T::HardOver, "-1deg"),
        ] {
            assert!(Value::parse(failure_type, text).is_err(), "{text}");
        }
    }
}
