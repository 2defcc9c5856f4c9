//! Sees both sides: flies plant and autopilot together and judges the flights.

pub mod closed_loop;
pub mod linearize;
