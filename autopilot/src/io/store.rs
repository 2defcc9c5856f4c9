//! The parameter file, and beside it the plan file: read at start, each written by a thread of its own while ground
//! stations change parameters and plans.
//!
//! The name always leads to a whole file, also when the process is killed, and only a file that has parameters is
//! replaced ([`OwnFile`]). Changes that follow each other quickly are written once.

use core::time::Duration;
use std::env;
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use host_io::file::{self, FileProblem, OwnFile};
use tracing::warn;

use flight_management::parameters::{
    Parameters, SavedError, SavedProblem, from_text, has_only_parameters,
};
use mavlink_services::mission::{SavedPlan, SavedPlanError};
use mavlink_services::param::{Save, Saved};

/// Time for more changes to come before a change is written.
const GATHER: Duration = Duration::from_millis(500);
/// The file inside the user's data folder.
const FILE: &str = "two-step/parameters.toml";
/// What the plan file has in place of the parameter file's extension: `parameters.plan.toml`.
const PLAN_EXTENSION: &str = "plan.toml";

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

    /// What is kept; `None` where nothing is to be. What the file does not have is as in `defaults`, those of the
    /// aircraft; a file that is not there keeps nothing but these.
    ///
    /// # Errors
    /// [`SavedError`] names the file and what is wrong with it.
    pub fn read(&self, defaults: &Parameters) -> Result<Option<Kept>, SavedError> {
        let Self::At(path) = self else { return Ok(None) };
        let file = path.display().to_string();
        let unreadable = |problem: &FileProblem| SavedError {
            file: file.clone(),
            problem: SavedProblem::Unreadable(problem.to_string()),
        };
        let parameters = match file::read_text(path, file::TEXT_MAX) {
            Ok(text) => from_text(&file, &text, defaults)?,
            Err(problem) if problem.is_not_found() => *defaults,
            Err(problem) => return Err(unreadable(&problem)),
        };
        Ok(Some(Kept { path: path.clone(), parameters, defaults: *defaults }))
    }

    /// The plan that is kept beside the parameters; `None` where nothing is to be. A file that is not there keeps no plan.
    ///
    /// # Errors
    /// [`SavedPlanError`] names the file and what is wrong with it.
    pub fn read_plan(&self) -> Result<Option<KeptPlan>, SavedPlanError> {
        let Self::At(parameters) = self else { return Ok(None) };
        let path = parameters.with_extension(PLAN_EXTENSION);
        let name = path.display().to_string();
        let plan = match file::read_text(&path, file::TEXT_MAX) {
            Ok(text) => SavedPlan::from_text(&name, &text)?,
            Err(problem) if problem.is_not_found() => SavedPlan::default(),
            Err(problem) => {
                let problem = format!("cannot be read: {problem}");
                return Err(SavedPlanError { file: name, problem });
            }
        };
        Ok(Some(KeptPlan { path, plan }))
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
    /// What is in it, and where it has nothing the defaults.
    pub parameters: Parameters,
    /// Defaults of the aircraft.
    pub defaults: Parameters,
}

impl Kept {
    /// The file for its writer: it has parameters and nothing else.
    #[must_use]
    pub fn own_file(&self) -> OwnFile {
        own_file(&self.path)
    }

    /// One line about the values that differ from their defaults; `None` if there are none.
    #[must_use]
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

/// The plan that is kept in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct KeptPlan {
    /// The file.
    pub path: PathBuf,
    /// What is in it.
    pub plan: SavedPlan,
}

impl KeptPlan {
    /// The file for its writer: it has a plan and nothing else.
    #[must_use]
    pub fn own_file(&self) -> OwnFile {
        own_plan_file(&self.path)
    }

    /// One line about the plan; `None` if there is none.
    #[must_use]
    pub fn summary(&self) -> Option<String> {
        let count = self.plan.count();
        (count > 0).then(|| format!("plan: {count} saved items from {}", self.path.display()))
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

/// Writes a file that is kept for the next start. Dropping it waits until everything is written.
#[derive(Debug)]
pub struct Store {
    shared: Arc<Shared>,
    writer: Option<JoinHandle<()>>,
    what: &'static str,
}

impl Store {
    /// Starts the writer of a file, which is called `what`.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn open(file: OwnFile, what: &'static str) -> io::Result<Self> {
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let write = move || write_all(&theirs, &file, what);
        let writer = thread::Builder::new().name(what.to_owned()).spawn(write)?;
        Ok(Self { shared, writer: Some(writer), what })
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
            warn!("the writer of the {} has broken down", self.what);
        }
    }
}

/// The parameter file as one of this program: it has parameters and nothing else.
fn own_file(path: &Path) -> OwnFile {
    OwnFile::new(path, file::TEXT_MAX, |content| {
        str::from_utf8(content).is_ok_and(has_only_parameters)
    })
}

/// The plan file, likewise.
fn own_plan_file(path: &Path) -> OwnFile {
    OwnFile::new(path, file::TEXT_MAX, |content| {
        str::from_utf8(content).is_ok_and(|text| SavedPlan::from_text("", text).is_ok())
    })
}

fn write_all(shared: &Shared, file: &OwnFile, what: &str) {
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
        let result = file.replace(text.as_bytes()).map_err(|problem| {
            warn!(file = %file.path().display(), %problem, "the {what} is not written");
            problem.to_string()
        });
        shared.lock().outcome = Some(Saved { number, result });
    }
}

#[cfg(test)]
mod tests;
