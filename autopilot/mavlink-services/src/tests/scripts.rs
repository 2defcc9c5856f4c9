//! Scripts by MAVLink FTP and by command.

use super::ftp::{Answer, answer_to, answers, problem, request, with_path};
use super::params::set_int;
use super::world::*;
use crate::codec::OWN;
use crate::component_metadata::crc32;
use crate::scripts::{FILE_MAX, FILES_MAX};
use ::mavlink::dialects::common::{MavMessage, MavResult};
use flight_management::command::Command;
use flight_management::command::Configuration;
use flight_management::script::Script;
use icd::tvc_jet;
use std::sync::Arc;

const ACK: u8 = 128;
const CREATE: u8 = 6;
const WRITE: u8 = 7;
const USER_3: u16 = 31_012;
const ACCEPTED: MavResult = MavResult::MAV_RESULT_ACCEPTED;
const DENIED: MavResult = MavResult::MAV_RESULT_DENIED;
const LATER: MavResult = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;

pub(super) const CHAIN: &str =
    "at 100 ms: fail left elevator stuck at 10 deg\nafter 50 ms: say Now!\n";
const START: [f32; 7] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
const STOP: [f32; 7] = [0.0; 7];

/// The requests of an upload in order: sequence numbers from `sequence` on, session 0.
fn upload_requests(sequence: u16, path: &str, text: &[u8], size: usize) -> Vec<MavMessage> {
    let mut requests = vec![with_path(sequence, 0, CREATE, path)];
    for (index, part) in text.chunks(size).enumerate() {
        let number = sequence + 1 + u16::try_from(index).unwrap();
        let offset = u32::try_from(index * size).unwrap();
        requests.push(request(number, 0, WRITE, u8::try_from(part.len()).unwrap(), offset, part));
    }
    let last = sequence + u16::try_from(requests.len()).unwrap();
    requests.push(request(last, 0, 1, 0, 0, &[]));
    requests
}

pub(super) fn upload(world: &mut World, path: &str, text: &str) {
    let mut requests = upload_requests(100, path, text.as_bytes(), 239);
    let last = requests.pop().unwrap();
    for message in requests {
        assert_eq!(answer_to(world, &message).opcode, ACK);
    }
    // The texts at the end are for the tests.
    world.send(&last);
}

fn list(world: &mut World, path: &str) -> String {
    String::from_utf8(answer_to(world, &with_path(900, 0, 3, path)).data).unwrap()
}

fn fetch(world: &mut World, path: &str) -> Vec<u8> {
    let opened = answer_to(world, &with_path(700, 0, 4, path));
    assert_eq!(opened.opcode, ACK, "{opened:?}");
    let mut text = Vec::new();
    for number in 701..800 {
        let offset = u32::try_from(text.len()).unwrap();
        let Answer { opcode, data, .. } =
            answer_to(world, &request(number, opened.session, 5, 239, offset, &[]));
        if opcode != ACK {
            break;
        }
        text.extend(data);
    }
    assert_eq!(answer_to(world, &request(800, opened.session, 1, 0, 0, &[])).opcode, ACK);
    text
}

#[test]
fn an_uploaded_script_is_listed_read_back_and_checked() {
    let mut world = World::flying();
    upload(&mut world, "/scripts/chain.txt", CHAIN);
    assert!(world.has_text("Script chain.txt: 2 lines, number 1"), "{:?}", world.texts());
    assert_eq!(list(&mut world, "/scripts"), format!("Fchain.txt\t{}\0", CHAIN.len()));
    assert_eq!(fetch(&mut world, "/scripts/chain.txt"), CHAIN.as_bytes());
    let checked = answer_to(&mut world, &with_path(950, 0, 14, "/scripts/chain.txt"));
    assert_eq!(checked.data, crc32(CHAIN.as_bytes()).to_le_bytes());
}

#[test]
fn an_upload_that_repeats_lost_requests_is_whole() {
    let text = CHAIN.repeat(4);
    let requests = upload_requests(100, "/scripts/a", text.as_bytes(), 80);
    assert!(requests.len() > 4);
    for repeated in 0..requests.len() {
        let mut world = World::flying();
        for (index, message) in requests.iter().enumerate() {
            let first = answer_to(&mut world, message);
            assert_eq!(first.opcode, ACK);
            if index == repeated {
                assert_eq!(answer_to(&mut world, message), first, "number {index} again");
            }
        }
        assert_eq!(fetch(&mut world, "scripts/a"), text.as_bytes(), "{repeated} repeated");
    }
}

#[test]
fn parts_of_an_upload_may_come_in_any_order_and_twice() {
    let text = CHAIN.repeat(4);
    let mut requests = upload_requests(100, "/scripts/a", text.as_bytes(), 50);
    let last = requests.len() - 1;
    requests[1..last].reverse();
    let again = requests[2].clone();
    requests.insert(last, again);
    let mut world = World::flying();
    for message in &requests {
        assert_eq!(answer_to(&mut world, message).opcode, ACK);
    }
    assert_eq!(fetch(&mut world, "scripts/a"), text.as_bytes());
}

#[test]
fn of_two_clients_that_write_the_same_file_the_later_one_goes_on() {
    let mut world = World::flying();
    assert_eq!(answer_to(&mut world, &with_path(1, 0, CREATE, "/scripts/a")).opcode, ACK);
    let other = |world: &mut World, message: &MavMessage| {
        let bytes = world.encode(STATION, message);
        world.got.clear();
        world.send_bytes(address(14_540), &bytes);
        answers(world, address(14_540)).remove(0).opcode
    };
    assert_eq!(other(&mut world, &with_path(1, 0, CREATE, "/scripts/a")), ACK);
    let late = request(2, 0, WRITE, 3, 0, b"end");
    assert_eq!(problem(&answer_to(&mut world, &late)), 4, "no session any more");
    assert_eq!(other(&mut world, &request(2, 0, WRITE, 3, 0, b"say")), ACK);
    // Another file is not affected.
    assert_eq!(answer_to(&mut world, &with_path(3, 7, CREATE, "/scripts/b")).opcode, ACK);
    assert_eq!(answer_to(&mut world, &request(4, 7, WRITE, 3, 0, b"end")).opcode, ACK);
    assert_eq!(fetch(&mut world, "/scripts/a"), b"say");
    assert_eq!(fetch(&mut world, "/scripts/b"), b"end");
}

#[test]
fn only_good_names_in_the_folder_of_the_scripts_can_be_written() {
    let mut world = World::flying();
    for (sequence, path) in (1..).zip([
        "/general.json",
        "/new.txt",
        "/scripts",
        "/scripts/",
        "/scripts/.hidden",
        "/scripts/../x",
        "/scripts/a/b",
        "/scripts/a b",
        "/scripts/abcdefghijklmnopqrstuvwxyz0123456",
        "/other/a",
    ]) {
        for opcode in [CREATE, 11] {
            let answer = answer_to(&mut world, &with_path(sequence, 0, opcode, path));
            assert_eq!(problem(&answer), 9, "{path}");
        }
    }
    assert_eq!(problem(&answer_to(&mut world, &with_path(50, 0, 8, "/general.json"))), 9);
    assert_eq!(problem(&answer_to(&mut world, &with_path(51, 0, 8, "/scripts/a"))), 10);
    assert_eq!(problem(&answer_to(&mut world, &with_path(52, 0, 4, "/scripts/a"))), 10);
    assert_eq!(problem(&answer_to(&mut world, &with_path(53, 0, 3, "/scripts"))), 6, "it is empty");
}

#[test]
fn files_and_their_sizes_are_limited() {
    let mut world = World::flying();
    for number in 0..FILES_MAX {
        upload(&mut world, &format!("/scripts/f{number:02}"), "end");
    }
    let one_more = answer_to(&mut world, &with_path(1, 0, CREATE, "/scripts/one_more"));
    assert_eq!((one_more.opcode, one_more.data), (129, vec![2, 28]), "no space left");
    // A file that exists already can be written again.
    let session = answer_to(&mut world, &with_path(2, 0, CREATE, "/scripts/f00")).session;
    let end = u32::try_from(FILE_MAX).unwrap();
    assert_eq!(answer_to(&mut world, &request(3, session, WRITE, 1, end - 1, b"#")).opcode, ACK);
    for offset in [end, u32::MAX] {
        let beyond = answer_to(&mut world, &request(4, session, WRITE, 1, offset, b"#"));
        assert_eq!(beyond.data, [2, 28]);
    }
    assert_eq!(problem(&answer_to(&mut world, &request(5, session, WRITE, 0, 0, &[]))), 3);
    assert_eq!(problem(&answer_to(&mut world, &request(6, 99, WRITE, 1, 0, b"#"))), 4);
}

#[test]
fn a_script_can_be_written_on_cut_and_removed() {
    let mut world = World::flying();
    upload(&mut world, "/scripts/a", "say one\n");
    let session = answer_to(&mut world, &with_path(1, 0, 11, "/scripts/a")).session;
    let more = request(2, session, WRITE, 8, 8, b"say two\n");
    assert_eq!(answer_to(&mut world, &more).opcode, ACK);
    assert_eq!(answer_to(&mut world, &request(3, session, 1, 0, 0, &[])).opcode, ACK);
    assert_eq!(fetch(&mut world, "/scripts/a"), b"say one\nsay two\n");
    assert_eq!(answer_to(&mut world, &request(4, 0, 12, 10, 8, b"/scripts/a")).opcode, ACK);
    assert_eq!(fetch(&mut world, "/scripts/a"), b"say one\n");
    assert_eq!(answer_to(&mut world, &with_path(5, 0, 8, "/scripts/a")).opcode, ACK);
    assert_eq!(problem(&answer_to(&mut world, &with_path(6, 0, 4, "/scripts/a"))), 10);
}

#[test]
fn a_script_is_started_by_command_and_every_line_is_reported() {
    let mut world = World::flying();
    upload(&mut world, "/scripts/chain.txt", CHAIN);
    world.send_command(USER_3, START);
    assert_eq!(world.take_acks(), [ack(USER_3, ACCEPTED)]);
    assert!(world.has_text("Script began: chain.txt"));
    world.run_ms(90);
    assert!(!world.has_text("Script 1"));
    world.run_ms(100);
    for words in [
        "Script 1: at 100 ms: fail left elevator stuck at 10 deg",
        "Script: Now!",
        "Script done: chain.txt",
    ] {
        assert!(world.has_text(words), "{words}: {:?}", world.texts());
    }
    assert_eq!(world.take_acks(), [], "its requests are not the commands of a station");
}

#[test]
fn scripts_are_numbered_in_the_order_of_their_names_and_zero_is_the_latest() {
    let mut world = World::flying();
    for name in ["b", "c", "a"] {
        upload(&mut world, &format!("/scripts/{name}"), &format!("say I am {name}"));
    }
    for (number, words) in [(0.0, "I am a"), (1.0, "I am a"), (2.0, "I am b"), (3.0, "I am c")] {
        world.got.clear();
        world.send_command(USER_3, [1.0, number, 0.0, 0.0, 0.0, 0.0, 0.0]);
        world.run_ms(10);
        assert_eq!(world.take_acks(), [ack(USER_3, ACCEPTED)]);
        assert!(world.has_text(words), "{number}: {:?}", world.texts());
    }
    for number in [4.0, 1_000.0, 0.5, -1.0] {
        world.send_command(USER_3, [1.0, number, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert_eq!(world.take_acks(), [ack(USER_3, DENIED)], "{number}");
    }
}

#[test]
fn a_bad_script_is_denied_with_its_line_and_its_reason() {
    let mut world = World::flying();
    world.send_command(USER_3, START);
    assert_eq!(world.take_acks(), [ack(USER_3, DENIED)]);
    assert!(world.has_text("Script refused: none is here"));
    upload(&mut world, "/scripts/bad", "say one\nfail elevator stuck\n");
    assert!(
        world.has_text("Script bad, line 2, column 6: `elevator` found"),
        "{:?}",
        world.texts()
    );
    world.got.clear();
    world.take_commands();
    world.send_command(USER_3, START);
    assert_eq!(world.take_acks(), [ack(USER_3, DENIED)]);
    assert!(world.has_text("Script refused: bad, line 2, column 6"), "{:?}", world.texts());
    assert_eq!(world.take_commands(), []);
    assert_eq!(answer_to(&mut world, &with_path(1, 0, CREATE, "/scripts/x")).opcode, ACK);
    assert_eq!(answer_to(&mut world, &request(2, 0, WRITE, 2, 0, &[0xFF, 0xFE])).opcode, ACK);
    assert_eq!(answer_to(&mut world, &request(3, 0, 1, 0, 0, &[])).opcode, ACK);
    world.got.clear();
    world.send_command(USER_3, START);
    assert_eq!(world.take_acks(), [ack(USER_3, DENIED)]);
    assert!(world.has_text("x: no text, byte 1 is not UTF-8"), "{:?}", world.texts());
}

#[test]
fn a_script_can_be_stopped_once_and_gives_way_to_another() {
    let mut world = World::flying();
    upload(&mut world, "/scripts/a", "at 1 min: say late");
    upload(&mut world, "/scripts/b", "at 2 min: say later");
    world.send_command(USER_3, STOP);
    assert_eq!(world.take_acks(), [ack(USER_3, LATER)]);
    world.send_command(USER_3, [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    world.send_command(USER_3, START);
    assert!(world.has_text("Script stopped: a") && world.has_text("Script began: b"));
    world.send_command(USER_3, STOP);
    assert!(world.has_text("Script stopped: b"));
    assert_eq!(world.take_acks(), [ack(USER_3, ACCEPTED); 3]);
}

#[test]
fn without_fault_injection_scripts_with_faults_do_not_start_and_others_do() {
    let mut world = World::flying();
    world.send(&set_int("SYS_FAILURE_EN", 0));
    upload(&mut world, "/scripts/faults", CHAIN);
    upload(&mut world, "/scripts/words", "say only words");
    world.send_command(USER_3, [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(USER_3, DENIED)]);
    assert!(world.has_text("fault injection is off (SYS_FAILURE_EN 0)"), "{:?}", world.texts());
    world.send_command(USER_3, [1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(world.take_acks(), [ack(USER_3, ACCEPTED)]);
}

#[test]
fn fault_injection_that_is_switched_off_under_way_refuses_the_lines_that_follow() {
    let mut world = World::flying();
    upload(&mut world, "/scripts/chain", CHAIN);
    world.send_command(USER_3, START);
    world.take_commands();
    world.send(&set_int("SYS_FAILURE_EN", 0));
    world.run_ms(10);
    assert_eq!(
        world.take_commands(),
        [Command::Configuration(Configuration::FaultInjection(false))]
    );
    world.run_ms(200);
    let words = "Script 1 refused: fault injection is off (SYS_FAILURE_EN 0) (at 100 ms: fail left";
    assert!(world.has_text(words), "{:?}", world.texts());
    assert!(world.has_text("Script: Now!"), "the rest goes on");
}

#[test]
fn without_an_aircraft_nothing_starts_for_now() {
    let mut world = World::waiting();
    world.run_ms(10);
    upload(&mut world, "/scripts/a", "say a");
    world.send_bytes(address(14_550), &command_long(USER_3, START, OWN));
    assert_eq!(world.take_acks(), [ack(USER_3, LATER)]);
}

#[test]
fn the_scenarios_script_is_the_one_to_start_when_none_was_uploaded() {
    let mut world = World::flying();
    let script = Arc::new(
        Script::parse("script of s.toml", "say from the scenario", &tvc_jet::effectors()).unwrap(),
    );
    let mut with_script = World::flying();
    core::mem::swap(&mut world.ground, &mut with_script.ground);
    world.ground = with_script.ground.with_script(Some(script));
    world.send_command(USER_3, START);
    world.run_ms(10);
    assert_eq!(world.take_acks(), [ack(USER_3, ACCEPTED)]);
    assert!(world.has_text("Script: from the scenario"), "{:?}", world.texts());
}

#[test]
fn when_the_latest_file_is_removed_the_one_uploaded_before_it_is_the_latest() {
    let mut world = World::flying();
    let script =
        Arc::new(Script::parse("s", "say from the scenario", &tvc_jet::effectors()).unwrap());
    let mut other = World::flying();
    core::mem::swap(&mut world.ground, &mut other.ground);
    world.ground = other.ground.with_script(Some(script));
    for name in ["c", "b", "a"] {
        upload(&mut world, &format!("/scripts/{name}"), &format!("say I am {name}"));
    }
    let left = [("a", "I am b"), ("b", "I am c"), ("c", "from the scenario")];
    for (number, (removed, words)) in (1..).zip(left) {
        let path = format!("/scripts/{removed}");
        assert_eq!(answer_to(&mut world, &with_path(number, 0, 8, &path)).opcode, ACK);
        world.got.clear();
        world.send_command(USER_3, START);
        world.run_ms(10);
        assert!(world.has_text(words), "without {removed}: {:?}", world.texts());
    }
}

#[test]
fn a_script_does_not_start_before_its_upload_has_ended() {
    let mut world = World::flying();
    let mut requests = upload_requests(1, "/scripts/a", b"say one\nsay two\n", 8);
    let last = requests.pop().unwrap();
    for message in &requests {
        assert_eq!(answer_to(&mut world, message).opcode, ACK);
        for number in [0.0, 1.0] {
            world.got.clear();
            world.send_command(USER_3, [1.0, number, 0.0, 0.0, 0.0, 0.0, 0.0]);
            assert_eq!(world.take_acks(), [ack(USER_3, DENIED)]);
            assert!(world.has_text("Script refused: a: its upload has not ended"));
        }
    }
    assert_eq!(answer_to(&mut world, &last).opcode, ACK);
    world.send_command(USER_3, START);
    assert_eq!(world.take_acks(), [ack(USER_3, ACCEPTED)]);
    // A client that falls silent has not ended its upload.
    assert_eq!(answer_to(&mut world, &with_path(50, 0, 11, "/scripts/a")).opcode, ACK);
    world.now = world.now + core::time::Duration::from_secs(61);
    world.settle();
    world.send_command(USER_3, START);
    assert_eq!(world.take_acks(), [ack(USER_3, DENIED)]);
}

#[test]
fn a_script_of_which_a_part_was_refused_does_not_start_until_it_is_uploaded_again() {
    let mut world = World::flying();
    let end = u32::try_from(FILE_MAX).unwrap();
    assert_eq!(answer_to(&mut world, &with_path(1, 0, CREATE, "/scripts/a")).opcode, ACK);
    assert_eq!(answer_to(&mut world, &request(2, 0, WRITE, 8, 0, b"say one\n")).opcode, ACK);
    assert_eq!(answer_to(&mut world, &request(3, 0, WRITE, 1, end, b"#")).data, [2, 28]);
    world.send(&request(4, 0, 1, 0, 0, &[]));
    assert!(world.has_text("Script a: a part is missing"), "{:?}", world.texts());
    world.send_command(USER_3, START);
    assert_eq!(world.take_acks(), [ack(USER_3, DENIED)]);
    // Further writing does not restore it.
    let session = answer_to(&mut world, &with_path(5, 0, 11, "/scripts/a")).session;
    assert_eq!(answer_to(&mut world, &request(6, session, 1, 0, 0, &[])).opcode, ACK);
    world.send_command(USER_3, START);
    assert_eq!(world.take_acks(), [ack(USER_3, DENIED)]);
    upload(&mut world, "/scripts/a", "say one");
    world.send_command(USER_3, START);
    assert_eq!(world.take_acks(), [ack(USER_3, ACCEPTED)]);
}

#[test]
fn listings_are_computed_again_and_a_repeated_removal_is_acknowledged_for_two_seconds() {
    let mut world = World::flying();
    upload(&mut world, "/scripts/a", "say a");
    let listing = with_path(1, 0, 3, "/scripts");
    let checksum = with_path(2, 0, 14, "/scripts/a");
    let by_other = |world: &mut World, message: &MavMessage| {
        let bytes = world.encode(STATION, message);
        world.send_bytes(address(14_540), &bytes);
    };
    for (question, text) in [(listing, b"say first"), (checksum, b"say other")] {
        let before = answer_to(&mut world, &question);
        for message in upload_requests(1, "/scripts/a", text, 80) {
            by_other(&mut world, &message);
        }
        let after = answer_to(&mut world, &question);
        assert_eq!((before.opcode, after.opcode), (ACK, ACK));
        assert_ne!(before.data, after.data);
    }
    let remove = with_path(7, 0, 8, "/scripts/a");
    assert_eq!(answer_to(&mut world, &remove).opcode, ACK);
    assert_eq!(answer_to(&mut world, &remove).opcode, ACK, "its answer was lost");
    world.run_ms(2_100);
    assert_eq!(problem(&answer_to(&mut world, &remove)), 10, "no such file");
}
