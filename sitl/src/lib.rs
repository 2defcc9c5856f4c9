//! Starts plant and autopilot as two processes, watches them, and is the command line of the project.
//!
//! What flies in one process, measures, draws and reports are the crates of `lab/`. [`cli::main`] is the program;
//! [`udp_flight::fly_udp`] flies a setup through both processes, to the same bits as [`lab_judges::closed_loop::fly`]:
//!
//! ```no_run
//! use std::path::Path;
//!
//! use icd::ControlPeriod;
//! use plant_sim::EarthModel;
//! use lab_paper::cases::{Case, Conditions};
//! use sitl::udp_flight::fly_udp;
//!
//! let conditions = Conditions {
//!     earth: EarthModel::Wgs84,
//!     period: ControlPeriod::DEFAULT,
//!     step_us: 1_000,
//!     gyro_noise_rad_s: 0.0,
//!     turbulence_m_s: 0.0,
//!     seed: 1,
//! };
//! let setup = Case::new(1, &conditions)?.setup;
//! let program = Path::new("target/release/sitl");
//! let end = fly_udp(program, &setup, &mut |record| println!("{} m", record.truth.altitude_m))?;
//! assert!(!end.on_ground);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod actions;
pub mod arrangement;
pub mod bench;
pub mod cli;
pub mod echo;
pub mod launch;
pub mod udp_flight;
