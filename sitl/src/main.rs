//! The command line; see `sitl::cli`.

use std::process::ExitCode;

fn main() -> ExitCode {
    sitl::cli::main(None)
}
