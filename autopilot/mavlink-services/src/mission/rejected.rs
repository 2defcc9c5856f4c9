//! Why a mission item is not taken: the result for the acknowledgement and the reason for people.

use ::mavlink::dialects::common::MavMissionResult as R;

/// A refusal.
#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    /// For MISSION_ACK.
    pub result: R,
    /// For STATUSTEXT.
    pub reason: String,
}

/// The parameters of an item by the number that the protocol gives them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Param {
    /// param1.
    P1,
    /// param2.
    P2,
    /// param3.
    P3,
    /// param4.
    P4,
    /// x.
    X,
    /// y.
    Y,
    /// z.
    Z,
}

impl Param {
    /// The result that names it.
    const fn result(self) -> R {
        match self {
            Self::P1 => R::MAV_MISSION_INVALID_PARAM1,
            Self::P2 => R::MAV_MISSION_INVALID_PARAM2,
            Self::P3 => R::MAV_MISSION_INVALID_PARAM3,
            Self::P4 => R::MAV_MISSION_INVALID_PARAM4,
            Self::X => R::MAV_MISSION_INVALID_PARAM5_X,
            Self::Y => R::MAV_MISSION_INVALID_PARAM6_Y,
            Self::Z => R::MAV_MISSION_INVALID_PARAM7,
        }
    }
}

impl Rejected {
    /// A parameter with a value that cannot be flown.
    #[must_use]
    pub fn param(param: Param, reason: impl Into<String>) -> Self {
        Self { result: param.result(), reason: reason.into() }
    }

    /// A command that is not flown.
    #[must_use]
    pub fn unsupported(reason: impl Into<String>) -> Self {
        Self { result: R::MAV_MISSION_UNSUPPORTED, reason: reason.into() }
    }

    /// A frame in which no altitude is known.
    #[must_use]
    pub fn frame(frame: u8) -> Self {
        let reason = format!("frame {frame} is not 0, 3, 5 or 6");
        Self { result: R::MAV_MISSION_UNSUPPORTED_FRAME, reason }
    }

    /// The same about an item of a plan.
    #[must_use]
    pub fn of_item(self, seq: u16) -> Self {
        Self { reason: format!("item {seq}: {}", self.reason), ..self }
    }
}
