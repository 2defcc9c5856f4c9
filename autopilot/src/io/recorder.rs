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

use flight_management::command::VehicleCommand;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use host_io::{clock, session};
use icd::wire::SensorPacket;
use icd::{Actuators, SimTime};
use tracing::warn;

use super::status::StatusSource;
use crate::config::RunError;
use ::recorder::{Begin, ControlHeader, End, Entry, LogRate, Moment, Recorded, Step, open};
use flight_management::autopilot::Autopilot;
use flight_management::command::{Command, Intent};
use flight_management::event::Event;
use flight_management::parameters::Parameters;
use mavlink_services::Ground;
use mavlink_services::statustext::LogText;

pub(crate) mod folder;
mod writer;

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
    /// Sends new parameters and texts.
    pub fn follow(&mut self, ground: &mut Ground) {
        self.send_parameters(ground.parameters());
        while let Some(text) = ground.pop_text_for_log() {
            self.send_text(text);
        }
    }

    /// Sends the present parameters. Never waits: without room, a later call makes up for it.
    fn send_parameters(&mut self, now: &Parameters) {
        if *now != self.last || self.late {
            self.late = self.sender.try_send(*now).is_err();
            self.last = *now;
        }
    }

    /// Sends a text for ground stations. Never waits: without room it is lost, and the next one counts it.
    fn send_text(&mut self, (severity, mut text): LogText) {
        if self.lost > 0 {
            text = format!("{text} ({} more are not in the log)", self.lost);
        }
        self.lost = match self.texts.try_send((severity, text)) {
            Ok(()) => 0,
            Err(_) => self.lost + 1,
        };
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
    pub fn start(config: RecorderConfig) -> Result<(Self, GroundFeed), RunError> {
        let folder = config.folder.clone();
        let failed = |error: io::Error| format!("--log-dir {}: {error}", folder.display());
        folder::prepare(&config.folder).map_err(failed)?;
        let (full, batches) = sync_channel(QUEUE_MAX);
        let (recycle, empty) = sync_channel(QUEUE_MAX);
        let (sender, changes) = sync_channel(PARAMETERS_MAX);
        let (text_sender, texts) = sync_channel(TEXTS_MAX);
        let last = config.parameters;
        let removed = Arc::new(AtomicBool::new(false));
        let theirs = Arc::clone(&removed);
        let thread = thread::Builder::new()
            .name("flight log".to_owned())
            .spawn(move || writer::LogThread::new(config, changes, theirs).run(&batches, &recycle))
            .map_err(failed)?;
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
        request: Option<icd::fault::PlantRequest>,
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
        let lock = self.thread.take()?.join();
        lock.inspect_err(|_| warn!("the log thread has broken down")).ok()?
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
