//! The command line: what a user meets first.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use autopilot::own_law::OwnLaw;
use autopilot::run::AutopilotArgs;
use clap::{Args, Parser, Subcommand, ValueEnum};
use host_io::file;
use icd::ControlPeriod;
use plant_sim::io::{PlantArgs, parse_earth, parse_period, whole};
use plant_sim::setup::default_step_us;
use plant_sim::{Airframe, EarthModel, Scenario, Start, scenario};

use crate::actions::{self, ActionsArgs};
use crate::bench::{self, BenchArgs};
use crate::echo::{self, EchoArgs};
use crate::launch::{self, LaunchArgs};
use crate::udp_flight;
use flight_analysis::configuration::AircraftArgs;
use flight_analysis::design::{self, DesignArgs};
use flight_analysis::envelope;
use flight_analysis::false_alarms;
use flight_analysis::fly::jams::{self, JamsArgs};
use flight_analysis::fly::{self, FlyArgs};
use flight_analysis::linearize;
use flight_analysis::margins::{self, MarginsArgs};
use flight_analysis::mission::{self, MissionOptions};
use flight_analysis::paper::{self, Link, Options};
use flight_analysis::plot::{self, PlotArgs};
use flight_analysis::replay::{self, ReplayArgs};

/// Largest gyro noise that can be asked for, deg/s rms.
const GYRO_NOISE_MAX_DEG_S: f64 = 10.0;
/// Largest turbulence that can be asked for, m/s rms.
const TURBULENCE_MAX_M_S: f64 = 20.0;

/// Longest study of false alarms, hours.
const HOURS_MAX: f64 = 10_000.0;

/// Fastest steady wind that can be asked for, m/s.
const WIND_MAX_M_S: f64 = 60.0;

/// Two-Step: a jet that keeps flying when a surface jams.
///
/// Without a command it starts the plant and the autopilot as two processes and waits for ground stations.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    launch: LaunchArgs,
}

/// The program `sitl`: reads the command line, and says on standard error what went wrong. `own_law` is a law that
/// the caller brings: it flies unless `--law` says otherwise.
#[must_use]
pub fn main(own_law: Option<OwnLaw>) -> ExitCode {
    host_io::console::show();
    let mut cli = Cli::parse();
    cli.bring(own_law);
    run(&cli).unwrap_or_else(|error| {
        tracing::error!("{error}");
        ExitCode::FAILURE
    })
}

impl Cli {
    /// Takes a law that the program brings.
    fn bring(&mut self, own_law: Option<OwnLaw>) {
        self.launch.bring(own_law);
        match &mut self.command {
            Some(Command::Autopilot(args)) => args.own_law = own_law,
            Some(Command::Fly(args)) => args.bring(own_law),
            _ => {}
        }
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fly a scenario in this process to its end, and say what became of it
    Fly(Box<FlyArgs>),
    /// Fly the paper's two cases, check its claims, draw its figures
    Paper(PaperArgs),
    /// Fly a demonstration mission and draw its track
    Mission(MissionArgs),
    /// Fly the healthy aircraft where it has to hold its altitude, and draw how well it does
    Envelope(EnvelopeArgs),
    /// Count false alarms of the detector in hours of healthy flight, over its delay
    FalseAlarms(FalseAlarmArgs),
    /// Draw the flight of a log into a page
    Plot(PlotArgs),
    /// Fly the flight of a log again and compare it bit for bit
    Replay(ReplayArgs),
    /// Derive the controller's model from the plant at its design trim
    Linearize(LinearizeArgs),
    /// Fly every surface jammed at parts of its travel, without and with the compensator, and write the table
    Jams(Box<JamsArgs>),
    /// Design the gains of a law from the controller's model
    #[command(subcommand)]
    Design(Design),
    /// Write buttons for QGroundControl that break something
    Actions(Box<ActionsArgs>),
    /// Print eigenvalues and margins of gain, phase and delay of each law's loop, confirmed by flights
    Margins(Box<MarginsArgs>),
    /// The flight software alone, as the program `autopilot`
    Autopilot(Box<AutopilotArgs>),
    /// The aircraft alone, as the program `plant-sim`
    PlantSim(Box<PlantArgs>),
    /// Print every parameter of the autopilot, as docs/parameters.md has them
    Parameters,
    /// Print how fast flights run on this machine, as ratios
    Bench(BenchArgs),
    /// Send link packets to and fro without a flight
    #[command(hide = true)]
    Echo(EchoArgs),
}

/// Laws whose gains can be designed.
#[derive(Debug, Subcommand)]
enum Design {
    /// Linear quadratic regulator: the discrete Riccati equation at the design point
    Lqr(DesignArgs),
}

/// Options of `sitl paper`.
#[derive(Debug, Args)]
pub struct PaperArgs {
    /// Folder for tables, claims, figures and report
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Aircraft and settings.
    #[command(flatten)]
    aircraft: AircraftArgs,
    /// Claims 4 and 5 too (a few minutes)
    #[arg(long)]
    full: bool,
    /// How plant and autopilot talk
    #[arg(long, value_enum, default_value = "in-process")]
    link: LinkChoice,
    /// Control period, 1 to 4 ms
    #[arg(long, allow_negative_numbers = true, value_name = "MS", default_value = "2", value_parser = parse_period)]
    period_ms: ControlPeriod,
    /// Integration step, us; divides the control period [default: its largest divisor up to 1000]
    #[arg(long, allow_negative_numbers = true, value_name = "US", value_parser = whole(1, ControlPeriod::MAX_MICROS))]
    step_us: Option<u32>,
    /// flat or wgs84
    #[arg(long, value_name = "MODEL", default_value = "wgs84", value_parser = parse_earth)]
    earth: EarthModel,
    /// White noise of the gyros, deg/s rms of each control sample; with it the limits of claim 4 apply
    #[arg(long, allow_negative_numbers = true, value_name = "DEG_S", default_value_t = 0.0, value_parser = parse_gyro_noise)]
    gyro_noise_deg_s: f64,
    /// Turbulence, m/s rms: light 1.5, moderate 3; with it the limits of claim 4 apply
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 0.0, value_parser = parse_turbulence)]
    turbulence_m_s: f64,
    /// Seed of all random streams
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    seed: u64,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum LinkChoice {
    /// Function calls in one process
    InProcess,
    /// Two processes over UDP
    Udp,
}

/// Options of `sitl false-alarms`.
#[derive(Debug, Args)]
pub struct FalseAlarmArgs {
    /// Folder for tables, figure and page
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Healthy flight, hours, up to 10000; 100 take some minutes of all cores
    #[arg(long, allow_negative_numbers = true, value_name = "H", default_value_t = 3.0, value_parser = parse_hours)]
    hours: f64,
    /// Turbulence, m/s rms: light 1.5, moderate 3
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 3.0, value_parser = parse_turbulence)]
    turbulence_m_s: f64,
    /// White noise of the gyros, deg/s rms of each control sample
    #[arg(long, allow_negative_numbers = true, value_name = "DEG_S", default_value_t = 0.1, value_parser = parse_gyro_noise)]
    gyro_noise_deg_s: f64,
    /// The aircraft, instead of the variant with Mach effects that comes with the program
    #[arg(long, value_name = "FILE")]
    airframe: Option<PathBuf>,
    /// Seed of the first flight; each has its own
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    seed: u64,
}

/// Options of `sitl mission`.
#[derive(Debug, Args)]
pub struct MissionArgs {
    /// Folder for the figure
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Aircraft and settings.
    #[command(flatten)]
    aircraft: AircraftArgs,
    /// flat or wgs84
    #[arg(long, value_name = "MODEL", default_value = "wgs84", value_parser = parse_earth)]
    earth: EarthModel,
    /// Steady wind, m/s, to the east-north-east
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 0.0, value_parser = parse_wind)]
    wind_m_s: f64,
    /// Turbulence, m/s rms: light 1.5, moderate 3
    #[arg(long, allow_negative_numbers = true, value_name = "M_S", default_value_t = 0.0, value_parser = parse_turbulence)]
    turbulence_m_s: f64,
    /// Seed of all random streams
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 1, value_parser = whole(0, u64::MAX))]
    seed: u64,
}

/// Options of `sitl envelope`.
#[derive(Debug, Args)]
pub struct EnvelopeArgs {
    /// Folder for table and picture
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Options of `sitl linearize`.
#[derive(Debug, Args)]
pub struct LinearizeArgs {
    /// Where the model goes
    #[arg(long, value_name = "FILE", default_value = "autopilot/models/tvc_jet.toml")]
    out: PathBuf,
    /// The aircraft, instead of the one that comes with the program
    #[arg(long, value_name = "FILE")]
    airframe: Option<PathBuf>,
    /// Flight condition of the model instead of the design point of the airframe; several make a model that is scheduled
    /// between them
    #[arg(long, value_name = "ALTITUDE_M,AIRSPEED_M_S", allow_hyphen_values = true)]
    at: Vec<linearize::Condition>,
}

/// Does what the command line says.
///
/// # Errors
/// Whatever keeps it from being done, in words for the operator.
pub fn run(cli: &Cli) -> Result<ExitCode, Box<dyn Error>> {
    // This executable starts itself for the two processes.
    let program = std::env::current_exe()?;
    match &cli.command {
        None => launch::run(&cli.launch, &program)?,
        Some(Command::Fly(args)) => return Ok(fly::run(args).into()),
        Some(Command::Paper(args)) => return fly_paper(args, &program),
        Some(Command::Mission(args)) => mission::run(&args.options())?,
        Some(Command::Envelope(args)) => envelope::run(&args.out)?,
        Some(Command::FalseAlarms(args)) => false_alarms::run(&args.options())?,
        Some(Command::Plot(args)) => plot::run(args)?,
        Some(Command::Jams(args)) => jams::run(args)?,
        Some(Command::Replay(args)) => return Ok(replay::run(args).into()),
        Some(Command::Linearize(args)) => write_model(args)?,
        Some(Command::Design(Design::Lqr(args))) => design::run(args)?,
        Some(Command::Actions(args)) => actions::run(args)?,
        Some(Command::Margins(args)) => margins::run(args)?,
        Some(Command::Autopilot(args)) => drop(autopilot::run::run(args)?),
        Some(Command::PlantSim(args)) => drop(plant_sim::io::run(args)?),
        Some(Command::Parameters) => {
            print!("{}", autopilot::parameters::document(&Airframe::paper().effectors));
        }
        Some(Command::Bench(args)) => bench::run(args, &program)?,
        Some(Command::Echo(args)) => echo::run(args)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The exit code says whether all checked claims hold.
fn fly_paper(args: &PaperArgs, program: &Path) -> Result<ExitCode, Box<dyn Error>> {
    let options = args.options();
    let outcome = match options.link {
        Link::InProcess => paper::run(&options, &paper::in_process),
        Link::Udp => {
            paper::run(&options, &|setup, sink| Ok(udp_flight::fly_udp(program, setup, sink)?))
        }
    }?;
    println!("figures and report: {}", args.out.join("report.html").display());
    Ok(if outcome.all_hold() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

impl PaperArgs {
    fn options(&self) -> Options {
        Options {
            earth: self.earth,
            period: self.period_ms,
            step_us: self.step_us.unwrap_or_else(|| default_step_us(self.period_ms)),
            gyro_noise_deg_s: self.gyro_noise_deg_s,
            turbulence_m_s: self.turbulence_m_s,
            seed: self.seed,
            full: self.full,
            out: self.out.clone(),
            aircraft: self.aircraft.clone(),
            link: match self.link {
                LinkChoice::InProcess => Link::InProcess,
                LinkChoice::Udp => Link::Udp,
            },
        }
    }
}

impl FalseAlarmArgs {
    fn options(&self) -> false_alarms::Options {
        let Self { out, hours, turbulence_m_s, gyro_noise_deg_s, airframe, seed } = self;
        false_alarms::Options {
            hours: *hours,
            turbulence_m_s: *turbulence_m_s,
            gyro_noise_deg_s: *gyro_noise_deg_s,
            seed: *seed,
            out: out.clone(),
            airframe: airframe.clone(),
        }
    }
}

impl MissionArgs {
    fn options(&self) -> MissionOptions {
        let Self { out, aircraft, earth, wind_m_s, turbulence_m_s, seed } = self;
        MissionOptions {
            aircraft: aircraft.clone(),
            earth: *earth,
            wind_m_s: *wind_m_s,
            turbulence_m_s: *turbulence_m_s,
            seed: *seed,
            out: out.clone(),
        }
    }
}

fn write_model(args: &LinearizeArgs) -> Result<(), Box<dyn Error>> {
    let airframe = match &args.airframe {
        None => Airframe::paper(),
        Some(path) => {
            let name = path.display().to_string();
            let text = file::read_text(path, file::TEXT_MAX)
                .map_err(|problem| format!("{name}: {problem}"))?;
            Airframe::from_toml(&name, &text)?
        }
    };
    let nominal = Scenario::from_toml("nominal.toml", scenario::NOMINAL, &airframe.effectors)?;
    let mut setup = nominal.plant.setup(airframe, 0, ControlPeriod::DEFAULT, 1_000);
    let at = |condition: &linearize::Condition| {
        let linearize::Condition { altitude_m, airspeed_m_s } = *condition;
        Start { altitude_m, airspeed_m_s, ..setup.start }
    };
    let mut points: Vec<Start> = args.at.iter().map(at).collect();
    if let [only] = points[..] {
        setup.start = only;
        points.clear();
    }
    let file = args.airframe.as_ref().map_or("tvc_jet.toml".into(), |path| path.to_string_lossy());
    let model =
        linearize::linearize(&setup, &points).map_err(|error| format!("{file}: {error}"))?;
    model.validate().map_err(|error| format!("{file}: the model: {error}"))?;
    let parameters = linearize::parameters_of(&args.out)
        .map_err(|problem| format!("--out {}: {problem}", args.out.display()))?;
    let text = linearize::to_toml(&model, &parameters)?;
    file::write(&args.out, text.as_bytes(), linearize::MARK.as_bytes())
        .map_err(|problem| format!("--out {}: {problem}", args.out.display()))?;
    println!("wrote {}", args.out.display());
    Ok(())
}

fn parse_hours(text: &str) -> Result<f64, String> {
    parse_inside(text, HOURS_MAX, "h")
}

fn parse_gyro_noise(text: &str) -> Result<f64, String> {
    parse_inside(text, GYRO_NOISE_MAX_DEG_S, "deg/s")
}

fn parse_turbulence(text: &str) -> Result<f64, String> {
    parse_inside(text, TURBULENCE_MAX_M_S, "m/s")
}

fn parse_wind(text: &str) -> Result<f64, String> {
    parse_inside(text, WIND_MAX_M_S, "m/s")
}

fn parse_inside(text: &str, max: f64, unit: &str) -> Result<f64, String> {
    let value: f64 =
        text.parse().map_err(|_| format!("not a number; allowed are 0 to {max} {unit}"))?;
    if (0.0..=max).contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} is outside 0 to {max} {unit}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    /// A parser of another type than its field is found only when the value is taken.
    #[test]
    fn every_command_takes_its_defaults() {
        let lines = [
            "",
            "fly nominal",
            "fly case1 --seed 1..3 --set FTC_MODE=0 --out x",
            "paper --out x",
            "mission --out x",
            "envelope --out x",
            "false-alarms --out x",
            "plot a.ulg",
            "replay a.ulg",
            "linearize",
            "design lqr --out x",
            "autopilot --cpu 0",
            "plant-sim --cpu 0 --step-us 500 --seed 3",
            "parameters",
            "bench",
            "echo --to 127.0.0.1:9 --cpu 0",
        ];
        for line in lines {
            let words = ["sitl"].into_iter().chain(line.split_whitespace());
            let parsed = Cli::try_parse_from(words).map(drop).map_err(|error| error.to_string());
            assert_eq!(parsed, Ok(()), "{line}");
        }
    }

    /// Options that take a number, by their names in the help.
    const NUMBERS: [&str; 13] = [
        "MS",
        "US",
        "N",
        "S",
        "M_S",
        "DEG_S",
        "MB",
        "CORE",
        "FACTOR|max",
        "COUNT",
        "HZ",
        "DEG",
        "H",
    ];

    fn check_numbers(command: &clap::Command, words: &[&str], tried: &mut u32) {
        for option in command.get_arguments().filter(|option| option.get_long().is_some()) {
            let names = option.get_value_names().unwrap_or_default();
            if !names.iter().any(|name| NUMBERS.contains(&name.as_str())) {
                continue;
            }
            let name = format!("--{}", option.get_long().unwrap());
            let all = words.iter().copied().chain([name.as_str(), "-1"]);
            if let Err(error) = Cli::try_parse_from(all) {
                let kind = error.kind();
                assert_ne!(kind, clap::error::ErrorKind::UnknownArgument, "{words:?} {error}");
                *tried += 1;
            }
        }
        for command in command.get_subcommands() {
            let words: Vec<&str> = words.iter().copied().chain([command.get_name()]).collect();
            check_numbers(command, &words, tried);
        }
    }

    #[test]
    fn a_negative_number_is_never_taken_for_an_option() {
        let mut tried = 0;
        check_numbers(&Cli::command(), &["sitl"], &mut tried);
        assert!(tried > 10, "{tried} numbers were refused");
    }

    #[test]
    fn numbers_outside_their_range_are_refused_with_the_range() {
        for bad in ["nan", "inf", "-1", "99", "x"] {
            let arguments = ["sitl", "paper", "--out", "o", "--turbulence-m-s", bad];
            let message = Cli::try_parse_from(arguments).map(|_| ()).unwrap_err().to_string();
            assert!(message.contains("0 to 20 m/s"), "{message}");
        }
    }
}
