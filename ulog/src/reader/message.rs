//! Bytes of one message to its parts.

use super::error::Wrong;
use super::{Parameter, ParameterValue};
use crate::format::{Field, FieldType};

/// Reads numbers and texts from the front of a message.
#[derive(Debug, Clone, Copy)]
pub struct Body<'a> {
    kind: u8,
    bytes: &'a [u8],
}

impl<'a> Body<'a> {
    /// Of a message of this type.
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

    /// A text with its length in front.
    pub fn short_text(&mut self) -> Result<&'a str, Wrong> {
        let length = usize::from(self.u8()?);
        let (text, rest) = self.bytes.split_at_checked(length).ok_or_else(|| self.short())?;
        self.bytes = rest;
        str::from_utf8(text).map_err(|_| Wrong::Text(char::from(self.kind)))
    }

    /// All that is left, as bytes.
    pub fn rest(self) -> &'a [u8] {
        self.bytes
    }

    /// All that is left, as text.
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
