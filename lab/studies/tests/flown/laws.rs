//! Every main controller with every compensator, in calm flight and through both faults of the paper.
//!
//! `cargo test --workspace --test flown laws -- --nocapture` prints the table of docs/laws.md.

use autopilot::config;
use autopilot::parameters::Parameters;
use flight_control::{
    CompensatorLaw, CompensatorMode, DesignModel, FlightControl, Gains, MainLaw, Navigator,
};
use icd::units::DEG;
use icd::{ControlPeriod, SimTime, tvc_jet};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::{self, FlightSetup, Record};
use lab_judges::trace::Sample;
use lab_report::runner;
use plant_sim::{Airframe, Plant, ReadAirframe as _, Scenario};

const SCENARIOS: [(&str, &str); 3] =
    [("nominal", scenarios::NOMINAL), ("case1", scenarios::CASE1), ("case2", scenarios::CASE2)];

fn setup(name: &str, text: &str, gains: Gains) -> FlightSetup {
    let scenario =
        Scenario::from_toml(name, text, &Airframe::paper().effectors).expect("a shipped scenario");
    let plant = scenario.plant.setup(Airframe::paper(), 0, ControlPeriod::DEFAULT, 1_000);
    let parameters = Parameters { gains, ..Parameters::default() };
    FlightSetup {
        plant,
        model: config::aircraft_model("tvc_jet.toml", aircraft::DEFAULT_MODEL)
            .expect("the shipped model"),
        parameters,
        references: config::references(name, text).expect("a shipped scenario"),
        script: None,
        duration: SimTime::from_micros(40_000_000),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    }
}

/// What became of a flight.
#[derive(Debug, Clone, Copy)]
struct Outcome {
    lost_at_s: Option<f64>,
    /// Largest distance of the roll angle from its reference, deg.
    roll_deg: f64,
    /// Altitude error at the end, m.
    altitude_m: f64,
    /// Airspeed error at the end, m/s.
    airspeed_m_s: f64,
}

fn fly(setup: &FlightSetup) -> Outcome {
    let model = DesignModel::new(setup.model);
    let mut outcome =
        Outcome { lost_at_s: None, roll_deg: 0.0, altitude_m: 0.0, airspeed_m_s: 0.0 };
    closed_loop::fly(setup, &mut |record: &Record| {
        let (truth, log) = (&record.truth, &record.log);
        if outcome.lost_at_s.is_none()
            && setup.plant.airframe.limits.are_exceeded(&(&Sample::of(&model, record).row).into())
        {
            outcome.lost_at_s = Some(truth.time.as_seconds());
        }
        let roll = (log.state.attitude.phi - log.roll_reference_rad).abs() / DEG;
        outcome.roll_deg = outcome.roll_deg.max(roll);
        outcome.altitude_m = log.state.altitude_m - log.altitude_reference_m;
        outcome.airspeed_m_s = log.state.airspeed_m_s - log.airspeed_reference_m_s;
    })
    .expect("the shipped aircraft flies");
    outcome
}

fn gains(main: MainLaw, compensator: Option<CompensatorLaw>) -> Gains {
    let mut gains = Gains::REFERENCE;
    gains.selection.main = main;
    match compensator {
        Some(law) => gains.selection.compensator_law = law,
        None => gains.selection.compensator = CompensatorMode::Off,
    }
    gains
}

/// The laws that the program brings.
fn laws() -> impl Iterator<Item = (&'static str, MainLaw)> {
    MainLaw::NAMES.iter().copied().filter(|(_, law)| *law != MainLaw::Own)
}

fn compensators() -> impl Iterator<Item = (&'static str, Option<CompensatorLaw>)> {
    let all = CompensatorLaw::NAMES.iter().copied().map(|(name, law)| (name, Some(law)));
    [("off", None)].into_iter().chain(all)
}

#[test]
fn every_law_flies_calmly_and_every_compensator_carries_every_law_through_both_cases() {
    let mut flights = Vec::new();
    for (law, main) in laws() {
        for (compensator, estimator) in compensators() {
            for (name, text) in SCENARIOS {
                flights.push((law, compensator, name, setup(name, text, gains(main, estimator))));
            }
        }
    }
    let flown = runner::map("laws", &flights, |(.., setup)| fly(setup));
    println!(
        "| law | compensator | scenario | lost after, s | largest roll error, deg | altitude error at 40 s, m | airspeed error at 40 s, m/s |"
    );
    println!("|---|---|---|---|---|---|---|");
    for ((law, compensator, name, _), o) in flights.iter().zip(&flown) {
        let lost = o.lost_at_s.map_or("kept".to_owned(), |t| format!("{t:.1}"));
        println!(
            "| {law} | {compensator} | {name} | {lost} | {:.1} | {:.1} | {:.2} |",
            o.roll_deg, o.altitude_m, o.airspeed_m_s
        );
    }
    for ((law, compensator, name, _), o) in flights.iter().zip(&flown) {
        if *name == "nominal" || *compensator != "off" {
            assert_eq!(o.lost_at_s, None, "{law} with {compensator} in {name}");
        }
        if *name == "nominal" {
            assert!(o.altitude_m.abs() < 1.0 && o.roll_deg < 0.5, "{law}, {compensator}: {o:?}");
        }
    }
}

/// Largest change of a command in one period at a switch in steady level flight, rad: a tenth of a degree. The
/// servos move by 0.16 deg in a period.
const BUMP_MAX_RAD: f64 = 0.1 * DEG;

#[test]
fn laws_and_compensators_are_switched_in_flight_without_a_bump() {
    let (name, text) = SCENARIOS[0];
    let start = setup(name, text, Gains::REFERENCE);
    let mut plant = Plant::new(&start.plant).unwrap();
    let mut flight = FlightControl::new(start.plant.period, &start.model, &start.parameters.gains);
    flight.start_at(&plant.trim().positions());
    let mut navigator = Navigator::default();
    let demand = flight_control::Demand { altitude_m: 5_000.0, roll_rad: 0.0, airspeed_m_s: 264.0 };
    let mut last = None;
    let mut switched = 0;
    let round =
        laws().flat_map(|(_, main)| CompensatorLaw::NAMES.iter().map(move |&(_, law)| (main, law)));
    for (main, law) in round {
        let mut gains = gains(main, Some(law));
        gains.selection.compensator = CompensatorMode::AlwaysOn;
        flight.set_gains(&gains);
        for tick in 0..5_000 {
            let state = navigator.step(plant.time(), &plant.sense());
            let log = flight.step(&state, &demand);
            for effector in tvc_jet::ALL.into_iter().filter(|effector| *effector != tvc_jet::ENGINE)
            {
                let command = log.actuators().commands[effector];
                let before =
                    last.as_ref().map_or(command, |last: &icd::Actuators| last.commands[effector]);
                let bump = (command - before).abs();
                assert!(
                    bump < BUMP_MAX_RAD,
                    "{effector:?}, {main:?} {law:?}, tick {tick}: {bump} rad"
                );
            }
            let height = log.state.altitude_m - 5_000.0;
            assert!(height.abs() < 5.0, "{main:?} {law:?}, tick {tick}: {height} m");
            last = Some(log.actuators());
            plant.advance(&log.actuators());
        }
        switched += 1;
    }
    assert_eq!(switched, 12);
}
