//! The plant as a separate program; `sitl plant-sim` is the same.

use std::process::ExitCode;

use clap::Parser;
use plant_sim::io::{self, PlantArgs};

/// The aircraft and the world it flies in.
#[derive(Parser)]
#[command(version)]
struct PlantCli {
    #[command(flatten)]
    plant: PlantArgs,
}

fn main() -> ExitCode {
    host_io::process::take_size_limit_as_error();
    let cli = PlantCli::try_parse().unwrap_or_else(|error| match error.use_stderr() {
        true => host_io::console::refuse(&error.render(), error.exit_code()),
        // Help and version are no errors: clap prints them to the standard output.
        false => error.exit(),
    });
    host_io::console::show();
    match io::run(&cli.plant) {
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error}");
            ExitCode::FAILURE
        }
    }
}
