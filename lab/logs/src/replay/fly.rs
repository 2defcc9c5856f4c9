//! The closed loop in one process, with the inputs of a log at their places, compared with its rows.

use core::fmt;
use std::collections::VecDeque;

use autopilot::recorder::{
    Moment, Recorded, RunHash, command_names, control_names, control_values,
};
use icd::fault::PlantRequest;
use icd::record::{FieldName, truth_fields};
use icd::{EffectorList, Sensors, SimTime};
use plant_sim::Plant;

use super::compare::{Difference, Hashes, Rows};
use super::recording::{Input, Recording};
use host_io::problem::{At as _, Problem, problem};
use lab_judges::closed_loop::{Exchange, Flight, Held, Tick};

/// What came of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayVerdict {
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

/// What a [`ReplayVerdict`] comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The same flight, as far as the log goes.
    Same,
    /// All that can be read of a damaged log is the same.
    SameWhereReadable,
    Different,
    /// It differs behind a damage, which may have taken an input: unknown.
    Unknown,
}

impl ReplayVerdict {
    /// The same flight, as far as the log goes, and no step of it is missing.
    pub fn is_same(&self) -> bool {
        self.outcome() == Outcome::Same
    }

    /// What it comes to.
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

impl fmt::Display for ReplayVerdict {
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

/// Flies the log again up to its end, its first difference, or the ground; `each` gets the number of each step.
pub fn fly(recording: &Recording, each: &mut dyn FnMut(u64)) -> Result<ReplayVerdict, Problem> {
    let mut replay = Replay::new(recording, each);
    // A log has its own end.
    let until = SimTime::from_micros(u64::MAX);
    let mut flight = Flight::of(&recording.plant.setup, &recording.settings(), until)
        .at("the plant cannot start")?;
    let difference = replay.fly(&mut flight).err();
    let steps = flight.steps();
    if let Some(failure) = flight.failure().filter(|_| steps < recording.steps()) {
        return Err(problem!("after {steps} of its control steps {failure}"));
    }
    Ok(ReplayVerdict {
        steps: replay.hash.steps(),
        run_hash: replay.hash.hex(),
        logged_hash: recording.run_hash().map(str::to_owned),
        difference: difference.map(|difference| *difference),
        missing: recording.missing().len() as u64,
        due: replay.hash.steps().div_ceil(recording.row_every()),
        first_damage: recording.first_damage_us().map(SimTime::from_micros),
    })
}

/// Puts the inputs of a log into the loop, and compares what comes out with its rows.
struct Replay<'a> {
    recording: &'a Recording,
    each: &'a mut dyn FnMut(u64),
    inputs: VecDeque<Input>,
    hash: RunHash,
    sensors: Rows<'a>,
    commands: Rows<'a>,
    control: Rows<'a>,
    truth: Rows<'a>,
    names: Names,
    hashes: Hashes<'a>,
    is_cut: bool,
}

type Checked = Result<(), Box<Difference>>;

/// Columns whose names follow the effectors.
struct Names {
    truth: Vec<FieldName>,
    commands: Vec<FieldName>,
    control: Vec<FieldName>,
}

impl Names {
    fn new(effectors: &EffectorList) -> Self {
        Self {
            truth: truth_fields(effectors).collect(),
            commands: command_names(effectors),
            control: control_names(effectors),
        }
    }
}

fn differ(exchange: &Exchange, signal: &str, logged: String, flown: String) -> Box<Difference> {
    let Exchange { step, time, .. } = *exchange;
    Box::new(Difference { step, time, signal: signal.to_owned(), logged, flown })
}

impl<'a> Replay<'a> {
    fn new(recording: &'a Recording, each: &'a mut dyn FnMut(u64)) -> Self {
        let (log, every) = (&recording.log, recording.row_every());
        Self {
            inputs: recording.inputs(),
            hash: RunHash::default(),
            sensors: Rows::new(log, "sensors", every),
            commands: Rows::new(log, "commands", every),
            control: Rows::new(log, "control", every),
            truth: Rows::new(log, "truth", every),
            names: Names::new(&recording.control.settings.model.effectors.list),
            hashes: Hashes::new(log),
            is_cut: recording.run_hash().is_none(),
            recording,
            each,
        }
    }

    /// Every exchange of the log; the first difference ends it.
    fn fly(&mut self, flight: &mut Flight) -> Checked {
        loop {
            let (step, time) = (flight.steps(), flight.next_time());
            let here = Exchange { step, time, moment: Moment::Step };
            // One step more than the log has: only that one moves the plant on to the ground.
            let is_logged = step < self.recording.steps();
            let inputs = if is_logged { self.inputs(&here) } else { Vec::new() };
            match flight.step(inputs) {
                Some(tick) if is_logged => self.check_tick(&tick)?,
                Some(_) => return Ok(()),
                None => break,
            }
            self.hold(flight, Moment::Holding)?;
        }
        if flight.end().on_ground {
            let time = flight.end().time;
            let here = Exchange { step: flight.steps(), time, moment: Moment::OnGround };
            self.check_truth(&here, flight.plant())?;
            self.hold(flight, Moment::OnGround)?;
        }
        Ok(())
    }

    /// Exchanges without a control step, as long as something was taken or left in one before the next step.
    fn hold(&mut self, flight: &mut Flight, moment: Moment) -> Checked {
        loop {
            let here = Exchange { step: flight.steps(), time: flight.end().time, moment };
            let mut now = self.inputs.iter().take_while(|input| input.step == here.step);
            if !now.any(|input| input.moment == moment) {
                return Ok(());
            }
            let waiting = self.inputs.len();
            let inputs = self.inputs(&here);
            let Some(Held { exchange, request, .. }) = flight.hold(inputs) else { return Ok(()) };
            self.check_request(&exchange, request)?;
            // Nothing was taken, and without an error this would go on for ever.
            if self.inputs.len() == waiting
                && let Some(input) = self.inputs.pop_front()
            {
                let flown = format!("nothing of this kind comes before an input of {moment:?}");
                return Err(differ(&exchange, "recorded", format!("{input:?}"), flown));
            }
        }
    }

    /// The inputs of an exchange. What came between two belongs to the first one that has none of its own before it.
    fn inputs(&mut self, here: &Exchange) -> Vec<Recorded> {
        let Exchange { step, moment, .. } = *here;
        let (mut taken, mut all) = (false, Vec::new());
        while let Some(input) = self.inputs.pop_front_if(|input| {
            let between = moment != Moment::Step && !taken;
            let is_now = moment == Moment::Step
                || input.moment == moment
                || (between && input.moment == Moment::Between);
            is_now && input.step == step && !matches!(input.what, Recorded::Request(_))
        }) {
            taken |= input.moment == moment;
            all.push(input.what);
        }
        all
    }

    fn check_tick(&mut self, tick: &Tick<'_>) -> Checked {
        let commands = self.names.commands.len();
        self.hash.step(tick.exchange.time, tick.sensors, &tick.log.actuators(), commands);
        (self.each)(tick.exchange.step);
        self.check_rows(tick)?;
        self.check_request(&tick.exchange, tick.request)
    }

    /// The request that left in an exchange, if one did.
    fn logged_request(&mut self, exchange: &Exchange) -> Option<PlantRequest> {
        let is_it = |input: &mut Input| {
            input.step == exchange.step
                && input.moment == exchange.moment
                && matches!(input.what, Recorded::Request(_))
        };
        match self.inputs.pop_front_if(is_it)?.what {
            Recorded::Request(request) => Some(request),
            _ => None,
        }
    }

    /// The request that leaves now must be the one of the log.
    fn check_request(&mut self, exchange: &Exchange, flown: Option<&PlantRequest>) -> Checked {
        let logged = self.logged_request(exchange);
        if logged.is_none() && self.may_be_cut_off(exchange) {
            return Ok(());
        }
        let is_lost = logged.is_none() && self.is_damaged_at(exchange.time);
        if !is_lost && flown != logged.as_ref() {
            let [logged, flown] = [logged.as_ref(), flown].map(|request| match request {
                Some(request) => format!("{request:?}"),
                None => "none".to_owned(),
            });
            return Err(differ(exchange, "request to the plant", logged, flown));
        }
        if let Some(request) = flown {
            self.hash.request(exchange.step, exchange.moment, &request.action);
        }
        Ok(())
    }

    /// What the log should have here may have been cut off with its end.
    fn may_be_cut_off(&self, exchange: &Exchange) -> bool {
        self.is_cut && self.inputs.is_empty() && exchange.step + 1 >= self.recording.steps()
    }

    /// The log is damaged at this tick.
    fn is_damaged_at(&self, time: SimTime) -> bool {
        self.recording.is_damaged_at(time.as_micros())
    }

    /// A difference where the log is damaged is none of the flight.
    fn unless_damaged(&self, time: SimTime, checked: Checked) -> Checked {
        if self.is_damaged_at(time) { Ok(()) } else { checked }
    }

    fn check_truth(&mut self, exchange: &Exchange, plant: &Plant) -> Checked {
        let Exchange { step, time, .. } = *exchange;
        // A plant sends its truth only to a recorder.
        if !self.truth.reach(time) {
            return Ok(());
        }
        let truth = plant.truth().to_row(plant.on_ground(), plant.is_broken());
        let names = self.names.truth.iter().map(FieldName::as_str);
        let checked = self.truth.check(step, time, names.zip(truth.iter().copied()));
        self.unless_damaged(time, checked)
    }

    fn check_rows(&mut self, tick: &Tick<'_>) -> Checked {
        let Exchange { step, time, .. } = tick.exchange;
        self.check_truth(&tick.exchange, tick.plant)?;
        let stamps = tick.sensors.stamps();
        let times = stamps.map(|stamp| stamp.time.as_micros() as f64);
        let valid = stamps.map(|stamp| f64::from(u8::from(stamp.valid)));
        let signals = Sensors::NAMES.into_iter().zip(tick.sensors.to_array());
        let signals = signals.chain(Sensors::TIMES.into_iter().zip(times));
        let signals = signals.chain(Sensors::VALID.into_iter().zip(valid));
        let checked = self.sensors.check(step, time, signals);
        self.unless_damaged(time, checked)?;
        let count = self.names.commands.len();
        let commands = tick.log.commands.first(count).iter().copied();
        let names = self.names.commands.iter().map(FieldName::as_str);
        let checked = self.commands.check(step, time, names.zip(commands));
        self.unless_damaged(time, checked)?;
        let control = control_values(tick.log, count);
        let names = self.names.control.iter().map(FieldName::as_str);
        let checked = self.control.check(step, time, names.zip(control));
        self.unless_damaged(time, checked)?;
        let checked = self.hashes.check(time, &self.hash);
        self.unless_damaged(time, checked)
    }
}
