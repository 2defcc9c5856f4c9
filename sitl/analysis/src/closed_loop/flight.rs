//! The loop itself: one exchange of plant and autopilot after the other, and the one place where inputs enter.
//!
//! It carries what the link carries: at most [`REPORTS_MAX`] reports come with a control step, one request leaves with
//! its answer. So a flight in one process and one through two processes agree to the bit.

use core::iter::Zip;
use core::ops::{ControlFlow, RangeFrom};
use core::slice;
use std::collections::VecDeque;
use std::iter::Peekable;

use autopilot::autopilot::{Autopilot, Settings};
use autopilot::command::{Command, Intent};
use autopilot::event::{Event, Snapshot};
use autopilot::own_law::OwnLaw;
use autopilot::recorder::{Moment, Recorded};
use flight_control::{Estimator, StepLog};
use icd::fault::{PlantAction, PlantReport, PlantRequest};
use icd::wire::REPORTS_MAX;
use icd::{Actuators, ControlPeriod, Sensors, SimTime};
use plant_sim::{Plant, PlantSetup, SetupError, Truth};

use super::{End, FlightSetup, Record, settings};

/// An exchange of packets between plant and autopilot: where in the flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Exchange {
    /// Control steps flown before it.
    pub step: u64,
    /// Simulation time.
    pub time: SimTime,
    /// With a control step, while time stands still, or on the ground.
    pub moment: Moment,
}

/// One tick after its control step.
#[derive(Debug, Clone, Copy)]
pub struct Tick<'a> {
    /// Where in the flight.
    pub exchange: Exchange,
    /// Sensor values.
    pub sensors: &'a Sensors,
    /// What the laws made of it: every signal of the step, the commands included.
    pub log: &'a StepLog,
    /// What the autopilot shows.
    pub snapshot: &'a Snapshot,
    /// The estimator, where the navigation state is its.
    pub estimator: Option<&'a Estimator>,
    /// Events since the tick before.
    pub events: &'a [Event],
    /// The plant at the tick, for its truth.
    pub plant: &'a Plant,
}

impl Tick<'_> {
    /// Truth and signals of the tick.
    #[must_use]
    pub fn record(&self) -> Record {
        Record { truth: *self.plant.truth(), log: *self.log }
    }
}

/// Who gives inputs to a flight, and looks at it.
pub trait Operator {
    /// Why a flight ends early.
    type Stop;

    /// One tick, after its control step.
    fn tick(&mut self, tick: &Tick<'_>) -> ControlFlow<Self::Stop>;

    /// A law that the program brings, for where `CTL_LAW` is 9.
    fn own_law(&self) -> Option<OwnLaw> {
        None
    }

    /// Other commands to the effectors than those of the autopilot, with their control step. Only the reference that knows the
    /// fault ([`crate::fault_known`]) has any.
    fn reallocates(&mut self, _plant: &Plant, _log: &StepLog) -> Option<StepLog> {
        None
    }

    /// The next input of this exchange, before its step; called until there is none.
    fn input(&mut self, _exchange: &Exchange) -> Option<Recorded> {
        None
    }

    /// What the plant reports in this exchange.
    fn report(&mut self, _exchange: &Exchange, _report: &PlantReport) {}

    /// The request to the plant in this exchange.
    fn request(
        &mut self,
        _exchange: &Exchange,
        _request: Option<&PlantRequest>,
    ) -> ControlFlow<Self::Stop> {
        ControlFlow::Continue(())
    }

    /// Whether the next control step is flown.
    fn goes_on(&self, _step: u64) -> bool {
        true
    }

    /// Whether there is one more exchange while time stands still.
    fn holds(&mut self, _exchange: &Exchange) -> bool {
        false
    }

    /// Such an exchange is over.
    fn held(&mut self, _exchange: &Exchange) -> ControlFlow<Self::Stop> {
        ControlFlow::Continue(())
    }

    /// The aircraft is on the ground.
    fn landed(&mut self, _exchange: &Exchange, _plant: &Plant) -> ControlFlow<Self::Stop> {
        ControlFlow::Continue(())
    }
}

/// How a flight ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Flown<S> {
    /// When and where.
    pub end: End,
    /// What the operator ended it with; `None` if it came to its own end.
    pub stopped: Option<S>,
}

/// Flies until `until`, the ground, a restart that an operator requests, or the operator's end.
///
/// # Errors
/// [`SetupError`] if the plant cannot start, or the model is of another aircraft.
pub fn run<O: Operator>(
    setup: &PlantSetup,
    settings: &Settings,
    until: SimTime,
    operator: &mut O,
) -> Result<Flown<O::Stop>, SetupError> {
    setup.check_model(settings.model.aircraft())?;
    let plant = Plant::new(setup)?;
    let mut autopilot = Autopilot::new(settings).with_own_law(operator.own_law());
    autopilot.begin_flight(setup.period, plant.time(), false);
    let (replies, events) = (VecDeque::new(), Vec::new());
    let mut flight = Flight { plant, autopilot, replies, events, step: 0, is_over: false };
    let stopped = flight.fly(setup.period, until, operator).break_value();
    let end = End { time: flight.plant.time(), on_ground: flight.plant.on_ground() };
    Ok(Flown { end, stopped })
}

struct Flight {
    plant: Plant,
    autopilot: Autopilot,
    /// Answers to requests; they leave before the plant's own reports.
    replies: VecDeque<PlantReport>,
    /// Not yet shown to the operator.
    events: Vec<Event>,
    /// Control steps flown.
    step: u64,
    /// A restart was requested.
    is_over: bool,
}

impl Flight {
    fn fly<O: Operator>(
        &mut self,
        period: ControlPeriod,
        until: SimTime,
        operator: &mut O,
    ) -> ControlFlow<O::Stop> {
        while !self.is_over {
            if self.plant.on_ground() {
                return self.stay_on_ground(operator);
            }
            if !operator.goes_on(self.step) {
                break;
            }
            let sensors = self.plant.sense();
            let mut actuators = self.exchange(&sensors, operator)?;
            self.step += 1;
            if self.plant.time() + period > until {
                break;
            }
            while !self.is_over && operator.holds(&self.here(Moment::Holding)) {
                actuators = self.hold(Moment::Holding, &sensors, operator)?;
            }
            self.plant.advance(&actuators);
        }
        ControlFlow::Continue(())
    }

    fn here(&self, moment: Moment) -> Exchange {
        Exchange { step: self.step, time: self.plant.time(), moment }
    }

    /// The exchange of a control step.
    fn exchange<O: Operator>(
        &mut self,
        sensors: &Sensors,
        operator: &mut O,
    ) -> ControlFlow<O::Stop, Actuators> {
        let here = self.here(Moment::Step);
        self.take_reports(&here, REPORTS_MAX, operator);
        self.take_inputs(&here, operator);
        let mut actuators = self.autopilot.step(here.time, sensors).actuators();
        self.gather_events();
        let snapshot = self.autopilot.snapshot().expect("a control step leaves a snapshot");
        let other = operator.reallocates(&self.plant, &snapshot.log);
        let log = other.as_ref().unwrap_or(&snapshot.log);
        if other.is_some() {
            actuators = log.actuators();
        }
        operator.tick(&Tick {
            exchange: here,
            sensors,
            log,
            snapshot,
            estimator: self.autopilot.estimator(),
            events: &self.events,
            plant: &self.plant,
        })?;
        self.events.clear();
        self.send_request(&here, operator)?;
        ControlFlow::Continue(actuators)
    }

    /// One exchange while time stands still.
    fn hold<O: Operator>(
        &mut self,
        moment: Moment,
        sensors: &Sensors,
        operator: &mut O,
    ) -> ControlFlow<O::Stop, Actuators> {
        let here = self.here(moment);
        self.take_reports(&here, usize::MAX, operator);
        self.take_inputs(&here, operator);
        let actuators = self.autopilot.hold(sensors, moment == Moment::OnGround);
        self.gather_events();
        self.send_request(&here, operator)?;
        operator.held(&here)?;
        ControlFlow::Continue(actuators)
    }

    fn stay_on_ground<O: Operator>(&mut self, operator: &mut O) -> ControlFlow<O::Stop> {
        let here = self.here(Moment::OnGround);
        operator.landed(&here, &self.plant)?;
        let sensors = self.plant.sense();
        while !self.is_over && operator.holds(&here) {
            self.hold(Moment::OnGround, &sensors, operator)?;
        }
        ControlFlow::Continue(())
    }

    /// Where operators' inputs enter, and nowhere else.
    fn take_inputs<O: Operator>(&mut self, here: &Exchange, operator: &mut O) {
        while let Some(input) = operator.input(here) {
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

    fn take_reports<O: Operator>(&mut self, here: &Exchange, count: usize, operator: &mut O) {
        for _ in 0..count {
            let Some(report) = self.replies.pop_front().or_else(|| self.plant.pop_report()) else {
                return;
            };
            operator.report(here, &report);
            self.autopilot.handle_report(&report);
        }
    }

    /// A request to the plant leaves with the answer to a packet, and the reply comes with the next one.
    fn send_request<O: Operator>(
        &mut self,
        here: &Exchange,
        operator: &mut O,
    ) -> ControlFlow<O::Stop> {
        let request = self.autopilot.next_request();
        operator.request(here, request.as_ref())?;
        let Some(PlantRequest { number: request, action }) = request else {
            return ControlFlow::Continue(());
        };
        match action {
            PlantAction::Fault(fault) => {
                let reply = self.plant.request(&fault);
                self.replies.push_back(PlantReport::FaultReply { request, reply });
            }
            PlantAction::ListFaults => self.plant.list_faults(),
            PlantAction::Restart => self.is_over = true,
            // Time passes as fast as it can here; the request is confirmed all the same.
            PlantAction::Pace(pace) => {
                let (request, at) = (Some(request), here.time);
                self.replies.push_back(PlantReport::Paced { request, pace, at });
            }
        }
        ControlFlow::Continue(())
    }

    fn gather_events(&mut self) {
        self.events.extend(std::iter::from_fn(|| self.autopilot.pop_event()));
    }
}

/// An operator's command at a time. Such a flight repeats to the bit like any other.
#[derive(Debug, Clone)]
pub struct TimedCommand {
    /// It is taken before the control step of the first tick at or after this time.
    pub at: SimTime,
    /// What.
    pub command: Command,
}

/// One tick of such a flight.
#[derive(Debug, Clone, Copy)]
pub struct Observation<'a> {
    /// The plant's truth at the tick.
    pub truth: &'a Truth,
    /// What the autopilot shows at the tick.
    pub snapshot: &'a Snapshot,
    /// Events since the tick before.
    pub events: &'a [Event],
}

/// Flies a setup from its start to its end and hands every tick to `sink`. `commands` is in the order of time.
///
/// # Errors
/// [`SetupError`] if the plant cannot start.
pub fn fly_with_commands(
    setup: &FlightSetup,
    commands: &[TimedCommand],
    sink: &mut dyn FnMut(&Observation),
) -> Result<End, SetupError> {
    fly_while(setup, commands, &mut |observation| {
        sink(observation);
        true
    })
}

/// The same, ended by a `sink` that returns false.
///
/// # Errors
/// [`SetupError`] if the plant cannot start.
pub fn fly_while(
    setup: &FlightSetup,
    commands: &[TimedCommand],
    sink: &mut dyn FnMut(&Observation) -> bool,
) -> Result<End, SetupError> {
    let mut commander = Commander { commands: commands.iter().zip(1..).peekable(), sink };
    Ok(run(&setup.plant, &settings(setup), setup.duration, &mut commander)?.end)
}

struct Commander<'a> {
    /// With the numbers of their intents.
    commands: Peekable<Zip<slice::Iter<'a, TimedCommand>, RangeFrom<u32>>>,
    sink: &'a mut dyn FnMut(&Observation) -> bool,
}

impl Operator for Commander<'_> {
    type Stop = ();

    fn input(&mut self, exchange: &Exchange) -> Option<Recorded> {
        let (timed, number) = self.commands.next_if(|(timed, _)| timed.at <= exchange.time)?;
        Some(Recorded::Intent(Intent { number, command: timed.command.clone() }))
    }

    fn tick(&mut self, tick: &Tick<'_>) -> ControlFlow<()> {
        let snapshot = tick.snapshot;
        let observation = Observation { truth: tick.plant.truth(), snapshot, events: tick.events };
        if (self.sink)(&observation) { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}
