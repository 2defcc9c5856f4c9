//! Tables of an airframe file: values over one or more inputs, linear between breakpoints.
//!
//! A table is written as comma-separated values. The first columns are the inputs, the last of them changing
//! fastest; every further column is a function of them. Sums of terms define the use of the functions
//! ([`sum`]), and [`lookup`] evaluates sums and tables together.
//!
//! ```toml
//! [[aerodynamics.table]]
//! inputs = ["elevator_deg", "alpha_deg"]
//! outside = "clamp"
//! csv = """
//! elevator_deg, alpha_deg, c_x, c_pitch
//! -24, -10, -0.099, 0.205
//! ..."""
//! ```

use host_io::problem::{At as _, Problem, problem};
use serde::{Deserialize, Serialize};

pub mod aerodynamics;
mod csv;
pub mod lookup;
pub mod sum;
pub mod thrust;

/// Most inputs of a table.
pub const INPUTS_MAX: usize = 4;

/// Most breakpoints of an input.
pub const BREAKPOINTS_MAX: usize = 200;

/// Most tables in one part of an airframe file.
pub const TABLES_MAX: usize = 64;

/// The value of a table outside its breakpoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outside {
    /// The value at the nearest end.
    Clamp,
    /// Extrapolation along the line through the last two breakpoints.
    Extrapolate,
}

/// A table as in the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableText {
    /// Names of the inputs with their units, as in the header of the values.
    pub inputs: Vec<String>,
    /// Rule outside the breakpoints.
    pub outside: Outside,
    /// An input, whose breakpoints begin at zero, in which all functions are odd: the value at -x is minus the value
    /// at +x.
    #[serde(default)]
    pub odd_in: Option<String>,
    pub csv: String,
}

/// A valid table: every number finite, breakpoints in order, no row missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Inputs, the first one changing most slowly.
    pub inputs: Vec<Input>,
    /// Rule outside the breakpoints.
    pub outside: Outside,
    /// Index of the input in which the functions are odd.
    pub odd_in: Option<usize>,
    /// Names of the functions.
    pub functions: Vec<String>,
    /// Values row by row, the functions of a row side by side.
    pub values: Vec<f64>,
}

/// An input of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Name with unit, as in `alpha_deg`.
    pub name: String,
    /// Values at which the functions are listed, increasing, in the unit of the name.
    pub breakpoints: Vec<f64>,
}

impl TableText {
    pub fn read(&self) -> Result<Table, Problem> {
        csv::read(self)
    }
}

/// Parts with tables in binary files: as the text of a text file, whose keys determine its form.
pub(crate) mod stored {
    use serde::de::{DeserializeOwned, Error as _};
    use serde::ser::Error as _;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<T: Serialize, S: Serializer>(part: &T, to: S) -> Result<S::Ok, S::Error> {
        if to.is_human_readable() {
            return part.serialize(to);
        }
        serde_json::to_string(part).map_err(S::Error::custom)?.serialize(to)
    }

    pub fn deserialize<'de, T: DeserializeOwned, D: Deserializer<'de>>(
        from: D,
    ) -> Result<T, D::Error> {
        if from.is_human_readable() {
            return T::deserialize(from);
        }
        serde_json::from_str(&String::deserialize(from)?).map_err(D::Error::custom)
    }
}

/// Reads all tables of a part of the file.
fn read_all(section: &'static str, texts: &[TableText]) -> Result<Vec<Table>, Problem> {
    if texts.len() > TABLES_MAX {
        let found = texts.len();
        return Err(problem!("[[{section}.table]]: {found} tables, expected at most {TABLES_MAX}"));
    }
    let mut tables: Vec<Table> = Vec::new();
    for (index, text) in texts.iter().enumerate() {
        let place = format!("[[{section}.table]] number {}", index + 1);
        let table = text.read().at(&place)?;
        let known = |name: &&String| tables.iter().any(|other| other.functions.contains(name));
        if let Some(name) = table.functions.iter().find(known) {
            return Err(problem!(
                "{place}: the function {name} stands in another table too, expected one for each name"
            ));
        }
        tables.push(table);
    }
    Ok(tables)
}

#[cfg(test)]
mod tests;
