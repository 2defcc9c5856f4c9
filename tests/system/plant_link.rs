//! Several plants and strangers at one autopilot: whose packets the autopilot accepts, with the real programs.

use crate::ground;
use crate::programs;

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use ground::Ground;
use icd::lockstep::{FlightEvent, FlightSide, PlantEvent, PlantSide};
use icd::tvc_jet;
use icd::wire::{self, PACKET_MAX, Packet, Phase, RefusalReason, Reports};
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use programs::{Program, TIMEOUT, autopilot, autopilot_with};

/// Signal numbers.
const KILL: u32 = 9;
const STOP: u32 = 19;
const CONTINUE: u32 = 18;

#[test]
fn a_stalled_plant_keeps_its_flight_and_a_dead_one_loses_it() {
    let mut ground = Ground::new();
    let (autopilot, link) = autopilot(ground.address(), &[]);
    let first = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("the first flight", |ground| ground.time_s > 3.0);
    let second = Program::start("plant-sim", &["--autopilot", &link]);
    second.wait_for("is flying another plant");
    first.signal(STOP);
    autopilot.wait_for("does not answer");
    // Neither the second plant nor a stranger gets an answer to its packets, however long the first one says nothing.
    let strange = socket();
    let packet = question(&mut PlantSide::new(7, tvc_jet::aircraft()), 0);
    for _ in 0..30 {
        let answer = exchange(&strange, &packet, &link).expect("strangers are answered");
        assert!(matches!(wire::decode(&answer), Ok(Packet::Refusal(_))));
        ground.listen_for(Duration::from_millis(100));
    }
    let before_s = ground.time_s;
    first.signal(CONTINUE);
    ground.listen_until("the first flight goes on", |ground| ground.time_s > before_s + 0.5);
    first.signal(KILL);
    ground.listen_until("the second flight", |ground| ground.time_s < before_s);
    let resumed_s = ground.time_s;
    ground.listen_until("the second flight goes on", |ground| ground.time_s > resumed_s + 0.5);
}

#[test]
fn a_packet_that_is_only_repeated_holds_nothing() {
    let mut ground = Ground::new();
    let (autopilot, link) = autopilot(ground.address(), &[]);
    let strange = socket();
    let packet = question(&mut PlantSide::new(7, tvc_jet::aircraft()), 0);
    exchange(&strange, &packet, &link).expect("the autopilot takes any plant");
    let plant = Program::start("plant-sim", &["--autopilot", &link]);
    let mut is_flying = false;
    for _ in 0..600 {
        // It never takes the answer, and its socket stays open.
        exchange(&strange, &packet, &link);
        ground.listen_for(Duration::from_millis(100));
        is_flying |= ground.time_s > 0.5;
        if is_flying {
            break;
        }
    }
    assert!(is_flying, "{}\n{}", autopilot.printed(), plant.printed());
}

/// A socket on loopback with a timeout.
fn socket() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("loopback has free ports");
    socket.set_read_timeout(Some(Duration::from_millis(200))).expect("a timeout");
    socket
}

fn question(plant: &mut PlantSide, tick: u64) -> Vec<u8> {
    let mut values = [0.0; Sensors::COUNT];
    // The attitude must be a unit quaternion.
    values[6] = 1.0;
    let (time, period) = (SimTime::from_micros(2_000 * tick), ControlPeriod::DEFAULT);
    let sensors = Sensors::at(time, &values);
    plant.begin_exchange(time, Phase::Flying, period, &sensors, Reports::new(), &[]).to_vec()
}

/// Sends a packet and returns the answer, if any.
fn exchange(socket: &UdpSocket, packet: &[u8], to: &str) -> Option<Vec<u8>> {
    socket.send_to(packet, to).expect("loopback takes it");
    let mut buffer = [0; PACKET_MAX];
    let bytes = socket.recv(&mut buffer).ok()?;
    Some(buffer[..bytes].to_vec())
}

#[test]
fn a_neighbour_that_knows_the_session_cannot_impersonate_the_plant() {
    let (_autopilot, link) = autopilot_with(&["--no-gcs"]);
    let (ours, strange) = (socket(), socket());
    let mut plant = PlantSide::new(0x0123_4567_89ab_cdef, tvc_jet::aircraft());
    for tick in 0..100 {
        let request = question(&mut plant, tick);
        // The neighbour's packets: the right session, the right sequence number; before the plant and after it.
        for is_known in [true, false] {
            let mut packet = request.clone();
            if !is_known {
                packet[8] ^= 1;
                let end = packet.len() - 4;
                let sum = crc32(&packet[..end]).to_le_bytes();
                packet[end..].copy_from_slice(&sum);
            }
            if tick > 0 {
                let answer = exchange(&strange, &packet, &link).expect("strangers are answered");
                match wire::decode(&answer).expect("a packet") {
                    Packet::Refusal(refusal) => assert_eq!(refusal.reason, RefusalReason::Busy),
                    other => panic!("known {is_known}: {other:?}"),
                }
            }
        }
        let answer = exchange(&ours, &request, &link).expect("the plant is answered");
        assert!(matches!(plant.handle(&answer), PlantEvent::Answer(_)), "tick {tick}");
        let event = exchange(&strange, &request, &link).expect("strangers are answered");
        assert!(matches!(wire::decode(&event), Ok(Packet::Refusal(_))), "tick {tick}");
    }
}

/// CRC-32 (IEEE), bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
        }
    }
    !crc
}

#[test]
fn a_neighbour_that_knows_the_session_cannot_impersonate_the_autopilot() {
    let (ours, strange) = (socket(), socket());
    let link = ours.local_addr().expect("it has one").to_string();
    let plant = Program::start("plant-sim", &["--autopilot", &link]);
    let mut flight = FlightSide::new(tvc_jet::aircraft());
    let mut buffer = [0; PACKET_MAX];
    let until = Instant::now() + TIMEOUT;
    let mut ticks = 0;
    while ticks < 50 {
        assert!(Instant::now() < until, "{ticks} ticks; printed:\n{}", plant.printed());
        let Ok((bytes, from)) = ours.recv_from(&mut buffer) else { continue };
        if !matches!(
            flight.handle(&buffer[..bytes], from, false),
            FlightEvent::NewFlight(_) | FlightEvent::Next(_)
        ) {
            continue;
        }
        let answer =
            flight.answer(&Actuators::default(), None, false).expect("there is a question");
        // The right answer from the wrong address: the plant keeps repeating its request.
        strange.send_to(answer, from).expect("loopback takes it");
        let again = ours.recv_from(&mut buffer).expect("the plant asks again");
        let event = flight.handle(&buffer[..again.0], from, false);
        let FlightEvent::Repeat(answer) = event else {
            panic!("tick {ticks}: the plant took the answer of a stranger: {event:?}")
        };
        ours.send_to(answer, from).expect("loopback takes it");
        ticks += 1;
    }
}
