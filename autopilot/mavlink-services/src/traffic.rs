//! Received and sent frames, for the record of all traffic.

use std::collections::VecDeque;

use ::mavlink::MessageData;
use ::mavlink::dialects::common::{LOG_DATA_DATA, SETUP_SIGNING_DATA};

use super::codec::{Encoded, Frame, Identity};
use super::queues::Sequences;

/// Frames that may wait to be taken: more than one datagram can have.
const FRAMES_MAX: usize = 512;

/// Frames that were received or sent and not taken yet.
///
/// A message to several peers is recorded once. Each link has its own sequence numbers, from which no reader could count
/// losses in their mixture, so a sent frame has the number of the record, and no signature.
#[derive(Debug, Default)]
pub struct Traffic {
    is_recording: bool,
    frames: VecDeque<Vec<u8>>,
    sequences: Sequences,
    dropped: u64,
}

impl Traffic {
    /// Keeps frames from now on, until they are taken.
    pub fn record_from_now(&mut self) {
        self.is_recording = true;
    }

    /// Records a good frame, except a signing key and pieces of a flight log.
    pub(super) fn record_received(&mut self, frame: &Frame<'_>) {
        if frame.id != SETUP_SIGNING_DATA::ID && frame.id != LOG_DATA_DATA::ID {
            self.record(|_| frame.bytes.to_vec());
        }
    }

    /// Records a message of `sender` that is sent now, unless it has been recorded for another peer. Pieces of a flight
    /// log (LOG_DATA) are left out, or each download would write the log once more.
    pub(super) fn record_sent(&mut self, message: &Encoded, sender: Identity) {
        // A copy for another peer may have been recorded already.
        if self.is_recording && message.id != LOG_DATA_DATA::ID && message.record_once() {
            self.record(|sequences| message.frame(sender, sequences.take(message)));
        }
    }

    fn record(&mut self, frame: impl FnOnce(&mut Sequences) -> Vec<u8>) {
        if !self.is_recording {
            return;
        }
        if self.frames.len() >= FRAMES_MAX {
            self.dropped += 1;
            return;
        }
        self.frames.push_back(frame(&mut self.sequences));
    }

    pub fn pop(&mut self) -> Option<Vec<u8>> {
        self.frames.pop_front()
    }

    /// Frames dropped for lack of room, since the last call.
    pub fn take_dropped(&mut self) -> u64 {
        core::mem::take(&mut self.dropped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::OWN;
    use ::mavlink::dialects::common::{HEARTBEAT_DATA, LOG_ENTRY_DATA};

    #[test]
    fn frames_are_kept_as_they_came_and_keys_are_not() {
        let mut traffic = Traffic::default();
        let frame = |id, bytes| Frame { sender: OWN, id, payload: &[], bytes };
        traffic.record_received(&frame(0, b"early"));
        traffic.record_from_now();
        traffic.record_received(&frame(256, b"secret"));
        traffic.record_received(&frame(120, b"bulk"));
        traffic.record_received(&frame(0, b"taken"));
        assert_eq!(traffic.pop(), Some(b"taken".to_vec()));
        assert_eq!(traffic.pop(), None);
        for _ in 0..FRAMES_MAX + 3 {
            traffic.record_received(&frame(0, b"x"));
        }
        assert_eq!((traffic.take_dropped(), traffic.take_dropped()), (3, 0));
    }

    #[test]
    fn copies_are_recorded_once_pieces_of_a_log_never_and_the_numbers_have_no_gap() {
        let mut traffic = Traffic::default();
        let heartbeat = Encoded::new(&HEARTBEAT_DATA::DEFAULT).for_many();
        traffic.record_sent(&heartbeat, OWN);
        traffic.record_from_now();
        let entry = Encoded::new(&LOG_ENTRY_DATA::DEFAULT);
        for _ in 0..2 {
            traffic.record_sent(&heartbeat.clone(), OWN);
            traffic.record_sent(&Encoded::new(&LOG_DATA_DATA::DEFAULT), OWN);
            traffic.record_sent(&entry.clone(), OWN);
        }
        let recorded: Vec<_> = std::iter::from_fn(|| traffic.pop()).collect();
        assert_eq!(recorded, [heartbeat.frame(OWN, 0), entry.frame(OWN, 1), entry.frame(OWN, 2)]);
    }
}
