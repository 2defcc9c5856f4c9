//! Entries to messages of a log, and which control steps get rows: 20 each second, and all of them around events.
//!
//! ```text
//! entries ──> [ the last tenth of a second, in order ] ──> rows of every n-th step, and of all steps that are near an event
//! ```
//!
//! An entry is written a tenth of a second of simulation time after it came, so that an event can still select the steps before it.
//! Entries of all kinds are written in the order in which they came; only rows of control steps are ever left out.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::Arc;

use icd::fault::{FaultReply, NO_ANSWER, PlantAction, Target, TargetClass};
use icd::{EffectorList, SimTime};
use ulog::format::Format;
use ulog::writer::{Data, Definitions, Level, Row, Topic, Value};

use super::entry::{fault_kinds, is_stream};
use super::topics::{self, Place};
use super::{Begin, End, Entry, Moment, Recorded, RunHash, Step, command_text, parameter_hash};
use flight_management::command::{Command, Configuration, Outcome, ScriptCommand};
use flight_management::event::{Event, EventKind};
use flight_management::event_text::{self, Severity};
use flight_management::fault_list::FaultList;
use flight_management::parameters::{Kind, Parameters, table};
use flight_management::script::{Script, ScriptEvent};
use flight_management::vehicle::{Mode, VehicleEvent};

/// Longest run header of a plant, bytes; a longer one is left out.
const PLANT_HEADER_MAX: usize = 60_000;
/// A damaged section of a log loses no more than about this, bytes.
const SYNC_EVERY: u64 = 64 * 1024;
/// Interval of rows with the run hash so far, us of simulation time.
const HASH_EVERY_US: u32 = 100_000;
/// Finished scripts that may still cause events, besides the running one.
const SCRIPTS_MAX: usize = 8;
/// Inputs whose outcome is still open; the vehicle has only a few of them open at a time.
const COMMANDS_MAX: usize = 64;

#[derive(Debug)]
pub struct Encoder<W> {
    data: Data<W>,
    effectors: EffectorList,
    topics: Topics,
    row: Row,
    selection: Selection,
    hash: RunHash,
    /// Control steps from one row of the topic `hash` to the next.
    hash_every: u64,
    /// Simulation time of the last entry that has one.
    time: SimTime,
    /// Time of the last text: the next one is not earlier, so that causes precede effects.
    text_time: SimTime,
    /// Texts of inputs by their number, the latest one last.
    commands: VecDeque<(u32, String, Option<Target>)>,
    /// Reason why the last input was refused.
    refusal: Option<String>,
    /// The rows of the topic `fault`: repeated reports of the plant's list are written once.
    fault_rows: FaultList,
    /// Size at which a sync message is due, bytes.
    sync_at: u64,
    parameters: Parameters,
    /// Of the plant's header; empty when it is complete.
    pieces: Vec<Option<Box<[u8]>>>,
    plant_header_is_there: bool,
    /// The faults as the plant has reported them: a repeated report is not recorded again.
    faults: FaultList,
    /// The script that began last.
    running: Option<Arc<Script>>,
    /// Scripts that may still cause events, the latest one last.
    scripts: VecDeque<Arc<Script>>,
}

#[derive(Debug)]
struct Topics {
    sensors: Topic,
    commands: Topic,
    control: Topic,
    truth: Topic,
    vehicle: Topic,
    estimator_status: Topic,
    fault: Topic,
    recorded: Topic,
    hash: Topic,
}

impl<W: Write> Encoder<W> {
    /// Begins a log. Gains, limits and guidance come from the header, the other parameters from `parameters`.
    pub fn begin(out: W, begin: Begin, parameters: &Parameters, rate: LogRate) -> io::Result<Self> {
        let Begin { time, mut header } = begin;
        let period_us = header.period_us;
        let effectors = header.settings.model.effectors.list;
        header.row_every = rate.row_every(period_us);
        let parameters = Parameters {
            gains: header.settings.gains,
            limits: header.settings.limits,
            navigation: header.settings.navigation,
            ..*parameters
        };
        let values = || table().iter().map(|row| (row.name, row.value(&parameters)));
        header.parameter_hash = parameter_hash(values());
        let scripts = header.settings.script.iter().cloned().collect();
        let json = serde_json::to_string(&header)?;
        let mut log = Definitions::begin(out, time.as_micros())?;
        log.info("sys_name", Value::Text("Two-Step"))?;
        log.info("ver_sw", Value::Text(&header.version))?;
        log.info("ver_wire", Value::U64(header.wire_version.into()))?;
        log.info("session", Value::Text(&header.session))?;
        log.info("control_header", Value::Text(&json))?;
        log.info("fault_kinds", Value::Text(&fault_kinds()))?;
        let formats = [
            topics::sensors(),
            topics::commands(&effectors),
            topics::control(&effectors),
            topics::truth(&effectors),
            topics::vehicle(),
            topics::estimator_status(),
            topics::fault(),
            topics::recorded(),
            topics::hash(),
        ];
        for format in &formats {
            log.format(format)?;
        }
        for row in table() {
            log.parameter(row.name, wire_value(row.kind, row.value(&parameters)))?;
        }
        let mut data = log.data();
        let mut subscribe = |format: &Format| data.subscribe(format);
        let [sensors, commands, control, truth, vehicle, estimate, fault, recorded, hash] =
            &formats;
        let topics = Topics {
            sensors: subscribe(sensors)?,
            commands: subscribe(commands)?,
            control: subscribe(control)?,
            truth: subscribe(truth)?,
            vehicle: subscribe(vehicle)?,
            estimator_status: subscribe(estimate)?,
            fault: subscribe(fault)?,
            recorded: subscribe(recorded)?,
            hash: subscribe(hash)?,
        };
        Ok(Self {
            data,
            effectors,
            topics,
            row: Row::default(),
            selection: Selection::new(rate, period_us, time),
            hash: RunHash::default(),
            hash_every: u64::from(HASH_EVERY_US / period_us.max(1)).max(1),
            time,
            text_time: time,
            commands: VecDeque::new(),
            refusal: None,
            fault_rows: FaultList::default(),
            sync_at: SYNC_EVERY,
            parameters,
            pieces: Vec::new(),
            plant_header_is_there: false,
            faults: FaultList::default(),
            running: None,
            scripts,
        })
    }

    /// Adds an entry other than the beginning or the end of a flight. It is written a tenth of a second of
    /// simulation time later, unless every step has its rows.
    pub fn add(&mut self, entry: Entry) -> io::Result<()> {
        self.selection.push(entry);
        self.write_selected()
    }

    /// Writes the waiting entries, with all rows: no control step comes for a while.
    pub fn settle(&mut self) -> io::Result<()> {
        self.selection.settle();
        self.write_selected()
    }

    fn write_selected(&mut self) -> io::Result<()> {
        while let Some((entry, has_rows)) = self.selection.pop() {
            self.write(entry, has_rows)?;
        }
        Ok(())
    }

    fn write(&mut self, entry: Entry, has_rows: bool) -> io::Result<()> {
        // Before an entry, so that a mark stands between whole messages.
        if self.written() >= self.sync_at {
            self.sync()?;
        }
        match entry {
            Entry::Begin(_) | Entry::End(_) => Ok(()),
            Entry::Step(step) => self.step(&step, has_rows),
            Entry::Parameters(parameters) => self.change_parameters(&parameters),
            Entry::Recorded { time, moment, what } => self.recorded(time, moment, &what),
            Entry::Fault { time, entry } => {
                self.time = time;
                if !self.fault_rows.handle_event(&EventKind::Fault(entry)) {
                    return Ok(());
                }
                topics::fault_row(&mut self.row, time, &entry);
                self.data.row(self.topics.fault, &self.row)
            }
            Entry::Event(event) => self.event(&event),
            Entry::Text { time, severity, text } => {
                self.time = time;
                // The refusal of an input is in the log already, with the text of the input.
                if self.refusal.take_if(|why| *why == text).is_some() {
                    return Ok(());
                }
                self.text_at(time, Level::from_number(severity), &text)
            }
            Entry::Ground { time, row: truth } => {
                self.time = time;
                topics::truth_row(&mut self.row, time, &truth);
                self.data.row(self.topics.truth, &self.row)
            }
            Entry::Piece { index, count, bytes } => self.piece(index, count, bytes),
        }
    }

    fn step(&mut self, step: &Step, has_rows: bool) -> io::Result<()> {
        self.time = step.time;
        self.hash.step(step.time, &step.sensors, &step.actuators, self.effectors.len());
        if has_rows {
            self.rows(step)?;
        }
        // The hash takes every step, also those without rows: a replay has them all.
        if !self.hash.steps().is_multiple_of(self.hash_every) {
            return Ok(());
        }
        topics::hash_row(&mut self.row, step.time, &self.hash);
        self.data.row(self.topics.hash, &self.row)
    }

    fn rows(&mut self, step: &Step) -> io::Result<()> {
        let Self { data, effectors, topics, row, .. } = self;
        let count = effectors.len();
        topics::sensors_row(row, step.time, &step.sensors);
        data.row(topics.sensors, row)?;
        topics::commands_row(row, step.time, &step.actuators, count);
        data.row(topics.commands, row)?;
        topics::control_row(row, step.time, &step.log, count);
        data.row(topics.control, row)?;
        topics::vehicle_row(row, step.time, step.mode, step.references, step.terminated);
        data.row(topics.vehicle, row)?;
        if let Some(status) = &step.log.state.estimate {
            topics::estimator_status_row(row, step.time, status);
            data.row(topics.estimator_status, row)?;
        }
        if let Some(truth) = &step.truth {
            topics::truth_row(row, step.time, truth);
            data.row(topics.truth, row)?;
        }
        Ok(())
    }

    fn recorded(&mut self, time: SimTime, moment: Moment, what: &Recorded) -> io::Result<()> {
        self.time = time;
        let mut step = self.hash.steps();
        if let Recorded::Request(request) = what {
            if moment == Moment::Step {
                // It is sent after the step of its exchange.
                step = step.saturating_sub(1);
            }
            self.hash.request(step, moment, &request.action);
        }
        let json = serde_json::to_vec(what)?;
        let pieces = json.chunks(topics::PIECE_CHARS);
        let parts = u16::try_from(pieces.len()).map_err(|_| io::ErrorKind::InvalidInput)?;
        let place = Place { time, step, moment };
        for (part, piece) in (0..parts).zip(pieces) {
            topics::recorded_row(&mut self.row, place, part, parts, piece);
            self.data.row(self.topics.recorded, &self.row)?;
        }
        match what {
            Recorded::Intent(intent) => {
                // The texts of later events depend on them.
                match &intent.command {
                    Command::Configuration(Configuration::Gains(gains)) => {
                        self.parameters.gains = **gains;
                    }
                    Command::Script(ScriptCommand::Run(script)) => {
                        if self.scripts.len() >= SCRIPTS_MAX {
                            self.scripts.pop_front();
                        }
                        self.scripts.push_back(Arc::clone(script));
                    }
                    _ => {}
                }
                let Some(text) = command_text(&intent.command, &self.effectors) else {
                    return Ok(());
                };
                self.text(Level::Info, &format!("Input: {text}"))?;
                if self.commands.len() >= COMMANDS_MAX {
                    self.commands.pop_front();
                }
                let target = match &intent.command {
                    Command::Plant(PlantAction::Fault(fault)) => fault.target(),
                    _ => None,
                };
                self.commands.push_back((intent.number, text, target));
                Ok(())
            }
            Recorded::Request(_) | Recorded::PlantLost | Recorded::PlantBack => Ok(()),
        }
    }

    fn event(&mut self, event: &Event) -> io::Result<()> {
        // Reports from before a silence stay valid: the autopilot requests the list again, and the recorder writes only differences.
        if event.kind != EventKind::PlantBack && !self.faults.handle_event(&event.kind) {
            return Ok(());
        }
        let text = match event.kind {
            EventKind::Outcome { number, outcome } => self.refused(number, &outcome),
            EventKind::Script { script, event } => {
                // The running one first: several may have the same text.
                let mut known = self.running.iter().chain(self.scripts.iter().rev());
                let script = known.find(|known| known.id() == script).cloned();
                let text = script.as_ref().map(|script| event_text::of_script(Some(script), event));
                if event == ScriptEvent::Began {
                    self.running = script;
                }
                text
            }
            ref kind => event_text::of_event(kind, &self.parameters, &self.effectors),
        };
        let Some((severity, text)) = text else { return Ok(()) };
        self.text_at(event.time, Level::from_number(severity as u8), &text)
    }

    /// The text of a refusal: the input and the reason.
    fn refused(&mut self, number: u32, outcome: &Outcome) -> Option<(Severity, String)> {
        let place = self.commands.iter().position(|(command, ..)| *command == number)?;
        let (_, input, target) = self.commands.remove(place)?;
        let why = match outcome {
            Outcome::Done => return None,
            Outcome::Refused(refusal) => refusal.to_string(),
            Outcome::Plant(FaultReply::Refused(refusal)) => {
                refusal.described(TargetClass::of_request(target, &self.effectors)).to_string()
            }
            Outcome::Plant(_) => return None,
            Outcome::NoAnswer => NO_ANSWER.to_owned(),
        };
        let text = format!("Input refused: {input}: {why}");
        self.refusal = Some(why);
        Some((Severity::Warning, text))
    }

    fn piece(&mut self, index: u16, count: u16, bytes: Box<[u8]>) -> io::Result<()> {
        let (index, count) = (usize::from(index), usize::from(count));
        if self.plant_header_is_there || index >= count {
            return Ok(());
        }
        // Pieces of another count are of another header.
        if self.pieces.len() != count {
            self.pieces = vec![None; count];
        }
        self.pieces[index] = Some(bytes);
        if self.pieces.iter().any(Option::is_none) {
            return Ok(());
        }
        self.plant_header_is_there = true;
        let all: Vec<u8> =
            std::mem::take(&mut self.pieces).into_iter().flatten().flatten().collect();
        if all.len() > PLANT_HEADER_MAX {
            return self.text(Level::Warning, "The plant's header is too long for a log");
        }
        self.data.info("plant_header", Value::Text(&String::from_utf8_lossy(&all)))?;
        // From here on a log can be replayed, so it is not left in a buffer.
        self.flush()
    }

    fn change_parameters(&mut self, now: &Parameters) -> io::Result<()> {
        for row in table() {
            let value = row.value(now);
            // By value, so only what has changed takes room.
            if value != row.value(&self.parameters) {
                self.data.parameter(row.name, wire_value(row.kind, value))?;
            }
        }
        self.parameters = *now;
        Ok(())
    }

    /// A text at the time of the last entry.
    pub fn text(&mut self, level: Level, text: &str) -> io::Result<()> {
        self.text_at(self.time, level, text)
    }

    fn text_at(&mut self, time: SimTime, level: Level, text: &str) -> io::Result<()> {
        self.text_time = self.text_time.max(time);
        // Readers of the log print it on terminals.
        let text = text.replace(char::is_control, "?");
        self.data.text(level, self.text_time.as_micros(), &text)
    }

    /// Writes a mark from which a reader can continue after damage.
    pub fn sync(&mut self) -> io::Result<()> {
        self.sync_at = self.written() + SYNC_EVERY;
        self.data.sync()
    }

    /// Bytes written so far.
    pub fn written(&self) -> u64 {
        self.data.written()
    }

    /// Writes run hash, number of steps and the reason why the log ends. Returns the output.
    pub fn end(mut self, why: End) -> io::Result<W> {
        if why == End::Full {
            // There is no room for the waiting entries.
            self.text(Level::Warning, "The log ends here: it has reached its limit")?;
        } else {
            self.settle()?;
        }
        self.data.info("run_hash", Value::Text(&self.hash.hex()))?;
        self.data.info("control_steps", Value::U64(self.hash.steps()))?;
        self.data.info("end", Value::Text(&why.to_string()))?;
        self.data.finish()
    }

    pub fn flush(&mut self) -> io::Result<()> {
        self.data.flush()
    }
}

// As parameters travel over MAVLink.
fn wire_value(kind: Kind, value: f64) -> Value<'static> {
    match kind {
        Kind::Int => Value::I32(value as i32),
        Kind::Real => Value::F32(value as f32),
    }
}

/// Selection of the control steps that get rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum LogRate {
    /// 20 each second, and all of them from 0.1 s before to 0.4 s after an event
    #[default]
    Events,
    /// All of them
    Full,
}

/// Before an event all steps of this time get rows, us of simulation time: a tenth of a second, and some steps in which the plant
/// has a fault and has not reported it yet.
const BEFORE_US: u64 = 110_000;
/// After an event all steps of this time get rows, us.
const AFTER_US: u64 = 400_000;
/// Away from events, the longest time between two rows, us.
const EVERY_US: u32 = 50_000;
/// Rows that events can add to those of quiet flight at once: one event at the shortest usual period of 2 ms, and a part of another.
/// With [`CREDIT_EVERY_US`] a log keeps to 4 MB a minute whatever happens (an intermittent fault, a compensator that comes and goes).
const CREDIT_MAX: u32 = 350;
/// Such a row comes back after this time, us.
const CREDIT_EVERY_US: u64 = 250_000;
/// Entries that wait: the steps of [`BEFORE_US`] at the shortest period, and as many entries of other kinds. If there are
/// more, the oldest are written early, with their rows.
const WAITING_MAX: usize = 256;
/// Changes of a reference in one step that count as an event: altitude, m; roll, rad; airspeed, m/s.
const REFERENCE_STEPS: [f64; 3] = [1.0, 0.017_453_292_519_943_295, 0.5];

impl LogRate {
    /// Interval of rows away from events, control steps.
    pub fn row_every(self, period_us: u32) -> u32 {
        match self {
            Self::Full => 1,
            Self::Events => (EVERY_US / period_us.max(1)).max(1),
        }
    }
}

/// State of a step that reveals a change in the next one: compensator active, mode, terminated, references.
type Seen = (bool, Mode, bool, [f64; 3]);

/// Waiting entries, and the state that decides about their rows.
#[derive(Debug)]
pub struct Selection {
    rate: LogRate,
    every: u64,
    waiting: VecDeque<Entry>,
    /// Time of the latest control step.
    newest: SimTime,
    /// Steps up to here get their rows.
    full_until: Option<SimTime>,
    /// Rows that events can still add.
    credit: u32,
    /// Time of the step at which the credit last grew.
    credited: SimTime,
    /// Control steps that have been passed on.
    left: u64,
    seen: Option<Seen>,
    faults: FaultList,
    /// Everything that waits is passed on with its rows.
    settles: bool,
}

impl Selection {
    /// For a flight that begins at this time.
    pub fn new(rate: LogRate, period_us: u32, begin: SimTime) -> Self {
        let room = if rate == LogRate::Full { 1 } else { WAITING_MAX };
        Self {
            rate,
            every: rate.row_every(period_us).into(),
            waiting: VecDeque::with_capacity(room),
            newest: begin,
            full_until: None,
            credit: CREDIT_MAX,
            credited: begin,
            left: 0,
            seen: None,
            faults: FaultList::default(),
            settles: false,
        }
    }

    /// Adds the next entry.
    pub fn push(&mut self, entry: Entry) {
        self.settles = false;
        if self.rate == LogRate::Events
            && let Some(time) = self.event_time(&entry)
        {
            let until = SimTime::from_micros(time.as_micros().saturating_add(AFTER_US));
            self.full_until = self.full_until.max(Some(until));
        }
        self.waiting.push_back(entry);
    }

    /// The next entry to write, and whether its rows are written.
    pub fn pop(&mut self) -> Option<(Entry, bool)> {
        // With a full queue nothing that comes later can select these steps any more.
        let is_early = self.settles || self.waiting.len() >= WAITING_MAX;
        let mut has_rows = true;
        if let Entry::Step(Step { time, .. }) = *self.waiting.front()? {
            let age_us = self.newest.as_micros().saturating_sub(time.as_micros());
            let is_full = Some(time) <= self.full_until;
            // A step whose rows an event has selected already does not wait.
            if self.rate == LogRate::Events && age_us < BEFORE_US && !is_early && !is_full {
                return None;
            }
            has_rows = self.left.is_multiple_of(self.every)
                || is_early
                || (is_full && self.takes_credit(time));
            self.left += 1;
        }
        Some((self.waiting.pop_front()?, has_rows))
    }

    /// Marks all waiting entries for the next calls of [`Selection::pop`], with their rows: the simulation is paused, or the
    /// flight is over.
    pub fn settle(&mut self) {
        self.settles = true;
    }

    /// One more row around an event at this time, if there is room for it.
    fn takes_credit(&mut self, time: SimTime) -> bool {
        let since_us = time.as_micros().saturating_sub(self.credited.as_micros());
        let (more, rest_us) = (since_us / CREDIT_EVERY_US, since_us % CREDIT_EVERY_US);
        let more = u32::try_from(more).unwrap_or(u32::MAX);
        self.credit = self.credit.saturating_add(more).min(CREDIT_MAX);
        // What is left of the interval counts for the next row.
        self.credited = SimTime::from_micros(time.as_micros().saturating_sub(rest_us));
        let takes = self.credit > 0;
        self.credit -= u32::from(takes);
        takes
    }

    /// The time of an event that this entry is or reveals.
    fn event_time(&mut self, entry: &Entry) -> Option<SimTime> {
        match entry {
            Entry::Step(step) => {
                self.newest = step.time;
                let Step { mode, terminated, references, .. } = *step;
                let now = (step.log.compensator_active, mode, terminated);
                let (active, mode, terminated, before) =
                    // The first step has nothing before it that it could differ from.
                    self.seen.replace((now.0, now.1, now.2, references))?;
                let steps = before.iter().zip(&references).zip(REFERENCE_STEPS);
                let jumps = steps.into_iter().any(|((before, now), by)| (now - before).abs() >= by);
                (jumps || (active, mode, terminated) != now).then_some(step.time)
            }
            // Repeated reports of the plant's list are not events.
            Entry::Fault { time, entry } => {
                self.faults.handle_event(&EventKind::Fault(*entry)).then_some(*time)
            }
            Entry::Event(event) => is_event(&event.kind).then_some(event.time),
            Entry::Recorded { time, what, .. } => is_input(what).then_some(*time),
            Entry::Ground { time, .. } => Some(*time),
            _ => None,
        }
    }
}

fn is_event(kind: &EventKind) -> bool {
    matches!(
        kind,
        EventKind::AuthorityExhausted { .. }
            | EventKind::AuthorityRestored(_)
            | EventKind::CompensatorActive { .. }
            | EventKind::GroundContact
            | EventKind::PlantLost
            | EventKind::PlantBack
            | EventKind::Vehicle(
                VehicleEvent::Terminated | VehicleEvent::LinkLost(_) | VehicleEvent::LinkBack(_)
            )
    )
}

/// Streams are not events, and neither are commands without an effect on the flight.
fn is_input(what: &Recorded) -> bool {
    match what {
        Recorded::Intent(intent) => match &intent.command {
            Command::Plant(PlantAction::ListFaults | PlantAction::Pace(_))
            | Command::Configuration(Configuration::FaultInjection(_)) => false,
            command => !is_stream(command),
        },
        Recorded::PlantLost | Recorded::PlantBack => true,
        Recorded::Request(_) => false,
    }
}

#[cfg(test)]
mod tests;
