//! Flies plant and autopilot together in one process, and measures, draws and reports what became of the flight.
//!
//! ```text
//! configuration, settings ─> closed_loop ─> fly, paper, mission, margins ─> table, chart, page
//! flight log ─> plot, replay ─> chart, page
//! plant ─> linearize, design ─> the controller's model and gains
//! plant ─> actuators, sensor_errors, turbulence ─> chart
//! ```
//!
//! It starts no process, opens no socket and draws nothing on a terminal but lines of progress: a flight is a function
//! of setup, seed and inputs. What starts and watches the two processes is the crate `sitl`.
//!
//! Start with [`closed_loop::fly`] and, for the flights of the paper, [`paper::cases::Case`]:
//!
//! ```
//! use lab_studies::closed_loop::fly;
//! use lab_studies::paper::cases::{Case, Conditions};
//! use icd::{ControlPeriod, SimTime};
//! use plant_sim::EarthModel;
//!
//! let conditions = Conditions {
//!     earth: EarthModel::Wgs84,
//!     period: ControlPeriod::DEFAULT,
//!     step_us: 1_000,
//!     gyro_noise_rad_s: 0.0,
//!     turbulence_m_s: 0.0,
//!     seed: 1,
//! };
//! let mut setup = Case::new(1, &conditions)?.setup;
//! setup.duration = SimTime::from_micros(1_000_000);
//! let mut altitude_m = 0.0;
//! let end = fly(&setup, &mut |record| altitude_m = record.truth.altitude_m)?;
//! assert!(!end.on_ground && altitude_m > 4_900.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use host_io::console;
pub use lab_engine::{builder, configuration, law, problem, settings};
pub use lab_judges::{closed_loop, metrics};

/// Prints a text. Where nobody reads any more, as behind `| head`, it is dropped: results are in files.
#[macro_export]
macro_rules! print_text {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = write!($crate::console::out(), $($text)*);
    }};
}

/// The same with a line feed.
#[macro_export]
macro_rules! print_line {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!($crate::console::out(), $($text)*);
    }};
}

pub mod actuators;
pub mod chart;
pub mod checkcase;
pub mod design;
pub mod fly;
pub mod linearize;
pub mod margins;
pub mod mission;
pub mod page;
pub mod paper;
pub mod plot;
pub mod replay;
pub mod runner;
pub mod sensor_errors;
pub mod trimmable;
pub mod turbulence;
