//! The signals between the two steps and the mixer.

use icd::Effector;
use serde::{Deserialize, Serialize};

/// Largest command that the laws accept, rad or N; beyond it sums could overflow.
const COMMAND_MAX: f64 = 1.0e9;

/// u1: command of the main controller, before limits. Rad; thrust N.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct MainCommand {
    /// δa_c: aileron pair, right = this, left = minus this.
    pub aileron_rad: f64,
    /// δe_c: both elevators.
    pub elevator_rad: f64,
    /// δr_c: rudder.
    pub rudder_rad: f64,
    /// Nozzle pitch; zero unless the nozzle is ganged.
    pub nozzle_pitch_rad: f64,
    /// Nozzle yaw; zero unless the nozzle is ganged.
    pub nozzle_yaw_rad: f64,
    /// Thrust, N.
    pub thrust_n: f64,
}

impl MainCommand {
    /// Field by field.
    pub(crate) fn combine(&self, other: &Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            aileron_rad: of(self.aileron_rad, other.aileron_rad),
            elevator_rad: of(self.elevator_rad, other.elevator_rad),
            rudder_rad: of(self.rudder_rad, other.rudder_rad),
            nozzle_pitch_rad: of(self.nozzle_pitch_rad, other.nozzle_pitch_rad),
            nozzle_yaw_rad: of(self.nozzle_yaw_rad, other.nozzle_yaw_rad),
            thrust_n: of(self.thrust_n, other.thrust_n),
        }
    }

    /// Where a field is not finite or beyond [`COMMAND_MAX`], that of `other`.
    pub(crate) fn finite_or(&self, other: &Self) -> Self {
        self.combine(
            other,
            |command, other| if command.abs() <= COMMAND_MAX { command } else { other },
        )
    }
}

/// u_cf: the redundant commands [Δδa, δz, δy], rad.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Compensation {
    /// Δδa: added to the aileron command.
    pub aileron_rad: f64,
    /// δz: nozzle pitch.
    pub nozzle_pitch_rad: f64,
    /// δy: nozzle yaw.
    pub nozzle_yaw_rad: f64,
}

impl Compensation {
    /// No compensation, to the bit.
    pub const NONE: Self = Self { aileron_rad: 0.0, nozzle_pitch_rad: 0.0, nozzle_yaw_rad: 0.0 };

    /// So much of it; nothing to the bit where that is zero, and where a part is not finite or beyond [`COMMAND_MAX`].
    pub(crate) fn faded(&self, fade: f64) -> Self {
        let Self { aileron_rad, nozzle_pitch_rad, nozzle_yaw_rad } = *self;
        let largest = aileron_rad.abs().max(nozzle_pitch_rad.abs()).max(nozzle_yaw_rad.abs());
        let is_sum_finite = (aileron_rad + nozzle_pitch_rad + nozzle_yaw_rad).is_finite();
        if fade == 0.0 || !is_sum_finite || largest > COMMAND_MAX {
            return Self::NONE;
        }
        Self {
            aileron_rad: fade * aileron_rad,
            nozzle_pitch_rad: fade * nozzle_pitch_rad,
            nozzle_yaw_rad: fade * nozzle_yaw_rad,
        }
    }
}

/// Side on which a command is beyond its limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Side {
    /// Inside the limits.
    #[default]
    Inside,
    /// Beyond the lower limit.
    Below,
    /// Beyond the upper limit.
    Above,
}

impl Side {
    /// Whether an integrator that grows with `error` would push farther beyond the limit.
    pub fn blocks(self, error: f64) -> bool {
        match self {
            Self::Inside => false,
            Self::Below => error < 0.0,
            Self::Above => error > 0.0,
        }
    }

    /// Whether the command was cut.
    pub fn is_saturated(self) -> bool {
        self != Self::Inside
    }
}

/// What could not be given in a step; the main controller's anti-windup reads it in the next one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Saturation {
    /// Aileron pair, both steps together.
    pub aileron: Side,
    /// Elevators.
    pub elevator: Side,
    /// Rudder.
    pub rudder: Side,
    /// Nozzle pitch.
    pub nozzle_pitch: Side,
    /// Nozzle yaw.
    pub nozzle_yaw: Side,
    /// Engine.
    pub thrust: Side,
}

/// Effectors as bits, by their places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct EffectorSet(u16);

impl EffectorSet {
    /// Whether an effector is one of them.
    pub const fn contains(self, effector: Effector) -> bool {
        self.0 & (1 << effector.index()) != 0
    }

    /// With an effector, or without it.
    #[must_use]
    pub const fn with(self, effector: Effector, is_in: bool) -> Self {
        let bit = 1 << effector.index();
        Self(if is_in { self.0 | bit } else { self.0 & !bit })
    }
}
