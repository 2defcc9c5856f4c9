//! `sitl campaign compare A B`: what differs between the tables of two campaigns, run by run.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::path::Path;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::{panic, thread};

use lab_studies::problem::{At as _, Problem, problem};
use parquet::basic::Compression;
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::reader::RowIter;
use parquet::record::{Field, Row};

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
pub fn folders(one: &Path, other: &Path) -> Result<String, Problem> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let report = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
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
    let a = RunTable::open(one)?;
    reading(true);
    let b = RunTable::open(other)?;
    reading(false);
    let laws_of_a = a.laws()?;
    reading(true);
    let laws_of_b = b.laws()?;
    let only = |mine: &Laws, others: &Laws| -> Vec<String> {
        mine.keys().filter(|law| !others.contains_key(*law)).cloned().collect()
    };
    let only = [only(&laws_of_a, &laws_of_b), only(&laws_of_b, &laws_of_a)];
    let [count_a, count_b] = [&laws_of_a, &laws_of_b].map(|laws| -> i64 {
        laws.iter()
            .filter(|(law, _)| !only.iter().flatten().any(|o| o == *law))
            .map(|(_, n)| n)
            .sum()
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
    for _ in 0..count_a {
        reading(false);
        let row_a = a.next(&mut rows_a, &only[0])?;
        reading(true);
        let row_b = b.next(&mut rows_b, &only[1])?;
        let cells_a: Vec<(&String, &Field)> = row_a.get_column_iter().collect();
        let cells_b: BTreeMap<&String, &Field> = row_b.get_column_iter().collect();
        let cell = |name: &str| cells_a.iter().find(|(n, _)| *n == name).map(|(_, f)| *f);
        let (Some(Field::Long(run)), Some(law)) = (cell("run"), cell("law").map(show)) else {
            return Err(a.damaged("a run has no number, or no law"));
        };
        let place = laws.iter().position(|(known, _)| *known == law).unwrap_or_else(|| {
            laws.push((law, Differences::default()));
            laws.len() - 1
        });
        let differences = &mut laws[place].1;
        differences.runs += 1;
        let outcome_at = cells_a.iter().position(|(name, _)| *name == "outcome");
        let outcome_at = outcome_at.ok_or_else(|| a.damaged("it has no column outcome"))?;
        // With another number of laws the same flight has another number.
        let is_number = |name: &str| name == "run" && only.iter().any(|laws| !laws.is_empty());
        let flown = cells_a[..outcome_at].iter().filter(|(name, _)| !is_number(name));
        for (name, field) in flown {
            let found = cells_b.get(name).map_or_else(|| "missing".to_owned(), |f| show(f));
            if found != show(field) {
                return Err(problem!(
                    "run {run} is another flight in {}: {name} is {found} there and {} in the first folder",
                    other.display(),
                    show(field)
                ));
            }
        }
        let is_same = cells_a.len() == cells_b.len()
            && cells_a
                .iter()
                .filter(|(name, _)| !is_number(name))
                .all(|(name, a)| cells_b.get(name).is_some_and(|b| is_same(a, b)));
        differences.same += u64::from(is_same);
        differences.add(*run, &cells_a[outcome_at..], &cells_b);
    }
    Ok(report(&a, &b, &laws, &only))
}

/// Names of laws, each with its number of runs.
type Laws = BTreeMap<String, i64>;

fn law_of(row: &Row) -> Option<String> {
    row.get_column_iter().find(|(name, _)| *name == "law").map(|(_, law)| show(law))
}

/// The table of a folder.
struct RunTable<'a> {
    folder: &'a Path,
    reader: SerializedFileReader<File>,
}

impl<'a> RunTable<'a> {
    fn open(folder: &'a Path) -> Result<Self, Problem> {
        let path = folder.join(RUNS);
        let file = File::open(&path).at(path.display())?;
        let reader = SerializedFileReader::new(file).at(path.display())?;
        let columns = reader.metadata().row_groups().iter().flat_map(RowGroupMetaData::columns);
        for column in columns {
            let is_read = matches!(
                column.compression(),
                Compression::UNCOMPRESSED | Compression::SNAPPY | Compression::GZIP(_)
            );
            if !is_read {
                return Err(problem!(
                    "{}: column {} is compressed with {}; this program reads NONE, SNAPPY and GZIP",
                    path.display(),
                    column.column_path().string(),
                    column.compression()
                ));
            }
        }
        Ok(Self { folder, reader })
    }

    fn rows(&self) -> Result<RowIter<'_>, Problem> {
        self.reader.get_row_iter(None).at(self.folder.join(RUNS).display())
    }

    /// The next row of a law that is not left out.
    fn next(&self, rows: &mut RowIter<'_>, left_out: &[String]) -> Result<Row, Problem> {
        loop {
            let row = rows.next().ok_or_else(|| self.damaged("it has fewer runs than it says"))?;
            let row = row.at(self.folder.join(RUNS).display())?;
            if left_out.is_empty() || law_of(&row).is_none_or(|law| !left_out.contains(&law)) {
                return Ok(row);
            }
        }
    }

    /// Its laws, and how many runs each has.
    fn laws(&self) -> Result<Laws, Problem> {
        let mut laws = Laws::new();
        for row in self.rows()? {
            let law = law_of(&row.at(self.folder.join(RUNS).display())?);
            let law = law.ok_or_else(|| self.damaged("a run has no law"))?;
            *laws.entry(law).or_default() += 1;
        }
        Ok(laws)
    }

    /// What the table says of the program and the specification of its runs; what another program wrote need not say it.
    fn about(&self, key: &str) -> Option<&str> {
        let about = self.reader.metadata().file_metadata().key_value_metadata()?;
        about.iter().find(|entry| entry.key == key)?.value.as_deref()
    }

    fn columns(&self) -> Vec<&str> {
        let schema = self.reader.metadata().file_metadata().schema_descr();
        schema.columns().iter().map(|column| column.name()).collect()
    }

    fn damaged(&self, why: &str) -> Problem {
        problem!("{}: damaged: {why}", self.folder.join(RUNS).display())
    }
}

/// Whether two cells have the same bits.
fn is_same(a: &Field, b: &Field) -> bool {
    match (a, b) {
        (Field::Double(a), Field::Double(b)) => a.to_bits() == b.to_bits(),
        _ => a == b,
    }
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

fn report(
    a: &RunTable<'_>,
    b: &RunTable<'_>,
    laws: &[(String, Differences)],
    only: &[Vec<String>; 2],
) -> String {
    let mut text = format!("A = {}, B = {}\n", a.folder.display(), b.folder.display());
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

fn show(field: &Field) -> String {
    match field {
        Field::Str(text) => text.clone(),
        Field::Null => String::new(),
        other => other.to_string(),
    }
}
