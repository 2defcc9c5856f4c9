//! Texts that the autopilot reads at start: its model of the aircraft, its part of a scenario.

use std::path::PathBuf;

use flight_control::AircraftModel;
use flight_control::aircraft_model::AircraftModelError;
use icd::EffectorList;
use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::parameters::{ParameterError, Parameters, SavedProblem, nearest, set_from_table};
use crate::script::{Script, ScriptError};
use crate::vehicle::schedule::{ReferenceEntry, ReferenceSchedule, ScheduleError};

/// The shipped model; written by `sitl aircraft linearize`.
pub const DEFAULT_MODEL: &str = include_str!("../../models/tvc_jet.toml");

/// The model files that come with the program, by the names of their aircraft. The variant of the jet with Mach effects has the
/// jet's model, which lacks them.
pub const MODELS: [(&str, &str); 4] = [
    ("tvc_jet", DEFAULT_MODEL),
    ("tvc_jet_mach", DEFAULT_MODEL),
    ("f16", include_str!("../../models/f16.toml")),
    ("aerosonde", include_str!("../../models/aerosonde.toml")),
];

/// Why a file cannot be used. Each message names the file, and the key, value and range where there is one.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        path: PathBuf,
        /// The error in it.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Neither a shipped scenario nor a file.
    #[error(
        "--scenario {name}: there is no such scenario and no such file; the scenarios are {known}"
    )]
    NoScenario {
        /// The name in the file.
        name: String,
        known: String,
    },
    /// Invalid text; the message has line, column and key.
    #[error("{file}: {source}")]
    Syntax { file: String, source: Box<toml::de::Error> },
    /// A model outside its range.
    #[error("{file}: {source}")]
    Model {
        file: String,
        /// Key, value and range.
        source: AircraftModelError,
    },
    /// A parameter of a model file.
    #[error("{file}: [parameters]: {problem}{}", hint(problem))]
    Parameters {
        file: String,
        /// Parameter, value and range.
        problem: SavedProblem,
    },
    /// A reference that cannot be flown.
    #[error("{file}: {source}")]
    Schedule {
        file: String,
        /// Key, value and range.
        source: ScheduleError,
    },
    /// An invalid script; the message has file, line and column.
    #[error(transparent)]
    Script(#[from] ScriptError),
}

/// The parameter that an unknown name probably means.
fn hint(problem: &SavedProblem) -> String {
    match problem {
        SavedProblem::Parameter(ParameterError::Unknown { name }) => {
            nearest(name).map_or_else(String::new, |name| format!("; the nearest is {name}"))
        }
        _ => String::new(),
    }
}

/// A model file: the aircraft, and the table [`PARAMETERS`] where it has one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// The controller's model of the aircraft.
    pub aircraft: AircraftModel,
    /// Defaults of the parameters for this aircraft: the program's where the file has none.
    pub defaults: Parameters,
}

/// Name of the table of parameters in a model file: NAME = value.
pub const PARAMETERS: &str = "parameters";

/// Reads a model file; `file` is its name for error messages.
pub fn model(file: &str, text: &str) -> Result<Model, ConfigError> {
    let table: toml::Table = parse(file, text)?;
    if table.contains_key(PARAMETERS) {
        return model_of(file, table);
    }
    // From the text, for the lines in messages.
    let aircraft = checked(file, parse(file, text)?)?;
    Ok(Model { aircraft, defaults: Parameters::default() })
}

/// Parses a file that was read already and may have been changed since.
pub fn model_of(file: &str, mut table: toml::Table) -> Result<Model, ConfigError> {
    let mut defaults = Parameters::default();
    if let Some(parameters) = table.remove(PARAMETERS) {
        let refused = |problem| ConfigError::Parameters { file: file.to_owned(), problem };
        let toml::Value::Table(parameters) = parameters else {
            let (name, value) = (PARAMETERS.to_owned(), parameters.to_string());
            return Err(refused(SavedProblem::NotANumber { name, value }));
        };
        set_from_table(&mut defaults, &parameters).map_err(refused)?;
    }
    Ok(Model { aircraft: checked(file, of_table(file, table)?)?, defaults })
}

/// The aircraft of a model file, without its parameters.
pub fn aircraft_model(file: &str, text: &str) -> Result<AircraftModel, ConfigError> {
    Ok(model(file, text)?.aircraft)
}

fn checked(file: &str, aircraft: AircraftModel) -> Result<AircraftModel, ConfigError> {
    aircraft.validate().map_err(|source| ConfigError::Model { file: file.to_owned(), source })?;
    Ok(aircraft)
}

/// The autopilot's part of a scenario file as written: the keys that it has. The plant's part is not read here.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    #[serde(rename = "plant")]
    _plant: Option<IgnoredAny>,
    #[serde(default)]
    autopilot: AutopilotPart,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct AutopilotPart {
    #[serde(default, rename = "reference")]
    references: Vec<ReferenceEntry>,
    script: Option<String>,
}

/// Reads the autopilot's part of a scenario; `file` is its name for error messages.
pub fn references(file: &str, text: &str) -> Result<ReferenceSchedule, ConfigError> {
    parse::<ScenarioFile>(file, text)?.autopilot.references(file)
}

/// Reads the script in a scenario, if there is one; `file` is its name for error messages.
pub fn script(
    file: &str,
    text: &str,
    effectors: &EffectorList,
) -> Result<Option<Script>, ConfigError> {
    parse::<ScenarioFile>(file, text)?.autopilot.script(file, effectors)
}

/// References and script of a scenario that was read already and may have been changed since.
pub fn scenario_of(
    file: &str,
    table: toml::Table,
    effectors: &EffectorList,
) -> Result<(ReferenceSchedule, Option<Script>), ConfigError> {
    let part = of_table::<ScenarioFile>(file, table)?.autopilot;
    let script = part.script(file, effectors)?;
    Ok((part.references(file)?, script))
}

impl AutopilotPart {
    fn references(self, file: &str) -> Result<ReferenceSchedule, ConfigError> {
        ReferenceSchedule::new(self.references)
            .map_err(|source| ConfigError::Schedule { file: file.to_owned(), source })
    }

    fn script(&self, file: &str, effectors: &EffectorList) -> Result<Option<Script>, ConfigError> {
        let name = format!("script of {file}");
        let script = self.script.as_ref().map(|script| Script::parse(&name, script, effectors));
        Ok(script.transpose()?)
    }
}

fn parse<T: serde::de::DeserializeOwned>(file: &str, text: &str) -> Result<T, ConfigError> {
    toml::from_str(text)
        .map_err(|source| ConfigError::Syntax { file: file.to_owned(), source: Box::new(source) })
}

fn of_table<T: serde::de::DeserializeOwned>(
    file: &str,
    table: toml::Table,
) -> Result<T, ConfigError> {
    table
        .try_into()
        .map_err(|source| ConfigError::Syntax { file: file.to_owned(), source: Box::new(source) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use flight_control::AllocationMode;
    use icd::tvc_jet;

    #[test]
    fn the_shipped_model_is_valid() {
        assert!(aircraft_model("tvc_jet.toml", DEFAULT_MODEL).is_ok());
    }

    #[test]
    fn a_model_out_of_range_names_file_key_value_and_range() {
        let text = DEFAULT_MODEL.replace("mass_kg = 9295.0", "mass_kg = -1.0");
        let error = aircraft_model("my.toml", &text).unwrap_err().to_string();
        assert_eq!(error, "my.toml: mass.mass_kg = -1 is outside 0.1 to 1000000");
    }

    #[test]
    fn every_number_of_a_model_that_is_not_finite_is_refused_by_its_key() {
        let value: toml::Value = toml::Value::Table(DEFAULT_MODEL.parse().unwrap());
        let mut numbers = Vec::new();
        collect(&value, &mut Vec::new(), &mut numbers);
        assert!(numbers.len() > 120, "{} numbers", numbers.len());
        for path in &numbers {
            for bad in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
                let mut changed = value.clone();
                let place = path.iter().fold(&mut changed, |at, step| match step {
                    Step::Key(key) => &mut at[key.as_str()],
                    Step::Place(place) => &mut at[*place],
                });
                *place = toml::Value::Float(bad);
                let text = toml::to_string(&changed).unwrap();
                let refused = aircraft_model("my.toml", &text).unwrap_err().to_string();
                let key = path.iter().rev().find_map(|step| match step {
                    Step::Key(key) => Some(key.as_str()),
                    Step::Place(_) => None,
                });
                let named = refused.contains(key.unwrap());
                assert!(refused.starts_with("my.toml: ") && named, "{key:?} = {bad}: {refused}");
            }
        }
    }

    /// One step on the path to a number of a file.
    #[derive(Clone)]
    enum Step {
        Key(String),
        Place(usize),
    }

    /// The paths to all numbers except whole ones, which are always finite.
    fn collect(value: &toml::Value, way: &mut Vec<Step>, numbers: &mut Vec<Vec<Step>>) {
        match value {
            toml::Value::Table(table) => {
                for (key, value) in table {
                    way.push(Step::Key(key.clone()));
                    collect(value, way, numbers);
                    way.pop();
                }
            }
            toml::Value::Array(all) => {
                for (place, value) in all.iter().enumerate() {
                    way.push(Step::Place(place));
                    collect(value, way, numbers);
                    way.pop();
                }
            }
            toml::Value::Float(_) => numbers.push(way.clone()),
            _ => {}
        }
    }

    #[test]
    fn a_model_file_has_parameters_of_its_aircraft_and_a_wrong_one_is_named_with_its_range() {
        let with =
            |lines: &str| model("my.toml", &format!("{DEFAULT_MODEL}\n[parameters]\n{lines}"));
        let read = with("FTC_ALLOC = 1\nALT_SLEW = 20.0\n").unwrap();
        assert_eq!(read.defaults.gains.selection.allocation, AllocationMode::Wls);
        assert_eq!(read.defaults.gains.references.slew_m_s, 20.0);
        assert_eq!(read.aircraft, aircraft_model("my.toml", DEFAULT_MODEL).unwrap());
        let shipped = model("my.toml", DEFAULT_MODEL).unwrap();
        assert_eq!(shipped.defaults, Parameters::default());
        for (lines, words) in [
            ("ALT_SLOW = 3", "there is no parameter ALT_SLOW; the nearest is ALT_SLEW"),
            ("OBS_W0 = -1", "OBS_W0 = -1 is outside 1 to 500 rad/s"),
            ("OBS_W0 = nan", "OBS_W0 = NaN is outside 1 to 500 rad/s"),
            ("FTC_ALLOC = 3", "FTC_ALLOC = 3 is outside 0 to 2"),
            ("OBS_W0 = \"40\"", "OBS_W0 = \"40\" is not a number"),
            ("REF_ALT_MIN = 15000", "REF_ALT_MIN = 15000 m is above REF_ALT_MAX = 12000 m"),
        ] {
            let error = with(lines).unwrap_err().to_string();
            assert!(
                error.starts_with("my.toml: [parameters]: ") && error.contains(words),
                "{error}"
            );
        }
        let text = format!("parameters = 3\n{DEFAULT_MODEL}");
        assert!(model("my.toml", &text).is_err());
    }

    #[test]
    fn a_misspelt_key_stops_the_start() {
        let text = DEFAULT_MODEL.replace("mass_kg", "mas_kg");
        let error = aircraft_model("my.toml", &text).unwrap_err().to_string();
        assert!(error.contains("mas_kg") && error.contains("mass_kg"), "{error}");
    }

    #[test]
    fn the_plant_part_of_a_scenario_is_not_looked_at() {
        let text =
            "[plant]\nanything = true\n[[autopilot.reference]]\nat_s = 1.0\nroll_deg = 15.0\n";
        assert!(references("s.toml", text).is_ok());
        assert!(references("s.toml", "[autopilot]\nrefs = 1\n").is_err());
        assert!(references("s.toml", "[pilot]\n").is_err());
    }

    #[test]
    fn the_script_of_a_scenario_is_read_and_an_error_names_its_line_and_column() {
        let scenario = |script: &str| format!("[autopilot]\nscript = \"\"\"\n{script}\"\"\"\n");
        let read = |text: &str| script("s.toml", &scenario(text), &tvc_jet::effectors());
        assert_eq!(script("s.toml", "[plant]\n", &tvc_jet::effectors()).unwrap(), None);
        let found = read("at 3 s: fail rudder stuck\n").unwrap().unwrap();
        assert_eq!(found.lines().count(), 1);
        let error = read("at 3 s: fail rudder stuck\nfial rudder stuck\n").unwrap_err().to_string();
        assert!(error.starts_with("script of s.toml, line 2, column 1: `fial` found"), "{error}");
    }
}
