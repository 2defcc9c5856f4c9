//! The keys of a `[[plant.fault]]` table, from the catalogue, and a table as written.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::LazyLock;

use icd::fault::CATALOGUE;
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Visitor};

/// Keys of the target: one of them is there.
pub(super) const TARGETS: [&str; 2] = ["effector", "sensor"];
/// Key of the kind.
pub(super) const KIND: &str = "kind";
/// Key of the onset.
pub(super) const ONSET: &str = "onset_s";
const TIMES: &str = "times";
/// Keys of the time, the onset first.
const TIMING: [&str; 6] = [ONSET, "clear_s", "ramp_s", "duration_s", "every_s", TIMES];

/// What stands behind a key.
enum Form {
    Name,
    /// One of these.
    Word(Vec<&'static str>),
    Number,
    Whole,
}

/// A key with its form.
type Key = (&'static str, Form);

/// Every key.
static KEYS: LazyLock<Vec<Key>> = LazyLock::new(|| {
    let mut keys: Vec<Key> = TARGETS.map(|key| (key, Form::Name)).into();
    keys.push((KIND, Form::Word(CATALOGUE.iter().map(|info| info.key).collect())));
    for info in &CATALOGUE {
        let numbers = info.numbers.iter().flat_map(|number| number.quantity.keys());
        keys.extend(numbers.map(|key| (key, Form::Number)));
        keys.extend(info.choice.iter().map(|choice| {
            (choice.key, Form::Word(choice.alternatives.iter().map(|one| one.key).collect()))
        }));
    }
    let form = |key| if key == TIMES { Form::Whole } else { Form::Number };
    keys.extend(TIMING.map(|key| (key, form(key))));
    // Several kinds share a key.
    let mut known = BTreeSet::new();
    keys.retain(|(key, _)| known.insert(*key));
    keys
});

/// Their names.
static NAMES: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| KEYS.iter().map(|(key, _)| *key).collect());

/// A table as written: texts and numbers by their keys. Target, kind and onset are there.
#[derive(Default)]
pub(super) struct Written {
    pub texts: BTreeMap<&'static str, String>,
    pub numbers: BTreeMap<&'static str, f64>,
}

impl Written {
    /// The keys of kinds that are there, in the order of the catalogue.
    pub fn of_kinds(&self) -> impl Iterator<Item = &'static str> + '_ {
        let is_there = |key: &&str| self.texts.contains_key(key) || self.numbers.contains_key(key);
        let others = |key: &&str| ![&TARGETS[..], &[KIND], &TIMING].concat().contains(key);
        NAMES.iter().copied().filter(is_there).filter(others)
    }
}

impl<'de> Deserialize<'de> for Written {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct("FaultTable", &NAMES, Self::default())
    }
}

impl<'de> Visitor<'de> for Written {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table with a fault")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut map: A) -> Result<Self, A::Error> {
        while let Some((key, form)) = map.next_key_seed(AnyKey)? {
            match form {
                Form::Name => drop(self.texts.insert(key, map.next_value()?)),
                Form::Word(words) => {
                    drop(self.texts.insert(key, map.next_value_seed(OneOf(words))?));
                }
                Form::Number => drop(self.numbers.insert(key, map.next_value()?)),
                Form::Whole => drop(self.numbers.insert(key, map.next_value::<u32>()?.into())),
            }
        }
        match TARGETS.map(|key| self.texts.contains_key(key)) {
            [false, false] => Err(A::Error::missing_field(TARGETS[0])),
            [true, true] => Err(A::Error::custom("a fault is of an effector or of a sensor")),
            _ if !self.texts.contains_key(KIND) => Err(A::Error::missing_field(KIND)),
            _ if !self.numbers.contains_key(ONSET) => Err(A::Error::missing_field(ONSET)),
            _ => Ok(self),
        }
    }
}

/// A key that there is.
struct AnyKey;

impl<'de> DeserializeSeed<'de> for AnyKey {
    type Value = &'static Key;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<&'static Key, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl Visitor<'_> for AnyKey {
    type Value = &'static Key;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a key of a fault")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<&'static Key, E> {
        let known = KEYS.iter().find(|(key, _)| *key == text);
        known.ok_or_else(|| E::unknown_field(text, &NAMES))
    }
}

/// One of these words.
struct OneOf(&'static [&'static str]);

impl<'de> DeserializeSeed<'de> for OneOf {
    type Value = String;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<String, D::Error> {
        deserializer.deserialize_str(self)
    }
}

impl Visitor<'_> for OneOf {
    type Value = String;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a word")
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<String, E> {
        let is_known = self.0.contains(&text);
        if is_known { Ok(text.to_owned()) } else { Err(E::unknown_variant(text, self.0)) }
    }
}
