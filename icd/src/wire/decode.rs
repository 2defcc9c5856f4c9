//! Bytes to packets. Nothing that is damaged, foreign or not finite gets through.

use super::cursor::Reader;
use super::encode::{KIND_ACTUATORS, KIND_REFUSAL, KIND_SENSORS};
use super::{
    ActuatorPacket, Actuators, ControlPeriod, Effector, FaultKind, FaultReply, FaultRequest, MAGIC,
    Onset, PACKET_MAX, Pace, Packet, PerEffector, Phase, PlantAction, PlantReport, PlantRequest,
    Refusal, RefusalPacket, RefusalReason, Reports, SensorPacket, Sensors, SimTime, Travel,
    VERSION, WireError,
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
struct Context {
    session: u64,
    sequence: u64,
}

impl Context {
    fn value(self, field: &'static str, value: f64) -> WireError {
        WireError::Value { field, value, session: self.session, sequence: self.sequence }
    }

    /// All of them finite, or the first that is not, with its name.
    fn all_finite<const N: usize>(
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

    fn finite(self, field: &'static str, value: f64) -> Result<f64, WireError> {
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
    let micros = r.u32()?;
    let period = ControlPeriod::from_micros(micros)
        .map_err(|_| context.value("control_period_us", f64::from(micros)))?;
    let values =
        context.all_finite(r.f64s::<{ Sensors::COUNT }>()?, |index| Sensors::NAMES[index])?;
    let square = values[6..10].iter().map(|v| v * v).sum::<f64>();
    if (square - 1.0).abs() > QUATERNION_TOLERANCE {
        return Err(context.value("attitude (squared length)", square));
    }
    let sensors = Sensors::from_array(&values);
    let mut reports = Reports::new();
    for _ in 0..r.u8()? {
        let report = read_report(r, context)?;
        reports.try_push(report).map_err(|_| WireError::Length { bytes: r.total })?;
    }
    Ok(SensorPacket { session, sequence, time, phase, period, sensors, reports })
}

fn actuator_packet(
    r: &mut Reader<'_>,
    session: u64,
    sequence: u64,
    time: SimTime,
    context: Context,
) -> Result<ActuatorPacket, WireError> {
    let values =
        context.all_finite(r.f64s::<{ Effector::COUNT }>()?, |index| Effector::ALL[index].key())?;
    let commands = PerEffector::new(values);
    let request = match r.u8()? {
        0 => None,
        1 => Some(PlantRequest { number: r.u32()?, action: read_action(r, context)? }),
        value => return Err(WireError::Code { field: "request flag", value }),
    };
    Ok(ActuatorPacket { session, sequence, time, actuators: Actuators { commands }, request })
}

fn read_action(r: &mut Reader<'_>, context: Context) -> Result<PlantAction, WireError> {
    match r.u8()? {
        0 => Ok(PlantAction::Restart),
        1 => Ok(PlantAction::Fault(FaultRequest::Clear { effector: effector(r.u8()?)? })),
        2 => {
            let effector = effector(r.u8()?)?;
            let code = r.u8()?;
            let kind = fault_kind(code, context.finite("fault value", r.f64()?)?)?;
            let onset = match r.u64()? {
                u64::MAX => Onset::AtOnce,
                micros => Onset::At(SimTime::from_micros(micros)),
            };
            Ok(PlantAction::Fault(FaultRequest::Inject { effector, kind, onset }))
        }
        3 => {
            let code = r.u8()?;
            Ok(PlantAction::Pace(pace(code, r.f64()?, context)?))
        }
        value => Err(WireError::Code { field: "request", value }),
    }
}

fn effector(code: u8) -> Result<Effector, WireError> {
    Effector::from_index(usize::from(code))
        .ok_or(WireError::Code { field: "effector", value: code })
}

fn fault_kind(code: u8, value: f64) -> Result<FaultKind, WireError> {
    match code {
        0 => Ok(FaultKind::StuckHere),
        1 => Ok(FaultKind::StuckAt { angle_rad: value, travel: Travel::Jump }),
        2 => Ok(FaultKind::StuckAt { angle_rad: value, travel: Travel::AtActuatorRate }),
        3 => Ok(FaultKind::PartialLoss { remaining: value }),
        4 => Ok(FaultKind::Float),
        value => Err(WireError::Code { field: "fault kind", value }),
    }
}

/// A pace that can be: a fraction of a period, or a speed beyond the limits, is refused like NaN.
fn pace(code: u8, value: f64, context: Context) -> Result<Pace, WireError> {
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

fn read_report(r: &mut Reader<'_>, context: Context) -> Result<PlantReport, WireError> {
    let code = r.u8()?;
    let a = r.u8()?;
    let b = r.u8()?;
    r.u8()?;
    let number = r.u32()?;
    let at = SimTime::from_micros(r.u64()?);
    let v = context.finite("report value", r.f64()?)?;
    let v2 = context.finite("report value", r.f64()?)?;
    match code {
        0 => Ok(PlantReport::GroundContact { at }),
        1 => Ok(PlantReport::FaultActs { effector: effector(a)?, kind: fault_kind(b, v)?, at }),
        2 => Ok(PlantReport::FaultEnded { effector: effector(a)?, at }),
        3 => {
            let reply = match a {
                0 => FaultReply::Applied { at },
                1 => FaultReply::Unchanged { at },
                2 => FaultReply::Scheduled { at },
                3 => FaultReply::Cleared { at },
                4 => FaultReply::Refused(refusal(b, at, v, v2)?),
                value => return Err(WireError::Code { field: "fault reply", value }),
            };
            Ok(PlantReport::FaultReply { request: number, reply })
        }
        4 => {
            let request = match b {
                0 => None,
                1 => Some(number),
                value => return Err(WireError::Code { field: "pace request", value }),
            };
            Ok(PlantReport::Paced { request, pace: pace(a, v, context)?, at })
        }
        value => Err(WireError::Code { field: "report", value }),
    }
}

fn refusal(code: u8, at: SimTime, v: f64, v2: f64) -> Result<Refusal, WireError> {
    match code {
        0 => Ok(Refusal::AngleOutOfTravel { angle_rad: v, limit_rad: v2 }),
        1 => Ok(Refusal::RemainingOutOfRange { remaining: v }),
        2 => Ok(Refusal::NotForThisEffector),
        3 => Ok(Refusal::OnsetInThePast {
            onset: at,
            // Only for a message to people: saturates for flights longer than that.
            now: SimTime::from_seconds(v.clamp(0.0, SimTime::MAX_SECONDS)).unwrap_or_default(),
        }),
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
        4 => Ok(Refusal::ScheduleFull { capacity: v as u32 }),
        5 => Ok(Refusal::FlightOver),
        value => Err(WireError::Code { field: "refusal", value }),
    }
}
