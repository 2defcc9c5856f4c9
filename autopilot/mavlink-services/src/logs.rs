//! The log service: LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END, LOG_ERASE.
//!
//! Logs are numbered 0, 1, 2 and so on by age, as in PX4: QGroundControl uses the
//! number as an index into its list. A number keeps its log until the ground station requests the list from
//! its beginning again.
//!
//! The process does the disk access: [`LogService::pop_job`] hands out one job at a time, and
//! [`LogService::handle_done`] receives its outcome.

use core::time::Duration;

use ::mavlink::dialects::common::{LOG_DATA_DATA, LOG_ENTRY_DATA, MavSeverity};
use arrayvec::ArrayVec;
use tracing::debug;

use crate::codec::{Encoded, LogRequest, Message};
use crate::peers::{From, Peer};
use crate::statustext::StatusTexts;
use crate::wall_time::WallTime;
use crate::{Service, Shared};

/// Ground stations at the same time. Another one replaces a station that fetches nothing, if there is one;
/// of several, the one without a request for longest.
const CLIENTS_MAX: usize = 16;
/// Time for one message, to all ground stations together: 0.9 MB/s.
const MESSAGE_TIME: Duration = Duration::from_micros(100);
/// The same for datagrams without flow control: 0.22 MB/s. MAVProxy accepts no more than 0.45 MB/s, and notices late
/// what it has lost.
const DATAGRAM_TIME: Duration = Duration::from_micros(400);
/// Shortest time between two bursts.
const BURST_INTERVAL: Duration = Duration::from_millis(1);
/// Longest time that a burst makes up for: a busy ground station would lose more.
const CATCH_UP_MAX: Duration = Duration::from_millis(4);
/// Retry interval while no station has room.
const RETRY: Duration = Duration::from_millis(5);
/// A station silent for this long receives nothing more.
const SILENCE: Duration = Duration::from_secs(60);

#[derive(Debug, Default)]
pub struct LogService {
    has_folder: bool,
    clients: Vec<LogClient>,
    latest_burst: WallTime,
    next_burst: WallTime,
    next_number: u64,
    /// The station that the disk serves next.
    turn: usize,
    erasing: Erasing,
}

/// Removal of all logs.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
enum Erasing {
    #[default]
    No,
    Requested,
    /// In progress, as the job with this number.
    Job(u64),
}

impl Service for LogService {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        let Message::Log(request) = *message else { return };
        if !self.has_folder {
            return answer_without_folder(from, request, now, shared);
        }
        match request {
            LogRequest::List { first, last } => {
                self.client(from.peer, now).request_entries(first, last);
            }
            LogRequest::Data { id, offset, count } => {
                self.client(from.peer, now).request_part(LogPart::new(id, offset, count));
            }
            LogRequest::End => self.client(from.peer, now).end(),
            LogRequest::Erase => {
                self.client(from.peer, now).forget();
                if self.erasing == Erasing::No {
                    self.erasing = Erasing::Requested;
                }
            }
        }
    }

    /// Sends what is due, and forgets stations that are gone.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        self.clients.retain(|client| shared.peers.knows(client.peer));
        if now < self.next_burst || !self.clients.iter().any(LogClient::is_ready) {
            return;
        }
        let takes_more =
            |client: &&LogClient| client.is_ready() && shared.peers.bulk_room(client.peer) > 0;
        let ready = self.clients.iter().filter(takes_more).count();
        if ready == 0 {
            self.next_burst = now + RETRY;
            return;
        }
        let elapsed = now.since(self.latest_burst).clamp(BURST_INTERVAL, CATCH_UP_MAX);
        self.latest_burst = now;
        let mut sent = false;
        for client in self.clients.iter_mut().filter(|client| client.is_ready()) {
            // UDP says nothing when the other end has gone.
            if client.is_fetching() && !shared.peers.is_present(client.peer, now, SILENCE) {
                client.end();
                continue;
            }
            let sets_pace = client.requests_pieces() || shared.peers.is_connection(client.peer);
            let time = if sets_pace { MESSAGE_TIME } else { DATAGRAM_TIME };
            let messages = elapsed.as_micros() / time.as_micros();
            // At least one message, so that many stations slow each other down and none stands still.
            let share = (usize::try_from(messages).unwrap_or(1) / ready).max(1);
            for _ in 0..share {
                if shared.peers.bulk_room(client.peer) == 0 {
                    break;
                }
                let Some(message) = client.next(now, &mut shared.texts) else { break };
                shared.peers.bulk(client.peer, message);
                sent = true;
            }
        }
        self.next_burst = now + if sent { BURST_INTERVAL } else { RETRY };
    }

    fn next_deadline(&self, _: &Shared) -> Option<WallTime> {
        self.clients.iter().any(LogClient::is_ready).then_some(self.next_burst)
    }
}

impl LogService {
    /// Enables the service: there is a folder with logs.
    pub fn open_folder(&mut self) {
        self.has_folder = true;
    }

    fn client(&mut self, peer: Peer, now: WallTime) -> &mut LogClient {
        let known = self.clients.iter().position(|client| client.peer == peer);
        let place = known.unwrap_or_else(|| {
            if self.clients.len() >= CLIENTS_MAX {
                let places = 0..self.clients.len();
                let oldest = places.min_by_key(|place| {
                    let client = &self.clients[*place];
                    (client.is_fetching(), client.last_seen)
                });
                self.clients.swap_remove(oldest.unwrap_or_default());
            }
            self.clients.push(LogClient::new(peer, now));
            self.clients.len() - 1
        });
        let client = &mut self.clients[place];
        client.last_seen = now;
        client
    }

    /// Next job for the disk. Call only while no job is running.
    pub fn pop_job(&mut self) -> Option<LogJob> {
        let number = self.next_number;
        // Before all reads: they would read what is to be erased.
        let job = if self.erasing == Erasing::Requested {
            self.erasing = Erasing::Job(number);
            LogJob { number, task: LogTask::Erase }
        } else {
            let count = self.clients.len();
            // By turns, so that a station with many requests does not keep the others from the disk.
            let mut places = (0..count).map(|i| (self.turn + i) % count);
            let (place, task) =
                places.find_map(|place| Some((place, self.clients[place].task()?)))?;
            self.turn = place + 1;
            let job = LogJob { number, task };
            self.clients[place].waiting = Some(job.clone());
            job
        };
        self.next_number += 1;
        Some(job)
    }

    /// Handles the outcome of a job. Its client may be gone.
    pub fn handle_done(&mut self, done: LogDone, now: WallTime, shared: &mut Shared) {
        if self.erasing == Erasing::Job(done.number) {
            self.erasing = Erasing::No;
            let (severity, text) = erased_text(&done);
            shared.texts.reply(severity, now, text);
            return;
        }
        let waits = |client: &&mut LogClient| {
            client.waiting.as_ref().is_some_and(|job| job.number == done.number)
        };
        let Some(client) = self.clients.iter_mut().find(waits) else { return };
        if let Err(problem) = client.take_done(done) {
            shared.texts.warn(now, problem);
        }
    }
}

fn answer_without_folder(from: From, request: LogRequest, now: WallTime, shared: &mut Shared) {
    match request {
        LogRequest::List { .. } => shared.peers.answer(from.peer, no_logs()),
        // An empty message marks the end; without it the station would wait and ask again.
        LogRequest::Data { id, offset, .. } => {
            shared.texts.warn(now, "There is no log folder (--log-dir)");
            shared.peers.answer(from.peer, data(id, offset, &[]));
        }
        LogRequest::Erase => shared.texts.warn(now, "There is no log folder (--log-dir)"),
        LogRequest::End => {}
    }
}

fn erased_text(done: &LogDone) -> (MavSeverity, String) {
    let erased = match &done.result {
        Ok(LogOutcome::Erased(erased)) => erased.clone(),
        Ok(_) => Erased::default(),
        Err(problem) => {
            return (MavSeverity::MAV_SEVERITY_WARNING, format!("Logs not erased: {problem}"));
        }
    };
    let Erased { removed, in_use, failed } = erased;
    let mut text = format!("{removed} {} erased", if removed == 1 { "log" } else { "logs" });
    if in_use > 0 {
        text += &format!(", {in_use} still written");
    }
    if failed > 0 {
        text += &format!(", {failed} could not be");
        return (MavSeverity::MAV_SEVERITY_WARNING, text);
    }
    (MavSeverity::MAV_SEVERITY_INFO, text)
}

/// One finished or growing log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogFile {
    /// Name of the file in the log folder.
    pub name: String,
    /// Bytes when it was listed; larger sizes saturate.
    pub size: u32,
    /// Time of its beginning, seconds since 1970, UTC.
    pub utc_s: u32,
}

/// A job, with the number of its outcome.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogJob {
    pub number: u64,
    pub task: LogTask,
}

/// Operation in the log folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogTask {
    /// List the logs, oldest first.
    List,
    /// Read a piece of one.
    Read {
        /// Name of the file.
        name: String,
        offset: u32,
        length: usize,
    },
    /// Remove all logs that are not being written.
    Erase,
}

/// Outcome of a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogDone {
    /// Number of the job.
    pub number: u64,
    /// Its outcome, or the error of the system.
    pub result: Result<LogOutcome, String>,
}

/// Result of a job.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogOutcome {
    /// The logs, oldest first.
    Listed(Vec<LogFile>),
    /// The bytes; fewer than requested where the file ends before.
    Read(Vec<u8>),
    /// Result of the removal.
    Erased(Erased),
}

/// Logs that were removed, and those that were not.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Erased {
    pub removed: usize,
    pub in_use: usize,
    /// Could not be removed.
    pub failed: usize,
}

/// Bytes of a log in one message.
const DATA: usize = 90;
/// Bytes read from the disk at once, a whole number of messages.
const BLOCK: usize = 728 * DATA;

/// Bytes read from the disk.
#[derive(Debug)]
struct LogBlock {
    name: String,
    offset: u32,
    bytes: Vec<u8>,
}

impl LogBlock {
    /// The bytes of this file from `offset` on; empty if `offset` is outside the block.
    fn rest(&self, name: &str, offset: u32) -> &[u8] {
        let at = offset.checked_sub(self.offset).filter(|_| self.name == name);
        let at = at.and_then(|at| usize::try_from(at).ok());
        at.and_then(|at| self.bytes.get(at..)).unwrap_or(&[])
    }
}

/// Requests of a ground station, and its progress.
#[derive(Debug)]
struct LogClient {
    peer: Peer,
    last_seen: WallTime,
    /// The job whose outcome it waits for.
    waiting: Option<LogJob>,
    /// The numbered logs: the index is the number.
    listing: Option<Vec<LogFile>>,
    needs_listing: bool,
    /// Numbers of the entries still to be sent.
    entries: Option<(u16, u16)>,
    /// The parts in the order of transmission; all belong to one log.
    parts: ArrayVec<LogPart, PARTS_MAX>,
    block: Option<LogBlock>,
}

impl LogClient {
    fn new(peer: Peer, last_seen: WallTime) -> Self {
        Self {
            peer,
            last_seen,
            waiting: None,
            listing: None,
            needs_listing: false,
            entries: None,
            parts: ArrayVec::new(),
            block: None,
        }
    }

    /// Requests the entries `first` to `last`. A request from the beginning reads the folder again;
    /// otherwise numbers keep their logs.
    fn request_entries(&mut self, first: u16, last: u16) {
        self.entries = Some((first, last));
        if first == 0 || self.listing.is_none() {
            self.request_listing();
        }
    }

    /// Requests a part of a log.
    fn request_part(&mut self, mut part: LogPart) {
        match &self.listing {
            Some(listing) => part.log = listing.get(usize::from(part.id)).cloned(),
            None => self.request_listing(),
        }
        add(&mut self.parts, part);
    }

    fn request_listing(&mut self) {
        if !self.needs_listing {
            self.needs_listing = true;
            // Parts still waiting are requested again after the listing.
            self.waiting = None;
        }
    }

    /// Ends all requests; the logs keep their numbers.
    fn end(&mut self) {
        self.parts.clear();
        self.entries = None;
        self.needs_listing = false;
        self.waiting = None;
        self.block = None;
    }

    /// Forgets the numbers too: the logs are gone.
    fn forget(&mut self) {
        self.end();
        self.listing = None;
    }

    /// It requests one piece after another, and so sets its own pace.
    fn requests_pieces(&self) -> bool {
        self.parts.first().is_some_and(|part| part.is_piece)
    }

    /// A part of a log is waiting.
    fn is_fetching(&self) -> bool {
        !self.parts.is_empty()
    }

    /// Next operation of the disk for this station.
    fn task(&self) -> Option<LogTask> {
        if self.waiting.is_some() {
            return None;
        }
        if self.needs_listing {
            return Some(LogTask::List);
        }
        let part = self.parts.first()?;
        let log = part.log.as_ref().filter(|log| part.offset < log.size && !part.is_gone)?;
        let is_there = self.block.as_ref();
        if part.is_over() || is_there.is_some_and(|b| !b.rest(&log.name, part.offset).is_empty()) {
            return None;
        }
        let end = part.end.min(u64::from(log.size));
        let length = usize::try_from(end - u64::from(part.offset)).unwrap_or(BLOCK).min(BLOCK);
        Some(LogTask::Read { name: log.name.clone(), offset: part.offset, length })
    }

    /// Handles the outcome of its job. `Err`: why the job failed.
    fn take_done(&mut self, done: LogDone) -> Result<(), String> {
        let Some(LogJob { task, .. }) = self.waiting.take() else { return Ok(()) };
        let problem = match (task, done.result) {
            (LogTask::List, Ok(LogOutcome::Listed(logs))) => {
                self.take_listing(logs);
                return Ok(());
            }
            (LogTask::Read { name, offset, length }, Ok(LogOutcome::Read(bytes))) => {
                // The system may give less than was asked for only where the file ends.
                if bytes.len() >= length {
                    self.block = Some(LogBlock { name, offset, bytes });
                    return Ok(());
                }
                self.lose(&name, "has become shorter")
            }
            (LogTask::List, result) => {
                // The station receives the answer that there are none.
                self.take_listing(Vec::new());
                format!("Logs: {}", result.err().unwrap_or_default())
            }
            (LogTask::Read { name, .. }, result) => {
                // The system's reason goes to the log only: as a text it would be split into chunks.
                let problem = result.err().unwrap_or_default();
                debug!(log = name, problem, "cannot be read");
                self.lose(&name, "is gone")
            }
            (LogTask::Erase, _) => return Ok(()),
        };
        Err(problem)
    }

    fn take_listing(&mut self, logs: Vec<LogFile>) {
        self.needs_listing = false;
        // Parts already resolved keep their log.
        for part in self.parts.iter_mut().filter(|part| part.log.is_none()) {
            part.log = logs.get(usize::from(part.id)).cloned();
        }
        self.listing = Some(logs);
    }

    /// Ends the transfer of a log that cannot be read any more: its first part gets the end mark, the others are dropped.
    /// Returns a text about it.
    fn lose(&mut self, name: &str, what: &str) -> String {
        let is_it = |part: &&mut LogPart| part.log.as_ref().is_some_and(|log| log.name == name);
        let Some(part) = self.parts.first_mut().filter(is_it) else {
            return format!("Log {name} {what}");
        };
        part.is_gone = true;
        let text = format!("Log {} {what}", part.id);
        self.parts.truncate(1);
        text
    }

    /// Something can be sent at once.
    fn is_ready(&self) -> bool {
        let is_open = self.entries.is_some() || self.is_fetching();
        is_open && !self.needs_listing && self.waiting.is_none() && self.task().is_none()
    }

    /// The next message; `None` if there is none, or if the disk has to read first.
    fn next(&mut self, now: WallTime, texts: &mut StatusTexts) -> Option<Encoded> {
        if self.needs_listing {
            return None;
        }
        self.next_entry(now, texts).or_else(|| self.next_data(now, texts))
    }

    fn next_entry(&mut self, now: WallTime, texts: &mut StatusTexts) -> Option<Encoded> {
        let (first, last) = self.entries?;
        let listing = self.listing.as_deref().unwrap_or_default();
        let count = u16::try_from(listing.len()).unwrap_or(u16::MAX);
        let Some(highest) = count.checked_sub(1) else {
            self.entries = None;
            return Some(no_logs());
        };
        let log = listing.get(usize::from(first)).filter(|_| first <= last);
        let Some(log) = log else {
            self.entries = None;
            texts.warn(now, format!("Logs {first} to {last}: there are 0 to {highest}"));
            return None;
        };
        self.entries = (first < last.min(highest)).then_some((first + 1, last));
        Some(Encoded::new(&LOG_ENTRY_DATA {
            time_utc: log.utc_s,
            size: log.size,
            id: first,
            num_logs: count,
            last_log_num: highest,
        }))
    }

    fn next_data(&mut self, now: WallTime, texts: &mut StatusTexts) -> Option<Encoded> {
        let part = self.parts.first_mut()?;
        let (id, offset) = (part.id, part.offset);
        let Some(log) = &part.log else {
            texts.warn(now, format!("Log {id}: there is no such log"));
            self.parts.pop_at(0);
            return Some(data(id, offset, &[]));
        };
        if offset >= log.size || part.is_over() || part.is_gone {
            // An empty message marks the end of the log.
            self.parts.pop_at(0);
            return Some(data(id, offset, &[]));
        }
        let rest = self.block.as_ref()?.rest(&log.name, offset);
        let length = usize::try_from(part.end - u64::from(offset)).unwrap_or(DATA);
        let bytes = rest.get(..length.min(DATA)).unwrap_or(rest);
        if bytes.is_empty() {
            return None;
        }
        let message = data(id, offset, bytes);
        part.offset += u32::try_from(bytes.len()).unwrap_or_default();
        // A full message does not show that it is the last one: an empty one follows.
        let is_last = bytes.len() < DATA && part.offset >= log.size;
        if part.is_over() || is_last {
            self.parts.pop_at(0);
        }
        Some(message)
    }
}

/// The LOG_ENTRY for "there are no logs", or the station waits for more.
fn no_logs() -> Encoded {
    Encoded::new(&LOG_ENTRY_DATA::DEFAULT)
}

/// One LOG_DATA, at most 90 bytes.
fn data(id: u16, ofs: u32, bytes: &[u8]) -> Encoded {
    let mut data = [0; DATA];
    let count = bytes.len().min(DATA);
    data[..count].copy_from_slice(&bytes[..count]);
    Encoded::new(&LOG_DATA_DATA { ofs, id, count: u8::try_from(count).unwrap_or_default(), data })
}

/// Parts that may wait: MAVProxy requests twenty gaps in a row.
const PARTS_MAX: usize = 24;

/// A station that requests no more than this at once requests the next piece after receiving this one.
const PIECE: u32 = 64 * 1024;

/// A part of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
struct LogPart {
    /// Number of the log, as the ground station knows it.
    id: u16,
    /// The log, once it is resolved.
    log: Option<LogFile>,
    /// The log is gone, or shorter than it was.
    is_gone: bool,
    offset: u32,
    /// First byte beyond the request; may be beyond the end of the log.
    end: u64,
    /// One of several that are requested one after the other.
    is_piece: bool,
}

impl LogPart {
    fn new(id: u16, offset: u32, count: u32) -> Self {
        let end = u64::from(offset) + u64::from(count);
        Self { id, log: None, is_gone: false, offset, end, is_piece: count <= PIECE }
    }

    /// All of it has been sent.
    fn is_over(&self) -> bool {
        u64::from(self.offset) >= self.end
    }

    fn overlaps(&self, other: &Self) -> bool {
        u64::from(self.offset) < other.end && u64::from(other.offset) < self.end
    }
}

/// Adds a new request. A request for another log, or for bytes that are already queued, replaces all
/// that waits: the ground station has restarted. Gaps elsewhere in the same log wait behind.
fn add(parts: &mut ArrayVec<LogPart, PARTS_MAX>, part: LogPart) {
    if parts.iter().any(|old| old.id != part.id || old.overlaps(&part)) {
        parts.clear();
    }
    // A station that misses a part requests it again.
    let _ = parts.try_push(part);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offsets(parts: &[LogPart]) -> Vec<u32> {
        parts.iter().map(|part| part.offset).collect()
    }

    #[test]
    fn gaps_of_one_log_wait_behind_each_other_and_a_new_beginning_replaces_them() {
        let mut parts = ArrayVec::new();
        for gap in 0..20 {
            add(&mut parts, LogPart::new(0, gap * 900, 90));
        }
        assert_eq!(offsets(&parts).len(), 20);
        add(&mut parts, LogPart::new(0, 90, 1_000_000));
        assert_eq!(offsets(&parts), [90], "it covers what waited");
        add(&mut parts, LogPart::new(1, 5_000_000, 90));
        assert_eq!(offsets(&parts), [5_000_000], "another log");
        for gap in 0..1000 {
            add(&mut parts, LogPart::new(1, gap * 90, 90));
        }
        assert_eq!(offsets(&parts).len(), PARTS_MAX);
        add(&mut parts, LogPart::new(1, u32::MAX, u32::MAX));
        assert!(!parts.first().unwrap().is_over());
    }
}
