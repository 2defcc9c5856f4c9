//! References by simulation time, from the autopilot's part of a scenario.

use icd::SimTime;
use serde::{Deserialize, Serialize};

use crate::TextError;

/// Entries that a schedule may have.
const ENTRIES_MAX: usize = 1000;
/// Range of altitude references in a scenario, m.
pub const ALTITUDE_M: (f64, f64) = (0.0, 20_000.0);
/// Range of roll references in a scenario, deg.
pub const ROLL_DEG: (f64, f64) = (-80.0, 80.0);
/// Range of airspeed references in a scenario, m/s.
pub const AIRSPEED_M_S: (f64, f64) = (5.0, 500.0);

/// One entry as written in the file.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceEntry {
    pub at_s: f64,
    pub altitude_m: Option<f64>,
    pub roll_deg: Option<f64>,
    pub airspeed_m_s: Option<f64>,
}

/// New references at a time; those not named stay.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScheduledReference {
    pub at: SimTime,
    /// Altitude, m.
    pub altitude_m: Option<f64>,
    /// Roll angle, rad.
    pub roll_rad: Option<f64>,
    /// True airspeed, m/s.
    pub airspeed_m_s: Option<f64>,
}

#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ReferenceSchedule(Vec<ScheduledReference>);

impl ReferenceSchedule {
    /// Checks the entries of a file.
    pub fn new(entries: Vec<ReferenceEntry>) -> Result<Self, TextError> {
        if entries.len() > ENTRIES_MAX {
            let count = entries.len();
            let why = format!("{count} entries, at most {ENTRIES_MAX} are allowed");
            return Err(TextError::at("[[autopilot.reference]]", why));
        }
        let mut schedule: Vec<ScheduledReference> = Vec::with_capacity(entries.len());
        for (index, entry) in entries.iter().enumerate() {
            let refused = |why: String| {
                TextError::at(format!("[[autopilot.reference]] number {}", index + 1), why)
            };
            let scheduled = entry.check().map_err(refused)?;
            if schedule.last().is_some_and(|before| before.at > scheduled.at) {
                return Err(refused("at_s is earlier than that of the entry before".to_owned()));
            }
            schedule.push(scheduled);
        }
        Ok(Self(schedule))
    }

    /// The entry at `index`, in the order of time.
    pub fn entry(&self, index: usize) -> Option<&ScheduledReference> {
        self.0.get(index)
    }
}

impl ReferenceEntry {
    fn check(&self) -> Result<ScheduledReference, String> {
        let outside = |key, value, (min, max)| format!("{key} = {value} is outside {min} to {max}");
        let inside = |key, value: Option<f64>, range: (f64, f64)| match value {
            Some(value) if !(range.0..=range.1).contains(&value) => Err(outside(key, value, range)),
            other => Ok(other),
        };
        let at = SimTime::from_seconds(self.at_s)
            .ok_or_else(|| outside("at_s", self.at_s, (0.0, SimTime::MAX_SECONDS)))?;
        Ok(ScheduledReference {
            at,
            altitude_m: inside("altitude_m", self.altitude_m, ALTITUDE_M)?,
            roll_rad: inside("roll_deg", self.roll_deg, ROLL_DEG)?.map(f64::to_radians),
            airspeed_m_s: inside("airspeed_m_s", self.airspeed_m_s, AIRSPEED_M_S)?,
        })
    }
}
