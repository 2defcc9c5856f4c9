//! The paper: its two cases flown, its claims checked, its figures drawn.
//!
//! ```text
//! Options ─> cases (fly) ─> trace ─> claims, both, model_error ─> claims.json, stdout
//!                             │                                └─> report.html
//!                             └─> table (CSV), figures (SVG, PNG), comparisons ──^
//! ```
//!
//! A case is a setup like any other ([`cases::Case`]):
//!
//! ```
//! use lab_judges::closed_loop::fly;
//! use lab_paper::cases::{Case, Conditions};
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

use host_io::print_text;
use std::path::PathBuf;

use host_io::folder::OutFolder;
use icd::ControlPeriod;
use plant_sim::EarthModel;
use plant_sim::io::{parse_earth, parse_period, whole};
use plant_sim::setup::default_step_us;

use host_io::problem::{At as _, Problem};
use lab_engine::configuration::{AircraftArgs, GYRO_NOISE_MAX_DEG_S, TURBULENCE_MAX_M_S, up_to};
use lab_judges::closed_loop::{End, FlightSetup, Record, fly};
use lab_report::chart::write_figure;
use lab_report::page::GENERATOR;
use lab_report::runner;

pub mod both;
pub mod cases;
pub mod claim;
pub mod claims;
pub mod comparisons;
pub mod estimated;
pub mod figures;
pub mod model_error;
pub mod report;
#[cfg(test)]
mod tests;

use both::Noisy;
use cases::{Case, Conditions, Flown, Run};
use claim::{ClaimResult, all_hold};
use model_error::{Extent, SurvivalPoint};

/// Seeds of claim 4.
const NOISE_SEEDS: u64 = 10;
/// Gyro noise of claim 4, deg/s rms of each control sample.
const NOISE_DEG_S: f64 = 0.1;
/// Turbulence of claim 4, m/s rms: light.
const NOISE_TURBULENCE_M_S: f64 = 1.5;

/// Flies a setup and hands every control tick to the sink: in process, or through the two real processes.
pub type Fly<'a> =
    dyn Fn(&FlightSetup, &mut dyn FnMut(&Record)) -> Result<End, Problem> + Sync + 'a;

/// Options of `sitl study paper`.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Options {
    /// Folder for tables, claims, figures and report
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Aircraft and settings.
    #[command(flatten)]
    pub aircraft: AircraftArgs,
    /// Claims 4 and 5 too (a few minutes)
    #[arg(long)]
    pub full: bool,
    /// How plant and autopilot talk
    #[arg(long, value_enum, default_value = "in-process")]
    pub link: Link,
    /// Control period, 1 to 4 ms
    #[arg(long = "period-ms", allow_negative_numbers = true, value_name = "MS", default_value = "2", value_parser = parse_period)]
    pub period: ControlPeriod,
    /// Integration step, us; divides the control period [default: its largest divisor up to 1000]
    #[arg(long, allow_negative_numbers = true, value_name = "US", value_parser = whole(1, ControlPeriod::MAX_MICROS))]
    pub step_us: Option<u32>,
    /// flat, wgs84, round or round_non_rotating
    #[arg(long, value_name = "MODEL", default_value = "wgs84", value_parser = parse_earth)]
    pub earth: EarthModel,
    /// White noise of the gyros, deg/s rms of each control sample; with it the limits of claim 4 apply
    #[arg(long, allow_negative_numbers = true, value_name = "DEG_S", default_value_t = 0.0, value_parser = up_to(GYRO_NOISE_MAX_DEG_S, "deg/s"))]
    pub gyro_noise_deg_s: f64,
    /// Turbulence, m/s rms: light 1.5, moderate 3; with it the limits of claim 4 apply
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 0.0, value_parser = up_to(TURBULENCE_MAX_M_S, "m/s"))]
    pub turbulence_m_s: f64,
    /// Seed of all random streams
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
}

/// How plant and autopilot talk in the paper's runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Link {
    /// Function calls in one process
    InProcess,
    /// Two processes over UDP
    Udp,
}

/// What came out.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Every measured value.
    pub results: Vec<ClaimResult>,
}

impl Outcome {
    /// Whether every checked claim holds.
    pub fn all_hold(&self) -> bool {
        all_hold(&self.results)
    }
}

/// The flown cases and their claims.
#[derive(Debug, Clone)]
pub struct Evaluation {
    /// Case 1 and case 2.
    pub flown: [Flown; 2],
    /// Every measured value.
    pub results: Vec<ClaimResult>,
    /// The survival curve; empty unless all claims are checked.
    pub survival: Vec<SurvivalPoint>,
}

/// Flies in this process.
pub fn in_process(setup: &FlightSetup, sink: &mut dyn FnMut(&Record)) -> Result<End, Problem> {
    fly(setup, sink)
}

/// What every run takes from an option, whatever a scenario has.
const OPTIONS: [(&str, &str); 4] = [
    ("plant.seed", "--seed"),
    ("plant.earth", "--earth"),
    ("plant.sensors.gyro_noise_deg_s", "--gyro-noise-deg-s"),
    ("plant.wind.turbulence_m_s", "--turbulence-m-s"),
];

impl Options {
    /// Checks the keys of the settings.
    pub fn check(&self) -> Result<(), Problem> {
        self.aircraft.check_beside(OPTIONS)
    }

    /// Step of the plant's integration, us.
    pub fn step_us(&self) -> u32 {
        self.step_us.unwrap_or_else(|| default_step_us(self.period))
    }

    /// What is the same in all of the paper's runs.
    pub fn conditions(&self) -> Conditions {
        Conditions {
            earth: self.earth,
            period: self.period,
            step_us: self.step_us(),
            gyro_noise_rad_s: self.gyro_noise_deg_s.to_radians(),
            turbulence_m_s: self.turbulence_m_s,
            seed: self.seed,
        }
    }
}

/// Flies the paper in process and checks its claims, without writing anything.
pub fn evaluate(options: &Options) -> Result<Vec<ClaimResult>, Problem> {
    fly_and_check(options, &in_process).map(|evaluation| evaluation.results)
}

/// Flies the paper's runs with `fly` and checks the claims, without writing anything.
///
/// Claims 4 and 5 are always flown in process: both ways of flying give the same bits.
pub fn fly_and_check(options: &Options, fly: &Fly) -> Result<Evaluation, Problem> {
    let conditions = options.conditions();
    let case = |number| Case::with(number, &conditions, &options.aircraft);
    let cases = [case(1)?, case(2)?];
    // Two real processes want the cores for themselves.
    let parallel = options.link == Link::InProcess;
    let flown = [cases[0].fly_all(fly, parallel)?, cases[1].fly_all(fly, parallel)?];
    let mut results = Vec::new();
    if conditions.are_ideal() {
        results.extend(flown.iter().flat_map(|flown| claims::of_case(&flown.runs())));
    }
    results.extend(flown.iter().flat_map(both::claim_3));
    if options.full {
        results.extend(both::claim_4(&fly_in_noise(&cases, &conditions, NOISE_SEEDS)?));
    } else if !conditions.are_ideal() {
        let noisy = |f: &Flown| Noisy::new(format!("case {}", f.case.number), &f.runs());
        results.extend(both::claim_4(&flown.iter().map(noisy).collect::<Vec<_>>()));
    }
    let mut survival = Vec::new();
    if options.full {
        let still = Conditions { gyro_noise_rad_s: 0.0, turbulence_m_s: 0.0, ..conditions };
        let campaign = model_error::campaign(
            &cases.map(|case| case.under(&still)),
            options.seed,
            &Extent::FULL,
        )?;
        results.extend(campaign.claims);
        survival = campaign.survival;
    }
    Ok(Evaluation { flown, results, survival })
}

/// The runs of claim 4: both cases under each seed, from that of `conditions` on.
///
/// Noise and turbulence are those of `conditions`, or those that the claim names if they are zero.
pub fn fly_in_noise(
    cases: &[Case; 2],
    conditions: &Conditions,
    seeds: u64,
) -> Result<Vec<Noisy>, Problem> {
    let mut noise = *conditions;
    if conditions.are_ideal() {
        noise.gyro_noise_rad_s = NOISE_DEG_S.to_radians();
        noise.turbulence_m_s = NOISE_TURBULENCE_M_S;
    }
    let flights: Vec<(Case, u64)> = (0..seeds)
        .map(|number| conditions.seed.wrapping_add(number))
        .flat_map(|seed| cases.iter().map(move |case| (case.clone(), seed)))
        .collect();
    let results = runner::map("claim 4, noise and air", &flights, |(case, seed)| {
        let case = case.under(&Conditions { seed: *seed, ..noise });
        let no_fault = case.fly(Run::NoFault, &in_process)?;
        let pid_only = case.fly(Run::PidOnly, &in_process)?;
        let compensated = case.fly(Run::Compensated, &in_process)?;
        let runs = cases::Runs {
            case: &case,
            no_fault: &no_fault,
            pid_only: &pid_only,
            compensated: &compensated,
        };
        Ok(Noisy::new(format!("case {}, seed {seed}", case.number), &runs))
    });
    results.into_iter().collect()
}

/// Flies the paper with `fly`, checks its claims, and writes tables, claims, figures and report.
///
/// A short table of the claims goes to standard output.
pub fn run(options: &Options, fly: &Fly) -> Result<Outcome, Problem> {
    options.check()?;
    let folder = OutFolder::create(&options.out)?;
    let evaluation = fly_and_check(options, fly)?;
    let [first, second] = &evaluation.flown;
    for flown in &evaluation.flown {
        write_tables(&folder, flown)?;
    }
    let json = serde_json::to_string_pretty(&evaluation.results).at("claims.json")?;
    folder.write("claims.json", json.as_bytes())?;

    let mut figures = figures::of_the_paper(first, second);
    if !evaluation.survival.is_empty() {
        figures.push(figures::survival(&evaluation.survival));
    }
    figures.iter().try_for_each(|figure| write_figure(&folder, figure))?;
    let comparisons = comparisons::compare([first, second], &options.conditions())?;
    let sensitivity = comparisons::sensitivity(&options.conditions(), &options.aircraft)?;
    let page = report::page(options, &evaluation, &comparisons, &sensitivity, &figures);
    folder.write_marked("report.html", GENERATOR.as_bytes(), page.as_bytes())?;

    let table = report::text_table(&evaluation.results);
    print_text!("{table}");
    Ok(Outcome { results: evaluation.results })
}

fn write_tables(folder: &OutFolder, flown: &Flown) -> Result<(), Problem> {
    let runs =
        [("nofault", &flown.no_fault), ("pid", &flown.pid_only), ("rftc", &flown.compensated)];
    for (name, trace) in runs {
        let file = format!("case{}_{name}.csv", flown.case.number);
        folder.write(&file, lab_judges::trajectory::to_csv(trace.table_rows()).as_bytes())?;
    }
    Ok(())
}
