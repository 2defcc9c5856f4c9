//! The messages streamed to each ground station, and their rates. Rates are wall time, time stamps simulation time.
//!
//! ```text
//!  commands 510, 511, REQUEST_DATA_STREAM ──> rates of one peer ──┐ due
//!                        parameters STR_* ──> defaults ───────────┤
//!                snapshot, aircraft ──> registry: build once ─────┴─> each peer for which it is due
//!                       command 512 ──> registry: build ────────────> the peer that requests it
//! ```
//!
//! When a message is due, the service requests a snapshot of the next tick and builds the messages from it. A
//! paused plant gives no snapshots; then the service sends the last one again.

use core::time::Duration;

use ::mavlink::dialects::common::MavLandedState;

use crate::aircraft::Home;
use crate::codec::{Encoded, Message};
use crate::fault_list::FaultStream;
use crate::heartbeat::HeartbeatIdentity;
use crate::peers::From;
use crate::telemetry::registry::TABLE;
use crate::wall_time::WallTime;
use crate::{Service, Shared};
use flight_management::event::EventKind;

pub use crate::telemetry::rates::{PeerRates, request};
pub use crate::telemetry::status::mission_current;

mod controls;
mod known;
mod motion;
mod rates;
mod registry;
mod status;

/// How long the telemetry waits for a snapshot that it requested.
const SNAPSHOT_TIMEOUT: Duration = Duration::from_millis(50);

/// Data for building messages.
#[derive(Debug, Clone, Copy)]
struct View<'a> {
    shared: &'a Shared,
    now: WallTime,
}

/// What the process reports about itself.
#[derive(Debug, Clone, Copy, Default)]
pub struct Host {
    /// The autopilot that the heartbeat names.
    pub identity: HeartbeatIdentity,
    /// UNIX time at [`WallTime::ZERO`], us; `None` if it is not known.
    pub unix_start_us: Option<u64>,
}

#[derive(Debug, Default)]
pub struct Telemetry {
    /// A message is due and waits for a snapshot, since this time.
    waiting: Option<WallTime>,
    /// The last wait timed out: no further wait until a snapshot arrives.
    still: bool,
    /// A state of this flight has been sent.
    shown: bool,
    landed: Option<MavLandedState>,
    /// Home as published last.
    home: Option<Home>,
    faults: FaultStream,
}

impl Service for Telemetry {
    fn handle(&mut self, from: From, message: &Message, _: WallTime, shared: &mut Shared) {
        if let Message::RequestDataStream(request) = message {
            shared.rates.set_group(from.peer, *request);
        }
    }

    fn handle_event(&mut self, _: &EventKind, _: WallTime, shared: &mut Shared) {
        self.publish_landed_state(shared);
    }

    /// Begins to wait for a snapshot when a message is due; sends without one after a timeout.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        shared.rates.follow(now, shared.parameters.streams, &shared.peers);
        self.show_a_new_flight(shared);
        self.publish_landed_state(shared);
        self.faults.poll(now, shared);
        match self.waiting {
            None if shared.rates.next_due().is_some_and(|due| due <= now) => {
                if self.still {
                    send_due(now, shared);
                } else {
                    self.waiting = Some(now);
                }
            }
            Some(since) if now.since(since) >= SNAPSHOT_TIMEOUT => {
                self.waiting = None;
                self.still = true;
                send_due(now, shared);
            }
            _ => {}
        }
    }

    /// `None` while there is no peer.
    fn next_deadline(&self, shared: &Shared) -> Option<WallTime> {
        let streams = self.waiting.map(|since| since + SNAPSHOT_TIMEOUT);
        let streams = streams.or_else(|| shared.rates.next_due());
        streams.into_iter().chain(self.faults.next_deadline()).min()
    }
}

impl Telemetry {
    /// The next tick must publish a snapshot.
    pub fn needs_snapshot(&self) -> bool {
        self.waiting.is_some() || self.still
    }

    /// A snapshot has arrived: sends the messages that waited for it.
    pub fn handle_snapshot(&mut self, now: WallTime, shared: &mut Shared) {
        self.still = false;
        self.show_a_new_flight(shared);
        self.publish_home(now, shared);
        if self.waiting.take().is_some() {
            send_due(now, shared);
        }
    }

    /// The list of faults has changed: it is sent soon.
    pub fn hurry_faults(&mut self, now: WallTime) {
        self.faults.hurry(now);
    }

    /// Announces at once that the aircraft has come down or that a flight has begun.
    fn publish_landed_state(&mut self, shared: &mut Shared) {
        let landed = status::landed_state(&shared.aircraft);
        if self.landed.replace(landed) != Some(landed) {
            shared.peers.announce(&status::extended_sys_state(&shared.aircraft));
        }
    }

    /// Announces at once that home was moved.
    fn publish_home(&mut self, now: WallTime, shared: &mut Shared) {
        let home = shared.aircraft.home().copied();
        if let (Some(before), Some(home)) = (self.home, home)
            && before != home
            && let Some(message) = motion::home_position(&View { shared, now })
        {
            shared.peers.announce(&message);
        }
        self.home = home.or(self.home);
    }

    /// On the first state of a flight: sends it at once, with all low-rate messages.
    fn show_a_new_flight(&mut self, shared: &mut Shared) {
        let has_state = shared.aircraft.snapshot().is_some();
        if has_state && !self.shown {
            shared.rates.everything_is_due();
        }
        self.shown = has_state;
    }
}

/// Builds each due message once, for all peers for which it is due.
fn send_due(now: WallTime, shared: &mut Shared) {
    for (index, row) in TABLE.iter().enumerate() {
        let due = shared.rates.take_due(index, row, now);
        if due.is_empty() {
            continue;
        }
        let messages = row.build(&View { shared, now });
        let messages: Vec<_> = messages.iter().map(Encoded::for_many).collect();
        for peer in due {
            for message in &messages {
                shared.peers.stream_to(peer, message.clone());
            }
        }
    }
    shared.rates.find_next();
}

#[cfg(test)]
mod tests;
