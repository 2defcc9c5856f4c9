//! How fast flights run on this machine, as ratios that hold beyond it; and what sensors with errors, turbulence and the estimator
//! cost, in one process on one core.

use std::hint::black_box;
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::{Command as Process, Stdio};

use aircraft::F16_AIRFRAME;
use flight_control::{Demand, FlightControl, NavigationSource, NavigationState};
use host_io::problem::{Problem, problem};
use host_io::{clock, console};
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use lab_engine::builder::SetupOptions;
use lab_engine::configuration::{AircraftArgs, Named};
use lab_judges::closed_loop::{FlightSetup, fly, watch};
use lab_judges::metrics::quantile;
use plant_sim::io::whole;
use plant_sim::{Airframe, GradeName, Plant, PlantSetup, ReadAirframe as _, grade_file};

use crate::arrangement::{self, Arrangement};
use crate::udp_flight::time_udp;

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
pub fn run(args: &BenchArgs, program: &Path) -> Result<(), Problem> {
    let mut out = console::out();
    // Case 1 of the paper, as the programs fly it by default.
    let setup = |step_us| -> Result<FlightSetup, Problem> {
        let options = SetupOptions { step_us: Some(step_us), ..SetupOptions::default() };
        let duration = SimTime::from_micros(1_000_000 * u64::from(args.flight_s));
        Ok(FlightSetup { duration, ..options.setup("case1")? })
    };
    writeln!(out, "in process, one core                            times real time")?;
    for step_us in [2_000, 1_000] {
        let setup = setup(step_us)?;
        let factor = median(args.repeat, || in_process(&setup))?;
        writeln!(out, "  plant step {step_us} us, control period 2000 us   {factor:10.0}")?;
    }
    measure_parts(&mut out, args.repeat, args.flight_s)?;
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
) -> Result<(), Problem> {
    const RATES: [&str; 2] = ["events", "full"];
    writeln!(out, "the same with a flight log, over the same without; plant step 1000 us")?;
    let mut ratios = [Vec::new(), Vec::new()];
    for _ in 0..args.repeat.max(1) {
        let speed = |log| ticks_per_s(program, setup, arrangement, log);
        let without = speed(None)?;
        for (rate, ratios) in RATES.into_iter().zip(&mut ratios) {
            ratios.push(speed(Some(rate))? / without);
        }
    }
    for (rate, ratios) in RATES.into_iter().zip(ratios) {
        writeln!(out, "    --log-rate {rate:<7} {}", middle(&ratios))?;
    }
    Ok(())
}

fn link(
    out: &mut impl Write,
    args: &BenchArgs,
    program: &Path,
    arrangement: &Arrangement,
    setup: &FlightSetup,
) -> Result<(), Problem> {
    // Always one right after the other: other work on the machine comes and goes, and must meet both.
    let (mut echoes, mut ticks, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..args.repeat.max(1) {
        let echo = arrangement::echo_rate(program, arrangement, ECHO_MS)?;
        let tick = ticks_per_s(program, setup, arrangement, None)?;
        echoes.push(echo);
        ticks.push(tick);
        ratios.push(tick / echo);
    }
    let (echo, tick) = (quantile(echoes, 0.5), quantile(ticks, 0.5));
    let ratio = middle(&ratios);
    let step_us = setup.plant.step_us;
    let factor = tick * setup.plant.period.as_seconds();
    writeln!(
        out,
        "    plant step {step_us} us: echo {echo:7.0}/s   closed loop {tick:7.0}/s, {factor:.0} times real time   \
         {ratio}"
    )?;
    Ok(())
}

/// Ticks a second of a flight through both processes.
fn ticks_per_s(
    program: &Path,
    setup: &FlightSetup,
    arrangement: &Arrangement,
    log: Option<&str>,
) -> Result<f64, Problem> {
    let report = time_udp(program, setup, arrangement, log)?;
    // Far below 2^53.
    let ticks = report.ticks as f64;
    Ok(ticks / report.wall_s)
}

/// Median, and range of the middle half.
fn middle(ratios: &[f64]) -> String {
    let [low, ratio, high] = [0.25, 0.5, 0.75].map(|part| quantile(ratios.to_vec(), part));
    format!("ratio {ratio:.2} ({low:.2} to {high:.2})")
}

/// Wall time of a whole flight as a command, ms.
fn command(program: &Path) -> Result<f64, Problem> {
    let began = clock::now();
    let flown = Process::new(program).args(["fly", COMMAND]).stdout(Stdio::null()).status()?;
    let ms = (clock::now() - began).as_secs_f64() * 1.0e3;
    if flown.success() { Ok(ms) } else { Err(problem!("sitl fly {COMMAND}: {flown}")) }
}

/// Simulation time per wall time in one process.
fn in_process(setup: &FlightSetup) -> Result<f64, Problem> {
    let began = clock::now();
    let end = fly(setup, &mut |record| {
        black_box(record);
    })?;
    Ok(end.time.as_seconds() / (clock::now() - began).as_secs_f64())
}

fn median(
    repeat: usize,
    mut measure: impl FnMut() -> Result<f64, Problem>,
) -> Result<f64, Problem> {
    let values: Result<Vec<f64>, _> = (0..repeat.max(1)).map(|_| measure()).collect();
    Ok(quantile(values?, 0.5))
}

/// Turbulence of the flights with all of it: light, m/s rms.
const TURBULENCE_M_S: f64 = 1.5;
/// Flight without a controller before the plant begins again, control periods: 1 s, in which no aircraft leaves its start far.
const PERIODS: u32 = 500;
/// Such flights of a measurement.
const FLIGHTS: u32 = 10;
/// Flight before the estimator is measured, control periods: 10 s, after which it is aligned.
const WARM: usize = 5_000;
/// Of the flight from which navigation and laws are measured, s.
const RECORDED_S: f64 = 20.0;

/// Measures and prints: plant steps, estimator and control step, and the closed loop with all of it for `flight_s`.
fn measure_parts(out: &mut impl Write, repeat: usize, flight_s: u32) -> Result<(), Problem> {
    writeln!(
        out,
        "plant steps a second; in brackets the time over that of the plain step. Plain: forces, servos, WGS-84, four evaluations \
         of the derivative.\nSampled: with exact sensors each 2 ms. All: tactical sensors each 2 ms and turbulence of \
         {TURBULENCE_M_S} m/s instead"
    )?;
    let aircraft = AircraftArgs::default();
    let jet = aircraft.airframe()?;
    let f16 = Airframe::from_toml("f16.toml", F16_AIRFRAME)?;
    for (name, airframe) in [("default", &jet), ("F-16", &f16)] {
        for step_us in [2_000, 1_000] {
            let plain = plant_setup(airframe, step_us, false)?;
            let all = plant_setup(airframe, step_us, true)?;
            let mut rates = [Vec::new(), Vec::new(), Vec::new()];
            // In turns, so that other work on the machine meets all of them.
            for _ in 0..repeat.max(1) {
                for (rates, (setup, samples)) in
                    rates.iter_mut().zip([(&plain, false), (&plain, true), (&all, true)])
                {
                    rates.push(plant_steps(setup, samples)?);
                }
            }
            // Of each turn, because the speed of a busy machine changes from turn to turn.
            let [sampled_ratio, all_ratio] = [1, 2].map(|of| {
                let turns = rates[0].iter().zip(&rates[of]);
                quantile(turns.map(|(plain, rate)| plain / rate).collect::<Vec<_>>(), 0.5)
            });
            let [plain, sampled, all] = rates.map(|rates| quantile(rates, 0.5));
            writeln!(
                out,
                "  {name:<8} step {step_us} us: plain {plain:8.0}/s, sampled {sampled:8.0}/s ({sampled_ratio:.2}), all {all:8.0}/s \
                 ({all_ratio:.2}, wanted at most 2)"
            )?;
        }
    }
    let setup = flight_setup(&jet, 1_000, RECORDED_S)?;
    let flown = RecordedFlight::of(&setup)?;
    let control_us = median(repeat, || Ok(flown.control_us(&setup)))?;
    let estimator_us = median(repeat, || Ok(flown.estimator_us(&setup)))?;
    writeln!(
        out,
        "estimator, mean of a control step {estimator_us:.2} us; control step {control_us:.2} us; ratio {:.1}, wanted at most 10",
        estimator_us / control_us
    )?;
    writeln!(
        out,
        "closed loop with tactical sensors, estimator and turbulence, in process, one core"
    )?;
    for step_us in [2_000, 1_000] {
        let setup = flight_setup(&jet, step_us, f64::from(flight_s))?;
        let factor = median(repeat, || in_process(&setup))?;
        writeln!(
            out,
            "  plant step {step_us} us: {factor:.0} times real time, wanted at least 500"
        )?;
    }
    Ok(())
}

/// The nominal flight of an aircraft, with exact sensors in still air or with all errors.
fn plant_setup(airframe: &Airframe, step_us: u32, has_errors: bool) -> Result<PlantSetup, Problem> {
    let nominal = Named::scenario("nominal")?;
    let mut plant = AircraftArgs::default().scenario(&nominal, &airframe.effectors)?.plant;
    if has_errors {
        plant.wind.turbulence_m_s = TURBULENCE_M_S;
        plant.sensors = grade_file::of_grade(GradeName::Tactical);
    }
    Ok(plant.setup(airframe.clone(), 0, ControlPeriod::DEFAULT, step_us))
}

/// The same with a controller, with all errors.
fn flight_setup(airframe: &Airframe, step_us: u32, flight_s: f64) -> Result<FlightSetup, Problem> {
    let mut setup = SetupOptions::default().setup("nominal")?;
    setup.plant = plant_setup(airframe, step_us, true)?;
    setup.duration = SimTime::from_seconds(flight_s).unwrap_or(SimTime::ZERO);
    Ok(setup)
}

/// Plant steps a second with the controls of the trimmed flight.
fn plant_steps(setup: &PlantSetup, samples: bool) -> Result<f64, Problem> {
    let start = Plant::new(setup)?;
    let actuators = Actuators::new(start.trim().positions());
    let began = clock::now();
    for _ in 0..FLIGHTS {
        // A clone, because the trim of a new plant would be part of the measured time.
        let mut plant = start.clone();
        for _ in 0..PERIODS {
            if samples {
                // Nobody reads the samples: without the black box the compiler could leave them
                // out.
                black_box(plant.sense());
            }
            plant.advance(black_box(&actuators));
        }
        black_box(plant.truth());
    }
    let wall_s = (clock::now() - began).as_secs_f64();
    let steps = FLIGHTS * PERIODS * (setup.period.as_micros() / setup.step_us);
    Ok(f64::from(steps) / wall_s)
}

/// What went into navigation and laws in a flight.
struct RecordedFlight(Vec<(SimTime, Sensors, NavigationState, Demand)>);

impl RecordedFlight {
    fn of(setup: &FlightSetup) -> Result<Self, Problem> {
        let mut flown = Self(Vec::new());
        watch(setup, |tick| {
            flown.0.push((tick.exchange.time, *tick.sensors, tick.log.state, tick.snapshot.demand));
            ControlFlow::Continue(())
        })?;
        match flown.0.last() {
            Some((_, _, state, _)) if flown.0.len() > WARM && state.estimate.is_some() => Ok(flown),
            _ => Err(problem!(
                "the flight that is measured ended early, or was not on estimated states"
            )),
        }
    }

    /// Mean time of a step of the estimator, us.
    fn estimator_us(&self, setup: &FlightSetup) -> f64 {
        let mut navigation = NavigationSource::new(&setup.model, &setup.parameters.gains);
        self.mean_us(|(time, sensors, _, _)| {
            black_box(navigation.step(*time, black_box(sensors)));
        })
    }

    /// Mean time of a control step, us.
    fn control_us(&self, setup: &FlightSetup) -> f64 {
        let gains = &setup.parameters.gains;
        let mut flight = FlightControl::new(setup.plant.period, &setup.model, gains);
        self.mean_us(|(_, _, state, demand)| {
            black_box(flight.step(black_box(state), demand));
        })
    }

    fn mean_us(&self, mut step: impl FnMut(&(SimTime, Sensors, NavigationState, Demand))) -> f64 {
        let (warm, measured) = self.0.split_at(WARM);
        warm.iter().for_each(&mut step);
        let began = clock::now();
        measured.iter().for_each(&mut step);
        // Thousands.
        let count = measured.len() as f64;
        (clock::now() - began).as_secs_f64() * 1.0e6 / count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_is_measured_in_a_flight_that_goes_on() {
        let mut out = Vec::new();
        measure_parts(&mut out, 1, 1).unwrap();
        let text = String::from_utf8(out).unwrap();
        for part in ["default", "F-16", "estimator, mean", "plant step 1000 us"] {
            assert!(text.contains(part), "{part} in {text}");
        }
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}
