//! `--set KEY=VALUE`: any key of the files of a flight, and any parameter, from the command line.
//!
//! | key | what it changes |
//! |---|---|
//! | `plant.…`, `autopilot.…` | the scenario, as in its file: `plant.wind.turbulence_m_s`, `plant.fault.1.angle_deg` |
//! | `airframe.…` | the airframe file: `airframe.mass.mass_kg` |
//! | `model.…` | the controller's model: `model.mass.mass_kg` |
//! | capitals | a parameter of the autopilot: `FTC_MODE` |
//!
//! Entries of a list are counted from 1; one more than there are adds one. The keys are those that the readers of the
//! files know ([`keys`]), so there is no second list of them.

use std::fmt;

use autopilot::parameters::{Parameter, ParameterError, Parameters, table};
use toml::{Table, Value};

use crate::problem::{At as _, Problem, problem};

pub mod keys;

/// One `--set`.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub key: String,
    /// To what, as it would stand in the file.
    pub value: Value,
}

impl Setting {
    /// Of a key and a value of any kind that a file can have.
    pub fn new(key: &str, value: impl Into<Value>) -> Self {
        Self { key: key.to_owned(), value: value.into() }
    }
}

/// As `--set` takes it: a text without quotes.
impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.key, shown(&self.value))
    }
}

/// Which file a key belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    Scenario,
    Airframe,
    Model,
    /// A parameter of the autopilot.
    Parameter,
}

impl Target {
    /// Its name, for messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Scenario => "the scenario (plant.…, autopilot.…)",
            Self::Airframe => "the airframe (airframe.…)",
            Self::Model => "the model (model.…)",
            Self::Parameter => "parameters (capitals)",
        }
    }
}

impl Setting {
    /// Reads `KEY=VALUE`, for the command line.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((key, value)) if !key.trim().is_empty() => {
                Ok(Self { key: key.trim().to_owned(), value: written(value.trim()) })
            }
            _ => Err(format!("{text} is not KEY=VALUE")),
        }
    }

    /// The file that the key belongs to.
    pub fn target(&self) -> Result<Target, Problem> {
        let known = keys::all();
        if table().iter().any(|row| row.name == self.key) {
            return Ok(Target::Parameter);
        }
        if keys::is_known(&self.key) {
            return Ok(match self.key.split('.').next() {
                Some("airframe") => Target::Airframe,
                Some("model") => Target::Model,
                _ => Target::Scenario,
            });
        }
        // What a ground station may not set either has its own reason.
        if let Err(
            error @ (ParameterError::ReadOnly { .. } | ParameterError::OnlyInFlight { .. }),
        ) = Parameters::default().set(&self.key, 0.0)
        {
            return Err(error).at("--set");
        }
        let names = table().iter().map(|row| row.name.to_owned());
        let nearest = keys::nearest(&self.key, known.iter().cloned().chain(names));
        let nearest = nearest.map_or_else(String::new, |key| format!("; the nearest is {key}"));
        Err(problem!("--set {}: there is no such key{nearest}", self.key))
    }
}

/// The settings of one file.
pub fn of(settings: &[Setting], target: Target) -> Vec<&Setting> {
    settings.iter().filter(|setting| setting.target() == Ok(target)).collect()
}

/// Checks that every key exists.
pub fn check_keys(settings: &[Setting]) -> Result<(), Problem> {
    for (place, Setting { key, .. }) in settings.iter().enumerate() {
        // Which of two counts would depend on their order.
        if settings[..place].iter().any(|before| before.key == *key) {
            return Err(problem!("--set {key}: this key is set twice"));
        }
    }
    settings.iter().try_for_each(|setting| setting.target().map(drop))
}

/// Puts settings into a file that was read; `root` is what their keys have before those of the file.
pub fn apply(file: &mut Table, root: &str, settings: &[&Setting]) -> Result<(), Problem> {
    for setting in settings {
        let path = setting.key.strip_prefix(root).unwrap_or(&setting.key);
        put(file, path, setting)?;
    }
    Ok(())
}

fn put(file: &mut Table, path: &str, setting: &Setting) -> Result<(), Problem> {
    let words: Vec<&str> = path.split('.').collect();
    let Some((first, rest)) = words.split_first() else { return Ok(()) };
    let mut place = *first;
    let mut here = entry(file, first, rest.first());
    for (index, word) in rest.iter().enumerate() {
        let next = rest.get(index + 1);
        here = match (here, word.parse::<usize>()) {
            (Value::Array(list), Ok(number)) => {
                let max = list.len() + 1;
                if !(1..=max).contains(&number) {
                    let key = &setting.key;
                    return Err(problem!(
                        "--set {key}: entry {number} of {place} is outside 1 to {max}"
                    ));
                }
                if number == max {
                    list.push(empty(next));
                }
                &mut list[number - 1]
            }
            (Value::Table(table), Err(_)) => entry(table, word, next),
            _ => return Err(problem!("--set {}: {place} is no table here", setting.key)),
        };
        place = word;
    }
    *here = setting.value.clone();
    Ok(())
}

fn entry<'a>(table: &'a mut Table, word: &str, next: Option<&&str>) -> &'a mut Value {
    table.entry(word).or_insert_with(|| empty(next))
}

/// What stands in a place before something is put into it.
fn empty(next: Option<&&str>) -> Value {
    match next {
        Some(word) if word.parse::<usize>().is_ok() => Value::Array(Vec::new()),
        _ => Value::Table(Table::new()),
    }
}

/// A value as it would stand in the file; what is none is a text, so that names need no quotes.
pub fn written(text: &str) -> Value {
    let line: Result<Table, _> = toml::from_str(&format!("value = {text}"));
    match line {
        // A value with a line feed could bring more keys.
        Ok(mut table) if table.len() == 1 => table.remove("value"),
        _ => None,
    }
    .unwrap_or_else(|| Value::String(text.to_owned()))
}

/// Sets the parameters among the settings, all at once, so that their order does not matter.
pub fn set_parameters(parameters: &mut Parameters, settings: &[Setting]) -> Result<(), Problem> {
    let mut values = Vec::new();
    for setting in of(settings, Target::Parameter) {
        let Some(row) = table().iter().find(|row| row.name == setting.key) else { continue };
        let value = number(&setting.value).ok_or_else(|| {
            let (Parameter { name, min, max, unit, .. }, value) = (row, shown(&setting.value));
            problem!("--set {name}={value}: {name} is a number from {min} to {max} {unit}")
        })?;
        values.push((row.name, value));
    }
    // A warning about Lemma 1 is no reason to refuse: whoever sets gains by hand knows it.
    parameters.set_all(values).at("--set").map(drop)
}

/// A whole number of a file is a number too.
pub fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|number| number as f64))
}

fn shown(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// A file's name with what was set in it, for messages.
pub fn describe(name: &str, settings: &[&Setting]) -> String {
    let set: Vec<String> = settings.iter().map(|setting| format!(" --set {setting}")).collect();
    format!("{name}{}", set.concat())
}

#[cfg(test)]
mod tests;
