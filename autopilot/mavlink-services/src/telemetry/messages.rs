//! One function for each message that is streamed or asked for.

pub mod about;
pub mod actuators;
pub mod pose;
pub mod references;
pub mod sensors;
pub mod signals;
pub mod status;
