//! The ground-station link: its sockets, and the channels to the control thread, around
//! [`mavlink_services::Ground`].
//!
//! ```text
//!  udp client ──┐                 ┌── Ground ──┐   intents   > control thread
//!  udp server ──┼── Sockets ──────┤            ├── events    <
//!  tcp server ──┘  never waits    └────────────┘   snapshots <
//! ```
//!
//! One task serves all: it asks what happened, hands it to [`mavlink_services::Ground`], and offers each
//! socket what waits for it. A socket that takes nothing keeps its own queue waiting and no other.
//!
//! Ground stations remember the address that datagrams come from, so one socket calls all of them.

use core::future::poll_fn;
use core::time::Duration;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use flight_control::AircraftModel;
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};
use tracing::info;

use super::channels::GroundChannels;
use super::key_store::{KeptKey, KeyStore};
use super::log_folder::LogFolder;
use super::recorder::GroundFeed;
use super::status::Listening;
use super::store::{Kept, KeptPlan, Store};
use super::tlog::Tlog;
use crate::clock::{self, WallTime};
use crowd::Crowd;
use flight_management::command::Intent;
use flight_management::event::{Event, Snapshot};
use flight_management::parameters::Parameters;
use flight_management::script::Script;
use logs::{next_done, open_tlog};
use mavlink_services::Ground;
use mavlink_services::heartbeat::HeartbeatIdentity;
use mavlink_services::logs::LogDone;
use mavlink_services::peers::{Address, CONFIGURED_MAX, Connection, is_this_computer};
use mavlink_services::signing::Signing;
use mavlink_services::telemetry::Host;
use sockets::{Arrival, READ_MAX, Sockets};

mod crowd;
mod keeping;
mod logs;
mod sockets;
mod tcp;
mod udp;

pub use logs::Logs;

/// Names of the links, for messages: what to change if one cannot be opened.
const UDP_CLIENT: &str = "UDP socket that calls ground stations (--gcs-bind)";
const UDP_SERVER: &str = "UDP port for ground stations that call (--gcs-udp-server)";
const TCP_SERVER: &str = "TCP port for ground stations that connect (--gcs-tcp)";

/// Events taken in a row, so that the sockets get their turn.
const EVENTS_IN_A_ROW: usize = 64;
/// Shortest sleep: an overdue deadline that cannot be met yet must not spin.
const SLEEP_MIN: Duration = Duration::from_millis(1);
/// A full intent channel is tried again after this.
const RETRY: Duration = Duration::from_millis(2);

/// Which sockets there are to be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Links {
    /// Ground stations that are called, at most [`CONFIGURED_MAX`].
    pub clients: Vec<SocketAddr>,
    /// Own address of the socket that calls them: an address of this machine, port 0 for any.
    pub client_bind: SocketAddr,
    /// Own address for ground stations that call by UDP.
    pub udp_server: Option<SocketAddr>,
    /// Own address for ground stations that connect by TCP.
    pub tcp_server: Option<SocketAddr>,
}

/// What the ground-station link starts from.
#[derive(Debug, Clone)]
pub struct GcsConfig {
    /// Which sockets.
    pub links: Links,
    /// Parameters at start; the control side must have started with the same.
    pub parameters: Parameters,
    /// The controller's model; scales the effectors' commands.
    pub model: AircraftModel,
    /// Defaults of the parameters for this aircraft.
    pub defaults: Parameters,
    /// The autopilot that heartbeats name.
    pub identity: HeartbeatIdentity,
    /// What begins with each flight, as on the control side.
    pub script: Option<Arc<Script>>,
    /// Where changes of parameters are kept, and what is kept already.
    pub kept: Option<Kept>,
    /// Where the plan is kept, and what is kept already.
    pub kept_plan: Option<KeptPlan>,
    /// Where the signing key is kept, and the key that is there already.
    pub kept_key: Option<KeptKey>,
    /// Where logs are.
    pub logs: Option<Logs>,
}

/// Why the link ends before it is told to.
#[derive(Debug, thiserror::Error)]
pub enum GcsError {
    /// No socket.
    #[error("autopilot: cannot open {address}, the {link}: {source}")]
    Bind {
        /// Which one, and the option that sets it.
        link: &'static str,
        /// The address asked for.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// A ground station that the socket cannot reach: IPv4 and IPv6 do not mix.
    #[error(
        "autopilot: ground station {endpoint} cannot be reached from {bind}: IPv4 and IPv6 do not mix"
    )]
    Family {
        /// The ground station.
        endpoint: SocketAddr,
        /// Own address.
        bind: SocketAddr,
    },
    /// Too many ground stations to call.
    #[error(
        "autopilot: {count} ground stations to call (--gcs); at most {CONFIGURED_MAX} are allowed"
    )]
    TooMany {
        /// How many were asked for.
        count: usize,
    },
    /// No thread for the parameter file or the plan file.
    #[error("autopilot: cannot keep parameters and plan: {0}")]
    Store(io::Error),
    /// No thread for the signing key.
    #[error("autopilot: cannot keep the signing key: {0}")]
    KeyStore(io::Error),
    /// No thread for the log folder.
    #[error("autopilot: cannot offer logs: {0}")]
    Logs(io::Error),
    /// The control thread has ended.
    #[error("autopilot: the control thread has ended")]
    ControlEnded,
}

/// The link with open sockets, before it serves anybody.
#[derive(Debug)]
pub struct GcsLink {
    ground: Ground,
    sockets: Sockets,
    listening: Listening,
    store: Option<Store>,
    plan_store: Option<Store>,
    key_store: Option<KeyStore>,
    ground_feed: Option<GroundFeed>,
    logs: Option<LogFolder>,
    tlog: Option<Tlog>,
}

impl GcsLink {
    /// Opens the sockets. Needs the runtime that will serve them.
    ///
    /// # Errors
    /// [`GcsError`] names the link and its address.
    pub async fn open(config: &GcsConfig) -> Result<Self, GcsError> {
        let GcsConfig {
            links,
            parameters,
            model,
            defaults,
            identity,
            script,
            kept,
            kept_plan,
            kept_key,
            logs,
        } = config;
        let bind = links.client_bind;
        let other = links.clients.iter().find(|address| address.is_ipv4() != bind.is_ipv4());
        if let Some(&endpoint) = other {
            return Err(GcsError::Family { endpoint, bind });
        }
        if links.clients.len() > CONFIGURED_MAX {
            return Err(GcsError::TooMany { count: links.clients.len() });
        }
        let sockets = Sockets::open(links).await?;
        let listening = sockets.listening(links)?;
        let configured: Vec<Address> =
            links.clients.iter().copied().map(Address::UdpClient).collect();
        let host = Host { identity: *identity, unix_start_us: clock::unix_start_us() };
        let mut ground = Ground::new(parameters, model, &configured)
            .with_defaults(defaults)
            .with_host(host)
            .with_script(script.clone());
        let mut store = None;
        if let Some(kept) = kept {
            ground.keep_parameters(kept.parameters);
            store = Some(Store::open(kept.own_file(), "parameter file").map_err(GcsError::Store)?);
        }
        let mut plan_store = None;
        if let Some(kept) = kept_plan {
            ground.keep_plan(kept.plan.clone());
            plan_store = Some(Store::open(kept.own_file(), "plan file").map_err(GcsError::Store)?);
        }
        let mut signing = Signing::new(host.unix_start_us);
        let mut key_store = None;
        if let Some(kept) = kept_key {
            signing = signing.with_file(kept.record);
            key_store = Some(KeyStore::open(&kept.path).map_err(GcsError::KeyStore)?);
        }
        ground = ground.with_signing(signing);
        let folder = logs.as_ref().map(|logs| LogFolder::open(&logs.folder));
        let folder = folder.transpose().map_err(GcsError::Logs)?;
        let tlog = logs.as_ref().and_then(|logs| open_tlog(logs, host.unix_start_us));
        if folder.is_some() {
            ground.open_log_folder();
        }
        if tlog.is_some() {
            ground.traffic().want();
        }
        Ok(Self {
            ground,
            sockets,
            listening,
            store,
            plan_store,
            key_store,
            ground_feed: None,
            logs: folder,
            tlog,
        })
    }

    /// Tells the recorder of parameters that change and of texts.
    #[must_use]
    pub fn with_ground_feed(mut self, feed: Option<GroundFeed>) -> Self {
        self.ground_feed = feed;
        self
    }

    /// Where ground stations can be.
    #[must_use]
    pub fn listening(&self) -> &Listening {
        &self.listening
    }

    /// Serves ground stations until `shutdown` becomes true or its sender is dropped.
    ///
    /// # Errors
    /// [`GcsError::ControlEnded`] when the control thread ends.
    pub async fn run(
        self,
        channels: GroundChannels,
        mut shutdown: watch::Receiver<bool>,
    ) -> Result<(), GcsError> {
        let Self {
            ground,
            sockets,
            listening,
            store,
            plan_store,
            key_store,
            ground_feed,
            logs,
            tlog,
        } = self;
        let Listening { clients, udp_server, tcp_server } = listening;
        info!(
            ?clients,
            udp_server = udp_server.map(tracing::field::display),
            tcp_server = tcp_server.map(tracing::field::display),
            "ground stations"
        );
        let mut link = Link {
            ground,
            sockets,
            channels,
            store,
            plan_store,
            key_store,
            ground_feed,
            logs,
            tlog,
            held_back: None,
            crowd: Crowd::default(),
        };
        let result = tokio::select! {
            // An error means that the sender is gone, which ends the link as well.
            _ = shutdown.wait_for(|stop| *stop) => Ok(()),
            result = link.serve() => result,
        };
        // What no socket takes at once is lost: nobody may keep the process from ending.
        link.ground.end();
        link.send(clock::now());
        link.close_key();
        result
    }
}

struct Link {
    ground: Ground,
    sockets: Sockets,
    channels: GroundChannels,
    /// Gone, it has written everything.
    store: Option<Store>,
    /// Likewise.
    plan_store: Option<Store>,
    /// Likewise.
    key_store: Option<KeyStore>,
    ground_feed: Option<GroundFeed>,
    logs: Option<LogFolder>,
    tlog: Option<Tlog>,
    /// An intent that found no room in the channel.
    held_back: Option<Intent>,
    crowd: Crowd,
}

enum Input {
    Socket(Arrival),
    Event(Event),
    Snapshot(Box<Snapshot>),
    LogDone(LogDone),
    Time,
    ControlEnded,
}

impl Link {
    async fn serve(&mut self) -> Result<(), GcsError> {
        let mut buffer = [0; READ_MAX];
        loop {
            let now = clock::now();
            self.ground.poll(now);
            self.pass_intents()?;
            if let Some(feed) = self.ground_feed.as_mut() {
                feed.follow(&mut self.ground);
            }
            self.keep_files(now);
            self.keep_key(now);
            self.begin_log_job();
            let wanted = self.ground.wants_snapshot();
            self.channels.snapshot_wanted.store(wanted, Ordering::Relaxed);
            self.send(now);
            let deadline = self.next_wake(now);
            let input = self.next_input(&mut buffer, deadline, now).await;
            let now = clock::now();
            match input {
                Input::Socket(arrival) => self.handle_arrival(&arrival, &buffer, now),
                Input::Event(event) => {
                    self.ground.handle_event(&event, now);
                    for _ in 1..EVENTS_IN_A_ROW {
                        let Ok(event) = self.channels.events.try_recv() else { break };
                        self.ground.handle_event(&event, now);
                    }
                }
                Input::Snapshot(snapshot) => self.ground.handle_snapshot(&snapshot, now),
                Input::LogDone(done) => self.ground.handle_log_done(done, now),
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
        if self.ground.can_resume() {
            // What was sent made room for input that waits.
            deadline = now;
        }
        clock::instant(deadline).into()
    }

    async fn next_input(&mut self, buffer: &mut [u8], deadline: Instant, now: WallTime) -> Input {
        let Self { ground, sockets, channels, logs, .. } = self;
        let accepts = |connection| ground.accepts_input(connection);
        // Not biased: each source gets its turn, also beside a flood of messages.
        tokio::select! {
            arrival = poll_fn(|cx| sockets.poll(cx, buffer, &accepts, now)) => {
                Input::Socket(arrival)
            }
            event = channels.events.recv() => event.map_or(Input::ControlEnded, Input::Event),
            snapshot = channels.snapshots.recv() => {
                snapshot.map_or(Input::ControlEnded, |snapshot| Input::Snapshot(Box::new(snapshot)))
            }
            done = next_done(logs) => Input::LogDone(done),
            () = sleep_until(deadline) => Input::Time,
        }
    }

    fn handle_arrival(&mut self, arrival: &Arrival, buffer: &[u8], now: WallTime) {
        let bytes = |length: usize| buffer.get(..length).unwrap_or(buffer);
        match *arrival {
            Arrival::Datagram { from, length } => {
                self.ground.handle_datagram(from, bytes(length), now);
                self.crowd.follow(self.ground.crowding());
            }
            Arrival::Bytes { connection, length } => {
                self.ground.handle_stream(connection, bytes(length), now);
            }
            Arrival::Opened { connection, from } => {
                if self.ground.open(connection, is_this_computer(from), now) {
                    info!(%from, "ground-station connection opened");
                } else {
                    self.sockets.close(connection);
                    self.crowd.refuse(from);
                }
            }
            Arrival::Closed(connection) => self.close(connection, "by the ground station"),
            Arrival::Writable => {}
        }
    }

    fn close(&mut self, connection: Connection, why: &str) {
        self.ground.close(connection);
        if let Some(from) = self.sockets.close(connection) {
            info!(%from, why, "ground-station connection closed");
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

    /// Offers each socket what waits for it, and gives up connections that take nothing for long.
    fn send(&mut self, now: WallTime) {
        // Questions before their answers.
        self.record_heard(now);
        loop {
            let sockets = &self.sockets;
            let frame = self.ground.pop_frame(|address| sockets.can_send(address));
            let Some((to, frame)) = frame else { break };
            if let Some(tlog) = &mut self.tlog {
                tlog.record(now, &frame);
            }
            self.sockets.send(to, frame, now);
        }
        while let Some(connection) = self.sockets.stalled(now) {
            self.close(connection, "it reads nothing");
        }
    }
}

#[cfg(test)]
mod tests;
