//! Signing of MAVLink 2: who may speak while it is on, and what is put behind every frame that is sent.
//!
//! ```text
//!  frame in ──> admit ──> services          frame out <── seal <── outbox
//!                 │  ^                                     │
//!              streams └────────── local time ─────────────┘ ──> key file
//! ```
//!
//! Off until a key comes, from the key file or by SETUP_SIGNING. `docs/signing.md` is for the operator.

use core::time::Duration;

use crate::codec::{Encoded, Frame, Identity, Message, SetupSigning};
use crate::wall_time::WallTime;
use crate::{From, Service, Shared};

mod key;
mod streams;

pub use key::{KEY, Key, KeyRecord, RecordError, Timestamp, Trailer};
pub use streams::{Refusal, Refusals, STREAMS_MAX, Stream, Streams};

use key::SAVE_EVERY;

/// SETUP_SIGNING carries the key: what records traffic must leave it out.
pub const SETUP_SIGNING: u32 = 256;
/// RADIO_STATUS: radios write it into the stream and have no key.
const RADIO_STATUS: u32 = 109;
/// How far ahead of the own time others may be where the computer knows the date. One wrong clock must not
/// carry the own time to where right clocks count as too old.
const AHEAD_MAX: Duration = Duration::from_secs(24 * 3600);

/// What becomes of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admission {
    /// It counts.
    Accepted,
    /// It may come unsigned. It is read, but does not make its sender a peer.
    Exempt,
    /// It does not count.
    Refused,
}

/// What is to become of the key file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyChange {
    /// It has this content.
    Keep(KeyRecord),
    /// It is not there.
    Forget,
}

/// What SETUP_SIGNING has done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SetupOutcome {
    /// Signing is on, with this key from now on.
    On,
    /// It was on with this key.
    StaysOn,
    /// Signing is off from now on.
    Off,
    /// It was off.
    StaysOff,
    /// The timestamp is outside what 48 bits can have; nothing has changed.
    TimestampOutside,
    /// The timestamp is more than a day ahead of the own time; nothing has changed.
    DayAhead,
}

/// Key, time and streams of the autopilot.
#[derive(Debug, Default)]
pub struct Signing {
    key: Option<Key>,
    /// UNIX time at [`WallTime::ZERO`], us.
    unix_start_us: Option<u64>,
    /// Own time: at least the calendar, the newest that was seen, and the last that was sent.
    local: Timestamp,
    streams: Streams,
    refusals: Refusals,
    /// There is a key file.
    has_file: bool,
    /// The key file does not have the present key.
    is_unsaved: bool,
    /// Own time when it was saved last.
    saved: Timestamp,
    /// Newest time that had been taken then.
    saved_accepted: Timestamp,
    /// Signing was turned on or off, and the log does not have it yet.
    news: Option<&'static str>,
}

impl Signing {
    /// Off. `unix_start_us` is UNIX time at the start of the process, us.
    #[must_use]
    pub fn new(unix_start_us: Option<u64>) -> Self {
        Self { unix_start_us, ..Self::default() }
    }

    /// With a key file, and what is in it: on, if that is a key.
    #[must_use]
    pub fn with_file(mut self, record: Option<KeyRecord>) -> Self {
        self.has_file = true;
        if let Some(record) = record {
            self.key = Some(record.key);
            self.local = self.local.max(record.resume_at());
            self.streams = Streams::above(record.floor(), record.accepted);
            // From now on the file marks its time as not the last one.
            self.is_unsaved = true;
        }
        self
    }

    /// Signing is on.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.key.is_some()
    }

    /// A key outlives the process.
    #[must_use]
    pub fn has_file(&self) -> bool {
        self.has_file
    }

    /// What was refused so far.
    #[must_use]
    pub fn refusals(&self) -> &Refusals {
        &self.refusals
    }

    /// Lets the own time follow the calendar.
    fn follow_calendar(&mut self, now: WallTime) {
        self.local = self.local.max(Timestamp::of_calendar(self.unix_start_us, now));
    }

    /// Whether a frame of another sender counts.
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

    /// The signature comes first: what is not signed rightly changes nothing.
    fn check(&mut self, key: Key, frame: &Frame<'_>) -> Result<(), Refusal> {
        if frame.is_version_1() {
            return Err(Refusal::Version1);
        }
        let (signed, trailer) = frame.signature().ok_or(Refusal::Unsigned)?;
        let trailer = Trailer(trailer);
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

    /// Nobody may be later.
    fn newest_allowed(&self) -> Timestamp {
        let knows_date = Timestamp::knows_date(self.unix_start_us);
        if knows_date { self.local.plus(AHEAD_MAX) } else { Timestamp::END }
    }

    /// The frame of a message of `sender` for the own link with this number, signed if signing is on.
    pub fn seal(&mut self, message: &Encoded, sender: Identity, sequence: u8, link: u8) -> Vec<u8> {
        let Some(key) = self.key else { return message.frame(sender, sequence) };
        // One time for all links: whoever is reached by two of them never sees it run backwards.
        self.local = self.local.next();
        message.signed_frame(sender, sequence, |frame| key.sign(frame, link, self.local))
    }

    /// Carries out SETUP_SIGNING, which has been admitted before.
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
        // Streams stay: what was taken once is not taken again, also when the same key comes back.
        let before = core::mem::replace(&mut self.key, setup.key);
        self.is_unsaved = true;
        match (before == setup.key, setup.key) {
            (false, Some(_)) => SetupOutcome::On,
            (true, Some(_)) => SetupOutcome::StaysOn,
            (false, None) => SetupOutcome::Off,
            (true, None) => SetupOutcome::StaysOff,
        }
    }

    /// What the key file should have now, if it is time to write it.
    pub fn pop_change(&mut self) -> Option<KeyChange> {
        let has_come_far = self.local >= self.saved.plus(SAVE_EVERY)
            || self.streams.newest() >= self.saved_accepted.plus(SAVE_EVERY);
        if !self.has_file || !(self.is_unsaved || self.is_on() && has_come_far) {
            return None;
        }
        Some(self.change(false))
    }

    /// What the key file has to have when nothing more will be sent or taken; `None` if it stays as it is.
    pub fn last_change(&mut self) -> Option<KeyChange> {
        (self.has_file && (self.is_on() || self.is_unsaved)).then(|| self.change(true))
    }

    fn change(&mut self, is_final: bool) -> KeyChange {
        self.is_unsaved = false;
        self.saved = self.local;
        // The last word has to cover what may have been taken before a kill, too.
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
    /// Something is refused.
    Refused(String),
}

impl Service for Signing {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        if let Message::SetupSigning(setup) = message {
            self.set_up_by(from, setup, now, shared);
        }
    }

    /// Lets the own time follow the calendar.
    fn poll(&mut self, now: WallTime, _: &mut Shared) {
        self.follow_calendar(now);
    }
}

impl Signing {
    /// Takes SETUP_SIGNING of a station on this computer. The key travels in clear, so one that came over
    /// a network would be no secret. It is never sent on and never answered.
    fn set_up_by(&mut self, from: From, setup: &SetupSigning, now: WallTime, shared: &mut Shared) {
        if !shared.peers.is_local(from.peer) {
            shared.texts.warn(now, "SETUP_SIGNING refused: it may only come from this computer");
            return;
        }
        let outcome = self.set_up(setup, now);
        let text = match outcome {
            SetupOutcome::On if self.has_file => "Signing is on",
            SetupOutcome::On => "Signing is on until the end: there is no key file",
            SetupOutcome::StaysOn => "Signing stays on, with the same key",
            SetupOutcome::Off => "Signing is off",
            SetupOutcome::StaysOff => "Signing stays off",
            SetupOutcome::TimestampOutside => {
                return shared
                    .texts
                    .warn(now, "SETUP_SIGNING refused: initial_timestamp is after 2103");
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

    /// One line for the log: signing was turned on or off, or refuses something. What it refuses is sent
    /// to the stations as well, at most every ten seconds for each kind.
    pub fn report(&mut self, now: WallTime) -> Option<LogLine> {
        if let Some(news) = self.news.take() {
            return Some(LogLine::Turned(news));
        }
        self.refusals.next_line(now).map(LogLine::Refused)
    }
}

#[cfg(test)]
mod tests;
