//! What sensors with errors, turbulence and the estimator cost, in one process on one core.

use std::error::Error;
use std::hint::black_box;
use std::io::Write;
use std::ops::ControlFlow;

use flight_analysis::builder::SetupOptions;
use flight_analysis::closed_loop::{FlightSetup, watch};
use flight_analysis::configuration::{AircraftArgs, Named};
use flight_control::{Demand, FlightControl, NavigationSource, NavigationState};
use host_io::clock;
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use plant_sim::airframe::F16_AIRFRAME;
use plant_sim::{Airframe, GradeName, Plant, PlantSetup, SensorSettings};

use super::{in_process, median};

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
pub(super) fn measure(
    out: &mut impl Write,
    repeat: usize,
    flight_s: u32,
) -> Result<(), Box<dyn Error>> {
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
                super::quantile(turns.map(|(plain, rate)| plain / rate).collect::<Vec<_>>(), 0.5)
            });
            let [plain, sampled, all] = rates.map(|rates| super::quantile(rates, 0.5));
            writeln!(
                out,
                "  {name:<8} step {step_us} us: plain {plain:8.0}/s, sampled {sampled:8.0}/s ({sampled_ratio:.2}), all {all:8.0}/s \
                 ({all_ratio:.2}, wanted at most 2)"
            )?;
        }
    }
    let setup = flight_setup(&jet, 1_000, RECORDED_S)?;
    let flown = Recorded::of(&setup)?;
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
fn plant_setup(
    airframe: &Airframe,
    step_us: u32,
    has_errors: bool,
) -> Result<PlantSetup, Box<dyn Error>> {
    let nominal = Named::scenario("nominal")?;
    let mut plant = AircraftArgs::default().scenario(&nominal, &airframe.effectors)?.plant;
    if has_errors {
        plant.wind.turbulence_m_s = TURBULENCE_M_S;
        plant.sensors = SensorSettings::of_grade(GradeName::Tactical);
    }
    Ok(plant.setup(airframe.clone(), 0, ControlPeriod::DEFAULT, step_us))
}

/// The same with a controller, with all errors.
fn flight_setup(
    airframe: &Airframe,
    step_us: u32,
    flight_s: f64,
) -> Result<FlightSetup, Box<dyn Error>> {
    let mut setup = SetupOptions::default().setup("nominal")?;
    setup.plant = plant_setup(airframe, step_us, true)?;
    setup.duration = SimTime::from_seconds(flight_s).unwrap_or(SimTime::ZERO);
    Ok(setup)
}

/// Plant steps a second with the controls of the trimmed flight.
fn plant_steps(setup: &PlantSetup, samples: bool) -> Result<f64, Box<dyn Error>> {
    let start = Plant::new(setup)?;
    let actuators = Actuators { commands: start.trim().positions() };
    let began = clock::now();
    for _ in 0..FLIGHTS {
        let mut plant = start.clone();
        for _ in 0..PERIODS {
            if samples {
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
struct Recorded(Vec<(SimTime, Sensors, NavigationState, Demand)>);

impl Recorded {
    fn of(setup: &FlightSetup) -> Result<Self, Box<dyn Error>> {
        let mut flown = Self(Vec::new());
        watch(setup, |tick| {
            flown.0.push((tick.exchange.time, *tick.sensors, tick.log.state, tick.snapshot.demand));
            ControlFlow::Continue(())
        })?;
        match flown.0.last() {
            Some((_, _, state, _)) if flown.0.len() > WARM && state.estimate.is_some() => Ok(flown),
            _ => {
                Err("the flight that is measured ended early, or was not on estimated states"
                    .into())
            }
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
        #[expect(clippy::cast_precision_loss, reason = "thousands")]
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
        measure(&mut out, 1, 1).unwrap();
        let text = String::from_utf8(out).unwrap();
        for part in ["default", "F-16", "estimator, mean", "plant step 1000 us"] {
            assert!(text.contains(part), "{part} in {text}");
        }
        assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
    }
}
