//! The composition root of the control side: vehicle, laws and requests to the plant, without I/O.
//!
//! The plant link calls it once a tick; an in-process flight calls it the same way. Intents and their
//! outcomes, events and snapshots are values.

use std::collections::VecDeque;
use std::sync::Arc;

use flight_control::{
    AircraftModel, Authority, Estimator, FlightControl, Gains, NavigationSource, NavigationState,
    StepLog, Visitor,
};
use icd::fault::{FaultReply, FaultRequest, FaultState, PlantAction, PlantReport, PlantRequest};
use icd::pace::Pace;
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use serde::{Deserialize, Serialize};

use crate::command::{
    Command, Configuration, FIRST_SCRIPT_REQUEST, Intent, Outcome, ScriptCommand, VehicleCommand,
};
use crate::event::{Event, EventKind, Snapshot, Transitions};
use crate::own_law::{Brought, FlightLaw, OwnLaw};
use crate::parameters::{NavigationParameters, ReferenceLimits};
use crate::script::{Action, LineRefusal, NotBegun, Run, Script, ScriptEvent};
use crate::termination;
use crate::vehicle::failsafe::Powerplant;
use crate::vehicle::plan::Plan;
use crate::vehicle::rules::within;
use crate::vehicle::schedule::ReferenceSchedule;
use crate::vehicle::{Rules, Vehicle, VehicleRefusal};

/// Requests to the plant that may be open.
const REQUESTS_MAX: usize = 32;
/// Open requests of a script to the plant; the rest of the room is for ground stations.
const OPEN_MAX: usize = 8;
const _: () = assert!(OPEN_MAX < REQUESTS_MAX);
/// Lines that are executed in one control step; further due lines follow in the next ones. A line causes up to
/// three events.
const LINES_PER_STEP: usize = 32;
/// Events that wait to be fetched; the queue drops the oldest of the least important kind and reports how many.
const EVENTS_MAX: usize = 256;
const _: () = assert!(3 * LINES_PER_STEP < EVENTS_MAX);

/// The control side of a flight at its start. Flight logs have it in this order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The controller's model of the aircraft.
    pub model: AircraftModel,
    pub gains: Gains,
    pub limits: ReferenceLimits,
    pub navigation: NavigationParameters,
    pub references: ReferenceSchedule,
    /// The script that begins with each flight.
    pub script: Option<Arc<Script>>,
    /// Scripts may break the aircraft (`SYS_FAILURE_EN`).
    pub fault_injection: bool,
    /// The law of the program that flies where `CTL_LAW` is 9. A file of settings has none.
    #[serde(skip)]
    pub own_law: Option<OwnLaw>,
}

/// The control side of the flight software.
///
/// A copy continues as the original would, with one exception: a law that cannot be copied starts anew in it
/// ([`FlightLaw::copy`]).
#[derive(Debug, Clone)]
pub struct Autopilot {
    model: AircraftModel,
    gains: Gains,
    rules: Rules,
    navigation: NavigationSource,
    vehicle: Vehicle,
    flight: FlightControl,
    own_law: Option<Brought>,
    period: ControlPeriod,
    in_flight: bool,
    on_ground: bool,
    time: SimTime,
    transitions: Transitions,
    latest: Option<Snapshot>,
    /// Requests to the plant without an answer, oldest first.
    open: VecDeque<OpenRequest>,
    scripts: ScriptState,
    events: EventQueue,
}

impl Autopilot {
    /// Waits for a flight.
    pub fn new(settings: &Settings) -> Self {
        let Settings { model, gains, limits, navigation, references, script, .. } = settings;
        let period = ControlPeriod::DEFAULT;
        Self {
            model: *model,
            gains: *gains,
            rules: Rules::new(*limits, *navigation, gains).of_model(model),
            navigation: NavigationSource::new(model, gains),
            vehicle: Vehicle::new(references.clone()),
            flight: FlightControl::new(period, model, gains),
            own_law: settings.own_law.clone().map(Brought::new),
            period,
            in_flight: false,
            on_ground: false,
            time: SimTime::ZERO,
            transitions: Transitions::default(),
            latest: None,
            open: VecDeque::with_capacity(REQUESTS_MAX),
            scripts: ScriptState {
                scenario: script.clone(),
                may_fail: settings.fault_injection,
                running: None,
                last_number: FIRST_SCRIPT_REQUEST,
            },
            events: EventQueue { events: VecDeque::with_capacity(EVENTS_MAX + 1), lost: 0 },
        }
    }

    /// Begins a flight, or joins one that is in progress: resets the state of the laws
    /// and the vehicle. Gains and limits stay.
    pub fn begin_flight(&mut self, period: ControlPeriod, time: SimTime, joined_in_flight: bool) {
        self.navigation = NavigationSource::new(&self.model, &self.gains);
        self.flight = FlightControl::new(period, &self.model, &self.gains);
        self.reset_own_law();
        self.period = period;
        self.time = time;
        (self.in_flight, self.on_ground) = (true, false);
        self.rules = self.rules.over(0.0);
        self.vehicle.begin_flight();
        self.transitions = Transitions::default();
        self.latest = None;
        // In this order: outcomes of the old flight, the new flight, and then whoever asked for it.
        self.abandon_requests();
        self.publish(EventKind::FlightBegan { joined_in_flight });
        self.resolve_restarts(Outcome::Done);
        self.begin_script(joined_in_flight);
    }

    /// For a flight of which only commands and truth are looked at: what the laws only report is left out of this flight.
    pub fn skip_unread_verdict(&mut self) {
        self.flight.skip_unread_verdict();
    }

    /// One control step: all its signals, including the commands.
    pub fn step(&mut self, time: SimTime, sensors: &Sensors) -> &StepLog {
        self.time = time;
        self.on_ground = false;
        // First, so that script, vehicle and laws see one state of one tick
        // (docs/decisions/115-navigation-state.md).
        let state = self.navigation.step(time, sensors);
        // Where it stands is the ground of the flight.
        if let (true, true, Some(height_m)) =
            (state.on_wheels, state.valid.altitude, state.height_above_ground_m)
            && !self.vehicle.is_armed()
        {
            self.rules = self.rules.over(state.altitude_m - height_m);
        }
        // Before the vehicle: a reference is flown in the step in which its line is due.
        self.step_script(&state);
        self.fly(&state, sensors)
    }

    /// The vehicle and the laws.
    fn fly(&mut self, state: &NavigationState, sensors: &Sensors) -> &StepLog {
        let time = state.time;
        let events = &mut self.events;
        let mut publish = |kind| events.push(time, kind);
        let engine = self.flight.model().engine();
        let last = self.latest.as_ref().map(|latest| &latest.log.commands);
        let gauge = &sensors.fuel_gauge_pct;
        let propulsion = Powerplant {
            commanded_n: engine.zip(last).map_or(0.0, |(engine, commands)| commands[engine]),
            fuel_pct: gauge.valid.then_some(gauge.value),
        };
        let command = self.vehicle.track(state, &self.rules, &propulsion, &mut |event| {
            publish(EventKind::Vehicle(event));
        });
        let own = self.own_law.as_mut().map(Brought::law_mut);
        let ground = self.vehicle.ground_demand(state, &self.rules);
        let log = self.flight.step_with(state, &command, &ground, own);
        let (mode, navigation) = (self.vehicle.mode(), self.vehicle.navigation());
        let is_armed = self.vehicle.is_armed();
        // Telemetry shows the reference; the log has what the laws were given for it.
        let demand = self.vehicle.demand().copied().unwrap_or(command);
        let (period, terminated) = (self.period, self.vehicle.is_terminated());
        let latest = match &mut self.latest {
            // Field by field: a whole snapshot would be copied once more.
            Some(latest) => {
                (latest.sensors, latest.log) = (*sensors, log);
                (latest.time, latest.period, latest.on_ground) = (time, period, false);
                (latest.mode, latest.demand, latest.navigation) = (mode, demand, navigation);
                (latest.terminated, latest.is_armed) = (terminated, is_armed);
                latest
            }
            latest => latest.insert(Snapshot {
                time,
                period,
                on_ground: false,
                mode,
                demand,
                navigation,
                terminated,
                is_armed,
                sensors: *sensors,
                log,
            }),
        };
        let log = &mut latest.log;
        if latest.terminated {
            log.commands = termination::commands(&self.model);
            // The surfaces stay at their stops.
            log.authority = Authority::NONE;
        } else {
            self.transitions.step(log, &state.alive(sensors), self.period, publish);
        }
        log
    }

    /// Handles a packet without a control step: the simulation is paused. The commands stay unchanged; the
    /// snapshot shows the present sensors, which is the state at ground contact when the flight has ended.
    pub fn hold(&mut self, sensors: &Sensors, on_ground: bool) -> Actuators {
        // Only a look: how many there are in a pause depends on wall time, which must not change the flight.
        let state = self.navigation.look(self.time, sensors);
        let actuators = match self.latest.as_mut() {
            Some(snapshot) => {
                snapshot.on_ground = on_ground;
                (snapshot.sensors, snapshot.log.state) = (*sensors, state);
                // A mode selected in a pause is shown in the pause; it acts when time continues.
                snapshot.mode = self.vehicle.mode();
                snapshot.demand = self.vehicle.demand().copied().unwrap_or(snapshot.demand);
                snapshot.navigation = self.vehicle.navigation();
                snapshot.terminated = self.vehicle.is_terminated();
                snapshot.is_armed = self.vehicle.is_armed();
                snapshot.log.actuators()
            }
            // Joined while paused: step the vehicle once, so that there is a state to show and to command.
            None => {
                let actuators = self.fly(&state, sensors).actuators();
                if let Some(snapshot) = self.latest.as_mut() {
                    snapshot.on_ground = on_ground;
                }
                // The step was for the display. The flight begins with its first tick.
                self.flight.reset();
                self.reset_own_law();
                actuators
            }
        };
        self.on_ground = on_ground;
        actuators
    }

    /// Executes a command of an operator. The outcome follows as an event: at once, or when the plant answers.
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
                self.rules.altitude = gains.altitude_response();
                self.flight.set_gains(&gains);
                self.navigation.set_gains(&gains);
            }
            Configuration::Limits(limits) => {
                let ground_m = core::mem::take(&mut self.rules.ground_m);
                self.rules.limits = limits;
                self.rules = self.rules.over(ground_m);
            }
            Configuration::Navigation(navigation) => self.rules.navigation = navigation,
            Configuration::FaultInjection(allowed) => self.scripts.may_fail = allowed,
        }
    }

    /// Whether a command needs an aircraft that flies and can be reached, as modes and references do.
    fn can_fly(&self) -> Result<(), VehicleRefusal> {
        match (self.in_flight, self.on_ground) {
            (false, _) => Err(VehicleRefusal::NoFlight),
            (true, true) => Err(VehicleRefusal::FlightOver),
            (true, false) => Ok(()),
        }
    }

    /// Passes a command to the vehicle. A list is accepted in any case; the rest needs an aircraft in the air.
    fn command_vehicle(&mut self, command: VehicleCommand) -> Result<(), VehicleRefusal> {
        let is_list = matches!(
            command,
            VehicleCommand::Plan(_)
                | VehicleCommand::PlanItem(_)
                | VehicleCommand::Fence(_)
                | VehicleCommand::Rally(_)
                | VehicleCommand::EnableFence(_)
        );
        if !is_list {
            self.can_fly()?;
        }
        let Self { vehicle, rules, events, time, .. } = self;
        let publish = &mut |event| events.push(*time, EventKind::Vehicle(event));
        match command {
            VehicleCommand::Mode(mode) => vehicle.change_mode(mode, rules, publish),
            VehicleCommand::Refer(reference) => vehicle.refer(reference, rules),
            VehicleCommand::Reposition(request) => vehicle.reposition(&request, rules, publish),
            VehicleCommand::Setpoint(setpoint) => vehicle.take_setpoint(setpoint, rules),
            VehicleCommand::Sticks(sticks) => vehicle.take_sticks(sticks),
            VehicleCommand::Plan(plan) => vehicle.replace_plan(&plan, rules, publish),
            VehicleCommand::PlanItem(item) => vehicle.select_item(item, publish),
            VehicleCommand::Continue => vehicle.continue_plan(rules, publish),
            VehicleCommand::Fence(fence) => {
                vehicle.replace_fence(&fence);
                Ok(())
            }
            VehicleCommand::Rally(points) => vehicle.replace_rally(&points),
            VehicleCommand::EnableFence(enabled) => {
                vehicle.enable_fence(enabled);
                Ok(())
            }
            VehicleCommand::Land => vehicle.land(rules, publish),
            VehicleCommand::GoAround(altitude_m) => vehicle.go_around(altitude_m, rules),
            VehicleCommand::Arm(armed) => vehicle.arm(armed, publish),
            VehicleCommand::TakeOff(altitude_m) => vehicle.take_off(altitude_m, rules, publish),
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

    /// Queues an event at the time of the last tick; also for events of the process, such as the removal of a log.
    pub fn publish(&mut self, kind: EventKind) {
        self.events.push(self.time, kind);
    }

    /// Oldest event not fetched yet. After the last one, the number of lost events, if any.
    pub fn pop_event(&mut self) -> Option<Event> {
        self.events.pop(self.time)
    }

    /// The latest tick, if any.
    pub fn snapshot(&self) -> Option<&Snapshot> {
        self.latest.as_ref()
    }

    /// The estimator, where the navigation state of this flight comes from it.
    pub fn estimator(&self) -> Option<&Estimator> {
        self.navigation.estimator()
    }

    /// The law that the program brought, as it is in this flight.
    pub fn own_law(&self) -> Option<&dyn FlightLaw> {
        self.own_law.as_ref().map(Brought::law)
    }

    /// Shows every continuous state of the laws, for a linearisation.
    pub fn law_states(&mut self, visit: &mut Visitor<'_>) {
        self.flight.states(visit);
        if let Some(own) = &mut self.own_law {
            own.law_mut().states(visit);
        }
    }

    /// Creates the law again.
    fn reset_own_law(&mut self) {
        if let Some(brought) = &mut self.own_law {
            brought.renew();
        }
    }

    /// The present settings: gains, limits and guidance as operators have set them.
    pub fn settings(&self) -> Settings {
        Settings {
            model: self.model,
            gains: self.gains,
            limits: self.rules.limits,
            navigation: self.rules.navigation,
            references: self.vehicle.references().clone(),
            script: self.scripts.scenario.clone(),
            own_law: self.own_law.as_ref().map(|brought| brought.own.clone()),
            fault_injection: self.scripts.may_fail,
        }
    }

    /// The loaded plan; empty if there is none.
    pub fn plan(&self) -> Arc<Plan> {
        self.vehicle.plan()
    }

    /// Design model of the laws, for the assessment of a flight.
    pub fn model(&self) -> &AircraftModel {
        &self.model
    }

    /// The gains that fly.
    pub fn gains(&self) -> &Gains {
        &self.gains
    }

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
                // Later the modelled servos are under way, and a repeated report must not move them.
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
                let events = &mut self.events;
                self.vehicle.touch_down(&mut |event| events.push(at, EventKind::Vehicle(event)));
                (at, EventKind::GroundContact)
            }
            PlantReport::Paced { request, pace, at } => {
                // The launcher changes the pace without a request, too.
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
    fn check_action(&self, action: PlantAction) -> Result<(), VehicleRefusal> {
        match action {
            PlantAction::Pace(pace @ Pace::Step(periods)) if !pace.is_valid() => {
                within("step", "periods", f64::from(periods), (1.0, f64::from(Pace::STEPS_MAX)))
            }
            PlantAction::Pace(pace @ Pace::Speed(speed)) if !pace.is_valid() => {
                within("simulation speed", "x real time", speed, Pace::SPEED)
            }
            // For an aircraft on the ground simulation time has ended.
            PlantAction::Pace(Pace::Step(_)) => self.can_fly(),
            _ => Ok(()),
        }
    }

    /// Queues a request for the plant, or publishes why it cannot be sent.
    fn request(&mut self, number: u32, action: PlantAction) {
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

    fn has_room_for_request(&self) -> bool {
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
    fn abandon_requests(&mut self) {
        while let Some(place) = self.open.iter().position(|open| !open.is_restart())
            && let Some(open) = self.open.remove(place)
        {
            self.conclude(&open, Outcome::NoAnswer);
        }
    }

    /// Ends the requests for a new flight.
    fn resolve_restarts(&mut self, outcome: Outcome) {
        while let Some(open) = self.open.pop_front() {
            self.conclude(&open, outcome);
        }
    }

    /// Begins a flight: ends the running script and begins the scenario's.
    fn begin_script(&mut self, joined_in_flight: bool) {
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
    fn start_script(&mut self, script: Arc<Script>) -> Result<(), VehicleRefusal> {
        self.can_fly()?;
        if script.has_faults() && !self.scripts.may_fail {
            return Err(VehicleRefusal::FaultInjectionOff);
        }
        // Only now: a script that is refused does not end the running one.
        self.stop_script();
        let id = script.id();
        // The answers would be told as those of lines of the new script.
        for open in self.open.iter_mut().filter(|open| open.asker != Asker::Operator) {
            open.asker = Asker::Nobody;
        }
        self.scripts.running = Some(Run::new(script));
        self.publish_script_event(id, ScriptEvent::Began);
        Ok(())
    }

    /// Ends the running script, if any, and returns whether there was one.
    fn stop_script(&mut self) -> bool {
        let Some(run) = self.scripts.running.take() else { return false };
        self.publish_script_event(run.script().id(), ScriptEvent::Stopped);
        true
    }

    /// Executes the lines that are due at this tick, up to [`LINES_PER_STEP`].
    fn step_script(&mut self, state: &NavigationState) {
        let Some(mut run) = self.scripts.running.take() else { return };
        let id = run.script().id();
        self.vehicle.see(state, &self.rules);
        for _ in 0..LINES_PER_STEP {
            let of_scripts = |open: &&OpenRequest| matches!(open.asker, Asker::Line { .. });
            let has_room = self.open.iter().filter(of_scripts).count() < OPEN_MAX
                && self.has_room_for_request();
            let Some(due) = run.next(state, has_room) else { break };
            // Before its outcome, so that the text of a line comes ahead of its refusal.
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
        match action {
            Action::Fault(request) => self.request_fault(asker, request),
            Action::Refer(reference) => self.vehicle.refer(reference, &self.rules),
            Action::Mode(mode) => self.command_vehicle(VehicleCommand::Mode(mode)),
            Action::Arm(armed) => self.command_vehicle(VehicleCommand::Arm(armed)),
            Action::Land => self.command_vehicle(VehicleCommand::Land),
            Action::Say | Action::End => Ok(()),
        }
    }

    fn request_fault(&mut self, asker: Asker, request: FaultRequest) -> Result<(), VehicleRefusal> {
        // The parameter may have changed since the script began.
        if !self.scripts.may_fail {
            return Err(VehicleRefusal::FaultInjectionOff);
        }
        // Wraps around in the upper half, where no intent has its number.
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

/// A request to the plant without an answer.
#[derive(Debug, Clone, Copy)]
struct OpenRequest {
    request: PlantRequest,
    /// The plant has it. One new flight completes all requests for one, so only the first of them is sent.
    is_sent: bool,
    asker: Asker,
}

/// Who learns the outcome of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Asker {
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

/// When a fault began or ended; `before` is the tick before the report. A new change happened at the tick that comes
/// with the report; a repeated one happened earlier, and a scheduled one will happen.
fn time_of_fault(state: &FaultState, before: SimTime) -> SimTime {
    match state {
        FaultState::Scheduled { .. } => before,
        state => state.time().max(before),
    }
}

/// The script of the flight.
#[derive(Debug, Clone)]
struct ScriptState {
    /// The script that begins with each flight.
    scenario: Option<Arc<Script>>,
    /// Scripts may inject faults (`SYS_FAILURE_EN`).
    may_fail: bool,
    running: Option<Run>,
    last_number: u32,
}

/// Events that wait to be fetched.
#[derive(Debug, Clone)]
struct EventQueue {
    events: VecDeque<Event>,
    /// Dropped events that no event has reported yet.
    lost: u64,
}

impl EventQueue {
    /// When there is no room, the oldest event of the least important kind is dropped, the new one included.
    fn push(&mut self, time: SimTime, kind: EventKind) {
        self.events.push_back(Event { time, kind });
        if self.events.len() > EVENTS_MAX {
            let ranks = self.events.iter().map(|event| rank(&event.kind)).enumerate();
            // Of several equal ones `min_by_key` gives the first, which is the oldest.
            let victim = ranks.min_by_key(|(_, rank)| *rank).map_or(0, |(place, _)| place);
            self.events.remove(victim);
            self.lost += 1;
        }
    }

    /// The oldest event. After the last one, the number of lost events, if any.
    fn pop(&mut self, now: SimTime) -> Option<Event> {
        self.events.pop_front().or_else(|| {
            let lost = std::mem::take(&mut self.lost);
            (lost > 0).then_some(Event { time: now, kind: EventKind::EventsLost(lost) })
        })
    }
}

/// How important an event is: the lower, the sooner it is dropped.
fn rank(kind: &EventKind) -> u8 {
    match kind {
        EventKind::Script { event: ScriptEvent::Line(_), .. } => 0,
        EventKind::Script { event: ScriptEvent::LineRefused { .. }, .. } => 1,
        // Events from which receivers maintain a state.
        EventKind::Fault(_)
        | EventKind::FlightBegan { .. }
        | EventKind::PlantLost
        | EventKind::PlantBack => 3,
        // A ground station waits for these.
        EventKind::Outcome { .. } => 4,
        _ => 2,
    }
}

#[cfg(test)]
mod tests;
