//! The composition root of the control side: vehicle, laws and requests to the plant, without I/O.
//!
//! The plant link calls it once a tick; an in-process flight calls it the same way. Intents and their
//! outcomes, events and snapshots are values.

use std::collections::VecDeque;
use std::sync::Arc;

use flight_control::{
    AircraftModel, Authority, FlightControl, Gains, NavigationState, Navigator, StepLog,
};
use icd::fault::{PlantAction, PlantReport, PlantRequest};
use icd::pace::Pace;
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use serde::{Deserialize, Serialize};

use crate::command::{Command, Configuration, Intent, Outcome, ScriptCommand, VehicleCommand};
use crate::event::{Event, EventKind, Snapshot};
use crate::own_law::Brought;
use crate::parameters::{NavigationParameters, ReferenceLimits};
use crate::script::Script;
use crate::termination;
use crate::transitions::Transitions;
use crate::vehicle::plan::Plan;
use crate::vehicle::schedule::ReferenceSchedule;
use crate::vehicle::{Rules, Vehicle, VehicleRefusal};
use event_queue::{EVENTS_MAX, push};
use scripts::Scripts;

mod event_queue;
mod own_law;
mod report_time;
mod scripts;

/// Requests that wait for the plant; one leaves with each control step.
const REQUESTS_MAX: usize = 32;

/// The control side of a flight at its start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The controller's model of the aircraft.
    pub model: AircraftModel,
    /// Validated gains.
    pub gains: Gains,
    /// References that are accepted.
    pub limits: ReferenceLimits,
    /// Guidance.
    pub navigation: NavigationParameters,
    /// Scripts may break the aircraft (`SYS_FAILURE_EN`).
    pub fault_injection: bool,
    /// References by time.
    pub references: ReferenceSchedule,
    /// What begins with each flight.
    pub script: Option<Arc<Script>>,
}

/// The control side of the flight software.
#[derive(Debug)]
pub struct Autopilot {
    model: AircraftModel,
    gains: Gains,
    rules: Rules,
    navigator: Navigator,
    vehicle: Vehicle,
    flight: FlightControl,
    own_law: Option<Brought>,
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
    /// Commands for a new flight: the plant has been asked once for all of them.
    restarts: Vec<u32>,
    scripts: Scripts,
    events: VecDeque<Event>,
    dropped_events: u64,
    /// Of these, the ones that somebody was told of.
    reported_dropped: u64,
}

impl Autopilot {
    /// Waits for a flight.
    #[must_use]
    pub fn new(settings: &Settings) -> Self {
        let Settings { model, gains, limits, navigation, references, script, fault_injection } =
            settings;
        let period = ControlPeriod::DEFAULT;
        Self {
            model: *model,
            gains: *gains,
            rules: Rules::new(*limits, *navigation, gains),
            navigator: Navigator::default(),
            vehicle: Vehicle::new(references.clone()),
            flight: FlightControl::new(period, model, gains),
            own_law: None,
            period,
            in_flight: false,
            on_ground: false,
            time: SimTime::ZERO,
            transitions: Transitions::default(),
            latest: None,
            requests: VecDeque::with_capacity(REQUESTS_MAX),
            unanswered: Vec::with_capacity(REQUESTS_MAX),
            restarts: Vec::with_capacity(REQUESTS_MAX),
            scripts: Scripts::new(script.clone(), *fault_injection),
            events: VecDeque::with_capacity(EVENTS_MAX + 1),
            dropped_events: 0,
            reported_dropped: 0,
        }
    }

    /// A flight begins, or this autopilot comes back into one that is under way: everything that the laws
    /// and the vehicle remember is forgotten. Gains and limits stay.
    pub fn begin_flight(&mut self, period: ControlPeriod, time: SimTime, joined_in_flight: bool) {
        self.navigator = Navigator::default();
        self.flight = FlightControl::new(period, &self.model, &self.gains);
        self.reset_own_law();
        self.period = period;
        self.time = time;
        (self.in_flight, self.on_ground) = (true, false);
        self.vehicle.begin_flight();
        self.transitions = Transitions::default();
        self.latest = None;
        self.abandon_requests();
        self.publish(EventKind::FlightBegan { joined_in_flight });
        self.resolve_restarts(Outcome::Done);
        self.begin_script(joined_in_flight);
    }

    /// One control step: every signal of it, the commands included.
    pub fn step(&mut self, time: SimTime, sensors: &Sensors) -> &StepLog {
        self.time = time;
        self.on_ground = false;
        let state = self.navigator.step(time, sensors);
        self.step_script(&state);
        self.fly(&state)
    }

    /// The vehicle and the laws.
    fn fly(&mut self, state: &NavigationState) -> &StepLog {
        let time = state.time;
        let (events, dropped) = (&mut self.events, &mut self.dropped_events);
        let mut publish = |kind| push(events, dropped, Event { time, kind });
        let command =
            self.vehicle.track(state, &self.rules, &mut |event| publish(EventKind::Vehicle(event)));
        let own = self.own_law.as_mut().map(Brought::law);
        let mut log = self.flight.step_with(state, &command, own);
        if self.vehicle.is_terminated() {
            log.commands = termination::commands(&self.model);
            // The surfaces are at their stops for good.
            log.authority = Authority::NONE;
        } else {
            self.transitions.step(&log, self.period, publish);
        }
        let latest = Snapshot {
            time,
            period: self.period,
            on_ground: false,
            mode: self.vehicle.mode(),
            demand: self.vehicle.demand().copied().unwrap_or(command),
            navigation: self.vehicle.navigation(),
            terminated: self.vehicle.is_terminated(),
            log,
        };
        &self.latest.insert(latest).log
    }

    /// The plant asks without a control step: time stands still. The commands stay as they were; the
    /// snapshot shows what the sensors say now, which is the contact itself when the flight has ended.
    pub fn hold(&mut self, sensors: &Sensors, on_ground: bool) -> Actuators {
        // The navigator remembers nothing of it: how often a plant asks meanwhile is a matter of wall time.
        let state = self.navigator.clone().step(self.time, sensors);
        let actuators = match self.latest.as_mut() {
            Some(snapshot) => {
                snapshot.on_ground = on_ground;
                snapshot.log.state = state;
                // What is chosen in a pause is shown in the pause; it acts when time goes on.
                snapshot.mode = self.vehicle.mode();
                snapshot.demand = self.vehicle.demand().copied().unwrap_or(snapshot.demand);
                snapshot.navigation = self.vehicle.navigation();
                snapshot.terminated = self.vehicle.is_terminated();
                Actuators { commands: snapshot.log.commands }
            }
            // Came in while nothing moves: look once, so that there is something to show and to command.
            None => {
                let actuators = self.fly(&state).actuators();
                if let Some(snapshot) = self.latest.as_mut() {
                    snapshot.on_ground = on_ground;
                }
                self.flight.reset();
                self.reset_own_law();
                actuators
            }
        };
        self.on_ground = on_ground;
        actuators
    }

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
                if !self.was_asked(request) || self.answer_script(request, Some(&reply)) {
                    return;
                }
                let outcome = Outcome::Plant(reply);
                (
                    report_time::of_reply(&reply).unwrap_or(self.time),
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
                (report_time::of_fault(&entry.state, self.time), EventKind::Fault(entry))
            }
            PlantReport::GroundContact { at } => {
                self.on_ground = true;
                self.stop_script();
                (at, EventKind::GroundContact)
            }
            PlantReport::Paced { request, pace, at } => {
                if let Some(number) = request.filter(|number| self.was_asked(*number)) {
                    self.publish(EventKind::Outcome { number, outcome: Outcome::Done });
                }
                (at, EventKind::Paced(pace))
            }
        };
        push(&mut self.events, &mut self.dropped_events, Event { time: at, kind });
    }

    /// Whether the plant owed an answer with this number; it does not any more.
    fn was_asked(&mut self, request: u32) -> bool {
        let place = self.unanswered.iter().position(|number| *number == request);
        if let Some(place) = place {
            self.unanswered.swap_remove(place);
        }
        place.is_some()
    }

    /// Takes a command of an operator. The outcome comes as an event: at once, or when the plant answers.
    pub fn handle_intent(&mut self, intent: Intent) {
        let Intent { number, command } = intent;
        let done = match command {
            Command::Vehicle(command) => self.command_vehicle(command),
            Command::Configuration(change) => {
                self.configure(change);
                Ok(())
            }
            Command::Script(ScriptCommand::Run(script)) => self.start_script(script),
            Command::Script(ScriptCommand::Stop) if self.stop_script() => Ok(()),
            Command::Script(ScriptCommand::Stop) => Err(VehicleRefusal::NoScript),
            Command::Plant(action) => match self.check_action(action) {
                Ok(()) => return self.request(number, action),
                refused => refused,
            },
        };
        let outcome = done.map_or_else(Outcome::Refused, |()| Outcome::Done);
        self.publish(EventKind::Outcome { number, outcome });
    }

    fn configure(&mut self, change: Configuration) {
        match change {
            Configuration::Gains(gains) => {
                self.gains = *gains;
                self.rules.obey(&gains);
                self.flight.set_gains(&gains);
            }
            Configuration::Limits(limits) => self.rules.limits = limits,
            Configuration::Navigation(navigation) => self.rules.navigation = navigation,
            Configuration::FaultInjection(allowed) => self.scripts.may_fail = allowed,
        }
    }

    /// Modes and references mean something only to an aircraft that flies and can be reached.
    fn can_fly(&self) -> Result<(), VehicleRefusal> {
        match (self.in_flight, self.on_ground) {
            (false, _) => Err(VehicleRefusal::NoFlight),
            (true, true) => Err(VehicleRefusal::FlightOver),
            (true, false) => Ok(()),
        }
    }

    /// Refuses a pace that is out of range.
    fn check_action(&self, action: PlantAction) -> Result<(), VehicleRefusal> {
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

    /// Hands a command to the vehicle. A plan is taken in any case; the rest needs an aircraft in the air.
    fn command_vehicle(&mut self, command: VehicleCommand) -> Result<(), VehicleRefusal> {
        if !matches!(command, VehicleCommand::Plan(_) | VehicleCommand::PlanItem(_)) {
            self.can_fly()?;
        }
        let Self { vehicle, rules, events, dropped_events, time, .. } = self;
        let time = *time;
        let publish = &mut |event| {
            push(events, dropped_events, Event { time, kind: EventKind::Vehicle(event) });
        };
        match command {
            VehicleCommand::Mode(mode) => vehicle.change_mode(mode, rules, publish),
            VehicleCommand::Refer(reference) => vehicle.refer(reference, rules),
            VehicleCommand::Reposition(wanted) => vehicle.reposition(&wanted, rules, publish),
            VehicleCommand::Setpoint(setpoint) => vehicle.take_setpoint(setpoint, rules),
            VehicleCommand::Sticks(sticks) => vehicle.take_sticks(sticks),
            VehicleCommand::Plan(plan) => vehicle.replace_plan(&plan, rules, publish),
            VehicleCommand::PlanItem(item) => vehicle.select_item(item, publish),
            VehicleCommand::Continue => vehicle.continue_plan(rules, publish),
            VehicleCommand::Home(place) => vehicle.set_home(place, publish),
            VehicleCommand::Terminate => {
                vehicle.terminate(publish);
                Ok(())
            }
            VehicleCommand::LinkLost(action) => {
                vehicle.lose_link(action, rules, publish);
                Ok(())
            }
            VehicleCommand::LinkBack => {
                vehicle.regain_link(rules, publish);
                Ok(())
            }
        }
    }

    /// Queues a request for the plant, or publishes why it cannot.
    fn request(&mut self, number: u32, action: PlantAction) {
        let outcome = if !self.in_flight {
            Outcome::Refused(VehicleRefusal::NoFlight)
        } else if action == PlantAction::Restart && !self.restarts.is_empty() {
            if self.restarts.len() < REQUESTS_MAX {
                // One new flight is enough for everybody who wants one.
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

    fn has_room_for_request(&self) -> bool {
        self.requests.len() + self.unanswered.len() < REQUESTS_MAX
    }

    /// The plant has been silent for too long: what it was asked is answered in its place.
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

    fn abandon_requests(&mut self) {
        let waiting = self.requests.drain(..).map(|request| request.number);
        let numbers: Vec<u32> = waiting.chain(self.unanswered.drain(..)).collect();
        for number in numbers {
            if !self.restarts.contains(&number) && !self.answer_script(number, None) {
                self.publish(EventKind::Outcome { number, outcome: Outcome::NoAnswer });
            }
        }
    }

    fn resolve_restarts(&mut self, outcome: Outcome) {
        for number in std::mem::take(&mut self.restarts) {
            self.publish(EventKind::Outcome { number, outcome });
        }
    }

    /// Queues an event at the time of the last tick; also one that only the process knows, as that a log was removed.
    pub fn publish(&mut self, kind: EventKind) {
        push(&mut self.events, &mut self.dropped_events, Event { time: self.time, kind });
    }

    /// Oldest event not fetched yet. After the last one, whether any were lost.
    pub fn pop_event(&mut self) -> Option<Event> {
        self.events.pop_front().or_else(|| {
            let lost = self.dropped_events - self.reported_dropped;
            self.reported_dropped = self.dropped_events;
            (lost > 0).then_some(Event { time: self.time, kind: EventKind::EventsLost(lost) })
        })
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

    /// What it is made of now: gains, limits and guidance as operators have set them.
    #[must_use]
    pub fn settings(&self) -> Settings {
        Settings {
            model: self.model,
            gains: self.gains,
            limits: self.rules.limits,
            navigation: self.rules.navigation,
            references: self.vehicle.references().clone(),
            script: self.scripts.of_scenario().cloned(),
            fault_injection: self.scripts.may_fail,
        }
    }

    /// The plan that is loaded; empty if there is none.
    #[must_use]
    pub fn plan(&self) -> Arc<Plan> {
        self.vehicle.plan()
    }

    /// Design model of the laws, for judges of a flight.
    #[must_use]
    pub fn model(&self) -> &AircraftModel {
        &self.model
    }
}

#[cfg(test)]
mod tests;
