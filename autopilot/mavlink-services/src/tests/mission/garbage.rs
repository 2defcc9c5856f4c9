//! Messages of the protocol in any order and with any bytes.

use super::client::*;
use crate::tests::world::*;
use proptest::prelude::*;

/// Id and extra checksum of what ground stations send.
const MESSAGES: [(u8, u8); 11] = [
    (38, 9),
    (39, 254),
    (40, 230),
    (41, 28),
    (43, 132),
    (44, 221),
    (45, 232),
    (47, 153),
    (51, 196),
    (73, 38),
    (37, 212),
];

/// For the autopilot: offset of the target in the payload of each.
const TARGETS: [usize; 11] = [4, 32, 2, 2, 0, 2, 0, 0, 2, 32, 4];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn whatever_came_before_a_plan_can_be_uploaded_and_read(
        messages in prop::collection::vec(
            (0..MESSAGES.len(), prop::collection::vec(any::<u8>(), 38), any::<bool>(), 0_u32..40),
            1..40,
        ),
    ) {
        let mut client = Client::new(MAVSDK);
        for (which, mut payload, small, wait) in messages {
            let at = TARGETS[which];
            payload[at] = 1;
            payload[at + 1] = 1;
            if small {
                // Likely numbers: counts, items and lists that exist.
                payload.iter_mut().enumerate().filter(|(i, _)| *i != at && *i != at + 1).for_each(
                    |(_, byte)| *byte %= 3,
                );
            }
            let (id, extra) = MESSAGES[which];
            let bytes = frame(id, extra, &payload);
            client.world.send_bytes(client.address, &bytes);
            let answers = client.world.got.iter().filter(|got| [40, 44, 47, 51, 73].contains(&got.id));
            let answers = answers.filter(|got| got.to == client.address).count();
            prop_assert!(answers <= 1, "{answers} answers to message {id}");
            client.world.got.clear();
            client.world.run_ms(wait);
            client.world.got.clear();
        }
        prop_assert_eq!(client.upload(&waypoints(3)).map(|(result, _)| result), Some(ACCEPTED));
        let got = client.download().map(|(items, _)| bytes(&items));
        prop_assert_eq!(got, Some(bytes(&waypoints(3))));
    }
}

#[test]
fn a_list_that_does_not_exist_is_refused_by_its_own_number() {
    let mut world = World::flying();
    // MISSION_COUNT of three items for the list 7.
    world.send_bytes(address(14_550), &frame(44, 221, &[3, 0, 1, 1, 7]));
    let acks: Vec<&Got> = world.got.iter().filter(|got| got.id == 47).collect();
    assert_eq!(acks.len(), 1);
    assert_eq!(acks[0].payload, [255, 190, 3, 7], "UNSUPPORTED, list 7");
}
