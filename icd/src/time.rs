//! Simulation time and the control period. Wall-clock time never appears here.

use core::fmt;
use core::ops::Add;

use serde::{Deserialize, Serialize};

/// Time since the start of the flight, whole microseconds.
///
/// It is an integer, so that every tick has an exact time however long the flight is.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct SimTime(u64);

impl SimTime {
    /// Start of the flight.
    pub const ZERO: Self = Self(0);

    /// Longest time that a caller can give in seconds: 30 days.
    pub const MAX_SECONDS: f64 = 30.0 * 86_400.0;

    /// From whole microseconds.
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros)
    }

    /// From seconds, rounded to the nearest microsecond.
    ///
    /// `None` if `seconds` is not finite, negative, or longer than [`SimTime::MAX_SECONDS`].
    pub fn from_seconds(seconds: f64) -> Option<Self> {
        if !(0.0..=Self::MAX_SECONDS).contains(&seconds) {
            return None;
        }
        // The range was checked above.
        Some(Self(libm::round(seconds * 1.0e6) as u64))
    }

    /// Whole microseconds since the start of the flight.
    pub const fn as_micros(self) -> u64 {
        self.0
    }

    /// Seconds since the start of the flight.
    // Exact up to 2^53 microseconds, 285 years.
    pub fn as_seconds(self) -> f64 {
        self.0 as f64 / 1.0e6
    }

    /// Microseconds from `earlier` to `self`; zero if `earlier` is later.
    pub const fn micros_since(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }
}

impl Add<ControlPeriod> for SimTime {
    type Output = Self;
    fn add(self, period: ControlPeriod) -> Self {
        Self(self.0 + u64::from(period.as_micros()))
    }
}

impl fmt::Display for SimTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:06} s", self.0 / 1_000_000, self.0 % 1_000_000)
    }
}

/// Period of the control loop, whole microseconds, 1 ms to 4 ms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct ControlPeriod(u32);

/// A control period outside 1000 to 4000 microseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PeriodOutOfRange {
    /// The refused period, microseconds.
    pub micros: u32,
}

impl fmt::Display for PeriodOutOfRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "control period {} us is outside {} to {} us",
            self.micros,
            ControlPeriod::MIN_MICROS,
            ControlPeriod::MAX_MICROS
        )
    }
}

impl core::error::Error for PeriodOutOfRange {}

impl ControlPeriod {
    /// Shortest period, microseconds.
    pub const MIN_MICROS: u32 = 1_000;
    /// Longest period, microseconds.
    pub const MAX_MICROS: u32 = 4_000;
    /// 2 ms.
    pub const DEFAULT: Self = Self(2_000);

    /// From whole microseconds.
    pub const fn from_micros(micros: u32) -> Result<Self, PeriodOutOfRange> {
        if micros < Self::MIN_MICROS || micros > Self::MAX_MICROS {
            return Err(PeriodOutOfRange { micros });
        }
        Ok(Self(micros))
    }

    /// Whole microseconds.
    pub const fn as_micros(self) -> u32 {
        self.0
    }

    /// Seconds.
    pub fn as_seconds(self) -> f64 {
        f64::from(self.0) / 1.0e6
    }
}

impl Default for ControlPeriod {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl TryFrom<u32> for ControlPeriod {
    type Error = PeriodOutOfRange;
    fn try_from(micros: u32) -> Result<Self, PeriodOutOfRange> {
        Self::from_micros(micros)
    }
}

impl From<ControlPeriod> for u32 {
    fn from(period: ControlPeriod) -> Self {
        period.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_round_to_the_nearest_microsecond() {
        assert_eq!(SimTime::from_seconds(3.0), Some(SimTime::from_micros(3_000_000)));
        assert_eq!(SimTime::from_seconds(1.000_000_6), Some(SimTime::from_micros(1_000_001)));
    }

    #[test]
    fn impossible_seconds_are_refused() {
        for seconds in [f64::NAN, f64::INFINITY, -0.001, 1.0e9] {
            assert_eq!(SimTime::from_seconds(seconds), None, "{seconds}");
        }
    }

    #[test]
    fn periods_outside_one_to_four_milliseconds_are_refused() {
        assert!(ControlPeriod::from_micros(999).is_err());
        assert!(ControlPeriod::from_micros(4_001).is_err());
        assert_eq!(ControlPeriod::from_micros(2_500).map(ControlPeriod::as_micros), Ok(2_500));
    }
}
