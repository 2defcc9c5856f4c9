//! Conversations in virtual time: a ground station that speaks through the crate's own encoder, the real
//! control side, and a plant that says what the test tells it to.

mod commands;
mod faults;
mod loss;
mod offboard;
mod params;
mod robustness;
pub(super) mod world;
