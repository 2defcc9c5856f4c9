//! The ground-station link: its sockets, and the channels to the control thread, around
//! [`mavlink_services::Ground`].
//!
//! ```text
//!  udp client ──┐                 ┌── Ground ──┐   intents   > control thread
//!  udp server ──┼── Sockets ──────┤            ├── events    <
//!  tcp server ──┘  never waits    └────────────┘   snapshots <
//! ```
//!
//! One task serves all sockets: it reads what has arrived, passes it to [`mavlink_services::Ground`], and offers each
//! socket its waiting frames. A blocked socket delays its own queue and no other.
//!
//! Ground stations remember the source address of datagrams, so one socket calls all of them.

use core::future::{pending, poll_fn};
use core::time::Duration;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use flight_control::AircraftModel;
use host_io::file::OwnFile;
use host_io::instance;
use host_io::problem::{At as _, Problem, problem};
use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};
use tracing::{info, warn};

use super::HERE;
use super::log_folder::{LogFolder, Tlog, make_room, share};
use super::plant_link::GroundChannels;
use super::recorder::GroundFeed;
use super::status::Listening;
use super::store::{Change, KeptKey, KeptParameters, KeptPlan, Store};
use crate::clock::{self, WallTime};
use flight_management::command::Intent;
use flight_management::event::{Event, Snapshot};
use flight_management::parameters::Parameters;
use flight_management::script::Script;
use mavlink_services::Ground;
use mavlink_services::heartbeat::HeartbeatIdentity;
use mavlink_services::logs::LogDone;
use mavlink_services::param::Saved;
use mavlink_services::peers::{
    Address, CONFIGURED_MAX, CONNECTIONS_MAX, Connection, Crowding, VISITORS_MAX, is_this_computer,
};
use mavlink_services::signing::{LogLine, Signing};
use mavlink_services::telemetry::Host;
use sockets::{Arrival, READ_MAX, Sockets};

mod sockets;

/// Names of the links, for messages: which option to change if one cannot be opened.
const UDP_CLIENT: &str = "UDP socket that calls ground stations (--gcs-bind)";
const UDP_SERVER: &str = "UDP port for ground stations that call (--gcs-udp-server)";
const TCP_SERVER: &str = "TCP port for ground stations that connect (--gcs-tcp)";

/// Events taken in a row, so that the sockets get their turn.
const EVENTS_IN_A_ROW: usize = 64;
/// Shortest sleep: an overdue deadline that cannot be met yet must not spin.
const SLEEP_MIN: Duration = Duration::from_millis(1);
/// A full intent channel is tried again after this.
const RETRY: Duration = Duration::from_millis(2);

/// The sockets to open.
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

/// Settings of the ground-station link at its start.
#[derive(Debug, Clone)]
pub struct GcsConfig {
    /// The sockets to open.
    pub links: Links,
    /// Parameters at start; the control side must have started with the same.
    pub parameters: Parameters,
    /// The controller's model; scales the effectors' commands.
    pub model: AircraftModel,
    /// Defaults of the parameters for this aircraft.
    pub defaults: Parameters,
    /// The autopilot that heartbeats name.
    pub identity: HeartbeatIdentity,
    /// The script that begins with each flight, as on the control side.
    pub script: Option<Arc<Script>>,
    /// The parameter file and its content, if changes are saved.
    pub kept: Option<KeptParameters>,
    /// The plan file and its content, if the plan is saved.
    pub kept_plan: Option<KeptPlan>,
    /// The file of the signing key and its content, if the key is saved.
    pub kept_key: Option<KeptKey>,
    /// Folder of the logs.
    pub logs: Option<Logs>,
}

/// The control thread has ended, and the link before it was stopped.
#[derive(Debug, thiserror::Error)]
#[error("autopilot: the control thread has ended")]
pub struct ControlEnded;

/// A socket could not be opened; `link` names it, and the option that sets it.
fn unopened(link: &'static str, address: SocketAddr) -> impl Fn(io::Error) -> Problem {
    move |source| {
        // For an address that another process has.
        let advice = match source.kind() {
            io::ErrorKind::AddrInUse => format!("; {}", instance::ADVICE),
            _ => String::new(),
        };
        problem!("cannot open {address}, the {link}: {source}{advice}")
    }
}

/// The link with open sockets.
#[derive(Debug)]
pub struct GcsLink {
    ground: Ground,
    sockets: Sockets,
    listening: Listening,
    stores: Stores,
    /// Sends changed parameters and texts to the recorder.
    pub ground_feed: Option<GroundFeed>,
    logs: Option<LogFolder>,
    tlog: Option<Tlog>,
    /// An intent that found no room in the channel.
    held_back: Option<Intent>,
    refusals: RefusalLog,
}

impl GcsLink {
    /// Opens the sockets. Requires the runtime that will serve them.
    pub async fn open(config: &GcsConfig) -> Result<Self, Problem> {
        let GcsConfig { links, parameters, model, defaults, identity, script, logs, .. } = config;
        let bind = links.client_bind;
        let other = links.clients.iter().find(|address| address.is_ipv4() != bind.is_ipv4());
        if let Some(&endpoint) = other {
            return Err(problem!(
                "{HERE}: ground station {endpoint} cannot be reached from {bind}: IPv4 and IPv6 do not mix"
            ));
        }
        if links.clients.len() > CONFIGURED_MAX {
            return Err(problem!(
                "{HERE}: {} ground stations to call (--gcs); at most {CONFIGURED_MAX} are allowed",
                links.clients.len()
            ));
        }
        let sockets = Sockets::open(links).await.at(HERE)?;
        let listening = sockets.listening(links).at(HERE)?;
        let configured: Vec<Address> =
            links.clients.iter().copied().map(Address::UdpClient).collect();
        let host = Host { identity: *identity, unix_start_us: clock::unix_start_us() };
        let mut ground = Ground::new(parameters, model, &configured)
            .with_defaults(defaults)
            .with_host(host)
            .with_script(script.clone());
        if let Some(kept) = &config.kept {
            ground.keep_parameters(kept.parameters);
        }
        if let Some(kept) = &config.kept_plan {
            ground.keep_plan(kept.plan.clone());
        }
        let mut signing = Signing::new(host.unix_start_us);
        if let Some(kept) = &config.kept_key {
            signing = signing.with_file(kept.record);
        }
        ground = ground.with_signing(signing);
        let stores = Stores::open(config).at(HERE)?;
        let folder = logs.as_ref().map(|logs| LogFolder::open(&logs.folder));
        let folder = folder.transpose().at("autopilot: cannot offer logs")?;
        let tlog = logs.as_ref().and_then(|logs| logs.open_tlog(host.unix_start_us));
        if folder.is_some() {
            ground.open_log_folder();
        }
        if tlog.is_some() {
            ground.traffic().record_from_now();
        }
        Ok(Self {
            ground,
            sockets,
            listening,
            stores,
            ground_feed: None,
            logs: folder,
            tlog,
            held_back: None,
            refusals: RefusalLog::default(),
        })
    }

    /// Addresses at which ground stations are called or can connect.
    pub fn listening(&self) -> &Listening {
        &self.listening
    }

    /// Serves ground stations until `shutdown` becomes true or its sender is dropped.
    pub async fn run(
        mut self,
        mut channels: GroundChannels,
        mut shutdown: watch::Receiver<bool>,
    ) -> Result<(), ControlEnded> {
        let Listening { clients, udp_server, tcp_server } = &self.listening;
        info!(
            ?clients,
            udp_server = udp_server.map(tracing::field::display),
            tcp_server = tcp_server.map(tracing::field::display),
            "ground stations"
        );
        let result = tokio::select! {
            // An error means that the sender is gone, which ends the link as well.
            _ = shutdown.wait_for(|stop| *stop) => Ok(()),
            result = self.serve(&mut channels) => result,
        };
        // A frame that no socket accepts at once is lost: no client may keep the process from ending.
        // The last text leaves with the frames that wait.
        self.ground.end();
        self.send(clock::now());
        self.stores.finish(&mut self.ground);
        result
    }

    async fn serve(&mut self, channels: &mut GroundChannels) -> Result<(), ControlEnded> {
        let mut buffer = [0; READ_MAX];
        loop {
            let now = clock::now();
            self.ground.poll(now);
            self.pass_intents(channels)?;
            if let Some(feed) = self.ground_feed.as_mut() {
                feed.follow(&mut self.ground);
            }
            self.stores.poll(&mut self.ground, now);
            if let Some(logs) = self.logs.as_mut().filter(|logs| !logs.is_busy())
                && let Some(job) = self.ground.pop_log_job()
            {
                logs.begin(job);
            }
            let wanted = self.ground.needs_snapshot();
            // Relaxed, because a snapshot of one tick later is as good.
            channels.snapshot_wanted.store(wanted, Ordering::Relaxed);
            self.send(now);
            let deadline = self.next_wake(now);
            let input = self.next_input(channels, &mut buffer, deadline, now).await;
            // Read again: the wait may have been long.
            let now = clock::now();
            match input {
                LinkInput::Socket(arrival) => self.handle_arrival(&arrival, &buffer, now),
                LinkInput::Event(event) => {
                    self.ground.handle_event(&event, now);
                    // The sockets wait for this loop, so it has an end.
                    for _ in 1..EVENTS_IN_A_ROW {
                        let Ok(event) = channels.events.try_recv() else { break };
                        self.ground.handle_event(&event, now);
                    }
                }
                LinkInput::Snapshot(snapshot) => self.ground.handle_snapshot(&snapshot, now),
                LinkInput::LogDone(done) => self.ground.handle_log_done(done, now),
                LinkInput::Time => {}
                LinkInput::ControlEnded => return Err(ControlEnded),
            }
        }
    }

    fn next_wake(&mut self, now: WallTime) -> Instant {
        let mut deadline = self.ground.next_deadline().max(now + SLEEP_MIN);
        if self.held_back.is_some() || self.ground.has_intents() {
            deadline = deadline.min(now + RETRY);
        }
        if self.ground.can_resume() {
            // Sent frames made room for waiting input.
            deadline = now;
        }
        clock::instant(deadline).into()
    }

    async fn next_input(
        &mut self,
        channels: &mut GroundChannels,
        buffer: &mut [u8],
        deadline: Instant,
        now: WallTime,
    ) -> LinkInput {
        let Self { ground, sockets, logs, .. } = self;
        let accepts = |connection| ground.accepts_input(connection);
        // Never without a folder.
        let log_done = async {
            match logs {
                Some(logs) => logs.outcome().await,
                None => pending().await,
            }
        };
        // Not biased: each source gets its turn, also beside a flood of messages.
        tokio::select! {
            arrival = poll_fn(|cx| sockets.poll(cx, buffer, &accepts, now)) => {
                LinkInput::Socket(arrival)
            }
            event = channels.events.recv() => event.map_or(LinkInput::ControlEnded, LinkInput::Event),
            snapshot = channels.snapshots.recv() => {
                snapshot.map_or(LinkInput::ControlEnded, |snapshot| LinkInput::Snapshot(Box::new(snapshot)))
            }
            done = log_done => LinkInput::LogDone(done),
            () = sleep_until(deadline) => LinkInput::Time,
        }
    }

    fn handle_arrival(&mut self, arrival: &Arrival, buffer: &[u8], now: WallTime) {
        let bytes = |length: usize| buffer.get(..length).unwrap_or(buffer);
        match *arrival {
            Arrival::Datagram { from, length } => {
                self.ground.handle_datagram(from, bytes(length), now);
                self.refusals.update(self.ground.crowding());
            }
            Arrival::Bytes { connection, length } => {
                self.ground.handle_stream(connection, bytes(length), now);
            }
            Arrival::Opened { connection, from } => {
                let mut is_open = self.ground.open(connection, is_this_computer(from), now);
                // Who is silent gives its place to a newcomer.
                if !is_open && let Some(quiet) = self.ground.quiet_connection(now) {
                    self.close(quiet, "it is silent, and another one came");
                    is_open = self.ground.open(connection, is_this_computer(from), now);
                }
                if is_open {
                    info!(%from, "ground-station connection opened");
                } else {
                    self.sockets.close(connection);
                    self.refusals.connection_refused(from);
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

    /// Sends intents to the control thread while there is room.
    fn pass_intents(&mut self, channels: &GroundChannels) -> Result<(), ControlEnded> {
        while let Some(intent) = self.held_back.take().or_else(|| self.ground.pop_intent()) {
            match channels.intents.try_send(intent) {
                Ok(()) => {}
                Err(TrySendError::Full(intent)) => {
                    self.held_back = Some(intent);
                    return Ok(());
                }
                Err(TrySendError::Closed(_)) => return Err(ControlEnded),
            }
        }
        Ok(())
    }

    /// Writes the frames received and sent to the log of traffic.
    fn record_traffic(&mut self, now: WallTime) {
        let Some(tlog) = &mut self.tlog else { return };
        let traffic = self.ground.traffic();
        while let Some(frame) = traffic.pop() {
            tlog.record(now, frame);
        }
        tlog.left_out(traffic.take_dropped());
    }

    /// Offers each socket its waiting frames, and closes connections that accept nothing for long.
    fn send(&mut self, now: WallTime) {
        // Requests before their answers.
        self.record_traffic(now);
        loop {
            let sockets = &self.sockets;
            let frame = self.ground.pop_frame(|address| sockets.can_send(address));
            let Some((to, frame)) = frame else { break };
            self.record_traffic(now);
            self.sockets.send(to, frame, now);
        }
        while let Some(connection) = self.sockets.stalled(now) {
            self.close(connection, "it reads nothing");
        }
    }
}

enum LinkInput {
    Socket(Arrival),
    Event(Event),
    Snapshot(Box<Snapshot>),
    LogDone(LogDone),
    Time,
    ControlEnded,
}

/// Warns of ground stations beyond the limit. One without a place may retry without end, so the log gets the first
/// refusal of each kind, and then each doubling.
#[derive(Debug, Default)]
struct RefusalLog {
    /// Connections closed on arrival, since there were too many.
    connections: u64,
    crowding: Crowding,
}

impl RefusalLog {
    fn connection_refused(&mut self, from: SocketAddr) {
        self.connections += 1;
        if self.connections.is_power_of_two() {
            warn!(
                %from,
                limit = CONNECTIONS_MAX,
                refused = self.connections,
                "a ground-station connection was refused: there are too many"
            );
        }
    }

    /// Logs changes since the last call, which happens once for each datagram.
    fn update(&mut self, now: Crowding) {
        let before = std::mem::replace(&mut self.crowding, now);
        let is_due = |count: u64, before: u64| count != before && count.is_power_of_two();
        let Crowding { displaced, turned_away } = now;
        if is_due(displaced, before.displaced) {
            warn!(
                limit = VISITORS_MAX,
                displaced, "a ground station lost its place to another one: too many call by UDP"
            );
        }
        if is_due(turned_away, before.turned_away) {
            warn!(
                limit = VISITORS_MAX,
                turned_away,
                "messages of a ground station were ignored: too many call by UDP; TCP and --gcs have places of their own"
            );
        }
    }
}

/// Folder in which the autopilot writes logs and offers them to ground stations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Logs {
    pub folder: PathBuf,
    /// All logs together, bytes.
    pub limit_bytes: u64,
}

impl Logs {
    /// Begins the log of traffic; if it cannot, the flight continues without.
    fn open_tlog(&self, unix_start_us: Option<u64>) -> Option<Tlog> {
        let Self { folder, limit_bytes } = self;
        make_room(folder, *limit_bytes);
        let tlog = Tlog::open(folder, unix_start_us.unwrap_or_default(), share(*limit_bytes));
        tlog.inspect_err(|error| {
            warn!(folder = %folder.display(), %error, "there is no log of the MAVLink traffic");
        })
        .ok()
    }
}

/// Passes a change to a writer, if there is one, and gives the result of its latest write.
fn exchange<C: Into<Change>>(
    store: &Option<Store>,
    change: impl FnOnce() -> Option<C>,
) -> Option<Saved> {
    let store = store.as_ref()?;
    if let Some(change) = change() {
        store.change(change);
    }
    store.outcome()
}

/// The writers of the files saved for the next start. Dropping one waits until everything is written.
#[derive(Debug)]
struct Stores {
    parameters: Option<Store>,
    plan: Option<Store>,
    key: Option<Store>,
}

impl Stores {
    fn open(config: &GcsConfig) -> Result<Self, Problem> {
        let open = |file: Option<OwnFile>, name| {
            let store = file.map(|file| Store::open(file, name)).transpose();
            store.at(format!("cannot keep the {name}"))
        };
        let GcsConfig { kept, kept_plan, kept_key, .. } = config;
        Ok(Self {
            parameters: open(kept.as_ref().map(KeptParameters::own_file), "parameter file")?,
            plan: open(kept_plan.as_ref().map(KeptPlan::own_file), "plan file")?,
            key: open(kept_key.as_ref().map(KeptKey::own_file), "signing key")?,
        })
    }

    /// Passes changed contents to the writers, and reports their results.
    fn poll(&self, ground: &mut Ground, now: WallTime) {
        if let Some(saved) = exchange(&self.parameters, || ground.pop_save()) {
            ground.handle_saved(&saved);
        }
        if let Some(saved) = exchange(&self.plan, || ground.pop_plan_save()) {
            ground.handle_plan_saved(&saved, now);
        }
        while let Some(line) = ground.report_signing(now) {
            match line {
                LogLine::Turned(line) => info!("{line}"),
                LogLine::Refused(line) => warn!("{line}"),
            }
        }
        let saved = exchange(&self.key, || ground.pop_key_change());
        if let Some(why) = saved.and_then(|saved| saved.result.err()) {
            ground.handle_key_unsaved(&why, now);
        }
    }

    /// Writes the final key file: no more frames are sent or accepted, so its time is the last one.
    fn finish(&self, ground: &mut Ground) {
        if let (Some(store), Some(change)) = (&self.key, ground.last_key_change()) {
            store.change(change);
        }
    }
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod file_tests {
    use super::*;

    #[test]
    fn the_log_of_traffic_has_an_eighth_of_the_limit_of_all_logs() {
        let folder = tempfile::tempdir().unwrap();
        let logs = Logs { folder: folder.path().to_path_buf(), limit_bytes: 800 };
        let mut tlog = logs.open_tlog(None).unwrap();
        for _ in 0..100 {
            tlog.record(WallTime::ZERO, b"frame".to_vec());
        }
        drop(tlog);
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let bytes: u64 = entries.map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
        assert_eq!(bytes, 7 * 13, "whole frames in 100 bytes");
    }
}
