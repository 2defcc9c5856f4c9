//! An upload under way: item after item is asked for, until they are all here.

use core::time::Duration;

use super::draft::Draft;
use super::wire;
use crate::codec::Encoded;
use crate::context::From;
use crate::wall_time::WallTime;

/// An item that does not come is asked for again after this. Ground stations wait half a second to one and
/// a half, and then send the item before once more.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(1);
/// Requests for one item, the first one included, until the upload is given up.
const TRIES_MAX: u32 = 5;
/// An item that is not the next one leads to a new request, but not more often than this: every copy of an
/// item would lead to a copy of all that follow.
const AGAIN: Duration = Duration::from_millis(200);

/// An upload.
#[derive(Debug)]
pub struct Upload {
    /// Who uploads.
    pub from: From,
    /// What has come.
    pub draft: Draft,
    asked: WallTime,
    tries: u32,
    as_int: bool,
}

impl Upload {
    /// Nothing has come, and the first item was not asked for.
    #[must_use]
    pub fn new(from: From, draft: Draft) -> Self {
        Self { from, draft, asked: WallTime::ZERO, tries: 0, as_int: true }
    }

    /// The request for the next item.
    #[must_use]
    pub fn request(&mut self, now: WallTime) -> Encoded {
        self.asked = now;
        self.tries += 1;
        wire::request(self.draft.next(), self.as_int, self.from.sender)
    }

    /// The request for the item after one that has come.
    #[must_use]
    pub fn request_next(&mut self, now: WallTime) -> Encoded {
        self.tries = 0;
        self.request(now)
    }

    /// The request once more, since something else came; `None` if it has just been sent.
    #[must_use]
    pub fn request_again(&mut self, now: WallTime) -> Option<Encoded> {
        (now.since(self.asked) >= AGAIN).then(|| {
            self.asked = now;
            wire::request(self.draft.next(), self.as_int, self.from.sender)
        })
    }

    /// The ground station does not know the request: the other one of the two.
    #[must_use]
    pub fn request_otherwise(&mut self, now: WallTime) -> Encoded {
        self.as_int = !self.as_int;
        self.request(now)
    }

    /// When the request will be sent once more, or the upload given up.
    #[must_use]
    pub fn deadline(&self) -> WallTime {
        self.asked + REQUEST_TIMEOUT
    }

    /// The next item was asked for often enough.
    #[must_use]
    pub fn is_hopeless(&self) -> bool {
        self.tries >= TRIES_MAX
    }
}
