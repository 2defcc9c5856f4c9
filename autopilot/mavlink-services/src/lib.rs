//! The MAVLink services: bytes in, bytes out, in between one file for each service. No sockets, no clock.
//!
//! ```text
//!                                  ┌─ command, failure    param, mode_switch ─┐
//!  datagrams, ─> codec ─> signing ─┼─ offboard, manual    mission, link_loss  ├─> peers (outboxes) ─> datagrams,
//!  streams                         ├─ ftp, scripts        shell, logs         │                       streams
//!     events ────────> Ground ────>├─ fault_list          statustext          │
//!  snapshots ────────>             └─ heartbeat           telemetry, ping ────┘
//!                                          └──> intents ──> control thread
//! ```
//!
//! A service has up to three verbs: `handle` reacts to one message, `poll` does what is due, and
//! `next_deadline` says when that will be. Time is an argument.
//!
//! Start with [`Ground`]. A process feeds it what its sockets receive, and sends what it hands out:
//!
//! ```
//! use flight_management::configuration::{DEFAULT_MODEL, model};
//! use mavlink_services::Ground;
//! use mavlink_services::peers::Address;
//! use mavlink_services::wall_time::WallTime;
//!
//! let model = model("tvc_jet.toml", DEFAULT_MODEL)?;
//! let station = Address::UdpClient("127.0.0.1:14550".parse().expect("an address"));
//! let mut ground = Ground::new(&model.defaults, &model.aircraft, &[station]);
//! ground.poll(WallTime::ZERO);
//! let (to, frame) = ground.pop_frame(|_| true).expect("a heartbeat");
//! assert_eq!((to, frame[0]), (station, 0xFD));
//! # Ok::<(), flight_management::configuration::ConfigError>(())
//! ```

use flight_control::AircraftModel;

use crate::wall_time::WallTime;
use flight_management::event::{Event, EventKind, Snapshot};
use flight_management::parameters::Parameters;
use flight_management::vehicle::{Mode, VehicleEvent};

pub mod aircraft;
pub mod codec;
pub mod command;
pub mod component_metadata;
pub mod context;
pub mod control;
pub mod convert;
pub mod failure;
pub mod fall_back;
pub mod fault_list;
pub mod ftp;
pub mod heartbeat;
pub mod inbox;
pub mod intents;
pub mod link_loss;
pub mod logs;
pub mod manual;
pub mod mission;
pub mod mode_switch;
mod modes;
pub mod offboard;
pub mod outbox;
mod outside;
pub mod param;
pub mod peers;
pub mod pending;
pub mod ping;
pub mod reasons;
pub mod refused;
pub mod scripts;
pub mod shell;
pub mod signing;
pub mod statustext;
pub mod telemetry;
pub mod traffic;
pub mod wall_time;

use aircraft::Aircraft;
use codec::{Frame, Identity, Message, Skipped};
use command::CommandService;
use context::{Context, From};
use control::Control;
use fault_list::ListRequest;
use ftp::FtpService;
use heartbeat::Heartbeat;
use intents::Intents;
use link_loss::LinkLoss;
use logs::LogService;
use manual::Manual;
use mission::MissionService;
use mode_switch::ModeSwitch;
use offboard::Offboard;
use param::ParamService;
use peers::{Address, Connection, Peer, Peers};
use scripts::Scripts;
use shell::ShellService;
use signing::{Admission, Signing};
use statustext::StatusTexts;
use telemetry::{Host, Telemetry};
use traffic::Traffic;

/// The ground-station side without its sockets.
#[derive(Debug)]
pub struct Ground {
    /// MAV_SYS_ID as it was at the start.
    own: Identity,
    parameters: Parameters,
    /// Their defaults for this aircraft.
    defaults: Parameters,
    model: AircraftModel,
    aircraft: Aircraft,
    intents: Intents,
    peers: Peers,
    texts: StatusTexts,
    heartbeat: Heartbeat,
    telemetry: Telemetry,
    command: CommandService,
    param: ParamService,
    offboard: Offboard,
    manual: Manual,
    mode_switch: ModeSwitch,
    mission: MissionService,
    fault_list: ListRequest,
    ftp: FtpService,
    scripts: Scripts,
    shell: ShellService,
    logs: LogService,
    traffic: Traffic,
    link_loss: LinkLoss,
    control: Control,
    signing: Signing,
    skipped: Skipped,
}

impl Ground {
    /// Knows the configured peers and no aircraft yet. `model` scales the effectors' commands and
    /// says how far they travel.
    #[must_use]
    pub fn new(parameters: &Parameters, model: &AircraftModel, configured: &[Address]) -> Self {
        Self {
            own: Identity::autopilot(parameters.link.system_id),
            parameters: *parameters,
            defaults: Parameters::default(),
            model: *model,
            aircraft: Aircraft::default(),
            intents: Intents::default(),
            peers: Peers::new(configured),
            texts: StatusTexts::default(),
            heartbeat: Heartbeat::default(),
            telemetry: Telemetry::new(model, parameters, &Parameters::default(), Host::default()),
            command: CommandService::default(),
            param: ParamService::default(),
            offboard: Offboard::default(),
            manual: Manual::default(),
            mode_switch: ModeSwitch::default(),
            mission: MissionService::default(),
            fault_list: ListRequest::default(),
            ftp: FtpService::default(),
            scripts: Scripts::new(&model.effectors.list),
            shell: ShellService::default(),
            logs: LogService::default(),
            traffic: Traffic::default(),
            link_loss: LinkLoss::default(),
            control: Control::default(),
            signing: Signing::default(),
            skipped: Skipped::default(),
        }
    }

    /// Defaults of the parameters for this aircraft; to be called before anything else.
    #[must_use]
    pub fn with_defaults(mut self, defaults: &Parameters) -> Self {
        self.defaults = *defaults;
        self.telemetry = Telemetry::new(&self.model, &self.parameters, defaults, Host::default());
        self
    }

    /// What the process tells of itself; to be called before anything else but the defaults.
    #[must_use]
    pub fn with_host(mut self, host: Host) -> Self {
        self.heartbeat = Heartbeat::new(host.identity);
        self.telemetry = Telemetry::new(&self.model, &self.parameters, &self.defaults, host);
        self
    }

    /// The key that is there already; to be called before anything else.
    #[must_use]
    pub fn with_signing(mut self, signing: Signing) -> Self {
        self.signing = signing;
        self
    }

    /// Takes one datagram. Its rest is as lost if there is no room for the answers.
    pub fn handle_datagram(&mut self, address: Address, datagram: &[u8], now: WallTime) {
        let mut rest = datagram;
        while let Some(frame) = codec::next_frame(&mut rest, &mut self.skipped) {
            if frame.sender == self.own {
                // Our own words, sent back by somebody.
                continue;
            }
            if self.signing.admit(&frame, now) != Admission::Accepted {
                // Nor does what may come unsigned make its sender a peer: there is no use for it here.
                continue;
            }
            let Some(peer) = self.peers.hear(address, now) else { return };
            if self.peers.can_answer(peer) {
                self.take(peer, &frame, now);
            } else {
                self.skipped.unanswerable += 1;
            }
        }
        self.texts.poll(&mut self.peers);
    }

    /// Takes what was read from a connection, cut anywhere. Read only while [`Ground::accepts_input`].
    pub fn handle_stream(&mut self, connection: Connection, bytes: &[u8], now: WallTime) {
        // A connection that is not open any more.
        let Some((_, inbox)) = self.peers.inbox(connection) else { return };
        self.skipped.overflow_bytes += inbox.receive(bytes) as u64;
        self.read_inbox(connection, now);
        self.texts.poll(&mut self.peers);
    }

    /// Takes the frames that have come over a connection, as far as they can be answered.
    fn read_inbox(&mut self, connection: Connection, now: WallTime) {
        let Some((peer, inbox)) = self.peers.inbox(connection) else { return };
        // The services answer into the same table, so the bytes leave it meanwhile.
        let bytes = inbox.take();
        let mut rest = &bytes[..];
        let held = loop {
            if !self.peers.can_answer(peer) {
                break !rest.is_empty();
            }
            let Some(frame) = codec::next_frame_of_stream(&mut rest, &mut self.skipped) else {
                break false;
            };
            if frame.sender != self.own && self.signing.admit(&frame, now) == Admission::Accepted {
                self.take(peer, &frame, now);
            }
        };
        let used = bytes.len() - rest.len();
        if let Some((_, inbox)) = self.peers.inbox(connection) {
            inbox.put_back(bytes, used, held);
        }
    }

    fn take(&mut self, peer: Peer, frame: &Frame<'_>, now: WallTime) {
        self.traffic.hear(frame);
        let from = From { peer, sender: frame.sender };
        if let Some((target, message)) = codec::decode(frame) {
            self.dispatch(from, target, &message, now);
        }
    }

    /// A ground station has opened a connection, from this computer or another one. False if there are
    /// too many.
    pub fn open(&mut self, connection: Connection, is_local: bool, now: WallTime) -> bool {
        self.peers.open(connection, is_local, now).is_some()
    }

    /// A connection was closed.
    pub fn close(&mut self, connection: Connection) {
        self.peers.close(connection);
    }

    fn dispatch(&mut self, from: From, target: Identity, message: &Message, now: WallTime) {
        // A ping is the one message whose target says whether it is a question.
        if let Message::Ping(data) = message {
            return ping::handle_ping(from, data, &mut self.peers);
        }
        if !target.reaches(self.own) {
            return;
        }
        if let Message::SetupSigning(setup) = message {
            return self.signing.handle(from, setup, now, &self.peers, &mut self.texts);
        }
        let (services, mut ctx, out) = self.split_for(Some(from), now);
        match message {
            Message::Ping(_) | Message::SetupSigning(_) => {}
            Message::Heartbeat(mav_type) => services.link_loss.hear(from, *mav_type, now, &mut ctx),
            Message::TimeSync(data) => ping::handle_timesync(from, data, now, out),
            Message::SetMode(data) => {
                services.command.handle_set_mode(from, data, now, &mut ctx, out);
            }
            Message::ParamRequestRead(data) => {
                services.param.handle_read(from, data, &mut ctx, out);
            }
            Message::ParamRequestList => services.param.handle_list(from),
            Message::ParamSet(set) => services.param.handle_set(from, set, now, &mut ctx, out),
            Message::Command(command) if command.id == param::PREFLIGHT_STORAGE => {
                services.param.handle_storage(from, command, now, &mut ctx, out);
            }
            Message::Command(command) => services.command.handle(from, command, now, &mut ctx, out),
            Message::SetAttitudeTarget(_)
            | Message::SetPositionGlobal(_)
            | Message::SetPositionLocal(_) => {
                services.offboard.handle(from, message, now, &mut ctx);
            }
            Message::ManualControl(_) => services.manual.handle(from, message, now, &mut ctx),
            Message::RcOverride(channels) => {
                services.manual.handle(from, message, now, &mut ctx);
                let (system, parameters) = (from.sender.system, &ctx.parameters.mode_switch);
                if let Some(mode) = services.mode_switch.handle(system, channels, parameters) {
                    services.command.ask_for_mode(from, true, mode, now, &mut ctx, out);
                }
            }
            Message::Ftp(request) => services.ftp.handle(from, request, now, &mut ctx, out),
            Message::RequestDataStream(request) => {
                ctx.telemetry.handle_data_stream(from, *request);
            }
            Message::SerialControl(data) => services.shell.handle(from, data, now),
            Message::Log(request) => services.logs.handle(from, *request, now, &mut ctx, out),
            Message::MissionRequestList(_)
            | Message::MissionCount(..)
            | Message::MissionItemInt(_)
            | Message::MissionItem(_)
            | Message::MissionRequest(..)
            | Message::MissionClear(_)
            | Message::MissionSetCurrent(_)
            | Message::MissionAck(..)
            | Message::MissionPartial(_) => {
                services.mission.handle(from, message, now, &mut ctx, out);
            }
        }
    }

    /// The services with state, what they share, and the way out.
    fn split(&mut self, now: WallTime) -> (Services<'_>, Context<'_>, &mut Peers) {
        self.split_for(None, now)
    }

    /// The same for a message of somebody.
    fn split_for(
        &mut self,
        from: Option<From>,
        now: WallTime,
    ) -> (Services<'_>, Context<'_>, &mut Peers) {
        let system = from.map(|from| from.sender.system);
        let parameters = &self.parameters;
        let setpoint_is_fresh = system.is_some_and(|s| self.offboard.is_fresh(s, now, parameters));
        let sticks_are_fresh = system.is_some_and(|s| self.manual.is_fresh(s, now, parameters));
        let plan_items = self.mission.plan_items();
        let services = Services {
            command: &mut self.command,
            param: &mut self.param,
            offboard: &mut self.offboard,
            manual: &mut self.manual,
            mode_switch: &mut self.mode_switch,
            mission: &mut self.mission,
            ftp: &mut self.ftp,
            shell: &mut self.shell,
            logs: &mut self.logs,
            link_loss: &mut self.link_loss,
        };
        let context = Context {
            parameters: &mut self.parameters,
            defaults: &self.defaults,
            model: &self.model,
            aircraft: &self.aircraft,
            intents: &mut self.intents,
            texts: &mut self.texts,
            telemetry: &mut self.telemetry,
            scripts: &mut self.scripts,
            control: &mut self.control,
            setpoint_is_fresh,
            sticks_are_fresh,
            plan_items,
        };
        (services, context, &mut self.peers)
    }

    /// Takes what happened on the control side.
    pub fn handle_event(&mut self, event: &Event, now: WallTime) {
        self.fault_list.handle_event(&event.kind);
        if self.aircraft.handle_event(&event.kind) {
            self.texts.handle_event(&event.kind, &self.parameters, &self.model.effectors.list);
            if let EventKind::Fault(_) = event.kind {
                self.telemetry.faults_changed(now);
            }
        }
        let (services, mut ctx, out) = self.split(now);
        if let EventKind::Vehicle(VehicleEvent::Mode(mode)) = event.kind {
            // Who asked for it has control from here on: its stream counts at once.
            services.command.handle_mode(mode, &mut ctx);
            services.shell.handle_mode(mode, &mut ctx);
        }
        match event.kind {
            EventKind::Outcome { number, outcome } => {
                services.command.handle_outcome(number, &outcome, now, &mut ctx, out);
                services.mission.handle_outcome(number, &outcome, now, &mut ctx, out);
                services.offboard.handle_outcome(number, &outcome, now, &mut ctx);
                services.shell.handle_outcome(number, &outcome, &mut ctx);
                services.param.handle_outcome(number, &outcome, now, &mut ctx, out);
            }
            EventKind::Script { script, event } => {
                ctx.scripts.handle_event(script, event, ctx.texts);
            }
            EventKind::Vehicle(VehicleEvent::Mode(Mode::Offboard)) => {
                services.offboard.begin(now, &mut ctx);
            }
            EventKind::Vehicle(VehicleEvent::Mode(Mode::Position | Mode::Altitude)) => {
                services.manual.begin(now, &mut ctx);
            }
            EventKind::FlightBegan { .. } => {
                services.link_loss.begin_flight();
                services.manual.begin(now, &mut ctx);
            }
            _ => {}
        }
        services.param.follow_faults(now, &mut ctx, out);
        services.mission.handle_event(&event.kind, &mut ctx, out);
        // An order may have given control on.
        services.link_loss.poll(now, &mut ctx);
        // The heartbeat tells a change at once, before the acknowledgement that waits for it.
        self.heartbeat.poll(now, &self.aircraft, &mut self.peers);
        self.telemetry.publish_landed_state(&self.aircraft, &mut self.peers);
        self.texts.poll(&mut self.peers);
    }

    /// Takes the state at one tick.
    pub fn handle_snapshot(&mut self, snapshot: &Snapshot, now: WallTime) {
        self.aircraft.handle_snapshot(snapshot);
        self.telemetry.handle_snapshot(now, &self.aircraft, &mut self.peers);
        self.heartbeat.poll(now, &self.aircraft, &mut self.peers);
    }

    /// Does what is due.
    pub fn poll(&mut self, now: WallTime) {
        self.signing.poll(now);
        self.peers.poll(now);
        for _ in 0..peers::CONNECTIONS_MAX {
            let Some(connection) = self.peers.next_resumable() else { break };
            self.read_inbox(connection, now);
        }
        self.run_lines(now);
        self.fault_list.poll(&mut self.intents);
        let (services, mut ctx, out) = self.split(now);
        services.command.poll(now, &mut ctx, out);
        services.param.poll(now, &mut ctx, out);
        services.offboard.poll(now, &mut ctx);
        services.manual.poll(now, &mut ctx);
        services.mission.poll(now, &mut ctx, out);
        services.ftp.poll(now, &mut ctx, out);
        services.shell.poll(now, &mut ctx, out);
        services.logs.poll(now, &mut ctx, out);
        services.link_loss.poll(now, &mut ctx);
        self.heartbeat.poll(now, &self.aircraft, &mut self.peers);
        self.telemetry.poll(now, &self.aircraft, &self.parameters, &mut self.peers);
        self.texts.poll(&mut self.peers);
    }

    /// Runs what was typed in the shells.
    fn run_lines(&mut self, now: WallTime) {
        for _ in 0..shell::LINES_AT_ONCE {
            let Some(from) = self.shell.next_ready() else { break };
            let (services, mut ctx, out) = self.split_for(Some(from), now);
            services.shell.run(from, now, &mut ctx, services.param, out);
        }
    }

    /// The process ends: every station gets a text that says so, and whether the plant has ended before it.
    pub fn end(&mut self) {
        let (severity, text) = statustext::text_of_end(self.aircraft.phase());
        self.texts.queue_text(severity, text);
        self.texts.poll(&mut self.peers);
    }

    /// When [`Ground::poll`] has something to do.
    #[must_use]
    pub fn next_deadline(&self) -> WallTime {
        let always = self.heartbeat.next_deadline();
        let sometimes = [
            self.telemetry.next_deadline(),
            self.peers.next_deadline(),
            self.command.next_deadline(),
            self.param.next_deadline(),
            self.offboard.next_deadline(&self.aircraft, &self.control, &self.parameters),
            self.manual.next_deadline(&self.aircraft, &self.control, &self.parameters),
            self.mission.next_deadline(),
            self.ftp.next_deadline(),
            self.shell.next_deadline(),
            self.logs.next_deadline(),
            self.link_loss.next_deadline(&self.control, &self.parameters, &self.aircraft),
        ];
        sometimes.into_iter().flatten().fold(always, WallTime::min)
    }
}

/// The services that remember something and react to messages.
struct Services<'a> {
    command: &'a mut CommandService,
    param: &'a mut ParamService,
    offboard: &'a mut Offboard,
    manual: &'a mut Manual,
    mode_switch: &'a mut ModeSwitch,
    mission: &'a mut MissionService,
    ftp: &'a mut FtpService,
    shell: &'a mut ShellService,
    logs: &'a mut LogService,
    link_loss: &'a mut LinkLoss,
}

#[cfg(test)]
mod tests;
