//! Text of the key file: key and timestamps.

use core::time::Duration;

use serde::{Deserialize, Serialize};

use super::key::Key;
use super::timestamp::Timestamp;

/// Own and accepted time are saved when one of them has come this far since the last save.
pub(super) const SAVE_EVERY: Duration = Duration::from_secs(5);
/// Added to a saved timestamp that may not be the last one: twice the time between two saves, so that a disk may
/// take five seconds.
const SLACK: Duration = Duration::from_secs(10);

/// A key and how far its time has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KeyRecord {
    /// The key.
    pub key: Key,
    /// Own time when it was saved.
    pub timestamp: Timestamp,
    /// Newest time that was taken from anybody.
    pub accepted: Timestamp,
    /// Nothing later was used or taken: the autopilot has ended in order.
    pub is_final: bool,
}

/// What is wrong with the text of a key file. Never shows the key.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
    /// Not the four keys.
    #[error(
        "not a signing key file; it has key = \"64 hexadecimal digits\", timestamp, accepted, final"
    )]
    Form,
    /// Not 64 hexadecimal digits, or zeros only.
    #[error("key is not 64 hexadecimal digits that are not all zero")]
    Key,
    /// Outside the range.
    #[error("{0} = {1} is outside 0 to 281474976710655 (48 bits, 10 us since 2015)")]
    Timestamp(&'static str, u64),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    key: String,
    #[serde(default)]
    timestamp: u64,
    accepted: Option<u64>,
    #[serde(default, rename = "final")]
    is_final: bool,
}

impl KeyRecord {
    /// Reads the text of a key file.
    ///
    /// # Errors
    /// [`RecordError`] says what is wrong, without the key.
    pub fn from_text(text: &str) -> Result<Self, RecordError> {
        // The error of the reader would quote the line, and with it the key.
        let table: Table = toml::from_str(text).map_err(|_| RecordError::Form)?;
        let key = Key::from_hex(&table.key).ok_or(RecordError::Key)?;
        let time = |name, units| Timestamp::new(units).ok_or(RecordError::Timestamp(name, units));
        let timestamp = time("timestamp", table.timestamp)?;
        // Nothing is taken that is later than the own time is then.
        let accepted = table.accepted.map_or(Ok(timestamp), |units| time("accepted", units))?;
        Ok(Self { key, timestamp, accepted, is_final: table.is_final })
    }

    /// The text of a key file.
    #[must_use]
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

    /// The earliest time to go on with: later than all that was used.
    #[must_use]
    pub fn resume_at(&self) -> Timestamp {
        self.at_most(self.timestamp)
    }

    /// Up to here everything may have been taken before.
    #[must_use]
    pub fn floor(&self) -> Timestamp {
        self.at_most(self.accepted)
    }

    /// What a saved time may have become before the end.
    fn at_most(&self, saved: Timestamp) -> Timestamp {
        if self.is_final { saved } else { saved.plus(SLACK) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> KeyRecord {
        let timestamp = Timestamp::new(123_456).unwrap();
        let accepted = Timestamp::new(100_000).unwrap();
        KeyRecord { key: Key::new([0xA5; 32]).unwrap(), timestamp, accepted, is_final: false }
    }

    #[test]
    fn what_is_written_is_read_and_key_alone_is_enough() {
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
