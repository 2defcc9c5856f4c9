//! HEARTBEAT: once a second, at once when its content changes, and at once to a new peer, since a
//! ground station starts from the first one that it receives.
//!
//! Autopilot and type never change: ground stations choose their user interface by the first heartbeat.
//!
//! PING and TIMESYNC are answered at once.

#![expect(deprecated, reason = "ground stations still send PING")]

use core::time::Duration;

use ::mavlink::dialects::common::{
    HEARTBEAT_DATA, MavAutopilot, MavModeFlag, MavState, MavType, PING_DATA, TIMESYNC_DATA,
};

use crate::aircraft::{Aircraft, Phase};
use crate::codec::{Encoded, Message};
use crate::peers::{From, Peer};
use crate::wall_time::WallTime;
use crate::{Service, Shared, modes};
use flight_management::event::EventKind;
use flight_management::vehicle::Mode;

/// Interval between heartbeats, wall time.
pub const INTERVAL: Duration = Duration::from_secs(1);
/// MAVLink protocol version in the heartbeat.
const PROTOCOL_VERSION: u8 = 3;

/// The autopilot that the heartbeat names. Ground stations know the features of a PX4 and offer modes, guided
/// flight and parameters accordingly; for an unknown autopilot they show little more than telemetry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum HeartbeatIdentity {
    /// `MAV_AUTOPILOT_PX4`.
    #[default]
    Px4,
    /// `MAV_AUTOPILOT_GENERIC`.
    Generic,
}

/// Sends heartbeats.
#[derive(Debug, Default)]
pub struct Heartbeat {
    last: Option<(WallTime, HEARTBEAT_DATA)>,
    /// The peers that have received one.
    greeted: Vec<Peer>,
}

impl Service for Heartbeat {
    /// A change is published at once.
    fn handle_event(&mut self, _: &EventKind, now: WallTime, shared: &mut Shared) {
        self.poll(now, shared);
    }

    /// Sends one to all if it is due or its content has changed, else to the new peers only.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        let Shared { aircraft, host, peers, .. } = shared;
        let content = content(host.identity, aircraft);
        let last = self.last.as_ref();
        if last.is_none_or(|(sent, last)| now.since(*sent) >= INTERVAL || *last != content) {
            peers.announce(&Encoded::new(&content));
            // Those of this round need none of their own any more.
            self.greeted = peers.all().collect();
            self.last = Some((now, content));
            return;
        }
        self.greeted.retain(|peer| peers.knows(*peer));
        let new: Vec<Peer> = peers.all().filter(|peer| !self.greeted.contains(peer)).collect();
        for peer in new {
            peers.answer(peer, Encoded::new(&content));
            self.greeted.push(peer);
        }
    }

    fn next_deadline(&self, _: &Shared) -> Option<WallTime> {
        Some(self.last.as_ref().map_or(WallTime::ZERO, |(sent, _)| *sent + INTERVAL))
    }
}

/// The present HEARTBEAT.
pub fn message(identity: HeartbeatIdentity, aircraft: &Aircraft) -> Encoded {
    Encoded::new(&content(identity, aircraft))
}

/// PX4's flags: manual input in a mode that takes a pilot's sticks, else autonomous.
fn mode_flags(mode: Mode) -> MavModeFlag {
    let control = match mode {
        Mode::Position | Mode::Altitude => MavModeFlag::MAV_MODE_FLAG_MANUAL_INPUT_ENABLED,
        Mode::Hold | Mode::Mission | Mode::Return | Mode::Offboard | Mode::Takeoff => {
            MavModeFlag::MAV_MODE_FLAG_AUTO_ENABLED | MavModeFlag::MAV_MODE_FLAG_GUIDED_ENABLED
        }
    };
    MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        | MavModeFlag::MAV_MODE_FLAG_STABILIZE_ENABLED
        | control
}

fn content(identity: HeartbeatIdentity, aircraft: &Aircraft) -> HEARTBEAT_DATA {
    let mut base_mode = mode_flags(aircraft.mode());
    if aircraft.is_armed() {
        base_mode |= MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
    }
    HEARTBEAT_DATA {
        custom_mode: modes::custom_mode(aircraft.mode()),
        mavtype: MavType::MAV_TYPE_FIXED_WING,
        autopilot: match identity {
            HeartbeatIdentity::Px4 => MavAutopilot::MAV_AUTOPILOT_PX4,
            HeartbeatIdentity::Generic => MavAutopilot::MAV_AUTOPILOT_GENERIC,
        },
        base_mode,
        system_status: match aircraft.phase() {
            Phase::NoFlight => MavState::MAV_STATE_BOOT,
            Phase::Flying | Phase::Lost if aircraft.is_terminated() => {
                MavState::MAV_STATE_FLIGHT_TERMINATION
            }
            Phase::Flying if !aircraft.is_armed() => MavState::MAV_STATE_STANDBY,
            // While the plant is silent the state of the aircraft is unknown: simulation time does not advance.
            Phase::Flying | Phase::Lost => MavState::MAV_STATE_ACTIVE,
            Phase::OnGround => MavState::MAV_STATE_STANDBY,
        },
        mavlink_version: PROTOCOL_VERSION,
    }
}

/// Answers PING, and TIMESYNC by wall time.
#[derive(Debug, Default)]
pub struct Ping;

impl Service for Ping {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        let (target_system, target_component) = (from.sender.system, from.sender.component);
        let answer = match *message {
            // A ping with a target is itself an answer.
            Message::Ping(PING_DATA { time_usec, seq, target_system: 0, target_component: 0 }) => {
                Encoded::new(&PING_DATA { time_usec, seq, target_system, target_component })
            }
            // tc1 is zero in a request.
            Message::TimeSync(TIMESYNC_DATA { tc1: 0, ts1, .. }) => {
                let tc1 = i64::try_from(now.as_micros().saturating_mul(1000)).unwrap_or(i64::MAX);
                Encoded::new(&TIMESYNC_DATA { tc1, ts1, target_system, target_component })
            }
            _ => return,
        };
        shared.peers.answer(from.peer, answer);
    }
}
