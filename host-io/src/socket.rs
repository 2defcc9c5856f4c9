//! The link's socket, and the three ways to wait on it.

use std::io::{self, ErrorKind, IoSliceMut};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::os::fd::{AsFd, AsRawFd};
use std::str::FromStr;
use std::time::Duration;

use nix::errno::Errno;
use nix::libc::sock_extended_err;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::socket::{
    ControlMessageOwned, MsgFlags, SockaddrStorage, recvmsg, setsockopt, sockopt,
};

use crate::clock;
use crate::instance::ADVICE;
use crate::problem::{At as _, Problem, problem};

/// Attempts between two reads of the clock while spinning: about 20 us.
const ATTEMPTS_PER_LOOK: u32 = 64;

/// Errors taken in one call: more than the queue of the system can have is not there.
const ERRORS_MAX: usize = 1024;

/// How a process waits for a packet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Wait {
    /// Asleep in the kernel: costs nothing, wakes a few microseconds late.
    #[default]
    Block,
    /// Polls, and yields to other threads on the same core in between.
    Yield,
    /// Polls without yielding: fastest on a dedicated core, which it uses fully.
    Spin,
}

impl Wait {
    /// Name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Block => "block",
            Self::Yield => "yield",
            Self::Spin => "spin",
        }
    }
}

impl FromStr for Wait {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let mut all = [Self::Block, Self::Yield, Self::Spin].into_iter();
        let found = all.find(|wait| wait.name() == text);
        found.ok_or_else(|| format!("{text:?} is none of block, yield, spin"))
    }
}

/// A UDP socket that waits in a selected way and never longer than its timeout.
#[derive(Debug)]
pub struct LinkSocket {
    socket: UdpSocket,
    wait: Wait,
    timeout: Duration,
    /// The last wait timed out, so it is not worth keeping a core busy.
    quiet: bool,
}

impl LinkSocket {
    /// Listens at `address`.
    pub fn listen(
        process: &'static str,
        link: &'static str,
        address: SocketAddr,
        wait: Wait,
        timeout: Duration,
    ) -> Result<Self, Problem> {
        Self::open(address, wait, timeout).map_err(|source| match source.kind() {
            ErrorKind::AddrInUse => problem!(
                "{process}: cannot bind the {link} to {address}: address in use; is another {process} running? {ADVICE}"
            ),
            _ => problem!("{process}: cannot bind the {link} to {address}: {source}"),
        })
    }

    /// Exchanges datagrams with `peer` only, from a port that the system chooses.
    pub fn connect(
        process: &'static str,
        link: &'static str,
        peer: SocketAddr,
        wait: Wait,
        timeout: Duration,
    ) -> Result<Self, Problem> {
        let own = match peer {
            SocketAddr::V4(_) => SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)),
            SocketAddr::V6(_) => SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0)),
        };
        let socket = Self::listen(process, link, own, wait, timeout)?;
        let place = format_args!("{process}: cannot bind the {link} to {peer}");
        socket.socket.connect(peer).at(place)?;
        Ok(socket)
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "the one socket of the plant link in each process"
    )]
    fn open(address: SocketAddr, wait: Wait, timeout: Duration) -> io::Result<Self> {
        let socket = UdpSocket::bind(address)?;
        match wait {
            Wait::Block => socket.set_read_timeout(Some(timeout))?,
            Wait::Yield | Wait::Spin => socket.set_nonblocking(true)?,
        }
        Ok(Self { socket, wait, timeout, quiet: false })
    }

    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// Waits for a datagram from any sender; `None` at the timeout.
    pub fn receive_from(&mut self, buffer: &mut [u8]) -> io::Result<Option<(usize, SocketAddr)>> {
        self.wait_for(|socket| socket.recv_from(buffer))
    }

    /// Waits for a datagram from the peer; `None` at the timeout.
    pub fn receive(&mut self, buffer: &mut [u8]) -> io::Result<Option<usize>> {
        self.wait_for(|socket| socket.recv(buffer))
    }

    /// Sends to `to`.
    pub fn send_to(&self, datagram: &[u8], to: SocketAddr) -> io::Result<()> {
        sent(|| self.socket.send_to(datagram, to))
    }

    /// Sends to the peer.
    pub fn send(&self, datagram: &[u8]) -> io::Result<()> {
        sent(|| self.socket.send(datagram))
    }

    /// Keeps or forgets the errors that other hosts report about packets sent from here, for [`Self::is_gone`].
    pub fn keep_errors(&self, keep: bool) -> io::Result<()> {
        match self.socket.local_addr()? {
            SocketAddr::V4(_) => setsockopt(&self.socket, sockopt::Ipv4RecvErr, &keep)?,
            SocketAddr::V6(_) => setsockopt(&self.socket, sockopt::Ipv6RecvErr, &keep)?,
        }
        Ok(())
    }

    /// Whether the host of `peer` has answered a packet with the report that no socket is open at its port. Takes the errors
    /// kept so far.
    pub fn is_gone(&self, peer: SocketAddr) -> bool {
        let mut is_gone = false;
        for _ in 0..ERRORS_MAX {
            let mut control = nix::cmsg_space!(sock_extended_err, nix::libc::sockaddr_in6);
            // The packet comes back with its error, and is of no use.
            let mut payload = [0; 1];
            let mut buffers = [IoSliceMut::new(&mut payload)];
            let flags = MsgFlags::MSG_ERRQUEUE | MsgFlags::MSG_DONTWAIT;
            let descriptor = self.socket.as_raw_fd();
            let Ok(kept) =
                recvmsg::<SockaddrStorage>(descriptor, &mut buffers, Some(&mut control), flags)
            else {
                break;
            };
            let is_refused = kept.cmsgs().is_ok_and(|mut messages| {
                messages.any(|message| match message {
                    ControlMessageOwned::Ipv4RecvErr(error, _)
                    | ControlMessageOwned::Ipv6RecvErr(error, _) => {
                        error.ee_errno == Errno::ECONNREFUSED as u32
                    }
                    _ => false,
                })
            });
            is_gone |= is_refused && kept.address.and_then(address_of) == Some(peer);
        }
        is_gone
    }

    fn wait_for<T>(
        &mut self,
        mut attempt: impl FnMut(&UdpSocket) -> io::Result<T>,
    ) -> io::Result<Option<T>> {
        if self.quiet && self.wait != Wait::Block {
            self.sleep_until_readable();
        }
        let mut deadline = None;
        for attempts in 1_u32.. {
            match attempt(&self.socket) {
                Ok(received) => {
                    self.quiet = false;
                    return Ok(Some(received));
                }
                Err(error) => match Trouble::of(&error) {
                    Trouble::Nothing if self.wait == Wait::Block || self.quiet => return Ok(None),
                    // The error interrupted the wait, so it begins again.
                    Trouble::NoPeer if self.quiet => self.sleep_until_readable(),
                    Trouble::Nothing | Trouble::NoPeer => {}
                    Trouble::Fatal => return Err(error),
                },
            }
            match self.wait {
                Wait::Block => {}
                Wait::Yield => std::thread::yield_now(),
                Wait::Spin => std::hint::spin_loop(),
            }
            // Reading the clock costs more than an attempt.
            if attempts.is_multiple_of(ATTEMPTS_PER_LOOK) {
                let now = clock::now();
                // The first look starts the wait, so that an answer that comes before it costs no
                // reading.
                if now >= *deadline.get_or_insert(now + self.timeout) {
                    self.quiet = true;
                    return Ok(None);
                }
            }
        }
        // Only for the compiler: the count has no end.
        Ok(None)
    }

    fn sleep_until_readable(&self) {
        let mut sockets = [PollFd::new(self.socket.as_fd(), PollFlags::POLLIN)];
        let timeout = PollTimeout::try_from(self.timeout).unwrap_or(PollTimeout::MAX);
        // An interrupted wait counts as a short wait.
        let _ = poll(&mut sockets, timeout);
    }
}

fn sent(send: impl Fn() -> io::Result<usize>) -> io::Result<()> {
    match send() {
        // The system reports that an earlier packet reached no peer; this one has not been sent yet.
        Err(error) if error.kind() == ErrorKind::ConnectionRefused => send(),
        other => other,
    }
    .map(|_| ())
}

/// The address in the form of the standard library.
fn address_of(storage: SockaddrStorage) -> Option<SocketAddr> {
    let v4 = storage.as_sockaddr_in().map(|at| SocketAddr::V4((*at).into()));
    v4.or_else(|| storage.as_sockaddr_in6().map(|at| SocketAddr::V6((*at).into())))
}

/// Meaning of an error of a receive call.
enum Trouble {
    /// No datagram has arrived yet.
    Nothing,
    /// The last packet reached no peer; reported once for each packet.
    NoPeer,
    /// The socket has failed.
    Fatal,
}

impl Trouble {
    fn of(error: &io::Error) -> Self {
        match error.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted => Self::Nothing,
            ErrorKind::ConnectionRefused
            | ErrorKind::ConnectionReset
            | ErrorKind::HostUnreachable
            | ErrorKind::NetworkUnreachable
            | ErrorKind::NetworkDown => Self::NoPeer,
            _ => Self::Fatal,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMEOUT: Duration = Duration::from_millis(200);

    fn listen(wait: Wait) -> LinkSocket {
        let anywhere = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        LinkSocket::listen("test", "link", anywhere, wait, TIMEOUT).unwrap()
    }

    #[test]
    fn a_datagram_goes_there_and_back_however_both_wait() {
        for wait in [Wait::Block, Wait::Yield, Wait::Spin] {
            let mut server = listen(wait);
            let address = server.local_address().unwrap();
            let mut client = LinkSocket::connect("test", "link", address, wait, TIMEOUT).unwrap();
            let mut buffer = [0; 16];
            client.send(b"there").unwrap();
            let (bytes, from) = server.receive_from(&mut buffer).unwrap().unwrap();
            assert_eq!(&buffer[..bytes], b"there", "{wait:?}");
            server.send_to(b"back", from).unwrap();
            let bytes = client.receive(&mut buffer).unwrap().unwrap();
            assert_eq!(&buffer[..bytes], b"back", "{wait:?}");
        }
    }

    #[test]
    fn a_wait_times_out_even_without_a_peer() {
        for wait in [Wait::Block, Wait::Yield, Wait::Spin] {
            let gone = listen(wait).local_address().unwrap();
            let mut client = LinkSocket::connect("test", "link", gone, wait, TIMEOUT).unwrap();
            for _ in 0..2 {
                client.send(b"anyone?").unwrap();
                let start = clock::now();
                assert_eq!(client.receive(&mut [0; 16]).unwrap(), None, "{wait:?}");
                let waited = clock::now() - start;
                assert!(waited >= TIMEOUT.mul_f64(0.9), "{wait:?} gave up after {waited:?}");
            }
        }
    }

    #[test]
    fn a_peer_is_gone_when_its_socket_is_closed_and_not_when_it_does_not_read() {
        let here = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let socket = LinkSocket::listen("test", "link", here, Wait::Block, TIMEOUT).unwrap();
        let (peer, other) = (listen(Wait::Block), listen(Wait::Block));
        let (at, other_at) = (peer.local_address().unwrap(), other.local_address().unwrap());
        socket.keep_errors(true).unwrap();
        drop(other);
        let ask = || {
            // The second one reports the error of the first, and is sent anyway.
            socket.send_to(b"there?", other_at).unwrap();
            socket.send_to(b"there?", at).unwrap();
            (0..100).any(|_| socket.is_gone(at))
        };
        assert!(!ask(), "it only does not read");
        drop(peer);
        assert!((0..100).any(|_| ask()));
        socket.keep_errors(false).unwrap();
        assert!(!(0..100).any(|_| ask()), "errors are not kept any more");
    }

    #[test]
    fn a_port_in_use_names_process_link_and_address() {
        let first = listen(Wait::Block);
        let address = first.local_address().unwrap();
        let error = LinkSocket::listen("autopilot", "plant link", address, Wait::Block, TIMEOUT)
            .unwrap_err();
        let expected = format!(
            "autopilot: cannot bind the plant link to {address}: address in use; is another autopilot running? {ADVICE}"
        );
        assert_eq!(error.to_string(), expected);
    }
}
