//! Configuration files: TOML to tables, with the units of their sources.

use std::collections::BTreeSet;

use host_io::problem::{At as _, Problem};
use serde::de::DeserializeOwned;

pub mod keys;
pub(crate) mod units;

/// Reads TOML into `T`; errors carry the file's name, line and column.
pub(crate) fn parse<T: DeserializeOwned>(file: &str, text: &str) -> Result<T, Problem> {
    toml::from_str(text).at(file)
}

/// Reads TOML with the units of its sources into `T`, whose keys are `known`. Errors carry the file's name; line and column where
/// no unit was converted.
pub(crate) fn parse_in_units<T: DeserializeOwned>(
    file: &str,
    text: &str,
    known: &BTreeSet<String>,
) -> Result<T, Problem> {
    let mut table = parse(file, text)?;
    match units::convert(file, &mut table, known)? {
        true => of_table(file, table),
        false => parse(file, text),
    }
}

/// Reads a file that was parsed already and may have been changed since.
pub(crate) fn of_table<T: DeserializeOwned>(file: &str, table: toml::Table) -> Result<T, Problem> {
    table.try_into().at(file)
}
