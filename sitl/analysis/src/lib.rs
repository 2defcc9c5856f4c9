//! Flies plant and autopilot together in one process, and measures, draws and reports what became of the flight.
//!
//! ```text
//! configuration, settings ─> closed_loop ─> fly, paper, mission, envelope, margins, false_alarms ─> table, chart, page
//! flight log ─> plot, replay ─> chart, page
//! plant ─> linearize, design ─> the controller's model and gains
//! ```
//!
//! It starts no process, opens no socket and draws nothing on a terminal but lines of progress: a flight is a function
//! of setup, seed and inputs. What starts and watches the two processes is the crate `sitl`.

pub mod chart;
pub mod closed_loop;
pub mod configuration;
pub mod design;
pub mod dispersion;
pub mod envelope;
pub mod false_alarms;
pub mod flight_log;
pub mod fly;
pub mod linearize;
pub mod margins;
pub mod metrics;
pub mod mission;
mod page;
pub mod paper;
pub mod plot;
pub mod replay;
pub mod runner;
pub mod settings;
pub mod table;
