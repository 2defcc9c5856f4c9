//! How fast flights run on this machine, as ratios that hold beyond it.

use std::error::Error;
use std::io::Write;
use std::path::Path;
use std::process::{Command as Process, Stdio};

use host_io::{clock, console};
use icd::SimTime;
use plant_sim::io::whole;

use crate::arrangement::{self, Arrangement};
use crate::udp_flight::time_udp;
use flight_analysis::builder::SetupOptions;
use flight_analysis::closed_loop::{FlightSetup, fly};
use flight_analysis::metrics::quantile;

mod parts;

/// The scenario that is flown as a command.
const COMMAND: &str = "case2";
/// Time for each echo, ms.
const ECHO_MS: u64 = 150;

/// Options of the measurement.
#[derive(Debug, Clone, clap::Args)]
pub struct BenchArgs {
    /// Simulation time of each flight, s
    #[arg(long, allow_negative_numbers = true, value_name = "S", default_value_t = 20, value_parser = whole(1_u32, 86_400))]
    flight_s: u32,
    /// Repetitions; the median counts
    #[arg(long, allow_negative_numbers = true, value_name = "N", default_value_t = 11, value_parser = whole(1_usize, 10_000))]
    repeat: usize,
    /// Measure the link in all arrangements of processes and cores, not only in the fastest
    #[arg(long)]
    all: bool,
    /// Measure what runs in one process only
    #[arg(long, conflicts_with = "all")]
    parts: bool,
}

/// Measures and prints.
///
/// # Errors
/// What went wrong with a flight, or with the output.
pub fn run(args: &BenchArgs, program: &Path) -> Result<(), Box<dyn Error>> {
    let mut out = console::out();
    let setup = |step_us| paper_case(step_us, args.flight_s);
    writeln!(out, "in process, one core                            times real time")?;
    for step_us in [2_000, 1_000] {
        let setup = setup(step_us)?;
        let factor = median(args.repeat, || in_process(&setup))?;
        writeln!(out, "  plant step {step_us} us, control period 2000 us   {factor:10.0}")?;
    }
    parts::measure(&mut out, args.repeat, args.flight_s)?;
    if args.parts {
        return Ok(());
    }
    let ms = median(args.repeat, || command(program))?;
    writeln!(
        out,
        "sitl fly {COMMAND}, 40 s flown, process start included   {ms:6.1} ms, wanted below 100"
    )?;
    writeln!(
        out,
        "two processes over UDP, control period 2000 us; ratio: median, and range of the middle half"
    )?;
    let measured = arrangement::measure_all(program);
    let arrangements: Vec<Arrangement> = measured
        .iter()
        .take(if args.all { usize::MAX } else { 1 })
        .map(|m| m.arrangement)
        .collect();
    for arrangement in &arrangements {
        writeln!(out, "  {arrangement}")?;
        for step_us in [2_000, 1_000] {
            link(&mut out, args, program, arrangement, &setup(step_us)?)?;
        }
    }
    if let Some(fastest) = arrangements.first() {
        logs(&mut out, args, program, fastest, &setup(1_000)?)?;
    }
    Ok(())
}

/// What a flight log costs: speed with one, over speed without.
fn logs(
    out: &mut impl Write,
    args: &BenchArgs,
    program: &Path,
    arrangement: &Arrangement,
    setup: &FlightSetup,
) -> Result<(), Box<dyn Error>> {
    const RATES: [&str; 2] = ["events", "full"];
    writeln!(out, "the same with a flight log, over the same without; plant step 1000 us")?;
    let mut ratios = [Vec::new(), Vec::new()];
    for _ in 0..args.repeat.max(1) {
        let speed = |log| -> Result<f64, Box<dyn Error>> {
            let report = time_udp(program, setup, arrangement, log)?;
            #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
            let ticks = report.ticks as f64;
            Ok(ticks / report.wall_s)
        };
        let without = speed(None)?;
        for (rate, ratios) in RATES.into_iter().zip(&mut ratios) {
            ratios.push(speed(Some(rate))? / without);
        }
    }
    for (rate, ratios) in RATES.into_iter().zip(ratios) {
        let [low, ratio, high] = [0.25, 0.5, 0.75].map(|part| quantile(ratios.clone(), part));
        writeln!(out, "    --log-rate {rate:<7} ratio {ratio:.2} ({low:.2} to {high:.2})")?;
    }
    Ok(())
}

fn link(
    out: &mut impl Write,
    args: &BenchArgs,
    program: &Path,
    arrangement: &Arrangement,
    setup: &FlightSetup,
) -> Result<(), Box<dyn Error>> {
    // Always one right after the other: other work on the machine comes and goes, and must meet both.
    let (mut echoes, mut ticks, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..args.repeat.max(1) {
        let echo = arrangement::echo_rate(program, arrangement, ECHO_MS)?;
        let report = time_udp(program, setup, arrangement, None)?;
        #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
        let tick = report.ticks as f64 / report.wall_s;
        echoes.push(echo);
        ticks.push(tick);
        ratios.push(tick / echo);
    }
    let (echo, tick) = (quantile(echoes, 0.5), quantile(ticks, 0.5));
    let [low, ratio, high] = [0.25, 0.5, 0.75].map(|part| quantile(ratios.clone(), part));
    let step_us = setup.plant.step_us;
    let factor = tick * setup.plant.period.as_seconds();
    writeln!(
        out,
        "    plant step {step_us} us: echo {echo:7.0}/s   closed loop {tick:7.0}/s, {factor:.0} times real time   \
         ratio {ratio:.2} ({low:.2} to {high:.2})"
    )?;
    Ok(())
}

/// Case 1 of the paper, as the programs fly it by default.
fn paper_case(step_us: u32, flight_s: u32) -> Result<FlightSetup, Box<dyn Error>> {
    let options = SetupOptions { step_us: Some(step_us), ..SetupOptions::default() };
    let duration = SimTime::from_micros(1_000_000 * u64::from(flight_s));
    Ok(FlightSetup { duration, ..options.setup("case1")? })
}

/// Wall time of a whole flight as a command, ms.
fn command(program: &Path) -> Result<f64, Box<dyn Error>> {
    let began = clock::now();
    let flown = Process::new(program).args(["fly", COMMAND]).stdout(Stdio::null()).status()?;
    let ms = (clock::now() - began).as_secs_f64() * 1.0e3;
    if flown.success() { Ok(ms) } else { Err(format!("sitl fly {COMMAND}: {flown}").into()) }
}

/// Simulation time per wall time in one process.
fn in_process(setup: &FlightSetup) -> Result<f64, Box<dyn Error>> {
    let began = clock::now();
    let end = fly(setup, &mut |record| {
        std::hint::black_box(record);
    })?;
    Ok(end.time.as_seconds() / (clock::now() - began).as_secs_f64())
}

fn median(
    repeat: usize,
    mut measure: impl FnMut() -> Result<f64, Box<dyn Error>>,
) -> Result<f64, Box<dyn Error>> {
    let values: Result<Vec<f64>, _> = (0..repeat.max(1)).map(|_| measure()).collect();
    Ok(quantile(values?, 0.5))
}
