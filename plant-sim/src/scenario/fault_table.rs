//! A `[[plant.fault]]` table of a scenario file: target, kind, numbers and times of one fault.
//!
//! Its keys are those of the quantities and choices in [`icd::fault::CATALOGUE`]. Every number has its unit in its key:
//! an effector that turns has keys in degrees, the engine in kilonewton. A key that the kind does not know is refused.
//! Ranges that need no aircraft are checked here, with file and key; whether the aircraft can have the fault is found
//! out by [`crate::Plant::new`].

use icd::fault::{
    self, FaultKind, KindInfo, NUMBERS_MAX, Onset, Refusal, Repeat, SensorKind, Target,
    TargetClass, Timing,
};
use icd::{EffectorList, SimTime};
use serde::Deserialize;

use crate::config::{self, ConfigError};
use crate::faults::ScheduledFault;
use crate::range::{RangeError, check_range, section};

mod keys;

use keys::{KIND, ONSET, TARGETS, Written};

const SECTION: &str = "plant.fault";

/// One table as written.
#[derive(Deserialize)]
#[serde(transparent)]
pub(super) struct FaultTable(Written);

/// The table while it is read; file and number (from 1) stand for it in errors.
struct Reader<'a> {
    file: &'a str,
    number: usize,
    kind: &'static str,
    written: &'a Written,
}

impl FaultTable {
    /// The fault; `file` and `number` (from 1) stand for the table in errors.
    pub(super) fn read(
        &self,
        file: &str,
        number: usize,
        effectors: &EffectorList,
    ) -> Result<ScheduledFault, ConfigError> {
        let kind = self.0.texts.get(KIND).and_then(|key| KindInfo::by_key(key));
        let reader =
            Reader { file, number, kind: kind.map_or("", |info| info.key), written: &self.0 };
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
        let [effector, sensor] = TARGETS.map(|key| self.written.texts.get(key));
        let (key, name, target, known) = if let Some(name) = sensor {
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

    /// In SI units, from the keys with the units of what has it.
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

    /// A number that must be there.
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
