//! What a replay needs of a log: headers, inputs in order, and the rows to compare with.

use std::collections::{BTreeSet, VecDeque};

use autopilot::autopilot::Settings;
use autopilot::command::Command;
use autopilot::command::Configuration;
use autopilot::own_law::OwnLaw;
use autopilot::parameters::Parameters;
use autopilot::recorder::{ControlHeader, FLIGHT_RULES, Moment, Recorded};
use icd::wire;
use plant_sim::io::header::PlantHeader;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use ulog::format::Field;
use ulog::reader::{Damage, Log, Row, Topic};

use host_io::problem::{At as _, Problem, problem};

/// Topics with a row for each control step.
const COMPARED: [&str; 4] = ["sensors", "commands", "control", "truth"];

/// A log has 20 rows a second at least, so it leaves out no more than this at the shortest period.
const ROW_EVERY_MAX: u32 = 50;

/// An input, and where in the flight it came.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// Control steps flown before it.
    pub step: u64,
    pub moment: Moment,
    /// Simulation time, s.
    pub t_s: f64,
    pub what: Recorded,
}

/// A log that can be flown again.
#[derive(Debug)]
pub struct Recording {
    pub(super) log: Log,
    pub(super) control: ControlHeader,
    pub(super) plant: PlantHeader,
    own_law: Option<OwnLaw>,
    inputs: Vec<Input>,
    steps: u64,
    missing: BTreeSet<u64>,
    /// First and last time of each damaged place, us.
    damaged: Vec<(u64, u64)>,
}

impl Recording {
    pub fn of(log: Log) -> Result<Self, Problem> {
        Self::with_law(log, None)
    }

    /// Of a log, with the law that flies where `CTL_LAW` is 9.
    pub fn with_law(log: Log, own_law: Option<OwnLaw>) -> Result<Self, Problem> {
        let name = log.info_text("sys_name").unwrap_or("missing");
        if name != "Two-Step" {
            return Err(problem!("it was not written by Two-Step (sys_name is {name})"));
        }
        // Before the rest: a header of other rules may have another shape too.
        let Rules { flight_rules } = header(&log, "control_header", "")?;
        if flight_rules != FLIGHT_RULES {
            return Err(problem!(
                "its flight follows rules {flight_rules}, this program has rules {FLIGHT_RULES}: \
                 fly it again with the program that wrote it"
            ));
        }
        let control: ControlHeader = header(&log, "control_header", "")?;
        if control.joined_in_flight {
            return Err(problem!(
                "the autopilot joined a flight under way, so the state at the log's first tick is not known"
            ));
        }
        control.settings.model.validate().at("the model in its control_header cannot be flown")?;
        let Settings { gains, limits, navigation, .. } = control.settings;
        let brings_law = own_law.as_ref().map(OwnLaw::role);
        let parameters =
            Parameters { gains, limits, navigation, brings_law, ..Parameters::default() };
        parameters.check().at("the parameters in its control_header cannot be flown")?;
        let when = "; it comes over the link with the first ticks, and the log may end before";
        let plant: PlantHeader = header(&log, "plant_header", when)?;
        let inputs = inputs(&log)?;
        // All of them before the flight, because in flight nothing checks them again.
        for (input, number) in inputs.iter().zip(1..) {
            let mut changed = parameters;
            let Recorded::Intent(intent) = &input.what else { continue };
            match &intent.command {
                Command::Configuration(Configuration::Gains(gains)) => changed.gains = **gains,
                Command::Configuration(Configuration::Limits(limits)) => changed.limits = *limits,
                Command::Configuration(Configuration::Navigation(navigation)) => {
                    changed.navigation = *navigation;
                }
                _ => continue,
            }
            let place = format_args!("the parameters in its input {number} cannot be flown");
            changed.check().at(place)?;
        }
        let topics: Vec<Topic<'_>> =
            COMPARED.iter().filter_map(|name| log.topic(name)).filter(|t| !t.is_empty()).collect();
        let rows = topics.iter().map(Topic::len).max();
        let rows = rows.ok_or_else(|| problem!("it has no control step"))? as u64;
        // It is a divisor, and a damaged header may have a zero.
        let period_us = u64::from(plant.setup.period.as_micros()).max(1);
        let every = row_every(&control);
        let is_damaged = !log.damages().is_empty();
        let times: Vec<Vec<u64>> = topics.iter().map(Topic::times_us).collect();
        let steps = if every == 1 && !is_damaged {
            rows
        } else {
            let last_us = times.iter().filter_map(|times| times.last()).copied().max().unwrap_or(0);
            let seen = last_us.saturating_sub(log.start_us()) / period_us + 1;
            let footer = log.info_u64("control_steps");
            // A damaged time leads nowhere: no log has more rows than bytes for them.
            let row_bytes: usize =
                topics.iter().flat_map(|topic| topic.fields()).map(Field::size).sum();
            let most = ((log.size() / row_bytes.max(1)) as u64 + 1).saturating_mul(every);
            footer.unwrap_or(seen).min(most)
        };
        let (mut missing, mut damaged) = (BTreeSet::new(), Vec::new());
        if is_damaged {
            let is_there = |us: &u64| times.iter().all(|times| times.binary_search(us).is_ok());
            let due = (0..steps.div_ceil(every)).map(|row| row * every);
            let due = due.map(|step| log.start_us().saturating_add(step.saturating_mul(period_us)));
            missing = due.filter(|us| !is_there(us)).collect();
            damaged = log.damages().iter().map(|damage| damaged_us(&topics, damage)).collect();
        }
        Ok(Self { log, control, plant, own_law, inputs, steps, missing, damaged })
    }

    /// The control side at the start.
    pub(super) fn settings(&self) -> Settings {
        Settings { own_law: self.own_law.clone(), ..self.control.settings.clone() }
    }

    /// The same recording, of which no more than this many control steps are flown.
    #[must_use]
    pub fn up_to(mut self, steps_max: u64) -> Self {
        self.steps = self.steps.min(steps_max);
        self
    }

    /// Times of control steps of which a damaged log does not have every row, us.
    pub(super) fn missing(&self) -> &BTreeSet<u64> {
        &self.missing
    }

    /// The log lacks rows of this time or the next one, or cannot be read there: a damage may begin inside of a row
    /// that keeps its length.
    pub(super) fn is_damaged_at(&self, us: u64) -> bool {
        let next = us.saturating_add(self.plant.setup.period.as_micros().into());
        self.missing.range(us..=next).next().is_some()
            || self.damaged.iter().any(|(from, to)| (*from..=*to).contains(&us))
    }

    /// The first time at which something may be lost, us.
    pub(super) fn first_damage_us(&self) -> Option<u64> {
        let places = self.damaged.iter().map(|(from, _)| *from);
        places.chain(self.missing.first().copied()).min()
    }

    /// One of so many control steps has its rows wherever it is.
    pub fn row_every(&self) -> u64 {
        row_every(&self.control)
    }

    /// Places of the log cannot be read.
    pub fn is_damaged(&self) -> bool {
        !self.log.damages().is_empty()
    }

    /// Control steps that the log has.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The run hash that the log ends with; `None` if it was cut off.
    pub fn run_hash(&self) -> Option<&str> {
        self.log.info_text("run_hash")
    }

    /// One line: what was flown.
    pub fn title(&self) -> String {
        let setup = &self.plant.setup;
        let seconds = self.steps as f64 * setup.period.as_seconds();
        format!(
            "{}, seed {}, run {}: {} control steps, {seconds:.1} s",
            self.plant.scenario, setup.seed, setup.run, self.steps
        )
    }

    /// What a reader of the result should know.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if self.control.version != env!("CARGO_PKG_VERSION")
            || self.control.wire_version != wire::VERSION
        {
            let (theirs, ours) = versions(&self.log);
            remarks.push(format!("the log is of {theirs}, this is {ours}"));
        }
        if self.plant.version != self.control.version {
            let (plant, control) = (&self.plant.version, &self.control.version);
            remarks.push(format!("the plant was of version {plant}, the autopilot of {control}"));
        }
        if self.log.is_cut() || self.run_hash().is_none() {
            remarks.push("the log was cut off; it is compared up to its end".to_owned());
        }
        remarks.extend(self.log.damages().iter().map(|damage| format!("damaged: {damage}")));
        let lost_ms: u64 = self.log.dropouts_ms().iter().copied().map(u64::from).sum();
        if lost_ms > 0 {
            remarks.push(format!("rows of {lost_ms} ms were lost while the log was written"));
        }
        remarks
    }

    #[cfg(test)]
    pub(super) fn forget_inputs(&mut self) {
        self.inputs.clear();
    }

    /// Inputs in their order.
    pub fn inputs(&self) -> VecDeque<Input> {
        self.inputs.iter().cloned().collect()
    }
}

/// The part of the control header that decides whether the flight can be flown again.
#[derive(Deserialize)]
struct Rules {
    #[serde(default)]
    flight_rules: u32,
}

fn row_every(control: &ControlHeader) -> u64 {
    // Zero would be a divisor, and a huge one would excuse every missing row.
    u64::from(control.row_every.clamp(1, ROW_EVERY_MAX))
}

/// From the last rows before a damaged place to the first ones behind it, us.
fn damaged_us(topics: &[Topic<'_>], damage: &Damage) -> (u64, u64) {
    let time = |topic: &Topic<'_>, row: Option<usize>| Some(topic.row(row?)?.timestamp_us());
    let before = |topic: &Topic<'_>| time(topic, topic.rows_before(damage.offset).checked_sub(1));
    let behind = |topic: &Topic<'_>| time(topic, Some(topic.rows_before(damage.resumed?)));
    let from = topics.iter().filter_map(before).min().unwrap_or(0);
    (from, topics.iter().filter_map(behind).max().unwrap_or(u64::MAX))
}

/// Versions of program and link: those of the log and those of this program.
fn versions(log: &Log) -> (String, String) {
    let software = log.info_text("ver_sw").unwrap_or("unknown");
    let link = log.info_u64("ver_wire").map_or("unknown".to_owned(), |version| version.to_string());
    (
        format!("version {software} with link version {link}"),
        format!("version {} with link version {}", env!("CARGO_PKG_VERSION"), wire::VERSION),
    )
}

fn header<T: DeserializeOwned>(
    log: &Log,
    key: &'static str,
    when: &'static str,
) -> Result<T, Problem> {
    let text = log.info_text(key).ok_or_else(|| problem!("its {key} is missing{when}"))?;
    serde_json::from_str(text).map_err(|error| {
        let (theirs, ours) = versions(log);
        problem!(
            "its {key} cannot be read by this version: {error}. The log is of {theirs}, this is {ours}"
        )
    })
}

/// Puts the pieces of the topic `recorded` together. In a damaged log entries that cannot be read are left out.
pub fn inputs(log: &Log) -> Result<Vec<Input>, Problem> {
    let Some(topic) = log.topic("recorded") else { return Ok(Vec::new()) };
    let mut inputs = Vec::new();
    let mut text: Vec<u8> = Vec::new();
    let mut next_part = 0;
    let is_damaged = !log.damages().is_empty();
    for row in topic.rows() {
        let number = inputs.len() + 1;
        let time_s = row.timestamp_us() as f64 * 1.0e-6;
        let failed = |why: String| {
            problem!("input {number} of the log (at {time_s:.3} s) cannot be read: {why}")
        };
        let field =
            |name| row.unsigned(name).ok_or_else(|| failed(format!("there is no column {name}")));
        let (part, parts) = (field("part")?, field("parts")?);
        if is_damaged && part != next_part {
            next_part = 0;
            // The rest of an entry that has lost its beginning.
            if part > 0 {
                continue;
            }
        }
        if part != next_part || parts == 0 {
            return Err(failed(format!("part {part} where part {next_part} was due")));
        }
        if part == 0 {
            text.clear();
        }
        text.extend_from_slice(piece(&row).ok_or_else(|| failed("no text".to_owned()))?);
        next_part = part + 1;
        if next_part < parts {
            continue;
        }
        next_part = 0;
        let what = match serde_json::from_slice(&text) {
            Ok(what) => what,
            // Pieces of two entries, with the damage between them.
            Err(_) if is_damaged => continue,
            Err(error) => return Err(failed(error.to_string())),
        };
        let phase = field("phase")?;
        let moment = u8::try_from(phase).ok().and_then(Moment::from_code);
        let moment = moment.ok_or_else(|| failed(format!("phase {phase} is not known")))?;
        inputs.push(Input { step: field("step")?, moment, t_s: time_s, what });
    }
    // An entry whose last pieces are missing was cut off with the file.
    Ok(inputs)
}

/// The text of one row.
fn piece<'a>(row: &Row<'a>) -> Option<&'a [u8]> {
    let length = usize::try_from(row.unsigned("length")?).ok()?;
    row.bytes("text")?.get(..length)
}
