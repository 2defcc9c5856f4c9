//! The specification of a campaign: what its file says, checked key by key.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use autopilot::own_law::OwnLaw;
use host_io::file::{self, TEXT_MAX};
use host_io::problem::{At as _, Problem, problem};
use icd::ControlPeriod;
use lab_engine::configuration::{AircraftArgs, Named};
use lab_engine::settings::{self, Setting, number, written};
use lab_judges::JudgeKind;
use plant_sim::airframe_file;
use scenarios::SCENARIOS;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use studies::{STUDIES, SUITE};
use toml::Value as Toml;

mod joint;
mod query;
mod variable;

pub use joint::{EachTwo, Joint, JointCase, JointMeaning};
pub use query::{Aggregate, ColumnSpec, ENDS, Fields, TableSpec};
pub use variable::{Each, Grid, Meaning, Normal, Variable};

/// Help on a specification.
pub(crate) fn help() -> String {
    let names = STUDIES.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    format!("The campaign: {names}, ftc-01 to ftc-12, or a file")
}

/// Most flights of a campaign; numbers of runs stay exact in every table.
pub const RUNS_MAX: u64 = 1 << 40;
/// Largest seed of a flight: JSON carries whole numbers up to it exactly.
pub(crate) const SEED_MAX: u64 = 1 << 53;
/// Most samples of each cell: the Sobol sequence has so many points.
pub const SAMPLES_MAX: u32 = 1 << 16;
/// Longest flight, s.
const DURATION_MAX_S: f64 = 86_400.0;

/// A campaign, as its file has it.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// Its name, for titles.
    pub name: String,
    /// What it is for, a sentence.
    #[serde(default)]
    pub about: String,
    /// Seed of all draws and flights.
    #[serde(default = "one")]
    pub seed: u64,
    #[serde(default)]
    pub seeds: Seeds,
    /// Duration of each flight, s.
    pub duration_s: f64,
    /// A scenario that comes with the program, or a file beside this one.
    pub scenario: String,
    /// Draws of the distributed variables for each combination of the others.
    #[serde(default = "one_sample")]
    pub samples: u32,
    /// How the distributed variables are drawn.
    #[serde(default)]
    pub design: Design,
    /// Control period, ms.
    #[serde(default = "period_ms")]
    pub period_ms: u32,
    /// Step of the plant, us; without it the largest divisor of the control period up to 2 ms.
    pub step_us: Option<u32>,
    /// What every flight has: keys and values of `--set`.
    #[serde(default)]
    pub set: toml::Table,
    /// References that each flight draws by its seed.
    pub manoeuvres: Option<Manoeuvres>,
    /// The aircraft; without one, the one that comes with the program.
    #[serde(default)]
    pub airframe: Vec<AirframeSpec>,
    /// The laws that are compared, each on the same flights; the first one is the reference.
    pub law: Vec<LawSpec>,
    /// What is varied.
    #[serde(default)]
    pub vary: Vec<Variable>,
    /// What is varied together; after [`SpecFile::parse`] these stand among the variables too.
    #[serde(default)]
    pub joint: Vec<Joint>,
    /// Judges whose numbers stand beside the measures.
    #[serde(default, deserialize_with = "judges")]
    pub judges: Vec<JudgeKind>,
    /// Measures whose medians stand in the summary.
    #[serde(default)]
    pub measures: Vec<String>,
    /// Tables of the results.
    #[serde(default, rename = "table")]
    pub tables: Vec<TableSpec>,
}

/// Which seed a flight has.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Seeds {
    /// One of its own, drawn.
    #[default]
    Flights,
    /// That of its sample, `seed` + 0, 1, 2, …: every combination of listed values meets the same air, sensors and manoeuvres.
    Samples,
}

/// Turns with a climb or descent and a change of speed, and straight and level flight after each.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manoeuvres {
    /// The first turn begins, s.
    pub from_s: f64,
    /// Length of a turn, and of the straight flight after it, s.
    pub turn_s: f64,
    pub level_s: f64,
    /// Least and largest bank, deg, to either side.
    pub roll_deg: [f64; 2],
    /// Largest changes, as parts of altitude and airspeed at the start.
    pub altitude_part: f64,
    pub airspeed_part: f64,
}

fn judges<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<JudgeKind>, D::Error> {
    let names = Vec::<String>::deserialize(from)?;
    names.iter().map(|name| JudgeKind::parse(name).map_err(D::Error::custom)).collect()
}

/// How distributed variables are drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Design {
    /// Independent draws.
    #[default]
    Random,
    /// Each variable has one draw in each of as many strata of equal probability as there are samples.
    LatinHypercube,
    /// The Owen-scrambled Sobol sequence.
    Sobol,
}

/// An aircraft of a campaign.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirframeSpec {
    /// Name in tables.
    pub name: String,
    /// An aircraft that comes with the program by name, or an airframe file beside this one; without it, `tvc_jet`.
    pub file: Option<PathBuf>,
    /// The controller's model in the same way; without it, that of the aircraft's name.
    pub model: Option<PathBuf>,
    /// What its flights have.
    #[serde(default)]
    pub set: toml::Table,
}

/// A law of a campaign.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LawSpec {
    /// Name in tables.
    pub name: String,
    /// What it is, for readers of the report.
    #[serde(default)]
    pub about: String,
    /// Parameters from a file, as `--gains`.
    pub gains: Option<PathBuf>,
    /// The reference that knows the fault, in place of a compensator: no law of the autopilot.
    #[serde(default)]
    pub fault_known: bool,
    /// Parameters and other keys of `--set`.
    #[serde(default)]
    pub set: toml::Table,
    /// Parameters that `sitl campaign tune` searches.
    #[serde(default)]
    pub tune: Vec<String>,
}

/// A specification with the text that it was read from.
#[derive(Debug, Clone)]
pub struct SpecFile {
    /// Name for messages.
    pub name: String,
    /// Its text.
    pub text: String,
    /// Folder that its file names are relative to.
    pub folder: PathBuf,
    /// What it says.
    pub spec: Spec,
    /// Laws that the program brings; each flies in the `[[law]]` of its name, the first one wherever `CTL_LAW` is set to 9.
    pub own_laws: Vec<OwnLaw>,
    /// Words of the command that change it.
    pub options: Vec<String>,
}

impl SpecFile {
    /// Reads a campaign that comes with the program, or a file.
    pub fn read(name: &str) -> Result<Self, Problem> {
        if let Some((_, text)) = STUDIES.iter().chain(&SUITE).find(|(known, _)| *known == name) {
            let mut file = Self::parse(name, (*text).to_owned(), PathBuf::new())?;
            if SUITE.iter().any(|(known, _)| *known == name) {
                // Its files stay as they are, and so do its flights.
                let _ = file.spec.step_us.get_or_insert(1_000);
            }
            return Ok(file);
        }
        let path = Path::new(name);
        let text = file::read_text(path, TEXT_MAX).map_err(|problem| {
            let known: Vec<&str> = STUDIES.iter().chain(&SUITE).map(|(name, _)| *name).collect();
            let known = known.join(", ");
            problem!("{name}: {problem}; the campaigns that come with the program are {known}")
        })?;
        Self::parse(name, text, path.parent().unwrap_or(Path::new("")).to_path_buf())
    }

    /// Reads a campaign, with the laws that the program brings and with more settings that every flight has.
    pub fn read_with(name: &str, own: &[OwnLaw], args: &AircraftArgs) -> Result<Self, Problem> {
        let file = Self::read(name)?.with_own_laws(own)?;
        file.flying(args)?.with(&args.settings)
    }

    /// Adds an option of the command to the text, so that the results are those of another specification.
    pub(crate) fn note(&mut self, option: &str, value: &dyn Display) {
        self.text += &format!("\n# --{option} {value}\n");
        self.options.extend([format!("--{option}"), value.to_string()]);
    }

    /// The same with another aircraft in place of its own.
    fn flying(mut self, args: &AircraftArgs) -> Result<Self, Problem> {
        let paths = [("airframe", &args.airframe), ("model", &args.model)];
        for (option, path) in paths.iter().filter_map(|(o, path)| Some((o, path.as_ref()?))) {
            let name = path.display();
            self.note(option, &name);
            self.spec.name += &format!(", {option} {name}");
        }
        if args.airframe.is_some() || args.model.is_some() {
            // Relative to where the command is given, not to the specification.
            let from_here = |path: &PathBuf| match airframe_file::is_shipped(path) {
                true => Ok(path.clone()),
                false => std::path::absolute(path).at(path.display()),
            };
            let [file, model] = [&args.airframe, &args.model].map(|p| p.as_ref().map(from_here));
            let (file, model) = (file.transpose()?, model.transpose()?);
            self.spec.airframe = vec![AirframeSpec { file, model, ..AirframeSpec::default() }];
        }
        Ok(self)
    }

    /// Parses a text.
    pub fn parse(name: &str, text: String, folder: PathBuf) -> Result<Self, Problem> {
        let mut spec: Spec = toml::from_str(&text).at(name)?;
        spec.check(name)?;
        // After `check`, because names of levels are no keys of `--set`.
        spec.vary.extend(spec.joint.iter().flat_map(Joint::variables));
        spec.check_names(name)?;
        let (name, options) = (name.to_owned(), Vec::new());
        Ok(Self { name, text, folder, spec, own_laws: Vec::new(), options })
    }

    /// The same with more settings that every flight has. They belong to the name and to the text of the specification, so its results
    /// are those of another one.
    pub fn with(mut self, settings: &[Setting]) -> Result<Self, Problem> {
        for setting in settings {
            let Setting { key, value } = checked(&setting.key, &setting.value, "--set")?;
            self.note("set", &setting);
            self.spec.name += &format!(", {setting}");
            // The specification has a key of its own for the duration, which would win over the
            // setting.
            if key == "plant.duration_s" {
                self.spec.duration_s = number(&value).unwrap_or(f64::NAN);
                self.spec.check_duration("--set")?;
                continue;
            }
            if let Some(place) = self.spec.set_later(&key) {
                let expected = format!("another key, because {place} sets this one");
                return refuse("--set", &key, value, &expected);
            }
            drop(self.spec.set.insert(key, value));
        }
        Ok(self)
    }

    /// The same with laws that the program brings, each one law more. Where a `[[law]]` sets `CTL_LAW`, or `FTC_ALLOC`, to 9 already,
    /// the first of them flies there instead. Their names belong to the text of the specification.
    pub fn with_own_laws(self, own: &[OwnLaw]) -> Result<Self, Problem> {
        let Self { name, mut text, folder, spec, .. } = self;
        let selects = |set: &toml::Table, (key, value): (&str, f64)| {
            set.get(key).and_then(number) == Some(value)
        };
        let sets = || [&spec.set].into_iter().chain(spec.law.iter().map(|law| &law.set));
        for (place, law) in own.iter().enumerate() {
            let is_own = |set: &toml::Table| law.selection().any(|one| selects(set, one));
            let own_name = Toml::String(law.name().to_owned());
            text += &match place == 0 && sets().any(is_own) {
                true => format!("\n# CTL_LAW = 9 is {own_name}\n"),
                false => {
                    let line = |key: &str, value: f64| format!("{key} = {value}");
                    let selected = law.selection().map(|(key, value)| line(key, value));
                    let more = law.settings().iter().map(|(key, value)| line(key, *value));
                    let set: Vec<String> = selected.chain(more).collect();
                    format!("\n[[law]]\nname = {own_name}\nset = {{ {} }}\n", set.join(", "))
                }
            };
        }
        let mut file = Self { own_laws: own.to_vec(), ..Self::parse(&name, text, folder)? };
        // The suite has a step that its text does not have.
        file.spec.step_us = spec.step_us;
        Ok(file)
    }

    /// The law of the program that flies in a `[[law]]` of this name.
    pub(crate) fn own_law(&self, name: &str) -> Option<&OwnLaw> {
        self.own_laws.iter().find(|own| own.name() == name).or(self.own_laws.first())
    }

    /// A file that the specification names.
    pub fn beside(&self, path: &Path) -> PathBuf {
        self.folder.join(path)
    }

    /// The scenario: one that comes with the program, or else a file beside the specification.
    pub fn scenario(&self) -> Result<Named, Problem> {
        let name = &self.spec.scenario;
        let beside = self.beside(Path::new(name));
        let is_shipped = SCENARIOS.iter().any(|(known, _)| known == name);
        match !is_shipped && beside.is_file() {
            true => Named::read(&beside),
            false => Named::scenario(name),
        }
    }
}

impl Spec {
    /// The control period.
    pub fn period(&self) -> Option<ControlPeriod> {
        ControlPeriod::from_micros(self.period_ms.checked_mul(1_000)?).ok()
    }

    /// What sets a key in some flights after the settings that all flights have.
    fn set_later(&self, key: &str) -> Option<&'static str> {
        // A factor multiplies what is set.
        let by = |v: &Variable| v.meaning != Meaning::Factor && v.keys().any(|set| set == key);
        let places = [
            (key == "plant.seed", "seed"),
            (self.manoeuvres.is_some() && key.starts_with("autopilot.reference"), "[manoeuvres]"),
            (self.vary.iter().any(by), "[[vary]]"),
            (self.airframe.iter().any(|airframe| airframe.set.contains_key(key)), "[[airframe]]"),
            (self.law.iter().any(|law| law.set.contains_key(key)), "[[law]]"),
        ];
        places.into_iter().find_map(|(is_it, place)| is_it.then_some(place))
    }

    /// Of a listed variable one value alone.
    pub(crate) fn keep_only(&mut self, only: &Setting) -> Result<(), Problem> {
        let refuse = |expected: &str| refuse("--only", &only.key, &only.value, expected);
        let listed = |v: &&mut Variable| v.key == only.key && v.values.is_some();
        let Some(variable) = self.vary.iter_mut().find(listed) else {
            let known = self.vary.iter().filter(|v| v.values.is_some());
            let known: Vec<&str> = known.map(|variable| variable.key.as_str()).collect();
            return refuse(&format!("one of {}", known.join(", ")));
        };
        let values = variable.values.iter().flatten();
        let is_it =
            // A text is no number, and NaN equals nothing.
            |v: &&Toml| **v == only.value || number(v) == number(&only.value).or(Some(f64::NAN));
        match values.clone().find(is_it).cloned() {
            Some(value) => variable.values = Some(vec![value]),
            None => {
                let known: Vec<String> = values.filter_map(text_of).collect();
                return refuse(&format!("one of {}", known.join(", ")));
            }
        }
        Ok(())
    }

    fn check_duration(&self, file: &str) -> Result<(), Problem> {
        let expected = format!("more than 0 and at most {DURATION_MAX_S} s");
        match self.duration_s > 0.0 && self.duration_s <= DURATION_MAX_S {
            true => Ok(()),
            false => refuse(file, "duration_s", self.duration_s, &expected),
        }
    }

    fn check(&self, file: &str) -> Result<(), Problem> {
        let refuse = |key: &str, value: String, expected: &str| refuse(file, key, value, expected);
        self.check_duration(file)?;
        if !(1..=SAMPLES_MAX).contains(&self.samples) {
            return refuse("samples", self.samples.to_string(), &format!("1 to {SAMPLES_MAX}"));
        }
        if self.period().is_none() {
            return refuse("period_ms", self.period_ms.to_string(), "1 to 4 ms");
        }
        if self.law.is_empty() {
            return refuse("law", "[]".to_owned(), "at least one [[law]]");
        }
        for names in [
            self.law.iter().map(|law| &law.name).collect::<Vec<_>>(),
            self.airframe.iter().map(|airframe| &airframe.name).collect(),
        ] {
            for (place, name) in names.iter().enumerate() {
                if name.is_empty() || names[..place].contains(name) {
                    return refuse("name", format!("{name:?}"), "each name once, and not empty");
                }
            }
        }
        let of_airframes = self.airframe.iter().map(|airframe| &airframe.set);
        let of_laws = self.law.iter().map(|law| &law.set);
        for table in [&self.set].into_iter().chain(of_airframes).chain(of_laws) {
            // For the checks alone: plan and flights read it again.
            let _ = settings_of(table, file)?;
        }
        if let Some(Manoeuvres {
            from_s,
            turn_s,
            level_s,
            roll_deg: [least, most],
            altitude_part,
            airspeed_part,
        }) = self.manoeuvres
        {
            for (key, value) in [("from_s", from_s), ("turn_s", turn_s), ("level_s", level_s)] {
                if !(1.0..=DURATION_MAX_S).contains(&value) {
                    let expected = format!("1 to {DURATION_MAX_S} s");
                    return refuse(&format!("manoeuvres.{key}"), value.to_string(), &expected);
                }
            }
            for (key, part) in [("altitude_part", altitude_part), ("airspeed_part", airspeed_part)]
            {
                if !(0.0..=0.5).contains(&part) {
                    return refuse(&format!("manoeuvres.{key}"), part.to_string(), "0 to 0.5");
                }
            }
            if !(0.0 <= least && least <= most && most <= 80.0) {
                let expected = "two numbers in rising order, 0 to 80 deg";
                return refuse("manoeuvres.roll_deg", format!("[{least}, {most}]"), expected);
            }
        }
        self.vary.iter().try_for_each(|variable| variable.check(file))?;
        self.joint.iter().try_for_each(|joint| joint.check(file))
    }

    /// Every key that is varied has one source, and every law that is tuned a file of its own.
    fn check_names(&self, file: &str) -> Result<(), Problem> {
        let tuned: Vec<&LawSpec> = self.law.iter().filter(|law| !law.tune.is_empty()).collect();
        for (place, law) in tuned.iter().enumerate() {
            let path = file_name(&law.name);
            let is_same = |other: &&&LawSpec| file_name(&other.name) == path;
            if let Some(other) = tuned[..place].iter().find(is_same) {
                let expected = format!(
                    "a name whose gains do not go to {path}.toml, as those of \"{}\" do",
                    other.name
                );
                return refuse(file, "law.name", &law.name, &expected);
            }
        }
        self.tables.iter().try_for_each(|table| table.check(self, file))?;
        let keys = || self.vary.iter().flat_map(Variable::keys);
        match keys().enumerate().find(|(place, key)| keys().take(*place).any(|other| other == *key))
        {
            None => Ok(()),
            Some((_, key)) => {
                refuse(file, "vary.key", key, "each key once, in [[vary]] and [[joint]] together")
            }
        }
    }
}

/// A law's name as a name of a file.
pub fn file_name(law: &str) -> String {
    let letter = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let name: String = law.chars().map(letter).collect();
    let words: Vec<&str> = name.split('-').filter(|word| !word.is_empty()).collect();
    words.join("-")
}

/// A finite number, a text, true or false.
fn is_scalar(value: &Toml) -> bool {
    match value {
        Toml::Float(number) => number.is_finite(),
        Toml::String(_) | Toml::Integer(_) | Toml::Boolean(_) => true,
        _ => false,
    }
}

fn check_key(key: &str, file: &str) -> Result<(), Problem> {
    let setting = Setting::new(key, "");
    settings::check_keys(std::slice::from_ref(&setting)).at(file)
}

/// A value as `--set` takes it; `None` of a list or table.
pub fn text_of(value: &Toml) -> Option<String> {
    match value {
        Toml::String(text) => Some(text.clone()),
        Toml::Integer(_) | Toml::Float(_) | Toml::Boolean(_) => Some(value.to_string()),
        _ => None,
    }
}

/// Settings of a table of keys and values.
pub fn settings_of(table: &toml::Table, file: &str) -> Result<Vec<Setting>, Problem> {
    let mut settings: Vec<Setting> =
        table.iter().map(|(key, value)| checked(key, value, file)).collect::<Result<_, _>>()?;
    // Entry 2 of a list before entry 10: each is one more than there are.
    let words = |key: &str| -> Vec<(usize, String)> {
        // A word that is no number stands by its letters.
        key.split('.').map(|word| (word.parse().unwrap_or(0), word.to_owned())).collect()
    };
    settings.sort_by_cached_key(|setting| words(&setting.key));
    Ok(settings)
}

/// A setting whose key exists and whose value has one place in a table.
fn checked(key: &str, given: &Toml, file: &str) -> Result<Setting, Problem> {
    check_key(key, file)?;
    let value = given.as_str().map_or_else(|| given.clone(), written);
    match is_scalar(&value) {
        true => Ok(Setting { key: key.to_owned(), value }),
        false => {
            let expected =
                "a finite number, a text, true or false (keys with dots stand in quotes)";
            refuse(file, key, given, expected)
        }
    }
}

/// A value that a key cannot have.
fn refuse<T>(file: &str, key: &str, value: impl Display, expected: &str) -> Result<T, Problem> {
    Err(problem!("{file}: {key} = {value}: expected {expected}"))
}

fn one() -> u64 {
    1
}

fn one_sample() -> u32 {
    1
}

fn period_ms() -> u32 {
    2
}
