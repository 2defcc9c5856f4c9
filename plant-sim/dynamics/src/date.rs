//! The date of a scenario, which the magnetic field depends on.

use std::fmt;
use std::str::FromStr;

use host_io::problem::{Problem, problem};
use icd::geomagnetism::{FROM_YEAR, TO_YEAR};
use serde::{Deserialize, Serialize};

/// A day in the years of the magnetic model; written YYYY-MM-DD.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Date {
    year: u16,
    month: u8,
    day: u8,
}

/// Days of the months before each month of a common year.
const BEFORE: [u16; 12] = [0, 31, 59, 90, 120, 151, 181, 212, 243, 273, 304, 334];

impl Date {
    /// That of a scenario without one.
    pub const DEFAULT: Self = Self { year: 2026, month: 1, day: 1 };

    /// As a year with its fraction: 2026.5 is in the middle of 2026.
    pub fn decimal_year(self) -> f64 {
        // No century without a leap day lies in the years of the magnetic model.
        let leap = self.year.is_multiple_of(4);
        let after_february = u16::from(leap && self.month > 2);
        let days = BEFORE[usize::from(self.month) - 1] + after_february + u16::from(self.day) - 1;
        f64::from(self.year) + f64::from(days) / if leap { 366.0 } else { 365.0 }
    }
}

impl FromStr for Date {
    type Err = Problem;

    fn from_str(text: &str) -> Result<Self, Problem> {
        let last = TO_YEAR - 1.0;
        let error = || {
            problem!(
                "date = \"{text}\", expected YYYY-MM-DD from {FROM_YEAR}-01-01 to {last}-12-31, the years of the World Magnetic Model 2025"
            )
        };
        // By `get`: an index inside a character of several bytes would panic.
        let digits = |range, length| {
            let part: &str = text.get(range).filter(|part: &&str| part.len() == length)?;
            // `parse` alone would accept a sign.
            part.bytes().all(|byte| byte.is_ascii_digit()).then(|| part.parse::<u16>().ok())?
        };
        if text.len() != 10 || text.get(4..5) != Some("-") || text.get(7..8) != Some("-") {
            return Err(error());
        }
        // Zero stands for what is no number; the ranges below refuse it.
        let [year, month, day] =
            [digits(0..4, 4), digits(5..7, 2), digits(8..10, 2)].map(|part| part.unwrap_or(0));
        let (month, day) = (u8::try_from(month).unwrap_or(0), u8::try_from(day).unwrap_or(0));
        let days = match month {
            2 if year.is_multiple_of(4) => 29,
            2 => 28,
            4 | 6 | 9 | 11 => 30,
            _ => 31,
        };
        let is_date = (FROM_YEAR..TO_YEAR).contains(&f64::from(year))
            && (1..=12).contains(&month)
            && (1..=days).contains(&day);
        if is_date { Ok(Self { year, month, day }) } else { Err(error()) }
    }
}

impl fmt::Display for Date {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-{:02}-{:02}", self.year, self.month, self.day)
    }
}

impl TryFrom<String> for Date {
    type Error = Problem;

    fn try_from(text: String) -> Result<Self, Problem> {
        text.parse()
    }
}

impl From<Date> for String {
    fn from(date: Date) -> Self {
        date.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_date_is_a_year_with_its_fraction() {
        let year = |text: &str| text.parse::<Date>().map(Date::decimal_year);
        assert_eq!(year("2026-01-01"), Ok(2026.0));
        assert_eq!(year("2026-12-31"), Ok(2026.0 + 364.0 / 365.0));
        assert_eq!(year("2028-12-31"), Ok(2028.0 + 365.0 / 366.0));
        assert_eq!(
            "2028-02-29".parse::<Date>().map(|date| date.to_string()),
            Ok("2028-02-29".to_owned())
        );
    }

    #[test]
    fn what_is_no_date_or_outside_the_model_is_refused_with_the_allowed_years() {
        for text in [
            "2024-12-31",
            "2030-01-01",
            "2026-13-01",
            "2026-02-29",
            "2026-1-01",
            "2026-00-10",
            "tomorrow",
            "2026-0é-1",
            "",
        ] {
            let error = text.parse::<Date>().unwrap_err().to_string();
            assert!(error.contains(text) && error.contains("2025-01-01 to 2029-12-31"), "{error}");
        }
    }
}
