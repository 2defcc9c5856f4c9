//! The services of the operating system that both programs need; independent of aircraft.
//!
//! The autopilot and the plant must not depend on each other, but both wait on a datagram socket, run on a core, end on request, show
//! log lines and write files. This crate provides these services to both.
//!
//! | question | file |
//! |---|---|
//! | how does a process wait for a packet? | [`socket`] |
//! | on which core does a thread run, what ends a process? | [`process`] |
//! | where do log lines go? | [`console`] |
//! | which files are read, and which are replaced? | [`mod@file`] |
//! | which addresses and files has the second vehicle on a computer? | [`instance`] |
//! | how are ticks written to a file and read back? | [`tick_log`] |
//! | how does a container engine check a process? | [`health`] |
//! | which number identifies a flight on the link? | [`session`] |
//! | where is the clock read? | [`clock`] |
//!
//! # Example
//!
//! Files that the user names are read up to a limit, and replaced only where they are recognised:
//!
//! ```
//! use host_io::{Stop, file};
//!
//! let folder = tempfile::tempdir()?;
//! let path = folder.path().join("table.csv");
//! file::write(&path, b"# made here\n1,2\n", b"# made here")?;
//! assert_eq!(file::read_text(&path, 1_000)?, "# made here\n1,2\n");
//!
//! std::fs::write(&path, "of another program")?;
//! assert!(file::write(&path, b"# made here\n3,4\n", b"# made here").is_err());
//!
//! // Every loop reads this flag; signals and the parent process set it.
//! let stop = Stop::new();
//! stop.request();
//! assert!(stop.is_requested());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod clock;
pub mod console;
pub mod file;
pub mod folder;
pub mod health;
pub mod instance;
pub mod problem;
pub mod process;
pub mod session;
pub mod socket;
pub mod tick_log;

pub use instance::Instance;
pub use process::Stop;
pub use socket::{LinkSocket, Wait};
