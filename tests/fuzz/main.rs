//! Fuzz targets: every interface that accepts bytes or texts from outside. docs/fuzzing.md has the commands.
//!
//! Each target interprets bytes as a sequence of choices: which seed to damage and how, or what to send next. So random bytes
//! get past checksums and syntax, under the random inputs of `cargo test` as well as under a fuzzer that searches
//! for coverage. Seeds come from the project's own encoders and files.
#![expect(clippy::unwrap_used, reason = "the seeds are good")]

mod choices;
mod logs;
mod mavlink_world;
mod messages;
mod packets;
mod texts;

/// Logs as the recorder writes them, by the same code as in `sitl`'s own tests.
#[path = "../../lab/logs/src/replay/tests/testing.rs"]
mod testing;
