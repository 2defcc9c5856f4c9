//! The log thread: one log after the other, each a file of whole messages that are written in large pieces.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::time::Instant;

use host_io::clock;
use tracing::{debug, info, warn};
use ulog::writer::Level;

use super::{FLUSH_EVERY, RecorderConfig, SETTLE_AFTER, folder};
use crate::io::tlog;
use ::recorder::{Begin, Encoder, End, Entry};
use flight_management::parameters::Parameters;

/// One piece of a file, bytes.
const BUFFER_BYTES: usize = 256 * 1024;
/// Old logs are removed each time a log has grown by this fraction of the limit.
const LOOKS: u64 = 16;

/// State of the log thread.
pub struct LogThread {
    config: RecorderConfig,
    changes: Receiver<Parameters>,
    log: Option<OpenLog>,
    /// Lock of the log that ended last; a new flight releases it.
    finished: Option<File>,
    flushed: Instant,
    /// Set for the control thread when a log was removed.
    removed: Arc<AtomicBool>,
    /// Time of the last control step.
    stepped: Instant,
}

struct OpenLog {
    encoder: Encoder<LogFile>,
    /// The lock of its file beyond its end.
    lock: Option<File>,
    path: PathBuf,
    /// Size at which old logs are removed next, bytes.
    look_at: u64,
}

impl LogThread {
    pub fn new(
        config: RecorderConfig,
        changes: Receiver<Parameters>,
        removed: Arc<AtomicBool>,
    ) -> Self {
        let now = clock::now();
        Self { config, changes, log: None, finished: None, flushed: now, stepped: now, removed }
    }

    /// Writes until the control thread ends. Gives the lock of the last log: until it is dropped, nobody erases that log.
    pub fn run(
        mut self,
        batches: &Receiver<Vec<Entry>>,
        recycle: &SyncSender<Vec<Entry>>,
    ) -> Option<File> {
        loop {
            match batches.recv_timeout(FLUSH_EVERY) {
                Ok(mut batch) => {
                    if batch.iter().any(|entry| matches!(entry, Entry::Step(_))) {
                        self.stepped = clock::now();
                    }
                    for entry in batch.drain(..) {
                        self.take(entry);
                    }
                    // The control thread has ended and does not need it back.
                    let _ = recycle.try_send(batch);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.take_parameters();
            self.poll();
        }
        self.end(End::Stopped);
        self.finished
    }

    fn take(&mut self, entry: Entry) {
        match entry {
            Entry::Begin(begin) => {
                self.end(End::Restart);
                self.finished = None;
                self.begin(*begin);
            }
            Entry::End(why) => self.end(why),
            entry => self.write(|encoder| encoder.add(entry)),
        }
    }

    fn take_parameters(&mut self) {
        while let Ok(now) = self.changes.try_recv() {
            self.config.parameters = now;
            self.write(|encoder| encoder.add(Entry::Parameters(Box::new(now))));
        }
    }

    fn begin(&mut self, begin: Begin) {
        let RecorderConfig { folder, limit_bytes, rate, parameters, .. } = &self.config;
        if let Err(problem) = std::fs::create_dir_all(folder) {
            // If the file cannot be created either, the result is the same.
            debug!(%problem, "the folder of the logs cannot be made again");
        }
        folder::make_room(folder, *limit_bytes);
        let path = folder.join(folder::name(clock::utc_seconds(), &begin.header.session));
        let log = LogFile::create(&path).and_then(|file| {
            let lock = file.file.try_clone().ok();
            let mut encoder = Encoder::begin(file, begin, parameters, *rate)?;
            encoder.flush()?;
            Ok((encoder, lock))
        });
        match log {
            Ok((encoder, lock)) => {
                match &self.config.status {
                    Some(status) => status.log(&path),
                    None => info!(log = %path.display(), "flight log"),
                }
                self.log = Some(OpenLog { encoder, lock, path, look_at: limit_bytes / LOOKS });
            }
            Err(problem) => {
                warn!(%problem, log = %path.display(), "there is no log of this flight");
            }
        }
    }

    /// Applies an operation to the log; if it fails, the log ends.
    fn write(&mut self, what: impl FnOnce(&mut Encoder<LogFile>) -> io::Result<()>) {
        let Some(log) = self.log.as_mut() else { return };
        if let Err(problem) = what(&mut log.encoder) {
            warn!(%problem, log = %log.path.display(), "the flight log ends here");
            // As far as there is room for it.
            let text = format!("The log ends here: {problem}");
            let _ = log.encoder.text(Level::Error, &text).and_then(|()| log.encoder.flush());
            self.log = None;
        }
    }

    fn poll(&mut self) {
        let now = clock::now();
        if now - self.flushed >= FLUSH_EVERY {
            self.flushed = now;
            if now - self.stepped >= SETTLE_AFTER {
                self.write(Encoder::settle);
            }
            self.write(|encoder| encoder.sync().and_then(|()| encoder.flush()));
            self.look_for_the_file();
        }
        let limit = self.config.limit_bytes;
        let Some(log) = self.log.as_mut() else { return };
        let written = log.encoder.written();
        // The log of traffic has its share besides it.
        if written >= limit - tlog::share(limit) {
            let path = log.path.display();
            warn!(log = %path, "the flight log has reached its limit and ends; see --log-limit-mb");
            self.end(End::Full);
            // The flight goes on without it.
            self.finished = None;
        } else if written >= log.look_at {
            log.look_at = written + limit / LOOKS;
            folder::make_room(&self.config.folder, limit);
        }
    }

    /// Data written to a file that has lost its name are lost at the end of the process.
    fn look_for_the_file(&mut self) {
        let is_gone = |log: &OpenLog| std::fs::symlink_metadata(&log.path).is_err();
        if let Some(log) = self.log.take_if(|log| is_gone(log)) {
            let path = log.path.display();
            warn!(log = %path, "the flight log was removed; recording ends here and begins again with the next flight");
            self.removed.store(true, Ordering::Relaxed);
        }
    }

    fn end(&mut self, why: End) {
        let Some(OpenLog { encoder, path, lock, .. }) = self.log.take() else { return };
        if let Err(problem) = encoder.end(why) {
            warn!(%problem, log = %path.display(), "the flight log has no proper end");
        }
        self.finished = lock;
    }
}

/// A log file. Each call of [`Write::write`] is one message; a piece ends between two messages, so that a piece without
/// room can be removed again.
#[derive(Debug)]
struct LogFile {
    file: File,
    buffer: Vec<u8>,
    /// Bytes of the file that are whole messages.
    whole: u64,
}

impl LogFile {
    /// Creates a new file and locks it: a locked log is not removed.
    fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().write(true).create_new(true).open(path)?;
        // A file system without locks only loses the protection from being removed.
        let _ = file.try_lock();
        Ok(Self { file, buffer: Vec::with_capacity(BUFFER_BYTES), whole: 0 })
    }

    fn pass_on(&mut self) -> io::Result<()> {
        let result = self.file.write_all(&self.buffer);
        match result {
            Ok(()) => self.whole += self.buffer.len() as u64,
            Err(_) => {
                // As far as the system allows: the file ends with a whole message.
                let _ = self.file.set_len(self.whole);
                let _ = self.file.seek(SeekFrom::Start(self.whole));
            }
        }
        self.buffer.clear();
        result
    }
}

impl Write for LogFile {
    fn write(&mut self, message: &[u8]) -> io::Result<usize> {
        if self.buffer.len() + message.len() > BUFFER_BYTES {
            self.pass_on()?;
        }
        self.buffer.extend_from_slice(message);
        Ok(message.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.buffer.is_empty() { Ok(()) } else { self.pass_on() }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::sync_channel;

    use ::recorder::{ControlHeader, LogRate};
    use flight_management::autopilot::Settings;
    use flight_management::configuration;
    use flight_management::vehicle::schedule::ReferenceSchedule;
    use icd::SimTime;

    use super::*;

    #[test]
    fn messages_arrive_in_order_and_a_file_is_not_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log");
        let mut file = LogFile::create(&path).unwrap();
        let message = [7; 1000];
        for _ in 0..1000 {
            file.write_all(&message).unwrap();
        }
        file.write_all(b"end").unwrap();
        file.flush().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(bytes.len(), 1_000_003);
        assert_eq!(&bytes[1_000_000..], b"end");
        assert_eq!(LogFile::create(&path).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
    }

    #[test]
    fn a_finished_log_keeps_its_lock_until_the_process_has_ended() {
        let model = configuration::model("tvc_jet.toml", configuration::DEFAULT_MODEL).unwrap();
        let Parameters { gains, limits, navigation, .. } = model.defaults;
        let begin = |session: &str| {
            let settings = Settings {
                model: model.aircraft,
                gains,
                limits,
                navigation,
                references: ReferenceSchedule::default(),
                script: None,
                own_law: None,
                fault_injection: false,
            };
            let header = ControlHeader::new(settings, session.to_owned(), 2_000, false);
            Entry::Begin(Box::new(Begin { time: SimTime::ZERO, header }))
        };
        let folder = tempfile::tempdir().unwrap();
        let (_changes, changes) = sync_channel(1);
        let config = RecorderConfig {
            folder: folder.path().to_path_buf(),
            limit_bytes: 1_000_000,
            rate: LogRate::Full,
            parameters: model.defaults,
            status: None,
        };
        let (batches, theirs) = sync_channel(1);
        let (recycle, _empty) = sync_channel(1);
        batches.send(vec![begin("00000001"), begin("00000002"), Entry::End(End::Stopped)]).unwrap();
        drop(batches);
        let lock = LogThread::new(config, changes, Arc::default()).run(&theirs, &recycle);
        let is_free = |session: &str| {
            let logs = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
            let log = logs.into_iter().find(|path| path.to_str().unwrap().contains(session));
            File::open(log.unwrap()).unwrap().try_lock().is_ok()
        };
        // The log of an earlier flight may be erased.
        assert!(is_free("00000001") && !is_free("00000002"));
        drop(lock);
        assert!(is_free("00000002"));
    }

    #[test]
    fn a_full_disk_is_an_error_that_leaves_the_output_usable() {
        let file = OpenOptions::new().write(true).open("/dev/full").unwrap();
        let mut log = LogFile { file, buffer: Vec::new(), whole: 0 };
        log.write_all(b"message").unwrap();
        assert_eq!(log.flush().unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert!(log.buffer.is_empty());
        assert!(log.flush().is_ok());
    }
}
