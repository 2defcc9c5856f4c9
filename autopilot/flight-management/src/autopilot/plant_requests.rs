//! Requests to the plant: queued, sent one with each answer, and completed by the plant's reports or, when it falls silent,
//! without them.

use icd::SimTime;
use icd::fault::{FaultReply, FaultState, PlantAction, PlantReport, PlantRequest};
use icd::pace::Pace;

use super::{Autopilot, REQUESTS_MAX};
use crate::command::Outcome;
use crate::event::EventKind;
use crate::script::{LineRefusal, ScriptEvent};
use crate::vehicle::VehicleRefusal;

/// A request to the plant without an answer.
#[derive(Debug, Clone, Copy)]
pub(super) struct OpenRequest {
    pub request: PlantRequest,
    /// The plant has it. One new flight completes all requests for one, so only the first of them is sent.
    pub is_sent: bool,
    pub asker: Asker,
}

/// Who learns the outcome of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asker {
    /// An operator: by the number of the command.
    Operator,
    /// A script: only of a refusal, with the line.
    Line { script: u32, line: u16 },
    /// Another script has begun since.
    Nobody,
}

impl OpenRequest {
    fn is_restart(&self) -> bool {
        self.request.action == PlantAction::Restart
    }
}

impl Autopilot {
    /// Next request for the plant; at most one leaves with each answer.
    pub fn next_request(&mut self) -> Option<PlantRequest> {
        let place = self.open.iter().position(|open| !open.is_sent)?;
        let open = self.open.get_mut(place)?;
        open.is_sent = true;
        let open = *open;
        if open.request.action == PlantAction::ListFaults {
            // The answers are ordinary reports.
            self.open.remove(place);
            self.conclude(&open, Outcome::Done);
        }
        Some(open.request)
    }

    /// Handles a report of the plant.
    pub fn handle_report(&mut self, report: &PlantReport) {
        let (at, kind) = match *report {
            PlantReport::FaultReply { request, reply } => {
                if let Some(open) = self.take_answered(request) {
                    self.conclude(&open, Outcome::Plant(reply));
                }
                return;
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
                if let Some(open) = request.and_then(|number| self.take_answered(number)) {
                    self.conclude(&open, Outcome::Done);
                }
                (at, EventKind::Paced(pace))
            }
        };
        self.events.push(at, kind);
    }

    /// Removes the request with this number that the plant answers; the answer to a restart is the new flight.
    fn take_answered(&mut self, number: u32) -> Option<OpenRequest> {
        let is_it = |open: &OpenRequest| {
            open.is_sent && open.request.number == number && !open.is_restart()
        };
        self.open.iter().position(is_it).and_then(|place| self.open.remove(place))
    }

    /// Publishes the outcome of a request for whoever made it.
    fn conclude(&mut self, open: &OpenRequest, outcome: Outcome) {
        let PlantRequest { number, action } = open.request;
        let at = match outcome {
            Outcome::Plant(FaultReply::Applied { at } | FaultReply::Cleared { at }) => at,
            _ => self.time,
        };
        let kind = match (open.asker, outcome) {
            (Asker::Operator, outcome) => EventKind::Outcome { number, outcome },
            (Asker::Line { script, line }, outcome) => {
                let why = match (outcome, action) {
                    (Outcome::NoAnswer, _) => LineRefusal::NoAnswer,
                    (Outcome::Plant(FaultReply::Refused(refusal)), PlantAction::Fault(request)) => {
                        LineRefusal::Plant { target: request.target(), refusal }
                    }
                    _ => return,
                };
                EventKind::Script { script, event: ScriptEvent::LineRefused { line, why } }
            }
            (Asker::Nobody, _) => return,
        };
        self.events.push(at, kind);
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
        let request = PlantRequest { number, action };
        let mut open = OpenRequest { request, is_sent: false, asker: Asker::Operator };
        if !self.in_flight {
            self.conclude(&open, Outcome::Refused(VehicleRefusal::NoFlight));
        } else if self.has_room_for_request() {
            open.is_sent = open.is_restart() && self.open.iter().any(OpenRequest::is_restart);
            self.open.push_back(open);
        } else {
            self.conclude(&open, Outcome::NoAnswer);
        }
    }

    pub(super) fn has_room_for_request(&self) -> bool {
        self.open.len() < REQUESTS_MAX
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

    /// Ends all requests without an answer, except those for a new flight.
    pub(super) fn abandon_requests(&mut self) {
        while let Some(place) = self.open.iter().position(|open| !open.is_restart())
            && let Some(open) = self.open.remove(place)
        {
            self.conclude(&open, Outcome::NoAnswer);
        }
    }

    /// Ends the requests for a new flight.
    pub(super) fn resolve_restarts(&mut self, outcome: Outcome) {
        while let Some(open) = self.open.pop_front() {
            self.conclude(&open, outcome);
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
