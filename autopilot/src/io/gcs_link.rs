//! The ground-station link: one UDP socket, and the channels to the control thread, around
//! [`crate::mavlink::Ground`].
//!
//! One socket serves all peers, since ground stations remember the address that datagrams come from.

use core::future::pending;
use core::time::Duration;
use std::io;
use std::net::SocketAddr;
use std::sync::atomic::Ordering;

use flight_control::Belief;
use tokio::net::UdpSocket;
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};
use tracing::{debug, warn};

use super::channels::GroundChannels;
use crate::clock::{self, WallTime};
use crate::event::Intent;
use crate::mavlink::Ground;
use crate::parameters::Parameters;

/// Longest datagram that is looked at; the largest frame has 280 bytes, and a path 1500.
const DATAGRAM_MAX: usize = 2048;
/// Events taken in a row, so that datagrams get their turn.
const EVENTS_IN_A_ROW: usize = 64;
/// Shortest sleep: an overdue deadline that cannot be met yet must not spin.
const SLEEP_MIN: Duration = Duration::from_millis(1);
/// A full intent channel is tried again after this.
const RETRY: Duration = Duration::from_millis(2);

/// What the ground-station link needs to know.
#[derive(Debug, Clone)]
pub struct GcsConfig {
    /// Own address: an address of this machine, port 0 for any.
    pub bind: SocketAddr,
    /// Ground stations that are always spoken to.
    pub endpoints: Vec<SocketAddr>,
    /// Parameters at start; the control side must have started with the same.
    pub parameters: Parameters,
    /// Belief of the control side; scales the effectors' commands.
    pub belief: Belief,
}

impl GcsConfig {
    /// Own address where nothing else is asked for: loopback, any port.
    pub const DEFAULT_BIND: SocketAddr =
        SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 0);
}

/// Why the link ends before it is told to.
#[derive(Debug, thiserror::Error)]
pub enum GcsError {
    /// No socket.
    #[error("autopilot: cannot open {address} for ground stations: {source}")]
    Bind {
        /// The address asked for.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// An endpoint that the socket cannot reach: IPv4 and IPv6 do not mix.
    #[error(
        "autopilot: ground station {endpoint} cannot be reached from {bind}: IPv4 and IPv6 do not mix"
    )]
    Family {
        /// The ground station.
        endpoint: SocketAddr,
        /// Own address.
        bind: SocketAddr,
    },
    /// The control thread has ended.
    #[error("autopilot: the control thread has ended")]
    ControlEnded,
}

/// Serves ground stations until `shutdown` becomes true or its sender is dropped.
///
/// # Errors
/// [`GcsError`] if there is no socket, or when the control thread ends.
pub async fn run(
    config: GcsConfig,
    channels: GroundChannels,
    mut shutdown: watch::Receiver<bool>,
) -> Result<(), GcsError> {
    let GcsConfig { bind, endpoints, parameters, belief } = config;
    if let Some(&endpoint) = endpoints.iter().find(|address| address.is_ipv4() != bind.is_ipv4()) {
        return Err(GcsError::Family { endpoint, bind });
    }
    #[expect(clippy::disallowed_methods, reason = "the ground-station link is I/O")]
    let socket =
        UdpSocket::bind(bind).await.map_err(|source| GcsError::Bind { address: bind, source })?;
    let link = Link {
        ground: Ground::new(&parameters, &belief, &endpoints),
        socket,
        channels,
        held_back: None,
        send_errors: 0,
    };
    tokio::select! {
        // An error means that the sender is gone, which ends the link as well.
        _ = shutdown.wait_for(|stop| *stop) => Ok(()),
        result = link.serve() => result,
    }
}

struct Link {
    ground: Ground,
    socket: UdpSocket,
    channels: GroundChannels,
    /// An intent that found no room in the channel.
    held_back: Option<Intent>,
    send_errors: u64,
}

enum Input {
    Datagram { from: SocketAddr, length: usize },
    Event(crate::event::Event),
    Snapshot(Box<crate::event::Snapshot>),
    Time,
    ControlEnded,
}

impl Link {
    async fn serve(mut self) -> Result<(), GcsError> {
        let mut buffer = [0; DATAGRAM_MAX];
        loop {
            let now = clock::now();
            self.ground.poll(now);
            self.pass_intents()?;
            let wanted = self.ground.wants_snapshot();
            self.channels.snapshot_wanted.store(wanted, Ordering::Relaxed);
            self.send().await;
            let deadline = self.next_wake(now);
            let input = self.next_input(&mut buffer, deadline).await;
            let now = clock::now();
            match input {
                Input::Datagram { from, length } => {
                    self.ground.handle_datagram(from, &buffer[..length], now);
                }
                Input::Event(event) => {
                    self.ground.handle_event(&event, now);
                    for _ in 1..EVENTS_IN_A_ROW {
                        let Ok(event) = self.channels.events.try_recv() else { break };
                        self.ground.handle_event(&event, now);
                    }
                }
                Input::Snapshot(snapshot) => self.ground.handle_snapshot(&snapshot, now),
                Input::Time => {}
                Input::ControlEnded => return Err(GcsError::ControlEnded),
            }
        }
    }

    fn next_wake(&self, now: WallTime) -> Instant {
        let mut deadline = self.ground.next_deadline().max(now + SLEEP_MIN);
        if self.held_back.is_some() || self.ground.has_intents() {
            deadline = deadline.min(now + RETRY);
        }
        clock::instant(deadline).into()
    }

    async fn next_input(&mut self, buffer: &mut [u8], deadline: Instant) -> Input {
        // Not biased: each source gets its turn, also beside a flood of datagrams.
        tokio::select! {
            received = receive(&self.socket, buffer) => {
                let (length, from) = received;
                Input::Datagram { from, length }
            }
            event = self.channels.events.recv() => {
                event.map_or(Input::ControlEnded, Input::Event)
            }
            snapshot = self.channels.snapshots.recv() => {
                snapshot.map_or(Input::ControlEnded, |snapshot| Input::Snapshot(Box::new(snapshot)))
            }
            () = sleep_until(deadline) => Input::Time,
        }
    }

    /// Hands intents to the control thread while there is room.
    fn pass_intents(&mut self) -> Result<(), GcsError> {
        while let Some(intent) = self.held_back.take().or_else(|| self.ground.pop_intent()) {
            match self.channels.intents.try_send(intent) {
                Ok(()) => {}
                Err(TrySendError::Full(intent)) => {
                    self.held_back = Some(intent);
                    return Ok(());
                }
                Err(TrySendError::Closed(_)) => return Err(GcsError::ControlEnded),
            }
        }
        Ok(())
    }

    /// Sends everything that waits. Nothing is read meanwhile, so input never outruns its answers.
    async fn send(&mut self) {
        while let Some((to, datagram)) = self.ground.pop_datagram() {
            if let Err(error) = self.socket.send_to(&datagram, to).await {
                self.send_errors += 1;
                // The first of each doubling: a ground station that is not there is normal.
                if self.send_errors.is_power_of_two() {
                    warn!(%to, %error, errors = self.send_errors, "a datagram was not sent");
                }
            }
        }
    }
}

/// Next datagram. Errors of the socket concern an earlier send to somebody who is not there.
async fn receive(socket: &UdpSocket, buffer: &mut [u8]) -> (usize, SocketAddr) {
    match socket.recv_from(buffer).await {
        Ok(received) => received,
        Err(error) => {
            debug!(%error, "ground-station socket");
            // The other inputs and the deadline go on; the next call reads again.
            pending().await
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{self, DEFAULT_BELIEF};
    use crate::io::channels::channels;

    fn config(endpoint: SocketAddr) -> GcsConfig {
        GcsConfig {
            bind: GcsConfig::DEFAULT_BIND,
            endpoints: vec![endpoint],
            parameters: Parameters::default(),
            belief: config::belief("belief", DEFAULT_BELIEF).unwrap(),
        }
    }

    #[tokio::test]
    #[expect(clippy::disallowed_methods, reason = "a ground station for the test")]
    async fn a_heartbeat_reaches_the_configured_ground_station_and_shutdown_ends_the_link() {
        let station = UdpSocket::bind("127.0.0.1:0").await.unwrap();
        let (ground, _control) = channels();
        let (stop, stopped) = watch::channel(false);
        let link = tokio::spawn(run(config(station.local_addr().unwrap()), ground, stopped));
        let mut buffer = [0; 300];
        let (length, _) = station.recv_from(&mut buffer).await.unwrap();
        assert_eq!((length, buffer[0], buffer[7]), (21, 0xFD, 0), "a HEARTBEAT of MAVLink 2");
        stop.send(true).unwrap();
        assert!(link.await.unwrap().is_ok());
    }

    #[tokio::test]
    async fn an_address_in_use_names_process_and_address() {
        #[expect(clippy::disallowed_methods, reason = "occupies a port for the test")]
        let taken = UdpSocket::bind("127.0.0.1:0").await.unwrap();
        let address = taken.local_addr().unwrap();
        let (ground, _control) = channels();
        let (_stop, stopped) = watch::channel(false);
        let config = GcsConfig { bind: address, ..config(address) };
        let error = run(config, ground, stopped).await.unwrap_err().to_string();
        assert!(error.contains("autopilot") && error.contains(&address.to_string()), "{error}");
    }

    #[tokio::test]
    async fn the_link_ends_with_the_control_thread() {
        let (ground, control) = channels();
        let (_stop, stopped) = watch::channel(false);
        drop(control);
        let result = run(config(GcsConfig::DEFAULT_BIND), ground, stopped).await;
        assert!(matches!(result, Err(GcsError::ControlEnded)), "{result:?}");
    }
}
