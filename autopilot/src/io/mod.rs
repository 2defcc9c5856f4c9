//! Sockets and waiting: everything of the autopilot that touches the outside.

pub mod gcs_link;
pub mod log_folder;
pub mod plant_link;
pub mod recorder;
pub mod status;
pub mod store;

/// Place of what the system refuses at the start.
pub(crate) const HERE: &str = "autopilot";
