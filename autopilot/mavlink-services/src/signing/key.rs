//! The shared secret, the time of a signature, and the key file. Only that file shows the key.

use core::fmt;
use core::time::Duration;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};

use crate::wall_time::WallTime;

/// Length of a key, bytes.
pub const KEY: usize = 32;
/// Length of the trailer of a signed frame: link, timestamp, signature.
pub const TRAILER: usize = LINK + TIME + HASH;
const LINK: usize = 1;
const TIME: usize = 6;
const HASH: usize = 6;

/// A key. Never all zeros, which means "no signing".
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Key([u8; KEY]);

impl fmt::Debug for Key {
    /// `Debug` without the key.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Key(not shown)")
    }
}

impl Key {
    /// `None` if it is all zeros.
    pub fn new(bytes: [u8; KEY]) -> Option<Self> {
        (bytes != [0; KEY]).then_some(Self(bytes))
    }

    /// From 64 hexadecimal digits; `None` for anything else, and for all zeros.
    pub fn from_hex(text: &str) -> Option<Self> {
        let digits: Vec<u8> =
            text.chars().map(|c| c.to_digit(16)?.try_into().ok()).collect::<Option<_>>()?;
        let (pairs, rest) = digits.as_chunks::<2>();
        let bytes: Vec<u8> = pairs.iter().map(|[high, low]| high << 4 | low).collect();
        rest.is_empty().then(|| bytes.try_into().ok()).flatten().and_then(Self::new)
    }

    /// 64 hexadecimal digits, for the key file only.
    pub fn to_hex(self) -> String {
        self.0.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// The trailer of a frame that ends with its checksum: `sha256_48(key + frame + link + timestamp)`.
    pub fn sign(&self, frame: &[u8], link: u8, at: Timestamp) -> [u8; TRAILER] {
        let [t0, t1, t2, t3, t4, t5] = at.to_bytes();
        let mut hash = Sha256::new();
        hash.update(self.0);
        hash.update(frame);
        hash.update([link, t0, t1, t2, t3, t4, t5]);
        let hash = hash.finalize();
        let mut trailer = [link, t0, t1, t2, t3, t4, t5, 0, 0, 0, 0, 0, 0];
        trailer[LINK + TIME..].copy_from_slice(&hash[..HASH]);
        trailer
    }

    /// Whether this trailer belongs to this frame. Runs in constant time.
    pub fn is_right(&self, frame: &[u8], trailer: Trailer) -> bool {
        let right = self.sign(frame, trailer.link(), trailer.at());
        // All bytes, whatever the first ones are: the time must not tell how many of them are right.
        let differences = right.iter().zip(trailer.0).fold(0, |sum, (a, b)| sum | (a ^ b));
        differences == 0
    }
}

/// Trailer of a signed frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Trailer(pub [u8; TRAILER]);

impl Trailer {
    /// Link id of the sender, which only the sender can interpret.
    pub fn link(self) -> u8 {
        self.0[0]
    }

    pub fn at(self) -> Timestamp {
        let [_, t0, t1, t2, t3, t4, t5, ..] = self.0;
        Timestamp::from_bytes([t0, t1, t2, t3, t4, t5])
    }
}

/// UNIX time at timestamp zero, us.
const EPOCH_UNIX_US: u64 = 1_420_070_400_000_000;
/// One unit, us.
const UNIT_US: u64 = 10;
/// Largest number of 48 bits.
const LAST_UNIT: u64 = (1 << 48) - 1;

/// Time of a signature, units of 10 us since 2015.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Timestamp(u64);

impl Timestamp {
    /// The beginning of 2015.
    pub const ZERO: Self = Self(0);
    /// Upper limit of accepted timestamps. A year before 48 bits end (in 2104), so that a holder of the
    /// key cannot push the local time to the end, where it could not grow any more.
    pub const LATEST: Self = Self(LAST_UNIT - 366 * 24 * 3600 * 100_000);

    /// What 48 bits hold.
    pub(super) const END: Self = Self(LAST_UNIT);

    /// From units of 10 us; `None` beyond 48 bits.
    pub fn new(units: u64) -> Option<Self> {
        (units <= LAST_UNIT).then_some(Self(units))
    }

    /// From the bytes in a frame.
    pub fn from_bytes([a, b, c, d, e, f]: [u8; 6]) -> Self {
        Self(u64::from_le_bytes([a, b, c, d, e, f, 0, 0]))
    }

    /// The bytes in a frame.
    pub fn to_bytes(self) -> [u8; 6] {
        let [a, b, c, d, e, f, _, _] = self.0.to_le_bytes();
        [a, b, c, d, e, f]
    }

    /// The computer's calendar at `now`. Zero where it knows no time after 2015: then the received
    /// and saved timestamps count.
    pub fn of_calendar(unix_start_us: Option<u64>, now: WallTime) -> Self {
        let unix = unix_start_us.unwrap_or(0).saturating_add(now.as_micros());
        Self(unix.saturating_sub(EPOCH_UNIX_US) / UNIT_US).min(Self::LATEST)
    }

    /// The computer knows a date after 2015.
    pub fn knows_date(unix_start_us: Option<u64>) -> bool {
        unix_start_us.is_some_and(|unix| unix > EPOCH_UNIX_US)
    }

    /// Units of 10 us since 2015.
    pub const fn units(self) -> u64 {
        self.0
    }

    /// The next timestamp; saturates at the end of 48 bits.
    #[must_use]
    pub const fn next(self) -> Self {
        if self.0 < LAST_UNIT { Self(self.0 + 1) } else { self }
    }

    /// Later by `duration`, at most the end of 48 bits.
    #[must_use]
    pub fn plus(self, duration: Duration) -> Self {
        Self(self.0.saturating_add(units(duration)).min(LAST_UNIT))
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

/// Local and accepted time are saved when one of them has advanced by this since the last save.
pub(super) const SAVE_EVERY: Duration = Duration::from_secs(5);
/// Added to a saved timestamp that may not be the last one: twice the time between two saves, so that a disk may
/// take five seconds.
const SLACK: Duration = Duration::from_secs(10);

/// A key and its timestamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeyRecord {
    pub key: Key,
    /// Local time at the save.
    pub timestamp: Timestamp,
    pub accepted: Timestamp,
    /// No later timestamp was used or accepted: the autopilot has ended in order.
    pub is_final: bool,
}

/// Error in the text of a key file. Never shows the key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// Other keys than the four expected.
    #[error(
        "not a signing key file; it has key = \"64 hexadecimal digits\", timestamp, accepted, final"
    )]
    Form,
    /// Not 64 hexadecimal digits, or all zeros.
    #[error("key is not 64 hexadecimal digits that are not all zero")]
    Key,
    #[error("{0} = {1} is outside 0 to 281474976710655 (48 bits, 10 us since 2015)")]
    Timestamp(&'static str, u64),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KeyTable {
    key: String,
    #[serde(default)]
    timestamp: u64,
    accepted: Option<u64>,
    #[serde(default, rename = "final")]
    is_final: bool,
}

impl KeyRecord {
    /// Reads the text of a key file.
    pub fn from_text(text: &str) -> Result<Self, RecordError> {
        // The parser's error would quote the line, and with it the key.
        let table: KeyTable = toml::from_str(text).map_err(|_| RecordError::Form)?;
        let key = Key::from_hex(&table.key).ok_or(RecordError::Key)?;
        let time = |name, units| Timestamp::new(units).ok_or(RecordError::Timestamp(name, units));
        let timestamp = time("timestamp", table.timestamp)?;
        // No timestamp later than the restored local time is accepted.
        let accepted = table.accepted.map_or(Ok(timestamp), |units| time("accepted", units))?;
        Ok(Self { key, timestamp, accepted, is_final: table.is_final })
    }

    /// The text of a key file.
    pub fn to_text(&self) -> String {
        let Self { key, timestamp, accepted, is_final } = self;
        format!(
            "# MAVLink signing key of Two-Step. Keep it secret; delete this file to turn signing off.\n\
             key = \"{}\"\ntimestamp = {}\naccepted = {}\nfinal = {is_final}\n",
            key.to_hex(),
            timestamp.units(),
            accepted.units()
        )
    }

    /// First timestamp to use: later than every one used before.
    pub fn resume_at(&self) -> Timestamp {
        self.at_most(self.timestamp)
    }

    /// Every timestamp up to here may have been accepted before.
    pub fn floor(&self) -> Timestamp {
        self.at_most(self.accepted)
    }

    /// Upper bound of a saved time at the end of the process.
    fn at_most(&self, saved: Timestamp) -> Timestamp {
        if self.is_final { saved } else { saved.plus(SLACK) }
    }
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

    fn record() -> KeyRecord {
        let timestamp = Timestamp::new(123_456).unwrap();
        let accepted = Timestamp::new(100_000).unwrap();
        KeyRecord { key: Key::new([0xA5; 32]).unwrap(), timestamp, accepted, is_final: false }
    }

    #[test]
    fn a_written_key_file_is_read_back_and_the_key_alone_is_enough() {
        assert_eq!(KeyRecord::from_text(&record().to_text()), Ok(record()));
        let by_hand = format!("key = \"{}\"", "A5".repeat(32));
        let read = KeyRecord::from_text(&by_hand).unwrap();
        assert_eq!((read.key, read.timestamp), (record().key, Timestamp::ZERO));
        let of_before = format!("{by_hand}\ntimestamp = 77\nfinal = true");
        assert_eq!(KeyRecord::from_text(&of_before).unwrap().floor().units(), 77);
    }

    #[test]
    fn wrong_texts_are_refused_and_no_error_shows_the_key() {
        let hex = "a5".repeat(32);
        for (text, error) in [
            (String::new(), RecordError::Form),
            (hex.clone(), RecordError::Form),
            (format!("key = \"{hex}\"\nmore = 1"), RecordError::Form),
            (format!("key = \"{hex}"), RecordError::Form),
            (format!("key = \"{hex}\"\ntimestamp = -1"), RecordError::Form),
            (format!("key = \"{}\"", &hex[1..]), RecordError::Key),
            (format!("key = \"{hex}a5\""), RecordError::Key),
            (format!("key = \"{}\"", "0".repeat(64)), RecordError::Key),
            (format!("key = \"{}é\"", &hex[2..]), RecordError::Key),
            (
                format!("key = \"{hex}\"\ntimestamp = 281474976710656"),
                RecordError::Timestamp("timestamp", 281_474_976_710_656),
            ),
            (
                format!("key = \"{hex}\"\naccepted = 281474976710656"),
                RecordError::Timestamp("accepted", 281_474_976_710_656),
            ),
        ] {
            let refused = KeyRecord::from_text(&text).unwrap_err();
            assert_eq!(refused, error, "{text}");
            assert!(!refused.to_string().contains("a5a5"), "{refused}");
        }
        assert!(!format!("{:?}", record()).contains("165"), "{:?}", record());
    }

    #[test]
    fn after_an_end_out_of_order_both_times_go_on_ten_seconds_later() {
        let times = |record: KeyRecord| (record.resume_at().units(), record.floor().units());
        assert_eq!(times(record()), (123_456 + 1_000_000, 100_000 + 1_000_000));
        assert_eq!(times(KeyRecord { is_final: true, ..record() }), (123_456, 100_000));
    }
}
