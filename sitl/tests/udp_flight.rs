//! A flight through the two real processes is the flight in one process, bit for bit.
#![allow(clippy::unwrap_used, reason = "in a test a panic is the report")]

use std::path::Path;

use autopilot::run::AutopilotArgs;
use clap::{Args, Command};
use icd::SimTime;
use plant_sim::io::PlantArgs;
use sitl::closed_loop::{End, FlightSetup, Record, fly};
use sitl::udp_flight::{UdpFlightError, fly_udp};

fn parse<T: Args>(words: &[&str]) -> T {
    let matches = T::augment_args(Command::new("test")).get_matches_from(words);
    T::from_arg_matches(&matches).unwrap()
}

fn setup(plant: &[&str], autopilot: &[&str], seconds: u64) -> FlightSetup {
    let plant: PlantArgs = parse(plant);
    let autopilot: AutopilotArgs = parse(autopilot);
    let (control, _) = autopilot.control_setup().unwrap();
    FlightSetup {
        plant: plant.plant_setup().unwrap(),
        belief: control.belief,
        gains: control.gains,
        references: control.references,
        duration: SimTime::from_micros(1_000_000 * seconds),
    }
}

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_sitl"))
}

fn assert_same(setup: &FlightSetup) -> End {
    let (mut here, mut there): (Vec<u8>, Vec<u8>) = (Vec::new(), Vec::new());
    let keep =
        |bytes: &mut Vec<u8>, record: &Record| bytes.extend(postcard::to_stdvec(record).unwrap());
    let end = fly(setup, &mut |record| keep(&mut here, record)).unwrap();
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

#[test]
fn a_setup_that_cannot_fly_is_told_by_the_process_that_finds_it() {
    let mut setup = setup(&["plant-sim"], &["autopilot"], 1);
    setup.plant.start.airspeed_m_s = 5.0;
    match fly_udp(program(), &setup, &mut |_| {}) {
        Err(UdpFlightError::Process { process: "plant-sim", message, .. }) => {
            assert!(message.contains("airspeed_m_s"), "{message}");
        }
        other => panic!("{other:?}"),
    }
    setup.plant.start.airspeed_m_s = 264.0;
    setup.gains.observer.bandwidth = f64::NAN;
    match fly_udp(program(), &setup, &mut |_| {}) {
        Err(UdpFlightError::Process { process: "autopilot", message, .. }) => {
            assert!(message.contains("OBS_W0"), "{message}");
        }
        other => panic!("{other:?}"),
    }
}
