//! How an effector fails.

use core::fmt;

use serde::{Deserialize, Serialize};

/// How an effector fails. Values are rad, rad/s for the seven that turn; N, N/s for the engine.
///
/// | kind | effectors | paper, literature |
/// |---|---|---|
/// | stuck here, stuck at | all (an angle: not the engine) | jam; the paper's two cases |
/// | hard over | all but the engine | runaway to a stop |
/// | partial loss | all | loss of effectiveness, the paper's x in `(x - 1) u`; the engine's thrust loss |
/// | float | all but the engine | disconnected linkage |
/// | slow | all | loss of hydraulic pressure |
/// | delayed | all | late commands |
/// | intermittent | all | loose contact |
/// | oscillating | all | oscillatory failure, "liquid" form |
/// | drifting, biased | all | sensor of the servo |
/// | limited travel | all | obstacle |
/// | flame-out | the engine | |
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FaultKind {
    /// Stuck where it is when the fault acts.
    StuckHere,
    /// Stuck at an angle.
    StuckAt {
        /// Where it sticks, rad, inside the effector's travel.
        angle_rad: f64,
        /// How it gets there.
        travel: Travel,
    },
    /// Runs to one end of its travel at the actuator's rate limit and stays there, whatever is commanded.
    HardOver {
        /// Which end. It is that of the deflection's sign and never that of the command.
        side: Side,
    },
    /// Partial loss: the effector has this fraction of its effect left (the paper's x in `(x - 1) u`).
    PartialLoss {
        /// Fraction remaining, 0 to 1.
        remaining: f64,
    },
    /// Disconnected: floats to zero deflection, where it has no moment.
    Float,
    /// Moves no faster than this.
    Slow {
        /// Largest speed either way, rad/s or N/s, more than 0.
        rate: f64,
    },
    /// Does what it was told this long ago. Nothing is told twice: at the onset it waits where it is.
    Delayed {
        /// Delay, s, 0 to [`FaultKind::DELAY_MAX_S`].
        delay_s: f64,
    },
    /// Commands get through for a part of each period only; else the effector stands still.
    Intermittent {
        /// Length of a period, s. A period begins with the gap.
        period_s: f64,
        /// Fraction of the period in which commands get through, 0 to 1.
        present: f64,
    },
    /// Swings about where it should be.
    Oscillating {
        /// Largest deviation, rad or N.
        amplitude: f64,
        /// Frequency, Hz, up to [`FaultKind::FREQUENCY_MAX_HZ`].
        frequency_hz: f64,
    },
    /// Its deviation grows until the end of the travel.
    Drifting {
        /// Speed and direction, rad/s or N/s.
        rate: f64,
    },
    /// Off by a constant.
    Biased {
        /// Deviation, rad or N.
        bias: f64,
    },
    /// Moves only this far; beyond it when the fault acts, it is pushed back.
    LimitedTravel {
        /// Largest deflection either way, rad; of the engine the largest thrust, N.
        limit: f64,
    },
    /// The engine is out: thrust runs down to zero, below its idle.
    FlameOut,
}

/// How a stuck effector reaches its angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Travel {
    /// At once, as in the paper's u_f.
    Jump,
    /// At the actuator's rate limit.
    AtActuatorRate,
}

/// An end of an effector's travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Side {
    /// That of positive deflections.
    Positive,
    /// That of negative deflections.
    Negative,
}

impl FaultKind {
    /// Longest delay, s.
    pub const DELAY_MAX_S: f64 = 1.0;
    /// Fastest oscillation, Hz.
    pub const FREQUENCY_MAX_HZ: f64 = 20.0;

    /// Number for packets and logs, from 1; 0 stands for no fault.
    #[must_use]
    pub const fn code(&self) -> u8 {
        match self {
            Self::StuckHere => 1,
            Self::StuckAt { travel: Travel::Jump, .. } => 2,
            Self::StuckAt { travel: Travel::AtActuatorRate, .. } => 3,
            Self::HardOver { side: Side::Positive } => 4,
            Self::HardOver { side: Side::Negative } => 5,
            Self::PartialLoss { .. } => 6,
            Self::Float => 7,
            Self::Slow { .. } => 8,
            Self::Delayed { .. } => 9,
            Self::Intermittent { .. } => 10,
            Self::Oscillating { .. } => 11,
            Self::Drifting { .. } => 12,
            Self::Biased { .. } => 13,
            Self::LimitedTravel { .. } => 14,
            Self::FlameOut => 15,
        }
    }

    /// The numbers of the kind in the order of its fields; 0 for those it does not have.
    #[must_use]
    pub const fn values(&self) -> [f64; 2] {
        match *self {
            Self::StuckHere | Self::HardOver { .. } | Self::Float | Self::FlameOut => [0.0; 2],
            Self::StuckAt { angle_rad: value, .. }
            | Self::PartialLoss { remaining: value }
            | Self::Slow { rate: value }
            | Self::Delayed { delay_s: value }
            | Self::Drifting { rate: value }
            | Self::Biased { bias: value }
            | Self::LimitedTravel { limit: value } => [value, 0.0],
            Self::Intermittent { period_s, present } => [period_s, present],
            Self::Oscillating { amplitude, frequency_hz } => [amplitude, frequency_hz],
        }
    }

    /// The kind with this number and these values; `None` if there is none.
    #[must_use]
    pub const fn from_code(code: u8, [value, second]: [f64; 2]) -> Option<Self> {
        Some(match code {
            1 => Self::StuckHere,
            2 => Self::StuckAt { angle_rad: value, travel: Travel::Jump },
            3 => Self::StuckAt { angle_rad: value, travel: Travel::AtActuatorRate },
            4 => Self::HardOver { side: Side::Positive },
            5 => Self::HardOver { side: Side::Negative },
            6 => Self::PartialLoss { remaining: value },
            7 => Self::Float,
            8 => Self::Slow { rate: value },
            9 => Self::Delayed { delay_s: value },
            10 => Self::Intermittent { period_s: value, present: second },
            11 => Self::Oscillating { amplitude: value, frequency_hz: second },
            12 => Self::Drifting { rate: value },
            13 => Self::Biased { bias: value },
            14 => Self::LimitedTravel { limit: value },
            15 => Self::FlameOut,
            _ => return None,
        })
    }

    /// It has a size that can grow from nothing, so that a ramp means something.
    #[must_use]
    pub const fn has_size(&self) -> bool {
        !matches!(self, Self::StuckHere | Self::HardOver { .. } | Self::FlameOut)
    }

    /// In words, for an effector whose values are angles (deg) or thrusts (kN).
    #[must_use]
    pub const fn described(&self, is_angle: bool) -> Described {
        Described { kind: *self, is_angle }
    }
}

/// A kind of fault in words, with the units of its effector.
#[derive(Debug, Clone, Copy)]
pub struct Described {
    kind: FaultKind,
    is_angle: bool,
}

impl fmt::Display for Described {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scale, unit) =
            if self.is_angle { (1.0_f64.to_degrees(), "deg") } else { (1.0e-3, "kN") };
        match self.kind {
            FaultKind::StuckHere => f.write_str("stuck"),
            FaultKind::StuckAt { angle_rad, travel } => {
                write!(f, "stuck at {:.1} deg", angle_rad.to_degrees())?;
                match travel {
                    Travel::Jump => Ok(()),
                    Travel::AtActuatorRate => f.write_str(" (travelling)"),
                }
            }
            FaultKind::HardOver { side: Side::Positive } => f.write_str("hard over, positive"),
            FaultKind::HardOver { side: Side::Negative } => f.write_str("hard over, negative"),
            FaultKind::PartialLoss { remaining } => write!(f, "{:.0} % left", remaining * 100.0),
            FaultKind::Float => f.write_str("floating"),
            FaultKind::Slow { rate } => write!(f, "slow, {:.1} {unit}/s", rate * scale),
            FaultKind::Delayed { delay_s } => write!(f, "delayed {:.0} ms", delay_s * 1.0e3),
            FaultKind::Intermittent { period_s, present } => {
                write!(f, "intermittent, {:.0} % of {period_s} s", present * 100.0)
            }
            FaultKind::Oscillating { amplitude, frequency_hz } => {
                write!(f, "oscillating {:.1} {unit} at {frequency_hz} Hz", amplitude * scale)
            }
            FaultKind::Drifting { rate } => write!(f, "drifting {:.2} {unit}/s", rate * scale),
            FaultKind::Biased { bias } => write!(f, "biased by {:.1} {unit}", bias * scale),
            FaultKind::LimitedTravel { limit } => {
                write!(f, "limited to {:.1} {unit}", limit * scale)
            }
            FaultKind::FlameOut => f.write_str("flame-out"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_comes_back_with_its_values() {
        let codes = (0..=u8::MAX).filter_map(|code| {
            let kind = FaultKind::from_code(code, [0.25, 0.5])?;
            assert_eq!(kind.code(), code);
            assert_eq!(FaultKind::from_code(code, kind.values()), Some(kind));
            Some(code)
        });
        assert!(codes.eq(1..=15));
    }
}
