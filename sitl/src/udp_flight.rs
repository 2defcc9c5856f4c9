//! A flight through the two real processes over UDP, with the same records as one in process.
//!
//! ```text
//! setup ─> files ─> sitl plant-sim ─ UDP, as fast as possible ─ sitl autopilot
//!                        └─> truth log ─> merged by tick <─ step log <─┘
//! ```

use std::fs;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use autopilot::io::plant_link::LoggedStep;
use autopilot::io::status::StatusLine;
use host_io::problem::{At as _, Problem, problem};
use host_io::session;
use host_io::tick_log::{Kind, TickLogReader};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use plant_sim::Truth;
use plant_sim::io::FlightReport;

use crate::arrangement::{Arrangement, Process};
use lab_judges::closed_loop::{End, FlightSetup, Record};

/// How often the autopilot is checked while the plant flies.
const WATCH_EVERY: Duration = Duration::from_millis(50);

/// Flies a setup through the two real processes as fast as they can, and hands every tick to `sink`.
///
/// `program` is the `sitl` executable.
pub fn fly_udp(
    program: &Path,
    setup: &FlightSetup,
    sink: &mut dyn FnMut(&Record),
) -> Result<End, Problem> {
    let folder = Folder::create()?;
    let (truth, steps) = (folder.0.join("truth.log"), folder.0.join("steps.log"));
    let logs = TickLogs::Ticks { truth: &truth, steps: &steps };
    let report = fly_processes(program, setup, &Arrangement::UNPINNED, &folder.0, Some(&logs))?;
    merge(&truth, &steps, sink)?;
    Ok(End { time: report.time, on_ground: report.on_ground })
}

/// Flies a setup through the two real processes and measures how long that takes; with a flight log of the rate `log`, or
/// without any.
pub fn time_udp(
    program: &Path,
    setup: &FlightSetup,
    arrangement: &Arrangement,
    log: Option<&str>,
) -> Result<FlightReport, Problem> {
    let folder = Folder::create()?;
    let logs = log.map(|rate| TickLogs::Flight { rate });
    fly_processes(program, setup, arrangement, &folder.0, logs.as_ref())
}

/// What the processes write.
enum TickLogs<'a> {
    /// Truth and step log, for a comparison.
    Ticks { truth: &'a Path, steps: &'a Path },
    /// A flight log, of which nothing stays.
    Flight { rate: &'a str },
}

fn fly_processes(
    program: &Path,
    setup: &FlightSetup,
    arrangement: &Arrangement,
    folder: &Path,
    logs: Option<&TickLogs<'_>>,
) -> Result<FlightReport, Problem> {
    let (plant_file, control_file) = (folder.join("plant.setup"), folder.join("control.setup"));
    let no_setup = "the setup cannot be written";
    fs::write(&plant_file, postcard::to_stdvec(&setup.plant).at(no_setup)?).at(no_setup)?;
    fs::write(&control_file, postcard::to_stdvec(&setup.settings()).at(no_setup)?).at(no_setup)?;

    let mut autopilot = Command::new(program);
    // Any free port, since several flights may run at once.
    autopilot.args(["autopilot", "--plant-link", "127.0.0.1:0"]);
    // A ground station that happens to listen could command this flight.
    autopilot.args(["--no-gcs", "--status", "--with-parent"]);
    autopilot.arg("--setup").arg(&control_file).args(arrangement.autopilot.options());
    let mut plant = Command::new(program);
    plant.args(["plant-sim", "--speed", "max", "--report", "--with-parent"]);
    plant.arg("--setup").arg(&plant_file).args(arrangement.plant.options());
    // The shortest text of a float reads back as the same float, so both modes end at the same
    // tick.
    plant.args(["--until-s", &setup.duration.as_seconds().to_string()]);
    match logs {
        None => {}
        Some(TickLogs::Ticks { truth, steps }) => {
            autopilot.arg("--step-log").arg(steps);
            plant.arg("--truth-log").arg(truth);
        }
        Some(TickLogs::Flight { rate }) => {
            autopilot.arg("--log-dir").arg(folder.join("logs")).args(["--log-rate", rate]);
        }
    }

    let mut autopilot = Process::start("autopilot", autopilot)?;
    let line = autopilot.line()?;
    let address: SocketAddr = match serde_json::from_str(&line) {
        Ok(StatusLine::Listening { plant_link, .. }) => plant_link,
        _ => return Err(autopilot.unexpected(&line)),
    };
    plant.args(["--autopilot", &address.to_string()]);
    let plant = Process::start("plant-sim", plant)?;
    let report = wait_for_report(plant, &mut autopilot)?;
    // Only after its end is its log complete.
    autopilot.end()?;
    Ok(report)
}

/// Waits for the plant's report, and for the autopilot's end, which the plant would outwait.
fn wait_for_report(plant: Process, autopilot: &mut Process) -> Result<FlightReport, Problem> {
    let (sender, receiver) = mpsc::channel();
    // The thread takes the process; its number is what is left to end it by.
    let id = plant.child.id();
    let watch = move || {
        let mut plant = plant;
        let report = plant.line().and_then(|line| {
            let report = serde_json::from_str(&line).map_err(|_| plant.unexpected(&line))?;
            plant.end()?;
            Ok(report)
        });
        // Nobody waits for it any more if the autopilot has ended first.
        let _ = sender.send(report);
    };
    let unwatched = "cannot watch a process";
    thread::Builder::new().name("plant".to_owned()).spawn(watch).at(unwatched)?;
    loop {
        if let Ok(result) = receiver.recv_timeout(WATCH_EVERY) {
            return result;
        }
        if autopilot.child.try_wait().at(unwatched)?.is_some() {
            let plant = Pid::from_raw(i32::try_from(id).unwrap_or(i32::MAX));
            // It may have ended by itself in the meantime.
            let _ = kill(plant, Signal::SIGTERM);
            return Err(autopilot.failure());
        }
    }
}

/// Both logs, tick by tick.
fn merge(truth: &Path, steps: &Path, sink: &mut dyn FnMut(&Record)) -> Result<(), Problem> {
    let mut truths = TickLogReader::open(truth, Kind::Truth)?;
    let mut steps = TickLogReader::open(steps, Kind::ControlSteps)?;
    for tick in 0.. {
        // Both are read before either is judged, so that the message says which of them is short.
        let truth: Option<Truth> = truths.next_entry()?;
        let step: Option<LoggedStep> = steps.next_entry()?;
        match (truth, step) {
            (None, None) => break,
            (Some(truth), Some((time, log))) if truth.time == time => sink(&Record { truth, log }),
            (truth, step) => {
                let plant = truth.map(|truth| truth.time);
                let autopilot = step.map(|(time, _)| time);
                return Err(problem!(
                    "tick {tick}: the plant says {plant:?}, the autopilot {autopilot:?}"
                ));
            }
        }
    }
    Ok(())
}

/// A folder for the files of one flight, removed with it.
struct Folder(PathBuf);

impl Folder {
    fn create() -> Result<Self, Problem> {
        let no_folder = "cannot create a folder";
        // One process may fly several flights at once, so its own number is not enough.
        let unique = session::shown(session::draw().at(no_folder)?);
        let path = std::env::temp_dir().join(format!("sitl-{}-{unique}", std::process::id()));
        // A folder that exists already is another flight's, and an error.
        fs::create_dir(&path).at(no_folder)?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A folder that stays behind in the temporary folder does no harm.
        let _ = fs::remove_dir_all(&self.0);
    }
}
