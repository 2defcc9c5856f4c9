//! What an entry of the catalogue says, and what follows from it for every kind alike.

use super::catalogue::{CATALOGUE, FaultKind, Quantity};
use super::mavlink::FailureType;
use super::target::TargetClass;

pub use super::measure::{Measure, Range, Unit};
pub use super::parts::NUMBERS_MAX;

/// An entry of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KindInfo {
    /// Number for packets and logs, from 1; of a kind with a choice that of the first alternative.
    pub code: u8,
    /// Word in scenario files.
    pub key: &'static str,
    /// What can have it.
    pub targets: Targets,
    /// Its words in scripts and texts.
    pub phrase: &'static [Piece],
    /// Its numbers, in the order of the fields.
    pub numbers: &'static [NumberInfo],
    /// Its choice, if it has one.
    pub choice: Option<Choice>,
    /// What the servo does, for the documents.
    pub servo: &'static str,
    /// What acts of the effector, for the documents.
    pub acts: &'static str,
    /// What a ramp does, for the documents; empty: the fault has no size and so no ramp.
    pub ramp: &'static str,
    /// How ground stations order it.
    pub mavlink: Mavlink,
}

/// What can have a kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Targets {
    /// Effectors that turn: surfaces and nozzles.
    pub angles: bool,
    /// Engines.
    pub thrust: bool,
    /// Sensors.
    pub sensors: bool,
}

/// A part of a phrase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Piece {
    /// One of these; texts have the first.
    Words(&'static [&'static str]),
    /// A word that may be left out; texts have it.
    Maybe(&'static str),
    /// A number with its unit.
    Number(Quantity),
    /// The words of the alternative.
    Choice,
}

/// A number of a kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberInfo {
    /// What it is.
    pub quantity: Quantity,
    /// Where it must lie.
    pub range: Range,
    /// Decimals in texts; `None`: as many as it has, up to four.
    pub decimals: Option<u8>,
    /// Option of the shell. [`SIZE_OPTION`] is the size of the fault, which USER_1 carries too.
    pub option: &'static str,
    /// The parameter that says it where an order does not.
    pub parameter: NumberParameter,
}

/// A parameter with a number, in the unit for what turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberParameter {
    /// Name.
    pub name: &'static str,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Value where nothing was set.
    pub default: f64,
    /// What it does.
    pub meaning: &'static str,
}

/// A choice of a kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Key in scenario files.
    pub key: &'static str,
    /// What it is, for messages.
    pub title: &'static str,
    /// What there is to choose from.
    pub alternatives: &'static [Alternative],
    /// The alternative where nothing is said; `None`: it must be said.
    pub default: Option<u8>,
    /// The parameter that says it where an order does not.
    pub parameter: Option<ChoiceParameter>,
}

/// One thing to choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternative {
    /// Word in scenario files.
    pub key: &'static str,
    /// Words in scripts, one of these; texts have the first. None: it is meant where nothing is said.
    pub words: &'static [&'static str],
    /// As the size of an order: text of the shell, number of USER_1.
    pub value: Option<(&'static str, f64)>,
    /// What the parameter says of it.
    pub label: &'static str,
}

/// A parameter with a choice: the numbers of the alternatives from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChoiceParameter {
    /// Name.
    pub name: &'static str,
    /// What it does.
    pub meaning: &'static str,
}

/// How ground stations order a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mavlink {
    /// Type of the failure.
    pub failure_type: FailureType,
    /// Value of the type's mode parameter that means this kind; of a kind with a choice that of the first alternative.
    pub first_mode: u8,
    /// What the mode parameter says of it, one for each alternative; empty if the type has no such parameter.
    pub mode: &'static [&'static str],
    /// Word of the shell that means this kind where the type leaves a choice.
    pub word: Option<&'static str>,
    /// Number in USER_1 (p4) that says what its value (p5) is.
    pub user_1: Option<u8>,
}

impl Targets {
    /// Every effector.
    pub const EFFECTORS: Self = Self { angles: true, thrust: true, sensors: false };
    /// Effectors that turn.
    pub const ANGLES: Self = Self { thrust: false, ..Self::EFFECTORS };
    /// Engines.
    pub const THRUST: Self = Self { angles: false, ..Self::EFFECTORS };

    /// Whether one of these can have it.
    #[must_use]
    pub const fn allow(self, class: TargetClass) -> bool {
        match class {
            TargetClass::Angle => self.angles,
            TargetClass::Thrust => self.thrust,
            TargetClass::Sensor => self.sensors,
        }
    }
}

impl Mavlink {
    /// A type's only kind.
    pub(super) const fn new(failure_type: FailureType) -> Self {
        Self { failure_type, first_mode: 0, mode: &[], word: None, user_1: None }
    }
}

impl KindInfo {
    /// It has a size that can grow from nothing, so that a ramp means something.
    #[must_use]
    pub const fn has_size(&self) -> bool {
        !self.ramp.is_empty()
    }

    /// How many alternatives it has; 1 without a choice.
    #[must_use]
    pub fn alternatives(&self) -> u8 {
        #[expect(clippy::cast_possible_truncation, reason = "two or three")]
        self.choice.map_or(1, |choice| choice.alternatives.len() as u8)
    }

    /// The number that is its size, and its place among its numbers.
    #[must_use]
    pub fn size(&self) -> Option<(usize, &'static NumberInfo)> {
        self.numbers.iter().enumerate().find(|(_, number)| number.option == SIZE_OPTION)
    }

    /// The kind with this alternative (from 0) and these numbers, SI units; `None` without such an alternative.
    #[must_use]
    pub fn with(&self, alternative: u8, values: [f64; NUMBERS_MAX]) -> Option<FaultKind> {
        let code = self.code.checked_add(alternative)?;
        FaultKind::from_code(code, values).filter(|kind| kind.info().code == self.code)
    }

    /// The entry with this word of scenario files.
    #[must_use]
    pub fn by_key(key: &str) -> Option<&'static Self> {
        CATALOGUE.iter().find(|info| info.key == key)
    }
}

/// Option of the shell for the size of a fault.
pub const SIZE_OPTION: &str = "-v";
