//! Requests to the plant: queued, sent one with each answer, and completed by the plant's reports or, when it falls silent,
//! without them.

use icd::SimTime;
use icd::fault::{FaultReply, FaultState, PlantAction, PlantReport, PlantRequest};
use icd::pace::Pace;

use super::{Autopilot, REQUESTS_MAX};
use crate::command::Outcome;
use crate::event::EventKind;
use crate::vehicle::VehicleRefusal;

impl Autopilot {
    /// Next request for the plant; at most one leaves with each answer.
    pub fn next_request(&mut self) -> Option<PlantRequest> {
        let request = self.requests.pop_front()?;
        match request.action {
            // The new flight is the answer.
            PlantAction::Restart => {}
            // The answers are ordinary reports.
            PlantAction::ListFaults => {
                let outcome = Outcome::Done;
                self.publish(EventKind::Outcome { number: request.number, outcome });
            }
            PlantAction::Fault(_) | PlantAction::Pace(_) => self.unanswered.push(request.number),
        }
        Some(request)
    }

    /// Handles a report of the plant.
    pub fn handle_report(&mut self, report: &PlantReport) {
        let (at, kind) = match *report {
            PlantReport::FaultReply { request, reply } => {
                if !self.take_unanswered(request) || self.answer_script(request, Some(&reply)) {
                    return;
                }
                let outcome = Outcome::Plant(reply);
                (
                    time_of_reply(&reply).unwrap_or(self.time),
                    EventKind::Outcome { number: request, outcome },
                )
            }
            PlantReport::Started { positions } => {
                if self.latest.is_none() {
                    self.flight.start_at(&positions);
                }
                return;
            }
            PlantReport::Fault(entry) => {
                (time_of_fault(&entry.state, self.time), EventKind::Fault(entry))
            }
            PlantReport::GroundContact { at } => {
                self.on_ground = true;
                self.stop_script();
                (at, EventKind::GroundContact)
            }
            PlantReport::Paced { request, pace, at } => {
                if let Some(number) = request.filter(|number| self.take_unanswered(*number)) {
                    self.publish(EventKind::Outcome { number, outcome: Outcome::Done });
                }
                (at, EventKind::Paced(pace))
            }
        };
        self.events.push(at, kind);
    }

    /// Removes an open request with this number; whether there was one.
    fn take_unanswered(&mut self, request: u32) -> bool {
        let place = self.unanswered.iter().position(|number| *number == request);
        if let Some(place) = place {
            self.unanswered.swap_remove(place);
        }
        place.is_some()
    }

    /// Refuses a pace that is out of range.
    pub(super) fn check_action(&self, action: PlantAction) -> Result<(), VehicleRefusal> {
        let refused = |what, unit, value, (min, max)| {
            Err(VehicleRefusal::OutOfRange { what, unit, value, min, max })
        };
        match action {
            PlantAction::Pace(pace @ Pace::Step(periods)) if !pace.is_valid() => {
                let limits = (1.0, f64::from(Pace::STEPS_MAX));
                refused("step", "periods", f64::from(periods), limits)
            }
            PlantAction::Pace(pace @ Pace::Speed(speed)) if !pace.is_valid() => {
                refused("simulation speed", "x real time", speed, Pace::SPEED)
            }
            // For an aircraft on the ground simulation time has ended.
            PlantAction::Pace(Pace::Step(_)) => self.can_fly(),
            PlantAction::Pace(Pace::Pause | Pace::Run | Pace::Speed(_))
            | PlantAction::Fault(_)
            | PlantAction::ListFaults
            | PlantAction::Restart => Ok(()),
        }
    }

    /// Queues a request for the plant, or publishes why it cannot be sent.
    pub(super) fn request(&mut self, number: u32, action: PlantAction) {
        let outcome = if !self.in_flight {
            Outcome::Refused(VehicleRefusal::NoFlight)
        } else if action == PlantAction::Restart && !self.restarts.is_empty() {
            if self.restarts.len() < REQUESTS_MAX {
                // One new flight completes all requests for one.
                self.restarts.push(number);
                return;
            }
            Outcome::NoAnswer
        } else if !self.has_room_for_request() {
            Outcome::NoAnswer
        } else {
            if action == PlantAction::Restart {
                self.restarts.push(number);
            }
            self.requests.push_back(PlantRequest { number, action });
            return;
        };
        self.publish(EventKind::Outcome { number, outcome });
    }

    pub(super) fn has_room_for_request(&self) -> bool {
        self.requests.len() + self.unanswered.len() < REQUESTS_MAX
    }

    /// The plant has been silent for too long: its open requests end without an answer.
    pub fn plant_lost(&mut self) {
        self.in_flight = false;
        self.abandon_requests();
        self.resolve_restarts(Outcome::NoAnswer);
        self.publish(EventKind::PlantLost);
    }

    /// The plant was silent and continues the same flight.
    pub fn plant_back(&mut self) {
        self.in_flight = true;
        self.publish(EventKind::PlantBack);
    }

    pub(super) fn abandon_requests(&mut self) {
        let waiting = self.requests.drain(..).map(|request| request.number);
        let numbers: Vec<u32> = waiting.chain(self.unanswered.drain(..)).collect();
        for number in numbers {
            if !self.restarts.contains(&number) && !self.answer_script(number, None) {
                self.publish(EventKind::Outcome { number, outcome: Outcome::NoAnswer });
            }
        }
    }

    pub(super) fn resolve_restarts(&mut self, outcome: Outcome) {
        for number in std::mem::take(&mut self.restarts) {
            self.publish(EventKind::Outcome { number, outcome });
        }
    }
}

/// When a request took effect, if it did.
fn time_of_reply(reply: &FaultReply) -> Option<SimTime> {
    match *reply {
        FaultReply::Applied { at } | FaultReply::Cleared { at } => Some(at),
        FaultReply::Unchanged { .. } | FaultReply::Scheduled { .. } | FaultReply::Refused(_) => {
            None
        }
    }
}

/// When a fault began or ended; `before` is the tick before the report. A new change happened at the tick that comes
/// with the report; a repeated one happened earlier, and a scheduled one will happen.
fn time_of_fault(state: &FaultState, before: SimTime) -> SimTime {
    match state {
        FaultState::Scheduled { .. } => before,
        state => state.time().max(before),
    }
}
