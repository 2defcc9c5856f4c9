//! Flight logs: read, plotted, replayed, converted.

use autopilot::command::ScriptCommand;
use autopilot::command::VehicleCommand;
use icd::tvc_jet;
use std::sync::Arc;

use autopilot::command::Command;
use autopilot::recorder::Moment;
use autopilot::script::Script;
use autopilot::vehicle::{Mode, Reference};
use icd::{ControlPeriod, SimTime};
use lab_engine::geometry::AircraftGeometry;
use lab_judges::closed_loop::FlightSetup;
use lab_paper::cases::{Case, Conditions};
use plant_sim::EarthModel;
use ulog::reader::Log;

use super::choices::Choices;
use super::testing::{self, Without};

/// Flight time of the log that is damaged.
const SEED_US: u64 = 60_000;
/// Control steps of a replayed log, at most.
const STEPS_MAX: u64 = 60;
/// Bytes of a page for each byte of its log, and of one without a flight.
const PAGE_PER_BYTE: usize = 12;
const PAGE_BYTES: usize = 600_000;

/// A short flight with a fault and with inputs of an operator, as the recorder writes it.
fn seed() -> Vec<u8> {
    let conditions = Conditions {
        earth: EarthModel::Wgs84,
        period: ControlPeriod::DEFAULT,
        step_us: 1_000,
        gyro_noise_rad_s: 1.0e-3,
        turbulence_m_s: 1.5,
        seed: 7,
    };
    let setup = Case::new(1, &conditions).unwrap().setup;
    let setup = FlightSetup { duration: SimTime::from_micros(SEED_US), ..setup };
    let script =
        Script::parse("a script", "at 0.02 s: fail rudder 50 % left\n", &tvc_jet::effectors())
            .unwrap();
    let commands = [
        (0, Moment::Step, Command::Vehicle(VehicleCommand::Refer(Reference::Altitude(5_100.0)))),
        (2, Moment::Step, Command::Script(ScriptCommand::Run(Arc::new(script)))),
        (5, Moment::Step, Command::Vehicle(VehicleCommand::Mode(Mode::Hold))),
    ];
    testing::log(&setup, &commands, Without::default())
}

fn damaged(seed: &[u8], input: &[u8]) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    Choices::new(input).damage(&mut bytes);
    bytes
}

#[test]
fn ulog_reader() {
    let seed = seed();
    bolero::check!().for_each(|input: &[u8]| {
        let bytes = damaged(&seed, input);
        let Ok(log) = Log::from_bytes(bytes) else { return };
        for topic in log.topics() {
            let name = topic.name();
            let times = log.times_us(name).map_or(0, |times| times.len());
            if let Some(column) = log.column(name, "timestamp") {
                assert_eq!(column.len(), times, "{name}");
            }
        }
        for info in log.infos() {
            // Of any type, with the interpretation of either.
            let _ = (info.text(), info.unsigned());
        }
    });
}

#[test]
fn plot() {
    let seed = seed();
    bolero::check!().for_each(|input: &[u8]| {
        let bytes = damaged(&seed, input);
        let length = bytes.len();
        if let Ok(page) = lab_logs::plot::of_bytes(bytes) {
            let most = PAGE_BYTES + PAGE_PER_BYTE * length;
            assert!(page.html.len() < most, "{} bytes of {length}", page.html.len());
        }
    });
}

#[test]
fn replay() {
    let seed = seed();
    bolero::check!().for_each(|input: &[u8]| {
        let bytes = damaged(&seed, input);
        if let Ok(verdict) = lab_logs::replay::of_bytes(bytes, STEPS_MAX) {
            assert!(verdict.steps <= STEPS_MAX, "{} steps", verdict.steps);
        }
    });
}

#[test]
fn mcap() {
    let seed = seed();
    let list = tvc_jet::effectors();
    let geometry =
        AircraftGeometry::from_toml("geometry.toml", aircraft::GEOMETRIES[0].1, &list).unwrap();
    bolero::check!().for_each(|input: &[u8]| {
        let Ok(log) = Log::from_bytes(damaged(&seed, input)) else { return };
        if let Ok(file) = lab_logs::mcap::file(log, &geometry) {
            assert!(file.starts_with(lab_logs::mcap::MARK));
        }
    });
}
