//! What keeps something from being read, flown or written.

use std::error::Error;
use std::fmt::{self, Display};

/// A sentence with field, value and range, behind its place: file, key, line, item. It takes every error by `?`.
#[derive(Clone, PartialEq, Eq)]
pub struct Problem(String);

/// A [`Problem`] from what `format!` takes.
#[macro_export]
macro_rules! problem {
    ($($text:tt)*) => { $crate::problem::Problem::new(format!($($text)*)) };
}
pub use crate::problem;

impl Problem {
    pub fn new(sentence: impl Into<String>) -> Self {
        Self(sentence.into())
    }
}

impl Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// As people read it, where a test or a program ends with it.
impl fmt::Debug for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl<E: Error> From<E> for Problem {
    fn from(error: E) -> Self {
        // Readers of files end theirs with an empty line.
        Self(error.to_string().trim_end().to_owned())
    }
}

// A problem is no `Error` itself, so that it can take every one of them.
impl From<Problem> for Box<dyn Error> {
    fn from(problem: Problem) -> Self {
        problem.0.into()
    }
}

impl From<Problem> for Box<dyn Error + Send + Sync> {
    fn from(problem: Problem) -> Self {
        problem.0.into()
    }
}

/// Adds the place to what went wrong.
pub trait At<T> {
    fn at(self, place: impl Display) -> Result<T, Problem>;
}

impl<T, E: Into<Problem>> At<T> for Result<T, E> {
    fn at(self, place: impl Display) -> Result<T, Problem> {
        self.map_err(|error| problem!("{place}: {}", error.into()))
    }
}
