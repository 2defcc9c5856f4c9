//! The autopilot process from its options to its end.

use std::path::PathBuf;
use std::thread::{self, JoinHandle};

use host_io::health::HealthFile;
use host_io::problem::{At as _, Problem, problem};
use host_io::tick_log::{Kind, TickLogWriter};
use host_io::{LinkSocket, Stop, process};
use tokio::sync::watch;
use tracing::{info, warn};

use crate::config;
use crate::io::HERE;
use crate::io::gcs_link::{ControlEnded, GcsConfig, GcsLink, Logs};
use crate::io::plant_link::{GroundChannels, PlantLink, RECEIVE_TIMEOUT, channels};
use crate::io::recorder::{self, GroundFeed, Recorder, RecorderConfig};
use crate::io::status::{self, Listening, StatusLine, StatusSource};
use crate::io::store::{KeptKey, KeptParameters, KeptPlan};
use flight_management::autopilot::Autopilot;
use flight_management::parameters::Parameters;

mod args;

pub use args::{
    AutopilotArgs, ConfigFile, Ftc, GroundStationArgs, GroundStationTable, LawArgs, RecordingArgs,
    ScriptArgs,
};

/// Flies until the process receives a request to end.
///
/// Call it before the process starts any thread: it changes how the process handles signals.
pub fn run(args: &AutopilotArgs) -> Result<(), Problem> {
    let stop = Stop::new();
    stop.on_signals().at(HERE)?;
    if args.with_parent {
        stop.with_parent().at(HERE)?;
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
    // The launcher reports it to its operator.
    let inherited = config::inherited(&model_file.aircraft, &parameters);
    if let Some(inherited) = inherited.filter(|_| !args.with_parent) {
        warn!("{inherited}");
    }
    let address = args.plant_link.unwrap_or_else(|| args.instance.plant_link());
    let socket =
        LinkSocket::listen("autopilot", "plant link", address, args.wait, RECEIVE_TIMEOUT)?;
    let listening = socket.local_address().at(HERE)?;
    let create = |path: &PathBuf| TickLogWriter::create(path, Kind::ControlSteps);
    let step_log = args.step_log.as_ref().map(create).transpose().at("step log")?;
    let (status, printer) = args.status.then(status::channel).unzip();
    let (recorder, ground_feed) = args.recorder(&parameters, status.clone())?.unzip();
    let (ground, control) = channels();
    let limit_bytes = args.recording.limit_bytes();
    let folder = recorder.as_ref().and_then(|_| args.log_folder());
    let logs = folder.map(|folder| Logs { folder, limit_bytes });
    let config = args.links()?.map(|links| GcsConfig {
        links,
        parameters,
        defaults: model_file.defaults,
        model: settings.model,
        identity: args.ground_stations.identity,
        script: settings.script.clone(),
        kept,
        kept_plan,
        kept_key,
        logs,
    });
    let ground_stations =
        config.map(|config| GroundStations::start(&config, ground, ground_feed, &stop));
    let ground_stations = ground_stations.transpose()?;
    if let Some(printer) = printer {
        let stations = ground_stations.as_ref().map(|stations| stations.listening.clone());
        let ground_stations = stations.unwrap_or_default();
        let first = StatusLine::Listening { plant_link: listening, ground_stations };
        status::start(printer, first, stop.clone()).at(HERE)?;
    }
    info!(plant_link = %listening, "autopilot ready");
    let autopilot = Autopilot::new(&settings);
    let health = args.health_file.as_deref().map(HealthFile::new).transpose()?;
    let mut link = PlantLink::new(socket, autopilot, control, status, step_log, stop);
    (link.health, link.recorder) = (health, recorder);
    let cpu = args.cpu;
    let control = move || {
        if let Some(cpu) = cpu
            && let Err(error) = process::pin_this_thread(cpu)
        {
            warn!(%error, "running on any core");
        }
        link.run()
    };
    let control_thread = thread::Builder::new().name("plant link".to_owned()).spawn(control);
    let finished_log = control_thread
        .at(HERE)?
        .join()
        .map_err(|_| problem!("{HERE}: the control thread has broken down"))??;
    ground_stations.map_or(Ok(()), GroundStations::end)?;
    drop(finished_log);
    Ok(())
}

impl AutopilotArgs {
    /// The recorder, if flight logs are enabled. Where the user's data folder cannot be written and no option asks for logs,
    /// the flight goes on without.
    fn recorder(
        &self,
        parameters: &Parameters,
        status: Option<StatusSource>,
    ) -> Result<Option<(Recorder, GroundFeed)>, Problem> {
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
    thread: JoinHandle<Result<(), ControlEnded>>,
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
    ) -> Result<Self, Problem> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.at(HERE)?;
        let mut link = runtime.block_on(GcsLink::open(config))?;
        link.ground_feed = ground_feed;
        let listening = link.listening().clone();
        let (shutdown, shutdown_requested) = watch::channel(false);
        let stop = stop.clone();
        let serve = move || {
            let result = runtime.block_on(link.run(channels, shutdown_requested));
            stop.request();
            result
        };
        let thread = thread::Builder::new().name("ground stations".to_owned()).spawn(serve);
        Ok(Self { thread: thread.at(HERE)?, shutdown, listening })
    }

    fn end(self) -> Result<(), Problem> {
        // A thread that has ended already needs no request.
        let _ = self.shutdown.send(true);
        match self.thread.join() {
            // The control thread ends first in normal operation.
            Ok(Ok(()) | Err(ControlEnded)) => Ok(()),
            Err(_) => Err(problem!("{HERE}: the ground-station thread has broken down")),
        }
    }
}
