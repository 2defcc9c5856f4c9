//! Check cases: scenarios that are flown without a controller, from any state, with prescribed controls.
//!
//! The table `[checkcase]` names the airframe file; `[plant.initial_state]`, `[plant.controls]` and `[[plant.control_step]]`
//! describe what an ordinary scenario does not have. docs/checkcases.md has all keys.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use host_io::problem::{At as _, Problem, problem};
use icd::{Body, EffectorKind, EulerAngles, Ned, PerEffector, SimTime};
use serde::Deserialize;

use super::{PlantTable, ScenarioFile, StartPart};
use crate::airframe::Airframe;
use crate::config;
use crate::earth::EarthModel;
use crate::geodesy::Geodetic;
use crate::range::check_range;
use crate::release::{
    Controls, InitialPosition, InitialRates, InitialState, InitialVelocity, ReleaseSetup,
    STEP_RANGE_US,
};

/// Section names for errors.
const CASE: &str = "checkcase";
const INITIAL: &str = "plant.initial_state";

/// Step of the integration without `step_ms`, ms.
const STEP_MS: f64 = 1.0;
/// Rows per second without `output_rate_hz`.
const OUTPUT_RATE_HZ: f64 = 20.0;
/// Longest case, s: a day.
pub const DURATION_MAX_S: f64 = 86_400.0;
/// Most rows of the output.
pub const ROWS_MAX: u64 = 1_000_000;

/// The table `[checkcase]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CaseTable {
    airframe: String,
    reference: Option<String>,
    step_ms: Option<f64>,
    output_rate_hz: Option<f64>,
    flat_gravity_m_s2: Option<f64>,
}

/// The table `[plant.initial_state]`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct InitialTable {
    latitude_deg: Option<f64>,
    longitude_deg: Option<f64>,
    altitude_m: Option<f64>,
    position_ned_m: Option<[f64; 3]>,
    velocity_ned_m_s: Option<[f64; 3]>,
    velocity_body_m_s: Option<[f64; 3]>,
    roll_deg: Option<f64>,
    pitch_deg: Option<f64>,
    yaw_deg: Option<f64>,
    rates_inertial_deg_s: Option<[f64; 3]>,
    rates_earth_deg_s: Option<[f64; 3]>,
    rates_ned_deg_s: Option<[f64; 3]>,
    trim: Option<TrimKind>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum TrimKind {
    /// Pitch angle, elevator and thrust.
    Longitudinal,
}

/// A `[[plant.control_step]]`: a change against the controls at the start.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ControlStepTable {
    at_s: f64,
    controls: BTreeMap<String, f64>,
}

/// A file of a check case that was read, before its airframe is.
pub struct CaseFile {
    name: String,
    case: CaseTable,
    file: ScenarioFile,
}

/// Values that replace those of the file.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CaseOptions {
    /// Step of the integration, ms.
    pub step_ms: Option<f64>,
    pub output_rate_hz: Option<f64>,
}

/// A check case, ready to be flown.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckCase {
    pub setup: ReleaseSetup,
    /// Its duration: a whole number of steps.
    pub duration: SimTime,
    /// Time from row to row, µs: a whole number of steps.
    pub output_us: u64,
    /// Steps of the controls, in order of time.
    pub steps: Vec<ControlStep>,
    /// Name of the case in reference data.
    pub reference: Option<String>,
}

/// From a time on the controls are those of the start and these changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlStep {
    /// When: a multiple of the step.
    pub at: SimTime,
    /// Added to the controls of the start.
    pub change: Controls,
}

impl CaseFile {
    /// Reads a file; errors call it `name`.
    pub fn from_toml(name: &str, text: &str) -> Result<Self, Problem> {
        Self::read(name, config::parse(name, text)?, Some(text))
    }

    /// Reads a file that was parsed already and may have been changed since.
    pub fn from_table(name: &str, table: toml::Table) -> Result<Self, Problem> {
        Self::read(name, table, None)
    }

    fn read(name: &str, table: toml::Table, text: Option<&str>) -> Result<Self, Problem> {
        let mut file = ScenarioFile::read(name, table, text)?;
        let Some(case) = file.checkcase.take() else {
            let problem = "is missing, a check case names its airframe file";
            return Err(key(CASE, "airframe", problem)).at(name);
        };
        Ok(Self { name: name.to_owned(), case, file })
    }

    /// Path of the airframe file, from the folder of this file if it is relative.
    pub fn airframe(&self) -> PathBuf {
        let folder = Path::new(&self.name).parent().unwrap_or_else(|| Path::new(""));
        folder.join(&self.case.airframe)
    }

    /// The case with this airframe.
    pub fn into_case(
        self,
        airframe: Airframe,
        options: &CaseOptions,
    ) -> Result<CheckCase, Problem> {
        let name = self.name;
        read_case(self.case, self.file.plant, airframe, options).at(name)
    }
}

fn read_case(
    case: CaseTable,
    mut plant: PlantTable,
    airframe: Airframe,
    options: &CaseOptions,
) -> Result<CheckCase, Problem> {
    let excluded = |section, other| Err(problem!("[{section}] has no meaning beside {other}"));
    if plant.start != StartPart::default() {
        return excluded("plant.start", "[checkcase], which has [plant.initial_state]");
    }
    if plant.sensors.is_some() {
        return excluded("plant.sensors", "[checkcase], which has no sensors");
    }
    if !plant.control_step.is_empty() && !plant.fault.is_empty() {
        return excluded("plant.fault", "[[plant.control_step]], which moves healthy effectors");
    }
    let earth = plant.earth.unwrap_or(EarthModel::Wgs84);
    if case.flat_gravity_m_s2.is_some() && earth != EarthModel::Flat {
        let problem = "has no meaning on this Earth, expected earth = \"flat\"";
        return Err(key(CASE, "flat_gravity_m_s2", problem));
    }
    let Some(initial) = plant.initial_state.take() else {
        return Err(key(INITIAL, "velocity_ned_m_s", "is missing, and so is the table"));
    };
    let initial = initial.read(earth)?;
    let reader = CaseReader { airframe: &airframe };
    let given = plant.controls.take().unwrap_or_default();
    let given = reader.at_start(&given, initial.is_trimmed)?;
    let step_tables = std::mem::take(&mut plant.control_step);
    let grid = StepGrid::new(&case, options, plant.duration_s)?;
    let mut steps = Vec::new();
    for table in step_tables {
        let at = grid.time(table.at_s)?;
        steps.push(ControlStep { at, change: reader.change(&table.controls)? });
    }
    steps.sort_by_key(|step| step.at);
    let part = plant.into_part(&airframe.effectors)?;
    let setup = ReleaseSetup {
        airframe,
        earth,
        flat_gravity: case.flat_gravity_m_s2,
        wind: part.wind,
        gusts: part.gusts,
        profile: part.profile,
        temperature_offset_k: part.temperature_offset_k,
        initial,
        controls: given,
        faults: part.faults,
        seed: part.seed,
        step_us: grid.step_us,
    };
    setup.check()?;
    Ok(CheckCase {
        setup,
        duration: grid.duration,
        output_us: grid.output_us,
        steps,
        reference: case.reference,
    })
}

/// Steps and rows of a case.
struct StepGrid {
    step_us: u32,
    output_us: u64,
    duration: SimTime,
}

impl StepGrid {
    fn new(
        case: &CaseTable,
        options: &CaseOptions,
        duration_s: Option<f64>,
    ) -> Result<Self, Problem> {
        let step_ms = options.step_ms.or(case.step_ms).unwrap_or(STEP_MS);
        let [least, most] = STEP_RANGE_US.map(|step_us| f64::from(step_us) / 1_000.0);
        check_range(CASE, "step_ms", step_ms, least, most)?;
        let Some(step_us) = whole(step_ms * 1_000.0) else {
            let problem = format!("= {step_ms} is no whole number of microseconds");
            return Err(key(CASE, "step_ms", &problem));
        };
        let rate = options.output_rate_hz.or(case.output_rate_hz).unwrap_or(OUTPUT_RATE_HZ);
        let fastest = 1.0e3 / step_ms;
        check_range(CASE, "output_rate_hz", rate, 1.0e-3, fastest)?;
        let Some(output_us) = whole(fastest / rate).map(|steps| steps * step_us) else {
            let fitting = fastest / libm::round(fastest / rate);
            let problem = format!(
                "= {rate} is no whole number of steps of {step_ms} ms from row to row; expected {fastest} over a whole \
                 number, as {fitting}"
            );
            return Err(key(CASE, "output_rate_hz", &problem));
        };
        let Some(duration_s) = duration_s else {
            return Err(key("plant", "duration_s", "is missing, a check case needs an end"));
        };
        check_range("plant", "duration_s", duration_s, 1.0e-3, DURATION_MAX_S)?;
        let Some(duration) = whole(duration_s * 1.0e6).filter(|us| us.is_multiple_of(step_us))
        else {
            let problem = format!("= {duration_s} is no whole number of steps of {step_ms} ms");
            return Err(key("plant", "duration_s", &problem));
        };
        // Both ends have a row.
        let rows = duration / output_us + 1;
        if rows > ROWS_MAX {
            let problem = format!(
                "= {duration_s} makes {rows} rows with output_rate_hz = {rate}, expected at most {ROWS_MAX}"
            );
            return Err(key("plant", "duration_s", &problem));
        }
        // Its range was checked in milliseconds above.
        let step_us = u32::try_from(step_us).unwrap_or(STEP_RANGE_US[1]);
        Ok(Self { step_us, output_us, duration: SimTime::from_micros(duration) })
    }

    /// The time of a control step.
    fn time(&self, at_s: f64) -> Result<SimTime, Problem> {
        let section = "plant.control_step";
        check_range(section, "at_s", at_s, 0.0, self.duration.as_seconds())?;
        let whole = whole(at_s * 1.0e6).filter(|us| us.is_multiple_of(u64::from(self.step_us)));
        whole.map(SimTime::from_micros).ok_or_else(|| {
            let step_ms = f64::from(self.step_us) / 1_000.0;
            let problem = format!("= {at_s} is no whole number of steps of {step_ms} ms");
            key(section, "at_s", &problem)
        })
    }
}

/// A positive number that is whole but for the rounding of its decimals; zero is whole too.
fn whole(value: f64) -> Option<u64> {
    let rounded = libm::round(value);
    // Callers check the range.
    ((value - rounded).abs() <= 1.0e-9 * rounded.max(1.0)).then_some(rounded as u64)
}

impl InitialTable {
    fn read(&self, earth: EarthModel) -> Result<InitialState, Problem> {
        let one_of = |what: &str, keys: &str, found: usize| {
            let found = if found == 0 { "none" } else { "several" };
            key(INITIAL, keys, &format!("- {found} of them for {what}, expected exactly one"))
        };
        let velocities = [self.velocity_ned_m_s, self.velocity_body_m_s];
        let velocity = match velocities {
            [Some([x, y, z]), None] => InitialVelocity::Ned(Ned::new(x, y, z)),
            [None, Some([x, y, z])] => InitialVelocity::Body(Body::new(x, y, z)),
            _ => {
                let keys = "velocity_ned_m_s, velocity_body_m_s";
                return Err(one_of("the velocity", keys, velocities.iter().flatten().count()));
            }
        };
        let rates = [self.rates_inertial_deg_s, self.rates_earth_deg_s, self.rates_ned_deg_s];
        let in_body = |rates: [f64; 3]| Body(rates.map(f64::to_radians).into());
        let rates = match rates {
            [Some(rates), None, None] => InitialRates::Inertial(in_body(rates)),
            [None, Some(rates), None] => InitialRates::Earth(in_body(rates)),
            [None, None, Some(rates)] => InitialRates::Ned(in_body(rates)),
            _ => {
                let keys = "rates_inertial_deg_s, rates_earth_deg_s, rates_ned_deg_s";
                return Err(one_of("the body rates", keys, rates.iter().flatten().count()));
            }
        };
        let is_trimmed = self.trim.is_some();
        if is_trimmed && self.pitch_deg.is_some() {
            let problem = "has no meaning beside trim = \"longitudinal\", which finds it";
            return Err(key(INITIAL, "pitch_deg", problem));
        }
        if is_trimmed && self.velocity_body_m_s.is_some() {
            let problem =
                "has no meaning beside trim = \"longitudinal\", expected velocity_ned_m_s";
            return Err(key(INITIAL, "velocity_body_m_s", problem));
        }
        let angle = |degrees: Option<f64>| degrees.unwrap_or(0.0).to_radians();
        let attitude = EulerAngles {
            phi: angle(self.roll_deg),
            theta: angle(self.pitch_deg),
            psi: angle(self.yaw_deg),
        };
        let position = self.position(earth)?;
        Ok(InitialState { position, velocity, attitude, rates, is_trimmed })
    }

    fn position(&self, earth: EarthModel) -> Result<InitialPosition, Problem> {
        // A flat Earth is the same everywhere.
        let coordinate = |name, value: Option<f64>| match value {
            None if earth != EarthModel::Flat => Err(key(INITIAL, name, "is missing")),
            degrees => Ok(degrees.unwrap_or(0.0).to_radians()),
        };
        let latitude_rad = coordinate("latitude_deg", self.latitude_deg)?;
        let longitude_rad = coordinate("longitude_deg", self.longitude_deg)?;
        let at = |altitude_m| Geodetic { latitude_rad, longitude_rad, altitude_m };
        match (self.altitude_m, self.position_ned_m) {
            (Some(altitude_m), None) => Ok(InitialPosition::Geodetic(at(altitude_m))),
            (None, Some([north, east, down])) => {
                let position = Ned::new(north, east, down);
                Ok(InitialPosition::Local { origin: at(0.0), position })
            }
            (None, None) => {
                Err(key(INITIAL, "altitude_m", "is missing, expected it or position_ned_m"))
            }
            (Some(_), Some(_)) => {
                let problem = "has no meaning beside altitude_m, expected one of them";
                Err(key(INITIAL, "position_ned_m", problem))
            }
        }
    }
}

fn key(section: &str, key: &str, problem: &str) -> Problem {
    problem!("[{section}] {key} {problem}")
}

// Prescribed controls: keys of effectors, of a pilot's commands, and of the engine.

const CONTROLS: &str = "plant.controls";
/// Key of the engine's lever.
const THROTTLE: &str = "throttle_percent";
/// Commands that several effectors follow, in the order of [`Airframe::follow`].
const COMMANDS: [&str; 3] = ["aileron", "elevator", "rudder"];

/// Reads controls for an aircraft.
struct CaseReader<'a> {
    airframe: &'a Airframe,
}

impl CaseReader<'_> {
    /// The controls at the start. An engine has to be among them, unless a trim finds its thrust.
    fn at_start(
        &self,
        table: &BTreeMap<String, f64>,
        is_trimmed: bool,
    ) -> Result<Controls, Problem> {
        let controls = self.change(table)?;
        let Some(engine) = self.airframe.effectors.only(EffectorKind::Engine) else {
            return Ok(controls);
        };
        let thrust_key = format!("{}_n", self.airframe.effectors.key(engine));
        let engine_key = if self.has_lever() { THROTTLE } else { thrust_key.as_str() };
        let is_engine = |name: &String| name == THROTTLE || config::factor_to(name, "n").is_some();
        let is_given = table.keys().any(is_engine);
        match (is_trimmed, is_given) {
            (true, true) => {
                let problem = "has no meaning beside trim = \"longitudinal\", which finds it";
                Err(key(CONTROLS, engine_key, problem))
            }
            (false, false) => {
                Err(key(CONTROLS, engine_key, "is missing, the aircraft has an engine"))
            }
            _ => Ok(controls),
        }
    }

    /// Controls, or changes of them.
    fn change(&self, table: &BTreeMap<String, f64>) -> Result<Controls, Problem> {
        let mut controls = Controls::default();
        for (name, value) in table {
            if name == THROTTLE && self.has_lever() {
                controls.lever = Some(value / 100.0);
                continue;
            }
            let followed = self.positions(name, *value).ok_or_else(|| {
                let known = self.known().join(", ");
                let problem = match known.is_empty() {
                    true => "has no meaning for a body without effectors".to_owned(),
                    false => format!("is unknown, expected one of {known}"),
                };
                key(CONTROLS, name, &problem)
            })?;
            controls.positions = PerEffector::from_fn(|e| controls.positions[e] + followed[e]);
        }
        Ok(controls)
    }

    /// What one key gives: the position of one effector, or those of all that follow a command.
    fn positions(&self, name: &str, value: f64) -> Option<PerEffector<f64>> {
        let list = &self.airframe.effectors;
        let mut positions = PerEffector::default();
        if let Some((stem, factor)) = config::factor_to(name, "deg") {
            let angle_rad = (value * factor).to_radians();
            // A single effector first: an aircraft with one elevator may call it like the command.
            if let Some(effector) = list.by_key(stem).filter(|effector| list.is_angle(*effector)) {
                positions[effector] = angle_rad;
                return Some(positions);
            }
            let command = COMMANDS.iter().position(|command| *command == stem)?;
            let mut commands = [0.0; 4];
            commands[command] = angle_rad;
            let has_follower = list.all().any(|effector| {
                let gains = &self.airframe.gains[effector];
                [gains.roll, gains.pitch, gains.yaw][command] != 0.0
            });
            return has_follower.then(|| self.airframe.follow(commands));
        }
        let (stem, factor) = config::factor_to(name, "n")?;
        let engine = list.by_key(stem).filter(|e| !list.is_angle(*e) && !self.has_lever())?;
        positions[engine] = value * factor;
        Some(positions)
    }

    fn has_lever(&self) -> bool {
        self.airframe.propulsion.is_some()
    }

    /// All keys of this aircraft.
    fn known(&self) -> Vec<String> {
        let list = &self.airframe.effectors;
        let of_effector = |effector| {
            let stem = list.key(effector);
            match (list.is_angle(effector), self.has_lever()) {
                (true, _) => format!("{stem}_deg"),
                (false, true) => THROTTLE.to_owned(),
                (false, false) => format!("{stem}_n"),
            }
        };
        let mut known: Vec<String> = list.all().map(of_effector).collect();
        if !known.is_empty() {
            known.extend(COMMANDS.map(|command| format!("{command}_deg")));
        }
        known
    }
}

#[cfg(test)]
mod tests;
