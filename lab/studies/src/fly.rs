//! `sitl fly SCENARIO`: one flight in this process, or one for each seed, to its end.
//!
//! ```text
//! scenario, airframe, model, --set ─> FlightSetup ─> Flight ─ every tick ─> Judge ─> Outcome
//!                                                                             │        └─> line, exit status, outcome.json
//!                                                                             └─> flight.csv, .ulg, .html, .mcap
//! ```

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use autopilot::config;
use autopilot::own_law::OwnLaw;
use autopilot::run::ScriptArgs;
use flight_control::gains::name_of;
use flight_control::{AllocationMode, CompensatorLaw, CompensatorMode, MainLaw};
use host_io::console;
use host_io::file;
use host_io::folder::OutFolder;
use lab_judges::{JudgeKind, trajectory};
use plant_sim::EarthModel;
use plant_sim::io::parse_earth;
use scenarios::SCENARIOS;
use serde::Serialize;
use ulog::reader::Log;

use host_io::problem::{At as _, Problem, problem};
use lab_engine::builder::{SetupOptions, preset_note};
use lab_engine::configuration::AircraftArgs;
use lab_engine::geometry::AircraftGeometry;
use lab_judges::closed_loop::FlightSetup;
use lab_logs::{mcap, plot};
use lab_report::page::GENERATOR;
use lab_report::runner::Progress;

pub mod seeds;

use lab_judges::flown::{self, FlightLog, Keep};
use lab_judges::outcome::{
    FIGURES, LOG, MCAP, OUTCOME, Outcome, PROGRAM, TABLE, WholeSetup, write_json,
};
use seeds::Seeds;

/// Exit status: every aircraft was kept.
const KEPT: u8 = 0;
/// Exit status where an aircraft was lost.
const LOST: u8 = 1;
/// Exit status where something could not be flown or written.
const FAILED: u8 = 2;

/// Options of `sitl fly`.
#[derive(Debug, Clone, clap::Args)]
pub struct FlyArgs {
    #[arg(value_name = "SCENARIO", help = format!("What is flown: {}, or a file", file::names(SCENARIOS)))]
    scenario: String,
    /// Aircraft, settings, laws, steps.
    #[command(flatten)]
    pub options: SetupOptions,
    /// What begins with the flight.
    #[command(flatten)]
    script: ScriptArgs,
    /// Seed of all random streams, or seeds A..B, both included, each a flight of its own; instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "N|A..B")]
    pub seed: Option<Seeds>,
    /// Fly on after the loss of the aircraft, to the end or to the ground
    #[arg(long)]
    no_stop_at_loss: bool,
    /// Folder for outcome.json and flight.csv; of several seeds outcome.json and the table seeds
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// The flight log too (flight.ulg)
    #[arg(long, requires = "out")]
    ulog: bool,
    /// A page of figures too (flight.html)
    #[arg(long, requires = "out")]
    figures: bool,
    /// The flight for Foxglove and other viewers too (flight.mcap)
    #[arg(long, requires = "out")]
    mcap: bool,
    #[arg(
        long = "judge", value_name = "NAME", value_parser = JudgeKind::parse,
        help = format!("A judge whose numbers stand beside the measures: {}; may be repeated", JudgeKind::names())
    )]
    pub judges: Vec<JudgeKind>,
    /// flat, wgs84, round or round_non_rotating, instead of the scenario's
    #[arg(long, value_name = "MODEL", value_parser = parse_earth)]
    earth: Option<EarthModel>,
    /// White noise of the gyros, deg/s rms, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "DEG_S")]
    gyro_noise_deg_s: Option<f64>,
    /// Turbulence, m/s rms, instead of the scenario's
    #[arg(long, allow_negative_numbers = true, value_name = "M_S")]
    turbulence_m_s: Option<f64>,
}

/// Flies and reports the outcome. Exit status 0: the aircraft was kept; 1: it, or one of them, was lost; 2: error.
pub fn run(args: &FlyArgs) -> u8 {
    match args.fly() {
        Ok(true) => KEPT,
        Ok(false) => LOST,
        Err(error) => {
            tracing::error!("{error}");
            FAILED
        }
    }
}

/// Content of `outcome.json`: one flight or many.
#[derive(Serialize)]
struct Written<'a, T> {
    program: &'static str,
    version: &'static str,
    scenario: &'a str,
    airframe: Option<String>,
    model: Option<String>,
    set: Vec<String>,
    law: &'static str,
    own_law: Option<&'a str>,
    compensator: &'static str,
    allocation: &'static str,
    ftc: &'static str,
    fault_known: bool,
    setup: WholeSetup<'a>,
    #[serde(flatten)]
    flown: T,
}

/// Many flights in `outcome.json`.
#[derive(Serialize)]
struct Many<'a> {
    flights: &'a [Outcome],
    lost: usize,
}

/// One flight, to its end, with what is kept of it.
#[derive(Debug, Clone, Copy)]
pub struct OneFlight<'a> {
    /// Name of what is flown, for the flight log and for `outcome.json`.
    pub scenario: &'a str,
    /// Files and settings that the setup was made of, for `outcome.json`.
    pub aircraft: &'a AircraftArgs,
    /// What is flown.
    pub setup: &'a FlightSetup,
    /// The flight ends with the loss of the aircraft.
    pub stops_at_loss: bool,
    /// Folder for `outcome.json` and `flight.csv`, and for what else is wanted.
    pub folder: Option<&'a Path>,
    /// The flight log too.
    pub ulog: bool,
    /// A page of figures too.
    pub figures: bool,
    /// A file for viewers too, with this geometry of the aircraft.
    pub mcap: Option<&'a AircraftGeometry>,
    /// Judges whose numbers stand beside the measures.
    pub judges: &'a [JudgeKind],
}

impl OneFlight<'_> {
    /// Flies it and writes its files, `outcome.json` last.
    pub fn fly(&self) -> Result<Outcome, Problem> {
        // Before the flight: a folder that cannot be written shall not cost one.
        let folder = self.folder.map(OutFolder::create).transpose()?;
        let begin = |folder: &OutFolder| {
            folder.begin(TABLE, file::beginning(trajectory::header().as_bytes()))
        };
        let mut rows = folder.as_ref().map(begin).transpose()?;
        let wants_log = self.ulog || self.figures || self.mcap.is_some();
        let seconds = self.setup.duration.as_seconds();
        // Checked seconds of a flight.
        let progress = Progress::new("fly", "s", seconds as usize + 1).quiet_at_first();
        let keep = Keep {
            table: rows.as_mut(),
            log: wants_log.then(|| FlightLog::begin(self.scenario, self.setup)).transpose()?,
            each_second: Some(&|| progress.one_done()),
            each_tick: None,
            judges: self.judges,
            scenario: Some(self.scenario),
        };
        let (outcome, log) = flown::fly(self.setup, self.stops_at_loss, keep)?;
        progress.finish();
        if let Some(rows) = rows {
            rows.finish()?;
        }
        if let (Some(folder), Some(log)) = (&folder, log) {
            self.write_log(folder, log.end()?)?;
        }
        if let Some(folder) = &folder {
            // Last: where it is, everything is.
            let written = written(self.scenario, self.aircraft, self.setup, &outcome);
            write_json(folder, OUTCOME, &written)?;
        }
        Ok(outcome)
    }

    fn write_log(&self, folder: &OutFolder, bytes: Vec<u8>) -> Result<(), Problem> {
        if self.ulog {
            folder.write_marked(LOG, &ulog::format::MAGIC, &bytes)?;
        }
        if let Some(geometry) = self.mcap {
            let log = Log::from_bytes(bytes.clone()).at("mcap")?;
            folder.write_marked(MCAP, mcap::MARK, &mcap::file(log, geometry).at("mcap")?)?;
        }
        if self.figures {
            let log = Log::from_bytes(bytes).at("figures")?;
            let page = plot::page(self.scenario, log, own_law(self.setup)).at("figures")?;
            folder.write_marked(FIGURES, GENERATOR.as_bytes(), page.html.as_bytes())?;
        }
        Ok(())
    }
}

/// Name of the law of the program that flies, if it does.
fn own_law(setup: &FlightSetup) -> Option<&str> {
    let own = setup.own_law.as_ref().map(OwnLaw::name);
    let selection = &setup.parameters.gains.selection;
    own.filter(|_| selection.main == MainLaw::Own || selection.allocation == AllocationMode::Own)
}

fn written<'a, T>(
    scenario: &'a str,
    aircraft: &AircraftArgs,
    setup: &'a FlightSetup,
    flown: T,
) -> Written<'a, T> {
    let name = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
    let selection = &setup.parameters.gains.selection;
    Written {
        program: PROGRAM,
        version: env!("CARGO_PKG_VERSION"),
        scenario,
        airframe: name(&aircraft.airframe),
        model: name(&aircraft.model),
        set: aircraft.settings.iter().map(ToString::to_string).collect(),
        law: name_of(MainLaw::NAMES, selection.main),
        own_law: own_law(setup),
        compensator: name_of(CompensatorLaw::NAMES, selection.compensator_law),
        allocation: name_of(AllocationMode::NAMES, selection.allocation),
        ftc: name_of(CompensatorMode::NAMES, selection.compensator),
        fault_known: setup.knows_fault,
        setup: WholeSetup::of(setup),
        flown,
    }
}

impl FlyArgs {
    /// Whether every aircraft was kept.
    fn fly(&self) -> Result<bool, Problem> {
        let setup = self.setup()?;
        let preset = setup.parameters.gains.selection.estimator;
        let inherited = config::inherited(&setup.model, &setup.parameters);
        for note in preset_note(preset, &setup.plant.sensors).into_iter().chain(inherited) {
            // Nobody may read it.
            let _ = writeln!(console::err(), "{note}");
        }
        if let Some(Seeds::Range { from, to }) = self.seed {
            return self.fly_seeds(&setup, from, to);
        }
        let effectors = &setup.plant.airframe.effectors;
        let geometry =
            || AircraftGeometry::of_aircraft(&self.options.aircraft, None, effectors).at("--mcap");
        // Before the flight, as the folder.
        let geometry = self.mcap.then(geometry).transpose()?;
        let one = OneFlight {
            scenario: &self.scenario,
            aircraft: &self.options.aircraft,
            setup: &setup,
            stops_at_loss: self.stops_at_loss(),
            folder: self.out.as_deref(),
            ulog: self.ulog,
            figures: self.figures,
            mcap: geometry.as_ref(),
            judges: &self.judges,
        };
        let outcome = one.fly()?;
        print(&format!("{}, {outcome}\n", self.scenario))?;
        Ok(outcome.is_kept())
    }

    fn fly_seeds(&self, setup: &FlightSetup, from: u64, to: u64) -> Result<bool, Problem> {
        let options = [(self.ulog, "--ulog"), (self.figures, "--figures"), (self.mcap, "--mcap")];
        for (is_given, option) in options {
            if is_given {
                return Err(problem!("{option} is for one flight, not for a range of seeds"));
            }
        }
        let folder = self.out.as_deref().map(OutFolder::create).transpose()?;
        let keep =
            || Keep { judges: &self.judges, scenario: Some(&self.scenario), ..Keep::default() };
        let flights = seeds::fly(setup, from, to, self.stops_at_loss(), keep)?;
        if let Some(folder) = &folder {
            seeds::table(&flights).write(folder.path())?;
            let lost = flights.iter().filter(|outcome| !outcome.is_kept()).count();
            let flown = Many { flights: &flights, lost };
            let aircraft = &self.options.aircraft;
            write_json(folder, OUTCOME, &written(&self.scenario, aircraft, setup, flown))?;
        }
        print(&seeds::shown(&flights))?;
        Ok(flights.iter().all(Outcome::is_kept))
    }

    pub fn stops_at_loss(&self) -> bool {
        !self.no_stop_at_loss
    }

    /// The flight of the options.
    pub fn setup(&self) -> Result<FlightSetup, Problem> {
        let turbulence = self.turbulence_m_s.map(|_| "--turbulence-m-s");
        let given = [
            ("plant.seed", self.seed.map(|_| "--seed")),
            ("plant.earth", self.earth.map(|_| "--earth")),
            ("plant.sensors.gyro_noise_deg_s", self.gyro_noise_deg_s.map(|_| "--gyro-noise-deg-s")),
            // The option replaces a level as well as a constant intensity.
            ("plant.wind.turbulence", turbulence),
            ("plant.wind.turbulence_m_s", turbulence),
        ];
        let given = given.into_iter().filter_map(|(key, option)| Some((key, option?)));
        // With an option and `--set` for one key it would be open which of them counts.
        self.options.aircraft.check_beside(given)?;
        let mut setup = self.options.setup(&self.scenario)?;
        let plant = &mut setup.plant;
        plant.earth = self.earth.unwrap_or(plant.earth);
        if let Some(Seeds::One(seed)) = self.seed {
            plant.seed = seed;
        }
        if let Some(noise) = self.gyro_noise_deg_s {
            plant.sensors.gyro_noise_rad_s = noise.to_radians();
        }
        if let Some(intensity_m_s) = self.turbulence_m_s {
            plant.wind = plant.wind.with_turbulence_m_s(intensity_m_s);
        }
        plant.check()?;
        let scenario = setup.script.take().map(Arc::unwrap_or_clone);
        let script = self.script.read(scenario, &plant.airframe.effectors)?;
        setup.script = script.map(Arc::new);
        Ok(setup)
    }
}

fn print(text: &str) -> Result<(), Problem> {
    let mut out = console::out();
    Ok(out.write_all(text.as_bytes()).and_then(|()| out.flush())?)
}
