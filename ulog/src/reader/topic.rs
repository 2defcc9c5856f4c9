//! Rows of a topic, and values in them.

use core::ops::Range;
use std::collections::HashMap;

use crate::format::{Field, FieldType, Format};

/// A format and the offsets of its fields in a row.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub(super) format: Format,
    /// Indices of the fields by name, of the first if there are several.
    by_name: HashMap<String, usize>,
    /// Offset of each field.
    pub(super) starts: Vec<usize>,
    /// Bytes of a whole row.
    pub(super) size: usize,
    /// Bytes of a row without its final padding, which the format allows to omit.
    pub(super) size_min: usize,
    /// Offset of the timestamp.
    pub(super) timestamp: Option<usize>,
}

impl Layout {
    pub(super) fn new(format: Format) -> Self {
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
    pub(super) bytes: &'a [u8],
    pub(super) layout: &'a Layout,
    pub(super) multi_id: u8,
    pub(super) rows: &'a [usize],
}

#[derive(Debug, Clone, Copy)]
pub struct Row<'a> {
    layout: &'a Layout,
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
