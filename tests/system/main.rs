//! What no single crate can promise: the whole in one process, and the real programs as processes. One program, because each test
//! program links everything.
#![expect(
    clippy::disallowed_methods,
    reason = "the other side of real programs: sockets, waiting, and the wall clock as bound"
)]

mod airframes;
mod checkcase;
mod clients;
mod closed_loop;
mod determinism;
mod edges;
mod events;
mod files;
mod flights;
mod flood;
mod fly;
mod ground;
mod lossy_link;
mod missions;
mod pace;
mod paper;
mod parameter_file;
mod plant_link;
mod processes;
mod programs;
mod recorder;
mod replay;
mod screen;
