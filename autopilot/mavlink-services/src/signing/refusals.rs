//! What was refused while signing is on: counted, and reported once in a while.

use core::time::Duration;

use crate::wall_time::WallTime;

/// A kind is reported again after this, if there is more of it.
const REPORT_INTERVAL: Duration = Duration::from_secs(10);

/// Why a frame is refused while signing is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// MAVLink 2 without a signature.
    Unsigned,
    /// MAVLink 1, which has no signatures.
    Version1,
    /// The signature is not that of this key and this frame.
    WrongSignature,
    /// Not newer than the last of its stream: doubled, reordered or replayed.
    NotNewer,
    /// First of its stream, and not newer than what may have been taken before the start of the process.
    BeforeStart,
    /// First of its stream, and more than a minute behind.
    NewStreamTooOld,
    /// First of its stream, and there are too many already.
    TooManyStreams,
    /// More than a day ahead of the own time, where the computer knows the date.
    DayAhead,
    /// In the last year of 48 bits.
    TooFarAhead,
}

impl Refusal {
    /// All kinds, in the order of their numbers.
    pub const ALL: [Self; 9] = [
        Self::Unsigned,
        Self::Version1,
        Self::WrongSignature,
        Self::NotNewer,
        Self::BeforeStart,
        Self::NewStreamTooOld,
        Self::TooManyStreams,
        Self::DayAhead,
        Self::TooFarAhead,
    ];

    /// What is refused, in words.
    #[must_use]
    pub const fn described(self) -> &'static str {
        match self {
            Self::Unsigned => "unsigned messages",
            Self::Version1 => "MAVLink 1 messages",
            Self::WrongSignature => "messages with a wrong signature (another key?)",
            Self::NotNewer => "messages not newer than the last of their stream",
            Self::BeforeStart => "messages from before the restart",
            Self::NewStreamTooOld => "a stream more than a minute behind",
            Self::TooManyStreams => "a new stream: there are too many",
            Self::DayAhead => "messages more than a day ahead (a wrong clock?)",
            Self::TooFarAhead => "messages from after 2103",
        }
    }
}

/// One kind: how many, how many of them were reported, and when.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    refused: u64,
    reported: u64,
    reported_at: WallTime,
}

/// How many of each kind were refused.
#[derive(Debug, Default)]
pub struct Refusals([Count; Refusal::ALL.len()]);

impl Refusals {
    /// Counts one.
    pub(super) fn add(&mut self, refusal: Refusal) {
        self.0[refusal as usize].refused += 1;
    }

    /// How many of this kind were refused since start.
    #[must_use]
    pub fn count(&self, refusal: Refusal) -> u64 {
        self.0[refusal as usize].refused
    }

    /// One line for a kind of which there is more to tell, at most every ten seconds.
    pub(super) fn next_line(&mut self, now: WallTime) -> Option<String> {
        let is_due = |count: &Count| {
            count.refused > count.reported
                && (count.reported == 0 || now.since(count.reported_at) >= REPORT_INTERVAL)
        };
        let (kind, count) =
            Refusal::ALL.into_iter().zip(&mut self.0).find(|(_, count)| is_due(count))?;
        count.reported = count.refused;
        count.reported_at = now;
        Some(format!("Signing refused {} ({} so far)", kind.described(), count.refused))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_one_kind_is_one_line_in_ten_seconds_and_hides_no_other_kind() {
        let mut refusals = Refusals::default();
        let at = |s: u64| WallTime::from_micros(s * 1_000_000);
        refusals.add(Refusal::Unsigned);
        let line = refusals.next_line(at(5)).unwrap();
        assert_eq!(line, "Signing refused unsigned messages (1 so far)");
        for _ in 0..1_000 {
            refusals.add(Refusal::Unsigned);
            assert_eq!(refusals.next_line(at(14)), None);
        }
        refusals.add(Refusal::WrongSignature);
        assert!(refusals.next_line(at(14)).unwrap().contains("wrong signature"));
        assert!(refusals.next_line(at(15)).unwrap().ends_with("(1001 so far)"));
        assert_eq!(refusals.next_line(at(99)), None, "nothing new");
    }

    #[test]
    fn the_list_of_kinds_is_in_the_order_of_their_numbers() {
        for (number, kind) in Refusal::ALL.into_iter().enumerate() {
            assert_eq!(kind as usize, number);
        }
    }
}
