//! Sees both sides: flies plant and autopilot together and judges the flights.

pub mod closed_loop;
pub mod linearize;
pub mod dispersion;
pub mod figures;
pub mod metrics;
pub mod paper;
pub mod report;
pub mod runner;
pub mod table;
