//! The reference that knows the fault: blind before the onset, exact after it.

use autopilot::config;
use flight_control::{AllocationMode, CompensatorMode, DesignModel};
use icd::{ControlPeriod, SimTime};
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::{FlightSetup, Record, fly};
use lab_judges::flown::outcome;
use nalgebra::Vector3;
use plant_sim::{Airframe, ReadAirframe as _, Scenario};

/// Onset of every fault, s.
const ONSET_S: f64 = 2.0;

fn setup(fault: &str, mode: CompensatorMode, duration_s: f64) -> FlightSetup {
    let airframe = Airframe::paper();
    let text = format!("[plant]\nseed = 3\n[[plant.fault]]\nonset_s = {ONSET_S:?}\n{fault}\n");
    let scenario = Scenario::from_toml("scenario", &text, &airframe.effectors).expect("above");
    let model = config::model("model", aircraft::DEFAULT_MODEL).expect("a shipped model");
    let mut parameters = model.defaults;
    parameters.gains.selection.compensator = mode;
    parameters.gains.selection.allocation = AllocationMode::Relief;
    FlightSetup {
        plant: scenario.plant.setup(airframe, 1, ControlPeriod::DEFAULT, 1_000),
        model: model.aircraft,
        parameters,
        references: config::references("scenario", &text).expect("above"),
        script: None,
        duration: SimTime::from_seconds(duration_s).expect("seconds of a flight"),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    }
}

fn records(setup: &FlightSetup, knows_fault: bool) -> Vec<Record> {
    let mut all = Vec::new();
    let setup = FlightSetup { knows_fault, ..setup.clone() };
    let _ = fly(&setup, &mut |record| all.push(*record)).expect("it can start");
    all
}

#[test]
fn before_the_onset_and_without_anything_to_reallocate_it_changes_no_bit() {
    let jam = setup(
        "effector = \"rudder\"\nkind = \"stuck_at\"\nangle_deg = 12.0",
        CompensatorMode::Off,
        3.0,
    );
    let (alone, known) = (records(&jam, false), records(&jam, true));
    let before = alone.iter().filter(|record| record.truth.time.as_seconds() < ONSET_S).count();
    assert_eq!(before, 1_000);
    assert_eq!(alone[..before], known[..before]);
    assert_ne!(alone[before].log.commands, known[before].log.commands, "at the onset");
    // A late effector has its whole travel: there is nothing to reallocate.
    let late = setup(
        "effector = \"rudder\"\nkind = \"delayed\"\ndelay_ms = 40.0",
        CompensatorMode::Off,
        3.0,
    );
    assert_eq!(records(&late, false), records(&late, true));
}

/// What all effectors give in the last step before the end, by the controller's model, minus what the main controller asks for.
fn missing(setup: &FlightSetup, knows_fault: bool) -> Vector3<f64> {
    let model = DesignModel::new(setup.model);
    let records = records(setup, knows_fault);
    let [.., last, next] = records.as_slice() else { panic!("a flight has steps") };
    let at = model.condition(&last.log.state);
    let list = setup.model.effectors.list;
    let mut demanded = last.log.commands;
    let main = &last.log.main;
    for effector in list.all().filter(|effector| list.is_angle(*effector)) {
        let gains = setup.model.effectors.gains[effector];
        demanded[effector] =
            gains.of([main.aileron_rad, main.elevator_rad, main.rudder_rad, main.thrust_n]);
    }
    model.effectors(&at, &next.truth.deflections) - model.effectors(&at, &demanded)
}

#[test]
fn what_a_failed_effector_does_not_give_the_others_do() {
    for fault in [
        "effector = \"left_elevator\"\nkind = \"stuck_at\"\nangle_deg = 8.0",
        "effector = \"right_aileron\"\nkind = \"partial_loss\"\nremaining_percent = 30.0",
        "effector = \"rudder\"\nkind = \"float\"",
        "effector = \"left_elevator\"\nkind = \"biased\"\nbias_deg = 6.0",
        "effector = \"nozzle_yaw\"\nkind = \"stuck_at\"\nangle_deg = 6.0",
    ] {
        let setup = setup(fault, CompensatorMode::Off, 20.0);
        let missing = missing(&setup, true);
        // Servos lag a little behind; the main controller has hardly anything to ask for by now.
        assert!(missing.norm() < 0.02, "{fault}: {missing:?} rad/s²");
    }
}

#[test]
fn knowledge_keeps_a_jammed_nozzle_that_the_blind_law_loses() {
    let fault = "effector = \"nozzle_yaw\"\nkind = \"stuck_at\"\nangle_deg = 15.0";
    let blind = setup(fault, CompensatorMode::Armed, 40.0);
    let known = setup(fault, CompensatorMode::Off, 40.0);
    let is_kept = |setup| outcome(&setup, &[]).expect("it can start").is_kept();
    assert!(!is_kept(blind) && is_kept(FlightSetup { knows_fault: true, ..known }));
}
