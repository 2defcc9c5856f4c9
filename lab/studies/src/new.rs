//! `sitl aircraft new`: from an airframe file to a model with every parameter, checked by margins and flights.

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;

use aircraft::AIRFRAMES;
use autopilot::config::{self, Model};
use flight_control::gains::name_of;
use flight_control::{CompensatorMode, MainLaw};
use host_io::file;
use host_io::folder::OutFolder;
use host_io::problem::{At as _, Problem, problem};
use host_io::{print_line, print_text};
use icd::ControlPeriod;
use lab_engine::builder::{SetupBuilder, SetupOptions};
use lab_engine::configuration::Named;
use lab_engine::flight::{FlightSetup, Tick};
use lab_judges::flown::{self, Keep};
use lab_judges::metrics::rms;
use plant_sim::{Airframe, Plant, ReadAirframe as _, Scenario, Start};

use crate::linearize::{Condition, MARK, linearize, schedule_of, to_toml};
use crate::margins::{self, LoopRow, SetupLoops};
use procedure::{ParameterSet, Performance, Procedure};

pub mod procedure;

/// Laws that every aircraft can fly, with their `CTL_LAW`. The first that keeps the aircraft is its own.
const LAWS: [(MainLaw, f64); 3] = [(MainLaw::Pid, 0.0), (MainLaw::Ndi, 2.0), (MainLaw::Lqr, 3.0)];
/// Duration of the check flight, s.
const FLIGHT_S: f64 = 120.0;
/// Its turbulence, rms: light, and at most this part of the airspeed.
const TURBULENCE_M_S: f64 = 1.5;
const TURBULENCE_PART: f64 = 0.06;
/// Largest step of the airspeed in the check flight, of the airspeed, times two.
const AIRSPEED_STEP: f64 = 0.2;
/// A detector level in standard deviations of the estimate of a healthy aircraft.
const LEVEL_DEVIATIONS: f64 = 6.0;
/// Smallest margins that are not called weak: a factor of two, and 30 degrees.
const GAIN_MARGIN: f64 = 2.0;
const PHASE_MARGIN_DEG: f64 = 30.0;

/// Options of `sitl aircraft new`.
#[derive(Debug, clap::Args)]
pub struct NewArgs {
    #[arg(
        long,
        value_name = "NAME|FILE",
        help = format!("The aircraft: a file, or one of {}", file::names(AIRFRAMES))
    )]
    airframe: PathBuf,
    /// Flight condition of model and procedure instead of the design point of the airframe; several make a model that is scheduled
    /// between them, with the procedure at the design point
    #[arg(long, value_name = "ALTITUDE_M,AIRSPEED_M_S", allow_hyphen_values = true)]
    at: Vec<Condition>,
    /// Folder for model.toml and report.md
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Writes the model and its parameters, flies it, and reports.
pub fn run(args: &NewArgs) -> Result<(), Box<dyn Error>> {
    let file = Named::shipped_or_read(&args.airframe, AIRFRAMES)?;
    let airframe = Airframe::from_toml(&file.name, &file.text)?;
    let made = New::make(airframe, &args.at).at(&file.name)?;
    let folder = OutFolder::create(&args.out)?;
    folder.write_marked("model.toml", MARK.as_bytes(), made.text.as_bytes())?;
    folder.write_markdown("report.md", &made.report)?;
    print_text!("{}", made.report);
    let model = args.out.join("model.toml");
    let airframe = args.airframe.display();
    print_line!("wrote {}", args.out.display());
    print_line!("fly it with --airframe {airframe} --model {}", model.display());
    Ok(())
}

/// A model with its parameters, and what the checks say of it.
#[derive(Debug, Clone)]
pub struct New {
    /// The model file.
    pub text: String,
    /// The report, Markdown.
    pub report: String,
    /// What is weak; empty for an aircraft without complaints.
    pub weak: Vec<String>,
}

impl New {
    /// The whole procedure, with a model of these conditions or of the design point.
    pub fn make(airframe: Airframe, conditions: &[Condition]) -> Result<Self, Problem> {
        let nominal = Scenario::from_toml("nominal.toml", scenarios::NOMINAL, &airframe.effectors)?;
        let period = ControlPeriod::DEFAULT;
        let mut setup = nominal.plant.setup(airframe.clone(), 0, period, 1_000);
        let points = schedule_of(&mut setup, conditions);
        let aircraft = linearize(&setup, &points)?;
        aircraft.validate().map_err(|error| problem!("the model: {error}"))?;
        let plant = Plant::new(&setup)?;
        let procedure = Procedure::new(plant.dynamics(), setup.start, aircraft, period);
        let able = procedure.performance()?;
        let mut found = procedure.parameters(&able)?;
        let text = |found: &ParameterSet| to_toml(&aircraft, &found.table()).at("the model");
        let fly = |found: &ParameterSet, law: MainLaw| {
            let model = config::model("the new model", &text(found)?)?;
            CheckSetup { airframe: &airframe, model, start: setup.start, able: &able }.fly(law)
        };
        let mut first = fly(&found, MainLaw::Pid)?;
        for (law, number) in LAWS.into_iter().skip(1) {
            if first.is_kept {
                break;
            }
            let flown = fly(&found, law)?;
            if flown.is_kept {
                found.set("CTL_LAW", number);
                let name = name_of(MainLaw::NAMES, law);
                found.weak.push(format!("pid does not keep it: it flies with {name}"));
                first = flown;
            }
        }
        // The levels come from a flight, which needs none: the compensator is off.
        let names = ["ACT_LVL_P", "ACT_LVL_Q", "ACT_LVL_R"];
        for (name, deviation) in names.into_iter().zip(first.estimate_rad_s2) {
            found.set(name, LEVEL_DEVIATIONS * deviation);
        }
        let mut report = heading(&airframe, &able, &setup.start);
        for (law, _) in LAWS {
            let flown = fly(&found, law)?;
            let _ = writeln!(report, "{}", flown.row);
            found.weak.extend(flown.weak);
        }
        report += "\n## Margins\n\n| law | commands | crossover, rad/s | gain | phase, deg |\n|---|---|---|---|---|\n";
        let model = config::model("the new model", &text(&found)?)?;
        let check = CheckSetup { airframe: &airframe, model, start: setup.start, able: &able };
        for (law, _) in LAWS {
            let mut setup = check.setup(law)?;
            setup.plant.wind = setup.plant.wind.with_turbulence_m_s(0.0);
            let name = name_of(MainLaw::NAMES, law);
            margins_of(&setup, name, &mut report, &mut found.weak);
            setup.parameters.gains.selection.compensator = CompensatorMode::AlwaysOn;
            margins_of(&setup, &format!("{name}, compensator"), &mut report, &mut found.weak);
        }
        let weak = match found.weak.as_slice() {
            [] => "nothing\n".to_owned(),
            weak => weak.iter().map(|line| format!("* {line}\n")).collect(),
        };
        let _ = write!(report, "\n## Weak\n\n{weak}");
        Ok(Self { text: text(&found)?, report, weak: found.weak })
    }
}

fn heading(airframe: &Airframe, able: &Performance, start: &Start) -> String {
    let Performance { slowest_m_s, fastest_m_s, climb_m_s, sink_m_s, ceiling_m } = able;
    format!(
        "# {}\n\nLevel flight at {} m from {slowest_m_s:.1} to {fastest_m_s:.1} m/s, design point {} m/s; climb {climb_m_s:.2} m/s, sink \
         with least thrust {sink_m_s:.2} m/s, ceiling {ceiling_m:.0} m.\n\n## Flight of {FLIGHT_S} s in turbulence of {:.2} m/s: turns, climb, descent, \
         airspeed\n\n| law | outcome | altitude, m rms | roll, deg rms | airspeed, m/s rms |\n|---|---|---|---|---|\n",
        airframe.name,
        start.altitude_m,
        start.airspeed_m_s,
        turbulence_m_s(start),
    )
}

fn turbulence_m_s(start: &Start) -> f64 {
    TURBULENCE_M_S.min(TURBULENCE_PART * start.airspeed_m_s)
}

/// A check flight.
struct CheckSetup<'a> {
    airframe: &'a Airframe,
    model: Model,
    start: Start,
    able: &'a Performance,
}

/// What the check flight of a law shows.
struct CheckFlight {
    is_kept: bool,
    row: String,
    weak: Vec<String>,
    /// Standard deviation of the estimated fault acceleration, rad/s².
    estimate_rad_s2: [f64; 3],
}

impl CheckSetup<'_> {
    /// Turns both ways, a climb, a descent, and both ends of the airspeeds.
    fn scenario(&self) -> String {
        let Start { altitude_m, airspeed_m_s: v, .. } = self.start;
        let navigation = &self.model.defaults.navigation;
        let (bank, climb) = (0.7 * navigation.bank_max_deg, 20.0 * navigation.climb_max_m_s);
        let slow = v - 0.5 * (v - (1.25 * self.able.slowest_m_s)).clamp(0.1 * v, AIRSPEED_STEP * v);
        let fast = v + 0.5 * (self.able.fastest_m_s - v).clamp(0.0, AIRSPEED_STEP * v);
        let lines = [
            (5.0, format!("roll_deg = {bank:?}")),
            (25.0, format!("roll_deg = {:?}", -bank)),
            (45.0, format!("roll_deg = 0.0\naltitude_m = {:?}", altitude_m + climb)),
            (75.0, format!("airspeed_m_s = {fast:?}")),
            (90.0, format!("airspeed_m_s = {slow:?}\nroll_deg = {:?}", 0.5 * bank)),
            (105.0, format!("airspeed_m_s = {v:?}\nroll_deg = 0.0\naltitude_m = {altitude_m:?}")),
        ];
        let entry = |(at_s, keys): &(f64, String)| {
            format!("[[autopilot.reference]]\nat_s = {at_s:?}\n{keys}\n")
        };
        format!(
            "[plant]\nseed = 1\nearth = \"wgs84\"\nduration_s = {FLIGHT_S:?}\n[plant.start]\naltitude_m = {altitude_m:?}\nairspeed_m_s = {v:?}\n\
             [plant.wind]\nturbulence_m_s = {:?}\n{}",
            turbulence_m_s(&self.start),
            lines.iter().map(entry).collect::<String>()
        )
    }

    fn setup(&self, law: MainLaw) -> Result<FlightSetup, Problem> {
        let options = SetupOptions::default();
        let builder = SetupBuilder::of(self.airframe.clone(), self.model, options)?;
        let mut setup = builder.setup(&Named::given("check flight", self.scenario()), &[])?;
        let selection = &mut setup.parameters.gains.selection;
        (selection.main, selection.compensator) = (law, CompensatorMode::Off);
        Ok(setup)
    }

    fn fly(&self, law: MainLaw) -> Result<CheckFlight, Problem> {
        let setup = self.setup(law)?;
        let (mut errors, mut estimates) =
            ([(); 3].map(|()| Vec::new()), [(); 3].map(|()| Vec::new()));
        let mut each_tick = |tick: &Tick<'_>| {
            let (log, truth) = (tick.log, tick.plant.truth());
            errors[0].push(truth.altitude_m - log.altitude_reference_m);
            errors[1].push((truth.attitude.euler().phi - log.roll_reference_rad).to_degrees());
            errors[2].push(truth.airspeed_m_s - log.airspeed_reference_m_s);
            for (of_axis, z2) in estimates.iter_mut().zip(&log.z2) {
                of_axis.push(*z2);
            }
        };
        let keep = Keep { each_tick: Some(&mut each_tick), ..Keep::default() };
        let (outcome, _) = flown::fly(&setup, true, keep)?;
        let [altitude, roll, airspeed] = errors.map(rms);
        let name = name_of(MainLaw::NAMES, law);
        let mut weak = Vec::new();
        if let Some(loss) = &outcome.loss {
            weak.push(format!("{name} loses the aircraft at {:.1} s: {}", loss.at_s, loss.by));
        }
        let v = self.start.airspeed_m_s;
        for (what, error, most, unit) in [
            ("altitude", altitude, 0.5 * v, "m"),
            ("roll", roll, 10.0, "deg"),
            ("airspeed", airspeed, 0.15 * v, "m/s"),
        ] {
            if error > most {
                weak.push(format!("{name} follows the {what} with {error:.1} {unit} rms"));
            }
        }
        let is_kept = outcome.is_kept();
        let kept = if is_kept { "kept" } else { "**lost**" };
        let row = format!("| {name} | {kept} | {altitude:.2} | {roll:.2} | {airspeed:.2} |");
        Ok(CheckFlight { is_kept, row, weak, estimate_rad_s2: estimates.map(rms) })
    }
}

/// Rows of the report for the loops of a law.
fn margins_of(setup: &FlightSetup, name: &str, report: &mut String, weak: &mut Vec<String>) {
    let SetupLoops { rows, eigenvalues } = match margins::loops(setup, margins::AMPLITUDE, false) {
        Ok(looked_at) => looked_at,
        Err(problem) => return weak.push(format!("{name} has no margins: {problem}")),
    };
    let unstable = eigenvalues.iter().filter(|s| margins::grows(s)).count();
    if unstable > 0 {
        weak.push(format!("{name}: {unstable} eigenvalues of the closed loop are unstable"));
    }
    for LoopRow { effectors: kind, margins, .. } in rows {
        let [least, most] = margins.gain;
        let phase_deg = margins.phase_rad.map(f64::to_degrees);
        let number =
            |value: Option<f64>| value.map_or("none".to_owned(), |value| format!("{value:.1}"));
        let _ = writeln!(
            report,
            "| {name} | {kind} | {} | {least:.2} to {most:.2} | {} |",
            number(margins.crossover_rad_s),
            number(phase_deg)
        );
        if most < GAIN_MARGIN || phase_deg.is_some_and(|phase| phase < PHASE_MARGIN_DEG) {
            weak.push(format!(
                "{name}: the loop of {kind} has a gain margin of {most:.2} and {} deg of phase",
                number(phase_deg)
            ));
        }
    }
}

#[cfg(test)]
mod tests;
