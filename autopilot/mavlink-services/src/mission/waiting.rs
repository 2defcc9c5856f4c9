//! Commands whose outcome is still open.

use core::time::Duration;
use std::sync::Arc;

use super::notes::Notes;
use super::wire::Stored;
use crate::codec::ListKind;
use crate::context::From;
use crate::wall_time::WallTime;

/// Commands that may be open at the same time.
const WAITING_MAX: usize = 32;
/// After this time the service answers that there was no outcome. It still takes one that comes later.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);

/// What was requested.
#[derive(Debug)]
pub enum What {
    /// Another plan.
    Plan {
        /// As it was sent.
        stored: Arc<Stored>,
        /// What to tell when it is in force.
        notes: Notes,
    },
    /// Another current item.
    Current(u16),
    /// Another place or altitude, by an item.
    Guided,
}

/// An open command.
#[derive(Debug)]
pub struct Waiting {
    /// Number of the intent.
    pub number: u32,
    /// Who asked.
    pub from: From,
    /// List to acknowledge; `None`: nobody waits for an acknowledgement, or not any more.
    pub list: Option<ListKind>,
    /// What.
    pub what: What,
    since: WallTime,
    overdue: bool,
}

/// The open commands, oldest first.
#[derive(Debug, Default)]
pub struct WaitingList(Vec<Waiting>);

impl WaitingList {
    /// One more command can be kept.
    #[must_use]
    pub fn has_room(&self) -> bool {
        self.0.iter().filter(|waiting| !waiting.overdue).count() < WAITING_MAX
    }

    /// Keeps a command. One that never had an outcome makes room.
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

    /// Somebody who waits for a plan to take force.
    pub fn plan_of(&mut self, from: From) -> Option<&mut Waiting> {
        self.0.iter_mut().find(|waiting| {
            waiting.from == from
                && waiting.list.is_some()
                && matches!(waiting.what, What::Plan { .. })
        })
    }

    /// The next command that has become overdue: who waits, and the list to acknowledge.
    pub fn next_overdue(&mut self, now: WallTime) -> Option<(From, Option<ListKind>)> {
        let waiting = self
            .0
            .iter_mut()
            .find(|waiting| !waiting.overdue && now.since(waiting.since) >= ANSWER_TIMEOUT)?;
        waiting.overdue = true;
        Some((waiting.from, waiting.list.take()))
    }

    /// When the next command becomes overdue.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        let open = self.0.iter().filter(|waiting| !waiting.overdue);
        open.map(|waiting| waiting.since + ANSWER_TIMEOUT).min()
    }
}
