//! Events of a flight, in the order of time, from rows and inputs of its log.

use std::collections::HashMap;

use autopilot::command::Command;
use autopilot::command::VehicleCommand;
use autopilot::recorder::{Recorded, command_text};
use autopilot::vehicle::Mode;
use flight_control::CompensatorMode;
use icd::fault::{FaultKind, FaultState, TargetClass};
use icd::record::effector_field;
use icd::{ControlPeriod, Effector, EffectorList, SimTime};
use plant_sim::Attained;
use ulog::reader::Topic;

use super::flight::{FaultSpan, Flight, Kind, LogEvent};
use lab_report::chart::curve::Point;
use lab_report::chart::panel::Mark;
use lab_report::chart::{Ink, Pattern};

/// A limit that is left for a shorter time than this has not been left, s.
const GAP_S: f64 = 1.0;
/// A limit that is reached for a shorter time than this is no event, s.
const SHORT_S: f64 = 0.1;

/// Longest control period with room for rounding, s.
const PERIOD_MAX_S: f64 = ControlPeriod::MAX_MICROS as f64 * 1.01e-6;
/// A report comes with one of the next packets, s.
const REPORT_LATE_S: f64 = 0.1;

/// Finds faults and events, and takes out events at a time that the flight does not have.
pub fn find(flight: &mut Flight) {
    flight.faults = faults(flight);
    flight.events = timeline(flight);
    let all = flight.events.len();
    let near = flight.near();
    flight.events.retain(|what| (near.0..=near.1).contains(&what.t_s));
    flight.strays = all - flight.events.len();
}

/// The lines on the time axes, with the numbers of the table. A loss comes first: of lines in one place the first is drawn.
pub fn marks(events: &[LogEvent]) -> Vec<Mark> {
    let numbered = events.iter().zip(1..).filter(|(what, _)| what.kind.is_marked());
    let (losses, others): (Vec<_>, Vec<_>) =
        numbered.partition(|(what, _)| what.kind == Kind::Loss);
    let numbered = losses.into_iter().chain(others);
    numbered
        .map(|(what, number)| Mark {
            x: what.t_s,
            number: Some(number),
            ink: Ink::new(what.kind.colour(), Pattern::Fine).wide(1.0),
            label: format!("{number}: {} ({:.3} s)", what.text, what.t_s),
        })
        .collect()
}

/// Times in which a signal is above zero; gaps shorter than `gap_s` do not count.
pub fn spans(points: &[Point], gap_s: f64) -> Vec<(f64, f64)> {
    let mut spans: Vec<(f64, f64)> = Vec::new();
    let mut before = f64::NEG_INFINITY;
    for (t_s, value) in points {
        if *value > 0.0 {
            match spans.last_mut() {
                // Unbroken since the tick before, or broken for a short time only.
                Some(last) if last.1 >= before || *t_s - last.1 < gap_s => last.1 = *t_s,
                _ => spans.push((*t_s, *t_s)),
            }
        }
        before = *t_s;
    }
    spans
}

/// When which fault acted: from the truth, and what the plant reported of its faults.
pub fn faults(flight: &Flight) -> Vec<FaultSpan> {
    let mut faults: Vec<FaultSpan> = if flight.has("truth") {
        flight.effectors.all().flat_map(|effector| of_truth(flight, effector)).collect()
    } else {
        of_reports(flight)
    };
    faults.sort_by(|a, b| a.span.0.total_cmp(&b.span.0));
    faults
}

/// Intervals in which the truth has the same fault of one effector.
fn of_truth(flight: &Flight, effector: Effector) -> Vec<FaultSpan> {
    let column = effector_field("fault", &flight.effectors, effector);
    let Some(points) = flight.signal("truth", &column, 1.0) else { return Vec::new() };
    let mut faults = Vec::new();
    let mut open: Option<(f64, f64)> = None;
    let topic = flight.log.topic("fault");
    let reports = topic.map(|topic| Reports::of(&topic)).unwrap_or_default();
    let mut close = |(since, code): (f64, f64), at: f64, lasts: bool| {
        let text = reports.describe(flight, effector, code, at);
        let end = if lasts { at } else { reports.exactly(effector, at) };
        let span = (reports.exactly(effector, since), end);
        faults.push(FaultSpan { effector, span, lasts, text });
    };
    for (t_s, code) in &points {
        if open.is_some_and(|(_, before)| before == *code) {
            continue;
        }
        if let Some(fault) = open.take() {
            close(fault, *t_s, false);
        }
        open = (*code > 0.0).then_some((*t_s, *code));
    }
    if let Some(fault) = open {
        close(fault, flight.span.1, true);
    }
    faults
}

/// The code of a fault in a column of the truth.
fn kind_of(code: f64) -> Option<u8> {
    (0..=u8::MAX).find(|kind| f64::from(*kind) == code)
}

/// One row of the topic `fault`.
struct Report {
    reported_s: f64,
    at_s: f64,
    id: u64,
    effector: Option<Effector>,
    code: u8,
    values: [f64; 2],
    state: u64,
}

impl Report {
    fn text(&self, effectors: &EffectorList) -> String {
        let is_angle = self.effector.is_none_or(|effector| effectors.is_angle(effector));
        match FaultKind::from_code(self.code, self.values) {
            Some(kind) => kind.described(TargetClass::of(is_angle)).to_string(),
            None => format!("fault of kind {}", self.code),
        }
    }
}

/// What the plant has reported of its faults.
#[derive(Default)]
struct Reports {
    all: Vec<Report>,
    /// Of each effector and kind: when they were reported, s, and which they are, in the order of that time.
    reported: HashMap<(usize, u8), Vec<(f64, usize)>>,
    /// Of each effector: when something changed, s, in order.
    changes: [Vec<f64>; Effector::MAX],
}

impl Reports {
    fn of(topic: &Topic<'_>) -> Self {
        let rows = topic.rows().filter_map(|row| {
            Some(Report {
                reported_s: row.timestamp_us() as f64 * 1.0e-6,
                at_s: row.value("at_us")? * 1.0e-6,
                id: row.unsigned("id")?,
                effector: usize::try_from(row.unsigned("effector")?)
                    .ok()
                    .and_then(Effector::from_index),
                code: u8::try_from(row.unsigned("kind")?).ok()?,
                values: [row.value("value_1")?, row.value("value_2")?],
                state: row.unsigned("state")?,
            })
        });
        let mut reports = Self { all: rows.collect(), ..Self::default() };
        for (index, report) in reports.all.iter().enumerate() {
            let Some(effector) = report.effector else { continue };
            let reported = reports.reported.entry((effector.index(), report.code)).or_default();
            reported.push((report.reported_s, index));
            reports.changes[effector.index()].push(report.at_s);
        }
        reports
            .reported
            .values_mut()
            .for_each(|reported| reported.sort_by(|a, b| a.0.total_cmp(&b.0)));
        reports.changes.iter_mut().for_each(|at_s| at_s.sort_by(f64::total_cmp));
        reports
    }

    /// Text of a fault: with the numbers of the plant's last report about it.
    fn describe(&self, flight: &Flight, effector: Effector, code: f64, until_s: f64) -> String {
        let report = kind_of(code).and_then(|kind| {
            let reported = self.reported.get(&(effector.index(), kind))?;
            let count =
                reported.partition_point(|(reported_s, _)| *reported_s <= until_s + REPORT_LATE_S);
            self.all.get(reported.get(count.checked_sub(1)?)?.1)
        });
        let text = |report: &Report| report.text(&flight.effectors);
        report.map_or_else(|| format!("fault of kind {code}"), text)
    }

    /// The time of a change that the truth shows at this tick: a fault begins and ends between ticks, too.
    fn exactly(&self, effector: Effector, tick_s: f64) -> f64 {
        let changes = &self.changes[effector.index()];
        let count = changes.partition_point(|at_s| *at_s <= tick_s);
        let at_s = count.checked_sub(1).map_or(f64::NEG_INFINITY, |last| changes[last]);
        if tick_s - at_s <= PERIOD_MAX_S { at_s } else { tick_s }
    }
}

/// Without truth: from what the plant reported.
fn of_reports(flight: &Flight) -> Vec<FaultSpan> {
    let Some(topic) = flight.log.topic("fault") else { return Vec::new() };
    let reports = Reports::of(&topic).all;
    // The next report about the same fault, looked for from the end.
    let mut next: HashMap<u64, f64> = HashMap::new();
    let active = u64::from(FaultState::Active { since: SimTime::ZERO }.code());
    let mut faults = Vec::new();
    for report in reports.iter().rev() {
        let later = next.insert(report.id, report.at_s);
        let Some(effector) = report.effector.filter(|_| report.state == active) else { continue };
        let span = (report.at_s, later.unwrap_or(flight.span.1));
        faults.push(FaultSpan {
            effector,
            span,
            lasts: later.is_none(),
            text: report.text(&flight.effectors),
        });
    }
    faults.reverse();
    faults
}

/// All events in the order of time.
fn timeline(flight: &Flight) -> Vec<LogEvent> {
    let mut all = Vec::new();
    for fault in &flight.faults {
        let FaultSpan { effector, span, lasts, text } = fault;
        let effector = flight.effectors.name(*effector);
        let event = |t_s, text| LogEvent { t_s, kind: Kind::Fault, text };
        all.push(event(span.0, format!("{effector}: {text}")));
        if !lasts {
            all.push(event(span.1, format!("{effector}: no longer {text}")));
        }
    }
    all.extend(inputs(flight));
    all.extend(logged_texts(flight));
    all.extend(compensator(flight));
    all.extend(saturations(flight));
    all.extend(modes(flight));
    all.extend(losses(flight));
    // Stable, so that events of one time keep the order of the lists above.
    all.sort_by(|a, b| a.t_s.total_cmp(&b.t_s));
    let text = match flight.log.info_text("end") {
        Some(why) => format!("the log ends: {why}"),
        None => "the log breaks off here".to_owned(),
    };
    // Behind all others, also those of the same time.
    all.push(LogEvent { t_s: flight.span.1, kind: Kind::Flight, text });
    all
}

fn inputs(flight: &Flight) -> Vec<LogEvent> {
    let mut all: Vec<LogEvent> = Vec::new();
    // The running stream: where it is in the list, what it is, how many.
    let mut stream: Option<(usize, &str, usize)> = None;
    for (t_s, what) in &flight.inputs {
        let (kind, text) = match what {
            Recorded::Intent(intent) => match command_text(&intent.command, &flight.effectors) {
                Some(text) => (Kind::Input, text),
                None => {
                    let name = stream_name(&intent.command);
                    let (place, count) = match stream {
                        Some((place, running, count)) if running == name => (place, count + 1),
                        _ => {
                            let text = String::new();
                            all.push(LogEvent { t_s: *t_s, kind: Kind::Input, text });
                            (all.len() - 1, 1)
                        }
                    };
                    all[place].text = format!("{name}: {count}, the last at {t_s:.3} s");
                    stream = Some((place, name, count));
                    continue;
                }
            },
            Recorded::PlantLost => {
                (Kind::Flight, "the plant has fallen silent; time stands still".to_owned())
            }
            Recorded::PlantBack => (Kind::Flight, "the plant is back".to_owned()),
            Recorded::Request(_) => continue,
        };
        all.push(LogEvent { t_s: *t_s, kind, text });
    }
    all
}

/// What only the texts of the log have: scripts and refusals.
fn logged_texts(flight: &Flight) -> impl Iterator<Item = LogEvent> {
    flight.log.texts().iter().filter_map(|text| {
        // In a log a text has no kind, only its words.
        let kind = if text.text.contains(" refused: ") {
            Kind::Refusal
        } else if text.text.starts_with("Script") {
            Kind::Script
        } else {
            return None;
        };
        let t_s = text.timestamp_us as f64 * 1.0e-6;
        Some(LogEvent { t_s, kind, text: text.text.clone() })
    })
}

/// Streams come many times a second; each is one event.
const fn stream_name(command: &Command) -> &'static str {
    match command {
        Command::Vehicle(VehicleCommand::Sticks(_)) => "positions of a pilot's sticks",
        _ => "setpoints of an offboard stream",
    }
}

fn compensator(flight: &Flight) -> Vec<LogEvent> {
    let event = |t_s, text| LogEvent { t_s, kind: Kind::Compensator, text };
    let active = flight.signal("control", "compensator_active", 1.0).unwrap_or_default();
    let levels = AXES.map(|axis| flight.signal("control", &format!("level_{axis}"), 1.0));
    let mut all = Vec::new();
    for (mode, (from, to)) in detections(flight) {
        let row = active.partition_point(|(t_s, _)| *t_s < from);
        let about = farthest(&levels, row).map(|axis| format!(" about the {axis} axis"));
        let about = about.unwrap_or_default();
        let (begin, end) = match mode {
            CompensatorMode::Off => ("a fault is seen, the compensator is off", NO_FAULT),
            CompensatorMode::Armed => {
                ("the compensator wakes", "the compensator goes back to sleep")
            }
            CompensatorMode::AlwaysOn => ("a fault is seen", NO_FAULT),
        };
        let text = format!("{begin}: something acts{about} that the model does not expect");
        all.push(event(from, text));
        if active.last().is_some_and(|last| to < last.0) {
            all.push(event(to, end.to_owned()));
        }
    }
    all
}

/// The end of a detection that did not wake the compensator.
const NO_FAULT: &str = "a fault is no longer seen";

/// When the detector saw a fault, from and to, s, and how `FTC_MODE` stood.
pub fn detections(flight: &Flight) -> Vec<(CompensatorMode, (f64, f64))> {
    let active = flight.signal("control", "compensator_active", 1.0).unwrap_or_default();
    let modes = flight.compensator_modes();
    // The first entry is at minus infinity, so every time has one before it.
    let mode_at = |t_s| modes[modes.partition_point(|(since_s, _)| *since_s < t_s) - 1].1;
    let of_mode = |mode| {
        let counts =
            |(t_s, value): &Point| (*t_s, if mode_at(*t_s) == mode { *value } else { 0.0 });
        let points: Vec<Point> = active.iter().map(counts).collect();
        spans(&points, 0.0).into_iter().map(move |span| (mode, span))
    };
    CompensatorMode::NAMES.iter().flat_map(|(_, mode)| of_mode(*mode)).collect()
}

/// Axes in the order of the columns of levels.
const AXES: [&str; 3] = ["roll", "pitch", "yaw"];

/// The axis whose estimate was farthest above its level in this row, if the log has levels.
fn farthest(levels: &[Option<Vec<Point>>; 3], row: usize) -> Option<&'static str> {
    let level = |points: &Option<Vec<Point>>| points.as_ref()?.get(row).map(|point| point.1);
    let known = AXES.into_iter().zip(levels).filter_map(|(axis, l)| Some((axis, level(l)?)));
    known.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(axis, _)| axis)
}

/// Columns of the flags, and what is at its limit.
const LIMITS: [(&str, &str); 6] = [
    ("aileron_saturated", "ailerons"),
    ("elevator_saturated", "elevators"),
    ("rudder_saturated", "rudder"),
    ("nozzle_pitch_saturated", "nozzle pitch angle"),
    ("nozzle_yaw_saturated", "nozzle yaw angle"),
    ("thrust_saturated", "engine"),
];

fn saturations(flight: &Flight) -> Vec<LogEvent> {
    let of = |(column, name): (&str, &str)| {
        let flags = flight.signal("control", column, 1.0).unwrap_or_default();
        let name = name.to_owned();
        let spans = spans(&flags, GAP_S).into_iter().filter(|(from, to)| to - from >= SHORT_S);
        spans.map(move |(from, to)| LogEvent {
            t_s: from,
            kind: Kind::Saturation,
            text: format!("{name} at the limit, for {:.1} s", to - from),
        })
    };
    LIMITS.into_iter().flat_map(of).collect()
}

/// Intervals of the same mode: from, to, its name.
pub fn mode_spans(flight: &Flight) -> Vec<(f64, f64, &'static str)> {
    let modes = flight.signal("vehicle", "mode", 1.0).unwrap_or_default();
    let name = |value: f64| {
        let mode = Mode::ALL.into_iter().enumerate().find(|(index, _)| *index as f64 == value);
        mode.map_or("unknown mode", |(_, mode)| mode.key())
    };
    let mut spans: Vec<(f64, f64, &'static str)> = Vec::new();
    for (t_s, value) in modes {
        let name = name(value);
        match spans.last_mut() {
            Some(last) if last.2 == name => last.1 = t_s,
            last => {
                // Up to the next mode, so that the strip has no gap.
                if let Some(last) = last {
                    last.1 = t_s;
                }
                spans.push((t_s, t_s, name));
            }
        }
    }
    // The last mode lasts to the end, which need not have a row of it.
    if let Some(last) = spans.last_mut() {
        last.1 = flight.span.1;
    }
    spans
}

fn modes(flight: &Flight) -> Vec<LogEvent> {
    let event = |(t_s, _, name): &(f64, f64, &str)| LogEvent {
        t_s: *t_s,
        kind: Kind::Mode,
        text: format!("mode {name}"),
    };
    mode_spans(flight).iter().map(event).collect()
}

/// The first limit of the airframe file that was passed, and the ground, from the truth; without it the ground from the
/// autopilot's texts.
fn losses(flight: &Flight) -> Vec<LogEvent> {
    let event = |t_s, text| LogEvent { t_s, kind: Kind::Loss, text };
    let columns =
        ["roll_rad", "pitch_rad", "alpha_rad", "beta_rad", "altitude_m", "on_ground", "broken"];
    let truth = flight.rows("truth", columns);
    let limits = flight.plant.as_ref().map(|plant| plant.setup.limits());
    let mut limit = truth.iter().filter_map(|(us, row)| {
        let [roll_rad, pitch_rad, alpha_rad, beta_rad, altitude_m, ..] = *row;
        let at = Attained { roll_rad, pitch_rad, alpha_rad, beta_rad, altitude_m };
        let by = limits.filter(|limits| limits.are_exceeded(&at))?.exceeded(&at)?;
        Some(event(*us as f64 * 1.0e-6, format!("the aircraft is lost: {by}")))
    });
    let stopped = truth.iter().find(|(_, row)| row[5] > 0.0).map(|(us, row)| (*us, row[6] > 0.0));
    let announced =
        || flight.log.texts().iter().find(|text| text.text.starts_with("Ground contact"));
    let stopped = stopped.or_else(|| announced().map(|text| (text.timestamp_us, false)));
    let ground = stopped.map(|(us, is_broken)| {
        let text = match is_broken {
            true => "the plant stops: a quantity is beyond all bounds",
            false => "the aircraft touches the ground",
        };
        event(us as f64 * 1.0e-6, text.to_owned())
    });
    limit.next().into_iter().chain(ground).collect()
}
