//! The table of messages: id, default rate, and the function that builds each.
//!
//! Streams and REQUEST_MESSAGE use it; docs/mavlink.md has the same table, with the content of each.

use core::time::Duration;

use ::mavlink::MessageData;
use ::mavlink::dialects::common as wire;

use crate::codec::Encoded;
use crate::modes;
use crate::telemetry::{View, controls, motion, status};
use flight_management::event::Snapshot;
use flight_management::parameters::StreamParameters;

/// One message, or a group of them with the same id.
#[derive(Debug)]
pub struct Row {
    pub id: u32,
    pub name: &'static str,
    pub rate: Rate,
    pub group: Group,
    build: Build,
}

/// Default rate of a message. Wall time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rate {
    /// Time between two of them, ms.
    EveryMs(u32),
    /// Parameter of attitude messages.
    Attitude,
    /// Parameter of position messages.
    Position,
    /// Parameter of the effectors' messages.
    Actuators,
    /// Parameter of the compensator's messages.
    Compensator,
    /// Not streamed by default; a peer can request an interval.
    OnRequest,
    /// Never streamed: only an answer to REQUEST_MESSAGE.
    Answer,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Group {
    RawSensors = 1,
    ExtendedStatus = 2,
    RcChannels = 3,
    RawController = 4,
    Position = 6,
    /// EXTRA1: attitude.
    Extra1 = 10,
    /// EXTRA2: head-up display.
    Extra2 = 11,
    /// EXTRA3: the rest.
    Extra3 = 12,
}

/// MAV_DATA_STREAM_ALL: every group.
pub const ALL_GROUPS: u8 = 0;

#[derive(Debug)]
enum Build {
    /// Built from the state of the flight.
    State(fn(&Snapshot) -> Encoded),
    /// The same, while what it says is known.
    Measured(fn(&Snapshot) -> Option<Encoded>),
    /// Built from the state of the flight and other data.
    Flight(fn(&View, &Snapshot) -> Encoded),
    /// Several of the same id, built from the state of the flight.
    Group(fn(&Snapshot) -> Vec<Encoded>),
    /// Built from data that are known also without a flight.
    Known(fn(&View) -> Option<Encoded>),
    /// A list, built item by item, from 1.
    Listed(fn(u8) -> Option<Encoded>),
}

/// Why a request has no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Nothing {
    /// There is nothing to send yet.
    Yet,
    /// The list has no item with this number.
    There,
}

impl Row {
    /// The messages at this moment; none without a flight where the message needs one.
    pub fn build(&self, view: &View) -> Vec<Encoded> {
        let state = view.shared.aircraft.snapshot();
        match self.build {
            Build::State(build) => state.map(build).into_iter().collect(),
            Build::Measured(build) => state.and_then(build).into_iter().collect(),
            Build::Flight(build) => state.map(|state| build(view, state)).into_iter().collect(),
            Build::Group(build) => state.map(build).unwrap_or_default(),
            Build::Known(build) => build(view).into_iter().collect(),
            Build::Listed(build) => (1..=u8::MAX).map_while(build).collect(),
        }
    }

    /// The messages that answer a request; `index` selects an item of a list, 0 all of it.
    pub fn answer(&self, view: &View, index: u8) -> Result<Vec<Encoded>, Nothing> {
        if let Build::Listed(build) = self.build
            && index != 0
        {
            return build(index).map(|message| vec![message]).ok_or(Nothing::There);
        }
        let messages = self.build(view);
        if messages.is_empty() { Err(Nothing::Yet) } else { Ok(messages) }
    }

    /// Default interval; `None`: not streamed.
    pub fn default_interval(&self, streams: &StreamParameters) -> Option<Duration> {
        let hz = match self.rate {
            Rate::EveryMs(ms) => return Some(Duration::from_millis(u64::from(ms))),
            Rate::Attitude => streams.attitude_hz,
            Rate::Position => streams.position_hz,
            Rate::Actuators => streams.actuators_hz,
            Rate::Compensator => streams.compensator_hz,
            Rate::OnRequest | Rate::Answer => return None,
        };
        // A rate of zero stops the stream.
        (hz > 0.0).then(|| Duration::from_secs_f64((1.0 / hz).min(1.0e6)))
    }
}

/// The row of a message.
pub fn find(id: u32) -> Option<(usize, &'static Row)> {
    TABLE.iter().enumerate().find(|(_, row)| row.id == id)
}

const fn row<D: MessageData>(rate: Rate, group: Group, build: Build) -> Row {
    Row { id: D::ID, name: D::NAME, rate, group, build }
}

/// Rows of [`TABLE`].
pub const ROWS: usize = 34;

#[expect(deprecated, reason = "QGroundControl requests it when it connects")]
const PROTOCOL_VERSION: Row = row::<wire::PROTOCOL_VERSION_DATA>(
    Rate::OnRequest,
    Group::ExtendedStatus,
    Build::Known(status::protocol_version),
);

/// The table, in the order in which messages that are due together are sent.
pub static TABLE: [Row; ROWS] = {
    use Build::{Flight, Known, Listed, State};
    use Group::{
        ExtendedStatus, Extra1, Extra2, Extra3, Position, RawController, RawSensors, RcChannels,
    };
    use Rate::{Answer, EveryMs, OnRequest};
    [
        row::<wire::HEARTBEAT_DATA>(Answer, Extra3, Known(status::heartbeat)),
        row::<wire::SYS_STATUS_DATA>(EveryMs(500), ExtendedStatus, Known(status::sys_status)),
        row::<wire::EXTENDED_SYS_STATE_DATA>(
            EveryMs(500),
            ExtendedStatus,
            Known(|view| Some(status::extended_sys_state(&view.shared.aircraft))),
        ),
        row::<wire::ATTITUDE_DATA>(Rate::Attitude, Extra1, State(motion::attitude)),
        row::<wire::ATTITUDE_QUATERNION_DATA>(
            Rate::Attitude,
            Extra1,
            State(motion::attitude_quaternion),
        ),
        row::<wire::GLOBAL_POSITION_INT_DATA>(
            Rate::Position,
            Position,
            Build::Measured(motion::global_position_int),
        ),
        row::<wire::LOCAL_POSITION_NED_DATA>(
            Rate::Position,
            Position,
            State(motion::local_position_ned),
        ),
        row::<wire::ODOMETRY_DATA>(Rate::Position, Position, State(motion::odometry)),
        row::<wire::VFR_HUD_DATA>(Rate::Position, Extra2, Flight(motion::vfr_hud)),
        row::<wire::ALTITUDE_DATA>(EveryMs(200), Extra2, State(motion::altitude)),
        row::<wire::GPS_RAW_INT_DATA>(EveryMs(200), RawSensors, Flight(motion::gps_raw_int)),
        row::<wire::HOME_POSITION_DATA>(
            EveryMs(2000),
            ExtendedStatus,
            Known(motion::home_position),
        ),
        row::<wire::ATTITUDE_TARGET_DATA>(
            EveryMs(200),
            RawController,
            Flight(controls::attitude_target),
        ),
        row::<wire::POSITION_TARGET_GLOBAL_INT_DATA>(
            EveryMs(200),
            RawController,
            State(controls::position_target_global_int),
        ),
        row::<wire::NAV_CONTROLLER_OUTPUT_DATA>(
            EveryMs(200),
            RawController,
            State(controls::nav_controller_output),
        ),
        row::<wire::SERVO_OUTPUT_RAW_DATA>(
            Rate::Actuators,
            RcChannels,
            Flight(controls::servo_output_raw),
        ),
        row::<wire::ACTUATOR_OUTPUT_STATUS_DATA>(
            Rate::Actuators,
            RcChannels,
            Flight(controls::actuator_output_status),
        ),
        row::<wire::DEBUG_VECT_DATA>(EveryMs(250), Extra3, Build::Group(controls::vectors)),
        row::<wire::NAMED_VALUE_FLOAT_DATA>(
            OnRequest,
            Extra3,
            Build::Group(controls::named_values),
        ),
        row::<wire::DEBUG_FLOAT_ARRAY_DATA>(Rate::Compensator, Extra3, State(controls::why)),
        row::<wire::HIGHRES_IMU_DATA>(EveryMs(100), RawSensors, State(motion::highres_imu)),
        row::<wire::SCALED_PRESSURE_DATA>(EveryMs(500), RawSensors, State(motion::scaled_pressure)),
        row::<wire::WIND_COV_DATA>(EveryMs(1000), Extra3, State(motion::wind_cov)),
        row::<wire::BATTERY_STATUS_DATA>(
            EveryMs(1000),
            ExtendedStatus,
            Known(status::battery_status),
        ),
        row::<wire::ESTIMATOR_STATUS_DATA>(
            EveryMs(1000),
            ExtendedStatus,
            Flight(status::estimator_status),
        ),
        row::<wire::VIBRATION_DATA>(EveryMs(1000), Extra3, State(status::vibration)),
        row::<wire::SYSTEM_TIME_DATA>(EveryMs(1000), Extra3, Known(status::system_time)),
        row::<wire::MISSION_CURRENT_DATA>(
            EveryMs(1000),
            ExtendedStatus,
            State(status::mission_current),
        ),
        row::<wire::CURRENT_MODE_DATA>(
            EveryMs(2000),
            ExtendedStatus,
            Known(|view| Some(modes::current_mode(&view.shared.aircraft))),
        ),
        row::<wire::AVAILABLE_MODES_MONITOR_DATA>(
            EveryMs(2000),
            ExtendedStatus,
            Known(|_| Some(modes::monitor())),
        ),
        row::<wire::AVAILABLE_MODES_DATA>(Answer, ExtendedStatus, Listed(modes::available_modes)),
        row::<wire::AUTOPILOT_VERSION_DATA>(
            OnRequest,
            ExtendedStatus,
            Known(status::autopilot_version),
        ),
        PROTOCOL_VERSION,
        row::<wire::COMPONENT_METADATA_DATA>(
            Answer,
            ExtendedStatus,
            Known(status::component_metadata),
        ),
    ]
};
