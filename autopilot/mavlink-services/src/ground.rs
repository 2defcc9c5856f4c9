//! The ground-station side as the process uses it: received input goes to the services, and their output to the sockets.

use std::sync::Arc;

use ::mavlink::dialects::common::MavSeverity;
use flight_control::AircraftModel;

use crate::aircraft::Aircraft;
use crate::codec::{Frame, Identity, Message, Skipped};
use crate::command::CommandService;
use crate::component_metadata::Metadata;
use crate::control::{Control, LinkLoss};
use crate::fault_list::FaultListRequest;
use crate::ftp::FtpService;
use crate::heartbeat::{Heartbeat, Ping};
use crate::logs::{LogDone, LogJob, LogService};
use crate::manual::Manual;
use crate::mission::{MissionService, SavedPlan};
use crate::modes::ModeSwitch;
use crate::offboard::Offboard;
use crate::param::{ParamService, ParameterStore, Save, Saved};
use crate::peers::{Address, Connection, Crowding, From, Peer, Peers};
use crate::queues::Intents;
use crate::scripts::Scripts;
use crate::shell::ShellService;
use crate::signing::{Admission, KeyChange, LogLine, Signing};
use crate::statustext::{LogText, StatusTexts};
use crate::streams::{Latest, Streams};
use crate::telemetry::{Host, PeerRates, Telemetry};
use crate::traffic::Traffic;
use crate::wall_time::WallTime;
use crate::{Service, Shared, codec, param, peers, statustext};
use flight_management::command::Intent;
use flight_management::event::{Event, EventKind, Snapshot};
use flight_management::parameters::Parameters;
use flight_management::script::Script;
use flight_management::vehicle::VehicleEvent;

/// The ground-station side without its sockets.
#[derive(Debug)]
pub struct Ground {
    /// MAV_SYS_ID at the start of the process.
    own: Identity,
    pub(crate) shared: Shared,
    pub(crate) services: Services,
    traffic: Traffic,
    skipped: Skipped,
}

macro_rules! services {
    ($($name:ident: $service:ty,)*) => {
        /// One instance of each service.
        #[derive(Debug, Default)]
        pub(crate) struct Services {
            $(pub(crate) $name: $service,)*
        }

        impl Services {
            /// All services, in the order in which they send during one turn.
            fn in_order(&mut self) -> [&mut dyn Service; [$(stringify!($name)),*].len()] {
                [$(&mut self.$name),*]
            }
        }
    };
}

// The heartbeat shows a new mode after the acknowledgement of the command that requested it, and before the telemetry.
services! {
    signing: Signing,
    ping: Ping,
    shell: ShellService,
    fault_list: FaultListRequest,
    command: CommandService,
    param: ParamService,
    offboard: Offboard,
    manual: Manual,
    mode_switch: ModeSwitch,
    mission: MissionService,
    ftp: FtpService,
    logs: LogService,
    link_loss: LinkLoss,
    heartbeat: Heartbeat,
    telemetry: Telemetry,
}

impl Ground {
    /// Starts with the configured peers and no aircraft. `model` scales the effectors' commands and
    /// has their travel.
    pub fn new(parameters: &Parameters, model: &AircraftModel, configured: &[Address]) -> Self {
        let defaults = Parameters::default();
        let shared = Shared {
            parameters: *parameters,
            defaults,
            store: ParameterStore::new(*parameters),
            model: *model,
            aircraft: Aircraft::default(),
            plan_items: 0,
            scripts: Scripts::new(&model.effectors.list),
            control: Control::default(),
            setpoints: Latest::default(),
            pilots: Latest::default(),
            streams: Streams::default(),
            derived: None,
            rates: PeerRates::new(parameters.streams),
            metadata: Metadata::new(&model.effectors.list, &defaults),
            host: Host::default(),
            intents: Intents::default(),
            texts: StatusTexts::default(),
            peers: Peers::new(configured),
        };
        Self {
            own: Identity::autopilot(parameters.link.system_id),
            shared,
            services: Services::default(),
            traffic: Traffic::default(),
            skipped: Skipped::default(),
        }
    }

    /// Sets the defaults of the parameters for this aircraft; call before anything else.
    #[must_use]
    pub fn with_defaults(mut self, defaults: &Parameters) -> Self {
        self.shared.defaults = *defaults;
        // The metadata name the defaults too.
        self.shared.metadata = Metadata::new(self.shared.effectors(), defaults);
        self
    }

    /// Sets what the process reports about itself; call before the first poll.
    #[must_use]
    pub fn with_host(mut self, host: Host) -> Self {
        self.shared.host = host;
        self
    }

    /// Sets the signing key of the last run; call before the first poll.
    #[must_use]
    pub fn with_signing(mut self, signing: Signing) -> Self {
        self.services.signing = signing;
        self
    }

    /// Sets the script that begins with the flight; call before the first poll.
    #[must_use]
    pub fn with_script(mut self, script: Option<Arc<Script>>) -> Self {
        self.shared.scripts.set_scenario(script);
        self
    }

    /// Handles one datagram. Drops the rest of it if there is no room for the answers.
    pub fn handle_datagram(&mut self, address: Address, datagram: &[u8], now: WallTime) {
        let mut rest = datagram;
        while let Some(frame) = codec::next_frame(&mut rest, &mut self.skipped) {
            // An exempt unsigned frame is read as well, but does not make its sender a peer.
            if !self.admits(&frame, now) {
                continue;
            }
            let Some(peer) = self.shared.peers.receive(address, now) else { return };
            if self.shared.peers.can_answer(peer) {
                self.handle_frame(peer, &frame, now);
            } else {
                self.skipped.unanswerable += 1;
            }
        }
        self.send_texts();
    }

    /// Handles bytes read from a connection, cut anywhere. Call only while [`Ground::accepts_input`] allows it.
    pub fn handle_stream(&mut self, connection: Connection, bytes: &[u8], now: WallTime) {
        // The connection is no longer open.
        let Some((_, inbox)) = self.shared.peers.inbox(connection) else { return };
        self.skipped.overflow_bytes += inbox.receive(bytes) as u64;
        self.read_inbox(connection, now);
        self.send_texts();
    }

    /// Handles the frames received over a connection, as far as there is room to answer them.
    fn read_inbox(&mut self, connection: Connection, now: WallTime) {
        let Some((peer, inbox)) = self.shared.peers.inbox(connection) else { return };
        // The services write answers into the same table, so the bytes are taken out meanwhile.
        let bytes = inbox.take();
        let mut rest = &bytes[..];
        let held = loop {
            if !self.shared.peers.can_answer(peer) {
                // Without a byte left there is nothing to resume.
                break !rest.is_empty();
            }
            let Some(frame) = codec::next_frame_of_stream(&mut rest, &mut self.skipped) else {
                break false;
            };
            if self.admits(&frame, now) {
                self.shared.peers.has_sent(peer, now);
                self.handle_frame(peer, &frame, now);
            }
        };
        let used = bytes.len() - rest.len();
        if let Some((_, inbox)) = self.shared.peers.inbox(connection) {
            inbox.put_back(bytes, used, held);
        }
    }

    /// Frames of this autopilot return where another system forwards them.
    fn admits(&mut self, frame: &Frame<'_>, now: WallTime) -> bool {
        frame.sender != self.own && self.services.signing.admit(frame, now) == Admission::Accepted
    }

    fn handle_frame(&mut self, peer: Peer, frame: &Frame<'_>, now: WallTime) {
        self.traffic.record_received(frame);
        let Some((target, message)) = codec::decode(frame) else { return };
        // The target of a ping shows whether it is a request or an answer.
        if !matches!(message, Message::Ping(_)) && !target.reaches(self.own) {
            return;
        }
        let from = From { peer, sender: frame.sender };
        self.shared.note_streams(from, now);
        let mut next = Some(message);
        while let Some(message) = next {
            for service in self.services.in_order() {
                service.handle(from, &message, now, &mut self.shared);
            }
            next = self.shared.derived.take();
        }
    }

    /// Registers a connection that a ground station has opened, from this computer or another one. False if there are
    /// too many.
    pub fn open(&mut self, connection: Connection, is_local: bool, now: WallTime) -> bool {
        self.shared.peers.open(connection, is_local, now).is_some()
    }

    /// The connection to close so that another one can be opened; `None` if all are sending.
    pub fn quiet_connection(&self, now: WallTime) -> Option<Connection> {
        self.shared.peers.quiet_connection(now)
    }

    /// Removes a closed connection.
    pub fn close(&mut self, connection: Connection) {
        self.shared.peers.close(connection);
    }

    /// Handles an event of the control side.
    pub fn handle_event(&mut self, event: &Event, now: WallTime) {
        let Shared { aircraft, texts, parameters, model, control, scripts, .. } = &mut self.shared;
        let is_news = aircraft.handle_event(&event.kind);
        // What the plant only repeats needs no text.
        if is_news {
            texts.handle_event(&event.kind, parameters, &model.effectors.list);
        }
        match event.kind {
            EventKind::Script { script, event } => scripts.handle_event(script, event, texts),
            EventKind::Fault(_) if is_news => self.services.telemetry.hurry_faults(now),
            EventKind::Vehicle(VehicleEvent::Mode(mode)) => {
                let services = self.services.in_order().into_iter();
                if let Some(station) = services.filter_map(|one| one.requester_of(mode)).next() {
                    control.take(station);
                }
            }
            EventKind::Outcome { number, outcome } => {
                for service in self.services.in_order() {
                    service.handle_outcome(number, &outcome, now, &mut self.shared);
                }
            }
            _ => {}
        }
        for service in self.services.in_order() {
            service.handle_event(&event.kind, now, &mut self.shared);
        }
        self.send_texts();
    }

    /// Handles the state at one tick.
    pub fn handle_snapshot(&mut self, snapshot: &Snapshot, now: WallTime) {
        self.shared.aircraft.handle_snapshot(snapshot);
        self.services.telemetry.handle_snapshot(now, &mut self.shared);
        // The state may show another mode than the last event.
        self.services.heartbeat.poll(now, &mut self.shared);
    }

    /// Does what is due.
    pub fn poll(&mut self, now: WallTime) {
        self.shared.peers.poll(now);
        // One turn for each connection: a resumed one may be held again at once.
        for _ in 0..peers::CONNECTIONS_MAX {
            let Some(connection) = self.shared.peers.next_resumable() else { break };
            self.read_inbox(connection, now);
        }
        for service in self.services.in_order() {
            service.poll(now, &mut self.shared);
        }
        self.send_texts();
    }

    /// Ends the process: every station gets a text with the reason and whether the plant ended before it.
    pub fn end(&mut self) {
        let (severity, text) = statustext::text_of_end(self.shared.aircraft.phase());
        self.shared.texts.publish_event(severity, text);
        self.send_texts();
    }

    fn send_texts(&mut self) {
        self.shared.texts.poll(&mut self.shared.peers);
    }

    /// When [`Ground::poll`] has something to do.
    pub fn next_deadline(&mut self) -> WallTime {
        let services = self.services.in_order().into_iter();
        let services = services.filter_map(|service| service.next_deadline(&self.shared));
        services.chain(self.shared.peers.next_deadline()).min().unwrap_or_default()
    }

    /// Whether to read from a connection now; if not, its sender has to wait.
    pub fn accepts_input(&self, connection: Connection) -> bool {
        self.shared.peers.accepts_input(connection)
    }

    /// Waiting input can be answered now, by [`Ground::poll`].
    pub fn can_resume(&self) -> bool {
        self.shared.peers.next_resumable().is_some()
    }

    /// The next tick must publish a snapshot.
    pub fn needs_snapshot(&self) -> bool {
        self.services.telemetry.needs_snapshot()
    }

    /// Next intent for the control thread.
    pub fn pop_intent(&mut self) -> Option<Intent> {
        self.shared.intents.pop()
    }

    /// Whether an intent waits.
    pub fn has_intents(&self) -> bool {
        !self.shared.intents.is_empty()
    }

    /// Next frame to send and its destination, among the peers that can receive now.
    pub fn pop_frame(&mut self, can_send: impl Fn(Address) -> bool) -> Option<(Address, Vec<u8>)> {
        self.shared.peers.pop(self.own, &mut self.services.signing, &mut self.traffic, can_send)
    }

    /// Next text for the flight log that is not the text of an event.
    pub fn pop_text_for_log(&mut self) -> Option<LogText> {
        self.shared.texts.pop_for_log()
    }

    /// Content that the key file should have now, if it is time to write it.
    pub fn pop_key_change(&mut self) -> Option<KeyChange> {
        self.services.signing.pop_change()
    }

    /// Content that the key file must have at the end.
    pub fn last_key_change(&mut self) -> Option<KeyChange> {
        self.services.signing.last_change()
    }

    /// Reports that the key file could not be written.
    pub fn handle_key_unsaved(&mut self, why: &str, now: WallTime) {
        self.shared.texts.warn(now, format!("The signing key is not saved: {why}"));
        self.send_texts();
    }

    /// A log line about signing; the ground stations receive reports of refusals as well.
    pub fn report_signing(&mut self, now: WallTime) -> Option<LogLine> {
        let line = self.services.signing.report(now);
        if let Some(LogLine::Refused(text)) = &line {
            self.shared.texts.publish(MavSeverity::MAV_SEVERITY_WARNING, text.clone());
        }
        self.send_texts();
        line
    }

    /// Saves changes of parameters from now on; `kept` is the saved set.
    pub fn keep_parameters(&mut self, kept: Parameters) {
        self.shared.store.kept = Some(kept);
    }

    /// Next text of the parameter file.
    pub fn pop_save(&mut self) -> Option<Save> {
        self.shared.store.saves.pop()
    }

    /// Handles the result of a save of the parameters.
    pub fn handle_saved(&mut self, saved: &Saved) {
        param::handle_saved(saved, &mut self.shared);
        self.send_texts();
    }

    /// Saves plans from now on; `saved` is the saved plan.
    pub fn keep_plan(&mut self, saved: SavedPlan) {
        self.services.mission.keep(saved);
    }

    /// Next text of the plan file.
    pub fn pop_plan_save(&mut self) -> Option<Save> {
        self.services.mission.pop_save()
    }

    /// Handles the result of a save of the plan.
    pub fn handle_plan_saved(&mut self, saved: &Saved, now: WallTime) {
        self.services.mission.handle_saved(saved, now, &mut self.shared);
        self.send_texts();
    }

    /// Enables the log service: there is a folder with logs.
    pub fn open_log_folder(&mut self) {
        self.services.logs.open_folder();
    }

    /// Next job for the log folder. Call only while no job is running.
    pub fn pop_log_job(&mut self) -> Option<LogJob> {
        self.services.logs.pop_job()
    }

    /// Handles the result of a job of the log folder.
    pub fn handle_log_done(&mut self, done: LogDone, now: WallTime) {
        self.services.logs.handle_done(done, now, &mut self.shared);
        self.send_texts();
    }

    /// Frames for the record of all traffic.
    pub fn traffic(&mut self) -> &mut Traffic {
        &mut self.traffic
    }

    pub fn parameters(&self) -> &Parameters {
        &self.shared.parameters
    }

    /// Messages to the present peers dropped so far: telemetry, announcements, answers.
    pub fn dropped(&self) -> [u64; 3] {
        self.shared.peers.dropped()
    }

    /// Counts of visitors beyond the limit so far.
    pub fn crowding(&self) -> Crowding {
        self.shared.peers.crowding()
    }

    /// What the codec has skipped in the input so far.
    pub fn skipped(&self) -> Skipped {
        self.skipped
    }
}
