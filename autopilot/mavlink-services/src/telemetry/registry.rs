//! The table of messages: id, default rate, and the function that builds each.
//!
//! Streams and REQUEST_MESSAGE use it; docs/mavlink.md has the same table, with the content of each.

use core::time::Duration;

use ::mavlink::MessageData;
use ::mavlink::dialects::common as wire;

use crate::aircraft::Aircraft;
use crate::codec::Encoded;
use crate::modes;
use crate::telemetry::{TelemetryView, motion, status};
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
    Flight(fn(&TelemetryView, &Snapshot) -> Encoded),
    /// Several of the same id, built from the state of the flight.
    Group(fn(&Snapshot) -> Vec<Encoded>),
    /// Built from what is known of the aircraft also without a flight.
    Aircraft(fn(&Aircraft) -> Encoded),
    /// Built from data that are known also without a flight.
    Known(fn(&TelemetryView) -> Option<Encoded>),
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
    pub fn build(&self, view: &TelemetryView) -> Vec<Encoded> {
        let state = view.shared.aircraft.snapshot();
        match self.build {
            Build::State(build) => state.map(build).into_iter().collect(),
            Build::Measured(build) => state.and_then(build).into_iter().collect(),
            Build::Flight(build) => state.map(|state| build(view, state)).into_iter().collect(),
            Build::Group(build) => state.map(build).unwrap_or_default(),
            Build::Aircraft(build) => vec![build(&view.shared.aircraft)],
            Build::Known(build) => build(view).into_iter().collect(),
            Build::Listed(build) => (1..=u8::MAX).map_while(build).collect(),
        }
    }

    /// The messages that answer a request; `index` selects an item of a list, 0 all of it.
    pub fn answer(&self, view: &TelemetryView, index: u8) -> Result<Vec<Encoded>, Nothing> {
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
        // A tiny rate must not overflow the duration, which would panic.
        (hz > 0.0).then(|| Duration::from_secs_f64((1.0 / hz).min(1.0e6)))
    }
}

/// Rows of [`TABLE`].
pub const ROWS: usize = 36;

macro_rules! table {
    ($($message:ident: $rate:ident$(($ms:literal))?, $group:ident, $build:ident($function:expr);)*) => {
        /// The table, in the order in which messages that are due together are sent.
        #[expect(deprecated, reason = "QGroundControl requests PROTOCOL_VERSION when it connects")]
        pub static TABLE: [Row; ROWS] = [$(Row {
            id: wire::$message::ID,
            name: wire::$message::NAME,
            rate: Rate::$rate$(($ms))?,
            group: Group::$group,
            build: Build::$build($function),
        }),*];
    };
}

table! {
    HEARTBEAT_DATA: Answer, Extra3, Known(status::heartbeat);
    SYS_STATUS_DATA: EveryMs(500), ExtendedStatus, Known(status::sys_status);
    EXTENDED_SYS_STATE_DATA: EveryMs(500), ExtendedStatus, Aircraft(status::extended_sys_state);
    ATTITUDE_DATA: Attitude, Extra1, State(motion::attitude);
    ATTITUDE_QUATERNION_DATA: Attitude, Extra1, State(motion::attitude_quaternion);
    GLOBAL_POSITION_INT_DATA: Position, Position, Measured(motion::global_position_int);
    LOCAL_POSITION_NED_DATA: Position, Position, State(motion::local_position_ned);
    ODOMETRY_DATA: Position, Position, State(motion::odometry);
    VFR_HUD_DATA: Position, Extra2, Flight(status::vfr_hud);
    ALTITUDE_DATA: EveryMs(200), Extra2, State(motion::altitude);
    GPS_RAW_INT_DATA: EveryMs(200), RawSensors, Flight(motion::gps_raw_int);
    HOME_POSITION_DATA: EveryMs(2000), ExtendedStatus, Known(motion::home_position);
    ATTITUDE_TARGET_DATA: EveryMs(200), RawController, Flight(status::attitude_target);
    POSITION_TARGET_GLOBAL_INT_DATA: EveryMs(200), RawController,
        State(status::position_target_global_int);
    NAV_CONTROLLER_OUTPUT_DATA: EveryMs(200), RawController, State(status::nav_controller_output);
    SERVO_OUTPUT_RAW_DATA: Actuators, RcChannels, Flight(status::servo_output_raw);
    ACTUATOR_OUTPUT_STATUS_DATA: Actuators, RcChannels, Flight(status::actuator_output_status);
    DEBUG_VECT_DATA: EveryMs(250), Extra3, Group(status::vectors);
    NAMED_VALUE_FLOAT_DATA: OnRequest, Extra3, Group(status::named_values);
    DEBUG_FLOAT_ARRAY_DATA: Compensator, Extra3, State(status::why);
    HIGHRES_IMU_DATA: EveryMs(100), RawSensors, State(motion::highres_imu);
    SCALED_PRESSURE_DATA: EveryMs(500), RawSensors, State(motion::scaled_pressure);
    WIND_COV_DATA: EveryMs(1000), Extra3, State(motion::wind_cov);
    BATTERY_STATUS_DATA: EveryMs(1000), ExtendedStatus, Known(status::battery_status);
    FUEL_STATUS_DATA: EveryMs(1000), ExtendedStatus, Known(status::fuel_status);
    ESTIMATOR_STATUS_DATA: EveryMs(1000), ExtendedStatus, Flight(status::estimator_status);
    VIBRATION_DATA: EveryMs(1000), Extra3, State(status::vibration);
    SYSTEM_TIME_DATA: EveryMs(1000), Extra3, Known(status::system_time);
    MISSION_CURRENT_DATA: EveryMs(1000), ExtendedStatus, State(status::mission_current);
    FENCE_STATUS_DATA: EveryMs(1000), ExtendedStatus, State(status::fence_status);
    CURRENT_MODE_DATA: EveryMs(2000), ExtendedStatus, Aircraft(modes::current_mode);
    AVAILABLE_MODES_MONITOR_DATA: EveryMs(2000), ExtendedStatus, Aircraft(modes::monitor);
    AVAILABLE_MODES_DATA: Answer, ExtendedStatus, Listed(modes::available_modes);
    AUTOPILOT_VERSION_DATA: OnRequest, ExtendedStatus, Known(status::autopilot_version);
    PROTOCOL_VERSION_DATA: OnRequest, ExtendedStatus, Known(status::protocol_version);
    COMPONENT_METADATA_DATA: Answer, ExtendedStatus, Known(status::component_metadata);
}
