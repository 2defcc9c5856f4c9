//! One UDP socket of the ground-station side.

use std::io;
use std::net::SocketAddr;
use std::task::{Context, Poll};

use tokio::net::UdpSocket;
use tracing::{debug, warn};

use super::GcsError;

/// Errors of the socket that are passed over in a row.
const ERRORS_IN_A_ROW: usize = 16;

/// A socket, and the datagram that the system did not take yet.
#[derive(Debug)]
pub(super) struct Udp {
    socket: UdpSocket,
    /// While there is one, nothing is read: input must not outrun its answers.
    unsent: Option<(SocketAddr, Vec<u8>)>,
    send_errors: u64,
}

/// What became possible.
pub(super) enum UdpNews {
    /// A datagram was read.
    Datagram { from: SocketAddr, length: usize },
    /// More can be sent.
    Writable,
}

impl Udp {
    pub(super) async fn open(link: &'static str, address: SocketAddr) -> Result<Self, GcsError> {
        #[expect(clippy::disallowed_methods, reason = "the ground-station link is I/O")]
        let socket = UdpSocket::bind(address).await;
        let socket = socket.map_err(|source| GcsError::Bind { link, address, source })?;
        Ok(Self { socket, unsent: None, send_errors: 0 })
    }

    pub(super) fn local_address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    pub(super) fn can_send(&self) -> bool {
        self.unsent.is_none()
    }

    /// Sends a datagram, or keeps it until the system takes it.
    pub(super) fn send(&mut self, to: SocketAddr, datagram: Vec<u8>) {
        match self.socket.try_send_to(&datagram, to) {
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                self.unsent = Some((to, datagram));
            }
            Err(error) => {
                self.send_errors += 1;
                // The first of each doubling: a ground station that is not there is normal.
                if self.send_errors.is_power_of_two() {
                    warn!(%to, %error, errors = self.send_errors, "a datagram was not sent");
                }
            }
        }
    }

    pub(super) fn poll(&mut self, cx: &mut Context<'_>, buffer: &mut [u8]) -> Poll<UdpNews> {
        while let Some((to, datagram)) = self.unsent.take() {
            if self.socket.poll_send_ready(cx).is_pending() {
                self.unsent = Some((to, datagram));
                return Poll::Pending;
            }
            self.send(to, datagram);
            if self.can_send() {
                return Poll::Ready(UdpNews::Writable);
            }
        }
        for _ in 0..ERRORS_IN_A_ROW {
            if self.socket.poll_recv_ready(cx).is_pending() {
                break;
            }
            match self.socket.try_recv_from(buffer) {
                Ok((length, from)) => return Poll::Ready(UdpNews::Datagram { from, length }),
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                // It concerns an earlier send to somebody who is not there.
                Err(error) => debug!(%error, "ground-station socket"),
            }
        }
        // After too many errors: the other inputs and the deadline go on, and the next call reads again.
        Poll::Pending
    }
}
