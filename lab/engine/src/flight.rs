//! A flight in one process: plant and autopilot take turns, without sockets, threads or clocks.
//!
//! It carries what the link carries: at most [`REPORTS_MAX`] reports come with a control step, one request leaves with
//! its answer. So a flight in one process and one through two processes agree to the bit.
//!
//! ```text
//! step:  request of the exchange before ─> plant;  plant advances;  sense ─> reports, inputs ─> autopilot ─> Tick
//! hold:  request of the exchange before ─> plant;                   reports, inputs ─> autopilot ─> Held
//! ```

use std::collections::VecDeque;
use std::mem;
use std::sync::Arc;

use autopilot::autopilot::{Autopilot, Settings};
use autopilot::event::{Event, Snapshot};
use autopilot::own_law::{FlightLaw, OwnLaw};
use autopilot::parameters::Parameters;
use autopilot::recorder::{Moment, Recorded};
use autopilot::script::{Action, Line, Script};
use autopilot::vehicle::schedule::ReferenceSchedule;
use flight_control::{AircraftModel, Estimator, StepLog, Visitor};
use host_io::problem::problem;
use icd::fault::{PlantAction, PlantReport, PlantRequest};
use icd::wire::REPORTS_MAX;
use icd::{Actuators, ControlPeriod, FaultRequest, PerEffector, Sensors, SimTime};
use plant_sim::{Plant, PlantSetup, ScheduledFault, SetupError, Truth};
use serde::{Deserialize, Serialize};

use crate::fault_known::FaultKnown;
use crate::law::LawFailure;

/// Everything that defines a flight of both sides.
#[derive(Debug, Clone)]
pub struct FlightSetup {
    /// The aircraft and the world.
    pub plant: PlantSetup,
    /// The controller's model of the aircraft.
    pub model: AircraftModel,
    /// Validated parameters of the autopilot.
    pub parameters: Parameters,
    pub references: ReferenceSchedule,
    /// What begins with the flight.
    pub script: Option<Arc<Script>>,
    /// The law that flies where `CTL_LAW` is 9.
    pub own_law: Option<OwnLaw>,
    /// The reference that knows the fault ([`crate::fault_known`]) stands between autopilot and plant.
    pub knows_fault: bool,
    /// The flight ends at this time, or on the ground.
    pub duration: SimTime,
}

impl FlightSetup {
    pub fn settings(&self) -> Settings {
        let Parameters { gains, limits, navigation, failure, .. } = self.parameters;
        Settings {
            model: self.model,
            gains,
            limits,
            navigation,
            references: self.references.clone(),
            script: self.script.clone(),
            own_law: self.own_law.clone(),
            fault_injection: failure.enabled,
        }
    }
}

impl FlightSetup {
    /// Checks that the aircraft can have the faults of the script: the plant would refuse them one by one while it flies.
    fn check_script(&self) -> Result<(), SetupError> {
        let Some(script) = &self.script else { return Ok(()) };
        for Line { number, text, action, .. } in script.lines() {
            let Action::Fault(FaultRequest::Inject { target, kind, timing }) = *action else {
                continue;
            };
            let class = target.class(script.effectors());
            let fault = ScheduledFault { target, kind, timing };
            self.plant.check_fault(&fault).map_err(|refusal| {
                let (name, refusal) = (script.name(), refusal.described(class));
                problem!("{name}: line {number}: `{text}`: {refusal}")
            })?;
        }
        Ok(())
    }
}

/// An exchange of packets between plant and autopilot: where in the flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exchange {
    /// Control steps flown before it.
    pub step: u64,
    pub time: SimTime,
    /// With a control step, while time stands still, or on the ground.
    pub moment: Moment,
}

/// One tick after its control step. The plant has not obeyed its request yet: it does so with the next step.
#[derive(Debug, Clone, Copy)]
pub struct Tick<'a> {
    /// Where in the flight.
    pub exchange: Exchange,
    pub sensors: &'a Sensors,
    /// What the laws made of it: every signal of the step, the commands included.
    pub log: &'a StepLog,
    /// What the autopilot shows.
    pub snapshot: &'a Snapshot,
    /// The estimator, where the navigation state is its.
    pub estimator: Option<&'a Estimator>,
    /// What the plant reported in this exchange.
    pub reports: &'a [PlantReport],
    /// Events since the tick before.
    pub events: &'a [Event],
    /// What the autopilot requests of the plant.
    pub request: Option<&'a PlantRequest>,
    /// The plant at the tick, for its truth.
    pub plant: &'a Plant,
}

/// One control tick: what was true, and what the controller made of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The plant's truth at the tick.
    pub truth: Truth,
    /// The signals of the control step at the tick.
    pub log: StepLog,
}

impl Tick<'_> {
    /// Truth and signals of the tick.
    pub fn record(&self) -> Record {
        Record { truth: *self.plant.truth(), log: *self.log }
    }
}

/// One exchange while time stands still, or on the ground.
#[derive(Debug, Clone, Copy)]
pub struct Held<'a> {
    /// Where in the flight.
    pub exchange: Exchange,
    /// What the plant reported in it.
    pub reports: &'a [PlantReport],
    /// What the autopilot requests of the plant.
    pub request: Option<&'a PlantRequest>,
}

/// How a flight ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct End {
    /// Time of the last tick.
    pub time: SimTime,
    /// The aircraft touched the ground.
    pub on_ground: bool,
}

/// The law of a flight cannot be copied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the flight cannot be copied: its law cannot")]
pub struct CannotCopy;

/// A flight in progress. The same setup and the same inputs give the same bits.
#[derive(Debug)]
pub struct Flight {
    // Large: on the stack of a thread there is no room for many copies of them.
    plant: Box<Plant>,
    autopilot: Box<Autopilot>,
    fault_known: Option<FaultKnown>,
    period: ControlPeriod,
    until: SimTime,
    step: u64,
    /// Commands that the plant has not obeyed yet; none before the first step, and none once the flight is over.
    actuators: Option<Actuators>,
    /// Answers to requests; they leave before the plant's own reports.
    replies: VecDeque<PlantReport>,
    /// The end was reached, or a restart was requested.
    is_over: bool,
    /// Of the present tick, once they were read: noise is drawn once a tick.
    sensors: Option<Sensors>,
    /// Of the present exchange.
    reports: Vec<PlantReport>,
    request: Option<PlantRequest>,
    /// Since the tick before.
    events: Vec<Event>,
    /// The events were part of a tick.
    is_shown: bool,
    has_script: bool,
    /// The step of the reference that knows the fault, if it has one.
    reallocated: Option<StepLog>,
}

impl Flight {
    /// Ready for the first step.
    pub fn new(setup: &FlightSetup) -> Result<Self, SetupError> {
        setup.check_script()?;
        let mut flight = Self::of(&setup.plant, &setup.settings(), setup.duration)?;
        let gains = &setup.parameters.gains;
        let known = || FaultKnown::new(&setup.model, gains, setup.plant.period);
        flight.fault_known = setup.knows_fault.then(known);
        Ok(flight)
    }

    /// The same from its two sides, as a flight log has them.
    pub fn of(setup: &PlantSetup, settings: &Settings, until: SimTime) -> Result<Self, SetupError> {
        setup.check_model(settings.model.aircraft())?;
        let plant = Box::new(Plant::new(setup)?);
        let mut autopilot = Box::new(Autopilot::new(settings));
        autopilot.begin_flight(setup.period, plant.time(), false);
        Ok(Self {
            plant,
            autopilot,
            fault_known: None,
            period: setup.period,
            until,
            step: 0,
            actuators: None,
            replies: VecDeque::new(),
            is_over: false,
            sensors: None,
            reports: Vec::new(),
            request: None,
            events: Vec::new(),
            is_shown: false,
            has_script: settings.script.is_some(),
            reallocated: None,
        })
    }

    /// For who looks at commands and truth alone: the isolation is left out where its verdict is only reported. A script may wait for its
    /// events, so a flight with one keeps it.
    pub fn skip_unread_verdict(&mut self) {
        if !self.has_script {
            self.autopilot.skip_unread_verdict();
        }
    }

    /// The next tick: the plant moves on, the autopilot takes `inputs` and makes its control step. `None` once the flight is over:
    /// by its end, on the ground, by a restart that was requested, or by a law that has failed.
    pub fn step(&mut self, inputs: impl IntoIterator<Item = Recorded>) -> Option<Tick<'_>> {
        if !self.move_on() {
            return None;
        }
        let exchange = self.here(Moment::Step);
        self.begin_exchange(REPORTS_MAX, inputs);
        let sensors = self.sensors.get_or_insert_with(|| self.plant.sense());
        // The snapshot below has all of the step.
        let _ = self.autopilot.step(exchange.time, sensors);
        self.end_exchange();
        let snapshot = self.autopilot.snapshot()?;
        // Without the reference nothing as large as a step is copied.
        let log = match &mut self.fault_known {
            None => &snapshot.log,
            Some(known) => {
                let (effects, positions) =
                    (self.plant.fault_effects(), self.plant.truth().positions);
                self.reallocated = known.step(effects, &positions, &snapshot.log);
                self.reallocated.as_ref().unwrap_or(&snapshot.log)
            }
        };
        self.actuators = Some(log.actuators());
        self.step += 1;
        self.is_shown = true;
        Some(Tick {
            exchange,
            sensors: self.sensors.as_ref()?,
            log,
            snapshot,
            estimator: self.autopilot.estimator(),
            reports: &self.reports,
            events: &self.events,
            request: self.request.as_ref(),
            plant: &self.plant,
        })
    }

    /// One exchange while time stands still, after a step or on the ground. `None` once the flight is over, but on the ground.
    pub fn hold(&mut self, inputs: impl IntoIterator<Item = Recorded>) -> Option<Held<'_>> {
        self.obey();
        if self.is_over {
            return None;
        }
        let on_ground = self.plant.on_ground();
        let exchange = self.here(if on_ground { Moment::OnGround } else { Moment::Holding });
        // The link sends as many packets as they need before time goes on.
        self.begin_exchange(usize::MAX, inputs);
        let sensors = self.sensors.get_or_insert_with(|| self.plant.sense());
        let actuators = self.autopilot.hold(sensors, on_ground);
        self.actuators = self.actuators.map(|_| actuators);
        self.end_exchange();
        let (reports, request) = (self.reports.as_slice(), self.request.as_ref());
        Some(Held { exchange, reports, request })
    }

    /// Every signal of the last control step.
    pub fn log(&self) -> Option<&StepLog> {
        let flown = || self.autopilot.snapshot().map(|snapshot| &snapshot.log);
        self.reallocated.as_ref().or_else(flown)
    }

    /// Events of the last tick, and since.
    pub fn events(&self) -> &[Event] {
        &self.events
    }

    /// Time of the tick that the next step makes, unless the flight is over.
    pub fn next_time(&self) -> SimTime {
        match self.actuators {
            Some(_) => self.plant.time() + self.period,
            None => self.plant.time(),
        }
    }

    pub fn steps(&self) -> u64 {
        self.step
    }

    /// The plant, for its truth.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The plant, to continue from another state, for a linearisation.
    pub fn plant_mut(&mut self) -> &mut Plant {
        &mut self.plant
    }

    /// Shows every continuous state of the laws, which may be changed.
    pub fn law_states(&mut self, visit: &mut Visitor<'_>) {
        self.autopilot.law_states(visit);
    }

    /// Commands that the plant obeys with the next step.
    pub fn commands(&self) -> Option<&PerEffector<f64>> {
        self.actuators.as_ref().map(|actuators| &actuators.commands)
    }

    /// Replaces them.
    pub fn replace_commands(&mut self, commands: PerEffector<f64>) {
        self.actuators = self.actuators.map(|_| Actuators::new(commands));
    }

    /// Where and when the flight is, or ended.
    pub fn end(&self) -> End {
        End { time: self.plant.time(), on_ground: self.plant.on_ground() }
    }

    /// Why the law of the program gives no more commands, if it has failed: the flight is over.
    pub fn failure(&self) -> Option<LawFailure> {
        self.autopilot.own_law().and_then(FlightLaw::failure).map(LawFailure)
    }

    /// A flight that continues from here with the same bits.
    pub fn copy(&self) -> Result<Self, CannotCopy> {
        if self.autopilot.own_law().is_some_and(|law| law.copy().is_none()) {
            return Err(CannotCopy);
        }
        Ok(Self {
            plant: self.plant.clone(),
            autopilot: self.autopilot.clone(),
            fault_known: self.fault_known.clone(),
            period: self.period,
            until: self.until,
            step: self.step,
            actuators: self.actuators,
            replies: self.replies.clone(),
            is_over: self.is_over,
            sensors: self.sensors,
            reports: self.reports.clone(),
            request: self.request,
            events: self.events.clone(),
            is_shown: self.is_shown,
            has_script: self.has_script,
            reallocated: self.reallocated,
        })
    }

    fn here(&self, moment: Moment) -> Exchange {
        Exchange { step: self.step, time: self.plant.time(), moment }
    }

    /// To the next tick, if there is one.
    fn move_on(&mut self) -> bool {
        self.obey();
        self.is_over |= self.failure().is_some();
        if self.is_over {
            return false;
        }
        match self.actuators.take() {
            Some(_) if self.plant.time() + self.period > self.until => {
                self.is_over = true;
                return false;
            }
            Some(actuators) => {
                self.plant.advance(&actuators);
                self.sensors = None;
            }
            // The first step has no commands; later there are none once the flight is over.
            None if self.step > 0 => return false,
            None => {}
        }
        !self.plant.on_ground()
    }

    /// The plant's reports and the operators' inputs, which enter here and nowhere else.
    fn begin_exchange(&mut self, reports_max: usize, inputs: impl IntoIterator<Item = Recorded>) {
        // What came in exchanges without a step belongs to the next tick.
        if mem::take(&mut self.is_shown) {
            self.events.clear();
        }
        self.reports.clear();
        while self.reports.len() < reports_max
            && let Some(report) = self.replies.pop_front().or_else(|| self.plant.pop_report())
        {
            self.autopilot.handle_report(&report);
            self.reports.push(report);
        }
        for input in inputs {
            match input {
                Recorded::Intent(intent) => self.autopilot.handle_intent(intent),
                Recorded::PlantLost => self.autopilot.plant_lost(),
                Recorded::PlantBack => self.autopilot.plant_back(),
                // Requests are what comes out of the autopilot.
                Recorded::Request(_) => {}
            }
            self.gather_events();
        }
    }

    fn end_exchange(&mut self) {
        self.gather_events();
        self.request = self.autopilot.next_request();
    }

    fn gather_events(&mut self) {
        self.events.extend(std::iter::from_fn(|| self.autopilot.pop_event()));
    }

    /// A request to the plant leaves with the answer to a packet, and the reply comes with the next one.
    fn obey(&mut self) {
        let Some(PlantRequest { number: request, action }) = self.request.take() else { return };
        match action {
            PlantAction::Fault(fault) => {
                let reply = self.plant.request(&fault);
                self.replies.push_back(PlantReport::FaultReply { request, reply });
            }
            PlantAction::ListFaults => self.plant.list_faults(),
            PlantAction::Restart => self.is_over = true,
            // Time passes as fast as it can here; the request is confirmed all the same.
            PlantAction::Pace(pace) => {
                let (request, at) = (Some(request), self.plant.time());
                self.replies.push_back(PlantReport::Paced { request, pace, at });
            }
        }
    }
}
