//! Flight modes: who gives the references.

use core::fmt;
use serde::{Deserialize, Serialize};

/// Who gives the references.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// References as they stand, or a pilot's sticks; without either the aircraft holds altitude, course and
    /// speed. A flight begins in it.
    Position,
    /// The aircraft circles around a point.
    Hold,
    /// The aircraft flies its plan.
    Mission,
    /// The aircraft flies home and circles there.
    Return,
    /// A ground station streams setpoints.
    Offboard,
    /// A pilot's sticks give roll angle, climb and airspeed.
    Altitude,
}

impl Mode {
    /// All of them, in the order in which they are listed to ground stations.
    pub const ALL: [Self; 6] =
        [Self::Position, Self::Hold, Self::Mission, Self::Return, Self::Offboard, Self::Altitude];

    /// Name for people.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "Position",
            Self::Hold => "Hold",
            Self::Mission => "Mission",
            Self::Return => "Return",
            Self::Offboard => "Offboard",
            Self::Altitude => "Altitude",
        }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
