//! A `[[plant.fault]]` table of a scenario file: target, kind, numbers and times of one fault.
//!
//! Its keys are those of the quantities and choices in [`icd::fault::CATALOGUE`]. Every number has its unit in its key:
//! an effector that turns has keys in degrees, the engine in kilonewton. A key that the kind does not use is refused.
//! Ranges that are independent of the aircraft are checked here, with file and key; [`crate::Plant::new`] checks whether the
//! aircraft can have the fault.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::LazyLock;

use icd::fault::{
    self, AirframePart, CATALOGUE, FaultKind, KindInfo, NUMBERS_MAX, Onset, Refusal, Repeat,
    SensorKind, Target, TargetClass, Timing,
};
use icd::{EffectorList, SimTime};
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Visitor};

use crate::config::{self, ConfigError};
use crate::faults::ScheduledFault;
use crate::range::{RangeError, check_range, section};

const SECTION: &str = "plant.fault";

/// The table while it is read; errors use file and number (from 1).
struct Reader<'a> {
    file: &'a str,
    number: usize,
    kind: &'static str,
    written: &'a FaultTable,
}

impl FaultTable {
    /// The fault; errors use `file` and `number` (from 1).
    pub(super) fn read(
        &self,
        file: &str,
        number: usize,
        effectors: &EffectorList,
    ) -> Result<ScheduledFault, ConfigError> {
        let kind = self.texts.get(KIND).and_then(|key| KindInfo::by_key(key));
        let reader = Reader { file, number, kind: kind.map_or("", |info| info.key), written: self };
        let info = kind.ok_or_else(|| reader.error(KIND, "is missing"))?;
        let target = reader.target(effectors)?;
        let class = target.class(effectors);
        let kind = reader.kind(info, class)?;
        let timing = reader.timing()?;
        fault::check_timing(&kind, &timing)
            .map_err(|refusal| reader.timing_error(&refusal, class))?;
        Ok(ScheduledFault { target, kind, timing })
    }
}

impl Reader<'_> {
    fn target(&self, effectors: &EffectorList) -> Result<Target, ConfigError> {
        let [effector, sensor, part] = TARGETS.map(|key| self.written.texts.get(key));
        let (key, name, target, known) = if let Some(name) = part {
            let known = AirframePart::ALL.map(AirframePart::key).to_vec();
            (TARGETS[2], name.as_str(), AirframePart::by_key(name).map(Target::from), known)
        } else if let Some(name) = sensor {
            let known: Vec<&str> = SensorKind::ALL.iter().map(|sensor| sensor.key()).collect();
            (TARGETS[1], name.as_str(), SensorKind::by_key(name).map(Target::from), known)
        } else {
            let name = effector.map_or("", String::as_str);
            let known = effectors.all().map(|effector| effectors.key(effector)).collect();
            (TARGETS[0], name, effectors.by_key(name).map(Target::from), known)
        };
        let (file, number) = (self.file.to_owned(), self.number);
        target.ok_or_else(|| {
            let (name, known) = (name.to_owned(), known.join(", "));
            ConfigError::FaultTarget { file, number, key, name, known }
        })
    }

    /// In SI units, from the keys with the units of its target.
    fn kind(&self, info: &KindInfo, class: TargetClass) -> Result<FaultKind, ConfigError> {
        let mut used = Vec::new();
        let mut values = [0.0; NUMBERS_MAX];
        for (place, number) in values.iter_mut().zip(info.numbers) {
            let (key, measure) = (number.quantity.key(class), number.quantity.measure());
            let value = self.need(key)?;
            let [min, max] = number.range.anywhere(measure, class);
            check_range(SECTION, key, value, min, max).map_err(config::in_file(self.file))?;
            *place = measure.unit(class).to_si(value);
            used.push(key);
        }
        let mut alternative = 0;
        if let Some(choice) = info.choice {
            let word = self.written.texts.get(choice.key);
            let place =
                word.and_then(|word| choice.alternatives.iter().position(|one| one.key == word));
            let place = place.and_then(|place| u8::try_from(place).ok()).or(choice.default);
            alternative = place.ok_or_else(|| self.error(choice.key, "is missing"))?;
            used.push(choice.key);
        }
        match self.written.of_kinds().find(|key| !used.contains(key)) {
            Some(key) => Err(self.error(key, "has no meaning here")),
            None => info.with(alternative, values).ok_or_else(|| self.error(KIND, "cannot be")),
        }
    }

    fn timing(&self) -> Result<Timing, ConfigError> {
        let numbers = &self.written.numbers;
        let number = |key| numbers.get(key).copied();
        let onset_s = self.need(ONSET)?;
        let onset = self.time(ONSET, onset_s)?;
        let duration_s = match (number("clear_s"), number("duration_s")) {
            (None, duration_s) => duration_s,
            (Some(_), Some(_)) => return Err(self.error("clear_s", "excludes duration_s")),
            (Some(clear_s), None) => {
                let until = self.time("clear_s", clear_s)?;
                if until <= onset {
                    let (file, number) = (self.file.to_owned(), self.number);
                    return Err(ConfigError::FaultEndsEarly { file, number, onset_s, clear_s });
                }
                Some(SimTime::from_micros(until.micros_since(onset)).as_seconds())
            }
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "read as u32")]
        let times = number("times").map(|times| times as u32);
        let repeat = match (number("every_s"), times) {
            (None, None) => None,
            (None, Some(_)) => return Err(self.error("every_s", "is missing")),
            (Some(_), _) if duration_s.is_none() => {
                return Err(self.error("duration_s", "is missing"));
            }
            (Some(every_s), times) => Some(Repeat { every_s, times }),
        };
        let ramp_s = number("ramp_s").unwrap_or(0.0);
        Ok(Timing { onset: Onset::At(onset), ramp_s, duration_s, repeat })
    }

    fn need(&self, key: &'static str) -> Result<f64, ConfigError> {
        self.written.numbers.get(key).copied().ok_or_else(|| self.error(key, "is missing"))
    }

    fn time(&self, key: &'static str, seconds: f64) -> Result<SimTime, ConfigError> {
        SimTime::from_seconds(seconds)
            .ok_or_else(|| self.out_of_range(key, seconds, 0.0, SimTime::MAX_SECONDS))
    }

    fn error(&self, key: &'static str, problem: &'static str) -> ConfigError {
        let Self { file, number, kind, .. } = *self;
        ConfigError::FaultKey { file: file.to_owned(), number, kind, key, problem }
    }

    fn timing_error(&self, refusal: &Refusal, class: TargetClass) -> ConfigError {
        match *refusal {
            Refusal::OutOfRange { what, value, min, max } => {
                self.out_of_range(what.key(class), value, min, max)
            }
            _ => self.error(ONSET, "cannot be"),
        }
    }

    fn out_of_range(&self, key: &str, value: f64, min: f64, max: f64) -> ConfigError {
        let (section, key) = (section(SECTION), section(key));
        config::in_file(self.file)(RangeError { section, key, value, min, max })
    }
}

/// Keys of the target, one of which is required.
const TARGETS: [&str; 3] = ["effector", "sensor", "part"];
/// Key of the kind.
const KIND: &str = "kind";
/// Key of the onset.
const ONSET: &str = "onset_s";
const TIMES: &str = "times";
/// Keys of the time, the onset first.
const TIMING: [&str; 6] = [ONSET, "clear_s", "ramp_s", "duration_s", "every_s", TIMES];

/// The form of the value of a key.
enum Form {
    Name,
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
        let sensors = SensorKind::ALL.into_iter().map(TargetClass::Sensor);
        let classes = [TargetClass::Angle, TargetClass::Thrust, TargetClass::Part];
        let classes = classes.into_iter().chain(sensors);
        for class in classes.filter(|class| info.targets.allow(*class)) {
            let numbers = info.numbers.iter().map(|number| number.quantity.key(class));
            keys.extend(numbers.map(|key| (key, Form::Number)));
        }
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

/// A table as written: texts and numbers by their keys. Target, kind and onset are required.
#[derive(Default)]
pub(super) struct FaultTable {
    texts: BTreeMap<&'static str, String>,
    numbers: BTreeMap<&'static str, f64>,
}

impl FaultTable {
    /// The given keys of kinds, in the order of the catalogue.
    fn of_kinds(&self) -> impl Iterator<Item = &'static str> + '_ {
        let is_there = |key: &&str| self.texts.contains_key(key) || self.numbers.contains_key(key);
        let others = |key: &&str| ![&TARGETS[..], &[KIND], &TIMING].concat().contains(key);
        NAMES.iter().copied().filter(is_there).filter(others)
    }
}

impl<'de> Deserialize<'de> for FaultTable {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_struct("FaultTable", &NAMES, Self::default())
    }
}

impl<'de> Visitor<'de> for FaultTable {
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
            [false, false, false] => Err(A::Error::missing_field(TARGETS[0])),
            [true, true, _] | [true, _, true] | [_, true, true] => {
                Err(A::Error::custom("a fault is of an effector, of a sensor or of a part"))
            }
            _ if !self.texts.contains_key(KIND) => Err(A::Error::missing_field(KIND)),
            _ if !self.numbers.contains_key(ONSET) => Err(A::Error::missing_field(ONSET)),
            _ => Ok(self),
        }
    }
}

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
