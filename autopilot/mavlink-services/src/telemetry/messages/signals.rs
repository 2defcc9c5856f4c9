//! The few signals that say why the aircraft still flies: DEBUG_VECT, each from a component of its own.
//!
//! QGroundControl's inspector keys its rows by message and component and plots the three numbers of a row, so each
//! signal is a row. The components send no HEARTBEAT: for a station they are no devices.

use ::mavlink::dialects::common::DEBUG_VECT_DATA;
use flight_control::StepLog;

use crate::codec::Encoded;
use crate::convert;
use flight_management::event::Snapshot;

/// A signal: roll, pitch, yaw.
struct Signal {
    /// Component id, of those that MAVLink leaves to the user (MAV_COMP_ID_USER1 is 25).
    component: u8,
    /// Name, at most nine characters: QGroundControl shows no more.
    name: &'static str,
    of: fn(&StepLog) -> [f64; 3],
}

/// Estimate, rad/s^2; level, in units of its threshold; authority, percent; compensation after limits, rad;
/// what it gives by the design model, rad/s^2.
const SIGNALS: [Signal; 5] = [
    Signal { component: 25, name: "estimate", of: |log| [log.z2.x, log.z2.y, log.z2.z] },
    Signal { component: 26, name: "level", of: |log| [log.levels.x, log.levels.y, log.levels.z] },
    Signal {
        component: 27,
        name: "authority",
        of: |log| [log.authority.roll_pct, log.authority.pitch_pct, log.authority.yaw_pct],
    },
    Signal {
        component: 28,
        name: "applied",
        of: |log| {
            let applied = &log.applied_compensation;
            [applied.aileron_rad, applied.nozzle_pitch_rad, applied.nozzle_yaw_rad]
        },
    },
    Signal {
        component: 29,
        name: "attained",
        of: |log| [log.attained.x, log.attained.y, log.attained.z],
    },
];

/// DEBUG_VECT of each signal; x is roll, y pitch, z yaw.
pub fn vectors(state: &Snapshot) -> Vec<Encoded> {
    let vector = |signal: &Signal| {
        let [x, y, z] = (signal.of)(&state.log).map(convert::float);
        let time_usec = state.time.as_micros();
        let message = DEBUG_VECT_DATA { time_usec, x, y, z, name: signal.name.into() };
        Encoded::new(&message).from_component(signal.component)
    };
    SIGNALS.iter().map(vector).collect()
}
