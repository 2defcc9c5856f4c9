//! The log service: LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END, LOG_ERASE.
//!
//! Logs have the numbers 0, 1, 2 and so on by their age, as PX4 counts them: QGroundControl takes the
//! number for a place in its list. A number keeps its log until the ground station asks for the list from
//! its beginning again.
//!
//! The disk belongs to somebody else: a job goes out by [`LogService::pop_job`], one at a time, and its
//! outcome comes back by [`LogService::handle_done`].

use core::time::Duration;

use ::mavlink::dialects::common::MavSeverity;

use super::codec::LogRequest;
use super::context::{Context, From};
use super::peers::{Peer, Peers};
use super::statustext::StatusTexts;
use crate::wall_time::WallTime;
use client::Client;
use ranges::Part;

mod client;
mod job;
mod ranges;

pub use job::{Erased, LogDone, LogFile, LogJob, LogOutcome, LogTask};

/// Ground stations at the same time. One more takes the place of one that fetches nothing, if there is one, and
/// of several the one that has asked for nothing for longest.
const CLIENTS_MAX: usize = 16;
/// Time for one message, to all ground stations together: 0.9 MB/s.
const MESSAGE_TIME: Duration = Duration::from_micros(100);
/// The same for datagrams without an end: 0.22 MB/s. MAVProxy takes no more than 0.45 MB/s, and learns late of
/// what it has lost.
const DATAGRAM_TIME: Duration = Duration::from_micros(400);
/// Shortest time between two bursts.
const BURST_INTERVAL: Duration = Duration::from_millis(1);
/// Longest time that a burst makes up for: more at once would be lost by a ground station that is busy.
const CATCH_UP_MAX: Duration = Duration::from_millis(4);
/// If nobody could take anything, it is tried again after this.
const RETRY: Duration = Duration::from_millis(5);
/// Whoever has not been heard for this long gets nothing more.
const SILENCE: Duration = Duration::from_secs(60);

/// Gives logs.
#[derive(Debug, Default)]
pub struct LogService {
    has_folder: bool,
    clients: Vec<Client>,
    latest_burst: WallTime,
    next_burst: WallTime,
    next_number: u64,
    /// Who is served by the disk next.
    turn: usize,
    erasing: Erasing,
}

/// Removing all logs.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
enum Erasing {
    #[default]
    No,
    Wanted,
    /// Under way, as the job with this number.
    Job(u64),
}

impl LogService {
    /// From now on there is a folder with logs.
    pub fn open_folder(&mut self) {
        self.has_folder = true;
    }

    /// Takes one request.
    pub fn handle(
        &mut self,
        from: From,
        request: LogRequest,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        if !self.has_folder {
            return answer_without_folder(from, request, now, ctx.texts, out);
        }
        match request {
            LogRequest::List { first, last } => {
                self.client(from.peer, now).ask_entries(first, last);
            }
            LogRequest::Data { id, offset, count } => {
                self.client(from.peer, now).ask_part(Part::new(id, offset, count));
            }
            LogRequest::End => self.client(from.peer, now).end(),
            LogRequest::Erase => {
                self.client(from.peer, now).forget();
                if self.erasing == Erasing::No {
                    self.erasing = Erasing::Wanted;
                }
            }
        }
    }

    fn client(&mut self, peer: Peer, now: WallTime) -> &mut Client {
        let known = self.clients.iter().position(|client| client.peer == peer);
        let place = known.unwrap_or_else(|| {
            if self.clients.len() >= CLIENTS_MAX {
                let places = 0..self.clients.len();
                let oldest = places.min_by_key(|place| {
                    let client = &self.clients[*place];
                    (client.is_fetching(), client.heard)
                });
                self.clients.swap_remove(oldest.unwrap_or_default());
            }
            self.clients.push(Client::new(peer, now));
            self.clients.len() - 1
        });
        let client = &mut self.clients[place];
        client.heard = now;
        client
    }

    /// What the disk has to do next. To be called when it has nothing to do.
    pub fn pop_job(&mut self) -> Option<LogJob> {
        let number = self.next_number;
        let job = if self.erasing == Erasing::Wanted {
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

    /// Takes what became of a job. Nobody may want it any more.
    pub fn handle_done(&mut self, done: LogDone, now: WallTime, ctx: &mut Context) {
        if self.erasing == Erasing::Job(done.number) {
            self.erasing = Erasing::No;
            let (severity, text) = erased_text(&done);
            ctx.texts.reply(severity, now, text);
            return;
        }
        let waits = |client: &&mut Client| {
            client.waiting.as_ref().is_some_and(|job| job.number == done.number)
        };
        let Some(client) = self.clients.iter_mut().find(waits) else { return };
        if let Err(problem) = client.take_done(done) {
            ctx.texts.refuse(now, problem);
        }
    }

    /// Sends what is due, and forgets who is gone.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context, out: &mut Peers) {
        self.clients.retain(|client| out.knows(client.peer));
        if now < self.next_burst || !self.clients.iter().any(Client::is_ready) {
            return;
        }
        let takes_more = |client: &&Client| client.is_ready() && out.bulk_room(client.peer) > 0;
        let ready = self.clients.iter().filter(takes_more).count();
        if ready == 0 {
            self.next_burst = now + RETRY;
            return;
        }
        let elapsed = now.since(self.latest_burst).clamp(BURST_INTERVAL, CATCH_UP_MAX);
        self.latest_burst = now;
        let mut sent = false;
        for client in self.clients.iter_mut().filter(|client| client.is_ready()) {
            if client.is_fetching() && !out.was_heard(client.peer, now, SILENCE) {
                client.end();
                continue;
            }
            let sets_pace = client.asks_in_pieces() || out.is_connection(client.peer);
            let time = if sets_pace { MESSAGE_TIME } else { DATAGRAM_TIME };
            let messages = elapsed.as_micros() / time.as_micros();
            let share = (usize::try_from(messages).unwrap_or(1) / ready).max(1);
            for _ in 0..share {
                if out.bulk_room(client.peer) == 0 {
                    break;
                }
                let Some(message) = client.next(now, ctx.texts) else { break };
                out.bulk(client.peer, message);
                sent = true;
            }
        }
        self.next_burst = now + if sent { BURST_INTERVAL } else { RETRY };
    }

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        self.clients.iter().any(Client::is_ready).then_some(self.next_burst)
    }
}

fn answer_without_folder(
    from: From,
    request: LogRequest,
    now: WallTime,
    texts: &mut StatusTexts,
    out: &mut Peers,
) {
    match request {
        LogRequest::List { .. } => out.answer(from.peer, client::no_logs()),
        LogRequest::Data { id, offset, .. } => {
            texts.refuse(now, "There is no log folder (--log-dir)");
            out.answer(from.peer, client::data(id, offset, &[]));
        }
        LogRequest::Erase => texts.refuse(now, "There is no log folder (--log-dir)"),
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
