//! The log service, with a disk that the test controls.

use std::collections::BTreeMap;

use super::world::*;
use crate::codec::Identity;
use crate::logs::{Erased, LogDone, LogFile, LogJob, LogOutcome, LogTask};
use crate::peers::Address;
use ::mavlink::dialects::common::{
    LOG_DATA_DATA, LOG_ENTRY_DATA, LOG_ERASE_DATA, LOG_REQUEST_DATA_DATA, LOG_REQUEST_END_DATA,
    LOG_REQUEST_LIST_DATA, MavMessage,
};

const ALL: u32 = u32::MAX;

/// A world with a disk.
struct Flight {
    world: World,
    files: BTreeMap<String, Vec<u8>>,
    /// The log of the flight under way.
    open: Option<String>,
    reads: usize,
    is_slow: bool,
}

fn name(number: u32) -> String {
    format!("20261121-08{number:02}00-0123abcd.ulg")
}

/// Different in every byte position that a message could confuse.
fn content(number: u32, size: usize) -> Vec<u8> {
    (0..size).map(|i| u8::try_from((i * 7 + i / 90 + number as usize) % 251).unwrap()).collect()
}

impl Flight {
    /// With logs of these sizes.
    fn with(sizes: &[usize]) -> Self {
        let mut world = World::flying();
        world.ground.open_log_folder();
        let files = (0..).zip(sizes).map(|(n, size)| (name(n), content(n, *size))).collect();
        Self { world, files, open: None, reads: 0, is_slow: false }
    }

    fn do_job(&mut self, LogJob { number, task }: LogJob) {
        let result = match task {
            LogTask::List => Ok(LogOutcome::Listed(
                self.files
                    .iter()
                    .map(|(name, bytes)| LogFile {
                        name: name.clone(),
                        size: u32::try_from(bytes.len()).unwrap(),
                        utc_s: 1_795_248_000,
                    })
                    .collect(),
            )),
            LogTask::Read { name, offset, length } => {
                self.reads += 1;
                let file = self.files.get(&name).ok_or_else(|| "no such file".to_owned());
                file.map(|file| {
                    let from = usize::try_from(offset).unwrap().min(file.len());
                    LogOutcome::Read(file[from..file.len().min(from + length)].to_vec())
                })
            }
            LogTask::Erase => {
                let before = self.files.len();
                let open = self.open.clone();
                self.files.retain(|name, _| Some(name) == open.as_ref());
                let in_use = self.files.len();
                Ok(LogOutcome::Erased(Erased { removed: before - in_use, in_use, failed: 0 }))
            }
        };
        self.world.ground.handle_log_done(LogDone { number, result }, self.world.now);
    }

    fn run_ms(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds / 2 {
            if !self.is_slow
                && let Some(job) = self.world.ground.pop_log_job()
            {
                self.do_job(job);
            }
            self.world.step();
        }
    }

    fn send_from(&mut self, port: u16, message: &MavMessage) {
        let bytes = self.world.encode(STATION, message);
        self.world.send_bytes(address(port), &bytes);
    }

    fn request_list(&mut self, start: u16, end: u16) {
        self.world.send(&list(start, end));
    }

    fn request(&mut self, id: u16, ofs: u32, count: u32) {
        self.world.send(&data(id, ofs, count));
    }

    fn entries(&self, to: Address) -> Vec<LOG_ENTRY_DATA> {
        self.world.got.iter().filter(|got| got.to == to).filter_map(Got::read).collect()
    }

    fn data(&self, to: Address) -> Vec<LOG_DATA_DATA> {
        self.world.got.iter().filter(|got| got.to == to).filter_map(Got::read).collect()
    }
}

fn list(start: u16, end: u16) -> MavMessage {
    let data = LOG_REQUEST_LIST_DATA { start, end, target_system: 1, target_component: 1 };
    MavMessage::LOG_REQUEST_LIST(data)
}

fn data(id: u16, ofs: u32, count: u32) -> MavMessage {
    let (target_system, target_component) = (1, 1);
    let data = LOG_REQUEST_DATA_DATA { ofs, count, id, target_system, target_component };
    MavMessage::LOG_REQUEST_DATA(data)
}

fn erase() -> MavMessage {
    MavMessage::LOG_ERASE(LOG_ERASE_DATA { target_system: 1, target_component: 1 })
}

fn end() -> MavMessage {
    MavMessage::LOG_REQUEST_END(LOG_REQUEST_END_DATA { target_system: 1, target_component: 1 })
}

/// The bytes from `from` on, if the messages follow each other.
fn joined(id: u16, from: u32, messages: &[LOG_DATA_DATA]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for message in messages {
        assert_eq!((message.id, message.ofs), (id, from + u32::try_from(bytes.len()).unwrap()));
        bytes.extend_from_slice(&message.data[..usize::from(message.count)]);
    }
    bytes
}

const STATION_PORT: u16 = 14_550;

#[test]
fn every_log_is_listed_with_its_number_size_and_time() {
    let mut flight = Flight::with(&[100, 0, 7_000_000]);
    flight.request_list(0, 0xFFFF);
    flight.run_ms(50);
    let entries = flight.entries(address(STATION_PORT));
    let entries: Vec<_> =
        entries.iter().map(|e| (e.id, e.size, e.num_logs, e.last_log_num, e.time_utc)).collect();
    let entry = |id, size| (id, size, 3, 2, 1_795_248_000);
    assert_eq!(entries, [entry(0, 100), entry(1, 0), entry(2, 7_000_000)]);
    assert_eq!(flight.entries(address(14_540)), [], "only the requesting station gets them");
    flight.world.got.clear();
    flight.request_list(1, 1);
    flight.run_ms(50);
    assert_eq!(flight.entries(address(STATION_PORT)).len(), 1, "a missed entry");
}

#[test]
fn without_logs_one_empty_entry_is_sent_with_a_folder_and_without() {
    let mut flight = Flight::with(&[]);
    flight.request_list(0, 0xFFFF);
    flight.run_ms(50);
    assert_eq!(flight.entries(address(STATION_PORT)), [LOG_ENTRY_DATA::DEFAULT]);
    let mut world = World::flying();
    world.send(&list(0, 0xFFFF));
    let entries: Vec<LOG_ENTRY_DATA> = world.got.iter().filter_map(Got::read).collect();
    assert_eq!(entries, [LOG_ENTRY_DATA::DEFAULT]);
    world.send(&data(0, 0, ALL));
    world.send(&erase());
    world.run_ms(20);
    assert!(world.has_text("no log folder"));
}

#[test]
fn a_log_comes_whole_in_messages_of_90_bytes_with_an_end() {
    for size in [1, 89, 90, 91, 180, 65_520, 65_521, 200_000] {
        let mut flight = Flight::with(&[10, size]);
        flight.request_list(0, 0xFFFF);
        flight.request(1, 0, ALL);
        flight.run_ms(1000);
        let got = flight.data(address(STATION_PORT));
        assert_eq!(joined(1, 0, &got), content(1, size), "{size}");
        let last = got.last().unwrap().count;
        assert!(last < 90, "MAVProxy knows the end of {size} bytes by a message that is not full");
        assert!(got[..got.len() - 1].iter().all(|message| message.count == 90));
    }
}

#[test]
fn a_range_gives_exactly_its_bytes_as_qgroundcontrol_and_mavsdk_count_them() {
    let mut flight = Flight::with(&[180 * 512]);
    flight.request_list(0, 0xFFFF);
    flight.run_ms(20);
    let whole = content(0, 180 * 512);
    for (offset, count) in [(0, 90 * 512), (90 * 512, 90 * 512), (450, 90), (90, 91), (7, 5)] {
        flight.world.got.clear();
        flight.request(0, offset, count);
        flight.run_ms(300);
        let got = flight.data(address(STATION_PORT));
        let (from, to) = (offset as usize, (offset + count) as usize);
        assert_eq!(joined(0, offset, &got), whole[from..to], "{offset} {count}");
        assert!(got.iter().all(|message| message.count > 0), "nothing behind a range");
    }
}

#[test]
fn requests_without_a_meaning_are_answered_with_nothing_or_a_text() {
    let mut flight = Flight::with(&[100]);
    for (id, offset, count) in [(0, 100, 90), (0, 5000, ALL), (0, 0, 0), (1, 0, ALL), (99, 7, 9)] {
        flight.world.got.clear();
        flight.request(id, offset, count);
        flight.run_ms(50);
        let got = flight.data(address(STATION_PORT));
        let got: Vec<_> = got.iter().map(|m| (m.id, m.ofs, m.count)).collect();
        assert_eq!(got, [(id, offset, 0)]);
        assert_eq!(flight.world.has_text("no such log"), id > 0);
    }
    for (start, end) in [(5, 9), (0xFFFF, 0xFFFF), (1, 0)] {
        flight.world.got.clear();
        flight.request_list(start, end);
        flight.run_ms(50);
        assert!(flight.world.has_text("there are 0 to 0"), "{start} {end}");
    }
    flight.world.got.clear();
    flight.world.send(&end());
    flight.run_ms(50);
    assert_eq!(flight.data(address(STATION_PORT)).len(), 0);
}

#[test]
fn the_end_stops_a_download_and_a_new_request_takes_its_place() {
    let mut flight = Flight::with(&[1_000_000, 500]);
    flight.request(0, 0, ALL);
    flight.run_ms(40);
    assert!(!flight.data(address(STATION_PORT)).is_empty());
    flight.world.send(&end());
    flight.world.got.clear();
    flight.run_ms(40);
    assert_eq!(flight.data(address(STATION_PORT)), []);
    flight.request(0, 0, ALL);
    flight.run_ms(40);
    flight.world.got.clear();
    flight.request(1, 0, ALL);
    flight.run_ms(40);
    let mut got = flight.data(address(STATION_PORT));
    got.retain(|message| message.id == 1);
    assert_eq!(joined(1, 0, &got), content(1, 500));
    flight.world.got.clear();
    flight.run_ms(100);
    assert_eq!(flight.data(address(STATION_PORT)), [], "the other one is over");
}

#[test]
fn a_late_answer_of_the_disk_is_not_taken_for_another() {
    let mut flight = Flight::with(&[1000, 2000]);
    flight.request_list(0, 0xFFFF);
    flight.run_ms(20);
    flight.request(0, 0, ALL);
    let late = flight.world.ground.pop_log_job().unwrap();
    flight.world.send(&end());
    flight.request(1, 0, ALL);
    flight.do_job(late);
    flight.run_ms(100);
    assert_eq!(joined(1, 0, &flight.data(address(STATION_PORT))), content(1, 2000));
}

#[test]
fn twenty_gaps_in_a_row_are_all_filled_as_mavproxy_requests_them() {
    let mut flight = Flight::with(&[100_000]);
    flight.request_list(0, 0xFFFF);
    flight.run_ms(20);
    flight.world.got.clear();
    for gap in 0..20 {
        flight.request(0, gap * 1800, 90);
    }
    flight.run_ms(100);
    let got = flight.data(address(STATION_PORT));
    let offsets: Vec<_> = got.iter().map(|message| message.ofs).collect();
    assert_eq!(offsets, (0..20).map(|gap| gap * 1800).collect::<Vec<_>>());
}

#[test]
fn numbers_keep_their_logs_until_the_list_is_requested_again() {
    let mut flight = Flight::with(&[1000, 2000]);
    flight.request_list(0, 0xFFFF);
    flight.run_ms(20);
    // An older one appears, as from another process: with a new list, it would be number 0.
    flight.files.insert("20251121-080000-0123abcd.ulg".to_owned(), vec![1; 50]);
    flight.files.insert(name(7), vec![2; 70]);
    flight.request(0, 0, ALL);
    flight.run_ms(50);
    assert_eq!(joined(0, 0, &flight.data(address(STATION_PORT))), content(0, 1000));
    flight.world.got.clear();
    flight.request_list(1, 1);
    flight.run_ms(50);
    let entry = &flight.entries(address(STATION_PORT))[0];
    assert_eq!((entry.size, entry.num_logs), (2000, 2), "a missed entry is of the same list");
    flight.world.got.clear();
    flight.request_list(0, 0xFFFF);
    flight.run_ms(50);
    let sizes: Vec<_> = flight.entries(address(STATION_PORT)).iter().map(|e| e.size).collect();
    assert_eq!(sizes, [50, 1000, 2000, 70]);
}

#[test]
fn the_log_of_the_flight_under_way_comes_as_far_as_it_was_listed() {
    let mut flight = Flight::with(&[1000]);
    flight.request_list(0, 0xFFFF);
    flight.run_ms(20);
    flight.files.insert(name(0), content(0, 5000));
    flight.request(0, 0, ALL);
    flight.run_ms(50);
    assert_eq!(joined(0, 0, &flight.data(address(STATION_PORT))), content(0, 1000));
}

#[test]
fn erasing_removes_all_but_the_log_under_way_and_reports_the_count() {
    let mut flight = Flight::with(&[1000, 2000, 3000]);
    flight.open = Some(name(2));
    flight.request_list(0, 0xFFFF);
    flight.run_ms(20);
    flight.request(0, 0, ALL);
    for _ in 0..50 {
        flight.world.send(&erase());
    }
    flight.request_list(0, 0xFFFF);
    flight.world.got.clear();
    flight.run_ms(100);
    assert!(flight.world.has_text("2 logs erased, 1 still written"));
    assert_eq!(flight.world.texts().len(), 1, "fifty requests are one");
    let sizes: Vec<_> = flight.entries(address(STATION_PORT)).iter().map(|e| e.size).collect();
    assert_eq!(sizes, [3000]);
    assert_eq!(flight.data(address(STATION_PORT)), [], "its download is over");
}

#[test]
fn a_log_that_is_gone_or_shorter_is_reported_and_no_bytes_are_invented() {
    let mut flight = Flight::with(&[1000, 2000]);
    flight.request_list(0, 0xFFFF);
    flight.run_ms(20);
    flight.files.remove(&name(0));
    flight.files.insert(name(1), vec![1; 10]);
    flight.request(0, 0, ALL);
    flight.run_ms(50);
    assert_eq!(flight.world.texts(), ["Log 0 is gone"], "one message, without words of the system");
    let end = |flight: &mut Flight| {
        let got = flight.data(address(STATION_PORT));
        flight.world.got.clear();
        got.iter().map(|m| (m.id, m.ofs, m.count)).collect::<Vec<_>>()
    };
    assert_eq!(end(&mut flight), [(0, 0, 0)], "whoever waits learns that nothing comes");
    flight.request(1, 0, ALL);
    flight.run_ms(50);
    assert!(flight.world.has_text("Log 1 has become shorter"));
    assert_eq!(end(&mut flight), [(1, 0, 0)]);
    flight.run_ms(50);
    assert_eq!(end(&mut flight), []);
}

#[test]
fn two_ground_stations_share_the_rate_and_each_gets_its_log() {
    let mut flight = Flight::with(&[90_000, 80_000]);
    flight.send_from(STATION_PORT, &data(0, 0, ALL));
    flight.send_from(14_540, &data(1, 0, ALL));
    flight.run_ms(100);
    let [one, two] = [STATION_PORT, 14_540].map(|port| flight.data(address(port)).len());
    assert!(one > 100 && one.abs_diff(two) <= 60, "{one} {two}");
    flight.run_ms(1000);
    assert_eq!(joined(0, 0, &flight.data(address(STATION_PORT))), content(0, 90_000));
    assert_eq!(joined(1, 0, &flight.data(address(14_540))), content(1, 80_000));
}

#[test]
fn a_request_for_a_whole_log_by_datagram_gets_a_quarter_of_the_rate() {
    let count = |requested| {
        let mut flight = Flight::with(&[2_000_000]);
        flight.request_list(0, 0xFFFF);
        flight.run_ms(20);
        flight.request(0, 0, requested);
        flight.run_ms(50);
        flight.data(address(STATION_PORT)).len()
    };
    let (all, piece) = (count(ALL), count(46_080));
    assert!((110..=140).contains(&all) && (460..=512).contains(&piece), "{all} {piece}");
}

#[test]
fn a_ground_station_that_takes_nothing_delays_no_other_and_gets_its_answers_first() {
    let mut flight = Flight::with(&[90_000]);
    flight.world.stuck.push(address(STATION_PORT));
    flight.send_from(STATION_PORT, &data(0, 0, ALL));
    flight.send_from(14_540, &data(0, 0, ALL));
    flight.run_ms(600);
    assert_eq!(joined(0, 0, &flight.data(address(14_540))), content(0, 90_000));
    assert_eq!(flight.data(address(STATION_PORT)), []);
    flight.world.send_command(176, [1.0, 4.0, 3.0, 0.0, 0.0, 0.0, 0.0]);
    flight.world.got.clear();
    flight.world.stuck.clear();
    flight.world.settle();
    let ids: Vec<u32> = flight
        .world
        .got
        .iter()
        .filter(|got| got.to == address(STATION_PORT))
        .map(|got| got.id)
        .collect();
    let ack = ids.iter().position(|id| *id == 77).unwrap();
    let first = ids.iter().position(|id| *id == 120).unwrap();
    assert!(ack < first, "{ids:?}");
    flight.run_ms(600);
    assert_eq!(joined(0, 0, &flight.data(address(STATION_PORT))), content(0, 90_000));
}

#[test]
fn a_slow_disk_holds_up_nothing_else() {
    let mut flight = Flight::with(&[1000]);
    flight.is_slow = true;
    flight.request_list(0, 0xFFFF);
    flight.request(0, 0, ALL);
    flight.world.got.clear();
    flight.run_ms(2000);
    assert!(flight.world.got.iter().filter(|got| got.id == 0).count() >= 2, "heartbeats");
    assert!(flight.data(address(STATION_PORT)).is_empty());
    flight.is_slow = false;
    flight.run_ms(100);
    assert_eq!(joined(0, 0, &flight.data(address(STATION_PORT))), content(0, 1000));
}

#[test]
fn a_download_reads_in_blocks_and_ends_when_the_client_is_silent() {
    let mut flight = Flight::with(&[20_000_000]);
    flight.request(0, 0, ALL);
    flight.run_ms(500);
    assert!((1..10).contains(&flight.reads), "{}", flight.reads);
    // The configured address is always known, so only its silence ends it.
    flight.run_ms(65_000);
    flight.world.got.clear();
    flight.run_ms(100);
    assert_eq!(flight.data(address(STATION_PORT)), []);
}

#[test]
fn requests_for_another_system_and_floods_of_clients_do_no_harm() {
    let mut flight = Flight::with(&[1000]);
    let other = LOG_REQUEST_LIST_DATA { start: 0, end: 9, target_system: 9, target_component: 1 };
    flight.world.send(&MavMessage::LOG_REQUEST_LIST(other));
    flight.run_ms(20);
    assert_eq!(flight.entries(address(STATION_PORT)), []);
    let visitor = Identity { system: 7, component: 7 };
    for port in 20_000..20_060 {
        let bytes = flight.world.encode(visitor, &data(0, 0, ALL));
        flight.world.send_bytes(address(port), &bytes);
    }
    flight.run_ms(200);
    let served = (20_000..20_060).filter(|port| !flight.data(address(*port)).is_empty()).count();
    assert_eq!(served, 16, "the limit of clients");
}

#[test]
fn a_log_erased_by_another_ends_a_download_under_way_with_a_message_without_bytes() {
    let mut flight = Flight::with(&[1_000_000]);
    flight.request(0, 0, ALL);
    flight.run_ms(50);
    let erase = erase();
    flight.send_from(14_540, &erase);
    flight.run_ms(1_000);
    let got = flight.data(address(STATION_PORT));
    let last = got.last().unwrap();
    assert_eq!((last.id, last.count), (0, 0));
    assert_eq!(joined(0, 0, &got), content(0, 1_000_000)[..last.ofs as usize]);
    assert!(last.ofs < 1_000_000 && flight.world.has_text("Log 0 is gone"));
}

#[test]
fn listing_the_logs_takes_no_place_of_a_download() {
    let mut flight = Flight::with(&[100_000]);
    let visitor = Identity { system: 7, component: 7 };
    let request = |flight: &mut Flight, port, message: &MavMessage| {
        let bytes = flight.world.encode(visitor, message);
        flight.world.send_bytes(address(port), &bytes);
    };
    // The download is the oldest of the clients, and more arrive than there are places.
    request(&mut flight, 20_000, &data(0, 0, ALL));
    flight.run_ms(20);
    for port in 20_001..20_030 {
        request(&mut flight, port, &list(0, 0xFFFF));
        flight.run_ms(4);
    }
    flight.run_ms(2_000);
    assert_eq!(joined(0, 0, &flight.data(address(20_000))), content(0, 100_000));
}
