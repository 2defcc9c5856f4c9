//! The bounded queues: messages waiting for one peer, bytes received from one connection, and the intents for the control
//! thread.

use std::collections::{BTreeMap, VecDeque};

use icd::fault::{FaultRequest, PlantAction, Target};

use crate::codec::Encoded;
use flight_management::command::{Command, FIRST_SCRIPT_REQUEST, Intent};

/// Answers that may wait: more than the frames of one datagram can request, a burst of the parameter list
/// and the texts of a moment.
pub const ANSWERS_MAX: usize = 256;
/// Places reserved for answers to input already read. While a peer has fewer, nothing more is read from it.
/// Twice the commands that may wait for their outcome, and far more than one message requests.
pub const ANSWERS_RESERVED: usize = 64;
/// Telemetry that may wait: about a quarter of a second of it.
const TELEMETRY_MAX: usize = 96;

/// Bulk data that may wait.
pub const BULK_MAX: usize = 48;

/// Three bounded queues and the sequence numbers of the link.
#[derive(Debug, Default)]
pub struct Outbox {
    answers: VecDeque<Encoded>,
    telemetry: VecDeque<Encoded>,
    bulk: VecDeque<Encoded>,
    /// It is the turn of bulk data.
    bulk_next: bool,
    sequences: Sequences,
    /// Telemetry messages dropped so far.
    pub dropped_telemetry: u64,
    /// Heartbeats, texts and changed parameters dropped so far.
    pub dropped_announcements: u64,
    pub dropped_answers: u64,
}

impl Outbox {
    /// Queues a message that goes to every peer. Dropped and counted if only the places reserved for answers are left.
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

    /// Queues bulk data, for which there must be room; the caller must not queue more.
    pub fn bulk(&mut self, message: Encoded) {
        if self.bulk_room() > 0 {
            self.bulk.push_back(message);
        }
    }

    /// Bulk data that still fit.
    pub fn bulk_room(&self) -> usize {
        BULK_MAX - self.bulk.len()
    }

    /// Answers that still fit.
    pub fn room(&self) -> usize {
        ANSWERS_MAX - self.answers.len()
    }

    /// Whether an answer waits.
    pub fn has_answer(&self) -> bool {
        !self.answers.is_empty()
    }

    /// Whether any message waits.
    pub fn has_any(&self) -> bool {
        self.has_answer() || !self.telemetry.is_empty() || !self.bulk.is_empty()
    }

    /// Next message to send and its sequence number, answers first. The number counts what is sent, so
    /// that a ground station sees no loss where telemetry was dropped.
    pub fn pop(&mut self) -> Option<(Encoded, u8)> {
        let message = self.answers.pop_front().or_else(|| self.pop_stream())?;
        let sequence = self.sequences.take(&message);
        Some((message, sequence))
    }

    /// Telemetry and bulk data by turns.
    fn pop_stream(&mut self) -> Option<Encoded> {
        // Also if one is empty: the turn does not matter then.
        self.bulk_next = !self.bulk_next;
        let [first, second] = match self.bulk_next {
            true => [&mut self.telemetry, &mut self.bulk],
            false => [&mut self.bulk, &mut self.telemetry],
        };
        first.pop_front().or_else(|| second.pop_front())
    }
}

/// The next sequence number of each component that sends, since receivers count losses by component.
#[derive(Debug, Default)]
pub struct Sequences(BTreeMap<Option<u8>, u8>);

impl Sequences {
    /// The number of this message.
    pub fn take(&mut self, message: &Encoded) -> u8 {
        let next = self.0.entry(message.component).or_default();
        core::mem::replace(next, next.wrapping_add(1))
    }
}

/// Bytes that may wait: one read, and the beginning of a frame in front of it.
const INBOX_MAX: usize = 4096;

/// The bytes of one connection, in order.
#[derive(Debug, Default)]
pub struct Inbox {
    bytes: Vec<u8>,
    /// Frames wait for room.
    pub held: bool,
}

impl Inbox {
    /// Appends received bytes. Returns the number of bytes without room: none if the caller does not read while the
    /// inbox is held.
    pub fn receive(&mut self, bytes: &[u8]) -> usize {
        let fitting = bytes.len().min(INBOX_MAX.saturating_sub(self.bytes.len()));
        self.bytes.extend(bytes.iter().take(fitting));
        bytes.len() - fitting
    }

    pub fn take(&mut self) -> Vec<u8> {
        core::mem::take(&mut self.bytes)
    }

    /// Puts back `bytes` without the first `used`. `held` if frames among them wait for room.
    pub fn put_back(&mut self, mut bytes: Vec<u8>, used: usize, held: bool) {
        bytes.drain(..used.min(bytes.len()));
        self.bytes = bytes;
        self.held = held;
    }
}

/// Intents that may wait for room in the channel.
const INTENTS_MAX: usize = 64;

/// A command to the aircraft without an outcome yet.
#[derive(Debug, Clone, Copy)]
pub struct OpenCommand {
    /// Number of the intent.
    pub number: u32,
    /// The fault that it injects or clears.
    pub fault: Option<FaultRequest>,
}

impl OpenCommand {
    /// The target of its fault.
    pub fn target(&self) -> Option<Target> {
        self.fault.and_then(|fault| fault.target())
    }
}

/// The queue of intents.
#[derive(Debug, Default)]
pub struct Intents {
    queue: VecDeque<Intent>,
    last_number: u32,
}

impl Intents {
    /// Intents that still fit.
    pub fn room(&self) -> usize {
        INTENTS_MAX - self.queue.len()
    }

    /// Queues a command and returns its number; `None` if the queue is full.
    pub fn push(&mut self, command: impl Into<Command>) -> Option<u32> {
        if self.room() == 0 {
            return None;
        }
        // Below the numbers that scripts use.
        self.last_number = (self.last_number + 1) % FIRST_SCRIPT_REQUEST;
        self.queue.push_back(Intent { number: self.last_number, command: command.into() });
        Some(self.last_number)
    }

    /// The same for a command whose outcome is waited for.
    pub fn open(&mut self, command: Command) -> Option<OpenCommand> {
        let fault = match &command {
            Command::Plant(PlantAction::Fault(request)) => Some(*request),
            _ => None,
        };
        self.push(command).map(|number| OpenCommand { number, fault })
    }

    /// Next intent for the control thread.
    pub fn pop(&mut self) -> Option<Intent> {
        self.queue.pop_front()
    }

    pub fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codec::OWN;
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
        assert_eq!(outbox.dropped_telemetry, 1000 - 96);
    }

    #[test]
    fn announcements_leave_places_for_answers() {
        let mut outbox = Outbox::default();
        for ms in 0..10_000 {
            outbox.announce(value(ms));
        }
        assert_eq!(outbox.room(), ANSWERS_RESERVED);
        assert_eq!(outbox.dropped_announcements, 10_000 - (ANSWERS_MAX - ANSWERS_RESERVED) as u64);
        for ms in 0..ANSWERS_RESERVED {
            outbox.answer(value(u32::try_from(ms).unwrap()));
        }
        assert_eq!((outbox.room(), outbox.dropped_answers), (0, 0));
    }

    #[test]
    fn bulk_data_goes_behind_answers_and_takes_turns_with_telemetry() {
        let mut outbox = Outbox::default();
        for ms in 0..100 {
            outbox.bulk(value(1000 + ms));
            outbox.stream(value(ms));
        }
        assert_eq!(outbox.bulk_room(), 0);
        let ack = Encoded::command_ack(420, MavResult::MAV_RESULT_ACCEPTED, OWN);
        outbox.answer(ack.clone());
        let oldest = 100 - u32::try_from(TELEMETRY_MAX).unwrap();
        let first = [(ack, 0), (value(oldest), 1), (value(1000), 2), (value(oldest + 1), 3)];
        assert_eq!([(); 4].map(|()| outbox.pop().unwrap()), first);
        let rest = std::iter::from_fn(|| outbox.pop()).count();
        assert_eq!(rest, TELEMETRY_MAX + BULK_MAX - 3);
    }

    #[test]
    fn both_queues_are_bounded() {
        let mut outbox = Outbox::default();
        for ms in 0..10_000 {
            outbox.answer(value(ms));
            outbox.stream(value(ms));
        }
        assert_eq!(std::iter::from_fn(|| outbox.pop()).count(), ANSWERS_MAX + TELEMETRY_MAX);
        assert_eq!(outbox.dropped_answers, 10_000 - ANSWERS_MAX as u64);
    }
}
