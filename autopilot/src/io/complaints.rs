//! Reports invalid packets to the operator, without a line for every packet.

use std::net::SocketAddr;
use std::time::Duration;

use icd::lockstep::Refused;
use icd::wire::{Aircraft, RefusalPacket, RefusalReason, VERSION, WireError};
use tracing::{error, warn};

use crate::clock::WallTime;

/// Time between two complaints of the same kind.
const INTERVAL: Duration = Duration::from_secs(5);
/// Kinds of complaints.
const KINDS: usize = 5;

/// When each kind was last reported.
#[derive(Debug, Clone, Copy, Default)]
pub struct Complaints {
    reported: [Option<WallTime>; KINDS],
}

impl Complaints {
    /// A packet was refused; `ours` is the aircraft of the model file.
    pub fn refused(&mut self, why: Refused, ours: Aircraft, from: SocketAddr, now: WallTime) {
        match why {
            Refused::Busy if self.is_due(0, now) => {
                warn!(%from, "refused a packet from another address than the plant's, which was heard less than a second ago");
            }
            Refused::Packet(WireError::Version { theirs, .. }) if self.is_due(1, now) => {
                error!(%from, theirs, ours = VERSION, "refused a plant of another link version");
            }
            Refused::Packet(WireError::Value { field, value, .. }) if self.is_due(2, now) => {
                error!(%from, field, value, "refused a packet with a value that cannot be");
            }
            Refused::Aircraft(theirs) if self.is_due(4, now) => {
                error!(%from, %theirs, %ours, "refused a plant that flies another aircraft than the model file is of");
            }
            Refused::Busy | Refused::Packet(_) | Refused::Aircraft(_) => {}
        }
    }

    /// The plant refuses this autopilot.
    pub fn refused_by_plant(&mut self, refusal: RefusalPacket, from: SocketAddr, now: WallTime) {
        if !self.is_due(3, now) {
            return;
        }
        match refusal.reason {
            RefusalReason::Version => {
                error!(%from, theirs = refusal.version, ours = VERSION, "the plant speaks another link version");
            }
            RefusalReason::Value => {
                error!(%from, "the plant refuses a value of this autopilot's packet");
            }
            RefusalReason::Aircraft => {
                error!(%from, "the plant flies another aircraft than the model file is of");
            }
            RefusalReason::Busy => error!(%from, "the plant flies with another autopilot"),
        }
    }

    fn is_due(&mut self, kind: usize, now: WallTime) -> bool {
        let due = self.reported[kind].is_none_or(|reported| now.since(reported) >= INTERVAL);
        if due {
            self.reported[kind] = Some(now);
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_reported_at_once_and_then_at_intervals() {
        let mut complaints = Complaints::default();
        let at = |s: u64| WallTime::from_micros(1_000_000 * s);
        assert!(complaints.is_due(0, at(1)));
        assert!(!complaints.is_due(0, at(5)));
        assert!(complaints.is_due(1, at(5)));
        assert!(complaints.is_due(0, at(6)));
    }
}
