//! The parts of an entry of the catalogue, and the macros that generate types from its entries.

use serde::{Deserialize, Serialize};

use super::quantity::{Quantity, Range};
use super::target::TargetClass;
use crate::named;

/// An entry of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KindInfo {
    /// Number in packets and logs, from 1; of a kind with a choice that of the first alternative.
    pub code: u8,
    /// Name in scenario files.
    pub key: &'static str,
    /// Which targets can have it.
    pub targets: Targets,
    /// Its phrase in scripts and texts.
    pub phrase: &'static [Piece],
    /// Its numbers, in the order of the fields.
    pub numbers: &'static [NumberInfo],
    /// Its choice, if it has one.
    pub choice: Option<Choice>,
    /// Behaviour of the servo, for the documents.
    pub servo: &'static str,
    /// Remaining effect of the effector, for the documents.
    pub acts: &'static str,
    /// Effect of a ramp, for the documents; empty for a fault without a size, which has no ramp.
    pub ramp: &'static str,
    /// How ground stations request it.
    pub mavlink: Mavlink,
}

/// Which targets can have a kind of fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Targets {
    /// Effectors that turn: surfaces and nozzles.
    pub angles: bool,
    /// Engines.
    pub thrust: bool,
    /// Sensors.
    pub sensors: bool,
    /// Parts of the airframe.
    pub parts: bool,
}

/// A part of a phrase.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Piece {
    /// One of these; texts use the first.
    Words(&'static [&'static str]),
    /// A word that a script may leave out; texts have it.
    Optional(&'static str),
    /// A number with its unit.
    Number(Quantity),
    /// The phrase of the alternative.
    Choice,
}

/// A number of a kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberInfo {
    /// The quantity.
    pub quantity: Quantity,
    /// The range that it must be in.
    pub range: Range,
    /// Decimals in texts; `None` for as many as the number has, up to four.
    pub decimals: Option<u8>,
    /// Option of the shell. [`SIZE_OPTION`] is the size of the fault, which USER_1 also carries.
    pub option: &'static str,
    /// The parameter that gives the number where a request does not.
    pub parameter: NumberParameter,
}

impl NumberInfo {
    pub(super) const fn new(
        option: &'static str,
        quantity: Quantity,
        range: Range,
        decimals: Option<u8>,
        parameter: NumberParameter,
    ) -> Self {
        Self { quantity, range, decimals, option, parameter }
    }
}

/// A parameter with a number, in the unit of effectors that turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NumberParameter {
    /// Name.
    pub name: &'static str,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Default value.
    pub default: f64,
    /// Its description.
    pub meaning: &'static str,
}

/// A choice of a kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Key in scenario files.
    pub key: &'static str,
    /// Its name in messages.
    pub title: &'static str,
    /// The alternatives.
    pub alternatives: &'static [Alternative],
    /// The alternative where a request gives none; `None` where it must give one.
    pub default: Option<u8>,
    /// The parameter that gives the alternative where a request does not.
    pub parameter: Option<ChoiceParameter>,
}

/// An alternative of a choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternative {
    /// Name in scenario files.
    pub key: &'static str,
    /// Phrases in scripts; texts use the first. Without any, it is the alternative of a script that names none.
    pub words: &'static [&'static str],
    /// As the size of a request: text in the shell, number in USER_1.
    pub value: Option<(&'static str, f64)>,
    /// Its label in the parameter.
    pub label: &'static str,
}

/// A parameter with a choice; its values number the alternatives of a kind, or the kinds of a type, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChoiceParameter {
    /// Name.
    pub name: &'static str,
    /// Its description.
    pub meaning: &'static str,
}

/// How ground stations request a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mavlink {
    /// Type of the failure.
    pub failure_type: FailureType,
    /// Value of the type's mode parameter for this kind; of a kind with a choice that of its first alternative.
    pub first_mode: u8,
    /// Labels of these values, one for each alternative; empty if the type has no mode parameter.
    pub mode: &'static [&'static str],
    /// Name in the shell where the type has several kinds.
    pub word: Option<&'static str>,
    /// Number in p4 of USER_1, which defines the value in p5.
    pub user_1: Option<u8>,
}

impl Targets {
    /// Every effector and sensor.
    pub const EVERY: Self = Self { sensors: true, ..Self::EFFECTORS };
    /// Sensors.
    pub const SENSORS: Self = Self { angles: false, thrust: false, ..Self::EVERY };
    /// Parts of the airframe.
    pub const PARTS: Self = Self { sensors: false, parts: true, ..Self::SENSORS };
    /// All effectors.
    pub const EFFECTORS: Self = Self { angles: true, thrust: true, sensors: false, parts: false };
    /// Effectors that turn.
    pub const ANGLES: Self = Self { thrust: false, ..Self::EFFECTORS };
    /// Engines.
    pub const THRUST: Self = Self { angles: false, ..Self::EFFECTORS };

    /// Whether a target can be of both.
    pub const fn overlap(self, other: Self) -> bool {
        self.angles && other.angles
            || self.thrust && other.thrust
            || self.sensors && other.sensors
            || self.parts && other.parts
    }

    /// Whether targets of this class can have it.
    pub const fn allow(self, class: TargetClass) -> bool {
        match class {
            TargetClass::Angle => self.angles,
            TargetClass::Thrust => self.thrust,
            TargetClass::Sensor(_) => self.sensors,
            TargetClass::Part => self.parts,
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
    /// Whether it has a size, which a ramp can increase from nothing.
    pub const fn has_size(&self) -> bool {
        !self.ramp.is_empty()
    }

    /// How many alternatives it has; 1 without a choice.
    pub fn alternatives(&self) -> u8 {
        // Two or three.
        self.choice.map_or(1, |choice| choice.alternatives.len() as u8)
    }

    /// The number that is its size, with its index.
    pub fn size(&self) -> Option<(usize, &'static NumberInfo)> {
        self.numbers.iter().enumerate().find(|(_, number)| number.option == SIZE_OPTION)
    }
}

/// Option of the shell for the size of a fault.
pub const SIZE_OPTION: &str = "-v";

named! {
    /// FAILURE_TYPE of MAVLink, by its number, with its name in PX4's shell.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
    FailureType {
        /// Repaired.
        Ok = "ok",
        /// Servo: floats. Motor: flame-out.
        Off = "off",
        /// Stuck.
        Stuck = "stuck",
        /// Oscillates.
        Garbage = "garbage",
        /// Does not follow its commands.
        Wrong = "wrong",
        /// Slow.
        Slow = "slow",
        /// Follows its commands late.
        Delayed = "delayed",
        /// Follows its commands for a part of the time.
        Intermittent = "intermittent",
        /// Drifts away from its commands.
        Drift = "drift",
    }
}

impl FailureType {
    /// Number in MAVLink.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The type with this number.
    pub fn from_code(code: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|known| i32::from(known.code()) == code)
    }

    /// Name, with an explanation where it needs one.
    pub const fn label(self) -> &'static str {
        match self {
            Self::Off => "off: floats, flame-out, no samples, torn off",
            Self::Garbage => "garbage: oscillates, noise",
            Self::Wrong => "wrong: see FLT_WRONG_MODE; bias of a sensor",
            other => other.key(),
        }
    }

    /// The parameter that selects one of several kinds.
    pub const fn mode(self) -> Option<ChoiceParameter> {
        match self {
            Self::Stuck => Some(ChoiceParameter {
                name: "FLT_STUCK_MODE",
                meaning: "Where STUCK holds an effector",
            }),
            Self::Wrong => {
                Some(ChoiceParameter { name: "FLT_WRONG_MODE", meaning: "What WRONG means" })
            }
            _ => None,
        }
    }
}

/// Most numbers that a kind can have.
pub const NUMBERS_MAX: usize = 2;

/// A kind taken apart.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parts {
    pub choice: u8,
    pub values: [f64; NUMBERS_MAX],
    pub next: usize,
}

/// A field of a kind.
pub(super) trait Part: Sized {
    fn put(self, parts: &mut Parts);
    fn take(parts: &mut Parts) -> Option<Self>;
}

impl Part for f64 {
    fn put(self, parts: &mut Parts) {
        if let Some(value) = parts.values.get_mut(parts.next) {
            *value = self;
            parts.next += 1;
        }
    }

    fn take(parts: &mut Parts) -> Option<Self> {
        let value = parts.values.get(parts.next).copied();
        parts.next += 1;
        value
    }
}

/// Enums without fields as fields of a kind.
macro_rules! choices {
    ($($name:ident: $($variant:ident),+;)+) => {
        $(impl Part for $name {
            fn put(self, parts: &mut Parts) {
                parts.choice = self as u8;
            }

            fn take(parts: &mut Parts) -> Option<Self> {
                [$(Self::$variant),+].get(usize::from(parts.choice)).copied()
            }
        })+
    };
}

/// The enum of the kinds, the catalogue, and the conversion between a kind and its code and numbers.
macro_rules! kinds {
    ($(
        $(#[$doc:meta])* $name:ident
        $({ $($(#[$field_doc:meta])* $field:ident: $type:ty),+ $(,)? })?
        => $info:expr;
    )+) => {
        /// How an effector or a sensor fails. Values are rad, rad/s for effectors that turn; N, N/s for an engine; the SI unit of
        /// its output, and that per second, for a sensor.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        pub enum FaultKind {
            $($(#[$doc])* $name $({ $($(#[$field_doc])* $field: $type),+ })?),+
        }

        /// Index in the catalogue.
        #[derive(Clone, Copy)]
        enum Place { $($name),+ }

        /// The entry of each kind of fault, in the order of [`FaultKind`].
        pub static CATALOGUE: [KindInfo; [$(Place::$name),+].len()] = [$($info),+];

        impl FaultKind {
            /// Its entry in the catalogue.
            pub fn info(&self) -> &'static KindInfo {
                match self { $(Self::$name { .. } => &CATALOGUE[Place::$name as usize]),+ }
            }

            pub(super) fn parts(&self) -> Parts {
                let mut parts = Parts::default();
                match *self {
                    $(Self::$name $({ $($field),+ })? => { $($($field.put(&mut parts);)+)? })+
                }
                parts
            }

            pub(super) fn from_parts(place: usize, mut parts: Parts) -> Option<Self> {
                // Not every kind has parts.
                let _parts = &mut parts;
                $(if place == Place::$name as usize {
                    return Some(Self::$name $({ $($field: Part::take(_parts)?),+ })?);
                })+
                None
            }
        }
    };
}

pub(super) use {choices, kinds};
