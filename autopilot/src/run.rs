//! The autopilot process from its options to its end.

use std::io;
use std::path::PathBuf;
use std::thread::{self, JoinHandle};

use host_io::health::{HealthFile, HealthFileError};
use host_io::tick_log::{Kind, LogError, TickLogWriter};
use host_io::{BindError, LinkSocket, Stop, process};
use tokio::sync::watch;
use tracing::{info, warn};

use crate::config::ConfigError;
use crate::io::channels::{self, GroundChannels};
use crate::io::gcs_link::{GcsConfig, GcsError, GcsLink, Logs};
use crate::io::plant_link::{PlantLink, PlantLinkError, RECEIVE_TIMEOUT};
use crate::io::recorder::{self, GroundFeed, Recorder, RecorderConfig, RecorderError};
use crate::io::status::{self, Listening, StatusLine, StatusSource};
use crate::io::store::{KeptKey, KeptParameters, KeptPlan, KeyFileError};
use flight_management::autopilot::Autopilot;
use flight_management::parameters::{ParameterError, Parameters, SavedError, SavedProblem};
use mavlink_services::mission::SavedPlanError;

mod args;
mod ground_stations;

pub use args::{AutopilotArgs, Ftc, LawArgs, RecordingArgs, ScriptArgs};
pub use ground_stations::{ConfigFile, Endpoint, GroundStationArgs, GroundStationTable};

/// Why the autopilot ended without an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitReason {
    /// The process received a request to end.
    Stopped,
}

/// Why the autopilot cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A configuration file is invalid.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A file is not a setup.
    #[error("{}: not a control setup of this version", path.display())]
    Setup { path: PathBuf },
    /// A parameter is invalid.
    #[error("--param: {0}")]
    Parameter(#[from] ParameterError),
    /// Saved parameters cannot be used.
    #[error(transparent)]
    Saved(#[from] SavedError),
    /// A file of gains cannot be used.
    #[error("--gains {}: {problem}", file.display())]
    Gains {
        file: PathBuf,
        /// The error in it.
        problem: SavedProblem,
    },
    /// A saved plan cannot be used.
    #[error(transparent)]
    SavedPlan(#[from] SavedPlanError),
    /// The signing key cannot be used.
    #[error("signing: {0}")]
    Key(#[from] KeyFileError),
    /// A socket could not be opened.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// Ground stations cannot be served.
    #[error(transparent)]
    Gcs(#[from] GcsError),
    /// The plant link has ended.
    #[error(transparent)]
    Link(#[from] PlantLinkError),
    /// Flight logs cannot be written.
    #[error(transparent)]
    Recorder(#[from] RecorderError),
    /// The step log cannot be written.
    #[error("step log: {0}")]
    Log(#[from] LogError),
    /// The health file cannot be written.
    #[error(transparent)]
    Health(#[from] HealthFileError),
    /// The system refuses signals, threads or output.
    #[error("autopilot: {0}")]
    System(#[from] io::Error),
}

/// Flies until the process receives a request to end.
///
/// Call it before the process starts any thread: it changes how the process handles signals.
pub fn run(args: &AutopilotArgs) -> Result<ExitReason, RunError> {
    let stop = Stop::new();
    stop.on_signals()?;
    if args.with_parent {
        stop.with_parent()?;
    }
    let model_file = args.model()?;
    let kept = args.kept_parameters(&model_file.defaults)?;
    let (kept_plan, kept_key) = (args.kept_plan()?, args.kept_key()?);
    let summaries = [
        kept.as_ref().and_then(KeptParameters::summary),
        kept_plan.as_ref().and_then(KeptPlan::summary),
        kept_key.as_ref().and_then(KeptKey::summary),
    ];
    summaries.iter().flatten().for_each(|summary| info!("{summary}"));
    let saved = kept.as_ref().map_or(model_file.defaults, |kept| kept.parameters);
    let (settings, parameters) = args.control_setup_over(&model_file.aircraft, &saved)?;
    let address = args.plant_link.unwrap_or_else(|| args.instance.plant_link());
    let socket =
        LinkSocket::listen("autopilot", "plant link", address, args.wait, RECEIVE_TIMEOUT)?;
    let listening = socket.local_address()?;
    let create = |path: &PathBuf| TickLogWriter::create(path, Kind::ControlSteps);
    let step_log = args.step_log.as_ref().map(create).transpose()?;
    let (status, printer) = args.status.then(status::channel).unzip();
    let (recorder, ground_feed) = args.recorder(&parameters, status.clone())?.unzip();
    let (ground, control) = channels::channels();
    let identity = args.ground_stations.identity;
    let model = settings.model;
    let script = settings.script.clone();
    let limit_bytes = args.recording.limit_bytes();
    let folder = recorder.as_ref().and_then(|_| args.log_folder());
    let logs = folder.map(|folder| Logs { folder, limit_bytes });
    let config = args.links()?.map(|links| GcsConfig {
        links,
        parameters,
        defaults: model_file.defaults,
        model,
        identity,
        script,
        kept,
        kept_plan,
        kept_key,
        logs,
    });
    let ground_stations =
        config.map(|config| GroundStations::start(&config, ground, ground_feed, &stop));
    let ground_stations = ground_stations.transpose()?;
    if let Some(printer) = printer {
        let ground_stations =
            ground_stations.as_ref().map_or_else(Listening::default, GroundStations::listening);
        let first = StatusLine::Listening { plant_link: listening, ground_stations };
        status::start(printer, first, stop.clone())?;
    }
    info!(plant_link = %listening, "autopilot ready");
    let autopilot = Autopilot::new(&settings);
    let health = args.health_file.as_deref().map(HealthFile::new).transpose()?;
    let link = PlantLink::new(socket, autopilot, control, status, step_log, stop)
        .with_health_file(health)
        .with_recorder(recorder);
    let cpu = args.cpu;
    let control_thread = thread::Builder::new().name("plant link".to_owned()).spawn(move || {
        if let Some(cpu) = cpu
            && let Err(error) = process::pin_this_thread(cpu)
        {
            warn!(%error, "running on any core");
        }
        link.run()
    })?;
    let finished_log = match control_thread.join() {
        Ok(result) => result?,
        Err(_) => return Err(io::Error::other("the control thread has broken down").into()),
    };
    ground_stations.map_or(Ok(()), GroundStations::end)?;
    drop(finished_log);
    Ok(ExitReason::Stopped)
}

impl AutopilotArgs {
    /// The recorder, if flight logs are enabled. Where the user's data folder cannot be written and no option asks for logs,
    /// the flight goes on without.
    fn recorder(
        &self,
        parameters: &Parameters,
        status: Option<StatusSource>,
    ) -> Result<Option<(Recorder, GroundFeed)>, RecorderError> {
        let Some(folder) = self.log_folder() else { return Ok(None) };
        let limit_bytes = self.recording.limit_bytes();
        let introduction = recorder::introduction(&folder, limit_bytes);
        let config = RecorderConfig {
            folder,
            limit_bytes,
            rate: self.recording.log_rate,
            parameters: *parameters,
            status,
        };
        match Recorder::start(config) {
            Ok(recorder) => {
                info!("{introduction}");
                Ok(Some(recorder))
            }
            Err(problem) if self.recording.log_dir.is_none() => {
                warn!("no flight logs: {problem}; --log-dir names another folder, or none");
                Ok(None)
            }
            Err(problem) => Err(problem),
        }
    }
}

/// The thread that serves ground stations.
struct GroundStations {
    thread: JoinHandle<Result<(), GcsError>>,
    shutdown: watch::Sender<bool>,
    listening: Listening,
}

impl GroundStations {
    /// If it fails, the process ends.
    fn start(
        config: &GcsConfig,
        channels: GroundChannels,
        ground_feed: Option<GroundFeed>,
        stop: &Stop,
    ) -> Result<Self, RunError> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let link = runtime.block_on(GcsLink::open(config))?.with_ground_feed(ground_feed);
        let listening = link.listening().clone();
        let (shutdown, shutdown_requested) = watch::channel(false);
        let stop = stop.clone();
        let serve = move || {
            let result = runtime.block_on(link.run(channels, shutdown_requested));
            stop.request();
            result
        };
        let thread = thread::Builder::new().name("ground stations".to_owned()).spawn(serve)?;
        Ok(Self { thread, shutdown, listening })
    }

    fn listening(&self) -> Listening {
        self.listening.clone()
    }

    fn end(self) -> Result<(), RunError> {
        // A thread that has ended already needs no request.
        let _ = self.shutdown.send(true);
        match self.thread.join() {
            // The control thread ends first in normal operation.
            Ok(Ok(()) | Err(GcsError::ControlEnded)) => Ok(()),
            Ok(Err(error)) => Err(error.into()),
            Err(_) => Err(io::Error::other("the ground-station thread has broken down").into()),
        }
    }
}
