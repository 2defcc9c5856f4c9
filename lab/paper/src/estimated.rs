//! The paper's cases on estimated states: `sitl study paper-estimated`.
//!
//! ```text
//! sensors, seed ─> both cases in light turbulence ─> outcomes (claim 4) and every precise limit (claims 1a to 2e)
//!                            many seeds ─> table by sensors, table of the limits that degrade
//! ```

use host_io::print_line;
use std::fmt::Write as _;
use std::path::PathBuf;

use host_io::folder::OutFolder;
use icd::ControlPeriod;
use icd::sensors::SensorKind;
use lab_tables::{Table, cells, table};
use plant_sim::io::whole;
use plant_sim::setup::default_step_us;
use plant_sim::{EarthModel, GradeName, grade_file};

use super::both::Noisy;
use super::cases::{Case, Conditions, Run, Runs};
use super::claim::{ClaimResult, Limit};
use super::{NOISE_TURBULENCE_M_S, claims, in_process};
use host_io::problem::Problem;
use lab_engine::builder::preset_of;
use lab_engine::configuration::{AircraftArgs, TURBULENCE_MAX_M_S, up_to};
use lab_judges::metrics::{max, min};
use lab_report::runner;

/// Most seeds.
const SEEDS_MAX: u32 = 1_000;
/// Greater ones are no whole numbers of a table.
const SEED_MAX: u64 = i64::MAX as u64 - SEEDS_MAX as u64;

/// Options of `sitl study paper-estimated`.
#[derive(Debug, Clone, PartialEq, clap::Args)]
pub struct Options {
    /// Folder for the tables
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Seeds of each case, up to 1000
    #[arg(long, allow_negative_numbers = true, value_name = "COUNT", default_value_t = 10, value_parser = whole(1, SEEDS_MAX))]
    pub seeds: u32,
    /// Turbulence, m/s rms: light 1.5, moderate 3
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = NOISE_TURBULENCE_M_S, value_parser = up_to(TURBULENCE_MAX_M_S, "m/s"))]
    pub turbulence_m_s: f64,
    /// Seed of the first flights
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, SEED_MAX))]
    pub seed: u64,
}

/// Sensors of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fit {
    pub name: &'static str,
    pub grade: GradeName,
    pub vanes: bool,
}

/// Ideal sensors in the same air first: what the air alone does.
pub const FITS: [Fit; 5] = [
    Fit { name: "ideal", grade: GradeName::Ideal, vanes: true },
    Fit { name: "tactical", grade: GradeName::Tactical, vanes: true },
    Fit { name: "tactical without vanes", grade: GradeName::Tactical, vanes: false },
    Fit { name: "consumer", grade: GradeName::Consumer, vanes: true },
    Fit { name: "consumer without vanes", grade: GradeName::Consumer, vanes: false },
];

/// The flights of one fit under one seed.
#[derive(Debug, Clone)]
pub struct Flown {
    /// Outcome of each case.
    pub outcomes: [Noisy; 2],
    /// Every precise limit of both cases.
    pub limits: Vec<ClaimResult>,
}

/// Flies both cases.
pub fn fly(fit: &Fit, turbulence_m_s: f64, seed: u64) -> Result<Flown, Problem> {
    let one = |number| -> Result<(Noisy, Vec<ClaimResult>), Problem> {
        let case = case(number, fit, turbulence_m_s, seed)?;
        let fly = |run| case.fly(run, &in_process);
        let traces = [fly(Run::NoFault)?, fly(Run::PidOnly)?, fly(Run::Compensated)?];
        let [no_fault, pid_only, compensated] = &traces;
        let runs = Runs { case: &case, no_fault, pid_only, compensated };
        let name = format!("case {number}, seed {seed}");
        Ok((Noisy::new(name, &runs), claims::of_case(&runs)))
    };
    let ((first, mut limits), (second, others)) = (one(1)?, one(2)?);
    limits.extend(others);
    Ok(Flown { outcomes: [first, second], limits })
}

fn case(number: u32, fit: &Fit, turbulence_m_s: f64, seed: u64) -> Result<Case, Problem> {
    let period = ControlPeriod::DEFAULT;
    let conditions = Conditions {
        earth: EarthModel::Wgs84,
        period,
        step_us: default_step_us(period),
        // The grades have noise of their own.
        gyro_noise_rad_s: 0.0,
        turbulence_m_s,
        seed,
    };
    let mut case = Case::with(number, &conditions, &AircraftArgs::default())?;
    let sensors = &mut case.setup.plant.sensors;
    *sensors = grade_file::of_grade(fit.grade);
    sensors.fitted[SensorKind::Vanes as usize] = fit.vanes;
    // As it comes with the grade.
    case.setup.parameters.gains.selection.estimator = preset_of(fit.grade);
    Ok(case)
}

/// Flies every fit under every seed.
pub fn study(options: &Options) -> Result<[Vec<Flown>; FITS.len()], Problem> {
    let seeds = (0..u64::from(options.seeds)).map(|number| options.seed + number);
    let items: Vec<(usize, u64)> =
        seeds.flat_map(|seed| (0..FITS.len()).map(move |fit| (fit, seed))).collect();
    let one = |(fit, seed): &(usize, u64)| fly(&FITS[*fit], options.turbulence_m_s, *seed);
    let mut flown: [Vec<Flown>; FITS.len()] = Default::default();
    for ((fit, _), result) in items.iter().zip(runner::map("estimated states", &items, one)) {
        flown[*fit].push(result?);
    }
    Ok(flown)
}

/// Flies everything, writes and prints the tables.
pub fn run(options: &Options) -> Result<(), Problem> {
    let folder = OutFolder::create(&options.out)?;
    let flown = study(options)?;
    let text = summary(options, &flown);
    folder.write_markdown("estimated.md", &text)?;
    limits(options, &flown).write(folder.path())?;
    print_line!("{text}\nwrote {}", options.out.display());
    Ok(())
}

/// Seeds under which one limit holds.
fn held(flown: &[Flown], limit: usize) -> usize {
    flown.iter().filter(|flown| flown.limits[limit].pass).count()
}

/// The measured value that is farthest to the wrong side of its limit.
fn worst(flown: &[Flown], limit: usize) -> f64 {
    let values = || flown.iter().map(|flown| flown.limits[limit].value);
    match flown[0].limits[limit].limit {
        Limit::AtLeast(_) | Limit::Above(_) => min(values()),
        _ => max(values()),
    }
}

/// Outcomes by sensors, then every limit that the air alone leaves and one of the sensors breaks.
pub fn summary(options: &Options, flown: &[Vec<Flown>; FITS.len()]) -> String {
    let Options { seeds, turbulence_m_s, seed, .. } = options;
    let limits = flown[0][0].limits.len();
    // Writing to a string cannot fail.
    let mut text = format!(
        "Both cases of the paper, {seeds} seeds from {seed} on, turbulence {turbulence_m_s} m/s rms; {} flights without fault, with PID only and \
         compensated for each row.\n\n\
         | sensors | lost without fault | not lost with PID only | lost with the compensator | wrong sign | woke without fault | time awake | \
         largest healthy z2 over its level | limits held in every seed |\n|---|---|---|---|---|---|---|---|---|\n",
        2 * seeds,
    );
    for (fit, flown) in FITS.iter().zip(flown) {
        let outcomes = || flown.iter().flat_map(|flown| &flown.outcomes);
        let count = |what: fn(&Noisy) -> bool| outcomes().filter(|outcome| what(outcome)).count();
        let always = (0..limits).filter(|limit| held(flown, *limit) == flown.len()).count();
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {:.1} % | {:.2} | {always} of {limits} |",
            fit.name,
            count(|f| f.no_fault_lost),
            count(|f| !f.pid_only_lost),
            count(|f| f.compensated_lost),
            count(|f| f.wrong_signs),
            count(|f| f.false_alarm),
            100.0 * outcomes().map(|f| f.healthy_active).sum::<f64>() / f64::from(2 * seeds),
            max(outcomes().map(|f| f.healthy_level)),
        );
    }
    text += "\n| claim | limit that some sensors break, and the air alone does not | must be |";
    text.extend(FITS.iter().map(|fit| format!(" {} |", fit.name)));
    text += &format!("\n|{}\n", "---|".repeat(3 + FITS.len()));
    for limit in 0..limits {
        let ideal = held(&flown[0], limit) == flown[0].len();
        if !ideal || flown.iter().all(|flown| held(flown, limit) == flown.len()) {
            continue;
        }
        let ClaimResult { id, measure, limit: must, unit, .. } = &flown[0][0].limits[limit];
        let _ = write!(text, "| {id} | {measure}, {unit} | {must} |");
        for flown in flown {
            let (value, held) = (worst(flown, limit), held(flown, limit));
            let _ = match held == flown.len() {
                true => write!(text, " {value:.3} |"),
                false => write!(text, " {value:.3} ({held} of {}) |", flown.len()),
            };
        }
        text.push('\n');
    }
    text += "\nThe worst value of all seeds; in brackets the seeds in which the limit holds, where these are not all.\n";
    text
}

/// Every limit of every fit and seed.
fn limits(options: &Options, flown: &[Vec<Flown>; FITS.len()]) -> Table {
    let mut table = table!("limits",
        sensors: Text, seed: Integer, claim: Text, measure: Text, value: Number, limit: Text,
        unit: Text, holds: Integer);
    for (fit, flown) in FITS.iter().zip(flown) {
        for (number, flown) in (0..).zip(flown) {
            let seed = options.seed + number;
            for ClaimResult { id, measure, value, limit, unit, pass, .. } in &flown.limits {
                let limit = limit.to_string();
                table.rows.push(cells![fit.name, seed, *id, measure, *value, limit, *unit, *pass]);
            }
        }
    }
    table
}
