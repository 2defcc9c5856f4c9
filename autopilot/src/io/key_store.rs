//! The signing key file: read at start, written by a thread of its own. Nobody but its owner may read it.
//!
//! The name always leads to a whole file that nobody else can read, and only a file that has a key is replaced or
//! removed ([`OwnFile`]).

use std::io;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use host_io::file::{self, FileProblem, OwnFile};
use nix::unistd::geteuid;
use tracing::warn;

use super::store::{NoPath, path_or_none, user_data_folder};
use mavlink_services::signing::{KeyChange, KeyRecord, RecordError};

/// The file inside the user's data folder.
const FILE: &str = "two-step/signing.key";
/// Permissions of the file: its owner reads and writes, nobody else does anything.
const MODE: u32 = 0o600;
/// Permissions of a folder that is made for it.
const FOLDER_MODE: u32 = 0o700;
/// Permissions that nobody may have.
const OTHERS: u32 = 0o077;
/// Longest file that is read; one that the autopilot writes has 200 bytes.
const BYTES_MAX: u64 = 4096;

/// Where the signing key is kept.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum KeyFile {
    /// Nowhere: nothing is read, nothing written.
    None,
    /// In this file.
    At(PathBuf),
}

impl Default for KeyFile {
    /// In the user's data folder, as the XDG base directory specification has it.
    fn default() -> Self {
        user_data_folder().map_or(Self::None, |folder| Self::At(folder.join(FILE)))
    }
}

impl FromStr for KeyFile {
    type Err = NoPath;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(path_or_none(text)?.map_or(Self::None, Self::At))
    }
}

/// A key file that must not be used.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {problem}; mend or delete the file, or start with --signing-key none")]
pub struct KeyFileError {
    /// The file.
    pub file: String,
    /// What is wrong with it.
    pub problem: KeyFileProblem,
}

/// What is wrong with a key file. Never shows the key.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileProblem {
    /// The system does not give it, or it is a folder, a device, or far too long.
    #[error("{0}")]
    File(#[from] FileProblem),
    /// Others than its owner may do something with it.
    #[error("others may use it: its mode is {found:04o} and has to be {MODE:04o}")]
    Mode {
        /// Mode of the file.
        found: u32,
    },
    /// It belongs to somebody else.
    #[error("it belongs to user {found} and has to belong to user {wanted}, who runs this program")]
    Owner {
        /// Owner of the file.
        found: u32,
        /// User of this process.
        wanted: u32,
    },
    /// Its text is wrong.
    #[error("{0}")]
    Text(#[from] RecordError),
}

impl KeyFile {
    /// What is kept; `None` where nothing is to be. A file that is not there keeps no key.
    ///
    /// # Errors
    /// [`KeyFileError`] names the file and what is wrong with it.
    pub fn read(&self) -> Result<Option<KeptKey>, KeyFileError> {
        let Self::At(path) = self else { return Ok(None) };
        let record = match read(path) {
            Ok(record) => Some(record),
            Err(KeyFileProblem::File(problem)) if problem.is_not_found() => None,
            Err(problem) => return Err(KeyFileError { file: path.display().to_string(), problem }),
        };
        Ok(Some(KeptKey { path: path.clone(), record }))
    }
}

fn read(path: &Path) -> Result<KeyRecord, KeyFileProblem> {
    let file = file::open(path)?;
    let about = file.metadata().map_err(FileProblem::from)?;
    let (found, wanted) = (about.uid(), geteuid().as_raw());
    if found != wanted {
        return Err(KeyFileProblem::Owner { found, wanted });
    }
    let found = about.mode() & 0o7777;
    if found & OTHERS != 0 {
        return Err(KeyFileProblem::Mode { found });
    }
    let bytes = file::read_opened(&file, BYTES_MAX)?;
    let text = String::from_utf8(bytes).map_err(|_| RecordError::Form)?;
    Ok(KeyRecord::from_text(&text)?)
}

/// A key file, and the key that is in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeptKey {
    /// The file.
    pub path: PathBuf,
    /// What is in it; `None` if it is not there.
    pub record: Option<KeyRecord>,
}

impl KeptKey {
    /// One line for the log; `None` if signing is off.
    #[must_use]
    pub fn summary(&self) -> Option<String> {
        self.record?;
        Some(format!("signing is on: the key is from {}", self.path.display()))
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
    /// The latest; an older one that was not written yet is not wanted any more.
    next: Option<KeyChange>,
    failure: Option<String>,
    has_ended: bool,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // The state is whole at every moment, also where a thread broke down.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Writes the key file. Dropping it waits until everything is written.
#[derive(Debug)]
pub struct KeyStore {
    shared: Arc<Shared>,
    writer: Option<JoinHandle<()>>,
}

impl KeyStore {
    /// Starts the writer.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = own_file(path);
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let write = move || write_all(&theirs, &file);
        let writer = thread::Builder::new().name("signing key".to_owned()).spawn(write)?;
        Ok(Self { shared, writer: Some(writer) })
    }

    /// Hands over what the file should have. Never waits for the disk.
    pub fn change(&self, change: KeyChange) {
        self.shared.lock().next = Some(change);
        self.shared.changed.notify_one();
    }

    /// Why the latest write failed, once.
    #[must_use]
    pub fn failure(&self) -> Option<String> {
        self.shared.lock().failure.take()
    }
}

impl Drop for KeyStore {
    fn drop(&mut self) {
        self.shared.lock().has_ended = true;
        self.shared.changed.notify_one();
        if let Some(writer) = self.writer.take()
            && writer.join().is_err()
        {
            warn!("the writer of the signing key has broken down");
        }
    }
}

/// The file as one of this program, for its owner alone: it has a signing key.
fn own_file(path: &Path) -> OwnFile {
    let is_own = |content: &[u8]| {
        std::str::from_utf8(content).is_ok_and(|text| KeyRecord::from_text(text).is_ok())
    };
    OwnFile::new(path, BYTES_MAX, is_own).with_modes(MODE, FOLDER_MODE)
}

fn write_all(shared: &Shared, file: &OwnFile) {
    loop {
        let idle = |state: &mut State| state.next.is_none() && !state.has_ended;
        let state = shared.changed.wait_while(shared.lock(), idle);
        let mut state = state.unwrap_or_else(PoisonError::into_inner);
        let Some(change) = state.next.take() else { return };
        drop(state);
        let result = match change {
            KeyChange::Keep(record) => file.replace(record.to_text().as_bytes()),
            KeyChange::Forget => file.remove(),
        };
        if let Err(problem) = result {
            warn!(file = %file.path().display(), %problem, "the signing key is not saved");
            shared.lock().failure = Some(problem.to_string());
        }
    }
}

#[cfg(test)]
mod tests;
