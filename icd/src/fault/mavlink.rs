//! Words and numbers of MAVLink for faults: the catalogue says which kind belongs to which.

/// FAILURE_TYPE of MAVLink.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum FailureType {
    /// Mended.
    Ok = 0,
    /// Servo: floats. Motor: flame-out.
    Off = 1,
    /// Stuck.
    Stuck = 2,
    /// Oscillates.
    Garbage = 3,
    /// Not as commanded.
    Wrong = 4,
    /// Slow.
    Slow = 5,
    /// Late.
    Delayed = 6,
    /// Follows now and then.
    Intermittent = 7,
    /// Drifts off.
    Drift = 8,
}

/// The parameter that says which kind a type of several kinds means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModeParameter {
    /// Name.
    pub name: &'static str,
    /// What it does.
    pub meaning: &'static str,
}

impl FailureType {
    /// All of them, by their number.
    pub const ALL: [Self; 9] = [
        Self::Ok,
        Self::Off,
        Self::Stuck,
        Self::Garbage,
        Self::Wrong,
        Self::Slow,
        Self::Delayed,
        Self::Intermittent,
        Self::Drift,
    ];

    /// Number in MAVLink.
    #[must_use]
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// The type with this number.
    #[must_use]
    pub fn from_code(code: i32) -> Option<Self> {
        Self::ALL.into_iter().find(|known| i32::from(known.code()) == code)
    }

    /// Name in PX4's shell.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Off => "off",
            Self::Stuck => "stuck",
            Self::Garbage => "garbage",
            Self::Wrong => "wrong",
            Self::Slow => "slow",
            Self::Delayed => "delayed",
            Self::Intermittent => "intermittent",
            Self::Drift => "drift",
        }
    }

    /// Name with what it means, where the name does not say it.
    #[must_use]
    pub const fn label(self) -> &'static str {
        match self {
            Self::Off => "off: floats, flame-out",
            Self::Garbage => "garbage: oscillates",
            Self::Wrong => "wrong: see FLT_WRONG_MODE",
            other => other.name(),
        }
    }

    /// The parameter that picks one of several kinds.
    #[must_use]
    pub const fn mode(self) -> Option<ModeParameter> {
        match self {
            Self::Stuck => Some(ModeParameter {
                name: "FLT_STUCK_MODE",
                meaning: "Where STUCK holds an effector",
            }),
            Self::Wrong => {
                Some(ModeParameter { name: "FLT_WRONG_MODE", meaning: "What WRONG means" })
            }
            _ => None,
        }
    }
}
