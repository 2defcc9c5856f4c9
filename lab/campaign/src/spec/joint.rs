//! Several keys that are varied together by one listed level.

use host_io::problem::Problem;
use serde::Deserialize;

use super::variable::{Meaning, Variable};
use super::{check_key, refuse, settings_of};

/// A level with the keys that it acts on. In tables and plots it is a listed variable with its name.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Joint {
    /// Its name; no key of `--set`.
    pub name: String,
    /// Its unit, for titles of curves.
    #[serde(default)]
    pub unit: String,
    #[serde(default)]
    pub levels: Vec<f64>,
    /// What a level means for each key.
    #[serde(default, rename = "as")]
    pub meaning: JointMeaning,
    #[serde(default)]
    pub keys: Vec<String>,
    /// In place of levels and keys: cases, each with values for keys of its own.
    #[serde(default, rename = "case")]
    pub cases: Vec<JointCase>,
    /// In place of all these: every two of these effectors, as those of `plant.fault.1` and `plant.fault.2`.
    pub each: Option<EachTwo>,
}

/// Which two effectors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EachTwo {
    /// Surfaces and nozzle angles.
    TwoAngles,
}

/// Keys and values under one name.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct JointCase {
    pub name: String,
    /// What its numbers mean, where that is not what those of the others mean.
    #[serde(rename = "as")]
    pub meaning: Option<JointMeaning>,
    #[serde(flatten)]
    pub set: toml::Table,
}

/// What a level means.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JointMeaning {
    /// Every key has the level as its value.
    #[default]
    Value,
    /// The numbers of a case are factors on the numbers that the file has, or, of altitude and airspeed, the design point.
    Factor,
    /// Angles, biases and amplitudes of a case are parts of the travel of the effector of the same fault.
    Travel,
    /// Bias, drift and noise of an engine monitor are parts of the range of the thrust.
    Thrust,
    /// Every key has a draw of its own, uniform within the level of 1 to either side, as a factor on the number that the file has.
    Error,
}

impl Joint {
    /// The variables that it stands for: its level, listed, and for [`JointMeaning::Error`] a drawn factor for each key.
    pub(super) fn variables(&self) -> Vec<Variable> {
        let names = self.cases.iter().map(|case| case.name.as_str().into());
        let values = self.levels.iter().copied().map(toml::Value::from).chain(names).collect();
        let level = Variable {
            key: self.name.clone(),
            values: Some(values),
            meaning: Meaning::Level,
            cases: self.cases.clone(),
            case_meaning: self.meaning,
            is_two: self.each.is_some(),
            ..Variable::default()
        };
        match self.meaning {
            JointMeaning::Value
            | JointMeaning::Factor
            | JointMeaning::Travel
            | JointMeaning::Thrust => {
                vec![Variable { sets: self.keys.clone(), ..level }]
            }
            JointMeaning::Error => {
                // A factor, so many times the level from 1.
                let drawn = |key: &String| Variable {
                    key: key.clone(),
                    uniform: Some([-1.0, 1.0]),
                    meaning: Meaning::Factor,
                    level: Some(self.name.clone()),
                    ..Variable::default()
                };
                std::iter::once(level).chain(self.keys.iter().map(drawn)).collect()
            }
        }
    }

    pub(super) fn check(&self, file: &str) -> Result<(), Problem> {
        let refuse = |part: &str, value: String, expected: &str| {
            refuse(file, &format!("joint {}, {part}", self.name), value, expected)
        };
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if self.name.is_empty() || !self.name.chars().all(is_word) {
            return refuse("name", format!("{:?}", self.name), "letters, digits and _");
        }
        if !self.cases.is_empty() || self.each.is_some() {
            let is_alone = self.levels.is_empty()
                && self.keys.is_empty()
                && self.cases.is_empty() == self.each.is_some();
            if !is_alone || self.meaning == JointMeaning::Error {
                let expected =
                    "[[joint.case]] or each alone, without levels, keys and as = \"error\"";
                return refuse("case", format!("{} of them", self.cases.len()), expected);
            }
            for (place, case) in self.cases.iter().enumerate() {
                let is_same = |other: &JointCase| other.name == case.name;
                if case.name.is_empty() || self.cases[..place].iter().any(is_same) {
                    let expected = "each name once, and not empty";
                    return refuse("case.name", format!("{:?}", case.name), expected);
                }
                settings_of(&case.set, file)?;
            }
            return Ok(());
        }
        let (least, most, expected) = match self.meaning {
            JointMeaning::Factor | JointMeaning::Travel | JointMeaning::Thrust => {
                return refuse("as", format!("{:?}", self.meaning), "[[joint.case]] with it");
            }
            JointMeaning::Value => (f64::MIN, f64::MAX, "one or more finite numbers"),
            // At 1 a mass or an inertia could be zero.
            JointMeaning::Error => (0.0, 0.95, "one or more numbers from 0 to 0.95"),
        };
        let is_fit = |level: &f64| (least..=most).contains(level);
        if self.levels.is_empty() || !self.levels.iter().all(is_fit) {
            return refuse("levels", format!("{:?}", self.levels), expected);
        }
        if self.keys.is_empty() {
            return refuse("keys", "[]".to_owned(), "one or more keys of --set");
        }
        self.keys.iter().try_for_each(|key| check_key(key, file))
    }
}
