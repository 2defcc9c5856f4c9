//! The flight software: everything between the plant link and the ground stations.
//!
//! ```text
//!  plant link thread                                    ground-station threads (tokio)
//!  ┌───────────────────────────────────┐   intents      ┌──────────────────────────────┐
//!  │ io::plant_link ── autopilot ──────┼<───────────────┼── mavlink services           │
//!  │                   │ vehicle       │   events,      │      ^ bytes                 │
//!  │                   └ FlightControl ┼───────────────>┼── io::gcs_link ── sockets    │
//!  └───────────────────────────────────┘   snapshots    └──────────────────────────────┘
//! ```
//!
//! Both directions are bounded channels, so nothing on the right can delay a control step. There is no
//! I/O outside `io/`, and no clock outside `clock.rs`.

pub mod autopilot;
pub mod clock;
pub mod config;
pub mod event;
pub mod io;
pub mod mavlink;
pub mod own_law;
pub mod parameters;
pub mod recorder;
pub mod run;
pub mod script;
pub mod termination;
pub mod transitions;
pub mod vehicle;
