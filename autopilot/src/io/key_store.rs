//! The signing key file: read at start, written by a thread of its own. Nobody but its owner may read it.
//!
//! A write goes to a new file that nobody else can read, which then takes the name, so that the name always
//! leads to a whole file.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, MetadataExt as _, OpenOptionsExt as _};
use std::path::{Path, PathBuf};
use std::process;
use std::str::FromStr;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};

use nix::unistd::geteuid;
use tracing::warn;

use super::store::{NoPath, path_or_none, user_data_folder};
use crate::mavlink::signing::{KeyChange, KeyRecord, RecordError};

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
    /// The system does not give it.
    #[error("cannot be read: {0}")]
    Unreadable(io::Error),
    /// A folder, a device, or far too long.
    #[error("not an ordinary file of at most {BYTES_MAX} bytes")]
    NotAFile,
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
            Err(KeyFileProblem::Unreadable(error)) if error.kind() == io::ErrorKind::NotFound => {
                None
            }
            Err(problem) => return Err(KeyFileError { file: path.display().to_string(), problem }),
        };
        Ok(Some(KeptKey { path: path.clone(), record }))
    }
}

fn read(path: &Path) -> Result<KeyRecord, KeyFileProblem> {
    // Before it is opened: to open a pipe is to wait for its other end.
    if !fs::metadata(path).map_err(KeyFileProblem::Unreadable)?.is_file() {
        return Err(KeyFileProblem::NotAFile);
    }
    let file = File::open(path).map_err(KeyFileProblem::Unreadable)?;
    // Of what was opened, whatever the name leads to by now.
    let about = file.metadata().map_err(KeyFileProblem::Unreadable)?;
    let (found, wanted) = (about.uid(), geteuid().as_raw());
    if found != wanted {
        return Err(KeyFileProblem::Owner { found, wanted });
    }
    let found = about.mode() & 0o7777;
    if found & OTHERS != 0 {
        return Err(KeyFileProblem::Mode { found });
    }
    if !about.is_file() || about.len() > BYTES_MAX {
        return Err(KeyFileProblem::NotAFile);
    }
    let mut bytes = Vec::new();
    file.take(BYTES_MAX).read_to_end(&mut bytes).map_err(KeyFileProblem::Unreadable)?;
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
        // Of a link, the file that it leads to is replaced and not the link.
        let path = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let write = move || write_all(&theirs, &path);
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

fn write_all(shared: &Shared, path: &Path) {
    loop {
        let idle = |state: &mut State| state.next.is_none() && !state.has_ended;
        let state = shared.changed.wait_while(shared.lock(), idle);
        let mut state = state.unwrap_or_else(PoisonError::into_inner);
        let Some(change) = state.next.take() else { return };
        drop(state);
        let result = match change {
            KeyChange::Keep(record) => replace(path, &record.to_text()),
            KeyChange::Forget => remove(path),
        };
        if let Err(error) = result {
            warn!(file = %path.display(), %error, "the signing key is not saved");
            shared.lock().failure = Some(error.to_string());
        }
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| *folder != Path::new("")).unwrap_or(Path::new("."))
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => sync(folder_of(path)),
    }
}

/// The name is on the disk when its folder is. A folder that cannot be opened still has the file.
fn sync(folder: &Path) -> io::Result<()> {
    File::open(folder).and_then(|folder| folder.sync_all()).or(Ok(()))
}

/// Gives `path` this content, or leaves it as it is.
fn replace(path: &Path, text: &str) -> io::Result<()> {
    let folder = folder_of(path);
    DirBuilder::new().recursive(true).mode(FOLDER_MODE).create(folder)?;
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
    sync(folder)
}

/// A file that only its owner can read from its first moment on.
fn write_new(path: &Path, text: &str) -> io::Result<()> {
    match fs::remove_file(path) {
        // Left over by a process that had the same number.
        Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
        _ => {}
    }
    let mut file = OpenOptions::new().write(true).create_new(true).mode(MODE).open(path)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()
}

#[cfg(test)]
mod tests;
