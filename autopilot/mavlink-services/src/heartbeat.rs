//! HEARTBEAT: once a second, at once when its content changes, and at once to who has just come, since a
//! ground station begins with the first one that it hears.
//!
//! Autopilot and type never change: ground stations choose what they offer by the first one.

use core::time::Duration;

use ::mavlink::dialects::common::{HEARTBEAT_DATA, MavAutopilot, MavModeFlag, MavState, MavType};

use super::aircraft::{Aircraft, Phase};
use super::codec::Encoded;
use super::modes;
use super::peers::{Peer, Peers};
use crate::wall_time::WallTime;
use flight_management::vehicle::Mode;

/// Interval between heartbeats, wall time.
pub const INTERVAL: Duration = Duration::from_secs(1);
/// MAVLink protocol version in the heartbeat.
const PROTOCOL_VERSION: u8 = 3;

/// The autopilot that the heartbeat names. Ground stations know what a PX4 can do and offer modes, guided
/// flight and parameters accordingly; of an unknown autopilot they show little more than telemetry.
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
    identity: HeartbeatIdentity,
    last: Option<(WallTime, HEARTBEAT_DATA)>,
    /// Who has got one.
    greeted: Vec<Peer>,
}

impl Heartbeat {
    /// Has not sent any.
    #[must_use]
    pub fn new(identity: HeartbeatIdentity) -> Self {
        Self { identity, ..Self::default() }
    }

    /// Sends one if it is time or if something changed; to who has just come in any case.
    pub fn poll(&mut self, now: WallTime, aircraft: &Aircraft, out: &mut Peers) {
        let content = content(self.identity, aircraft);
        let is_due = self
            .last
            .as_ref()
            .is_none_or(|(sent, last)| now.since(*sent) >= INTERVAL || *last != content);
        if is_due {
            out.announce(&Encoded::new(&content));
            self.greeted.clear();
            self.greeted.extend(out.all());
            self.last = Some((now, content));
            return;
        }
        self.greeted.retain(|peer| out.knows(*peer));
        let new: Vec<Peer> = out.all().filter(|peer| !self.greeted.contains(peer)).collect();
        for peer in new {
            out.answer(peer, Encoded::new(&content));
            self.greeted.push(peer);
        }
    }

    /// When the next one is due.
    #[must_use]
    pub fn next_deadline(&self) -> WallTime {
        self.last.as_ref().map_or(WallTime::ZERO, |(sent, _)| *sent + INTERVAL)
    }
}

/// The HEARTBEAT of this moment.
#[must_use]
pub fn message(identity: HeartbeatIdentity, aircraft: &Aircraft) -> Encoded {
    Encoded::new(&content(identity, aircraft))
}

/// The aircraft is armed: it flies and its engine runs, as far as is known.
#[must_use]
pub fn is_armed(aircraft: &Aircraft) -> bool {
    matches!(aircraft.phase(), Phase::Flying | Phase::Lost) && !aircraft.is_terminated()
}

/// PX4's flags: a mode that takes a pilot's sticks, or the autopilot by itself.
fn mode_flags(mode: Mode) -> MavModeFlag {
    let who = match mode {
        Mode::Position | Mode::Altitude => MavModeFlag::MAV_MODE_FLAG_MANUAL_INPUT_ENABLED,
        Mode::Hold | Mode::Mission | Mode::Return | Mode::Offboard => {
            MavModeFlag::MAV_MODE_FLAG_AUTO_ENABLED | MavModeFlag::MAV_MODE_FLAG_GUIDED_ENABLED
        }
    };
    MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        | MavModeFlag::MAV_MODE_FLAG_STABILIZE_ENABLED
        | who
}

fn content(identity: HeartbeatIdentity, aircraft: &Aircraft) -> HEARTBEAT_DATA {
    let mut base_mode = mode_flags(aircraft.mode());
    if is_armed(aircraft) {
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
            // A plant that is silent says nothing about the aircraft: simulation time stands still.
            Phase::Flying | Phase::Lost => MavState::MAV_STATE_ACTIVE,
            Phase::OnGround => MavState::MAV_STATE_STANDBY,
        },
        mavlink_version: PROTOCOL_VERSION,
    }
}
