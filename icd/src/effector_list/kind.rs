//! The kinds of effectors.

use serde::{Deserialize, Serialize};

/// Kind of an effector. A law finds the effector of a role by kind and side.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EffectorKind {
    /// Surface at the wing's trailing edge, for roll.
    Aileron,
    /// Surface at the tail, for pitch; left and right ones can also roll.
    Elevator,
    /// Surface of the fin.
    Rudder,
    /// High-lift surface at the wing's edge.
    Flap,
    /// Surface on the wing that reduces lift.
    Spoiler,
    /// Surface ahead of the wing, for pitch.
    Canard,
    /// Angle of the jet in pitch.
    NozzlePitch,
    /// Angle of the jet in yaw.
    NozzleYaw,
    /// Thrust, newton.
    Engine,
}

impl EffectorKind {
    /// All kinds.
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

    /// Name in files.
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

    /// Whether it is a nozzle angle.
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
