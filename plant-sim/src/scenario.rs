//! Scenarios: a file becomes a [`Scenario`].
//!
//! A file has two tables. `[plant]` is read here; `[autopilot]` belongs to the flight software and is
//! ignored, so that neither side needs to know the other's keys. A file with `[checkcase]` is flown without a controller
//! ([`case`]).

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::LazyLock;

use host_io::problem::{At as _, Problem, problem};
use icd::fault::{
    CATALOGUE, FaultDraft, FaultError, FaultValue, KindInfo, Quantity, SensorKind, Target,
    TargetClass,
};
use icd::{ControlPeriod, EffectorList, SimTime};
use serde::Deserialize;
use serde::de::{Deserializer, Error, IgnoredAny, MapAccess, Visitor};

use crate::airframe::Airframe;
use crate::atmosphere::Atmosphere;
use crate::config::{self, gather};
use crate::earth::EarthModel;
use crate::faults::ScheduledFault;
use crate::geodesy::Geodetic;
use crate::grade_file::SensorsTable;
use crate::ground::{GroundSetup, GroundStart, Launch, SECTION as GROUND};
use crate::range::{check_range, out_of_range};
use crate::sensors::SensorSettings;
use crate::setup::PlantSetup;
use crate::start::{Start, StartPart};
use crate::wind::{
    DiscreteGust, TurbulenceName, WindLevel, WindProfile, WindSettings, check_gusts,
};

pub mod case;

use case::{CaseTable, ControlStepTable, InitialTable};

/// The plant's part of one scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    pub plant: PlantPart,
}

/// The plant's part of a scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantPart {
    /// Seed of the random streams.
    pub seed: u64,
    /// Duration of the flight, s; `None` where the scenario has no duration.
    pub duration_s: Option<f64>,
    /// Where the flight starts; missing values are those of the design point of the airframe.
    pub start: StartPart,
    /// The Earth model; WGS-84 if the file has none.
    pub earth: EarthModel,
    /// The ground; without it the flight ends at altitude zero.
    pub ground: Option<GroundSetup>,
    /// Wind and turbulence; calm if the file has none.
    pub wind: WindSettings,
    /// Wind over the altitude, added to the steady one; none if the file has none.
    pub profile: WindProfile,
    /// How much warmer the air is than the standard, K.
    pub temperature_offset_k: f64,
    /// Discrete gusts; none if the file has none.
    pub gusts: Vec<DiscreteGust>,
    /// Errors of the sensors; ideal if the file has none.
    pub sensors: SensorSettings,
    /// The faults and their times.
    pub faults: Vec<ScheduledFault>,
}

impl Scenario {
    /// Reads a scenario file for an aircraft with these effectors; errors call it `name`.
    pub fn from_toml(name: &str, text: &str, effectors: &EffectorList) -> Result<Self, Problem> {
        let table = config::parse(name, text)?;
        ScenarioFile::read(name, table, Some(text))?.into_scenario(effectors).at(name)
    }

    /// Reads a file that was parsed already and may have been changed since.
    pub fn from_table(
        name: &str,
        table: toml::Table,
        effectors: &EffectorList,
    ) -> Result<Self, Problem> {
        ScenarioFile::read(name, table, None)?.into_scenario(effectors).at(name)
    }
}

impl PlantPart {
    /// The flight of this scenario with an aircraft, as run number `run`.
    pub fn setup(
        &self,
        airframe: Airframe,
        run: u64,
        period: ControlPeriod,
        step_us: u32,
    ) -> PlantSetup {
        PlantSetup {
            start: self.start.over(&airframe.design_point),
            airframe,
            earth: self.earth,
            ground: self.ground,
            wind: self.wind,
            profile: self.profile.clone(),
            temperature_offset_k: self.temperature_offset_k,
            gusts: self.gusts.clone(),
            sensors: self.sensors,
            faults: self.faults.clone(),
            seed: self.seed,
            run,
            period,
            step_us,
        }
    }
}

/// Seed of a scenario that names none.
const SEED: u64 = 1;

/// The plant's part of a scenario file as written: the keys that it has.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    // First, because the search for keys ends at the faults, which no number satisfies.
    checkcase: Option<CaseTable>,
    plant: PlantTable,
    #[serde(default, rename = "autopilot")]
    _autopilot: Option<IgnoredAny>,
}

impl ScenarioFile {
    /// Reads a file that has been parsed as TOML. `text` provides line and column of errors.
    fn read(name: &str, table: toml::Table, text: Option<&str>) -> Result<Self, Problem> {
        config::in_units(name, table, text, &KNOWN_KEYS)
    }

    fn into_scenario(self, effectors: &EffectorList) -> Result<Scenario, Problem> {
        let of_cases = [
            ("checkcase", self.checkcase.is_some()),
            ("plant.initial_state", self.plant.initial_state.is_some()),
            ("plant.controls", self.plant.controls.is_some()),
            ("plant.control_step", !self.plant.control_step.is_empty()),
        ];
        if let Some((section, _)) = of_cases.iter().find(|(_, is_there)| *is_there) {
            let other = "an autopilot: `sitl study checkcase` flies it";
            return Err(problem!("[{section}] has no meaning beside {other}"));
        }
        Ok(Scenario { plant: self.plant.into_part(effectors)? })
    }
}

/// Converts the keys of a parsed file that have units of its sources to those that its reader has.
pub fn convert_units(name: &str, table: &mut toml::Table) -> Result<(), Problem> {
    config::convert(name, table, &KNOWN_KEYS).map(drop)
}

/// The keys of a scenario file.
static KNOWN_KEYS: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
    let mut keys = BTreeSet::new();
    gather::<ScenarioFile>("", &mut keys);
    keys
});

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantTable {
    seed: Option<u64>,
    duration_s: Option<f64>,
    earth: Option<EarthModel>,
    #[serde(default)]
    start: StartPart,
    initial_state: Option<InitialTable>,
    controls: Option<BTreeMap<String, f64>>,
    #[serde(default)]
    control_step: Vec<ControlStepTable>,
    atmosphere: Option<AtmosphereTable>,
    ground: Option<GroundTable>,
    wind: Option<WindTable>,
    date: Option<String>,
    sensors: Option<SensorsTable>,
    #[serde(default)]
    gust: Vec<DiscreteGust>,
    #[serde(default)]
    fault: Vec<FaultTable>,
}

/// Missing values are calm.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct WindTable {
    speed_m_s: f64,
    towards_deg: f64,
    down_m_s: f64,
    turbulence_m_s: f64,
    turbulence: Option<TurbulenceName>,
    level: Vec<WindLevel>,
}

/// A runway in a field that is level beside it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct GroundTable {
    latitude_deg: f64,
    longitude_deg: f64,
    elevation_m: f64,
    heading_deg: f64,
    length_m: f64,
    slope_percent: Option<f64>,
    friction: Option<f64>,
    #[serde(default)]
    start: GroundStartWord,
    along_m: Option<f64>,
    height_m: Option<f64>,
    speed_m_s: Option<f64>,
    pitch_deg: Option<f64>,
    rail_m: Option<f64>,
}

#[derive(Deserialize, Default, Clone, Copy, PartialEq)]
#[serde(rename_all = "snake_case")]
enum GroundStartWord {
    #[default]
    Air,
    Parked,
    Launched,
    Catapult,
}

impl GroundTable {
    /// Refuses keys that the start does not use, and names those that it lacks.
    fn check_start(&self, start: &StartPart) -> Result<(), Problem> {
        let is_catapult = self.start == GroundStartWord::Catapult;
        let is_launched = is_catapult || self.start == GroundStartWord::Launched;
        let is_in_air = self.start == GroundStartWord::Air;
        if self.along_m.is_some() && is_in_air {
            return Err(problem!("[{GROUND}] along_m has no meaning with this start"));
        }
        for (key, value, is_used) in [
            ("height_m", self.height_m, is_launched),
            ("speed_m_s", self.speed_m_s, is_launched),
            ("pitch_deg", self.pitch_deg, is_launched),
            ("rail_m", self.rail_m, is_catapult),
        ] {
            match (value, is_used) {
                (Some(_), false) => {
                    return Err(problem!("[{GROUND}] {key} has no meaning with this start"));
                }
                (None, true) => return Err(problem!("[{GROUND}]: {key} is missing")),
                _ => {}
            }
        }
        if !is_in_air && *start != StartPart::default() {
            return Err(problem!(
                "[plant.start] has no meaning beside the start of [{GROUND}]: the runway has the place and the heading"
            ));
        }
        Ok(())
    }

    fn into_setup(self, start: &StartPart) -> Result<GroundSetup, Problem> {
        self.check_start(start)?;
        let along_m = self.along_m.unwrap_or(0.0);
        // The keys of a launch are there, as checked above.
        let [height_m, speed_m_s, pitch_deg, rail_m] =
            [self.height_m, self.speed_m_s, self.pitch_deg, self.rail_m]
                .map(Option::unwrap_or_default);
        let pitch_rad = pitch_deg.to_radians();
        let launch = Launch { along_m, height_m, speed_m_s, pitch_rad };
        let setup = GroundSetup {
            threshold: Geodetic {
                latitude_rad: self.latitude_deg.to_radians(),
                longitude_rad: self.longitude_deg.to_radians(),
                altitude_m: self.elevation_m,
            },
            heading_rad: self.heading_deg.to_radians(),
            length_m: self.length_m,
            slope: 0.01 * self.slope_percent.unwrap_or(0.0),
            friction: self.friction.unwrap_or(1.0),
            start: match self.start {
                GroundStartWord::Air => GroundStart::Air,
                GroundStartWord::Parked => GroundStart::Parked { along_m },
                GroundStartWord::Launched => GroundStart::Launched(launch),
                GroundStartWord::Catapult => GroundStart::Catapult { launch, rail_m },
            },
        };
        setup.check()?;
        Ok(setup)
    }
}

/// Missing values are those of the standard.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct AtmosphereTable {
    temperature_offset_k: f64,
}

impl PlantTable {
    fn into_part(self, effectors: &EffectorList) -> Result<PlantPart, Problem> {
        if let Some(duration_s) = self.duration_s {
            check_range("plant", "duration_s", duration_s, 0.001, SimTime::MAX_SECONDS)?;
        }
        // Only the keys of the file are checked; the others come from an airframe that is not known
        // here.
        self.start.over(&Start::NOT_USED).check("plant.start")?;
        let table = self.wind.unwrap_or_default();
        let wind = WindSettings {
            speed_m_s: table.speed_m_s,
            towards_rad: table.towards_deg.to_radians(),
            down_m_s: table.down_m_s,
            turbulence_m_s: table.turbulence_m_s,
            turbulence: table.turbulence.and_then(TurbulenceName::level),
        };
        let profile = WindProfile::new(table.level)?;
        wind.check()?;
        let temperature_offset_k = self.atmosphere.unwrap_or_default().temperature_offset_k;
        Atmosphere::check(temperature_offset_k)?;
        check_gusts(&self.gust)?;
        let mut sensors = self.sensors.unwrap_or_default().settings()?;
        if let Some(date) = &self.date {
            sensors.date = date.parse().map_err(|error| problem!("[plant] {error}"))?;
        }
        sensors.check(ControlPeriod::DEFAULT.as_micros())?;
        let ground = self.ground.map(|ground| ground.into_setup(&self.start)).transpose()?;
        let faults = self.fault.iter().enumerate();
        Ok(PlantPart {
            seed: self.seed.unwrap_or(SEED),
            duration_s: self.duration_s,
            start: self.start,
            earth: self.earth.unwrap_or(EarthModel::Wgs84),
            ground,
            wind,
            profile,
            temperature_offset_k,
            gusts: self.gust,
            sensors,
            faults: faults.map(|(i, f)| f.read(i + 1, effectors)).collect::<Result<_, _>>()?,
        })
    }
}

// A `[[plant.fault]]` is split into keys and values here; [`icd::fault::FaultDraft`] reads them. Ranges that are independent of the
// aircraft are checked with file and key; [`crate::Plant::new`] checks whether the aircraft can have the fault.

/// Keys of the target of a fault, one of which is required.
const TARGETS: [&str; 3] = ["effector", "sensor", "part"];
const KIND: &str = "kind";
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

static NAMES: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| KEYS.iter().map(|(key, _)| *key).collect());

static KINDS: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| CATALOGUE.iter().map(|info| info.key).collect());

/// A table as written.
#[derive(Default)]
struct FaultTable {
    kind: Option<&'static KindInfo>,
    /// Key and name.
    target: Option<(&'static str, String)>,
    numbers: Vec<(&'static str, f64)>,
    words: Vec<(&'static str, String)>,
}

impl FaultTable {
    /// The fault; errors use its `number` (from 1).
    fn read(&self, number: usize, effectors: &EffectorList) -> Result<ScheduledFault, Problem> {
        let refused = |key: &str, problem: String| {
            let kind = self.kind.map_or(String::new(), |info| format!(", kind {}", info.key));
            problem!("[[plant.fault]] number {number}{kind}: {key} {problem}")
        };
        let is_missing = |key: &str| refused(key, "is missing".to_owned());
        let named = self.target.as_ref().ok_or_else(|| is_missing(TARGETS[0]))?;
        let info = self.kind.ok_or_else(|| is_missing(KIND))?;
        if !self.numbers.iter().any(|(key, _)| *key == ONSET) {
            return Err(is_missing(ONSET));
        }
        let target = target(named, number, effectors)?;
        let class = target.class(effectors);
        let error = |error| match error {
            FaultError::OutOfRange { what, value, min, max, .. } => {
                out_of_range("plant.fault", what.key(class), [value, min, max])
            }
            FaultError::Missing(field) => is_missing(field.key(class)),
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
        // Told last: what is missing or out of range says more about the mistake than a key too
        // many.
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
}

/// The target of fault `number` (from 1), of its key and its name.
fn target(
    (key, name): &(&'static str, String),
    number: usize,
    effectors: &EffectorList,
) -> Result<Target, Problem> {
    let has_key = |target: &Target| {
        let place = match target {
            Target::Effector(_) => 0,
            Target::Sensor(_) => 1,
            Target::Part(_) => 2,
        };
        TARGETS[place] == *key
    };
    let all = || Target::all(effectors).filter(has_key);
    let is_it = |target: &Target| match target {
        // By its role too, so that a scenario of one aircraft flies another.
        Target::Effector(effector) => effectors.by_key(name) == Some(*effector),
        other => other.key(effectors) == name,
    };
    all().find(is_it).ok_or_else(|| {
        let known = all().map(|target| target.key(effectors)).collect::<Vec<_>>().join(", ");
        problem!("[[plant.fault]] number {number}: {key} = `{name}`, the aircraft has only {known}")
    })
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
        Ok(self)
    }
}

#[cfg(test)]
mod tests;
