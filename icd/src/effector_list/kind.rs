//! What effectors there are.

use serde::{Deserialize, Serialize};

/// What an effector is. A law that needs a role asks for it by kind and side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectorKind {
    /// Surface at the wing's trailing edge that rolls.
    Aileron,
    /// Surface at the tail that pitches; on both sides it can roll too.
    Elevator,
    /// Surface of the fin.
    Rudder,
    /// Surface at the wing's edge that lifts.
    Flap,
    /// Surface on the wing that takes lift away.
    Spoiler,
    /// Surface ahead of the wing that pitches.
    Canard,
    /// Angle of the jet that pitches.
    NozzlePitch,
    /// Angle of the jet that yaws.
    NozzleYaw,
    /// Thrust, newton.
    Engine,
}

impl EffectorKind {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Aileron,
        Self::Elevator,
        Self::Rudder,
        Self::Flap,
        Self::Spoiler,
        Self::Canard,
        Self::NozzlePitch,
        Self::NozzleYaw,
        Self::Engine,
    ];

    /// Word in files.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Aileron => "aileron",
            Self::Elevator => "elevator",
            Self::Rudder => "rudder",
            Self::Flap => "flap",
            Self::Spoiler => "spoiler",
            Self::Canard => "canard",
            Self::NozzlePitch => "nozzle_pitch",
            Self::NozzleYaw => "nozzle_yaw",
            Self::Engine => "engine",
        }
    }

    /// Whether the value is an angle, rad; the engine's is a thrust, N.
    #[must_use]
    pub const fn is_angle(self) -> bool {
        !matches!(self, Self::Engine)
    }

    /// Whether it turns the jet.
    #[must_use]
    pub const fn is_nozzle(self) -> bool {
        matches!(self, Self::NozzlePitch | Self::NozzleYaw)
    }

    /// Whether it is an aerodynamic surface.
    #[must_use]
    pub const fn is_surface(self) -> bool {
        self.is_angle() && !self.is_nozzle()
    }
}
