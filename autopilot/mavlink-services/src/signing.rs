//! Signing of MAVLink 2: which frames are accepted while it is on, and the trailer of every frame sent.
//!
//! ```text
//!  frame in ──> admit ──> services          frame out <── seal <── outbox
//!                 │  ^                                     │
//!              streams └────────── local time ─────────────┘ ──> key file
//! ```
//!
//! Off until a key arrives, from the key file or by SETUP_SIGNING. `docs/signing.md` is for the operator.

use core::time::Duration;

use crate::codec::{Encoded, Frame, Identity, Message, SetupSigning};
use crate::wall_time::WallTime;
use crate::{From, Service, Shared};

mod key;

pub use key::{KEY, Key, KeyRecord, RecordError, Timestamp, Trailer};

use key::SAVE_EVERY;

/// RADIO_STATUS: radios insert it into the stream and have no key.
const RADIO_STATUS: u32 = 109;
/// Largest lead of other clocks over the local time where the computer knows the date. One wrong clock must not
/// advance the local time so far that right clocks count as too old.
const AHEAD_MAX: Duration = Duration::from_secs(24 * 3600);

/// Admission of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admission {
    Accepted,
    /// Accepted although unsigned. The frame is read, but does not make its sender a peer.
    Exempt,
    Refused,
}

/// Content due for the key file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyChange {
    Keep(KeyRecord),
    Forget,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetupOutcome {
    /// Signing is on, with this key from now on.
    On,
    /// It was already on with this key.
    StaysOn,
    /// Signing is off from now on.
    Off,
    /// It was already off.
    StaysOff,
    /// The timestamp exceeds 48 bits; nothing has changed.
    TimestampOutside,
    /// The timestamp is more than a day ahead of the local time; nothing has changed.
    DayAhead,
}

/// Key, time and streams of the autopilot.
#[derive(Debug, Default)]
pub struct Signing {
    key: Option<Key>,
    /// UNIX time at [`WallTime::ZERO`], us.
    unix_start_us: Option<u64>,
    /// Local time: at least the calendar, the newest timestamp received, and the last one sent.
    local: Timestamp,
    streams: Streams,
    refusals: Refusals,
    /// There is a key file.
    has_file: bool,
    /// The key file does not contain the present key.
    is_unsaved: bool,
    /// Local time at the last save.
    saved: Timestamp,
    /// Newest accepted timestamp at the last save.
    saved_accepted: Timestamp,
    /// Signing was turned on or off, and the log has no line about it yet.
    news: Option<&'static str>,
}

impl Signing {
    /// Off. `unix_start_us` is UNIX time at the start of the process, us.
    pub fn new(unix_start_us: Option<u64>) -> Self {
        Self { unix_start_us, ..Self::default() }
    }

    /// With a key file and its content: on, if it contains a key.
    #[must_use]
    pub fn with_file(mut self, record: Option<KeyRecord>) -> Self {
        self.has_file = true;
        if let Some(record) = record {
            self.key = Some(record.key);
            self.local = self.local.max(record.resume_at());
            self.streams = Streams::above(record.floor(), record.accepted);
            // From now on the file marks its timestamp as not final.
            self.is_unsaved = true;
        }
        self
    }

    /// Advances the local time to the calendar.
    fn follow_calendar(&mut self, now: WallTime) {
        self.local = self.local.max(Timestamp::of_calendar(self.unix_start_us, now));
    }

    /// Whether to accept a frame of another sender.
    pub fn admit(&mut self, frame: &Frame<'_>, now: WallTime) -> Admission {
        let Some(key) = self.key else { return Admission::Accepted };
        self.follow_calendar(now);
        if frame.id == RADIO_STATUS && !frame.is_version_1() && frame.signature().is_none() {
            return Admission::Exempt;
        }
        match self.check(key, frame) {
            Ok(()) => Admission::Accepted,
            Err(refusal) => {
                self.refusals.add(refusal);
                Admission::Refused
            }
        }
    }

    fn check(&mut self, key: Key, frame: &Frame<'_>) -> Result<(), Refusal> {
        if frame.is_version_1() {
            return Err(Refusal::Version1);
        }
        let (signed, trailer) = frame.signature().ok_or(Refusal::Unsigned)?;
        let trailer = Trailer(trailer);
        // Before anything else is read: a frame without a valid signature must change nothing.
        if !key.is_right(signed, trailer) {
            return Err(Refusal::WrongSignature);
        }
        if trailer.at() > self.newest_allowed() {
            return Err(Refusal::DayAhead);
        }
        let stream = Stream { link: trailer.link(), sender: frame.sender };
        self.streams.take(stream, trailer.at(), self.local)?;
        self.local = self.local.max(trailer.at());
        Ok(())
    }

    /// Upper limit of accepted timestamps.
    fn newest_allowed(&self) -> Timestamp {
        let knows_date = Timestamp::knows_date(self.unix_start_us);
        // Without a date any lead may be right.
        if knows_date { self.local.plus(AHEAD_MAX) } else { Timestamp::END }
    }

    /// The frame of a message of `sender` for the own link with this number, signed if signing is on.
    pub fn seal(&mut self, message: &Encoded, sender: Identity, sequence: u8, link: u8) -> Vec<u8> {
        let Some(key) = self.key else { return message.frame(sender, sequence) };
        // One time for all links: a station reached over two of them never sees it run backwards.
        self.local = self.local.next();
        message.signed_frame(sender, sequence, |frame| key.sign(frame, link, self.local))
    }

    /// Executes SETUP_SIGNING, after its admission.
    pub fn set_up(&mut self, setup: &SetupSigning, now: WallTime) -> SetupOutcome {
        let initial = Timestamp::new(setup.initial_timestamp);
        let Some(initial) = initial.filter(|initial| *initial <= Timestamp::LATEST) else {
            return SetupOutcome::TimestampOutside;
        };
        self.follow_calendar(now);
        if initial > self.newest_allowed() {
            return SetupOutcome::DayAhead;
        }
        self.local = self.local.max(initial);
        // The streams stay: a timestamp accepted once is not accepted again, even if the same key returns.
        let before = core::mem::replace(&mut self.key, setup.key);
        self.is_unsaved = true;
        match (before == setup.key, setup.key) {
            (false, Some(_)) => SetupOutcome::On,
            (true, Some(_)) => SetupOutcome::StaysOn,
            (false, None) => SetupOutcome::Off,
            (true, None) => SetupOutcome::StaysOff,
        }
    }

    /// Content that the key file should have now, if it is time to write it.
    pub fn pop_change(&mut self) -> Option<KeyChange> {
        let has_come_far = self.local >= self.saved.plus(SAVE_EVERY)
            || self.streams.newest() >= self.saved_accepted.plus(SAVE_EVERY);
        if !self.has_file || !(self.is_unsaved || self.key.is_some() && has_come_far) {
            return None;
        }
        Some(self.change(false))
    }

    /// Final content of the key file, when no more frames will be sent or accepted; `None` if the file needs no change.
    pub fn last_change(&mut self) -> Option<KeyChange> {
        (self.has_file && (self.key.is_some() || self.is_unsaved)).then(|| self.change(true))
    }

    fn change(&mut self, is_final: bool) -> KeyChange {
        self.is_unsaved = false;
        self.saved = self.local;
        // The final content also has to cover what may have been accepted before a kill.
        self.saved_accepted =
            if is_final { self.streams.newest_possible() } else { self.streams.newest() };
        let (timestamp, accepted) = (self.saved, self.saved_accepted);
        self.key.map_or(KeyChange::Forget, |key| {
            KeyChange::Keep(KeyRecord { key, timestamp, accepted, is_final })
        })
    }
}

/// A line for the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogLine {
    /// Signing was turned on or off.
    Turned(&'static str),
    Refused(String),
}

impl Service for Signing {
    /// Handles SETUP_SIGNING of a station on this computer. The key travels in clear, so one received over
    /// a network would be no secret. The autopilot never forwards or answers it.
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        let Message::SetupSigning(setup) = message else { return };
        if !shared.peers.is_local(from.peer) {
            let text = "SETUP_SIGNING refused: it may only come from this computer";
            return shared.texts.warn(now, text);
        }
        let outcome = self.set_up(setup, now);
        let text = match outcome {
            SetupOutcome::On if self.has_file => "Signing is on",
            SetupOutcome::On => "Signing is on until the end: there is no key file",
            SetupOutcome::StaysOn => "Signing stays on, with the same key",
            SetupOutcome::Off => "Signing is off",
            SetupOutcome::StaysOff => "Signing stays off",
            SetupOutcome::TimestampOutside => {
                let why = "SETUP_SIGNING refused: initial_timestamp is after 2103";
                return shared.texts.warn(now, why);
            }
            SetupOutcome::DayAhead => {
                let why = "SETUP_SIGNING refused: initial_timestamp is over a day ahead; is a clock wrong?";
                return shared.texts.warn(now, why);
            }
        };
        shared.texts.inform(now, text);
        if matches!(outcome, SetupOutcome::On | SetupOutcome::Off) {
            self.news = Some(text);
        }
    }

    /// Advances the local time to the calendar.
    fn poll(&mut self, now: WallTime, _: &mut Shared) {
        self.follow_calendar(now);
    }
}

impl Signing {
    /// One line for the log: signing was turned on or off, or refuses frames. Refusals go
    /// to the stations as well, at most every ten seconds for each kind.
    pub fn report(&mut self, now: WallTime) -> Option<LogLine> {
        if let Some(news) = self.news.take() {
            return Some(LogLine::Turned(news));
        }
        self.refusals.next_line(now).map(LogLine::Refused)
    }
}

/// Streams at the same time: more than twice the links that there can be.
pub const STREAMS_MAX: usize = 128;
/// How far a new stream may be behind the local time (the standard).
const BEHIND_MAX: Duration = Duration::from_secs(60);

/// Identity of a stream: link of the sender, system and component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stream {
    /// Link of the sender.
    pub link: u8,
    pub sender: Identity,
}

/// The streams received so far.
#[derive(Debug, Default)]
pub struct Streams {
    known: Vec<(Stream, Timestamp)>,
    /// Every timestamp up to here may have been accepted before the start of the process.
    floor: Timestamp,
    /// The newest accepted timestamp.
    newest: Timestamp,
}

impl Streams {
    /// No streams yet; refuses every timestamp up to `floor`. `newest` is the newest timestamp known to
    /// have been accepted before, at most `floor`.
    pub fn above(floor: Timestamp, newest: Timestamp) -> Self {
        Self { known: Vec::new(), floor, newest }
    }

    /// The newest accepted timestamp, including those before the start of the process.
    pub fn newest(&self) -> Timestamp {
        self.newest
    }

    /// The newest timestamp that may have been accepted, including those before the start of the process.
    pub fn newest_possible(&self) -> Timestamp {
        self.newest.max(self.floor)
    }

    /// Accepts the timestamp of a frame with a valid signature, or returns why it is refused. `local` is the local
    /// time.
    fn take(&mut self, stream: Stream, at: Timestamp, local: Timestamp) -> Result<(), Refusal> {
        if at > Timestamp::LATEST {
            return Err(Refusal::TooFarAhead);
        }
        let known = self.known.iter_mut().find(|(known, _)| *known == stream);
        if let Some((_, latest)) = known {
            if at <= *latest {
                return Err(Refusal::NotNewer);
            }
            *latest = at;
            self.newest = self.newest.max(at);
            return Ok(());
        }
        if at <= self.floor {
            return Err(Refusal::BeforeStart);
        }
        if at < local.minus(BEHIND_MAX) {
            return Err(Refusal::NewStreamTooOld);
        }
        if self.known.len() >= STREAMS_MAX {
            // A frame of such an old stream would be refused as that of a new one, too: forgetting the stream admits
            // nothing.
            self.known.retain(|(_, latest)| *latest >= local.minus(BEHIND_MAX));
        }
        if self.known.len() >= STREAMS_MAX {
            return Err(Refusal::TooManyStreams);
        }
        self.known.push((stream, at));
        self.newest = self.newest.max(at);
        Ok(())
    }
}

/// A kind is reported again after this, if there are new refusals.
const REPORT_INTERVAL: Duration = Duration::from_secs(10);

macro_rules! refusals {
    ($($(#[$doc:meta])* $kind:ident: $text:literal,)*) => {
        /// Why a frame is refused while signing is on.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Refusal {
            $($(#[$doc])* $kind,)*
        }

        impl Refusal {
            /// All kinds, in the order of their numbers.
            pub const ALL: [Self; [$($text),*].len()] = [$(Self::$kind),*];

            const fn described(self) -> &'static str {
                match self {
                    $(Self::$kind => $text,)*
                }
            }
        }
    };
}

refusals! {
    /// MAVLink 2 without a signature.
    Unsigned: "unsigned messages",
    /// MAVLink 1, which has no signatures.
    Version1: "MAVLink 1 messages",
    /// The signature is not that of this key and this frame.
    WrongSignature: "messages with a wrong signature (another key?)",
    /// Not newer than the last of its stream: doubled, reordered or replayed.
    NotNewer: "messages not newer than the last of their stream",
    /// First of its stream, and not newer than a timestamp that may have been accepted before the start of the process.
    BeforeStart: "messages from before the restart",
    /// First of its stream, and more than a minute behind.
    NewStreamTooOld: "a stream more than a minute behind",
    /// First of its stream, and there are too many already.
    TooManyStreams: "a new stream: there are too many",
    /// More than a day ahead of the local time, where the computer knows the date.
    DayAhead: "messages more than a day ahead (a wrong clock?)",
    /// In the last year of 48 bits.
    TooFarAhead: "messages from after 2103",
}

/// One kind: the number of refusals, how many of them were reported, and when.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    refused: u64,
    reported: u64,
    reported_at: WallTime,
}

/// Counts of refusals by kind.
#[derive(Debug, Default)]
pub struct Refusals([Count; Refusal::ALL.len()]);

impl Refusals {
    fn add(&mut self, refusal: Refusal) {
        self.0[refusal as usize].refused += 1;
    }

    /// Refusals of this kind since start.
    pub fn count(&self, refusal: Refusal) -> u64 {
        self.0[refusal as usize].refused
    }

    /// One line for a kind with new refusals, at most every ten seconds.
    fn next_line(&mut self, now: WallTime) -> Option<String> {
        let is_due = |count: &Count| {
            count.refused > count.reported
                && (count.reported == 0 || now.since(count.reported_at) >= REPORT_INTERVAL)
        };
        let (kind, count) =
            Refusal::ALL.into_iter().zip(&mut self.0).find(|(_, count)| is_due(count))?;
        count.reported = count.refused;
        count.reported_at = now;
        Some(format!("Signing refused {} ({} so far)", kind.described(), count.refused))
    }
}

#[cfg(test)]
mod tests;
