//! MAVLink FTP as QGroundControl, MAVSDK and MAVProxy use it.

use super::world::*;
use crate::component_metadata::Metadata;
use crate::component_metadata::crc32;
use crate::peers::Address;
use ::mavlink::dialects::common::{
    COMPONENT_METADATA_DATA, FILE_TRANSFER_PROTOCOL_DATA, MavMessage,
};
use ::mavlink::{MavlinkVersion, MessageData};
use flight_management::parameters::Parameters;
use icd::tvc_jet;

const ACK: u8 = 128;
const NAK: u8 = 129;
const DATA_MAX: usize = 239;

/// One answer, as a client receives it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Answer {
    pub(super) sequence: u16,
    pub(super) session: u8,
    pub(super) opcode: u8,
    pub(super) request: u8,
    pub(super) burst_complete: bool,
    pub(super) offset: u32,
    pub(super) data: Vec<u8>,
}

fn parse(data: &FILE_TRANSFER_PROTOCOL_DATA) -> Answer {
    assert_eq!((data.target_system, data.target_component), (255, 190), "back to the sender");
    let p = &data.payload;
    Answer {
        sequence: u16::from_le_bytes([p[0], p[1]]),
        session: p[2],
        opcode: p[3],
        request: p[5],
        burst_complete: p[6] != 0,
        offset: u32::from_le_bytes([p[8], p[9], p[10], p[11]]),
        data: p[12..12 + usize::from(p[4])].to_vec(),
    }
}

/// A request: sequence, session, opcode, size, offset, data.
pub(super) fn request(
    sequence: u16,
    session: u8,
    opcode: u8,
    size: u8,
    offset: u32,
    data: &[u8],
) -> MavMessage {
    let mut payload = [0; 251];
    payload[..2].copy_from_slice(&sequence.to_le_bytes());
    payload[2..5].copy_from_slice(&[session, opcode, size]);
    payload[8..12].copy_from_slice(&offset.to_le_bytes());
    payload[12..12 + data.len()].copy_from_slice(data);
    MavMessage::FILE_TRANSFER_PROTOCOL(FILE_TRANSFER_PROTOCOL_DATA {
        target_network: 0,
        target_system: 1,
        target_component: 1,
        payload,
    })
}

pub(super) fn with_path(sequence: u16, session: u8, opcode: u8, path: &str) -> MavMessage {
    request(sequence, session, opcode, u8::try_from(path.len()).unwrap(), 0, path.as_bytes())
}

pub(super) fn answers(world: &mut World, to: Address) -> Vec<Answer> {
    let got = world.got.iter().filter(|got| got.to == to);
    let answers = got.filter_map(Got::read).map(|data| parse(&data)).collect();
    world.got.clear();
    answers
}

/// The one answer to a message.
pub(super) fn answer_to(world: &mut World, message: &MavMessage) -> Answer {
    world.got.clear();
    world.send(message);
    let answers = answers(world, address(14_550));
    assert_eq!(answers.len(), 1, "{answers:?}");
    answers.into_iter().next().unwrap()
}

pub(super) fn problem(answer: &Answer) -> u8 {
    assert_eq!((answer.opcode, answer.data.len()), (NAK, 1), "{answer:?}");
    answer.data[0]
}

fn open(world: &mut World, sequence: u16, path: &str) -> (u8, usize) {
    let answer = answer_to(world, &with_path(sequence, 0, 4, path));
    assert_eq!((answer.opcode, answer.request, answer.data.len()), (ACK, 4, 4), "{answer:?}");
    let size = u32::from_le_bytes([answer.data[0], answer.data[1], answer.data[2], answer.data[3]]);
    (answer.session, usize::try_from(size).unwrap())
}

fn metadata() -> Metadata {
    Metadata::new(&tvc_jet::effectors(), &Parameters::default())
}

fn content(name: &str) -> Vec<u8> {
    let metadata = metadata();
    let (_, text) = metadata.files().iter().find(|(other, _)| *other == name).unwrap();
    text.as_bytes().to_vec()
}

#[test]
fn an_unknown_file_is_refused_in_the_same_poll_as_mavproxy_needs_it() {
    let mut world = World::flying();
    let answer = answer_to(&mut world, &with_path(41, 77, 4, "@PARAM/param.pck?withdefaults=1"));
    assert_eq!(problem(&answer), 10);
    assert_eq!((answer.sequence, answer.session, answer.request), (42, 77, 4));
}

#[test]
fn the_way_from_the_message_to_every_file_is_open() {
    let mut world = World::flying();
    let encoded = metadata().message(0).frame(crate::codec::OWN, 0);
    let length = usize::from(encoded[1]);
    let message =
        COMPONENT_METADATA_DATA::deser(MavlinkVersion::V2, &encoded[10..10 + length]).unwrap();
    let mut listed = vec![(message.uri.to_str().unwrap().to_owned(), message.file_crc)];
    let mut fetched = 0;
    while let Some((uri, crc)) = listed.pop() {
        let path = uri.strip_prefix("mftp://").unwrap();
        let text = fetch(&mut world, path, 0, 239).0;
        assert_eq!(crc32(&text), crc, "{uri}");
        let file: serde_json::Value = serde_json::from_slice(&text).unwrap();
        for entry in file["metadataTypes"].as_array().into_iter().flatten() {
            let crc = u32::try_from(entry["fileCrc"].as_u64().unwrap()).unwrap();
            listed.push((entry["uri"].as_str().unwrap().to_owned(), crc));
        }
        fetched += 1;
    }
    assert_eq!(fetched, 4);
}

/// Downloads as QGroundControl does: open, burst, gaps, reset. The answer of number `lost` never arrives.
fn fetch(world: &mut World, path: &str, lost: usize, size: u8) -> (Vec<u8>, usize) {
    let mut count = 0;
    let mut passes = || {
        count += 1;
        count != lost
    };
    let mut sequence = 7;
    let session_and_size = (0..3).find_map(|_| {
        let answer = open(world, sequence, path);
        passes().then_some(answer)
    });
    let (session, length) = session_and_size.expect("opened within three tries");
    let mut pieces: Vec<(usize, Vec<u8>)> = Vec::new();
    sequence += 2;
    for _ in 0..3 {
        world.got.clear();
        let next = pieces.last().map_or(0, |(offset, data)| offset + data.len());
        world.send(&request(sequence, session, 15, size, u32::try_from(next).unwrap(), &[]));
        world.run_ms(1_000);
        let arrived: Vec<Answer> =
            answers(world, address(14_550)).into_iter().filter(|_| passes()).collect();
        let ended = arrived.iter().any(|answer| answer.opcode == NAK && answer.data == [6]);
        for answer in arrived.into_iter().filter(|answer| answer.opcode == ACK) {
            assert_eq!(answer.session, session);
            pieces.push((usize::try_from(answer.offset).unwrap(), answer.data));
        }
        if ended {
            break;
        }
    }
    let mut text = vec![None; length];
    for (offset, data) in &pieces {
        for (place, byte) in text[*offset..].iter_mut().zip(data) {
            *place = Some(*byte);
        }
    }
    while let Some(gap) = text.iter().position(Option::is_none) {
        sequence += 2;
        let offset = u32::try_from(gap).unwrap();
        let answer = answer_to(world, &request(sequence, session, 5, size, offset, &[]));
        assert_eq!((answer.opcode, answer.offset), (ACK, offset));
        if passes() {
            for (place, byte) in text[gap..].iter_mut().zip(answer.data) {
                *place = Some(byte);
            }
        }
    }
    assert_eq!(answer_to(world, &request(sequence + 2, 0, 2, 0, 0, &[])).opcode, ACK);
    (text.into_iter().map(Option::unwrap).collect(), count)
}

#[test]
fn whichever_answer_is_lost_the_file_is_whole() {
    let mut world = World::flying();
    let (text, count) = fetch(&mut world, "/actuators.json", 0, 80);
    assert_eq!(text, content("actuators.json"));
    assert!(count > 10, "{count} answers");
    for lost in 1..=count {
        let mut world = World::flying();
        assert_eq!(fetch(&mut world, "/actuators.json", lost, 80).0, text, "{lost} lost");
    }
}

#[test]
fn a_burst_is_paced_ends_with_the_end_of_the_file_and_counts_its_messages() {
    let mut world = World::flying();
    let (session, length) = open(&mut world, 1, "parameter.json");
    assert_eq!(length, content("parameter.json").len());
    // So close to the end that one burst is enough.
    let first = (length / DATA_MAX - 200) * DATA_MAX;
    world.send(&request(3, session, 15, 239, u32::try_from(first).unwrap(), &[]));
    let times: Vec<u64> = {
        world.run_ms(1_000);
        world.got.iter().filter(|got| got.id == 110).map(|got| got.at.as_micros()).collect()
    };
    for (index, time) in times.iter().enumerate() {
        let within = times[..index].iter().filter(|earlier| time - **earlier < 50_000).count();
        assert!(within <= 44, "{within} messages within 50 ms");
    }
    let got = answers(&mut world, address(14_550));
    assert_eq!(got.len(), (length - first).div_ceil(DATA_MAX) + 1);
    for (index, answer) in got.iter().enumerate() {
        assert_eq!(usize::from(answer.sequence), 4 + index);
        assert_eq!(answer.request, 15);
    }
    let last = got.last().unwrap();
    assert_eq!((problem(last), last.offset), (6, u32::try_from(length).unwrap()));
}

#[test]
fn a_repeated_burst_begins_again_and_terminating_its_session_ends_it() {
    let mut world = World::flying();
    let (session, length) = open(&mut world, 1, "parameter.json");
    let burst = request(3, session, 15, 20, 0, &[]);
    world.send(&burst);
    world.run_ms(20);
    assert!(!answers(&mut world, address(14_550)).is_empty());
    world.send(&burst);
    world.run_ms(6);
    let again = answers(&mut world, address(14_550));
    assert_eq!((again[0].sequence, again[0].offset), (4, 0));
    assert_eq!(answer_to(&mut world, &request(5, session, 1, 0, 0, &[])).opcode, ACK);
    world.run_ms(1_000);
    assert!(answers(&mut world, address(14_550)).is_empty());
    assert!(length / 20 > 256, "long enough for the next test");
}

#[test]
fn a_long_burst_stops_with_a_note_that_there_is_more() {
    let mut world = World::flying();
    let (session, _) = open(&mut world, 1, "parameter.json");
    world.send(&request(3, session, 15, 20, 0, &[]));
    world.run_ms(3_000);
    let got = answers(&mut world, address(14_550));
    assert_eq!(got.len(), 256);
    assert!(got.last().unwrap().burst_complete);
    assert_eq!(got.iter().filter(|answer| answer.burst_complete).count(), 1);
}

#[test]
fn a_request_that_comes_again_gets_the_same_answer_and_no_second_session() {
    let mut world = World::flying();
    let message = with_path(9, 0, 4, "/general.json");
    let first = answer_to(&mut world, &message);
    assert_eq!(answer_to(&mut world, &message), first);
    let end = request(11, first.session, 1, 0, 0, &[]);
    let ended = answer_to(&mut world, &end);
    assert_eq!((ended.opcode, answer_to(&mut world, &end)), (ACK, ended.clone()));
    let late = answer_to(&mut world, &request(13, first.session, 5, 239, 0, &[]));
    assert_eq!(problem(&late), 4, "it was the only session");
}

#[test]
fn a_client_that_insists_on_its_number_gets_it() {
    let mut world = World::flying();
    let answer = answer_to(&mut world, &with_path(1, 200, 4, "/general.json"));
    assert_eq!((answer.opcode, answer.session), (ACK, 200));
    let second = answer_to(&mut world, &with_path(3, 200, 4, "/events.json"));
    assert_eq!((second.opcode, second.session), (ACK, 0), "that one is taken");
}

#[test]
fn sessions_are_bounded_and_each_station_has_its_own() {
    let mut world = World::flying();
    for sequence in 0..4 {
        assert_eq!(answer_to(&mut world, &with_path(sequence, 0, 4, "/general.json")).opcode, ACK);
    }
    assert_eq!(problem(&answer_to(&mut world, &with_path(9, 0, 4, "/general.json"))), 5);
    // Another station behind another peer is unaffected, and cannot close them.
    let other = world.encode(STATION, &request(1, 0, 2, 0, 0, &[]));
    world.send_bytes(address(14_540), &other);
    assert_eq!(answers(&mut world, address(14_540)).len(), 1);
    assert_eq!(answer_to(&mut world, &request(11, 3, 5, 10, 0, &[])).opcode, ACK);
    assert_eq!(answer_to(&mut world, &request(13, 0, 2, 0, 0, &[])).opcode, ACK);
    assert_eq!(problem(&answer_to(&mut world, &request(15, 3, 5, 10, 0, &[]))), 4);
}

#[test]
fn a_client_that_falls_silent_is_forgotten() {
    let mut world = World::flying();
    let (session, _) = open(&mut world, 1, "general.json");
    world.now = world.now + core::time::Duration::from_secs(61);
    world.settle();
    assert_eq!(problem(&answer_to(&mut world, &request(3, session, 5, 10, 0, &[]))), 4);
}

#[test]
fn sizes_and_offsets_are_checked() {
    let mut world = World::flying();
    let (session, length) = open(&mut world, 1, "general.json");
    let length = u32::try_from(length).unwrap();
    let mut read = |sequence, size, offset| {
        answer_to(&mut world, &request(sequence, session, 5, size, offset, &[]))
    };
    assert_eq!(read(3, 255, 0).data.len(), DATA_MAX, "clamped");
    assert_eq!(read(5, 239, length - 3).data.len(), 3);
    assert_eq!(problem(&read(7, 239, length)), 6);
    assert_eq!(problem(&read(9, 239, u32::MAX)), 6);
    assert_eq!(problem(&read(11, 0, 0)), 3);
}

#[test]
fn the_folder_is_listed_with_sizes() {
    let mut world = World::flying();
    for path in ["/", "", "."] {
        let answer = answer_to(&mut world, &with_path(1, 0, 3, path));
        let names: Vec<String> = metadata()
            .files()
            .iter()
            .map(|(name, text)| format!("F{name}\t{}\0", text.len()))
            .chain(["Dscripts\0".to_owned()])
            .collect();
        assert_eq!(answer.data, names.concat().as_bytes(), "{path}");
    }
    assert_eq!(problem(&answer_to(&mut world, &request(3, 0, 3, 1, 5, b"/"))), 6);
    assert_eq!(problem(&answer_to(&mut world, &with_path(5, 0, 3, "/fs/microsd"))), 10);
}

#[test]
fn the_checksum_of_a_file_is_sent() {
    let mut world = World::flying();
    let answer = answer_to(&mut world, &with_path(1, 0, 14, "/parameter.json"));
    assert_eq!(answer.data, crc32(&content("parameter.json")).to_le_bytes());
}

#[test]
fn whatever_would_change_a_file_is_refused_and_so_is_the_unknown() {
    let mut world = World::flying();
    // 7 writes in a session.
    for opcode in [6, 8, 9, 10, 11, 12, 13] {
        let answer = answer_to(&mut world, &with_path(opcode.into(), 0, opcode, "/general.json"));
        assert_eq!(problem(&answer), 9, "opcode {opcode}");
    }
    for opcode in [16, 100, 127] {
        assert_eq!(problem(&answer_to(&mut world, &with_path(1, 0, opcode, "/x"))), 7);
    }
    assert_eq!(answer_to(&mut world, &request(1, 0, 0, 0, 0, &[])).opcode, ACK);
}

#[test]
fn an_answer_of_another_system_is_not_answered() {
    let mut world = World::flying();
    for opcode in [ACK, NAK, 255] {
        world.send(&request(1, 0, opcode, 1, 0, &[1]));
        assert!(answers(&mut world, address(14_550)).is_empty());
    }
}
