//! STATUSTEXT: what happened, in words, once.

use core::cmp::Reverse;
use core::time::Duration;
use std::collections::VecDeque;

use ::mavlink::dialects::common::{MavSeverity, STATUSTEXT_DATA};

use super::aircraft::Phase;
use super::codec::Encoded;
use super::peers::Peers;
use crate::wall_time::WallTime;
use flight_management::event::EventKind;
use flight_management::event_text::{self, Severity};
use flight_management::parameters::Parameters;
use icd::EffectorList;

mod chunks;

use chunks::{CHUNK, CHUNKS_MAX};

/// Texts that may wait for room at a peer; of more than these the least important ones are not shown.
const TEXTS_MAX: usize = 32;
/// Texts in reply to requests, in a burst.
const REPLIES_BURST: u32 = 20;
/// After a burst, one of them in this time: a flood of bad requests must not hide what matters.
const REPLY_INTERVAL: Duration = Duration::from_millis(200);

/// The texts that wait.
#[derive(Debug)]
pub struct StatusTexts {
    queue: VecDeque<(MavSeverity, String)>,
    replies: u32,
    refilled: WallTime,
    suppressed: u64,
    dropped: u64,
    /// Of these, the ones that no text has reported yet.
    unreported: u64,
    next_id: u16,
    for_log: VecDeque<LogText>,
}

/// A text for the flight log: importance (number of syslog), words.
pub type LogText = (u8, String);

impl Default for StatusTexts {
    fn default() -> Self {
        Self {
            queue: VecDeque::with_capacity(TEXTS_MAX + 1),
            replies: REPLIES_BURST,
            refilled: WallTime::ZERO,
            suppressed: 0,
            dropped: 0,
            unreported: 0,
            next_id: 1,
            for_log: VecDeque::new(),
        }
    }
}

impl StatusTexts {
    /// Queues a text of the ground-station side, for the peers and for the flight log.
    pub fn say(&mut self, severity: MavSeverity, text: impl Into<String>) {
        let text = text.into();
        self.note(severity, text.clone());
        self.queue_text(severity, text);
    }

    /// Queues a text for the flight log only: the peers get the information in another way.
    pub fn note(&mut self, severity: MavSeverity, text: impl Into<String>) {
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
    pub fn queue_text(&mut self, severity: MavSeverity, text: impl Into<String>) {
        self.queue.push_back((severity, text.into()));
        if self.queue.len() > TEXTS_MAX {
            let severities = self.queue.iter().map(|(severity, _)| *severity as u8).enumerate();
            // The larger the number, the less it matters; the oldest of them.
            let victim = severities.min_by_key(|(_, severity)| Reverse(*severity));
            self.queue.remove(victim.map_or(0, |(place, _)| place));
            self.dropped += 1;
            self.unreported += 1;
        }
    }

    /// Why a request was refused.
    pub fn refuse(&mut self, now: WallTime, text: impl Into<String>) {
        self.reply(MavSeverity::MAV_SEVERITY_WARNING, now, text);
    }

    /// Something that a request causes; limited in rate, since requests are not.
    pub fn reply(&mut self, severity: MavSeverity, now: WallTime, text: impl Into<String>) {
        let refill = now.since(self.refilled).as_micros() / REPLY_INTERVAL.as_micros();
        if refill > 0 {
            let refill = u32::try_from(refill).unwrap_or(u32::MAX);
            self.replies = self.replies.saturating_add(refill).min(REPLIES_BURST);
            self.refilled = now;
        }
        if self.replies == 0 {
            self.suppressed += 1;
            return;
        }
        self.replies -= 1;
        let mut text = text.into();
        if self.suppressed > 0 {
            text = format!("{text} ({} more were not shown)", self.suppressed);
            self.suppressed = 0;
        }
        self.say(severity, text);
    }

    /// Queues the text of an event.
    pub fn handle_event(
        &mut self,
        kind: &EventKind,
        parameters: &Parameters,
        effectors: &EffectorList,
    ) {
        if let Some((severity, text)) = event_text::of_event(kind, parameters, effectors) {
            self.queue_text(mav_severity(severity), text);
        }
    }

    /// Sends what waits, as far as any peer has room; then how many texts found no room.
    pub fn poll(&mut self, peers: &mut Peers) {
        while peers.can_announce(CHUNKS_MAX)
            && let Some((severity, text)) =
                self.queue.pop_front().or_else(|| self.take_unreported())
        {
            for message in self.chunks(severity, &text) {
                peers.announce(&message);
            }
        }
    }

    fn take_unreported(&mut self) -> Option<(MavSeverity, String)> {
        let count = core::mem::take(&mut self.unreported);
        let text = format!("{count} texts were not shown");
        (count > 0).then_some((MavSeverity::MAV_SEVERITY_WARNING, text))
    }

    /// Something waits.
    #[must_use]
    pub fn is_due(&self) -> bool {
        !self.queue.is_empty()
    }

    /// Texts dropped so far.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    fn chunks(&mut self, severity: MavSeverity, text: &str) -> Vec<Encoded> {
        let chunks = chunks::of(text);
        let id = if chunks.len() == 1 { 0 } else { self.take_id() };
        let message = |(text, chunk_seq): ([u8; CHUNK], u8)| {
            Encoded::new(&STATUSTEXT_DATA { severity, text: text.into(), id, chunk_seq })
        };
        chunks.into_iter().zip(0..).map(message).collect()
    }

    fn take_id(&mut self) -> u16 {
        let id = self.next_id;
        self.next_id = self.next_id.checked_add(1).unwrap_or(1);
        id
    }
}

/// Severity and text of the end of the process.
#[must_use]
pub fn text_of_end(phase: Phase) -> (MavSeverity, &'static str) {
    match phase {
        Phase::Lost => {
            (MavSeverity::MAV_SEVERITY_CRITICAL, "The simulation ends: the plant does not answer")
        }
        _ => (MavSeverity::MAV_SEVERITY_INFO, "The simulation ends"),
    }
}

/// The same severity in MAVLink.
#[must_use]
pub fn mav_severity(severity: Severity) -> MavSeverity {
    match severity {
        Severity::Emergency => MavSeverity::MAV_SEVERITY_EMERGENCY,
        Severity::Critical => MavSeverity::MAV_SEVERITY_CRITICAL,
        Severity::Warning => MavSeverity::MAV_SEVERITY_WARNING,
        Severity::Info => MavSeverity::MAV_SEVERITY_INFO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_of_refusals_is_limited_and_counted_and_leaves_room_for_events() {
        let mut texts = StatusTexts::default();
        for _ in 0..1000 {
            texts.refuse(WallTime::ZERO, "no");
        }
        assert_eq!(texts.queue.len(), REPLIES_BURST as usize);
        texts.refuse(WallTime::from_micros(1_000_000), "no");
        assert_eq!(texts.queue.back().unwrap().1, "no (980 more were not shown)");
    }

    #[test]
    fn what_matters_least_is_not_shown_when_there_are_too_many_texts() {
        let mut texts = StatusTexts::default();
        texts.say(MavSeverity::MAV_SEVERITY_EMERGENCY, "ground");
        for number in 0..100 {
            texts.say(MavSeverity::MAV_SEVERITY_INFO, number.to_string());
        }
        texts.say(MavSeverity::MAV_SEVERITY_WARNING, "fault");
        let shown: Vec<&str> = texts.queue.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(shown.len(), TEXTS_MAX);
        assert_eq!((shown[0], shown[1], shown[TEXTS_MAX - 1]), ("ground", "70", "fault"));
        assert_eq!(
            texts.take_unreported().map(|(_, text)| text).unwrap(),
            "70 texts were not shown"
        );
        assert_eq!(texts.take_unreported(), None, "said once");
    }
}
