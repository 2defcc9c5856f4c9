//! PING and TIMESYNC: answered at once, wall time.

#![expect(deprecated, reason = "ground stations still send PING")]

use ::mavlink::dialects::common::{PING_DATA, TIMESYNC_DATA};

use crate::codec::{Encoded, Message};
use crate::peers::From;
use crate::wall_time::WallTime;
use crate::{Service, Shared};

/// Answers both.
#[derive(Debug, Default)]
pub struct Ping;

impl Service for Ping {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        let (target_system, target_component) = (from.sender.system, from.sender.component);
        let answer = match *message {
            // With a target it is itself an answer.
            Message::Ping(PING_DATA { time_usec, seq, target_system: 0, target_component: 0 }) => {
                Encoded::new(&PING_DATA { time_usec, seq, target_system, target_component })
            }
            // tc1 is zero in a request.
            Message::TimeSync(TIMESYNC_DATA { tc1: 0, ts1, .. }) => {
                let tc1 = i64::try_from(now.as_micros().saturating_mul(1000)).unwrap_or(i64::MAX);
                Encoded::new(&TIMESYNC_DATA { tc1, ts1, target_system, target_component })
            }
            _ => return,
        };
        shared.peers.answer(from.peer, answer);
    }
}
