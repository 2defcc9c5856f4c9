//! Commands of operators to the aircraft: modes, plans, references, parameters and scripts around the laws. No I/O, no clock,
//! no MAVLink.
//!
//! ```text
//!   commands ──> Autopilot ──> Vehicle ──────> FlightControl ──> commands of the effectors
//!                 │    ^        mode, plan,      the laws
//!        events <─┘    └─ Script  references
//! ```
//!
//! Start with [`autopilot::Autopilot`]: the process calls it once for each control step, and so does a flight in one
//! process. [`vehicle`] accepts or refuses commands, [`parameters`] is the table of all tunables, [`script`]
//! reads scripts; [`command`] and [`event`] have the values that cross from and to the ground-station side.
//!
//! ```
//! use flight_management::parameters::Parameters;
//! use flight_management::vehicle::Reference;
//!
//! let mut parameters = Parameters::default();
//! parameters.set("REF_ALT_MAX", 6_000.0)?;
//! assert!(parameters.limits.check(Reference::Altitude(7_000.0), 7_000.0).is_err());
//! # Ok::<(), flight_management::parameters::ParameterError>(())
//! ```

pub mod autopilot;
pub mod command;
pub mod configuration;
pub mod event;
pub mod event_text;
pub mod fault_list;
pub mod own_law;
pub mod parameters;
pub mod script;
pub mod termination;
mod text_error;
pub mod vehicle;

pub use text_error::TextError;
