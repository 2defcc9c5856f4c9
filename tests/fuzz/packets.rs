//! Packets of the link between plant and autopilot.

use icd::fault::{FaultReply, PlantAction, PlantReport, PlantRequest};
use icd::lockstep::{FlightSide, PlantSide};
use icd::tvc_jet;
use icd::wire::{self, Packet, PacketBytes, Phase, Reports};
use icd::{Actuators, ControlPeriod, Sensors, SimTime};

use super::choices::Choices;

/// Bytes of the checksum at the end of a packet.
const CHECKSUM: usize = 4;

fn level_flight() -> Sensors {
    let mut values = [0.0; Sensors::COUNT];
    values[6] = 1.0;
    (values[21], values[23]) = (5_000.0, 264.0);
    Sensors::at(SimTime::ZERO, &values)
}

/// A sensor packet, an answer to it, and a refusal.
fn seeds() -> [Vec<u8>; 3] {
    let mut reports = Reports::new();
    reports.push(PlantReport::FaultReply {
        request: 3,
        reply: FaultReply::Applied { at: SimTime::ZERO },
    });
    let (mut plant, mut flight) =
        (PlantSide::new(7, tvc_jet::aircraft()), FlightSide::new(tvc_jet::aircraft()));
    let question = plant
        .begin_exchange(
            SimTime::ZERO,
            Phase::Flying,
            ControlPeriod::DEFAULT,
            &level_flight(),
            reports,
            b"truth",
        )
        .to_vec();
    let from = "127.0.0.1:9000".parse().unwrap();
    flight.handle(&question, from, false);
    let request = PlantRequest { number: 9, action: PlantAction::ListFaults };
    let answer = flight.answer(&Actuators::default(), Some(request), true).unwrap().to_vec();
    let mut refusal = PacketBytes::new();
    let reason = wire::RefusalReason::Busy;
    let busy = wire::RefusalPacket { version: wire::VERSION, session: 7, sequence: 0, reason };
    wire::encode_refusal(&busy, &mut refusal);
    [question, answer, refusal.to_vec()]
}

/// A decoded packet is the same after it is encoded and decoded again.
fn read_and_write(datagram: &[u8]) {
    let Ok(packet) = wire::decode(datagram) else { return };
    let mut again = PacketBytes::new();
    match &packet {
        Packet::Sensors(packet) => {
            wire::encode_sensors(packet, wire::envelope(datagram), &mut again);
        }
        Packet::Actuators(packet) => wire::encode_actuators(packet, &mut again),
        Packet::Refusal(packet) => wire::encode_refusal(packet, &mut again),
    }
    assert_eq!(wire::decode(&again), Ok(packet));
}

#[test]
fn plant_link() {
    let seeds = seeds();
    bolero::check!().for_each(|input: &[u8]| {
        let mut choices = Choices::new(input);
        let (mut plant, mut flight) =
            (PlantSide::new(7, tvc_jet::aircraft()), FlightSide::new(tvc_jet::aircraft()));
        let from = ["127.0.0.1:9000", "127.0.0.1:9001"].map(|at| at.parse().unwrap());
        plant.begin_exchange(
            SimTime::ZERO,
            Phase::Flying,
            ControlPeriod::DEFAULT,
            &level_flight(),
            Reports::new(),
            &[],
        );
        while !choices.is_empty() {
            let mut datagram = choices.one_of(&seeds).clone();
            choices.damage(&mut datagram);
            if choices.byte() < 224 && datagram.len() >= CHECKSUM {
                // The code of interest comes after the checksum.
                let end = datagram.len() - CHECKSUM;
                let checksum = crc32fast::hash(&datagram[..end]).to_le_bytes();
                datagram[end..].copy_from_slice(&checksum);
            }
            read_and_write(&datagram);
            flight.handle(&datagram, *choices.one_of(&from), choices.byte() > 128);
            if choices.byte() > 64 {
                flight.answer(&Actuators::default(), None, choices.byte() > 128);
            }
            plant.handle(&datagram);
        }
    });
}
