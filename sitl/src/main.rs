//! The command line: without a subcommand, a flight of both processes.

use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;

use autopilot::run::AutopilotArgs;
use clap::{Parser, Subcommand};
use plant_sim::io::PlantArgs;
use sitl::bench::BenchArgs;
use sitl::echo::EchoArgs;
use sitl::launch::LaunchArgs;

/// Two-Step: fault-tolerant flight control in the loop with a simulated jet.
#[derive(Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Task>,
    #[command(flatten)]
    launch: LaunchArgs,
}

#[derive(Subcommand)]
enum Task {
    /// The flight software alone
    Autopilot(AutopilotArgs),
    /// The aircraft and the world alone
    PlantSim(PlantArgs),
    /// Print how fast flights run here, as ratios
    Bench(BenchArgs),
    /// Send link packets to and fro without a flight
    #[command(hide = true)]
    Echo(EchoArgs),
}

fn main() -> ExitCode {
    host_io::console::show();
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tracing::error!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: Cli) -> Result<(), Box<dyn Error>> {
    match cli.command {
        None => sitl::launch::run(&cli.launch, &program()?)?,
        Some(Task::Autopilot(args)) => drop(autopilot::run::run(&args)?),
        Some(Task::PlantSim(args)) => drop(plant_sim::io::run(&args)?),
        Some(Task::Bench(args)) => sitl::bench::run(&args, &program()?)?,
        Some(Task::Echo(args)) => sitl::echo::run(&args)?,
    }
    Ok(())
}

/// This executable, which starts itself for the two processes.
fn program() -> std::io::Result<PathBuf> {
    std::env::current_exe()
}
