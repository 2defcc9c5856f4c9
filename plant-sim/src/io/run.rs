//! The plant process from its options to its end.

use std::io::{self, Write};
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;

use host_io::health::HealthFile;
use host_io::tick_log::{Kind, TickLogWriter};
use host_io::{LinkSocket, Stop, console, process};
use tracing::{info, warn};

use super::RunError;
use super::args::PlantArgs;
use super::flight::{Flight, FlightEnd, FlightReport};
use super::header::Envelopes;
use super::link::{Link, RESEND_AFTER};
use super::pacer::Pacer;
use super::parent::Parent;
use crate::plant::Plant;
use crate::setup::PlantSetup;

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
pub fn run(args: &PlantArgs) -> Result<ExitReason, RunError> {
    let stop = Stop::new();
    stop.on_signals()?;
    let parent = Parent::new(args.with_parent, args.status, &stop)?;
    let setup = args.plant_setup()?;
    // Before the socket: a flight that cannot start ends with its error instead of waiting for an autopilot.
    let plant = args.plant(&setup)?;
    let autopilot = args.autopilot.clone();
    let peer = resolve(&autopilot.unwrap_or_else(|| args.instance.plant_link().to_string()))?;
    let socket = LinkSocket::connect("plant-sim", "plant link", peer, args.wait, RESEND_AFTER)?;
    let create = |path: &PathBuf| TickLogWriter::create(path, Kind::Truth);
    let mut truth_log = args.truth_log.as_ref().map(create).transpose()?;
    if let Some(cpu) = args.cpu
        && let Err(error) = process::pin_this_thread(cpu)
    {
        warn!(%error, "running on any core");
    }
    info!(autopilot = %peer, speed = %args.speed, "plant ready");
    let health = args.health_file.as_deref().map(HealthFile::new).transpose()?;
    let link = Link::new(socket, setup.airframe.aircraft(), stop.clone(), health)?;
    let end = fly(args, &setup, plant, link, &stop, &parent, &mut truth_log);
    if let Some(log) = truth_log {
        log.finish()?;
    }
    let exit = end?;
    if let (true, ExitReason::Complete(report)) = (args.report, exit) {
        let line = serde_json::to_string(&report).map_err(io::Error::other)?;
        writeln!(console::out(), "{line}")?;
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
) -> Result<ExitReason, RunError> {
    let mut pacer = Pacer::new(setup.period, args.speed, args.start_paused);
    let mut plant = first;
    let mut envelopes = Envelopes::new(&args.scenario, setup).map_err(io::Error::from)?;
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
        match flight.fly()? {
            FlightEnd::Stop => return Ok(ExitReason::Stopped),
            FlightEnd::Complete(report) => return Ok(ExitReason::Complete(report)),
            FlightEnd::Restart => {
                info!("the autopilot asks for a new flight");
                plant = Plant::new(setup)?;
                link.begin_session()?;
            }
        }
    }
}

fn resolve(name: &str) -> Result<SocketAddr, RunError> {
    let failed = |source| RunError::Resolve { name: name.to_owned(), source };
    let mut addresses = name.to_socket_addrs().map_err(failed)?;
    let nothing = || failed(io::Error::other("the name has no address"));
    let address = addresses.next().ok_or_else(nothing)?;
    if address.port() == 0 { Err(RunError::Port { name: name.to_owned() }) } else { Ok(address) }
}
