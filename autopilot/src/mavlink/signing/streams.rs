//! The latest timestamp of each stream that was heard, so that nothing is taken twice.

use core::time::Duration;

use super::refusals::Refusal;
use super::timestamp::Timestamp;
use crate::mavlink::codec::Identity;

/// Streams at the same time: more than twice the links that there can be.
pub const STREAMS_MAX: usize = 128;
/// How far a new stream may be behind the local time (the standard).
const BEHIND_MAX: Duration = Duration::from_secs(60);

/// Who signs: link of the sender, system and component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stream {
    /// Link of the sender.
    pub link: u8,
    /// System and component.
    pub sender: Identity,
}

/// The streams that were heard.
#[derive(Debug, Default)]
pub struct Streams(Vec<(Stream, Timestamp)>);

impl Streams {
    /// Takes the timestamp of a rightly signed frame, or says what is wrong with it. `local` is the own
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
        if let Some((_, latest)) = self.0.iter_mut().find(|(known, _)| *known == stream) {
            if at <= *latest {
                return Err(Refusal::NotNewer);
            }
            *latest = at;
            return Ok(());
        }
        if at < local.minus(BEHIND_MAX) {
            return Err(Refusal::NewStreamTooOld);
        }
        if self.0.len() >= STREAMS_MAX {
            // As a new stream, what came over such an old one would be refused as well: forgetting it opens
            // nothing.
            self.0.retain(|(_, latest)| *latest >= local.minus(BEHIND_MAX));
        }
        if self.0.len() >= STREAMS_MAX {
            return Err(Refusal::TooManyStreams);
        }
        self.0.push((stream, at));
        Ok(())
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
    fn the_last_year_of_48_bits_is_taken_from_nobody() {
        let late = Timestamp::from_bytes([0xFF; 6]);
        let refused = Streams::default().take(stream(0, 1), late, seconds(1));
        assert_eq!(refused, Err(Refusal::TooFarAhead));
    }
}
