//! Flights one after the other: the plant between two packets.

use std::time::{Duration, Instant};

use host_io::problem::Problem;
use host_io::tick_log::TickLogWriter;
use host_io::{Stop, clock};
use icd::fault::{PlantAction, PlantReport, PlantRequest};
use icd::wire::{Phase, Reports};
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use serde::{Deserialize, Serialize};
use tracing::{error, info};

use super::header::Envelopes;
use super::link::Link;
use super::pacer::{Due, PaceRequest, Pacer, Parent};
use crate::plant::Plant;

/// If the next tick is due later than this, the plant exchanges packets without a control step meanwhile.
const HOLD_EVERY: Duration = Duration::from_millis(50);
/// Most exchanges for the last reports of a flight: more than the plant can have waiting.
const LAST_EXCHANGES_MAX: u32 = 100;

/// Summary of a flight, for a process that measures.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FlightReport {
    pub ticks: u64,
    /// Wall time from the first answer to the end, s.
    pub wall_s: f64,
    /// Simulation time at the end.
    pub time: SimTime,
    /// The aircraft touched the ground.
    pub on_ground: bool,
}

/// Why a flight has ended.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum FlightEnd {
    /// The autopilot requested a restart.
    Restart,
    /// The process has to end.
    Stop,
    /// The flight has reached its end time, or the ground.
    Complete(FlightReport),
    Failed(Problem),
}

impl From<Problem> for FlightEnd {
    fn from(problem: Problem) -> Self {
        Self::Failed(problem)
    }
}

/// A flight in progress.
pub(super) struct Flight<'a> {
    pub(super) plant: Plant,
    pub(super) period: ControlPeriod,
    pub(super) until: Option<SimTime>,
    /// The flight ends on the ground instead of waiting for a restart.
    pub(super) ends_on_ground: bool,
    /// Name of the airframe file, for messages.
    pub(super) airframe: &'a str,
    pub(super) link: &'a mut Link,
    pub(super) stop: &'a Stop,
    pub(super) truth_log: &'a mut Option<TickLogWriter>,
    pub(super) envelopes: &'a mut Envelopes,
    pub(super) pacer: &'a mut Pacer,
    pub(super) parent: &'a Parent,
    /// Reply to the last request; the next packet carries it.
    pub(super) reply: Option<PlantReport>,
    /// The last packet had room for more reports, so none is waiting.
    pub(super) all_reported: bool,
    /// The last answer carried a request, so more may follow.
    pub(super) had_request: bool,
    pub(super) ticks: u64,
}

impl Flight<'_> {
    /// Flies until the flight ends.
    pub(super) fn fly(&mut self) -> FlightEnd {
        self.fly_on().unwrap_or_else(|end| end)
    }

    fn fly_on(&mut self) -> Result<FlightEnd, FlightEnd> {
        let mut began: Option<Instant> = None;
        loop {
            let sensors = self.plant.sense();
            if self.plant.on_ground() {
                let wall = began.map_or(Duration::ZERO, |began| clock::now() - began);
                return self.stay_on_ground(&sensors, wall);
            }
            let actuators = self.exchange(Phase::Flying, &sensors)?;
            self.ticks += 1;
            let began = *began.get_or_insert_with(|| {
                info!(session = %self.link.session(), "the flight begins");
                clock::now()
            });
            // After the exchange, so that the last tick is in the logs of both sides.
            let next = self.plant.time() + self.period;
            if self.until.is_some_and(|until| next > until) {
                let wall = clock::now() - began;
                info!(t_s = self.plant.time().as_seconds(), "the flight is complete");
                return self.finish(Phase::Holding, &sensors, wall);
            }
            let actuators = self.wait_until_due(next, &sensors, actuators)?;
            self.plant.advance(&actuators);
            self.pacer.advanced(self.plant.time());
        }
    }

    /// Waits until the tick at `next` is due; returns the commands that apply until then.
    fn wait_until_due(
        &mut self,
        next: SimTime,
        sensors: &Sensors,
        mut actuators: Actuators,
    ) -> Result<Actuators, FlightEnd> {
        loop {
            self.parent.update(self.pacer, self.plant.time());
            let left = match self.pacer.due(self.plant.time(), next, clock::now) {
                Due::Now => return Ok(actuators),
                Due::In(left) => left,
                Due::Never => Duration::MAX,
            };
            if left > HOLD_EVERY {
                actuators = self.exchange(Phase::Holding, sensors)?;
                // Somebody waits for the reports, and more requests may follow at once.
                if self.had_request || self.has_reports() {
                    continue;
                }
            }
            clock::sleep(left.min(HOLD_EVERY));
        }
    }

    /// Whether reports wait for the next packet.
    fn has_reports(&self) -> bool {
        self.reply.is_some() || self.pacer.has_reports() || !self.all_reported
    }

    /// Sends one packet, waits for the answer and executes its request.
    fn exchange(&mut self, phase: Phase, sensors: &Sensors) -> Result<Actuators, FlightEnd> {
        let mut reports = Reports::new();
        // The reply first, since it must find room.
        reports.extend(self.reply.take());
        while !reports.is_full()
            && let Some(report) = self.pacer.pop_report().or_else(|| self.plant.pop_report())
        {
            reports.push(report);
        }
        // A full packet may have left some behind; the next one shows whether it has.
        self.all_reported = !reports.is_full();
        let plant = &self.plant;
        let truth = || plant.truth().to_row(plant.on_ground(), plant.is_broken());
        let envelope = self.envelopes.next(truth);
        self.link.begin_exchange(plant.time(), phase, self.period, sensors, reports, envelope);
        if phase == Phase::Flying {
            // While the autopilot works.
            if let Some(log) = self.truth_log.as_mut()
                && let Err(problem) = log.write(self.plant.truth())
            {
                error!(%problem, "the truth log ends here");
            }
        }
        if self.stop.is_requested() {
            return Err(FlightEnd::Stop);
        }
        let answer = self.link.answer()?.ok_or(FlightEnd::Stop)?;
        self.had_request = answer.request.is_some();
        self.envelopes.set_recorded(answer.wants_envelope);
        match answer.request {
            None => {}
            Some(PlantRequest { action: PlantAction::Restart, .. }) => {
                // The new session is the answer.
                return Err(FlightEnd::Restart);
            }
            Some(PlantRequest { action: PlantAction::ListFaults, .. }) => self.plant.list_faults(),
            Some(PlantRequest { number, action: PlantAction::Fault(request) }) => {
                let reply = self.plant.request(&request);
                self.reply = Some(PlantReport::FaultReply { request: number, reply });
            }
            Some(PlantRequest { number, action: PlantAction::Pace(pace) }) => {
                self.pacer.request(PaceRequest { request: Some(number), pace }, self.plant.time());
            }
        }
        Ok(answer.actuators)
    }

    fn stay_on_ground(
        &mut self,
        sensors: &Sensors,
        wall: Duration,
    ) -> Result<FlightEnd, FlightEnd> {
        let t_s = self.plant.time().as_seconds();
        match (self.plant.broken_by(), self.plant.crash()) {
            (None, None) => {
                info!(t_s, "the aircraft is on the ground; the plant waits for a restart");
            }
            (None, Some(crash)) => info!(t_s, %crash, "crash; the plant waits for a restart"),
            (Some(quantity), _) => error!(
                t_s,
                quantity,
                airframe = self.airframe,
                "the flight is over: this quantity is beyond all bounds; the likely cause are the numbers of the airframe file"
            ),
        }
        if self.ends_on_ground {
            return self.finish(Phase::OnGround, sensors, wall);
        }
        loop {
            self.parent.update(self.pacer, self.plant.time());
            self.pacer.end(self.plant.time());
            self.exchange(Phase::OnGround, sensors)?;
            if !self.had_request && !self.has_reports() {
                clock::sleep(HOLD_EVERY);
            }
        }
    }

    /// Sends the remaining reports, then ends.
    fn finish(
        &mut self,
        phase: Phase,
        sensors: &Sensors,
        wall: Duration,
    ) -> Result<FlightEnd, FlightEnd> {
        let (time, on_ground) = (self.plant.time(), self.plant.on_ground());
        let report =
            FlightReport { ticks: self.ticks, wall_s: wall.as_secs_f64(), time, on_ground };
        self.pacer.end(time);
        for _ in 0..LAST_EXCHANGES_MAX {
            self.exchange(phase, sensors)?;
            if !self.has_reports() {
                break;
            }
        }
        Ok(FlightEnd::Complete(report))
    }
}
