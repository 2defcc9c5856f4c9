//! What the operator sees of a flight: one line of JSON ten times a second on the standard output.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use host_io::Stop;
use serde::{Deserialize, Serialize};

use super::gcs_link::Listening;
use crate::event::Snapshot;

/// Time between two lines.
const INTERVAL: Duration = Duration::from_millis(100);

/// One line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StatusLine {
    /// First of all: where plants and ground stations are awaited.
    Listening {
        /// Address of the plant link.
        plant_link: std::net::SocketAddr,
        /// Where ground stations can be; empty if there are to be none.
        #[serde(default)]
        ground_stations: Listening,
    },
    /// No plant has called yet.
    NoPlant,
    /// The flight.
    Flight(FlightStatus),
    /// A flight log was begun.
    FlightLog {
        /// Its path.
        path: PathBuf,
    },
}

/// The flight at one instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightStatus {
    /// What the plant is doing.
    pub plant: PlantState,
    /// Simulation time, s.
    pub t_s: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Roll angle, deg.
    pub roll_deg: f64,
    /// The detector says that something is wrong.
    pub compensator_active: bool,
    /// How much of the compensation is let through, 0 to 1.
    pub fade: f64,
    /// Flight mode.
    pub mode: String,
}

/// What the plant is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlantState {
    /// Simulation time runs.
    Flying,
    /// The flight is over.
    OnGround,
    /// It has been silent for a second.
    Lost,
}

/// Lines that wait to be printed: one of the flight, since there is none before it is wanted, and paths of logs.
const LINES_MAX: usize = 8;

/// The end of those who have something to show.
#[derive(Debug, Clone)]
pub struct StatusSource {
    wanted: Arc<AtomicBool>,
    lines: SyncSender<StatusLine>,
}

impl StatusSource {
    /// Whether a line is wanted: one relaxed load, cheap enough for each tick.
    #[must_use]
    pub fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// Fulfils the wish. Never waits.
    pub fn show(&self, plant: PlantState, snapshot: Option<&Snapshot>) {
        self.wanted.store(false, Ordering::Relaxed);
        let line = snapshot.map_or(StatusLine::NoPlant, |s| {
            StatusLine::Flight(FlightStatus {
                plant: if s.on_ground && plant == PlantState::Flying {
                    PlantState::OnGround
                } else {
                    plant
                },
                t_s: s.time.as_seconds(),
                altitude_m: s.log.state.altitude_m,
                airspeed_m_s: s.log.state.airspeed_m_s,
                roll_deg: s.log.state.attitude.phi.to_degrees(),
                compensator_active: s.log.compensator_active,
                fade: s.log.fade,
                mode: s.mode.to_string(),
            })
        });
        // Full means that the last lines are not printed yet: this one would be no news.
        let _ = self.lines.try_send(line);
    }

    /// Shows where a flight log is. Never waits.
    pub fn log(&self, path: &Path) {
        // Nobody reads where there is no room.
        let _ = self.lines.try_send(StatusLine::FlightLog { path: path.to_owned() });
    }
}

/// The end of the thread that prints.
#[derive(Debug)]
pub struct StatusPrinter {
    wanted: Arc<AtomicBool>,
    lines: Receiver<StatusLine>,
}

/// Both ends.
#[must_use]
pub fn channel() -> (StatusSource, StatusPrinter) {
    let wanted = Arc::new(AtomicBool::new(false));
    let (sender, lines) = sync_channel(LINES_MAX);
    let source = StatusSource { wanted: Arc::clone(&wanted), lines: sender };
    (source, StatusPrinter { wanted, lines })
}

/// Starts the thread that prints, and asks the process to end when nobody reads any more.
///
/// # Errors
/// What the system says, if it refuses a thread.
pub fn start(printer: StatusPrinter, first: StatusLine, stop: Stop) -> std::io::Result<()> {
    let StatusPrinter { wanted, lines } = printer;
    let print_all = move || {
        let printed = print(&first).and_then(|()| print_all(&wanted, &lines));
        if printed.is_err() {
            stop.request();
        }
    };
    thread::Builder::new().name("status".to_owned()).spawn(print_all).map(|_| ())
}

fn print_all(wanted: &AtomicBool, lines: &Receiver<StatusLine>) -> std::io::Result<()> {
    loop {
        host_io::clock::sleep(INTERVAL);
        wanted.store(true, Ordering::Relaxed);
        match lines.recv_timeout(INTERVAL) {
            Ok(line) => print(&line)?,
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        }
    }
}

fn print(line: &StatusLine) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{}", serde_json::to_string(line)?)?;
    out.flush()
}
