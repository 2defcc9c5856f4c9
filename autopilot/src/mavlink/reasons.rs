//! Why several effectors of one command are refused, in one text.

use icd::fault::Refusal;
use icd::{Effector, EffectorList};

use super::failure;

/// Reasons, each with the effectors for which it was given.
#[derive(Debug, Default)]
pub struct Reasons(Vec<(String, Vec<Effector>)>);

impl Reasons {
    /// One more; an effector is named, a command without effectors has the bare reason.
    pub fn add(&mut self, reason: String, effector: Option<Effector>) {
        match self.0.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, effectors)) => effectors.extend(effector),
            None => self.0.push((reason, effector.into_iter().collect())),
        }
    }

    /// One more, in the units of its effector.
    pub fn refuse(
        &mut self,
        refusal: &Refusal,
        effector: Option<Effector>,
        effectors: &EffectorList,
    ) {
        self.add(failure::refused(refusal, effector, effectors), effector);
    }

    /// They are about effectors.
    #[must_use]
    pub fn names_effectors(&self) -> bool {
        self.0.iter().any(|(_, effectors)| !effectors.is_empty())
    }

    /// There is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them in words.
    #[must_use]
    pub fn text(&self, all: &EffectorList) -> String {
        let of = |(reason, effectors): &(String, Vec<Effector>)| {
            if effectors.is_empty() {
                reason.clone()
            } else {
                format!("{}: {reason}", failure::names(effectors, all))
            }
        };
        self.0.iter().map(of).collect::<Vec<_>>().join("; ")
    }
}
