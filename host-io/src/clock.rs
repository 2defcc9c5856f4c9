//! The wall clock. It determines waiting times and retransmissions, never a computed value.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

#[expect(clippy::disallowed_methods, reason = "the wall clock of waiting and sending again")]
pub fn now() -> Instant {
    Instant::now()
}

/// Waits for this wall time.
#[expect(clippy::disallowed_methods, reason = "waiting for a tick that is due later")]
pub fn sleep(duration: Duration) {
    std::thread::sleep(duration);
}

/// Seconds since 1970, UTC, for names of files; no result depends on it.
#[expect(clippy::disallowed_methods, reason = "only shows people the time of an event")]
pub fn utc_seconds() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs()
}
