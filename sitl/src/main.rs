//! The command line; see `sitl::cli`.

use std::process::ExitCode;

use clap::Parser;
use sitl::cli::{self, Cli};

fn main() -> ExitCode {
    host_io::console::show();
    cli::run(&Cli::parse()).unwrap_or_else(|error| {
        tracing::error!("{error}");
        ExitCode::FAILURE
    })
}
