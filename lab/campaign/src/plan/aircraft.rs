//! An aircraft of a campaign: its files, and what the values of the variables are for it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use autopilot::config::Model;
use host_io::problem::{Problem, problem};
use icd::{Effector, EffectorKind, EffectorList};
use lab_engine::configuration::{AircraftArgs, Named};
use lab_engine::settings::{Setting, number};
use lab_judges::measures::Measures;
use plant_sim::{Airframe, airframe_file};

use super::{Plan, Value};
use crate::spec::{
    AirframeSpec, Each, JointCase, JointMeaning, Meaning, RUNS_MAX, SpecFile, Variable,
    settings_of, text_of,
};

/// Keys of a fault whose numbers can be parts of a travel.
const TRAVELS: [&str; 3] = [".angle_deg", ".bias_deg", ".amplitude_deg"];

/// The same of an engine monitor, whose numbers can be parts of the range of the thrust.
const THRUSTS: [&str; 3] = [".bias_kn", ".rate_kn_s", ".noise_kn"];

/// An aircraft of the campaign, read and checked.
#[derive(Debug)]
pub struct Aircraft {
    pub name: String,
    /// Its files, and what every flight of it has.
    pub args: AircraftArgs,
    /// The aircraft, without what is varied.
    pub airframe: Airframe,
    /// Names and units of the measures of its flights.
    pub measures: Vec<(String, &'static str)>,
    pub(super) model: Model,
    pub(super) airframe_file: toml::Table,
    pub(super) model_file: toml::Table,
    /// The values of every listed variable, `None` of a drawn one.
    pub(super) lists: Vec<Option<Vec<Value>>>,
    /// For every variable its cases by name, as settings of this aircraft.
    pub(super) cases: Vec<Vec<(String, Vec<Setting>)>>,
    /// Combinations of the listed values.
    pub(super) combinations: u64,
    /// Number of its first flight.
    pub(crate) first: u64,
    /// Effectors and keys of the model that the specification names and this aircraft lacks.
    pub(super) lacking: BTreeSet<String>,
    /// Keys that are not set for this aircraft; one that ends with a point is a whole table.
    unset: Vec<String>,
}

impl Aircraft {
    /// Reads its files and lists the values of the listed variables.
    pub(super) fn read(
        spec: &AirframeSpec,
        file: &SpecFile,
        scenario: &Named,
        first: u64,
    ) -> Result<Self, Problem> {
        // The name of an aircraft that comes with the program, or a file beside the specification.
        let named = |name: &Option<PathBuf>| {
            name.as_deref().map(|name: &Path| match airframe_file::is_shipped(name) {
                true => name.to_path_buf(),
                false => file.beside(name),
            })
        };
        let mut settings = settings_of(&file.spec.set, &file.name)?;
        // Of two settings of one key the later one counts.
        settings.extend(settings_of(&spec.set, &file.name)?);
        let mut args =
            AircraftArgs { airframe: named(&spec.file), model: named(&spec.model), settings };
        let (airframe, model) = (args.airframe()?, args.model()?);
        let mut lacking = Lacking { list: &airframe.effectors, names: BTreeSet::new() };
        let Some(mut unset) = lacking.faults(&args.settings, &file.spec.vary) else {
            let names: Vec<String> = lacking.names.into_iter().collect();
            let (file, airframe, names) = (&file.name, &airframe.name, names.join(", "));
            return Err(problem!("{file}: {airframe} has no effector {names}"));
        };
        args.settings.retain(|setting| !unset.iter().any(|key| is_of(&setting.key, key)));
        let lists = file.spec.vary.iter();
        let lists: Vec<_> = lists.map(|v| Some(lacking.kept(v, v.list(&airframe)?))).collect();
        let mut lacking = lacking.names;
        let mut combinations = 1_u64;
        for (list, variable) in lists.iter().zip(&file.spec.vary) {
            let Some(list) = list else { continue };
            if list.is_empty() {
                let (file, key, airframe) = (&file.name, &variable.key, &airframe.name);
                return Err(problem!("{file}: {key}: {airframe} has no such effector"));
            }
            combinations = combinations
                .checked_mul(list.len() as u64)
                .ok_or_else(|| problem!("{}: more than {RUNS_MAX} runs", file.name))?;
        }
        let period_s = file.spec.period().unwrap_or_default().as_seconds();
        let observer = model.defaults.gains.selection.observer;
        // The measures of a flight that has not begun have all names and units.
        let measures = Measures::new(&airframe, &model.aircraft, observer, period_s).metrics(None);
        let measures = measures.into_iter().map(|metric| (metric.name, metric.unit));
        let judged = file.spec.judges.iter().flat_map(|kind| kind.columns);
        let judged = judged.map(|(name, unit)| ((*name).to_owned(), *unit));
        let measures = measures.chain(judged).collect();
        let name = if spec.name.is_empty() { airframe.name.to_string() } else { spec.name.clone() };
        let (airframe_file, model_file) = (args.airframe_table()?, args.model_table()?);
        let mut aircraft = Self {
            name,
            args,
            airframe,
            measures,
            model,
            airframe_file,
            model_file,
            lists,
            cases: Vec::new(),
            combinations,
            first,
            lacking: BTreeSet::new(),
            unset: Vec::new(),
        };
        // An error of what the model of this aircraft lacks is left out instead of refused.
        let is_error = |v: &&Variable| v.level.is_some() && v.key.starts_with("model.");
        let errors = file.spec.vary.iter().filter(is_error);
        let no_base = |v: &&Variable| aircraft.base(file, scenario, &v.key).is_err();
        let without: Vec<String> = errors.filter(no_base).map(|v| v.key.clone()).collect();
        lacking.extend(without.iter().cloned());
        unset.extend(without);
        (aircraft.lacking, aircraft.unset) = (lacking, unset);
        let case = |variable: &Variable, case: &JointCase| -> Result<_, Problem> {
            let mut set = settings_of(&case.set, &file.name)?;
            let meaning = case.meaning.unwrap_or(variable.case_meaning);
            for Setting { key, value } in &mut set {
                let Some(number) = number(value) else { continue };
                match meaning {
                    JointMeaning::Factor => {
                        *value = (number * aircraft.base(file, scenario, key)?).into();
                    }
                    JointMeaning::Thrust if THRUSTS.iter().any(|end| key.ends_with(end)) => {
                        *value = rounded(number * aircraft.thrust_range_kn()).into();
                    }
                    _ => {}
                }
            }
            Ok((case.name.clone(), set))
        };
        let of = |variable: &Variable| match variable.is_two {
            true => Ok(two_angles(&aircraft.airframe)),
            false => variable.cases.iter().map(|one| case(variable, one)).collect(),
        };
        aircraft.cases = file.spec.vary.iter().map(of).collect::<Result<_, Problem>>()?;
        Ok(aircraft)
    }

    /// Whether a key is set for this aircraft.
    pub(super) fn sets(&self, key: &str) -> bool {
        !self.unset.iter().any(|unset| is_of(key, unset))
    }

    /// What a value of a variable sets besides its key, where it is the name of a case.
    fn case(&self, place: usize, value: &Value) -> &[Setting] {
        let Value::Text(name) = value else { return &[] };
        let found = self.cases[place].iter().find(|(known, _)| known == name);
        found.map_or(&[], |(_, set)| set)
    }

    /// The same with angles for parts of a travel.
    pub(super) fn settings_of_case(
        &self,
        plan: &Plan,
        place: usize,
        values: &[Value],
    ) -> Result<Vec<Setting>, Problem> {
        let mut set = self.case(place, &values[place]).to_vec();
        let is_travel = plan.variables()[place].case_meaning == JointMeaning::Travel;
        for setting in set.iter_mut().filter(|_| is_travel) {
            if let Some(part) = number(&setting.value)
                && TRAVELS.iter().any(|key| setting.key.ends_with(key))
            {
                setting.value = self.travel_deg(plan, &setting.key, values, part)?.into();
            }
        }
        Ok(set)
    }

    /// Turns factors and parts of a travel into values of their keys.
    pub(super) fn translate(&self, plan: &Plan, values: &[Value]) -> Result<Vec<Value>, Problem> {
        let of = |(variable, value): (&Variable, &Value)| {
            let Value::Number(number) = value else { return Ok(value.clone()) };
            match variable.meaning {
                Meaning::Value | Meaning::Level => Ok(value.clone()),
                Meaning::Factor if !self.sets(&variable.key) => Ok(value.clone()),
                Meaning::Factor => {
                    let factor = match &variable.level {
                        None => *number,
                        Some(level) => 1.0 + number * level_of(plan, level, values),
                    };
                    let base = self.base(&plan.file, &plan.scenario, &variable.key)?;
                    Ok(Value::Number(factor * base))
                }
                Meaning::Travel => {
                    let deg = self.travel_deg(plan, &variable.key, values, *number)?;
                    Ok(Value::Number(deg))
                }
            }
        };
        plan.variables().iter().zip(values).map(of).collect()
    }

    /// The number that the file of a key has; of altitudes and airspeeds that the scenario leaves open, that of the design point.
    fn base(&self, file: &SpecFile, scenario: &Named, key: &str) -> Result<f64, Problem> {
        let design = &self.airframe.design_point;
        let of_design = || match key.rsplit('.').next() {
            Some("altitude_m") => Some(design.altitude_m),
            Some("airspeed_m_s") => Some(design.airspeed_m_s),
            _ => None,
        };
        let of = |table: &toml::Table, path: &str| number_at(table, path);
        let found = match key.split_once('.') {
            Some(("airframe", path)) => of(&self.airframe_file, path),
            Some(("model", path)) => of(&self.model_file, path),
            Some(_) => {
                let table: Option<toml::Table> = toml::from_str(&scenario.text).ok();
                table.and_then(|table| of(&table, key)).or_else(of_design)
            }
            None => autopilot::parameters::table()
                .iter()
                .find(|row| row.name == key)
                .map(|row| row.value(&self.model.defaults)),
        };
        found.ok_or_else(|| {
            let file = &file.name;
            problem!("{file}: {key}: as = \"factor\" needs a number in the file, and there is none")
        })
    }

    /// Angle at a part of the travel of the effector of the same fault, deg.
    fn travel_deg(
        &self,
        plan: &Plan,
        key: &str,
        values: &[Value],
        part: f64,
    ) -> Result<f64, Problem> {
        let fail = |why: String| Err(problem!("{}: {key}: {why}", plan.file.name));
        if !(-1.0..=1.0).contains(&part) {
            return fail(format!("{part} of the travel: expected -1 to 1"));
        }
        let Some(fault) = TRAVELS.iter().find_map(|travel| key.strip_suffix(travel)) else {
            let known = TRAVELS.map(|travel| &travel[1..]).join(", ");
            return fail(format!("as = \"travel\" is for these keys of a fault: {known}"));
        };
        let wanted = format!("{fault}.effector");
        let mut varied = plan.variables().iter().zip(values);
        let varied =
            varied.find(|(other, _)| other.key == wanted).map(|(_, value)| value.setting());
        // The last one counts: `Plan::settings` writes those of a case after those of every flight.
        let of_cases = values.iter().enumerate().flat_map(|(at, value)| self.case(at, value));
        let mut settings = self.args.settings.iter().chain(of_cases);
        let set = settings.rfind(|setting| setting.key == wanted);
        let set = set.and_then(|setting| setting.value.as_str()).map(str::to_owned);
        let Some(name) = varied.or(set) else {
            return fail(format!("as = \"travel\" needs {wanted} among the settings or variables"));
        };
        let list = &self.airframe.effectors;
        let Some(effector) = list.by_key(&name) else {
            return fail(format!("{} has no effector {name}", self.airframe.name));
        };
        if !list.is_angle(effector) {
            return fail(format!("{name} has no angle"));
        }
        let servo = &self.airframe.servos[effector];
        let middle = 0.0_f64.clamp(servo.min, servo.max);
        let end = if part < 0.0 { servo.min } else { servo.max };
        let angle_deg = (middle + part.abs() * (end - middle)).to_degrees();
        Ok(rounded(angle_deg))
    }

    /// From the least thrust to the largest; zero without an engine.
    fn thrust_range_kn(&self) -> f64 {
        let Airframe { effectors, servos, .. } = &self.airframe;
        let range_n = |engine| servos[engine].max - servos[engine].min;
        1.0e-3 * effectors.only(EffectorKind::Engine).map_or(0.0, range_n)
    }
}

/// As people write a number in a file: without the noise of two conversions.
fn rounded(value: f64) -> f64 {
    (value * 1.0e9).round() / 1.0e9
}

/// End of a key that names the effector of a fault.
const EFFECTOR: &str = "effector";

/// Whether a key is this one, or of this table.
fn is_of(key: &str, unset: &str) -> bool {
    key == unset || unset.ends_with('.') && key.starts_with(unset)
}

/// Number of the fault that a key is of.
fn number_of(key: &str) -> Option<u32> {
    key.strip_prefix("plant.fault.")?.split('.').next()?.parse().ok()
}

fn is_target(key: &str) -> bool {
    key.starts_with("plant.fault.") && key.ends_with(EFFECTOR)
}

/// The effectors that a specification names and an aircraft with these lacks.
struct Lacking<'a> {
    list: &'a EffectorList,
    names: BTreeSet<String>,
}

impl Lacking<'_> {
    /// Whether a key names such an effector.
    fn has(&mut self, key: &str, value: &str) -> bool {
        let is_lacking = is_target(key) && self.list.lacks(value);
        if is_lacking {
            self.names.insert(value.to_owned());
        }
        is_lacking
    }

    /// Tables of the faults that every flight would have of such effectors; `None` if the campaign is about one of them: it is varied,
    /// or the only one, or another one follows it, whose number would have a gap before it.
    fn faults(&mut self, settings: &[Setting], vary: &[Variable]) -> Option<Vec<String>> {
        let mut lacking = BTreeSet::new();
        for Setting { key, value } in settings {
            if self.has(key, value.as_str().unwrap_or_default()) {
                lacking.extend(number_of(key));
            }
        }
        let keys = settings.iter().map(|setting| &setting.key);
        let keys = keys.chain(vary.iter().flat_map(Variable::keys));
        let numbers = keys.filter_map(|key| number_of(key));
        let last = numbers.filter(|number| !lacking.contains(number)).max();
        let is_varied = |fault: u32| vary.iter().any(|v| number_of(&v.key) == Some(fault));
        let is_subject = |fault: &u32| is_varied(*fault) || last.is_none_or(|last| *fault < last);
        if lacking.iter().any(is_subject) {
            return None;
        }
        Some(lacking.iter().map(|fault| format!("plant.fault.{fault}.")).collect())
    }

    /// The values of a listed variable that name no such effector, and whose cases do not.
    fn kept(&mut self, variable: &Variable, mut values: Vec<Value>) -> Vec<Value> {
        values.retain(|value| {
            let Value::Text(name) = value else { return true };
            let case = variable.cases.iter().find(|case| case.name == *name);
            let mut set = case.iter().flat_map(|case| &case.set);
            !self.has(&variable.key, name)
                && !set.any(|(key, value)| self.has(key, value.as_str().unwrap_or_default()))
        });
        values
    }
}

/// Every two effectors with an angle, by name, as those of two faults.
fn two_angles(airframe: &Airframe) -> Vec<(String, Vec<Setting>)> {
    let list = &airframe.effectors;
    let angles: Vec<&str> = list.all().filter(|e| list.is_angle(*e)).map(|e| list.key(e)).collect();
    let pairs = angles.iter().enumerate().flat_map(|(place, one)| {
        angles[place + 1..].iter().map(move |other| {
            let faults = [("plant.fault.1.effector", *one), ("plant.fault.2.effector", *other)];
            let set = faults.map(|(key, effector)| Setting::new(key, effector));
            (format!("{one} and {other}"), set.into())
        })
    });
    pairs.collect()
}

/// The value of a joint level.
fn level_of(plan: &Plan, name: &str, values: &[Value]) -> f64 {
    let mut varied = plan.variables().iter().zip(values);
    let found = varied.find(|(variable, _)| variable.key == name);
    found.and_then(|(_, value)| value.number()).unwrap_or(f64::NAN)
}

/// The number at a path of a file; entries of lists are counted from 1.
fn number_at(table: &toml::Table, path: &str) -> Option<f64> {
    let mut words = path.split('.');
    let mut value = table.get(words.next()?)?;
    for word in words {
        value = match value {
            toml::Value::Array(list) => list.get(word.parse::<usize>().ok()?.checked_sub(1)?)?,
            other => other.get(word)?,
        };
    }
    // Numbers of settings are floats.
    value.as_float().or_else(|| value.as_integer().map(|number| number as f64))
}

impl Variable {
    /// The value of a drawn variable at a probability.
    pub(crate) fn quantile(&self, probability: f64) -> f64 {
        match (self.uniform, &self.normal) {
            (Some([low, high]), _) => low + probability * (high - low),
            (None, Some(normal)) => normal.quantile(probability),
            (None, None) => f64::NAN,
        }
    }

    /// The values of a listed variable for an aircraft; `None` of a drawn one.
    fn list(&self, airframe: &Airframe) -> Option<Vec<Value>> {
        if self.is_two {
            let names = two_angles(airframe).into_iter().map(|(name, _)| Value::Text(name));
            return Some(names.collect());
        }
        if let Some(values) = &self.values {
            let of = |value: &toml::Value| match value {
                toml::Value::Float(number) => Some(Value::Number(*number)),
                // Numbers of settings are floats.
                toml::Value::Integer(number) => Some(Value::Number(*number as f64)),
                other => text_of(other).map(Value::Text),
            };
            return Some(values.iter().filter_map(of).collect());
        }
        if let Some(grid) = self.grid {
            // A single value stands at the beginning.
            let last = f64::from(grid.count.max(2) - 1);
            let at = |place: u32| {
                let part = f64::from(place) / last;
                // Both ends, and zero in the middle of a grid that is even about it, are exact.
                Value::Number(grid.from * (1.0 - part) + grid.to * part)
            };
            return Some((0..grid.count).map(at).collect());
        }
        let each = self.each?;
        let list = &airframe.effectors;
        let is_meant = |effector: &Effector| match each {
            Each::Surface => list.kind(*effector).is_some_and(EffectorKind::is_surface),
            Each::Angle => list.is_angle(*effector),
            Each::Effector => true,
        };
        let keys = list.all().filter(is_meant).map(|effector| list.key(effector).to_owned());
        Some(keys.map(Value::Text).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_that_is_left_out_takes_no_other_one_with_it() {
        for (key, unset, is_it) in [
            ("plant.fault.1.kind", "plant.fault.1.", true),
            ("plant.fault.10.kind", "plant.fault.1.", false),
            ("model.airframe.c_lift", "model.airframe.c_lift", true),
            ("model.airframe.c_lift_q", "model.airframe.c_lift", false),
        ] {
            assert_eq!(is_of(key, unset), is_it, "{key} {unset}");
        }
    }
}
