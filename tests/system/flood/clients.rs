//! Ground stations that flood, and a well-behaved one.

use std::collections::BTreeMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, UdpSocket};
use std::time::{Duration, Instant};

use super::messages::FIRST_UNKNOWN;

/// One ground station of the flood.
pub struct Flooder {
    link: Link,
    answers: u64,
}

enum Link {
    Udp { socket: UdpSocket, to: SocketAddr },
    Tcp { stream: TcpStream, reads: bool },
}

impl Flooder {
    /// By UDP, to the port that ground stations call.
    pub fn udp(to: SocketAddr) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("loopback has free ports");
        socket.set_nonblocking(true).expect("a socket can be set not to block");
        Self { link: Link::Udp { socket, to }, answers: 0 }
    }

    /// By TCP; the autopilot stops reading from a client that does not read.
    pub fn tcp(to: SocketAddr, reads: bool) -> Self {
        let stream = TcpStream::connect(to).expect("the autopilot listens");
        stream.set_nodelay(true).expect("an open connection");
        stream.set_nonblocking(true).expect("a socket can be set not to block");
        Self { link: Link::Tcp { stream, reads }, answers: 0 }
    }

    /// Sends, unless the system does not accept it: then it is lost, or cut.
    pub fn send(&mut self, bytes: &[u8]) {
        let sent = match &mut self.link {
            Link::Udp { socket, to } => socket.send_to(bytes, *to),
            Link::Tcp { stream, .. } => stream.write(bytes),
        };
        if let Err(error) = sent {
            assert_eq!(error.kind(), ErrorKind::WouldBlock, "{error}");
        }
    }

    /// Receives everything available.
    pub fn read(&mut self) {
        let mut buffer = [0; 65_536];
        loop {
            let read = match &mut self.link {
                Link::Udp { socket, .. } => socket.recv(&mut buffer),
                Link::Tcp { reads: false, .. } => return,
                Link::Tcp { stream, .. } => stream.read(&mut buffer),
            };
            match read {
                Ok(0) => panic!("the autopilot has closed a connection"),
                Ok(length) => self.answers += count_frames(&buffer[..length]),
                Err(error) => {
                    assert_eq!(error.kind(), ErrorKind::WouldBlock, "{error}");
                    return;
                }
            }
        }
    }

    /// Approximate number of acknowledgements, pings and parameters received: cut frames may be misread.
    pub fn answers(&self) -> u64 {
        self.answers
    }
}

/// Frames of COMMAND_ACK, PING, TIMESYNC and PARAM_VALUE.
fn count_frames(bytes: &[u8]) -> u64 {
    let heads = bytes.windows(10).filter(|head| head[0] == 0xFD && head[5..7] == [1, 1]);
    heads.filter(|head| [77, 4, 111, 22].contains(&head[7]) && head[8..] == [0, 0]).count() as u64
}

/// A ground station that reads all output and counts acknowledgements.
pub struct Station {
    stream: TcpStream,
    waiting: Vec<u8>,
    /// Acknowledgements of each unknown command.
    pub acknowledged: BTreeMap<u16, u32>,
}

impl Station {
    /// By TCP.
    pub fn connect(to: SocketAddr) -> Self {
        let stream = TcpStream::connect(to).expect("the autopilot listens");
        stream.set_nodelay(true).expect("an open connection");
        Self { stream, waiting: Vec::new(), acknowledged: BTreeMap::new() }
    }

    /// Sends one frame.
    pub fn send(&mut self, bytes: &[u8]) {
        self.stream.write_all(bytes).expect("the autopilot reads whoever reads");
    }

    /// Receives during this time.
    pub fn read_for(&mut self, time: Duration) {
        let until = Instant::now() + time;
        let mut buffer = [0; 4_096];
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            self.stream.set_read_timeout(Some(left)).expect("a time above zero");
            match self.stream.read(&mut buffer) {
                Ok(length) => self.take(&buffer[..length]),
                Err(error) => {
                    let timely = [ErrorKind::WouldBlock, ErrorKind::TimedOut];
                    assert!(timely.contains(&error.kind()), "{error}");
                }
            }
        }
    }

    /// Every frame is a good one of MAVLink 2, however the stream is cut.
    fn take(&mut self, bytes: &[u8]) {
        assert!(!bytes.is_empty(), "the autopilot has closed the connection");
        self.waiting.extend_from_slice(bytes);
        while let [marker, length, _, _, _, _, _, id, id1, id2, rest @ ..] = &self.waiting[..] {
            assert_eq!(*marker, 0xFD, "frames follow each other without a gap");
            let length = usize::from(*length);
            if rest.len() < length + 2 {
                return;
            }
            if [*id, *id1, *id2] == [77, 0, 0] {
                let command = u16::from_le_bytes([rest[0], rest[1]]);
                *self.acknowledged.entry(command - FIRST_UNKNOWN).or_default() += 1;
            }
            self.waiting.drain(..10 + length + 2);
        }
    }
}
