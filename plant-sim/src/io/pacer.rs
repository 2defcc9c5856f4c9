//! When a tick is due by the wall clock.

use std::str::FromStr;
use std::time::{Duration, Instant};

use host_io::clock;
use icd::SimTime;

/// Slowest and fastest factor that can be asked for.
const FACTOR: (f64, f64) = (0.01, 1_000.0);
/// A plant that is behind by more than this goes on from now instead of catching up in a sprint.
const BEHIND_MAX: Duration = Duration::from_millis(250);

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
#[error("speed {0:?} is neither max nor a number from {min} to {max}", min = FACTOR.0, max = FACTOR.1)]
pub struct UnknownSpeed(String);

impl FromStr for Speed {
    type Err = UnknownSpeed;
    fn from_str(text: &str) -> Result<Self, UnknownSpeed> {
        if text == "max" {
            return Ok(Self::Max);
        }
        let factor = text.parse().ok().filter(|factor| (FACTOR.0..=FACTOR.1).contains(factor));
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

/// Holds simulation time to the wall clock.
#[derive(Debug)]
pub(super) struct Pacer {
    speed: Speed,
    /// This simulation time was due at this instant.
    origin: (Instant, SimTime),
}

impl Pacer {
    /// `time` is due now.
    pub(super) fn new(speed: Speed, time: SimTime) -> Self {
        Self { speed, origin: (clock::now(), time) }
    }

    /// Wall time until `time` is due; `None` if it is.
    pub(super) fn left(&mut self, time: SimTime) -> Option<Duration> {
        let Speed::Times(factor) = self.speed else { return None };
        self.left_at(clock::now(), time, factor)
    }

    fn left_at(&mut self, now: Instant, time: SimTime, factor: f64) -> Option<Duration> {
        let (origin, origin_time) = self.origin;
        let since_origin = Duration::from_micros(time.micros_since(origin_time));
        let due = origin + since_origin.div_f64(factor);
        if due > now {
            return Some(due - now);
        }
        if now - due > BEHIND_MAX {
            self.origin = (now, time);
        }
        None
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

    #[test]
    fn a_small_delay_is_caught_up_and_a_long_one_is_not() {
        let mut pacer = Pacer::new(Speed::REAL_TIME, SimTime::ZERO);
        let start = pacer.origin.0;
        let at = |ms: u64| start + Duration::from_millis(ms);
        let tick = |ms: u64| SimTime::from_micros(1_000 * ms);
        assert_eq!(pacer.left_at(at(3), tick(10), 1.0), Some(Duration::from_millis(7)));
        // 100 ms late: the ticks in between are due at once.
        assert_eq!(pacer.left_at(at(110), tick(10), 1.0), None);
        assert_eq!(pacer.left_at(at(110), tick(110), 1.0), None);
        // 1 s late: simulation time goes on from here.
        assert_eq!(pacer.left_at(at(1_110), tick(110), 1.0), None);
        assert_eq!(pacer.left_at(at(1_110), tick(112), 1.0), Some(Duration::from_millis(2)));
    }
}
