//! The command line: what a user meets first.

use host_io::{print_line, print_text};
use std::error::Error;
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

use autopilot::own_law::OwnLaw;
use autopilot::run::AutopilotArgs;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use plant_sim::io::PlantArgs;
use plant_sim::{Airframe, ReadAirframe as _};

use crate::actions::{self, ActionsArgs};
use crate::bench::{self, BenchArgs};
use crate::echo::{self, EchoArgs};
use crate::launch::{self, LaunchArgs};
use crate::udp_flight;
use lab_campaign::RunArgs;
use lab_fmu::FmuArgs;
use lab_logs::mcap::{self, McapArgs};
use lab_logs::plot::{self, PlotArgs};
use lab_logs::replay::{self, ReplayArgs};
use lab_paper::Link;
use lab_studies::actuators::{self, ActuatorsArgs};
use lab_studies::checkcase::report::{self, CompareArgs};
use lab_studies::checkcase::{self, CheckcaseArgs};
use lab_studies::design::{self, DesignArgs};
use lab_studies::fly::{self, FlyArgs};
use lab_studies::geometry::{self, DrawArgs};
use lab_studies::linearize::{self, LinearizeArgs};
use lab_studies::margins::{self, MarginsArgs};
use lab_studies::mission::{self, MissionOptions};
use lab_studies::new::{self, NewArgs};
use lab_studies::sensor_errors::{self, SensorErrorsArgs};
use lab_studies::trimmable::{self, TrimmableArgs};
use lab_studies::turbulence::{self, TurbulenceArgs};
use studies::STUDIES;

/// Two-Step: a jet that keeps flying when a surface jams.
///
/// Without a command it starts the plant and the autopilot as two processes and waits for ground stations.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Option<SitlCommand>,
    #[command(flatten)]
    launch: LaunchArgs,
}

/// The program `sitl`: reads the command line and reports errors on standard error. `own` is a law that the caller brings: it flies
/// unless `--law` names another one.
pub fn main(own: Option<OwnLaw>) -> ExitCode {
    // This executable starts itself for the two processes.
    match std::env::current_exe() {
        Ok(program) => main_of(std::env::args_os(), &program, own).into(),
        Err(error) => {
            tracing::error!("{error}");
            ExitCode::FAILURE
        }
    }
}

/// The same with these words, under a `program` that starts it; gives the exit status.
pub fn main_of(
    words: impl IntoIterator<Item = OsString>,
    program: &Path,
    own: Option<OwnLaw>,
) -> u8 {
    // First of all: it changes the mask of signals, which every later thread inherits.
    host_io::process::take_size_limit_as_error();
    host_io::console::show();
    let mut cli = Cli::read(words).unwrap_or_else(|error| refuse(&error));
    if let Some(own) = &own {
        cli.set_own_law(own);
    }
    // Success says that the results were written, so a full disk under them is a failure of the
    // program.
    let ended =
        run(&cli, program, own.as_slice()).and_then(|code| match host_io::console::finish() {
            Ok(()) => Ok(code),
            Err(error) => Err(format!("standard output: {error}").into()),
        });
    ended.unwrap_or_else(|error| {
        // A study that is a specification has options of its own.
        if let Some(mistake) = error.downcast_ref::<clap::Error>() {
            refuse(mistake);
        }
        tracing::error!("{error}");
        FAILED
    })
}

/// Exit status of what went well.
const DONE: u8 = 0;
/// Exit status of an error, and of a claim that does not hold.
const FAILED: u8 = 1;

/// Ends with what clap says: help and version on the standard output, a mistake on the other.
fn refuse(error: &clap::Error) -> ! {
    match error.use_stderr() {
        // The message repeats what was typed, control characters too, which the console leaves out.
        true => host_io::console::refuse(&error.render(), error.exit_code()),
        false => error.exit(),
    }
}

impl Cli {
    /// Reads a command line.
    pub fn read(words: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        let matches = command().try_get_matches_from(in_its_group(words.into_iter().collect()))?;
        Self::from_arg_matches(&matches)
    }

    /// Takes a law that the program brings.
    pub fn set_own_law(&mut self, own: &OwnLaw) {
        match &mut self.command {
            None => self.launch.set_own_law(own),
            Some(SitlCommand::Live(args)) => args.set_own_law(own),
            Some(SitlCommand::Autopilot(args)) => args.laws.set_own_law(own),
            Some(SitlCommand::Fly(args)) => args.options.laws.set_own_law(own),
            Some(SitlCommand::Study(study)) => study.set_own_law(own),
            Some(SitlCommand::Aircraft(AircraftCommand::Margins(args))) => args.set_own_law(own),
            Some(SitlCommand::Log(LogCommand::Replay(args))) => args.set_own_law(own),
            // A campaign gets the law when it runs; the others fly none.
            Some(_) => {}
        }
    }
}

impl StudyCommand {
    /// Takes a law that the program brings.
    fn set_own_law(&mut self, own: &OwnLaw) {
        let laws = match self {
            Self::Mission(args) => &mut args.laws,
            Self::Paper(_) | Self::PaperEstimated(_) => {
                return tracing::warn!("the paper flies its own laws, not {}", own.name());
            }
            // They fly no law.
            _ => return,
        };
        laws.set_own_law(own);
    }
}

#[derive(Debug, Subcommand)]
enum SitlCommand {
    /// Fly live for ground stations, as without a command; all its options
    Live(Box<LaunchArgs>),
    /// Fly a scenario to its end and report the outcome
    Fly(Box<FlyArgs>),
    /// Answer one question with many flights: tables, pictures, pages
    #[command(subcommand)]
    Study(StudyCommand),
    /// Fly many flights with several laws and compare what they survive
    #[command(subcommand)]
    Campaign(lab_campaign::Command),
    /// Models, gains, margins and parameters of an aircraft
    #[command(subcommand)]
    Aircraft(AircraftCommand),
    /// Draw flight logs, fly them again, convert them for viewers
    #[command(subcommand)]
    Log(LogCommand),
    /// The flight software alone, as the program `autopilot`
    #[command(hide = true)]
    Autopilot(Box<AutopilotArgs>),
    /// The aircraft alone, as the program `plant-sim`
    #[command(hide = true)]
    PlantSim(Box<PlantArgs>),
    /// Send link packets to and fro without a flight
    #[command(hide = true)]
    Echo(EchoArgs),
}

/// What is studied.
#[derive(Debug, Subcommand)]
#[command(after_help = specifications())]
enum StudyCommand {
    /// Fly the paper's two cases, check its claims, draw its figures
    Paper(lab_paper::Options),
    /// Fly the paper's two cases on estimated states, with sensors of each grade, and say which limits still hold
    PaperEstimated(lab_paper::estimated::Options),
    /// Fly a demonstration mission and draw its track
    Mission(MissionOptions),
    /// Draw the errors of each sensor of a grade in a steady flight
    #[command(name = "sensors")]
    SensorErrors(SensorErrorsArgs),
    /// Draw what each property of an actuator does to a step and a triangle
    Actuators(Box<ActuatorsArgs>),
    /// Fly through turbulence of a level and draw its six spectra beside the formulas of the standard
    Turbulence(TurbulenceArgs),
    /// Fly a scenario without a controller, and write its trajectory for a comparison with other simulators
    Checkcase(Box<CheckcaseArgs>),
    /// Fly check cases and draw how far they are from the trajectories of other simulators
    CompareCheckcases(CompareArgs),
    /// Print how fast flights run on this machine, as ratios
    Bench(BenchArgs),
    /// A study that is a specification: with the options of `sitl campaign run`
    #[command(external_subcommand)]
    Specified(Vec<OsString>),
}

/// What is made of an aircraft.
#[derive(Debug, Subcommand)]
enum AircraftCommand {
    /// Derive the controller's model from the plant at its design trim
    Linearize(LinearizeArgs),
    /// Make the model of a new aircraft with all its parameters, check it by margins and flights, and report what is weak
    New(NewArgs),
    /// Design the gains of a law from the controller's model
    #[command(subcommand)]
    Design(DesignCommand),
    /// Print eigenvalues and margins of gain, phase and delay of each law's loop, confirmed by flights
    Margins(Box<MarginsArgs>),
    /// Compute for every jam whether a steady flight exists at all, and draw how far each effector can jam
    Trimmable(Box<TrimmableArgs>),
    /// Draw the aircraft in three views, with its effectors and their hinges
    Draw(Box<DrawArgs>),
    /// Write buttons for QGroundControl that break something
    Actions(Box<ActionsArgs>),
    /// Write the plant or the autopilot as an FMU of FMI 3.0, for other simulators
    Fmu(Box<FmuArgs>),
    /// Print every parameter of the autopilot, as docs/parameters.md has them
    Parameters,
}

/// What is done with a flight log.
#[derive(Debug, Subcommand)]
enum LogCommand {
    /// Draw the flight of a log into a page
    Plot(PlotArgs),
    /// Fly the flight of a log again and compare it bit for bit
    Replay(ReplayArgs),
    /// Write the flight of a log for Foxglove, Rerun and other viewers of MCAP files
    Mcap(McapArgs),
}

/// The groups whose commands stood at the top once: their old names still work there, and in no help.
const GROUPS: [&str; 3] = ["study", "aircraft", "log"];

/// Options of a live flight that the first screen shows; `sitl live --help` has them all.
const FIRST: [&str; 7] = ["scenario", "airframe", "law", "ftc", "speed", "param", "instance"];

/// The command line as clap has it.
fn command() -> clap::Command {
    let hide = |arg: clap::Arg| match FIRST.contains(&arg.get_id().as_str()) {
        true => arg,
        // It is still accepted, so that an option of `live` works without the word too.
        false => arg.hide(true),
    };
    // Its first screen has some options; the help of `live` has the rest.
    let short = Cli::command()
        .mut_args(hide)
        .mut_arg("scenario", |arg| arg.help("Name of a scenario, or a file"))
        .mut_arg("airframe", |arg| arg.help("Name of an aircraft, or a file"));
    with_short_help(without_models(short).disable_help_flag(true))
}

/// Commands of an aircraft alone, which refuse `--model`.
const WITHOUT_MODEL: [(&str, [&str; 2]); 2] =
    [("study", ["sensors", "actuators"]), ("aircraft", ["trimmable", "actions"])];

/// Without the option of a model in the help of the commands that read none.
fn without_models(command: clap::Command) -> clap::Command {
    let hide = |below: clap::Command| below.mut_arg("model", |arg| arg.hide(true));
    WITHOUT_MODEL.into_iter().fold(command, |command, (group, names)| {
        let in_group = |all: clap::Command| {
            names.into_iter().fold(all, |all, name| all.mut_subcommand(name, hide))
        };
        command.mut_subcommand(group, in_group)
    })
}

/// With help that fits a screen for the command and for each below it: a line an option.
fn with_short_help(command: clap::Command) -> clap::Command {
    let help = clap::Arg::new("help").short('h').long("help").help("Print help");
    command.arg(help.action(clap::ArgAction::HelpShort)).mut_subcommands(with_short_help)
}

/// With the group before a command that is named by its old name alone.
fn in_its_group(mut words: Vec<OsString>) -> Vec<OsString> {
    let at = if words.get(1).is_some_and(|word| word == "help") { 2 } else { 1 };
    let name = words.get(at).and_then(|word| word.to_str()).map(str::to_owned);
    let command = Cli::command();
    let has = |group: &&&str| {
        let commands = command.find_subcommand(group).map(clap::Command::get_subcommands);
        commands.into_iter().flatten().any(|command| Some(command.get_name()) == name.as_deref())
    };
    // One of them has the name of a group.
    let is_command = name.as_ref().is_some_and(|name| command.find_subcommand(name).is_some());
    let is_specified =
        !is_command && STUDIES.iter().any(|(known, _)| Some(*known) == name.as_deref());
    // No command of clap's own, so `help` does not know it.
    let is_study = words.get(2).is_some_and(|word| word == "study");
    if at == 2 && (is_specified || is_study && words.len() > 3) {
        let of = words.split_off(if is_study { 3 } else { 2 });
        words.truncate(1);
        words.push("study".into());
        words.extend(of);
        words.push("--help".into());
        return words;
    }
    let group = GROUPS.iter().find(has).or(is_specified.then_some(&"study"));
    if let Some(group) = group {
        words.insert(at, (*group).into());
    }
    words
}

/// Laws whose gains can be designed.
#[derive(Debug, Subcommand)]
enum DesignCommand {
    /// Linear quadratic regulator: the discrete Riccati equation at the design point
    Lqr(DesignArgs),
}

/// Carries out the command line, a campaign with the laws that the program brings; gives the exit status.
pub fn run(cli: &Cli, program: &Path, own: &[OwnLaw]) -> Result<u8, Box<dyn Error>> {
    match &cli.command {
        None => launch::run(&cli.launch, program)?,
        Some(SitlCommand::Live(args)) => launch::run(args, program)?,
        Some(SitlCommand::Fly(args)) => return Ok(fly::run(args)),
        Some(SitlCommand::Study(study)) => return run_study(study, program, own),
        Some(SitlCommand::Campaign(command)) => lab_campaign::run(command, own)?,
        Some(SitlCommand::Aircraft(command)) => run_aircraft(command, program)?,
        Some(SitlCommand::Log(LogCommand::Plot(args))) => plot::run(args)?,
        Some(SitlCommand::Log(LogCommand::Replay(args))) => return Ok(replay::run(args)),
        Some(SitlCommand::Log(LogCommand::Mcap(args))) => mcap::run(args)?,
        Some(SitlCommand::Autopilot(args)) => autopilot::run::run(args)?,
        Some(SitlCommand::PlantSim(args)) => drop(plant_sim::io::run(args)?),
        Some(SitlCommand::Echo(args)) => echo::run(args)?,
    }
    Ok(DONE)
}

fn run_study(study: &StudyCommand, program: &Path, own: &[OwnLaw]) -> Result<u8, Box<dyn Error>> {
    match study {
        StudyCommand::Paper(args) => return fly_paper(args, program),
        StudyCommand::PaperEstimated(args) => lab_paper::estimated::run(args)?,
        StudyCommand::Mission(args) => mission::run(args)?,
        StudyCommand::SensorErrors(args) => sensor_errors::run(args)?,
        StudyCommand::Actuators(args) => actuators::run(args)?,
        StudyCommand::Turbulence(args) => turbulence::run(args)?,
        StudyCommand::Checkcase(args) => checkcase::run(args)?,
        StudyCommand::CompareCheckcases(args) => report::run(args)?,
        StudyCommand::Bench(args) => bench::run(args, program)?,
        StudyCommand::Specified(words) => lab_campaign::run(&specified(words)?, own)?,
    }
    Ok(DONE)
}

/// The specifications that come with the program, each with what it is about.
fn specifications() -> String {
    let line = |(name, text): &(&str, &str)| {
        let about = text.lines().find_map(|line| line.strip_prefix("about = "));
        format!("  {name:18}  {}\n", about.unwrap_or_default().trim_matches('"'))
    };
    let lines: String = STUDIES.iter().map(line).collect();
    format!("Specifications, with the options of `sitl campaign run`; a file is one too:\n{lines}")
}

/// The campaign of a specification, read with the options of `sitl campaign run`.
fn specified(words: &[OsString]) -> Result<lab_campaign::Command, clap::Error> {
    let command = RunArgs::augment_args(clap::Command::new("sitl study"));
    let words = std::iter::once("sitl study".into()).chain(words.iter().cloned());
    let matches = command.try_get_matches_from(words)?;
    RunArgs::from_arg_matches(&matches).map(lab_campaign::Command::Run)
}

fn run_aircraft(command: &AircraftCommand, program: &Path) -> Result<(), Box<dyn Error>> {
    match command {
        AircraftCommand::Linearize(args) => linearize::run(args)?,
        AircraftCommand::New(args) => new::run(args)?,
        AircraftCommand::Design(DesignCommand::Lqr(args)) => design::run(args)?,
        AircraftCommand::Margins(args) => margins::run(args)?,
        AircraftCommand::Trimmable(args) => trimmable::run(args)?,
        AircraftCommand::Draw(args) => geometry::run(args)?,
        AircraftCommand::Actions(args) => actions::run(args)?,
        AircraftCommand::Fmu(args) => lab_fmu::run(args, program)?,
        AircraftCommand::Parameters => {
            print_text!("{}", autopilot::parameters::document(&Airframe::paper().effectors));
        }
    }
    Ok(())
}

/// The exit code is that of success if all checked claims hold.
fn fly_paper(options: &lab_paper::Options, program: &Path) -> Result<u8, Box<dyn Error>> {
    let outcome = match options.link {
        Link::InProcess => lab_paper::run(options, &lab_paper::in_process),
        Link::Udp => {
            lab_paper::run(options, &|setup, sink| udp_flight::fly_udp(program, setup, sink))
        }
    }?;
    print_line!("figures and report: {}", options.out.join("report.html").display());
    Ok(if outcome.all_hold() { DONE } else { FAILED })
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn the_help_fits_a_screen_and_every_group_has_its_commands() {
        let help = command().render_help().to_string();
        assert!(help.lines().count() <= 24, "{help}");
        assert!(help.lines().all(|line| line.chars().count() <= 80), "{help}");
        assert!(!help.contains("false-alarms") && help.contains("all its options"), "{help}");
        for group in GROUPS {
            assert!(Cli::command().find_subcommand(group).is_some(), "{group}");
        }
    }

    #[test]
    fn every_command_has_its_help() {
        fn ask(command: &clap::Command, words: &[&str]) {
            let line = words.iter().chain(&["--help"]).map(OsString::from);
            let help = Cli::read(line).expect_err("help").kind();
            assert_eq!(help, clap::error::ErrorKind::DisplayHelp, "{words:?}");
            for below in command.get_subcommands() {
                ask(below, &[words, &[below.get_name()]].concat());
            }
        }
        ask(&Cli::command(), &["sitl"]);
    }

    /// A parser of another type than its field is found only when the value is taken.
    #[test]
    fn every_command_takes_its_defaults() {
        let lines = [
            "",
            "fly nominal",
            "checkcase x.toml --step-ms 10 --rate-hz 50 --out y.csv",
            "compare-checkcases x.toml y.toml --reference d --step-ms 5 --out z",
            "fly case1 --seed 1..3 --set FTC_MODE=0 --out x",
            "paper --out x",
            "mission --out x",
            "envelope --airframe f16 --samples 2 --out x",
            "false-alarms --samples 1 --out x",
            "estimator --samples 10 --seed 3 --out x",
            "trimmable --pairs-deg 10 --out x",
            "turbulence --level light --altitude-m 100,5000 --airspeed-m-s 60 --out x",
            "campaign run jams --shard 1/2 --out x",
            "campaign merge jams --out x y z",
            "campaign replay jams --run 3 --out x",
            "campaign worst smoke --over plant.fault.1.onset_s --from -1 --out x",
            "campaign compare x y",
            "campaign suite --out x",
            "campaign tune tuning --out x",
            "sensors --grade tactical --out x",
            "actuators --effector rudder --out x",
            "plot a.ulg",
            "replay a.ulg",
            "live --speed 2",
            "aircraft linearize",
            "aircraft new --airframe my.toml --out my",
            "aircraft fmu --airframe f16 --out f16.fmu",
            "study jams --out x",
            "help jams",
            "help study jams",
            "log replay a.ulg",
            "linearize",
            "design lqr --out x",
            "autopilot --cpu 0",
            "plant-sim --cpu 0 --step-us 500 --seed 3",
            "parameters",
            "bench --parts",
            "echo --to 127.0.0.1:9 --cpu 0",
        ];
        for line in lines {
            let words = ["sitl"].into_iter().chain(line.split_whitespace()).map(OsString::from);
            let parsed = Cli::read(words).map(drop).map_err(|error| error.to_string());
            assert_eq!(parsed, Ok(()), "{line}");
        }
    }

    #[test]
    fn no_help_offers_a_model_that_the_command_refuses() {
        let mut command = without_models(Cli::command());
        for (group, names) in WITHOUT_MODEL {
            for name in names {
                let of =
                    command.find_subcommand_mut(group).and_then(|g| g.find_subcommand_mut(name));
                let help = of.unwrap().render_long_help().to_string();
                assert!(help.contains("--airframe") && !help.contains("--model"), "{name}: {help}");
            }
        }
    }

    /// Options that take a number, by their names in the help.
    const NUMBERS: [&str; 14] = [
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
        "VALUE",
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
            let arguments = ["sitl", "study", "paper", "--out", "o", "--turbulence-m-s", bad];
            let message = Cli::try_parse_from(arguments).map(|_| ()).unwrap_err().to_string();
            assert!(message.contains("0 to 20 m/s"), "{message}");
        }
    }
}
