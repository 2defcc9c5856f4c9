//! Time of a signature: 48 bits, units of 10 us since the beginning of 2015 (UTC).

use core::time::Duration;

use crate::wall_time::WallTime;

/// UNIX time at timestamp zero, us.
const EPOCH_UNIX_US: u64 = 1_420_070_400_000_000;
/// One unit, us.
const UNIT_US: u64 = 10;
/// What 48 bits hold.
const END: u64 = (1 << 48) - 1;

/// Time of a signature, units of 10 us since 2015.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Timestamp(u64);

impl Timestamp {
    /// The beginning of 2015.
    pub const ZERO: Self = Self(0);
    /// Nothing later is taken from anybody. A year before 48 bits end (in 2104), so that whoever holds the
    /// key cannot push the own time to the end, where it could not grow any more.
    pub const LATEST: Self = Self(END - 366 * 24 * 3600 * 100_000);

    /// What 48 bits hold.
    pub(super) const END: Self = Self(END);

    /// From units of 10 us; `None` beyond 48 bits.
    #[must_use]
    pub fn new(units: u64) -> Option<Self> {
        (units <= END).then_some(Self(units))
    }

    /// As it stands in a frame.
    #[must_use]
    pub fn from_bytes([a, b, c, d, e, f]: [u8; 6]) -> Self {
        Self(u64::from_le_bytes([a, b, c, d, e, f, 0, 0]))
    }

    /// For a frame.
    #[must_use]
    pub fn to_bytes(self) -> [u8; 6] {
        let [a, b, c, d, e, f, _, _] = self.0.to_le_bytes();
        [a, b, c, d, e, f]
    }

    /// The computer's calendar at `now`. Zero where it does not know a time after 2015: then what was seen
    /// and saved leads.
    #[must_use]
    pub fn of_calendar(unix_start_us: Option<u64>, now: WallTime) -> Self {
        let unix = unix_start_us.unwrap_or(0).saturating_add(now.as_micros());
        Self(unix.saturating_sub(EPOCH_UNIX_US) / UNIT_US).min(Self::LATEST)
    }

    /// The computer knows a date after 2015.
    #[must_use]
    pub fn knows_date(unix_start_us: Option<u64>) -> bool {
        unix_start_us.is_some_and(|unix| unix > EPOCH_UNIX_US)
    }

    /// Units of 10 us since 2015.
    #[must_use]
    pub const fn units(self) -> u64 {
        self.0
    }

    /// The next one; saturates at the end of 48 bits.
    #[must_use]
    pub const fn next(self) -> Self {
        if self.0 < END { Self(self.0 + 1) } else { self }
    }

    /// Later by `duration`, at most the end of 48 bits.
    #[must_use]
    pub fn plus(self, duration: Duration) -> Self {
        Self(self.0.saturating_add(units(duration)).min(END))
    }

    /// Earlier by `duration`, at least zero.
    #[must_use]
    pub fn minus(self, duration: Duration) -> Self {
        Self(self.0.saturating_sub(units(duration)))
    }
}

fn units(duration: Duration) -> u64 {
    u64::try_from(duration.as_micros()).unwrap_or(u64::MAX) / UNIT_US
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_calendar_becomes_units_of_10_us_since_2015() {
        // 2026-01-01 00:00:00 UTC is 1767225600 (date -u -d 2026-01-01 +%s).
        let at = Timestamp::of_calendar(Some(1_767_225_600_000_000), WallTime::from_micros(25));
        assert_eq!(at.units(), (1_767_225_600 - 1_420_070_400) * 100_000 + 2);
        assert_eq!(Timestamp::of_calendar(None, WallTime::ZERO), Timestamp::ZERO);
        assert_eq!(Timestamp::of_calendar(Some(1), WallTime::ZERO), Timestamp::ZERO);
        assert_eq!(Timestamp::of_calendar(Some(u64::MAX), WallTime::ZERO), Timestamp::LATEST);
    }

    #[test]
    fn six_bytes_carry_it_and_arithmetic_never_wraps() {
        let at = Timestamp::from_bytes([1, 2, 3, 4, 5, 6]);
        assert_eq!((at.units(), at.to_bytes()), (0x0605_0403_0201, [1, 2, 3, 4, 5, 6]));
        let end = Timestamp::from_bytes([0xFF; 6]);
        assert_eq!(end.next(), end);
        assert_eq!(Timestamp::new(end.units()), Some(end));
        assert_eq!(Timestamp::new(end.units() + 1), None);
        assert_eq!(end.plus(Duration::MAX), end);
        assert_eq!(Timestamp::ZERO.minus(Duration::from_secs(60)), Timestamp::ZERO);
        assert_eq!(Timestamp::ZERO.plus(Duration::from_secs(60)).units(), 6_000_000);
    }
}
