//! The process of the flight software: plant link, ground-station links, files and threads.
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
//!
//! Start with [`run::run`]. Everything that needs no process is in separate crates, which this one re-exports:
//! [`flight_management`] (modes, plans, parameters, scripts), [`mavlink`] (the services for ground stations) and
//! [`recorder`] (the content of a flight log).
//!
//! ```
//! let model = autopilot::configuration::model("tvc_jet.toml", aircraft::DEFAULT_MODEL)?;
//! let ground = autopilot::mavlink::Ground::new(&model.defaults, &model.aircraft, &[]);
//! assert!(!ground.needs_snapshot());
//! # Ok::<(), flight_management::TextError>(())
//! ```

pub mod clock;
pub mod config;
pub mod io;
pub mod run;

pub use ::recorder;
pub use flight_management::{
    self, autopilot, command, configuration, event, event_text, fault_list, own_law, parameters,
    script, vehicle,
};
pub use mavlink_services as mavlink;
