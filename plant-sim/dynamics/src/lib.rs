//! The nonlinear six-degree-of-freedom plant: what computes in a step. What reads files and options is in `plant-sim`, which has
//! all names of this crate too, so that the optimiser compiles none of it.
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
//! Nothing here reads a clock or opens a file; the same [`PlantSetup`] and the same commands give the same bits. Transcendental
//! functions come from `libm`, so that a new host does not change them.
//!
//! | question | file |
//! |---|---|
//! | where does a fault act? | [`faults`], and nowhere else |
//! | when is the aircraft lost? | [`limits`], with the numbers of the airframe file |
//! | what are the numbers of the aircraft? | [`airframe`] |
//! | which forces act? | [`aerodynamics`], [`propulsion`], [`earth`], [`contact`] |
//! | what is the motion? | [`rigid_body`], assembled in [`dynamics`] |

pub mod aerodynamics;
pub mod airframe;
pub mod atmosphere;
pub mod contact;
pub mod damage;
mod date;
pub mod derivatives;
pub mod dynamics;
pub mod earth;
pub mod faults;
pub mod gear;
pub mod geodesy;
pub mod ground;
pub mod integrator;
pub mod limits;
pub mod noise;
pub mod plant;
pub mod propulsion;
mod rail;
pub mod range;
pub mod release;
pub mod rigid_body;
pub mod sensors;
pub mod servos;
pub mod settling;
pub mod setup;
pub mod start;
pub mod step_limit;
pub mod tables;
pub mod touchdown;
pub mod trim;
pub mod truth;
pub mod wind;

#[cfg(test)]
mod tests;

pub use airframe::Airframe;
pub use contact::ContactFailure;
pub use date::Date;
pub use earth::EarthModel;
pub use faults::ScheduledFault;
pub use gear::Gear;
pub use ground::{GroundSetup, GroundStart};
pub use limits::{Attained, Exceeded, FlightLimits};
pub use plant::Plant;
pub use release::ReleaseSetup;
pub use sensors::{GradeName, SensorSettings};
pub use setup::{PlantSetup, SetupError};
pub use start::{Start, StartPart};
pub use trim::Trim;
pub use truth::Truth;
pub use wind::WindSettings;
