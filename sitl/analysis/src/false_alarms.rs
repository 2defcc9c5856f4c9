//! How often the detector wakes on a healthy aircraft, and what it costs to make it wake less often:
//! `sitl study false-alarms`.
//!
//! ```text
//! flights, healthy and in turbulence       ─> detectors ─> alarms an hour ─┐
//! flights with faults, in the same air     ─> detectors ─> delay, s ───────┴─> tables, figure, page
//! ```
//!
//! The aircraft has a structure that the controller's model lacks: derivatives that change with the Mach number.

use flight_control::{CompensatorMode, Gains};
use plant_sim::GradeName;
use plant_sim::io::whole;

use crate::configuration::{GYRO_NOISE_MAX_DEG_S, TURBULENCE_MAX_M_S, up_to};
use crate::problem::Problem;
use crate::runner;
use crate::study::{Sides, StudyOptions, write_report};

pub mod detectors;
pub mod flights;
mod results;

use detectors::{DWELLS_S, FILTERS_S, upper_95};
use flights::{
    Air, Condition, Delays, FLIGHT_S, Watched, conditions, flights_for, programme, setup, watch,
};

/// Alarms an hour that are allowed, as the upper 95 % bound.
pub const ALLOWED_PER_H: f64 = 1.0;
/// Longest study, hours.
const HOURS_MAX: f64 = 10_000.0;

/// Options of `sitl study false-alarms`.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Options {
    /// Aircraft, laws, settings, folder.
    #[command(flatten)]
    pub study: StudyOptions,
    /// Sensors: ideal, tactical or consumer; may be repeated
    #[arg(long = "grade", value_name = "NAME", default_values = ["ideal", "tactical", "consumer"], value_parser = crate::sensor_errors::grade)]
    pub grades: Vec<GradeName>,
    /// Healthy flight with each of these sensors, hours, up to 10000; 100 take some minutes of all cores
    #[arg(long, allow_negative_numbers = true, value_name = "H", default_value_t = 3.0, value_parser = up_to(HOURS_MAX, "h"))]
    pub hours: f64,
    /// Flight conditions, m/s of airspeed at m of altitude; may be repeated [default: five about the design point]
    #[arg(long = "at", value_name = "AIRSPEED@ALTITUDE", value_parser = Condition::parse)]
    pub conditions: Vec<Condition>,
    /// Straight and level, without manoeuvres
    #[arg(long)]
    pub straight: bool,
    /// Turbulence, m/s rms: light 1.5, moderate 3
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 3.0, value_parser = up_to(TURBULENCE_MAX_M_S, "m/s"))]
    pub turbulence_m_s: f64,
    /// White noise of the gyros of ideal sensors, deg/s rms of each control sample
    #[arg(long, allow_negative_numbers = true, value_name = "DEG_S", default_value_t = 0.1, value_parser = up_to(GYRO_NOISE_MAX_DEG_S, "deg/s"))]
    pub gyro_noise_deg_s: f64,
    /// Seed of the first flight; each has its own
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
}

impl Options {
    /// The air and the sensors.
    pub const fn air(&self, grade: GradeName) -> Air {
        let Self { turbulence_m_s, gyro_noise_deg_s, .. } = *self;
        Air { grade, turbulence_m_s, gyro_noise_deg_s }
    }
}

/// What came out with one grade of sensors.
#[derive(Debug, Clone)]
pub struct GradeStudy {
    /// The sensors.
    pub grade: GradeName,
    /// Healthy flight, by flight condition.
    pub conditions: Vec<Watched>,
    /// Faults.
    pub delays: Vec<Delays>,
}

/// Detector that flies: its place among the filters and dwells, and among the heights.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shipped {
    /// Filter and dwell.
    pub kind: usize,
    /// Height one.
    pub index: usize,
}

impl Shipped {
    /// The detector of the reference gains; the study has one of its dwell.
    pub fn find() -> Self {
        let gains = Gains::REFERENCE.activation;
        let near = |a: f64, b: f64| (a - b).abs() < 1.0e-9;
        let dwell = DWELLS_S.iter().position(|dwell| near(*dwell, gains.on_dwell_s)).unwrap_or(0);
        let index = (0..detectors::SCALES).find(|i| near(detectors::scale(*i), 1.0)).unwrap_or(0);
        Self { kind: dwell, index }
    }
}

impl GradeStudy {
    /// All flight conditions together.
    pub fn healthy(&self) -> Watched {
        self.conditions.iter().fold(Watched::default(), Watched::with)
    }
}

/// Upper 95 % bound of alarms an hour.
pub fn bound_per_h(alarms: u32, seconds: f64) -> f64 {
    upper_95(alarms) / (seconds / 3_600.0)
}

/// Flies the healthy flights.
pub fn fly_healthy(
    options: &Options,
    grade: GradeName,
    sides: &Sides,
) -> Result<Vec<Watched>, Problem> {
    let at = conditions(&options.conditions, &sides.scale());
    let flights = at.len() as u64 * flights_for(options.hours, at.len());
    let items: Vec<(usize, u64)> = (0_usize..at.len())
        .cycle()
        .zip((0..flights).map(|number| options.seed.wrapping_add(number)))
        .collect();
    let one = |(place, seed): &(usize, u64)| {
        let condition = &at[*place];
        let references = programme(condition, &sides.scale(), *seed, options.straight);
        let air = options.air(grade);
        let setup = setup(&air, sides, condition, *seed, &references, FLIGHT_S)?;
        watch(&setup, options.straight)
    };
    let label = format!("{} sensors, healthy flights of 10 minutes", grade.key());
    let results = runner::try_map(&label, &items, one)?;
    let mut conditions = vec![Watched::default(); at.len()];
    for ((place, _), watched) in items.iter().zip(results) {
        let so_far = std::mem::take(&mut conditions[*place]);
        conditions[*place] = so_far.with(&watched);
    }
    Ok(conditions)
}

/// Flies everything, writes tables, figure and page, prints a summary.
pub fn run(options: &Options) -> Result<(), Problem> {
    let sides = options.study.random_sides(CompensatorMode::Off, &[])?;
    let folder = sides.begin(&options.study.out)?;
    let of = |grade: &GradeName| -> Result<_, Problem> {
        Ok(GradeStudy {
            grade: *grade,
            delays: flights::measure_delays(options, *grade, &sides)?,
            conditions: fly_healthy(options, *grade, &sides)?,
        })
    };
    let study = options.grades.iter().map(of).collect::<Result<Vec<_>, _>>()?;
    let at = conditions(&options.conditions, &sides.scale());
    write_report(
        &folder,
        ["False alarms", "False alarms and detection delay"],
        &results::figure(&study),
        &[
            ("alarms.csv", results::alarms_csv(&at, &study)),
            ("delays.csv", results::delays_csv(&study)),
        ],
        &results::summary(options, &at, &study),
    )
}

/// Time constant of the lag and dwell, s.
pub fn of_kind(kind: usize) -> (f64, f64) {
    (FILTERS_S[kind / DWELLS_S.len()], DWELLS_S[kind % DWELLS_S.len()])
}
