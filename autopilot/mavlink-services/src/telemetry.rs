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

use ::mavlink::MessageData;
use ::mavlink::dialects::common::{
    DEBUG_FLOAT_ARRAY_DATA, MESSAGE_INTERVAL_DATA, MavLandedState, MavResult,
};

use crate::aircraft::Home;
use crate::codec::{CommandError, Encoded, Message, StreamRequest};
use crate::fault_list::FaultStream;
use crate::heartbeat::HeartbeatIdentity;
use crate::peers::{From, Peer, Peers};
use crate::telemetry::registry::{ALL_GROUPS, Nothing, ROWS, Rate, Row, TABLE};
use crate::wall_time::WallTime;
use crate::{Service, Shared, convert, fault_list, heartbeat};
use flight_management::event::EventKind;
use flight_management::parameters::StreamParameters;

pub use crate::telemetry::status::mission_current;

mod motion;
mod registry;
mod status;

/// How long the telemetry waits for a snapshot that it requested.
const SNAPSHOT_TIMEOUT: Duration = Duration::from_millis(50);

/// Data for building messages.
#[derive(Debug, Clone, Copy)]
struct TelemetryView<'a> {
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
        // Also while time stands still: the first tick after it ends the stillness.
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
            && let Some(message) = motion::home_position(&TelemetryView { shared, now })
        {
            shared.peers.announce(&message);
        }
        self.home = home.or(self.home);
    }

    /// On the first state of a flight: sends it at once, with all low-rate messages.
    fn show_a_new_flight(&mut self, shared: &mut Shared) {
        let has_state = shared.aircraft.snapshot().is_some();
        if has_state && !self.shown {
            let PeerRates { defaults, peers } = &mut shared.rates;
            peers.iter_mut().for_each(|rates| rates.everything_is_due(defaults));
        }
        self.shown = has_state;
    }
}

/// Builds each due message once, for all peers for which it is due.
fn send_due(now: WallTime, shared: &mut Shared) {
    for (index, row) in TABLE.iter().enumerate() {
        let due = shared.rates.take_due(index, now);
        if due.is_empty() {
            continue;
        }
        // Built once, however many peers are due: each gets a copy.
        let messages = row.build(&TelemetryView { shared, now });
        let messages: Vec<_> = messages.iter().map(Encoded::for_many).collect();
        for peer in due {
            for message in &messages {
                shared.peers.stream_to(peer, message.clone());
            }
        }
    }
    // Once at the end, since each row has changed its own due time only.
    shared.rates.peers.iter_mut().for_each(Rates::find_next);
}

/// Shortest interval: 200 messages a second are more than any display shows.
const SHORTEST: Duration = Duration::from_millis(5);
/// REQUEST_DATA_STREAM changes the rate of messages that have at most this interval by default;
/// the slower state reports keep their rate.
const FAST: Duration = Duration::from_millis(200);

/// Longest interval: what MESSAGE_INTERVAL can hold, us.
const LONGEST_US: f32 = 2.0e9;

/// The interval that stops a stream.
const STOP: f32 = -1.0;
/// The interval that selects the default.
const DEFAULT: f32 = 0.0;

/// Time between two messages of one kind; `None`: never.
type Interval = Option<Duration>;

/// One message of one peer.
#[derive(Debug, Clone, Copy, Default)]
struct TelemetryStream {
    /// By SET_MESSAGE_INTERVAL; takes precedence over `grouped`.
    requested: Option<Interval>,
    /// By REQUEST_DATA_STREAM.
    grouped: Option<Interval>,
    due: Option<WallTime>,
}

/// The rates of one peer, and when each of its messages is due.
#[derive(Debug)]
struct Rates {
    peer: Peer,
    streams: [TelemetryStream; ROWS],
    /// Earliest time at which any message is due.
    next: Option<WallTime>,
}

impl Rates {
    fn interval(&self, index: usize, defaults: &StreamParameters) -> Interval {
        let TelemetryStream { requested, grouped, .. } = self.streams[index];
        requested.or(grouped).unwrap_or_else(|| TABLE[index].default_interval(defaults))
    }

    /// Changes the stream of a row. Its next message is due at once, unless the interval stays the same.
    fn change(
        &mut self,
        index: usize,
        change: impl Fn(&mut TelemetryStream),
        defaults: &StreamParameters,
    ) {
        let before = self.interval(index, defaults);
        change(&mut self.streams[index]);
        let after = self.interval(index, defaults);
        if after != before {
            // At once, so that a station sees that its request has worked.
            self.streams[index].due = after.map(|_| WallTime::ZERO);
            self.find_next();
        }
    }

    /// Every streamed message is due now.
    fn everything_is_due(&mut self, defaults: &StreamParameters) {
        for index in 0..ROWS {
            let interval = self.interval(index, defaults);
            self.streams[index].due = interval.map(|_| WallTime::ZERO);
        }
        self.find_next();
    }

    fn find_next(&mut self) {
        self.next = self.streams.iter().filter_map(|stream| stream.due).min();
    }

    /// Whether this row is due; then the next one is scheduled.
    fn take_due(&mut self, index: usize, now: WallTime, defaults: &StreamParameters) -> bool {
        let interval = self.interval(index, defaults);
        let stream = &mut self.streams[index];
        let Some(due) = stream.due.filter(|due| *due <= now) else { return false };
        stream.due = interval.map(|interval| {
            // Keeps the rhythm, but never catches up: missed messages are skipped.
            if now.since(due) < interval { due + interval } else { now + interval }
        });
        true
    }
}

/// The rates of all peers: the own requests of each (SET_MESSAGE_INTERVAL, REQUEST_DATA_STREAM) over the defaults.
#[derive(Debug)]
pub struct PeerRates {
    defaults: StreamParameters,
    peers: Vec<Rates>,
}

impl PeerRates {
    pub fn new(defaults: StreamParameters) -> Self {
        Self { defaults, peers: Vec::new() }
    }

    /// The rates of one peer; a new one has the defaults, and everything is due at once.
    fn of(&mut self, peer: Peer) -> &mut Rates {
        let place = self.peers.iter().position(|rates| rates.peer == peer);
        let place = place.unwrap_or_else(|| {
            let mut rates = Rates { peer, streams: [TelemetryStream::default(); ROWS], next: None };
            rates.everything_is_due(&self.defaults);
            self.peers.push(rates);
            self.peers.len() - 1
        });
        &mut self.peers[place]
    }

    /// REQUEST_DATA_STREAM of one peer. It changes the fast messages of a group, except those with a requested interval.
    /// Zero, or `start` not set, stops the whole group.
    fn set_group(&mut self, peer: Peer, request: StreamRequest) {
        let defaults = self.defaults;
        let rates = self.of(peer);
        let stop = !request.start || request.rate_hz == 0;
        let interval = Duration::from_secs(1) / u32::from(request.rate_hz.max(1));
        for (index, row) in TABLE.iter().enumerate() {
            let is_member = request.stream == ALL_GROUPS || request.stream == row.group as u8;
            if !is_member || row.rate == Rate::Answer {
                continue;
            }
            let is_fast = row.default_interval(&defaults).is_some_and(|interval| interval <= FAST);
            let grouped = match (stop, is_fast) {
                (true, _) => Some(None),
                (false, true) => Some(Some(interval.max(SHORTEST))),
                (false, false) => None,
            };
            rates.change(index, |stream| stream.grouped = grouped, &defaults);
        }
    }

    /// Follows the list of peers and the parameters: changed defaults bring distant due times closer, and start and stop
    /// streams.
    fn follow(&mut self, now: WallTime, defaults: StreamParameters, peers: &Peers) {
        if self.defaults != defaults {
            self.defaults = defaults;
            for rates in &mut self.peers {
                for index in 0..ROWS {
                    let soonest = rates.interval(index, &defaults).map(|interval| now + interval);
                    let due = &mut rates.streams[index].due;
                    *due = soonest.map(|soonest| due.map_or(soonest, |due| due.min(soonest)));
                }
                rates.find_next();
            }
        }
        self.peers.retain(|rates| peers.knows(rates.peer));
        for peer in peers.all() {
            self.of(peer);
        }
    }

    /// When the next message is due for some peer.
    fn next_due(&self) -> Option<WallTime> {
        self.peers.iter().filter_map(|rates| rates.next).min()
    }

    /// The peers for which this row is due; the next one is scheduled.
    fn take_due(&mut self, index: usize, now: WallTime) -> Vec<Peer> {
        let Self { peers, defaults } = self;
        let due = peers
            .iter_mut()
            .filter_map(|rates| rates.take_due(index, now, defaults).then_some(rates.peer));
        due.collect()
    }

    /// SET_MESSAGE_INTERVAL of one peer: param1 and param2 of the command. -1 stops, 0 goes back to the
    /// default, else microseconds.
    pub fn set_interval(
        &mut self,
        peer: Peer,
        message_id: f32,
        interval_us: f32,
    ) -> Result<(), CommandError> {
        let index = streamed(message_id)?;
        let requested = requested(interval_us)?;
        let defaults = self.defaults;
        self.of(peer).change(index, |stream| stream.requested = requested, &defaults);
        Ok(())
    }

    /// GET_MESSAGE_INTERVAL of one peer: the MESSAGE_INTERVAL that answers it. Its interval is -1 for a
    /// stream that is stopped, and 0 for a message that does not exist here.
    pub fn interval(&self, peer: Peer, message_id: f32) -> Result<Encoded, CommandError> {
        let id = whole(message_id)?;
        let microseconds =
            |interval: Duration| i32::try_from(interval.as_micros()).unwrap_or(i32::MAX);
        let interval_us = match TABLE.iter().position(|row| row.id == id) {
            None => 0,
            Some(index) if is_heartbeat(&TABLE[index]) => microseconds(heartbeat::INTERVAL),
            Some(index) => {
                let own = self.peers.iter().find(|rates| rates.peer == peer);
                let interval = match own {
                    Some(rates) => rates.interval(index, &self.defaults),
                    None => TABLE[index].default_interval(&self.defaults),
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

/// The index of a message that can be streamed.
fn streamed(message_id: f32) -> Result<usize, CommandError> {
    let id = whole(message_id)?;
    let (index, row) = TABLE.iter().enumerate().find(|(_, row)| row.id == id).ok_or_else(|| {
        CommandError::unsupported(format!("Interval refused: there is no message {id}"))
    })?;
    if is_heartbeat(row) {
        return Err(CommandError::denied("Interval refused: heartbeats come once a second"));
    }
    if row.rate == Rate::Answer {
        let text = format!("Interval refused: {} only answers requests", row.name);
        return Err(CommandError::denied(text));
    }
    Ok(index)
}

/// `None`: the default.
fn requested(interval_us: f32) -> Result<Option<Interval>, CommandError> {
    if interval_us == STOP {
        return Ok(Some(None));
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
    Ok(Some(Some(interval)))
}

/// A message number received as a float.
fn whole(message_id: f32) -> Result<u32, CommandError> {
    // Message numbers have 24 bits, and so have floats.
    let id = convert::whole_number(message_id.into()).filter(|id| *id < 1 << 24);
    id.ok_or_else(|| CommandError::denied(format!("Refused: {message_id} is no message number")))
}

/// REQUEST_MESSAGE of one peer: param1 and param2 of the command; returns the answer. param2 selects an entry
/// of a list of modes by its number, of the arrays `WHY` or `FAULTS` by its id, and the message whose MESSAGE_INTERVAL is requested.
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
    let row = TABLE.iter().find(|row| row.id == id).ok_or(unsupported)?;
    let index = index(param2)?;
    let is_array = id == DEBUG_FLOAT_ARRAY_DATA::ID;
    if is_array && index > fault_list::ARRAY_ID {
        return Err(CommandError::without_text(MavResult::MAV_RESULT_DENIED));
    }
    if is_array && index == fault_list::ARRAY_ID && shared.aircraft.snapshot().is_some() {
        return Ok(fault_list::messages(shared));
    }
    let view = TelemetryView { shared, now };
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

#[cfg(test)]
mod tests;
