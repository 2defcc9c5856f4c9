//! The composition root of the control side: vehicle, laws and requests to the plant, without I/O.
//!
//! The plant link calls it once a tick; an in-process flight calls it the same way. Intents and their
//! outcomes, events and snapshots are values.

use std::collections::VecDeque;

use flight_control::{Belief, FlightControl, Gains, StepOutput};
use icd::fault::{FaultReply, PlantAction, PlantReport, PlantRequest};
use icd::{Actuators, ControlPeriod, Sensors, SimTime};

use crate::event::{Event, EventKind, Intent, Outcome, Snapshot, Wish};
use crate::parameters::ReferenceLimits;
use crate::transitions::Transitions;
use crate::vehicle::schedule::ReferenceSchedule;
use crate::vehicle::{Vehicle, VehicleRefusal};

/// Requests that wait for the plant; one leaves with each control step.
const REQUESTS_MAX: usize = 32;
/// Events that wait to be fetched; the oldest that is not an outcome is dropped and counted.
const EVENTS_MAX: usize = 256;

/// What the control side is made of at start.
#[derive(Debug, Clone)]
pub struct Settings {
    /// What the controller believes about the aircraft.
    pub belief: Belief,
    /// Validated gains.
    pub gains: Gains,
    /// References that are accepted.
    pub limits: ReferenceLimits,
    /// References by time.
    pub references: ReferenceSchedule,
}

/// The control side of the flight software.
#[derive(Debug, Clone)]
pub struct Autopilot {
    belief: Belief,
    gains: Gains,
    limits: ReferenceLimits,
    vehicle: Vehicle,
    flight: FlightControl,
    period: ControlPeriod,
    in_flight: bool,
    time: SimTime,
    transitions: Transitions,
    latest: Option<Snapshot>,
    /// Not yet sent to the plant.
    requests: VecDeque<PlantRequest>,
    /// Sent to the plant, not yet answered.
    unanswered: Vec<u32>,
    restart: Option<u32>,
    events: VecDeque<Event>,
    dropped_events: u64,
}

impl Autopilot {
    /// Waits for a flight.
    #[must_use]
    pub fn new(settings: &Settings) -> Self {
        let Settings { belief, gains, limits, references } = settings;
        let period = ControlPeriod::DEFAULT;
        Self {
            belief: *belief,
            gains: *gains,
            limits: *limits,
            vehicle: Vehicle::new(references.clone()),
            flight: FlightControl::new(period, belief, gains),
            period,
            in_flight: false,
            time: SimTime::ZERO,
            transitions: Transitions::default(),
            latest: None,
            requests: VecDeque::with_capacity(REQUESTS_MAX),
            unanswered: Vec::with_capacity(REQUESTS_MAX),
            restart: None,
            events: VecDeque::with_capacity(EVENTS_MAX),
            dropped_events: 0,
        }
    }

    /// A flight begins, or this autopilot comes back into one that is under way: everything that the laws
    /// and the vehicle remember is forgotten. Gains and limits stay.
    pub fn begin_flight(&mut self, period: ControlPeriod, time: SimTime, joined_in_flight: bool) {
        self.flight = FlightControl::new(period, &self.belief, &self.gains);
        self.period = period;
        self.time = time;
        self.in_flight = true;
        self.vehicle.begin_flight();
        self.transitions = Transitions::default();
        self.latest = None;
        self.abandon_requests();
        self.tell(EventKind::FlightBegan { joined_in_flight });
        if let Some(number) = self.restart.take() {
            self.tell(EventKind::Outcome { number, outcome: Outcome::Done });
        }
    }

    /// One control step.
    pub fn step(&mut self, time: SimTime, sensors: &Sensors) -> StepOutput {
        self.time = time;
        let demand = self.vehicle.track(time, sensors);
        let output = self.flight.step(sensors, &demand);
        let (events, dropped) = (&mut self.events, &mut self.dropped_events);
        self.transitions.step(&output.log, &self.gains.activation, self.period, |kind| {
            push(events, dropped, Event { time, kind });
        });
        self.latest = Some(Snapshot {
            time,
            period: self.period,
            on_ground: false,
            mode: self.vehicle.mode(),
            demand,
            sensors: *sensors,
            log: output.log,
        });
        output
    }

    /// The plant asks without a control step: time stands still. The commands stay as they were.
    pub fn hold(&mut self, sensors: &Sensors, on_ground: bool) -> Actuators {
        match self.latest.as_mut() {
            Some(snapshot) => {
                snapshot.on_ground = on_ground;
                Actuators { commands: snapshot.log.commands }
            }
            // Came in while nothing moves: look once, so that there is something to show and to command.
            None => {
                let time = self.time;
                let actuators = self.step(time, sensors).actuators;
                if let Some(snapshot) = self.latest.as_mut() {
                    snapshot.on_ground = on_ground;
                }
                self.flight.reset();
                actuators
            }
        }
    }

    /// Next request for the plant; at most one leaves with each answer.
    pub fn next_request(&mut self) -> Option<PlantRequest> {
        let request = self.requests.pop_front()?;
        if let PlantAction::Fault(_) = request.action {
            self.unanswered.push(request.number);
        }
        Some(request)
    }

    /// Takes what the plant reports.
    pub fn handle_report(&mut self, report: &PlantReport) {
        let (at, kind) = match *report {
            PlantReport::FaultReply { request, reply } => {
                let Some(place) = self.unanswered.iter().position(|number| *number == request)
                else {
                    return;
                };
                self.unanswered.swap_remove(place);
                let outcome = Outcome::Plant(reply);
                (
                    reply_time(&reply).unwrap_or(self.time),
                    EventKind::Outcome { number: request, outcome },
                )
            }
            PlantReport::FaultActs { effector, kind, at } => {
                (at, EventKind::FaultActs { effector, kind })
            }
            PlantReport::FaultEnded { effector, at } => (at, EventKind::FaultEnded { effector }),
            PlantReport::GroundContact { at } => (at, EventKind::GroundContact),
        };
        push(&mut self.events, &mut self.dropped_events, Event { time: at, kind });
    }

    /// Takes what the operator wants. The outcome comes as an event: at once, or when the plant answers.
    pub fn handle_intent(&mut self, intent: Intent) {
        let Intent { number, wish } = intent;
        let outcome = match wish {
            Wish::Mode(mode) => {
                let changed = self.vehicle.mode() != mode;
                self.vehicle.set_mode(mode);
                if changed {
                    self.tell(EventKind::Mode(mode));
                }
                Outcome::Done
            }
            Wish::Refer(reference) => match self.vehicle.refer(reference, &self.limits) {
                Ok(()) => Outcome::Done,
                Err(refusal) => Outcome::Refused(refusal),
            },
            Wish::Gains(gains) => {
                self.gains = *gains;
                self.flight.set_gains(&gains);
                Outcome::Done
            }
            Wish::Limits(limits) => {
                self.limits = limits;
                Outcome::Done
            }
            Wish::Fault(request) => return self.ask_plant(number, PlantAction::Fault(request)),
            Wish::Restart => return self.ask_plant(number, PlantAction::Restart),
        };
        self.tell(EventKind::Outcome { number, outcome });
    }

    fn ask_plant(&mut self, number: u32, action: PlantAction) {
        let outcome = if !self.in_flight {
            Outcome::Refused(VehicleRefusal::NoFlight)
        } else if self.requests.len() + self.unanswered.len() >= REQUESTS_MAX {
            Outcome::NoAnswer
        } else {
            if action == PlantAction::Restart {
                self.restart = Some(number);
            }
            self.requests.push_back(PlantRequest { number, action });
            return;
        };
        self.tell(EventKind::Outcome { number, outcome });
    }

    /// The plant has been silent for too long: what it was asked is answered in its place.
    pub fn plant_lost(&mut self) {
        self.in_flight = false;
        self.abandon_requests();
        if let Some(number) = self.restart.take() {
            self.tell(EventKind::Outcome { number, outcome: Outcome::NoAnswer });
        }
        self.tell(EventKind::PlantLost);
    }

    /// The plant has been silent and goes on with the same flight.
    pub fn plant_back(&mut self) {
        self.in_flight = true;
        self.tell(EventKind::PlantBack);
    }

    fn abandon_requests(&mut self) {
        let waiting = self.requests.drain(..).map(|request| request.number);
        let numbers: Vec<u32> = waiting.chain(self.unanswered.drain(..)).collect();
        for number in numbers {
            if self.restart != Some(number) {
                self.tell(EventKind::Outcome { number, outcome: Outcome::NoAnswer });
            }
        }
    }

    fn tell(&mut self, kind: EventKind) {
        push(&mut self.events, &mut self.dropped_events, Event { time: self.time, kind });
    }

    /// Oldest event not fetched yet.
    pub fn pop_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Events dropped because nobody fetched them.
    #[must_use]
    pub fn dropped_events(&self) -> u64 {
        self.dropped_events
    }

    /// The latest tick, once there was one.
    #[must_use]
    pub fn snapshot(&self) -> Option<&Snapshot> {
        self.latest.as_ref()
    }

    /// Design model of the laws, for judges of a flight.
    #[must_use]
    pub fn belief(&self) -> &Belief {
        &self.belief
    }
}

fn reply_time(reply: &FaultReply) -> Option<SimTime> {
    match *reply {
        FaultReply::Applied { at } | FaultReply::Cleared { at } => Some(at),
        FaultReply::Unchanged { .. } | FaultReply::Scheduled { .. } | FaultReply::Refused(_) => {
            None
        }
    }
}

/// Outcomes are promises to somebody who waits, so they push out anything else first.
fn push(events: &mut VecDeque<Event>, dropped: &mut u64, event: Event) {
    if events.len() >= EVENTS_MAX {
        let victim = events
            .iter()
            .position(|event| !matches!(event.kind, EventKind::Outcome { .. }))
            .unwrap_or(0);
        events.remove(victim);
        *dropped += 1;
    }
    events.push_back(event);
}

#[cfg(test)]
mod tests;
