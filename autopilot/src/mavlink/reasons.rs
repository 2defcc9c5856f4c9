//! Why several effectors of one command are refused, in one text.

use core::fmt;

use icd::Effector;
use icd::fault::Refusal;

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
    pub fn refuse(&mut self, refusal: &Refusal, effector: Option<Effector>) {
        self.add(failure::refused(refusal, effector), effector);
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
}

impl fmt::Display for Reasons {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, (reason, effectors)) in self.0.iter().enumerate() {
            if place > 0 {
                f.write_str("; ")?;
            }
            if !effectors.is_empty() {
                write!(f, "{}: ", failure::names(effectors))?;
            }
            f.write_str(reason)?;
        }
        Ok(())
    }
}
