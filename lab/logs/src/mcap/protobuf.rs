//! Messages in the encoding of Protocol Buffers, with the descriptors that readers of an MCAP file decode them by.
//!
//! One list makes the struct, its bytes and its descriptor, so they cannot differ. Wire format and numbers:
//! <https://protobuf.dev/programming-guides/encoding>, and `google/protobuf/descriptor.proto`. A code generator, or structs with
//! a second list for the descriptors, would be more than these few messages need.

const LENGTH_DELIMITED: u64 = 2;

/// A value that a field can have.
pub trait FieldValue {
    /// `FieldDescriptorProto.Type`.
    const TYPE: u64;
    /// Full name of a message or an enumeration.
    const TYPE_NAME: &'static str = "";
    /// `FieldDescriptorProto.Label`: 1 for one value, 3 for a list.
    const LABEL: u64 = 1;

    /// Appends the field with this number; nothing for a default value, which readers fill in.
    fn put(&self, number: u64, bytes: &mut Vec<u8>);
}

/// A list of fields.
pub trait Message: FieldValue {
    fn encoded(&self) -> Vec<u8>;
}

/// Defines messages of a package, and a function with their descriptors:
/// `Struct = "Name" { field: Type = number, }`; `+ Type` is an enumeration inside the message.
macro_rules! messages {
    ($all:ident of $package:literal: $($(#[$doc:meta])* $message:ident = $name:literal {
        $($field:ident: $type:ty = $number:literal,)*
    } $(+ $enumeration:ident)?)*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, Default, PartialEq)]
            pub struct $message {
                $(pub $field: $type,)*
            }

            impl Message for $message {
                fn encoded(&self) -> Vec<u8> {
                    let mut bytes = Vec::new();
                    $(self.$field.put($number, &mut bytes);)*
                    bytes
                }
            }

            impl FieldValue for $message {
                const TYPE: u64 = 11;
                const TYPE_NAME: &'static str = concat!($package, ".", $name);

                fn put(&self, number: u64, bytes: &mut Vec<u8>) {
                    put_bytes(number, &self.encoded(), bytes);
                }
            }
        )*

        /// Descriptors of the messages.
        pub fn $all() -> Vec<Vec<u8>> {
            vec![$({
                let fields = [$(field::<$type>(stringify!($field), $number)),*];
                #[allow(unused_mut, reason = "few messages have an enumeration")]
                let mut bytes = message($name, &fields);
                $(put_bytes(4, &$enumeration::descriptor(), &mut bytes);)?
                bytes
            }),*]
        }
    };
}
pub(super) use messages;

/// Descriptor of a field of a Rust type.
pub fn field<T: FieldValue>(name: &str, number: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    put_bytes(1, name.trim_start_matches("r#").as_bytes(), &mut bytes);
    number.put(3, &mut bytes);
    T::LABEL.put(4, &mut bytes);
    T::TYPE.put(5, &mut bytes);
    if !T::TYPE_NAME.is_empty() {
        put_bytes(6, format!(".{}", T::TYPE_NAME).as_bytes(), &mut bytes);
    }
    bytes
}

/// Descriptor of a message with these fields.
pub fn message(name: &str, fields: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = Vec::new();
    put_bytes(1, name.as_bytes(), &mut bytes);
    fields.iter().for_each(|field| put_bytes(2, field, &mut bytes));
    bytes
}

/// Descriptor of an enumeration with these values, from zero.
pub fn enumeration(name: &str, values: &[&str]) -> Vec<u8> {
    let mut bytes = Vec::new();
    put_bytes(1, name.as_bytes(), &mut bytes);
    for (value, number) in values.iter().zip(0_u64..) {
        let mut described = Vec::new();
        put_bytes(1, value.as_bytes(), &mut described);
        number.put(2, &mut described);
        put_bytes(2, &described, &mut bytes);
    }
    bytes
}

/// A file of a `FileDescriptorSet`: its package, the files that it needs, and its messages.
pub fn file(package: &str, needed: &[&str], messages: &[Vec<u8>]) -> Vec<u8> {
    let mut described = Vec::new();
    put_bytes(1, file_name(package).as_bytes(), &mut described);
    put_bytes(2, package.as_bytes(), &mut described);
    needed.iter().for_each(|other| put_bytes(3, file_name(other).as_bytes(), &mut described));
    messages.iter().for_each(|message| put_bytes(4, message, &mut described));
    put_bytes(12, b"proto3", &mut described);
    let mut bytes = Vec::new();
    put_bytes(1, &described, &mut bytes);
    bytes
}

fn file_name(package: &str) -> String {
    format!("{}.proto", package.replace('.', "/"))
}

fn put_varint(mut value: u64, bytes: &mut Vec<u8>) {
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
}

pub fn put_bytes(number: u64, value: &[u8], bytes: &mut Vec<u8>) {
    put_varint(number << 3 | LENGTH_DELIMITED, bytes);
    put_varint(value.len() as u64, bytes);
    bytes.extend_from_slice(value);
}

/// Whole numbers of variable length; a negative one takes all 64 bits.
macro_rules! varints {
    ($($type:ty: $code:literal, $to_u64:expr;)+) => {$(
        impl FieldValue for $type {
            const TYPE: u64 = $code;

            fn put(&self, number: u64, bytes: &mut Vec<u8>) {
                let to_u64: fn(Self) -> u64 = $to_u64;
                let value = to_u64(*self);
                if value != 0 {
                    put_varint(number << 3, bytes);
                    put_varint(value, bytes);
                }
            }
        }
    )+};
}

/// Numbers of fixed length, with their wire type.
macro_rules! fixed {
    ($($type:ty: $code:literal, $wire:literal, $zero:expr;)+) => {$(
        impl FieldValue for $type {
            const TYPE: u64 = $code;

            fn put(&self, number: u64, bytes: &mut Vec<u8>) {
                // By its bytes, because minus zero is no default value.
                if self.to_le_bytes() != $zero.to_le_bytes() {
                    put_varint(number << 3 | $wire, bytes);
                    bytes.extend_from_slice(&self.to_le_bytes());
                }
            }
        }
    )+};
}

varints! {
    i64: 3, i64::cast_unsigned;
    u64: 4, u64::from;
    i32: 5, |value| i64::from(value).cast_unsigned();
    bool: 8, u64::from;
}

fixed! {
    f64: 1, 1, 0.0_f64;
    u32: 7, 5, 0_u32;
}

impl FieldValue for String {
    const TYPE: u64 = 9;

    fn put(&self, number: u64, bytes: &mut Vec<u8>) {
        if !self.is_empty() {
            put_bytes(number, self.as_bytes(), bytes);
        }
    }
}

impl FieldValue for Vec<u8> {
    const TYPE: u64 = 12;

    fn put(&self, number: u64, bytes: &mut Vec<u8>) {
        put_bytes(number, self, bytes);
    }
}

/// A list of messages.
impl<T: Message> FieldValue for Vec<T> {
    const TYPE: u64 = T::TYPE;
    const TYPE_NAME: &'static str = T::TYPE_NAME;
    const LABEL: u64 = 3;

    fn put(&self, number: u64, bytes: &mut Vec<u8>) {
        self.iter().for_each(|entry| entry.put(number, bytes));
    }
}
