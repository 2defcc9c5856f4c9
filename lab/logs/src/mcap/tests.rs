use std::collections::BTreeMap;

use icd::{SimTime, tvc_jet};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::FlightSetup;
use mcap::MessageStream;

use super::*;
use crate::replay::tests::testing::{self, Without};
use crate::replay::tests::{commands, setup};

fn geometry() -> AircraftGeometry {
    AircraftGeometry::from_toml("tvc_jet", GEOMETRIES[0].1, &tvc_jet::effectors()).unwrap()
}

/// The paper's first case: the left elevator jams at 30 deg after 3 s.
fn case_1(seconds: u64) -> FlightSetup {
    let mut setup = SetupOptions::default().setup("case1").unwrap();
    setup.duration = SimTime::from_micros(seconds * 1_000_000);
    setup
}

/// With ten rows a second.
fn log_of(setup: &FlightSetup) -> Vec<u8> {
    testing::log(setup, &[], Without { rows: 50, ..Without::default() })
}

fn file_of(log: Vec<u8>) -> Vec<u8> {
    file(Log::from_bytes(log).unwrap(), &geometry()).unwrap()
}

/// The fields of a message by number: its bytes, or those of a number.
fn fields(mut bytes: &[u8]) -> Vec<(u64, Vec<u8>)> {
    fn varint(bytes: &mut &[u8]) -> u64 {
        let mut value = 0;
        for shift in (0..).step_by(7) {
            let byte = bytes[0];
            *bytes = &bytes[1..];
            value |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                break;
            }
        }
        value
    }
    let mut fields = Vec::new();
    while !bytes.is_empty() {
        let tag = varint(&mut bytes);
        let value = match tag & 7 {
            0 => varint(&mut bytes).to_le_bytes().to_vec(),
            1 => bytes.split_off(..8).unwrap().to_vec(),
            2 => {
                let length = varint(&mut bytes) as usize;
                bytes.split_off(..length).unwrap().to_vec()
            }
            wire => panic!("wire type {wire}"),
        };
        fields.push((tag >> 3, value));
    }
    fields
}

fn field(bytes: &[u8], number: u64) -> Option<Vec<u8>> {
    fields(bytes).into_iter().find(|(found, _)| *found == number).map(|(_, value)| value)
}

fn number(bytes: &[u8], number: u64) -> f64 {
    field(bytes, number).map_or(0.0, |value| f64::from_le_bytes(value.try_into().unwrap()))
}

#[test]
fn every_channel_has_its_schema_and_a_message_for_each_row_of_its_topic() {
    let log = log_of(&case_1(4));
    let rows: BTreeMap<String, usize> = Log::from_bytes(log.clone())
        .unwrap()
        .topics()
        .map(|topic| (format!("/{}", topic.name()), topic.len()))
        .collect();
    let file = file_of(log);
    assert!(file.starts_with(MARK), "{:?}", &file[..MARK.len()]);
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let mut last = 0;
    for message in MessageStream::new(&file).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().expect("a schema");
        assert_eq!(
            (schema.encoding.as_str(), &*message.channel.message_encoding),
            ("protobuf", "protobuf")
        );
        let described = |file: &[u8]| -> Vec<String> {
            let text = |bytes| String::from_utf8(bytes).unwrap();
            let package = text(field(file, 2).unwrap());
            let messages = fields(file).into_iter().filter(|(number, _)| *number == 4);
            messages
                .map(|(_, one)| format!("{package}.{}", text(field(&one, 1).unwrap())))
                .collect()
        };
        let names = fields(&schema.data).into_iter().flat_map(|(_, file)| described(&file));
        assert_eq!(names.filter(|name| *name == schema.name).count(), 1, "{}", schema.name);
        assert!(message.log_time >= last, "in the order of time");
        last = message.log_time;
        *counts.entry(message.channel.topic.clone()).or_default() += 1;
    }
    for topic in ["/truth", "/control", "/commands", "/sensors", "/vehicle", "/fault"] {
        assert_eq!(counts.get(topic), Some(&rows[topic]), "{topic}");
    }
    for topic in ["/tf", "/location", "/estimate"] {
        assert_eq!(counts.get(topic), Some(&rows["/truth"]), "{topic}");
    }
    // All parts at first, and the elevator as soon as it fails.
    assert_eq!(counts["/scene"], 2);
    assert_eq!(counts["/points/left elevator"], 1);
    assert!(counts["/events"] >= 2, "{counts:?}");
    assert!(!counts.contains_key("/hash") && !counts.contains_key("/recorded"), "{counts:?}");
    assert_eq!(last, 4_000_000_000);
}

/// Turn of a frame about its hinge at each time, rad, with the sign of the hinge's axis in body axes.
fn turns(file: &[u8], frame: &str, axis: usize) -> Vec<(u64, f64)> {
    let messages = MessageStream::new(file).unwrap().map(Result::unwrap);
    let of_frames = messages.filter(|message| message.channel.topic == "/tf");
    of_frames
        .map(|message| {
            let transforms = fields(&message.data);
            let transform = transforms
                .iter()
                .find(|(_, transform)| field(transform, 3).unwrap() == frame.as_bytes())
                .unwrap_or_else(|| panic!("no frame {frame}"));
            let q = field(&transform.1, 5).unwrap();
            let along = number(&q, axis as u64 + 1);
            (message.log_time, 2.0 * libm::atan2(along, number(&q, 4)))
        })
        .collect()
}

#[test]
fn the_left_elevator_turns_by_its_true_deflection() {
    let log = log_of(&case_1(5));
    let read = Log::from_bytes(log.clone()).unwrap();
    let truth = read.column("truth", "position_left_elevator_rad").unwrap();
    let times = read.times_us("truth").unwrap();
    // The hinge runs to the right, the frame's y axis to the left.
    let [from, to] = geometry().part_of("left elevator").unwrap().hinges[0].axis_m;
    let along = (to - from).normalize();
    assert!(along.y > 0.999, "{along}");
    let turns = turns(&file_of(log), "body/left elevator", 1);
    assert_eq!(turns.len(), truth.len());
    for ((time, turn), (us, rad)) in turns.iter().zip(times.iter().zip(&truth)) {
        assert_eq!(*time, us * 1_000);
        // The hinge is a little oblique, by half a degree.
        let expected = -2.0 * libm::atan(libm::tan(0.5 * rad) * along.y);
        assert!((turn - expected).abs() < 1.0e-12, "{us} us: {turn} {expected}");
    }
    let before = times.iter().rposition(|us| *us < 3_000_000).unwrap();
    assert!(truth[before].to_degrees().abs() < 10.0, "{} deg", truth[before].to_degrees());
    assert!((turns.last().unwrap().1.to_degrees() + 30.0).abs() < 0.01, "{:?}", turns.last());
}

#[test]
fn the_same_log_gives_the_same_bytes() {
    let log = log_of(&case_1(1));
    assert!(file_of(log.clone()) == file_of(log));
}

#[test]
fn a_log_without_truth_or_of_an_unknown_aircraft_is_refused() {
    let without = Without { truth: true, ..Without::default() };
    let log = Log::from_bytes(testing::log(&setup(1), &[], without)).unwrap();
    let refused = file(log, &geometry()).unwrap_err().to_string();
    assert!(refused.starts_with("it has no truth"), "{refused}");

    let named = |setup: &FlightSetup, without| {
        let log = Log::from_bytes(testing::log(setup, &[], without)).unwrap();
        shipped_geometry(&Flight::new(log).unwrap()).map(|named| named.name)
    };
    let mut other = setup(1);
    assert_eq!(named(&other, Without::default()).unwrap(), "tvc_jet");
    other.plant.airframe.name = "glider".try_into().unwrap();
    let refused = named(&other, Without::default()).unwrap_err().to_string();
    assert!(
        refused.contains("its aircraft is \"glider\"") && refused.contains("--geometry"),
        "{refused}"
    );
    let without = Without { headers: true, ..Without::default() };
    let refused = named(&setup(1), without).unwrap_err().to_string();
    assert!(refused.contains("plant_header") && refused.contains("--geometry"), "{refused}");
}

#[test]
fn a_log_that_is_cut_or_damaged_gives_what_can_be_read() {
    let bytes = testing::log(&setup(2), &commands(), Without::default());
    let messages = |log: Vec<u8>| match file(Log::from_bytes(log).unwrap(), &geometry()) {
        Ok(file) => MessageStream::new(&file).unwrap().map(Result::unwrap).count(),
        Err(_) => 0,
    };
    let whole = messages(bytes.clone());
    let half = messages(bytes[..bytes.len() / 2].to_vec());
    assert!(whole / 3 < half && half < whole, "{half} of {whole}");
    for end in (0..bytes.len()).step_by(bytes.len() / 12).skip(1) {
        messages(bytes[..end].to_vec());
        let mut damaged = bytes.clone();
        damaged[end..].iter_mut().take(7).for_each(|byte| *byte ^= 0x5a);
        messages(damaged);
    }
}

#[test]
fn only_files_of_the_program_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let (log, out) = (folder.path().join("a.ulg"), folder.path().join("a.mcap"));
    std::fs::write(&log, log_of(&case_1(1))).unwrap();
    let args = |out: &PathBuf| McapArgs { log: log.clone(), out: out.clone(), geometry: None };
    run(&args(&out)).unwrap();
    run(&args(&out)).unwrap();
    std::fs::write(&out, b"\x89MCAP0\r\n of another program").unwrap();
    for foreign in [&out, &log] {
        let refused = run(&args(foreign)).unwrap_err().to_string();
        assert!(refused.contains("not written by this program"), "{refused}");
    }
    let text = folder.path().join("text.ulg");
    std::fs::write(&text, "a text").unwrap();
    for (wrong, reason) in [(&text, "no ULog file"), (&folder.path().to_path_buf(), "a folder")] {
        let args = McapArgs { log: wrong.clone(), ..args(&out) };
        let refused = run(&args).unwrap_err().to_string();
        assert!(refused.contains(reason), "{refused}");
    }
}
