//! Message rates of each peer: its own requests (SET_MESSAGE_INTERVAL, REQUEST_DATA_STREAM) over the defaults,
//! and when each is due next. Answers to GET_MESSAGE_INTERVAL and REQUEST_MESSAGE, for the requesting peer only.

use core::time::Duration;

use ::mavlink::MessageData;
use ::mavlink::dialects::common::{DEBUG_FLOAT_ARRAY_DATA, MESSAGE_INTERVAL_DATA, MavResult};

use crate::codec::{CommandError, Encoded, StreamRequest};
use crate::peers::{Peer, Peers};
use crate::telemetry::registry::{ALL_GROUPS, Nothing, ROWS, Rate, Row, TABLE};
use crate::telemetry::{View, registry};
use crate::wall_time::WallTime;
use crate::{Shared, fault_list, heartbeat};
use flight_management::parameters::StreamParameters;

/// Shortest interval: 200 messages a second are more than any display shows.
pub const SHORTEST: Duration = Duration::from_millis(5);
/// REQUEST_DATA_STREAM changes the rate of messages that have at most this interval by default;
/// the slower state reports keep their rate.
const FAST: Duration = Duration::from_millis(200);

/// Request of a peer for one message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Requested {
    Never,
    /// One in each interval.
    Every(Duration),
}

impl Requested {
    /// Time between two of them.
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
    /// By SET_MESSAGE_INTERVAL; takes precedence over `grouped`.
    requested: Option<Requested>,
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

    /// Follows the list of peers and the parameters.
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

    /// A new flight has its first state: every streamed message is due now.
    pub fn everything_is_due(&mut self) {
        for rates in &mut self.peers {
            rates.everything_is_due(&self.defaults);
        }
    }

    /// When the next message is due for some peer.
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
    /// Earliest time at which any message is due.
    next: Option<WallTime>,
}

impl Rates {
    /// The defaults; everything is due at once.
    pub fn new(peer: Peer, defaults: &StreamParameters) -> Self {
        let mut rates = Self { peer, streams: [Stream::default(); ROWS], next: None };
        rates.everything_is_due(defaults);
        rates
    }

    /// Messages of this peer.
    pub const fn peer(&self) -> Peer {
        self.peer
    }

    /// Interval of this row; `None`: not streamed.
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

    /// Sets the interval of this row for the peer; `None`: the default. The next message is due at once, unless nothing
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

    /// REQUEST_DATA_STREAM. It changes the fast messages of a group, except those with a requested
    /// interval. Zero, or `start` not set, stops the whole group.
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

    /// The defaults have changed: brings distant due times closer, starts and stops streams.
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

    /// There is a new state: every streamed message is due now.
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
            // Keeps the rhythm, but never catches up: missed messages are skipped.
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

/// Longest interval: what MESSAGE_INTERVAL can hold, us.
const LONGEST_US: f32 = 2.0e9;

/// The interval that stops a stream.
const STOP: f32 = -1.0;
/// The interval that selects the default.
const DEFAULT: f32 = 0.0;

impl PeerRates {
    /// SET_MESSAGE_INTERVAL of one peer: param1 and param2 of the command. -1 stops, 0 goes back to the
    /// default, else microseconds.
    ///
    /// # Errors
    /// No such message, or an invalid, too short or too long interval.
    pub fn set_interval(
        &mut self,
        peer: Peer,
        message_id: f32,
        interval_us: f32,
    ) -> Result<(), CommandError> {
        let (index, row) = streamed(message_id)?;
        let requested = requested(interval_us)?;
        let defaults = self.defaults;
        self.of(peer).request_row(index, row, requested, &defaults);
        Ok(())
    }

    /// GET_MESSAGE_INTERVAL of one peer: the MESSAGE_INTERVAL that answers it. Its interval is -1 for a
    /// stream that is stopped, and 0 for a message that does not exist here.
    pub fn interval(&self, peer: Peer, message_id: f32) -> Result<Encoded, CommandError> {
        let id = whole(message_id)?;
        let interval_us = match registry::find(id) {
            None => 0,
            Some((_, row)) if is_heartbeat(row) => microseconds(heartbeat::INTERVAL),
            Some((_, Row { rate: Rate::Answer, .. })) => -1,
            Some((index, row)) => {
                let own = self.peers.iter().find(|rates| rates.peer() == peer);
                let interval = match own {
                    Some(rates) => rates.interval(index, row, &self.defaults),
                    None => row.default_interval(&self.defaults),
                };
                interval.map_or(-1, microseconds)
            }
        };
        let message_id = u16::try_from(id).unwrap_or(u16::MAX);
        Ok(Encoded::new(&MESSAGE_INTERVAL_DATA { message_id, interval_us }))
    }
}

fn is_heartbeat(row: &Row) -> bool {
    row.id == 0
}

fn microseconds(interval: Duration) -> i32 {
    i32::try_from(interval.as_micros()).unwrap_or(i32::MAX)
}

/// The row of a message that can be streamed.
fn streamed(message_id: f32) -> Result<(usize, &'static Row), CommandError> {
    let id = whole(message_id)?;
    let (index, row) = registry::find(id).ok_or_else(|| {
        CommandError::unsupported(format!("Interval refused: there is no message {id}"))
    })?;
    if is_heartbeat(row) {
        return Err(CommandError::denied("Interval refused: heartbeats come once a second"));
    }
    if row.rate == Rate::Answer {
        let text = format!("Interval refused: {} only answers requests", row.name);
        return Err(CommandError::denied(text));
    }
    Ok((index, row))
}

/// `None`: the default.
fn requested(interval_us: f32) -> Result<Option<Requested>, CommandError> {
    if interval_us == STOP {
        return Ok(Some(Requested::Never));
    }
    if interval_us == DEFAULT {
        return Ok(None);
    }
    let shortest_us = SHORTEST.as_micros();
    if !(0.0..=LONGEST_US).contains(&interval_us) {
        let text =
            format!("Interval refused: {interval_us} us is not -1, 0, or {shortest_us} to 2e9");
        return Err(CommandError::denied(text));
    }
    let interval = Duration::from_secs_f64(f64::from(interval_us) * 1.0e-6);
    if interval < SHORTEST {
        let text = format!("Interval refused: {interval_us} us is shorter than {shortest_us} us");
        return Err(CommandError::denied(text));
    }
    Ok(Some(Requested::Every(interval)))
}

/// A message number received as a float.
pub(super) fn whole(message_id: f32) -> Result<u32, CommandError> {
    // Message numbers have 24 bits, and so have floats.
    let max = 16_777_215.0;
    if message_id.fract() == 0.0 && (0.0..=max).contains(&message_id) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "whole and in range, as just checked"
        )]
        return Ok(message_id as u32);
    }
    Err(CommandError::denied(format!("Refused: {message_id} is no message number")))
}

/// REQUEST_MESSAGE of one peer: param1 and param2 of the command; returns the answer. param2 selects an entry
/// of a list of modes by its number, of the arrays `WHY` or `FAULTS` by its id, and the message whose MESSAGE_INTERVAL is requested.
///
/// # Errors
/// No such message, nothing to send yet, or nothing with this number.
pub fn request(
    shared: &Shared,
    peer: Peer,
    now: WallTime,
    message_id: f32,
    param2: f32,
) -> Result<Vec<Encoded>, CommandError> {
    let id = whole(message_id)?;
    if id == MESSAGE_INTERVAL_DATA::ID {
        return shared.rates.interval(peer, param2).map(|message| vec![message]);
    }
    let unsupported = CommandError::without_text(MavResult::MAV_RESULT_UNSUPPORTED);
    let (_, row) = registry::find(id).ok_or(unsupported)?;
    let index = index(param2)?;
    let is_array = id == DEBUG_FLOAT_ARRAY_DATA::ID;
    if is_array && index > fault_list::ARRAY_ID {
        return Err(CommandError::without_text(MavResult::MAV_RESULT_DENIED));
    }
    if is_array && index == fault_list::ARRAY_ID && shared.aircraft.snapshot().is_some() {
        return Ok(fault_list::messages(shared));
    }
    let view = View { shared, now };
    let mut answer = row.answer(&view, index).map_err(|nothing| {
        CommandError::without_text(match nothing {
            Nothing::Yet => MavResult::MAV_RESULT_TEMPORARILY_REJECTED,
            Nothing::There => MavResult::MAV_RESULT_DENIED,
        })
    })?;
    if is_array && index == 0 {
        answer.extend(fault_list::messages(shared));
    }
    Ok(answer)
}

/// A number in a list; NaN means "not given".
fn index(param2: f32) -> Result<u8, CommandError> {
    if param2.is_nan() {
        return Ok(0);
    }
    let number = whole(param2)?;
    u8::try_from(number).map_err(|_| CommandError::without_text(MavResult::MAV_RESULT_DENIED))
}
