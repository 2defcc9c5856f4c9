//! Why something is not done: the result for the acknowledgement and the reason for people.

use ::mavlink::dialects::common::MavResult;

/// A refusal.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// For COMMAND_ACK.
    pub result: MavResult,
    /// For STATUSTEXT; `None` where the result says it all.
    pub reason: Option<String>,
}

impl Refused {
    /// The same request will never be accepted.
    #[must_use]
    pub fn denied(reason: impl Into<String>) -> Self {
        Self { result: MavResult::MAV_RESULT_DENIED, reason: Some(reason.into()) }
    }

    /// The same request may be accepted later.
    #[must_use]
    pub fn for_now(reason: impl Into<String>) -> Self {
        let result = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;
        Self { result, reason: Some(reason.into()) }
    }

    /// The autopilot does not have this.
    #[must_use]
    pub fn unsupported(reason: impl Into<String>) -> Self {
        Self { result: MavResult::MAV_RESULT_UNSUPPORTED, reason: Some(reason.into()) }
    }

    /// The protocol wants FAILED here.
    #[must_use]
    pub fn failed(reason: impl Into<String>) -> Self {
        Self { result: MavResult::MAV_RESULT_FAILED, reason: Some(reason.into()) }
    }

    /// A result that says it all.
    #[must_use]
    pub fn silent(result: MavResult) -> Self {
        Self { result, reason: None }
    }
}
