//! The folder of the logs: their names and times of beginning, room for new ones, a thread for ground stations that list,
//! fetch and erase flight logs, and one that writes all MAVLink traffic of the process into a file that ground-station tools read
//! (`.tlog`).
//!
//! The first thread does the work for which the disk may take long: one job at a time, each of it bounded. The writer of a
//! log holds the lock of its file, so that no one removes it meanwhile, not even another process
//! with the same folder. Only regular files with names of flight logs are touched.
//!
//! In the log of traffic each frame follows eight bytes: microseconds since 1970, big-endian. Frames of all ground stations
//! are in it in order of reception and transmission; frames without room are left out and counted.

use core::time::Duration;
use std::fs::{self, File};
use std::io::{self, BufWriter, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use tokio::sync::mpsc;
use tracing::{debug, info, warn};

use super::join;
use crate::clock::WallTime;
use mavlink_services::logs::{Erased, LogDone, LogFile, LogJob, LogOutcome, LogTask};

/// Extensions of the files that count towards the limit and may be removed.
const ENDINGS: [&str; 2] = ["ulg", "tlog"];
/// Characters of `yyyymmdd-hhmmss`.
const STAMP: usize = 15;

/// Creates the folder if needed, and writes to it once.
pub fn prepare(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let probe = folder.join(format!(".two-step-{}", process::id()));
    File::create(&probe)?;
    fs::remove_file(probe)
}

/// Name of a log: UTC time of its beginning and the short form of the flight's session.
pub fn log_name(utc_s: u64, session: &str) -> String {
    format!("{}-{session}.ulg", stamp(utc_s))
}

/// `yyyymmdd-hhmmss`, UTC, of a time in seconds since 1970.
pub fn stamp(utc_s: u64) -> String {
    let (days, second) = (utc_s / 86_400, utc_s % 86_400);
    // Days from 1 March 0000, in eras of 400 years (Gregorian calendar).
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let year = era * 400 + year + next;
    let (hour, minute) = (second / 3_600, second / 60 % 60);
    format!("{year:04}{month:02}{day:02}-{hour:02}{minute:02}{:02}", second % 60)
}

/// Time at which a log with this name was begun, seconds since 1970, UTC; `None` if it is not the name of a flight
/// log: `yyyymmdd-hhmmss-<hash of the session, 8 hex digits>.ulg`.
pub fn flight_log_begun(name: &str) -> Option<u64> {
    let (stamp, rest) = name.split_at_checked(STAMP)?;
    let session = rest.strip_prefix('-')?.strip_suffix(".ulg")?;
    let is_hex = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
    let is_session = session.len() == 8 && session.bytes().all(is_hex);
    if is_session { begun(stamp) } else { None }
}

fn begun(stamp: &str) -> Option<u64> {
    let digits = |from: usize, to: usize| -> Option<u64> {
        let text = stamp.get(from..to)?;
        text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
    };
    if stamp.len() != STAMP || stamp.get(8..9) != Some("-") {
        return None;
    }
    let (year, month, day) = (digits(0, 4)?, digits(4, 6)?, digits(6, 8)?);
    let (hour, minute, second) = (digits(9, 11)?, digits(11, 13)?, digits(13, 15)?);
    // Days from 1 March 0000, as in `stamp`, whose result is the same only for a date and a time that exist.
    let (year, month) =
        if month > 2 { (year, month - 3) } else { (year.checked_sub(1)?, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day;
    let days = days.checked_sub(719_469)?;
    let utc_s = days * 86_400 + hour * 3_600 + minute * 60 + second;
    (self::stamp(utc_s) == stamp).then_some(utc_s)
}

/// Removes the oldest logs until they have at most `limit` bytes together. It keeps logs that are being written, and
/// files whose names are not those of logs.
pub fn make_room(folder: &Path, limit: u64) {
    let logs = match logs(folder, usize::MAX, is_log) {
        Ok(logs) => logs,
        Err(problem) => {
            warn!(%problem, folder = %folder.display(), "old flight logs cannot be looked at");
            return;
        }
    };
    let mut all: u64 = logs.iter().map(|log| log.size).sum();
    for FolderLog { name, size } in logs {
        if all <= limit {
            return;
        }
        let path = folder.join(&name);
        if File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
            match fs::remove_file(&path) {
                Ok(()) => {
                    all -= size;
                    info!(log = name, "removed the oldest flight log to make room");
                }
                Err(problem) => warn!(%problem, log = name, "cannot remove an old flight log"),
            }
        }
    }
}

/// `yyyymmdd-hhmmss`, then anything, then one of the extensions.
fn is_log(name: &str) -> bool {
    let Some((stem, ending)) = name.rsplit_once('.') else { return false };
    let stamp = stem.as_bytes().get(..STAMP).unwrap_or_default();
    let is_stamp = stamp.len() == STAMP
        && stamp.iter().enumerate().all(|(at, byte)| match at {
            8 => *byte == b'-',
            _ => byte.is_ascii_digit(),
        });
    is_stamp && ENDINGS.contains(&ending)
}

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
            let mut held = HeldLog::default();
            while let Some(LogJob { number, task }) = held.next_job(&theirs, HOLD) {
                held.prepare(&folder, &task);
                let result = match &task {
                    LogTask::List => list(&folder).map(LogOutcome::Listed),
                    LogTask::Read { name, offset, length } => {
                        read(&folder, name, *offset, *length).map(LogOutcome::Read)
                    }
                    LogTask::Erase => erase(&folder).map(LogOutcome::Erased),
                };
                let result = result.map_err(|error| error.to_string());
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
        join(self.reader.take(), "reader of the log folder");
    }
}

/// Logs being fetched, the latest last. Their locks keep them from being removed to make room.
#[derive(Debug, Default)]
struct HeldLog(Vec<(String, File)>);

impl HeldLog {
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

/// One log in the folder.
#[derive(Debug, Clone, PartialEq, Eq)]
struct FolderLog {
    name: String,
    size: u64,
}

/// The files whose names `is_log` accepts among so many entries of the folder, sorted by name, that is, by age.
fn logs(folder: &Path, most: usize, is_log: impl Fn(&str) -> bool) -> io::Result<Vec<FolderLog>> {
    let mut logs = Vec::new();
    for entry in fs::read_dir(folder)?.take(most) {
        let entry = entry?;
        let Ok(name) = entry.file_name().into_string() else { continue };
        if !is_log(&name) {
            continue;
        }
        // Metadata of the entry itself: the target of a link is not in this folder. The file may be gone by now.
        match entry.metadata() {
            Ok(data) if data.is_file() => logs.push(FolderLog { name, size: data.len() }),
            _ => {}
        }
    }
    logs.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(logs)
}

/// The flight logs. A folder that does not exist has none.
fn flight_logs(folder: &Path) -> io::Result<Vec<FolderLog>> {
    match logs(folder, ENTRIES_MAX, |name| flight_log_begun(name).is_some()) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        logs => logs,
    }
}

fn list(folder: &Path) -> io::Result<Vec<LogFile>> {
    let logs = flight_logs(folder)?;
    let first = logs.len().saturating_sub(LISTED_MAX);
    let entry = |FolderLog { name, size }: FolderLog| {
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
    for log in flight_logs(folder)? {
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

/// Frames that may wait for the disk: more than half a second of a download.
const FRAMES_MAX: usize = 8192;
/// Longest time until a written frame is in the file.
const FLUSH: Duration = Duration::from_millis(500);
/// Fraction of the limit of all logs for the traffic of one process.
const SHARE: u64 = 8;
/// Names that are tried: another process may have begun in the same second.
const NAMES_MAX: u64 = 60;

/// Size limit of the log of traffic where all logs together may have `limit_bytes`.
pub const fn share(limit_bytes: u64) -> u64 {
    limit_bytes / SHARE
}

/// A frame and its time of reception or transmission.
type Entry = (WallTime, Vec<u8>);

/// Writes traffic. Dropping it waits until everything is written.
#[derive(Debug)]
pub struct Tlog {
    entries: Option<SyncSender<Entry>>,
    writer: Option<JoinHandle<()>>,
    dropped: u64,
}

impl Tlog {
    /// Begins a file in the folder. It ends when it has `limit_bytes`; `unix_start_us` is the time at
    /// [`WallTime::ZERO`], microseconds since 1970.
    pub fn open(folder: &Path, unix_start_us: u64, limit_bytes: u64) -> io::Result<Self> {
        let (path, file) = create(folder, unix_start_us / 1_000_000)?;
        let (entries, theirs) = sync_channel(FRAMES_MAX);
        let writer =
            TrafficWriter { path, out: BufWriter::new(file), unix_start_us, left: limit_bytes };
        let write = move || writer.run(&theirs);
        let writer = thread::Builder::new().name("traffic log".to_owned()).spawn(write)?;
        Ok(Self { entries: Some(entries), writer: Some(writer), dropped: 0 })
    }

    /// Writes one frame. Never waits.
    pub fn record(&mut self, at: WallTime, frame: Vec<u8>) {
        let Some(entries) = self.entries.as_ref() else { return };
        match entries.try_send((at, frame)) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) => self.left_out(1),
            // The writer has ended, and has logged why.
            Err(TrySendError::Disconnected(_)) => self.entries = None,
        }
    }

    /// Counts frames dropped for lack of room.
    pub fn left_out(&mut self, frames: u64) {
        if self.dropped == 0 && frames > 0 {
            warn!("the disk cannot keep up with the traffic log: frames are left out");
        }
        self.dropped += frames;
    }
}

impl Drop for Tlog {
    fn drop(&mut self) {
        self.entries = None;
        if self.dropped > 0 {
            warn!(frames = self.dropped, "frames that the traffic log does not have");
        }
        join(self.writer.take(), "writer of the traffic log");
    }
}

/// A new file with the time as its name, which is not removed while it is open.
fn create(folder: &Path, utc_s: u64) -> io::Result<(PathBuf, File)> {
    fs::create_dir_all(folder)?;
    let mut second = 0;
    loop {
        let path = folder.join(format!("{}.tlog", stamp(utc_s + second)));
        match File::create_new(&path) {
            Ok(file) => {
                // A file system without locks only loses the protection from being removed.
                let _ = file.try_lock();
                return Ok((path, file));
            }
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && second < NAMES_MAX => {
                second += 1;
            }
            Err(error) => return Err(error),
        }
    }
}

struct TrafficWriter {
    path: PathBuf,
    out: BufWriter<File>,
    unix_start_us: u64,
    /// Bytes left for the file.
    left: u64,
}

impl TrafficWriter {
    fn run(mut self, entries: &Receiver<Entry>) {
        if let Err(error) = self.write_all(entries) {
            warn!(file = %self.path.display(), %error, "the traffic log ends");
        }
    }

    fn write_all(&mut self, entries: &Receiver<Entry>) -> io::Result<()> {
        let mut flushed = WallTime::ZERO;
        loop {
            match entries.recv_timeout(FLUSH) {
                Ok(entry) => {
                    let at = entry.0;
                    if !self.write(&entry)? {
                        let file = self.path.display();
                        warn!(%file, "the traffic log has its eighth of --log-limit-mb and ends");
                        return self.out.flush();
                    }
                    if at.since(flushed) < FLUSH {
                        continue;
                    }
                    flushed = at;
                    self.out.flush()?;
                }
                Err(RecvTimeoutError::Timeout) => self.out.flush()?,
                Err(RecvTimeoutError::Disconnected) => return self.out.flush(),
            }
        }
    }

    /// False if there is no room for it.
    fn write(&mut self, (at, frame): &Entry) -> io::Result<bool> {
        let utc_us = self.unix_start_us.saturating_add(at.as_micros());
        let length = 8 + frame.len() as u64;
        let Some(left) = self.left.checked_sub(length) else { return Ok(false) };
        self.left = left;
        self.out.write_all(&utc_us.to_be_bytes())?;
        self.out.write_all(frame)?;
        Ok(true)
    }
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod name_tests {
    use super::*;

    #[test]
    fn names_have_the_time_and_the_number_of_the_flight() {
        assert_eq!(stamp(0), "19700101-000000");
        assert_eq!(stamp(951_782_399), "20000228-235959");
        assert_eq!(stamp(951_782_400), "20000229-000000");
        assert_eq!(stamp(1_735_689_599), "20241231-235959");
        assert_eq!(stamp(4_107_542_400), "21000301-000000");
        assert_eq!(log_name(0, "000000ab"), "19700101-000000-000000ab.ulg");
        assert!(is_log(&log_name(0, "00000001")) && is_log("19700101-000000.tlog"));
    }

    #[test]
    fn the_oldest_logs_go_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["notes.txt", "diary.ulg", "19700101-000000.tlog"];
        let flights = [1, 2, 3, 4].map(|utc_s| log_name(utc_s, "0000000a"));
        for name in names.iter().copied().chain(flights.iter().map(String::as_str)) {
            fs::write(folder.path().join(name), [0; 100]).unwrap();
        }
        // The second one is being written.
        let open = File::open(folder.path().join(&flights[1])).unwrap();
        open.lock().unwrap();
        make_room(folder.path(), 250);
        let mut left: Vec<String> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        left.sort();
        let expected = [&flights[1], &flights[3], "diary.ulg", "notes.txt"];
        assert_eq!(left, expected);
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(prepare(&file.join("logs")).is_err());
        prepare(&folder.path().join("a/b")).unwrap();
        assert_eq!(fs::read_dir(folder.path().join("a/b")).unwrap().count(), 0);
    }

    #[test]
    fn a_name_leads_back_to_its_second() {
        for utc_s in (0..4_102_444_800).step_by(86_400 * 3 + 4321) {
            assert_eq!(flight_log_begun(&log_name(utc_s, "0000000a")), Some(utc_s));
        }
    }

    #[test]
    fn only_names_that_the_program_gives_are_names_of_logs() {
        let good = "20261121-081257-0123abcf.ulg";
        assert_eq!(flight_log_begun(good), Some(1_795_248_777));
        for bad in [
            "",
            "notes.ulg",
            "20261121-081257.ulg",
            "20261121-081257-0123abcg.ulg",
            "20261121-081257-0123abcf.ulg.bak",
            "20261321-081257-0123abcf.ulg",
            "20260229-081257-0123abcf.ulg",
            "20261121-246057-0123abcf.ulg",
            "+0261121-081257-0123abcf.ulg",
            "../261121-081257-0123abcf.ulg",
            "ä0261121-08125-0123abcf.ulg",
            "20261121-081257.tlog",
        ] {
            assert_eq!(flight_log_begun(bad), None, "{bad}");
        }
    }
}

#[cfg(test)]
mod traffic_tests {
    use super::*;

    const START_US: u64 = 1_795_248_777_000_000;

    fn at(us: u64) -> WallTime {
        WallTime::from_micros(us)
    }

    #[test]
    fn each_frame_stands_behind_its_time_and_the_file_has_the_name_of_its_first_second() {
        let folder = tempfile::tempdir().unwrap();
        let mut tlog = Tlog::open(folder.path(), START_US, 1000).unwrap();
        tlog.record(at(5), b"in".to_vec());
        tlog.record(at(1_000_000), b"out".to_vec());
        drop(tlog);
        let mut expected = (START_US + 5).to_be_bytes().to_vec();
        expected.extend_from_slice(b"in");
        expected.extend_from_slice(&(START_US + 1_000_000).to_be_bytes());
        expected.extend_from_slice(b"out");
        assert_eq!(fs::read(folder.path().join("20261121-081257.tlog")).unwrap(), expected);
    }

    #[test]
    fn two_in_one_second_have_two_files_and_a_full_one_ends_whole() {
        let folder = tempfile::tempdir().unwrap();
        let first = Tlog::open(folder.path(), START_US, 1000).unwrap();
        let mut second = Tlog::open(folder.path(), START_US, 25).unwrap();
        for us in 0..100 {
            second.record(at(us), b"abcd".to_vec());
        }
        drop((first, second));
        let length = |name| fs::metadata(folder.path().join(name)).unwrap().len();
        assert_eq!(length("20261121-081257.tlog"), 0);
        assert_eq!(length("20261121-081258.tlog"), 24);
    }

    #[test]
    fn recorded_frames_are_in_the_file_soon_while_recording_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let mut tlog = Tlog::open(folder.path(), START_US, 1000).unwrap();
        tlog.record(at(0), b"frame".to_vec());
        let path = folder.path().join("20261121-081257.tlog");
        let (_kept, silence) = sync_channel::<()>(0);
        let is_there = (0..50).any(|_| {
            let length = fs::metadata(&path).unwrap().len();
            assert_eq!(silence.recv_timeout(FLUSH / 5), Err(RecvTimeoutError::Timeout));
            length == 13
        });
        assert!(is_there);
        drop(tlog);
    }
}
