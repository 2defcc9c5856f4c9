//! The composition root of the control side: vehicle, laws and requests to the plant, without I/O.
//!
//! The plant link calls it once a tick; an in-process flight calls it the same way. Intents and their
//! outcomes, events and snapshots are values.

use std::collections::VecDeque;
use std::sync::Arc;

use flight_control::{
    AircraftModel, Authority, Estimator, FlightControl, Gains, NavigationSource, NavigationState,
    StepLog,
};
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use serde::{Deserialize, Serialize};

use crate::command::{Command, Configuration, Intent, Outcome, ScriptCommand, VehicleCommand};
use crate::event::{Event, EventKind, Snapshot};
use crate::parameters::{NavigationParameters, ReferenceLimits};
use crate::script::Script;
use crate::termination;
use crate::transitions::Transitions;
use crate::vehicle::plan::Plan;
use crate::vehicle::schedule::ReferenceSchedule;
use crate::vehicle::{Rules, Vehicle, VehicleRefusal};
use event_queue::{EVENTS_MAX, EventQueue};
use own_law::{Brought, OwnLaw};
use plant_requests::OpenRequest;
use scripts::Scripts;

mod event_queue;
pub mod own_law;
mod plant_requests;
mod scripts;

/// Requests to the plant that may be open.
const REQUESTS_MAX: usize = 32;

/// The control side of a flight at its start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The controller's model of the aircraft.
    pub model: AircraftModel,
    pub gains: Gains,
    pub limits: ReferenceLimits,
    pub navigation: NavigationParameters,
    /// Scripts may break the aircraft (`SYS_FAILURE_EN`).
    pub fault_injection: bool,
    pub references: ReferenceSchedule,
    /// The script that begins with each flight.
    pub script: Option<Arc<Script>>,
    /// The law of the program that flies where `CTL_LAW` is 9. A file of settings has none.
    #[serde(skip)]
    pub own_law: Option<OwnLaw>,
}

/// The control side of the flight software.
///
/// A copy continues as the original would, with one exception: a law that cannot be copied starts anew in it
/// ([`own_law::FlightLaw::copy`]).
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
    scripts: Scripts,
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
            rules: Rules::new(*limits, *navigation, gains),
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
            scripts: Scripts::new(script.clone(), settings.fault_injection),
            events: EventQueue::new(),
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
        self.vehicle.begin_flight();
        self.transitions = Transitions::default();
        self.latest = None;
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
        let state = self.navigation.step(time, sensors);
        self.step_script(&state);
        self.fly(&state, sensors)
    }

    /// The vehicle and the laws.
    fn fly(&mut self, state: &NavigationState, sensors: &Sensors) -> &StepLog {
        let time = state.time;
        let events = &mut self.events;
        let mut publish = |kind| events.push(time, kind);
        let command =
            self.vehicle.track(state, &self.rules, &mut |event| publish(EventKind::Vehicle(event)));
        let own = self.own_law.as_mut().map(Brought::law_mut);
        let log = self.flight.step_with(state, &command, own);
        let (mode, navigation) = (self.vehicle.mode(), self.vehicle.navigation());
        let demand = self.vehicle.demand().copied().unwrap_or(command);
        let (period, terminated) = (self.period, self.vehicle.is_terminated());
        let latest = match &mut self.latest {
            // Field by field: a whole snapshot would be copied once more.
            Some(latest) => {
                (latest.sensors, latest.log) = (*sensors, log);
                (latest.time, latest.period, latest.on_ground) = (time, period, false);
                (latest.mode, latest.demand, latest.navigation) = (mode, demand, navigation);
                latest.terminated = terminated;
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
                Actuators { commands: snapshot.log.commands }
            }
            // Joined while paused: step the vehicle once, so that there is a state to show and to command.
            None => {
                let actuators = self.fly(&state, sensors).actuators();
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
                self.rules.obey(&gains);
                self.flight.set_gains(&gains);
                self.navigation.set_gains(&gains);
            }
            Configuration::Limits(limits) => self.rules.limits = limits,
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

    /// Passes a command to the vehicle. A plan is accepted in any case; the rest needs an aircraft in the air.
    fn command_vehicle(&mut self, command: VehicleCommand) -> Result<(), VehicleRefusal> {
        if !matches!(command, VehicleCommand::Plan(_) | VehicleCommand::PlanItem(_)) {
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

    /// The present settings: gains, limits and guidance as operators have set them.
    pub fn settings(&self) -> Settings {
        Settings {
            model: self.model,
            gains: self.gains,
            limits: self.rules.limits,
            navigation: self.rules.navigation,
            references: self.vehicle.references().clone(),
            script: self.scripts.of_scenario().cloned(),
            own_law: self.own_law.as_ref().map(Brought::own),
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
}

#[cfg(test)]
mod tests;
