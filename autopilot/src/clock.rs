//! Wall time, and the only place that reads a clock.

use core::ops::Add;
use core::time::Duration;
use std::sync::LazyLock;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// Wall time since the process started, whole microseconds.
///
/// Timers of ground-station traffic use it. It never becomes a [`icd::SimTime`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct WallTime(u64);

impl WallTime {
    /// Start of the process.
    pub const ZERO: Self = Self(0);

    /// From whole microseconds.
    #[must_use]
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros)
    }

    /// Whole microseconds since the start of the process.
    #[must_use]
    pub const fn as_micros(self) -> u64 {
        self.0
    }

    /// Time from `earlier` to `self`; zero if `earlier` is later.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Duration {
        Duration::from_micros(self.0.saturating_sub(earlier.0))
    }
}

impl Add<Duration> for WallTime {
    type Output = Self;
    fn add(self, duration: Duration) -> Self {
        Self(self.0.saturating_add(u64::try_from(duration.as_micros()).unwrap_or(u64::MAX)))
    }
}

/// The one clock read of the process.
#[expect(clippy::disallowed_methods, reason = "the one clock read of the process")]
fn read() -> Instant {
    Instant::now()
}

static START: LazyLock<Instant> = LazyLock::new(read);

/// Wall time now. The first call is time zero.
#[must_use]
pub fn now() -> WallTime {
    let start = *START;
    WallTime::ZERO + read().saturating_duration_since(start)
}

/// UNIX time at [`WallTime::ZERO`] by the computer's calendar, us; `None` if that is before 1970. Told to
/// ground stations and used for nothing else.
#[must_use]
#[expect(clippy::disallowed_methods, reason = "the one look at the calendar of the process")]
pub fn unix_start_us() -> Option<u64> {
    let elapsed = now().as_micros();
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).ok()?;
    u64::try_from(since_1970.as_micros()).ok()?.checked_sub(elapsed)
}

/// The instant at `time`, for timers that want one.
#[must_use]
pub fn instant(time: WallTime) -> Instant {
    *START + Duration::from_micros(time.as_micros())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_does_not_run_backwards_and_the_calendar_is_of_this_century() {
        let first = now();
        assert!(now() >= first);
        // 1.6e15 us: September 2020, before this program was written.
        assert!(unix_start_us().is_some_and(|start| start > 1_600_000_000_000_000));
        assert_eq!(first.since(first + Duration::from_secs(1)), Duration::ZERO);
    }
}
