//! The peers: the configured addresses, always; every address that sends a datagram, until it falls silent; every
//! client that opens a connection, until it is closed.
//!
//! The numbers of visitors (peers that came by themselves over UDP) and of connections are limited. When all places are taken, a
//! new one gets the place of a silent one. Among visitors that all send it gets the newest place: a crowd that arrives
//! later displaces no earlier visitor that is still sending.

use core::time::Duration;
use std::net::SocketAddr;

use crate::codec::{Encoded, Identity};
use crate::queues::{ANSWERS_RESERVED, Inbox, Outbox};
use crate::signing::Signing;
use crate::traffic::Traffic;
use crate::wall_time::WallTime;

pub const CONFIGURED_MAX: usize = 8;
/// Visitors at the same time: peers that came by themselves over UDP.
pub const VISITORS_MAX: usize = 24;
/// Connections at the same time.
pub const CONNECTIONS_MAX: usize = 16;
/// A visitor that has been silent for this long is forgotten.
const SILENCE: Duration = Duration::from_secs(10);
/// When all places are taken, a peer that has been silent for this long loses its place to a new one: three
/// heartbeats of a ground station, at 1 Hz.
const QUIET: Duration = Duration::from_secs(3);
/// One that has not yet sent for this long loses it after being silent for this long: longer than between two heartbeats.
const PROBATION: Duration = Duration::from_millis(1_500);
/// The newest visitor keeps its place at least this long, so that two visitors that compete for it can each fetch a
/// parameter list.
const STAY_MIN: Duration = Duration::from_secs(10);

/// Number of a connection, never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Connection(pub u32);

/// Address of a peer, and the socket that reaches it. The same address by two sockets is two peers,
/// each with its own sequence numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Address {
    /// By the UDP socket from which the autopilot calls ground stations.
    UdpClient(SocketAddr),
    /// By the UDP port that ground stations call.
    UdpServer(SocketAddr),
    /// By a TCP connection that a ground station has opened.
    Tcp(Connection),
}

impl Address {
    /// Bytes arrive as a stream, and silence has no meaning: closing ends the connection.
    pub const fn is_connection(self) -> bool {
        matches!(self, Self::Tcp(_))
    }

    /// A UDP address of this computer. For a connection the number has no meaning.
    pub fn is_loopback(self) -> bool {
        match self {
            Self::UdpClient(at) | Self::UdpServer(at) => is_this_computer(at),
            Self::Tcp(_) => false,
        }
    }
}

/// Whether an address is a loopback address. The operating system accepts no packet with such an address from
/// a network.
pub fn is_this_computer(at: SocketAddr) -> bool {
    at.ip().to_canonical().is_loopback()
}

/// A peer, for as long as it is known. Never reused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Peer(u32);

/// Sender of a message, and the link that it came over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct From {
    pub peer: Peer,
    /// System and component of the sender.
    pub sender: Identity,
}

#[derive(Debug)]
struct PeerEntry {
    peer: Peer,
    address: Address,
    /// Number of the link in signatures: the lowest free one, fixed for as long as the peer is
    /// known.
    link: u8,
    /// The peer is on this computer.
    is_local: bool,
    configured: bool,
    since: WallTime,
    /// A good frame has arrived; a connection may be opened without any.
    has_sent: bool,
    last_seen: WallTime,
    /// Used by connections only.
    inbox: Inbox,
    outbox: Outbox,
}

impl PeerEntry {
    fn can_fall_silent(&self) -> bool {
        !self.configured && !self.address.is_connection()
    }

    /// It has been sending for some time.
    fn is_settled(&self) -> bool {
        self.last_seen.since(self.since) >= PROBATION
    }

    /// There is room for the answers to one more message.
    fn has_room(&self) -> bool {
        self.outbox.room() >= ANSWERS_RESERVED
    }

    /// A new peer may have its place.
    fn is_quiet(&self, now: WallTime) -> bool {
        let allowed = if self.is_settled() { QUIET } else { PROBATION };
        !self.has_sent || now.since(self.last_seen) >= allowed
    }
}

/// The peers and the messages waiting for each.
#[derive(Debug)]
pub struct Peers {
    entries: Vec<PeerEntry>,
    next: u32,
    crowding: Crowding,
}

/// Counts of visitors beyond the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Crowding {
    /// Visitors that lost their place to a new one.
    pub displaced: u64,
    /// Messages of new visitors that got no place.
    pub turned_away: u64,
}

impl Peers {
    /// The configured addresses, at most [`CONFIGURED_MAX`]; those beyond are left out.
    pub fn new(configured: &[Address]) -> Self {
        let mut peers = Self { entries: Vec::new(), next: 0, crowding: Crowding::default() };
        for &address in configured.iter().take(CONFIGURED_MAX) {
            peers.add(address, address.is_loopback(), true, WallTime::ZERO);
        }
        peers
    }

    fn add(&mut self, address: Address, is_local: bool, configured: bool, now: WallTime) -> Peer {
        let peer = Peer(self.next);
        self.next = self.next.wrapping_add(1);
        let is_free = |link: &u8| self.entries.iter().all(|entry| entry.link != *link);
        // There are far fewer peers than numbers.
        let link = (0..=u8::MAX).find(is_free).unwrap_or(u8::MAX);
        self.entries.push(PeerEntry {
            peer,
            address,
            link,
            is_local,
            configured,
            since: now,
            // A frame makes a UDP peer. A connection may be opened and say nothing.
            has_sent: !address.is_connection(),
            last_seen: now,
            inbox: Inbox::default(),
            outbox: Outbox::default(),
        });
        peer
    }

    /// Handles a good frame from `address`. `None` if no other peer gives up its place, or if it is a
    /// connection that is not open.
    pub fn receive(&mut self, address: Address, now: WallTime) -> Option<Peer> {
        if let Some(entry) = self.entries.iter_mut().find(|entry| entry.address == address) {
            entry.last_seen = now;
            return Some(entry.peer);
        }
        if address.is_connection() {
            return None;
        }
        let is_local = address.is_loopback();
        let peer = self.admit(address, is_local, now).or_else(|| {
            self.displace(now)?;
            self.admit(address, is_local, now)
        });
        self.crowding.turned_away += u64::from(peer.is_none());
        peer
    }

    /// The peer that gives its place to a new one first: one that never sent, then one that did not send for long, then one
    /// that has been silent for long; of several the one that has been silent for longest.
    fn quietest(&self, among: impl Fn(&PeerEntry) -> bool, now: WallTime) -> Option<&PeerEntry> {
        let quiet = self.entries.iter().filter(|entry| among(entry) && entry.is_quiet(now));
        // `false` is less than `true`: who never sent comes first.
        quiet.min_by_key(|entry| (entry.has_sent, entry.is_settled(), entry.last_seen))
    }

    /// The connection to close so that another one can be opened; `None` if all are sending.
    pub fn quiet_connection(&self, now: WallTime) -> Option<Connection> {
        match self.quietest(|entry| entry.address.is_connection(), now)?.address {
            Address::Tcp(connection) => Some(connection),
            Address::UdpClient(_) | Address::UdpServer(_) => None,
        }
    }

    /// Takes the place of one visitor: of a quiet one, or else of the newest. `None` if all are sending and the newest has
    /// not had its place for long.
    fn displace(&mut self, now: WallTime) -> Option<()> {
        let quiet = self.quietest(PeerEntry::can_fall_silent, now);
        let visitors = self.entries.iter().filter(|entry| entry.can_fall_silent());
        let newest = visitors.max_by_key(|entry| entry.since);
        // A crowd that all sends moves nobody but its own last member.
        let stayed = || newest.filter(|entry| now.since(entry.since) >= STAY_MIN);
        let leaves = quiet.or_else(stayed)?.peer;
        self.entries.retain(|entry| entry.peer != leaves);
        self.crowding.displaced += 1;
        Some(())
    }

    /// Adds an opened connection, from this computer or another one. `None` if there are too many.
    pub fn open(&mut self, connection: Connection, is_local: bool, now: WallTime) -> Option<Peer> {
        self.admit(Address::Tcp(connection), is_local, now)
    }

    /// Adds a peer that was not configured, if there is room for another one of its kind.
    fn admit(&mut self, address: Address, is_local: bool, now: WallTime) -> Option<Peer> {
        let is_connection = address.is_connection();
        let most = if is_connection { CONNECTIONS_MAX } else { VISITORS_MAX };
        let alike = |entry: &&PeerEntry| {
            !entry.configured && entry.address.is_connection() == is_connection
        };
        let has_room = self.entries.iter().filter(alike).count() < most;
        has_room.then(|| self.add(address, is_local, false, now))
    }

    /// Removes the peer of a closed connection, with all that waits for it.
    pub fn close(&mut self, connection: Connection) {
        self.entries.retain(|entry| entry.address != Address::Tcp(connection));
    }

    /// Forgets the visitors that have been silent for too long.
    pub fn poll(&mut self, now: WallTime) {
        self.entries
            .retain(|entry| !entry.can_fall_silent() || now.since(entry.last_seen) < SILENCE);
    }

    /// When the next silent peer will be forgotten.
    pub fn next_deadline(&self) -> Option<WallTime> {
        let visitors = self.entries.iter().filter(|entry| entry.can_fall_silent());
        visitors.map(|entry| entry.last_seen + SILENCE).min()
    }

    /// Whether `peer` is still known.
    pub fn knows(&self, peer: Peer) -> bool {
        self.entries.iter().any(|entry| entry.peer == peer)
    }

    /// Whether `peer` is on this computer.
    pub fn is_local(&self, peer: Peer) -> bool {
        self.entries.iter().any(|entry| entry.peer == peer && entry.is_local)
    }

    /// Whether there is room for the answers to one more message of `peer`.
    pub fn can_answer(&mut self, peer: Peer) -> bool {
        self.room(peer) >= ANSWERS_RESERVED
    }

    /// Records a good frame of a peer with an open connection.
    pub fn has_sent(&mut self, peer: Peer, now: WallTime) {
        if let Some(entry) = self.entries.iter_mut().find(|entry| entry.peer == peer) {
            (entry.has_sent, entry.last_seen) = (true, now);
        }
    }

    /// The peer at the other end of `connection`, and the bytes received from it.
    pub fn inbox(&mut self, connection: Connection) -> Option<(Peer, &mut Inbox)> {
        let address = Address::Tcp(connection);
        let mut entries = self.entries.iter_mut();
        let entry = entries.find(|entry| entry.address == address)?;
        Some((entry.peer, &mut entry.inbox))
    }

    /// Whether to read from `connection`: earlier input is handled, and there is room for answers.
    pub fn accepts_input(&self, connection: Connection) -> bool {
        let address = Address::Tcp(connection);
        let mut entries = self.entries.iter().filter(|entry| entry.address == address);
        entries.any(|entry| !entry.inbox.held && entry.has_room())
    }

    /// A connection whose input waited for room, and now has it.
    pub fn next_resumable(&self) -> Option<Connection> {
        self.entries.iter().find_map(|entry| match entry.address {
            Address::Tcp(connection) => {
                (entry.inbox.held && entry.has_room()).then_some(connection)
            }
            _ => None,
        })
    }

    fn outbox(&mut self, peer: Peer) -> Option<&mut Outbox> {
        self.entries.iter_mut().find(|entry| entry.peer == peer).map(|entry| &mut entry.outbox)
    }

    /// Answers that still fit into the queue of `peer`; none if it is gone.
    pub fn room(&mut self, peer: Peer) -> usize {
        self.outbox(peer).map_or(0, |outbox| outbox.room())
    }

    /// Queues an answer to one peer; dropped if the peer is gone.
    pub fn answer(&mut self, peer: Peer, message: Encoded) {
        if let Some(outbox) = self.outbox(peer) {
            outbox.answer(message);
        }
    }

    /// Bulk data that still fits into the queue of `peer`; none if it is gone.
    pub fn bulk_room(&mut self, peer: Peer) -> usize {
        self.outbox(peer).map_or(0, |outbox| outbox.bulk_room())
    }

    /// Queues bulk data to one peer, for which there must be room.
    pub fn bulk(&mut self, peer: Peer, message: Encoded) {
        if let Some(outbox) = self.outbox(peer) {
            outbox.bulk(message);
        }
    }

    /// Whether `peer` is at the other end of a connection, where data arrive or wait, but are not lost.
    pub fn is_connection(&self, peer: Peer) -> bool {
        self.entries.iter().any(|entry| entry.peer == peer && entry.address.is_connection())
    }

    /// Whether `peer` has an open connection or sent something less than `silence` ago.
    pub fn is_present(&self, peer: Peer, now: WallTime, silence: Duration) -> bool {
        self.entries.iter().any(|entry| {
            let is_present = entry.address.is_connection() || now.since(entry.last_seen) < silence;
            entry.peer == peer && is_present
        })
    }

    /// Queues a message that every peer must get: heartbeats, texts, changed parameters.
    pub fn announce(&mut self, message: &Encoded) {
        let message = message.for_many();
        for entry in &mut self.entries {
            entry.outbox.announce(message.clone());
        }
    }

    /// Whether at least one peer has room for so many announcements, or there is no peer.
    pub fn can_announce(&self, count: usize) -> bool {
        let has_room = |entry: &PeerEntry| entry.outbox.room() >= ANSWERS_RESERVED + count;
        self.entries.is_empty() || self.entries.iter().any(has_room)
    }

    pub fn all(&self) -> impl Iterator<Item = Peer> + '_ {
        self.entries.iter().map(|entry| entry.peer)
    }

    /// Queues telemetry for one peer; dropped if the peer is gone.
    pub fn stream_to(&mut self, peer: Peer, message: Encoded) {
        if let Some(outbox) = self.outbox(peer) {
            outbox.stream(message);
        }
    }

    /// Queues telemetry for every peer.
    pub fn stream(&mut self, message: &Encoded) {
        let message = message.for_many();
        for entry in &mut self.entries {
            entry.outbox.stream(message.clone());
        }
    }

    /// Next frame and its destination, among the peers that can receive now; answers to all go
    /// before telemetry to any. `signing` signs it, if it is on, and `traffic` records it.
    pub fn pop(
        &mut self,
        sender: Identity,
        signing: &mut Signing,
        traffic: &mut Traffic,
        can_send: impl Fn(Address) -> bool,
    ) -> Option<(Address, Vec<u8>)> {
        let mut ready = self.entries.iter_mut().filter(|entry| can_send(entry.address));
        let mut chosen: Option<&mut PeerEntry> = None;
        let entry = loop {
            match ready.next() {
                Some(entry) if entry.outbox.has_answer() => break entry,
                // Goes on: another peer may still have an answer.
                Some(entry) if chosen.is_none() && entry.outbox.has_any() => chosen = Some(entry),
                Some(_) => {}
                None => break chosen?,
            }
        };
        let (message, sequence) = entry.outbox.pop()?;
        traffic.record_sent(&message, sender);
        Some((entry.address, signing.seal(&message, sender, sequence, entry.link)))
    }

    /// Counts of visitors beyond the limit so far.
    pub fn crowding(&self) -> Crowding {
        self.crowding
    }

    /// Messages to the present peers dropped so far: telemetry, announcements, answers.
    pub fn dropped(&self) -> [u64; 3] {
        let sum =
            |count: fn(&Outbox) -> u64| self.entries.iter().map(|entry| count(&entry.outbox)).sum();
        [
            sum(|outbox| outbox.dropped_telemetry),
            sum(|outbox| outbox.dropped_announcements),
            sum(|outbox| outbox.dropped_answers),
        ]
    }
}

#[cfg(test)]
mod tests;
