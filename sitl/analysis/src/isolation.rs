//! Which effector the isolation names, how soon, and how often it is wrong: `sitl study isolation`.
//!
//! ```text
//! faults drawn for each class, in turbulence ─> three laws ─> verdicts ─┬─> confusion matrices, delays, losses
//! hours of healthy flight in the same air    ─────────────> verdicts ─┴─> tables, figure, page
//! ```
//!
//! The aircraft has a structure that the controller's model lacks: derivatives that change with the Mach number. The
//! gains of the isolation were chosen on other flights (docs/isolation.md).

use flight_control::{AllocationMode, CompensatorMode, IsolationMode};
use plant_sim::GradeName;
use plant_sim::io::whole;

use crate::configuration::{GYRO_NOISE_MAX_DEG_S, TURBULENCE_MAX_M_S, up_to};
use crate::false_alarms::flights::Air;
use crate::problem::Problem;
use crate::study::{Sides, StudyOptions, own, write_report};

pub mod flights;
pub mod pairs;
mod results;

use flights::{Classes, Healthy, Outcome};

/// Longest healthy flight, hours.
const HOURS_MAX: f64 = 10_000.0;
/// Most flights of each class and law.
const FLIGHTS_MAX: u32 = 10_000;

/// Most pairs of jams.
const PAIRS_MAX: u32 = 100_000;

/// Options of `sitl study isolation`.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Options {
    /// Aircraft, laws, settings, folder.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Flights with a fault, for each class and law, up to 10000
    #[arg(long, allow_negative_numbers = true, value_name = "COUNT", default_value_t = 100, value_parser = whole(1, FLIGHTS_MAX))]
    pub flights: u32,
    /// Pairs of jams, each flown without and with the verdict in use, up to 100000
    #[arg(long, allow_negative_numbers = true, value_name = "COUNT", default_value_t = 200, value_parser = whole(0, PAIRS_MAX))]
    pub pairs: u32,
    /// Healthy flight of each law, hours, up to 10000
    #[arg(long, allow_negative_numbers = true, value_name = "H", default_value_t = 10.0, value_parser = up_to(HOURS_MAX, "h"))]
    pub hours: f64,
    /// Turbulence, m/s rms: light 1.5, moderate 3
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 3.0, value_parser = up_to(TURBULENCE_MAX_M_S, "m/s"))]
    pub turbulence_m_s: f64,
    /// Sensors: ideal, tactical or consumer
    #[arg(long, value_name = "NAME", default_value = "ideal", value_parser = crate::sensor_errors::grade)]
    pub grade: GradeName,
    /// White noise of the gyros of ideal sensors, deg/s rms of each control sample
    #[arg(long, allow_negative_numbers = true, value_name = "DEG_S", default_value_t = 0.1, value_parser = up_to(GYRO_NOISE_MAX_DEG_S, "deg/s"))]
    pub gyro_noise_deg_s: f64,
    /// Seed of the first flight; each has its own
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, 1_u64 << 53))]
    pub seed: u64,
}

impl Options {
    /// The air and the gyros.
    pub const fn air(&self) -> Air {
        let Self { grade, turbulence_m_s, gyro_noise_deg_s, .. } = *self;
        Air { grade, turbulence_m_s, gyro_noise_deg_s }
    }

    /// Aircraft and laws; the study compares allocations and uses of the verdict, so that both are its own.
    pub fn sides(&self) -> Result<Sides, Problem> {
        if self.study.flight.laws.allocation.is_some() {
            return Err(own("--allocation"));
        }
        self.study.random_sides(CompensatorMode::Armed, &COMPARED)
    }
}

/// What the variants differ in.
const COMPARED: [&str; 2] = ["FTC_ALLOC", "FTC_ISO"];

/// A law with what it does with the verdict.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// For people.
    pub name: &'static str,
    /// How the compensating demand is allocated.
    pub allocation: AllocationMode,
    /// What the verdict is good for.
    pub isolation: IsolationMode,
}

/// The paper's law, whose verdict is only reported; and the law beyond the paper without and with the use of it.
pub const VARIANTS: [Variant; 3] = [
    Variant {
        name: "paper, report only",
        allocation: AllocationMode::Paper,
        isolation: IsolationMode::Report,
    },
    Variant {
        name: "relief, report only",
        allocation: AllocationMode::Relief,
        isolation: IsolationMode::Report,
    },
    Variant {
        name: "relief, verdict used",
        allocation: AllocationMode::Relief,
        isolation: IsolationMode::Use,
    },
];

/// What came out.
#[derive(Debug, Clone)]
pub struct Study {
    /// What can be broken.
    pub classes: Classes,
    /// For each law the flights with a fault.
    pub outcomes: [Vec<Outcome>; VARIANTS.len()],
    /// Every two effectors jammed, without and with the verdict in use.
    pub pairs: Vec<[Outcome; pairs::COMPARED.len()]>,
    /// For each law the healthy flights together.
    pub healthy: [Healthy; VARIANTS.len()],
}

impl Study {
    /// Flies it.
    pub fn fly(options: &Options, sides: &Sides) -> Result<Self, Problem> {
        let classes = Classes::of(sides.airframe());
        Ok(Self {
            outcomes: flights::fly_faults(options, sides, &classes)?,
            pairs: pairs::fly(options, sides)?,
            healthy: flights::fly_healthy(options, sides)?,
            classes,
        })
    }
}

/// Flies everything, writes tables, figure and page, prints a summary.
pub fn run(options: &Options) -> Result<(), Problem> {
    let sides = options.sides()?;
    let folder = sides.begin(&options.study.out)?;
    let study = Study::fly(options, &sides)?;
    write_report(
        &folder,
        ["Isolation", "Which effector the isolation names"],
        &results::figure(&study),
        &[
            ("flights.csv", results::flights_csv(&study)),
            ("pairs.csv", results::pairs_csv(&study)),
            ("confusion.csv", results::confusion_csv(&study)),
        ],
        &results::summary(options, &study),
    )
}
