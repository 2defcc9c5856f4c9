//! The status of a flight for the operator: one line of JSON ten times a second on the standard output.

use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use flight_control::CompensatorMode;
use host_io::{Stop, console};
use icd::fault::{FaultEntry, FaultState};
use icd::{EffectorKind, EffectorList, PerEffector};
use serde::{Deserialize, Serialize};

use flight_management::autopilot::Autopilot;
use flight_management::event::{Axis, Snapshot};
use flight_management::fault_list::FaultList;

/// Time between two lines.
const INTERVAL: Duration = Duration::from_millis(100);

/// Faults in a line; further ones are only counted.
const FAULTS_SHOWN: usize = 8;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum StatusLine {
    /// The first line: addresses for plants and ground stations.
    Listening {
        /// Address of the plant link.
        plant_link: SocketAddr,
        /// Addresses for ground stations; empty if they are disabled.
        #[serde(default)]
        ground_stations: Listening,
    },
    /// No plant has connected yet.
    NoPlant,
    Flight(Box<FlightStatus>),
    /// A flight log was begun.
    FlightLog {
        path: PathBuf,
    },
}

/// Addresses for ground stations, from the opened [`super::gcs_link::Links`].
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Listening {
    /// Ground stations that are called.
    pub clients: Vec<SocketAddr>,
    /// Where they can call by UDP.
    pub udp_server: Option<SocketAddr>,
    /// Where they can connect by TCP.
    pub tcp_server: Option<SocketAddr>,
}

/// The flight at one instant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlightStatus {
    /// State of the plant.
    pub plant: PlantState,
    /// Simulation time, s.
    pub t_s: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Roll angle, deg.
    pub roll_deg: f64,
    /// References of the laws.
    pub references: References,
    /// The compensator never acts (`FTC_MODE` 0).
    pub compensator_off: bool,
    /// The detector has found a fault.
    pub compensator_active: bool,
    /// Fraction of the compensation that is applied, 0 to 1.
    pub fade: f64,
    /// Largest estimated fault acceleration in units of its activation level.
    pub level: f64,
    /// What the compensation adds to the commands: the largest addition of each kind of effector that has one, deg.
    pub adds: Vec<(EffectorKind, f64)>,
    /// Remaining authority of the compensator in roll, pitch and yaw, percent.
    pub authority_pct: [f64; 3],
    /// The first faults on the plant's list.
    pub faults: Vec<FaultStatus>,
    /// Further faults on it.
    pub more_faults: usize,
    pub mode: String,
}

/// References of the laws.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct References {
    /// Altitude, m.
    pub altitude_m: f64,
    /// True airspeed, m/s.
    pub airspeed_m_s: f64,
    /// Roll angle, deg.
    pub roll_deg: f64,
}

/// A fault on the plant's list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaultStatus {
    /// Effector and kind, as in `left elevator stuck at 30.0 deg`.
    pub what: String,
    /// State of the fault.
    pub state: FaultState,
}

impl FaultStatus {
    fn new(entry: &FaultEntry, effectors: &EffectorList) -> Self {
        let kind = entry.kind.described(entry.target.class(effectors));
        let what = format!("{} {kind}", entry.target.name(effectors));
        Self { what, state: entry.state }
    }
}

impl FlightStatus {
    fn new(plant: PlantState, s: &Snapshot, autopilot: &Autopilot, faults: &FaultList) -> Self {
        let effectors = &autopilot.model().effectors.list;
        let (log, demand) = (&s.log, &s.demand);
        let plant = match plant {
            PlantState::Flying if s.on_ground => PlantState::OnGround,
            PlantState::Flying if s.terminated => PlantState::Terminated,
            plant => plant,
        };
        let mut listed = faults.entries().iter().map(|entry| FaultStatus::new(entry, effectors));
        Self {
            plant,
            t_s: s.time.as_seconds(),
            altitude_m: log.state.altitude_m,
            airspeed_m_s: log.state.airspeed_m_s,
            roll_deg: log.state.attitude.phi.to_degrees(),
            references: References {
                altitude_m: demand.altitude_m,
                airspeed_m_s: demand.airspeed_m_s,
                roll_deg: demand.roll_rad.to_degrees(),
            },
            compensator_off: autopilot.gains().selection.compensator == CompensatorMode::Off,
            compensator_active: log.compensator_active,
            fade: log.fade,
            level: log.level,
            adds: adds(effectors, &log.increments),
            authority_pct: Axis::ALL.map(|axis| axis.authority_pct(&log.authority)),
            faults: listed.by_ref().take(FAULTS_SHOWN).collect(),
            more_faults: listed.count(),
            mode: s.mode.to_string(),
        }
    }
}

/// The largest addition of each kind of effector that turns, deg, of the kinds that have one.
fn adds(list: &EffectorList, increments: &PerEffector<f64>) -> Vec<(EffectorKind, f64)> {
    let kinds = EffectorKind::ALL.into_iter().filter(|kind| kind.is_angle());
    let largest = |kind| {
        let of_kind = list.of_kind(kind).map(|effector| increments[effector]);
        let largest = of_kind.max_by(|one, other| one.abs().total_cmp(&other.abs()))?;
        (largest != 0.0).then(|| (kind, largest.to_degrees()))
    };
    kinds.filter_map(largest).collect()
}

/// State of the plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PlantState {
    Flying,
    /// The flight was terminated: engine off, surfaces at their stops.
    Terminated,
    /// The flight is over.
    OnGround,
    /// The plant has been silent for a second.
    Lost,
}

/// Lines that wait to be printed: one of the flight, since there is none before a request for it, and paths of logs.
const LINES_MAX: usize = 8;

#[derive(Debug, Clone)]
pub struct StatusSource {
    wanted: Arc<AtomicBool>,
    lines: SyncSender<StatusLine>,
}

impl StatusSource {
    /// Whether a line is requested: one relaxed load, cheap enough for each tick.
    pub fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// Reports the flight with the faults on the plant's list. Never waits.
    pub fn show(&self, plant: PlantState, autopilot: &Autopilot, faults: &FaultList) {
        let line = autopilot.snapshot().map_or(StatusLine::NoPlant, |snapshot| {
            StatusLine::Flight(Box::new(FlightStatus::new(plant, snapshot, autopilot, faults)))
        });
        // Full means that earlier lines are not printed yet: this one would add nothing.
        let _ = self.lines.try_send(line);
        // After the line: a request before it would get a second line, and both would wait.
        self.wanted.store(false, Ordering::Relaxed);
    }

    /// Prints the path of a flight log. Never waits.
    pub fn log(&self, path: &Path) {
        // Without room there is no reader.
        let _ = self.lines.try_send(StatusLine::FlightLog { path: path.to_owned() });
    }
}

/// The receiving end, of the thread that prints.
#[derive(Debug)]
pub struct StatusPrinter {
    wanted: Arc<AtomicBool>,
    lines: Receiver<StatusLine>,
}

pub fn channel() -> (StatusSource, StatusPrinter) {
    let wanted = Arc::new(AtomicBool::new(false));
    let (sender, lines) = sync_channel(LINES_MAX);
    let source = StatusSource { wanted: Arc::clone(&wanted), lines: sender };
    (source, StatusPrinter { wanted, lines })
}

/// Starts the thread that prints, and ends the process when the reader closes the output.
pub fn start(printer: StatusPrinter, first: StatusLine, stop: Stop) -> std::io::Result<()> {
    let StatusPrinter { wanted, lines } = printer;
    let print_all = move || {
        let mut printed = print(&first).map(|()| true);
        while matches!(printed, Ok(true)) {
            host_io::clock::sleep(INTERVAL);
            printed = print_next(&wanted, &lines, print);
        }
        if printed.is_err() {
            stop.request();
        }
    };
    thread::Builder::new().name("status".to_owned()).spawn(print_all).map(|_| ())
}

/// Prints the lines that wait, requests the next one and prints it. Returns whether there is a source of more.
fn print_next(
    wanted: &AtomicBool,
    lines: &Receiver<StatusLine>,
    mut print: impl FnMut(&StatusLine) -> std::io::Result<()>,
) -> std::io::Result<bool> {
    // Paths of logs come unasked, and lines of the flight may be late. One left here would delay all that follow.
    lines.try_iter().try_for_each(|line| print(&line))?;
    wanted.store(true, Ordering::Relaxed);
    match lines.recv_timeout(INTERVAL) {
        Ok(line) => print(&line).map(|()| true),
        Err(RecvTimeoutError::Timeout) => Ok(true),
        Err(RecvTimeoutError::Disconnected) => Ok(false),
    }
}

fn print(line: &StatusLine) -> std::io::Result<()> {
    let mut out = console::out();
    writeln!(out, "{}", serde_json::to_string(line)?)?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use flight_management::event::EventKind;
    use icd::SimTime;
    use icd::fault::{FaultKind, Timing, Travel};
    use icd::tvc_jet;

    #[test]
    fn a_line_about_a_log_delays_no_later_line() {
        let (source, StatusPrinter { wanted, lines }) = channel();
        source.log(Path::new("flight.ulg"));
        source.lines.try_send(StatusLine::NoPlant).unwrap();
        let mut printed = Vec::new();
        let mut print = |line: &StatusLine| {
            assert!(!source.is_wanted(), "requested before this line was printed: {line:?}");
            printed.push(line.clone());
            Ok(())
        };
        assert!(print_next(&wanted, &lines, &mut print).unwrap());
        let log = StatusLine::FlightLog { path: "flight.ulg".into() };
        assert_eq!(printed, [log, StatusLine::NoPlant]);
        assert!(source.is_wanted());
    }

    #[test]
    fn the_printer_ends_with_its_source_and_with_its_reader() {
        let (source, StatusPrinter { wanted, lines }) = channel();
        source.log(Path::new("flight.ulg"));
        let closed = |_: &StatusLine| Err(std::io::ErrorKind::BrokenPipe.into());
        assert!(print_next(&wanted, &lines, closed).is_err());
        drop(source);
        assert!(!print_next(&wanted, &lines, |_| Ok(())).unwrap());
    }

    #[test]
    fn faults_are_named_by_effector_and_kind_and_those_beyond_the_limit_are_counted() {
        let mut list = FaultList::default();
        let at = |s: u64| SimTime::from_micros(s * 1_000_000);
        for id in 1..=u32::try_from(FAULTS_SHOWN).unwrap() + 2 {
            let kind = FaultKind::StuckAt { angle_rad: 0.5, travel: Travel::Jump };
            let state = match id {
                1 => FaultState::Active { since: at(3) },
                _ => FaultState::Scheduled { at: at(u64::from(id)) },
            };
            let (effector, timing) = (tvc_jet::LEFT_ELEVATOR, Timing::at(at(3)));
            list.handle_event(&EventKind::Fault(FaultEntry {
                id,
                target: effector.into(),
                kind,
                timing,
                state,
            }));
        }
        let mut listed =
            list.entries().iter().map(|entry| FaultStatus::new(entry, &tvc_jet::effectors()));
        let first = listed.next().unwrap();
        let expected = ("left elevator stuck at 28.6 deg", FaultState::Active { since: at(3) });
        assert_eq!((first.what.as_str(), first.state), expected);
        assert_eq!(listed.next().unwrap().state, FaultState::Scheduled { at: at(2) });
    }
}
