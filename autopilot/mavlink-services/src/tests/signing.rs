//! Signing in a conversation: which frames are accepted, which station may set it up, which texts report it.

use super::world::*;
use crate::codec::{OWN, SIGNATURE};
use crate::peers::{Address, Connection, Crowding};
use crate::signing::{Key, KeyChange, LogLine, Signing, Timestamp, Trailer};
use ::mavlink::dialects::common::{
    HEARTBEAT_DATA, MavMessage, MavResult, PARAM_REQUEST_READ_DATA, SETUP_SIGNING_DATA,
};
use proptest::prelude::*;

const KEY: [u8; 32] = [0x5A; 32];
const NEAR: &str = "127.0.0.1:9999";
const FAR: &str = "192.168.7.7:9999";

fn key() -> Key {
    Key::new(KEY).unwrap()
}

fn visitor(place: &str) -> Address {
    Address::UdpServer(place.parse().unwrap())
}

/// The frame as a ground station with this key signs it.
fn signed(frame: &[u8], key: Key, units: u64) -> Vec<u8> {
    let mut frame = frame.to_vec();
    frame[2] = 1;
    let end = frame.len() - 2;
    let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
    let extra = <MavMessage as ::mavlink::Message>::extra_crc(id);
    let crc = ::mavlink::calculate_crc(&frame[1..end], extra);
    frame[end..].copy_from_slice(&crc.to_le_bytes());
    let trailer = key.sign(&frame, 9, Timestamp::new(units).unwrap());
    [frame, trailer.to_vec()].concat()
}

fn setup(world: &mut World, key: [u8; 32]) -> Vec<u8> {
    let data = SETUP_SIGNING_DATA {
        initial_timestamp: 1_000,
        target_system: 1,
        target_component: 1,
        secret_key: key,
    };
    world.encode(STATION, &MavMessage::SETUP_SIGNING(data))
}

/// Flying, with signing on.
fn signing() -> World {
    let mut world = World::flying();
    world.ground = world.ground.with_signing(Signing::new(None).with_file(None));
    let on = setup(&mut world, KEY);
    world.send_bytes(visitor(NEAR), &on);
    assert!(world.has_text("Signing is on"), "{:?}", world.texts());
    world.got.clear();
    world
}

fn read_parameter(world: &mut World) -> Vec<u8> {
    let data = PARAM_REQUEST_READ_DATA {
        param_index: -1,
        target_system: 1,
        target_component: 1,
        param_id: "OBS_W0".into(),
    };
    world.encode(STATION, &MavMessage::PARAM_REQUEST_READ(data))
}

#[test]
fn everything_sent_is_signed_and_what_is_not_signed_rightly_is_not_answered() {
    let mut world = signing();
    let request = read_parameter(&mut world);
    let other = Key::new([1; 32]).unwrap();
    for wrong in [request.clone(), signed(&request, other, 2_000)] {
        world.send_bytes(address(14_550), &wrong);
        assert!(world.values(address(14_550)).is_empty());
    }
    world.send_bytes(address(14_550), &signed(&request, key(), 2_000));
    assert_eq!(world.values(address(14_550)).len(), 1);
    world.send_bytes(address(14_550), &signed(&request, key(), 2_000));
    assert_eq!(world.values(address(14_550)).len(), 1, "the same frame again");
    world.run_ms(2_000);
    assert!(world.got.len() > 100);
    let mut latest = Timestamp::ZERO;
    for got in &world.got {
        let (frame, trailer) = got.bytes.split_last_chunk::<SIGNATURE>().unwrap();
        let trailer = Trailer(*trailer);
        assert!(frame[2] == 1 && key().is_right(frame, trailer), "{:?}", got.bytes);
        assert!(trailer.at() > latest);
        latest = trailer.at();
    }
}

#[test]
fn each_link_signs_with_its_own_number() {
    let mut world = signing();
    world.run_ms(1_500);
    let link = |to: Address| {
        let mut links: Vec<u8> = world
            .got
            .iter()
            .filter(|got| got.to == to)
            .map(|got| got.bytes[got.bytes.len() - SIGNATURE])
            .collect();
        links.dedup();
        links
    };
    assert_eq!(link(address(14_550)), [0]);
    assert_eq!(link(address(14_540)), [1]);
    assert_eq!(link(visitor(NEAR)), [2]);
}

#[test]
fn setup_comes_from_this_computer_only() {
    let mut world = World::flying();
    let on = setup(&mut world, KEY);
    world.send_bytes(visitor(FAR), &on);
    assert!(world.ground.open(Connection(0), false, world.now));
    world.send_bytes(Address::Tcp(Connection(0)), &on);
    assert!(world.has_text("SETUP_SIGNING refused: it may only come from this computer"));
    world.run_ms(100);
    assert!(world.got.iter().all(|got| got.bytes[2] == 0), "it is off");
    assert!(world.ground.open(Connection(1), true, world.now));
    world.got.clear();
    world.send_bytes(Address::Tcp(Connection(1)), &on);
    assert!(world.has_text("Signing is on until the end: there is no key file"));
    assert!(world.got.iter().all(|got| got.bytes[2] == 1), "it is on");
}

#[test]
fn while_on_only_a_signed_setup_counts_and_zeros_turn_it_off() {
    let mut world = signing();
    assert!(matches!(world.ground.pop_key_change(), Some(KeyChange::Keep(_))));
    let off = setup(&mut world, [0; 32]);
    world.send_bytes(visitor(NEAR), &off);
    assert!(!world.has_text("Signing is off"));
    world.send_bytes(visitor(FAR), &signed(&off, key(), 1_000_000));
    assert!(!world.has_text("Signing is off"), "signed, and from somewhere else");
    world.send_bytes(visitor(NEAR), &signed(&off, key(), 1_000_001));
    assert!(world.has_text("Signing is off"));
    assert_eq!(world.ground.pop_key_change(), Some(KeyChange::Forget));
    assert_eq!(world.ground.last_key_change(), None);
    assert_eq!(world.ground.report_signing(world.now), Some(LogLine::Turned("Signing is off")));
    world.send_command(50_000, [0.0; 7]);
    assert_eq!(world.take_acks(), [ack(50_000, MavResult::MAV_RESULT_UNSUPPORTED)]);
}

#[test]
fn setup_for_another_vehicle_is_not_ours() {
    let mut world = World::flying();
    let mut other = setup(&mut world, KEY);
    other[10 + 8] = 9;
    let end = other.len() - 2;
    let crc = ::mavlink::calculate_crc(&other[1..end], 71);
    other[end..].copy_from_slice(&crc.to_le_bytes());
    world.send_bytes(address(14_550), &other);
    assert_eq!(world.ground.skipped().bad_crc, 0);
    assert!(world.texts().is_empty(), "{:?}", world.texts());
}

#[test]
fn the_key_is_in_nothing_that_is_sent() {
    let mut world = World::flying();
    let on = setup(&mut world, KEY);
    world.send_bytes(visitor(NEAR), &on);
    let again = setup(&mut world, KEY);
    world.send_bytes(visitor(NEAR), &signed(&again, key(), 5_000));
    world.run_ms(3_000);
    assert!(world.got.len() > 100);
    for got in &world.got {
        assert!(got.id != 256 && !got.bytes.windows(8).any(|part| part == [0x5A; 8]), "{got:?}");
    }
}

#[test]
fn a_stranger_without_the_key_gets_nothing_and_takes_no_place() {
    let mut world = signing();
    let beat = world.encode(STATION, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    for port in 1..200 {
        let stranger = visitor(&format!("10.0.0.1:{port}"));
        world.send_bytes(stranger, &beat);
        world.send_bytes(stranger, &frame(9, 109, &[0; 9]));
    }
    world.run_ms(1_500);
    assert_eq!(world.ground.crowding(), Crowding::default());
    let strangers = |got: &&Got| matches!(got.to, Address::UdpServer(at) if at.port() < 200);
    assert_eq!(world.got.iter().filter(strangers).count(), 0);
    world.send_bytes(visitor("10.0.0.1:500"), &signed(&beat, key(), 9_000));
    world.run_ms(1_500);
    assert!(world.got.iter().any(|got| got.to == visitor("10.0.0.1:500")));
}

#[test]
fn refused_frames_are_reported_once_in_ten_seconds() {
    let mut world = signing();
    let request = read_parameter(&mut world);
    let mut lines = Vec::new();
    world.ground.report_signing(world.now);
    for _ in 0..1_000 {
        world.send_bytes(address(14_550), &request);
        lines.extend(world.ground.report_signing(world.now));
        world.step();
    }
    assert_eq!(
        lines,
        [LogLine::Refused("Signing refused unsigned messages (1 so far)".to_owned())]
    );
    world.settle();
    assert_eq!(world.texts().iter().filter(|text| text.contains("Signing refused")).count(), 1);
}

/// PING to all systems.
fn ping(number: u8) -> Vec<u8> {
    frame(4, 237, &[0, 0, 0, 0, 0, 0, 0, 0, number, 0, 0, 0, 0, 0])
}

/// Attacks of a hostile ground station: changes of a signed frame, or other frames in its place.
fn hostile() -> impl Strategy<Value = Vec<u8>> {
    let pieces = prop_oneof![
        Just(vec![0xFD]),
        proptest::collection::vec(any::<u8>(), 0..40),
        (any::<u8>(), any::<u64>(), any::<bool>()).prop_map(|(number, units, is_right)| {
            let key = if is_right { key() } else { Key::new([2; 32]).unwrap() };
            signed(&ping(number), key, units >> 16)
        }),
        any::<u8>().prop_map(ping),
        (any::<u64>(), any::<[u8; 32]>(), any::<u64>()).prop_map(|(at, new, units)| {
            let payload = [&at.to_le_bytes()[..], &[1, 1], &new].concat();
            let mut setup = frame(0, 71, &payload);
            setup[8] = 1;
            signed(&setup, key(), units >> 16)
        }),
    ];
    proptest::collection::vec((pieces, any::<u16>()), 1..20).prop_map(|pieces| {
        pieces
            .into_iter()
            .flat_map(|(mut piece, at)| {
                if at % 4 == 0
                    && let Some(byte) = piece.get_mut(usize::from(at / 4) % 40)
                {
                    *byte ^= 1 << (at % 7);
                }
                piece
            })
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 256, ..ProptestConfig::default() })]

    #[test]
    fn no_input_breaks_signing_and_a_stream_cut_anywhere_gives_what_it_gives_whole(
        bytes in hostile(),
        cuts in proptest::collection::vec(any::<u16>(), 0..6),
    ) {
        let answers = |cuts: &[usize]| {
            let mut world = signing();
            assert!(world.ground.open(Connection(0), true, world.now));
            let tcp = Address::Tcp(Connection(0));
            let mut from = 0;
            for &to in cuts {
                world.send_bytes(tcp, &bytes[from..to]);
                from = to;
            }
            world.send_bytes(tcp, &bytes[from..]);
            let pongs = |got: &&Got| got.to == tcp && got.id == 4;
            (world.got.iter().filter(pongs).count(), world.ground.skipped())
        };
        let mut cuts: Vec<usize> = cuts.iter().map(|cut| usize::from(*cut) % (bytes.len() + 1)).collect();
        cuts.sort_unstable();
        prop_assert_eq!(answers(&cuts), answers(&[]));
    }

    #[test]
    fn one_bit_changed_anywhere_in_a_signed_frame_makes_it_count_for_nothing(
        at in any::<prop::sample::Index>(),
        bit in 0_u8..8,
    ) {
        let mut world = signing();
        let mut bytes = signed(&read_parameter(&mut world), key(), 2_000);
        let at = at.index(bytes.len());
        bytes[at] ^= 1 << bit;
        world.send_bytes(address(14_550), &bytes);
        prop_assert!(world.values(address(14_550)).is_empty());
    }
}

#[test]
fn our_own_signed_messages_sent_back_are_no_replay() {
    let mut world = signing();
    world.run_ms(1_100);
    let own = world.got.iter().find(|got| got.id == 0).unwrap().bytes.clone();
    assert_eq!((own[5], own[6]), (OWN.system, OWN.component));
    world.ground.report_signing(world.now);
    for _ in 0..3 {
        world.send_bytes(address(14_550), &own);
    }
    assert_eq!(world.ground.report_signing(world.now), None);
}
