//! Fuzz targets: every place where bytes or texts come from outside. docs/fuzzing.md has the commands.
//!
//! Each target takes bytes as a row of choices: which seed is damaged and how, or what is sent next. So random bytes
//! reach behind checksums and syntax, under the random inputs of `cargo test` as well as under a fuzzer that looks
//! for coverage. Seeds come from the project's own encoders and files.
#![expect(clippy::unwrap_used, reason = "the seeds are good")]

mod choices;
mod logs;
mod mavlink_world;
mod messages;
mod packets;
mod texts;

/// Logs as the recorder writes them, by the code that `sitl`'s own tests use.
#[path = "../../sitl/analysis/src/replay/testing.rs"]
mod testing;

/// Where `testing` looks for it.
mod closed_loop {
    pub use sitl::closed_loop::{FlightSetup, settings};
}
