//! The parameters as a text for reading and editing: the values that differ from their defaults, as
//! TOML.

use core::fmt::Write as _;

use flight_control::compensator::neso::Lemma1Warning;

use super::{Kind, ParameterError, Parameters, table};

/// Header of the file, above the values.
const HEADER: &str = "\
# Parameters of the autopilot that differ from their defaults.
# Written anew, comments and all, whenever a ground station sets one.
";

/// Characters of a line that a message repeats.
const LINE_MAX: usize = 60;

/// Why saved parameters cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{file}: {problem}; mend the file, or start with --parameter-file none")]
pub struct SavedError {
    pub file: String,
    /// The error in it.
    pub problem: SavedProblem,
}

/// Error of saved parameters.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SavedProblem {
    /// The file exists and cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    #[error("{0}")]
    Syntax(String),
    /// Something other than a number.
    #[error("{name} = {value} is not a number")]
    NotANumber { name: String, value: String },
    /// An invalid name or value.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
}

/// The text for `parameters`, where `defaults` are those of the aircraft. [`from_text`] gives the same parameters to
/// the bit.
pub fn to_text(parameters: &Parameters, defaults: &Parameters) -> String {
    let mut text = HEADER.to_owned();
    for row in table() {
        let (value, default) = (row.value(parameters), row.value(defaults));
        if value.to_bits() != default.to_bits() {
            let unit = if row.unit == "-" { String::new() } else { format!(" {}", row.unit) };
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{} = {value} # default {default}{unit}", row.name);
        }
    }
    text
}

/// The parameters in `text`, which comes from `file`; the others have the values of `defaults`.
pub fn from_text(file: &str, text: &str, defaults: &Parameters) -> Result<Parameters, SavedError> {
    let refuse = |problem| SavedError { file: file.to_owned(), problem };
    let mut parameters = *defaults;
    // The warning, if any, was reported when the value was set.
    set_from_text(&mut parameters, text).map_err(refuse)?;
    Ok(parameters)
}

/// Sets the parameters in `text`; the others stay.
pub fn set_from_text(
    parameters: &mut Parameters,
    text: &str,
) -> Result<Option<Lemma1Warning>, SavedProblem> {
    let table: toml::Table = text
        .parse()
        .map_err(|error: toml::de::Error| SavedProblem::Syntax(one_line(&error, text)))?;
    set_from_table(parameters, &table)
}

/// Sets the parameters in a table; the others stay.
pub fn set_from_table(
    parameters: &mut Parameters,
    table: &toml::Table,
) -> Result<Option<Lemma1Warning>, SavedProblem> {
    let settings = table.iter().map(|(name, value)| Ok((name.as_str(), number(name, value)?)));
    let settings: Vec<(&str, f64)> = settings.collect::<Result<_, SavedProblem>>()?;
    Ok(parameters.set_all(settings)?)
}

/// Whether a text contains numbers under names of parameters and nothing else. Whether they are valid together depends
/// on the defaults of an aircraft.
pub fn has_only_parameters(text: &str) -> bool {
    let is_one = |(name, value): (&String, &toml::Value)| {
        number(name, value).is_ok() && table().iter().any(|row| row.name == name)
    };
    text.parse::<toml::Table>().is_ok_and(|table| table.iter().all(is_one))
}

fn number(name: &str, value: &toml::Value) -> Result<f64, SavedProblem> {
    match value {
        toml::Value::Float(value) => Ok(*value),
        // A value beyond 32 bits is out of every range too.
        toml::Value::Integer(value) => Ok(i32::try_from(*value).map_or(f64::INFINITY, f64::from)),
        _ => Err(SavedProblem::NotANumber { name: name.to_owned(), value: value.to_string() }),
    }
}

fn one_line(error: &toml::de::Error, text: &str) -> String {
    let at = error.span().map_or(0, |span| span.start.min(text.len()));
    let before = text.bytes().take(at).filter(|byte| *byte == b'\n').count();
    let line: String =
        text.lines().nth(before).unwrap_or_default().chars().take(LINE_MAX).collect();
    format!("line {} ({line}): {}", before + 1, error.message().replace('\n', " "))
}

impl Parameters {
    /// The values that differ from `defaults`, for display: `OBS_W0 = 40, FTC_MODE = 0`.
    pub fn differences(&self, defaults: &Self) -> Vec<String> {
        let bits = |row: &super::Parameter, of: &Self| row.value(of).to_bits();
        let changed = table().iter().filter(|row| bits(row, self) != bits(row, defaults));
        changed
            .map(|row| match row.kind {
                Kind::Int => format!("{} = {:.0}", row.name, row.value(self)),
                Kind::Real => format!("{} = {}", row.name, row.value(self)),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn to_text(parameters: &Parameters) -> String {
        super::to_text(parameters, &Parameters::default())
    }

    fn from_text(file: &str, text: &str) -> Result<Parameters, SavedError> {
        super::from_text(file, text, &Parameters::default())
    }

    #[test]
    fn the_defaults_are_a_text_without_values_and_come_back() {
        let text = to_text(&Parameters::default());
        assert!(text.lines().all(|line| line.starts_with('#')), "{text}");
        assert_eq!(from_text("f", &text), Ok(Parameters::default()));
        assert_eq!(from_text("f", ""), Ok(Parameters::default()));
    }

    #[test]
    fn every_parameter_comes_back_to_the_bit() {
        for row in table() {
            for value in [row.min, row.max, 0.3 * row.min + 0.7 * row.max] {
                let mut parameters = Parameters::default();
                if parameters.set(row.name, value).is_ok() {
                    let back = from_text("f", &to_text(&parameters)).unwrap();
                    let (back, value) = (row.value(&back), row.value(&parameters));
                    assert_eq!(back.to_bits(), value.to_bits(), "{} = {value}", row.name);
                }
            }
        }
    }

    #[test]
    fn limits_that_move_together_come_back_in_any_order() {
        let mut parameters = Parameters::default();
        parameters.set_all([("FW_AIRSPD_MIN", 330.0), ("FW_AIRSPD_MAX", 400.0)]).unwrap();
        let text = to_text(&parameters);
        assert_eq!(from_text("f", &text), Ok(parameters));
        let reversed: Vec<&str> = text.lines().rev().collect();
        assert_eq!(from_text("f", &reversed.join("\n")), Ok(parameters));
    }

    #[test]
    fn a_damaged_text_names_file_key_value_and_range() {
        for (text, words) in [
            ("OBS_W0 = -1", "p.toml: OBS_W0 = -1 is outside 1 to 500 rad/s"),
            ("OBS_W0 = nan", "OBS_W0 = NaN is outside"),
            ("OBS_W0 = 99999999999999", "OBS_W0 = inf is outside"),
            ("OBS_W0 = \"40\"", "OBS_W0 = \"40\" is not a number"),
            ("NOPE = 1", "there is no parameter NOPE"),
            ("SYS_AUTOSTART = 1", "SYS_AUTOSTART is read-only"),
            ("FW_AIRSPD_MIN = 400", "FW_AIRSPD_MIN = 400 m/s is above FW_AIRSPD_MAX = 280 m/s"),
            ("OBS_W0 = 40\nOBS_W0 = 41", "line 2 (OBS_W0 = 41): duplicate key"),
            ("OBS_W0 = 40\nOBS_", "line 2 (OBS_): "),
        ] {
            let message = from_text("p.toml", text).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
            assert!(message.starts_with("p.toml: ") && message.contains("--parameter-file none"));
        }
    }
}
