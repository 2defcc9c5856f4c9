//! The plant as a process: command line, socket to the autopilot, pacing by the wall clock, truth log.
//!
//! ```text
//! sense ─> send ────────────> autopilot ────────> answer ─> request ─> wait until due ─> advance ─> sense ..
//!           └ again, if no answer comes             ├ fault: the reply is in the next packet
//!                                                   ├ restart: a new session
//!                                                   └ pace ─> pacer <─ requests of the parent process
//! ```
//!
//! The wall clock determines when a tick is flown, never a computed value: the same flight at any speed
//! gives the same bits, also with pauses and single steps in between. While time is paused (pause, slow
//! motion, on the ground) the plant sends about 20 packets a second without a control step, which show that it is
//! alive and let the autopilot request faults, a restart and another pace.

mod args;
mod flight;
pub mod header;
mod link;
mod pacer;
mod parent;
mod run;

pub use args::{CORE_MAX, PlantArgs, Speed, parse_earth, parse_period, whole};
pub use flight::FlightReport;
pub use parent::PlantLine;
pub use run::{ExitReason, run};
