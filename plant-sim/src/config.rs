//! Configuration files: TOML to tables, with the units of their sources, and the keys that the reader of a file knows.
//!
//! `altitude_ft` instead of `altitude_m`: the last words of a key are its unit, and each quantity has several. A key that the reader
//! does not know is converted to the one that it knows, with the same words before the unit.
//!
//! The keys are found by probing the reader, a type that serde fills. It is filled here from nothing: whatever it requests is noted as
//! a key and answered with a number or an empty text. So a key that a reader learns is known here without a list.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::iter;

use host_io::problem::{At as _, Problem, problem};
use icd::units::{DEG, STANDARD_GRAVITY_M_S2};
use serde::de::value::{SeqDeserializer, StrDeserializer};
use serde::de::{
    DeserializeOwned, DeserializeSeed, Deserializer, Error as _, IntoDeserializer, MapAccess,
    Visitor,
};
use serde::forward_to_deserialize_any;
use toml::{Table, Value};

/// Reads TOML into `T`; errors carry the file's name, and the table of a key that is missing, or else line and column.
pub(crate) fn parse<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, Problem> {
    let read = toml::from_str(text);
    read.map_err(|error| missing(&error, text).unwrap_or_else(|| error.into())).at(file)
}

/// The error about a missing key with the table that lacks it, and its number where it is an entry of a list.
fn missing(error: &toml::de::Error, text: &str) -> Option<Problem> {
    // toml tells a missing key by its message only.
    let key = error.message().strip_prefix("missing field `")?.strip_suffix('`')?;
    let start = error.span()?.start;
    // The span of the error begins at the heading of the table that lacks the key.
    let heading = text.get(start..)?.lines().next()?.trim();
    // All entries of a list have the same heading, so those before it give its number.
    let is_it = |line: &&str| line.trim() == heading;
    let number = text.get(..start)?.lines().filter(is_it).count() + 1;
    match (heading.starts_with("[["), heading.starts_with('[')) {
        (true, _) => Some(problem!("{heading} number {number}: {key} is missing")),
        (false, true) => Some(problem!("{heading}: {key} is missing")),
        (false, false) => None,
    }
}

/// Reads a parsed file with the units of its sources into `T`, whose keys are `known`. Errors carry the file's name; line and column
/// where no unit was converted and `text` is what was parsed.
pub(crate) fn in_units<T: DeserializeOwned>(
    file: &str,
    mut table: Table,
    text: Option<&str>,
    known: &BTreeSet<String>,
) -> Result<T, Problem> {
    let has_converted = convert(file, &mut table, known)?;
    // Line and column are those of the text, and after a conversion its keys are others.
    match text.filter(|_| !has_converted) {
        Some(text) => parse(file, text),
        None => T::deserialize(table.clone())
            .map_err(|error| {
                // Only in a text has an entry of a list a number.
                let text = toml::to_string(&table).unwrap_or_default();
                let again = toml::from_str::<T>(&text).err();
                again.and_then(|again| missing(&again, &text)).unwrap_or_else(|| error.into())
            })
            .at(file),
    }
}

/// Units of one quantity: the end of a key, and its value in SI units.
type Quantity = &'static [(&'static str, f64)];

/// International foot and nautical mile, m; pound, kg; standard gravity, m/s² (NIST SP 811, appendix B).
const FOOT: f64 = 0.304_8;
const NAUTICAL_MILE: f64 = 1_852.0;
const POUND: f64 = 0.453_592_37;
const POUND_FORCE: f64 = POUND * STANDARD_GRAVITY_M_S2;
/// The mass that a pound-force accelerates by 1 ft/s², kg.
const SLUG: f64 = POUND_FORCE / FOOT;

const QUANTITIES: [Quantity; 11] = [
    &[("m", 1.0), ("ft", FOOT), ("in", FOOT / 12.0), ("km", 1_000.0), ("nmi", NAUTICAL_MILE)],
    &[("m2", 1.0), ("ft2", FOOT * FOOT)],
    &[("m_s", 1.0), ("ft_s", FOOT), ("kt", NAUTICAL_MILE / 3_600.0), ("km_h", 1.0 / 3.6)],
    &[("m_s2", 1.0), ("ft_s2", FOOT)],
    &[("kg", 1.0), ("slug", SLUG), ("lb", POUND)],
    &[("kg_m2", 1.0), ("slug_ft2", SLUG * FOOT * FOOT), ("lb_ft2", POUND * FOOT * FOOT)],
    &[("n", 1.0), ("kn", 1_000.0), ("lbf", POUND_FORCE)],
    &[("deg", DEG), ("rad", 1.0)],
    &[("deg_s", DEG), ("rad_s", 1.0), ("hz", 2.0 * std::f64::consts::PI)],
    &[("s", 1.0), ("ms", 1.0e-3), ("min", 60.0)],
    &[("pa", 1.0), ("kpa", 1_000.0), ("psf", POUND_FORCE / (FOOT * FOOT))],
];

/// A unit: its quantity and its value in SI units.
#[derive(Clone, Copy)]
struct KeyUnit {
    quantity: Quantity,
    name: &'static str,
    in_si: f64,
}

/// The words of a key before its unit, and the unit; the longest one that fits.
fn split(key: &str) -> Option<(&str, KeyUnit)> {
    let units =
        QUANTITIES.iter().flat_map(|quantity| quantity.iter().map(move |unit| (quantity, unit)));
    units
        .filter_map(|(quantity, (name, in_si))| {
            // `m` alone is a key, not a unit.
            let stem = key.strip_suffix(name)?.strip_suffix('_').filter(|stem| !stem.is_empty())?;
            Some((stem, KeyUnit { quantity, name, in_si: *in_si }))
        })
        // `speed_m_s` ends in m_s and in s.
        .max_by_key(|(_, unit)| unit.name.len())
}

/// The words of a key before its unit, and the factor from its unit to `native`; `None` if the key has no unit of that quantity.
pub(crate) fn factor_to<'a>(key: &'a str, native: &str) -> Option<(&'a str, f64)> {
    let (stem, unit) = split(key)?;
    let (_, native) = unit.quantity.iter().find(|(name, _)| *name == native)?;
    Some((stem, unit.in_si / native))
}

/// Converts every key of a file that is not `known` to the known one of the same quantity. Tells whether there was one.
pub(crate) fn convert(
    file: &str,
    table: &mut Table,
    known: &BTreeSet<String>,
) -> Result<bool, Problem> {
    Walk { known, has_converted: false }.table(table, "", "").at(file)
}

struct Walk<'a> {
    known: &'a BTreeSet<String>,
    has_converted: bool,
}

impl Walk<'_> {
    /// `place` is the table in the list of known keys, `shown` as in the file.
    fn table(&mut self, table: &mut Table, place: &str, shown: &str) -> Result<bool, Problem> {
        let below = |parent: &str, key: &str| match parent {
            "" => key.to_owned(),
            _ => format!("{parent}.{key}"),
        };
        // A copy, since a conversion renames keys of the table.
        let keys: Vec<String> = table.keys().cloned().collect();
        for key in keys {
            let (path, shown_path) = (below(place, &key), below(shown, &key));
            match table.get_mut(&key) {
                Some(Value::Table(inner)) => {
                    self.table(inner, &path, &shown_path)?;
                }
                Some(Value::Array(list)) if list.iter().any(Value::is_table) => {
                    for (number, entry) in (1..).zip(list) {
                        if let Value::Table(inner) = entry {
                            let shown = format!("{shown_path}.{number}");
                            self.table(inner, &format!("{path}.N"), &shown)?;
                        }
                    }
                }
                _ => self.value(table, &key, place, &shown_path)?,
            }
        }
        Ok(self.has_converted)
    }

    fn value(
        &mut self,
        table: &mut Table,
        key: &str,
        place: &str,
        shown: &str,
    ) -> Result<(), Problem> {
        let prefix = if place.is_empty() { String::new() } else { format!("{place}.") };
        // A table that takes any word also takes one that looks like a unit.
        if self.known.contains(&format!("{prefix}{key}"))
            || self.known.contains(&format!("{prefix}{ANY}"))
        {
            return Ok(());
        }
        // What has no unit, and below what has no counterpart, is left to the reader, which refuses
        // it in its own words.
        let Some((stem, unit)) = split(key) else { return Ok(()) };
        let beside = self.known.iter().filter_map(|known| known.strip_prefix(&prefix));
        let same_stem = beside
            // Not a key of a table further down.
            .filter(|known| !known.contains('.'))
            .find_map(|known| split(known).filter(|(other, _)| *other == stem).zip(Some(known)));
        let Some(((_, native), native_key)) = same_stem else { return Ok(()) };
        if native.quantity != unit.quantity {
            let all = native.quantity.iter().map(|(name, _)| format!("{stem}_{name}"));
            let expected = all.collect::<Vec<_>>().join(", ");
            return Err(problem!(
                "{shown}: the unit {} does not fit, expected one of {expected}",
                unit.name
            ));
        }
        if table.contains_key(native_key) {
            return Err(problem!(
                "{shown} and {native_key} are the same quantity, expected one of them"
            ));
        }
        let factor = unit.in_si / native.in_si;
        let value = table.remove(key).and_then(|value| scaled(&value, factor));
        let value = value
            .ok_or_else(|| problem!("{shown} is no number, expected one, or a list of numbers"))?;
        table.insert(native_key.to_owned(), value);
        self.has_converted = true;
        Ok(())
    }
}

/// A number or a list of numbers times a factor.
fn scaled(value: &Value, factor: f64) -> Option<Value> {
    Some(match value {
        Value::Float(number) => Value::Float(number * factor),
        // As if the file had a decimal point.
        Value::Integer(number) => Value::Float(*number as f64 * factor),
        Value::Array(list) => {
            Value::Array(list.iter().map(|entry| scaled(entry, factor)).collect::<Option<_>>()?)
        }
        _ => return None,
    })
}

/// An error without content: a reader that does not take what it is given ends its part of the list.
type Nothing = serde::de::value::Error;

/// Last word of a key whose table takes any word.
pub const ANY: &str = "*";

/// Adds the keys that `T` reads, below `root`; an entry of a list is `N`.
pub fn gather<T: DeserializeOwned>(root: &str, keys: &mut BTreeSet<String>) {
    let found = RefCell::default();
    // A reader that is not content with zeros has named its keys before it fails.
    let _ = T::deserialize(Probe { path: root.to_owned(), keys: &found });
    keys.append(&mut found.into_inner());
}

/// Stands for a value at a place, whatever it is.
#[derive(Clone)]
struct Probe<'a> {
    path: String,
    keys: &'a RefCell<BTreeSet<String>>,
}

impl Probe<'_> {
    fn below(&self, word: &str) -> Self {
        let path =
            if self.path.is_empty() { word.to_owned() } else { format!("{}.{word}", self.path) };
        Self { path, keys: self.keys }
    }

    fn is_key(&self) {
        self.keys.borrow_mut().insert(self.path.clone());
    }
}

impl IntoDeserializer<'_, Nothing> for Probe<'_> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

/// Answers to requests for a single value; a number of any type can be an integer of the smallest.
macro_rules! leaves {
    ($($visit:ident $answer:tt => $($method:ident)+;)+) => {
        $(leaves! { @each $visit $answer $($method)+ })+
    };
    (@each $visit:ident $answer:tt $($method:ident)+) => {
        $(fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Nothing> {
            self.is_key();
            visitor.$visit $answer
        })+
    };
}

impl<'de> Deserializer<'de> for Probe<'_> {
    type Error = Nothing;

    leaves! {
        visit_unit() => deserialize_any;
        visit_bool(false) => deserialize_bool;
        visit_u8(0) => deserialize_i8 deserialize_i16 deserialize_i32 deserialize_i64 deserialize_f32
            deserialize_u8 deserialize_u16 deserialize_u32 deserialize_u64 deserialize_f64;
        visit_char(' ') => deserialize_char;
        visit_str("") => deserialize_str deserialize_string deserialize_identifier;
        visit_bytes(b"") => deserialize_bytes deserialize_byte_buf;
    }

    /// What a reader passes over is a key of another one.
    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Nothing> {
        visitor.visit_unit()
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Nothing> {
        // A reader may ask for more keys inside of what is optional.
        visitor.visit_some(self)
    }

    forward_to_deserialize_any! { unit unit_struct tuple_struct }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Nothing> {
        self.is_key();
        // One entry shows the keys of all.
        visitor.visit_seq(SeqDeserializer::new(iter::once(self.below("N"))))
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        self.is_key();
        // A reader of a fixed number of entries fails on fewer.
        visitor.visit_seq(SeqDeserializer::new(iter::repeat_n(self.below("N"), len)))
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Nothing> {
        self.is_key();
        // No word of a map is known before a file has it.
        self.below(ANY).is_key();
        visitor.visit_map(KeyFields { probe: self, names: &[] })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        visitor.visit_map(KeyFields { probe: self, names: fields })
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Nothing> {
        self.is_key();
        let first = variants.first().ok_or_else(|| Nothing::custom("no variant"))?;
        // A choice is one key, whatever is chosen.
        let first: StrDeserializer<'_, Nothing> = first.into_deserializer();
        visitor.visit_enum(first)
    }
}

/// The fields of a struct, one after the other.
struct KeyFields<'a> {
    probe: Probe<'a>,
    names: &'static [&'static str],
}

impl<'de> MapAccess<'de> for KeyFields<'_> {
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

#[cfg(test)]
mod units_tests {
    use super::*;

    fn known() -> BTreeSet<String> {
        [
            "mass.mass_kg",
            "mass.ixx_kg_m2",
            "start.altitude_m",
            "start.velocity_ned_m_s",
            "start.roll_deg",
        ]
        .into_iter()
        .chain(["fault.N.bias_kn", "controls.*", "aero.area_m2", "duration_s"])
        .map(str::to_owned)
        .collect()
    }

    fn converted(text: &str) -> Result<Table, String> {
        let mut table: Table = toml::from_str(text).unwrap();
        convert("my.toml", &mut table, &known()).map_err(|error| error.to_string())?;
        Ok(table)
    }

    #[test]
    fn units_of_sources_become_those_of_the_reader() {
        // Conversions of NIST SP 811, appendix B.8.
        for (text, table, key, expected) in [
            ("mass.mass_slug = 1", "mass", "mass_kg", 14.593_902_937_206_364),
            ("mass.mass_lb = 5.0", "mass", "mass_kg", 2.267_961_85),
            ("mass.ixx_slug_ft2 = 3.6", "mass", "ixx_kg_m2", 3.6 * 1.355_817_948_331_4),
            ("start.altitude_ft = 30_000", "start", "altitude_m", 9_144.0),
            ("start.roll_rad = 1", "start", "roll_deg", 57.295_779_513_082_32),
            ("aero.area_ft2 = 0.222_22", "aero", "area_m2", 0.020_644_913_548_8),
        ] {
            let value = converted(text).unwrap()[table][key].as_float().unwrap();
            assert!((value / expected - 1.0).abs() < 1e-9, "{text}: {value}");
        }
        let list = converted("start.velocity_ned_ft_s = [0, 1000, -1e3]").unwrap();
        let list = list["start"]["velocity_ned_m_s"].as_array().unwrap();
        assert_eq!(list[1].as_float(), Some(304.8));
        let fault = converted("[[fault]]\nbias_lbf = 1000").unwrap();
        let bias = fault["fault"][0]["bias_kn"].as_float().unwrap();
        assert!((bias - 4.448_221_615_260_5).abs() < 1e-12, "{bias} kN");
        assert_eq!(converted("duration_min = 2").unwrap()["duration_s"].as_float(), Some(120.0));
        assert_eq!(factor_to("elevator_rad", "deg").map(|(stem, _)| stem), Some("elevator"));
        assert!(factor_to("elevator_ft", "deg").is_none());
    }

    #[test]
    fn a_unit_of_another_quantity_is_refused_with_those_that_fit() {
        assert_eq!(
            converted("mass.mass_ft = 3").unwrap_err(),
            "my.toml: mass.mass_ft: the unit ft does not fit, expected one of mass_kg, mass_slug, mass_lb"
        );
        assert_eq!(
            converted("[[fault]]\nbias_ft2 = 3").unwrap_err(),
            "my.toml: fault.1.bias_ft2: the unit ft2 does not fit, expected one of bias_n, bias_kn, bias_lbf"
        );
    }

    #[test]
    fn a_quantity_given_twice_and_a_text_are_refused() {
        assert_eq!(
            converted("start.altitude_ft = 3\nstart.altitude_m = 1").unwrap_err(),
            "my.toml: start.altitude_ft and altitude_m are the same quantity, expected one of them"
        );
        assert_eq!(
            converted("start.altitude_ft = \"high\"").unwrap_err(),
            "my.toml: start.altitude_ft is no number, expected one, or a list of numbers"
        );
    }

    #[test]
    fn what_the_reader_knows_or_nobody_knows_stays() {
        let text = "duration_s = 3\nspeed = 4\nx_ft = 1\n[controls]\nanything_ft = 5\n";
        assert_eq!(converted(text).unwrap(), toml::from_str::<Table>(text).unwrap());
    }
}
