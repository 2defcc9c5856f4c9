//! One ground station that lists or downloads logs, and the parts of logs that it waits for.

use ::mavlink::dialects::common::{LOG_DATA_DATA, LOG_ENTRY_DATA};
use arrayvec::ArrayVec;
use tracing::debug;

use crate::codec::Encoded;
use crate::logs::{LogDone, LogFile, LogJob, LogOutcome, LogTask};
use crate::peers::Peer;
use crate::statustext::StatusTexts;
use crate::wall_time::WallTime;

/// Bytes of a log in one message.
pub(super) const DATA: usize = 90;
/// Bytes read from the disk at once, a whole number of messages.
pub(super) const BLOCK: usize = 728 * DATA;

/// Bytes read from the disk.
#[derive(Debug)]
struct Block {
    name: String,
    offset: u32,
    bytes: Vec<u8>,
}

impl Block {
    /// The bytes of this file from `offset` on; empty if `offset` is outside the block.
    fn rest(&self, name: &str, offset: u32) -> &[u8] {
        let at = offset.checked_sub(self.offset).filter(|_| self.name == name);
        let at = at.and_then(|at| usize::try_from(at).ok());
        at.and_then(|at| self.bytes.get(at..)).unwrap_or(&[])
    }
}

/// Requests of a ground station, and its progress.
#[derive(Debug)]
pub(super) struct Client {
    pub peer: Peer,
    pub last_seen: WallTime,
    /// The job whose outcome it waits for.
    pub waiting: Option<LogJob>,
    /// The numbered logs: the index is the number.
    listing: Option<Vec<LogFile>>,
    needs_listing: bool,
    /// Numbers of the entries still to be sent.
    entries: Option<(u16, u16)>,
    ranges: Ranges,
    block: Option<Block>,
}

impl Client {
    pub fn new(peer: Peer, last_seen: WallTime) -> Self {
        Self {
            peer,
            last_seen,
            waiting: None,
            listing: None,
            needs_listing: false,
            entries: None,
            ranges: Ranges::default(),
            block: None,
        }
    }

    /// Requests the entries `first` to `last`. A request from the beginning reads the folder again;
    /// otherwise numbers keep their logs.
    pub fn request_entries(&mut self, first: u16, last: u16) {
        self.entries = Some((first, last));
        if first == 0 || self.listing.is_none() {
            self.request_listing();
        }
    }

    /// Requests a part of a log.
    pub fn request_part(&mut self, mut part: Part) {
        match &self.listing {
            Some(listing) => part.log = listing.get(usize::from(part.id)).cloned(),
            None => self.request_listing(),
        }
        self.ranges.add(part);
    }

    fn request_listing(&mut self) {
        if !self.needs_listing {
            self.needs_listing = true;
            // Parts still waiting are requested again after the listing.
            self.waiting = None;
        }
    }

    /// Ends all requests; the logs keep their numbers.
    pub fn end(&mut self) {
        self.ranges.clear();
        self.entries = None;
        self.needs_listing = false;
        self.waiting = None;
        self.block = None;
    }

    /// Forgets the numbers too: the logs are gone.
    pub fn forget(&mut self) {
        self.end();
        self.listing = None;
    }

    /// It requests one piece after another, and so sets its own pace.
    pub fn requests_pieces(&self) -> bool {
        self.ranges.first().is_some_and(|part| part.is_piece)
    }

    /// A part of a log is waiting.
    pub fn is_fetching(&self) -> bool {
        !self.ranges.is_empty()
    }

    /// Next operation of the disk for this station.
    pub fn task(&self) -> Option<LogTask> {
        if self.waiting.is_some() {
            return None;
        }
        if self.needs_listing {
            return Some(LogTask::List);
        }
        let part = self.ranges.first()?;
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
    pub fn take_done(&mut self, done: LogDone) -> Result<(), String> {
        let Some(LogJob { task, .. }) = self.waiting.take() else { return Ok(()) };
        let problem = match (task, done.result) {
            (LogTask::List, Ok(LogOutcome::Listed(logs))) => {
                self.take_listing(logs);
                return Ok(());
            }
            (LogTask::Read { name, offset, length }, Ok(LogOutcome::Read(bytes))) => {
                if bytes.len() >= length {
                    self.block = Some(Block { name, offset, bytes });
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
        self.ranges.resolve(&logs);
        self.listing = Some(logs);
    }

    /// Ends the transfer of a log that cannot be read any more: the waiting station gets the end mark. Returns a text about it.
    fn lose(&mut self, name: &str, what: &str) -> String {
        match self.ranges.lose(name) {
            Some(id) => format!("Log {id} {what}"),
            None => format!("Log {name} {what}"),
        }
    }

    /// Something can be sent at once.
    pub fn is_ready(&self) -> bool {
        let is_open = self.entries.is_some() || self.is_fetching();
        is_open && !self.needs_listing && self.waiting.is_none() && self.task().is_none()
    }

    /// The next message; `None` if there is none, or if the disk has to read first.
    pub fn next(&mut self, now: WallTime, texts: &mut StatusTexts) -> Option<Encoded> {
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
        let part = self.ranges.first_mut()?;
        let (id, offset) = (part.id, part.offset);
        let Some(log) = &part.log else {
            texts.warn(now, format!("Log {id}: there is no such log"));
            self.ranges.drop_first();
            return Some(data(id, offset, &[]));
        };
        if offset >= log.size || part.is_over() || part.is_gone {
            // An empty message marks the end of the log.
            self.ranges.drop_first();
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
        let is_last = bytes.len() < DATA && part.offset >= log.size;
        if part.is_over() || is_last {
            self.ranges.drop_first();
        }
        Some(message)
    }
}

/// The LOG_ENTRY for "there are no logs", or the station waits for more.
pub(super) fn no_logs() -> Encoded {
    Encoded::new(&LOG_ENTRY_DATA::DEFAULT)
}

/// One LOG_DATA, at most 90 bytes.
pub(super) fn data(id: u16, ofs: u32, bytes: &[u8]) -> Encoded {
    let mut data = [0; DATA];
    let count = bytes.len().min(DATA);
    data[..count].copy_from_slice(&bytes[..count]);
    Encoded::new(&LOG_DATA_DATA { ofs, id, count: u8::try_from(count).unwrap_or_default(), data })
}

/// Parts that may wait: MAVProxy requests twenty gaps in a row.
pub(super) const PARTS_MAX: usize = 24;

/// A station that requests no more than this at once requests the next piece after receiving this one.
const PIECE: u32 = 64 * 1024;

/// A part of a log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    /// Number of the log, as the ground station knows it.
    pub id: u16,
    /// The log, once it is resolved.
    pub log: Option<LogFile>,
    /// The log is gone, or shorter than it was.
    pub is_gone: bool,
    pub offset: u32,
    /// First byte beyond the request; may be beyond the end of the log.
    pub end: u64,
    /// One of several that are requested one after the other.
    pub is_piece: bool,
}

impl Part {
    pub fn new(id: u16, offset: u32, count: u32) -> Self {
        let end = u64::from(offset) + u64::from(count);
        Self { id, log: None, is_gone: false, offset, end, is_piece: count <= PIECE }
    }

    /// All of it has been sent.
    pub fn is_over(&self) -> bool {
        u64::from(self.offset) >= self.end
    }

    fn overlaps(&self, other: &Self) -> bool {
        u64::from(self.offset) < other.end && u64::from(other.offset) < self.end
    }
}

/// Parts in the order of transmission.
#[derive(Debug, Default)]
pub(super) struct Ranges {
    parts: ArrayVec<Part, PARTS_MAX>,
}

impl Ranges {
    /// Adds a new request. A request for another log, or for bytes that are already queued, replaces all
    /// that waits: the ground station has restarted. Gaps elsewhere in the same log wait behind.
    pub fn add(&mut self, part: Part) {
        let restarts = |old: &Part| old.id != part.id || old.overlaps(&part);
        if self.parts.iter().any(restarts) {
            self.parts.clear();
        }
        // A station that misses a part requests it again.
        let _ = self.parts.try_push(part);
    }

    pub fn clear(&mut self) {
        self.parts.clear();
    }

    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    pub fn first(&self) -> Option<&Part> {
        self.parts.first()
    }

    pub fn first_mut(&mut self) -> Option<&mut Part> {
        self.parts.first_mut()
    }

    /// The log is gone: its first part ends the download, and the others are dropped. All parts belong to
    /// one log. Returns its number, if it is this log.
    pub fn lose(&mut self, name: &str) -> Option<u16> {
        let part = self.parts.first_mut()?;
        part.log.as_ref().filter(|log| log.name == name)?;
        part.is_gone = true;
        let id = part.id;
        self.parts.truncate(1);
        Some(id)
    }

    /// The first part has been sent.
    pub fn drop_first(&mut self) {
        if !self.parts.is_empty() {
            self.parts.remove(0);
        }
    }

    /// Resolves the numbers to logs; parts already resolved keep their log.
    pub fn resolve(&mut self, listing: &[LogFile]) {
        for part in self.parts.iter_mut().filter(|part| part.log.is_none()) {
            part.log = listing.get(usize::from(part.id)).cloned();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn offsets(ranges: &Ranges) -> Vec<u32> {
        ranges.parts.iter().map(|part| part.offset).collect()
    }

    #[test]
    fn gaps_of_one_log_wait_behind_each_other_and_a_new_beginning_replaces_them() {
        let mut ranges = Ranges::default();
        for gap in 0..20 {
            ranges.add(Part::new(0, gap * 900, 90));
        }
        assert_eq!(offsets(&ranges).len(), 20);
        ranges.add(Part::new(0, 90, 1_000_000));
        assert_eq!(offsets(&ranges), [90], "it covers what waited");
        ranges.add(Part::new(1, 5_000_000, 90));
        assert_eq!(offsets(&ranges), [5_000_000], "another log");
        for gap in 0..1000 {
            ranges.add(Part::new(1, gap * 90, 90));
        }
        assert_eq!(offsets(&ranges).len(), PARTS_MAX);
        ranges.add(Part::new(1, u32::MAX, u32::MAX));
        assert!(!ranges.first().unwrap().is_over());
    }
}
