//! How often one peer gets each message: its own requests over the defaults, and when each is due next.

use core::time::Duration;

use crate::codec::StreamRequest;
use crate::peers::{Peer, Peers};
use crate::telemetry::registry::{ALL_GROUPS, ROWS, Rate, Row, TABLE};
use crate::wall_time::WallTime;
use flight_management::parameters::StreamParameters;

/// Shortest interval: 200 messages a second are more than any display shows.
pub const SHORTEST: Duration = Duration::from_millis(5);
/// Messages that come at least this often by default are what REQUEST_DATA_STREAM makes faster or slower;
/// the state reports of the rest keep their rhythm.
const FAST: Duration = Duration::from_millis(200);

/// What a peer has requested of one message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Requested {
    /// None.
    Never,
    /// One in each interval.
    Every(Duration),
}

impl Requested {
    /// Time between two of them.
    #[must_use]
    pub const fn interval(self) -> Option<Duration> {
        match self {
            Self::Never => None,
            Self::Every(interval) => Some(interval),
        }
    }
}

/// One message of one peer.
#[derive(Debug, Clone, Copy, Default)]
struct Stream {
    /// By SET_MESSAGE_INTERVAL; goes before `grouped`.
    requested: Option<Requested>,
    /// By REQUEST_DATA_STREAM.
    grouped: Option<Requested>,
    due: Option<WallTime>,
}

/// The rates of all peers.
#[derive(Debug)]
pub struct PeerRates {
    pub(super) defaults: StreamParameters,
    pub(super) peers: Vec<Rates>,
}

impl PeerRates {
    /// No peers yet.
    #[must_use]
    pub fn new(defaults: StreamParameters) -> Self {
        Self { defaults, peers: Vec::new() }
    }

    /// The rates of one peer; the defaults if it is new.
    pub(super) fn of(&mut self, peer: Peer) -> &mut Rates {
        let place = self.peers.iter().position(|rates| rates.peer == peer);
        let place = place.unwrap_or_else(|| {
            self.peers.push(Rates::new(peer, &self.defaults));
            self.peers.len() - 1
        });
        &mut self.peers[place]
    }

    /// REQUEST_DATA_STREAM of one peer.
    pub fn set_group(&mut self, peer: Peer, request: StreamRequest) {
        let defaults = self.defaults;
        self.of(peer).request_group(request, SHORTEST, &defaults);
    }

    /// Follows the peers as they come and go, and the parameters.
    pub fn follow(&mut self, now: WallTime, defaults: StreamParameters, peers: &Peers) {
        if self.defaults != defaults {
            self.defaults = defaults;
            for rates in &mut self.peers {
                rates.defaults_changed(now, &defaults);
            }
        }
        self.peers.retain(|rates| peers.knows(rates.peer));
        for peer in peers.all() {
            self.of(peer);
        }
    }

    /// A new flight has its first state: every message that is streamed is due now.
    pub fn everything_is_due(&mut self) {
        for rates in &mut self.peers {
            rates.everything_is_due(&self.defaults);
        }
    }

    /// When the next message is due for some peer.
    #[must_use]
    pub fn next_due(&self) -> Option<WallTime> {
        self.peers.iter().filter_map(|rates| rates.next).min()
    }

    /// The peers for which this row is due; the next one is scheduled.
    pub(super) fn take_due(&mut self, index: usize, row: &Row, now: WallTime) -> Vec<Peer> {
        let defaults = &self.defaults;
        let due = self
            .peers
            .iter_mut()
            .filter_map(|rates| rates.take_due(index, row, now, defaults).then_some(rates.peer));
        due.collect()
    }

    /// To be called after [`PeerRates::take_due`].
    pub(super) fn find_next(&mut self) {
        for rates in &mut self.peers {
            rates.find_next();
        }
    }
}

/// The rates of one peer.
#[derive(Debug)]
pub struct Rates {
    peer: Peer,
    streams: [Stream; ROWS],
    /// Earliest of all that is due.
    next: Option<WallTime>,
}

impl Rates {
    /// The defaults; everything is due at once.
    #[must_use]
    pub fn new(peer: Peer, defaults: &StreamParameters) -> Self {
        let mut rates = Self { peer, streams: [Stream::default(); ROWS], next: None };
        rates.everything_is_due(defaults);
        rates
    }

    /// Whose.
    #[must_use]
    pub const fn peer(&self) -> Peer {
        self.peer
    }

    /// Time between two messages of this row; `None`: it does not come.
    #[must_use]
    pub fn interval(
        &self,
        index: usize,
        row: &Row,
        defaults: &StreamParameters,
    ) -> Option<Duration> {
        let stream = self.streams.get(index)?;
        match stream.requested.or(stream.grouped) {
            Some(requested) => requested.interval(),
            None => row.default_interval(defaults),
        }
    }

    /// Sets how often the peer gets this row; `None`: the default. The next one comes at once, unless nothing
    /// changed.
    pub fn request_row(
        &mut self,
        index: usize,
        row: &Row,
        requested: Option<Requested>,
        defaults: &StreamParameters,
    ) {
        let before = self.interval(index, row, defaults);
        if let Some(stream) = self.streams.get_mut(index) {
            stream.requested = requested;
        }
        self.reschedule(index, row, before, defaults);
    }

    /// REQUEST_DATA_STREAM. It moves the fast messages of a group, and of these only those for which no
    /// interval was requested. Zero, or `start` not set, stops the whole group.
    pub fn request_group(
        &mut self,
        request: StreamRequest,
        shortest: Duration,
        defaults: &StreamParameters,
    ) {
        let stop = !request.start || request.rate_hz == 0;
        let interval = Duration::from_secs(1) / u32::from(request.rate_hz.max(1));
        for (index, row) in TABLE.iter().enumerate() {
            let is_member = request.stream == ALL_GROUPS || request.stream == row.group as u8;
            if !is_member || row.rate == Rate::Answer {
                continue;
            }
            let is_fast = row.default_interval(defaults).is_some_and(|interval| interval <= FAST);
            let grouped = match (stop, is_fast) {
                (true, _) => Some(Requested::Never),
                (false, true) => Some(Requested::Every(interval.max(shortest))),
                (false, false) => None,
            };
            let before = self.interval(index, row, defaults);
            if let Some(stream) = self.streams.get_mut(index) {
                stream.grouped = grouped;
            }
            self.reschedule(index, row, before, defaults);
        }
    }

    /// The defaults have changed: what is far off comes nearer, what has begun or stopped does so.
    pub fn defaults_changed(&mut self, now: WallTime, defaults: &StreamParameters) {
        for (index, row) in TABLE.iter().enumerate() {
            let interval = self.interval(index, row, defaults);
            if let Some(stream) = self.streams.get_mut(index) {
                let soonest = interval.map(|interval| now + interval);
                stream.due =
                    soonest.map(|soonest| stream.due.map_or(soonest, |due| due.min(soonest)));
            }
        }
        self.find_next();
    }

    /// There is something new: every message that is streamed at all is due now.
    pub fn everything_is_due(&mut self, defaults: &StreamParameters) {
        for (index, row) in TABLE.iter().enumerate() {
            let comes = self.interval(index, row, defaults).is_some();
            if let Some(stream) = self.streams.get_mut(index) {
                stream.due = comes.then_some(WallTime::ZERO);
            }
        }
        self.find_next();
    }

    /// Whether this row is due; then the next one is scheduled.
    pub fn take_due(
        &mut self,
        index: usize,
        row: &Row,
        now: WallTime,
        defaults: &StreamParameters,
    ) -> bool {
        let interval = self.interval(index, row, defaults);
        let Some(stream) = self.streams.get_mut(index) else { return false };
        let Some(due) = stream.due.filter(|due| *due <= now) else { return false };
        stream.due = interval.map(|interval| {
            // Keeps the rhythm, but never catches up: what is late is gone.
            if now.since(due) < interval { due + interval } else { now + interval }
        });
        true
    }

    /// To be called after [`Rates::take_due`].
    pub fn find_next(&mut self) {
        self.next = self.streams.iter().filter_map(|stream| stream.due).min();
    }

    fn reschedule(
        &mut self,
        index: usize,
        row: &Row,
        before: Option<Duration>,
        defaults: &StreamParameters,
    ) {
        let after = self.interval(index, row, defaults);
        if after == before {
            return;
        }
        if let Some(stream) = self.streams.get_mut(index) {
            stream.due = after.map(|_| WallTime::ZERO);
        }
        self.find_next();
    }
}
