//! Messages in the encoding of Protocol Buffers, with the descriptors that readers of an MCAP file decode them by.
//!
//! One list makes the struct, its bytes and its descriptor, so they cannot differ. Source of wire format and numbers:
//! <https://protobuf.dev/programming-guides/encoding> and `google/protobuf/descriptor.proto`. A compiler of `.proto` files, or
//! structs with the numbers and descriptors beside them, would be more than these few messages need.

/// `FieldDescriptorProto.Label` of a single value and of a list.
const OPTIONAL: u64 = 1;
const REPEATED: u64 = 3;

/// Wire types.
const VARINT: u64 = 0;
const FIXED_64: u64 = 1;
const LENGTH_DELIMITED: u64 = 2;

/// A value that a field can have.
pub trait FieldValue {
    /// `FieldDescriptorProto.Type`.
    const TYPE: u64;
    const LABEL: u64 = OPTIONAL;

    /// Appends the field with this number; nothing for a default value, which readers fill in.
    fn put(&self, number: u64, bytes: &mut Vec<u8>);

    /// Full name of a type that needs a description; adds its file and those that it needs.
    fn describe(_: &mut Vec<FileDescriptorProto>) -> String {
        String::new()
    }
}

/// A message: a list of fields.
pub trait Message {
    /// With its package.
    const NAME: &'static str;

    fn append_to(&self, bytes: &mut Vec<u8>);

    fn fields(files: &mut Vec<FileDescriptorProto>) -> Vec<FieldDescriptorProto>;

    fn enums() -> Vec<EnumDescriptorProto> {
        Vec::new()
    }
}

/// Defines messages: `Struct = "package.Name" { field: Type = number, }`. `+ Name` is an enumeration inside the message.
macro_rules! messages {
    ($($(#[$doc:meta])* $message:ident = $name:literal {
        $($field:ident: $type:ty = $number:literal,)*
    } $(+ $values:ident)?)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct $message {
            $(pub $field: $type,)*
        }

        impl $crate::mcap::protobuf::Message for $message {
            const NAME: &'static str = $name;

            fn append_to(&self, bytes: &mut Vec<u8>) {
                $($crate::mcap::protobuf::FieldValue::put(&self.$field, $number, bytes);)*
            }

            fn fields(
                files: &mut Vec<$crate::mcap::protobuf::FileDescriptorProto>,
            ) -> Vec<$crate::mcap::protobuf::FieldDescriptorProto> {
                vec![$($crate::mcap::protobuf::field::<$type>(stringify!($field), $number, files)),*]
            }

            $(fn enums() -> Vec<$crate::mcap::protobuf::EnumDescriptorProto> {
                vec![$values::descriptor()]
            })?
        }

        impl $crate::mcap::protobuf::FieldValue for $message {
            const TYPE: u64 = $crate::mcap::protobuf::TYPE_MESSAGE;

            fn put(&self, number: u64, bytes: &mut Vec<u8>) {
                $crate::mcap::protobuf::put_bytes(
                    number,
                    &$crate::mcap::protobuf::encoded(self),
                    bytes,
                );
            }

            fn describe(files: &mut Vec<$crate::mcap::protobuf::FileDescriptorProto>) -> String {
                $crate::mcap::protobuf::describe::<Self>(files)
            }
        }
    )*};
}
pub(super) use messages;

pub const TYPE_MESSAGE: u64 = 11;
pub const TYPE_ENUM: u64 = 14;

// The messages that describe messages; from `google/protobuf/descriptor.proto` the fields that are used here.
messages! {
    FileDescriptorSet = "google.protobuf.FileDescriptorSet" {
        file: Vec<FileDescriptorProto> = 1,
    }

    FileDescriptorProto = "google.protobuf.FileDescriptorProto" {
        name: String = 1,
        package: String = 2,
        dependency: Vec<String> = 3,
        message_type: Vec<DescriptorProto> = 4,
        syntax: String = 12,
    }

    DescriptorProto = "google.protobuf.DescriptorProto" {
        name: String = 1,
        field: Vec<FieldDescriptorProto> = 2,
        enum_type: Vec<EnumDescriptorProto> = 4,
    }

    FieldDescriptorProto = "google.protobuf.FieldDescriptorProto" {
        name: String = 1,
        number: u64 = 3,
        label: u64 = 4,
        kind: u64 = 5,
        type_name: String = 6,
    }

    EnumDescriptorProto = "google.protobuf.EnumDescriptorProto" {
        name: String = 1,
        value: Vec<EnumValueDescriptorProto> = 2,
    }

    EnumValueDescriptorProto = "google.protobuf.EnumValueDescriptorProto" {
        name: String = 1,
        number: u64 = 2,
    }
}

/// The bytes of a message.
pub fn encoded(message: &impl Message) -> Vec<u8> {
    let mut bytes = Vec::new();
    message.append_to(&mut bytes);
    bytes
}

/// The data of a schema: the descriptors of a message and of all that it contains, dependencies first.
pub fn schema<M: Message>() -> Vec<u8> {
    let mut file = Vec::new();
    describe::<M>(&mut file);
    encoded(&FileDescriptorSet { file })
}

/// The data of the schema of a message with a list of fields that only the program knows.
pub fn schema_of(package: &str, name: &str, fields: Vec<FieldDescriptorProto>) -> Vec<u8> {
    let message =
        DescriptorProto { name: name.to_owned(), field: fields, ..DescriptorProto::default() };
    encoded(&FileDescriptorSet { file: vec![file(package, message, Vec::new())] })
}

fn file(package: &str, message: DescriptorProto, dependency: Vec<String>) -> FileDescriptorProto {
    FileDescriptorProto {
        name: path(&format!("{package}.{}", message.name)),
        package: package.to_owned(),
        dependency,
        message_type: vec![message],
        syntax: "proto3".to_owned(),
    }
}

/// Name of the file of a message.
fn path(name: &str) -> String {
    format!("{}.proto", name.replace('.', "/"))
}

/// Adds the file of a message behind those of the messages in it, once; gives its name as a type.
pub fn describe<M: Message>(files: &mut Vec<FileDescriptorProto>) -> String {
    let type_name = format!(".{}", M::NAME);
    if files.iter().any(|file| file.name == path(M::NAME)) {
        return type_name;
    }
    let field = M::fields(files);
    let (package, name) = M::NAME.rsplit_once('.').expect("a name has a package");
    let used = field.iter().filter(|field| field.kind == TYPE_MESSAGE);
    let mut dependency: Vec<_> = used.map(|field| path(&field.type_name[1..])).collect();
    dependency.sort();
    dependency.dedup();
    let message = DescriptorProto { name: name.to_owned(), field, enum_type: M::enums() };
    files.push(file(package, message, dependency));
    type_name
}

/// Describes a field of a Rust type.
pub fn field<T: FieldValue>(
    name: &str,
    number: u64,
    files: &mut Vec<FileDescriptorProto>,
) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: name.to_owned(),
        number,
        label: T::LABEL,
        kind: T::TYPE,
        type_name: T::describe(files),
    }
}

fn put_varint(mut value: u64, bytes: &mut Vec<u8>) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

fn put_tag(number: u64, wire_type: u64, bytes: &mut Vec<u8>) {
    put_varint(number << 3 | wire_type, bytes);
}

pub fn put_bytes(number: u64, value: &[u8], bytes: &mut Vec<u8>) {
    put_tag(number, LENGTH_DELIMITED, bytes);
    put_varint(value.len() as u64, bytes);
    bytes.extend_from_slice(value);
}

impl FieldValue for f64 {
    const TYPE: u64 = 1;

    fn put(&self, number: u64, bytes: &mut Vec<u8>) {
        // Minus zero is no default value.
        if self.to_bits() != 0 {
            put_tag(number, FIXED_64, bytes);
            bytes.extend_from_slice(&self.to_le_bytes());
        }
    }
}

impl FieldValue for u64 {
    const TYPE: u64 = 4;

    fn put(&self, number: u64, bytes: &mut Vec<u8>) {
        if *self != 0 {
            put_tag(number, VARINT, bytes);
            put_varint(*self, bytes);
        }
    }
}

/// Whole numbers with a sign, which have no negative values here.
macro_rules! signed {
    ($($type:ty, $code:literal;)+) => {$(
        impl FieldValue for $type {
            const TYPE: u64 = $code;

            fn put(&self, number: u64, bytes: &mut Vec<u8>) {
                // A negative number takes all 64 bits.
                i64::from(*self).cast_unsigned().put(number, bytes);
            }
        }
    )+};
}

signed! {
    i64, 3;
    i32, 5;
}

impl FieldValue for bool {
    const TYPE: u64 = 8;

    fn put(&self, number: u64, bytes: &mut Vec<u8>) {
        u64::from(*self).put(number, bytes);
    }
}

impl FieldValue for String {
    const TYPE: u64 = 9;

    fn put(&self, number: u64, bytes: &mut Vec<u8>) {
        if !self.is_empty() {
            put_bytes(number, self.as_bytes(), bytes);
        }
    }
}

/// A list of messages or of texts that are not empty: of a list each entry stands in the bytes.
impl<T: FieldValue> FieldValue for Vec<T> {
    const TYPE: u64 = T::TYPE;
    const LABEL: u64 = REPEATED;

    fn put(&self, number: u64, bytes: &mut Vec<u8>) {
        self.iter().for_each(|entry| entry.put(number, bytes));
    }

    fn describe(files: &mut Vec<FileDescriptorProto>) -> String {
        T::describe(files)
    }
}
