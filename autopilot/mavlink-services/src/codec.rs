//! Frames and payloads: bytes of a datagram to messages, messages to bytes.
//!
//! The project's own frame splitter: the crate's reader loses good frames behind a truncated one and does not count
//! what it skips. Fields that are enums in the definitions are read as integers, so that a value newer than the
//! definitions does not make the message disappear: an unknown command still gets its answer.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use ::mavlink::dialects::common::{COMMAND_ACK_DATA, MavMessage, MavResult};
use ::mavlink::{MAV_STX, MAV_STX_V2, MavlinkVersion, Message as _, MessageData, calculate_crc};

mod message;

pub use message::{
    CommandMessage, ItemWords, ListKind, LogRequest, ManualControl, Message, MissionItem, ParamSet,
    PositionTarget, SerialControl, SetMode, SetupSigning, StreamRequest, decode,
};

/// System and component id of an autopilot whose MAV_SYS_ID was not set.
pub const OWN: Identity = Identity { system: 1, component: 1 };

/// Longest payload of a frame.
const PAYLOAD_MAX: usize = 255;
/// Longest frame without its signature.
pub const FRAME_MAX: usize = HEADER_V2 + PAYLOAD_MAX + CRC;
const HEADER_V1: usize = 6;
const HEADER_V2: usize = 10;
const CRC: usize = 2;
/// Signature trailer of a signed frame.
pub const SIGNATURE: usize = 13;
const PROGRESS_UNKNOWN: u8 = u8::MAX;
/// The one incompatibility flag that the codec understands. [`super::signing`] handles the signature itself.
const SIGNED: u8 = 0x01;

/// Sender or target of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Identity {
    /// System id; 0 as a target means all.
    pub system: u8,
    /// Component id; 0 as a target means all.
    pub component: u8,
}

impl Identity {
    /// The autopilot of the vehicle with this system id.
    pub const fn autopilot(system: u8) -> Self {
        Self { system, component: OWN.component }
    }

    /// A message with this target is for `own`.
    pub fn reaches(self, own: Self) -> bool {
        [0, own.system].contains(&self.system) && [0, own.component].contains(&self.component)
    }
}

/// Why a command is refused: the result for the acknowledgement and the reason for the operator.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandError {
    pub result: MavResult,
    /// For STATUSTEXT; `None` where the result is enough.
    pub reason: Option<String>,
}

impl CommandError {
    /// The service will never accept the same request.
    pub fn denied(reason: impl Into<String>) -> Self {
        Self { result: MavResult::MAV_RESULT_DENIED, reason: Some(reason.into()) }
    }

    /// The service may accept the same request later.
    pub fn temporary(reason: impl Into<String>) -> Self {
        let result = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;
        Self { result, reason: Some(reason.into()) }
    }

    /// The autopilot does not have this.
    pub fn unsupported(reason: impl Into<String>) -> Self {
        Self { result: MavResult::MAV_RESULT_UNSUPPORTED, reason: Some(reason.into()) }
    }

    /// FAILED, where the protocol requires it.
    pub fn failed(reason: impl Into<String>) -> Self {
        Self { result: MavResult::MAV_RESULT_FAILED, reason: Some(reason.into()) }
    }

    /// A result that needs no text.
    pub fn without_text(result: MavResult) -> Self {
        Self { result, reason: None }
    }
}

/// The character as a byte of a text for other stations: printable ASCII, or `?`. One byte for each, so that no character is
/// cut in two, and no control character of one station reaches another.
pub fn printable(c: char) -> u8 {
    u8::try_from(c).ok().filter(|byte| (b' '..=b'~').contains(byte)).unwrap_or(b'?')
}

/// Skipped input, since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Skipped {
    /// Bytes that do not begin a frame, including those after the marker of an abandoned frame.
    pub noise_bytes: u64,
    /// Frames cut off by the end of the datagram.
    pub truncated: u64,
    /// Frames with a wrong checksum.
    pub bad_crc: u64,
    /// Frames with an unknown incompatibility flag.
    pub unknown_flags: u64,
    /// Frames with a message id that no definition has.
    pub unknown_id: u64,
    /// Good frames of a datagram that were not handled, because there was no room for answers.
    pub unanswerable: u64,
    /// Bytes received on a connection without room to store them.
    pub overflow_bytes: u64,
}

/// One frame whose checksum is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame<'a> {
    pub sender: Identity,
    pub id: u32,
    /// Payload as received; trailing zeros may be missing.
    pub payload: &'a [u8],
    /// The whole frame as received, from its marker to its checksum or signature.
    pub bytes: &'a [u8],
}

impl<'a> Frame<'a> {
    /// MAVLink 1.
    pub fn is_version_1(&self) -> bool {
        self.bytes.first() == Some(&MAV_STX)
    }

    /// The signed bytes and the signature; `None` if the frame has none.
    pub fn signature(&self) -> Option<(&'a [u8], [u8; SIGNATURE])> {
        let is_signed = !self.is_version_1() && self.bytes.get(2)? & SIGNED != 0;
        let (signed, signature) = self.bytes.split_last_chunk()?;
        is_signed.then_some((signed, *signature))
    }
}

/// Takes the next good frame out of `rest`; `None` at the end of the datagram.
pub fn next_frame<'a>(rest: &mut &'a [u8], skipped: &mut Skipped) -> Option<Frame<'a>> {
    loop {
        match cut(rest, skipped) {
            Cut::Frame(frame) => return Some(frame),
            Cut::Nothing => return None,
            Cut::Beginning => {
                // No more bytes will arrive, so skip only the marker: a good frame may begin right
                // behind it.
                skipped.truncated += 1;
                *rest = &rest[1..];
            }
        }
    }
}

/// Takes the next good frame out of `rest`, which will grow; `None` leaves there what may be the
/// beginning of a frame, at most [`FRAME_MAX`] and a signature.
pub fn next_frame_of_stream<'a>(rest: &mut &'a [u8], skipped: &mut Skipped) -> Option<Frame<'a>> {
    match cut(rest, skipped) {
        Cut::Frame(frame) => Some(frame),
        Cut::Nothing | Cut::Beginning => None,
    }
}

/// The beginning of the input, after skipping everything that cannot be a frame.
enum Cut<'a> {
    Frame(Frame<'a>),
    /// A marker, and bytes that may become a frame once more arrive.
    Beginning,
    Nothing,
}

/// Each decision looks only at bytes that are there in any case, so it does not matter where a stream was
/// cut. Of an invalid frame only the marker is skipped: its length field cannot be trusted.
fn cut<'a>(rest: &mut &'a [u8], skipped: &mut Skipped) -> Cut<'a> {
    while let Some(&first) = rest.first() {
        let layout = match first {
            MAV_STX_V2 => FrameLayout::v2(rest),
            MAV_STX => FrameLayout::v1(rest),
            _ => {
                skipped.noise_bytes += 1;
                *rest = &rest[1..];
                continue;
            }
        };
        let Some(layout) = layout else { return Cut::Beginning };
        let wrong = if layout.unknown_flags {
            &mut skipped.unknown_flags
        } else if !MavMessage::all_ids().contains(&layout.id) {
            &mut skipped.unknown_id
        } else {
            let Some(frame) = rest.get(..layout.length) else { return Cut::Beginning };
            let end = layout.payload_at + layout.payload_length;
            // The checksum covers neither the marker nor the signature.
            let crc = calculate_crc(&frame[1..end], MavMessage::extra_crc(layout.id));
            if frame[end..end + CRC] == crc.to_le_bytes() {
                *rest = &rest[layout.length..];
                let payload = &frame[layout.payload_at..end];
                let FrameLayout { sender, id, .. } = layout;
                return Cut::Frame(Frame { sender, id, payload, bytes: frame });
            }
            &mut skipped.bad_crc
        };
        *wrong += 1;
        *rest = &rest[1..];
    }
    Cut::Nothing
}

/// Positions of the parts of a frame.
struct FrameLayout {
    sender: Identity,
    id: u32,
    payload_at: usize,
    payload_length: usize,
    length: usize,
    unknown_flags: bool,
}

impl FrameLayout {
    fn v1(bytes: &[u8]) -> Option<Self> {
        let &[_, length, _, system, component, id] = bytes.first_chunk::<HEADER_V1>()?;
        let payload_length = usize::from(length);
        Some(Self {
            sender: Identity { system, component },
            id: u32::from(id),
            payload_at: HEADER_V1,
            payload_length,
            length: HEADER_V1 + payload_length + CRC,
            unknown_flags: false,
        })
    }

    fn v2(bytes: &[u8]) -> Option<Self> {
        let &[_, length, flags, _, _, system, component, id0, id1, id2] =
            bytes.first_chunk::<HEADER_V2>()?;
        let payload_length = usize::from(length);
        let signature = if flags & SIGNED == 0 { 0 } else { SIGNATURE };
        Some(Self {
            sender: Identity { system, component },
            id: u32::from_le_bytes([id0, id1, id2, 0]),
            payload_at: HEADER_V2,
            payload_length,
            length: HEADER_V2 + payload_length + CRC + signature,
            unknown_flags: flags & !SIGNED != 0,
        })
    }
}

/// A message ready to be sent, except for the sequence number of its link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Encoded {
    pub(super) id: u32,
    extra_crc: u8,
    payload: Vec<u8>,
    /// The sending component, if it is not the autopilot.
    pub component: Option<u8>,
    copies: Copies,
}

/// Shared by the copies of a message to several peers: whether one of them has been recorded.
#[derive(Debug, Clone, Default)]
struct Copies(Option<Arc<AtomicBool>>);

/// A message equals its copies.
impl PartialEq for Copies {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Eq for Copies {}

impl Encoded {
    /// Any message but COMMAND_ACK.
    pub fn new<D: MessageData>(data: &D) -> Self {
        let mut payload = vec![0; PAYLOAD_MAX];
        let length = data.ser(MavlinkVersion::V2, &mut payload);
        payload.truncate(length);
        Self::of::<D>(payload)
    }

    fn of<D: MessageData>(payload: Vec<u8>) -> Self {
        let copies = Copies::default();
        Self { id: D::ID, extra_crc: D::EXTRA_CRC, payload, component: None, copies }
    }

    /// COMMAND_ACK, also for a command that the definitions do not have.
    pub fn command_ack(command: u16, result: MavResult, to: Identity) -> Self {
        let mut payload = command.to_le_bytes().to_vec();
        // The progress of a command in execution is not known, and there is no second result.
        let is_open = result == MavResult::MAV_RESULT_IN_PROGRESS;
        let progress = if is_open { PROGRESS_UNKNOWN } else { 0 };
        payload.extend([result as u8, progress, 0, 0, 0, 0, to.system, to.component]);
        Self::by_hand::<COMMAND_ACK_DATA>(payload)
    }

    /// A message whose payload was assembled byte by byte, since it may carry numbers that the definitions do not
    /// have. Zeros at its end are cut off, as the protocol requires.
    pub fn by_hand<D: MessageData>(mut payload: Vec<u8>) -> Self {
        // The protocol keeps the first byte, even if it is zero.
        while payload.len() > 1 && payload.last() == Some(&0) {
            payload.pop();
        }
        Self::of::<D>(payload)
    }

    /// The same message, of which each peer gets a copy by `clone`.
    pub fn for_many(&self) -> Self {
        Self { copies: Copies(Some(Arc::default())), ..self.clone() }
    }

    /// Whether no copy has been recorded before; this one is from now on.
    pub(super) fn record_once(&self) -> bool {
        // Relaxed, because the flag guards no other data.
        self.copies.0.as_ref().is_none_or(|recorded| !recorded.swap(true, Ordering::Relaxed))
    }

    /// The same message from another component of the vehicle.
    #[must_use]
    pub fn from_component(mut self, component: u8) -> Self {
        self.component = Some(component);
        self
    }

    /// The frame of this sender with this sequence number: MAVLink 2, not signed.
    pub fn frame(&self, sender: Identity, sequence: u8) -> Vec<u8> {
        self.frame_with(0, sender, sequence)
    }

    /// The same frame, followed by what `sign` makes of it.
    pub fn signed_frame(
        &self,
        sender: Identity,
        sequence: u8,
        sign: impl FnOnce(&[u8]) -> [u8; SIGNATURE],
    ) -> Vec<u8> {
        let mut frame = self.frame_with(SIGNED, sender, sequence);
        frame.extend(sign(&frame));
        frame
    }

    fn frame_with(&self, flags: u8, sender: Identity, sequence: u8) -> Vec<u8> {
        let mut frame = Vec::with_capacity(HEADER_V2 + self.payload.len() + CRC + SIGNATURE);
        let length = u8::try_from(self.payload.len()).expect("a payload has at most 255 bytes");
        let [id0, id1, id2, _] = self.id.to_le_bytes();
        let Identity { system, component } = sender;
        let component = self.component.unwrap_or(component);
        frame.extend_from_slice(&[MAV_STX_V2, length, flags, 0, sequence, system, component]);
        frame.extend_from_slice(&[id0, id1, id2]);
        frame.extend_from_slice(&self.payload);
        let crc = calculate_crc(&frame[1..], self.extra_crc);
        frame.extend_from_slice(&crc.to_le_bytes());
        frame
    }
}

#[cfg(test)]
mod tests;
