//! Looks at every tick of a flight: measures it, writes its row, and ends it when the aircraft is lost.

use core::ops::ControlFlow;

use autopilot::own_law::OwnLaw;
use flight_control::DesignModel;
use icd::SimTime;
use icd::fault::{PlantReport, PlantRequest};
use plant_sim::{FlightLimits, Plant};

use super::FlyError;
use super::log::FlightLog;
use super::measures::{Measured, Measures};
use super::outcome::{Fate, Loss, LossBy, Outcome};
use crate::closed_loop::{Exchange, FlightSetup, Flown, Operator, Tick, run, settings};
use crate::paper::trace::Sample;
use crate::runner::Progress;
use crate::table::{self, Columns};

/// What goes with a flight beside its setup: what is kept of it, and a law that the program brings.
#[derive(Default)]
pub(super) struct Keep<'a> {
    /// Where the table goes, with its name for messages.
    pub(super) table: Option<&'a mut super::files::Output>,
    /// The flight log.
    pub(super) log: Option<FlightLog>,
    /// Told of each second of simulation time.
    pub(super) progress: Option<&'a Progress>,
    /// What flies where `CTL_LAW` is 9.
    pub(super) own_law: Option<OwnLaw>,
}

/// One second, us.
const SECOND_US: u64 = 1_000_000;

/// Why a flight is ended before its time.
enum Stop {
    Lost,
    Failed(FlyError),
}

/// Flies a setup and says what became of it; ends it with the loss of the aircraft if `stops_at_loss`.
pub(super) fn fly(
    setup: &FlightSetup,
    stops_at_loss: bool,
    keep: Keep<'_>,
) -> Result<(Outcome, Option<FlightLog>), FlyError> {
    let airframe = &setup.plant.airframe;
    let mut judge = Judge {
        model: DesignModel::new(setup.model),
        limits: airframe.limits,
        measures: Measures::new(airframe, setup.plant.period.as_seconds()),
        rows_every: table::ticks_per_row(setup.plant.period) as u64,
        columns: Columns::of(&airframe.effectors),
        line: String::new(),
        steps: 0,
        altitude_m: [f64::NAN; 2],
        loss: None,
        stops_at_loss,
        next_second: SimTime::ZERO,
        keep,
    };
    if let Some(output) = judge.keep.table.as_mut() {
        output.write(judge.columns.header().as_bytes())?;
    }
    let Flown { end, stopped } = run(&setup.plant, &settings(setup), setup.duration, &mut judge)?;
    if let Some(Stop::Failed(error)) = stopped {
        return Err(error);
    }
    let lost_s = judge.loss.map(|loss| loss.at_s);
    let outcome = Outcome {
        seed: setup.plant.seed,
        fate: judge.loss.map_or(Fate::Kept, Fate::Lost),
        end_s: end.time.as_seconds(),
        steps: judge.steps,
        altitude_m: judge.altitude_m,
        metrics: judge.measures.metrics(lost_s),
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
    stops_at_loss: bool,
    /// Simulation time of the next word to the progress.
    next_second: SimTime,
    keep: Keep<'a>,
}

impl Judge<'_> {
    fn look(&mut self, tick: &Tick<'_>) -> Result<(), FlyError> {
        let record = tick.record();
        let sample = Sample::of(&self.model, &record);
        let demand = &tick.snapshot.demand;
        let references = [demand.altitude_m, demand.roll_rad, demand.airspeed_m_s];
        self.measures.tick(&Measured {
            sample: &sample,
            references,
            commands: &record.log.commands,
            positions: &record.truth.positions,
            is_broken: record.truth.fault_codes.iter().any(|(_, code)| *code != 0),
        });
        self.altitude_m = [sample.row.altitude_m, references[0]];
        if self.loss.is_none() {
            let by = self.limits.exceeded(&(&sample.row).into());
            self.loss = by.map(|by| Loss { at_s: sample.row.t_s, by: LossBy::Limit(by) });
        }
        if let Some(output) = self.keep.table.as_mut()
            && self.steps.is_multiple_of(self.rows_every)
        {
            self.line.clear();
            self.columns.push(&mut self.line, &sample.row, &record.truth, &record.log);
            output.write(self.line.as_bytes())?;
        }
        if let Some(log) = self.keep.log.as_mut() {
            log.tick(tick)?;
        }
        if let Some(progress) = self.keep.progress
            && tick.exchange.time >= self.next_second
        {
            progress.one_done();
            self.next_second = SimTime::from_micros(self.next_second.as_micros() + SECOND_US);
        }
        self.steps += 1;
        Ok(())
    }

    fn over(&self) -> ControlFlow<Stop> {
        if self.stops_at_loss && self.loss.is_some() {
            return ControlFlow::Break(Stop::Lost);
        }
        ControlFlow::Continue(())
    }
}

fn until_failed(done: Result<(), FlyError>) -> ControlFlow<Stop> {
    done.map_or_else(|error| ControlFlow::Break(Stop::Failed(error)), ControlFlow::Continue)
}

impl Operator for Judge<'_> {
    type Stop = Stop;

    fn own_law(&self) -> Option<OwnLaw> {
        self.keep.own_law
    }

    fn tick(&mut self, tick: &Tick<'_>) -> ControlFlow<Stop> {
        until_failed(self.look(tick))?;
        self.over()
    }

    fn report(&mut self, exchange: &Exchange, report: &PlantReport) {
        if let Some(log) = self.keep.log.as_mut() {
            log.report(exchange, report);
        }
    }

    fn request(
        &mut self,
        exchange: &Exchange,
        request: Option<&PlantRequest>,
    ) -> ControlFlow<Stop> {
        let (Some(log), Some(request)) = (self.keep.log.as_mut(), request) else {
            return ControlFlow::Continue(());
        };
        until_failed(log.request(exchange, *request))
    }

    fn landed(&mut self, exchange: &Exchange, plant: &Plant) -> ControlFlow<Stop> {
        let by = plant.broken_by().map_or(LossBy::Ground, LossBy::Broken);
        self.loss.get_or_insert(Loss { at_s: exchange.time.as_seconds(), by });
        match self.keep.log.as_mut() {
            Some(log) => until_failed(log.landed(exchange, plant)),
            None => ControlFlow::Continue(()),
        }
    }
}
