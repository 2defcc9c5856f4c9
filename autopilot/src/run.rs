//! The autopilot process from its options to its end.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::thread;

use host_io::tick_log::{Kind, LogError, TickLogWriter};
use host_io::{BindError, LinkSocket, Stop, cpu};
use tracing::{info, warn};

use crate::autopilot::{Autopilot, Settings};
use crate::config::ConfigError;
use crate::io::channels;
use crate::io::plant_link::{PATIENCE, PlantLink, PlantLinkError};
use crate::io::status::{self, StatusLine};
use crate::parameters::ParameterError;

mod args;

pub use args::{AutopilotArgs, ControlSetup, Ftc};

/// Why the autopilot ended in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitReason {
    /// It was told to.
    Stopped,
}

/// Why the autopilot cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A configuration file is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A file that is not a setup.
    #[error("{}: not a control setup of this version", path.display())]
    Setup {
        /// The file.
        path: PathBuf,
    },
    /// A parameter is wrong.
    #[error("--param: {0}")]
    Parameter(#[from] ParameterError),
    /// No socket.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The link is over.
    #[error(transparent)]
    Link(#[from] PlantLinkError),
    /// The step log cannot be written.
    #[error("step log: {0}")]
    Log(#[from] LogError),
    /// The system refuses signals, threads or output.
    #[error("autopilot: {0}")]
    System(#[from] io::Error),
}

/// Flies until the process is told to end.
///
/// Call it before the process starts any thread: it changes how the process takes signals.
///
/// # Errors
/// [`RunError`] tells the operator what to mend.
pub fn run(args: &AutopilotArgs) -> Result<ExitReason, RunError> {
    let stop = Stop::new();
    stop.on_signals()?;
    if args.with_parent {
        stop.with_parent()?;
    }
    let (control, parameters) = args.control_setup()?;
    let settings = Settings {
        belief: control.belief,
        gains: parameters.gains,
        limits: parameters.limits,
        references: control.references,
    };
    let address = args.plant_link;
    let socket = LinkSocket::listen("autopilot", "plant link", address, args.wait, PATIENCE)?;
    let listening = socket.local_address()?;
    let create = |path: &PathBuf| TickLogWriter::create(path, Kind::ControlSteps);
    let step_log = args.step_log.as_ref().map(create).transpose()?;
    let (_ground, channels) = channels::channels();
    let status = if args.status {
        Some(status::start(StatusLine::Listening { plant_link: listening }, stop.clone())?)
    } else {
        None
    };
    info!(plant_link = %listening, "autopilot ready");
    let autopilot = Autopilot::new(&settings);
    let link = PlantLink::new(socket, autopilot, channels, status, step_log, stop);
    let cpu = args.cpu;
    let control_thread = thread::Builder::new().name("plant link".to_owned()).spawn(move || {
        if let Some(cpu) = cpu
            && let Err(error) = cpu::pin_this_thread(cpu)
        {
            warn!(%error, "running on any core");
        }
        link.run()
    })?;
    match control_thread.join() {
        Ok(result) => result?,
        Err(_) => return Err(io::Error::other("the control thread has broken down").into()),
    }
    Ok(ExitReason::Stopped)
}

/// Where ground stations listen if nothing else is asked for: QGroundControl, and offboard scripts.
pub const DEFAULT_GROUND_STATIONS: [SocketAddr; 2] = [local(14_550), local(14_540)];

const fn local(port: u16) -> SocketAddr {
    SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), port)
}
