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

use std::io;
use std::path::PathBuf;

use host_io::BindError;
use host_io::file::FileProblem;
use host_io::health::HealthFileError;
use host_io::tick_log::LogError;

use crate::config::ConfigError;
use crate::setup::SetupError;

mod args;
mod flight;
pub mod header;
mod link;
mod pacer;
mod parent;
mod run;

pub use args::{CORE_MAX, PlantArgs, Speed, parse_earth, parse_period, whole};
pub use flight::FlightReport;
pub use link::LinkError;
pub use parent::PlantLine;
pub use run::{ExitReason, run};

/// Why the plant cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A file cannot be read.
    #[error("{}: {source}", path.display())]
    Read { path: PathBuf, source: FileProblem },
    /// Neither a shipped scenario nor a file.
    #[error(
        "--scenario {name}: there is no such scenario and no such file; the scenarios are {known}"
    )]
    NoScenario { name: String, known: String },
    /// A file is not a setup.
    #[error("{}: not a plant setup of this version", path.display())]
    Setup { path: PathBuf },
    /// A configuration file is invalid.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A fault of a scenario that the aircraft cannot have.
    #[error("{file}: {source}")]
    Fault {
        file: String,
        /// The fault and the reason.
        source: Box<SetupError>,
    },
    /// The flight cannot start.
    #[error(transparent)]
    Start(#[from] SetupError),
    /// This aircraft cannot fly this scenario.
    #[error("airframe {airframe}, scenario {scenario}: {source}")]
    Flight { airframe: String, scenario: String, source: Box<SetupError> },
    #[error("--autopilot {name}: port 0 is no port; allowed are 1 to 65535")]
    Port { name: String },
    #[error("--autopilot {name}: {source}")]
    Resolve { name: String, source: io::Error },
    /// A socket could not be opened.
    #[error(transparent)]
    Bind(#[from] BindError),
    /// The link has ended.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The truth log is incomplete.
    #[error("truth log: {0}")]
    Log(#[from] LogError),
    /// The health file cannot be written.
    #[error(transparent)]
    Health(#[from] HealthFileError),
    /// The system refuses signals, threads or output.
    #[error("plant-sim: {0}")]
    System(#[from] io::Error),
}
