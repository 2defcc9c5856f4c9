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
//!
//! Reading rejects everything damaged, foreign or not finite.

use arrayvec::ArrayVec;

use crate::effector_list::{Actuators, EffectorList, Name};
use crate::fault::{PlantReport, PlantRequest};
use crate::sensors::{SensorKind, Sensors, Stamp};
use crate::time::{ControlPeriod, SimTime};

mod fields;

use fields::{Field, Reader, Writer};

/// First four bytes of every packet.
pub const MAGIC: [u8; 4] = *b"2STP";

/// Version of the packets below; peers of different versions refuse each other.
pub const VERSION: u16 = 10;

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
        // At most 16.
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
    /// Of so many bytes: too short, or too long for its kind.
    Length(usize),
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
            Self::Length(bytes) => write!(f, "a packet cannot have {bytes} bytes"),
            Self::Magic => f.write_str("not a packet of the plant link"),
            Self::Version { theirs, .. } => write!(
                f,
                "the peer speaks version {theirs} of the plant link, this is version {VERSION}"
            ),
            Self::Crc => f.write_str("checksum is wrong"),
            Self::Code { field, value } => write!(f, "{field} code {value} is not defined"),
            Self::Value { field, value, .. } => {
                write!(f, "{field} is {value}; it must be finite and in the range of the field")
            }
        }
    }
}

impl core::error::Error for WireError {}

const KIND_SENSORS: u8 = 1;
const KIND_ACTUATORS: u8 = 2;
const KIND_REFUSAL: u8 = 3;

/// Phases of a flight by their codes.
const PHASES: [Phase; 3] = [Phase::Flying, Phase::Holding, Phase::OnGround];

/// Reasons of a refusal by their codes, from 1.
const REASONS: [RefusalReason; 4] =
    [RefusalReason::Version, RefusalReason::Busy, RefusalReason::Value, RefusalReason::Aircraft];

/// Header and checksum, without a body.
const FRAME_BYTES: usize = 32 + 4;

/// Largest deviation of the attitude quaternion's squared length from one.
const QUATERNION_TOLERANCE: f64 = 1.0e-6;

/// Writes a sensor packet into `out`, which is cleared first.
///
/// An `envelope` longer than [`ENVELOPE_MAX`] is left out.
// Few sensors with few numbers, at most REPORTS_MAX and ENVELOPE_MAX.
pub fn encode_sensors(packet: &SensorPacket, envelope: &[u8], out: &mut PacketBytes) {
    let phase = packet.phase as u8;
    let mut w = header(out, KIND_SENSORS, phase, packet.session, packet.sequence, packet.time);
    packet.aircraft.write(&mut w);
    w.u32(packet.period.as_micros());
    let sensors = &packet.sensors;
    let (stamps, values) = (sensors.stamps(), sensors.to_array());
    w.u8(sensors.present().count() as u8);
    for sensor in sensors.present() {
        let Stamp { time, valid } = stamps[sensor as usize];
        w.u8(sensor as u8);
        w.u8(sensor.signals().len() as u8);
        w.u8(valid.into());
        time.write(&mut w);
        for value in &values[sensor.places()] {
            w.f64(*value);
        }
    }
    w.u8(packet.reports.len() as u8);
    for report in &packet.reports {
        report.write(&mut w);
    }
    let envelope = if envelope.len() <= ENVELOPE_MAX { envelope } else { &[] };
    w.bytes(envelope);
    w.u16(envelope.len() as u16);
    w.finish();
}

/// Writes an actuator packet into `out`, which is cleared first.
pub fn encode_actuators(packet: &ActuatorPacket, out: &mut PacketBytes) {
    let mut w = header(out, KIND_ACTUATORS, 0, packet.session, packet.sequence, packet.time);
    packet.aircraft.write(&mut w);
    packet.actuators.commands.write(&mut w);
    w.f64(packet.actuators.brakes);
    packet.request.write(&mut w);
    w.u8(packet.wants_envelope.into());
    w.finish();
}

/// Writes a refusal into `out`, which is cleared first.
pub fn encode_refusal(packet: &RefusalPacket, out: &mut PacketBytes) {
    let reason = packet.reason as u8;
    let mut w = header(out, KIND_REFUSAL, reason, packet.session, packet.sequence, SimTime::ZERO);
    w.u16(packet.version);
    w.finish();
}

fn header(
    out: &mut PacketBytes,
    kind: u8,
    detail: u8,
    session: u64,
    sequence: u64,
    time: SimTime,
) -> Writer<'_> {
    out.clear();
    let mut w = Writer { out, effectors: 0 };
    w.bytes(&MAGIC);
    w.u16(VERSION);
    w.u8(kind);
    w.u8(detail);
    w.u64(session);
    w.u64(sequence);
    time.write(&mut w);
    w
}

/// Reads one datagram.
pub fn decode(datagram: &[u8]) -> Result<Packet, WireError> {
    let total = datagram.len();
    if !(FRAME_BYTES..=PACKET_MAX).contains(&total) {
        return Err(WireError::Length(total));
    }
    let mut r = Reader { left: datagram, total, session: 0, sequence: 0, effectors: 0 };
    if r.u32()?.to_le_bytes() != MAGIC {
        return Err(WireError::Magic);
    }
    let version = r.u16()?;
    let kind = r.u8()?;
    let detail = r.u8()?;
    let session = r.u64()?;
    let sequence = r.u64()?;
    // Before the checksum, which another version may compute in another way.
    // Refusals are the same in all versions.
    if version != VERSION && kind != KIND_REFUSAL {
        return Err(WireError::Version { theirs: version, session, sequence });
    }
    let (body, crc) = datagram.split_at(total - 4);
    if crc32fast::hash(body).to_le_bytes() != *crc {
        return Err(WireError::Crc);
    }
    // Behind session and number, which are read already.
    r = Reader { left: &body[24..], session, sequence, ..r };
    let time = Field::read(&mut r, "time")?;
    let packet = match kind {
        KIND_SENSORS => Packet::Sensors(sensor_packet(&mut r, detail, time)?),
        KIND_ACTUATORS => Packet::Actuators(actuator_packet(&mut r, time)?),
        KIND_REFUSAL => {
            let reason = usize::from(detail).checked_sub(1).and_then(|index| REASONS.get(index));
            let wrong = WireError::Code { field: "refusal reason", value: detail };
            let reason = *reason.ok_or(wrong)?;
            Packet::Refusal(RefusalPacket { version: r.u16()?, session, sequence, reason })
        }
        value => return Err(WireError::Code { field: "packet kind", value }),
    };
    if r.left.is_empty() { Ok(packet) } else { Err(r.length()) }
}

fn sensor_packet(r: &mut Reader<'_>, phase: u8, time: SimTime) -> Result<SensorPacket, WireError> {
    let wrong = WireError::Code { field: "phase", value: phase };
    let phase = *PHASES.get(usize::from(phase)).ok_or(wrong)?;
    let aircraft = Aircraft::read(r, "aircraft")?;
    let micros = r.u32()?;
    let period = ControlPeriod::from_micros(micros)
        .map_err(|_| r.value("control_period_us", f64::from(micros)))?;
    let sensors = read_sensors(r, time)?;
    // Nobody normalises it again, since that would change its bits, so it has to be a unit here.
    let square = sensors.attitude.value.wxyz().iter().map(|v| v * v).sum::<f64>();
    if (square - 1.0).abs() > QUATERNION_TOLERANCE {
        return Err(r.value("attitude (squared length)", square));
    }
    let mut reports = Reports::new();
    for _ in 0..r.u8()? {
        let report = PlantReport::read(r, "report")?;
        // An autopilot that joins later must not take the start for the present state.
        if matches!(report, PlantReport::Started { .. }) && r.sequence != 0 {
            return Err(WireError::Code { field: "report", value: 4 });
        }
        reports.try_push(report).map_err(|_| r.length())?;
    }
    // The envelope at the end is for the recorder.
    let (envelope, length) = r.left.split_last_chunk::<2>().ok_or(r.length())?;
    if envelope.len() != usize::from(u16::from_le_bytes(*length)) || envelope.len() > ENVELOPE_MAX {
        return Err(r.length());
    }
    r.left = &[];
    let Reader { session, sequence, .. } = *r;
    Ok(SensorPacket { session, sequence, aircraft, time, phase, period, sensors, reports })
}

/// The samples of a packet; none may be in the future.
fn read_sensors(r: &mut Reader<'_>, now: SimTime) -> Result<Sensors, WireError> {
    let mut fitted = [false; Sensors::SENSORS];
    let mut stamps = [Stamp { time: SimTime::ZERO, valid: false }; Sensors::SENSORS];
    let mut values = [0.0; Sensors::COUNT];
    let mut last = None;
    for _ in 0..r.u8()? {
        let number = r.u8()?;
        // Ascending, so that no sensor comes twice; `None` is less than every number.
        if last.replace(number) >= Some(number) {
            return Err(WireError::Code { field: "number of a sensor", value: number });
        }
        let count = r.u8()?;
        let index = usize::from(number);
        let Some(sensor) = SensorKind::ALL.get(index) else {
            // Of a later version: validity, time and numbers.
            r.bytes(1 + 8 + 8 * usize::from(count))?;
            continue;
        };
        if usize::from(count) != sensor.signals().len() {
            return Err(WireError::Code { field: "count of a sensor's numbers", value: count });
        }
        let valid = r.flag(Sensors::VALID[index])?;
        let time = SimTime::read(r, "time")?;
        if time > now {
            return Err(r.value(Sensors::TIMES[index], time.as_seconds() * 1.0e6));
        }
        r.finite_f64s(&mut values[sensor.places()], |place| sensor.signals()[place])?;
        (fitted[index], stamps[index]) = (true, Stamp { time, valid });
    }
    let mut sensors = Sensors::new(&stamps, &values);
    sensors.keep(&fitted);
    Ok(sensors)
}

fn actuator_packet(r: &mut Reader<'_>, time: SimTime) -> Result<ActuatorPacket, WireError> {
    let aircraft = Aircraft::read(r, "aircraft")?;
    let commands = Field::read(r, "commands")?;
    let mut brakes = [0.0];
    r.finite_f64s(&mut brakes, |_| "brakes")?;
    let [brakes] = brakes;
    if !(0.0..=1.0).contains(&brakes) {
        return Err(r.value("brakes", brakes));
    }
    let actuators = Actuators { commands, brakes };
    let request = Field::read(r, "request flag")?;
    let wants_envelope = r.flag("envelope flag")?;
    let Reader { session, sequence, .. } = *r;
    Ok(ActuatorPacket { session, sequence, aircraft, time, actuators, request, wants_envelope })
}

/// The data of a sensor packet for the recorder, still encoded; empty if there are none. Only for a datagram
/// that [`decode`] has accepted as a sensor packet.
pub fn envelope(datagram: &[u8]) -> &[u8] {
    let length_at = datagram.len().saturating_sub(4 + 2);
    let length = match datagram.get(length_at..).and_then(|end| end.first_chunk::<2>()) {
        Some(bytes) => usize::from(u16::from_le_bytes(*bytes)),
        None => 0,
    };
    length_at.checked_sub(length).and_then(|from| datagram.get(from..length_at)).unwrap_or(&[])
}

#[cfg(test)]
mod tests;
