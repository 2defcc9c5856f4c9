//! The script of the flight: its lines are executed like commands of operators, at the beginning of a step.

use std::sync::Arc;

use flight_control::NavigationState;
use icd::fault::{FaultRequest, PlantAction, PlantRequest};

use super::plant_requests::{Asker, OpenRequest};
use super::{Autopilot, EVENTS_MAX, REQUESTS_MAX};
use crate::command::FIRST_SCRIPT_REQUEST;
use crate::event::EventKind;
use crate::script::{Action, LineRefusal, NotBegun, Run, Script, ScriptEvent};
use crate::vehicle::VehicleRefusal;

/// Open requests of a script to the plant; the rest of the room is for ground stations.
const OPEN_MAX: usize = 8;
const _: () = assert!(OPEN_MAX < REQUESTS_MAX);
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
    last_number: u32,
}

impl Scripts {
    pub(super) fn new(scenario: Option<Arc<Script>>, may_fail: bool) -> Self {
        Self { scenario, may_fail, running: None, last_number: FIRST_SCRIPT_REQUEST }
    }

    /// Sets the script that begins with each flight.
    pub(super) fn of_scenario(&self) -> Option<&Arc<Script>> {
        self.scenario.as_ref()
    }
}

impl Autopilot {
    /// Begins a flight: ends the running script and begins the scenario's.
    pub(super) fn begin_script(&mut self, joined_in_flight: bool) {
        self.stop_script();
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
        for open in self.open.iter_mut().filter(|open| open.asker != Asker::Operator) {
            open.asker = Asker::Nobody;
        }
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
            let of_scripts = |open: &&OpenRequest| matches!(open.asker, Asker::Line { .. });
            let has_room = self.open.iter().filter(of_scripts).count() < OPEN_MAX
                && self.has_room_for_request();
            let Some(due) = run.next(state, has_room) else { break };
            self.publish_script_event(id, ScriptEvent::Line(due.line));
            let asker = Asker::Line { script: id, line: due.line };
            if let Err(refusal) = self.execute(asker, due.action) {
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

    fn execute(&mut self, asker: Asker, action: Action) -> Result<(), VehicleRefusal> {
        let Self { vehicle, rules, events, time, .. } = self;
        match action {
            Action::Fault(request) => self.request_fault(asker, request),
            Action::Refer(reference) => vehicle.refer(reference, rules),
            Action::Mode(mode) => {
                let publish = &mut |event| events.push(*time, EventKind::Vehicle(event));
                vehicle.change_mode(mode, rules, publish)
            }
            Action::Say | Action::End => Ok(()),
        }
    }

    fn request_fault(&mut self, asker: Asker, request: FaultRequest) -> Result<(), VehicleRefusal> {
        if !self.scripts.may_fail {
            return Err(VehicleRefusal::FaultInjectionOff);
        }
        let number = self.scripts.last_number.wrapping_add(1) | FIRST_SCRIPT_REQUEST;
        self.scripts.last_number = number;
        let request = PlantRequest { number, action: PlantAction::Fault(request) };
        self.open.push_back(OpenRequest { request, is_sent: false, asker });
        Ok(())
    }

    fn publish_script_event(&mut self, script: u32, event: ScriptEvent) {
        self.publish(EventKind::Script { script, event });
    }
}
