//! Why a text that the autopilot reads cannot be used.

use core::fmt::Display;

/// A sentence with value and range, behind its place: file, key, line, item.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct TextError(pub String);

impl TextError {
    /// Adds the place to what went wrong.
    pub fn at(place: impl Display, problem: impl Display) -> Self {
        Self(format!("{place}: {problem}"))
    }

    /// Adds the name of the file to a problem of a line.
    pub(crate) fn in_file(self, name: &str) -> Self {
        Self(format!("{name}, {self}"))
    }
}
