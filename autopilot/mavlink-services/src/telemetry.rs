//! What is streamed to each ground station, and how often. Rates are wall time, time stamps simulation time.
//!
//! ```text
//!  commands 510, 511, REQUEST_DATA_STREAM ──> rates of one peer ──┐ due
//!                        parameters STR_* ──> defaults ───────────┤
//!                snapshot, aircraft ──> registry: build once ─────┴─> each peer for which it is due
//!                       command 512 ──> registry: build ────────────> the peer that asks
//! ```
//!
//! When something is due, a snapshot of the next tick is requested, and the messages are made of it. A
//! plant that stands still gives no snapshots; then the last one is shown again.

use core::time::Duration;

use ::mavlink::dialects::common::MavLandedState;
use flight_control::AircraftModel;

use super::aircraft::{Aircraft, Home};
use super::codec::{Encoded, StreamRequest};
use super::component_metadata::Metadata;
use super::heartbeat::HeartbeatIdentity;
use super::peers::{From, Peer, Peers};
use crate::wall_time::WallTime;
use flight_management::parameters::{Parameters, StreamParameters};

mod faults;
mod intervals;
mod messages;
mod rates;
mod registry;
mod request;

pub use request::request;

use faults::FaultStream;
use messages::status;
pub use messages::status::mission_current;
use rates::Rates;
use registry::TABLE;

/// How long the telemetry waits for a snapshot that it requested.
const SNAPSHOT_TIMEOUT: Duration = Duration::from_millis(50);

/// What messages are made of.
#[derive(Debug, Clone, Copy)]
struct View<'a> {
    aircraft: &'a Aircraft,
    model: &'a AircraftModel,
    metadata: &'a Metadata,
    host: Host,
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

/// Streams telemetry.
#[derive(Debug)]
pub struct Telemetry {
    model: AircraftModel,
    metadata: Metadata,
    host: Host,
    defaults: StreamParameters,
    rates: Vec<Rates>,
    /// Something is due and waits for a snapshot, since then.
    waiting: Option<WallTime>,
    /// The last wait was in vain: nothing is waited for until a snapshot comes.
    still: bool,
    /// A state of this flight has been shown.
    shown: bool,
    landed: Option<MavLandedState>,
    /// Home as published last.
    home: Option<Home>,
    faults: FaultStream,
}

impl Telemetry {
    /// Nobody listens yet.
    #[must_use]
    pub fn new(
        model: &AircraftModel,
        parameters: &Parameters,
        defaults: &Parameters,
        host: Host,
    ) -> Self {
        Self {
            model: *model,
            metadata: Metadata::new(&model.effectors.list, defaults),
            host,
            defaults: parameters.streams,
            rates: Vec::new(),
            waiting: None,
            still: false,
            shown: false,
            landed: None,
            home: None,
            faults: FaultStream::default(),
        }
    }

    /// The files that describe parameters and effectors.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// REQUEST_DATA_STREAM: scales the rates of one peer.
    pub fn handle_data_stream(&mut self, from: From, request: StreamRequest) {
        let defaults = self.defaults;
        self.rates_of(from.peer).want_group(request, intervals::SHORTEST, &defaults);
    }

    /// A snapshot of the next tick is wanted.
    #[must_use]
    pub fn wants_snapshot(&self) -> bool {
        self.waiting.is_some() || self.still
    }

    /// A snapshot has come: what waited for it is sent.
    pub fn handle_snapshot(&mut self, now: WallTime, aircraft: &Aircraft, out: &mut Peers) {
        self.still = false;
        self.show_a_new_flight(aircraft);
        self.publish_home(now, aircraft, out);
        if self.waiting.take().is_some() {
            self.send_due(now, aircraft, out);
        }
    }

    /// Tells at once when the aircraft has come down or a flight has begun.
    pub fn publish_landed_state(&mut self, aircraft: &Aircraft, out: &mut Peers) {
        let landed = status::landed_state(aircraft);
        if self.landed.replace(landed) != Some(landed) {
            out.announce(&status::extended_sys_state(aircraft));
        }
    }

    /// Tells at once that home was moved.
    fn publish_home(&mut self, now: WallTime, aircraft: &Aircraft, out: &mut Peers) {
        let home = aircraft.home().copied();
        if let (Some(before), Some(home)) = (self.home, home)
            && before != home
        {
            let (model, metadata, host) = (&self.model, &self.metadata, self.host);
            let view = View { aircraft, model, metadata, host, now };
            if let Some(message) = messages::pose::home_position(&view) {
                out.announce(&message);
            }
        }
        self.home = home.or(self.home);
    }

    /// The list of faults has changed: everybody is told soon.
    pub fn faults_changed(&mut self, now: WallTime) {
        self.faults.hurry(now);
    }

    /// Starts to wait for a snapshot when something is due; sends without one when none comes.
    pub fn poll(
        &mut self,
        now: WallTime,
        aircraft: &Aircraft,
        parameters: &Parameters,
        out: &mut Peers,
    ) {
        self.follow(now, parameters, out);
        self.show_a_new_flight(aircraft);
        self.publish_landed_state(aircraft, out);
        self.faults.poll(now, aircraft, &self.model.effectors.list, out);
        match self.waiting {
            None if self.next_due().is_some_and(|due| due <= now) => {
                if self.still {
                    self.send_due(now, aircraft, out);
                } else {
                    self.waiting = Some(now);
                }
            }
            Some(since) if now.since(since) >= SNAPSHOT_TIMEOUT => {
                self.waiting = None;
                self.still = true;
                self.send_due(now, aircraft, out);
            }
            _ => {}
        }
    }

    /// When there is something to do; `None` while nobody listens.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        let streams =
            self.waiting.map(|since| since + SNAPSHOT_TIMEOUT).or_else(|| self.next_due());
        streams.into_iter().chain(self.faults.next_deadline()).min()
    }

    fn next_due(&self) -> Option<WallTime> {
        self.rates.iter().filter_map(Rates::next).min()
    }

    /// Peers come and go, and so do parameters.
    fn follow(&mut self, now: WallTime, parameters: &Parameters, out: &Peers) {
        if self.defaults != parameters.streams {
            self.defaults = parameters.streams;
            for rates in &mut self.rates {
                rates.defaults_changed(now, &self.defaults);
            }
        }
        self.rates.retain(|rates| out.knows(rates.peer()));
        for peer in out.all() {
            self.rates_of(peer);
        }
    }

    fn rates_of(&mut self, peer: Peer) -> &mut Rates {
        let place = self.rates.iter().position(|rates| rates.peer() == peer);
        let place = place.unwrap_or_else(|| {
            self.rates.push(Rates::new(peer, &self.defaults));
            self.rates.len() - 1
        });
        &mut self.rates[place]
    }

    /// The first state of a flight is worth telling at once, also what is told rarely.
    fn show_a_new_flight(&mut self, aircraft: &Aircraft) {
        let has_state = aircraft.snapshot().is_some();
        if has_state && !self.shown {
            for rates in &mut self.rates {
                rates.everything_is_due(&self.defaults);
            }
        }
        self.shown = has_state;
    }

    /// Each message that is due for somebody is made once.
    fn send_due(&mut self, now: WallTime, aircraft: &Aircraft, out: &mut Peers) {
        let Self { model, metadata, host, defaults, rates, .. } = self;
        let view = View { aircraft, model, metadata, host: *host, now };
        for (index, row) in TABLE.iter().enumerate() {
            let mut built: Option<Vec<Encoded>> = None;
            for rates in rates.iter_mut() {
                if rates.take_due(index, row, now, defaults) {
                    for message in built.get_or_insert_with(|| row.build(&view)) {
                        out.stream_to(rates.peer(), message.clone());
                    }
                }
            }
        }
        for rates in rates {
            rates.find_next();
        }
    }
}

#[cfg(test)]
mod tests;
