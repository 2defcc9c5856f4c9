//! Finished runs on the disk: parts that are complete or not there, so that a campaign can be killed at any moment and go on.
//!
//! A folder of a campaign has `campaign.toml`, which says what it is of, and `parts/`; the tables are written when every
//! part is there. A part has a line of text, length and CRC-32 of its content, and the content as postcard: what it is of, in the
//! words of `campaign.toml`, and its runs. A part that is not whole is flown again; one of something else is refused.

use std::borrow::Cow;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use host_io::file::{self, NewFile, TEXT_MAX};
use host_io::folder::OutFolder;
use host_io::problem::{At as _, Problem, problem};
use lab_judges::outcome::Outcome;
use serde::{Deserialize, Serialize};

use crate::plan::{Aircraft, Plan};

/// Simulation time in a part, s: what is lost at most of each thread when the program is killed.
const PART_S: f64 = 1_000.0;
/// Most runs of a part.
const PART_RUNS_MAX: f64 = 1_000.0;
/// First line of a part.
const MARK: &[u8] = b"Two-Step campaign part 2\n";
/// First line of the file that names the campaign.
const HEAD: &str = "# Written by `sitl campaign`; do not edit.";
/// Version of the program and hash of its sources (`build.rs`): the same version with other sources gives other results.
pub const PROGRAM: &str =
    concat!(env!("CARGO_PKG_VERSION"), " (sources ", env!("TWO_STEP_SOURCES"), ")");
/// Longest part, bytes.
const PART_BYTES_MAX: u64 = 1 << 30;

/// What became of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub run: u64,
    /// What became of it.
    pub end: RunEnd,
    /// When it was lost, s.
    pub lost_at_s: Option<f64>,
    /// By what it was lost, or why it could not be flown.
    pub reason: String,
    /// Simulation time at its end, s.
    pub end_s: f64,
    /// The measures, in the order of those of its aircraft.
    pub measures: Vec<Option<f64>>,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum RunEnd {
    /// The aircraft was kept.
    Kept,
    Lost,
    /// It could not be flown.
    Failed,
}

impl RunEnd {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Lost => "lost",
            Self::Failed => "failed",
        }
    }
}

impl Row {
    /// The row of a flight.
    pub fn of(run: u64, outcome: &Outcome) -> Self {
        let (end, lost_at_s, reason) = match &outcome.loss {
            None => (RunEnd::Kept, None, String::new()),
            Some(loss) => (RunEnd::Lost, Some(loss.at_s), loss.by.to_string()),
        };
        let measures = outcome.metrics.iter().map(|metric| metric.value).collect();
        Self { run, end, lost_at_s, reason, end_s: outcome.end_s, measures }
    }

    /// Checks a row that was read, of an aircraft with these measures.
    fn check(&self, measures: &[String]) -> Result<(), Problem> {
        let refuse = |why: String| Err(problem!("run {}: {why}", self.run));
        let expected = if self.end == RunEnd::Failed { 0 } else { measures.len() };
        if self.measures.len() != expected {
            return refuse(format!("{} measures; it must have {expected}", self.measures.len()));
        }
        if self.lost_at_s.is_some() != (self.end == RunEnd::Lost) {
            return refuse(format!("{} with lost_at_s = {:?}", self.end.name(), self.lost_at_s));
        }
        let times = [("end_s", Some(self.end_s)), ("lost_at_s", self.lost_at_s)];
        let named = measures.iter().map(String::as_str).zip(self.measures.iter().copied());
        match times.into_iter().chain(named).find(|(_, v)| v.is_some_and(|v| !v.is_finite())) {
            Some((name, value)) => {
                refuse(format!("{name} is {}; it must be finite", value.unwrap_or_default()))
            }
            None => Ok(()),
        }
    }

    /// The row of a run that could not be flown.
    pub fn failed(run: u64, reason: String) -> Self {
        Self { run, end: RunEnd::Failed, lost_at_s: None, reason, end_s: 0.0, measures: Vec::new() }
    }
}

/// What a folder is of.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    campaign: String,
    program: String,
    fingerprint: String,
    runs: u64,
    runs_of_a_part: u64,
}

/// The folder of a campaign.
#[derive(Debug)]
pub struct RunStore {
    folder: PathBuf,
    head: Head,
    /// Of each aircraft its first run and the names of its measures.
    aircraft: Vec<(u64, Vec<String>)>,
}

/// The content of a part.
#[derive(Debug, Serialize, Deserialize)]
struct StorePart<'a> {
    head: Cow<'a, Head>,
    rows: Cow<'a, [Row]>,
}

impl RunStore {
    /// Opens the folder of a campaign, or makes it.
    pub fn open(plan: &Plan, folder: &Path) -> Result<Self, Problem> {
        let laws = plan.laws().len() as u64;
        let of = |aircraft: &Aircraft| {
            let names = aircraft.measures.iter().map(|(name, _)| name.clone()).collect();
            (aircraft.first * laws, names)
        };
        let aircraft = plan.aircraft.iter().map(of).collect();
        let store = Self { folder: folder.to_path_buf(), head: Head::of(plan), aircraft };
        let parts = store.parts();
        // Only for its checks, and for the folder itself.
        let _ = OutFolder::create(folder)?;
        fs::create_dir_all(&parts).at(parts.display())?;
        let path = store.head_path();
        // Every other error is told by the comparison below, which reads the file again.
        if matches!(file::read_text(&path, TEXT_MAX), Err(problem) if problem.is_not_found()) {
            // Plain fields always become text.
            let text = toml::to_string(&store.head).unwrap_or_default();
            // Another campaign may have made it just now: it is compared below, and never replaced.
            let mut new = NewFile::begin(&path, |_| true).at(path.display())?;
            write!(new, "{HEAD}\n\n{text}").at(path.display())?;
            // Of two campaigns that begin in the same moment one makes the file; both compare with what it says.
            let _ = new.finish_if_free().at(path.display())?;
        }
        store.compare_with_head(&store.folder)?;
        Ok(store)
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    pub fn count(&self) -> u64 {
        self.head.runs.div_ceil(self.head.runs_of_a_part)
    }

    /// Runs of a part.
    pub fn range(&self, part: u64) -> std::ops::Range<u64> {
        let from = part * self.head.runs_of_a_part;
        from..(from + self.head.runs_of_a_part).min(self.head.runs)
    }

    /// The runs of a part; `None` if it is not there, or not whole: then it is flown again.
    pub fn read(&self, part: u64) -> Result<Option<Vec<Row>>, Problem> {
        let path = self.path(part);
        match file::read(&path, PART_BYTES_MAX) {
            Ok(bytes) => decode(&bytes).map(|whole| self.check(part, whole, &path)).transpose(),
            Err(problem) if problem.is_not_found() => Ok(None),
            Err(problem) => Err(problem).at(path.display()),
        }
    }

    /// The runs of a part of a finished campaign.
    pub fn runs(&self, part: u64) -> Result<Vec<Row>, Problem> {
        self.read(part)?.ok_or_else(|| self.missing(1, part))
    }

    /// Whether a part is there and whole.
    pub fn has(&self, part: u64) -> Result<bool, Problem> {
        // Read in full, because a part that is not whole is not there.
        Ok(self.read(part)?.is_some())
    }

    /// Writes a part: it is there whole, or not at all.
    pub fn write(&self, part: u64, rows: &[Row]) -> Result<(), Problem> {
        let path = self.path(part);
        let content = StorePart { head: Cow::Borrowed(&self.head), rows: Cow::Borrowed(rows) };
        let content = postcard::to_stdvec(&content).at(path.display())?;
        let mut bytes = MARK.to_vec();
        bytes.extend((content.len() as u64).to_le_bytes());
        bytes.extend(crc32fast::hash(&content).to_le_bytes());
        bytes.extend(content);
        write_new(&path, &bytes, MARK)
    }

    /// Takes every whole part of another folder of the same campaign that is not here yet; gives how many.
    pub fn take(&self, other: &Path) -> Result<u64, Problem> {
        let (head, aircraft) = (self.head.clone(), self.aircraft.clone());
        let from = Self { folder: other.to_path_buf(), head, aircraft };
        from.compare_with_head(other)?;
        let mut taken = 0;
        for part in 0..self.count() {
            if let Some(rows) = from.read(part)?
                && !self.has(part)?
            {
                self.write(part, &rows)?;
                taken += 1;
            }
        }
        Ok(taken)
    }

    /// Checks that every part is there.
    pub fn check_complete(&self) -> Result<(), Problem> {
        let mut missing = Vec::new();
        for part in 0..self.count() {
            if !self.has(part)? {
                missing.push(part);
            }
        }
        match missing.first() {
            None => Ok(()),
            Some(first) => Err(self.missing(missing.len(), *first)),
        }
    }

    fn missing(&self, missing: usize, first: u64) -> Problem {
        let (folder, count) = (self.folder.display(), self.count());
        problem!("{folder}: {missing} of {count} parts are missing, the first one is part {first}")
    }

    /// The rows of a whole part, if it is the one of this name in this campaign.
    fn check(&self, part: u64, whole: StorePart<'_>, path: &Path) -> Result<Vec<Row>, Problem> {
        self.compare(&whole.head, path)?;
        let rows = whole.rows.into_owned();
        let range = self.range(part);
        if !rows.iter().map(|row| row.run).eq(range.clone()) {
            let first = rows.first().map_or("none".to_owned(), |row| row.run.to_string());
            return Err(problem!(
                "{}: it has {} runs from {first} on; it must have {} to {}",
                path.display(),
                rows.len(),
                range.start,
                range.end - 1
            ));
        }
        for row in &rows {
            let of = self.aircraft.partition_point(|(first, _)| *first <= row.run) - 1;
            row.check(&self.aircraft[of].1).at(path.display())?;
        }
        Ok(rows)
    }

    fn compare_with_head(&self, folder: &Path) -> Result<(), Problem> {
        let path = self.head_path();
        let text = file::read_text(&path, TEXT_MAX).at(path.display())?;
        let head = toml::from_str(&text).at(path.display())?;
        self.compare(&head, folder)
    }

    fn compare(&self, head: &Head, path: &Path) -> Result<(), Problem> {
        let (mine, its) = (&self.head, head);
        let differs = [
            ("program version", &its.program, &mine.program),
            ("campaign", &its.campaign, &mine.campaign),
            ("fingerprint", &its.fingerprint, &mine.fingerprint),
            ("runs", &its.runs.to_string(), &mine.runs.to_string()),
        ];
        for (key, found, expected) in differs {
            if found != expected {
                return Err(problem!(
                    "{}: it has results of {key} {found}, and this campaign has {expected}; take another folder",
                    path.display()
                ));
            }
        }
        Ok(())
    }

    fn parts(&self) -> PathBuf {
        self.folder.join("parts")
    }

    fn path(&self, part: u64) -> PathBuf {
        self.parts().join(format!("{part:08}.part"))
    }

    fn head_path(&self) -> PathBuf {
        self.folder.join("campaign.toml")
    }
}

impl Head {
    fn of(plan: &Plan) -> Self {
        // Between 1 and a thousand.
        let runs_of_a_part =
            (PART_S / plan.file.spec.duration_s).clamp(1.0, PART_RUNS_MAX).floor() as u64;
        Self {
            campaign: plan.file.spec.name.clone(),
            program: PROGRAM.to_owned(),
            fingerprint: plan.fingerprint.clone(),
            runs: plan.runs(),
            runs_of_a_part,
        }
    }
}

/// What the bytes of a whole part say; `None` where a killed program, or a disk, has left something else.
fn decode(bytes: &[u8]) -> Option<StorePart<'_>> {
    let rest = bytes.strip_prefix(MARK)?;
    let (length, rest) = rest.split_first_chunk::<8>()?;
    let (crc, content) = rest.split_first_chunk::<4>()?;
    let is_whole = u64::from_le_bytes(*length) == content.len() as u64
        && u32::from_le_bytes(*crc) == crc32fast::hash(content);
    // Decoded last, since damaged bytes could claim a list of any length.
    is_whole.then(|| postcard::from_bytes(content).ok())?
}

/// Writes a file that is whole or not there; it replaces only a file of the same kind.
pub(crate) fn write_new(path: &Path, bytes: &[u8], mark: &[u8]) -> Result<(), Problem> {
    file::write(path, bytes, mark).at(path.display())
}
