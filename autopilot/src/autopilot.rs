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
use crate::vehicle::{Mode, Navigation, Vehicle, VehicleRefusal};

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
    on_ground: bool,
    time: SimTime,
    transitions: Transitions,
    latest: Option<Snapshot>,
    /// Not yet sent to the plant.
    requests: VecDeque<PlantRequest>,
    /// Sent to the plant, not yet answered.
    unanswered: Vec<u32>,
    /// Wishes for a new flight: the plant has been asked once for all of them.
    restarts: Vec<u32>,
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
            on_ground: false,
            time: SimTime::ZERO,
            transitions: Transitions::default(),
            latest: None,
            requests: VecDeque::with_capacity(REQUESTS_MAX),
            unanswered: Vec::with_capacity(REQUESTS_MAX),
            restarts: Vec::with_capacity(REQUESTS_MAX),
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
        self.on_ground = false;
        self.vehicle.begin_flight();
        self.transitions = Transitions::default();
        self.latest = None;
        self.abandon_requests();
        self.tell(EventKind::FlightBegan { joined_in_flight });
        self.resolve_restarts(Outcome::Done);
    }

    /// One control step.
    pub fn step(&mut self, time: SimTime, sensors: &Sensors) -> StepOutput {
        self.time = time;
        self.on_ground = false;
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
            navigation: Navigation::default(),
            terminated: false,
            sensors: *sensors,
            log: output.log,
        });
        output
    }

    /// The plant asks without a control step: time stands still. The commands stay as they were; the
    /// snapshot shows what the sensors say now, which is the contact itself when the flight has ended.
    pub fn hold(&mut self, sensors: &Sensors, on_ground: bool) -> Actuators {
        let actuators = match self.latest.as_mut() {
            Some(snapshot) => {
                snapshot.on_ground = on_ground;
                snapshot.sensors = *sensors;
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
        };
        self.on_ground = on_ground;
        actuators
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
            PlantReport::GroundContact { at } => {
                self.on_ground = true;
                (at, EventKind::GroundContact)
            }
        };
        push(&mut self.events, &mut self.dropped_events, Event { time: at, kind });
    }

    /// Takes what the operator wants. The outcome comes as an event: at once, or when the plant answers.
    pub fn handle_intent(&mut self, intent: Intent) {
        let Intent { number, wish } = intent;
        let done = match wish {
            Wish::Mode(mode) => self.can_fly().map(|()| self.change_mode(mode)),
            Wish::Refer(reference) => {
                self.can_fly().and_then(|()| self.vehicle.refer(reference, &self.limits))
            }
            Wish::Gains(gains) => {
                self.gains = *gains;
                self.flight.set_gains(&gains);
                Ok(())
            }
            Wish::Limits(limits) => {
                self.limits = limits;
                Ok(())
            }
            Wish::Fault(request) => return self.ask_plant(number, PlantAction::Fault(request)),
            Wish::Restart => return self.ask_plant(number, PlantAction::Restart),
            // Interim, replaced by the vehicle's own handling.
            _ => Err(VehicleRefusal::NoFlight),
        };
        let outcome = done.map_or_else(Outcome::Refused, |()| Outcome::Done);
        self.tell(EventKind::Outcome { number, outcome });
    }

    /// Modes and references mean something only to an aircraft that flies and can be reached.
    fn can_fly(&self) -> Result<(), VehicleRefusal> {
        match (self.in_flight, self.on_ground) {
            (false, _) => Err(VehicleRefusal::NoFlight),
            (true, true) => Err(VehicleRefusal::FlightOver),
            (true, false) => Ok(()),
        }
    }

    fn change_mode(&mut self, mode: Mode) {
        let changed = self.vehicle.mode() != mode;
        self.vehicle.set_mode(mode);
        if changed {
            self.tell(EventKind::Mode(mode));
        }
    }

    fn ask_plant(&mut self, number: u32, action: PlantAction) {
        let outcome = if !self.in_flight {
            Outcome::Refused(VehicleRefusal::NoFlight)
        } else if action == PlantAction::Restart && !self.restarts.is_empty() {
            if self.restarts.len() < REQUESTS_MAX {
                // One new flight is enough for everybody who wants one.
                self.restarts.push(number);
                return;
            }
            Outcome::NoAnswer
        } else if self.requests.len() + self.unanswered.len() >= REQUESTS_MAX {
            Outcome::NoAnswer
        } else {
            if action == PlantAction::Restart {
                self.restarts.push(number);
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
        self.resolve_restarts(Outcome::NoAnswer);
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
            if !self.restarts.contains(&number) {
                self.tell(EventKind::Outcome { number, outcome: Outcome::NoAnswer });
            }
        }
    }

    fn resolve_restarts(&mut self, outcome: Outcome) {
        for number in std::mem::take(&mut self.restarts) {
            self.tell(EventKind::Outcome { number, outcome });
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
