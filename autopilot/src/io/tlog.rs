//! All MAVLink traffic of the process in a file that ground-station tools read (`.tlog`).
//!
//! Each frame follows eight bytes: microseconds since 1970, big-endian. Frames of all ground stations
//! are in it in order of reception and transmission. Its own thread writes; frames without room are left out and counted.

use core::time::Duration;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::{self, JoinHandle};

use tracing::warn;

use super::log_folder::stamp;
use crate::clock::WallTime;

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
#[derive(Debug)]
struct Entry {
    at: WallTime,
    frame: Vec<u8>,
}

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
        let writer = Writer { path, out: BufWriter::new(file), unix_start_us, left: limit_bytes };
        let write = move || writer.run(&theirs);
        let writer = thread::Builder::new().name("traffic log".to_owned()).spawn(write)?;
        Ok(Self { entries: Some(entries), writer: Some(writer), dropped: 0 })
    }

    /// Writes one frame. Never waits.
    pub fn record(&mut self, at: WallTime, frame: Vec<u8>) {
        let Some(entries) = self.entries.as_ref() else { return };
        match entries.try_send(Entry { at, frame }) {
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
        if let Some(writer) = self.writer.take()
            && writer.join().is_err()
        {
            warn!("the writer of the traffic log has broken down");
        }
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

struct Writer {
    path: PathBuf,
    out: BufWriter<File>,
    unix_start_us: u64,
    /// Bytes left for the file.
    left: u64,
}

impl Writer {
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
                    let at = entry.at;
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
    fn write(&mut self, Entry { at, frame }: &Entry) -> io::Result<bool> {
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
mod tests {
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
