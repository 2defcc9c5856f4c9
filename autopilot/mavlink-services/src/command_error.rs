//! Why a command is refused: the result for the acknowledgement and the reason for the operator.

use ::mavlink::dialects::common::MavResult;

/// Why a command is refused.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandError {
    /// For COMMAND_ACK.
    pub result: MavResult,
    /// For STATUSTEXT; `None` where the result is enough.
    pub reason: Option<String>,
}

impl CommandError {
    /// The same request will never be accepted.
    #[must_use]
    pub fn denied(reason: impl Into<String>) -> Self {
        Self { result: MavResult::MAV_RESULT_DENIED, reason: Some(reason.into()) }
    }

    /// The same request may be accepted later.
    #[must_use]
    pub fn temporary(reason: impl Into<String>) -> Self {
        let result = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;
        Self { result, reason: Some(reason.into()) }
    }

    /// The autopilot does not have this.
    #[must_use]
    pub fn unsupported(reason: impl Into<String>) -> Self {
        Self { result: MavResult::MAV_RESULT_UNSUPPORTED, reason: Some(reason.into()) }
    }

    /// The protocol requires FAILED here.
    #[must_use]
    pub fn failed(reason: impl Into<String>) -> Self {
        Self { result: MavResult::MAV_RESULT_FAILED, reason: Some(reason.into()) }
    }

    /// A result that needs no text.
    #[must_use]
    pub fn without_text(result: MavResult) -> Self {
        Self { result, reason: None }
    }
}
