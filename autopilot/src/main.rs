//! The autopilot as a separate program; `sitl autopilot` is the same.

use std::process::ExitCode;

use autopilot::run::{self, AutopilotArgs};
use clap::Parser;

/// The flight software.
#[derive(Parser)]
#[command(version)]
struct AutopilotCli {
    #[command(flatten)]
    autopilot: AutopilotArgs,
}

fn main() -> ExitCode {
    host_io::process::take_size_limit_as_error();
    let cli = AutopilotCli::try_parse().unwrap_or_else(|error| match error.use_stderr() {
        true => host_io::console::refuse(&error.render(), error.exit_code()),
        false => error.exit(),
    });
    host_io::console::show();
    match run::run(&cli.autopilot) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error}");
            ExitCode::FAILURE
        }
    }
}
