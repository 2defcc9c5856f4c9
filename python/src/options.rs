//! Options of a command from keywords of Python: `step_deg=5` is `--step-deg=5`.
//!
//! They go through the parser of the command line, so Python has its options, ranges and messages and no second list of them.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{Args, Command};
use lab_engine::settings::Setting;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyList, PyRange, PyTuple};
use toml::Value as Toml;

/// Keywords as words of a command line.
pub fn words(keywords: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<OsString>> {
    let mut words = Vec::new();
    for (key, value) in keywords.into_iter().flatten() {
        let option = format!("--{}", key.extract::<String>()?.replace('_', "-"));
        add(&mut words, &option, &value)?;
    }
    Ok(words)
}

fn add(words: &mut Vec<OsString>, option: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
    if value.is_none() {
        return Ok(());
    }
    if let Ok(flag) = value.cast::<PyBool>() {
        if flag.is_true() {
            words.push(option.into());
        }
        return Ok(());
    }
    if let Ok(pairs) = value.cast::<PyDict>() {
        for (key, value) in pairs {
            let setting = Setting::new(&key.str()?.to_string(), toml(&value)?);
            words.push(format!("{option}={setting}").into());
        }
        return Ok(());
    }
    if let Ok(seeds) = value.cast::<PyRange>() {
        let (first, step) = (seeds.getattr("start")?, seeds.getattr("step")?.extract::<i64>()?);
        if step != 1 || seeds.len()? == 0 {
            let message = format!(
                "{option}: expected a range of step 1 with at least one number, not {seeds}"
            );
            return Err(PyValueError::new_err(message));
        }
        let last = seeds.getattr("stop")?.sub(1)?;
        words.push(format!("{option}={first}..{last}").into());
        return Ok(());
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        for one in value.try_iter()? {
            add(words, option, &one?)?;
        }
        return Ok(());
    }
    let mut word = OsString::from(format!("{option}="));
    word.push(plain(option, value)?);
    words.push(word);
    Ok(())
}

/// A text, a path or a number.
fn plain(option: &str, value: &Bound<'_, PyAny>) -> PyResult<OsString> {
    if let Ok(path) = value.extract::<PathBuf>() {
        return Ok(path.into());
    }
    // Also the scalars of numpy.
    match value.extract::<i128>() {
        Ok(whole) => Ok(whole.to_string().into()),
        Err(_) => match value.extract::<f64>() {
            Ok(number) => Ok(number.to_string().into()),
            Err(_) => {
                let message = format!("{option}: {} is neither a text nor a number", value.repr()?);
                Err(PyTypeError::new_err(message))
            }
        },
    }
}

/// A value as it stands in a file.
pub fn toml(value: &Bound<'_, PyAny>) -> PyResult<Toml> {
    if let Ok(flag) = value.cast::<PyBool>() {
        return Ok(Toml::Boolean(flag.is_true()));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        return value
            .try_iter()?
            .map(|item| toml(&item?))
            .collect::<PyResult<_>>()
            .map(Toml::Array);
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(Toml::String(text));
    }
    match (value.extract::<i64>(), value.extract::<f64>()) {
        (Ok(whole), _) => Ok(Toml::Integer(whole)),
        (_, Ok(number)) => Ok(Toml::Float(number)),
        _ => Err(PyTypeError::new_err(format!("{} is neither a text nor a number", value.repr()?))),
    }
}

/// Reads the options of a command.
pub fn parse<A: Args>(words: impl IntoIterator<Item = OsString>) -> PyResult<A> {
    let command = A::augment_args(Command::new("two_step").no_binary_name(true));
    let matches = command.try_get_matches_from(words);
    matches.and_then(|matches| A::from_arg_matches(&matches)).map_err(|error| mistake(&error))
}

/// What the parser says of a mistake, as an exception; help is what was asked for.
pub fn mistake(error: &clap::Error) -> PyErr {
    let text = error.render().to_string();
    // Its usage and its advice are about a shell.
    let text = text.split("\n\n").next().unwrap_or(&text).trim_start_matches("error: ");
    let text = text.trim().to_owned();
    match error.kind() {
        ErrorKind::UnknownArgument | ErrorKind::MissingRequiredArgument => {
            PyTypeError::new_err(text)
        }
        _ => PyValueError::new_err(text),
    }
}

/// A refusal of the program: it names what is wrong, its value and what is allowed.
pub fn refused(problem: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(problem.to_string())
}
