//! `sitl study checkcase`: flies a scenario without a controller, and writes its trajectory for a comparison with other simulators.

use host_io::print_line;
use std::io::Write as _;
use std::path::PathBuf;

use host_io::file::NewFile;
use icd::{Actuators, SimTime};
use plant_sim::scenario::case::{CaseFile, CaseOptions, CheckCase};
use plant_sim::{Airframe, Plant};

use columns::CheckcaseColumns;
use host_io::problem::{At as _, Problem, problem};
use lab_engine::configuration::{AircraftArgs, Named};
use lab_engine::settings::{self, Setting, Target};
use lab_report::runner::Progress;

pub mod columns;
mod picture;
pub mod reference;
pub mod report;
pub mod trajectory;

/// First words of the output, by which this program knows what it may write over.
const MARK: &[u8] = b"time_s,";

/// Options of `sitl study checkcase`.
#[derive(Debug, Clone, clap::Args)]
pub struct CheckcaseArgs {
    /// What is flown: a scenario with the table `checkcase`
    #[arg(value_name = "SCENARIO")]
    scenario: PathBuf,
    /// The aircraft or body, instead of the scenario's
    #[arg(long, value_name = "FILE")]
    airframe: Option<PathBuf>,
    /// Integration step, ms, instead of the scenario's [default: 1]
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    step_ms: Option<f64>,
    /// Rows per second, instead of the scenario's [default: 20]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: Option<f64>,
    /// Set a key of the scenario (plant.initial_state.roll_deg) or of the airframe (airframe.mass.mass_kg); may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = Setting::parse)]
    settings: Vec<Setting>,
    /// File for the trajectory
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// Flies and writes.
pub fn run(args: &CheckcaseArgs) -> Result<(), Problem> {
    let name = args.scenario.display().to_string();
    let case = args.case()?;
    let mut flight = Flight::new(&name, &case)?;
    let out = format!("--out {}", args.out.display());
    // Before the flight: a place that cannot be written shall not cost one.
    let mut file = NewFile::begin(&args.out, |beginning| beginning.starts_with(MARK)).at(&out)?;
    print_line!("{}", flight.described());
    let rows = case.duration.as_micros() / case.output_us + 1;
    let rows = usize::try_from(rows).unwrap_or(usize::MAX);
    let progress = Progress::new(&name, "rows", rows).quiet_at_first();
    let mut count = 0_u64;
    let end = flight.fly(&mut |line| {
        file.write_all(format!("{line}\n").as_bytes()).at(&out)?;
        // The header is no row.
        if count > 0 {
            progress.one_done();
        }
        count += 1;
        Ok(())
    });
    progress.finish();
    // A contact with the ground leaves rows that are worth keeping.
    if end.is_err() && !flight.plant.on_ground() {
        return end.at(name);
    }
    file.finish().at(&out)?;
    print_line!("wrote {}: {} rows", args.out.display(), count - 1);
    end.map_err(|problem| problem!("{name}: {problem}; the file has the rows until then"))
}

impl CheckcaseArgs {
    /// A scenario with a step (ms) and without other options, for callers that write no file.
    pub fn of(scenario: PathBuf, step_ms: Option<f64>) -> Self {
        let (airframe, rate_hz, settings, out) = (None, None, Vec::new(), PathBuf::new());
        Self { scenario, airframe, step_ms, rate_hz, settings, out }
    }

    /// The case with its airframe.
    pub fn case(&self) -> Result<CheckCase, Problem> {
        settings::check_keys(&self.settings)?;
        let is_ours = |target| matches!(target, Ok(Target::Scenario | Target::Airframe));
        if let Some(other) = self.settings.iter().find(|setting| !is_ours(setting.target())) {
            return Err(problem!("--set {}: a check case has no controller", other.key));
        }
        let scenario = Named::read(&self.scenario)?;
        let mut aircraft =
            AircraftArgs { settings: self.settings.clone(), ..AircraftArgs::default() };
        let of_scenario = settings::of(&self.settings, Target::Scenario);
        // A text keeps its lines for errors; a table that settings have changed has none.
        let file = if of_scenario.is_empty() {
            CaseFile::from_toml(&scenario.name, &scenario.text)?
        } else {
            CaseFile::from_table(&scenario.name, aircraft.scenario_table(&scenario)?)?
        };
        aircraft.airframe = Some(self.airframe.clone().unwrap_or_else(|| file.airframe()));
        let options = CaseOptions { step_ms: self.step_ms, output_rate_hz: self.rate_hz };
        file.into_case(aircraft.airframe()?, &options)
    }
}

/// A case at its start.
#[derive(Debug)]
pub struct Flight<'a> {
    case: &'a CheckCase,
    plant: Plant,
    columns: CheckcaseColumns,
}

impl<'a> Flight<'a> {
    /// Begins a case; errors call its file `name`.
    pub fn new(name: &str, case: &'a CheckCase) -> Result<Self, Problem> {
        let plant = Plant::release(&case.setup).at(name)?;
        let start = plant.controls();
        // All of them now, instead of an error in the middle of the flight.
        for step in &case.steps {
            let controls = start.plus(&step.change);
            case.setup.check_controls(&controls).at(name)?;
        }
        let columns = CheckcaseColumns::new(&plant);
        Ok(Self { case, plant, columns })
    }

    /// The start in words, with what the trim has found.
    pub fn described(&self) -> String {
        let Airframe { name, effectors, .. } = &self.case.setup.airframe;
        let step_ms = f64::from(self.case.setup.step_us) / 1_000.0;
        let mut text =
            format!("{name}: {} s in steps of {step_ms} ms", self.case.duration.as_seconds());
        if self.case.setup.initial.is_trimmed {
            let trim = self.plant.trim();
            let [theta, elevator] = [trim.theta_rad, trim.elevator_rad].map(f64::to_degrees);
            text += &format!("\ntrim: pitch {theta:.5} deg, elevator {elevator:.5} deg");
            if effectors.only(icd::EffectorKind::Engine).is_some() {
                text += &format!(", thrust {:.1} N", trim.thrust_n);
            }
            if let Some(lever) = self.plant.controls().lever {
                text += &format!(", throttle {:.4} %", 100.0 * lever);
            }
        }
        text
    }

    /// Flies to the end; a contact with the ground before it is a problem. `write` gets the header and then each row.
    pub fn fly(
        &mut self,
        write: &mut dyn FnMut(&str) -> Result<(), Problem>,
    ) -> Result<(), Problem> {
        let Self { case, plant, columns } = self;
        let start = plant.controls();
        let end_us = case.duration.as_micros();
        let mut steps = case.steps.iter().peekable();
        write(columns.header())?;
        loop {
            // A step acts at its time, so the row of that time shows it.
            while let Some(step) = steps.next_if(|step| step.at <= plant.time()) {
                plant.set_controls(&start.plus(&step.change));
            }
            let now_us = plant.time().as_micros();
            let is_over = now_us >= end_us || plant.on_ground();
            // The end gets a row also where it is not on the grid.
            if now_us.is_multiple_of(case.output_us) || is_over {
                write(&columns.row(plant))?;
            }
            if is_over {
                break;
            }
            // Commanded to where they are, so that no servo moves.
            plant.advance(&Actuators::new(plant.controls().positions));
            if let Some(what) = plant.broken_by() {
                let time_s = SimTime::from_micros(now_us).as_seconds();
                return Err(problem!(
                    "after {time_s} s the {what} is not finite any more; a shorter step may help"
                ));
            }
        }
        if plant.time() < case.duration {
            let (time_s, duration_s) = (plant.time().as_seconds(), case.duration.as_seconds());
            return Err(problem!(
                "ground contact after {time_s} s, before duration_s = {duration_s}"
            ));
        }
        Ok(())
    }
}
