//! The aircraft and the world it flies in: the nonlinear six-degree-of-freedom plant.
//!
//! The crate `plant-dynamics` computes it, and this one has all its names; [`Plant`] is the entry point. Files and the process are
//! here: nothing outside [`io`] reads a clock or opens a socket.
//!
//! | question | file |
//! |---|---|
//! | what are the numbers of the aircraft? | `aircraft/tvc_jet/airframe.toml`, read by [`airframe_file`] |
//! | what is flown, and which faults occur when? | `scenarios/*.toml`, read by [`scenario`] |
//!
//! # A flight
//!
//! ```
//! use icd::{Actuators, ControlPeriod, tvc_jet};
//! use plant_sim::{Airframe, Plant, ReadAirframe as _, Scenario};
//!
//! let airframe = Airframe::paper();
//! let case1 = Scenario::from_toml("case1.toml", scenarios::CASE1, &airframe.effectors)?.plant;
//! let setup = case1.setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
//!
//! // The commands of the trim for four seconds; the left elevator jams after three.
//! let mut plant = Plant::new(&setup)?;
//! let commands = plant.trim().positions;
//! for _ in 0..2_000 {
//!     let _measured = plant.sense();
//!     plant.advance(&Actuators::new(commands));
//! }
//! let truth = plant.truth();
//! assert!(truth.body_rates.0.x > 0.1, "it rolls to the right: {} rad/s", truth.body_rates.0.x);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod airframe_file;
pub mod config;
pub mod grade_file;
pub mod io;
pub mod scenario;

pub use plant_dynamics::*;

pub use airframe_file::ReadAirframe;
pub use scenario::{PlantPart, Scenario};
