//! A `[[plant.fault]]` table of a scenario file: target, kind, numbers and times of one fault.
//!
//! The table is split into keys and values here; [`icd::fault::FaultDraft`] reads them. Ranges that are independent of the
//! aircraft are checked with file and key; [`crate::Plant::new`] checks whether the aircraft can have the fault.

use host_io::problem::{Problem, problem};
use std::collections::BTreeSet;
use std::fmt;
use std::sync::LazyLock;

use icd::EffectorList;
use icd::fault::{
    CATALOGUE, FaultDraft, FaultError, FaultValue, KindInfo, Quantity, SensorKind, Target,
    TargetClass,
};
use serde::Deserialize;
use serde::de::{Deserializer, Error, MapAccess, Visitor};

use crate::faults::ScheduledFault;
use crate::range::{RangeError, section};

/// Keys of the target, one of which is required.
const TARGETS: [&str; 3] = ["effector", "sensor", "part"];
/// Key of the kind.
const KIND: &str = "kind";
/// Key of the onset.
const ONSET: &str = Quantity::Onset.keys()[0];

/// Every key, and whether its value is a number.
static KEYS: LazyLock<Vec<(&'static str, bool)>> = LazyLock::new(|| {
    let words = TARGETS.into_iter().chain([KIND]).map(|key| (key, false));
    let of_kinds = CATALOGUE.iter().flat_map(|info| {
        let sensors = SensorKind::ALL.into_iter().map(TargetClass::Sensor);
        let classes = [TargetClass::Angle, TargetClass::Thrust, TargetClass::Part];
        let classes = classes.into_iter().chain(sensors).filter(|class| info.targets.allow(*class));
        let keys = |class| info.numbers.iter().map(move |number| number.quantity.key(class));
        let choice = info.choice.map(|choice| (choice.key, false));
        classes.flat_map(keys).map(|key| (key, true)).chain(choice)
    });
    let times = Quantity::TIMING.map(|quantity| (quantity.keys()[0], true));
    // Several kinds share a key.
    let mut known = BTreeSet::new();
    words.chain(of_kinds).chain(times).filter(|(key, _)| known.insert(*key)).collect()
});

/// Their names.
static NAMES: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| KEYS.iter().map(|(key, _)| *key).collect());

/// The kinds.
static KINDS: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| CATALOGUE.iter().map(|info| info.key).collect());

/// A table as written.
#[derive(Default)]
pub(super) struct FaultTable {
    kind: Option<&'static KindInfo>,
    /// Key and name.
    target: Option<(&'static str, String)>,
    numbers: Vec<(&'static str, f64)>,
    words: Vec<(&'static str, String)>,
}

impl FaultTable {
    /// The fault; errors use `file` and `number` (from 1).
    pub(super) fn read(
        &self,
        file: &str,
        number: usize,
        effectors: &EffectorList,
    ) -> Result<ScheduledFault, Problem> {
        let refused = |key: &str, problem: String| {
            let kind = self.kind.map_or("", |info| info.key);
            problem!("{file}: [[plant.fault]] number {number}, kind {kind}: {key} {problem}")
        };
        let info = self.kind.ok_or_else(|| refused(KIND, "is missing".to_owned()))?;
        let target = self.target(file, number, effectors)?;
        let class = target.class(effectors);
        let error = |error| match error {
            FaultError::OutOfRange { what, value, min, max, .. } => {
                let (section, key) = (section("plant.fault"), section(what.key(class)));
                problem!("{file}: {}", RangeError { section, key, value, min, max })
            }
            FaultError::Missing(field) => refused(field.key(class), "is missing".to_owned()),
            FaultError::Excludes(what, other) => {
                refused(what.key(class), format!("excludes {}", other.key(class)))
            }
            FaultError::NotWhole(what, value) => {
                refused(what.key(class), format!("= {value} is no whole number"))
            }
            FaultError::NoSuchWord(choice) => {
                let word = self.words.iter().find(|(key, _)| *key == choice.key);
                let word = word.map_or("", |(_, word)| word);
                let words: Vec<&str> = choice.alternatives.iter().map(|one| one.key).collect();
                refused(choice.key, format!("= {word:?} is none of {}", words.join(", ")))
            }
            FaultError::NoSuchAlternative => refused(KIND, error.to_string()),
        };
        let mut draft = FaultDraft::new(info, class);
        let numbers = self.numbers.iter().map(|(key, value)| (*key, FaultValue::Number(*value)));
        let words = self.words.iter().map(|(key, word)| (*key, FaultValue::Word(word)));
        let mut stray = None;
        for (key, value) in numbers.chain(words) {
            if !draft.put(key, value).map_err(error)? {
                stray = stray.or(Some(key));
            }
        }
        let (kind, timing) = draft.finish().map_err(error)?;
        match stray {
            Some(key) => Err(refused(key, "has no meaning here".to_owned())),
            None => Ok(ScheduledFault { target, kind, timing }),
        }
    }

    /// Key of the target.
    fn key(&self) -> &'static str {
        self.target.as_ref().map_or(TARGETS[0], |(key, _)| key)
    }

    fn target(
        &self,
        file: &str,
        number: usize,
        effectors: &EffectorList,
    ) -> Result<Target, Problem> {
        let (key, name) = (self.key(), self.target.as_ref().map_or("", |(_, name)| name));
        let has_key = |target: &Target| {
            let place = match target {
                Target::Effector(_) => 0,
                Target::Sensor(_) => 1,
                Target::Part(_) => 2,
            };
            TARGETS[place] == key
        };
        let all = || Target::all(effectors).filter(has_key);
        all().find(|target| target.key(effectors) == name).ok_or_else(|| {
            let known = all().map(|target| target.key(effectors)).collect::<Vec<_>>().join(", ");
            problem!(
                "{file}: [[plant.fault]] number {number}: {key} = `{name}`, the aircraft has only {known}"
            )
        })
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
        while let Some(name) = map.next_key::<String>()? {
            let known = KEYS.iter().find(|(key, _)| *key == name);
            let (key, is_number) = *known.ok_or_else(|| A::Error::unknown_field(&name, &NAMES))?;
            if is_number {
                self.numbers.push((key, map.next_value()?));
            } else {
                self.words.push((key, map.next_value()?));
            }
        }
        // Only now, because the search for keys reads every key with an empty word.
        for (_, word) in self.words.extract_if(.., |(key, _)| *key == KIND) {
            self.kind = KindInfo::by_key(&word);
            if self.kind.is_none() {
                return Err(A::Error::unknown_variant(&word, &KINDS));
            }
        }
        for target in self.words.extract_if(.., |(key, _)| TARGETS.contains(key)) {
            if self.target.replace(target).is_some() {
                return Err(A::Error::custom(
                    "a fault is of an effector, of a sensor or of a part",
                ));
            }
        }
        let has_onset = self.numbers.iter().any(|(key, _)| *key == ONSET);
        match (&self.target, self.kind, has_onset) {
            (None, ..) => Err(A::Error::missing_field(TARGETS[0])),
            (_, None, _) => Err(A::Error::missing_field(KIND)),
            (.., false) => Err(A::Error::missing_field(ONSET)),
            _ => Ok(self),
        }
    }
}
