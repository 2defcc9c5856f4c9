//! The plant as a program of its own; `sitl plant-sim` is the same.

use std::process::ExitCode;

use clap::Parser;
use plant_sim::io::{self, PlantArgs};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;

/// The aircraft and the world it flies in.
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(flatten)]
    plant: PlantArgs,
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let filter = EnvFilter::builder().with_default_directive(LevelFilter::INFO.into());
    tracing_subscriber::fmt()
        .with_env_filter(filter.from_env_lossy())
        .with_writer(std::io::stderr)
        .log_internal_errors(false)
        .init();
    match io::run(&cli.plant) {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error}");
            ExitCode::FAILURE
        }
    }
}
