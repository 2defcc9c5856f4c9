//! STATUSTEXT: each event as a text, once.

use core::cmp::Reverse;
use core::time::Duration;
use std::collections::VecDeque;

use ::mavlink::dialects::common::{MavSeverity, STATUSTEXT_DATA};
use icd::EffectorList;

use crate::aircraft::Phase;
use crate::codec::{Encoded, printable};
use crate::peers::Peers;
use crate::wall_time::WallTime;
use flight_management::event::EventKind;
use flight_management::event_text;
use flight_management::event_text::Severity;
use flight_management::parameters::Parameters;

/// Texts that may wait for room at a peer; beyond that the least important ones are dropped.
const TEXTS_MAX: usize = 32;
/// Texts in reply to requests, in a burst.
const REPLIES_BURST: u32 = 20;
/// After a burst, one such text in this time: a flood of bad requests must not hide important texts.
const REPLY_INTERVAL: Duration = Duration::from_millis(200);

#[derive(Debug, Default)]
pub struct StatusTexts {
    queue: VecDeque<(MavSeverity, String)>,
    /// Texts in reply to requests, of the present burst.
    replies: u32,
    refilled: WallTime,
    suppressed: u64,
    /// Dropped texts that no report has counted yet.
    unreported: u64,
    last_id: u16,
    for_log: VecDeque<LogText>,
}

/// A text for the flight log: severity (number of syslog), text.
pub type LogText = (u8, String);

impl StatusTexts {
    /// Queues a text of the ground-station side, for the peers and for the flight log.
    pub fn publish(&mut self, severity: MavSeverity, text: impl Into<String>) {
        let text = text.into();
        self.log(severity, text.clone());
        self.publish_event(severity, text);
    }

    /// Queues a text for the flight log only: the peers get the information in another way.
    // The recorder may be slow or absent, and this queue must not grow for it.
    pub fn log(&mut self, severity: MavSeverity, text: impl Into<String>) {
        if self.for_log.len() >= TEXTS_MAX {
            self.for_log.pop_front();
        }
        self.for_log.push_back((severity as u8, text.into()));
    }

    /// Next text for the flight log.
    pub fn pop_for_log(&mut self) -> Option<LogText> {
        self.for_log.pop_front()
    }

    /// Queues the text of an event, for the peers only: the recorder writes the event itself.
    pub fn publish_event(&mut self, severity: MavSeverity, text: impl Into<String>) {
        self.queue.push_back((severity, text.into()));
        if self.queue.len() > TEXTS_MAX {
            let severities = self.queue.iter().map(|(severity, _)| *severity as u8).enumerate();
            // The larger the number, the less important; the oldest of them.
            let victim = severities.min_by_key(|(_, severity)| Reverse(*severity));
            self.queue.remove(victim.map_or(0, |(place, _)| place));
            self.unreported += 1;
        }
    }

    /// A warning in reply to a request, such as the reason of a refusal; limited in rate, since requests are not.
    pub fn warn(&mut self, now: WallTime, text: impl Into<String>) {
        self.reply(MavSeverity::MAV_SEVERITY_WARNING, now, text);
    }

    /// Information in reply to a request, limited in the same way.
    pub fn inform(&mut self, now: WallTime, text: impl Into<String>) {
        self.reply(MavSeverity::MAV_SEVERITY_INFO, now, text);
    }

    /// The same with any severity.
    pub fn reply(&mut self, severity: MavSeverity, now: WallTime, text: impl Into<String>) {
        let refill = now.since(self.refilled).as_micros() / REPLY_INTERVAL.as_micros();
        if refill > 0 {
            let refill = u32::try_from(refill).unwrap_or(u32::MAX);
            self.replies = self.replies.saturating_sub(refill);
            self.refilled = now;
        }
        if self.replies >= REPLIES_BURST {
            self.suppressed += 1;
            return;
        }
        self.replies += 1;
        let mut text = text.into();
        if self.suppressed > 0 {
            text = format!("{text} ({} more were not shown)", self.suppressed);
            self.suppressed = 0;
        }
        self.publish(severity, text);
    }

    /// Queues the text of an event.
    pub fn handle_event(
        &mut self,
        kind: &EventKind,
        parameters: &Parameters,
        effectors: &EffectorList,
    ) {
        if let Some((severity, text)) = event_text::of_event(kind, parameters, effectors) {
            self.publish_event(mav_severity(severity), text);
        }
    }

    /// Sends waiting texts, as far as any peer has room; then the number of dropped ones.
    pub fn poll(&mut self, peers: &mut Peers) {
        while peers.can_announce(CHUNKS_MAX)
            // Only with room for the longest text: one with its end missing says something else.
            && let Some((severity, text)) =
                self.queue.pop_front().or_else(|| self.take_unreported())
        {
            let chunks = chunks_of(&text);
            let id = if chunks.len() == 1 {
                0
            } else {
                // 0 is the id of a text that fits one message.
                self.last_id = self.last_id.checked_add(1).unwrap_or(1);
                self.last_id
            };
            for (text, chunk_seq) in chunks.into_iter().zip(0..) {
                let text = text.into();
                let message = STATUSTEXT_DATA { severity, text, id, chunk_seq };
                peers.announce(&Encoded::new(&message));
            }
        }
    }

    fn take_unreported(&mut self) -> Option<(MavSeverity, String)> {
        let count = core::mem::take(&mut self.unreported);
        let text = format!("{count} texts were not shown");
        (count > 0).then_some((MavSeverity::MAV_SEVERITY_WARNING, text))
    }
}

/// Severity and text for the end of the process.
pub fn text_of_end(phase: Phase) -> (MavSeverity, &'static str) {
    match phase {
        Phase::Lost => {
            (MavSeverity::MAV_SEVERITY_CRITICAL, "The simulation ends: the plant does not answer")
        }
        _ => (MavSeverity::MAV_SEVERITY_INFO, "The simulation ends"),
    }
}

/// The same severity in MAVLink.
pub fn mav_severity(severity: Severity) -> MavSeverity {
    match severity {
        Severity::Emergency => MavSeverity::MAV_SEVERITY_EMERGENCY,
        Severity::Critical => MavSeverity::MAV_SEVERITY_CRITICAL,
        Severity::Warning => MavSeverity::MAV_SEVERITY_WARNING,
        Severity::Info => MavSeverity::MAV_SEVERITY_INFO,
    }
}

/// Characters of one message.
pub(super) const CHUNK: usize = 50;
/// Chunks of one text; a longer text is cut.
pub(super) const CHUNKS_MAX: usize = 5;

/// The chunks of a text, at least one. Receivers join them as they are, up to the first that has a NUL: all but the last
/// are full, and of more than one the last is not.
fn chunks_of(text: &str) -> Vec<[u8; CHUNK]> {
    let mut bytes: Vec<u8> = text.chars().map(printable).collect();
    bytes.truncate(bytes.trim_ascii_end().len());
    if bytes.len() > CHUNK && bytes.len().is_multiple_of(CHUNK) {
        // QGroundControl shows an empty chunk as `...`.
        bytes.push(b' ');
    }
    // One byte less, so that the last chunk has the NUL that ends the text.
    bytes.truncate(CHUNKS_MAX * CHUNK - 1);
    if bytes.is_empty() {
        return vec![[0; CHUNK]];
    }
    let filled = |part: &[u8]| {
        let mut chunk = [0; CHUNK];
        chunk[..part.len()].copy_from_slice(part);
        chunk
    };
    bytes.chunks(CHUNK).map(filled).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_flood_of_refusals_is_limited_and_counted_and_leaves_room_for_events() {
        let mut texts = StatusTexts::default();
        for _ in 0..1000 {
            texts.warn(WallTime::ZERO, "no");
        }
        assert_eq!(texts.queue.len(), REPLIES_BURST as usize);
        texts.warn(WallTime::from_micros(1_000_000), "no");
        assert_eq!(texts.queue.back().unwrap().1, "no (980 more were not shown)");
    }

    #[test]
    fn the_least_important_texts_are_dropped_when_there_are_too_many() {
        let mut texts = StatusTexts::default();
        texts.publish(MavSeverity::MAV_SEVERITY_EMERGENCY, "ground");
        for number in 0..100 {
            texts.publish(MavSeverity::MAV_SEVERITY_INFO, number.to_string());
        }
        texts.publish(MavSeverity::MAV_SEVERITY_WARNING, "fault");
        let shown: Vec<&str> = texts.queue.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(shown.len(), TEXTS_MAX);
        assert_eq!((shown[0], shown[1], shown[TEXTS_MAX - 1]), ("ground", "70", "fault"));
        assert_eq!(
            texts.take_unreported().map(|(_, text)| text).unwrap(),
            "70 texts were not shown"
        );
        assert_eq!(texts.take_unreported(), None, "reported once");
    }

    /// As receivers see a chunk: up to its NUL.
    fn seen(text: &str) -> Vec<String> {
        let end = |chunk: &[u8; CHUNK]| chunk.iter().position(|byte| *byte == 0).unwrap_or(CHUNK);
        let text_of = |chunk: [u8; CHUNK]| String::from_utf8(chunk[..end(&chunk)].to_vec());
        chunks_of(text).into_iter().map(|chunk| text_of(chunk).unwrap()).collect()
    }

    /// As QGroundControl, MAVSDK and MAVProxy join them: the first that is shorter than the field is the last one.
    fn joined(chunks: &[String]) -> String {
        let last = chunks.iter().position(|chunk| chunk.len() < CHUNK);
        chunks[..=last.unwrap_or(0)].concat()
    }

    #[test]
    fn a_text_that_fits_is_one_message() {
        assert_eq!(seen(""), [""]);
        assert_eq!(seen("short"), ["short"]);
        assert_eq!(seen(&"x".repeat(50)), ["x".repeat(50)]);
    }

    #[test]
    fn a_longer_text_has_no_blanks_of_the_protocol_and_its_last_chunk_is_never_full_or_empty() {
        assert_eq!(seen(&"x".repeat(51)), ["x".repeat(50), "x".to_owned()]);
        assert_eq!(seen(&"x".repeat(100)), ["x".repeat(50), "x".repeat(50), " ".to_owned()]);
        assert_eq!(seen(&"x".repeat(10_000)).concat().len(), CHUNKS_MAX * CHUNK - 1);
        assert_eq!(seen("Gr\u{f6}\u{df}e \u{1b}[2J\r\n\u{7}\u{7f}\u{202e}~"), ["Gr??e ?[2J?????~"]);
    }

    proptest! {
        #[test]
        fn every_receiver_joins_every_text(text in "[a-z]([a-z ]{0,247}[a-z])?") {
            let chunks = seen(&text);
            let joined = joined(&chunks);
            prop_assert_eq!(joined.trim_ascii_end(), text);
            prop_assert!(chunks.iter().all(|chunk| !chunk.is_empty()));
        }
    }
}
