//! Commands that fly, measure and draw: one flight ([`fly`]), what an aircraft can do ([`margins`], [`trimmable`]), the
//! controller's model and gains ([`linearize`], [`design`], [`new`]), and studies of single parts.
//!
//! ```text
//! configuration, settings ─> closed_loop ─> fly, mission, margins ─> table, chart, page
//! plant ─> linearize, design, new ─> the controller's model, gains, parameters
//! plant ─> actuators, sensor_errors, turbulence ─> chart
//! ```
//!
//! It starts no process, opens no socket and draws nothing on a terminal but lines of progress: a flight is a function
//! of setup, seed and inputs. What starts and watches the two processes is the crate `sitl`.

pub mod actuators;
pub mod checkcase;
pub mod design;
pub mod fly;
pub mod geometry;
pub mod linearize;
pub mod margins;
pub mod mission;
pub mod new;
pub mod sensor_errors;
pub mod trimmable;
pub mod turbulence;
