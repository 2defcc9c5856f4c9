//! The autopilot as a program of its own; `sitl autopilot` is the same.

use std::process::ExitCode;

use autopilot::run::{self, AutopilotArgs};
use clap::Parser;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;

/// The flight software.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(flatten)]
    autopilot: AutopilotArgs,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let filter = EnvFilter::builder().with_default_directive(LevelFilter::INFO.into());
    tracing_subscriber::fmt()
        .with_env_filter(filter.from_env_lossy())
        .with_writer(std::io::stderr)
        .log_internal_errors(false)
        .init();
    match run::run(&cli.autopilot) {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error}");
            ExitCode::FAILURE
        }
    }
}
