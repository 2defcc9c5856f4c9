//! The MAVLink services: bytes in, bytes out. No sockets, no clock.
//!
//! ```text
//!  datagrams,      ┌────────────────────── Ground ──────────────────────┐      datagrams,
//!  streams ──────> │ codec ─> signing ─> services, each in its turn:    │ ───> streams
//!                  │   signing, ping, shell, fault_list, command,       │
//!  events ───────> │   param, offboard, manual, mode_switch, mission,   │
//!  snapshots ────> │   ftp, logs, link_loss, heartbeat, telemetry       │
//!                  │     │ read and write                               │
//!                  │     v                                              │
//!                  │ Shared: parameters, aircraft, control, scripts, .. │
//!                  │         intents, texts, peers (outboxes)           │
//!                  └─────────────────────────────┬──────────────────────┘
//!                                                └─> intents ─> control thread
//! ```
//!
//! Every service implements [`Service`]: it handles messages, outcomes and events, does in `poll` what is due, and returns
//! from `next_deadline` when that will be. What one service needs of another one is in [`Shared`]. Time is an argument.
//!
//! Start with [`Ground`]. A process feeds it what its sockets receive, and sends what it returns:
//!
//! ```
//! use aircraft::DEFAULT_MODEL;
//! use flight_management::configuration::model;
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
//! # Ok::<(), flight_management::TextError>(())
//! ```

use flight_control::AircraftModel;
use icd::EffectorList;

use crate::aircraft::Aircraft;
use crate::codec::{Encoded, Identity, Message};
use crate::component_metadata::Metadata;
use crate::control::Control;
use crate::manual::Pilot;
use crate::offboard::Setpoints;
use crate::param::ParameterStore;
use crate::peers::{From, Peers};
use crate::queues::Intents;
use crate::scripts::Scripts;
use crate::statustext::StatusTexts;
use crate::streams::{Latest, Streams};
use crate::telemetry::{Host, PeerRates};
use crate::wall_time::WallTime;
use flight_management::command::Outcome;
use flight_management::event::EventKind;
use flight_management::parameters::Parameters;
use flight_management::vehicle::Mode;

pub use crate::ground::Ground;

pub mod aircraft;
pub mod codec;
pub mod command;
pub mod component_metadata;
pub mod control;
pub mod convert;
pub mod failure;
pub mod fault_list;
pub mod ftp;
mod ground;
pub mod heartbeat;
pub mod logs;
pub mod manual;
pub mod mission;
mod modes;
pub mod offboard;
pub mod param;
pub mod peers;
pub mod queues;
pub mod scripts;
pub mod shell;
pub mod signing;
pub mod statustext;
pub mod streams;
pub mod telemetry;
pub mod traffic;
pub mod wall_time;

/// State that every service may read and write besides its own.
#[derive(Debug)]
pub struct Shared {
    pub parameters: Parameters,
    /// Their defaults for this aircraft.
    pub defaults: Parameters,
    /// Which changes of parameters the control thread and the parameter file have not received yet.
    pub store: ParameterStore,
    /// The design model of the autopilot: the effectors and their travel.
    pub model: AircraftModel,
    /// The known state of the aircraft.
    pub aircraft: Aircraft,
    /// Items of the plan that the aircraft has accepted.
    pub plan_items: u16,
    /// The stored scripts, and the running one.
    pub scripts: Scripts,
    /// Which ground station has control.
    pub control: Control,
    /// Offboard setpoints of each system.
    pub setpoints: Latest<Setpoints>,
    /// Stick positions of each system.
    pub pilots: Latest<Pilot>,
    /// Which streams the sender of the present message has sent recently.
    pub streams: Streams,
    /// A message that a service has derived from the present one; dispatched next.
    pub derived: Option<Message>,
    /// Message rates of each peer.
    pub rates: PeerRates,
    /// Files that describe parameters and effectors.
    pub metadata: Metadata,
    /// What the process reports about itself.
    pub host: Host,
    /// Commands to the control thread.
    pub intents: Intents,
    /// Texts to the operators.
    pub texts: StatusTexts,
    /// The ground stations, and the messages waiting for each.
    pub peers: Peers,
}

impl Shared {
    /// The effectors of the aircraft, as its model file has them.
    pub fn effectors(&self) -> &EffectorList {
        &self.model.effectors.list
    }

    /// Obstacle to arming and flying.
    pub fn not_ready(&self) -> Option<String> {
        self.aircraft.not_ready(self.parameters.gains.ground.runway_rad())
    }

    /// Records which streams a system has sent recently, before its next message is handled.
    pub fn note_streams(&mut self, from: From, now: WallTime) {
        let Self { parameters, setpoints, pilots, .. } = self;
        let system = Some(from.sender.system);
        self.streams = Streams {
            setpoints: setpoints.of(system).is_some_and(|one| one.is_fresh(now, parameters)),
            sticks: pilots.of(system).is_some_and(|pilot| pilot.is_fresh(now, parameters)),
        };
    }
}

/// Sender of a message, and what its handler may read and use.
pub(crate) struct Caller<'a> {
    pub from: From,
    pub now: WallTime,
    pub shared: &'a mut Shared,
}

impl Caller<'_> {
    pub fn answer(&mut self, message: Encoded) {
        self.shared.peers.answer(self.from.peer, message);
    }
}

/// One service of the MAVLink protocol. All methods are optional.
pub trait Service {
    /// Reacts to a message; most messages concern other services.
    fn handle(&mut self, _from: From, _message: &Message, _now: WallTime, _shared: &mut Shared) {}

    /// Reacts to the outcome of an intent; most intents are those of other services.
    fn handle_outcome(
        &mut self,
        _number: u32,
        _outcome: &Outcome,
        _now: WallTime,
        _shared: &mut Shared,
    ) {
    }

    /// Reacts to an event of the flight, which [`Shared::aircraft`] has received before.
    fn handle_event(&mut self, _event: &EventKind, _now: WallTime, _shared: &mut Shared) {}

    /// The ground station whose request for this mode is still open here: it gets control as soon as the mode begins.
    fn requester_of(&self, _mode: Mode) -> Option<Identity> {
        None
    }

    /// Does what is due.
    fn poll(&mut self, _now: WallTime, _shared: &mut Shared) {}

    /// When `poll` has something to do.
    fn next_deadline(&self, _shared: &Shared) -> Option<WallTime> {
        None
    }
}

#[cfg(test)]
mod tests;
