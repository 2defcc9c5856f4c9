//! What the autopilot is, and what time it is.

#![expect(deprecated, reason = "ground stations still ask for PROTOCOL_VERSION")]

use ::mavlink::dialects::common::{
    AUTOPILOT_VERSION_DATA, MavProtocolCapability as Capability, PROTOCOL_VERSION_DATA,
    SYSTEM_TIME_DATA,
};

use crate::codec::Encoded;
use crate::convert;
use crate::heartbeat;
use crate::telemetry::View;

/// flight_sw_version: PX4 1.17.0, a development version (type byte 0), since ground stations judge what a
/// PX4 can do by it.
const FLIGHT_SW_VERSION: u32 = u32::from_be_bytes([1, 17, 0, 0]);

/// middleware_sw_version: the version of this program, in the same layout.
const OWN_VERSION: u32 = u32::from_be_bytes([
    number(env!("CARGO_PKG_VERSION_MAJOR")),
    number(env!("CARGO_PKG_VERSION_MINOR")),
    number(env!("CARGO_PKG_VERSION_PATCH")),
    0,
]);

/// A decimal number in a text; the build fails if it does not fit a byte.
const fn number(text: &str) -> u8 {
    match u8::from_str_radix(text, 10) {
        Ok(number) => number,
        Err(_) => panic!("a part of the version is no number of 0 to 255"),
    }
}

/// What the services can do. No geofence and no rally points: they do not exist.
const CAPABILITIES: Capability = Capability::MAV_PROTOCOL_CAPABILITY_MISSION_INT
    .union(Capability::MAV_PROTOCOL_CAPABILITY_COMMAND_INT)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_FTP)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION)
    .union(Capability::MAV_PROTOCOL_CAPABILITY_MAVLINK2);

/// AUTOPILOT_VERSION.
pub fn autopilot_version(_: &View) -> Option<Encoded> {
    Some(Encoded::new(&AUTOPILOT_VERSION_DATA {
        capabilities: CAPABILITIES,
        uid: 0,
        flight_sw_version: FLIGHT_SW_VERSION,
        middleware_sw_version: OWN_VERSION,
        os_sw_version: 0,
        board_version: 0,
        vendor_id: 0,
        product_id: 0,
        flight_custom_version: [0; 8],
        middleware_custom_version: [0; 8],
        os_custom_version: [0; 8],
        uid2: [0; 18],
    }))
}

/// PROTOCOL_VERSION: MAVLink 1 is understood, MAVLink 2 spoken.
pub fn protocol_version(_: &View) -> Option<Encoded> {
    Some(Encoded::new(&PROTOCOL_VERSION_DATA {
        version: 200,
        min_version: 100,
        max_version: 200,
        spec_version_hash: [0; 8],
        library_version_hash: [0; 8],
    }))
}

/// SYSTEM_TIME: the clock of this computer, zero if it was not told, and the simulation time of the flight.
pub fn system_time(view: &View) -> Option<Encoded> {
    let time = view.aircraft.snapshot().map(|state| state.time);
    Some(Encoded::new(&SYSTEM_TIME_DATA {
        time_unix_usec: view
            .host
            .unix_start_us
            .map_or(0, |start| start.saturating_add(view.now.as_micros())),
        time_boot_ms: time.map_or(0, convert::boot_ms),
    }))
}

/// COMPONENT_METADATA: where the descriptions of parameters, effectors and events begin.
pub fn component_metadata(view: &View) -> Option<Encoded> {
    let time = view.aircraft.snapshot().map(|state| state.time);
    Some(view.metadata.message(time.map_or(0, convert::boot_ms)))
}

/// HEARTBEAT, for those who ask for it; it comes by itself once a second.
pub fn heartbeat(view: &View) -> Option<Encoded> {
    Some(heartbeat::message(view.host.identity, view.aircraft))
}
