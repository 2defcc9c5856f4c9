//! Who listens: the configured addresses, always; whoever sends a datagram, until it falls silent; whoever
//! opens a connection, until it is closed.

use core::time::Duration;
use std::net::SocketAddr;

use super::codec::Encoded;
use super::inbox::Inbox;
use super::outbox::{ANSWERS_RESERVED, Outbox};
use super::signing::Signing;
use crate::clock::WallTime;

/// Configured addresses.
pub const CONFIGURED_MAX: usize = 8;
/// Peers at the same time that came by themselves over UDP.
pub const VISITORS_MAX: usize = 24;
/// Connections at the same time.
pub const CONNECTIONS_MAX: usize = 16;
/// A peer that came by itself over UDP and has been silent for this long is forgotten.
const SILENCE: Duration = Duration::from_secs(10);

/// Number of a connection, never used twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Connection(pub u32);

/// Where a peer is, and by which of our sockets it is reached. The same place by two sockets is two peers,
/// each with its own sequence numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Address {
    /// By the UDP socket that calls ground stations.
    UdpClient(SocketAddr),
    /// By the UDP port for ground stations that call.
    UdpServer(SocketAddr),
    /// By a TCP connection that a ground station has opened.
    Tcp(Connection),
}

impl Address {
    /// Bytes come as a stream, and silence means nothing: the connection says when it ends.
    #[must_use]
    pub const fn is_connection(self) -> bool {
        matches!(self, Self::Tcp(_))
    }

    /// A UDP address of this computer. Of a connection the number says nothing.
    #[must_use]
    pub fn is_loopback(self) -> bool {
        match self {
            Self::UdpClient(at) | Self::UdpServer(at) => is_this_computer(at),
            Self::Tcp(_) => false,
        }
    }
}

/// Whether an address is one of this computer alone. The system lets nothing with such an address in from
/// a network.
#[must_use]
pub fn is_this_computer(at: SocketAddr) -> bool {
    at.ip().to_canonical().is_loopback()
}

/// A peer, for as long as it is known. Never used twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Peer(u32);

#[derive(Debug)]
struct Entry {
    peer: Peer,
    address: Address,
    /// Number of the link in signatures: the lowest that nobody has, and its own for as long as the peer is
    /// known.
    link: u8,
    /// On this computer.
    is_local: bool,
    configured: bool,
    heard: WallTime,
    /// Used by connections only.
    inbox: Inbox,
    outbox: Outbox,
}

impl Entry {
    fn can_fall_silent(&self) -> bool {
        !self.configured && !self.address.is_connection()
    }
}

/// The peers and what waits to be sent to each.
#[derive(Debug)]
pub struct Peers {
    entries: Vec<Entry>,
    next: u32,
    turned_away: u64,
}

impl Peers {
    /// The configured addresses, at most [`CONFIGURED_MAX`]; those beyond are left out.
    #[must_use]
    pub fn new(configured: &[Address]) -> Self {
        let mut peers = Self { entries: Vec::new(), next: 0, turned_away: 0 };
        for &address in configured.iter().take(CONFIGURED_MAX) {
            peers.add(address, address.is_loopback(), true, WallTime::ZERO);
        }
        peers
    }

    fn add(&mut self, address: Address, is_local: bool, configured: bool, heard: WallTime) -> Peer {
        let peer = Peer(self.next);
        self.next = self.next.wrapping_add(1);
        let is_free = |link: &u8| self.entries.iter().all(|entry| entry.link != *link);
        // There are far fewer peers than numbers.
        let link = (0..=u8::MAX).find(is_free).unwrap_or(u8::MAX);
        self.entries.push(Entry {
            peer,
            address,
            link,
            is_local,
            configured,
            heard,
            inbox: Inbox::default(),
            outbox: Outbox::default(),
        });
        peer
    }

    /// A good frame came from `address`. `None` if there is no room for one more peer, or if it is a
    /// connection that is not open.
    pub fn hear(&mut self, address: Address, now: WallTime) -> Option<Peer> {
        if let Some(entry) = self.entries.iter_mut().find(|entry| entry.address == address) {
            entry.heard = now;
            return Some(entry.peer);
        }
        if address.is_connection() {
            return None;
        }
        let peer = self.admit(address, address.is_loopback(), VISITORS_MAX, now);
        self.turned_away += u64::from(peer.is_none());
        peer
    }

    /// A connection was opened, from this computer or another one. `None` if there are too many.
    pub fn open(&mut self, connection: Connection, is_local: bool, now: WallTime) -> Option<Peer> {
        self.admit(Address::Tcp(connection), is_local, CONNECTIONS_MAX, now)
    }

    /// Adds a peer that came by itself, if fewer than `most` of its kind are known.
    fn admit(
        &mut self,
        address: Address,
        is_local: bool,
        most: usize,
        now: WallTime,
    ) -> Option<Peer> {
        let is_connection = address.is_connection();
        let alike =
            |entry: &&Entry| !entry.configured && entry.address.is_connection() == is_connection;
        let has_room = self.entries.iter().filter(alike).count() < most;
        has_room.then(|| self.add(address, is_local, false, now))
    }

    /// A connection was closed: its peer is gone, with all that waits for it.
    pub fn close(&mut self, connection: Connection) {
        self.entries.retain(|entry| entry.address != Address::Tcp(connection));
    }

    /// Forgets who has been silent for too long.
    pub fn poll(&mut self, now: WallTime) {
        self.entries.retain(|entry| !entry.can_fall_silent() || now.since(entry.heard) < SILENCE);
    }

    /// When the next silent peer will be forgotten.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        let visitors = self.entries.iter().filter(|entry| entry.can_fall_silent());
        visitors.map(|entry| entry.heard + SILENCE).min()
    }

    /// Whether `peer` is still known.
    #[must_use]
    pub fn knows(&self, peer: Peer) -> bool {
        self.entries.iter().any(|entry| entry.peer == peer)
    }

    /// Whether `peer` is on this computer.
    #[must_use]
    pub fn is_local(&self, peer: Peer) -> bool {
        self.entries.iter().any(|entry| entry.peer == peer && entry.is_local)
    }

    /// Whether there is room for the answers to one more message of `peer`.
    pub fn can_answer(&mut self, peer: Peer) -> bool {
        self.room(peer) >= ANSWERS_RESERVED
    }

    /// The peer at the other end of `connection`, and what has come from it.
    pub fn inbox(&mut self, connection: Connection) -> Option<(Peer, &mut Inbox)> {
        let address = Address::Tcp(connection);
        let mut entries = self.entries.iter_mut();
        let entry = entries.find(|entry| entry.address == address)?;
        Some((entry.peer, &mut entry.inbox))
    }

    /// Whether to read from `connection`: what came before was understood, and can be answered.
    #[must_use]
    pub fn accepts_input(&self, connection: Connection) -> bool {
        let address = Address::Tcp(connection);
        self.entries.iter().any(|entry| {
            entry.address == address
                && !entry.inbox.is_held()
                && entry.outbox.room() >= ANSWERS_RESERVED
        })
    }

    /// A connection whose input waited for room, and now has it.
    #[must_use]
    pub fn next_resumable(&self) -> Option<Connection> {
        self.entries.iter().find_map(|entry| match entry.address {
            Address::Tcp(connection)
                if entry.inbox.is_held() && entry.outbox.room() >= ANSWERS_RESERVED =>
            {
                Some(connection)
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

    /// An answer to one peer; nobody gets it if the peer is gone.
    pub fn answer(&mut self, peer: Peer, message: Encoded) {
        if let Some(outbox) = self.outbox(peer) {
            outbox.answer(message);
        }
    }

    /// Bulk data that still fits into the queue of `peer`; none if it is gone.
    pub fn bulk_room(&mut self, peer: Peer) -> usize {
        self.outbox(peer).map_or(0, |outbox| outbox.bulk_room())
    }

    /// Bulk data to one peer, for which there must be room.
    pub fn bulk(&mut self, peer: Peer, message: Encoded) {
        if let Some(outbox) = self.outbox(peer) {
            outbox.bulk(message);
        }
    }

    /// Whether `peer` is at the other end of a connection: what is sent arrives, or waits.
    #[must_use]
    pub fn is_connection(&self, peer: Peer) -> bool {
        self.entries.iter().any(|entry| entry.peer == peer && entry.address.is_connection())
    }

    /// Whether `peer` has an open connection or was heard less than `silence` ago.
    #[must_use]
    pub fn was_heard(&self, peer: Peer, now: WallTime, silence: Duration) -> bool {
        self.entries.iter().any(|entry| {
            let is_present = entry.address.is_connection() || now.since(entry.heard) < silence;
            entry.peer == peer && is_present
        })
    }

    /// Something that every peer must get: heartbeats, texts, changed parameters.
    pub fn announce(&mut self, message: &Encoded) {
        for entry in &mut self.entries {
            entry.outbox.announce(message.clone());
        }
    }

    /// Whether somebody has room for so many announcements, or nobody is there.
    #[must_use]
    pub fn can_announce(&self, count: usize) -> bool {
        let has_room = |entry: &Entry| entry.outbox.room() >= ANSWERS_RESERVED + count;
        self.entries.is_empty() || self.entries.iter().any(has_room)
    }

    /// The peers now.
    pub fn all(&self) -> impl Iterator<Item = Peer> + '_ {
        self.entries.iter().map(|entry| entry.peer)
    }

    /// Telemetry for one peer; nobody gets it if the peer is gone.
    pub fn stream_to(&mut self, peer: Peer, message: Encoded) {
        if let Some(outbox) = self.outbox(peer) {
            outbox.stream(message);
        }
    }

    /// Telemetry for every peer.
    pub fn stream(&mut self, message: &Encoded) {
        for entry in &mut self.entries {
            entry.outbox.stream(message.clone());
        }
    }

    /// Next frame and its destination, of those to whom something can be sent now; answers of all go
    /// before telemetry of any. `signing` signs it, if it is on.
    pub fn pop(
        &mut self,
        signing: &mut Signing,
        can_send: impl Fn(Address) -> bool,
    ) -> Option<(Address, Vec<u8>)> {
        let mut ready = self.entries.iter_mut().filter(|entry| can_send(entry.address));
        let mut chosen: Option<&mut Entry> = None;
        let entry = loop {
            match ready.next() {
                Some(entry) if entry.outbox.has_answer() => break entry,
                Some(entry) if chosen.is_none() && entry.outbox.has_any() => chosen = Some(entry),
                Some(_) => {}
                None => break chosen?,
            }
        };
        let (message, sequence) = entry.outbox.pop()?;
        Some((entry.address, signing.seal(&message, sequence, entry.link)))
    }

    /// Messages from visitors that nobody looked at, since there were too many visitors.
    #[must_use]
    pub fn turned_away(&self) -> u64 {
        self.turned_away
    }

    /// Messages to the present peers dropped so far: telemetry, announcements, answers.
    #[must_use]
    pub fn dropped(&self) -> [u64; 3] {
        self.entries.iter().fold([0; 3], |[telemetry, announcements, answers], entry| {
            let outbox = &entry.outbox;
            [
                telemetry + outbox.dropped_telemetry(),
                announcements + outbox.dropped_announcements(),
                answers + outbox.dropped_answers(),
            ]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(port: u16) -> SocketAddr {
        SocketAddr::from(([127, 0, 0, 1], port))
    }

    fn address(port: u16) -> Address {
        Address::UdpClient(place(port))
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
    fn visitors_and_connections_are_bounded_apart_and_configured_peers_always_have_a_place() {
        let configured: Vec<Address> = (1..=8).map(address).collect();
        let mut peers = Peers::new(&configured);
        let come = |peers: &mut Peers, port| peers.hear(address(port), seconds(0)).is_some();
        assert_eq!((100..200).filter(|port| come(&mut peers, *port)).count(), VISITORS_MAX);
        let open = |peers: &mut Peers, n| peers.open(Connection(n), true, seconds(0)).is_some();
        assert_eq!((0..100).filter(|n| open(&mut peers, *n)).count(), CONNECTIONS_MAX);
        assert_eq!(peers.turned_away(), 100 - VISITORS_MAX as u64);
        assert!((1..=8).all(|port| come(&mut peers, port)));
    }

    #[test]
    fn the_same_place_by_two_sockets_is_two_peers() {
        let mut peers = Peers::new(&[]);
        let one = peers.hear(Address::UdpClient(place(9_000)), seconds(0)).unwrap();
        let other = peers.hear(Address::UdpServer(place(9_000)), seconds(0)).unwrap();
        assert_ne!(one, other);
        assert_eq!(peers.hear(Address::UdpServer(place(9_000)), seconds(1)), Some(other));
    }

    #[test]
    fn each_link_has_a_number_of_its_own_for_as_long_as_its_peer_is_known() {
        let mut peers = Peers::new(&[address(14_550), address(14_540)]);
        let links = |peers: &Peers| peers.entries.iter().map(|e| e.link).collect::<Vec<_>>();
        peers.open(Connection(0), true, seconds(0)).unwrap();
        peers.hear(address(9_000), seconds(0)).unwrap();
        assert_eq!(links(&peers), [0, 1, 2, 3]);
        peers.close(Connection(0));
        assert_eq!(links(&peers), [0, 1, 3]);
        peers.open(Connection(1), true, seconds(0)).unwrap();
        assert_eq!(links(&peers), [0, 1, 3, 2]);
    }

    #[test]
    fn a_peer_is_local_by_its_address_or_by_what_opened_the_connection() {
        let mut peers = Peers::new(&[address(14_550)]);
        let mut hears = |text: &str| {
            let at = Address::UdpServer(text.parse().unwrap());
            let peer = peers.hear(at, seconds(0)).unwrap();
            peers.is_local(peer)
        };
        assert!(hears("127.8.9.1:1") && hears("[::1]:1") && hears("[::ffff:127.0.0.1]:1"));
        assert!(!hears("192.168.1.2:1") && !hears("[::ffff:10.0.0.1]:1") && !hears("[fe80::1]:1"));
        for is_local in [true, false] {
            let peer = peers.open(Connection(u32::from(is_local)), is_local, seconds(0)).unwrap();
            assert_eq!(peers.is_local(peer), is_local);
        }
    }

    #[test]
    fn a_connection_may_be_silent_and_is_gone_when_it_is_closed() {
        let mut peers = Peers::new(&[]);
        let peer = peers.open(Connection(0), true, seconds(0)).unwrap();
        peers.poll(seconds(3_600));
        assert!(peers.knows(peer));
        assert_eq!(peers.next_deadline(), None);
        peers.close(Connection(0));
        assert!(!peers.knows(peer));
        assert_eq!(peers.hear(Address::Tcp(Connection(0)), seconds(3_601)), None, "it is closed");
    }
}
