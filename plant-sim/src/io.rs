//! The plant as a process: command line, socket to the autopilot, pacing by the wall clock, truth log.
//!
//! ```text
//! sense ─> send ────────────> autopilot ────────> answer ─> request ─> wait until due ─> advance ─> sense ..
//!           └ again, if no answer comes             ├ fault: the reply is in the next packet
//!                                                   ├ restart: a new session
//!                                                   └ pace ─> pacer <─ requests of the parent process
//! ```
//!
//! The wall clock determines when a tick is flown, never a computed value: the same flight at any speed
//! gives the same bits, also with pauses and single steps in between. While time is paused (pause, slow
//! motion, on the ground) the plant sends about 20 packets a second without a control step, which show that it is
//! alive and let the autopilot request faults, a restart and another pace.

use std::io::Write;
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;

use host_io::health::HealthFile;
use host_io::problem::{At as _, Problem, problem};
use host_io::tick_log::{Kind, TickLogWriter};
use host_io::{LinkSocket, Stop, console, process};
use tracing::{info, warn};

use crate::plant::Plant;
use crate::setup::PlantSetup;

mod args;
mod flight;
pub mod header;
mod link;
mod pacer;

pub use args::{CORE_MAX, PlantArgs, Speed, StartPlace, parse_earth, parse_period, whole};
pub use flight::FlightReport;
pub use pacer::PlantLine;

use flight::{Flight, FlightEnd};
use header::Envelopes;
use link::{Link, RESEND_AFTER};
use pacer::{Pacer, Parent};

/// Who speaks where the system refuses signals, threads or output.
const PROGRAM: &str = "plant-sim";
const TRUTH_LOG: &str = "truth log";

/// Why the plant ended without an error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ExitReason {
    /// A signal or the parent process ended it.
    Stopped,
    /// The flight is complete.
    Complete(FlightReport),
}

/// Flies until the flight is complete or the process has to end.
///
/// Call it before the process starts any thread: it changes how the process handles signals.
pub fn run(args: &PlantArgs) -> Result<ExitReason, Problem> {
    let stop = Stop::new();
    stop.on_signals().at(PROGRAM)?;
    let parent = Parent::new(args.with_parent, args.status, &stop).at(PROGRAM)?;
    let setup = args.plant_setup()?;
    // Before the socket: a flight that cannot start ends with its error instead of waiting for an autopilot.
    let plant = args.plant(&setup)?;
    let autopilot = args.autopilot.clone();
    let peer = resolve(&autopilot.unwrap_or_else(|| args.instance.plant_link().to_string()))?;
    let socket = LinkSocket::connect("plant-sim", "plant link", peer, args.wait, RESEND_AFTER)?;
    let create = |path: &PathBuf| TickLogWriter::create(path, Kind::Truth);
    let mut truth_log = args.truth_log.as_ref().map(create).transpose().at(TRUTH_LOG)?;
    if let Some(cpu) = args.cpu
        // Without a core of its own the flight has the same bits and only takes longer.
        && let Err(error) = process::pin_this_thread(cpu)
    {
        warn!(%error, "running on any core");
    }
    info!(autopilot = %peer, speed = %args.speed, "plant ready");
    let health = args.health_file.as_deref().map(HealthFile::new).transpose()?;
    let link = Link::new(socket, setup.airframe.aircraft(), stop.clone(), health).at(PROGRAM)?;
    let end = fly(args, &setup, plant, link, &stop, &parent, &mut truth_log);
    // Before an error of the flight is returned: that is when somebody reads the log.
    if let Some(log) = truth_log {
        log.finish().at(TRUTH_LOG)?;
    }
    let exit = end?;
    if let (true, ExitReason::Complete(report)) = (args.report, exit) {
        let line = serde_json::to_string(&report).at(PROGRAM)?;
        writeln!(console::out(), "{line}").at(PROGRAM)?;
    }
    Ok(exit)
}

fn fly(
    args: &PlantArgs,
    setup: &PlantSetup,
    first: Plant,
    mut link: Link,
    stop: &Stop,
    parent: &Parent,
    truth_log: &mut Option<TickLogWriter>,
) -> Result<ExitReason, Problem> {
    let mut pacer = Pacer::new(setup.period, args.speed, args.start_paused);
    let mut plant = first;
    let mut envelopes = Envelopes::new(&args.scenario, setup).at(PROGRAM)?;
    let airframe = args.airframe_name();
    let until = args.until()?;
    loop {
        pacer.begin_flight();
        envelopes.begin_flight();
        let mut flight = Flight {
            plant,
            period: setup.period,
            until,
            ends_on_ground: args.until_s.is_some(),
            airframe: &airframe,
            link: &mut link,
            stop,
            truth_log,
            envelopes: &mut envelopes,
            pacer: &mut pacer,
            parent,
            reply: None,
            all_reported: true,
            had_request: false,
            ticks: 0,
        };
        match flight.fly() {
            FlightEnd::Stop => return Ok(ExitReason::Stopped),
            FlightEnd::Complete(report) => return Ok(ExitReason::Complete(report)),
            FlightEnd::Failed(problem) => return Err(problem),
            FlightEnd::Restart => {
                info!("the autopilot asks for a new flight");
                // From the same setup, so that a restart repeats the first flight to the bit.
                plant = Plant::new(setup)?;
                // Packets of the flight before belong to another session and are refused.
                link.begin_session().at(PROGRAM)?;
            }
        }
    }
}

fn resolve(name: &str) -> Result<SocketAddr, Problem> {
    let addresses = name.to_socket_addrs().at(format_args!("--autopilot {name}"))?.next();
    match addresses {
        None => Err(problem!("--autopilot {name}: the name has no address")),
        Some(address) if address.port() == 0 => {
            Err(problem!("--autopilot {name}: port 0 is no port; allowed are 1 to 65535"))
        }
        Some(address) => Ok(address),
    }
}
