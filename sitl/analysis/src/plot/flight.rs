//! A log as a flight: headers, signals by name, faults, and what happened.

use autopilot::recorder::{ControlHeader, Recorded};
use flight_control::{DesignModel, NavigationState};
use icd::record::{FieldName, TRUTH_HEAD, effector_field};
use icd::{EffectorKind, EffectorList, EulerAngles, PerEffector, tvc_jet};
use nalgebra::Vector3;
use plant_sim::io::header::PlantHeader;
use serde::de::DeserializeOwned;
use ulog::reader::{Log, Topic};

use super::NothingToDraw;
use super::happened::{FaultSpan, Happened};
use super::times::Times;
use crate::chart::curve::{Point, thin};
use crate::closed_loop;
use crate::replay;

/// Topics that have a row in each control step.
const TICKING: [&str; 4] = ["sensors", "control", "commands", "truth"];

/// A flight as its log tells it.
#[derive(Debug)]
pub struct Flight {
    /// The log.
    pub log: Log,
    /// The effectors of the aircraft.
    pub effectors: EffectorList,
    /// What the control side was made of, if the log says.
    pub control: Option<ControlHeader>,
    /// The scenario, if the log says.
    pub plant: Option<PlantHeader>,
    /// First and last time, s.
    pub span: (f64, f64),
    /// Control steps.
    pub steps: usize,
    /// What came in from outside, with the time in s.
    pub inputs: Vec<(f64, Recorded)>,
    /// Why the inputs could not be read.
    pub unread: Option<String>,
    /// When which fault acted; empty until the events are found.
    pub faults: Vec<FaultSpan>,
    /// What happened, in the order of time; empty until the events are found.
    pub happened: Vec<Happened>,
    /// Which rows can be drawn.
    times: Times,
    /// Entries that happened at a time that the flight does not have.
    pub strays: usize,
}

impl Flight {
    /// Of a log.
    ///
    /// # Errors
    /// [`NothingToDraw`] if it has no row.
    pub fn new(log: Log) -> Result<Self, NothingToDraw> {
        let ticking: Vec<Topic<'_>> =
            TICKING.iter().filter_map(|name| log.topic(name)).filter(|t| !t.is_empty()).collect();
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
            happened: Vec::new(),
            times,
            strays: 0,
        };
        let of_plant = flight.plant.as_ref().map(|plant| plant.setup.airframe.effectors);
        let of_control = flight.control.as_ref().map(|control| control.model.effectors.list);
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

    /// A signal over time, multiplied by `scale`; `None` if the log does not have it.
    pub fn signal(&self, topic: &str, column: &str, scale: f64) -> Option<Vec<Point>> {
        let topic = self.log.topic(topic).filter(|topic| !topic.is_empty())?;
        let values = self.column(&topic, column)?;
        let times = self.times_us(&topic).into_iter().map(|us| us as f64 * 1.0e-6);
        Some(times.zip(values.into_iter().map(|value| value * scale)).collect())
    }

    /// A column of the rows that can be drawn.
    fn column(&self, topic: &Topic<'_>, column: &str) -> Option<Vec<f64>> {
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
        let model = DesignModel::new(self.control.as_ref()?.model);
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
const STATE: &[&str; 10] = TRUTH_HEAD.first_chunk().expect("the truth begins with the state");

fn header<T: DeserializeOwned>(log: &Log, key: &str) -> Option<T> {
    // A page without a header is better than none; the page says what is missing.
    serde_json::from_str(log.info_text(key)?).ok()
}
