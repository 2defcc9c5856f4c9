//! The autopilot process from its options to its end.

use std::io;
use std::path::PathBuf;
use std::thread::{self, JoinHandle};

use host_io::tick_log::{Kind, LogError, TickLogWriter};
use host_io::{BindError, LinkSocket, Stop, cpu};
use tokio::sync::watch;
use tracing::{info, warn};

use crate::autopilot::{Autopilot, Settings};
use crate::config::ConfigError;
use crate::io::channels::{self, GroundChannels};
use crate::io::gcs_link::{self, GcsConfig, GcsError};
use crate::io::plant_link::{PATIENCE, PlantLink, PlantLinkError};
use crate::io::status::{self, StatusLine};
use crate::parameters::{ParameterError, Parameters};

mod args;

pub use args::{AutopilotArgs, ControlSetup, DEFAULT_GROUND_STATIONS, Ftc};

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
    /// Ground stations cannot be served.
    #[error(transparent)]
    Gcs(#[from] GcsError),
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
    let (ground, control) = channels::channels();
    let ground_stations = GroundStations::start(args, &settings, &parameters, ground, &stop)?;
    let status = if args.status {
        Some(status::start(StatusLine::Listening { plant_link: listening }, stop.clone())?)
    } else {
        None
    };
    info!(plant_link = %listening, "autopilot ready");
    let autopilot = Autopilot::new(&settings);
    let link = PlantLink::new(socket, autopilot, control, status, step_log, stop);
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
    ground_stations.map_or(Ok(()), GroundStations::end)?;
    Ok(ExitReason::Stopped)
}

/// The thread that serves ground stations.
struct GroundStations {
    thread: JoinHandle<Result<(), GcsError>>,
    shutdown: watch::Sender<bool>,
}

impl GroundStations {
    /// `None` if there are to be no ground stations. If they cannot be served, the process ends.
    fn start(
        args: &AutopilotArgs,
        settings: &Settings,
        parameters: &Parameters,
        channels: GroundChannels,
        stop: &Stop,
    ) -> io::Result<Option<Self>> {
        if args.no_gcs {
            return Ok(None);
        }
        let config = GcsConfig {
            bind: args.gcs_bind(),
            endpoints: args.ground_stations().to_vec(),
            parameters: *parameters,
            belief: settings.belief,
        };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let (shutdown, told) = watch::channel(false);
        let stop = stop.clone();
        let serve = move || {
            let result = runtime.block_on(gcs_link::run(config, channels, told));
            stop.request();
            result
        };
        let thread = thread::Builder::new().name("ground stations".to_owned()).spawn(serve)?;
        Ok(Some(Self { thread, shutdown }))
    }

    fn end(self) -> Result<(), RunError> {
        // A thread that has ended already needs no telling.
        let _ = self.shutdown.send(true);
        match self.thread.join() {
            // The control thread ends first when all is well.
            Ok(Ok(()) | Err(GcsError::ControlEnded)) => Ok(()),
            Ok(Err(error)) => Err(error.into()),
            Err(_) => Err(io::Error::other("the ground-station thread has broken down").into()),
        }
    }
}
