//! What the studies share: options, aircraft, drawn numbers, and what keeps them from being made.

use std::path::{Path, PathBuf};

use autopilot::autopilot::Settings;
use autopilot::own_law::OwnLaw;
use flight_control::CompensatorMode;
use host_io::folder::OutFolder;
use maud::{PreEscaped, html};
use plant_sim::{Airframe, GradeName, PlantSetup};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::Serialize;

use crate::builder::SetupOptions;
use crate::chart::{Figure, write_figure};
use crate::closed_loop::FlightSetup;
use crate::configuration::{AircraftArgs, Named};
use crate::page;
use crate::problem::{At as _, Problem, problem};
use crate::settings::Setting;

/// Options that every study takes.
#[derive(Debug, Clone, Default, PartialEq, clap::Args)]
pub struct StudyOptions {
    /// Aircraft, model, laws, settings.
    #[command(flatten)]
    pub flight: SetupOptions,
    /// Folder for tables, pictures and pages
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
}

/// Everything that defines a flight, but the code of a law of the program: enough to fly it again.
#[derive(Serialize)]
pub struct WholeSetup<'a> {
    plant: &'a PlantSetup,
    control: Settings,
    duration_s: f64,
}

impl<'a> WholeSetup<'a> {
    /// Of a flight.
    pub fn of(setup: &'a FlightSetup) -> Self {
        let duration_s = setup.duration.as_seconds();
        Self { plant: &setup.plant, control: setup.settings(), duration_s }
    }
}

/// `setup.json` of a study: what was asked for, and the flight that its flights are variations of.
#[derive(Serialize)]
struct Asked<'a> {
    program: &'static str,
    version: &'static str,
    command: Vec<String>,
    own_law: Option<&'a str>,
    setup: WholeSetup<'a>,
}

/// How the file begins.
const MARK: &[u8] = b"{\n  \"program\": \"Two-Step sitl study\"";

/// What studies of random flights about the design point set themselves: beginnings of keys.
pub const RANDOM: [&str; 9] = [
    "plant.seed",
    "plant.start.altitude",
    "plant.start.airspeed",
    "plant.wind.turbulence",
    "plant.sensors.grade",
    "plant.sensors.gyro_noise",
    "plant.duration",
    "plant.fault",
    "autopilot.reference",
];

/// Aircraft and laws of a study, read once.
#[derive(Debug, Clone)]
pub struct Sides {
    /// Level flight at the design point.
    nominal: FlightSetup,
    /// The same with the sensors of each grade.
    of_grade: [FlightSetup; GradeName::ALL.len()],
}

impl StudyOptions {
    /// An aircraft with settings, and nothing written.
    pub fn of(aircraft: AircraftArgs) -> Self {
        let flight = SetupOptions { aircraft, ..SetupOptions::default() };
        Self { flight, ..Self::default() }
    }

    /// Aircraft and laws. Without `--ftc` the compensator is in `mode`; `own` are beginnings of keys that the study sets in its
    /// flights itself, so that setting them is refused.
    pub fn sides(&self, mode: CompensatorMode, own: &[&str]) -> Result<Sides, Problem> {
        Sides::new(&self.flight, mode, own)
    }

    /// The same for random flights, unless `--airframe` names another one with the jet whose derivatives change with the Mach
    /// number, which the controller's model does not know.
    pub fn random_sides(&self, mode: CompensatorMode, own: &[&str]) -> Result<Sides, Problem> {
        let mut options = self.flight.clone();
        if options.aircraft.airframe.is_none() {
            options.aircraft.airframe = Some("tvc_jet_mach".into());
            let _ = options.aircraft.model.get_or_insert_with(|| "tvc_jet".into());
        }
        Sides::new(&options, mode, &[&RANDOM, own].concat())
    }
}

impl Sides {
    fn new(options: &SetupOptions, mode: CompensatorMode, own: &[&str]) -> Result<Self, Problem> {
        let settings = &options.aircraft.settings;
        let is_own = |setting: &&Setting| own.iter().any(|key| setting.key.starts_with(key));
        if let Some(Setting { key, .. }) = settings.iter().find(is_own) {
            return Err(self::own(&format!("--set {key}")));
        }
        let sets = |name: &str| settings.iter().any(|Setting { key, .. }| key == name);
        let (builder, scenario) = (options.builder()?, Named::scenario("nominal")?);
        let setup = |more: &[Setting]| -> Result<FlightSetup, Problem> {
            let mut setup = builder.setup(&scenario, more)?;
            if options.ftc.is_none() && !sets("FTC_MODE") {
                setup.parameters.gains.selection.compensator = mode;
            }
            Ok(setup)
        };
        let graded = |grade: GradeName| setup(&[Setting::new("plant.sensors.grade", grade.key())]);
        let [ideal, tactical, consumer] = GradeName::ALL.map(graded);
        let of_grade = [ideal?, tactical?, consumer?];
        Ok(Self { nominal: setup(&[])?, of_grade })
    }

    /// The folder of the study, with `setup.json` in it, before the first flight.
    pub fn begin(&self, out: &Path) -> Result<OutFolder, Problem> {
        let folder = OutFolder::create(out)?;
        let command = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
        let asked = Asked {
            program: "Two-Step sitl study",
            version: env!("CARGO_PKG_VERSION"),
            command: command.collect(),
            own_law: self.nominal.own_law.as_ref().map(OwnLaw::name),
            setup: WholeSetup::of(&self.nominal),
        };
        let mut json = serde_json::to_vec_pretty(&asked).at("setup.json")?;
        json.push(b'\n');
        folder.write_marked("setup.json", MARK, &json)?;
        Ok(folder)
    }

    /// The aircraft.
    pub fn airframe(&self) -> &Airframe {
        &self.nominal.plant.airframe
    }

    /// Level flight at the design point.
    pub fn nominal(&self) -> &FlightSetup {
        &self.nominal
    }

    /// The same with sensors of a grade, and the estimator set to them.
    pub fn with_sensors(&self, grade: GradeName) -> FlightSetup {
        self.of_grade[grade as usize].clone()
    }

    /// Airspeed and altitude of the design point over those of the paper's jet: flight conditions that are stated for it are scaled so.
    pub fn scale(&self) -> Scale {
        let design = &self.airframe().design_point;
        Scale { airspeed: design.airspeed_m_s / 264.0, altitude: design.altitude_m / 5_000.0 }
    }
}

/// Airspeed and altitude over those of the paper's jet, at the design points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Of airspeeds.
    pub airspeed: f64,
    /// Of altitudes.
    pub altitude: f64,
}

/// Numbers between two limits, drawn from the stream of this seed and name.
pub fn draws(seed: u64, name: [u8; 24]) -> impl FnMut(f64, f64) -> f64 {
    let mut key = [0; 32];
    key[..8].copy_from_slice(&seed.to_le_bytes());
    key[8..].copy_from_slice(&name);
    let mut generator = ChaCha8Rng::from_seed(key);
    move |low, high| {
        let unit = f64::from(generator.next_u32()) / (f64::from(u32::MAX) + 1.0);
        low + (high - low) * unit
    }
}

/// An option that would have no effect.
pub fn own(option: &str) -> Problem {
    problem!("{option} has no effect: this study sets it in its flights itself")
}

/// Writes figure, tables, summary and a page that opens without a network, with these words in its title and heading; prints the
/// summary.
pub fn write_report(
    folder: &OutFolder,
    [title, heading]: [&str; 2],
    figure: &Figure,
    tables: &[(&str, String)],
    summary: &str,
) -> Result<(), Problem> {
    write_figure(folder, figure)?;
    for (name, table) in tables {
        folder.write(name, table.as_bytes())?;
    }
    folder.write_markdown("summary.md", summary)?;
    let body = html! {
        h1 { (heading) }
        figure {
            (PreEscaped(&figure.svg))
            figcaption { (figure.caption) }
        }
        (page::markdown(summary))
    };
    let page = page::page(title, "", &body);
    folder.write_marked("report.html", page::GENERATOR.as_bytes(), page.as_bytes())?;
    print_line!("{summary}\nfigure and page: {}", folder.path().join("report.html").display());
    Ok(())
}
