//! The TCP server of the ground-station side: several connections, none of which can hold up another.

use core::time::Duration;
use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};

use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tracing::{debug, warn};

use super::GcsError;
use crate::clock::WallTime;
use mavlink_services::peers::Connection;

/// Connections that may wait to be accepted.
const BACKLOG: u32 = 16;
/// What the system keeps for a peer that does not read, bytes: a few seconds of telemetry. Beyond that
/// telemetry is dropped here, so that a slow peer does not see the past.
const SYSTEM_BUFFER: u32 = 32 * 1024;
/// A connection whose peer takes nothing for this long is closed, so that its place is free again.
const STALL_MAX: Duration = Duration::from_secs(60);
/// Refusals of the system to accept that are passed over in a row.
const ERRORS_IN_A_ROW: usize = 16;

/// Listens, and holds the connections that were opened.
#[derive(Debug)]
pub(super) struct TcpServer {
    listener: TcpListener,
    clients: Vec<Client>,
    next: u32,
    /// Whose turn it is to be looked at first.
    turn: usize,
    accept_errors: u64,
}

#[derive(Debug)]
struct Client {
    connection: Connection,
    remote: SocketAddr,
    stream: TcpStream,
    /// The part of a frame that the system did not take yet.
    unsent: Vec<u8>,
    /// When the system refused to take more.
    stalled_since: WallTime,
    broken: bool,
}

/// What happened.
pub(super) enum TcpNews {
    /// A ground station opened a connection.
    Opened { connection: Connection, from: SocketAddr },
    /// Bytes were read.
    Bytes { connection: Connection, length: usize },
    /// More can be sent.
    Writable,
    /// The connection is over.
    Closed(Connection),
}

impl TcpServer {
    pub(super) fn open(address: SocketAddr) -> Result<Self, GcsError> {
        let failed = |source| GcsError::Bind { link: super::TCP_SERVER, address, source };
        let listener = listen(address).map_err(failed)?;
        Ok(Self { listener, clients: Vec::new(), next: 0, turn: 0, accept_errors: 0 })
    }

    pub(super) fn local_address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    pub(super) fn can_send(&self, connection: Connection) -> bool {
        let client = self.clients.iter().find(|client| client.connection == connection);
        client.is_some_and(|client| client.unsent.is_empty() && !client.broken)
    }

    /// Sends a frame, or keeps what the system does not take.
    pub(super) fn send(&mut self, connection: Connection, frame: Vec<u8>, now: WallTime) {
        let mut clients = self.clients.iter_mut();
        // A connection that was closed just now.
        let Some(client) = clients.find(|client| client.connection == connection) else { return };
        client.unsent = frame;
        client.stalled_since = now;
        client.write();
    }

    /// Closes a connection. Returns who was at its other end.
    pub(super) fn close(&mut self, connection: Connection) -> Option<SocketAddr> {
        let at = self.clients.iter().position(|client| client.connection == connection)?;
        Some(self.clients.swap_remove(at).remote)
    }

    /// A connection whose peer has stopped taking what it is sent.
    pub(super) fn stalled(&self, now: WallTime) -> Option<Connection> {
        let stalled = |client: &&Client| {
            !client.unsent.is_empty() && now.since(client.stalled_since) > STALL_MAX
        };
        self.clients.iter().find(stalled).map(|client| client.connection)
    }

    /// Connections are looked at in turns, and each is read once in its turn.
    pub(super) fn poll(
        &mut self,
        cx: &mut Context<'_>,
        buffer: &mut [u8],
        accepts_input: &impl Fn(Connection) -> bool,
        now: WallTime,
    ) -> Poll<TcpNews> {
        if let Poll::Ready(opened) = self.poll_accept(cx, now) {
            return Poll::Ready(opened);
        }
        let count = self.clients.len();
        for i in 0..count {
            let at = (self.turn + i) % count;
            let Some(client) = self.clients.get_mut(at) else { continue };
            if let Poll::Ready(news) = client.poll(cx, buffer, accepts_input, now) {
                self.turn = at + 1;
                return Poll::Ready(news);
            }
        }
        Poll::Pending
    }

    fn poll_accept(&mut self, cx: &mut Context<'_>, now: WallTime) -> Poll<TcpNews> {
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
                // It has been closed already, as reading will tell; else it is served with some delay.
                debug!(%remote, %error, "TCP_NODELAY");
            }
            let connection = Connection(self.next);
            self.next = self.next.wrapping_add(1);
            let unsent = Vec::new();
            let client =
                Client { connection, remote, stream, unsent, stalled_since: now, broken: false };
            self.clients.push(client);
            return Poll::Ready(TcpNews::Opened { connection, from: remote });
        }
        Poll::Pending
    }
}

fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // A server that has just ended leaves connections behind that would keep the port; one that still
    // listens keeps it all the same.
    socket.set_reuseaddr(true)?;
    // Accepted connections inherit it.
    socket.set_send_buffer_size(SYSTEM_BUFFER)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

impl Client {
    /// Writes what waits, as far as the system takes it. True if it took anything.
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
    ) -> Poll<TcpNews> {
        let connection = self.connection;
        while !self.broken && !self.unsent.is_empty() {
            if self.stream.poll_write_ready(cx).is_pending() {
                break;
            }
            if self.write() {
                self.stalled_since = now;
            }
            if self.unsent.is_empty() && !self.broken {
                return Poll::Ready(TcpNews::Writable);
            }
        }
        while !self.broken && accepts_input(connection) {
            if self.stream.poll_read_ready(cx).is_pending() {
                return Poll::Pending;
            }
            match self.stream.try_read(buffer) {
                Ok(0) => self.broken = true,
                Ok(length) => return Poll::Ready(TcpNews::Bytes { connection, length }),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Err(_) => self.broken = true,
            }
        }
        if self.broken { Poll::Ready(TcpNews::Closed(connection)) } else { Poll::Pending }
    }
}
