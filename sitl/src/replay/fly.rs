//! The flight itself: the closed loop in one process, with the inputs of a log at their places.

use core::fmt;
use std::collections::VecDeque;

use autopilot::autopilot::Autopilot;
use autopilot::recorder::{
    COMMAND_NAMES, CONTROL_NAMES, Moment, Recorded, RunHash, control_values,
};
use flight_control::StepOutput;
use icd::fault::{PlantAction, PlantReport, PlantRequest};
use icd::record::TRUTH_FIELDS;
use icd::wire::REPORTS_MAX;
use icd::{Actuators, Sensors, SimTime};
use plant_sim::Plant;

use super::compare::{Difference, Hashes, Rows};
use super::recording::{CannotFly, Input, Recording};

/// What came of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// Control steps flown.
    pub steps: u64,
    /// Hash of the flight.
    pub run_hash: String,
    /// Hash that the log ends with; `None` if it was cut off.
    pub logged_hash: Option<String>,
    /// The first signal that differs.
    pub difference: Option<Difference>,
    /// Control steps that a damaged log should have rows of, and does not.
    pub missing: u64,
    /// Control steps that it should have rows of.
    due: u64,
    /// Where it is damaged first.
    first_damage: Option<SimTime>,
}

/// What a [`Verdict`] comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The same flight, as far as the log goes.
    Same,
    /// All that can be read of a damaged log is the same.
    SameWhereReadable,
    /// Another flight.
    Different,
    /// It differs behind a damage, which may have taken an input: nobody knows.
    Unknown,
}

impl Verdict {
    /// The same flight, as far as the log goes, and no step of it is missing.
    #[must_use]
    pub fn is_same(&self) -> bool {
        self.outcome() == Outcome::Same
    }

    /// What it comes to.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        let is_hash_other = self.logged_hash.as_ref().is_some_and(|h| *h != self.run_hash);
        match (&self.difference, self.first_damage) {
            (None, None) if is_hash_other => Outcome::Different,
            (None, Some(_)) if is_hash_other => Outcome::Unknown,
            (None, _) if self.missing == 0 => Outcome::Same,
            (None, _) => Outcome::SameWhereReadable,
            (Some(difference), Some(first)) if difference.time >= first => Outcome::Unknown,
            (Some(_), _) => Outcome::Different,
        }
    }

    fn of_damaged(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { due, missing, difference, run_hash, logged_hash, .. } = self;
        match (self.outcome(), difference) {
            (Outcome::SameWhereReadable, _) => {
                let readable = due.saturating_sub(*missing);
                write!(
                    f,
                    "damaged; all {readable} readable control steps are the same, {missing} are missing"
                )?;
                match logged_hash {
                    Some(_) => write!(f, "; same run hash {run_hash}"),
                    None => write!(f, ", and so is the run hash"),
                }
            }
            (_, Some(difference)) => write!(
                f,
                "damaged; whether it is the same flight cannot be told, since an input may be missing where \
                 {missing} control steps are: {difference}"
            ),
            (_, None) => write!(
                f,
                "damaged; all readable control steps are the same, but the run hash is not: an input may be \
                 missing where {missing} control steps are"
            ),
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if matches!(self.outcome(), Outcome::SameWhereReadable | Outcome::Unknown) {
            return self.of_damaged(f);
        }
        let Self { steps, run_hash, logged_hash, difference, .. } = self;
        match (difference, logged_hash) {
            (Some(difference), _) => write!(f, "not the same flight: {difference}"),
            (None, Some(logged)) if logged == run_hash => {
                write!(
                    f,
                    "same run hash {run_hash}: {steps} control steps are the same bit for bit"
                )
            }
            (None, Some(logged)) => write!(
                f,
                "not the same flight: every row is the same, but the run hash is not:\n  \
                 logged {logged}\n  flown  {run_hash}"
            ),
            (None, None) => write!(
                f,
                "the same flight bit for bit in all {steps} control steps that the log has; it was cut off before \
                 its run hash (that of these steps is {run_hash})"
            ),
        }
    }
}

/// Flies the log again up to its end, its first difference, or the ground; `each` hears the number of each step.
///
/// # Errors
/// [`CannotFly::Start`] if the plant refuses the setup.
pub fn fly(recording: &Recording, each: &mut dyn FnMut(u64)) -> Result<Verdict, CannotFly> {
    let mut flight = Flight::new(recording)?;
    let every = recording.row_every();
    let difference = flight.run(each).err().map(|difference| *difference);
    Ok(Verdict {
        steps: flight.hash.steps(),
        run_hash: flight.hash.hex(),
        logged_hash: recording.run_hash().map(str::to_owned),
        difference,
        missing: recording.missing().len() as u64,
        due: flight.hash.steps().div_ceil(every),
        first_damage: recording.first_damage_us().map(SimTime::from_micros),
    })
}

struct Flight<'a> {
    plant: Plant,
    autopilot: Autopilot,
    inputs: VecDeque<Input>,
    hash: RunHash,
    sensors: Rows<'a>,
    commands: Rows<'a>,
    control: Rows<'a>,
    truth: Rows<'a>,
    hashes: Hashes<'a>,
    /// The answer to the last request, and what a plant's pacer would report; leaves first.
    replies: VecDeque<PlantReport>,
    /// Control steps flown.
    step: u64,
    /// Control steps of the log.
    steps: u64,
    is_cut: bool,
    recording: &'a Recording,
    over: bool,
}

type Checked = Result<(), Box<Difference>>;

impl<'a> Flight<'a> {
    fn new(recording: &'a Recording) -> Result<Self, CannotFly> {
        let setup = &recording.plant.setup;
        let plant = Plant::new(setup)?;
        let mut autopilot = Autopilot::new(&recording.settings());
        autopilot.begin_flight(setup.period, plant.time(), false);
        let (log, every) = (&recording.log, recording.row_every());
        Ok(Self {
            plant,
            autopilot,
            inputs: recording.inputs(),
            hash: RunHash::default(),
            sensors: Rows::new(log, "sensors", every),
            commands: Rows::new(log, "commands", every),
            control: Rows::new(log, "control", every),
            truth: Rows::new(log, "truth", every),
            hashes: Hashes::new(log),
            replies: VecDeque::new(),
            step: 0,
            steps: recording.steps(),
            is_cut: recording.run_hash().is_none(),
            recording,
            over: false,
        })
    }

    fn run(&mut self, each: &mut dyn FnMut(u64)) -> Checked {
        while !self.over && self.step < self.steps {
            if self.plant.on_ground() {
                break;
            }
            let sensors = self.plant.sense();
            let mut actuators = self.exchange(&sensors)?;
            each(self.step);
            self.step += 1;
            actuators = self.hold(&sensors, actuators)?;
            self.plant.advance(&actuators);
        }
        if !self.over && self.plant.on_ground() { self.stay_on_ground() } else { Ok(()) }
    }

    /// The exchange of a control step.
    fn exchange(&mut self, sensors: &Sensors) -> Result<Actuators, Box<Difference>> {
        let time = self.plant.time();
        self.tell_reports(REPORTS_MAX);
        while let Some(input) = self.inputs.pop_front_if(|input| {
            input.step == self.step && !matches!(input.what, Recorded::Request(_))
        }) {
            self.take(input.what);
        }
        let output = self.autopilot.step(time, sensors);
        while self.autopilot.pop_event().is_some() {}
        self.hash.step(time, sensors, &output.actuators);
        self.check_rows(time, sensors, &output)?;
        let logged = self.next_request(Moment::Step);
        self.ask(Moment::Step, logged)?;
        Ok(output.actuators)
    }

    /// What came in while time stood still after the last step.
    fn hold(
        &mut self,
        sensors: &Sensors,
        mut actuators: Actuators,
    ) -> Result<Actuators, Box<Difference>> {
        while !self.over && self.is_due(Moment::Holding) {
            actuators = self.exchange_without_step(Moment::Holding, sensors)?;
        }
        Ok(actuators)
    }

    fn stay_on_ground(&mut self) -> Checked {
        self.check_truth(self.plant.time())?;
        let sensors = self.plant.sense();
        while !self.over && self.is_due(Moment::OnGround) {
            self.exchange_without_step(Moment::OnGround, &sensors)?;
        }
        Ok(())
    }

    /// Something was taken or left in an exchange of this kind before the next control step.
    fn is_due(&self, moment: Moment) -> bool {
        let mut now = self.inputs.iter().take_while(|input| input.step == self.step);
        now.any(|input| input.moment == moment)
    }

    /// One exchange while time stands still, with the inputs up to the next request.
    fn exchange_without_step(
        &mut self,
        moment: Moment,
        sensors: &Sensors,
    ) -> Result<Actuators, Box<Difference>> {
        self.tell_reports(usize::MAX);
        let waiting = self.inputs.len();
        let mut heard = false;
        while let Some(input) = self.inputs.pop_front_if(|input| {
            let is_now = input.moment == moment || (!heard && input.moment == Moment::Between);
            is_now && input.step == self.step && !matches!(input.what, Recorded::Request(_))
        }) {
            heard |= input.moment == moment;
            self.take(input.what);
        }
        let actuators = self.autopilot.hold(sensors, moment == Moment::OnGround);
        while self.autopilot.pop_event().is_some() {}
        let logged = self.next_request(moment);
        self.ask(moment, logged)?;
        if self.inputs.len() == waiting
            && let Some(input) = self.inputs.pop_front()
        {
            let flown = format!("nothing of this kind comes before an input of {moment:?}");
            return Err(self.differ("recorded", format!("{input:?}"), flown));
        }
        Ok(actuators)
    }

    fn differ(&self, signal: &str, logged: String, flown: String) -> Box<Difference> {
        let (step, time) = (self.step, self.plant.time());
        Box::new(Difference { step, time, signal: signal.to_owned(), logged, flown })
    }

    /// The request that left in the present exchange, if one did.
    fn next_request(&mut self, moment: Moment) -> Option<PlantRequest> {
        let is_it = |input: &mut Input| {
            input.step == self.step
                && input.moment == moment
                && matches!(input.what, Recorded::Request(_))
        };
        match self.inputs.pop_front_if(is_it)?.what {
            Recorded::Request(request) => Some(request),
            _ => None,
        }
    }

    fn take(&mut self, what: Recorded) {
        match what {
            Recorded::Intent(intent) => self.autopilot.handle_intent(intent),
            Recorded::PlantLost => self.autopilot.plant_lost(),
            Recorded::PlantBack => self.autopilot.plant_back(),
            // Requests are what comes out of the autopilot.
            Recorded::Request(_) => {}
        }
        while self.autopilot.pop_event().is_some() {}
    }

    /// The request that leaves now must be the one of the log; the plant does what it says.
    fn ask(&mut self, moment: Moment, logged: Option<PlantRequest>) -> Checked {
        let flown = self.autopilot.next_request();
        if logged.is_none() && self.may_be_cut_off() {
            return Ok(());
        }
        let is_lost = logged.is_none() && self.is_damaged_at(self.plant.time());
        if !is_lost && flown != logged {
            let [logged, flown] = [logged, flown].map(|request| match request {
                Some(request) => format!("{request:?}"),
                None => "none".to_owned(),
            });
            return Err(self.differ("request to the plant", logged, flown));
        }
        let Some(PlantRequest { number, action }) = flown else { return Ok(()) };
        self.hash.request(self.step, moment, &action);
        match action {
            PlantAction::Fault(request) => {
                let reply = self.plant.request(&request);
                self.replies.push_back(PlantReport::FaultReply { request: number, reply });
            }
            PlantAction::ListFaults => self.plant.list_faults(),
            PlantAction::Restart => self.over = true,
            PlantAction::Pace(pace) => {
                let at = self.plant.time();
                self.replies.push_back(PlantReport::Paced { request: Some(number), pace, at });
            }
        }
        Ok(())
    }

    /// What the log should have here may have been cut off with its end.
    fn may_be_cut_off(&self) -> bool {
        self.is_cut && self.inputs.is_empty() && self.step + 1 >= self.steps
    }

    /// The log is damaged at this tick.
    fn is_damaged_at(&self, time: SimTime) -> bool {
        self.recording.is_damaged_at(time.as_micros())
    }

    /// A difference where the log is damaged is none of the flight.
    fn unless_damaged(&self, time: SimTime, checked: Checked) -> Checked {
        if self.is_damaged_at(time) { Ok(()) } else { checked }
    }

    /// Reports of the plant to the autopilot, as many as an exchange carries.
    fn tell_reports(&mut self, count: usize) {
        for _ in 0..count {
            let Some(report) = self.replies.pop_front().or_else(|| self.plant.pop_report()) else {
                return;
            };
            self.autopilot.handle_report(&report);
        }
    }

    fn check_truth(&mut self, time: SimTime) -> Checked {
        // A plant sends its truth only where somebody records.
        if !self.truth.reach(time) {
            return Ok(());
        }
        let truth = self.plant.truth().to_row(self.plant.on_ground(), self.plant.is_broken());
        let checked = self.truth.check(self.step, time, TRUTH_FIELDS.into_iter().zip(truth));
        self.unless_damaged(time, checked)
    }

    fn check_rows(&mut self, time: SimTime, sensors: &Sensors, output: &StepOutput) -> Checked {
        let step = self.step;
        self.check_truth(time)?;
        let signals = Sensors::NAMES.into_iter().zip(sensors.to_array());
        let checked = self.sensors.check(step, time, signals);
        self.unless_damaged(time, checked)?;
        let commands = *output.actuators.commands.as_array();
        let checked = self.commands.check(step, time, COMMAND_NAMES.into_iter().zip(commands));
        self.unless_damaged(time, checked)?;
        let control = control_values(&output.log);
        let checked = self.control.check(step, time, CONTROL_NAMES.into_iter().zip(control));
        self.unless_damaged(time, checked)?;
        let checked = self.hashes.check(time, &self.hash);
        self.unless_damaged(time, checked)
    }
}
