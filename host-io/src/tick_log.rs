//! Files with one entry per control tick, bit for bit.
//!
//! ```text
//! "2STPTICK"  version u16  kind u16       then for each tick:
//! length u16, bytes (postcard)
//! ```
//!
//! All numbers are little endian. A writer thread takes full buffers, so that a slow disk delays the loop
//! only when `QUEUE_MAX` buffers wait already; simulation time waits too, so nothing is lost.

use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::file;
use crate::problem::{At as _, Problem, problem};

const MAGIC: [u8; 8] = *b"2STPTICK";
const VERSION: u16 = 1;
const HEADER_BYTES: usize = 12;
/// One buffer, bytes: a few hundred ticks.
const BUFFER_BYTES: usize = 256 * 1024;
/// Full buffers that may wait for the disk.
const QUEUE_MAX: usize = 16;
/// Longest entry, bytes.
const ENTRY_MAX: usize = 4096;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum Kind {
    Truth = 1,
    /// The signals of the autopilot's control steps.
    ControlSteps = 2,
}

#[derive(Debug)]
pub struct TickLogWriter {
    path: PathBuf,
    buffer: Vec<u8>,
    full: Option<SyncSender<Vec<u8>>>,
    writer: Option<JoinHandle<io::Result<()>>>,
}

impl TickLogWriter {
    /// Creates the file, or empties an earlier log.
    pub fn create(path: &Path, kind: Kind) -> Result<Self, Problem> {
        let file = file::create(path, |beginning| beginning.starts_with(&MAGIC));
        Self::begin(path, file.at(path.display())?, kind)
    }

    fn begin(path: &Path, mut file: File, kind: Kind) -> Result<Self, Problem> {
        let (full, queue) = sync_channel(QUEUE_MAX);
        let mut buffer = Vec::with_capacity(BUFFER_BYTES);
        buffer.extend_from_slice(&MAGIC);
        buffer.extend_from_slice(&VERSION.to_le_bytes());
        buffer.extend_from_slice(&(kind as u16).to_le_bytes());
        let writer = thread::Builder::new()
            .name("tick log".to_owned())
            .spawn(move || write_all(&mut file, &queue))
            .at(path.display())?;
        Ok(Self { path: path.to_path_buf(), buffer, full: Some(full), writer: Some(writer) })
    }

    pub fn write(&mut self, entry: &impl Serialize) -> Result<(), Problem> {
        if self.full.is_none() {
            return Ok(());
        }
        let mut scratch = [0; ENTRY_MAX];
        let used = match postcard::to_slice(entry, &mut scratch) {
            Ok(used) => used.len(),
            Err(error) => {
                // Nothing is written behind a gap, and the error is reported once.
                self.full = None;
                return Err(error).at(self.path.display());
            }
        };
        // An entry has at most `ENTRY_MAX` bytes.
        let length = u16::try_from(used).unwrap_or(u16::MAX);
        self.buffer.extend_from_slice(&length.to_le_bytes());
        self.buffer.extend_from_slice(&scratch[..used]);
        // The longest entry still fits, so the buffer never grows.
        if self.buffer.len() + ENTRY_MAX + 2 > BUFFER_BYTES {
            let buffer = std::mem::replace(&mut self.buffer, Vec::with_capacity(BUFFER_BYTES));
            let accepted = self.full.as_ref().is_some_and(|full| full.send(buffer).is_ok());
            if !accepted {
                return Err(self.finish_writer().err().unwrap_or_else(|| self.stopped()));
            }
        }
        Ok(())
    }

    /// Writes the rest and closes the file.
    pub fn finish(mut self) -> Result<(), Problem> {
        if let Some(full) = &self.full {
            // If the writer has ended, the join below returns its error.
            let _ = full.send(std::mem::take(&mut self.buffer));
        }
        self.finish_writer()
    }

    fn finish_writer(&mut self) -> Result<(), Problem> {
        self.full = None;
        match self.writer.take().map(JoinHandle::join) {
            None | Some(Ok(Ok(()))) => Ok(()),
            Some(Ok(failed)) => failed.at(self.path.display()),
            Some(Err(_)) => Err(self.stopped()),
        }
    }

    fn stopped(&self) -> Problem {
        problem!("{}: the writer thread has ended", self.path.display())
    }
}

fn write_all(file: &mut File, queue: &Receiver<Vec<u8>>) -> io::Result<()> {
    while let Ok(buffer) = queue.recv() {
        file.write_all(&buffer)?;
    }
    file.flush()
}

#[derive(Debug)]
pub struct TickLogReader {
    path: PathBuf,
    file: io::BufReader<File>,
    number: u64,
}

impl TickLogReader {
    /// Opens a log of this kind.
    pub fn open(path: &Path, kind: Kind) -> Result<Self, Problem> {
        let file = file::open(path).at(path.display())?;
        let mut file = io::BufReader::with_capacity(BUFFER_BYTES, file);
        let mut header = [0; HEADER_BYTES];
        file.read_exact(&mut header).at(path.display())?;
        let word = |at: usize| u16::from_le_bytes([header[at], header[at + 1]]);
        if header[..8] != MAGIC || word(8) != VERSION || word(10) != kind as u16 {
            return Err(problem!("{}: not a version {VERSION} log of {kind:?}", path.display()));
        }
        Ok(Self { path: path.to_path_buf(), file, number: 0 })
    }

    /// Next entry; `None` at the end.
    pub fn next_entry<T: DeserializeOwned>(&mut self) -> Result<Option<T>, Problem> {
        let mut length = [0; 2];
        // The end of the file is an end only between two entries.
        if self.file.read(&mut length[..1]).at(self.path.display())? == 0 {
            return Ok(None);
        }
        let (path, number) = (&self.path, self.number);
        let damaged = problem!("{}: entry {number} is damaged", path.display());
        let entry = self.read_entry(&mut length).ok_or(damaged)?;
        self.number += 1;
        Ok(Some(entry))
    }

    fn read_entry<T: DeserializeOwned>(&mut self, length: &mut [u8; 2]) -> Option<T> {
        self.file.read_exact(&mut length[1..]).ok()?;
        let mut scratch = [0; ENTRY_MAX];
        let bytes = scratch.get_mut(..usize::from(u16::from_le_bytes(*length)))?;
        self.file.read_exact(bytes).ok()?;
        postcard::from_bytes(bytes).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(path: &Path, ticks: u64) {
        let mut log = TickLogWriter::create(path, Kind::Truth).unwrap();
        for tick in 0..ticks {
            log.write(&(tick, 0.1 * tick as f64)).unwrap();
        }
        log.finish().unwrap();
    }

    #[test]
    fn a_written_log_reads_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        // More than one buffer.
        write(&path, 100_000);
        let mut log = TickLogReader::open(&path, Kind::Truth).unwrap();
        for tick in 0..100_000 {
            let entry: (u64, f64) = log.next_entry().unwrap().unwrap();
            assert_eq!((entry.0, entry.1.to_bits()), (tick, (0.1 * tick as f64).to_bits()));
        }
        assert_eq!(log.next_entry::<(u64, f64)>().unwrap(), None);
    }

    #[test]
    fn a_cut_log_and_a_log_of_another_kind_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        write(&path, 3);
        let error = TickLogReader::open(&path, Kind::ControlSteps).unwrap_err().to_string();
        assert!(error.ends_with("log: not a version 1 log of ControlSteps"), "{error}");
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        let mut log = TickLogReader::open(&path, Kind::Truth).unwrap();
        log.next_entry::<(u64, f64)>().unwrap().unwrap();
        log.next_entry::<(u64, f64)>().unwrap().unwrap();
        let error = log.next_entry::<(u64, f64)>().unwrap_err().to_string();
        assert!(error.contains("entry 2 is damaged"), "{error}");
    }

    #[test]
    fn a_file_that_cannot_be_written_is_named() {
        let error = TickLogWriter::create(Path::new("/nowhere/log"), Kind::Truth).unwrap_err();
        assert!(error.to_string().starts_with("/nowhere/log: "), "{error}");
        // Always full: every write fails.
        let full = Path::new("/dev/full");
        let file = File::options().write(true).open(full).unwrap();
        let mut log = TickLogWriter::begin(full, file, Kind::Truth).unwrap();
        log.write(&1_u8).unwrap();
        assert!(log.finish().unwrap_err().to_string().starts_with("/dev/full: "));
    }
}
