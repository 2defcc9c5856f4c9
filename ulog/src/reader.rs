//! From a file to rows, texts and parameters.
//!
//! The bytes of the file stay in memory as they are; a topic stores the offsets of its rows. So a log needs little more memory
//! than its file. No content of a file can make the reader panic.

use std::collections::HashMap;
use std::path::Path;

use crate::format::{Field, FieldType, Format};

mod message;
mod parse;
mod topic;

pub use message::{Damage, ReadError, Wrong};
pub use topic::{Row, Topic};

use topic::Layout;

#[derive(Debug, Clone)]
pub struct Log {
    bytes: Vec<u8>,
    start_us: u64,
    formats: Vec<Layout>,
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
        parse::parse(bytes)
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

    /// Formats of the file, also of topics without rows.
    pub fn formats(&self) -> impl Iterator<Item = &Format> {
        self.formats.iter().map(|layout| &layout.format)
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
        let mut wide = [0; 8];
        wide.get_mut(..self.bytes.len())?.copy_from_slice(&self.bytes);
        let value = u64::from_le_bytes(wide);
        match self.field.kind {
            Bool | U8 | U16 | U32 | U64 => Some(value),
            I8 | I16 | I32 | I64 => {
                let negative = self.bytes.last().is_some_and(|byte| *byte >= 0x80);
                (!negative).then_some(value)
            }
            F32 | F64 | Char => None,
        }
    }
}

#[cfg(test)]
mod tests;
