//! Received frames, for the record of all traffic.

use std::collections::VecDeque;

use ::mavlink::MessageData;
use ::mavlink::dialects::common::{LOG_DATA_DATA, SETUP_SIGNING_DATA};

use super::codec::Frame;

/// Frames that may wait to be taken: more than one datagram can have.
const RECEIVED_MAX: usize = 512;

/// Frames that were received and not taken yet.
#[derive(Debug, Default)]
pub struct Traffic {
    is_recording: bool,
    received: VecDeque<Vec<u8>>,
    dropped: u64,
}

impl Traffic {
    /// Keeps received frames from now on, until they are taken.
    pub fn record_from_now(&mut self) {
        self.is_recording = true;
    }

    /// Records a good frame, except a signing key and what [`is_bulk`].
    pub(super) fn record(&mut self, frame: &Frame<'_>) {
        if !self.is_recording || frame.id == SETUP_SIGNING_DATA::ID || frame.id == LOG_DATA_DATA::ID
        {
            return;
        }
        if self.received.len() >= RECEIVED_MAX {
            self.dropped += 1;
            return;
        }
        self.received.push_back(frame.bytes.to_vec());
    }

    /// The next received frame.
    pub fn pop(&mut self) -> Option<Vec<u8>> {
        self.received.pop_front()
    }

    /// Frames dropped for lack of room, since the last call.
    pub fn take_dropped(&mut self) -> u64 {
        core::mem::take(&mut self.dropped)
    }
}

/// Whether a frame of MAVLink 2 is a piece of a flight log (LOG_DATA): recorders of traffic leave it out, or each
/// download would write the log once more.
#[must_use]
pub fn is_bulk(frame: &[u8]) -> bool {
    let id = LOG_DATA_DATA::ID.to_le_bytes();
    frame.first() == Some(&::mavlink::MAV_STX_V2) && frame.get(7..10) == Some(&id[..3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::OWN;

    #[test]
    fn frames_are_kept_as_they_came_and_keys_are_not() {
        let mut traffic = Traffic::default();
        let frame = |id, bytes| Frame { sender: OWN, id, payload: &[], bytes };
        traffic.record(&frame(0, b"early"));
        traffic.record_from_now();
        traffic.record(&frame(256, b"secret"));
        traffic.record(&frame(120, b"bulk"));
        traffic.record(&frame(0, b"taken"));
        assert_eq!(traffic.pop(), Some(b"taken".to_vec()));
        assert_eq!(traffic.pop(), None);
        for _ in 0..RECEIVED_MAX + 3 {
            traffic.record(&frame(0, b"x"));
        }
        assert_eq!((traffic.take_dropped(), traffic.take_dropped()), (3, 0));
    }

    #[test]
    fn pieces_of_a_log_are_bulk_and_nothing_else_is() {
        use crate::codec::Encoded;
        use ::mavlink::dialects::common::{HEARTBEAT_DATA, LOG_ENTRY_DATA};
        assert!(is_bulk(&Encoded::new(&LOG_DATA_DATA::DEFAULT).frame(OWN, 5)));
        assert!(!is_bulk(&Encoded::new(&LOG_ENTRY_DATA::DEFAULT).frame(OWN, 5)));
        assert!(!is_bulk(&Encoded::new(&HEARTBEAT_DATA::DEFAULT).frame(OWN, 5)));
        assert!(!is_bulk(&[]));
    }
}
