//! What became of a flight: one line for people, files in the folder of `--out` for programs. Each file is whole, or is not
//! there.

use std::fmt;

use host_io::folder::OutFolder;
use plant_sim::Exceeded;
use serde::{Serialize, Serializer};

use crate::problem::Problem;

/// What became of the aircraft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fate {
    /// It flew to the end.
    Kept,
    Lost(Loss),
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
    /// This quantity was beyond all bounds, so the numbers of the airframe file make no sense.
    Broken(&'static str),
}

impl fmt::Display for LossBy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Limit(exceeded) => write!(f, "{exceeded}"),
            Self::Ground => f.write_str("on the ground"),
            Self::Broken(quantity) => write!(
                f,
                "{quantity} beyond all bounds; the likely cause are the numbers of the airframe file"
            ),
        }
    }
}

/// One measure of a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Metric {
    pub name: String,
    /// Unit of the value; `1` for a count or a ratio.
    pub unit: &'static str,
    /// The value; `None` where the flight has nothing to measure (no fault, too short).
    pub value: Option<f64>,
}

impl Metric {
    /// A measure; a value that is not finite is none.
    pub fn new(name: impl Into<String>, unit: &'static str, value: Option<f64>) -> Self {
        Self { name: name.into(), unit, value: value.filter(|value| value.is_finite()) }
    }
}

/// What became of a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Seed of its random streams.
    pub seed: u64,
    /// What became of the aircraft.
    pub fate: Fate,
    /// Simulation time at the end, s.
    pub end_s: f64,
    pub steps: u64,
    /// Altitude at the end and its reference, m.
    pub altitude_m: [f64; 2],
    /// Sensors that the estimator gave up, in the order of time.
    pub sensors_lost: Vec<SensorLost>,
    pub metrics: Vec<Metric>,
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
        self.fate == Fate::Kept
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
        match self.fate {
            Fate::Kept => write!(
                f,
                "seed {seed}: kept, {end_s:.3} s flown, altitude {altitude:.0} m, reference {reference:.0} m"
            ),
            Fate::Lost(Loss { at_s, by }) => {
                write!(f, "seed {seed}: lost at {at_s:.3} s, {by}; {end_s:.3} s flown")
            }
        }
    }
}

/// As in `outcome.json`.
impl Serialize for Outcome {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Shown<'a> {
            seed: u64,
            outcome: &'static str,
            lost_at_s: Option<f64>,
            lost_by: Option<String>,
            end_s: f64,
            control_steps: u64,
            #[serde(skip_serializing_if = "<[_]>::is_empty")]
            sensors_lost: &'a [SensorLost],
            metrics: Metrics<'a>,
        }
        let lost = match self.fate {
            Fate::Kept => None,
            Fate::Lost(loss) => Some(loss),
        };
        Shown {
            seed: self.seed,
            outcome: if lost.is_some() { "lost" } else { "kept" },
            lost_at_s: lost.map(|loss| loss.at_s),
            lost_by: lost.map(|loss| loss.by.to_string()),
            end_s: self.end_s,
            control_steps: self.steps,
            sensors_lost: &self.sensors_lost,
            metrics: Metrics(&self.metrics),
        }
        .serialize(to)
    }
}

/// A map from name to value and unit, in the order of the measures.
struct Metrics<'a>(&'a [Metric]);

impl Serialize for Metrics<'_> {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Shown {
            value: Option<f64>,
            unit: &'static str,
        }
        let shown = |metric: &Metric| Shown { value: metric.value, unit: metric.unit };
        to.collect_map(self.0.iter().map(|metric| (&metric.name, shown(metric))))
    }
}

/// The table of one flight.
pub(super) const TABLE: &str = "flight.csv";
/// What became of it.
pub(super) const OUTCOME: &str = "outcome.json";
pub(super) const LOG: &str = "flight.ulg";
pub(super) const FIGURES: &str = "flight.html";
/// One row for each seed.
pub(super) const SEEDS: &str = "seeds.csv";

/// Writes a value as JSON.
pub(super) fn write_json(
    folder: &OutFolder,
    name: &str,
    value: &impl Serialize,
) -> Result<(), Problem> {
    let mut json = serde_json::to_vec_pretty(value)?;
    json.push(b'\n');
    Ok(folder.write_marked(name, MARK.as_bytes(), &json)?)
}

/// How every JSON file of this command begins.
const MARK: &str = "{\n  \"program\": \"Two-Step sitl fly\"";
/// The first key of such a file.
pub(super) const PROGRAM: &str = "Two-Step sitl fly";
