//! What became of a flight: one line for people, files in the folder of `--out` for programs. Each file is whole, or is not
//! there.

use std::fmt;

use autopilot::autopilot::Settings;
use host_io::folder::OutFolder;
use plant_sim::touchdown::Touchdown;
use plant_sim::{ContactFailure, Exceeded, PlantSetup};
use serde::{Serialize, Serializer};

use host_io::problem::Problem;
use lab_engine::FlightSetup;

/// Everything that defines a flight, but the code of a law of the program: enough to fly it again.
#[derive(Serialize)]
pub struct WholeSetup<'a> {
    plant: &'a PlantSetup,
    control: Settings,
    duration_s: f64,
}

impl<'a> WholeSetup<'a> {
    /// Of a flight.
    pub fn of(setup: &'a FlightSetup) -> Self {
        let duration_s = setup.duration.as_seconds();
        Self { plant: &setup.plant, control: setup.settings(), duration_s }
    }
}

/// When and how an aircraft was lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// Simulation time, s.
    pub at_s: f64,
    pub by: LossBy,
}

/// How an aircraft was lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LossBy {
    /// It passed a limit of its airframe file.
    Limit(Exceeded),
    /// It touched the ground.
    Ground,
    /// It passed a limit of its gear.
    Crash(ContactFailure),
    /// This quantity was beyond all bounds, so the numbers of the airframe file make no sense.
    Broken(&'static str),
}

impl fmt::Display for LossBy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Limit(exceeded) => write!(f, "{exceeded}"),
            Self::Ground => f.write_str("on the ground"),
            Self::Crash(failure) => write!(f, "{failure}"),
            Self::Broken(quantity) => write!(
                f,
                "{quantity} beyond all bounds; the likely cause are the numbers of the airframe file"
            ),
        }
    }
}

/// One measure of a flight.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Metric {
    #[serde(skip)]
    pub name: String,
    /// The value; `None` where the flight has nothing to measure (no fault, too short).
    pub value: Option<f64>,
    /// Unit of the value; `1` for a count or a ratio.
    pub unit: &'static str,
}

impl Metric {
    /// A measure; a value that is not finite is none.
    pub fn new(name: impl Into<String>, unit: &'static str, value: Option<f64>) -> Self {
        Self { name: name.into(), unit, value: value.filter(|value| value.is_finite()) }
    }
}

/// What became of a flight; also its part of `outcome.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// Seed of its random streams.
    pub seed: u64,
    /// The loss of the aircraft; `None` if it flew to the end.
    #[serde(flatten, serialize_with = "with_words")]
    pub loss: Option<Loss>,
    /// Simulation time at the end, s.
    pub end_s: f64,
    #[serde(rename = "control_steps")]
    pub steps: u64,
    /// Altitude at the end and its reference, m.
    #[serde(skip)]
    pub altitude_m: [f64; 2],
    /// Sensors that the estimator gave up, in the order of time.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub sensors_lost: Vec<SensorLost>,
    /// The first one of a flight over a ground.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub touchdown: Option<Touchdown>,
    #[serde(serialize_with = "by_name")]
    pub metrics: Vec<Metric>,
}

fn with_words<S: Serializer>(loss: &Option<Loss>, to: S) -> Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Words {
        outcome: &'static str,
        lost_at_s: Option<f64>,
        lost_by: Option<String>,
    }
    let outcome = if loss.is_some() { "lost" } else { "kept" };
    let (lost_at_s, lost_by) = loss.map(|Loss { at_s, by }| (at_s, by.to_string())).unzip();
    Words { outcome, lost_at_s, lost_by }.serialize(to)
}

/// A map from name to value and unit, in the order of the measures.
fn by_name<S: Serializer>(metrics: &[Metric], to: S) -> Result<S::Ok, S::Error> {
    to.collect_map(metrics.iter().map(|metric| (&metric.name, metric)))
}

/// A sensor that the estimator gave up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SensorLost {
    pub sensor: &'static str,
    /// When, s.
    pub at_s: f64,
    pub why: &'static str,
}

impl Outcome {
    /// Whether the aircraft was kept.
    pub fn is_kept(&self) -> bool {
        self.loss.is_none()
    }

    /// The value of a measure.
    pub fn metric(&self, name: &str) -> Option<f64> {
        self.metrics.iter().find(|metric| metric.name == name)?.value
    }
}

/// The line for people, but for what was flown.
impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { seed, end_s, altitude_m: [altitude, reference], .. } = self;
        match self.loss {
            None => {
                write!(f, "seed {seed}: kept, {end_s:.3} s flown, ")?;
                match &self.touchdown {
                    Some(Touchdown { time, sink_m_s, along_m, across_m, .. }) => write!(
                        f,
                        "touchdown at {} s with {sink_m_s:.1} m/s, {along_m:.0} m behind the threshold, {across_m:.1} m to the right",
                        time.as_seconds()
                    ),
                    None => {
                        write!(f, "altitude {altitude:.0} m, reference {reference:.0} m")
                    }
                }
            }
            Some(Loss { at_s, by }) => {
                write!(f, "seed {seed}: lost at {at_s:.3} s, {by}; {end_s:.3} s flown")
            }
        }
    }
}

/// The table of one flight.
pub const TABLE: &str = "flight.csv";
/// What became of it.
pub const OUTCOME: &str = "outcome.json";
pub const LOG: &str = "flight.ulg";
pub const FIGURES: &str = "flight.html";
pub const MCAP: &str = "flight.mcap";

/// Writes a value as JSON.
pub fn write_json(folder: &OutFolder, name: &str, value: &impl Serialize) -> Result<(), Problem> {
    let mut json = serde_json::to_vec_pretty(value)?;
    json.push(b'\n');
    folder.write_marked(name, MARK.as_bytes(), &json)
}

/// How every JSON file of this command begins.
const MARK: &str = "{\n  \"program\": \"Two-Step sitl fly\"";
/// The first key of such a file.
pub const PROGRAM: &str = "Two-Step sitl fly";
