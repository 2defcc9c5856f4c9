//! Scenarios: a file becomes a [`Scenario`].
//!
//! A file has two tables. `[plant]` is read here; `[autopilot]` belongs to the flight software and is
//! ignored, so that neither side needs to know the other's keys. A file with `[checkcase]` is flown without a controller
//! ([`case`]).

use host_io::problem::{At as _, Problem, problem};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

use icd::{ControlPeriod, EffectorList, SimTime};
use serde::Deserialize;
use serde::de::{Error as _, IgnoredAny};

use crate::airframe::Airframe;
use crate::atmosphere::Atmosphere;
use crate::config::keys::gather;
use crate::config::{self, units};
use crate::date::NoDate;
use crate::earth::EarthModel;
use crate::faults::ScheduledFault;
use crate::range::check_range;
use crate::sensors::{SensorSettings, SensorsTable};
use crate::setup::PlantSetup;
use crate::start::{Start, StartPart};
use crate::wind::{
    DiscreteGust, TurbulenceName, WindLevel, WindProfile, WindSettings, check_gusts,
};

pub mod case;
mod fault_table;

use case::{CaseTable, ControlStepTable, InitialTable};
use fault_table::FaultTable;

/// Level flight without commands and without faults.
pub const NOMINAL: &str = include_str!("../scenarios/nominal.toml");
/// The paper's first case: climb with a left elevator that jams at +30 degrees.
pub const CASE1: &str = include_str!("../scenarios/case1.toml");
/// The paper's second case: turn with a rudder that jams at +7 degrees.
pub const CASE2: &str = include_str!("../scenarios/case2.toml");

/// The scenarios that come with the program, by name.
pub const SCENARIOS: [(&str, &str); 3] = [("nominal", NOMINAL), ("case1", CASE1), ("case2", CASE2)];

/// The plant's part of one scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    pub plant: PlantPart,
}

/// The plant's part of a scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantPart {
    /// Seed of the random streams.
    pub seed: u64,
    /// Duration of the flight, s; `None` where the scenario has no duration.
    pub duration_s: Option<f64>,
    /// Where the flight starts; missing values are those of the design point of the airframe.
    pub start: StartPart,
    /// The Earth model; WGS-84 if the file has none.
    pub earth: EarthModel,
    /// Wind and turbulence; calm if the file has none.
    pub wind: WindSettings,
    /// Wind over the altitude, added to the steady one; none if the file has none.
    pub profile: WindProfile,
    /// How much warmer the air is than the standard, K.
    pub temperature_offset_k: f64,
    /// Discrete gusts; none if the file has none.
    pub gusts: Vec<DiscreteGust>,
    /// Errors of the sensors; ideal if the file has none.
    pub sensors: SensorSettings,
    /// The faults and their times.
    pub faults: Vec<ScheduledFault>,
}

impl Scenario {
    /// Reads a scenario file for an aircraft with these effectors; errors call it `name`.
    pub fn from_toml(name: &str, text: &str, effectors: &EffectorList) -> Result<Self, Problem> {
        ScenarioFile::parse(name, text)?.into_scenario(name, effectors)
    }

    /// Reads a file that was parsed already and may have been changed since.
    pub fn from_table(
        name: &str,
        table: toml::Table,
        effectors: &EffectorList,
    ) -> Result<Self, Problem> {
        ScenarioFile::of_table(name, table)?.into_scenario(name, effectors)
    }
}

impl PlantPart {
    /// The flight of this scenario with an aircraft, as run number `run`.
    pub fn setup(
        &self,
        airframe: Airframe,
        run: u64,
        period: ControlPeriod,
        step_us: u32,
    ) -> PlantSetup {
        PlantSetup {
            start: self.start.over(&airframe.design_point),
            airframe,
            earth: self.earth,
            wind: self.wind,
            profile: self.profile.clone(),
            temperature_offset_k: self.temperature_offset_k,
            gusts: self.gusts.clone(),
            sensors: self.sensors,
            faults: self.faults.clone(),
            seed: self.seed,
            run,
            period,
            step_us,
        }
    }
}

/// The plant's part of a scenario file as written: the keys that it has.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    // First, because the search for keys ends at the faults, which no number satisfies.
    checkcase: Option<CaseTable>,
    plant: PlantTable,
    #[serde(default, rename = "autopilot")]
    _autopilot: Option<IgnoredAny>,
}

impl ScenarioFile {
    fn parse(name: &str, text: &str) -> Result<Self, Problem> {
        config::parse_in_units(name, text, known_keys())
    }

    fn of_table(name: &str, mut table: toml::Table) -> Result<Self, Problem> {
        convert_units(name, &mut table)?;
        config::of_table(name, table)
    }

    fn into_scenario(self, name: &str, effectors: &EffectorList) -> Result<Scenario, Problem> {
        let of_cases = [("checkcase", self.checkcase.is_some())].into_iter();
        if let Some((section, _)) =
            of_cases.chain(self.plant.of_cases()).find(|(_, is_there)| *is_there)
        {
            let other = "an autopilot: `sitl study checkcase` flies it";
            return Err(problem!("{name}: [{section}] has no meaning beside {other}"));
        }
        if self.plant.seed.is_none() {
            return Err(toml::de::Error::missing_field("seed")).at(name);
        }
        Ok(Scenario { plant: self.plant.into_part(name, effectors)? })
    }
}

/// Converts the keys of a parsed file that have units of its sources to those that its reader has.
pub fn convert_units(name: &str, table: &mut toml::Table) -> Result<(), Problem> {
    units::convert(name, table, known_keys()).map(drop)
}

/// The keys of a scenario file.
fn known_keys() -> &'static BTreeSet<String> {
    static KEYS: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
        let mut keys = BTreeSet::new();
        gather::<ScenarioFile>("", &mut keys);
        keys
    });
    &KEYS
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantTable {
    /// A check case needs none.
    seed: Option<u64>,
    duration_s: Option<f64>,
    earth: Option<EarthModel>,
    #[serde(default)]
    start: StartPart,
    initial_state: Option<InitialTable>,
    controls: Option<BTreeMap<String, f64>>,
    #[serde(default)]
    control_step: Vec<ControlStepTable>,
    atmosphere: Option<AtmosphereTable>,
    wind: Option<WindTable>,
    date: Option<String>,
    sensors: Option<SensorsTable>,
    #[serde(default)]
    gust: Vec<DiscreteGust>,
    #[serde(default)]
    fault: Vec<FaultTable>,
}

/// Missing values are calm.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct WindTable {
    speed_m_s: f64,
    towards_deg: f64,
    down_m_s: f64,
    turbulence_m_s: f64,
    turbulence: Option<TurbulenceName>,
    level: Vec<WindLevel>,
}

/// Missing values are those of the standard.
#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields, default)]
struct AtmosphereTable {
    temperature_offset_k: f64,
}

impl PlantTable {
    /// Tables that only a check case has, and whether they are there.
    fn of_cases(&self) -> [(&'static str, bool); 3] {
        [
            ("plant.initial_state", self.initial_state.is_some()),
            ("plant.controls", self.controls.is_some()),
            ("plant.control_step", !self.control_step.is_empty()),
        ]
    }

    fn into_part(self, file: &str, effectors: &EffectorList) -> Result<PlantPart, Problem> {
        if let Some(duration_s) = self.duration_s {
            check_range("plant", "duration_s", duration_s, 0.001, SimTime::MAX_SECONDS).at(file)?;
        }
        self.start.over(&Start::NOT_USED).check().at(file)?;
        let table = self.wind.unwrap_or_default();
        let wind = WindSettings {
            speed_m_s: table.speed_m_s,
            towards_rad: table.towards_deg.to_radians(),
            down_m_s: table.down_m_s,
            turbulence_m_s: table.turbulence_m_s,
            turbulence: table.turbulence.and_then(TurbulenceName::level),
        };
        let profile = WindProfile::new(table.level).at(file)?;
        wind.check().at(file)?;
        let temperature_offset_k = self.atmosphere.unwrap_or_default().temperature_offset_k;
        Atmosphere::check(temperature_offset_k).at(file)?;
        check_gusts(&self.gust).at(file)?;
        let mut sensors = self.sensors.unwrap_or_default().settings(file)?;
        if let Some(date) = &self.date {
            sensors.date =
                date.parse().map_err(|error: NoDate| problem!("{file}: [plant] {error}"))?;
        }
        sensors.check(ControlPeriod::DEFAULT.as_micros()).at(file)?;
        let faults = self.fault.iter().enumerate();
        Ok(PlantPart {
            seed: self.seed.unwrap_or_default(),
            duration_s: self.duration_s,
            start: self.start,
            earth: self.earth.unwrap_or(EarthModel::Wgs84),
            wind,
            profile,
            temperature_offset_k,
            gusts: self.gust,
            sensors,
            faults: faults
                .map(|(i, f)| f.read(file, i + 1, effectors))
                .collect::<Result<_, _>>()?,
        })
    }
}

#[cfg(test)]
mod tests;
