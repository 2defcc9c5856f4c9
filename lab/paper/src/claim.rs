//! A claim as data: what was measured, against which limit, and whether it holds.

use std::fmt;

use serde::{Serialize, Serializer};

/// A row of the list of claims.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claim {
    /// Its number, as in `1a`.
    pub id: &'static str,
    /// What the paper says.
    pub text: &'static str,
}

/// What a value must satisfy. A NaN satisfies nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    AtMost(f64),
    AtLeast(f64),
    Above(f64),
    Below(f64),
    /// Exactly this, to the bit but for the sign of zero.
    Exactly(f64),
}

impl Limit {
    /// Whether `value` satisfies it.
    pub fn allows(self, value: f64) -> bool {
        match self {
            Self::AtMost(limit) => value <= limit,
            Self::AtLeast(limit) => value >= limit,
            Self::Above(limit) => value > limit,
            Self::Below(limit) => value < limit,
            #[expect(clippy::float_cmp, reason = "exactness is the claim")]
            Self::Exactly(limit) => value == limit,
        }
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(limit) => write!(f, "<= {limit}"),
            Self::AtLeast(limit) => write!(f, ">= {limit}"),
            Self::Above(limit) => write!(f, "> {limit}"),
            Self::Below(limit) => write!(f, "< {limit}"),
            Self::Exactly(limit) => write!(f, "= {limit}"),
        }
    }
}

impl Serialize for Limit {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// One measured value of a claim. A claim holds if all its values do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClaimResult {
    /// Number of the claim, as in `1a`.
    pub id: &'static str,
    /// What the paper says.
    pub claim: &'static str,
    pub measure: String,
    /// The measured value; `null` in the file if nothing could be measured.
    pub value: f64,
    /// What it must satisfy.
    pub limit: Limit,
    /// Unit of value and limit.
    pub unit: &'static str,
    pub pass: bool,
    /// Which runs failed, where the value counts runs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failed_runs: Vec<String>,
}

impl Claim {
    /// Holds a measured value against its limit.
    pub fn check(
        self,
        measure: impl Into<String>,
        value: f64,
        unit: &'static str,
        limit: Limit,
    ) -> ClaimResult {
        ClaimResult {
            id: self.id,
            claim: self.text,
            measure: measure.into(),
            value,
            limit,
            unit,
            pass: limit.allows(value),
            failed_runs: Vec::new(),
        }
    }

    /// Holds measured values against their limits: measure, value, unit, limit.
    pub fn check_all<const N: usize>(
        self,
        rows: [(&str, f64, &'static str, Limit); N],
    ) -> Vec<ClaimResult> {
        rows.map(|(measure, value, unit, limit)| self.check(measure, value, unit, limit)).to_vec()
    }

    /// Counts the runs that did what they must not; there must be none.
    pub fn check_none(self, measure: impl Into<String>, offenders: Vec<String>) -> ClaimResult {
        let count = u32::try_from(offenders.len()).map_or(f64::INFINITY, f64::from);
        let result = self.check(measure, count, "runs", Limit::Exactly(0.0));
        ClaimResult { failed_runs: offenders, ..result }
    }
}

/// Whether every value satisfies its limit; not so for no values at all.
pub fn all_hold(results: &[ClaimResult]) -> bool {
    !results.is_empty() && results.iter().all(|result| result.pass)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLAIM: Claim = Claim { id: "9z", text: "the aircraft flies" };

    #[test]
    fn every_limit_refuses_what_is_beyond_it_and_nan() {
        let cases = [
            (Limit::AtMost(2.0), 2.0, 2.1),
            (Limit::AtLeast(2.0), 2.0, 1.9),
            (Limit::Above(2.0), 2.1, 2.0),
            (Limit::Below(2.0), 1.9, 2.0),
            (Limit::Exactly(0.0), -0.0, 1.0e-300),
        ];
        for (limit, inside, outside) in cases {
            assert!(limit.allows(inside), "{inside} {limit}");
            assert!(!limit.allows(outside), "{outside} {limit}");
            assert!(!limit.allows(f64::NAN), "NaN {limit}");
        }
    }

    #[test]
    fn one_failed_value_fails_all_and_no_value_proves_nothing() {
        let good = CLAIM.check("height", 1.0, "m", Limit::AtMost(2.0));
        let bad = CLAIM.check("height", 3.0, "m", Limit::AtMost(2.0));
        assert!(all_hold(&[good.clone(), good.clone()]));
        assert!(!all_hold(&[good, bad]));
        assert!(!all_hold(&[]));
    }

    #[test]
    fn the_file_has_the_promised_keys() {
        let result = CLAIM.check("height", 1.5, "m", Limit::AtMost(2.0));
        let json = serde_json::to_value(vec![result]).unwrap();
        let entry = json[0].as_object().unwrap();
        assert_eq!(entry["id"], "9z");
        assert_eq!(entry["claim"], "the aircraft flies");
        assert_eq!(entry["value"], 1.5);
        assert_eq!(entry["limit"], "<= 2");
        assert_eq!(entry["unit"], "m");
        assert_eq!(entry["pass"], true);
    }

    #[test]
    fn a_value_that_could_not_be_measured_is_null_and_fails() {
        let result = CLAIM.check("height", f64::NAN, "m", Limit::AtMost(2.0));
        let json = serde_json::to_value(&result).unwrap();
        assert!(json["value"].is_null() && json["pass"] == false);
    }

    #[test]
    fn runs_that_did_what_they_must_not_are_named() {
        let result = CLAIM.check_none("lost", vec!["Clda at 0.9".to_owned()]);
        assert!(!result.pass && result.value == 1.0);
        assert!(CLAIM.check_none("lost", vec![]).pass);
    }
}
