//! From rows, texts and parameters to a file.
//!
//! [`Definitions`] writes the beginning (formats, info, parameters), [`Data`] the rest (rows,
//! texts, changes). Each message is written as a whole, so that a truncated file can be read up to its
//! last whole message.

use std::io::{self, Write};

use crate::format::{FILE_HEADER, Format, MAGIC, SYNC, VERSION};

/// Longest message, bytes without its header.
const MESSAGE_MAX: usize = u16::MAX as usize;
/// Flag bits: 8 compatible, 8 incompatible, three offsets of appended data; all zero.
const FLAG_BITS: [u8; 40] = [0; 40];

/// Importance of a logged text, with the numbers of syslog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// The system is unusable.
    Emergency,
    /// Immediate action is needed.
    Alert,
    /// Critical.
    Critical,
    /// Error.
    Error,
    /// Warning.
    Warning,
    /// Normal, but significant.
    Notice,
    /// Information.
    Info,
    /// For developers.
    Debug,
}

impl Level {
    /// The level with this syslog number; larger numbers are [`Level::Debug`].
    pub const fn from_number(number: u8) -> Self {
        use Level::{Alert, Critical, Debug, Emergency, Error, Info, Notice, Warning};
        let levels = [Emergency, Alert, Critical, Error, Warning, Notice, Info, Debug];
        if number < 8 { levels[number as usize] } else { Debug }
    }
}

/// Value of an info message or a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Value<'a> {
    /// `char[n]`; info only.
    Text(&'a str),
    /// `uint64_t`; info only.
    U64(u64),
    /// `int32_t`.
    I32(i32),
    /// `float`.
    F32(f32),
}

/// A topic that rows can be written to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Topic {
    id: u16,
    size: usize,
}

/// The bytes of one row, in the order of its format. Reuses its memory from row to row.
#[derive(Debug, Clone, Default)]
pub struct Row {
    bytes: Vec<u8>,
}

macro_rules! puts {
    ($($(#[$doc:meta])* $name:ident: $kind:ty;)*) => {
        $(
            $(#[$doc])*
            pub fn $name(&mut self, value: $kind) -> &mut Self {
                self.bytes.extend_from_slice(&value.to_le_bytes());
                self
            }
        )*
    };
}

impl Row {
    /// Begins a row at this time, us.
    pub fn begin(&mut self, timestamp_us: u64) -> &mut Self {
        self.bytes.clear();
        self.u64(timestamp_us)
    }

    puts! {
        /// `uint8_t`.
        u8: u8;
        /// `uint16_t`.
        u16: u16;
        /// `uint32_t`.
        u32: u32;
        /// `uint64_t`.
        u64: u64;
        /// `int32_t`.
        i32: i32;
        /// `float`.
        f32: f32;
        /// `double`.
        f64: f64;
    }

    /// `bool`.
    pub fn bool(&mut self, value: bool) -> &mut Self {
        self.u8(u8::from(value))
    }

    /// `double`, several.
    pub fn f64s(&mut self, values: &[f64]) -> &mut Self {
        for value in values {
            self.f64(*value);
        }
        self
    }

    /// `char[length]`: a longer text is cut, a shorter one is filled with zeros.
    pub fn chars(&mut self, text: &[u8], length: usize) -> &mut Self {
        let text = &text[..text.len().min(length)];
        self.bytes.extend_from_slice(text);
        self.bytes.resize(self.bytes.len() + length - text.len(), 0);
        self
    }

    /// The bytes so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }
}

/// The beginning of a file.
#[derive(Debug)]
pub struct Definitions<W>(Messages<W>);

impl<W: Write> Definitions<W> {
    /// Writes the file header; `start_us` is the time of the first row.
    pub fn begin(out: W, start_us: u64) -> io::Result<Self> {
        let mut messages = Messages { out, written: FILE_HEADER as u64, scratch: Vec::new() };
        let mut header = [0; FILE_HEADER];
        header[..7].copy_from_slice(&MAGIC);
        header[7] = VERSION;
        header[8..].copy_from_slice(&start_us.to_le_bytes());
        messages.out.write_all(&header)?;
        // The format wants them in front of all other messages.
        messages.message(b'B', &[&FLAG_BITS])?;
        Ok(Self(messages))
    }

    /// Defines a topic.
    ///
    /// # Errors
    /// The output's error; [`io::ErrorKind::InvalidInput`] if the format is too long.
    pub fn format(&mut self, format: &Format) -> io::Result<()> {
        self.0.message(b'F', &[format.to_string().as_bytes()])
    }

    /// Writes an info message about the file.
    pub fn info(&mut self, name: &str, value: Value<'_>) -> io::Result<()> {
        self.0.named(b'I', name, value)
    }

    /// Value of a parameter at the start.
    pub fn parameter(&mut self, name: &str, value: Value<'_>) -> io::Result<()> {
        self.0.named(b'P', name, value)
    }

    /// Ends the definitions.
    pub fn data(self) -> Data<W> {
        Data { messages: self.0, topics: 0 }
    }
}

/// The data section of a file.
#[derive(Debug)]
pub struct Data<W> {
    messages: Messages<W>,
    topics: u16,
}

impl<W: Write> Data<W> {
    /// Announces rows of a defined topic.
    ///
    /// # Errors
    /// The output's error; [`io::ErrorKind::InvalidInput`] if there are too many topics.
    pub fn subscribe(&mut self, format: &Format) -> io::Result<Topic> {
        let id = self.topics;
        self.topics = id.checked_add(1).ok_or(io::ErrorKind::InvalidInput)?;
        // There is one instance of each topic.
        let instance = [0];
        self.messages.message(b'A', &[&instance, &id.to_le_bytes(), format.name.as_bytes()])?;
        Ok(Topic { id, size: format.size() })
    }

    /// One row.
    ///
    /// # Errors
    /// The output's error; [`io::ErrorKind::InvalidInput`] if the row does not have the topic's length.
    pub fn row(&mut self, topic: Topic, row: &Row) -> io::Result<()> {
        if row.bytes.len() != topic.size {
            let text = format!("a row of {} bytes in a topic of {}", row.bytes.len(), topic.size);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        }
        self.messages.message(b'D', &[&topic.id.to_le_bytes(), &row.bytes])
    }

    /// A text at this time, us.
    ///
    /// # Errors
    /// The output's error; [`io::ErrorKind::InvalidInput`] if the text is too long.
    pub fn text(&mut self, level: Level, timestamp_us: u64, text: &str) -> io::Result<()> {
        let level = b'0' + level as u8;
        self.messages.message(b'L', &[&[level], &timestamp_us.to_le_bytes(), text.as_bytes()])
    }

    /// Writes an info message about the file, also at its end.
    ///
    /// # Errors
    /// The output's error; [`io::ErrorKind::InvalidInput`] if name or value is too long.
    pub fn info(&mut self, name: &str, value: Value<'_>) -> io::Result<()> {
        self.messages.named(b'I', name, value)
    }

    /// Writes a changed parameter; the change counts after the last row before it.
    ///
    /// # Errors
    /// The output's error; [`io::ErrorKind::InvalidInput`] if the value is neither `int32_t` nor `float`.
    pub fn parameter(&mut self, name: &str, value: Value<'_>) -> io::Result<()> {
        self.messages.named(b'P', name, value)
    }

    /// Reports missing rows over this duration, ms.
    pub fn dropout(&mut self, milliseconds: u16) -> io::Result<()> {
        self.messages.message(b'O', &[&milliseconds.to_le_bytes()])
    }

    /// Writes a mark from which a reader can continue after damage.
    pub fn sync(&mut self) -> io::Result<()> {
        self.messages.message(b'S', &[&SYNC])
    }

    /// Bytes written so far, from the start of the file.
    pub fn written(&self) -> u64 {
        self.messages.written
    }

    /// Flushes the output.
    pub fn flush(&mut self) -> io::Result<()> {
        self.messages.out.flush()
    }

    /// Flushes and returns the output.
    pub fn finish(mut self) -> io::Result<W> {
        self.flush()?;
        Ok(self.messages.out)
    }
}

#[derive(Debug)]
struct Messages<W> {
    out: W,
    written: u64,
    /// Assembles one message, so that it is written at once.
    scratch: Vec<u8>,
}

impl<W: Write> Messages<W> {
    fn message(&mut self, kind: u8, parts: &[&[u8]]) -> io::Result<()> {
        let length = parts.iter().map(|part| part.len()).sum::<usize>();
        let size = u16::try_from(length).map_err(|_| too_long("message", length, MESSAGE_MAX))?;
        self.scratch.clear();
        self.scratch.extend_from_slice(&size.to_le_bytes());
        self.scratch.push(kind);
        for part in parts {
            self.scratch.extend_from_slice(part);
        }
        self.out.write_all(&self.scratch)?;
        self.written += self.scratch.len() as u64;
        Ok(())
    }

    fn named(&mut self, kind: u8, name: &str, value: Value<'_>) -> io::Result<()> {
        // The format has no parameters of other types.
        let is_number = matches!(value, Value::I32(_) | Value::F32(_));
        if kind == b'P' && !is_number {
            let text = format!("parameter {name} is neither int32_t nor float");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
        }
        let (kind_name, bytes) = match value {
            Value::Text(text) => (format!("char[{}]", text.len()), text.as_bytes().to_vec()),
            Value::U64(value) => ("uint64_t".to_owned(), value.to_le_bytes().to_vec()),
            Value::I32(value) => ("int32_t".to_owned(), value.to_le_bytes().to_vec()),
            Value::F32(value) => ("float".to_owned(), value.to_le_bytes().to_vec()),
        };
        let key = format!("{kind_name} {name}");
        let length =
            u8::try_from(key.len()).map_err(|_| too_long("name", key.len(), u8::MAX.into()))?;
        self.message(kind, &[&[length], key.as_bytes(), &bytes])
    }
}

fn too_long(what: &str, length: usize, most: usize) -> io::Error {
    let text = format!("a {what} of {length} bytes; at most {most}");
    io::Error::new(io::ErrorKind::InvalidInput, text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::{Field, FieldType};

    fn format() -> Format {
        let fields = vec![
            Field::new(FieldType::U64, "timestamp"),
            Field::new(FieldType::F64, "x_m"),
            Field::array(FieldType::Char, 3, "note"),
        ];
        Format { name: "place".to_owned(), fields }
    }

    #[test]
    fn a_file_has_the_bytes_of_the_specification() {
        let mut definitions = Definitions::begin(Vec::new(), 7).unwrap();
        definitions.format(&format()).unwrap();
        definitions.info("sys_name", Value::Text("ab")).unwrap();
        definitions.parameter("P", Value::I32(-2)).unwrap();
        let mut data = definitions.data();
        let topic = data.subscribe(&format()).unwrap();
        let mut row = Row::default();
        row.begin(9).f64(0.5).chars(b"abcdef", 3);
        data.row(topic, &row).unwrap();
        data.text(Level::Warning, 9, "hot").unwrap();
        data.dropout(300).unwrap();
        data.sync().unwrap();
        let written = data.written();
        let bytes = data.finish().unwrap();
        let mut expected = Vec::new();
        expected.extend(b"ULog\x01\x12\x35\x01\x07\0\0\0\0\0\0\0");
        expected.extend(b"\x28\0B");
        expected.extend([0; 40]);
        expected.extend(b"\x31\0Fplace:uint64_t timestamp;double x_m;char[3] note;");
        expected.extend(b"\x13\0I\x10char[2] sys_nameab");
        expected.extend(b"\x0e\0P\x09int32_t P\xfe\xff\xff\xff");
        expected.extend(b"\x08\0A\0\0\0place");
        expected.extend(b"\x15\0D\0\0\x09\0\0\0\0\0\0\0\0\0\0\0\0\0\xe0\x3fabc");
        expected.extend(b"\x0c\0L4\x09\0\0\0\0\0\0\0hot");
        expected.extend(b"\x02\0O\x2c\x01");
        expected.extend(b"\x08\0S\x2f\x73\x13\x20\x25\x0c\xbb\x12");
        assert_eq!(written, bytes.len() as u64);
        for (at, (is, should)) in bytes.iter().zip(&expected).enumerate() {
            assert_eq!(is, should, "byte {at}");
        }
        assert_eq!(bytes.len(), expected.len());
    }

    #[test]
    fn an_invalid_message_is_refused_and_leaves_the_file_whole() {
        let mut definitions = Definitions::begin(Vec::new(), 0).unwrap();
        definitions.format(&format()).unwrap();
        let mut data = definitions.data();
        let topic = data.subscribe(&format()).unwrap();
        let before = data.written();
        let mut row = Row::default();
        row.begin(1).f64(1.0);
        let refused = [
            data.row(topic, &row),
            data.info("x", Value::Text(&"x".repeat(70_000))),
            data.info(&"x".repeat(300), Value::U64(1)),
            data.parameter("x", Value::Text("1")),
            data.text(Level::Info, 0, &"x".repeat(70_000)),
        ];
        for result in refused {
            assert_eq!(result.unwrap_err().kind(), io::ErrorKind::InvalidInput);
        }
        assert_eq!(data.written(), before);
        assert_eq!(data.finish().unwrap().len() as u64, before);
    }
}
