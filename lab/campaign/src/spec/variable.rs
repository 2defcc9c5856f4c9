//! A variable of a campaign: which key is varied, and how.

use std::collections::BTreeSet;

use host_io::problem::Problem;
use lab_engine::settings::written;
use serde::Deserialize;
use toml::Value as Toml;

use super::{JointCase, JointMeaning, check_key, is_scalar, refuse};

/// Most values of one variable.
const VALUES_MAX: u32 = 100_000;

/// A key that is varied. One of `values`, `grid`, `each`, `uniform` and `normal` says how.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variable {
    /// A key of `--set`.
    pub key: String,
    /// These values, one after the other.
    pub values: Option<Vec<Toml>>,
    pub grid: Option<Grid>,
    /// Keys of these effectors of the aircraft.
    pub each: Option<Each>,
    /// Uniformly distributed between two numbers.
    pub uniform: Option<[f64; 2]>,
    pub normal: Option<Normal>,
    /// What the number means.
    #[serde(default, rename = "as")]
    pub meaning: Meaning,
    /// Keys that have the value of a joint level.
    #[serde(skip)]
    pub sets: Vec<String>,
    /// What its values stand for, where they are names, and what the numbers of these cases mean.
    #[serde(skip)]
    pub cases: Vec<JointCase>,
    #[serde(skip)]
    pub case_meaning: JointMeaning,
    /// Its values are every two effectors with an angle.
    #[serde(skip)]
    pub is_two: bool,
    /// Name of the joint level that scales the deviation of the factor from 1.
    #[serde(skip)]
    pub level: Option<String>,
}

/// Equally spaced numbers, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    pub from: f64,
    pub to: f64,
    pub count: u32,
}

/// A normal distribution, cut off where `min` and `max` say.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Normal {
    pub mean: f64,
    pub deviation: f64,
    pub min: Option<f64>,
    pub max: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Each {
    Surface,
    /// Surfaces and nozzle angles.
    Angle,
    Effector,
}

/// What a number of a variable means.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Meaning {
    /// The value of the key.
    #[default]
    Value,
    /// A factor on the number that the file has.
    Factor,
    /// Part of the travel of the fault's effector: -1 is its lower end, 1 its upper end, deg.
    Travel,
    /// The level of joint keys, and no key itself.
    #[serde(skip)]
    Level,
}

impl Variable {
    /// Whether its values are drawn, not listed.
    pub fn is_drawn(&self) -> bool {
        self.uniform.is_some() || self.normal.is_some()
    }

    /// The keys that it sets, each once.
    pub fn keys(&self) -> impl Iterator<Item = &String> {
        let of_cases: BTreeSet<&String> =
            self.cases.iter().flat_map(|case| case.set.keys()).collect();
        std::iter::once(&self.key).chain(&self.sets).chain(of_cases)
    }

    /// Smallest and largest number that it takes; `None` of texts and of what is not bounded.
    pub fn range(&self) -> Option<[f64; 2]> {
        if let Some(grid) = self.grid {
            return Some([grid.from.min(grid.to), grid.from.max(grid.to)]);
        }
        if let Some(range) = self.uniform {
            return Some(range);
        }
        if let Some(normal) = self.normal {
            return Some([normal.min?, normal.max?]);
        }
        let number = |value: &Toml| {
            value.as_float().or_else(|| value.as_integer().map(|number| number as f64))
        };
        let numbers: Vec<f64> = self.values.as_ref()?.iter().map(number).collect::<Option<_>>()?;
        let low = numbers.iter().copied().fold(f64::INFINITY, f64::min);
        let high = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        Some([low, high])
    }

    pub(super) fn check(&self, file: &str) -> Result<(), Problem> {
        let refuse = |part: &str, value: String, expected: &str| {
            refuse(file, &format!("{}, {part}", self.key), value, expected)
        };
        check_key(&self.key, file)?;
        let ways = [
            self.values.is_some(),
            self.grid.is_some(),
            self.each.is_some(),
            self.uniform.is_some(),
            self.normal.is_some(),
        ];
        let count = ways.iter().filter(|is_given| **is_given).count();
        if count != 1 {
            let expected = "exactly one of values, grid, each, uniform, normal";
            return refuse("ways of variation", count.to_string(), expected);
        }
        if let Some(values) = &self.values {
            let is_fit = |value: &Toml| match value {
                Toml::String(text) => self.meaning == Meaning::Value && is_scalar(&written(text)),
                other => is_scalar(other),
            };
            if values.is_empty() || values.len() > VALUES_MAX as usize {
                let expected = format!("1 to {VALUES_MAX} values");
                return refuse("values", format!("{} of them", values.len()), &expected);
            }
            if let Some(value) = values.iter().find(|value| !is_fit(value)) {
                return refuse("values", value.to_string(), "finite numbers, or texts");
            }
        }
        if let Some(Grid { from, to, count }) = self.grid
            && !(from.is_finite() && to.is_finite() && (1..=VALUES_MAX).contains(&count))
        {
            let expected = format!("finite ends, and a count of 1 to {VALUES_MAX}");
            return refuse("grid", format!("{from} to {to}, {count} values"), &expected);
        }
        if let Some([low, high]) = self.uniform
            && !(low.is_finite() && high.is_finite() && low < high)
        {
            return refuse("uniform", format!("[{low}, {high}]"), "two numbers in rising order");
        }
        if let Some(Normal { mean, deviation, min, max }) = self.normal {
            let [low, high] = [min.unwrap_or(f64::NEG_INFINITY), max.unwrap_or(f64::INFINITY)];
            let has_middle =
                low < high && high >= mean - 5.0 * deviation && low <= mean + 5.0 * deviation;
            if !(mean.is_finite() && deviation > 0.0 && deviation.is_finite() && has_middle) {
                let expected = "a finite mean, a deviation above 0, and limits that leave a range within 5 deviations";
                return refuse("normal", format!("{:?}", self.normal), expected);
            }
        }
        if self.meaning != Meaning::Value && self.each.is_some() {
            return refuse("as", format!("{:?}", self.meaning), "no `as` beside `each`");
        }
        Ok(())
    }
}
