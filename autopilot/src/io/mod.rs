//! Sockets and waiting: everything of the autopilot that touches the outside.

use std::thread::JoinHandle;

use tracing::warn;

pub mod gcs_link;
pub mod log_folder;
pub mod plant_link;
pub mod recorder;
pub mod status;
pub mod store;

/// Place of what the system refuses at the start.
pub(crate) const HERE: &str = "autopilot";

/// Waits for a thread, and warns if it has panicked.
pub(crate) fn join<T>(thread: Option<JoinHandle<T>>, name: &str) -> Option<T> {
    thread?.join().inspect_err(|_| warn!("the {name} has broken down")).ok()
}
