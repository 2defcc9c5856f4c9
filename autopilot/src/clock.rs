//! The only place that reads a clock.

use core::time::Duration;
use std::sync::LazyLock;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

pub use mavlink_services::wall_time::WallTime;

static START: LazyLock<Instant> = LazyLock::new(host_io::clock::now);

/// Wall time now. The first call is time zero.
pub fn now() -> WallTime {
    let start = *START;
    WallTime::ZERO + host_io::clock::now().saturating_duration_since(start)
}

/// UNIX time at [`WallTime::ZERO`] by the computer's calendar, us; `None` if that is before 1970. Sent to
/// ground stations and used for nothing else.
#[expect(clippy::disallowed_methods, reason = "the one look at the calendar of the process")]
pub fn unix_start_us() -> Option<u64> {
    let elapsed = now().as_micros();
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).ok()?;
    u64::try_from(since_1970.as_micros()).ok()?.checked_sub(elapsed)
}

/// The instant at `time`, for timers that need one.
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
