//! All sockets of the ground-station side behind one question: what happened?

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};

use super::tcp::{TcpNews, TcpServer};
use super::udp::{Udp, UdpNews};
use super::{GcsError, Links, TCP_SERVER, UDP_CLIENT, UDP_SERVER};
use crate::clock::WallTime;
use crate::io::status::Listening;
use mavlink_services::peers::{Address, Connection};

/// Longest piece that is read at once; the largest frame has 293 bytes, and a path 1500.
pub(super) const READ_MAX: usize = 2048;
/// Kinds of sockets that take turns.
const KINDS: usize = 3;

/// The sockets that were asked for.
#[derive(Debug)]
pub(super) struct Sockets {
    client: Option<Udp>,
    server: Option<Udp>,
    tcp: Option<TcpServer>,
    /// Which kind is looked at first.
    turn: usize,
}

/// What happened at a socket.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Arrival {
    /// A datagram of this length was read.
    Datagram { from: Address, length: usize },
    /// A connection was opened.
    Opened { connection: Connection, from: SocketAddr },
    /// Bytes of a connection were read.
    Bytes { connection: Connection, length: usize },
    /// A connection is over.
    Closed(Connection),
    /// A socket takes more again.
    Writable,
}

impl Sockets {
    pub(super) async fn open(links: &Links) -> Result<Self, GcsError> {
        let client = match links.clients.as_slice() {
            [] => None,
            _ => Some(Udp::open(UDP_CLIENT, links.client_bind).await?),
        };
        let server = match links.udp_server {
            None => None,
            Some(address) => Some(Udp::open(UDP_SERVER, address).await?),
        };
        let tcp = links.tcp_server.map(TcpServer::open).transpose()?;
        Ok(Self { client, server, tcp, turn: 0 })
    }

    /// Where ground stations can connect, with the ports that the system chose.
    pub(super) fn listening(&self, links: &Links) -> Result<Listening, GcsError> {
        let failed = |link, asked: Option<SocketAddr>| {
            move |source: io::Error| GcsError::Bind {
                link,
                address: asked.unwrap_or(links.client_bind),
                source,
            }
        };
        let udp = self.server.as_ref().map(Udp::local_address).transpose();
        let tcp = self.tcp.as_ref().map(TcpServer::local_address).transpose();
        Ok(Listening {
            clients: links.clients.clone(),
            udp_server: udp.map_err(failed(UDP_SERVER, links.udp_server))?,
            tcp_server: tcp.map_err(failed(TCP_SERVER, links.tcp_server))?,
        })
    }

    /// Whether a frame to `address` can be handed to the system now.
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
            // Nobody can have come by a socket that does not exist.
            _ => {}
        }
    }

    /// Closes a connection. Returns who was at its other end.
    pub(super) fn close(&mut self, connection: Connection) -> Option<SocketAddr> {
        self.tcp.as_mut().and_then(|tcp| tcp.close(connection))
    }

    /// A connection whose peer has stopped taking what it is sent.
    pub(super) fn stalled(&self, now: WallTime) -> Option<Connection> {
        self.tcp.as_ref().and_then(|tcp| tcp.stalled(now))
    }

    /// What happens next. The sockets take turns, so that a flood at one leaves room for the others.
    pub(super) fn poll(
        &mut self,
        cx: &mut Context<'_>,
        buffer: &mut [u8],
        accepts_input: &impl Fn(Connection) -> bool,
        now: WallTime,
    ) -> Poll<Arrival> {
        for i in 0..KINDS {
            let kind = (self.turn + i) % KINDS;
            let arrival = match kind {
                0 => poll_udp(&mut self.client, Address::UdpClient, cx, buffer),
                1 => poll_udp(&mut self.server, Address::UdpServer, cx, buffer),
                _ => poll_tcp(&mut self.tcp, cx, buffer, accepts_input, now),
            };
            if arrival.is_ready() {
                self.turn = kind + 1;
                return arrival;
            }
        }
        Poll::Pending
    }
}

fn poll_udp(
    udp: &mut Option<Udp>,
    address: impl Fn(SocketAddr) -> Address,
    cx: &mut Context<'_>,
    buffer: &mut [u8],
) -> Poll<Arrival> {
    let Some(udp) = udp else { return Poll::Pending };
    udp.poll(cx, buffer).map(|news| match news {
        UdpNews::Datagram { from, length } => Arrival::Datagram { from: address(from), length },
        UdpNews::Writable => Arrival::Writable,
    })
}

fn poll_tcp(
    tcp: &mut Option<TcpServer>,
    cx: &mut Context<'_>,
    buffer: &mut [u8],
    accepts_input: &impl Fn(Connection) -> bool,
    now: WallTime,
) -> Poll<Arrival> {
    let Some(tcp) = tcp else { return Poll::Pending };
    tcp.poll(cx, buffer, accepts_input, now).map(|news| match news {
        TcpNews::Opened { connection, from } => Arrival::Opened { connection, from },
        TcpNews::Bytes { connection, length } => Arrival::Bytes { connection, length },
        TcpNews::Writable => Arrival::Writable,
        TcpNews::Closed(connection) => Arrival::Closed(connection),
    })
}
