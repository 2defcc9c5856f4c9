//! The log service: LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END, LOG_ERASE.
//!
//! Logs are numbered 0, 1, 2 and so on by age, as in PX4: QGroundControl uses the
//! number as an index into its list. A number keeps its log until the ground station requests the list from
//! its beginning again.
//!
//! The process does the disk access: [`LogService::pop_job`] hands out one job at a time, and
//! [`LogService::handle_done`] receives its outcome.

use core::time::Duration;

use ::mavlink::dialects::common::MavSeverity;

use crate::codec::{LogRequest, Message};
use crate::logs::client::{Client, Part};
use crate::peers::{From, Peer};
use crate::wall_time::WallTime;
use crate::{Service, Shared};

mod client;

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
    clients: Vec<Client>,
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
                self.client(from.peer, now).request_part(Part::new(id, offset, count));
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
        if now < self.next_burst || !self.clients.iter().any(Client::is_ready) {
            return;
        }
        let takes_more =
            |client: &&Client| client.is_ready() && shared.peers.bulk_room(client.peer) > 0;
        let ready = self.clients.iter().filter(takes_more).count();
        if ready == 0 {
            self.next_burst = now + RETRY;
            return;
        }
        let elapsed = now.since(self.latest_burst).clamp(BURST_INTERVAL, CATCH_UP_MAX);
        self.latest_burst = now;
        let mut sent = false;
        for client in self.clients.iter_mut().filter(|client| client.is_ready()) {
            if client.is_fetching() && !shared.peers.is_present(client.peer, now, SILENCE) {
                client.end();
                continue;
            }
            let sets_pace = client.requests_pieces() || shared.peers.is_connection(client.peer);
            let time = if sets_pace { MESSAGE_TIME } else { DATAGRAM_TIME };
            let messages = elapsed.as_micros() / time.as_micros();
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
        self.clients.iter().any(Client::is_ready).then_some(self.next_burst)
    }
}

impl LogService {
    /// Enables the service: there is a folder with logs.
    pub fn open_folder(&mut self) {
        self.has_folder = true;
    }

    fn client(&mut self, peer: Peer, now: WallTime) -> &mut Client {
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
            self.clients.push(Client::new(peer, now));
            self.clients.len() - 1
        });
        let client = &mut self.clients[place];
        client.last_seen = now;
        client
    }

    /// Next job for the disk. Call only while no job is running.
    pub fn pop_job(&mut self) -> Option<LogJob> {
        let number = self.next_number;
        let job = if self.erasing == Erasing::Requested {
            self.erasing = Erasing::Job(number);
            LogJob { number, task: LogTask::Erase }
        } else {
            let count = self.clients.len();
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
        let waits = |client: &&mut Client| {
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
        LogRequest::List { .. } => shared.peers.answer(from.peer, client::no_logs()),
        LogRequest::Data { id, offset, .. } => {
            shared.texts.warn(now, "There is no log folder (--log-dir)");
            shared.peers.answer(from.peer, client::data(id, offset, &[]));
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
