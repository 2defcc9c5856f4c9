//! Entries to messages of a log.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::Arc;

use icd::fault::{FaultReply, NO_ANSWER, PlantAction, Target, TargetClass};
use icd::{EffectorList, SimTime};
use ulog::format::Format;
use ulog::writer::{Data, Definitions, Level, Row, Topic, Value};

use super::entry::fault_kinds;
use super::topics::{self, Place};
use super::{
    Begin, End, Entry, LogRate, Moment, Recorded, RunHash, Selection, Step, command_text,
    parameter_hash,
};
use flight_management::command::{Command, Configuration, Outcome, ScriptCommand};
use flight_management::event::{Event, EventKind};
use flight_management::event_text::{self, Severity};
use flight_management::fault_list::FaultList;
use flight_management::parameters::{Kind, Parameters, table};
use flight_management::script::{Script, ScriptEvent};

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
        let effectors = header.model.effectors.list;
        header.row_every = rate.row_every(period_us);
        let parameters = Parameters {
            gains: header.gains,
            limits: header.limits,
            navigation: header.navigation,
            ..*parameters
        };
        let values = || table().iter().map(|row| (row.name, row.value(&parameters)));
        header.parameter_hash = parameter_hash(values());
        let scripts = header.script.iter().cloned().collect();
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

    /// Adds an entry other than the beginning or the end of a flight. It is written half a second of simulation
    /// time later, unless every step has its rows.
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

#[expect(clippy::cast_possible_truncation, reason = "as parameters travel over MAVLink")]
fn wire_value(kind: Kind, value: f64) -> Value<'static> {
    match kind {
        Kind::Int => Value::I32(value as i32),
        Kind::Real => Value::F32(value as f32),
    }
}

#[cfg(test)]
mod tests;
