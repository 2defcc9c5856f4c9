//! Requests to the plant: queued, sent one with each answer, answered by the plant's reports or, when it falls silent, in its
//! place.

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
            // The answer is the new flight.
            PlantAction::Restart => {}
            // The answers are reports like any other.
            PlantAction::ListFaults => {
                let outcome = Outcome::Done;
                self.publish(EventKind::Outcome { number: request.number, outcome });
            }
            PlantAction::Fault(_) | PlantAction::Pace(_) => self.unanswered.push(request.number),
        }
        Some(request)
    }

    /// Takes what the plant reports.
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

    /// Whether the plant owed an answer with this number; it does not any more.
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
            // Time has ended for an aircraft on the ground.
            PlantAction::Pace(Pace::Step(_)) => self.can_fly(),
            PlantAction::Pace(Pace::Pause | Pace::Run | Pace::Speed(_))
            | PlantAction::Fault(_)
            | PlantAction::ListFaults
            | PlantAction::Restart => Ok(()),
        }
    }

    /// Queues a request for the plant, or publishes why it cannot.
    pub(super) fn request(&mut self, number: u32, action: PlantAction) {
        let outcome = if !self.in_flight {
            Outcome::Refused(VehicleRefusal::NoFlight)
        } else if action == PlantAction::Restart && !self.restarts.is_empty() {
            if self.restarts.len() < REQUESTS_MAX {
                // One new flight is enough for all who requested one.
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

    /// The plant has been silent and goes on with the same flight.
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

/// When a fault began or ended; `before` is the tick before the report. What is new happened at the tick that comes
/// with the report; what is listed again happened earlier, and what is scheduled will happen.
fn time_of_fault(state: &FaultState, before: SimTime) -> SimTime {
    match state {
        FaultState::Scheduled { .. } => before,
        state => state.time().max(before),
    }
}
