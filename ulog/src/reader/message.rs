//! The parts of a message, and why a file, or a section of it, cannot be read.

use core::fmt;

use super::{Parameter, ParameterValue};
use crate::format::{Field, FieldType};

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
pub struct Body<'a> {
    kind: u8,
    bytes: &'a [u8],
}

impl<'a> Body<'a> {
    /// For a message of this type.
    pub fn new(kind: u8, bytes: &'a [u8]) -> Self {
        Self { kind, bytes }
    }

    pub fn take<const N: usize>(&mut self) -> Result<[u8; N], Wrong> {
        let (first, rest) = self.bytes.split_first_chunk::<N>().ok_or_else(|| self.short())?;
        self.bytes = rest;
        Ok(*first)
    }

    pub fn u8(&mut self) -> Result<u8, Wrong> {
        self.take::<1>().map(|[byte]| byte)
    }

    pub fn u16(&mut self) -> Result<u16, Wrong> {
        self.take().map(u16::from_le_bytes)
    }

    pub fn u64(&mut self) -> Result<u64, Wrong> {
        self.take().map(u64::from_le_bytes)
    }

    /// A text after its length.
    pub fn short_text(&mut self) -> Result<&'a str, Wrong> {
        let length = usize::from(self.u8()?);
        let (text, rest) = self.bytes.split_at_checked(length).ok_or_else(|| self.short())?;
        self.bytes = rest;
        str::from_utf8(text).map_err(|_| Wrong::Text(char::from(self.kind)))
    }

    pub fn rest(self) -> &'a [u8] {
        self.bytes
    }

    /// The remaining bytes, as text.
    pub fn text(self) -> Result<&'a str, Wrong> {
        str::from_utf8(self.bytes).map_err(|_| Wrong::Text(char::from(self.kind)))
    }

    fn short(&self) -> Wrong {
        Wrong::Short(char::from(self.kind))
    }
}

/// Key and value bytes of an info message (`I`, `M`).
pub fn info(mut body: Body<'_>) -> Result<(Field, &[u8]), Wrong> {
    let key = body.short_text()?;
    let field = Field::parse(key).ok_or_else(|| Wrong::Key(key.to_owned()))?;
    let value = body.rest();
    if value.len() == field.size() { Ok((field, value)) } else { Err(Wrong::Key(key.to_owned())) }
}

/// A parameter (`P`).
pub fn parameter(body: Body<'_>, after_us: Option<u64>) -> Result<Parameter, Wrong> {
    let (field, value) = info(body)?;
    let value = match (field.kind, field.array, value.as_array::<4>()) {
        (FieldType::I32, None, Some(bytes)) => ParameterValue::Integer(i32::from_le_bytes(*bytes)),
        (FieldType::F32, None, Some(bytes)) => ParameterValue::Real(f32::from_le_bytes(*bytes)),
        _ => return Err(Wrong::Key(field.to_string())),
    };
    Ok(Parameter { name: field.name, value, after_us })
}
