//! Small files saved for the next start: parameters; plan, fence and rally points; signing key. Each is read at start and
//! written by its own thread.
//!
//! The name always refers to a complete file, even if the process is killed, and only a file of its own kind
//! is replaced or removed ([`OwnFile`]). Changes in quick succession are written once.

use core::time::Duration;
use std::env;
use std::ffi::OsString;
use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use host_io::file::{self, FileProblem, OwnFile};
use host_io::problem::{Problem, problem};
use nix::unistd::geteuid;
use tracing::warn;

use super::join;
use flight_management::TextError;
use flight_management::parameters::{Parameters, from_text, has_only_parameters, saved_error};
use mavlink_services::mission::{SavedPlan, SavedPlanError};
use mavlink_services::param::{Save, Saved};
use mavlink_services::signing::{KeyChange, KeyRecord, RecordError};

/// Waiting time for further changes before a change is written.
const GATHER: Duration = Duration::from_millis(500);
/// Extension of the plan file in place of the parameter file's: `parameters.plan.toml`.
const PLAN_EXTENSION: &str = "plan.toml";
/// Permissions of the key file: its owner reads and writes, other users have no access.
const KEY_MODE: u32 = 0o600;
/// Permissions of a folder created for it.
const KEY_FOLDER_MODE: u32 = 0o700;
/// Permissions of a key file that only its owner may have.
const OTHERS: u32 = 0o077;
/// Longest key file that is read; those of the autopilot have 200 bytes.
const KEY_BYTES_MAX: u64 = 4096;

/// A path from the command line, or `none`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PathOption {
    /// No file: nothing is read or written.
    None,
    At(PathBuf),
}

/// An option that must be a path or `none` is empty: an unset variable must not select some default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("neither a path nor none")]
pub struct EmptyPath;

impl FromStr for PathOption {
    type Err = EmptyPath;

    fn from_str(text: &str) -> Result<Self, EmptyPath> {
        match text {
            "" => Err(EmptyPath),
            "none" => Ok(Self::None),
            path => Ok(Self::At(PathBuf::from(path))),
        }
    }
}

impl PathOption {
    /// The path of an option; without the option that of `name` in the user's data folder, as the XDG base directory
    /// specification defines it.
    pub fn path(option: Option<&Self>, name: &str) -> Option<PathBuf> {
        match option {
            Some(Self::At(path)) => Some(path.clone()),
            Some(Self::None) => None,
            None => data_folder(env::var_os("XDG_DATA_HOME"), env::var_os("HOME"))
                .map(|folder| folder.join(name)),
        }
    }
}

/// The user's data folder; `None` if there is no user.
fn data_folder(data: Option<OsString>, home: Option<OsString>) -> Option<PathBuf> {
    let absolute = |path: Option<OsString>| path.map(PathBuf::from).filter(|p| p.is_absolute());
    absolute(data).or_else(|| Some(absolute(home)?.join(".local/share")))
}

/// Text of a file; `None` if it does not exist.
fn read_text(path: &Path) -> Result<Option<String>, FileProblem> {
    match file::read_text(path, file::TEXT_MAX) {
        Ok(text) => Ok(Some(text)),
        Err(problem) if problem.is_not_found() => Ok(None),
        Err(problem) => Err(problem),
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct KeptParameters {
    pub path: PathBuf,
    /// Its values, and the defaults for the others.
    pub parameters: Parameters,
    /// Defaults of the aircraft.
    pub defaults: Parameters,
}

impl KeptParameters {
    /// Reads the file; if it does not exist, the defaults apply.
    pub fn read(path: PathBuf, defaults: &Parameters) -> Result<Self, TextError> {
        let file = path.display().to_string();
        let parameters = match read_text(&path) {
            Ok(Some(text)) => from_text(&file, &text, defaults)?,
            Ok(None) => *defaults,
            Err(problem) => {
                return Err(saved_error(&file, format!("cannot be read: {problem}")));
            }
        };
        Ok(Self { path, parameters, defaults: *defaults })
    }

    /// The file for its writer: it contains parameters and nothing else.
    pub fn own_file(&self) -> OwnFile {
        let is_own = |content: &[u8]| str::from_utf8(content).is_ok_and(has_only_parameters);
        OwnFile::new(&self.path, file::TEXT_MAX, is_own)
    }

    /// One line about the values that differ from their defaults; `None` if there are none.
    pub fn summary(&self) -> Option<String> {
        let values = self.parameters.differences(&self.defaults);
        let count = match values.len() {
            0 => return None,
            1 => "1 saved value".to_owned(),
            more => format!("{more} saved values"),
        };
        Some(format!("parameters: {count} from {}: {}", self.path.display(), values.join(", ")))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct KeptPlan {
    pub path: PathBuf,
    /// The plan in it.
    pub plan: SavedPlan,
}

impl KeptPlan {
    /// Reads the plan saved next to the parameters; without the file there is no plan.
    pub fn read_beside(parameters: &Path) -> Result<Self, SavedPlanError> {
        let path = parameters.with_extension(PLAN_EXTENSION);
        let file = path.display().to_string();
        let plan = match read_text(&path) {
            Ok(Some(text)) => SavedPlan::from_text(&file, &text)?,
            Ok(None) => SavedPlan::default(),
            Err(problem) => {
                let problem = format!("cannot be read: {problem}");
                return Err(SavedPlanError { file, problem });
            }
        };
        Ok(Self { path, plan })
    }

    /// The file for its writer: it contains a plan and nothing else.
    pub fn own_file(&self) -> OwnFile {
        let is_own = |content: &[u8]| {
            str::from_utf8(content).is_ok_and(|text| SavedPlan::from_text("", text).is_ok())
        };
        OwnFile::new(&self.path, file::TEXT_MAX, is_own)
    }

    /// One line about the plan, the fence and the rally points; `None` if there is none of them.
    pub fn summary(&self) -> Option<String> {
        let counts = self.plan.counts();
        let parts = ["plan", "fence", "rally points"].iter().zip(counts);
        let parts = parts.filter(|(_, count)| *count > 0);
        let parts: Vec<_> =
            parts.map(|(list, count)| format!("{list}: {count} saved items")).collect();
        (!parts.is_empty()).then(|| format!("{} from {}", parts.join(", "), self.path.display()))
    }
}

/// The file of the signing key. Only its owner may read it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptKey {
    pub path: PathBuf,
    /// Its content; `None` if it does not exist.
    pub record: Option<KeyRecord>,
}

impl KeptKey {
    /// Reads the file; without it there is no key. An error never shows the key.
    pub fn read(path: PathBuf) -> Result<Self, Problem> {
        let advice = "mend or delete the file, or start with --signing-key none";
        match read_key(&path) {
            Ok(record) => Ok(Self { path, record }),
            Err(problem) => Err(problem!("{}: {problem}; {advice}", path.display())),
        }
    }

    /// The file for its writer, for its owner alone: it contains a signing key.
    pub fn own_file(&self) -> OwnFile {
        let is_own = |content: &[u8]| {
            str::from_utf8(content).is_ok_and(|text| KeyRecord::from_text(text).is_ok())
        };
        OwnFile::new(&self.path, KEY_BYTES_MAX, is_own).with_modes(KEY_MODE, KEY_FOLDER_MODE)
    }

    /// One line for the log; `None` if signing is off.
    pub fn summary(&self) -> Option<String> {
        self.record?;
        Some(format!("signing is on: the key is from {}", self.path.display()))
    }
}

fn read_key(path: &Path) -> Result<Option<KeyRecord>, Problem> {
    let file = match file::open(path) {
        Err(problem) if problem.is_not_found() => return Ok(None),
        opened => opened?,
    };
    let about = file.metadata()?;
    let (found, wanted) = (about.uid(), geteuid().as_raw());
    if found != wanted {
        return Err(problem!(
            "it belongs to user {found} and has to belong to user {wanted}, who runs this program"
        ));
    }
    let found = about.mode() & 0o7777;
    if found & OTHERS != 0 {
        return Err(problem!(
            "others may use it: its mode is {found:04o} and has to be {KEY_MODE:04o}"
        ));
    }
    let bytes = file::read_opened(&file, KEY_BYTES_MAX)?;
    let text = String::from_utf8(bytes).map_err(|_| RecordError::Form)?;
    Ok(Some(KeyRecord::from_text(&text)?))
}

/// Operation on a file.
#[derive(Debug)]
pub enum Change {
    Save(Save),
    Remove,
}

impl From<Save> for Change {
    fn from(save: Save) -> Self {
        Self::Save(save)
    }
}

impl From<KeyChange> for Change {
    fn from(change: KeyChange) -> Self {
        match change {
            KeyChange::Keep(key) => {
                Self::Save(Save { number: 0, text: key.to_text(), at_once: true })
            }
            KeyChange::Forget => Self::Remove,
        }
    }
}

/// State shared by writer and owner.
#[derive(Debug, Default)]
struct SharedStore {
    state: Mutex<StoreState>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct StoreState {
    /// The latest change; it supersedes an earlier one that was not written yet.
    next: Option<Change>,
    outcome: Option<Saved>,
    has_ended: bool,
}

impl SharedStore {
    fn lock(&self) -> MutexGuard<'_, StoreState> {
        // The state is consistent at every moment, even if a thread has panicked.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Writes a file saved for the next start. Dropping it waits until everything is written.
#[derive(Debug)]
pub struct Store {
    shared: Arc<SharedStore>,
    writer: Option<JoinHandle<()>>,
    name: &'static str,
}

impl Store {
    /// Starts the writer of a file, which messages call `name`.
    pub fn open(file: OwnFile, name: &'static str) -> io::Result<Self> {
        let shared = Arc::new(SharedStore::default());
        let theirs = Arc::clone(&shared);
        let write = move || write_all(&theirs, &file, name);
        let writer = thread::Builder::new().name(name.to_owned()).spawn(write)?;
        Ok(Self { shared, writer: Some(writer), name })
    }

    /// Submits the latest change. Never waits for the disk.
    pub fn change(&self, change: impl Into<Change>) {
        self.shared.lock().next = Some(change.into());
        self.shared.changed.notify_one();
    }

    /// Result of the latest write, once.
    pub fn outcome(&self) -> Option<Saved> {
        self.shared.lock().outcome.take()
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        self.shared.lock().has_ended = true;
        self.shared.changed.notify_one();
        join(self.writer.take(), &format!("writer of the {}", self.name));
    }
}

fn write_all(shared: &SharedStore, file: &OwnFile, name: &str) {
    loop {
        let is_idle = |state: &mut StoreState| state.next.is_none() && !state.has_ended;
        let state = shared.changed.wait_while(shared.lock(), is_idle);
        let state = state.unwrap_or_else(PoisonError::into_inner);
        if state.next.is_none() {
            return;
        }
        let can_gather = |state: &mut StoreState| {
            !state.has_ended && matches!(&state.next, Some(Change::Save(save)) if !save.at_once)
        };
        let gathered = shared.changed.wait_timeout_while(state, GATHER, can_gather);
        let (mut state, _) = gathered.unwrap_or_else(PoisonError::into_inner);
        let Some(change) = state.next.take() else { continue };
        drop(state);
        let (number, written) = match change {
            Change::Save(Save { number, text, .. }) => (number, file.replace(text.as_bytes())),
            Change::Remove => (0, file.remove()),
        };
        let result = written.map_err(|problem| {
            warn!(file = %file.path().display(), %problem, "the {name} is not written");
            problem.to_string()
        });
        shared.lock().outcome = Some(Saved { number, result });
    }
}

#[cfg(test)]
mod tests;
