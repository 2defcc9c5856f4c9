//! Uploads and downloads in progress, and the commands whose outcome is still open.

use core::time::Duration;
use std::sync::Arc;

use crate::codec::{Encoded, ListKind};
use crate::mission::draft::Draft;
use crate::mission::fields::Notes;
use crate::mission::wire;
use crate::mission::wire::Stored;
use crate::peers::From;
use crate::wall_time::WallTime;

/// A missing item is requested again after this time. Ground stations wait half a second to one and
/// a half, and then repeat the previous item.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(1);
/// Requests for one item, including the first, before the upload is given up.
const TRIES_MAX: u32 = 5;
/// An item out of order leads to a new request, but not more often than this: otherwise every copy of an
/// item would lead to a copy of all that follow.
const AGAIN: Duration = Duration::from_millis(200);

#[derive(Debug)]
pub struct Upload {
    pub from: From,
    pub draft: Draft,
    requested_at: WallTime,
    tries: u32,
    as_int: bool,
}

impl Upload {
    /// No item has arrived, and the first was never requested.
    pub fn new(from: From, draft: Draft) -> Self {
        Self { from, draft, requested_at: WallTime::ZERO, tries: 0, as_int: true }
    }

    /// The request for the next item.
    pub fn request(&mut self, now: WallTime) -> Encoded {
        self.requested_at = now;
        self.tries += 1;
        wire::request(self.draft.next(), self.as_int, self.from.sender)
    }

    /// The request for the item after the one just received.
    pub fn request_next(&mut self, now: WallTime) -> Encoded {
        self.tries = 0;
        self.request(now)
    }

    /// The request once more, after another item has arrived; `None` if it has just been sent.
    pub fn request_again(&mut self, now: WallTime) -> Option<Encoded> {
        (now.since(self.requested_at) >= AGAIN).then(|| {
            self.requested_at = now;
            wire::request(self.draft.next(), self.as_int, self.from.sender)
        })
    }

    /// The ground station does not know the request: use the other one of the two.
    pub fn request_otherwise(&mut self, now: WallTime) -> Encoded {
        self.as_int = !self.as_int;
        self.request(now)
    }

    /// When to repeat the request, or to give up the upload.
    pub fn deadline(&self) -> WallTime {
        self.requested_at + REQUEST_TIMEOUT
    }

    /// The next item was requested as often as allowed.
    pub fn is_hopeless(&self) -> bool {
        self.tries >= TRIES_MAX
    }
}

/// Downloads at the same time; the one with the oldest request makes room.
const DOWNLOADS_MAX: usize = 16;
/// A download is over after this long without a request.
const DOWNLOAD_TIMEOUT: Duration = Duration::from_secs(10);

#[derive(Debug)]
struct Download {
    from: From,
    plan: Arc<Stored>,
    requested_at: WallTime,
}

/// The downloads under way.
#[derive(Debug, Default)]
pub struct Downloads(Vec<Download>);

impl Downloads {
    /// Records that a station requests the list.
    pub fn begin(&mut self, from: From, plan: &Arc<Stored>, now: WallTime) {
        self.end(from);
        if self.0.len() >= DOWNLOADS_MAX {
            let oldest =
                self.0.iter().enumerate().min_by_key(|(_, download)| download.requested_at);
            if let Some((place, _)) = oldest {
                self.0.swap_remove(place);
            }
        }
        self.0.push(Download { from, plan: Arc::clone(plan), requested_at: now });
    }

    /// The plan that a station downloads; `None` if it has no download.
    pub fn plan(&mut self, from: From, now: WallTime) -> Option<Arc<Stored>> {
        self.0.retain(|download| now.since(download.requested_at) < DOWNLOAD_TIMEOUT);
        let download = self.0.iter_mut().find(|download| download.from == from)?;
        download.requested_at = now;
        Some(Arc::clone(&download.plan))
    }

    /// The station has the whole list, or has cancelled.
    pub fn end(&mut self, from: From) {
        self.0.retain(|download| download.from != from);
    }
}

/// Commands that may be open at the same time.
const WAITING_MAX: usize = 32;
/// After this time the service answers that there was no outcome. It still handles an outcome that arrives later.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);

/// Request of an open command.
#[derive(Debug)]
pub enum What {
    Plan {
        /// The plan as uploaded.
        stored: Arc<Stored>,
        /// What to report when it takes effect.
        notes: Notes,
    },
    Current(u16),
    /// Another place or altitude, by an item.
    Guided,
}

#[derive(Debug)]
pub struct Waiting {
    /// Number of the intent.
    pub number: u32,
    /// Station that requested it.
    pub from: From,
    /// List to acknowledge; `None`: no station waits for an acknowledgement.
    pub list: Option<ListKind>,
    pub what: What,
    since: WallTime,
    overdue: bool,
}

/// The open commands, oldest first.
#[derive(Debug, Default)]
pub struct WaitingList(Vec<Waiting>);

impl WaitingList {
    /// There is room for another command.
    pub fn has_room(&self) -> bool {
        self.0.iter().filter(|waiting| !waiting.overdue).count() < WAITING_MAX
    }

    /// Adds a command. One that never had an outcome makes room.
    pub fn keep(
        &mut self,
        number: u32,
        from: From,
        list: Option<ListKind>,
        what: What,
        now: WallTime,
    ) {
        if self.0.len() >= WAITING_MAX
            && let Some(oldest) = self.0.iter().position(|waiting| waiting.overdue)
        {
            self.0.remove(oldest);
        }
        self.0.push(Waiting { number, from, list, what, since: now, overdue: false });
    }

    /// The command with this number.
    pub fn take(&mut self, number: u32) -> Option<Waiting> {
        let place = self.0.iter().position(|waiting| waiting.number == number)?;
        Some(self.0.remove(place))
    }

    /// A station that waits for a plan to take effect.
    pub fn plan_of(&mut self, from: From) -> Option<&mut Waiting> {
        self.0.iter_mut().find(|waiting| {
            waiting.from == from
                && waiting.list.is_some()
                && matches!(waiting.what, What::Plan { .. })
        })
    }

    /// The next overdue command: the waiting station, and the list to acknowledge.
    pub fn next_overdue(&mut self, now: WallTime) -> Option<(From, Option<ListKind>)> {
        let waiting = self
            .0
            .iter_mut()
            .find(|waiting| !waiting.overdue && now.since(waiting.since) >= ANSWER_TIMEOUT)?;
        waiting.overdue = true;
        Some((waiting.from, waiting.list.take()))
    }

    /// When the next command becomes overdue.
    pub fn next_deadline(&self) -> Option<WallTime> {
        let open = self.0.iter().filter(|waiting| !waiting.overdue);
        open.map(|waiting| waiting.since + ANSWER_TIMEOUT).min()
    }
}
