//! The folder with logs, for ground stations that list, fetch and erase flight logs.
//!
//! Its own thread does the work for which the disk may take long: one job at a time, each of it bounded. The writer of a
//! log holds the lock of its file, so that no one removes it meanwhile, not even another process
//! with the same folder. Only regular files with names of flight logs are touched.

use core::time::Duration;
use std::fs::{self, File};
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use tokio::sync::mpsc;
use tracing::{debug, warn};

use super::recorder::folder::flight_log_begun;
use mavlink_services::logs::{Erased, LogDone, LogFile, LogJob, LogOutcome, LogTask};

/// Listed logs: if there are more, the latest.
pub const LISTED_MAX: usize = 1000;
/// Entries of the folder that are read.
const ENTRIES_MAX: usize = 100_000;
/// Bytes of a read.
const READ_MAX: usize = 256 * 1024;
/// Most recently read logs, which are not removed to make room.
const HELD_MAX: usize = 4;
/// After this time without a request, no log is protected any more.
const HOLD: Duration = Duration::from_secs(60);
/// Jobs and outcomes in their channels: there is one at a time.
const JOBS_MAX: usize = 1;

/// The thread that reads the folder.
#[derive(Debug)]
pub struct LogFolder {
    jobs: Option<SyncSender<LogJob>>,
    done: mpsc::Receiver<LogDone>,
    is_busy: bool,
    reader: Option<JoinHandle<()>>,
}

impl LogFolder {
    /// Starts the thread. The folder need not exist.
    pub fn open(folder: &Path) -> io::Result<Self> {
        let (jobs, theirs) = sync_channel::<LogJob>(JOBS_MAX);
        let (outcomes, done) = mpsc::channel(JOBS_MAX);
        let folder = folder.to_path_buf();
        let read = move || {
            let mut held = Held::default();
            while let Some(LogJob { number, task }) = held.next_job(&theirs, HOLD) {
                held.prepare(&folder, &task);
                let result = work(&folder, &task).map_err(|error| error.to_string());
                if outcomes.blocking_send(LogDone { number, result }).is_err() {
                    return;
                }
            }
        };
        let reader = thread::Builder::new().name("log folder".to_owned()).spawn(read)?;
        Ok(Self { jobs: Some(jobs), done, is_busy: false, reader: Some(reader) })
    }

    /// A job is running; the next one has to wait.
    pub fn is_busy(&self) -> bool {
        self.is_busy
    }

    /// Starts a job. Never waits; do not call it while the thread is busy.
    pub fn begin(&mut self, job: LogJob) {
        if let Some(jobs) = &self.jobs {
            self.is_busy = jobs.try_send(job).is_ok();
        }
    }

    /// Outcome of the running job; waits for ever if there is none.
    pub async fn outcome(&mut self) -> LogDone {
        match self.done.recv().await {
            Some(done) => {
                self.is_busy = false;
                done
            }
            // The thread has panicked, and a report was made: there are no more outcomes.
            None => core::future::pending().await,
        }
    }
}

impl Drop for LogFolder {
    fn drop(&mut self) {
        self.jobs = None;
        self.done.close();
        if let Some(reader) = self.reader.take()
            && reader.join().is_err()
        {
            warn!("the reader of the log folder has broken down");
        }
    }
}

/// Logs being fetched, the latest last. Their locks keep them from being removed to make room.
#[derive(Debug, Default)]
struct Held(Vec<(String, File)>);

impl Held {
    /// The next job; `None` after the last one. Unlocks all logs when no job comes for `hold`.
    fn next_job(&mut self, jobs: &Receiver<LogJob>, hold: Duration) -> Option<LogJob> {
        loop {
            match jobs.recv_timeout(hold) {
                Ok(job) => return Some(job),
                Err(RecvTimeoutError::Timeout) => self.0.clear(),
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
    }

    /// Locks the log that is about to be read; unlocks all before an erase.
    fn prepare(&mut self, folder: &Path, task: &LogTask) {
        match task {
            LogTask::Read { name, .. } => self.hold(folder, name),
            LogTask::Erase => self.0.clear(),
            LogTask::List => {}
        }
    }

    fn hold(&mut self, folder: &Path, name: &str) {
        if let Some(at) = self.0.iter().position(|(held, _)| held == name) {
            let log = self.0.remove(at);
            self.0.push(log);
            return;
        }
        // The writer of a log has locked it already; one that cannot be opened cannot be read either.
        let Ok(file) = log_path(folder, name).and_then(File::open) else { return };
        if file.try_lock_shared().is_ok() {
            if self.0.len() >= HELD_MAX {
                self.0.remove(0);
            }
            self.0.push((name.to_owned(), file));
        }
    }
}

fn work(folder: &Path, task: &LogTask) -> io::Result<LogOutcome> {
    Ok(match task {
        LogTask::List => LogOutcome::Listed(list(folder)?),
        LogTask::Read { name, offset, length } => {
            LogOutcome::Read(read(folder, name, *offset, *length)?)
        }
        LogTask::Erase => LogOutcome::Erased(erase(folder)?),
    })
}

/// One log in the folder.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Log {
    name: String,
    size: u64,
}

/// The flight logs, sorted by name, that is, by age. A folder that does not exist has none.
fn logs(folder: &Path) -> io::Result<Vec<Log>> {
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let mut logs = Vec::new();
    for entry in entries.take(ENTRIES_MAX) {
        let entry = entry?;
        let Ok(name) = entry.file_name().into_string() else { continue };
        if flight_log_begun(&name).is_none() {
            continue;
        }
        // Metadata of the entry itself: the target of a link is not in this folder. The file may be gone by now.
        match entry.metadata() {
            Ok(data) if data.is_file() => logs.push(Log { name, size: data.len() }),
            _ => {}
        }
    }
    logs.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(logs)
}

fn list(folder: &Path) -> io::Result<Vec<LogFile>> {
    let logs = logs(folder)?;
    let first = logs.len().saturating_sub(LISTED_MAX);
    let entry = |Log { name, size }: Log| {
        let utc_s = flight_log_begun(&name).unwrap_or_default();
        let utc_s = u32::try_from(utc_s).unwrap_or(u32::MAX);
        LogFile { name, size: u32::try_from(size).unwrap_or(u32::MAX), utc_s }
    };
    Ok(logs.into_iter().skip(first).map(entry).collect())
}

fn read(folder: &Path, name: &str, offset: u32, length: usize) -> io::Result<Vec<u8>> {
    let path = log_path(folder, name)?;
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(offset.into()))?;
    let mut bytes = Vec::with_capacity(length.min(READ_MAX));
    file.take(length.min(READ_MAX) as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Path of a flight log, if the name is that of one and it is a regular file.
fn log_path(folder: &Path, name: &str) -> io::Result<PathBuf> {
    let path = folder.join(name);
    let is_log = flight_log_begun(name).is_some() && fs::symlink_metadata(&path)?.is_file();
    if is_log { Ok(path) } else { Err(io::Error::other("not a log")) }
}

fn erase(folder: &Path) -> io::Result<Erased> {
    let mut erased = Erased::default();
    for log in logs(folder)? {
        match remove(folder, &log.name) {
            Ok(true) => erased.removed += 1,
            Ok(false) => erased.in_use += 1,
            Err(error) => {
                debug!(log = log.name, %error, "not erased");
                erased.failed += 1;
            }
        }
    }
    Ok(erased)
}

/// Removes a log that is not being written; false if it is.
fn remove(folder: &Path, name: &str) -> io::Result<bool> {
    let path = log_path(folder, name)?;
    match File::open(&path)?.try_lock() {
        Ok(()) => {}
        Err(fs::TryLockError::WouldBlock) => return Ok(false),
        // A file system without locks: no writer can hold one.
        Err(fs::TryLockError::Error(_)) => {}
    }
    fs::remove_file(path)?;
    Ok(true)
}

#[cfg(test)]
mod tests;
