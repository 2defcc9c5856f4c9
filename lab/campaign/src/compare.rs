//! `sitl campaign compare A B`: what differs between the tables of two campaigns, run by run.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::{panic, thread};

use host_io::problem::{At as _, Problem, problem};
use lab_tables::{Cell, ParquetReader};

use crate::table::{FINGERPRINT, PROGRAM_KEY, RUNS};

/// Columns of each law that are listed at most, those with the largest relative change first.
const LISTED: usize = 8;
/// Runs that are named at most for each law.
const NAMED: usize = 5;
/// Name of the thread that reads tables.
const READER: &str = "tables";

/// What differs for one law.
#[derive(Debug, Default)]
struct Differences {
    runs: u64,
    same: u64,
    /// Lost in the first folder only, and in the second only: how many, and the first runs.
    lost: [(u64, Vec<i64>); 2],
    /// Of each measure: runs in which it differs, sum and largest of the differences, sum of the magnitudes in A.
    measures: BTreeMap<String, RunChange>,
}

#[derive(Debug, Default, Clone, Copy)]
struct RunChange {
    runs: u64,
    sum: f64,
    largest: f64,
    at: i64,
    magnitude: f64,
}

/// Compares the tables of two folders; the text says what differs.
pub fn folders(one: &Path, other: &Path) -> Result<String, Problem> {
    // Once, or each call would wrap the hook of the one before.
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let report = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            // Other threads report as before.
            if thread::current().name() != Some(READER) {
                report(panic);
            }
        }));
    });
    // The library panics on some damaged tables, and no check of ours would find them all. So a thread of its own reads, whose
    // panic is an error here.
    let is_other = AtomicBool::new(false);
    let compared = thread::scope(|scope| {
        let compare = || compare(one, other, &is_other);
        let reader = thread::Builder::new().name(READER.to_owned()).spawn_scoped(scope, compare);
        Ok(reader?.join())
    });
    let path = || if is_other.load(Ordering::Relaxed) { other } else { one }.join(RUNS);
    match compared {
        Ok(Ok(result)) => result,
        Ok(Err(panic)) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
            let why = text.unwrap_or("it cannot be read");
            Err(problem!("{}: damaged: {why}", path().display()))
        }
        Err(problem) => Err::<_, std::io::Error>(problem).at(path().display()),
    }
}

/// `is_other` says which table is being read.
fn compare(one: &Path, other: &Path, is_other: &AtomicBool) -> Result<String, Problem> {
    let reading = |of_other: bool| is_other.store(of_other, Ordering::Relaxed);
    let a = ParquetReader::open(&one.join(RUNS))?;
    reading(true);
    let b = ParquetReader::open(&other.join(RUNS))?;
    reading(false);
    let laws_of_a = laws(&a)?;
    reading(true);
    let laws_of_b = laws(&b)?;
    let only = |mine: &Laws, others: &Laws| -> Vec<String> {
        mine.keys().filter(|law| !others.contains_key(*law)).cloned().collect()
    };
    let only = [only(&laws_of_a, &laws_of_b), only(&laws_of_b, &laws_of_a)];
    let [count_a, count_b] = [&laws_of_a, &laws_of_b].map(|laws| -> u64 {
        let both = laws.iter().filter(|(law, _)| !only.iter().flatten().any(|one| one == *law));
        both.map(|(_, count)| count).sum()
    });
    if only[0].len() == laws_of_a.len() && !laws_of_a.is_empty() {
        return Err(problem!("{}: it has no law of the first folder", other.display()));
    }
    if count_a != count_b {
        return Err(problem!(
            "{}: {count_b} runs, and the first folder has {count_a}",
            other.display()
        ));
    }
    let mut laws: Vec<(String, Differences)> = Vec::new();
    reading(false);
    let mut rows_a = a.rows()?;
    reading(true);
    let mut rows_b = b.rows()?;
    let fewer = "it has fewer runs than it says";
    for _ in 0..count_a {
        reading(false);
        let cells_a = next_of(&mut rows_a, &only[0]).ok_or_else(|| damaged(&a, fewer))??;
        reading(true);
        let cells_b = next_of(&mut rows_b, &only[1]).ok_or_else(|| damaged(&b, fewer))??;
        let cells_b: BTreeMap<String, Cell> = cells_b.into_iter().collect();
        let cell = |name| cells_a.iter().find(|(known, _)| known == name).map(|(_, cell)| cell);
        let (Some(run), Some(law)) = (cell("run").and_then(Cell::integer), cell("law")) else {
            return Err(damaged(&a, "a run has no number, or no law"));
        };
        let law = law.to_string();
        let place = laws.iter().position(|(known, _)| *known == law).unwrap_or_else(|| {
            laws.push((law, Differences::default()));
            laws.len() - 1
        });
        let differences = &mut laws[place].1;
        differences.runs += 1;
        let outcome_at = cells_a.iter().position(|(name, _)| *name == "outcome");
        let outcome_at = outcome_at.ok_or_else(|| damaged(&a, "it has no column outcome"))?;
        // With another number of laws the same flight has another number.
        let is_number = |name: &str| name == "run" && only.iter().any(|laws| !laws.is_empty());
        for (name, cell) in cells_a[..outcome_at].iter().filter(|(name, _)| !is_number(name)) {
            let found = cells_b.get(name).map_or_else(|| "missing".to_owned(), Cell::to_string);
            if found != cell.to_string() {
                return Err(problem!(
                    "run {run} is another flight in {}: {name} is {found} there and {cell} in the first folder",
                    other.display(),
                ));
            }
        }
        let is_same = cells_a.len() == cells_b.len()
            && cells_a
                .iter()
                .filter(|(name, _)| !is_number(name))
                .all(|(name, a)| cells_b.get(name).is_some_and(|b| is_same(a, b)));
        differences.same += u64::from(is_same);
        differences.add(run, &cells_a[outcome_at..], &cells_b);
    }
    Ok(report(&a, &b, &laws, &only))
}

/// Names of laws, each with its number of runs.
type Laws = BTreeMap<String, u64>;

/// A row: names and values.
type Cells = Vec<(String, Cell)>;

fn law_of(cells: &Cells) -> Option<String> {
    cells.iter().find(|(name, _)| name == "law").map(|(_, law)| law.to_string())
}

/// The next run of a law that both tables have.
fn next_of(
    rows: &mut impl Iterator<Item = Result<Cells, Problem>>,
    only: &[String],
) -> Option<Result<Cells, Problem>> {
    rows.find(|row| {
        !row.as_ref().is_ok_and(|cells| law_of(cells).is_some_and(|law| only.contains(&law)))
    })
}

/// The laws of a table with their runs.
fn laws(table: &ParquetReader) -> Result<Laws, Problem> {
    let mut laws = Laws::new();
    for row in table.rows()? {
        *laws.entry(law_of(&row?).unwrap_or_default()).or_default() += 1;
    }
    Ok(laws)
}

fn damaged(table: &ParquetReader, why: &str) -> Problem {
    problem!("{}: damaged: {why}", table.path.display())
}

/// Whether two cells have the same bits.
fn is_same(a: &Cell, b: &Cell) -> bool {
    match (a, b) {
        (Cell::Number(a), Cell::Number(b)) => a.to_bits() == b.to_bits(),
        _ => a == b,
    }
}

impl Differences {
    fn add(&mut self, run: i64, a: &[(String, Cell)], b: &BTreeMap<String, Cell>) {
        for (name, cell) in a {
            match (name.as_str(), cell, b.get(name).unwrap_or(&Cell::Missing)) {
                ("outcome", a, b) => {
                    let lost = [a, b].map(|cell| cell.text() == Some("lost"));
                    for (place, (count, runs)) in self.lost.iter_mut().enumerate() {
                        if lost[place] && !lost[1 - place] {
                            *count += 1;
                            if runs.len() < NAMED {
                                runs.push(run);
                            }
                        }
                    }
                }
                (_, Cell::Number(a), Cell::Number(b)) => {
                    let change = self.measures.entry(name.clone()).or_default();
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

fn report(
    a: &ParquetReader,
    b: &ParquetReader,
    laws: &[(String, Differences)],
    only: &[Vec<String>; 2],
) -> String {
    let mut text = format!("A = {}, B = {}\n", a.path.display(), b.path.display());
    for (what, key) in [("program", PROGRAM_KEY), ("specification", FINGERPRINT)] {
        let [of_a, of_b] = [a, b].map(|table| table.about(key).unwrap_or("that it does not name"));
        if of_a != of_b {
            let _ = writeln!(text, "{what}: A of {of_a}, B of {of_b}");
        }
    }
    for (folder, mine, others) in [("A", a.columns(), b.columns()), ("B", b.columns(), a.columns())]
    {
        let only: Vec<&str> = mine.into_iter().filter(|name| !others.contains(name)).collect();
        if !only.is_empty() {
            let _ = writeln!(text, "columns in {folder} only: {}", only.join(", "));
        }
    }
    for (folder, laws) in ["A", "B"].into_iter().zip(only).filter(|(_, laws)| !laws.is_empty()) {
        let _ = writeln!(text, "laws in {folder} only, left out: {}", laws.join(", "));
    }
    for (law, differences) in laws {
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
        let relative =
            // `MIN_POSITIVE` stands for a zero, by which nothing can be divided.
            |change: &RunChange| change.sum.abs() / change.magnitude.max(f64::MIN_POSITIVE);
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
