//! Packets to bytes.

use super::cursor::Writer;
use super::{
    ActuatorPacket, Aircraft, ENVELOPE_MAX, MAGIC, Pace, PacketBytes, Phase, PlantAction,
    PlantReport, PlantRequest, RefusalPacket, RefusalReason, SensorPacket, VERSION, faults,
};

pub(super) const KIND_SENSORS: u8 = 1;
pub(super) const KIND_ACTUATORS: u8 = 2;
pub(super) const KIND_REFUSAL: u8 = 3;

/// Writes a sensor packet into `out`, which is cleared first.
///
/// Of an `envelope` longer than [`ENVELOPE_MAX`] nothing is written.
pub fn encode_sensors(packet: &SensorPacket, envelope: &[u8], out: &mut PacketBytes) {
    let phase = match packet.phase {
        Phase::Flying => 0,
        Phase::Holding => 1,
        Phase::OnGround => 2,
    };
    let mut w = header(out, KIND_SENSORS, phase, packet.session, packet.sequence);
    w.u64(packet.time.as_micros());
    write_aircraft(&mut w, &packet.aircraft);
    w.u32(packet.period.as_micros());
    for stamp in packet.sensors.stamps() {
        w.u64(stamp.time.as_micros());
        w.u8(u8::from(stamp.valid));
    }
    for v in packet.sensors.to_array() {
        w.f64(v);
    }
    #[expect(clippy::cast_possible_truncation, reason = "at most REPORTS_MAX")]
    w.u8(packet.reports.len() as u8);
    for report in &packet.reports {
        write_report(&mut w, report, packet.aircraft.count());
    }
    let envelope = if envelope.len() <= ENVELOPE_MAX { envelope } else { &[] };
    w.bytes(envelope);
    #[expect(clippy::cast_possible_truncation, reason = "at most ENVELOPE_MAX")]
    w.u16(envelope.len() as u16);
    w.finish();
}

/// Writes an actuator packet into `out`, which is cleared first.
pub fn encode_actuators(packet: &ActuatorPacket, out: &mut PacketBytes) {
    let mut w = header(out, KIND_ACTUATORS, 0, packet.session, packet.sequence);
    w.u64(packet.time.as_micros());
    write_aircraft(&mut w, &packet.aircraft);
    for v in packet.actuators.commands.first(packet.aircraft.count()) {
        w.f64(*v);
    }
    match &packet.request {
        None => w.u8(0),
        Some(PlantRequest { number, action }) => {
            w.u8(1);
            w.u32(*number);
            match action {
                PlantAction::Restart => w.u8(0),
                PlantAction::Fault(request) => {
                    w.u8(1);
                    faults::write_request(&mut w, request);
                }
                PlantAction::ListFaults => w.u8(2),
                PlantAction::Pace(pace) => {
                    w.u8(3);
                    write_pace(&mut w, *pace);
                }
            }
        }
    }
    w.u8(u8::from(packet.wants_envelope));
    w.finish();
}

/// Writes a refusal into `out`, which is cleared first.
pub fn encode_refusal(packet: &RefusalPacket, out: &mut PacketBytes) {
    let reason = match packet.reason {
        RefusalReason::Version => 1,
        RefusalReason::Busy => 2,
        RefusalReason::Value => 3,
        RefusalReason::Aircraft => 4,
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

fn write_aircraft(w: &mut Writer<'_>, aircraft: &Aircraft) {
    #[expect(clippy::cast_possible_truncation, reason = "at most NAME_MAX")]
    w.u8(aircraft.name.len() as u8);
    w.bytes(aircraft.name.as_bytes());
    w.u8(aircraft.effectors);
    w.u32(aircraft.identity);
}

fn write_pace(w: &mut Writer<'_>, pace: Pace) {
    let (code, value) = match pace {
        Pace::Pause => (0, 0.0),
        Pace::Run => (1, 0.0),
        Pace::Step(periods) => (2, f64::from(periods)),
        Pace::Speed(speed) => (3, speed),
    };
    w.u8(code);
    w.f64(value);
}

fn write_report(w: &mut Writer<'_>, report: &PlantReport, effectors: usize) {
    match report {
        PlantReport::GroundContact { at } => {
            w.u8(0);
            w.u64(at.as_micros());
        }
        PlantReport::Fault(entry) => {
            w.u8(1);
            faults::write_entry(w, entry);
        }
        PlantReport::FaultReply { request, reply } => {
            w.u8(2);
            w.u32(*request);
            faults::write_reply(w, reply);
        }
        PlantReport::Paced { request, pace, at } => {
            w.u8(3);
            let (given, number) = request.map_or((0, 0), |number| (1, number));
            w.u8(given);
            w.u32(number);
            write_pace(w, *pace);
            w.u64(at.as_micros());
        }
        PlantReport::Started { positions } => {
            w.u8(4);
            for v in positions.first(effectors) {
                w.f64(*v);
            }
        }
    }
}
