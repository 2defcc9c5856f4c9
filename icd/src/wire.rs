//! Packets of the plant link: bytes, little endian, one packet a datagram.
//!
//! ```text
//! offset  size  field
//!  0      4     magic "2STP"
//!  4      2     version
//!  6      1     kind: 1 sensors, 2 actuators, 3 refusal
//!  7      1     phase (sensors), reason (refusal), 0 (actuators)
//!  8      8     session: one flight; a new random number is a new flight
//! 16      8     sequence number inside the session, from 0
//! 24      8     simulation time, us
//! 32      ..    body, by kind
//! end-4   4     CRC-32 (IEEE) of all bytes before it
//! ```
//!
//! Magic, version, kind and the whole refusal packet keep their places in every version, so that two
//! versions can refuse each other. Times and sequence numbers are u64, values f64 as
//! computed. Reading a packet checks that every value is finite.
//!
//! The body begins with the aircraft: the length of its name, u8, and the name, the number of effectors, u8, and
//! the identity of their list, u32. A packet has one command or position for each effector.
//!
//! In a sensor packet the control period follows, us, u32, then the number of sensors, u8, and for each sensor that the aircraft has,
//! in ascending order: its number ([`SensorKind`]), u8, the count of its numbers, u8, its validity, u8, the time of its sample,
//! us, u64, and the numbers ([`SensorKind::signals`]). A reader skips a sensor that it does not know. No sample is newer than its
//! packet.
//!
//! A sensor packet ends with an envelope and its length, u16: the plant's data for the recorder of the flight
//! ([`crate::record`]). No other code reads it; it is not part of [`SensorPacket`].

use arrayvec::ArrayVec;

use crate::effector::Actuators;
use crate::effector_list::{EffectorList, Name};
use crate::fault::{PlantReport, PlantRequest};
use crate::sensors::{SensorKind, Sensors, Stamp};
use crate::time::{ControlPeriod, SimTime};

mod cursor;
mod fields;
mod packets;

pub use packets::{decode, encode_actuators, encode_refusal, encode_sensors, envelope};

/// First four bytes of every packet.
pub const MAGIC: [u8; 4] = *b"2STP";

/// Version of the packets below; peers of different versions refuse each other.
pub const VERSION: u16 = 9;

/// Largest packet, bytes.
pub const PACKET_MAX: usize = 1472;

/// Longest envelope, bytes: the data that a sensor packet carries for the recorder ([`crate::record`]).
pub const ENVELOPE_MAX: usize = 712;

/// Reports that one sensor packet can carry; more wait for the next one.
pub const REPORTS_MAX: usize = 3;

/// The aircraft of a packet, which must be the same on both sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Aircraft {
    /// Its name, as in its files.
    pub name: Name,
    /// Number of effectors, and so of commands in a packet.
    pub effectors: u8,
    /// Their number, order, names and kinds ([`EffectorList::identity`]).
    pub identity: u32,
}

impl Aircraft {
    /// The aircraft with this name and these effectors.
    pub fn new(name: Name, effectors: &EffectorList) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "at most 16")]
        let count = effectors.len() as u8;
        Self { name, effectors: count, identity: effectors.identity() }
    }
}

/// `tvc_jet (8 effectors, 12ab34cd)`.
impl core::fmt::Display for Aircraft {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { name, effectors, identity } = self;
        write!(f, "{name} ({effectors} effectors, {identity:08x})")
    }
}

/// An encoded packet.
pub type PacketBytes = ArrayVec<u8, PACKET_MAX>;

/// The reports of one sensor packet.
pub type Reports = ArrayVec<PlantReport, REPORTS_MAX>;

/// Whether simulation time is running.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// A control step: time has advanced by one period since the last one.
    Flying = 0,
    /// No control step: simulation time is paused (pause, or slow motion); answer with the last commands.
    Holding = 1,
    /// As [`Phase::Holding`], and the flight is over: the aircraft is on the ground.
    OnGround = 2,
}

/// From the plant: the sensor data of the aircraft at `time`.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorPacket {
    /// The flight.
    pub session: u64,
    /// Number of this exchange in the flight, from 0.
    pub sequence: u64,
    /// The aircraft with these sensors.
    pub aircraft: Aircraft,
    /// Simulation time of the exchange.
    pub time: SimTime,
    /// Whether this is a control step.
    pub phase: Phase,
    /// Control period of the flight, constant in a session.
    pub period: ControlPeriod,
    /// The latest sample of each sensor.
    pub sensors: Sensors,
    /// Events since the last packet.
    pub reports: Reports,
}

/// From the autopilot: the answer to the sensor packet with the same session and sequence number.
#[derive(Debug, Clone, PartialEq)]
pub struct ActuatorPacket {
    /// The flight.
    pub session: u64,
    /// Number of the exchange that this answers.
    pub sequence: u64,
    /// The aircraft that receives the commands: that of the sensor packet.
    pub aircraft: Aircraft,
    /// Simulation time of the sensor packet that this answers.
    pub time: SimTime,
    /// The commands, held until the next packet.
    pub actuators: Actuators,
    /// A request to the plant.
    pub request: Option<PlantRequest>,
    /// The flight is recorded: the next sensor packet shall carry an envelope.
    pub wants_envelope: bool,
}

/// From either side: the refusal of a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RefusalPacket {
    /// Version of the sender.
    pub version: u16,
    /// Session of the refused packet.
    pub session: u64,
    /// Sequence number of the refused packet.
    pub sequence: u64,
    /// Reason.
    pub reason: RefusalReason,
}

/// Why a packet was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RefusalReason {
    /// The packet has another version than the refusing side.
    Version = 1,
    /// The autopilot is flying another plant that is still alive.
    Busy = 2,
    /// A value in the packet is not finite or out of its range.
    Value = 3,
    /// The packet is about another aircraft than that of the refusing side's files.
    Aircraft = 4,
}

/// Any packet.
#[derive(Debug, Clone, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "short-lived and on the stack: the link may not allocate"
)]
pub enum Packet {
    /// Plant to autopilot.
    Sensors(SensorPacket),
    /// Autopilot to plant.
    Actuators(ActuatorPacket),
    /// Either way.
    Refusal(RefusalPacket),
}

/// Why a datagram is not a packet of this link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WireError {
    /// Too short, or too long for its kind.
    Length {
        /// Bytes received.
        bytes: usize,
    },
    /// Does not start with [`MAGIC`].
    Magic,
    /// The sender has another version.
    Version {
        /// The sender's.
        theirs: u16,
        /// Session of the packet.
        session: u64,
        /// Sequence number of the packet.
        sequence: u64,
    },
    /// Damaged in transit.
    Crc,
    /// A code that this version does not define.
    Code {
        /// The field with the code.
        field: &'static str,
        /// The code.
        value: u8,
    },
    /// A value that is not finite, or not valid.
    Value {
        /// Name of the value.
        field: &'static str,
        /// The value.
        value: f64,
        /// Session of the packet.
        session: u64,
        /// Sequence number of the packet.
        sequence: u64,
    },
}

impl core::fmt::Display for WireError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Length { bytes } => write!(f, "a packet cannot have {bytes} bytes"),
            Self::Magic => f.write_str("not a packet of the plant link"),
            Self::Version { theirs, .. } => write!(
                f,
                "the peer speaks version {theirs} of the plant link, this is version {VERSION}"
            ),
            Self::Crc => f.write_str("checksum is wrong"),
            Self::Code { field, value } => write!(f, "{field} code {value} is not defined"),
            Self::Value { field, value, .. } => write!(f, "{field} is {value}, which cannot be"),
        }
    }
}

impl core::error::Error for WireError {}

#[cfg(test)]
mod tests;
