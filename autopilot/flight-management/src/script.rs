//! Scripts of faults and events: a short readable text of the events of a flight and their times.
//!
//! ```text
//!  text ─> words ─> parser ─> Script ─┐
//!                                     v
//!        time, sensors ────────────> Run ─> actions (fault requests, references, modes, texts)
//! ```
//!
//! A script is separate from the laws and the vehicle: its lines are executed like commands of a ground
//! station. It sees simulation time and sensor values only, so a script that is started at the same tick does the same
//! each time, to the bit. `docs/scripts.md` describes the language.

use core::fmt;
use icd::fault::{NO_ANSWER, Refusal, Target, TargetClass};
use icd::{EffectorList, FaultRequest};
use serde::{Deserialize, Serialize};

use crate::vehicle::{Mode, Reference};

mod cursor;
mod error;
mod fault;
mod parser;
mod quantity;
mod run;

pub use error::{Problem, ScriptError};
pub use quantity::{Condition, Crossing, Quantity};
pub use run::{Due, Run};

/// Longest text, bytes.
pub const TEXT_MAX: usize = 16 * 1024;
/// Lines with an action that a script may have.
pub const LINES_MAX: usize = 256;
/// Sequences that a script may have, the first one included.
pub const SEQUENCES_MAX: usize = 16;

/// A valid script. Serialized, it is its name, its text and the effectors that it can
/// name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Text", into = "Text")]
pub struct Script {
    name: String,
    text: String,
    /// The effectors of its aircraft.
    effectors: EffectorList,
    id: u32,
    sequences: Vec<Sequence>,
}

/// Lines that run one after the other, in parallel with the other sequences.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Its name and the line of the text that names it, from 1; the first sequence may have none.
    pub name: Option<(u16, String)>,
    /// Its lines, in order.
    pub lines: Vec<Line>,
}

/// One line: an action and its trigger.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Number of the line in the text, from 1.
    pub number: u16,
    /// The line in plain form: one space between words, small letters, no comment.
    pub text: String,
    pub trigger: Trigger,
    pub action: Action,
}

/// The trigger of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trigger {
    /// None: the line acts together with the line before.
    AtOnce,
    /// This many microseconds after the start of the script; at once if they have passed.
    At(u64),
    /// This many microseconds after the line before.
    After(u64),
    /// A quantity crosses a value while the line is the next one.
    When(Condition),
}

/// The action of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// Injects or clears a fault; goes to the plant like the request of a ground station.
    Fault(FaultRequest),
    Refer(Reference),
    Mode(Mode),
    /// Sends the text after `say` to the ground stations.
    Say,
    /// Ends the script with all its sequences.
    End,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
struct Text {
    name: String,
    text: String,
    effectors: EffectorList,
}

impl Script {
    /// Reads a script for an aircraft with these effectors; messages call it `name`.
    pub fn parse(name: &str, text: &str, effectors: &EffectorList) -> Result<Self, ScriptError> {
        // Some editors put a byte order mark before the text.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let sequences = parser::sequences(text, effectors).map_err(|error| error.in_file(name))?;
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(name.as_bytes());
        hasher.update(&[0]);
        hasher.update(text.as_bytes());
        let id = hasher.finalize();
        let (name, text) = (name.to_owned(), text.to_owned());
        Ok(Self { name, text, effectors: *effectors, id, sequences })
    }

    /// The error for a text of more than [`TEXT_MAX`] bytes, of which `length` were read.
    pub fn too_long(name: &str, length: usize) -> ScriptError {
        Problem::TextTooLong(length).at(1, 1).in_file(name)
    }

    /// Its name in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn text(&self) -> &str {
        &self.text
    }

    /// The effectors of its aircraft.
    pub fn effectors(&self) -> &EffectorList {
        &self.effectors
    }

    /// Number that events use for it: a checksum of name and text.
    pub fn id(&self) -> u32 {
        self.id
    }

    /// Its sequences; the first one has no name unless the text begins with one.
    pub fn sequences(&self) -> &[Sequence] {
        &self.sequences
    }

    pub fn lines(&self) -> impl Iterator<Item = &Line> {
        self.sequences.iter().flat_map(|sequence| &sequence.lines)
    }

    /// The line with this number in the text, if it has an action.
    pub fn line(&self, number: u16) -> Option<&Line> {
        self.lines().find(|line| line.number == number)
    }

    /// Whether it injects or clears a fault.
    pub fn has_faults(&self) -> bool {
        self.lines().any(|line| matches!(line.action, Action::Fault(_)))
    }

    /// Whether it changes references or the mode.
    pub fn steers(&self) -> bool {
        self.lines().any(|line| matches!(line.action, Action::Refer(_) | Action::Mode(_)))
    }
}

/// The script in plain form, each line at its place in the text.
impl fmt::Display for Script {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut next = 1;
        let mut put = |f: &mut fmt::Formatter<'_>, number: u16, text: &str| {
            while next < number {
                writeln!(f)?;
                next += 1;
            }
            next += 1;
            writeln!(f, "{text}")
        };
        for sequence in &self.sequences {
            if let Some((number, name)) = &sequence.name {
                put(f, *number, &format!("sequence {name}"))?;
            }
            for line in &sequence.lines {
                put(f, line.number, &line.text)?;
            }
        }
        Ok(())
    }
}

impl TryFrom<Text> for Script {
    type Error = ScriptError;
    fn try_from(Text { name, text, effectors }: Text) -> Result<Self, ScriptError> {
        Self::parse(&name, &text, &effectors)
    }
}

impl From<Script> for Text {
    fn from(script: Script) -> Self {
        Self { name: script.name, text: script.text, effectors: script.effectors }
    }
}

impl Line {
    /// The text after `say`.
    pub fn words(&self) -> Option<&str> {
        matches!(self.action, Action::Say).then(|| parser::said_text(&self.text)).flatten()
    }
}

/// An event of a script, which [`Script::id`] identifies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ScriptEvent {
    Began,
    /// It should have begun with the flight and has not.
    NotBegun(NotBegun),
    /// This line of its text was executed.
    Line(u16),
    /// This line was executed, and its command was refused.
    LineRefused {
        line: u16,
        why: LineRefusal,
    },
    /// Its last line is done.
    Done,
    /// It was stopped before its end: by a command, by another script, by the end of the flight.
    Stopped,
}

/// Why the script of a scenario does not begin with the flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotBegun {
    /// The autopilot joined a flight in progress.
    JoinedInFlight,
    /// It injects faults, and fault injection is off.
    FaultInjectionOff,
}

/// Why the command of a line was not executed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LineRefusal {
    Vehicle(crate::vehicle::VehicleRefusal),
    Plant {
        /// Target; `None` for all.
        target: Option<Target>,
        refusal: Refusal,
    },
    /// The plant has gone away before it answered.
    NoAnswer,
}

impl LineRefusal {
    /// In words, with the units of its target.
    pub fn described(&self, effectors: &EffectorList) -> String {
        match self {
            Self::Vehicle(refusal) => refusal.to_string(),
            Self::Plant { target, refusal } => {
                refusal.described(TargetClass::of_request(*target, effectors)).to_string()
            }
            Self::NoAnswer => NO_ANSWER.to_owned(),
        }
    }
}

#[cfg(test)]
mod tests;
