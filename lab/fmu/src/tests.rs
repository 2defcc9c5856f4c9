use super::*;
use lab_engine::Flight;
use variables::{Causality, FmuVariable};

fn flight(scenario: &str) -> FlightSetup {
    let mut options = SetupOptions::default();
    options.set("plant.duration_s", 5.0).set("plant.sensors.grade", "tactical");
    options.set("plant.wind.turbulence_m_s", 2.0).setup(scenario).expect("a scenario that ships")
}

fn plant_of(flight: &FlightSetup) -> FmuInstance {
    begun(FmuInstance::new(SideSetup::Plant(Box::new(flight.plant.clone()))))
}

fn begun(instance: Result<FmuInstance, Problem>) -> FmuInstance {
    let mut instance = instance.expect("an instance");
    instance.enter_initialization(0.0).expect("a new instance");
    instance.exit_initialization().expect("a flight begins");
    instance
}

fn reference(instance: &FmuInstance, name: &str) -> u32 {
    let place = instance.variables().iter().position(|variable| variable.name == name);
    place.unwrap_or_else(|| panic!("no {name}")) as u32
}

fn set(instance: &mut FmuInstance, name: &str, value: FmuValue) -> Result<(), String> {
    instance.set(reference(instance, name), value).map_err(|problem| problem.to_string())
}

fn number(instance: &mut FmuInstance, name: &str) -> f64 {
    match instance.get(reference(instance, name)) {
        Ok(FmuValue::Number(number)) => *number,
        other => panic!("{name}: {other:?}"),
    }
}

/// From every output to the input of its name.
fn pass(from: &mut FmuInstance, to: &mut FmuInstance) {
    let is_input = |name: &str| {
        let of_name = |v: &&FmuVariable| v.name == name && v.causality == Causality::Input;
        to.variables().iter().any(|variable| of_name(&variable))
    };
    let outputs = from.variables().iter().filter(|v| v.causality == Causality::Output);
    let names: Vec<String> =
        outputs.map(|v| v.name.clone()).filter(|name| is_input(name)).collect();
    assert!(names.len() > 3, "{names:?}");
    for name in names {
        let value = from.get(reference(from, &name)).expect("an output").clone();
        set(to, &name, value).expect("an input");
    }
}

#[test]
fn the_pair_flies_as_in_one_process_to_the_bit() {
    let setup = flight("case1");
    let mut flight = Flight::new(&setup).expect("a flight");
    let mut plant = plant_of(&setup);
    let autopilot = AutopilotSetup::of(&setup).expect("an autopilot");
    let mut autopilot = begun(FmuInstance::new(SideSetup::Autopilot(Box::new(autopilot))));
    let period_s = plant.period().as_seconds();
    let mut compared = 0;
    while let Some(tick) = flight.step([]) {
        let truth = tick.plant.truth().to_row(false, false);
        let at_s = tick.exchange.time.as_seconds();
        let names = icd::record::truth_fields(&setup.plant.airframe.effectors);
        for (name, value) in names.zip(truth.iter()) {
            let ours = number(&mut plant, &format!("truth.{name}"));
            assert_eq!(ours.to_bits(), value.to_bits(), "{name} at {at_s} s: {ours}, {value}");
            compared += 1;
        }
        pass(&mut plant, &mut autopilot);
        let _ = autopilot.step(at_s, period_s).expect("a control step");
        pass(&mut autopilot, &mut plant);
        let _ = plant.step(at_s, period_s).expect("a period");
    }
    assert!(compared > 100_000, "{compared}");
}

#[test]
fn words_break_the_aircraft_as_the_scenario_does() {
    let setup = flight("case1");
    let (mut scenario, mut nominal) = (plant_of(&setup), setup.clone());
    nominal.plant.faults.clear();
    let mut words = plant_of(&nominal);
    let fault = FmuValue::Text("at 3 s: left elevator stuck at 30 deg".to_owned());
    set(&mut words, "fault", fault).expect("a fault");
    for plant in [&mut scenario, &mut words] {
        let _ = plant.step(0.0, 4.0).expect("a step of many periods");
    }
    for name in ["truth.p_rad_s", "truth.fault_left_elevator"] {
        let [a, b] = [&mut scenario, &mut words].map(|plant| number(plant, name));
        assert!(a.to_bits() == b.to_bits() && a != 0.0, "{name}: {a}, {b}");
    }
}

#[test]
fn what_cannot_be_is_refused_with_the_reason_and_changes_nothing() {
    let mut plant = plant_of(&flight("nominal"));
    let before = number(&mut plant, "truth.altitude_m");
    let refused = |result: Result<(), String>, reason: &str| {
        let error = result.expect_err(reason);
        assert!(error.contains(reason), "{error}");
    };
    let words = |text: &str| FmuValue::Text(text.to_owned());
    refused(set(&mut plant, "fault", words("rudder stuck at 300 deg")), "rudder stuck at 300 deg");
    refused(set(&mut plant, "fault", words("roll 10 deg")), "fault");
    refused(set(&mut plant, "fault", FmuValue::Number(1.0)), "another type");
    refused(set(&mut plant, "seed", FmuValue::Count(2)), "cannot set a parameter");
    refused(set(&mut plant, "truth.alpha_rad", FmuValue::Number(0.0)), "only parameters");
    refused(set(&mut plant, "wind_down_m_s", FmuValue::Number(f64::NAN)), "finite");
    for (point_s, size_s, reason) in [
        (0.0, 0.003, "a multiple of the control period of 0.002 s"),
        (0.0, 0.0, "a multiple"),
        (0.0, f64::NAN, "a multiple"),
        (0.0, 1.0e300, "a multiple"),
        (0.1, 0.002, "the time is 0 s"),
    ] {
        refused(plant.step(point_s, size_s).map(drop).map_err(|p| p.to_string()), reason);
    }
    assert_eq!(number(&mut plant, "truth.altitude_m"), before);
}

#[test]
fn the_same_flight_gives_the_same_bytes_and_reads_back() {
    let setup = flight("case1");
    for is_autopilot in [false, true] {
        let archive = || archive(&setup, is_autopilot, b"a library").expect("an archive");
        assert_eq!(archive(), archive());
        let folder = tempfile::tempdir().expect("a folder");
        let side = match is_autopilot {
            true => SideSetup::Autopilot(Box::new(AutopilotSetup::of(&setup).expect("one"))),
            false => SideSetup::Plant(Box::new(setup.plant.clone())),
        };
        let json = side.to_json().expect("a text");
        std::fs::write(folder.path().join(setup::SETUP_FILE), &json).expect("a file");
        let read = |token: &str| SideSetup::read(folder.path(), token);
        assert_eq!(read(&setup::token_of(&json)).expect("it reads back"), side);
        assert!(read("another").unwrap_err().to_string().contains("not the setup"));
    }
}
