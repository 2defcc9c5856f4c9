use super::*;
use ::mavlink::dialects::common::{
    COMMAND_ACK_DATA, HEARTBEAT_DATA, MavCmd, NAMED_VALUE_FLOAT_DATA,
};
use ::mavlink::{MAVLinkV2MessageRaw, MavHeader};
use proptest::prelude::*;

fn heartbeat(sequence: u8) -> Vec<u8> {
    let header = MavHeader { system_id: 255, component_id: 190, sequence };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message_data(header, &HEARTBEAT_DATA::default());
    raw.raw_bytes().to_vec()
}

fn ids(bytes: &[u8]) -> (Vec<u32>, Skipped) {
    let (mut rest, mut skipped) = (bytes, Skipped::default());
    let ids = core::iter::from_fn(|| next_frame(&mut rest, &mut skipped).map(|frame| frame.id));
    (ids.collect(), skipped)
}

#[test]
fn good_frames_behind_bad_ones_are_found_and_the_bad_ones_counted() {
    let mut bad_crc = heartbeat(1);
    *bad_crc.last_mut().unwrap() ^= 1;
    let mut unknown_flag = heartbeat(2);
    unknown_flag[2] = 0x04;
    let mut unknown_id = heartbeat(3);
    unknown_id[7..10].copy_from_slice(&[0xFF, 0xFF, 0x7F]);
    let truncated = vec![0xFD, 200, 0, 0, 0, 255, 190, 0, 0, 0];
    let all = [heartbeat(0), bad_crc, unknown_flag, unknown_id, truncated, heartbeat(4)].concat();
    let (ids, skipped) = ids(&all);
    assert_eq!(ids, [0, 0]);
    assert_eq!((skipped.bad_crc, skipped.unknown_flags, skipped.unknown_id), (1, 1, 1));
    assert!(skipped.truncated >= 1);
}

#[test]
fn a_signed_frame_is_read_and_its_signature_skipped() {
    let mut signed = heartbeat(0);
    signed[2] = 0x01;
    let end = signed.len() - 2;
    let crc = calculate_crc(&signed[1..end], HEARTBEAT_DATA::EXTRA_CRC);
    signed[end..].copy_from_slice(&crc.to_le_bytes());
    signed.extend_from_slice(&[0xFD; 13]);
    assert_eq!(ids(&[signed, heartbeat(1)].concat()), (vec![0, 0], Skipped::default()));
}

#[test]
fn our_frames_are_those_of_the_crate() {
    let data = NAMED_VALUE_FLOAT_DATA { time_boot_ms: 5, value: 1.5, name: "z2_p".into() };
    let header = MavHeader { system_id: 1, component_id: 1, sequence: 9 };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message_data(header, &data);
    assert_eq!(Encoded::new(&data).frame(OWN, 9), raw.raw_bytes());
}

#[test]
fn an_acknowledgement_is_that_of_the_crate_and_carries_any_command() {
    let to = Identity { system: 255, component: 190 };
    let data = COMMAND_ACK_DATA {
        command: MavCmd::MAV_CMD_INJECT_FAILURE,
        result: MavResult::MAV_RESULT_DENIED,
        progress: 0,
        result_param2: 0,
        target_system: 255,
        target_component: 190,
    };
    assert_eq!(Encoded::command_ack(420, data.result, to), Encoded::new(&data));
    let ack = Encoded::command_ack(54_321, MavResult::MAV_RESULT_UNSUPPORTED, to).frame(OWN, 0);
    assert_eq!(ack[10..13], [0x31, 0xD4, 3]);
    let (ids, skipped) = ids(&ack);
    assert_eq!((ids, skipped), (vec![77], Skipped::default()));
}

#[test]
fn missing_trailing_zeros_are_zeros() {
    // COMMAND_LONG 420 with all parameters zero and confirmation zero: 32 bytes on the wire.
    let mut payload = vec![0; 28];
    payload.extend_from_slice(&[0xA4, 0x01, 1, 1]);
    let frame = Frame { sender: OWN, id: 76, payload: &payload, bytes: &[] };
    let (target, message) = decode(&frame).unwrap();
    assert_eq!(target, OWN);
    assert_eq!(
        message,
        Message::Command(CommandMessage { id: 420, params: [0.0; 7], frame: None, xy: None })
    );
}

/// Content of a connection: good frames, and everything else that can occur between them.
fn stream() -> impl Strategy<Value = Vec<u8>> {
    let noise = prop_oneof![2 => any::<u8>(), 1 => Just(0xFD_u8), 1 => Just(0xFE_u8)];
    let piece = prop_oneof![
        4 => any::<u8>().prop_map(heartbeat),
        1 => (any::<u8>(), 0..21_usize).prop_map(|(n, end)| heartbeat(n)[..end].to_vec()),
        1 => (any::<u8>(), 0..21_usize).prop_map(|(n, at)| {
            let mut frame = heartbeat(n);
            frame[at] ^= 0x10;
            frame
        }),
        1 => proptest::collection::vec(noise, 0..40),
    ];
    proptest::collection::vec(piece, 0..30).prop_map(|pieces| pieces.concat())
}

/// Sender, message id and payload.
type Read = (Identity, u32, Vec<u8>);

/// Frames of a stream that arrives in pieces cut at `cuts`, the skipped counts, and the rest.
fn frames_of_pieces(stream: &[u8], cuts: &[usize]) -> (Vec<Read>, Skipped, usize) {
    let mut cuts: Vec<usize> = cuts.iter().map(|cut| cut % (stream.len() + 1)).collect();
    cuts.push(stream.len());
    cuts.sort_unstable();
    let (mut frames, mut skipped, mut begin) = (Vec::new(), Skipped::default(), 0);
    for end in cuts {
        let mut rest = &stream[begin..end];
        while let Some(frame) = next_frame_of_stream(&mut rest, &mut skipped) {
            frames.push((frame.sender, frame.id, frame.payload.to_vec()));
        }
        begin = end - rest.len();
    }
    (frames, skipped, stream.len() - begin)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_stream_cut_anywhere_gives_what_it_gives_whole(
        stream in stream(),
        cuts in proptest::collection::vec(any::<usize>(), 0..60),
    ) {
        let whole = frames_of_pieces(&stream, &[]);
        prop_assert_eq!(&frames_of_pieces(&stream, &cuts), &whole);
        let bytewise: Vec<usize> = (0..stream.len()).collect();
        prop_assert_eq!(&frames_of_pieces(&stream, &bytewise), &whole);
        prop_assert!(whole.2 <= FRAME_MAX + SIGNATURE, "{} bytes wait", whole.2);
    }

    #[test]
    fn a_good_frame_is_found_whatever_stood_before_it(noise in proptest::collection::vec(any::<u8>(), 0..300)) {
        // Enough bytes follow for any frame that the noise may seem to begin.
        let bytes = [noise, heartbeat(1), vec![0; FRAME_MAX + SIGNATURE]].concat();
        let (frames, ..) = frames_of_pieces(&bytes, &[]);
        prop_assert!(frames.iter().any(|(sender, id, _)| (sender.system, *id) == (255, 0)), "{:?}", frames);
    }
}
