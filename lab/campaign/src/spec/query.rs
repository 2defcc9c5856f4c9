//! What is asked of the runs: tables of a specification.

use host_io::problem::Problem;
use serde::{Deserialize, Serialize};

use super::{Spec, refuse};

/// A table: a row for each combination of `rows`, in the order of the runs, and in it `columns` for each value of `across`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TableSpec {
    pub title: String,
    /// A sentence for readers.
    #[serde(default)]
    pub about: String,
    /// `airframe`, `law`, or variables.
    pub rows: Vec<String>,
    /// Flights of this law alone.
    pub law: Option<String>,
    /// One more of these.
    pub across: Option<String>,
    pub columns: Vec<ColumnSpec>,
}

/// A column: an aggregate over the flights of a cell.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ColumnSpec {
    /// For people, without unit.
    pub name: String,
    /// `lost`, `lost_at_s`, `newly_lost` and `newly_kept` (other than with the first law), or a measure, also one of a judge.
    pub of: String,
    #[serde(default, rename = "as")]
    pub by: Aggregate,
    #[serde(default = "two")]
    pub decimals: usize,
    /// Also of flights that were lost.
    #[serde(default)]
    pub all: bool,
    /// Words for the numbers 0, 1, 2, ….
    #[serde(default)]
    pub words: Vec<String>,
    /// Draws the table as coloured fields too, by this column.
    pub fields: Option<Fields>,
}

/// The colour of a field: within a limit, beyond it, and beyond it where nothing was due.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fields {
    pub within: f64,
    /// A measure that is 0 where the limit need not be kept.
    pub due: Option<String>,
}

/// How the flights of a cell become one number. A measure is that of the flights that were kept.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Aggregate {
    #[default]
    Sum,
    Mean,
    /// The mean, as a percentage.
    Percent,
    Rms,
    Median,
    /// The value below which 95 % lie.
    P95,
    Largest,
    /// Upper 95 % bound of what is counted, an hour of `healthy_s`.
    BoundPerHour,
}

fn two() -> usize {
    2
}

impl ColumnSpec {
    /// A word without a name stands in the cell before.
    pub fn is_remark(&self) -> bool {
        self.name.is_empty() && !self.words.is_empty()
    }
}

/// What is no measure.
pub const ENDS: [&str; 4] = ["lost", "lost_at_s", "newly_lost", "newly_kept"];

impl TableSpec {
    /// Names of everything that the columns read.
    pub fn reads(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().flat_map(|column| {
            let due = column.fields.as_ref().and_then(|fields| fields.due.as_deref());
            let hours = (column.by == Aggregate::BoundPerHour).then_some("healthy_s");
            std::iter::once(column.of.as_str()).chain(due).chain(hours)
        })
    }

    pub(super) fn check(&self, spec: &Spec, file: &str) -> Result<(), Problem> {
        let known = |key: &&String| {
            ["airframe", "law"].contains(&key.as_str()) || spec.vary.iter().any(|v| v.key == **key)
        };
        if let Some(key) = self.rows.iter().chain(&self.across).find(|key| !known(key)) {
            return refuse(file, "table.rows", key, "airframe, law, or a variable");
        }
        match &self.law {
            Some(law) if spec.law.iter().all(|known| known.name != *law) => {
                refuse(file, "table.law", law, "the name of a [[law]]")
            }
            _ => Ok(()),
        }
    }
}
