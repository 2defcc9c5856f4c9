//! What is streamed to every ground station, and how often. Rates are wall time, time stamps simulation time.
//!
//! When something is due, a snapshot of the next tick is wished for, and the messages are made of it. A
//! plant that stands still gives no snapshots; then the last one is shown again.

use core::time::Duration;

use ::mavlink::MessageData;
use ::mavlink::dialects::common::{
    AUTOPILOT_VERSION_DATA, HOME_POSITION_DATA, MavLandedState,
    MavProtocolCapability as Capability, MavResult,
};
use flight_control::Belief;

use super::aircraft::Aircraft;
use super::codec::{Encoded, StreamRequest};
use super::context::{Context, From};
use super::convert;
use super::peers::{Peer, Peers};
use super::refused::Refused;
use crate::clock::WallTime;

mod messages;

/// The stream table: message and time between two of them in ms.
const INTERVALS: [(Stream, u64); 12] = [
    (Stream::SysStatus, 500),
    (Stream::ExtendedSysState, 500),
    (Stream::Attitude, 40),
    (Stream::AttitudeQuaternion, 40),
    (Stream::GlobalPositionInt, 100),
    (Stream::LocalPositionNed, 100),
    (Stream::VfrHud, 100),
    (Stream::Altitude, 200),
    (Stream::HomePosition, 2000),
    (Stream::ServoOutputRaw, 100),
    (Stream::ActuatorOutputStatus, 100),
    (Stream::NamedValues, 100),
];

/// A message, or a group of the same kind, that is streamed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stream {
    SysStatus,
    ExtendedSysState,
    Attitude,
    AttitudeQuaternion,
    GlobalPositionInt,
    LocalPositionNed,
    VfrHud,
    Altitude,
    HomePosition,
    ServoOutputRaw,
    ActuatorOutputStatus,
    /// z2, compensation, flag, angle of attack, sideslip.
    NamedValues,
}

/// A snapshot that was wished for is waited for this long.
const PATIENCE: Duration = Duration::from_millis(50);

/// Streams telemetry.
#[derive(Debug)]
pub struct Telemetry {
    belief: Belief,
    due: [WallTime; INTERVALS.len()],
    /// Something is due and waits for a snapshot, since then.
    waiting: Option<WallTime>,
    landed: Option<MavLandedState>,
}

impl Telemetry {
    /// Everything is due at once.
    #[must_use]
    pub fn new(belief: &Belief) -> Self {
        Self {
            belief: *belief,
            due: [WallTime::ZERO; INTERVALS.len()],
            waiting: None,
            landed: None,
        }
    }

    /// REQUEST_DATA_STREAM: scales the rates of one peer.
    pub fn handle_data_stream(&mut self, _from: From, _request: StreamRequest, _now: WallTime) {}

    /// SET_MESSAGE_INTERVAL of one peer: param1 and param2 of the command. -1 stops, 0 goes back to the
    /// default, else microseconds.
    ///
    /// # Errors
    /// No such message, or an interval that is none or too short.
    pub fn set_interval(
        &mut self,
        _peer: Peer,
        _message_id: f32,
        _interval_us: f32,
    ) -> Result<(), Refused> {
        Err(Refused::silent(MavResult::MAV_RESULT_UNSUPPORTED))
    }

    /// GET_MESSAGE_INTERVAL of one peer: the MESSAGE_INTERVAL that answers it; its interval is 0 for a
    /// message that is never sent.
    ///
    /// # Errors
    /// `message_id` is no message number.
    pub fn interval(&self, _peer: Peer, _message_id: f32) -> Result<Encoded, Refused> {
        Err(Refused::silent(MavResult::MAV_RESULT_UNSUPPORTED))
    }

    /// A snapshot of the next tick is wanted.
    #[must_use]
    pub fn wants_snapshot(&self) -> bool {
        self.waiting.is_some()
    }

    /// A snapshot has come: what waited for it is sent.
    pub fn handle_snapshot(&mut self, now: WallTime, aircraft: &Aircraft, out: &mut Peers) {
        if self.waiting.take().is_some() {
            self.send_due(now, aircraft, out);
        }
    }

    /// Tells at once when the aircraft has come down or a flight has begun.
    pub fn tell_landed_state(&mut self, aircraft: &Aircraft, out: &mut Peers) {
        let landed = messages::landed_state(aircraft);
        if self.landed.replace(landed) != Some(landed) {
            out.announce(&messages::extended_sys_state(aircraft));
        }
    }

    /// Starts to wait for a snapshot when something is due; sends without one when none comes.
    pub fn poll(&mut self, now: WallTime, aircraft: &Aircraft, out: &mut Peers) {
        self.tell_landed_state(aircraft, out);
        match self.waiting {
            None if self.due.iter().any(|due| *due <= now) => self.waiting = Some(now),
            Some(since) if now.since(since) >= PATIENCE => {
                self.waiting = None;
                self.send_due(now, aircraft, out);
            }
            _ => {}
        }
    }

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(&self) -> WallTime {
        match self.waiting {
            Some(since) => since + PATIENCE,
            None => self.due.into_iter().min().unwrap_or_default(),
        }
    }

    fn send_due(&mut self, now: WallTime, aircraft: &Aircraft, out: &mut Peers) {
        for ((stream, interval_ms), due) in INTERVALS.into_iter().zip(&mut self.due) {
            if *due > now {
                continue;
            }
            let interval = Duration::from_millis(interval_ms);
            // Keeps the rhythm, but never catches up: what is late is gone.
            *due = if now.since(*due) < interval { *due + interval } else { now + interval };
            send(stream, aircraft, &self.belief, out);
        }
    }
}

/// REQUEST_MESSAGE of one peer: param1 and param2 of the command; what answers it.
///
/// # Errors
/// No such message, or nothing to tell yet.
pub fn request(
    ctx: &Context,
    _peer: Peer,
    _now: WallTime,
    message_id: f32,
    _param2: f32,
) -> Result<Vec<Encoded>, Refused> {
    if message_id == AUTOPILOT_VERSION_ID {
        return Ok(vec![autopilot_version()]);
    }
    if message_id == HOME_POSITION_ID {
        return home_position(ctx.aircraft)
            .map(|message| vec![message])
            .ok_or(Refused::silent(MavResult::MAV_RESULT_TEMPORARILY_REJECTED));
    }
    Err(Refused::silent(MavResult::MAV_RESULT_UNSUPPORTED))
}

fn send(stream: Stream, aircraft: &Aircraft, belief: &Belief, out: &mut Peers) {
    let state = aircraft.snapshot();
    let message = match stream {
        Stream::SysStatus => Some(messages::sys_status(aircraft)),
        Stream::ExtendedSysState => Some(messages::extended_sys_state(aircraft)),
        Stream::Attitude => state.map(messages::attitude),
        Stream::AttitudeQuaternion => state.map(messages::attitude_quaternion),
        Stream::GlobalPositionInt => state.map(messages::global_position_int),
        Stream::LocalPositionNed => state.map(messages::local_position_ned),
        Stream::VfrHud => state.map(|state| messages::vfr_hud(state, belief)),
        Stream::Altitude => state.map(messages::altitude),
        Stream::HomePosition => home_position(aircraft),
        Stream::ServoOutputRaw => state.map(|state| messages::servo_output_raw(state, belief)),
        Stream::ActuatorOutputStatus => {
            state.map(|state| messages::actuator_output_status(state, belief))
        }
        Stream::NamedValues => {
            for message in state.into_iter().flat_map(messages::named_values) {
                out.stream(&message);
            }
            None
        }
    };
    if let Some(message) = message {
        out.stream(&message);
    }
}

/// Id of HOME_POSITION as a command parameter.
pub const HOME_POSITION_ID: f32 = 242.0;
/// Id of AUTOPILOT_VERSION as a command parameter.
pub const AUTOPILOT_VERSION_ID: f32 = 148.0;
const _: () = assert!(HOME_POSITION_DATA::ID == 242 && AUTOPILOT_VERSION_DATA::ID == 148);

/// HOME_POSITION, once home is known.
#[must_use]
pub fn home_position(aircraft: &Aircraft) -> Option<Encoded> {
    let home = aircraft.home()?;
    let position = home.position.0;
    Some(Encoded::new(&HOME_POSITION_DATA {
        latitude: convert::degrees_e7(home.latitude_rad),
        longitude: convert::degrees_e7(home.longitude_rad),
        altitude: 0,
        x: convert::float(position.x),
        y: convert::float(position.y),
        z: convert::float(position.z),
        q: [1.0, 0.0, 0.0, 0.0],
        approach_x: 0.0,
        approach_y: 0.0,
        approach_z: 0.0,
        time_usec: 0,
    }))
}

/// flight_sw_version: PX4 1.17.0, a development version (type byte 0), since ground stations judge what a
/// PX4 can do by it.
const FLIGHT_SW_VERSION: u32 = u32::from_be_bytes([1, 17, 0, 0]);

/// AUTOPILOT_VERSION.
#[must_use]
pub fn autopilot_version() -> Encoded {
    Encoded::new(&AUTOPILOT_VERSION_DATA {
        capabilities: Capability::MAV_PROTOCOL_CAPABILITY_COMMAND_INT
            | Capability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
            | Capability::MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
            | Capability::MAV_PROTOCOL_CAPABILITY_MAVLINK2,
        uid: 0,
        flight_sw_version: FLIGHT_SW_VERSION,
        middleware_sw_version: 0,
        os_sw_version: 0,
        board_version: 0,
        vendor_id: 0,
        product_id: 0,
        flight_custom_version: [0; 8],
        middleware_custom_version: [0; 8],
        os_custom_version: [0; 8],
        uid2: [0; 18],
    })
}

#[cfg(test)]
mod tests;
