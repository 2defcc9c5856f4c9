//! Why several effectors of one command are refused, in one text.

use icd::EffectorList;
use icd::fault::{Refusal, Target};

use super::failure;

/// Reasons, each with the targets for which it was given.
#[derive(Debug, Default)]
pub struct Reasons(Vec<(String, Vec<Target>)>);

impl Reasons {
    /// One more; a target is named, a command without targets has the bare reason.
    pub fn add(&mut self, reason: String, target: Option<Target>) {
        match self.0.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, targets)) => targets.extend(target),
            None => self.0.push((reason, target.into_iter().collect())),
        }
    }

    /// One more, in the units of its target.
    pub fn refuse(&mut self, refusal: &Refusal, target: Option<Target>, effectors: &EffectorList) {
        self.add(failure::refused(refusal, target, effectors), target);
    }

    /// They name what they are about.
    #[must_use]
    pub fn names_targets(&self) -> bool {
        self.0.iter().any(|(_, targets)| !targets.is_empty())
    }

    /// There is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them in words.
    #[must_use]
    pub fn text(&self, all: &EffectorList) -> String {
        let of = |(reason, targets): &(String, Vec<Target>)| {
            if targets.is_empty() {
                reason.clone()
            } else {
                format!("{}: {reason}", failure::names(targets, all))
            }
        };
        self.0.iter().map(of).collect::<Vec<_>>().join("; ")
    }
}
