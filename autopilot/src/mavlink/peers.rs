//! Who listens: the configured addresses, always, and whoever sends to the socket, until they fall silent.

use core::time::Duration;
use std::net::SocketAddr;

use super::codec::Encoded;
use super::outbox::Outbox;
use crate::clock::WallTime;

/// Peers at the same time, configured ones included.
const PEERS_MAX: usize = 16;
/// A peer that came by itself and has been silent for this long is forgotten.
const SILENCE: Duration = Duration::from_secs(10);

/// A peer, for as long as it is known. Never used twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Peer(u32);

#[derive(Debug)]
struct Entry {
    peer: Peer,
    address: SocketAddr,
    configured: bool,
    heard: WallTime,
    outbox: Outbox,
}

/// The peers and what waits to be sent to each.
#[derive(Debug)]
pub struct Peers {
    entries: Vec<Entry>,
    next: u32,
    turned_away: u64,
}

impl Peers {
    /// The configured addresses; those beyond the limit are left out.
    #[must_use]
    pub fn new(configured: &[SocketAddr]) -> Self {
        let mut peers = Self { entries: Vec::with_capacity(PEERS_MAX), next: 0, turned_away: 0 };
        for &address in configured.iter().take(PEERS_MAX) {
            peers.add(address, true, WallTime::ZERO);
        }
        peers
    }

    fn add(&mut self, address: SocketAddr, configured: bool, heard: WallTime) -> Peer {
        let peer = Peer(self.next);
        self.next = self.next.wrapping_add(1);
        self.entries.push(Entry { peer, address, configured, heard, outbox: Outbox::default() });
        peer
    }

    /// A good frame came from `address`. `None` if there is no room for one more peer.
    pub fn hear(&mut self, address: SocketAddr, now: WallTime) -> Option<Peer> {
        if let Some(entry) = self.entries.iter_mut().find(|entry| entry.address == address) {
            entry.heard = now;
            return Some(entry.peer);
        }
        if self.entries.len() >= PEERS_MAX {
            self.turned_away += 1;
            return None;
        }
        Some(self.add(address, false, now))
    }

    /// Forgets who has been silent for too long.
    pub fn poll(&mut self, now: WallTime) {
        self.entries.retain(|entry| entry.configured || now.since(entry.heard) < SILENCE);
    }

    /// When the next silent peer will be forgotten.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        let visitors = self.entries.iter().filter(|entry| !entry.configured);
        visitors.map(|entry| entry.heard + SILENCE).min()
    }

    /// Whether `peer` is still known.
    #[must_use]
    pub fn knows(&self, peer: Peer) -> bool {
        self.entries.iter().any(|entry| entry.peer == peer)
    }

    fn outbox(&mut self, peer: Peer) -> Option<&mut Outbox> {
        self.entries.iter_mut().find(|entry| entry.peer == peer).map(|entry| &mut entry.outbox)
    }

    /// Answers that still fit into the queue of `peer`; none if it is gone.
    pub fn room(&mut self, peer: Peer) -> usize {
        self.outbox(peer).map_or(0, |outbox| outbox.room())
    }

    /// An answer to one peer; nobody gets it if the peer is gone.
    pub fn answer(&mut self, peer: Peer, message: Encoded) {
        if let Some(outbox) = self.outbox(peer) {
            outbox.answer(message);
        }
    }

    /// Something that every peer must get: heartbeats, texts, changed parameters.
    pub fn announce(&mut self, message: &Encoded) {
        for entry in &mut self.entries {
            entry.outbox.answer(message.clone());
        }
    }

    /// Telemetry for every peer.
    pub fn stream(&mut self, message: &Encoded) {
        for entry in &mut self.entries {
            entry.outbox.stream(message.clone());
        }
    }

    /// Next datagram and its destination; answers of all peers go before telemetry of any.
    pub fn pop(&mut self) -> Option<(SocketAddr, Vec<u8>)> {
        let answers_first = |entry: &&mut Entry| entry.outbox.has_answer();
        let entry = match self.entries.iter_mut().find(answers_first) {
            Some(entry) => entry,
            None => self.entries.iter_mut().find(|entry| entry.outbox.has_any())?,
        };
        entry.outbox.pop().map(|frame| (entry.address, frame))
    }

    /// Peers turned away because the table was full.
    #[must_use]
    pub fn turned_away(&self) -> u64 {
        self.turned_away
    }

    /// Messages dropped so far: telemetry, answers.
    #[must_use]
    pub fn dropped(&self) -> (u64, u64) {
        self.entries.iter().fold((0, 0), |(telemetry, answers), entry| {
            let outbox = &entry.outbox;
            (telemetry + outbox.dropped_telemetry(), answers + outbox.dropped_answers())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    fn seconds(s: u64) -> WallTime {
        WallTime::from_micros(s * 1_000_000)
    }

    #[test]
    fn configured_peers_stay_and_silent_visitors_are_forgotten() {
        let mut peers = Peers::new(&[address(14_550)]);
        let known = peers.hear(address(14_550), seconds(0)).unwrap();
        let visitor = peers.hear(address(9_000), seconds(0)).unwrap();
        peers.hear(address(9_000), seconds(5)).unwrap();
        peers.poll(seconds(14));
        assert!(peers.knows(visitor));
        assert_eq!(peers.next_deadline(), Some(seconds(15)));
        peers.poll(seconds(15));
        assert!(!peers.knows(visitor));
        assert!(peers.knows(known));
        assert_ne!(peers.hear(address(9_000), seconds(16)), Some(visitor), "a new peer");
    }

    #[test]
    fn the_table_is_bounded() {
        let mut peers = Peers::new(&[]);
        let let_in =
            (1..=100).filter(|port| peers.hear(address(*port), seconds(0)).is_some()).count();
        assert_eq!(let_in, PEERS_MAX);
        assert_eq!(peers.turned_away(), 100 - PEERS_MAX as u64);
    }
}
