//! Packets to bytes.

use super::cursor::Writer;
use super::{
    ActuatorPacket, FaultKind, FaultReply, FaultRequest, MAGIC, Onset, Pace, PacketBytes, Phase,
    PlantAction, PlantReport, PlantRequest, Refusal, RefusalPacket, RefusalReason, SensorPacket,
    Travel, VERSION,
};

pub(super) const KIND_SENSORS: u8 = 1;
pub(super) const KIND_ACTUATORS: u8 = 2;
pub(super) const KIND_REFUSAL: u8 = 3;

/// Writes a sensor packet into `out`, which is cleared first.
pub fn encode_sensors(packet: &SensorPacket, out: &mut PacketBytes) {
    let phase = match packet.phase {
        Phase::Flying => 0,
        Phase::Holding => 1,
        Phase::OnGround => 2,
    };
    let mut w = header(out, KIND_SENSORS, phase, packet.session, packet.sequence);
    w.u64(packet.time.as_micros());
    w.u32(packet.period.as_micros());
    for v in packet.sensors.to_array() {
        w.f64(v);
    }
    #[expect(clippy::cast_possible_truncation, reason = "at most REPORTS_MAX")]
    w.u8(packet.reports.len() as u8);
    for report in &packet.reports {
        write_report(&mut w, report);
    }
    w.finish();
}

/// Writes an actuator packet into `out`, which is cleared first.
pub fn encode_actuators(packet: &ActuatorPacket, out: &mut PacketBytes) {
    let mut w = header(out, KIND_ACTUATORS, 0, packet.session, packet.sequence);
    w.u64(packet.time.as_micros());
    for v in packet.actuators.commands.as_array() {
        w.f64(*v);
    }
    match &packet.request {
        None => w.u8(0),
        Some(PlantRequest { number, action }) => {
            w.u8(1);
            w.u32(*number);
            match action {
                PlantAction::Restart => w.u8(0),
                PlantAction::Pace(pace) => {
                    w.u8(3);
                    let (code, value) = pace_code(*pace);
                    w.u8(code);
                    w.f64(value);
                }
                PlantAction::Fault(FaultRequest::Clear { effector }) => {
                    w.u8(1);
                    w.u8(*effector as u8);
                }
                PlantAction::Fault(FaultRequest::Inject { effector, kind, onset }) => {
                    w.u8(2);
                    w.u8(*effector as u8);
                    let (code, value) = kind_code(kind);
                    w.u8(code);
                    w.f64(value);
                    match onset {
                        Onset::AtOnce => w.u64(u64::MAX),
                        Onset::At(at) => w.u64(at.as_micros()),
                    }
                }
            }
        }
    }
    w.finish();
}

/// Writes a refusal into `out`, which is cleared first.
pub fn encode_refusal(packet: &RefusalPacket, out: &mut PacketBytes) {
    let reason = match packet.reason {
        RefusalReason::Version => 1,
        RefusalReason::Busy => 2,
        RefusalReason::Value => 3,
    };
    let mut w = header(out, KIND_REFUSAL, reason, packet.session, packet.sequence);
    w.u64(0);
    w.u16(packet.version);
    w.finish();
}

fn header(out: &mut PacketBytes, kind: u8, detail: u8, session: u64, sequence: u64) -> Writer<'_> {
    out.clear();
    let mut w = Writer(out);
    w.bytes(&MAGIC);
    w.u16(VERSION);
    w.u8(kind);
    w.u8(detail);
    w.u64(session);
    w.u64(sequence);
    w
}

fn kind_code(kind: &FaultKind) -> (u8, f64) {
    match kind {
        FaultKind::StuckHere => (0, 0.0),
        FaultKind::StuckAt { angle_rad, travel: Travel::Jump } => (1, *angle_rad),
        FaultKind::StuckAt { angle_rad, travel: Travel::AtActuatorRate } => (2, *angle_rad),
        FaultKind::PartialLoss { remaining } => (3, *remaining),
        FaultKind::Float => (4, 0.0),
    }
}

fn pace_code(pace: Pace) -> (u8, f64) {
    match pace {
        Pace::Pause => (0, 0.0),
        Pace::Run => (1, 0.0),
        Pace::Step(periods) => (2, f64::from(periods)),
        Pace::Speed(speed) => (3, speed),
    }
}

/// One fixed-size record: code, two small codes, pad, number, time, two values.
struct Record {
    code: u8,
    a: u8,
    b: u8,
    number: u32,
    time: u64,
    values: [f64; 2],
}

fn write_report(w: &mut Writer<'_>, report: &PlantReport) {
    let record = match report {
        PlantReport::GroundContact { at } => {
            Record { code: 0, a: 0, b: 0, number: 0, time: at.as_micros(), values: [0.0; 2] }
        }
        PlantReport::FaultActs { effector, kind, at } => {
            let (b, value) = kind_code(kind);
            let time = at.as_micros();
            Record { code: 1, a: *effector as u8, b, number: 0, time, values: [value, 0.0] }
        }
        PlantReport::FaultEnded { effector, at } => Record {
            code: 2,
            a: *effector as u8,
            b: 0,
            number: 0,
            time: at.as_micros(),
            values: [0.0; 2],
        },
        PlantReport::FaultReply { request, reply } => reply_record(*request, reply),
        PlantReport::Paced { request, pace, at } => {
            let (a, value) = pace_code(*pace);
            let (b, number) = request.map_or((0, 0), |number| (1, number));
            Record { code: 4, a, b, number, time: at.as_micros(), values: [value, 0.0] }
        }
    };
    w.u8(record.code);
    w.u8(record.a);
    w.u8(record.b);
    w.u8(0);
    w.u32(record.number);
    w.u64(record.time);
    w.f64(record.values[0]);
    w.f64(record.values[1]);
}

fn reply_record(number: u32, reply: &FaultReply) -> Record {
    let (a, b, time, values) = match reply {
        FaultReply::Applied { at } => (0, 0, at.as_micros(), [0.0; 2]),
        FaultReply::Unchanged { at } => (1, 0, at.as_micros(), [0.0; 2]),
        FaultReply::Scheduled { at } => (2, 0, at.as_micros(), [0.0; 2]),
        FaultReply::Cleared { at } => (3, 0, at.as_micros(), [0.0; 2]),
        FaultReply::Refused(refusal) => {
            let (b, time, values) = match refusal {
                Refusal::AngleOutOfTravel { angle_rad, limit_rad } => {
                    (0, 0, [*angle_rad, *limit_rad])
                }
                Refusal::RemainingOutOfRange { remaining } => (1, 0, [*remaining, 0.0]),
                Refusal::NotForThisEffector => (2, 0, [0.0; 2]),
                Refusal::OnsetInThePast { onset, now } => {
                    (3, onset.as_micros(), [now.as_seconds(), 0.0])
                }
                Refusal::ScheduleFull { capacity } => (4, 0, [f64::from(*capacity), 0.0]),
                Refusal::FlightOver => (5, 0, [0.0; 2]),
            };
            (4, b, time, values)
        }
    };
    Record { code: 3, a, b, number, time, values }
}
