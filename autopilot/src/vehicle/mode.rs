//! Flight modes.

use core::fmt;

/// Who gives the references.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    /// The aircraft holds altitude and airspeed, wings level.
    Hold,
    /// A ground station streams the roll reference.
    Offboard,
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Hold => "Hold",
            Self::Offboard => "Offboard",
        })
    }
}
