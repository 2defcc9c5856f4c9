//! The script of the flight: its lines are executed like commands of operators, at the beginning of a step.

use std::sync::Arc;

use arrayvec::ArrayVec;
use flight_control::NavigationState;
use icd::fault::{FaultReply, FaultRequest, PlantAction, PlantRequest, Target};

use super::{Autopilot, EVENTS_MAX, REQUESTS_MAX};
use crate::command::FIRST_SCRIPT_REQUEST;
use crate::event::EventKind;
use crate::script::{Action, LineRefusal, NotBegun, Run, Script, ScriptEvent};
use crate::vehicle::VehicleRefusal;

/// Open requests of a script to the plant; the rest of the room is for ground stations.
const PENDING_MAX: usize = 8;
const _: () = assert!(PENDING_MAX < REQUESTS_MAX);
/// Lines that are executed in one control step; further due lines follow in the next ones. A line causes up to
/// three events.
const LINES_PER_STEP: usize = 32;
const _: () = assert!(3 * LINES_PER_STEP < EVENTS_MAX);

/// The script of the flight.
#[derive(Debug, Clone)]
pub(super) struct Scripts {
    /// The script that begins with each flight.
    scenario: Option<Arc<Script>>,
    /// Scripts may inject faults (`SYS_FAILURE_EN`).
    pub(super) may_fail: bool,
    running: Option<Run>,
    /// Requests that the plant has not answered.
    pending: ArrayVec<Pending, PENDING_MAX>,
    last_number: u32,
    /// The script that these requests belong to.
    requester: u32,
}

#[derive(Debug, Clone, Copy)]
struct Pending {
    number: u32,
    line: u16,
    /// `None` for all targets.
    target: Option<Target>,
}

impl Scripts {
    pub(super) fn new(scenario: Option<Arc<Script>>, may_fail: bool) -> Self {
        let pending = ArrayVec::new();
        Self {
            scenario,
            may_fail,
            running: None,
            pending,
            last_number: FIRST_SCRIPT_REQUEST,
            requester: 0,
        }
    }

    /// Sets the script that begins with each flight.
    pub(super) fn of_scenario(&self) -> Option<&Arc<Script>> {
        self.scenario.as_ref()
    }

    fn has_room(&self) -> bool {
        !self.pending.is_full()
    }

    /// A number for a request of this line, for this target.
    fn number(&mut self, line: u16, target: Option<Target>) -> u32 {
        self.last_number = self.last_number.wrapping_add(1) | FIRST_SCRIPT_REQUEST;
        self.pending.push(Pending { number: self.last_number, line, target });
        self.last_number
    }
}

impl Autopilot {
    /// Begins a flight: ends the running script and begins the scenario's.
    pub(super) fn begin_script(&mut self, joined_in_flight: bool) {
        self.stop_script();
        self.scripts.pending.clear();
        // A flight does not depend on earlier flights.
        self.scripts.last_number = FIRST_SCRIPT_REQUEST;
        let Some(script) = self.scripts.scenario.clone() else { return };
        let id = script.id();
        if joined_in_flight {
            self.publish_script_event(id, ScriptEvent::NotBegun(NotBegun::JoinedInFlight));
        } else if self.start_script(script).is_err() {
            self.publish_script_event(id, ScriptEvent::NotBegun(NotBegun::FaultInjectionOff));
        }
    }

    /// Runs a script from the next control step on, instead of the running one.
    pub(super) fn start_script(&mut self, script: Arc<Script>) -> Result<(), VehicleRefusal> {
        self.can_fly()?;
        if script.has_faults() && !self.scripts.may_fail {
            return Err(VehicleRefusal::FaultInjectionOff);
        }
        self.stop_script();
        let id = script.id();
        self.scripts.pending.clear();
        self.scripts.requester = id;
        self.scripts.running = Some(Run::new(script));
        self.publish_script_event(id, ScriptEvent::Began);
        Ok(())
    }

    /// Ends the running script, if any, and returns whether there was one.
    pub(super) fn stop_script(&mut self) -> bool {
        let Some(run) = self.scripts.running.take() else { return false };
        self.publish_script_event(run.script().id(), ScriptEvent::Stopped);
        true
    }

    /// Executes the lines that are due at this tick, up to [`LINES_PER_STEP`].
    pub(super) fn step_script(&mut self, state: &NavigationState) {
        let Some(mut run) = self.scripts.running.take() else { return };
        let id = run.script().id();
        self.vehicle.see(state);
        for _ in 0..LINES_PER_STEP {
            let has_room = self.scripts.has_room() && self.has_room_for_request();
            let Some(due) = run.next(state, has_room) else { break };
            self.publish_script_event(id, ScriptEvent::Line(due.line));
            if let Err(refusal) = self.execute(due.line, due.action) {
                let why = LineRefusal::Vehicle(refusal);
                self.publish_script_event(id, ScriptEvent::LineRefused { line: due.line, why });
            }
        }
        // The next line has been evaluated at this tick, even if the limit was reached before it.
        run.look(state);
        if run.is_over() {
            self.publish_script_event(id, ScriptEvent::Done);
        } else {
            self.scripts.running = Some(run);
        }
    }

    fn execute(&mut self, line: u16, action: Action) -> Result<(), VehicleRefusal> {
        let Self { vehicle, rules, events, time, .. } = self;
        match action {
            Action::Fault(request) => self.request_fault(line, request),
            Action::Refer(reference) => vehicle.refer(reference, rules),
            Action::Mode(mode) => {
                let publish = &mut |event| events.push(*time, EventKind::Vehicle(event));
                vehicle.change_mode(mode, rules, publish)
            }
            Action::Say | Action::End => Ok(()),
        }
    }

    fn request_fault(&mut self, line: u16, request: FaultRequest) -> Result<(), VehicleRefusal> {
        if !self.scripts.may_fail {
            return Err(VehicleRefusal::FaultInjectionOff);
        }
        let number = self.scripts.number(line, request.target());
        self.requests.push_back(PlantRequest { number, action: PlantAction::Fault(request) });
        Ok(())
    }

    /// Handles the answer to a request of a script, or `None` if there will be none. False for other requests.
    pub(super) fn answer_script(&mut self, number: u32, reply: Option<&FaultReply>) -> bool {
        if number < FIRST_SCRIPT_REQUEST {
            return false;
        }
        let pending = &mut self.scripts.pending;
        let place = pending.iter().position(|request| request.number == number);
        let Some(place) = place else { return true };
        let Pending { line, target, .. } = pending.swap_remove(place);
        let why = match reply {
            None => LineRefusal::NoAnswer,
            Some(FaultReply::Refused(refusal)) => LineRefusal::Plant { target, refusal: *refusal },
            Some(
                FaultReply::Applied { .. }
                | FaultReply::Unchanged { .. }
                | FaultReply::Scheduled { .. }
                | FaultReply::Cleared { .. },
            ) => return true,
        };
        self.publish_script_event(self.scripts.requester, ScriptEvent::LineRefused { line, why });
        true
    }

    fn publish_script_event(&mut self, script: u32, event: ScriptEvent) {
        self.publish(EventKind::Script { script, event });
    }
}
