//! The log thread: one log after the other.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender};
use std::time::Instant;

use host_io::clock;
use tracing::{debug, info, warn};
use ulog::writer::Level;

use super::file::LogFile;
use super::{FLUSH_EVERY, RecorderConfig, SETTLE_AFTER, folder};
use crate::io::tlog;
use ::recorder::{Begin, Encoder, End, Entry};
use flight_management::parameters::Parameters;

/// Old logs are looked after each time a log has grown by this part of the limit.
const LOOKS: u64 = 16;

/// What the log thread owns.
pub struct LogThread {
    config: RecorderConfig,
    changes: Receiver<Parameters>,
    log: Option<OpenLog>,
    flushed: Instant,
    /// Tells the control thread of a log that was removed.
    removed: Arc<AtomicBool>,
    /// When the last control step came.
    stepped: Instant,
}

struct OpenLog {
    encoder: Encoder<LogFile>,
    path: PathBuf,
    /// Size at which old logs are looked after again, bytes.
    look_at: u64,
}

impl LogThread {
    pub fn new(
        config: RecorderConfig,
        changes: Receiver<Parameters>,
        removed: Arc<AtomicBool>,
    ) -> Self {
        let now = clock::now();
        Self { config, changes, log: None, flushed: now, stepped: now, removed }
    }

    /// Writes until the control thread ends.
    pub fn run(mut self, batches: &Receiver<Vec<Entry>>, recycle: &SyncSender<Vec<Entry>>) {
        loop {
            match batches.recv_timeout(FLUSH_EVERY) {
                Ok(mut batch) => {
                    if batch.iter().any(|entry| matches!(entry, Entry::Step(_))) {
                        self.stepped = clock::now();
                    }
                    for entry in batch.drain(..) {
                        self.take(entry);
                    }
                    // Where nobody wants it back, it goes.
                    let _ = recycle.try_send(batch);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.take_parameters();
            self.poll();
        }
        self.end(End::Stopped);
    }

    fn take(&mut self, entry: Entry) {
        match entry {
            Entry::Begin(begin) => {
                self.end(End::Restart);
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
            // The file cannot be made either, which says the same.
            debug!(%problem, "the folder of the logs cannot be made again");
        }
        folder::make_room(folder, *limit_bytes);
        let path = folder.join(folder::name(clock::utc_seconds(), &begin.header.session));
        let encoder = LogFile::create(&path)
            .and_then(|file| Encoder::begin(file, begin, parameters, *rate))
            .and_then(|mut encoder| encoder.flush().map(|()| encoder));
        match encoder {
            Ok(encoder) => {
                match &self.config.status {
                    Some(status) => status.log(&path),
                    None => info!(log = %path.display(), "flight log"),
                }
                self.log = Some(OpenLog { encoder, path, look_at: limit_bytes / LOOKS });
            }
            Err(problem) => {
                warn!(%problem, log = %path.display(), "there is no log of this flight");
            }
        }
    }

    /// Does something to the log; where that fails, the log is over.
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
        // The log of traffic has its share beside it.
        if written >= limit - tlog::share(limit) {
            let path = log.path.display();
            warn!(log = %path, "the flight log has reached its limit and ends; see --log-limit-mb");
            self.end(End::Full);
        } else if written >= log.look_at {
            log.look_at = written + limit / LOOKS;
            folder::make_room(&self.config.folder, limit);
        }
    }

    /// What is written to a file that has lost its name is lost with the end of the process.
    fn look_for_the_file(&mut self) {
        let is_gone = |log: &OpenLog| std::fs::symlink_metadata(&log.path).is_err();
        if let Some(log) = self.log.take_if(|log| is_gone(log)) {
            let path = log.path.display();
            warn!(log = %path, "the flight log was removed; recording ends here and begins again with the next flight");
            self.removed.store(true, Ordering::Relaxed);
        }
    }

    fn end(&mut self, why: End) {
        if let Some(OpenLog { encoder, path, .. }) = self.log.take()
            && let Err(problem) = encoder.end(why)
        {
            warn!(%problem, log = %path.display(), "the flight log has no proper end");
        }
    }
}
