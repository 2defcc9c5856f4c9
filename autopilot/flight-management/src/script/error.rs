//! Why a text is not a valid script: file, line, column, the text found there and the allowed text.

use super::{LINES_MAX, SEQUENCES_MAX, TEXT_MAX};

/// Why a text is not a valid script.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}, line {line}, column {column}: {problem}")]
pub struct ScriptError {
    /// Name of the file.
    pub file: String,
    /// Line of the text, from 1.
    pub line: usize,
    /// Character of the line, from 1.
    pub column: usize,
    pub problem: Box<Problem>,
}

/// A problem of a script.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Problem {
    #[error("{found} found, expected {expected}")]
    Unexpected {
        /// The word, or the end of the line.
        found: String,
        expected: String,
    },
    /// A character that no word contains.
    #[error("{0:?} belongs to no word")]
    Character(char),
    /// A number out of range.
    #[error("{what} {value} is outside {min} to {max} {unit}")]
    OutOfRange {
        /// Name of the number.
        what: &'static str,
        value: String,
        min: String,
        max: String,
        /// Unit of all three.
        unit: &'static str,
    },
    /// No aircraft can have this fault.
    #[error("{0}")]
    Fault(String),
    /// Two sequences with the same name.
    #[error("there is a sequence {0} already")]
    SameName(String),
    /// The text is too long.
    #[error("the text has {0} bytes or more, at most {TEXT_MAX} are allowed")]
    TextTooLong(usize),
    #[error("more than {LINES_MAX} lines with an action")]
    TooManyLines,
    #[error("more than {SEQUENCES_MAX} sequences")]
    TooManySequences,
    /// No line has an action.
    #[error("no line does anything")]
    Empty,
}

impl Problem {
    /// A problem at a place.
    pub(super) fn at(self, line: usize, column: usize) -> ScriptError {
        ScriptError { file: String::new(), line, column, problem: Box::new(self) }
    }
}

impl ScriptError {
    /// The same with the name of its file.
    pub(super) fn in_file(self, name: &str) -> Self {
        Self { file: name.to_owned(), ..self }
    }
}
