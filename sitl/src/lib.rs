//! Starts plant and autopilot as two processes, watches them, and is the command line of the project.
//!
//! Everything that flies in one process, measures, draws and reports is the crate [`flight_analysis`], whose modules are
//! here under their own names.

pub use flight_analysis::{
    chart, closed_loop, configuration, design, envelope, false_alarms, fly, linearize, margins,
    metrics, mission, paper, plot, replay, runner, settings, table,
};

pub mod actions;
pub mod arrangement;
pub mod bench;
pub mod cli;
pub mod echo;
pub mod launch;
mod process;
pub mod udp_flight;
