//! Bytes to packets. Nothing that is damaged, foreign or not finite gets through.

use super::cursor::Reader;
use super::encode::{KIND_ACTUATORS, KIND_REFUSAL, KIND_SENSORS};
use super::{
    ActuatorPacket, Actuators, Aircraft, ControlPeriod, ENVELOPE_MAX, Effector, MAGIC, Name,
    PACKET_MAX, Pace, Packet, PerEffector, Phase, PlantAction, PlantReport, PlantRequest,
    RefusalPacket, RefusalReason, Reports, SensorPacket, Sensors, SimTime, Stamp, VERSION,
    WireError, faults,
};

/// Header and checksum, without a body.
const FRAME_BYTES: usize = 32 + 4;

/// Largest deviation of the attitude quaternion's squared length from one.
const QUATERNION_TOLERANCE: f64 = 1.0e-6;

/// Reads one datagram.
///
/// # Errors
/// [`WireError`] says what is wrong. A packet of another version is recognised before anything else
/// but its magic, so that its sender can be told.
pub fn decode(datagram: &[u8]) -> Result<Packet, WireError> {
    let total = datagram.len();
    if !(FRAME_BYTES..=PACKET_MAX).contains(&total) {
        return Err(WireError::Length { bytes: total });
    }
    let mut r = Reader { left: datagram, total };
    if r.u32()?.to_le_bytes() != MAGIC {
        return Err(WireError::Magic);
    }
    let version = r.u16()?;
    let kind = r.u8()?;
    let detail = r.u8()?;
    let session = r.u64()?;
    let sequence = r.u64()?;
    // Refusals are the same in all versions.
    if version != VERSION && kind != KIND_REFUSAL {
        return Err(WireError::Version { theirs: version, session, sequence });
    }
    let (body, crc) = datagram.split_at(total - 4);
    if crc32fast::hash(body).to_le_bytes() != *crc {
        return Err(WireError::Crc);
    }
    r.left = &body[24..];
    let time = SimTime::from_micros(r.u64()?);
    let context = Context { session, sequence };
    let packet = match kind {
        KIND_SENSORS => {
            Packet::Sensors(sensor_packet(&mut r, detail, session, sequence, time, context)?)
        }
        KIND_ACTUATORS => {
            Packet::Actuators(actuator_packet(&mut r, session, sequence, time, context)?)
        }
        KIND_REFUSAL => {
            let reason = match detail {
                1 => RefusalReason::Version,
                2 => RefusalReason::Busy,
                3 => RefusalReason::Value,
                4 => RefusalReason::Aircraft,
                value => return Err(WireError::Code { field: "refusal reason", value }),
            };
            Packet::Refusal(RefusalPacket { version: r.u16()?, session, sequence, reason })
        }
        value => return Err(WireError::Code { field: "packet kind", value }),
    };
    if r.left.is_empty() { Ok(packet) } else { Err(WireError::Length { bytes: total }) }
}

/// Which packet a refused value was in.
#[derive(Clone, Copy)]
pub(super) struct Context {
    session: u64,
    sequence: u64,
}

impl Context {
    fn value(self, field: &'static str, value: f64) -> WireError {
        WireError::Value { field, value, session: self.session, sequence: self.sequence }
    }

    /// All of them finite, or the first that is not, with its name.
    pub(super) fn all_finite<const N: usize>(
        self,
        values: [f64; N],
        name: impl Fn(usize) -> &'static str,
    ) -> Result<[f64; N], WireError> {
        // `&` and not `&&`: one branch for all of them.
        if values.iter().fold(true, |finite, value| finite & value.is_finite()) {
            return Ok(values);
        }
        match values.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(self.value(name(index), values[index])),
            None => Ok(values),
        }
    }

    pub(super) fn finite(self, field: &'static str, value: f64) -> Result<f64, WireError> {
        if value.is_finite() { Ok(value) } else { Err(self.value(field, value)) }
    }
}

fn sensor_packet(
    r: &mut Reader<'_>,
    phase: u8,
    session: u64,
    sequence: u64,
    time: SimTime,
    context: Context,
) -> Result<SensorPacket, WireError> {
    let phase = match phase {
        0 => Phase::Flying,
        1 => Phase::Holding,
        2 => Phase::OnGround,
        value => return Err(WireError::Code { field: "phase", value }),
    };
    let aircraft = read_aircraft(r)?;
    let micros = r.u32()?;
    let period = ControlPeriod::from_micros(micros)
        .map_err(|_| context.value("control_period_us", f64::from(micros)))?;
    let stamps = read_stamps(r, context, time)?;
    let values =
        context.all_finite(r.f64s::<{ Sensors::COUNT }>()?, |index| Sensors::NAMES[index])?;
    let square = values[6..10].iter().map(|v| v * v).sum::<f64>();
    if (square - 1.0).abs() > QUATERNION_TOLERANCE {
        return Err(context.value("attitude (squared length)", square));
    }
    let sensors = Sensors::new(&stamps, &values);
    let mut reports = Reports::new();
    for _ in 0..r.u8()? {
        let report = read_report(r, context, aircraft)?;
        reports.try_push(report).map_err(|_| WireError::Length { bytes: r.total })?;
    }
    skip_envelope(r)?;
    Ok(SensorPacket { session, sequence, aircraft, time, phase, period, sensors, reports })
}

/// Time and validity of each sample; none is of the future.
fn read_stamps(
    r: &mut Reader<'_>,
    context: Context,
    now: SimTime,
) -> Result<[Stamp; Sensors::SENSORS], WireError> {
    let mut stamps = [Stamp { time: now, valid: false }; Sensors::SENSORS];
    for (index, stamp) in stamps.iter_mut().enumerate() {
        stamp.time = SimTime::from_micros(r.u64()?);
        if stamp.time > now {
            let us = stamp.time.as_seconds() * 1.0e6;
            return Err(context.value(Sensors::TIMES[index], us));
        }
        stamp.valid = read_flag(r, Sensors::VALID[index])?;
    }
    Ok(stamps)
}

fn actuator_packet(
    r: &mut Reader<'_>,
    session: u64,
    sequence: u64,
    time: SimTime,
    context: Context,
) -> Result<ActuatorPacket, WireError> {
    let aircraft = read_aircraft(r)?;
    let commands = read_effectors(r, context, aircraft)?;
    let request = if read_flag(r, "request flag")? {
        Some(PlantRequest { number: r.u32()?, action: read_action(r, context)? })
    } else {
        None
    };
    let wants_envelope = read_flag(r, "envelope flag")?;
    let actuators = Actuators { commands };
    Ok(ActuatorPacket { session, sequence, aircraft, time, actuators, request, wants_envelope })
}

fn read_aircraft(r: &mut Reader<'_>) -> Result<Aircraft, WireError> {
    let length = r.u8()?;
    let wrong = WireError::Code { field: "length of the aircraft's name", value: length };
    let name = core::str::from_utf8(r.bytes(length.into())?).ok();
    let name = name.and_then(|name| Name::from(name).ok()).ok_or(wrong)?;
    let effectors = r.u8()?;
    if !(1..=Effector::MAX).contains(&usize::from(effectors)) {
        return Err(WireError::Code { field: "number of effectors", value: effectors });
    }
    Ok(Aircraft { name, effectors, identity: r.u32()? })
}

/// One value for each effector of the aircraft.
fn read_effectors(
    r: &mut Reader<'_>,
    context: Context,
    aircraft: Aircraft,
) -> Result<PerEffector<f64>, WireError> {
    let total = r.total;
    let bytes = r.bytes(8 * aircraft.count())?;
    let (values, _) = bytes.as_chunks::<8>();
    if values.len() != aircraft.count() {
        return Err(WireError::Length { bytes: total });
    }
    let values = values.iter().map(|bytes| f64::from_le_bytes(*bytes));
    let values = PerEffector::from_values(values);
    context.all_finite(*values.as_array(), |index| VALUES[index])?;
    Ok(values)
}

/// The effectors' values in errors.
const VALUES: [&str; Effector::MAX] = [
    "value of effector 1",
    "value of effector 2",
    "value of effector 3",
    "value of effector 4",
    "value of effector 5",
    "value of effector 6",
    "value of effector 7",
    "value of effector 8",
    "value of effector 9",
    "value of effector 10",
    "value of effector 11",
    "value of effector 12",
    "value of effector 13",
    "value of effector 14",
    "value of effector 15",
    "value of effector 16",
];

fn read_action(r: &mut Reader<'_>, context: Context) -> Result<PlantAction, WireError> {
    match r.u8()? {
        0 => Ok(PlantAction::Restart),
        1 => Ok(PlantAction::Fault(faults::read_request(r, context)?)),
        2 => Ok(PlantAction::ListFaults),
        3 => Ok(PlantAction::Pace(read_pace(r, context)?)),
        value => Err(WireError::Code { field: "request", value }),
    }
}

/// A pace that can be: a fraction of a period, or a speed beyond the limits, is refused like NaN.
fn read_pace(r: &mut Reader<'_>, context: Context) -> Result<Pace, WireError> {
    let code = r.u8()?;
    let value = r.f64()?;
    let pace = match code {
        0 => Pace::Pause,
        1 => Pace::Run,
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "saturates, and what it changes is refused"
        )]
        2 if f64::from(value as u32) == value => Pace::Step(value as u32),
        2 => return Err(context.value("pace", value)),
        3 => Pace::Speed(value),
        value => return Err(WireError::Code { field: "pace", value }),
    };
    if pace.is_valid() { Ok(pace) } else { Err(context.value("pace", value)) }
}

fn read_report(
    r: &mut Reader<'_>,
    context: Context,
    aircraft: Aircraft,
) -> Result<PlantReport, WireError> {
    match r.u8()? {
        0 => Ok(PlantReport::GroundContact { at: SimTime::from_micros(r.u64()?) }),
        1 => Ok(PlantReport::Fault(faults::read_entry(r, context)?)),
        2 => Ok(PlantReport::FaultReply {
            request: r.u32()?,
            reply: faults::read_reply(r, context)?,
        }),
        3 => {
            let given = read_flag(r, "pace request")?;
            let number = r.u32()?;
            let pace = read_pace(r, context)?;
            let at = SimTime::from_micros(r.u64()?);
            Ok(PlantReport::Paced { request: given.then_some(number), pace, at })
        }
        // Whoever joins later must not learn from a start what has become of the aircraft since.
        4 if context.sequence == 0 => {
            Ok(PlantReport::Started { positions: read_effectors(r, context, aircraft)? })
        }
        value => Err(WireError::Code { field: "report", value }),
    }
}

fn read_flag(r: &mut Reader<'_>, field: &'static str) -> Result<bool, WireError> {
    match r.u8()? {
        0 => Ok(false),
        1 => Ok(true),
        value => Err(WireError::Code { field, value }),
    }
}

/// What a sensor packet carries for the recorder, unopened; empty if it carries nothing. Only for a datagram
/// that [`decode`] has accepted as one.
#[must_use]
pub fn envelope(datagram: &[u8]) -> &[u8] {
    let length_at = datagram.len().saturating_sub(4 + 2);
    let length = match datagram.get(length_at..).and_then(|end| end.first_chunk::<2>()) {
        Some(bytes) => usize::from(u16::from_le_bytes(*bytes)),
        None => 0,
    };
    length_at.checked_sub(length).and_then(|from| datagram.get(from..length_at)).unwrap_or(&[])
}

/// Passes over the envelope at the end of a sensor packet.
fn skip_envelope(r: &mut Reader<'_>) -> Result<(), WireError> {
    let wrong = WireError::Length { bytes: r.total };
    let (envelope, length) = r.left.split_last_chunk::<2>().ok_or(wrong)?;
    if envelope.len() != usize::from(u16::from_le_bytes(*length)) || envelope.len() > ENVELOPE_MAX {
        return Err(wrong);
    }
    r.left = &[];
    Ok(())
}
