//! The parameter file: read at start, written by a thread of its own while ground stations change
//! parameters.
//!
//! A write goes to a new file beside the old one, which then takes its name, so that the name always leads to
//! a whole file, also when the process is killed. Changes that follow each other quickly are written once.

use core::time::Duration;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::{env, process};

use tracing::warn;

use crate::mavlink::param::{Save, Saved};
use crate::parameters::{Parameters, SavedError, SavedProblem, from_text};

/// Time for more changes to come before a change is written.
const GATHER: Duration = Duration::from_millis(500);
/// The file inside the user's data folder.
const FILE: &str = "two-step/parameters.toml";

/// An option that has to be a path or `none` is empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("neither a path nor none")]
pub struct NoPath;

/// What an option says that is a path or `none`.
///
/// # Errors
/// [`NoPath`] if it is empty: a variable that is not set must not stand for some place.
pub fn path_or_none(text: &str) -> Result<Option<PathBuf>, NoPath> {
    match text {
        "" => Err(NoPath),
        "none" => Ok(None),
        path => Ok(Some(PathBuf::from(path))),
    }
}

/// Where parameters are kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ParameterFile {
    /// Nowhere: nothing is read, nothing written.
    None,
    /// In this file.
    At(PathBuf),
}

impl Default for ParameterFile {
    /// In the user's data folder, as the XDG base directory specification has it.
    fn default() -> Self {
        Self::in_data_folder(env::var_os("XDG_DATA_HOME"), env::var_os("HOME"))
    }
}

impl FromStr for ParameterFile {
    type Err = NoPath;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(path_or_none(text)?.map_or(Self::None, Self::At))
    }
}

impl ParameterFile {
    fn in_data_folder(data: Option<std::ffi::OsString>, home: Option<std::ffi::OsString>) -> Self {
        match data_folder(data, home) {
            Some(folder) => Self::At(folder.join(FILE)),
            None => Self::None,
        }
    }

    /// What is kept; `None` where nothing is to be. A file that is not there keeps nothing but defaults.
    ///
    /// # Errors
    /// [`SavedError`] names the file and what is wrong with it.
    pub fn read(&self) -> Result<Option<Kept>, SavedError> {
        let Self::At(path) = self else { return Ok(None) };
        let file = path.display().to_string();
        let parameters = match fs::read_to_string(path) {
            Ok(text) => from_text(&file, &text)?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Parameters::default(),
            Err(error) => {
                return Err(SavedError {
                    file,
                    problem: SavedProblem::Unreadable(error.to_string()),
                });
            }
        };
        Ok(Some(Kept { path: path.clone(), parameters }))
    }
}

/// The user's data folder, as the XDG base directory specification has it; `None` where there is no user.
pub(crate) fn user_data_folder() -> Option<PathBuf> {
    data_folder(env::var_os("XDG_DATA_HOME"), env::var_os("HOME"))
}

fn data_folder(
    data: Option<std::ffi::OsString>,
    home: Option<std::ffi::OsString>,
) -> Option<PathBuf> {
    let data = data.map(PathBuf::from).filter(|path| path.is_absolute());
    let home = home.map(PathBuf::from).filter(|path| path.is_absolute());
    data.or_else(|| Some(home?.join(".local/share")))
}

/// Parameters that are kept in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Kept {
    /// The file.
    pub path: PathBuf,
    /// What is in it.
    pub parameters: Parameters,
}

impl Kept {
    /// One line about the values that differ from their defaults; `None` if there are none.
    #[must_use]
    pub fn summary(&self) -> Option<String> {
        let values = self.parameters.differences();
        let count = match values.len() {
            0 => return None,
            1 => "1 saved value".to_owned(),
            more => format!("{more} saved values"),
        };
        Some(format!("parameters: {count} from {}: {}", self.path.display(), values.join(", ")))
    }
}

/// What writer and owner share.
#[derive(Debug, Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    /// The latest text; an older one that was not written yet is not wanted any more.
    next: Option<Save>,
    outcome: Option<Saved>,
    has_ended: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // The state is whole at every moment, also where a thread broke down.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Writes the parameter file. Dropping it waits until everything is written.
#[derive(Debug)]
pub struct Store {
    shared: Arc<Shared>,
    writer: Option<JoinHandle<()>>,
}

impl Store {
    /// Starts the writer.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn open(path: &Path) -> io::Result<Self> {
        // Of a link, the file that it leads to is replaced and not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let write = move || write_all(&theirs, &path);
        let writer = thread::Builder::new().name("parameter file".to_owned()).spawn(write)?;
        Ok(Self { shared, writer: Some(writer) })
    }

    /// Hands over the latest text. Never waits.
    pub fn save(&self, save: Save) {
        self.shared.lock().next = Some(save);
        self.shared.changed.notify_one();
    }

    /// What became of the latest write, once.
    #[must_use]
    pub fn outcome(&self) -> Option<Saved> {
        self.shared.lock().outcome.take()
    }
}

impl Drop for Store {
    fn drop(&mut self) {
        self.shared.lock().has_ended = true;
        self.shared.changed.notify_one();
        if let Some(writer) = self.writer.take()
            && writer.join().is_err()
        {
            warn!("the writer of the parameter file has broken down");
        }
    }
}

fn write_all(shared: &Shared, path: &Path) {
    loop {
        let idle = |state: &mut State| state.next.is_none() && !state.has_ended;
        let state = shared.changed.wait_while(shared.lock(), idle);
        let state = state.unwrap_or_else(PoisonError::into_inner);
        if state.next.is_none() {
            return;
        }
        let can_gather = |state: &mut State| {
            !state.has_ended && state.next.as_ref().is_some_and(|next| !next.at_once)
        };
        let gathered = shared.changed.wait_timeout_while(state, GATHER, can_gather);
        let (mut state, _) = gathered.unwrap_or_else(PoisonError::into_inner);
        let Some(Save { number, text, .. }) = state.next.take() else { continue };
        drop(state);
        let result = replace(path, &text).map_err(|error| {
            warn!(file = %path.display(), %error, "parameters are not saved");
            error.to_string()
        });
        shared.lock().outcome = Some(Saved { number, result });
    }
}

/// Gives `path` this content, or leaves it as it is.
fn replace(path: &Path, text: &str) -> io::Result<()> {
    let folder = path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    // Two autopilots with one file do not write into each other's new file.
    name.push(format!(".{}.new", process::id()));
    let new = folder.join(name);
    let written = write_new(&new, text).and_then(|()| fs::rename(&new, path));
    if written.is_err() {
        // It may never have come to be; the error that matters is the one above.
        let _ = fs::remove_file(&new);
    }
    written?;
    // The name is on the disk when its folder is. A folder that cannot be opened still has the file.
    File::open(folder).and_then(|folder| folder.sync_all()).or(Ok(()))
}

fn write_new(path: &Path, text: &str) -> io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()
}

#[cfg(test)]
mod tests;
