//! PING and TIMESYNC: answered at once, wall time.

#![expect(deprecated, reason = "ground stations still send PING and SET_MODE")]

use ::mavlink::dialects::common::{PING_DATA, TIMESYNC_DATA};

use super::codec::Encoded;
use super::context::From;
use super::peers::Peers;
use crate::wall_time::WallTime;

/// Answers a ping that asks everybody; an answer (with a target) needs none.
pub fn handle_ping(from: From, data: &PING_DATA, out: &mut Peers) {
    if data.target_system != 0 || data.target_component != 0 {
        return;
    }
    let answer = PING_DATA {
        time_usec: data.time_usec,
        seq: data.seq,
        target_system: from.sender.system,
        target_component: from.sender.component,
    };
    out.answer(from.peer, Encoded::new(&answer));
}

/// Answers a question for the time; tc1 is zero in a question.
pub fn handle_timesync(from: From, data: &TIMESYNC_DATA, now: WallTime, out: &mut Peers) {
    if data.tc1 != 0 {
        return;
    }
    let nanoseconds = i64::try_from(now.as_micros().saturating_mul(1000)).unwrap_or(i64::MAX);
    let answer = TIMESYNC_DATA {
        tc1: nanoseconds,
        ts1: data.ts1,
        target_system: from.sender.system,
        target_component: from.sender.component,
    };
    out.answer(from.peer, Encoded::new(&answer));
}
