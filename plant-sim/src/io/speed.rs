//! How fast simulation time runs, in the words of the command line.

use std::str::FromStr;

use icd::pace::Pace;

/// How fast simulation time runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Speed {
    /// As fast as both processes can.
    Max,
    /// This many times as fast as the wall clock.
    Times(f64),
}

impl Speed {
    /// As fast as the wall clock.
    pub const REAL_TIME: Self = Self::Times(1.0);
}

/// Not a speed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("speed {0:?} is neither max nor a number from {min} to {max}", min = Pace::SPEED.0, max = Pace::SPEED.1)]
pub struct UnknownSpeed(String);

impl FromStr for Speed {
    type Err = UnknownSpeed;
    fn from_str(text: &str) -> Result<Self, UnknownSpeed> {
        if text == "max" {
            return Ok(Self::Max);
        }
        let factor = text.parse().ok().filter(|factor| Pace::Speed(*factor).is_valid());
        factor.map(Self::Times).ok_or_else(|| UnknownSpeed(text.to_owned()))
    }
}

impl std::fmt::Display for Speed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Max => f.write_str("max"),
            Self::Times(factor) => write!(f, "{factor}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_outside_the_range_are_refused_with_the_range() {
        assert_eq!("max".parse(), Ok(Speed::Max));
        assert_eq!("0.01".parse(), Ok(Speed::Times(0.01)));
        for bad in ["0", "-1", "NaN", "inf", "1001", "fast", ""] {
            let error = bad.parse::<Speed>().unwrap_err().to_string();
            let expected = format!("speed {bad:?} is neither max nor a number from 0.01 to 1000");
            assert_eq!(error, expected);
        }
    }
}
