//! Laws, allocation, isolation and damage, flown.
#![expect(clippy::unwrap_used, clippy::panic, reason = "what fails here fails the test")]

mod beyond_the_paper;
mod damage;
mod fault_known;
mod ground;
mod isolation;
mod laws;
mod plans;
mod script_flight;
mod wls;
