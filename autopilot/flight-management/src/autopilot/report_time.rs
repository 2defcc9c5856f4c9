//! Simulation times of what the plant reports.

use icd::SimTime;
use icd::fault::{FaultReply, FaultState};

/// When a request took effect, if it did.
pub(super) fn of_reply(reply: &FaultReply) -> Option<SimTime> {
    match *reply {
        FaultReply::Applied { at } | FaultReply::Cleared { at } => Some(at),
        FaultReply::Unchanged { .. } | FaultReply::Scheduled { .. } | FaultReply::Refused(_) => {
            None
        }
    }
}

/// When a fault began or ended; `before` is the tick before the report. What is new happened at the tick that comes
/// with the report; what is listed again happened earlier, and what is scheduled will happen.
pub(super) fn of_fault(state: &FaultState, before: SimTime) -> SimTime {
    match state {
        FaultState::Scheduled { .. } => before,
        state => state.time().max(before),
    }
}
