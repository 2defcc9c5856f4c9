//! Many ground stations at once, over links that are slow, cut or closed.

use super::world::*;
use crate::codec::OWN;
use crate::peers::{Address, Connection};
use ::mavlink::dialects::common::{MavMessage, PARAM_REQUEST_READ_DATA};
use proptest::prelude::*;

const TCP: Address = Address::Tcp(Connection(0));

/// Commands with unknown numbers start here.
const UNKNOWN: u16 = 50_000;

fn flying_with_tcp() -> World {
    let mut world = World::flying();
    assert!(world.ground.open(Connection(0), true, world.now));
    world
}

fn unknown(number: u16) -> Vec<u8> {
    command_long(UNKNOWN + number, [0.0; 7], OWN)
}

/// Which unknown commands were acknowledged to `to`, in order.
fn acknowledged(world: &World, to: Address) -> Vec<u16> {
    let acks = world.got.iter().filter(|got| got.to == to && got.id == 77);
    acks.map(|ack| u16::from_le_bytes([ack.payload[0], ack.payload[1]]) - UNKNOWN).collect()
}

/// PING to all systems.
fn ping(number: u32) -> Vec<u8> {
    let payload = [&[0; 8][..], &number.to_le_bytes(), &[0, 0]].concat();
    frame(4, 237, &payload)
}

#[test]
fn a_connection_gets_telemetry_from_its_start_until_it_is_closed() {
    let mut world = flying_with_tcp();
    world.run_ms(1_000);
    assert!(world.got.iter().any(|got| got.to == TCP));
    world.ground.close(Connection(0));
    world.got.clear();
    world.send_bytes(TCP, &ping(1));
    world.run_ms(1_000);
    assert!(world.got.iter().all(|got| got.to != TCP));
}

#[test]
fn the_record_of_traffic_has_what_all_get_once_and_what_one_gets_too_without_a_gap() {
    let mut world = flying_with_tcp();
    world.run_ms(100);
    world.got.clear();
    world.ground.traffic().record_from_now();
    let other = Address::UdpServer("127.0.0.1:9000".parse().unwrap());
    for (number, to) in [address(14_550), TCP, other].into_iter().enumerate() {
        world.send_bytes(to, &unknown(u16::try_from(number).unwrap()));
    }
    let (mut heartbeats, mut answers, mut sequences) = (0, 0, Vec::new());
    for _ in 0..50 {
        world.run_ms(100);
        while let Some(frame) = world.ground.traffic().pop() {
            let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
            let is_ours = (frame[5], frame[6]) == (OWN.system, OWN.component);
            heartbeats += usize::from(is_ours && id == 0);
            answers += u32::from(is_ours && id == 77);
            sequences.extend(is_ours.then_some(frame[4]));
        }
    }
    let to_one = world.got.iter().filter(|got| got.to == TCP && got.id == 0 && got.bytes[6] == 1);
    assert_eq!(heartbeats, to_one.count() + 1, "the new visitor is greeted by one of its own");
    assert!(heartbeats >= 5, "{heartbeats} in 5 s");
    assert_eq!(answers, 3);
    assert!(sequences.windows(2).all(|two| two[1] == two[0].wrapping_add(1)), "{sequences:?}");
}

#[test]
fn each_link_counts_its_own_frames_also_to_the_same_place() {
    let mut world = flying_with_tcp();
    let Address::UdpClient(place) = address(14_550) else { panic!("a UDP address") };
    let server = Address::UdpServer(place);
    world.send_bytes(server, &ping(1));
    world.send_bytes(TCP, &ping(1));
    world.run_ms(3_000);
    for to in [server, TCP] {
        // Those of the autopilot: other components have their own count. The seventh byte is the component.
        let of_link = world.got.iter().filter(|got| got.to == to && got.bytes[6] == 1);
        let sequences: Vec<u8> = of_link.map(|got| got.sequence).collect();
        assert!(sequences.len() > 30, "{} frames to {to:?}", sequences.len());
        let expected: Vec<u8> = (0..=255).cycle().take(sequences.len()).collect();
        assert_eq!(sequences, expected, "{to:?}");
    }
}

#[test]
fn a_peer_that_takes_nothing_is_read_no_further_and_loses_no_answer_to_what_was_read() {
    let mut world = flying_with_tcp();
    world.stuck.push(TCP);
    let mut sent = 0;
    while world.ground.accepts_input(Connection(0)) {
        assert!(sent < 10_000, "read without end");
        world.send_bytes(TCP, &unknown(sent));
        sent += 1;
        world.step();
    }
    assert!(sent > 100, "{sent} were read");
    // The others do not notice.
    world.run_ms(5_000);
    world.got.clear();
    world.send_bytes(address(14_540), &ping(7));
    assert!(world.got.iter().any(|got| got.to == address(14_540) && got.id == 4));
    assert!(acknowledged(&world, TCP).is_empty());

    world.stuck.clear();
    world.settle();
    assert_eq!(acknowledged(&world, TCP), (0..sent).collect::<Vec<u16>>());
    assert!(world.ground.accepts_input(Connection(0)));
    let [telemetry, _, answers] = world.ground.dropped();
    assert!(telemetry > 0, "telemetry gives way");
    assert_eq!(answers, 0);
}

#[test]
fn messages_read_together_wait_for_room_and_are_answered_once_and_in_order() {
    let mut world = flying_with_tcp();
    world.stuck.push(TCP);
    // More than the queue of answers holds, in pieces as they are read.
    let stream: Vec<u8> = (0..400).flat_map(unknown).collect();
    let mut pieces = stream.chunks(2_048).peekable();
    while pieces.peek().is_some() {
        if !world.ground.accepts_input(Connection(0)) {
            world.stuck.clear();
        }
        if let Some(piece) = pieces.next_if(|_| world.ground.accepts_input(Connection(0))) {
            world.send_bytes(TCP, piece);
        } else {
            world.settle();
        }
    }
    world.settle();
    world.settle();
    assert_eq!(acknowledged(&world, TCP), (0..400).collect::<Vec<u16>>());
    assert_eq!(world.ground.skipped().overflow_bytes, 0);
}

#[test]
fn broadcasts_take_no_room_from_the_answers_to_a_slow_peer() {
    let mut world = flying_with_tcp();
    world.stuck.push(TCP);
    // Each change of a parameter is broadcast.
    for i in 0..1_000_u16 {
        let value = if i % 2 == 0 { 40.0 } else { 30.0 };
        world.send(&super::params::set_real("OBS_W0", value));
        world.got.clear();
    }
    world.send_bytes(TCP, &unknown(1));
    world.stuck.clear();
    world.settle();
    assert_eq!(acknowledged(&world, TCP), [1]);
    let [_, announcements, answers] = world.ground.dropped();
    assert!(announcements > 0);
    assert_eq!(answers, 0);
}

#[test]
fn a_datagram_that_cannot_be_answered_changes_nothing() {
    let mut world = World::flying();
    world.stuck.push(address(14_550));
    for number in 0..1_000 {
        world.send_bytes(address(14_550), &unknown(number));
    }
    let before = world.ground.parameters().gains;
    world.send(&super::params::set_real("OBS_W0", 40.0));
    assert_eq!(world.ground.parameters().gains, before);
    let unanswerable = world.ground.skipped().unanswerable;
    world.stuck.clear();
    world.settle();
    let answered = acknowledged(&world, address(14_550)).len();
    assert_eq!(answered as u64 + unanswerable, 1_001);
    world.send(&super::params::set_real("OBS_W0", 40.0));
    assert_ne!(world.ground.parameters().gains, before, "there is room again");
}

#[test]
fn our_own_messages_sent_back_over_a_connection_are_ignored() {
    let mut world = flying_with_tcp();
    let read = PARAM_REQUEST_READ_DATA { param_index: 0, ..Default::default() };
    let echo = world.encode(OWN, &MavMessage::PARAM_REQUEST_READ(read.clone()));
    world.send_bytes(TCP, &echo);
    assert!(world.values(TCP).is_empty());
    let question = world.encode(STATION, &MavMessage::PARAM_REQUEST_READ(read));
    world.send_bytes(TCP, &question);
    assert_eq!(world.values(TCP).len(), 1);
}

#[test]
fn many_ground_stations_are_served_at_once_and_each_gets_its_own_answers() {
    let mut world = World::flying();
    let visitor =
        |n: u16| Address::UdpServer(std::net::SocketAddr::from(([127, 0, 0, 1], 9_000 + n)));
    let mut all: Vec<Address> = (0..24).map(visitor).collect();
    for n in 0..16 {
        assert!(world.ground.open(Connection(n), true, world.now));
        all.push(Address::Tcp(Connection(n)));
    }
    all.extend([address(14_550), address(14_540)]);
    for (n, &from) in (0..).zip(&all) {
        world.send_bytes(from, &unknown(n));
    }
    world.run_ms(2_000);
    for (n, &to) in (0..).zip(&all) {
        assert_eq!(acknowledged(&world, to), [n], "{to:?}");
        assert!(world.got.iter().any(|got| got.to == to && got.id == 0), "a heartbeat to {to:?}");
    }
}

#[test]
fn a_new_station_on_a_full_port_is_served_in_the_end_and_the_others_without_a_gap() {
    let mut world = World::flying();
    let visitor =
        |n: u16| Address::UdpServer(std::net::SocketAddr::from(([127, 0, 0, 1], 9_000 + n)));
    let late = visitor(24);
    let mut served_since = None;
    for second in 0..14 {
        for n in 0..25 {
            // 24 fill the table before the late one begins to call.
            if n < 24 || second > 0 {
                world.send_bytes(visitor(n), &ping(u32::from(n)));
            }
        }
        world.got.clear();
        world.run_ms(1_000);
        let heartbeats =
            |to: Address| world.got.iter().filter(|got| got.to == to && got.id == 0).count();
        for n in 0..23 {
            assert!(heartbeats(visitor(n)) > 0, "no heartbeat to {n} in second {second}");
        }
        if served_since.is_none() && heartbeats(late) > 0 {
            served_since = Some(second);
        }
    }
    assert_eq!(served_since, Some(10), "the newest keeps its place for ten seconds");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn a_conversation_cut_anywhere_gets_the_answers_of_the_whole(
        noise in proptest::collection::vec(any::<u8>(), 0..200),
        cuts in proptest::collection::vec(0..2_000_usize, 0..40),
    ) {
        let mut stream: Vec<u8> = (0..20).flat_map(unknown).collect();
        stream.extend(noise);
        stream.extend((20..30).flat_map(unknown));
        let answers = |cuts: &[usize]| {
            let mut world = flying_with_tcp();
            let mut begin = 0;
            for &end in cuts.iter().chain([&stream.len()]) {
                let end = end.min(stream.len());
                world.send_bytes(TCP, &stream[begin..end]);
                begin = end;
            }
            acknowledged(&world, TCP)
        };
        let mut cuts = cuts;
        cuts.sort_unstable();
        let whole = answers(&[]);
        prop_assert!(whole.len() >= 20);
        prop_assert_eq!(answers(&cuts), whole);
    }
}
