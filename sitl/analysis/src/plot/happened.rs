//! What can happen in a flight.

use icd::Effector;

/// What kind of thing happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A fault begins or ends.
    Fault,
    /// An operator gave a command.
    Input,
    /// The script does something.
    Script,
    /// Something that was wanted is not done.
    Refusal,
    /// The compensator wakes or sleeps.
    Compensator,
    /// An effector is at its limit.
    Saturation,
    /// The mode changes.
    Mode,
    /// The link to the plant, the ground, the end.
    Flight,
}

impl Kind {
    /// Name for people.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fault => "fault",
            Self::Input => "input",
            Self::Script => "script",
            Self::Refusal => "refusal",
            Self::Compensator => "compensator",
            Self::Saturation => "limit",
            Self::Mode => "mode",
            Self::Flight => "flight",
        }
    }

    /// Colour as `#rrggbb`.
    pub const fn colour(self) -> &'static str {
        match self {
            Self::Fault => "#b3161b",
            Self::Input => "#1f5fbf",
            Self::Script => "#00707a",
            Self::Refusal => "#a03a78",
            Self::Compensator => "#0a6b2e",
            Self::Saturation => "#8a5a00",
            Self::Mode => "#5b3fa0",
            Self::Flight => "#444444",
        }
    }

    /// It has a line on every time axis.
    pub const fn is_marked(self) -> bool {
        !matches!(self, Self::Saturation | Self::Mode | Self::Refusal)
    }
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq)]
pub struct Happened {
    /// Simulation time, s.
    pub t_s: f64,
    /// What kind of thing.
    pub kind: Kind,
    /// In plain words.
    pub text: String,
}

/// A fault from its onset to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultSpan {
    /// Which effector.
    pub effector: Effector,
    /// From and to, s; to the end of the log if it still acts.
    pub span: (f64, f64),
    /// It still acts when the log ends.
    pub lasts: bool,
    /// How it fails.
    pub text: String,
}
