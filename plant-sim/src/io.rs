//! The plant as a process: command line, socket to the autopilot, pacing by the wall clock, truth log.
//!
//! ```text
//! sense ─> ask ─────────────> autopilot ────────> answer ─> request ─> wait until due ─> advance ─> sense ..
//!           └ again, if no answer comes             └ fault: reply rides in the next packet
//!                                                     restart: a new session
//! ```
//!
//! The wall clock decides when a tick is asked for, never what is computed: the same flight at any speed
//! gives the same bits. While time stands still (slow motion, on the ground) the plant asks about 20 times
//! a second without a control step, so that faults and a restart can still be requested.

mod args;
mod flight;
mod link;
mod pacer;
mod run;

pub use args::{PlantArgs, Speed, parse_earth, parse_period};
pub use flight::FlightReport;
pub use link::LinkError;
pub use run::{ExitReason, RunError, run};
