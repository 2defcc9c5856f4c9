//! More ground stations than there are places, for the log.
//!
//! Whoever gets no place may try again without end, so each kind is reported at its first time and at each
//! doubling.

use std::net::SocketAddr;

use tracing::warn;

use mavlink_services::peers::{CONNECTIONS_MAX, Crowding, VISITORS_MAX};

/// What was reported so far.
#[derive(Debug, Default)]
pub(super) struct Crowd {
    /// Connections closed again since there were too many.
    refused: u64,
    crowding: Crowding,
}

impl Crowd {
    /// A connection was closed again since there were too many.
    pub(super) fn refuse(&mut self, from: SocketAddr) {
        self.refused += 1;
        if self.refused.is_power_of_two() {
            warn!(
                %from,
                limit = CONNECTIONS_MAX,
                refused = self.refused,
                "a ground-station connection was refused: there are too many"
            );
        }
    }

    /// Reports what is new since the last call, of which there is one for each datagram.
    pub(super) fn follow(&mut self, now: Crowding) {
        let before = std::mem::replace(&mut self.crowding, now);
        let is_news = |count: u64, before: u64| count != before && count.is_power_of_two();
        let Crowding { displaced, turned_away } = now;
        if is_news(displaced, before.displaced) {
            warn!(
                limit = VISITORS_MAX,
                displaced, "a ground station lost its place to another one: too many call by UDP"
            );
        }
        if is_news(turned_away, before.turned_away) {
            warn!(
                limit = VISITORS_MAX,
                turned_away,
                "messages of a ground station were ignored: too many call by UDP; TCP and --gcs have places of their own"
            );
        }
    }
}
