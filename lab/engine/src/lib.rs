//! The engine of everything that flies in one process: from names, files and `--set` to a [`FlightSetup`], and from a setup to a
//! [`Flight`], tick by tick.
//!
//! ```text
//! SetupOptions ─> FlightSetup ─> Flight::new ─> step ─> Tick ─> judges
//! ```
//!
//! ```
//! use lab_engine::{Flight, SetupOptions};
//!
//! let mut options = SetupOptions::default();
//! options.set("plant.duration_s", 1.0).set("FTC_MODE", 0.0);
//! let mut flight = Flight::new(&options.setup("case1")?)?;
//! let mut altitude_m = 0.0;
//! while let Some(tick) = flight.step([]) {
//!     altitude_m = tick.plant.truth().altitude_m;
//! }
//! assert!(!flight.end().on_ground && altitude_m > 4_900.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! It writes no file, draws nothing, starts no process and opens no socket.

pub mod builder;
pub mod configuration;
pub mod fault_known;
pub mod fault_words;
pub mod flight;
pub mod geometry;
pub mod law;
pub mod settings;
pub mod watch;

pub use builder::{SetupBuilder, SetupOptions};
pub use flight::{Flight, FlightSetup};
pub use host_io::problem;
pub use host_io::problem::{At, Problem};
