//! Texts that the autopilot reads at start: its model of the aircraft, its part of a scenario.

use flight_control::AircraftModel;
use icd::EffectorList;
use serde::Deserialize;
use serde::de::{DeserializeOwned, IgnoredAny};

use crate::TextError;
use crate::parameters::{ParameterError, Parameters, SavedProblem, nearest, set_from_table};
use crate::script::Script;
use crate::vehicle::schedule::{ReferenceEntry, ReferenceSchedule};

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
pub fn model(file: &str, text: &str) -> Result<Model, TextError> {
    let table: toml::Table = parse(file, text)?;
    if table.contains_key(PARAMETERS) {
        return model_of(file, table);
    }
    // From the text, for the lines in messages.
    let aircraft = checked(file, parse(file, text)?)?;
    Ok(Model { aircraft, defaults: Parameters::default() })
}

/// Parses a file that was read already and may have been changed since.
pub fn model_of(file: &str, mut table: toml::Table) -> Result<Model, TextError> {
    let mut defaults = Parameters::default();
    if let Some(parameters) = table.remove(PARAMETERS) {
        let place = format!("{file}: [{PARAMETERS}]");
        let toml::Value::Table(parameters) = parameters else {
            let why = format!("{PARAMETERS} = {parameters} is not a number");
            return Err(TextError::at(place, why));
        };
        set_from_table(&mut defaults, &parameters).map_err(|problem| {
            // The parameter that an unknown name probably means.
            let meant = match &problem {
                SavedProblem::Parameter(ParameterError::Unknown { name }) => nearest(name),
                _ => None,
            };
            let hint = meant.map_or_else(String::new, |name| format!("; the nearest is {name}"));
            TextError::at(place, format!("{problem}{hint}"))
        })?;
    }
    Ok(Model { aircraft: checked(file, of_table(file, table)?)?, defaults })
}

/// The aircraft of a model file, without its parameters.
pub fn aircraft_model(file: &str, text: &str) -> Result<AircraftModel, TextError> {
    Ok(model(file, text)?.aircraft)
}

fn checked(file: &str, aircraft: AircraftModel) -> Result<AircraftModel, TextError> {
    aircraft.validate().map_err(|problem| TextError::at(file, problem))?;
    Ok(aircraft)
}

/// The autopilot's part of a scenario file as written: the keys that it has. The plant's part is not read here.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    // Has a name only so that `deny_unknown_fields` lets the plant's part pass.
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
pub fn references(file: &str, text: &str) -> Result<ReferenceSchedule, TextError> {
    parse::<ScenarioFile>(file, text)?.autopilot.references(file)
}

/// Reads the script in a scenario, if there is one; `file` is its name for error messages.
pub fn script(
    file: &str,
    text: &str,
    effectors: &EffectorList,
) -> Result<Option<Script>, TextError> {
    parse::<ScenarioFile>(file, text)?.autopilot.script(file, effectors)
}

/// References and script of a scenario that was read already and may have been changed since.
pub fn scenario_of(
    file: &str,
    table: toml::Table,
    effectors: &EffectorList,
) -> Result<(ReferenceSchedule, Option<Script>), TextError> {
    let part = of_table::<ScenarioFile>(file, table)?.autopilot;
    let script = part.script(file, effectors)?;
    Ok((part.references(file)?, script))
}

impl AutopilotPart {
    fn references(self, file: &str) -> Result<ReferenceSchedule, TextError> {
        ReferenceSchedule::new(self.references).map_err(|problem| TextError::at(file, problem))
    }

    fn script(&self, file: &str, effectors: &EffectorList) -> Result<Option<Script>, TextError> {
        let name = format!("script of {file}");
        self.script.as_ref().map(|text| Script::parse(&name, text, effectors)).transpose()
    }
}

fn parse<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, TextError> {
    toml::from_str(text).map_err(|problem| TextError::at(file, problem))
}

fn of_table<T: DeserializeOwned>(file: &str, table: toml::Table) -> Result<T, TextError> {
    table.try_into().map_err(|problem| TextError::at(file, problem))
}

#[cfg(test)]
mod tests {
    use super::*;
    use aircraft::DEFAULT_MODEL;
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
            ("FTC_ALLOC = 3", "FTC_ALLOC = 3 is none of 0, 1, 2, 9"),
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
