//! What a process tells its operator, line by line, on the standard error.

use std::io::IsTerminal;

use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::LevelFilter;

/// Shows `info` and above; the environment variable `RUST_LOG` changes that.
///
/// A second call changes nothing.
pub fn show() {
    let filter = EnvFilter::builder().with_default_directive(LevelFilter::INFO.into());
    // An error means that somebody has done it already.
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter.from_env_lossy())
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .without_time()
        // A reader that went away must not end the flight.
        .log_internal_errors(false)
        .try_init();
}
