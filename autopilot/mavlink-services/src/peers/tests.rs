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
    let known = peers.receive(address(14_550), seconds(0)).unwrap();
    let visitor = peers.receive(address(9_000), seconds(0)).unwrap();
    peers.receive(address(9_000), seconds(5)).unwrap();
    peers.poll(seconds(14));
    assert!(peers.knows(visitor));
    assert_eq!(peers.next_deadline(), Some(seconds(15)));
    peers.poll(seconds(15));
    assert!(!peers.knows(visitor));
    assert!(peers.knows(known));
    assert_ne!(peers.receive(address(9_000), seconds(16)), Some(visitor), "a new peer");
}

#[test]
fn visitors_and_connections_are_bounded_apart_and_configured_peers_always_have_a_place() {
    let configured: Vec<Address> = (1..=8).map(address).collect();
    let mut peers = Peers::new(&configured);
    let come = |peers: &mut Peers, port| peers.receive(address(port), seconds(0)).is_some();
    assert_eq!((100..200).filter(|port| come(&mut peers, *port)).count(), VISITORS_MAX);
    let open = |peers: &mut Peers, n| peers.open(Connection(n), true, seconds(0)).is_some();
    assert_eq!((0..100).filter(|n| open(&mut peers, *n)).count(), CONNECTIONS_MAX);
    assert_eq!(peers.crowding().turned_away, 100 - VISITORS_MAX as u64);
    assert!((1..=8).all(|port| come(&mut peers, port)));
}

#[test]
fn the_same_place_by_two_sockets_is_two_peers() {
    let mut peers = Peers::new(&[]);
    let one = peers.receive(Address::UdpClient(place(9_000)), seconds(0)).unwrap();
    let other = peers.receive(Address::UdpServer(place(9_000)), seconds(0)).unwrap();
    assert_ne!(one, other);
    assert_eq!(peers.receive(Address::UdpServer(place(9_000)), seconds(1)), Some(other));
}

#[test]
fn each_link_has_its_own_number_for_as_long_as_its_peer_is_known() {
    let mut peers = Peers::new(&[address(14_550), address(14_540)]);
    let links = |peers: &Peers| peers.entries.iter().map(|e| e.link).collect::<Vec<_>>();
    peers.open(Connection(0), true, seconds(0)).unwrap();
    peers.receive(address(9_000), seconds(0)).unwrap();
    assert_eq!(links(&peers), [0, 1, 2, 3]);
    peers.close(Connection(0));
    assert_eq!(links(&peers), [0, 1, 3]);
    peers.open(Connection(1), true, seconds(0)).unwrap();
    assert_eq!(links(&peers), [0, 1, 3, 2]);
}

#[test]
fn a_peer_is_local_by_its_address_or_by_what_opened_the_connection() {
    let mut peers = Peers::new(&[address(14_550)]);
    let mut is_local = |text: &str| {
        let at = Address::UdpServer(text.parse().unwrap());
        let peer = peers.receive(at, seconds(0)).unwrap();
        peers.is_local(peer)
    };
    assert!(is_local("127.8.9.1:1") && is_local("[::1]:1") && is_local("[::ffff:127.0.0.1]:1"));
    assert!(
        !is_local("192.168.1.2:1") && !is_local("[::ffff:10.0.0.1]:1") && !is_local("[fe80::1]:1")
    );
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
    assert_eq!(peers.receive(Address::Tcp(Connection(0)), seconds(3_601)), None, "it is closed");
}

/// The senders at `ports` that have a place after sending at `s`.
fn served(peers: &mut Peers, ports: core::ops::Range<u16>, s: u64) -> Vec<u16> {
    ports.filter(|port| peers.receive(address(*port), seconds(s)).is_some()).collect()
}

#[test]
fn among_active_peers_a_new_one_replaces_the_newest_after_a_while() {
    let mut peers = Peers::new(&[]);
    assert_eq!(served(&mut peers, 0..23, 0).len(), VISITORS_MAX - 1);
    assert_eq!(served(&mut peers, 23..24, 1), [23]);
    for s in 2..11 {
        assert_eq!(served(&mut peers, 0..25, s), Vec::from_iter(0..24), "at {s} s");
    }
    assert_eq!(served(&mut peers, 24..25, 11), [24], "the newest has had its ten seconds");
    assert_eq!(peers.crowding(), Crowding { displaced: 1, turned_away: 9 });
    for s in 11..21 {
        let expected: Vec<u16> = (0..23).chain([24]).collect();
        assert_eq!(served(&mut peers, 0..25, s), expected, "at {s} s");
    }
    assert_eq!(served(&mut peers, 23..24, 21), [23], "and so has its successor");
}

#[test]
fn visitors_that_said_one_thing_give_way_soon_and_those_that_talked_after_three_seconds() {
    let mut peers = Peers::new(&[]);
    served(&mut peers, 0..24, 0);
    assert!(served(&mut peers, 100..101, 1).is_empty());
    assert_eq!(served(&mut peers, 100..101, 2), [100]);
    let mut peers = Peers::new(&[]);
    served(&mut peers, 0..24, 0);
    served(&mut peers, 0..24, 2);
    assert!(served(&mut peers, 100..101, 4).is_empty());
    assert_eq!(served(&mut peers, 100..101, 5), [100]);
}

#[test]
fn connections_that_never_sent_give_way_at_once_and_those_that_send_never() {
    let mut peers = Peers::new(&[]);
    let opened: Vec<Peer> =
        (0..16).map(|n| peers.open(Connection(n), true, seconds(0)).unwrap()).collect();
    for peer in &opened[2..] {
        peers.has_sent(*peer, seconds(0));
    }
    assert_eq!(peers.open(Connection(16), true, seconds(0)), None);
    for n in 0..2 {
        assert_eq!(peers.quiet_connection(seconds(0)), Some(Connection(n)), "the oldest first");
        peers.close(Connection(n));
        let peer = peers.open(Connection(16 + n), true, seconds(0)).unwrap();
        peers.has_sent(peer, seconds(0));
    }
    assert_eq!(peers.quiet_connection(seconds(0)), None);
    for peer in &opened[3..] {
        peers.has_sent(*peer, seconds(1));
    }
    assert_eq!(peers.quiet_connection(seconds(2)), Some(Connection(2)), "it said one thing");
    for peer in &opened[2..] {
        peers.has_sent(*peer, seconds(2));
    }
    for n in 16..18 {
        peers.close(Connection(n));
    }
    assert_eq!(peers.quiet_connection(seconds(4)), None);
    assert_eq!(peers.quiet_connection(seconds(5)), Some(Connection(2)));
}

#[test]
fn a_crowd_displaces_no_active_peer_that_came_before_it() {
    let mut peers = Peers::new(&[]);
    let operators: Vec<Peer> =
        (0..4).map(|port| peers.receive(address(port), seconds(port.into())).unwrap()).collect();
    for s in 4..100 {
        // Operators send heartbeats, the crowd sends from ever new addresses.
        served(&mut peers, 0..4, s);
        let first = 1_000 + 200 * u16::try_from(s).unwrap();
        served(&mut peers, first..first + 200, s);
        peers.poll(seconds(s));
        assert!(operators.iter().all(|operator| peers.knows(*operator)), "at {s} s");
        assert!(peers.entries.len() <= VISITORS_MAX);
    }
    assert!(peers.crowding().displaced > 100, "{:?}", peers.crowding());
}

#[test]
fn the_quiet_go_before_the_newest_and_the_quietest_first() {
    let mut peers = Peers::new(&[address(14_550)]);
    served(&mut peers, 0..24, 0);
    served(&mut peers, 0..3, 1);
    served(&mut peers, 4..24, 6);
    // 3 was received at 0 s only, 0 to 2 at 1 s too, the others now.
    assert_eq!(served(&mut peers, 100..106, 6), [100, 101, 102, 103]);
    let known = |peers: &Peers, port| peers.entries.iter().any(|e| e.address == address(port));
    assert!((0..4).all(|port| !known(&peers, port)) && (4..24).all(|port| known(&peers, port)));
    assert!(known(&peers, 14_550), "a configured one is not a visitor, however quiet");
    assert_eq!(peers.crowding(), Crowding { displaced: 4, turned_away: 2 });
}
