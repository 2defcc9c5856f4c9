use super::*;
use crate::codec::{OWN, Skipped, next_frame};
use ::mavlink::dialects::common::NAMED_VALUE_FLOAT_DATA;

mod streams;

/// `hashlib.sha256(b"two-step").hexdigest()` of Python.
const KEY_HEX: &str = "67c9537996983d5d358e401795b7dc56a88ecccbf958b14b45d4a7e8181e14c4";
/// HEARTBEAT of 255/190, signed with that key on link 7 at 0x0102030405, as pymavlink 2.4.50 writes it:
/// `mav = MAVLink(None, 255, 190); mav.signing.secret_key, .link_id, .timestamp, .sign_outgoing = ...;`
/// `mav.heartbeat_encode(6, 8, 192, 0, 4).pack(mav).hex()`. Its last six bytes are those of
/// `hashlib.sha256(key + frame[:-6]).digest()[:6]`.
const HEARTBEAT_HEX: &str = "fd09010000ffbe000000000000000608c00403038b07050403020100b2bae13747fb";
/// NAMED_VALUE_FLOAT of 1/1 with sequence 9, 5 ms, `z2_p` = 1.5, on link 3, in the same way.
const VALUE_HEX: &str =
    "fd0c0100090101fb0000050000000000c03f7a325f709c29030504030201006cb969b83c30";
/// UNIX time at the start of the process: 1 s before the timestamp of the two frames.
const START_UNIX_US: u64 = 1_420_070_400_000_000 + 0x01_0203_0405 * 10 - 1_000_000;

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect()
}

fn key() -> Key {
    Key::from_hex(KEY_HEX).unwrap()
}

fn now() -> WallTime {
    WallTime::from_micros(0)
}

fn signing() -> Signing {
    let mut signing = Signing::new(Some(START_UNIX_US));
    let setup = SetupSigning { key: Some(key()), initial_timestamp: 0 };
    assert_eq!(signing.set_up(&setup, now()), SetupOutcome::On);
    signing
}

fn admit(signing: &mut Signing, frame: &[u8]) -> Admission {
    let (mut rest, mut skipped) = (frame, Skipped::default());
    let frame = next_frame(&mut rest, &mut skipped).unwrap();
    assert!(rest.is_empty());
    signing.admit(&frame, now())
}

/// The heartbeat signed again, on this link at this time.
fn signed_at(link: u8, units: u64) -> Vec<u8> {
    let frame = &bytes(HEARTBEAT_HEX)[..21];
    let trailer = key().sign(frame, link, Timestamp::new(units).unwrap());
    [frame, &trailer].concat()
}

fn value() -> Encoded {
    Encoded::new(&NAMED_VALUE_FLOAT_DATA { time_boot_ms: 5, value: 1.5, name: "z2_p".into() })
}

#[test]
fn val_our_signature_is_that_of_pymavlink_both_ways() {
    assert_eq!(Key::from_hex(KEY_HEX).unwrap().to_hex(), KEY_HEX);
    let mut signing = signing();
    assert_eq!(admit(&mut signing, &bytes(HEARTBEAT_HEX)), Admission::Accepted);
    let frame = value().signed_frame(OWN, 9, |frame| {
        key().sign(frame, 3, Timestamp::new(0x01_0203_0405).unwrap())
    });
    assert_eq!(frame, bytes(VALUE_HEX));
}

#[test]
fn a_frame_with_any_bit_of_its_signature_changed_is_refused_and_changes_nothing() {
    let mut signing = signing();
    let good = bytes(HEARTBEAT_HEX);
    for at in good.len() - 13..good.len() {
        for bit in 0..8 {
            let mut frame = good.clone();
            frame[at] ^= 1 << bit;
            assert_eq!(admit(&mut signing, &frame), Admission::Refused, "byte {at} bit {bit}");
        }
    }
    assert_eq!(signing.refusals.count(Refusal::WrongSignature), 13 * 8);
    assert_eq!(admit(&mut signing, &good), Admission::Accepted);
    assert_eq!(admit(&mut signing, &good), Admission::Refused, "a second time");
    assert_eq!(signing.refusals.count(Refusal::NotNewer), 1);
}

#[test]
fn a_frame_of_another_key_is_refused() {
    let mut signing = signing();
    let other = SetupSigning { key: Key::new([1; KEY]), initial_timestamp: 0 };
    assert_eq!(signing.set_up(&other, now()), SetupOutcome::On);
    assert_eq!(admit(&mut signing, &bytes(HEARTBEAT_HEX)), Admission::Refused);
    assert_eq!(signing.refusals.count(Refusal::WrongSignature), 1);
}

#[test]
fn a_new_stream_is_at_most_a_minute_behind_and_a_known_one_only_newer() {
    let mut signing = signing();
    let local = signing.local.units();
    assert_eq!(admit(&mut signing, &signed_at(0, local - 6_000_001)), Admission::Refused);
    assert_eq!(admit(&mut signing, &signed_at(0, local - 6_000_000)), Admission::Accepted);
    assert_eq!(admit(&mut signing, &signed_at(1, local)), Admission::Accepted);
    assert_eq!(admit(&mut signing, &signed_at(1, local)), Admission::Refused);
    assert_eq!(admit(&mut signing, &signed_at(0, local - 5_999_999)), Admission::Accepted);
    assert_eq!(signing.refusals.count(Refusal::NewStreamTooOld), 1);
    assert_eq!(signing.refusals.count(Refusal::NotNewer), 1);
}

#[test]
fn unsigned_and_mavlink_1_frames_are_refused_but_radio_status_may_come_unsigned() {
    let mut signing = signing();
    let unsigned = |flags: u8, id: u8, extra: u8| {
        let mut frame = vec![0xFD, 9, flags, 0, 0, 51, 68, id, 0, 0];
        frame.extend([0; 9]);
        let crc = ::mavlink::calculate_crc(&frame[1..], extra);
        [frame, crc.to_le_bytes().to_vec()].concat()
    };
    assert_eq!(admit(&mut signing, &unsigned(0, 0, 50)), Admission::Refused);
    assert_eq!(admit(&mut signing, &unsigned(0, 109, 185)), Admission::Exempt);
    // A signed one is judged by its signature.
    let wrong = [unsigned(1, 109, 185), vec![0; 13]].concat();
    assert_eq!(admit(&mut signing, &wrong), Admission::Refused);
    let mut old = vec![0xFE, 9, 0, 51, 68, 109];
    old.extend([0; 9]);
    let crc = ::mavlink::calculate_crc(&old[1..], 185).to_le_bytes();
    assert_eq!(admit(&mut signing, &[old, crc.to_vec()].concat()), Admission::Refused);
    let count = |refusal| signing.refusals.count(refusal);
    assert_eq!((count(Refusal::Unsigned), count(Refusal::Version1)), (1, 1));
}

#[test]
fn while_off_everything_counts_and_nothing_is_signed() {
    let mut signing = Signing::new(Some(START_UNIX_US));
    let mut wrong = bytes(HEARTBEAT_HEX);
    *wrong.last_mut().unwrap() ^= 1;
    assert_eq!(admit(&mut signing, &wrong), Admission::Accepted);
    assert_eq!(signing.seal(&value(), OWN, 9, 3), value().frame(OWN, 9));
    assert_eq!(Refusal::ALL.map(|kind| signing.refusals.count(kind)), [0; 9]);
}

#[test]
fn times_of_what_is_sent_only_grow_over_all_links_and_follow_calendar_and_the_newest_seen() {
    let mut signing = signing();
    let mut last = Timestamp::ZERO;
    let mut send = |signing: &mut Signing, link| {
        let frame = signing.seal(&value(), OWN, 0, link);
        let (signed, trailer) = frame.split_last_chunk().unwrap();
        let trailer = Trailer(*trailer);
        assert!(key().is_right(signed, trailer));
        assert_eq!((signed[2], trailer.link()), (1, link), "flag and link");
        assert!(trailer.at() > last, "{:?} after {last:?}", trailer.at());
        last = trailer.at();
        last.units()
    };
    let first = send(&mut signing, 0);
    assert_eq!(send(&mut signing, 5), first + 1);
    signing.follow_calendar(WallTime::from_micros(10_000_000));
    assert_eq!(send(&mut signing, 0), 0x01_0203_0405 - 100_000 + 1_000_000 + 1);
    signing.follow_calendar(now());
    let later = send(&mut signing, 0) + 77;
    assert_eq!(admit(&mut signing, &signed_at(0, later)), Admission::Accepted);
    assert_eq!(send(&mut signing, 0), later + 1);
}

#[test]
fn setup_never_turns_time_back_and_zero_turns_signing_off() {
    let mut signing = signing();
    let before = signing.local;
    let later = SetupSigning { key: Some(key()), initial_timestamp: before.units() + 1_000 };
    assert_eq!(signing.set_up(&later, now()), SetupOutcome::StaysOn);
    assert_eq!(signing.local.units(), before.units() + 1_000);
    let earlier = SetupSigning { key: Key::new([1; KEY]), initial_timestamp: 5 };
    assert_eq!(signing.set_up(&earlier, now()), SetupOutcome::On);
    assert_eq!(signing.local.units(), before.units() + 1_000);
    for initial_timestamp in [Timestamp::LATEST.units() + 1, 1 << 48, u64::MAX] {
        let wrong = SetupSigning { key: None, initial_timestamp };
        assert_eq!(signing.set_up(&wrong, now()), SetupOutcome::TimestampOutside);
        assert!(signing.key.is_some());
    }
    let off = SetupSigning { key: Key::new([0; KEY]), initial_timestamp: 0 };
    assert_eq!(signing.set_up(&off, now()), SetupOutcome::Off);
    assert_eq!(signing.set_up(&off, now()), SetupOutcome::StaysOff);
    assert_eq!(admit(&mut signing, &bytes(HEARTBEAT_HEX)), Admission::Accepted);
}

#[test]
fn a_frame_taken_once_is_not_taken_again_after_off_and_on() {
    let mut signing = signing();
    assert_eq!(admit(&mut signing, &bytes(HEARTBEAT_HEX)), Admission::Accepted);
    for key in [None, Some(key())] {
        signing.set_up(&SetupSigning { key, initial_timestamp: 0 }, now());
    }
    assert_eq!(admit(&mut signing, &bytes(HEARTBEAT_HEX)), Admission::Refused);
}

#[test]
fn the_file_gets_a_key_at_once_its_time_each_five_seconds_and_the_last_one_at_the_end() {
    let kept = |change: Option<KeyChange>| match change {
        Some(KeyChange::Keep(record)) => (record.timestamp.units(), record.is_final),
        other => panic!("{other:?}"),
    };
    let mut signing = signing().with_file(None);
    let start = signing.local.units();
    assert_eq!(kept(signing.pop_change()), (start, false));
    signing.follow_calendar(WallTime::from_micros(4_900_000));
    assert_eq!(signing.pop_change(), None);
    signing.follow_calendar(WallTime::from_micros(5_000_000));
    assert_eq!(kept(signing.pop_change()), (start + 500_000, false));
    // A jump is saved at once.
    let jump = start + 9_000_000;
    assert_eq!(admit(&mut signing, &signed_at(0, jump)), Admission::Accepted);
    assert_eq!(kept(signing.pop_change()), (jump, false));
    signing.seal(&value(), OWN, 0, 0);
    assert_eq!(kept(signing.last_change()), (jump + 1, true));
    signing.set_up(&SetupSigning { key: None, initial_timestamp: 0 }, now());
    assert_eq!(signing.pop_change(), Some(KeyChange::Forget));
    signing.follow_calendar(WallTime::from_micros(90_000_000));
    assert_eq!((signing.pop_change(), signing.last_change()), (None, None), "it is off");
}

#[test]
fn after_a_start_time_goes_on_behind_what_was_saved_and_behind_the_calendar() {
    let saved = |ahead: u64, is_final| KeyRecord {
        key: key(),
        timestamp: Timestamp::new(0x01_0203_0405 + ahead).unwrap(),
        accepted: Timestamp::ZERO,
        is_final,
    };
    let started = |record: KeyRecord| {
        let mut signing = Signing::new(Some(START_UNIX_US)).with_file(Some(record));
        signing.follow_calendar(WallTime::from_micros(1_000_000));
        assert!(signing.key.is_some());
        let change = signing.pop_change();
        assert!(
            matches!(change, Some(KeyChange::Keep(KeyRecord { is_final: false, .. }))),
            "from the start on the file marks its time as not the last one: {change:?}"
        );
        signing.local.units() - 0x01_0203_0405
    };
    assert_eq!(started(saved(500, true)), 500);
    assert_eq!(started(saved(500, false)), 500 + 1_000_000);
    let long_ago = KeyRecord { timestamp: Timestamp::ZERO, ..saved(0, false) };
    assert_eq!(started(long_ago), 0, "the calendar");
}

#[test]
fn without_a_file_nothing_is_to_be_written() {
    let mut signing = signing();
    assert_eq!((signing.pop_change(), signing.last_change()), (None, None));
}

/// Content of the key file at `units`.
fn saved(signing: &mut Signing) -> KeyRecord {
    match signing.pop_change() {
        Some(KeyChange::Keep(record)) => record,
        other => panic!("{other:?}"),
    }
}

/// A process that starts with this file, when the calendar is at the two frames.
fn started(record: KeyRecord) -> Signing {
    let unix_us = START_UNIX_US + 1_000_000;
    Signing::new(Some(unix_us)).with_file(Some(record))
}

#[test]
fn after_a_clean_end_no_frame_is_accepted_twice_and_newer_ones_are_at_once() {
    let mut signing = signing().with_file(None);
    let frame = bytes(HEARTBEAT_HEX);
    assert_eq!(admit(&mut signing, &frame), Admission::Accepted);
    let Some(KeyChange::Keep(mut record)) = signing.last_change() else { panic!("no key") };
    // Also without any frame between several starts.
    for _ in 0..3 {
        let mut signing = started(record);
        assert_eq!(admit(&mut signing, &frame), Admission::Refused);
        assert_eq!(admit(&mut signing, &signed_at(0, 0x01_0203_0405)), Admission::Refused);
        assert_eq!(signing.refusals.count(Refusal::BeforeStart), 2);
        let Some(KeyChange::Keep(last)) = signing.last_change() else { panic!("no key") };
        record = last;
    }
    let newer = signed_at(7, 0x01_0203_0405 + 1);
    assert_eq!(admit(&mut started(record), &newer), Admission::Accepted);
}

#[test]
fn after_a_kill_no_frame_is_accepted_twice_and_after_ten_seconds_all_stations_are_served() {
    let at = |s: u64| 0x01_0203_0405 + s * 100_000;
    let mut signing = signing().with_file(None);
    assert_eq!(admit(&mut signing, &signed_at(0, at(0))), Admission::Accepted);
    // Every accepted timestamp reaches the file within five seconds, also where the local time is ahead.
    signing.follow_calendar(WallTime::from_micros(40_000_000));
    let mut record = saved(&mut signing);
    for units in (at(0)..at(30)).step_by(10_000).skip(1) {
        assert_eq!(admit(&mut signing, &signed_at(0, units)), Admission::Accepted);
        let old = record;
        if let Some(KeyChange::Keep(new)) = signing.pop_change() {
            record = new;
        }
        assert!(!record.is_final);
        for record in [old, record] {
            let mut next = started(record);
            assert_eq!(admit(&mut next, &signed_at(0, units)), Admission::Refused, "{units}");
            assert_eq!(admit(&mut next, &signed_at(9, units)), Admission::Refused, "{units}");
            let later = signed_at(0, units + 1_000_001);
            assert_eq!(admit(&mut next, &later), Admission::Accepted, "{units}");
        }
    }
}

#[test]
fn repeated_kills_before_the_first_message_do_not_lengthen_the_wait() {
    let mut signing = signing().with_file(None);
    assert_eq!(admit(&mut signing, &bytes(HEARTBEAT_HEX)), Admission::Accepted);
    let mut record = saved(&mut signing);
    for _ in 0..20 {
        record = saved(&mut started(record));
    }
    assert_eq!(record.floor().units(), 0x01_0203_0405 + 1_000_000);
    // An orderly end in between makes no replay possible.
    let Some(KeyChange::Keep(last)) = started(record).last_change() else { panic!("no key") };
    assert_eq!((last.is_final, last.floor()), (true, record.floor()));
}

#[test]
fn a_clock_more_than_a_day_ahead_moves_nothing_where_the_date_is_known() {
    const DAY: u64 = 24 * 3600 * 100_000;
    let year_ahead = |signing: &Signing| signing.local.units() + 365 * DAY;
    let mut signing = signing();
    let (before, ahead) = (signing.local, year_ahead(&signing));
    for key in [Some(key()), None, Key::new([1; KEY])] {
        let wrong = SetupSigning { key, initial_timestamp: ahead };
        assert_eq!(signing.set_up(&wrong, now()), SetupOutcome::DayAhead);
    }
    assert_eq!(admit(&mut signing, &signed_at(0, ahead)), Admission::Refused);
    assert_eq!(admit(&mut signing, &signed_at(0, before.units() + DAY + 1)), Admission::Refused);
    assert_eq!((signing.refusals.count(Refusal::DayAhead), signing.local), (2, before));
    assert_eq!(admit(&mut signing, &bytes(HEARTBEAT_HEX)), Admission::Accepted);
    // A computer that does not know the date follows the timestamps of its peers.
    let mut signing = Signing::new(Some(5));
    let first = SetupSigning { key: Some(key()), initial_timestamp: ahead };
    assert_eq!(signing.set_up(&first, now()), SetupOutcome::On);
    assert_eq!(admit(&mut signing, &signed_at(0, ahead + 2 * DAY)), Admission::Accepted);
}
