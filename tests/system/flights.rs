//! The paper's flights as setups, and a function that flies them to a list of ticks.

use autopilot::config;
use autopilot::parameters::Parameters;
use icd::{ControlPeriod, SimTime};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::{self, FlightSetup, Record};
use plant_sim::{Airframe, EarthModel, ReadAirframe as _, Scenario};

/// A scenario text with the shipped airframe, model and gains at 2 ms and one plant step per millisecond.
pub fn setup(name: &str, text: &str, earth: EarthModel) -> FlightSetup {
    let effectors = Airframe::paper().effectors;
    let scenario = Scenario::from_toml(name, text, &effectors).expect("a shipped scenario");
    let mut plant = scenario.plant.setup(Airframe::paper(), 0, ControlPeriod::DEFAULT, 1_000);
    plant.earth = earth;
    FlightSetup {
        plant,
        model: config::aircraft_model("tvc_jet.toml", aircraft::DEFAULT_MODEL)
            .expect("the shipped model"),
        parameters: Parameters::default(),
        references: config::references(name, text).expect("a shipped scenario"),
        script: None,
        // The test sets the duration of a scenario that has none.
        duration: SimTime::from_seconds(scenario.plant.duration_s.unwrap_or(0.0))
            .expect("checked by the scenario"),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    }
}

/// Case 1 with its fault, compensator armed.
pub fn case_1(earth: EarthModel) -> FlightSetup {
    setup("case1.toml", scenarios::CASE1, earth)
}

/// Case 2 with its fault, compensator armed.
pub fn case_2(earth: EarthModel) -> FlightSetup {
    setup("case2.toml", scenarios::CASE2, earth)
}

/// Level flight without a fault, 20 s.
pub fn healthy(earth: EarthModel) -> FlightSetup {
    let mut setup = setup("nominal.toml", scenarios::NOMINAL, earth);
    setup.duration = SimTime::from_micros(20_000_000);
    setup
}

/// All ticks of a flight.
pub fn fly(setup: &FlightSetup) -> Vec<Record> {
    let mut records = Vec::new();
    closed_loop::fly(setup, &mut |record| records.push(*record))
        .expect("the shipped aircraft flies");
    records
}

/// Every number of every tick, as bytes.
pub fn bytes(records: &[Record]) -> Vec<u8> {
    records.iter().flat_map(|record| postcard::to_stdvec(record).expect("plain numbers")).collect()
}
