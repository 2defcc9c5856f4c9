//! Whether the estimator knows how wrong it is: `sitl study estimator`.
//!
//! ```text
//! grade, seed ─> flight with manoeuvres in turbulence, on estimated states ─> error and covariance, once a second
//!                       many seeds ─> normalised squares against their 95 % band ─> table, figure
//! ```
//!
//! The normalised estimation error squared (NEES) of a group of three states is eᵀ P⁻¹ e. For a consistent filter it is distributed as
//! χ² with three degrees of freedom: its mean over N flights is 3 within a band that narrows with N (Bar-Shalom, Li, Kirubarajan,
//! Estimation with Applications to Tracking and Navigation, 2001, section 5.4.2).

use flight_control::CompensatorMode;
use icd::sensors::SensorKind;
use plant_sim::GradeName;
use plant_sim::io::whole;

use crate::chart::write_figure;
use crate::closed_loop::FlightSetup;
use crate::configuration::{TURBULENCE_MAX_M_S, up_to};
use crate::problem::Problem;
use crate::runner;
use crate::study::{Sides, StudyOptions};

pub mod flights;
mod results;

use flights::Flown;
pub use results::{band, mean_nees};

/// Most flights of each case.
const FLIGHTS_MAX: u32 = 10_000;

/// Options of `sitl study estimator`.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Options {
    /// Aircraft, laws, settings, folder.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Flights of each case, up to 10000
    #[arg(long, allow_negative_numbers = true, value_name = "COUNT", default_value_t = 50, value_parser = whole(1, FLIGHTS_MAX))]
    pub flights: u32,
    /// Turbulence, m/s rms: light 1.5, moderate 3
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 1.5, value_parser = up_to(TURBULENCE_MAX_M_S, "m/s"))]
    pub turbulence_m_s: f64,
    /// Seed of the first flight; each has its own
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
}

/// Sensors of a case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Case {
    /// For people.
    pub name: &'static str,
    /// Grade of the sensors.
    pub grade: GradeName,
    /// Whether there are vanes.
    pub vanes: bool,
}

impl Case {
    /// Level flight with these sensors, and the estimator set to them.
    pub(crate) fn equip(&self, sides: &Sides) -> FlightSetup {
        let mut setup = sides.with_sensors(self.grade);
        setup.plant.sensors.fitted[SensorKind::Vanes as usize] = self.vanes;
        setup
    }
}

/// Both grades, with vanes and without.
pub const CASES: [Case; 4] = [
    Case { name: "tactical", grade: GradeName::Tactical, vanes: true },
    Case { name: "tactical without vanes", grade: GradeName::Tactical, vanes: false },
    Case { name: "consumer", grade: GradeName::Consumer, vanes: true },
    Case { name: "consumer without vanes", grade: GradeName::Consumer, vanes: false },
];

/// Flies every case.
pub fn study(options: &Options, sides: &Sides) -> Result<Vec<Vec<Flown>>, Problem> {
    let each = (options.seed, u64::from(options.flights));
    runner::map_groups("estimator", &CASES, each, |case, seed| {
        flights::fly(sides, case, options.turbulence_m_s, seed)
    })
}

/// Flies everything, writes table and figure, prints the table.
pub fn run(options: &Options) -> Result<(), Problem> {
    let sides = flights::sides(&options.study, CompensatorMode::Off, &[])?;
    let folder = sides.begin(&options.study.out)?;
    let duration_s = sides.nominal().duration.as_seconds();
    let flown = study(options, &sides)?;
    write_figure(&folder, &results::figure(duration_s, &flown))?;
    let summary = results::summary(options, duration_s, &flown);
    folder.write_markdown("estimator.md", &summary)?;
    folder.write("nees.csv", results::csv(&flown).as_bytes())?;
    print_line!("{summary}\nwrote {}", folder.path().display());
    Ok(())
}
