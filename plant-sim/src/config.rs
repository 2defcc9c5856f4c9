//! Errors of configuration files, with all data that the user needs to correct them.

use std::collections::BTreeSet;

use icd::effector_list::EffectorListError;
use serde::de::DeserializeOwned;

use crate::date::NoDate;
use crate::range::RangeError;
use crate::tables::TablesError;

pub mod keys;
pub(crate) mod units;

/// Why a configuration file was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConfigError {
    /// Not TOML, a missing or unknown key, or a value of the wrong type; has line and column.
    #[error("{file}: {source}")]
    Toml {
        /// Name of the file.
        file: String,
        source: Box<toml::de::Error>,
    },
    /// A value outside its range.
    #[error("{file}: {source}")]
    Range {
        /// Name of the file.
        file: String,
        source: Box<RangeError>,
    },
    /// Tables that cannot be evaluated.
    #[error("{file}: {source}")]
    Tables {
        /// Name of the file.
        file: String,
        /// The error in the tables.
        source: Box<TablesError>,
    },
    /// Two tables of the file exclude each other.
    #[error("{file}: [{section}] has no meaning beside {other}")]
    Excluded {
        /// Name of the file.
        file: String,
        section: &'static str,
        /// The table that excludes it.
        other: &'static str,
    },
    /// The list of effectors is invalid.
    #[error("{file}: {source}")]
    Effectors {
        /// Name of the file.
        file: String,
        source: EffectorListError,
    },
    /// An effector lacks a key that its kind needs, or has one that its kind does not use.
    #[error("{file}: effector `{effector}`: {key} {problem}")]
    EffectorKey {
        /// Name of the file.
        file: String,
        /// Name of the effector.
        effector: String,
        key: &'static str,
        /// `is missing` or `has no meaning for this kind`.
        problem: &'static str,
    },
    /// The unit of a key is one of another quantity.
    #[error("{file}: {key}: the unit {unit} does not fit, expected one of {expected}")]
    Unit {
        /// Name of the file.
        file: String,
        /// The key, with its table.
        key: String,
        unit: &'static str,
        /// Keys with units that fit.
        expected: String,
    },
    /// A quantity in two units.
    #[error("{file}: {key} and {other} are the same quantity, expected one of them")]
    Twice {
        /// Name of the file.
        file: String,
        /// One of the keys, with its table.
        key: String,
        other: String,
    },
    /// Something else in the place of a number with a unit.
    #[error("{file}: {key} is no number, expected one, or a list of numbers")]
    NotANumber {
        /// Name of the file.
        file: String,
        /// The key, with its table.
        key: String,
    },
    /// A key is missing, unknown or has no meaning beside others.
    #[error("{file}: [{section}] {key} {problem}")]
    Key {
        /// Name of the file.
        file: String,
        section: &'static str,
        /// The key, or several.
        key: String,
        /// What is wrong with it, and what is expected.
        problem: String,
    },
    /// A date that is none, or outside the magnetic model.
    #[error("{file}: [plant] {source}")]
    Date {
        /// Name of the file.
        file: String,
        /// What is wrong with it.
        source: NoDate,
    },
    /// A name is too long.
    #[error("{file}: name = `{name}` is too long, at most {longest} bytes")]
    LongName {
        /// Name of the file.
        file: String,
        name: String,
        /// Longest one, bytes.
        longest: usize,
    },
    /// A fault of an effector that the aircraft lacks, or of an unknown sensor.
    #[error(
        "{file}: [[plant.fault]] number {number}: {key} = `{name}`, the aircraft has only {known}"
    )]
    FaultTarget {
        /// Name of the file.
        file: String,
        /// Number of the fault, from 1, in the order of the file.
        number: usize,
        /// `effector`, `sensor` or `part`.
        key: &'static str,
        /// The name in the file.
        name: String,
        known: String,
    },
    /// A part of the airframe names a surface that there is not.
    #[error("{file}: {key} = `{name}`, the aircraft has only {known}")]
    NoSuchEffector {
        /// Name of the file.
        file: String,
        key: String,
        /// The name in the file.
        name: String,
        known: String,
    },
    /// A fault lacks a key that its kind needs, or has one that its kind does not use.
    #[error("{file}: [[plant.fault]] number {number}, kind {kind}: {key} {problem}")]
    FaultKey {
        /// Name of the file.
        file: String,
        /// Number of the fault, from 1, in the order of the file.
        number: usize,
        kind: &'static str,
        key: &'static str,
        /// `is missing` or `has no meaning here`.
        problem: String,
    },
}

/// Reads TOML into `T`; errors carry the file's name, line and column.
pub(crate) fn parse<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, ConfigError> {
    toml::from_str(text)
        .map_err(|source| ConfigError::Toml { file: file.to_owned(), source: Box::new(source) })
}

/// Reads TOML with the units of its sources into `T`, whose keys are `known`. Errors carry the file's name; line and column where
/// no unit was converted.
pub(crate) fn parse_in_units<T: DeserializeOwned>(
    file: &str,
    text: &str,
    known: &BTreeSet<String>,
) -> Result<T, ConfigError> {
    let mut table = parse(file, text)?;
    match units::convert(file, &mut table, known)? {
        true => of_table(file, table),
        false => parse(file, text),
    }
}

/// Reads a file that was parsed already and may have been changed since.
pub(crate) fn of_table<T: DeserializeOwned>(
    file: &str,
    table: toml::Table,
) -> Result<T, ConfigError> {
    table
        .try_into()
        .map_err(|source| ConfigError::Toml { file: file.to_owned(), source: Box::new(source) })
}

/// Adds the file's name to a range error.
pub(crate) fn in_file(file: &str) -> impl Fn(RangeError) -> ConfigError + '_ {
    |source| ConfigError::Range { file: file.to_owned(), source: Box::new(source) }
}
