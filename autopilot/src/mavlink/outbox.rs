//! What waits to be sent to one peer. Answers and telemetry wait apart, so that a peer that reads slowly
//! loses telemetry first, then what everybody is told, and never an acknowledgement.

use std::collections::VecDeque;

use super::codec::Encoded;

/// Answers that may wait: more than the frames of one datagram can ask for, a burst of the parameter list
/// and the texts of a moment.
pub const ANSWERS_MAX: usize = 256;
/// Places kept for answers to what was read already. While a peer has fewer, nothing more is read from it.
/// Twice the commands that may wait for their outcome, and far more than one message asks for.
pub const ANSWERS_RESERVED: usize = 64;
/// Telemetry that may wait: about a quarter of a second of it.
const TELEMETRY_MAX: usize = 96;

/// Two bounded queues and the sequence number of the link.
#[derive(Debug, Default)]
pub struct Outbox {
    answers: VecDeque<Encoded>,
    telemetry: VecDeque<Encoded>,
    sequence: u8,
    dropped_telemetry: u64,
    dropped_announcements: u64,
    dropped_answers: u64,
}

impl Outbox {
    /// Queues what everybody is told. Dropped and counted if only the places of answers are left.
    pub fn announce(&mut self, message: Encoded) {
        if self.room() > ANSWERS_RESERVED {
            self.answers.push_back(message);
        } else {
            self.dropped_announcements += 1;
        }
    }

    /// Queues an answer. Dropped and counted if there is no room at all, which [`ANSWERS_RESERVED`] prevents.
    pub fn answer(&mut self, message: Encoded) {
        if self.answers.len() < ANSWERS_MAX {
            self.answers.push_back(message);
        } else {
            self.dropped_answers += 1;
        }
    }

    /// Queues telemetry; the oldest makes room.
    pub fn stream(&mut self, message: Encoded) {
        if self.telemetry.len() >= TELEMETRY_MAX {
            self.telemetry.pop_front();
            self.dropped_telemetry += 1;
        }
        self.telemetry.push_back(message);
    }

    /// Answers that still fit.
    #[must_use]
    pub fn room(&self) -> usize {
        ANSWERS_MAX - self.answers.len()
    }

    /// An answer waits.
    #[must_use]
    pub fn has_answer(&self) -> bool {
        !self.answers.is_empty()
    }

    /// Anything waits.
    #[must_use]
    pub fn has_any(&self) -> bool {
        self.has_answer() || !self.telemetry.is_empty()
    }

    /// Next message to send and its sequence number, answers first. The number counts what is sent, so
    /// that a ground station sees no loss where telemetry was dropped.
    pub fn pop(&mut self) -> Option<(Encoded, u8)> {
        let message = self.answers.pop_front().or_else(|| self.telemetry.pop_front())?;
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        Some((message, sequence))
    }

    /// Telemetry messages dropped so far.
    #[must_use]
    pub fn dropped_telemetry(&self) -> u64 {
        self.dropped_telemetry
    }

    /// Heartbeats, texts and changed parameters dropped so far.
    #[must_use]
    pub fn dropped_announcements(&self) -> u64 {
        self.dropped_announcements
    }

    /// Answers dropped so far.
    #[must_use]
    pub fn dropped_answers(&self) -> u64 {
        self.dropped_answers
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mavlink::codec::OWN;
    use ::mavlink::dialects::common::{MavResult, NAMED_VALUE_FLOAT_DATA};

    fn value(time_boot_ms: u32) -> Encoded {
        Encoded::new(&NAMED_VALUE_FLOAT_DATA { time_boot_ms, value: 0.0, name: "x".into() })
    }

    #[test]
    fn a_slow_peer_loses_old_telemetry_and_no_acknowledgement() {
        let mut outbox = Outbox::default();
        for ms in 0..1000 {
            outbox.stream(value(ms));
        }
        let ack = Encoded::command_ack(420, MavResult::MAV_RESULT_ACCEPTED, OWN);
        outbox.answer(ack.clone());
        assert_eq!(outbox.pop(), Some((ack, 0)), "the answer goes first");
        assert_eq!(outbox.pop(), Some((value(1000 - 96), 1)));
        assert_eq!(outbox.dropped_telemetry(), 1000 - 96);
    }

    #[test]
    fn announcements_leave_places_for_answers() {
        let mut outbox = Outbox::default();
        for ms in 0..10_000 {
            outbox.announce(value(ms));
        }
        assert_eq!(outbox.room(), ANSWERS_RESERVED);
        assert_eq!(
            outbox.dropped_announcements(),
            10_000 - (ANSWERS_MAX - ANSWERS_RESERVED) as u64
        );
        for ms in 0..ANSWERS_RESERVED {
            outbox.answer(value(u32::try_from(ms).unwrap()));
        }
        assert_eq!((outbox.room(), outbox.dropped_answers()), (0, 0));
    }

    #[test]
    fn both_queues_are_bounded() {
        let mut outbox = Outbox::default();
        for ms in 0..10_000 {
            outbox.answer(value(ms));
            outbox.stream(value(ms));
        }
        assert_eq!(std::iter::from_fn(|| outbox.pop()).count(), ANSWERS_MAX + TELEMETRY_MAX);
        assert_eq!(outbox.dropped_answers(), 10_000 - ANSWERS_MAX as u64);
    }
}
