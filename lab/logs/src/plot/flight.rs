//! A log as a flight: headers, signals by name, faults and events.

use std::collections::HashMap;

use autopilot::parameters::Parameters;
use autopilot::recorder::{ControlHeader, Recorded};
use flight_control::{CompensatorMode, DesignModel, NavigationState};
use icd::record::{FieldName, TruthHead, effector_field};
use icd::{Effector, EffectorKind, EffectorList, EulerAngles, PerEffector, tvc_jet};
use nalgebra::Vector3;
use plant_sim::io::header::PlantHeader;
use serde::de::DeserializeOwned;
use ulog::reader::{Log, ParameterValue, Topic};

use super::NothingToDraw;
use crate::replay;
use lab_judges::closed_loop;
use lab_report::chart::curve::{Point, thin};

/// Topics that have a row in each control step.
const TICKING: [&str; 5] = ["sensors", "control", "commands", "truth", "estimator_status"];

/// An event this long before the first row or after the last one is of the flight, s.
const STRAY_S: f64 = 60.0;

/// The flight of a log.
#[derive(Debug)]
pub struct Flight {
    pub log: Log,
    /// The effectors of the aircraft.
    pub effectors: EffectorList,
    /// The control side, if the log has it.
    pub control: Option<ControlHeader>,
    /// The scenario, if the log has it.
    pub plant: Option<PlantHeader>,
    /// First and last time, s.
    pub span: (f64, f64),
    pub steps: usize,
    /// What came in from outside, with the time in s.
    pub inputs: Vec<(f64, Recorded)>,
    /// Why the inputs could not be read.
    pub unread: Option<String>,
    /// When which fault acted; empty until the events are found.
    pub faults: Vec<FaultSpan>,
    /// Events in the order of time; empty until they are found.
    pub events: Vec<LogEvent>,
    /// Which rows can be drawn.
    times: Times,
    /// Events at a time that the flight does not have.
    pub strays: usize,
}

impl Flight {
    pub fn new(log: Log) -> Result<Self, NothingToDraw> {
        let ticking: Vec<Topic<'_>> =
            TICKING.iter().filter_map(|name| log.topic(name)).filter(|t| !t.is_empty()).collect();
        // A damaged log may have lost rows of one topic and not of another.
        let rows = ticking.iter().map(Topic::len).max().ok_or(NothingToDraw)?;
        let times = Times::of(&log, &TICKING);
        let (first, last) = times.span_us.ok_or(NothingToDraw)?;
        let (first, last) = (first as f64 * 1.0e-6, last as f64 * 1.0e-6);
        // A frame needs a width, also of a flight of a single tick; far from zero numbers lie farther apart.
        let span = (first, last.max(first + 1.0e-3).max(first * (1.0 + 1.0e-9)));
        let (inputs, unread) = match replay::inputs(&log) {
            Ok(inputs) => (inputs.into_iter().map(|input| (input.t_s, input.what)).collect(), None),
            Err(error) => (Vec::new(), Some(error.to_string())),
        };
        let mut flight = Self {
            control: header(&log, "control_header"),
            plant: header(&log, "plant_header"),
            log,
            effectors: EffectorList::default(),
            span,
            steps: rows,
            inputs,
            unread,
            faults: Vec::new(),
            events: Vec::new(),
            times,
            strays: 0,
        };
        let of_plant = flight.plant.as_ref().map(|plant| plant.setup.airframe.effectors);
        let of_control =
            flight.control.as_ref().map(|control| control.settings.model.effectors.list);
        // A log without headers names its columns all the same: those of the aircraft that every log had once.
        flight.effectors = of_plant.or(of_control).unwrap_or_else(tvc_jet::effectors);
        Ok(flight)
    }

    /// What is not drawn, and why.
    pub fn not_drawn(&self) -> Vec<String> {
        let entries = (self.strays > 0).then(|| {
            let (from, to) = self.span;
            format!(
                "{} of what happened is not shown, because its time is not in the flight ({from:.3} to {to:.3} s); \
                 the log is damaged there",
                self.strays
            )
        });
        self.times.remark().into_iter().chain(entries).collect()
    }

    /// The log has a topic with rows.
    pub fn has(&self, topic: &str) -> bool {
        self.log.topic(topic).is_some_and(|topic| !topic.is_empty())
    }

    /// How `FTC_MODE` stood, and since when, s; armed, as usual, if the log does not have it.
    pub fn compensator_modes(&self) -> Vec<(f64, CompensatorMode)> {
        let mut parameters = Parameters::default();
        let mode = &mut parameters.gains.selection.compensator;
        *mode = self
            .control
            .as_ref()
            .map_or(CompensatorMode::Armed, |control| control.settings.gains.selection.compensator);
        let mut modes = vec![(f64::NEG_INFINITY, *mode)];
        for change in self.log.parameters().iter().filter(|change| change.name == "FTC_MODE") {
            let (Some(us), ParameterValue::Integer(value)) = (change.after_us, change.value) else {
                continue;
            };
            // A damaged log may have a value that there is not.
            if parameters.set(&change.name, value.into()).is_ok() {
                modes.push((us as f64 * 1.0e-6, parameters.gains.selection.compensator));
            }
        }
        modes
    }

    /// The autopilot flew on an estimate of the state.
    pub fn is_estimated(&self) -> bool {
        self.has("estimator_status")
    }

    /// Columns of a topic at the times of its rows, us.
    pub fn rows<const N: usize>(&self, topic: &str, columns: [&str; N]) -> Vec<(u64, [f64; N])> {
        let Some(topic) = self.log.topic(topic).filter(|topic| !topic.is_empty()) else {
            return Vec::new();
        };
        let columns = columns.map(|column| self.column(&topic, column));
        if columns.iter().any(Option::is_none) {
            return Vec::new();
        }
        let columns = columns.map(Option::unwrap_or_default);
        let times = self.times_us(&topic).into_iter().enumerate();
        times.map(|(k, us)| (us, std::array::from_fn(|n| columns[n][k]))).collect()
    }

    /// A signal over time, multiplied by `scale`; `None` if the log does not have it.
    pub fn signal(&self, topic: &str, column: &str, scale: f64) -> Option<Vec<Point>> {
        let topic = self.log.topic(topic).filter(|topic| !topic.is_empty())?;
        let values = self.column(&topic, column)?;
        let times = self.times_us(&topic).into_iter().map(|us| us as f64 * 1.0e-6);
        Some(times.zip(values.into_iter().map(|value| value * scale)).collect())
    }

    /// Times, us, and numbers of a topic's rows that can be drawn and are of the flight.
    pub fn numbered(&self, topic: &Topic<'_>) -> Vec<(u64, usize)> {
        let numbers = self.times.keep(topic.name(), (0..topic.len()).collect());
        let (from, to) = self.near();
        let is_near = |(us, _): &(u64, usize)| (from..=to).contains(&(*us as f64 * 1.0e-6));
        self.times_us(topic).into_iter().zip(numbers).filter(is_near).collect()
    }

    /// Between these times, s, an event is of the flight.
    pub fn near(&self) -> (f64, f64) {
        (self.span.0 - STRAY_S, self.span.1 + STRAY_S)
    }

    /// A column of the rows that can be drawn.
    pub fn column(&self, topic: &Topic<'_>, column: &str) -> Option<Vec<f64>> {
        Some(self.times.keep(topic.name(), topic.column(column)?))
    }

    /// Timestamps of the rows that can be drawn, us.
    fn times_us(&self, topic: &Topic<'_>) -> Vec<u64> {
        self.times.keep(topic.name(), topic.times_us())
    }

    /// The same, thinned to what can be seen; no peak is lost.
    pub fn thinned(&self, topic: &str, column: &str, scale: f64) -> Option<Vec<Point>> {
        Some(thin(self.signal(topic, column, scale)?, self.span.0, self.span.1))
    }

    /// Roll, pitch and yaw from a quaternion of the log, rad.
    pub fn angles(&self, topic: &str, columns: [&str; 4]) -> Option<Vec<(f64, EulerAngles)>> {
        let topic = self.log.topic(topic).filter(|topic| !topic.is_empty())?;
        let [w, x, y, z] = columns.map(|column| self.column(&topic, column));
        let (w, x, y, z) = (w?, x?, y?, z?);
        let times = self.times_us(&topic);
        let angles = (0..times.len()).map(|k| {
            let attitude = icd::Attitude::from_unit_wxyz([w[k], x[k], y[k], z[k]]);
            (times[k] as f64 * 1.0e-6, attitude.euler())
        });
        Some(angles.collect())
    }

    /// The true F of each tick that has a row of truth and one of control, see Eq. (18); it needs the model.
    pub fn true_fault_acceleration(&self) -> Option<Vec<(f64, Vector3<f64>)>> {
        let model = DesignModel::new(self.control.as_ref()?.settings.model);
        let (truth, control) = (self.log.topic("truth")?, self.log.topic("control")?);
        let columns = |topic: &Topic<'_>, names: &[&str]| -> Option<Vec<Vec<f64>>> {
            names.iter().map(|name| self.column(topic, name)).collect()
        };
        let state = columns(&truth, STATE)?;
        let acceleration = columns(&truth, &["p_dot_rad_s2", "q_dot_rad_s2", "r_dot_rad_s2"])?;
        let list = &self.effectors;
        let engine = list.only(EffectorKind::Engine);
        let engine = engine.map(|engine| effector_field("effect", list, engine));
        let thrust = engine.and_then(|engine| self.column(&truth, &engine));
        let modelled: Vec<_> = list.all().map(|e| effector_field("modelled", list, e)).collect();
        let modelled: Vec<&str> = modelled.iter().map(FieldName::as_str).collect();
        let modelled = columns(&control, &modelled)?;
        let (times, steps) = (self.times_us(&truth), self.times_us(&control));
        // A damaged log has rows of the one without rows of the other.
        let pairs = (0..times.len())
            .filter_map(|k| steps.binary_search(&times[k]).ok().map(|step| (k, step)));
        let ticks = pairs.map(|(k, step)| {
            let s: [f64; 10] = std::array::from_fn(|n| state[n][k]);
            let state = NavigationState {
                rates: Vector3::new(s[0], s[1], s[2]),
                attitude: EulerAngles { phi: s[3], theta: s[4], psi: s[5] },
                airspeed_m_s: s[6],
                alpha: s[7],
                beta: s[8],
                altitude_m: s[9],
                thrust_n: thrust.as_ref().map_or(f64::NAN, |thrust| thrust[k]),
                ..NavigationState::at_rest()
            };
            let acceleration =
                Vector3::new(acceleration[0][k], acceleration[1][k], acceleration[2][k]);
            let modelled = PerEffector::from_values(modelled.iter().map(|column| column[step]));
            let f = closed_loop::beyond_model(&model, &state, &acceleration, &modelled);
            (times[k] as f64 * 1.0e-6, f)
        });
        Some(ticks.collect())
    }
}

/// Columns of the true state, in the order in which [`Flight::true_fault_acceleration`] takes them.
const STATE: &[&str; 10] = TruthHead::NAMES.first_chunk().expect("the truth begins with the state");

fn header<T: DeserializeOwned>(log: &Log, key: &str) -> Option<T> {
    // A page without a header is better than none; the page names what is missing.
    serde_json::from_str(log.info_text(key)?).ok()
}

/// A longer gap between two rows is none of a flight, us: a log has a row each 20 ms, and a damaged place of this
/// length would be tens of megabytes.
const GAP_MAX_US: u64 = 600_000_000;

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A fault begins or ends.
    Fault,
    /// An operator gave a command.
    Input,
    /// The script does something.
    Script,
    Refusal,
    /// The compensator wakes or sleeps.
    Compensator,
    /// An effector is at its limit.
    Saturation,
    Mode,
    /// The aircraft passes a limit of its airframe file, or touches the ground.
    Loss,
    /// The link to the plant, the end.
    Flight,
}

impl Kind {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fault => "fault",
            Self::Input => "input",
            Self::Script => "script",
            Self::Refusal => "refusal",
            Self::Compensator => "compensator",
            Self::Saturation => "limit",
            Self::Mode => "mode",
            Self::Loss => "loss",
            Self::Flight => "flight",
        }
    }

    /// Colour as `#rrggbb`.
    pub const fn colour(self) -> &'static str {
        match self {
            Self::Fault => "#b3161b",
            Self::Input => "#1f5fbf",
            Self::Script => "#00707a",
            Self::Refusal => "#a03a78",
            Self::Compensator => "#0a6b2e",
            Self::Saturation => "#8a5a00",
            Self::Mode => "#5b3fa0",
            Self::Loss => "#e0002a",
            Self::Flight => "#444444",
        }
    }

    /// It has a line on every time axis.
    pub const fn is_marked(self) -> bool {
        !matches!(self, Self::Saturation | Self::Mode | Self::Refusal)
    }
}

/// An event of the flight.
#[derive(Debug, Clone, PartialEq)]
pub struct LogEvent {
    /// Simulation time, s.
    pub t_s: f64,
    pub kind: Kind,
    pub text: String,
}

/// A fault from its onset to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultSpan {
    pub effector: Effector,
    /// From and to, s; to the end of the log if it still acts.
    pub span: (f64, f64),
    /// It still acts when the log ends.
    pub lasts: bool,
    pub text: String,
}

/// Which rows of each topic have a time that can be drawn.
///
/// A flipped bit in one timestamp would stretch every axis to centuries. So a row is drawn if its time fits between
/// those of its neighbours, and lies in the part of the flight that most rows are in.
#[derive(Debug, Default)]
pub struct Times {
    /// Numbers of the rows, for topics of which some cannot be drawn.
    drawn: HashMap<String, Vec<usize>>,
    /// First and last time, us; `None` without a row.
    pub span_us: Option<(u64, u64)>,
    /// Rows that are not drawn.
    pub strays: usize,
    /// Topic and time of the first of them, us.
    pub first_stray: Option<(String, u64)>,
}

impl Times {
    /// Of a log, whose topics `ticking` give its span.
    pub fn of(log: &Log, ticking: &[&str]) -> Self {
        let mut times = Self::default();
        let topics: Vec<Topic<'_>> = log.topics().filter(|topic| topic.multi_id() == 0).collect();
        let in_order: Vec<(Vec<u64>, Vec<usize>)> = topics
            .iter()
            .map(|topic| {
                let us = topic.times_us();
                let rows = longest_in_order(&us);
                (us, rows)
            })
            .collect();
        let is_ticking = |topic: &Topic<'_>| ticking.contains(&topic.name());
        let all = topics.iter().zip(&in_order).filter(|(topic, _)| is_ticking(topic));
        let mut all: Vec<u64> =
            all.flat_map(|(_, (us, rows))| rows.iter().map(|row| us[*row])).collect();
        all.sort_unstable();
        let Some(span) = densest(&all) else { return times };
        times.span_us = Some(span);
        for (topic, (us, mut rows)) in topics.iter().zip(in_order) {
            // An event may lie a little outside of the rows; `find` takes out those far away.
            rows.retain(|row| (span.0..=span.1).contains(&us[*row]) || !is_ticking(topic));
            if rows.len() == us.len() {
                continue;
            }
            times.strays += us.len() - rows.len();
            let mut next = rows.iter().copied().peekable();
            let stray = (0..us.len()).find(|row| next.next_if_eq(row).is_none());
            let stray = stray.map(|row| (topic.name().to_owned(), us[row]));
            times.first_stray = times.first_stray.take().or(stray);
            times.drawn.insert(topic.name().to_owned(), rows);
        }
        times
    }

    /// What is left of the values of a topic's rows.
    pub fn keep<T: Copy>(&self, topic: &str, values: Vec<T>) -> Vec<T> {
        match self.drawn.get(topic) {
            None => values,
            Some(rows) => rows.iter().filter_map(|row| values.get(*row).copied()).collect(),
        }
    }

    /// Why some rows are not drawn, `None` where all are.
    pub fn remark(&self) -> Option<String> {
        let (topic, us) = self.first_stray.as_ref()?;
        let (rows, verb) = if self.strays == 1 { ("row", "is") } else { ("rows", "are") };
        let t_s = *us as f64 * 1.0e-6;
        Some(format!(
            "{} {rows} {verb} not drawn, because the time does not fit between those of the neighbours \
             (the first: a row of {topic} at {t_s:.3} s); the log is damaged there",
            self.strays
        ))
    }
}

/// Numbers of the longest part of `us` in which no time is earlier than the one before.
fn longest_in_order(us: &[u64]) -> Vec<usize> {
    if us.is_sorted() {
        return (0..us.len()).collect();
    }
    // The row that ends the best part of each length, and the row before each row in its best part.
    let mut ends: Vec<usize> = Vec::new();
    let mut before: Vec<Option<usize>> = Vec::with_capacity(us.len());
    for (row, time) in us.iter().enumerate() {
        let length = ends.partition_point(|end| us[*end] <= *time);
        before.push(length.checked_sub(1).map(|last| ends[last]));
        match ends.get_mut(length) {
            Some(end) => *end = row,
            None => ends.push(row),
        }
    }
    let mut rows = Vec::with_capacity(ends.len());
    let mut at = ends.last().copied();
    while let Some(row) = at {
        rows.push(row);
        at = before[row];
    }
    rows.reverse();
    rows
}

/// First and last of the part with the most times that has no gap longer than [`GAP_MAX_US`]; `us` is sorted.
fn densest(us: &[u64]) -> Option<(u64, u64)> {
    let parts = us.chunk_by(|a, b| b - a <= GAP_MAX_US);
    let largest = parts.reduce(|a, b| if b.len() > a.len() { b } else { a })?;
    Some((*largest.first()?, *largest.last()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_that_does_not_fit_between_its_neighbours_is_left_out() {
        assert_eq!(longest_in_order(&[0, 2, 2, 6]), [0, 1, 2, 3]);
        assert_eq!(longest_in_order(&[0, 2, 1 << 60, 6, 8]), [0, 1, 3, 4]);
        assert_eq!(longest_in_order(&[1 << 60, 2, 4, 6]), [1, 2, 3]);
        assert_eq!(longest_in_order(&[0, 2, 4, 1, 8]), [0, 1, 2, 4]);
        assert_eq!(longest_in_order(&[]), [0; 0]);
    }

    #[test]
    fn the_span_is_that_of_most_rows() {
        assert_eq!(densest(&[]), None);
        assert_eq!(densest(&[5]), Some((5, 5)));
        assert_eq!(densest(&[0, 10, 20, u64::MAX]), Some((0, 20)));
        assert_eq!(densest(&[0, GAP_MAX_US]), Some((0, GAP_MAX_US)));
        assert_eq!(densest(&[0, 2 * GAP_MAX_US, 2 * GAP_MAX_US + 1]).unwrap().0, 2 * GAP_MAX_US);
    }
}
