use proptest::prelude::*;

use super::*;
use crate::format::{MAGIC, SYNC, VERSION};

/// A file assembled from messages.
#[derive(Clone)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn new() -> Self {
        let mut bytes = MAGIC.to_vec();
        bytes.push(VERSION);
        bytes.extend(1_000_u64.to_le_bytes());
        Self(bytes)
    }

    fn message(mut self, kind: u8, parts: &[&[u8]]) -> Self {
        let body = parts.concat();
        self.0.extend(u16::try_from(body.len()).unwrap().to_le_bytes());
        self.0.push(kind);
        self.0.extend(body);
        self
    }

    fn keyed(self, kind: u8, key: &str, value: &[u8]) -> Self {
        self.message(kind, &[&[u8::try_from(key.len()).unwrap()], key.as_bytes(), value])
    }

    fn flags(self, incompatible: u8, appended: u64) -> Self {
        let mut body = [0; 40];
        body[8] = incompatible;
        body[16..24].copy_from_slice(&appended.to_le_bytes());
        self.message(b'B', &[&body])
    }

    fn subscribe(self, id: u16, multi_id: u8, name: &str) -> Self {
        self.message(b'A', &[&[multi_id], &id.to_le_bytes(), name.as_bytes()])
    }

    fn row(self, id: u16, timestamp_us: u64, rest: &[u8]) -> Self {
        self.message(b'D', &[&id.to_le_bytes(), &timestamp_us.to_le_bytes(), rest])
    }

    fn sync(self) -> Self {
        self.message(b'S', &[&SYNC])
    }

    /// Definitions of one topic of each kind of value.
    fn defined() -> Self {
        Self::new()
            .flags(0, 0)
            .message(b'F', &[b"truth:uint64_t timestamp;double altitude_m;int16_t[2] pair;uint8_t[3] _padding0;"])
            .keyed(b'I', "char[8] sys_name", b"Two-Step")
            .keyed(b'I', "uint64_t steps", &77_u64.to_le_bytes())
            .keyed(b'P', "float K_ROLL", &2.5_f32.to_le_bytes())
            .keyed(b'P', "int32_t LAW", &(-3_i32).to_le_bytes())
            .subscribe(4, 0, "truth")
            .subscribe(9, 1, "truth")
    }

    /// One row of that topic.
    fn truth(self, id: u16, timestamp_us: u64, altitude_m: f64, pair: [i16; 2]) -> Self {
        let pair = [pair[0].to_le_bytes(), pair[1].to_le_bytes()].concat();
        self.row(id, timestamp_us, &[&altitude_m.to_le_bytes()[..], &pair].concat())
    }

    fn read(self) -> Log {
        Log::from_bytes(self.0).unwrap()
    }

    fn error(self) -> ReadError {
        Log::from_bytes(self.0).unwrap_err()
    }
}

#[test]
fn rows_facts_parameters_and_texts_come_out_as_they_went_in() {
    let log = Bytes::defined()
        .truth(4, 2_000, 100.5, [-7, 8])
        .truth(9, 2_500, -1.0, [0, 1])
        .message(b'L', &[b"4", &2_600_u64.to_le_bytes(), "fault begins".as_bytes()])
        .message(b'C', &[b"6", &5_u16.to_le_bytes(), &2_700_u64.to_le_bytes(), b"tagged"])
        .keyed(b'P', "float K_ROLL", &3.5_f32.to_le_bytes())
        .keyed(b'I', "char[4] end", b"done")
        .sync()
        .message(b'O', &[&12_u16.to_le_bytes()])
        .truth(4, 3_000, 101.5, [9, -10])
        .read();
    assert!(!log.is_cut() && log.damages().is_empty());
    assert_eq!(log.start_us(), 1_000);
    assert_eq!(log.column("truth", "altitude_m"), Some(vec![100.5, 101.5]));
    assert_eq!(log.column("truth", "pair[1]"), Some(vec![8.0, -10.0]));
    assert_eq!(log.times_us("truth"), Some(vec![2_000, 3_000]));
    assert_eq!(log.topic_of("truth", 1).unwrap().column("pair[0]"), Some(vec![0.0]));
    assert_eq!(log.topics().map(|topic| topic.len()).collect::<Vec<_>>(), [2, 1]);
    assert_eq!(log.info_text("sys_name"), Some("Two-Step"));
    assert_eq!(log.info_u64("steps"), Some(77));
    assert_eq!(log.info("end").unwrap().after_us, Some(2_500));
    let k_roll = |value, after_us| Parameter {
        name: "K_ROLL".into(),
        value: ParameterValue::Real(value),
        after_us,
    };
    assert_eq!(log.parameters()[0], k_roll(2.5, None));
    assert_eq!(log.parameters()[1].value, ParameterValue::Integer(-3));
    assert_eq!(log.parameters()[2], k_roll(3.5, Some(2_500)));
    let [first, second] = log.texts() else { panic!("{:?}", log.texts()) };
    assert_eq!((first.level, first.timestamp_us, &*first.text), (4, 2_600, "fault begins"));
    assert_eq!((second.level, second.tag, &*second.text), (6, Some(5), "tagged"));
    assert_eq!(log.dropouts_ms(), [12]);
}

#[test]
fn a_column_that_does_not_exist_is_none() {
    let log = Bytes::defined().truth(4, 2_000, 1.0, [0, 0]).read();
    for name in ["altitude", "altitude_m[0]", "pair", "pair[2]", "pair[x]", "pair[", ""] {
        assert_eq!(log.column("truth", name), None, "{name}");
    }
    assert_eq!(log.column("lies", "altitude_m"), None);
    assert_eq!(log.column("truth", "_padding0[1]"), Some(vec![0.0]), "padding may be left out");
}

#[test]
fn every_type_is_read_with_its_sign() {
    let names = "int8_t a;uint8_t b;int16_t c;uint16_t d;int32_t e;uint32_t f;int64_t g;uint64_t h;\
                 float i;double j;bool k;char l;";
    let ones = [0xFF; 1 + 1 + 2 + 2 + 4 + 4 + 8 + 8];
    let rest = [&ones[..], &(-1.5_f32).to_le_bytes(), &(-2.5_f64).to_le_bytes(), &[1], b"x"];
    let log = Bytes::new()
        .message(b'F', &[format!("all:uint64_t timestamp;{names}").as_bytes()])
        .subscribe(0, 0, "all")
        .row(0, 5, &rest.concat())
        .read();
    let values: Vec<f64> = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l"]
        .map(|name| log.column("all", name).unwrap()[0])
        .to_vec();
    let u64_max = u64::MAX as f64;
    assert_eq!(
        values,
        [-1.0, 255.0, -1.0, 65_535.0, -1.0, 4_294_967_295.0, -1.0, u64_max, -1.5, -2.5, 1.0, 120.0]
    );
    let row = log.topic("all").unwrap().row(0).unwrap();
    assert_eq!(row.unsigned("h"), Some(u64::MAX));
    assert_eq!(row.unsigned("g"), None);
    assert_eq!(row.bytes("l"), Some(&b"x"[..]));
}

#[test]
fn long_texts_in_pieces_are_put_together() {
    let piece = |bytes: Bytes, more: u8, text: &str| {
        let key = format!("char[{}] header", text.len());
        let length = u8::try_from(key.len()).unwrap();
        bytes.message(b'M', &[&[more], &[length], key.as_bytes(), text.as_bytes()])
    };
    let log = piece(piece(piece(Bytes::new(), 0, "old"), 0, "one, "), 1, "two").read();
    assert_eq!(log.info_text("header"), Some("one, two"));
    assert_eq!(log.infos().len(), 2);
}

#[test]
fn a_file_cut_off_anywhere_is_read_up_to_its_last_whole_message() {
    let whole = Bytes::defined().truth(4, 2_000, 1.0, [0, 0]);
    let before = whole.0.len();
    let all = whole.truth(4, 3_000, 2.0, [0, 0]).0;
    for length in before + 1..all.len() {
        let log = Log::from_bytes(all[..length].to_vec()).unwrap();
        assert!(log.is_cut(), "{length} bytes");
        assert_eq!(log.column("truth", "altitude_m"), Some(vec![1.0]), "{length} bytes");
    }
    assert!(!Log::from_bytes(all[..before].to_vec()).unwrap().is_cut());
}

#[test]
fn a_damaged_end_is_reported_with_its_offset_and_keeps_everything_before_it() {
    let good = Bytes::defined().truth(4, 2_000, 1.0, [0, 0]);
    let offset = good.0.len();
    let error_of = |damaged: Bytes| {
        let log = damaged.read();
        assert_eq!(log.column("truth", "altitude_m"), Some(vec![1.0]));
        assert!(log.is_cut());
        let [damage] = log.damages() else { panic!("{:?}", log.damages()) };
        assert_eq!((damage.offset, damage.resumed), (offset, None));
        damage.to_string()
    };
    let message = error_of(good.clone().row(5, 0, &[]).truth(4, 3_000, 2.0, [0, 0]));
    let expected = format!("byte {offset}: a row of the topic number 5");
    assert!(message.starts_with(&expected) && message.contains("the rest is lost"), "{message}");
    let short = error_of(good.clone().row(4, 0, &[1, 2, 3]));
    assert!(short.contains("a row of 11 bytes; \"truth\" has 23"), "{short}");
    let kind = error_of(good.clone().message(0x07, &[b"x"]));
    assert!(kind.contains("type 0x07 with 1 bytes"), "{kind}");
    let nested = error_of(good.clone().message(b'F', &[b"a:truth inner;"]));
    assert!(nested.contains("\"a:truth inner;\"") && nested.contains("nested"), "{nested}");
    let mut zeros = good;
    zeros.0.extend_from_slice(&[0; 4096]);
    assert!(error_of(zeros).contains("type 0x00 with 0 bytes"));
}

#[test]
fn reading_continues_at_a_sync_message_and_reports_it() {
    let good = Bytes::defined().truth(4, 2_000, 1.0, [0, 0]);
    let offset = good.0.len();
    let damaged = good.message(0xFE, &[&[1; 30]]).truth(4, 3_000, 2.0, [0, 0]);
    let resumed = damaged.0.len();
    let log = damaged.sync().truth(4, 4_000, 3.0, [0, 0]).read();
    assert_eq!(log.column("truth", "altitude_m"), Some(vec![1.0, 3.0]));
    let wrong = Wrong::Message { kind: 0xFE, size: 30 };
    assert_eq!(log.damages(), [Damage { offset, resumed: Some(resumed), wrong }]);
}

#[test]
fn a_damaged_length_that_points_behind_the_end_is_no_cut_if_a_sync_message_follows() {
    let good = Bytes::defined();
    let offset = good.0.len();
    let mut bytes = good.truth(4, 2_000, 1.0, [0, 0]).sync().truth(4, 3_000, 2.0, [0, 0]);
    bytes.0[offset + 1] = 0xFF;
    let log = bytes.read();
    assert!(!log.is_cut());
    assert_eq!(log.column("truth", "altitude_m"), Some(vec![2.0]));
    assert_eq!(log.damages()[0].offset, offset);
}

#[test]
fn features_and_versions_that_are_not_known_are_refused() {
    let message = Bytes::new().flags(0b101, 0).error().to_string();
    assert!(message.contains("0x04 (byte 0"), "{message}");
    let mut other = Bytes::new();
    other.0[7] = 2;
    assert!(matches!(other.error(), ReadError::Version(2)));
    assert!(matches!(Bytes(b"\x89PNG and more than that".to_vec()).error(), ReadError::NoLog));
    assert!(matches!(Bytes(Vec::new()).error(), ReadError::NoLog));
}

#[test]
fn data_appended_to_a_cut_file_are_read() {
    let body = |appended| {
        Bytes::new()
            .flags(1, appended)
            .message(b'F', &[b"x:uint64_t timestamp;uint8_t v;"])
            .subscribe(0, 0, "x")
            .row(0, 1, &[1])
    };
    let mut bytes = body(0);
    let appended = bytes.0.len() as u64 + 5;
    bytes = body(appended);
    bytes.0.extend([11, 0, b'D', 0, 0]);
    let log = bytes.row(0, 2, &[2]).read();
    assert_eq!(log.column("x", "v"), Some(vec![1.0, 2.0]));
    assert!(!log.is_cut());
}

#[test]
fn a_topic_without_timestamp_or_format_is_damage() {
    let message = Bytes::new().subscribe(0, 0, "x").read().damages()[0].to_string();
    assert!(message.contains("\"x\" has no format"), "{message}");
    let message = Bytes::new().message(b'F', &[b"x:double v;"]).subscribe(0, 0, "x").read();
    assert!(message.damages()[0].to_string().contains("no uint64_t timestamp"), "{message:?}");
}

#[test]
fn a_written_log_reads_back() {
    use crate::format::{Field, Format};
    use crate::writer::{Definitions, Level, Row, Value};
    let fields = vec![
        Field::new(FieldType::U64, "timestamp"),
        Field::new(FieldType::F64, "x"),
        Field::array(FieldType::Char, 4, "note"),
    ];
    let format = Format { name: "topic".into(), fields };
    let mut definitions = Definitions::begin(Vec::new(), 77).unwrap();
    definitions.format(&format).unwrap();
    definitions.info("sys_name", Value::Text("Two-Step")).unwrap();
    definitions.parameter("LAW", Value::I32(-2)).unwrap();
    let mut data = definitions.data();
    let topic = data.subscribe(&format).unwrap();
    let mut row = Row::default();
    for k in 0..5_u32 {
        row.begin(u64::from(k) * 2_000).f64(f64::from(k) / 3.0).chars(b"ab", 4);
        data.row(topic, &row).unwrap();
    }
    data.sync().unwrap();
    data.text(Level::Warning, 9_000, "text").unwrap();
    data.dropout(12).unwrap();
    data.info("control_steps", Value::U64(5)).unwrap();
    let log = Log::from_bytes(data.finish().unwrap()).unwrap();
    assert!(!log.is_cut() && log.damages().is_empty());
    assert_eq!(log.start_us(), 77);
    let thirds: Vec<f64> = (0..5).map(|k| f64::from(k) / 3.0).collect();
    assert_eq!(log.column("topic", "x"), Some(thirds));
    assert_eq!(log.times_us("topic"), Some(vec![0, 2_000, 4_000, 6_000, 8_000]));
    let row = log.topic("topic").unwrap().row(4).unwrap();
    assert_eq!(row.bytes("note"), Some(&b"ab\0\0"[..]));
    assert_eq!(log.parameters()[0].value, ParameterValue::Integer(-2));
    assert_eq!((log.texts()[0].level, &*log.texts()[0].text), (4, "text"));
    assert_eq!((log.info_u64("control_steps"), log.dropouts_ms()), (Some(5), &[12][..]));
}

fn look(log: &Log) -> usize {
    let columns = |topic: Topic<'_>| {
        let names = topic.fields().iter().take(4).map(|field| field.name.clone());
        let values: usize =
            names.filter_map(|name| topic.column(&name)).map(|values| values.len()).sum();
        values + topic.times_us().len() + usize::from(topic.kind("timestamp").is_some())
    };
    let facts =
        log.infos().iter().filter(|info| info.text().is_some() || info.unsigned().is_some());
    log.topics().map(columns).sum::<usize>() + facts.count() + log.texts().len()
}

proptest! {
    #[test]
    fn no_bytes_make_the_reader_panic(tail in proptest::collection::vec(any::<u8>(), 0..400)) {
        let mut bytes = Bytes::defined();
        bytes.0.extend(tail);
        if let Ok(log) = Log::from_bytes(bytes.0) {
            look(&log);
        }
    }

    #[test]
    fn no_change_of_bytes_makes_the_reader_panic(
        changes in proptest::collection::vec((any::<proptest::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<proptest::sample::Index>(),
    ) {
        let mut bytes = Bytes::defined()
            .truth(4, 2_000, 1.0, [0, 0])
            .sync()
            .message(b'L', &[b"4", &2_600_u64.to_le_bytes(), b"text"])
            .truth(9, 3_000, 2.0, [1, 2])
            .0;
        for (index, value) in changes {
            let place = index.index(bytes.len());
            bytes[place] = value;
        }
        bytes.truncate(cut.index(bytes.len()) + 1);
        if let Ok(log) = Log::from_bytes(bytes) {
            look(&log);
        }
    }
}
