//! The sockets of the ground-station side: UDP to configured stations, a UDP and a TCP port for stations that call.
//! No socket can block another.

use core::time::Duration;
use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};

use host_io::problem::Problem;
use tokio::net::{TcpListener, TcpSocket, TcpStream, UdpSocket};
use tracing::{debug, warn};

use super::{Links, TCP_SERVER, UDP_CLIENT, UDP_SERVER, unopened};
use crate::clock::WallTime;
use crate::io::status::Listening;
use mavlink_services::peers::{Address, Connection};

/// Longest single read; the largest frame has 293 bytes, and a packet on the network about 1500.
pub(super) const READ_MAX: usize = 2048;
/// Kinds of sockets that take turns.
const KINDS: usize = 3;
/// Errors of a socket in a row after which the other sockets get their turn.
const ERRORS_IN_A_ROW: usize = 16;
/// TCP connections that may wait to be accepted.
const BACKLOG: u32 = 16;
/// Send buffer for a TCP peer that does not read, bytes: a few seconds of telemetry. Beyond that the autopilot drops
/// telemetry, so that a slow peer does not receive old data.
const SYSTEM_BUFFER: u32 = 32 * 1024;
/// A TCP connection whose peer accepts nothing for this long is closed, which frees its place.
const STALL_MAX: Duration = Duration::from_secs(60);

#[derive(Debug)]
pub(super) struct Sockets {
    client: Option<Udp>,
    server: Option<Udp>,
    tcp: Option<TcpServer>,
    /// The kind to poll first.
    turn: usize,
}

/// An event of a socket.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Arrival {
    /// A datagram of this length was read.
    Datagram { from: Address, length: usize },
    /// A connection was opened.
    Opened { connection: Connection, from: SocketAddr },
    /// Bytes of a connection were read.
    Bytes { connection: Connection, length: usize },
    /// A connection has ended.
    Closed(Connection),
    /// A socket can send again.
    Writable,
}

impl Sockets {
    pub(super) async fn open(links: &Links) -> Result<Self, Problem> {
        let own = (!links.clients.is_empty()).then_some(links.client_bind);
        let client = Udp::open(UDP_CLIENT, own).await?;
        let server = Udp::open(UDP_SERVER, links.udp_server).await?;
        let tcp = links.tcp_server.map(TcpServer::open).transpose()?;
        Ok(Self { client, server, tcp, turn: 0 })
    }

    /// Addresses of the open sockets, with the ports that the system chose.
    pub(super) fn listening(&self, links: &Links) -> Result<Listening, Problem> {
        let failed = |link, requested: Option<SocketAddr>| {
            unopened(link, requested.unwrap_or(links.client_bind))
        };
        let udp = self.server.as_ref().map(|udp| udp.socket.local_addr()).transpose();
        let tcp = self.tcp.as_ref().map(TcpServer::local_address).transpose();
        Ok(Listening {
            clients: links.clients.clone(),
            udp_server: udp.map_err(failed(UDP_SERVER, links.udp_server))?,
            tcp_server: tcp.map_err(failed(TCP_SERVER, links.tcp_server))?,
        })
    }

    /// Whether the system can accept a frame to `address` now.
    pub(super) fn can_send(&self, address: Address) -> bool {
        match address {
            Address::UdpClient(_) => self.client.as_ref().is_some_and(Udp::can_send),
            Address::UdpServer(_) => self.server.as_ref().is_some_and(Udp::can_send),
            Address::Tcp(connection) => {
                self.tcp.as_ref().is_some_and(|tcp| tcp.can_send(connection))
            }
        }
    }

    /// Sends one frame; never waits.
    pub(super) fn send(&mut self, to: Address, frame: Vec<u8>, now: WallTime) {
        match (to, &mut self.client, &mut self.server, &mut self.tcp) {
            (Address::UdpClient(to), Some(client), _, _) => client.send(to, frame),
            (Address::UdpServer(to), _, Some(server), _) => server.send(to, frame),
            (Address::Tcp(connection), _, _, Some(tcp)) => tcp.send(connection, frame, now),
            // No peer can have come by a socket that does not exist.
            _ => {}
        }
    }

    /// Closes a connection. Returns the address of its peer.
    pub(super) fn close(&mut self, connection: Connection) -> Option<SocketAddr> {
        self.tcp.as_mut().and_then(|tcp| tcp.close(connection))
    }

    /// A connection whose peer no longer accepts data.
    pub(super) fn stalled(&self, now: WallTime) -> Option<Connection> {
        self.tcp.as_ref().and_then(|tcp| tcp.stalled(now))
    }

    /// The next event. The sockets take turns, so that a flood at one leaves room for the others.
    pub(super) fn poll(
        &mut self,
        cx: &mut Context<'_>,
        buffer: &mut [u8],
        accepts_input: &impl Fn(Connection) -> bool,
        now: WallTime,
    ) -> Poll<Arrival> {
        for i in 0..KINDS {
            let kind = (self.turn + i) % KINDS;
            let arrival = match (kind, &mut self.client, &mut self.server, &mut self.tcp) {
                (0, Some(client), ..) => client.poll(cx, buffer, Address::UdpClient),
                (1, _, Some(server), _) => server.poll(cx, buffer, Address::UdpServer),
                (2, .., Some(tcp)) => tcp.poll(cx, buffer, accepts_input, now),
                _ => Poll::Pending,
            };
            if arrival.is_ready() {
                self.turn = kind + 1;
                return arrival;
            }
        }
        Poll::Pending
    }
}

/// A UDP socket, and the datagram that the system has not accepted yet.
#[derive(Debug)]
struct Udp {
    socket: UdpSocket,
    /// While there is one, nothing is read: input must not outrun its answers.
    unsent: Option<(SocketAddr, Vec<u8>)>,
    send_errors: u64,
}

impl Udp {
    async fn open(
        link: &'static str,
        address: Option<SocketAddr>,
    ) -> Result<Option<Self>, Problem> {
        let Some(address) = address else { return Ok(None) };
        #[expect(clippy::disallowed_methods, reason = "the ground-station link is I/O")]
        let socket = UdpSocket::bind(address).await;
        let socket = socket.map_err(unopened(link, address))?;
        Ok(Some(Self { socket, unsent: None, send_errors: 0 }))
    }

    fn can_send(&self) -> bool {
        self.unsent.is_none()
    }

    /// Sends a datagram, or keeps it until the system accepts it.
    fn send(&mut self, to: SocketAddr, datagram: Vec<u8>) {
        match self.socket.try_send_to(&datagram, to) {
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                self.unsent = Some((to, datagram));
            }
            Err(error) => {
                self.send_errors += 1;
                // Logs the first of each doubling: an absent ground station is normal.
                if self.send_errors.is_power_of_two() {
                    warn!(%to, %error, errors = self.send_errors, "a datagram was not sent");
                }
            }
        }
    }

    fn poll(
        &mut self,
        cx: &mut Context<'_>,
        buffer: &mut [u8],
        address: fn(SocketAddr) -> Address,
    ) -> Poll<Arrival> {
        while let Some((to, datagram)) = self.unsent.take() {
            if self.socket.poll_send_ready(cx).is_pending() {
                self.unsent = Some((to, datagram));
                return Poll::Pending;
            }
            self.send(to, datagram);
            if self.can_send() {
                return Poll::Ready(Arrival::Writable);
            }
        }
        for _ in 0..ERRORS_IN_A_ROW {
            if self.socket.poll_recv_ready(cx).is_pending() {
                break;
            }
            match self.socket.try_recv_from(buffer) {
                Ok((length, from)) => {
                    return Poll::Ready(Arrival::Datagram { from: address(from), length });
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                // The error concerns an earlier datagram to an absent peer.
                Err(error) => debug!(%error, "ground-station socket"),
            }
        }
        // After too many errors the other inputs and the deadline continue, and the next call reads again.
        Poll::Pending
    }
}

/// The listening socket, and the open connections.
#[derive(Debug)]
pub(super) struct TcpServer {
    listener: TcpListener,
    clients: Vec<TcpClient>,
    next: u32,
    /// The connection to poll first.
    turn: usize,
    accept_errors: u64,
}

#[derive(Debug)]
struct TcpClient {
    connection: Connection,
    remote: SocketAddr,
    stream: TcpStream,
    /// The part of a frame that the system has not accepted yet.
    unsent: Vec<u8>,
    /// When the system stopped accepting data.
    stalled_since: WallTime,
    broken: bool,
}

impl TcpServer {
    pub(super) fn open(address: SocketAddr) -> Result<Self, Problem> {
        let listener = listen(address).map_err(unopened(TCP_SERVER, address))?;
        Ok(Self { listener, clients: Vec::new(), next: 0, turn: 0, accept_errors: 0 })
    }

    pub(super) fn local_address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    pub(super) fn can_send(&self, connection: Connection) -> bool {
        let client = self.clients.iter().find(|client| client.connection == connection);
        client.is_some_and(|client| client.unsent.is_empty() && !client.broken)
    }

    /// Sends a frame, or keeps what the system does not accept.
    pub(super) fn send(&mut self, connection: Connection, frame: Vec<u8>, now: WallTime) {
        let mut clients = self.clients.iter_mut();
        // The connection was closed just now.
        let Some(client) = clients.find(|client| client.connection == connection) else { return };
        client.unsent = frame;
        client.stalled_since = now;
        client.write();
    }

    /// Closes a connection. Returns the address of its peer.
    pub(super) fn close(&mut self, connection: Connection) -> Option<SocketAddr> {
        let at = self.clients.iter().position(|client| client.connection == connection)?;
        Some(self.clients.swap_remove(at).remote)
    }

    /// A connection whose peer no longer accepts data.
    pub(super) fn stalled(&self, now: WallTime) -> Option<Connection> {
        let stalled = |client: &&TcpClient| {
            !client.unsent.is_empty() && now.since(client.stalled_since) > STALL_MAX
        };
        self.clients.iter().find(stalled).map(|client| client.connection)
    }

    /// Polls the connections in turn, each once per round.
    pub(super) fn poll(
        &mut self,
        cx: &mut Context<'_>,
        buffer: &mut [u8],
        accepts_input: &impl Fn(Connection) -> bool,
        now: WallTime,
    ) -> Poll<Arrival> {
        if let Poll::Ready(opened) = self.poll_accept(cx, now) {
            return Poll::Ready(opened);
        }
        let count = self.clients.len();
        for i in 0..count {
            let at = (self.turn + i) % count;
            let Some(client) = self.clients.get_mut(at) else { continue };
            if let Poll::Ready(arrival) = client.poll(cx, buffer, accepts_input, now) {
                self.turn = at + 1;
                return Poll::Ready(arrival);
            }
        }
        Poll::Pending
    }

    fn poll_accept(&mut self, cx: &mut Context<'_>, now: WallTime) -> Poll<Arrival> {
        for _ in 0..ERRORS_IN_A_ROW {
            let (stream, remote) = match self.listener.poll_accept(cx) {
                Poll::Pending => break,
                Poll::Ready(Ok(accepted)) => accepted,
                Poll::Ready(Err(error)) => {
                    self.accept_errors += 1;
                    if self.accept_errors.is_power_of_two() {
                        warn!(%error, errors = self.accept_errors, "a connection was not accepted");
                    }
                    continue;
                }
            };
            if let Err(error) = stream.set_nodelay(true) {
                // The peer has closed it already, as reading will show; otherwise it is served with some delay.
                debug!(%remote, %error, "TCP_NODELAY");
            }
            let connection = Connection(self.next);
            self.next = self.next.wrapping_add(1);
            let unsent = Vec::new();
            let client =
                TcpClient { connection, remote, stream, unsent, stalled_since: now, broken: false };
            self.clients.push(client);
            return Poll::Ready(Arrival::Opened { connection, from: remote });
        }
        Poll::Pending
    }
}

fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // Connections of a server that has just ended would keep the port; one that still
    // listens keeps it all the same.
    socket.set_reuseaddr(true)?;
    // Accepted connections inherit the option.
    socket.set_send_buffer_size(SYSTEM_BUFFER)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

impl TcpClient {
    /// Writes waiting data, as far as the system accepts them. True if it accepted any.
    fn write(&mut self) -> bool {
        match self.stream.try_write(&self.unsent) {
            Ok(taken) => {
                self.unsent.drain(..taken);
                taken > 0
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => false,
            Err(error) => {
                debug!(remote = %self.remote, %error, "ground-station connection");
                self.broken = true;
                false
            }
        }
    }

    fn poll(
        &mut self,
        cx: &mut Context<'_>,
        buffer: &mut [u8],
        accepts_input: &impl Fn(Connection) -> bool,
        now: WallTime,
    ) -> Poll<Arrival> {
        let connection = self.connection;
        while !self.broken && !self.unsent.is_empty() {
            if self.stream.poll_write_ready(cx).is_pending() {
                break;
            }
            if self.write() {
                self.stalled_since = now;
            }
            if self.unsent.is_empty() && !self.broken {
                return Poll::Ready(Arrival::Writable);
            }
        }
        while !self.broken && accepts_input(connection) {
            if self.stream.poll_read_ready(cx).is_pending() {
                return Poll::Pending;
            }
            match self.stream.try_read(buffer) {
                Ok(0) => self.broken = true,
                Ok(length) => return Poll::Ready(Arrival::Bytes { connection, length }),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Err(_) => self.broken = true,
            }
        }
        if self.broken { Poll::Ready(Arrival::Closed(connection)) } else { Poll::Pending }
    }
}
