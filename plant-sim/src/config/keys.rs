//! The keys that the reader of a file knows, found by probing the reader.
//!
//! A reader is a type that serde fills. It is filled here from nothing: whatever it requests is noted as a
//! key and answered with a number or an empty text. So a key that a reader learns is known here without a list.

use std::collections::BTreeSet;

use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, EnumAccess, Error as _, IntoDeserializer,
    MapAccess, SeqAccess, VariantAccess, Visitor,
};

/// An error without content: a reader that does not take what it is given ends its part of the list.
type Nothing = serde::de::value::Error;

/// Last word of a key whose table takes any word.
pub const ANY: &str = "*";

/// Adds the keys that `T` reads, below `root`; an entry of a list is `N`.
pub fn gather<T: DeserializeOwned>(root: &str, keys: &mut BTreeSet<String>) {
    // A reader that is not content with zeros has named its keys before it fails.
    let _ = T::deserialize(Probe { path: root.to_owned(), keys });
}

/// Stands for a value at a place, whatever it is.
struct Probe<'a> {
    path: String,
    keys: &'a mut BTreeSet<String>,
}

impl Probe<'_> {
    fn below(&mut self, word: &str) -> Probe<'_> {
        let path =
            if self.path.is_empty() { word.to_owned() } else { format!("{}.{word}", self.path) };
        Probe { path, keys: self.keys }
    }

    fn is_key(&mut self) {
        self.keys.insert(self.path.clone());
    }
}

macro_rules! leaves {
    ($($method:ident $visit:ident $($value:expr)?;)+) => {
        $(fn $method<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Nothing> {
            self.is_key();
            visitor.$visit($($value)?)
        })+
    };
}

impl<'de> Deserializer<'de> for Probe<'_> {
    type Error = Nothing;

    leaves! {
        deserialize_any visit_unit;
        deserialize_bool visit_bool false;
        deserialize_i8 visit_i8 0;
        deserialize_i16 visit_i16 0;
        deserialize_i32 visit_i32 0;
        deserialize_i64 visit_i64 0;
        deserialize_u8 visit_u8 0;
        deserialize_u16 visit_u16 0;
        deserialize_u32 visit_u32 0;
        deserialize_u64 visit_u64 0;
        deserialize_f32 visit_f32 0.0;
        deserialize_f64 visit_f64 0.0;
        deserialize_char visit_char ' ';
        deserialize_str visit_str "";
        deserialize_string visit_str "";
        deserialize_bytes visit_bytes b"";
        deserialize_byte_buf visit_bytes b"";
        deserialize_unit visit_unit;
        deserialize_identifier visit_str "";
    }

    /// What a reader passes over is a key of another one.
    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Nothing> {
        visitor.visit_unit()
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Nothing> {
        visitor.visit_some(self)
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        self.deserialize_unit(visitor)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Nothing> {
        self.is_key();
        visitor.visit_seq(Entries { probe: self, left: 1 })
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        mut self,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        self.is_key();
        visitor.visit_seq(Entries { probe: self, left: len })
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        self.deserialize_tuple(len, visitor)
    }

    fn deserialize_map<V: Visitor<'de>>(mut self, visitor: V) -> Result<V::Value, Nothing> {
        self.is_key();
        self.below(ANY).is_key();
        visitor.visit_map(Fields { probe: self, names: &[] })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        visitor.visit_map(Fields { probe: self, names: fields })
    }

    fn deserialize_enum<V: Visitor<'de>>(
        mut self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        self.is_key();
        let first = variants.first().ok_or_else(|| Nothing::custom("no variant"))?;
        visitor.visit_enum(First { probe: self, variant: first })
    }
}

/// The fields of a struct, one after the other.
struct Fields<'a> {
    probe: Probe<'a>,
    names: &'static [&'static str],
}

impl<'de> MapAccess<'de> for Fields<'_> {
    type Error = Nothing;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Nothing> {
        let Some(name) = self.names.first() else { return Ok(None) };
        let name: StrDeserializer<'_, Nothing> = name.into_deserializer();
        seed.deserialize(name).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Nothing> {
        let Some((name, rest)) = self.names.split_first() else {
            return Err(Nothing::custom("no field"));
        };
        self.names = rest;
        seed.deserialize(self.probe.below(name)).inspect_err(|_| {
            // The reader stops here: of the rest only the names are known.
            for name in rest {
                self.probe.below(name).is_key();
            }
        })
    }
}

/// Entries of a list, all alike.
struct Entries<'a> {
    probe: Probe<'a>,
    left: usize,
}

impl<'de> SeqAccess<'de> for Entries<'_> {
    type Error = Nothing;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Nothing> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        seed.deserialize(self.probe.below("N")).map(Some)
    }
}

/// The first variant of an enum: a choice is one key, whatever is chosen.
struct First<'a> {
    probe: Probe<'a>,
    variant: &'static str,
}

impl<'a, 'de> EnumAccess<'de> for First<'a> {
    type Error = Nothing;
    type Variant = Probe<'a>;

    fn variant_seed<V: DeserializeSeed<'de>>(
        self,
        seed: V,
    ) -> Result<(V::Value, Probe<'a>), Nothing> {
        let variant: StrDeserializer<'_, Nothing> = self.variant.into_deserializer();
        Ok((seed.deserialize(variant)?, self.probe))
    }
}

impl<'de> VariantAccess<'de> for Probe<'_> {
    type Error = Nothing;

    fn unit_variant(self) -> Result<(), Nothing> {
        Ok(())
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Nothing> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, len: usize, visitor: V) -> Result<V::Value, Nothing> {
        self.deserialize_tuple(len, visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        self.deserialize_struct("", fields, visitor)
    }
}
