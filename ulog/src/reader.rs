//! From a file to rows, texts and parameters.
//!
//! The bytes of the file stay in memory as they are; a topic stores the offsets of its rows. So a log needs little more memory
//! than its file. No content of a file can make the reader panic.

use core::fmt;
use core::ops::Range;
use std::collections::HashMap;
use std::path::Path;

use crate::format::{FILE_HEADER, Field, FieldType, Format, MAGIC, MESSAGE_HEADER, SYNC, VERSION};

#[derive(Debug, Clone, Default)]
pub struct Log {
    bytes: Vec<u8>,
    start_us: u64,
    formats: Vec<TopicLayout>,
    by_name: HashMap<String, usize>,
    topics: Vec<Subscribed>,
    infos: Vec<Info>,
    parameters: Vec<Parameter>,
    texts: Vec<LoggedText>,
    dropouts_ms: Vec<u16>,
    damages: Vec<Damage>,
    is_cut: bool,
}

/// A topic as the file subscribes to it.
#[derive(Debug, Clone)]
struct Subscribed {
    format: usize,
    multi_id: u8,
    /// Offset of each row in the file.
    rows: Vec<usize>,
}

/// An info message of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Info {
    pub field: Field,
    /// The value's bytes, little endian.
    pub bytes: Vec<u8>,
    /// Timestamp of the last row before it, us; `None` in the definitions at the beginning.
    pub after_us: Option<u64>,
}

/// A parameter of the vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    pub name: String,
    /// Value; an `int32_t` or a `float` in the file.
    pub value: ParameterValue,
    /// Timestamp of the last row before a change, us; `None` in the definitions at the beginning.
    pub after_us: Option<u64>,
}

/// Value of a [`Parameter`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ParameterValue {
    /// `int32_t`.
    Integer(i32),
    /// `float`.
    Real(f32),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoggedText {
    /// 0 emergency to 7 debug, as in syslog.
    pub level: u8,
    /// Source, if the line has one.
    pub tag: Option<u16>,
    pub timestamp_us: u64,
    pub text: String,
}

impl Log {
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let bytes = std::fs::read(path)?;
        Self::from_bytes(bytes)
    }

    /// Reads the bytes of a file.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, ReadError> {
        parse(bytes)
    }

    /// Bytes of the file.
    pub fn size(&self) -> usize {
        self.bytes.len()
    }

    /// Start time from the file header, us.
    pub fn start_us(&self) -> u64 {
        self.start_us
    }

    /// The file ends inside a message (its writer was killed or the disk was full), or its end cannot be read.
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    /// Sections that could not be read; reading continued at the next sync message, if one followed.
    pub fn damages(&self) -> &[Damage] {
        &self.damages
    }

    /// Durations for which the writer lost rows, ms.
    pub fn dropouts_ms(&self) -> &[u16] {
        &self.dropouts_ms
    }

    /// Info messages in the order of the file.
    pub fn infos(&self) -> &[Info] {
        &self.infos
    }

    /// Parameters and their changes in the order of the file.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Logged texts in the order of the file.
    pub fn texts(&self) -> &[LoggedText] {
        &self.texts
    }

    /// All topics in the order of their subscriptions.
    pub fn topics(&self) -> impl Iterator<Item = Topic<'_>> {
        self.topics.iter().map(|topic| self.view(topic))
    }

    /// The topic with this name and the multi id 0.
    pub fn topic(&self, name: &str) -> Option<Topic<'_>> {
        self.topic_of(name, 0)
    }

    /// The topic with this name and this multi id.
    pub fn topic_of(&self, name: &str, multi_id: u8) -> Option<Topic<'_>> {
        self.topics().find(|topic| topic.name() == name && topic.multi_id() == multi_id)
    }

    /// A column as `f64`: `name`, or `name[2]` for an element of an array. `None` if the log has no such topic or column.
    pub fn column(&self, topic: &str, field: &str) -> Option<Vec<f64>> {
        self.topic(topic)?.column(field)
    }

    /// Timestamps of a topic's rows, us. `None` if the log has no such topic.
    pub fn times_us(&self, topic: &str) -> Option<Vec<u64>> {
        Some(self.topic(topic)?.times_us())
    }

    /// The last info message with this key.
    pub fn info(&self, key: &str) -> Option<&Info> {
        self.infos.iter().rev().find(|info| info.field.name == key)
    }

    /// The last text with this key. `None` if there is none, or it is not UTF-8 text.
    pub fn info_text(&self, key: &str) -> Option<&str> {
        self.info(key)?.text()
    }

    /// The last whole number with this key. `None` if there is none, or it is negative or not a number.
    pub fn info_u64(&self, key: &str) -> Option<u64> {
        self.info(key)?.unsigned()
    }

    fn view<'a>(&'a self, topic: &'a Subscribed) -> Topic<'a> {
        Topic {
            bytes: &self.bytes,
            layout: &self.formats[topic.format],
            multi_id: topic.multi_id,
            rows: &topic.rows,
        }
    }
}

impl Info {
    /// The value if it is a text.
    pub fn text(&self) -> Option<&str> {
        (self.field.kind == FieldType::Char).then(|| str::from_utf8(&self.bytes).ok()).flatten()
    }

    /// The value if it is a whole number from 0 up.
    pub fn unsigned(&self) -> Option<u64> {
        use FieldType::{Bool, Char, F32, F64, I8, I16, I32, I64, U8, U16, U32, U64};
        if self.field.array.is_some() {
            return None;
        }
        let value = wide(&self.bytes);
        match self.field.kind {
            Bool | U8 | U16 | U32 | U64 => Some(value),
            I8 | I16 | I32 | I64 => {
                // `wide` fills up with zeros, so only the sign bit tells a negative number.
                let negative = self.bytes.last().is_some_and(|byte| *byte >= 0x80);
                (!negative).then_some(value)
            }
            F32 | F64 | Char => None,
        }
    }
}

/// A format and the offsets of its fields in a row.
#[derive(Debug, Clone)]
struct TopicLayout {
    format: Format,
    /// Indices of the fields by name, of the first if there are several.
    by_name: HashMap<String, usize>,
    /// Offset of each field.
    starts: Vec<usize>,
    /// Bytes of a whole row.
    size: usize,
    /// Bytes of a row without its final padding, which the format allows to omit.
    size_min: usize,
    /// Offset of the timestamp.
    timestamp: Option<usize>,
}

impl TopicLayout {
    fn new(format: Format) -> Self {
        let mut starts = Vec::with_capacity(format.fields.len());
        let (mut size, mut size_min, mut timestamp) = (0_usize, 0, None);
        let mut by_name = HashMap::with_capacity(format.fields.len());
        for (index, field) in format.fields.iter().enumerate() {
            by_name.entry(field.name.clone()).or_insert(index);
            starts.push(size);
            if field.name == "timestamp" && field.kind == FieldType::U64 && field.array.is_none() {
                timestamp = timestamp.or(Some(size));
            }
            size = size.saturating_add(field.size());
            if !field.name.starts_with("_padding") {
                size_min = size;
            }
        }
        Self { format, by_name, starts, size, size_min, timestamp }
    }

    /// A field and its offset.
    fn field(&self, name: &str) -> Option<(&Field, usize)> {
        let index = *self.by_name.get(name)?;
        Some((self.format.fields.get(index)?, *self.starts.get(index)?))
    }

    /// Type and position of `name` or `name[3]`.
    fn find(&self, name: &str) -> Option<(FieldType, Range<usize>)> {
        let (plain, element) = match name.strip_suffix(']').and_then(|name| name.split_once('[')) {
            Some((plain, element)) => (plain, Some(element.parse::<usize>().ok()?)),
            None => (name, None),
        };
        let (field, start) = self.field(plain)?;
        let step = field.kind.size();
        let start = match (field.array, element) {
            (None, None) => start,
            (Some(length), Some(index)) if index < length => {
                start.checked_add(step.checked_mul(index)?)?
            }
            _ => return None,
        };
        Some((field.kind, start..start.checked_add(step)?))
    }
}

/// The rows of one topic.
#[derive(Debug, Clone, Copy)]
pub struct Topic<'a> {
    bytes: &'a [u8],
    layout: &'a TopicLayout,
    multi_id: u8,
    rows: &'a [usize],
}

#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    layout: &'a TopicLayout,
    bytes: &'a [u8],
}

impl<'a> Topic<'a> {
    pub fn name(&self) -> &'a str {
        &self.layout.format.name
    }

    /// Multi id of several topics with the same name, from 0.
    pub fn multi_id(&self) -> u8 {
        self.multi_id
    }

    /// Fields in the order of the bytes.
    pub fn fields(&self) -> &'a [Field] {
        &self.layout.format.fields
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether it has no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// A row by its number, from 0.
    pub fn row(&self, index: usize) -> Option<Row<'a>> {
        self.rows.get(index).map(|start| self.row_at(*start))
    }

    /// All rows in the order of the file.
    pub fn rows(&self) -> impl Iterator<Item = Row<'a>> + use<'a> {
        let topic = *self;
        self.rows.iter().map(move |start| topic.row_at(*start))
    }

    /// Rows that begin before this byte of the file.
    pub fn rows_before(&self, offset: usize) -> usize {
        self.rows.partition_point(|start| *start < offset)
    }

    /// Timestamps of the rows, us.
    pub fn times_us(&self) -> Vec<u64> {
        self.rows().map(|row| row.timestamp_us()).collect()
    }

    /// A column as `f64`: `name`, or `name[2]` for an element of an array. `None` if there is no such column.
    pub fn column(&self, name: &str) -> Option<Vec<f64>> {
        let (kind, place) = self.layout.find(name)?;
        Some(self.rows().map(|row| number(kind, row.at(place.clone()))).collect())
    }

    /// The type of a column, if there is one with that name.
    pub fn kind(&self, name: &str) -> Option<FieldType> {
        self.layout.find(name).map(|(kind, _)| kind)
    }

    /// `start` is the offset of a row of this topic.
    fn row_at(&self, start: usize) -> Row<'a> {
        let rest = self.bytes.get(start..).unwrap_or_default();
        Row { layout: self.layout, bytes: &rest[..self.layout.size.min(rest.len())] }
    }
}

impl<'a> Row<'a> {
    pub fn timestamp_us(&self) -> u64 {
        self.layout.timestamp.map_or(0, |start| wide(self.at(start..start.saturating_add(8))))
    }

    /// A value as `f64`. `None` if there is no such column.
    pub fn value(&self, name: &str) -> Option<f64> {
        let (kind, place) = self.layout.find(name)?;
        Some(number(kind, self.at(place)))
    }

    /// An unsigned whole number. `None` if there is no such column, or it is of another type.
    pub fn unsigned(&self, name: &str) -> Option<u64> {
        use FieldType::{Bool, U8, U16, U32, U64};
        let (kind, place) = self.layout.find(name)?;
        matches!(kind, Bool | U8 | U16 | U32 | U64).then(|| wide(self.at(place)))
    }

    /// Bytes of a field, of all elements if it is an array. `None` if there is no such field.
    pub fn bytes(&self, name: &str) -> Option<&'a [u8]> {
        let (field, start) = self.layout.field(name)?;
        self.bytes.get(start..start.checked_add(field.size())?)
    }

    /// Bytes at a position; none in omitted padding.
    fn at(&self, place: Range<usize>) -> &'a [u8] {
        self.bytes.get(place).unwrap_or_default()
    }
}

/// Up to eight bytes as a number, little endian.
fn wide(bytes: &[u8]) -> u64 {
    let mut wide = [0; 8];
    for (to, from) in wide.iter_mut().zip(bytes) {
        *to = *from;
    }
    u64::from_le_bytes(wide)
}

/// A value as `f64`; whole numbers beyond 2^53 are rounded.
fn number(kind: FieldType, bytes: &[u8]) -> f64 {
    let bits = wide(bytes);
    let [b0, b1, b2, b3, ..] = bits.to_le_bytes();
    match kind {
        FieldType::F64 => f64::from_bits(bits),
        FieldType::F32 => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
        FieldType::I8 => f64::from(i8::from_le_bytes([b0])),
        FieldType::I16 => f64::from(i16::from_le_bytes([b0, b1])),
        FieldType::I32 => f64::from(i32::from_le_bytes([b0, b1, b2, b3])),
        FieldType::I64 => bits.cast_signed() as f64,
        FieldType::U8
        | FieldType::U16
        | FieldType::U32
        | FieldType::U64
        | FieldType::Bool
        | FieldType::Char => bits as f64,
    }
}

/// A section that could not be read, unlike the part before it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Its offset in the file, bytes.
    pub offset: usize,
    /// Where reading continued; `None` if no sync message followed, so that the rest of the file is lost.
    pub resumed: Option<usize>,
    pub wrong: Wrong,
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { offset, resumed, wrong } = self;
        match resumed {
            Some(resumed) => write!(f, "byte {offset}: {wrong}; read on at byte {resumed}"),
            None => {
                write!(f, "byte {offset}: {wrong}; no sync message follows, so the rest is lost")
            }
        }
    }
}

/// Why a file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The first bytes are those of another kind of file.
    #[error("this is no ULog file: it does not begin with its seven magic bytes")]
    NoLog,
    /// The format has changed.
    #[error("ULog version {0}; only version 1 can be read")]
    Version(u8),
    /// The file has a feature that changes how it must be read.
    #[error(
        "the file needs the features {flags:#04x} (byte {index} of its incompatible flags), which are not known"
    )]
    Flags {
        /// Index of the byte, of eight.
        index: usize,
        flags: u8,
    },
}

/// Errors of a message.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Wrong {
    /// No writer produces such a message.
    #[error("a message of type {kind:#04x} with {size} bytes")]
    Message {
        kind: u8,
        /// Its size without the header.
        size: usize,
    },
    /// A message is too short, or its internal lengths are inconsistent.
    #[error("the message '{0}' is too short for what it says")]
    Short(char),
    /// Bytes that are not valid text.
    #[error("the text in the message '{0}' is no UTF-8")]
    Text(char),
    /// An invalid format; nested types are not supported.
    #[error("the format {0:?} cannot be read (nested types are not supported)")]
    Format(String),
    /// A topic without `uint64_t timestamp`.
    #[error("the topic {0:?} has no uint64_t timestamp")]
    Timestamp(String),
    /// A subscription without a format.
    #[error("the topic {0:?} has no format")]
    Topic(String),
    /// A row without a subscription.
    #[error("a row of the topic number {0}, which was not announced")]
    Row(u16),
    /// A row that does not fit its format.
    #[error("a row of {size} bytes; {topic:?} has {expected}")]
    RowSize {
        topic: String,
        size: usize,
        /// Bytes of its format.
        expected: usize,
    },
    /// An invalid key or parameter.
    #[error("the key {0:?} cannot be read")]
    Key(String),
}

/// Reads numbers and texts from the front of a message.
#[derive(Debug, Clone, Copy)]
struct MessageBody<'a> {
    kind: u8,
    bytes: &'a [u8],
}

impl<'a> MessageBody<'a> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Wrong> {
        let (first, rest) = self.bytes.split_first_chunk::<N>().ok_or_else(|| self.short())?;
        self.bytes = rest;
        Ok(*first)
    }

    fn u8(&mut self) -> Result<u8, Wrong> {
        self.take::<1>().map(|[byte]| byte)
    }

    fn u16(&mut self) -> Result<u16, Wrong> {
        self.take().map(u16::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Wrong> {
        self.take().map(u64::from_le_bytes)
    }

    /// A text after its length.
    fn short_text(&mut self) -> Result<&'a str, Wrong> {
        let length = usize::from(self.u8()?);
        let (text, rest) = self.bytes.split_at_checked(length).ok_or_else(|| self.short())?;
        self.bytes = rest;
        str::from_utf8(text).map_err(|_| Wrong::Text(char::from(self.kind)))
    }

    fn rest(self) -> &'a [u8] {
        self.bytes
    }

    /// The remaining bytes, as text.
    fn text(self) -> Result<&'a str, Wrong> {
        str::from_utf8(self.bytes).map_err(|_| Wrong::Text(char::from(self.kind)))
    }

    fn short(&self) -> Wrong {
        Wrong::Short(char::from(self.kind))
    }
}

/// Key and value bytes of an info message (`I`, `M`).
fn info(mut body: MessageBody<'_>) -> Result<(Field, &[u8]), Wrong> {
    let key = body.short_text()?;
    let field = Field::parse(key).ok_or_else(|| Wrong::Key(key.to_owned()))?;
    let value = body.rest();
    if value.len() == field.size() { Ok((field, value)) } else { Err(Wrong::Key(key.to_owned())) }
}

/// Bit of the first incompatible flag: data were appended after the end, at the given offsets.
const DATA_APPENDED: u8 = 1;

/// Reads a file from its first byte to its last.
fn parse(bytes: Vec<u8>) -> Result<Log, ReadError> {
    let Some((header, _)) = bytes.split_first_chunk::<FILE_HEADER>() else {
        return Err(ReadError::NoLog);
    };
    let [magic @ .., _, _, _, _, _, _, _, _, _] = header;
    if *magic != MAGIC {
        return Err(ReadError::NoLog);
    }
    if header[MAGIC.len()] != VERSION {
        return Err(ReadError::Version(header[MAGIC.len()]));
    }
    let mut start = [0; 8];
    start.copy_from_slice(&header[MAGIC.len() + 1..]);
    let mut log = Log { start_us: u64::from_le_bytes(start), ..Log::default() };
    let mut parser = Parser {
        bytes: &bytes,
        at: FILE_HEADER,
        log: &mut log,
        ids: HashMap::new(),
        known: HashMap::new(),
        appended: Vec::new(),
        after_us: None,
    };
    parser.run()?;
    log.bytes = bytes;
    Ok(log)
}

struct Parser<'a> {
    bytes: &'a [u8],
    /// Offset of the next message.
    at: usize,
    log: &'a mut Log,
    /// Message ids of the file to indices of topics.
    ids: HashMap<u16, usize>,
    /// Formats and multi ids to indices of topics: a topic may be announced again.
    known: HashMap<(usize, u8), usize>,
    /// Offsets of appended data, the nearest last.
    appended: Vec<usize>,
    /// Timestamp of the last row; `None` before the data section.
    after_us: Option<u64>,
}

/// Why a message was rejected.
enum ReadStop {
    Wrong(Wrong),
    Flags(ReadError),
}

impl From<Wrong> for ReadStop {
    fn from(wrong: Wrong) -> Self {
        Self::Wrong(wrong)
    }
}

impl Parser<'_> {
    fn run(&mut self) -> Result<(), ReadError> {
        while self.at < self.end() || self.jump() {
            let Some((kind, body)) = self.message() else {
                // A writer that has appended data gives their offset; otherwise the file ends here, or a length is damaged.
                if !self.jump() && !self.resume_in_rest() {
                    self.log.is_cut = true;
                    return Ok(());
                }
                continue;
            };
            let end = body.end;
            match self.take(kind, body) {
                Ok(()) => self.at = end,
                Err(ReadStop::Flags(error)) => return Err(error),
                Err(ReadStop::Wrong(wrong)) => {
                    if !self.resume(wrong.clone()) {
                        let damage = Damage { offset: self.at, resumed: None, wrong };
                        self.log.damages.push(damage);
                        // Appended data may still be whole.
                        if !self.jump() {
                            self.log.is_cut = true;
                            return Ok(());
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// End of the data that can be read now.
    fn end(&self) -> usize {
        self.appended.last().copied().unwrap_or(self.bytes.len())
    }

    /// Continues at the appended data; false if there are none.
    fn jump(&mut self) -> bool {
        self.appended.pop().is_some_and(|start| {
            self.at = start;
            true
        })
    }

    /// Type and position of the next message; `None` if it is incomplete.
    fn message(&self) -> Option<(u8, Range<usize>)> {
        let rest = self.bytes.get(self.at..self.end())?;
        let (header, rest) = rest.split_first_chunk::<MESSAGE_HEADER>()?;
        let [low, high, kind] = *header;
        let size = usize::from(u16::from_le_bytes([low, high]));
        let start = self.at + MESSAGE_HEADER;
        (size <= rest.len()).then_some((kind, start..start + size))
    }

    fn take(&mut self, kind: u8, place: Range<usize>) -> Result<(), ReadStop> {
        let size = place.len();
        let start = place.start;
        let mut body = MessageBody { kind, bytes: &self.bytes[place] };
        match kind {
            // No message is empty, so a run of zeros is damage and not a row of messages.
            _ if size == 0 => return Err(Wrong::Message { kind, size }.into()),
            b'B' => self.flags(body)?,
            b'F' => self.format(body)?,
            b'I' => self.info(body, false)?,
            b'M' => {
                let continued = body.u8()? != 0;
                self.info(body, continued)?;
            }
            b'P' => self.parameter(body)?,
            b'A' => self.subscribe(body)?,
            b'R' => {
                let id = body.u16()?;
                self.ids.remove(&id).ok_or(Wrong::Row(id))?;
            }
            b'D' => self.row(body, start + 2)?,
            b'L' => self.text(body, false)?,
            b'C' => self.text(body, true)?,
            b'O' => self.log.dropouts_ms.push(body.u16()?),
            b'S' if body.rest() != SYNC => return Err(Wrong::Message { kind, size }.into()),
            // Defaults of parameters, and messages of later versions.
            _ if kind.is_ascii_alphabetic() => {}
            _ => return Err(Wrong::Message { kind, size }.into()),
        }
        Ok(())
    }

    fn flags(&mut self, mut body: MessageBody<'_>) -> Result<(), ReadStop> {
        body.take::<8>()?;
        let incompatible = body.take::<8>()?;
        for (index, flags) in incompatible.into_iter().enumerate() {
            let unknown = if index == 0 { flags & !DATA_APPENDED } else { flags };
            // The format wants a file refused that has a flag unknown to its reader.
            if unknown != 0 {
                return Err(ReadStop::Flags(ReadError::Flags { index, flags: unknown }));
            }
        }
        for _ in 0..3 {
            let offset = usize::try_from(body.u64()?).unwrap_or(usize::MAX);
            // Zero: not used. Beyond the end: the appended data are cut off.
            if offset > self.at && offset < self.bytes.len() {
                self.appended.push(offset);
            }
        }
        self.appended.sort_unstable_by(|a, b| b.cmp(a));
        Ok(())
    }

    fn format(&mut self, body: MessageBody<'_>) -> Result<(), Wrong> {
        let text = body.text()?;
        let format = Format::parse(text).ok_or_else(|| Wrong::Format(text.to_owned()))?;
        // A later format of this name counts from here on; topics keep theirs by its index.
        self.log.by_name.insert(format.name.clone(), self.log.formats.len());
        self.log.formats.push(TopicLayout::new(format));
        Ok(())
    }

    fn info(&mut self, body: MessageBody<'_>, continued: bool) -> Result<(), Wrong> {
        let (field, value) = info(body)?;
        let after_us = self.after_us;
        match self.log.infos.last_mut().filter(|last| continued && last.field.name == field.name) {
            Some(last) => {
                last.bytes.extend_from_slice(value);
                last.field.array = Some(last.bytes.len() / last.field.kind.size());
            }
            None => self.log.infos.push(Info { field, bytes: value.to_vec(), after_us }),
        }
        Ok(())
    }

    fn subscribe(&mut self, mut body: MessageBody<'_>) -> Result<(), Wrong> {
        let (multi_id, id) = (body.u8()?, body.u16()?);
        let name = body.text()?;
        let format = *self.log.by_name.get(name).ok_or_else(|| Wrong::Topic(name.to_owned()))?;
        if self.log.formats[format].timestamp.is_none() {
            return Err(Wrong::Timestamp(name.to_owned()));
        }
        let topics = &mut self.log.topics;
        let index = *self.known.entry((format, multi_id)).or_insert_with(|| {
            topics.push(Subscribed { format, multi_id, rows: Vec::new() });
            topics.len() - 1
        });
        self.ids.insert(id, index);
        // The first topic ends the definitions.
        self.after_us = self.after_us.or(Some(self.log.start_us));
        Ok(())
    }

    fn parameter(&mut self, body: MessageBody<'_>) -> Result<(), Wrong> {
        let (field, value) = info(body)?;
        let value = match (field.kind, field.array, value.as_array::<4>()) {
            (FieldType::I32, None, Some(bytes)) => {
                ParameterValue::Integer(i32::from_le_bytes(*bytes))
            }
            (FieldType::F32, None, Some(bytes)) => ParameterValue::Real(f32::from_le_bytes(*bytes)),
            _ => return Err(Wrong::Key(field.to_string())),
        };
        self.log.parameters.push(Parameter { name: field.name, value, after_us: self.after_us });
        Ok(())
    }

    fn row(&mut self, mut body: MessageBody<'_>, start: usize) -> Result<(), Wrong> {
        let id = body.u16()?;
        let topic = *self.ids.get(&id).ok_or(Wrong::Row(id))?;
        let topic = &mut self.log.topics[topic];
        let layout = &self.log.formats[topic.format];
        let row = body.rest();
        if !(layout.size_min..=layout.size).contains(&row.len()) {
            let topic = layout.format.name.clone();
            return Err(Wrong::RowSize { topic, size: row.len(), expected: layout.size });
        }
        topic.rows.push(start);
        if let Some(bytes) = layout.timestamp.and_then(|at| row[at..].first_chunk()) {
            self.after_us = Some(u64::from_le_bytes(*bytes));
        }
        Ok(())
    }

    fn text(&mut self, mut body: MessageBody<'_>, tagged: bool) -> Result<(), Wrong> {
        // Levels are written as digits.
        let level = body.u8()?.saturating_sub(b'0').min(7);
        let tag = if tagged { Some(body.u16()?) } else { None };
        let timestamp_us = body.u64()?;
        let text = body.text()?.to_owned();
        self.log.texts.push(LoggedText { level, tag, timestamp_us, text });
        self.after_us = self.after_us.or(Some(self.log.start_us));
        Ok(())
    }

    /// Continues at the next sync message; false if none follows.
    fn resume(&mut self, wrong: Wrong) -> bool {
        let Some(resumed) = self.next_sync() else { return false };
        self.log.damages.push(Damage { offset: self.at, resumed: Some(resumed), wrong });
        self.at = resumed;
        true
    }

    /// A message that exceeds the end may have a damaged length, as a sync message after it shows.
    fn resume_in_rest(&mut self) -> bool {
        let wrong = match self.bytes.get(self.at..).unwrap_or_default() {
            [low, high, kind, ..] => {
                let size = usize::from(u16::from_le_bytes([*low, *high]));
                Wrong::Message { kind: *kind, size }
            }
            _ => return false,
        };
        self.resume(wrong)
    }

    /// Offset of the next sync message.
    fn next_sync(&self) -> Option<usize> {
        const LENGTH: usize = MESSAGE_HEADER + SYNC.len();
        // Behind the first byte of this message: at the same place reading would never move on.
        let from = self.at + 1;
        let rest = self.bytes.get(from..)?;
        let is_sync = |window: &[u8]| {
            window.starts_with(&[SYNC.len() as u8, 0, b'S']) && window[MESSAGE_HEADER..] == SYNC
        };
        rest.windows(LENGTH).position(is_sync).map(|index| from + index)
    }
}

#[cfg(test)]
mod tests;
