//! The aircraft and the world it flies in: the nonlinear six-degree-of-freedom plant.
//!
//! # Signal path of one control period
//!
//! ```text
//! commands -> servos -> faults -> aerodynamics, propulsion -> rigid_body -> integrator
//!                                   ^ wind, atmosphere         ^ earth        |
//!             sensors <- truth <----------------------------------------------+
//! ```
//!
//! [`Plant`] is the entry point: [`Plant::sense`], [`Plant::advance`], [`Plant::truth`], [`Plant::request`].
//! Nothing outside [`io`] reads a clock or opens a socket; the same [`PlantSetup`] and the same commands give the
//! same bits. Transcendental functions come from `libm`, so that a new host does not change them.
//!
//! | question | file |
//! |---|---|
//! | where does a fault act? | [`faults`], and nowhere else |
//! | when is the aircraft lost? | [`limits`], with the numbers of the airframe file |
//! | what are the numbers of the aircraft? | `aircraft/tvc_jet/airframe.toml`, read by [`airframe`] |
//! | what is flown, and which faults occur when? | `scenarios/*.toml`, read by [`scenario`] |
//! | which forces act? | [`aerodynamics`], [`propulsion`], [`earth`] |
//! | what is the motion? | [`rigid_body`], assembled in [`dynamics`] |
//!
//! # A flight
//!
//! ```
//! use icd::{Actuators, ControlPeriod, tvc_jet};
//! use plant_sim::{Airframe, Plant, Scenario};
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
//!     plant.advance(&Actuators { commands });
//! }
//! let truth = plant.truth();
//! assert!(truth.body_rates.0.x > 0.1, "it rolls to the right: {} rad/s", truth.body_rates.0.x);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod aerodynamics;
pub mod airframe;
pub mod atmosphere;
pub mod config;
pub mod damage;
mod date;
pub mod derivatives;
pub mod dynamics;
pub mod earth;
pub mod faults;
pub mod geodesy;
pub mod integrator;
pub mod io;
pub mod limits;
pub mod noise;
pub mod plant;
pub mod propulsion;
pub mod range;
pub mod release;
pub mod rigid_body;
pub mod scenario;
pub mod sensors;
pub mod servos;
pub mod setup;
pub mod start;
pub mod step_limit;
pub mod tables;
pub mod trim;
pub mod truth;
pub mod wind;

#[cfg(test)]
mod tests;

pub use airframe::Airframe;
pub use date::Date;
pub use earth::EarthModel;
pub use faults::ScheduledFault;
pub use limits::{Attained, Exceeded, FlightLimits};
pub use plant::Plant;
pub use release::ReleaseSetup;
pub use scenario::{PlantPart, Scenario};
pub use sensors::{GradeName, SensorSettings};
pub use setup::{PlantSetup, SetupError};
pub use start::{Start, StartPart};
pub use trim::Trim;
pub use truth::Truth;
pub use wind::WindSettings;
