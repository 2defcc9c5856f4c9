//! The flight log of a flight in one process: the same entries that the recorder of the autopilot's process gets.

use std::io;

use autopilot::recorder::{
    Begin, ControlHeader, Encoder, End, Entry, FLIGHT_RULES, LogRate, Recorded, Step,
};
use host_io::session;
use icd::fault::{PlantReport, PlantRequest};
use icd::{SimTime, wire};
use plant_sim::Plant;
use plant_sim::io::header::PlantHeader;

use super::FlyError;
use crate::closed_loop::{Exchange, FlightSetup, Tick, settings};

/// A log in memory.
#[derive(Debug)]
pub(super) struct FlightLog(Encoder<Vec<u8>>);

impl FlightLog {
    /// Begins the log of a flight of the scenario with this name.
    pub(super) fn begin(scenario: &str, setup: &FlightSetup) -> Result<Self, FlyError> {
        let settings = settings(setup);
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let header = ControlHeader {
            version: version.clone(),
            wire_version: wire::VERSION,
            flight_rules: FLIGHT_RULES,
            // There is no link; the seed tells one flight from another.
            session: session::shown(setup.plant.seed),
            period_us: setup.plant.period.as_micros(),
            row_every: 1,
            joined_in_flight: false,
            model: settings.model,
            gains: settings.gains,
            limits: settings.limits,
            navigation: settings.navigation,
            references: settings.references,
            script: settings.script,
            fault_injection: settings.fault_injection,
            parameter_hash: String::new(),
        };
        let begin = Begin { time: SimTime::ZERO, header };
        let mut log = Encoder::begin(Vec::new(), begin, &setup.parameters, LogRate::Events)?;
        let plant =
            PlantHeader { version, scenario: scenario.to_owned(), setup: setup.plant.clone() };
        let json = serde_json::to_vec(&plant).map_err(io::Error::from)?;
        log.add(Entry::Piece { index: 0, count: 1, bytes: json.into() })?;
        Ok(Self(log))
    }

    /// A control step and what has happened.
    pub(super) fn tick(&mut self, tick: &Tick<'_>) -> Result<(), FlyError> {
        let snapshot = tick.snapshot;
        let plant = tick.plant;
        let demand = &snapshot.demand;
        self.0.add(Entry::Step(Step {
            time: tick.exchange.time,
            sensors: *tick.sensors,
            actuators: tick.log.actuators(),
            log: *tick.log,
            mode: snapshot.mode,
            references: [demand.altitude_m, demand.roll_rad, demand.airspeed_m_s],
            terminated: snapshot.terminated,
            truth: Some(plant.truth().to_row(plant.on_ground(), plant.is_broken())),
        }))?;
        for event in tick.events {
            self.0.add(Entry::Event(*event))?;
        }
        Ok(())
    }

    /// What the plant reports. A log in memory takes everything; what fails is found at the next tick.
    pub(super) fn report(&mut self, exchange: &Exchange, report: &PlantReport) {
        if let Some(entry) = Entry::of_report(exchange.time, report) {
            let _ = self.0.add(entry);
        }
    }

    /// What the autopilot asks of the plant.
    pub(super) fn request(
        &mut self,
        exchange: &Exchange,
        request: PlantRequest,
    ) -> Result<(), FlyError> {
        let Exchange { time, moment, .. } = *exchange;
        let what = Recorded::Request(request);
        Ok(self.0.add(Entry::Recorded { time, moment, what })?)
    }

    /// The aircraft is on the ground.
    pub(super) fn landed(&mut self, exchange: &Exchange, plant: &Plant) -> Result<(), FlyError> {
        let row = plant.truth().to_row(plant.on_ground(), plant.is_broken());
        Ok(self.0.add(Entry::Ground { time: exchange.time, row })?)
    }

    /// Its bytes.
    pub(super) fn end(self) -> Result<Vec<u8>, FlyError> {
        Ok(self.0.end(End::Stopped)?)
    }
}
