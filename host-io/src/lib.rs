//! What both programs need of the operating system, and nothing about aircraft.
//!
//! The autopilot and the plant may not know each other, but both wait on a datagram socket, run on a
//! core, end when they are told to, tell their operator what happens, and write a log. Those things are
//! here once.
//!
//! | question | file |
//! |---|---|
//! | how does a process wait for a packet? | [`socket`] |
//! | on which core does a thread run? | [`cpu`] |
//! | who tells a process to end? | [`stop`] |
//! | what does the parent process say? | [`parent`] |
//! | which files are read, and which are replaced? | [`mod@file`] |
//! | how are ticks written to a file and read back? | [`tick_log`] |
//! | what does the operator read? | [`console`] |
//! | how does somebody outside see that all is well? | [`health`] |
//! | which number has a flight on the link? | [`session`] |
//! | who reads a clock? | [`clock`] |

pub mod clock;
pub mod console;
pub mod cpu;
pub mod file;
pub mod health;
pub mod parent;
pub mod session;
pub mod socket;
pub mod stop;
pub mod tick_log;

pub use socket::{BindError, LinkSocket, Wait};
pub use stop::Stop;
