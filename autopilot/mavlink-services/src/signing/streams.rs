//! The latest timestamp of each stream, so that nothing is accepted twice, and what was refused: counted and reported.

use core::time::Duration;

use crate::codec::Identity;
use crate::signing::key::Timestamp;
use crate::wall_time::WallTime;

/// Streams at the same time: more than twice the links that there can be.
pub const STREAMS_MAX: usize = 128;
/// How far a new stream may be behind the local time (the standard).
const BEHIND_MAX: Duration = Duration::from_secs(60);

/// Identity of a stream: link of the sender, system and component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stream {
    /// Link of the sender.
    pub link: u8,
    pub sender: Identity,
}

/// The streams received so far.
#[derive(Debug, Default)]
pub struct Streams {
    known: Vec<(Stream, Timestamp)>,
    /// Every timestamp up to here may have been accepted before the start of the process.
    floor: Timestamp,
    /// The newest accepted timestamp.
    newest: Timestamp,
}

impl Streams {
    /// No streams yet; refuses every timestamp up to `floor`. `newest` is the newest timestamp known to
    /// have been accepted before, at most `floor`.
    pub fn above(floor: Timestamp, newest: Timestamp) -> Self {
        Self { known: Vec::new(), floor, newest }
    }

    /// The newest accepted timestamp, including those before the start of the process.
    pub fn newest(&self) -> Timestamp {
        self.newest
    }

    /// The newest timestamp that may have been accepted, including those before the start of the process.
    pub fn newest_possible(&self) -> Timestamp {
        self.newest.max(self.floor)
    }

    /// Accepts the timestamp of a frame with a valid signature, or returns why it is refused. `local` is the local
    /// time.
    pub(super) fn take(
        &mut self,
        stream: Stream,
        at: Timestamp,
        local: Timestamp,
    ) -> Result<(), Refusal> {
        if at > Timestamp::LATEST {
            return Err(Refusal::TooFarAhead);
        }
        let known = self.known.iter_mut().find(|(known, _)| *known == stream);
        if let Some((_, latest)) = known {
            if at <= *latest {
                return Err(Refusal::NotNewer);
            }
            *latest = at;
            self.newest = self.newest.max(at);
            return Ok(());
        }
        if at <= self.floor {
            return Err(Refusal::BeforeStart);
        }
        if at < local.minus(BEHIND_MAX) {
            return Err(Refusal::NewStreamTooOld);
        }
        if self.known.len() >= STREAMS_MAX {
            // A frame of such an old stream would be refused as that of a new one, too: forgetting the stream admits
            // nothing.
            self.known.retain(|(_, latest)| *latest >= local.minus(BEHIND_MAX));
        }
        if self.known.len() >= STREAMS_MAX {
            return Err(Refusal::TooManyStreams);
        }
        self.known.push((stream, at));
        self.newest = self.newest.max(at);
        Ok(())
    }
}

/// A kind is reported again after this, if there are new refusals.
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
    /// First of its stream, and not newer than a timestamp that may have been accepted before the start of the process.
    BeforeStart,
    /// First of its stream, and more than a minute behind.
    NewStreamTooOld,
    /// First of its stream, and there are too many already.
    TooManyStreams,
    /// More than a day ahead of the local time, where the computer knows the date.
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

    /// Description of the refusal.
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

/// One kind: the number of refusals, how many of them were reported, and when.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    refused: u64,
    reported: u64,
    reported_at: WallTime,
}

/// Counts of refusals by kind.
#[derive(Debug, Default)]
pub struct Refusals([Count; Refusal::ALL.len()]);

impl Refusals {
    pub(super) fn add(&mut self, refusal: Refusal) {
        self.0[refusal as usize].refused += 1;
    }

    /// Refusals of this kind since start.
    pub fn count(&self, refusal: Refusal) -> u64 {
        self.0[refusal as usize].refused
    }

    /// One line for a kind with new refusals, at most every ten seconds.
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

    fn stream(link: u8, component: u8) -> Stream {
        Stream { link, sender: Identity { system: 255, component } }
    }

    fn seconds(s: u64) -> Timestamp {
        Timestamp::new(s * 100_000).unwrap()
    }

    #[test]
    fn each_stream_has_its_own_time_and_takes_nothing_twice() {
        let mut streams = Streams::default();
        let local = seconds(100);
        assert_eq!(streams.take(stream(0, 1), seconds(90), local), Ok(()));
        assert_eq!(streams.take(stream(0, 1), seconds(90), local), Err(Refusal::NotNewer));
        assert_eq!(streams.take(stream(0, 1), seconds(89), local), Err(Refusal::NotNewer));
        assert_eq!(streams.take(stream(1, 1), seconds(80), local), Ok(()), "another link");
        assert_eq!(streams.take(stream(0, 2), seconds(80), local), Ok(()), "another component");
        assert_eq!(streams.take(stream(0, 1), seconds(90).next(), local), Ok(()));
    }

    #[test]
    fn a_known_stream_may_be_old_and_a_new_one_at_most_a_minute() {
        let mut streams = Streams::default();
        assert_eq!(streams.take(stream(0, 1), seconds(10), seconds(70)), Ok(()));
        let old = streams.take(stream(1, 1), seconds(10), seconds(70).next());
        assert_eq!(old, Err(Refusal::NewStreamTooOld));
        assert_eq!(streams.take(stream(0, 1), seconds(11), seconds(900)), Ok(()));
    }

    #[test]
    fn times_up_to_the_floor_are_refused_and_the_newest_is_remembered() {
        let mut streams = Streams::above(seconds(100), seconds(90));
        assert_eq!(streams.newest(), seconds(90));
        let early = streams.take(stream(0, 1), seconds(100), seconds(100));
        assert_eq!(early, Err(Refusal::BeforeStart));
        assert_eq!(streams.newest(), seconds(90));
        assert_eq!(streams.take(stream(0, 1), seconds(100).next(), seconds(100)), Ok(()));
        assert_eq!(streams.take(stream(0, 1), seconds(120), seconds(100)), Ok(()));
        assert_eq!(streams.take(stream(1, 1), seconds(110), seconds(120)), Ok(()));
        assert_eq!(streams.newest(), seconds(120));
    }

    #[test]
    fn the_table_is_bounded_and_only_streams_that_would_be_refused_anyway_make_room() {
        let mut streams = Streams::default();
        let all = (0..=255).map(|link| streams.take(stream(link, 1), seconds(100), seconds(100)));
        assert_eq!(all.filter(Result::is_ok).count(), STREAMS_MAX);
        let full = streams.take(stream(0, 9), seconds(160), seconds(160));
        assert_eq!(full, Err(Refusal::TooManyStreams));
        let later = seconds(160).next();
        assert_eq!(streams.take(stream(0, 9), later, later), Ok(()));
        let replayed = streams.take(stream(0, 1), seconds(100), later);
        assert_eq!(replayed, Err(Refusal::NewStreamTooOld));
    }

    #[test]
    fn timestamps_in_the_last_year_of_48_bits_are_refused() {
        let late = Timestamp::from_bytes([0xFF; 6]);
        let refused = Streams::default().take(stream(0, 1), late, seconds(1));
        assert_eq!(refused, Err(Refusal::TooFarAhead));
    }

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
