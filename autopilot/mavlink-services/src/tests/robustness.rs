use super::world::*;
use crate::codec::OWN;
use ::mavlink::dialects::common::{HEARTBEAT_DATA, MavMessage};
use ::mavlink::{MAVLinkV1MessageRaw, MavHeader};
use proptest::prelude::*;

#[test]
fn a_mavlink_1_peer_is_understood_and_answered_in_mavlink_2() {
    let mut world = World::flying();
    let header = MavHeader { system_id: 255, component_id: 190, sequence: 0 };
    let mut raw = MAVLinkV1MessageRaw::new();
    raw.serialize_message(header, &super::params::set_real("OBS_W0", 40.0));
    world.send_bytes(address(9_999), raw.raw_bytes());
    let values = world.values(address(9_999));
    assert_eq!(values.len(), 1);
    assert_eq!(values[0].param_value, 40.0);
}

#[test]
fn a_visitor_gets_telemetry_until_it_falls_silent() {
    let mut world = World::flying();
    let beat = world.encode(STATION, &MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
    world.send_bytes(address(9_999), &beat);
    world.got.clear();
    world.run_ms(9_000);
    assert!(world.got.iter().any(|got| got.to == address(9_999)));
    world.run_ms(2_000);
    world.got.clear();
    world.run_ms(2_000);
    assert!(world.got.iter().all(|got| got.to != address(9_999)));
}

#[test]
fn noise_makes_no_sender_a_peer() {
    let mut world = World::flying();
    world.send_bytes(address(9_999), &[0xFD; 300]);
    world.run_ms(2_000);
    assert!(world.got.iter().all(|got| got.to != address(9_999)));
}

#[test]
fn our_own_messages_sent_back_are_ignored() {
    let mut world = World::flying();
    let ping = MavMessage::PARAM_REQUEST_LIST(Default::default());
    let echo = world.encode(OWN, &ping);
    world.send_bytes(address(14_550), &echo);
    world.run_ms(500);
    assert!(world.values(address(14_550)).is_empty());
}

#[test]
fn a_flood_that_changes_nothing_becomes_no_intent_and_bounded_output() {
    let mut world = World::flying();
    world.take_commands();
    let mut sent = 0_usize;
    for i in 0..1_000_u16 {
        let mut datagram = command_long(50_000 + i % 100, [f32::NAN; 7], OWN);
        datagram.extend(command_long(186, [f32::NAN; 7], OWN));
        datagram.extend_from_slice(&[0xFD, 255, 0, 0]);
        world.send_bytes(address(9_000 + i % 50), &datagram);
        if i % 4 == 0 {
            world.step();
        }
        sent += world.got.len();
        world.got.clear();
    }
    assert!(world.take_commands().is_empty());
    // At most 14 visitors get in; two acknowledgements a datagram, texts limited, half a second of
    // telemetry for 16 peers.
    assert!(sent < 12_000, "{sent} frames");
}

fn garbage() -> impl Strategy<Value = Vec<u8>> {
    let byte =
        prop_oneof![3 => any::<u8>(), 1 => Just(0xFD_u8), 1 => Just(0xFE_u8), 1 => Just(0_u8)];
    proptest::collection::vec(byte, 0..2048)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 256, ..ProptestConfig::default() })]

    #[test]
    fn garbage_changes_nothing(bytes in garbage()) {
        let mut world = World::waiting();
        world.settle();
        world.send_bytes(address(14_550), &bytes);
        world.step();
        prop_assert!(world.take_commands().is_empty());
    }

    #[test]
    fn a_good_frame_behind_anything_that_is_no_frame_is_found(noise in proptest::collection::vec(0_u8..0xFD, 0..300)) {
        let mut world = World::flying();
        let mut datagram = noise;
        datagram.extend(command_long(54_321, [0.0; 7], OWN));
        world.send_bytes(address(14_550), &datagram);
        prop_assert_eq!(world.take_acks().len(), 1);
    }

    #[test]
    fn any_message_with_any_payload_is_survived(
        id in prop_oneof![Just(0_u8), Just(4), Just(11), Just(20), Just(21), Just(23), Just(69), Just(70), Just(75), Just(76), Just(82), Just(84), Just(86), Just(111)],
        mut payload in proptest::collection::vec(any::<u8>(), 1..255),
    ) {
        // Addressed to us, wherever the target stands.
        for place in [4, 5, 30, 31, 36, 37, 12, 13, 0, 1, 2, 3] {
            if let (Some(byte), true) = (payload.get_mut(place), place > 3) {
                *byte = 1;
            }
        }
        use ::mavlink::Message as _;
        let mut world = World::flying();
        let bytes = frame(id, MavMessage::extra_crc(u32::from(id)), &payload);
        for cut in [bytes.len(), bytes.len() - 1, bytes.len() / 2] {
            world.send_bytes(address(14_550), &bytes[..cut]);
        }
        world.run_ms(20);
    }
}
