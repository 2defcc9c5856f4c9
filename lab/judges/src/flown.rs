//! Looks at every tick of a flight: measures it, writes its row and its entries of the flight log, and ends it when the
//! aircraft is lost.

use crate::JudgeKind;
use autopilot::recorder::{Begin, ControlHeader, Encoder, End, Entry, LogRate, Recorded, Step};
use flight_control::DesignModel;
use host_io::session;
use icd::SimTime;
use icd::fault::PlantReport;
use icd::sensors::SensorKind;
use plant_sim::io::header::PlantHeader;
use plant_sim::{Attained, FlightLimits, Plant};

use crate::measures::{Measured, Measures};
use crate::outcome::{Loss, LossBy, Metric, Outcome, SensorLost};
use crate::trace::Sample;
use crate::trajectory::{self, Columns};
use host_io::problem::{Problem, problem};
use lab_engine::flight::{Exchange, Flight, FlightSetup, Tick};

/// What is kept of a flight.
#[derive(Default)]
pub struct Keep<'a> {
    /// Where the table goes, with its name for messages.
    pub table: Option<&'a mut host_io::folder::OutFile>,
    pub log: Option<FlightLog>,
    /// Called once for each second of simulation time.
    pub each_second: Option<&'a dyn Fn()>,
    /// Called with every tick.
    pub each_tick: Option<&'a mut dyn FnMut(&Tick<'_>)>,
    /// Judges whose numbers stand beside the measures.
    pub judges: &'a [JudgeKind],
    /// What is flown, for messages.
    pub scenario: Option<&'a str>,
}

/// One second, us.
const SECOND_US: u64 = 1_000_000;

/// Flies a setup to its end, or to the loss of the aircraft, and keeps nothing but the outcome.
pub fn outcome(setup: &FlightSetup, judges: &[JudgeKind]) -> Result<Outcome, Problem> {
    fly(setup, true, Keep { judges, ..Keep::default() }).map(|(outcome, _)| outcome)
}

/// Flies a setup and reports the outcome; ends it with the loss of the aircraft if `stops_at_loss`.
pub fn fly(
    setup: &FlightSetup,
    stops_at_loss: bool,
    keep: Keep<'_>,
) -> Result<(Outcome, Option<FlightLog>), Problem> {
    let airframe = &setup.plant.airframe;
    let mut judge = Judge {
        model: DesignModel::new(setup.model),
        limits: setup.plant.limits(),
        measures: Measures::new(
            airframe,
            &setup.model,
            setup.parameters.gains.selection.observer,
            setup.plant.period.as_seconds(),
        ),
        rows_every: trajectory::ticks_per_row(setup.plant.period) as u64,
        columns: Columns::of(&airframe.effectors),
        line: String::new(),
        steps: 0,
        altitude_m: [f64::NAN; 2],
        loss: None,
        sensors_lost: Vec::new(),
        next_second: SimTime::ZERO,
        judges: keep.judges.iter().map(|kind| kind.judge(setup)).collect(),
        keep,
    };
    if let Some(output) = judge.keep.table.as_mut() {
        output.write(judge.columns.header().as_bytes())?;
    }
    let scenario = judge.keep.scenario;
    let of_scenario = |problem: Problem| match scenario {
        Some(name) => problem!("scenario {name}: {problem}"),
        None => problem,
    };
    let mut flight = Flight::new(setup).map_err(|error| of_scenario(error.into()))?;
    // Only the log, the judges and the caller read verdicts.
    if judge.keep.log.is_none() && judge.keep.each_tick.is_none() && judge.judges.is_empty() {
        flight.skip_unread_verdict();
    }
    while let Some(tick) = flight.step([]) {
        judge.look(&tick)?;
        if stops_at_loss && judge.loss.is_some() {
            break;
        }
    }
    if let Some(failure) = flight.failure() {
        return Err(of_scenario(failure.into()));
    }
    let end = flight.end();
    if end.on_ground {
        judge.landed(end.time, flight.plant())?;
    }
    let lost_s = judge.loss.map(|loss| loss.at_s);
    let mut metrics = judge.measures.metrics(lost_s);
    for (kind, judge) in judge.keep.judges.iter().zip(&judge.judges) {
        let values = kind.columns.iter().zip(judge.values());
        let metric = |((name, unit), value): (&(&str, &'static str), Option<f64>)| {
            Metric::new(*name, unit, value)
        };
        metrics.extend(values.map(metric));
    }
    let outcome = Outcome {
        seed: setup.plant.seed,
        loss: judge.loss,
        end_s: end.time.as_seconds(),
        steps: judge.steps,
        altitude_m: judge.altitude_m,
        sensors_lost: judge.sensors_lost,
        touchdown: flight.plant().touchdown().copied(),
        metrics,
    };
    Ok((outcome, judge.keep.log))
}

struct Judge<'a> {
    model: DesignModel,
    limits: FlightLimits,
    measures: Measures,
    rows_every: u64,
    columns: Columns,
    /// The row that is being written.
    line: String,
    steps: u64,
    altitude_m: [f64; 2],
    loss: Option<Loss>,
    sensors_lost: Vec<SensorLost>,
    /// Simulation time of the next count of the progress.
    next_second: SimTime,
    judges: Vec<Box<dyn crate::Judge>>,
    keep: Keep<'a>,
}

impl Judge<'_> {
    fn look(&mut self, tick: &Tick<'_>) -> Result<(), Problem> {
        let truth = tick.plant.truth();
        let sensed = &tick.log.state;
        // The angles of the navigation state are those of its orientation.
        let attitude = match sensed.orientation.wxyz() == truth.attitude.wxyz() {
            true => sensed.attitude,
            false => truth.euler(),
        };
        let demand = &tick.snapshot.demand;
        let references = [demand.altitude_m, demand.roll_rad, demand.airspeed_m_s];
        self.measures.tick(&Measured { truth, attitude: &attitude, log: tick.log, references });
        self.judges.iter_mut().for_each(|judge| judge.look(tick));
        self.altitude_m = [truth.altitude_m, references[0]];
        if self.loss.is_none() {
            let at = Attained {
                roll_rad: attitude.phi,
                pitch_rad: attitude.theta,
                alpha_rad: truth.alpha_rad,
                beta_rad: truth.beta_rad,
                altitude_m: truth.altitude_m,
            };
            let by = if self.limits.are_exceeded(&at) { self.limits.exceeded(&at) } else { None };
            self.loss = by.map(|by| Loss { at_s: truth.time.as_seconds(), by: LossBy::Limit(by) });
        }
        if let Some(status) = &sensed.estimate {
            for sensor in SensorKind::ALL {
                let (health, sensor) = (status.source(sensor), sensor.name());
                let is_new = self.sensors_lost.iter().all(|lost| lost.sensor != sensor);
                if health.is_gone() && is_new {
                    let at_s = truth.time.as_seconds();
                    self.sensors_lost.push(SensorLost { sensor, at_s, why: health.name() });
                }
            }
        }
        if let Some(output) = self.keep.table.as_mut()
            && self.steps.is_multiple_of(self.rows_every)
        {
            let record = tick.record();
            let row = Sample::of(&self.model, &record).row;
            self.line.clear();
            self.columns.push(&mut self.line, &row, &record.truth, &record.log);
            output.write(self.line.as_bytes())?;
        }
        if let Some(each_tick) = &mut self.keep.each_tick {
            each_tick(tick);
        }
        if let Some(log) = self.keep.log.as_mut() {
            // Reports came before the step, so they stand before it.
            tick.reports.iter().for_each(|report| log.report(tick.exchange.time, report));
            log.tick(tick)?;
        }
        if let Some(each_second) = self.keep.each_second
            && tick.exchange.time >= self.next_second
        {
            each_second();
            self.next_second = SimTime::from_micros(self.next_second.as_micros() + SECOND_US);
        }
        self.steps += 1;
        Ok(())
    }

    fn landed(&mut self, time: SimTime, plant: &Plant) -> Result<(), Problem> {
        let crash = || plant.crash().map_or(LossBy::Ground, LossBy::Crash);
        let by = plant.broken_by().map_or_else(crash, LossBy::Broken);
        self.loss.get_or_insert(Loss { at_s: time.as_seconds(), by });
        match self.keep.log.as_mut() {
            Some(log) => log.landed(time, plant),
            None => Ok(()),
        }
    }
}

/// The flight log in memory, with the entries that the recorder of the autopilot's process gets.
#[derive(Debug)]
pub struct FlightLog(Encoder<Vec<u8>>);

impl FlightLog {
    /// Begins the log of a flight of the scenario with this name.
    pub fn begin(scenario: &str, setup: &FlightSetup) -> Result<Self, Problem> {
        // There is no link; the seed tells one flight from another.
        let session = session::shown(setup.plant.seed);
        let period_us = setup.plant.period.as_micros();
        let header = ControlHeader::new(setup.settings(), session, period_us, false);
        let begin = Begin { time: SimTime::ZERO, header };
        let mut log = Encoder::begin(Vec::new(), begin, &setup.parameters, LogRate::Events)?;
        let json = serde_json::to_vec(&PlantHeader::new(scenario, &setup.plant))?;
        // In one piece, because no packet has to carry it.
        log.add(Entry::Piece { index: 0, count: 1, bytes: json.into() })?;
        Ok(Self(log))
    }

    /// A control step and its events.
    pub fn tick(&mut self, tick: &Tick<'_>) -> Result<(), Problem> {
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
        if let Some(request) = tick.request {
            let Exchange { time, moment, .. } = tick.exchange;
            self.0.add(Entry::Recorded { time, moment, what: Recorded::Request(*request) })?;
        }
        Ok(())
    }

    /// What the plant reports. A log in memory takes everything; what fails is found at the next tick.
    fn report(&mut self, time: SimTime, report: &PlantReport) {
        if let Some(entry) = Entry::of_report(time, report) {
            let _ = self.0.add(entry);
        }
    }

    /// The aircraft is on the ground.
    fn landed(&mut self, time: SimTime, plant: &Plant) -> Result<(), Problem> {
        let row = plant.truth().to_row(plant.on_ground(), plant.is_broken());
        Ok(self.0.add(Entry::Ground { time, row })?)
    }

    pub fn end(self) -> Result<Vec<u8>, Problem> {
        Ok(self.0.end(End::Stopped)?)
    }
}
