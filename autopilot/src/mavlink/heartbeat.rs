//! HEARTBEAT: once a second, and at once when its content changes.
//!
//! Autopilot and type never change: ground stations choose what they offer by the first one.

use core::time::Duration;

use ::mavlink::dialects::common::{HEARTBEAT_DATA, MavAutopilot, MavModeFlag, MavState, MavType};

use super::aircraft::{Aircraft, Phase};
use super::codec::Encoded;
use super::modes;
use super::peers::Peers;
use crate::clock::WallTime;

/// Interval between heartbeats, wall time.
const INTERVAL: Duration = Duration::from_secs(1);
/// MAVLink protocol version in the heartbeat.
const PROTOCOL_VERSION: u8 = 3;

/// Sends heartbeats.
#[derive(Debug, Default)]
pub struct Heartbeat {
    last: Option<(WallTime, HEARTBEAT_DATA)>,
}

impl Heartbeat {
    /// Sends one if it is time or if something changed.
    pub fn poll(&mut self, now: WallTime, aircraft: &Aircraft, out: &mut Peers) {
        let content = content(aircraft);
        let is_due = self
            .last
            .as_ref()
            .is_none_or(|(sent, last)| now.since(*sent) >= INTERVAL || *last != content);
        if is_due {
            out.announce(&Encoded::new(&content));
            self.last = Some((now, content));
        }
    }

    /// When the next one is due.
    #[must_use]
    pub fn next_deadline(&self) -> WallTime {
        self.last.as_ref().map_or(WallTime::ZERO, |(sent, _)| *sent + INTERVAL)
    }
}

/// The aircraft is armed.
#[must_use]
pub fn is_armed(aircraft: &Aircraft) -> bool {
    matches!(aircraft.phase(), Phase::Flying | Phase::Lost)
}

fn content(aircraft: &Aircraft) -> HEARTBEAT_DATA {
    let mut base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        | MavModeFlag::MAV_MODE_FLAG_STABILIZE_ENABLED
        | MavModeFlag::MAV_MODE_FLAG_GUIDED_ENABLED
        | MavModeFlag::MAV_MODE_FLAG_AUTO_ENABLED;
    if is_armed(aircraft) {
        base_mode |= MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
    }
    HEARTBEAT_DATA {
        custom_mode: modes::custom_mode(aircraft.mode()),
        mavtype: MavType::MAV_TYPE_FIXED_WING,
        autopilot: MavAutopilot::MAV_AUTOPILOT_PX4,
        base_mode,
        system_status: match aircraft.phase() {
            Phase::NoFlight => MavState::MAV_STATE_BOOT,
            Phase::Flying => MavState::MAV_STATE_ACTIVE,
            Phase::OnGround => MavState::MAV_STATE_STANDBY,
            Phase::Lost => MavState::MAV_STATE_CRITICAL,
        },
        mavlink_version: PROTOCOL_VERSION,
    }
}
