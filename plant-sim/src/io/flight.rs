//! One flight after the other: the plant between two packets.

use std::time::{Duration, Instant};

use host_io::tick_log::TickLogWriter;
use host_io::{Stop, clock};
use icd::fault::{PlantAction, PlantReport, PlantRequest};
use icd::wire::{Phase, Reports};
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use serde::{Deserialize, Serialize};
use tracing::{error, info};

use super::link::{Link, LinkError};
use super::pacer::{Pacer, Speed};
use crate::plant::Plant;

/// Where the next tick is farther away than this, the plant asks without a control step meanwhile.
const HOLD_EVERY: Duration = Duration::from_millis(50);
/// Exchanges in which the last reports of a flight may leave: more than the plant can have waiting.
const FAREWELLS_MAX: u32 = 100;

/// What a process that measures wants to know about a flight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FlightReport {
    /// Control ticks.
    pub ticks: u64,
    /// Wall time from the first answer to the end, s.
    pub wall_s: f64,
    /// Simulation time at the end.
    pub time: SimTime,
    /// The aircraft touched the ground.
    pub on_ground: bool,
}

/// Why a flight is over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FlightEnd {
    /// The autopilot asked for a new one.
    Restart,
    /// The process is to end.
    Stop,
    /// It has reached its time, or the ground.
    Complete(FlightReport),
}

/// A flight in progress.
pub(super) struct Flight<'a> {
    pub(super) plant: Plant,
    pub(super) period: ControlPeriod,
    pub(super) until: Option<SimTime>,
    pub(super) link: &'a mut Link,
    pub(super) stop: &'a Stop,
    pub(super) truth_log: &'a mut Option<TickLogWriter>,
    /// Answer to the last request; leaves with the next packet.
    pub(super) reply: Option<PlantReport>,
    /// The last packet had room for more reports, so none waits.
    pub(super) all_told: bool,
    pub(super) ticks: u64,
}

/// What came back from the autopilot.
enum Answer {
    Fly(Actuators),
    End(FlightEnd),
}

impl Flight<'_> {
    /// Flies until something ends it.
    pub(super) fn fly(&mut self, speed: Speed) -> Result<FlightEnd, LinkError> {
        let mut pace: Option<(Pacer, Instant)> = None;
        loop {
            let sensors = self.plant.sense();
            if self.plant.on_ground() {
                let wall = pace.map_or(Duration::ZERO, |(_, began)| clock::now() - began);
                return self.stay_on_ground(&sensors, wall);
            }
            let mut actuators = match self.exchange(Phase::Flying, &sensors)? {
                Answer::Fly(actuators) => actuators,
                Answer::End(end) => return Ok(end),
            };
            self.ticks += 1;
            let (pacer, began) = pace.get_or_insert_with(|| {
                info!(session = %format_args!("{:016x}", self.link.session()), "the flight begins");
                (Pacer::new(speed, self.plant.time()), clock::now())
            });
            let next = self.plant.time() + self.period;
            if self.until.is_some_and(|until| next > until) {
                let wall = clock::now() - *began;
                return self.take_leave(Phase::Holding, &sensors, wall);
            }
            while let Some(left) = pacer.left(next) {
                if left > HOLD_EVERY {
                    match self.exchange(Phase::Holding, &sensors)? {
                        Answer::Fly(held) => actuators = held,
                        Answer::End(end) => return Ok(end),
                    }
                }
                clock::sleep(left.min(HOLD_EVERY));
            }
            self.plant.advance(&actuators);
        }
    }

    /// One question and its answer, and what the answer asks for.
    fn exchange(&mut self, phase: Phase, sensors: &Sensors) -> Result<Answer, LinkError> {
        let mut reports = Reports::new();
        reports.extend(self.reply.take());
        while !reports.is_full()
            && let Some(report) = self.plant.pop_report()
        {
            reports.push(report);
        }
        self.all_told = !reports.is_full();
        self.link.ask(self.plant.time(), phase, self.period, sensors, reports);
        if phase == Phase::Flying {
            // While the autopilot works.
            self.record();
        }
        if self.stop.is_requested() {
            return Ok(Answer::End(FlightEnd::Stop));
        }
        let Some(answer) = self.link.answer()? else { return Ok(Answer::End(FlightEnd::Stop)) };
        match answer.request {
            None => {}
            Some(PlantRequest { action: PlantAction::Restart, .. }) => {
                return Ok(Answer::End(FlightEnd::Restart));
            }
            Some(PlantRequest { number, action: PlantAction::Fault(request) }) => {
                let reply = self.plant.request(&request);
                self.reply = Some(PlantReport::FaultReply { request: number, reply });
            }
        }
        Ok(Answer::Fly(answer.actuators))
    }

    fn record(&mut self) {
        if let Some(log) = self.truth_log.as_mut()
            && let Err(problem) = log.write(&self.plant.truth())
        {
            error!(%problem, "the truth log ends here");
        }
    }

    fn stay_on_ground(
        &mut self,
        sensors: &Sensors,
        wall: Duration,
    ) -> Result<FlightEnd, LinkError> {
        let t_s = self.plant.time().as_seconds();
        info!(t_s, "the aircraft is on the ground; the plant waits for a restart");
        if self.until.is_some() {
            return self.take_leave(Phase::OnGround, sensors, wall);
        }
        loop {
            if let Answer::End(end) = self.exchange(Phase::OnGround, sensors)? {
                return Ok(end);
            }
            if self.all_told && self.reply.is_none() {
                clock::sleep(HOLD_EVERY);
            }
        }
    }

    /// Tells what is left to tell, then ends.
    fn take_leave(
        &mut self,
        phase: Phase,
        sensors: &Sensors,
        wall: Duration,
    ) -> Result<FlightEnd, LinkError> {
        let (time, on_ground) = (self.plant.time(), self.plant.on_ground());
        let report =
            FlightReport { ticks: self.ticks, wall_s: wall.as_secs_f64(), time, on_ground };
        for _ in 0..FAREWELLS_MAX {
            if let Answer::End(end) = self.exchange(phase, sensors)? {
                return Ok(end);
            }
            if self.all_told && self.reply.is_none() {
                break;
            }
        }
        Ok(FlightEnd::Complete(report))
    }
}
