//! Definitions shared by the writer and the reader: file header, message types, field types, formats of topics.

use core::fmt;

/// First seven bytes of a file.
pub const MAGIC: [u8; 7] = [0x55, 0x4C, 0x6F, 0x67, 0x01, 0x12, 0x35];
/// Version of the format, the eighth byte.
pub const VERSION: u8 = 1;
/// Magic, version and the time of the start, us.
pub const FILE_HEADER: usize = 16;
/// Size (u16) and type (u8) in front of each message.
pub const MESSAGE_HEADER: usize = 3;
/// Bytes that mark a position from which a damaged file can be read (message `S`).
pub const SYNC: [u8; 8] = [0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12];

// One row for each type, so that names and sizes are in the order of the variants.
macro_rules! field_types {
    ($($variant:ident $name:literal $size:literal,)+) => {
        /// Type of a field.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum FieldType {
            $(#[doc = concat!("`", $name, "`.")] $variant,)+
        }

        impl FieldType {
            /// All types, with name and size in bytes.
            pub const ALL: [(Self, &'static str, usize); [$($size),+].len()] =
                [$((Self::$variant, $name, $size)),+];
        }
    };
}

field_types! {
    I8 "int8_t" 1,
    U8 "uint8_t" 1,
    I16 "int16_t" 2,
    U16 "uint16_t" 2,
    I32 "int32_t" 4,
    U32 "uint32_t" 4,
    I64 "int64_t" 8,
    U64 "uint64_t" 8,
    F32 "float" 4,
    F64 "double" 8,
    Bool "bool" 1,
    Char "char" 1,
}

impl FieldType {
    /// Name in the file.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].1
    }

    /// Bytes of one value.
    pub fn size(self) -> usize {
        Self::ALL[self as usize].2
    }

    /// The type with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, known, _)| *known == name).map(|(kind, ..)| *kind)
    }
}

/// One field of a topic or an info message: type, length if it is an array, name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    pub kind: FieldType,
    /// Elements of an array; `None` for a single value.
    pub array: Option<usize>,
    pub name: String,
}

impl Field {
    pub fn new(kind: FieldType, name: impl Into<String>) -> Self {
        Self { kind, array: None, name: name.into() }
    }

    pub fn array(kind: FieldType, length: usize, name: impl Into<String>) -> Self {
        Self { kind, array: Some(length), name: name.into() }
    }

    /// Bytes of the field.
    pub fn size(&self) -> usize {
        // A damaged file may claim any length.
        self.kind.size().saturating_mul(self.array.unwrap_or(1))
    }

    /// Reads `type name` or `type[n] name`; `None` if it is neither.
    pub fn parse(text: &str) -> Option<Self> {
        let (kind, name) = text.split_once(' ')?;
        let (kind, array) = match kind.split_once('[') {
            None => (kind, None),
            Some((kind, length)) => (kind, Some(length.strip_suffix(']')?.parse().ok()?)),
        };
        let kind = FieldType::from_name(kind)?;
        (!name.is_empty()).then(|| Self { kind, array, name: name.to_owned() })
    }
}

impl fmt::Display for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.array {
            None => write!(f, "{} {}", self.kind.name(), self.name),
            Some(length) => write!(f, "{}[{length}] {}", self.kind.name(), self.name),
        }
    }
}

/// Name and fields of a topic. The first field is `uint64_t timestamp`, us.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Format {
    /// Name of the topic.
    pub name: String,
    /// Its fields in the order of the bytes; nested types are not supported.
    pub fields: Vec<Field>,
}

impl Format {
    /// Bytes of one row.
    pub fn size(&self) -> usize {
        self.fields.iter().fold(0, |sum, field| sum.saturating_add(field.size()))
    }

    /// Reads `name:type field;type field;`; `None` if it is something else.
    pub fn parse(text: &str) -> Option<Self> {
        let (name, fields) = text.split_once(':')?;
        let fields = fields.split(';').filter(|field| !field.is_empty()).map(Field::parse);
        Some(Self { name: name.to_owned(), fields: fields.collect::<Option<_>>()? })
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.name)?;
        self.fields.iter().try_for_each(|field| write!(f, "{field};"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_format_comes_back_from_its_text() {
        let text = "truth:uint64_t timestamp;double[3] rates;char[20] note;bool on;";
        let format = Format::parse(text).unwrap();
        assert_eq!(format.to_string(), text);
        assert_eq!(format.size(), 8 + 24 + 20 + 1);
    }

    #[test]
    fn every_type_stands_at_its_own_place() {
        for (index, (kind, name, size)) in FieldType::ALL.into_iter().enumerate() {
            assert_eq!((kind as usize, kind.name(), kind.size()), (index, name, size));
            assert_eq!(FieldType::from_name(name), Some(kind));
        }
    }

    #[test]
    fn an_invalid_format_is_none() {
        for text in ["", "name", "x:double", "x:real a;", "x:double[ a;", "x:double[-1] a;"] {
            assert_eq!(Format::parse(text), None, "{text}");
        }
    }
}
