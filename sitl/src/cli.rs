//! The command line: what a user meets first.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use autopilot::own_law::OwnLaw;
use autopilot::run::AutopilotArgs;
use clap::{Args, Parser, Subcommand};
use plant_sim::Airframe;
use plant_sim::io::PlantArgs;

use crate::actions::{self, ActionsArgs};
use crate::bench::{self, BenchArgs};
use crate::echo::{self, EchoArgs};
use crate::launch::{self, LaunchArgs};
use crate::udp_flight;
use flight_analysis::actuators::{self, ActuatorsArgs};
use flight_analysis::checkcase::report::{self, CompareArgs};
use flight_analysis::checkcase::{self, CheckcaseArgs};
use flight_analysis::design::{self, DesignArgs};
use flight_analysis::envelope;
use flight_analysis::fly::jams::{self, JamsArgs};
use flight_analysis::fly::{self, FlyArgs};
use flight_analysis::linearize::{self, LinearizeArgs};
use flight_analysis::margins::{self, MarginsArgs};
use flight_analysis::mission::{self, MissionOptions};
use flight_analysis::paper::{self, Link};
use flight_analysis::plot::{self, PlotArgs};
use flight_analysis::replay::{self, ReplayArgs};
use flight_analysis::sensor_errors::{self, SensorErrorsArgs};
use flight_analysis::sensor_faults;
use flight_analysis::trimmable::{self, TrimmableArgs};
use flight_analysis::turbulence::{self, TurbulenceArgs};
use flight_analysis::{estimator, false_alarms, isolation};
use flight_analysis::{print_line, print_text};

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

/// The program `sitl`: reads the command line and reports errors on standard error. `own` is a law that the caller brings: it flies
/// unless `--law` names another one.
#[must_use]
pub fn main(own: Option<OwnLaw>) -> ExitCode {
    host_io::process::take_size_limit_as_error();
    host_io::console::show();
    let mut cli = Cli::try_parse().unwrap_or_else(|error| match error.use_stderr() {
        true => host_io::console::refuse(&error.render(), error.exit_code()),
        false => error.exit(),
    });
    if let Some(own) = &own {
        cli.bring(own);
    }
    run(&cli, own.as_ref()).unwrap_or_else(|error| {
        tracing::error!("{error}");
        ExitCode::FAILURE
    })
}

impl Cli {
    /// Takes a law that the program brings.
    pub fn bring(&mut self, own: &OwnLaw) {
        match &mut self.command {
            None => self.launch.bring(own),
            Some(Command::Autopilot(args)) => args.laws.bring(own),
            Some(Command::Fly(args)) => args.options.laws.bring(own),
            Some(Command::Mission(args)) => args.laws.bring(own),
            Some(Command::Jams(args)) => args.bring(own),
            Some(Command::Margins(args)) => args.bring(own),
            Some(Command::Replay(args)) => args.bring(own),
            // It gets the law when it runs.
            Some(Command::Campaign(_)) => {}
            Some(command) if command.flies_laws_of_its_own() => {
                tracing::warn!("this command flies the laws of the program, not {}", own.name());
            }
            Some(_) => {}
        }
    }
}

impl Command {
    /// Studies of the laws that the program has.
    fn flies_laws_of_its_own(&self) -> bool {
        matches!(
            self,
            Self::Paper(_)
                | Self::PaperEstimated(_)
                | Self::Envelope(_)
                | Self::FalseAlarms(_)
                | Self::Isolation(_)
                | Self::SensorFaults(_)
                | Self::Estimator(_)
        )
    }
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fly a scenario in this process to its end, and say what became of it
    Fly(Box<FlyArgs>),
    /// Fly a scenario without a controller, and write its trajectory for a comparison with other simulators
    Checkcase(Box<CheckcaseArgs>),
    /// Fly check cases and draw how far they are from the trajectories of other simulators
    CompareCheckcases(CompareArgs),
    /// Fly the paper's two cases, check its claims, draw its figures
    Paper(paper::Options),
    /// Fly the paper's two cases on estimated states, with sensors of each grade, and say which limits still hold
    PaperEstimated(paper::estimated::Options),
    /// Fly a demonstration mission and draw its track
    Mission(MissionOptions),
    /// Fly the healthy aircraft where it has to hold its altitude, and draw how well it does
    Envelope(EnvelopeArgs),
    /// Count false alarms of the detector in hours of healthy flight, over its delay
    FalseAlarms(false_alarms::Options),
    /// Break every effector in many ways, and count how often the isolation names the right one
    Isolation(isolation::Options),
    /// Draw the errors of each sensor of a grade in a steady flight
    #[command(name = "sensors")]
    SensorErrors(SensorErrorsArgs),
    /// Fail each sensor in each way on estimated states, and say what becomes of the flight
    SensorFaults(sensor_faults::Options),
    /// Draw what each property of an actuator does to a step and a triangle
    Actuators(Box<ActuatorsArgs>),
    /// Fly on estimated states with sensors of each grade, and compare the errors with what the estimator says of them
    Estimator(estimator::Options),
    /// Draw the flight of a log into a page
    Plot(PlotArgs),
    /// Fly the flight of a log again and compare it bit for bit
    Replay(ReplayArgs),
    /// Derive the controller's model from the plant at its design trim
    Linearize(LinearizeArgs),
    /// Fly every surface jammed at parts of its travel, without and with the compensator, and write the table
    Jams(Box<JamsArgs>),
    /// Compute for every jam whether a steady flight exists at all, and draw how far each effector can jam
    Trimmable(Box<TrimmableArgs>),
    /// Fly through turbulence of a level and draw its six spectra beside the formulas of the standard
    Turbulence(TurbulenceArgs),
    /// Fly many flights drawn from a specification with several laws, and compare what they survive
    #[command(subcommand)]
    Campaign(flight_campaign::Command),
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

/// Options of `sitl envelope`.
#[derive(Debug, Args)]
pub struct EnvelopeArgs {
    /// Folder for table and picture
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Carries out the command line.
///
/// # Errors
/// Why it cannot be done, as a text for the operator.
pub fn run(cli: &Cli, own: Option<&OwnLaw>) -> Result<ExitCode, Box<dyn Error>> {
    // This executable starts itself for the two processes.
    let program = std::env::current_exe()?;
    match &cli.command {
        None => launch::run(&cli.launch, &program)?,
        Some(Command::Fly(args)) => return Ok(fly::run(args).into()),
        Some(Command::Paper(args)) => return fly_paper(args, &program),
        Some(Command::PaperEstimated(args)) => paper::estimated::run(args)?,
        Some(Command::Mission(args)) => mission::run(args)?,
        Some(Command::Envelope(args)) => envelope::run(&args.out)?,
        Some(Command::FalseAlarms(args)) => false_alarms::run(args)?,
        Some(Command::Isolation(args)) => isolation::run(args)?,
        Some(Command::Estimator(args)) => estimator::run(args)?,
        Some(Command::Checkcase(args)) => checkcase::run(args)?,
        Some(Command::CompareCheckcases(args)) => report::run(args)?,
        Some(Command::SensorErrors(args)) => sensor_errors::run(args)?,
        Some(Command::SensorFaults(args)) => sensor_faults::run(args)?,
        Some(Command::Actuators(args)) => actuators::run(args)?,
        Some(Command::Plot(args)) => plot::run(args)?,
        Some(Command::Jams(args)) => jams::run(args)?,
        Some(Command::Trimmable(args)) => trimmable::run(args)?,
        Some(Command::Turbulence(args)) => turbulence::run(args)?,
        Some(Command::Replay(args)) => return Ok(replay::run(args).into()),
        Some(Command::Linearize(args)) => linearize::run(args)?,
        Some(Command::Campaign(command)) => flight_campaign::run(command, own)?,
        Some(Command::Design(Design::Lqr(args))) => design::run(args)?,
        Some(Command::Actions(args)) => actions::run(args)?,
        Some(Command::Margins(args)) => margins::run(args)?,
        Some(Command::Autopilot(args)) => drop(autopilot::run::run(args)?),
        Some(Command::PlantSim(args)) => drop(plant_sim::io::run(args)?),
        Some(Command::Parameters) => {
            print_text!("{}", autopilot::parameters::document(&Airframe::paper().effectors));
        }
        Some(Command::Bench(args)) => bench::run(args, &program)?,
        Some(Command::Echo(args)) => echo::run(args)?,
    }
    Ok(ExitCode::SUCCESS)
}

/// The exit code is that of success if all checked claims hold.
fn fly_paper(options: &paper::Options, program: &Path) -> Result<ExitCode, Box<dyn Error>> {
    let outcome = match options.link {
        Link::InProcess => paper::run(options, &paper::in_process),
        Link::Udp => {
            paper::run(options, &|setup, sink| Ok(udp_flight::fly_udp(program, setup, sink)?))
        }
    }?;
    print_line!("figures and report: {}", options.out.join("report.html").display());
    Ok(if outcome.all_hold() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
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
            "checkcase x.toml --step-ms 10 --rate-hz 50 --out y.csv",
            "compare-checkcases x.toml y.toml --reference d --step-ms 5 --out z",
            "fly case1 --seed 1..3 --set FTC_MODE=0 --out x",
            "paper --out x",
            "mission --out x",
            "envelope --out x",
            "false-alarms --out x",
            "isolation --out x",
            "estimator --flights 10 --out x",
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
            "linearize",
            "design lqr --out x",
            "autopilot --cpu 0",
            "plant-sim --cpu 0 --step-us 500 --seed 3",
            "parameters",
            "bench --parts",
            "echo --to 127.0.0.1:9 --cpu 0",
        ];
        for line in lines {
            let words = ["sitl"].into_iter().chain(line.split_whitespace());
            let parsed = Cli::try_parse_from(words).map(drop).map_err(|error| error.to_string());
            assert_eq!(parsed, Ok(()), "{line}");
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
            let arguments = ["sitl", "paper", "--out", "o", "--turbulence-m-s", bad];
            let message = Cli::try_parse_from(arguments).map(|_| ()).unwrap_err().to_string();
            assert!(message.contains("0 to 20 m/s"), "{message}");
        }
    }
}
