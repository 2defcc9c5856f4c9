//! `sitl campaign compare A B`: what differs between the tables of two campaigns, run by run.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::path::{Path, PathBuf};

use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

use crate::table::RUNS;

/// Columns of each law that are listed at most, those with the largest relative change first.
const LISTED: usize = 8;
/// Runs that are named at most for each law.
const NAMED: usize = 5;

/// Why two tables cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A table cannot be opened.
    #[error("{}: {source}", path.display())]
    Open {
        /// The table.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// A table is not one, or is damaged.
    #[error("{}: {source}", path.display())]
    Read {
        /// The table.
        path: PathBuf,
        /// What is wrong with it.
        source: ParquetError,
    },
    /// The flights differ.
    #[error("run {run} is another flight in {}: {column} is {found} there and {expected} in the first folder", path.display())]
    Flight {
        /// The second folder.
        path: PathBuf,
        /// The run.
        run: i64,
        /// What differs.
        column: String,
        /// What the second folder has.
        found: String,
        /// What the first folder has.
        expected: String,
    },
    /// The numbers of runs differ.
    #[error("{}: {found} runs, and the first folder has {expected}", path.display())]
    Count {
        /// The second folder.
        path: PathBuf,
        /// What it has.
        found: i64,
        /// What the first folder has.
        expected: i64,
    },
}

/// What differs for one law.
#[derive(Debug, Default)]
struct Differences {
    runs: u64,
    same: u64,
    /// Lost in the first folder only, and in the second only: how many, and the first runs.
    lost: [(u64, Vec<i64>); 2],
    /// Of each measure: runs in which it differs, sum and largest of the differences, sum of the magnitudes in A.
    measures: BTreeMap<String, Change>,
}

#[derive(Debug, Default, Clone, Copy)]
struct Change {
    runs: u64,
    sum: f64,
    largest: f64,
    at: i64,
    magnitude: f64,
}

/// Compares the tables of two folders; the text says what differs.
///
/// # Errors
/// [`CompareError`]: a table cannot be read, or has other flights.
pub fn folders(one: &Path, other: &Path) -> Result<String, CompareError> {
    let [a, b] = [one, other].map(open);
    let (a, b) = (a?, b?);
    let count = |reader: &SerializedFileReader<File>| reader.metadata().file_metadata().num_rows();
    if count(&a) != count(&b) {
        return Err(CompareError::Count {
            path: other.to_path_buf(),
            found: count(&b),
            expected: count(&a),
        });
    }
    let failed = |folder: &Path| {
        let path = folder.join(RUNS);
        move |source| CompareError::Read { path: path.clone(), source }
    };
    let rows = |reader, folder: &Path| -> Result<_, CompareError> {
        SerializedFileReader::get_row_iter(reader, None).map_err(failed(folder))
    };
    let mut laws: BTreeMap<(usize, String), Differences> = BTreeMap::new();
    let mut order: Vec<String> = Vec::new();
    for (row_a, row_b) in rows(&a, one)?.zip(rows(&b, other)?) {
        let row_a = row_a.map_err(failed(one))?;
        let row_b = row_b.map_err(failed(other))?;
        let cells_a: Vec<(&String, &Field)> = row_a.get_column_iter().collect();
        let cells_b: BTreeMap<&String, &Field> = row_b.get_column_iter().collect();
        let text = |name: &str| cells_a.iter().find(|(n, _)| *n == name).map(|(_, f)| *f);
        let Some(Field::Long(run)) = text("run") else { continue };
        let law = text("law").map_or_else(String::new, show);
        let place = order.iter().position(|known| *known == law).unwrap_or_else(|| {
            order.push(law.clone());
            order.len() - 1
        });
        let differences = laws.entry((place, law)).or_default();
        differences.runs += 1;
        let outcome_at = cells_a.iter().position(|(name, _)| *name == "outcome").unwrap_or(0);
        for (name, field) in &cells_a[..outcome_at] {
            let found = cells_b.get(name).map_or_else(|| "missing".to_owned(), |f| show(f));
            if found != show(field) {
                return Err(CompareError::Flight {
                    path: other.to_path_buf(),
                    run: *run,
                    column: (*name).clone(),
                    found,
                    expected: show(field),
                });
            }
        }
        let is_same = cells_a.iter().all(|(name, field)| cells_b.get(name) == Some(field));
        differences.same += u64::from(is_same);
        differences.add(*run, &cells_a[outcome_at..], &cells_b);
    }
    Ok(report(one, other, &laws))
}

impl Differences {
    fn add(&mut self, run: i64, a: &[(&String, &Field)], b: &BTreeMap<&String, &Field>) {
        for (name, field) in a {
            let other = b.get(name).copied().unwrap_or(&Field::Null);
            match (name.as_str(), field, other) {
                ("outcome", a, b) => {
                    let lost = [a, b].map(|field| show(field) == "lost");
                    for (place, (count, runs)) in self.lost.iter_mut().enumerate() {
                        if lost[place] && !lost[1 - place] {
                            *count += 1;
                            if runs.len() < NAMED {
                                runs.push(run);
                            }
                        }
                    }
                }
                (_, Field::Double(a), Field::Double(b)) => {
                    let change = self.measures.entry((*name).clone()).or_default();
                    change.magnitude += a.abs();
                    if a.to_bits() != b.to_bits() {
                        change.runs += 1;
                        change.sum += b - a;
                        if (b - a).abs() > change.largest.abs() {
                            (change.largest, change.at) = (b - a, run);
                        }
                    }
                }
                _ => {}
            }
        }
    }
}

fn report(one: &Path, other: &Path, laws: &BTreeMap<(usize, String), Differences>) -> String {
    let mut text = format!("A = {}, B = {}\n", one.display(), other.display());
    for ((_, law), differences) in laws {
        let Differences { runs, same, lost, measures } = differences;
        let _ = writeln!(text, "\n{law}: {same} of {runs} runs are the same to the bit");
        for ((count, runs), folder) in lost.iter().zip(["A", "B"]) {
            if *count > 0 {
                let runs: Vec<String> = runs.iter().map(ToString::to_string).collect();
                let _ = writeln!(
                    text,
                    "  lost in {folder} only: {count}, runs {} ...",
                    runs.join(", ")
                );
            }
        }
        let mut changed: Vec<_> = measures.iter().filter(|(_, change)| change.runs > 0).collect();
        let relative = |change: &Change| change.sum.abs() / change.magnitude.max(f64::MIN_POSITIVE);
        changed.sort_by(|a, b| relative(b.1).total_cmp(&relative(a.1)));
        for (name, change) in changed.iter().take(LISTED) {
            let _ = writeln!(
                text,
                "  {name}: differs in {} runs, on average by {:+.4e}, most in run {} by {:+.4e}",
                change.runs,
                change.sum / change.runs as f64,
                change.at,
                change.largest
            );
        }
        if changed.len() > LISTED {
            let _ = writeln!(text, "  and {} more measures", changed.len() - LISTED);
        }
    }
    text
}

fn open(folder: &Path) -> Result<SerializedFileReader<File>, CompareError> {
    let path = folder.join(RUNS);
    let file =
        File::open(&path).map_err(|source| CompareError::Open { path: path.clone(), source })?;
    SerializedFileReader::new(file).map_err(|source| CompareError::Read { path, source })
}

fn show(field: &Field) -> String {
    match field {
        Field::Str(text) => text.clone(),
        Field::Null => String::new(),
        other => other.to_string(),
    }
}
