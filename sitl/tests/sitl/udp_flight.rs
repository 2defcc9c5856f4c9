//! A flight through the two real processes is the flight in one process, bit for bit.

use std::path::Path;
use std::sync::Arc;

use autopilot::run::AutopilotArgs;
use autopilot::script::Script;
use clap::{Args, Command};
use icd::SimTime;
use icd::tvc_jet;
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::{End, FlightSetup, Record, fly};
use plant_sim::io::PlantArgs;
use sitl::udp_flight::fly_udp;

fn parse<T: Args>(words: &[&str]) -> T {
    let matches = T::augment_args(Command::new("test")).get_matches_from(words);
    T::from_arg_matches(&matches).unwrap()
}

fn setup(plant: &[&str], autopilot: &[&str], seconds: u64) -> FlightSetup {
    let plant: PlantArgs = parse(plant);
    let autopilot: AutopilotArgs = parse(autopilot);
    let (control, parameters) = autopilot.control_setup().unwrap();
    FlightSetup {
        plant: plant.plant_setup().unwrap(),
        model: control.model,
        parameters,
        references: control.references,
        script: control.script,
        duration: SimTime::from_micros(1_000_000 * seconds),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    }
}

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_sitl"))
}

fn assert_same(setup: &FlightSetup) -> End {
    assert_same_with(setup, &mut |_| {})
}

fn assert_same_with(setup: &FlightSetup, sink: &mut dyn FnMut(&Record)) -> End {
    let (mut here, mut there): (Vec<u8>, Vec<u8>) = (Vec::new(), Vec::new());
    let keep =
        |bytes: &mut Vec<u8>, record: &Record| bytes.extend(postcard::to_stdvec(record).unwrap());
    let end = fly(setup, &mut |record| {
        keep(&mut here, record);
        sink(record);
    });
    let end = end.unwrap();
    let udp = fly_udp(program(), setup, &mut |record| keep(&mut there, record)).unwrap();
    assert_eq!(end, udp);
    assert!(here == there, "{} bytes in process, {} over UDP", here.len(), there.len());
    end
}

#[test]
fn case_2_with_noise_and_turbulence_gives_the_same_bytes_over_udp() {
    let plant = ["plant-sim", "--scenario=case2", "--gyro-noise-deg-s=0.1", "--turbulence-m-s=1.5"];
    let end = assert_same(&setup(&plant, &["autopilot", "--scenario=case2"], 10));
    assert_eq!(end.time, SimTime::from_micros(10_000_000));
}

#[test]
fn a_flight_that_ends_on_the_ground_ends_at_the_same_tick_over_udp() {
    let plant = ["plant-sim", "--scenario=case1", "--earth=flat", "--period-ms=4"];
    let end = assert_same(&setup(&plant, &["autopilot", "--scenario=case1", "--ftc=off"], 90));
    assert!(end.on_ground, "case 1 without the compensator is lost, but it ended at {}", end.time);
}

/// Codes of the faults that acted, each time they changed.
fn faults_of(record: &Record, seen: &mut Vec<Vec<u8>>) {
    let codes = tvc_jet::ALL.map(|effector| record.truth.fault_codes[effector]).to_vec();
    if seen.last() != Some(&codes) {
        seen.push(codes);
    }
}

#[test]
fn the_shipped_script_gives_the_same_bytes_over_udp() {
    let chain = concat!("--scenario=", env!("CARGO_MANIFEST_DIR"), "/../scenarios/chain.toml");
    let setup = setup(&["plant-sim", chain], &["autopilot", chain], 30);
    assert!(setup.script.is_some());
    let mut seen = Vec::new();
    assert_same_with(&setup, &mut |record| faults_of(record, &mut seen));
    // Healthy, the elevator, the rudder too, mended.
    assert_eq!(seen.len(), 4, "{seen:?}");
    assert_eq!(seen.first(), seen.last());
}

#[test]
fn more_faults_in_one_step_than_may_wait_for_an_answer_act_at_the_same_ticks_over_udp() {
    let plant = ["plant-sim", "--gyro-noise-deg-s=0.1", "--turbulence-m-s=1.5"];
    let mut setup = setup(&plant, &["autopilot"], 6);
    let text = "at 1 s: roll 10 deg\n".to_owned()
        + &(1..=7).map(|n| format!("fail servo {n} 80 % left, for 1 s\n")).collect::<String>()
        + "fail engine 90 % left\nfail servo 1 biased 1 deg\nfail servo 2 slow 20 deg/s\n"
        + "sequence other\nwhen roll passes 5 deg: fail servo 5 biased 1 deg, for 500 ms\n"
        + "altitude 5100 m\nafter 1 s: clear all\n";
    setup.script = Some(Arc::new(Script::parse("many", &text, &tvc_jet::effectors()).unwrap()));
    let mut seen = Vec::new();
    assert_same_with(&setup, &mut |record| faults_of(record, &mut seen));
    assert!(seen.len() > 10, "one after the other: {seen:?}");
}

#[test]
fn a_setup_that_cannot_fly_is_reported_by_the_process_that_finds_it() {
    let mut setup = setup(&["plant-sim"], &["autopilot"], 1);
    setup.plant.start.airspeed_m_s = 5.0;
    let refused = |setup: &FlightSetup| fly_udp(program(), setup, &mut |_| {}).unwrap_err();
    let message = refused(&setup).to_string();
    assert!(message.starts_with("plant-sim ended"), "{message}");
    assert!(message.contains("steady level flight at 5 m/s"), "{message}");
    setup.plant.start.airspeed_m_s = 264.0;
    setup.parameters.gains.neso.bandwidth = f64::NAN;
    let message = refused(&setup).to_string();
    assert!(message.starts_with("autopilot ended"), "{message}");
    assert!(message.contains("OBS_W0"), "{message}");
}
