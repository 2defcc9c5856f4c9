//! The plant as a process: command line, socket to the autopilot, pacing by the wall clock, truth log.
//!
//! ```text
//! sense ─> ask ─────────────> autopilot ────────> answer ─> request ─> wait until due ─> advance ─> sense ..
//!           └ again, if no answer comes             ├ fault: reply rides in the next packet
//!                                                   ├ restart: a new session
//!                                                   └ pace ─> pacer <─ orders of the parent process
//! ```
//!
//! The wall clock decides when a tick is asked for, never what is computed: the same flight at any speed
//! gives the same bits, also with pauses and single steps in between. While time stands still (pause, slow
//! motion, on the ground) the plant asks about 20 times a second without a control step, so that it is seen
//! to be alive, and faults, a restart and another pace can still be requested.

mod args;
mod flight;
pub mod header;
mod link;
mod pacer;
mod parent;
mod run;
mod speed;
mod status;

pub use args::{CORE_MAX, PlantArgs, Speed, parse_earth, parse_period, whole};
pub use flight::FlightReport;
pub use link::LinkError;
pub use run::{ExitReason, RunError, run};
pub use status::PlantLine;
