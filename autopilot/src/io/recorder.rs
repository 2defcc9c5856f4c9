//! Flight logs: the control thread passes entries in batches, and a separate thread writes them.
//!
//! ```text
//! control thread                                   log thread                        folder
//!   batch of entries ── 16 batches at most ──────>   Encoder ── 256 KiB or 0.1 s ──> 20260102-030405-<session>.ulg
//!   empty batches   <──────────────────────────────
//! ground stations ── parameters, 16 at most ─────>
//!   └ texts, 64 at most ──> control thread
//! ```
//!
//! The control thread passes a batch after it has sent its answer, and waits only when all batches are in
//! use, which means that the disk cannot keep up; simulation time waits with it. A log that cannot continue ends with a
//! text, and the flight continues. Entries reach the operating system at least every [`FLUSH_EVERY`], except for the
//! half second of simulation time that the encoder holds back ([`::recorder::Selection`]), so a
//! process that is killed leaves a log up to its last second.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use host_io::problem::{At as _, Problem};
use host_io::{clock, session};
use icd::fault::PlantRequest;
use icd::wire::SensorPacket;
use icd::{Actuators, SimTime};
use tracing::{debug, info, warn};
use ulog::writer::Level;

use super::join;
use super::log_folder::{log_name, make_room, prepare, share};
use super::status::StatusSource;
use ::recorder::{
    Begin, ControlHeader, Encoder, End, Entry, LogRate, Moment, Recorded, Step, open,
};
use flight_management::autopilot::Autopilot;
use flight_management::command::{Command, Intent, VehicleCommand};
use flight_management::event::Event;
use flight_management::parameters::Parameters;
use mavlink_services::Ground;
use mavlink_services::statustext::LogText;

/// Entries of a batch; the control thread passes it when it is full.
const BATCH: usize = 64;
/// Room in a batch for the entries of one exchange besides its step.
const BATCH_ROOM: usize = BATCH + 96;
/// Batches in the channel to the log thread.
const QUEUE_MAX: usize = 16;
/// A batch is passed when it is this old, full or not.
const HAND_OVER_AFTER: Duration = Duration::from_millis(100);
/// Entries are flushed to the operating system at least this often, wall time.
pub const FLUSH_EVERY: Duration = Duration::from_millis(100);
/// Without a control step for this wall time, the entries that the encoder holds back are written.
const SETTLE_AFTER: Duration = Duration::from_secs(1);
/// Changes of parameters in the channel to the log thread; each has all values, so the next makes up for a lost one.
const PARAMETERS_MAX: usize = 16;

/// Texts in the channel to the control thread, which knows the simulation time of their arrival.
const TEXTS_MAX: usize = 64;
/// Texts taken in one tick; more wait in their channel.
const TEXTS_PER_TICK: usize = 16;

/// Settings of the log thread.
#[derive(Debug)]
pub struct RecorderConfig {
    /// Folder of the logs.
    pub folder: PathBuf,
    /// Size of all logs together, bytes.
    pub limit_bytes: u64,
    /// Selection of the control steps that get rows.
    pub rate: LogRate,
    /// Parameters at the start of the process.
    pub parameters: Parameters,
    /// Channel to the thread that shows the operator the path of a log; without it, the process prints a line.
    pub status: Option<StatusSource>,
}

/// The end on the ground-station side: sends changed parameters and texts to the recorder.
#[derive(Debug, Clone)]
pub struct GroundFeed {
    sender: SyncSender<Parameters>,
    last: Parameters,
    late: bool,
    texts: SyncSender<LogText>,
    /// Texts dropped since the last one that had room.
    lost: u64,
}

impl GroundFeed {
    /// Sends the present parameters, and texts for ground stations. Never waits: without room for the parameters a later call makes
    /// up for it, and a text is lost, which the next one counts.
    pub fn follow(&mut self, ground: &mut Ground) {
        let now = ground.parameters();
        if *now != self.last || self.late {
            self.late = self.sender.try_send(*now).is_err();
            self.last = *now;
        }
        while let Some((severity, mut text)) = ground.pop_text_for_log() {
            if self.lost > 0 {
                text = format!("{text} ({} more are not in the log)", self.lost);
            }
            let is_sent = self.texts.try_send((severity, text)).is_ok();
            self.lost = if is_sent { 0 } else { self.lost + 1 };
        }
    }
}

/// The end on the control thread.
#[derive(Debug)]
pub struct Recorder {
    batch: Vec<Entry>,
    began: Option<Instant>,
    full: Option<SyncSender<Vec<Entry>>>,
    empty: Receiver<Vec<Entry>>,
    thread: Option<JoinHandle<Option<File>>>,
    /// Set when the log thread finds that its log was removed.
    removed: Arc<AtomicBool>,
    in_flight: bool,
    plant_is_lost: bool,
    time: SimTime,
    moment: Moment,
    texts: Receiver<LogText>,
    /// The state on the ground is in the log.
    has_landed: bool,
}

impl Recorder {
    /// Checks that logs can be written to the folder, which it creates if needed, and starts the log thread.
    pub fn start(config: RecorderConfig) -> Result<(Self, GroundFeed), Problem> {
        let place = format!("--log-dir {}", config.folder.display());
        prepare(&config.folder).at(&place)?;
        let (full, batches) = sync_channel(QUEUE_MAX);
        let (recycle, empty) = sync_channel(QUEUE_MAX);
        let (sender, changes) = sync_channel(PARAMETERS_MAX);
        let (text_sender, texts) = sync_channel(TEXTS_MAX);
        let last = config.parameters;
        let removed = Arc::new(AtomicBool::new(false));
        let theirs = Arc::clone(&removed);
        let thread = thread::Builder::new()
            .name("flight log".to_owned())
            .spawn(move || LogThread::new(config, changes, theirs).run(&batches, &recycle))
            .at(place)?;
        let recorder = Self {
            batch: Vec::with_capacity(BATCH_ROOM),
            began: None,
            full: Some(full),
            empty,
            thread: Some(thread),
            removed,
            in_flight: false,
            plant_is_lost: false,
            time: SimTime::ZERO,
            moment: Moment::Between,
            texts,
            has_landed: false,
        };
        Ok((recorder, GroundFeed { sender, last, late: false, texts: text_sender, lost: 0 }))
    }

    /// Begins a log: a flight has begun with this packet; the autopilot has begun it too, and has not made a step yet.
    pub fn begin_flight(&mut self, packet: &SensorPacket, autopilot: &Autopilot) {
        let session = session::shown(packet.session);
        let (period_us, joined) = (packet.period.as_micros(), packet.sequence > 0);
        let header = ControlHeader::new(autopilot.settings(), session, period_us, joined);
        if self.plant_is_lost {
            // Another plant has replaced a silent one: no request restarted the flight.
            self.push(Entry::End(End::PlantLost));
        }
        self.in_flight = true;
        self.plant_is_lost = false;
        self.has_landed = false;
        self.time = packet.time;
        self.moment = Moment::Between;
        self.push(Entry::Begin(Box::new(Begin { time: packet.time, header })));
        let plan = autopilot.plan();
        if !plan.items.is_empty() {
            // Left by an earlier flight.
            self.recorded(Recorded::Intent(Intent {
                number: 0,
                command: Command::Vehicle(VehicleCommand::Plan(plan)),
            }));
        }
    }

    /// Begins an exchange: inputs from here on precede its step.
    pub fn enter(&mut self, packet: &SensorPacket) {
        self.time = packet.time;
        self.moment = packet.phase.into();
        for report in &packet.reports {
            if let Some(entry) = Entry::of_report(packet.time, report) {
                self.push(entry);
            }
        }
    }

    /// Records an operator's command.
    pub fn intent(&mut self, intent: &Intent) {
        if self.in_flight {
            self.recorded(Recorded::Intent(intent.clone()));
        }
    }

    /// Records that the plant has been silent for too long.
    pub fn plant_lost(&mut self) {
        self.plant_is_lost = true;
        self.recorded(Recorded::PlantLost);
    }

    /// Records that the plant continues the flight.
    pub fn plant_back(&mut self) {
        self.plant_is_lost = false;
        self.recorded(Recorded::PlantBack);
    }

    /// Ends an exchange after its answer was sent: records its step, the request to the plant, and the plant's data for the
    /// recorder. Besides [`Recorder::poll`] the only function that can wait for the disk.
    pub fn leave(
        &mut self,
        packet: &SensorPacket,
        envelope: &[u8],
        actuators: &Actuators,
        request: Option<PlantRequest>,
        autopilot: &Autopilot,
    ) {
        let (truth, piece) = open(envelope);
        if self.moment == Moment::Step
            && let Some(snapshot) = autopilot.snapshot()
        {
            let demand = snapshot.demand;
            self.push(Entry::Step(Step {
                time: packet.time,
                sensors: packet.sensors,
                actuators: *actuators,
                log: snapshot.log,
                mode: snapshot.mode,
                references: [demand.altitude_m, demand.roll_rad, demand.airspeed_m_s],
                terminated: snapshot.terminated,
                truth,
            }));
        }
        if self.moment == Moment::OnGround
            && !self.has_landed
            && let Some(row) = truth
        {
            self.has_landed = true;
            self.push(Entry::Ground { time: packet.time, row });
        }
        if let Some(request) = request {
            self.recorded(Recorded::Request(request));
        }
        if let Some(piece) = piece {
            self.push(piece);
        }
        self.moment = Moment::Between;
    }

    /// Records an event of the autopilot.
    pub fn event(&mut self, event: Event) {
        self.push(Entry::Event(event));
    }

    /// Records texts of the ground-station side, and passes a batch when it is due.
    pub fn poll(&mut self) {
        for _ in 0..TEXTS_PER_TICK {
            let Ok((severity, text)) = self.texts.try_recv() else { break };
            self.push(Entry::Text { time: self.time, severity, text });
        }
        let Some(began) = self.began else { return };
        if self.batch.len() >= BATCH || clock::now() - began >= HAND_OVER_AFTER {
            self.hand_over();
        }
    }

    /// Whether the log was removed during writing; true once for each log.
    pub fn log_was_removed(&mut self) -> bool {
        self.removed.load(Ordering::Relaxed) && self.removed.swap(false, Ordering::Relaxed)
    }

    /// Ends the log, and waits until it is written. Gives its lock: a ground station that erases all logs while the process
    /// ends must not erase the one that has just been finished.
    pub fn finish(mut self) -> Option<File> {
        let end = if self.plant_is_lost { End::PlantLost } else { End::Stopped };
        self.push(Entry::End(end));
        self.hand_over();
        self.full = None;
        join(self.thread.take(), "log thread").flatten()
    }

    fn recorded(&mut self, what: Recorded) {
        self.push(Entry::Recorded { time: self.time, moment: self.moment, what });
    }

    fn push(&mut self, entry: Entry) {
        if !self.in_flight || self.full.is_none() {
            return;
        }
        if self.batch.is_empty() {
            self.began = Some(clock::now());
        }
        self.batch.push(entry);
    }

    fn hand_over(&mut self) {
        self.began = None;
        if self.batch.is_empty() {
            return;
        }
        let next = self.empty.try_recv().unwrap_or_else(|_| Vec::with_capacity(BATCH_ROOM));
        let batch = std::mem::replace(&mut self.batch, next);
        if self.full.as_ref().is_some_and(|full| full.send(batch).is_err()) {
            warn!("the log thread has ended; there is no flight log any more");
            self.full = None;
        }
    }
}

/// Folder and size limit of the logs, for the operator.
pub fn introduction(folder: &Path, limit_bytes: u64) -> String {
    format!("flight logs in {}, {} MB at most", folder.display(), limit_bytes / 1_000_000)
}

/// One piece of a file, bytes.
const BUFFER_BYTES: usize = 256 * 1024;
/// Old logs are removed each time a log has grown by this fraction of the limit.
const LOOKS: u64 = 16;

/// State of the log thread.
struct LogThread {
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
    encoder: Encoder<RecordedFile>,
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
            while let Ok(now) = self.changes.try_recv() {
                self.config.parameters = now;
                self.write(|encoder| encoder.add(Entry::Parameters(Box::new(now))));
            }
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

    fn begin(&mut self, begin: Begin) {
        let RecorderConfig { folder, limit_bytes, rate, parameters, .. } = &self.config;
        if let Err(problem) = std::fs::create_dir_all(folder) {
            // If the file cannot be created either, the result is the same.
            debug!(%problem, "the folder of the logs cannot be made again");
        }
        make_room(folder, *limit_bytes);
        let path = folder.join(log_name(clock::utc_seconds(), &begin.header.session));
        let log = RecordedFile::create(&path).and_then(|file| {
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
    fn write(&mut self, what: impl FnOnce(&mut Encoder<RecordedFile>) -> io::Result<()>) {
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
            // Data written to a file that has lost its name are lost at the end of the process.
            let is_gone = |log: &OpenLog| std::fs::symlink_metadata(&log.path).is_err();
            if let Some(log) = self.log.take_if(|log| is_gone(log)) {
                let path = log.path.display();
                warn!(log = %path, "the flight log was removed; recording ends here and begins again with the next flight");
                self.removed.store(true, Ordering::Relaxed);
            }
        }
        let limit = self.config.limit_bytes;
        let Some(log) = self.log.as_mut() else { return };
        let written = log.encoder.written();
        // The log of traffic has its share besides it.
        if written >= limit - share(limit) {
            let path = log.path.display();
            warn!(log = %path, "the flight log has reached its limit and ends; see --log-limit-mb");
            self.end(End::Full);
            // The flight goes on without it.
            self.finished = None;
        } else if written >= log.look_at {
            log.look_at = written + limit / LOOKS;
            make_room(&self.config.folder, limit);
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
struct RecordedFile {
    file: File,
    buffer: Vec<u8>,
    /// Bytes of the file that are whole messages.
    whole: u64,
}

impl RecordedFile {
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

impl Write for RecordedFile {
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
        let mut file = RecordedFile::create(&path).unwrap();
        let message = [7; 1000];
        for _ in 0..1000 {
            file.write_all(&message).unwrap();
        }
        file.write_all(b"end").unwrap();
        file.flush().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert_eq!(bytes.len(), 1_000_003);
        assert_eq!(&bytes[1_000_000..], b"end");
        assert_eq!(RecordedFile::create(&path).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
    }

    #[test]
    fn a_finished_log_keeps_its_lock_until_the_process_has_ended() {
        let model = configuration::model("tvc_jet.toml", aircraft::DEFAULT_MODEL).unwrap();
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
        let mut log = RecordedFile { file, buffer: Vec::new(), whole: 0 };
        log.write_all(b"message").unwrap();
        assert_eq!(log.flush().unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert!(log.buffer.is_empty());
        assert!(log.flush().is_ok());
    }
}
