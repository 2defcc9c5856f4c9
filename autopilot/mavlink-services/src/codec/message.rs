//! Payloads to messages that the autopilot reacts to.

#![expect(deprecated, reason = "ground stations still send PING, SET_MODE and MISSION_ITEM")]

use ::mavlink::dialects::common::{
    COMMAND_INT_DATA, COMMAND_LONG_DATA, FILE_TRANSFER_PROTOCOL_DATA, HEARTBEAT_DATA,
    MANUAL_CONTROL_DATA, MISSION_ACK_DATA, MISSION_CLEAR_ALL_DATA, MISSION_COUNT_DATA,
    MISSION_ITEM_DATA, MISSION_ITEM_INT_DATA, MISSION_REQUEST_DATA, MISSION_REQUEST_INT_DATA,
    MISSION_REQUEST_LIST_DATA, MISSION_REQUEST_PARTIAL_LIST_DATA, MISSION_SET_CURRENT_DATA,
    MISSION_WRITE_PARTIAL_LIST_DATA, MavModeFlag, PARAM_REQUEST_LIST_DATA, PARAM_REQUEST_READ_DATA,
    PARAM_SET_DATA, PING_DATA, RC_CHANNELS_OVERRIDE_DATA, REQUEST_DATA_STREAM_DATA,
    SERIAL_CONTROL_DATA, SET_ATTITUDE_TARGET_DATA, SET_MODE_DATA,
    SET_POSITION_TARGET_GLOBAL_INT_DATA, SET_POSITION_TARGET_LOCAL_NED_DATA, SETUP_SIGNING_DATA,
    TIMESYNC_DATA,
};
use ::mavlink::{MavlinkVersion, MessageData};

use super::{Frame, Identity};

mod logs;

use crate::signing::Key;
pub use logs::LogRequest;

/// A message that the autopilot reacts to.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// HEARTBEAT of a ground station or another vehicle: its MAV_TYPE.
    Heartbeat(u8),
    Ping(PING_DATA),
    TimeSync(TIMESYNC_DATA),
    SetMode(SetMode),
    ParamRequestRead(PARAM_REQUEST_READ_DATA),
    ParamRequestList,
    ParamSet(ParamSet),
    Command(CommandMessage),
    SetAttitudeTarget(SET_ATTITUDE_TARGET_DATA),
    SetPositionGlobal(PositionTarget<i32>),
    SetPositionLocal(PositionTarget<f32>),
    ManualControl(ManualControl),
    /// RC_CHANNELS_OVERRIDE: channels 1 to 8, us; 65535 means ignore, 0 release.
    RcOverride([u16; 8]),
    /// MISSION_REQUEST_LIST of this list.
    MissionRequestList(ListKind),
    /// MISSION_COUNT: the number of items to follow.
    MissionCount(ListKind, u16),
    MissionItemInt(MissionItem<i32>),
    /// MISSION_ITEM, the old form with floats.
    MissionItem(MissionItem<f32>),
    /// MISSION_REQUEST_INT (true) or MISSION_REQUEST (false) for one item.
    MissionRequest(ListKind, u16, bool),
    MissionClear(ListKind),
    MissionSetCurrent(u16),
    /// MISSION_ACK: its MAV_MISSION_RESULT.
    MissionAck(ListKind, u8),
    MissionPartial(ListKind),
    /// FILE_TRANSFER_PROTOCOL: the 251 bytes.
    Ftp(Box<[u8; 251]>),
    RequestDataStream(StreamRequest),
    SerialControl(Box<SerialControl>),
    /// LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END or LOG_ERASE.
    Log(LogRequest),
    SetupSigning(SetupSigning),
}

/// SET_MODE in PX4's encoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetMode {
    /// Main and sub mode count.
    pub is_custom: bool,
    pub main: u8,
    pub sub: u8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SetupSigning {
    /// `None` turns signing off.
    pub key: Option<Key>,
    /// First timestamp to use, 10 us since 2015.
    pub initial_timestamp: u64,
}

/// MAV_MISSION_TYPE as a number: 0 mission, 1 fence, 2 rally points, 255 all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ListKind(pub u8);

impl ListKind {
    pub const MISSION: Self = Self(0);
    pub const ALL: Self = Self(255);
}

/// MISSION_ITEM_INT (`i32` places, 1e-7 deg or 1e-4 m) or MISSION_ITEM (`f32` places, deg or m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MissionItem<P> {
    /// param1 to param4.
    pub params: [f32; 4],
    pub x: P,
    pub y: P,
    /// Altitude or z, m.
    pub z: f32,
    pub words: ItemWords,
}

/// The integer fields of a mission item.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ItemWords {
    /// Index in the list, from 0.
    pub seq: u16,
    pub command: u16,
    pub frame: u8,
    /// 1 for the item to begin with; 2 for a guided target, 3 for an altitude change (older form).
    pub current: u8,
    /// Continue with the next item.
    pub autocontinue: bool,
    pub list: ListKind,
}

/// SET_POSITION_TARGET_GLOBAL_INT (`i32` places, 1e-7 deg) or _LOCAL_NED (`f32` places, m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionTarget<P> {
    pub x: P,
    pub y: P,
    /// Altitude, m up (global), or z, m down (local).
    pub z: f32,
    /// Velocity north, east, down, m/s.
    pub velocity: [f32; 3],
    /// Yaw, rad.
    pub yaw: f32,
    /// POSITION_TARGET_TYPEMASK: set bits are ignored fields.
    pub ignored: u16,
    pub frame: u8,
}

/// MANUAL_CONTROL: -1000 to 1000, `i16::MAX` for an absent axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ManualControl {
    pub x: i16,
    pub y: i16,
    pub z: i16,
    pub r: i16,
    /// The system to control.
    pub target: u8,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamRequest {
    pub rate_hz: u16,
    pub stream: u8,
    /// 1 to start, 0 to stop.
    pub start: bool,
}

/// SERIAL_CONTROL with its device as a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SerialControl {
    pub device: u8,
    pub flags: u8,
    /// Number of valid bytes in `data`; a number beyond its length means all.
    pub count: u8,
    pub data: [u8; 70],
}

impl SerialControl {
    pub fn typed(&self) -> &[u8] {
        &self.data[..usize::from(self.count).min(self.data.len())]
    }
}

/// PARAM_SET with its type as a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParamSet {
    /// Name, NUL-padded.
    pub id: [u8; 16],
    /// The four bytes of the value.
    pub value: [u8; 4],
    pub kind: u8,
}

/// COMMAND_LONG or COMMAND_INT with the command as a number.
#[derive(Debug, Clone, Copy)]
pub struct CommandMessage {
    pub id: u16,
    /// param1 to param7. In a COMMAND_INT the fifth and sixth are in `xy`, and NaN ("not given") here.
    pub params: [f32; 7],
    /// MAV_FRAME of a COMMAND_INT.
    pub frame: Option<u8>,
    /// x and y of a COMMAND_INT, 1e-7 deg or 1e-4 m.
    pub xy: Option<[i32; 2]>,
}

impl PartialEq for CommandMessage {
    /// The same bits, so that two commands with NaN for "not given" are the same.
    fn eq(&self, other: &Self) -> bool {
        (self.id, self.frame, self.xy, self.params.map(f32::to_bits))
            == (other.id, other.frame, other.xy, other.params.map(f32::to_bits))
    }
}

/// Reads a payload, zero-extended; bytes beyond the definition are ignored.
struct Fields<const N: usize>([u8; N]);

impl<const N: usize> Fields<N> {
    fn new(payload: &[u8]) -> Self {
        let mut fields = [0; N];
        let length = payload.len().min(N);
        fields[..length].copy_from_slice(&payload[..length]);
        Self(fields)
    }

    fn bytes<const K: usize>(&self, at: usize) -> [u8; K] {
        let mut bytes = [0; K];
        bytes.copy_from_slice(&self.0[at..at + K]);
        bytes
    }

    fn u8(&self, at: usize) -> u8 {
        self.0[at]
    }

    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.bytes(at))
    }

    fn i16(&self, at: usize) -> i16 {
        i16::from_le_bytes(self.bytes(at))
    }

    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.bytes(at))
    }

    fn i32(&self, at: usize) -> i32 {
        i32::from_le_bytes(self.bytes(at))
    }

    fn f32(&self, at: usize) -> f32 {
        f32::from_le_bytes(self.bytes(at))
    }

    fn floats<const K: usize>(&self, at: usize) -> [f32; K] {
        core::array::from_fn(|i| self.f32(at + 4 * i))
    }

    fn identity(&self, at: usize) -> Identity {
        Identity { system: self.0[at], component: self.0[at + 1] }
    }
}

/// The message in a frame and its target; `None` if the autopilot does not handle it.
pub fn decode(frame: &Frame) -> Option<(Identity, Message)> {
    let payload = frame.payload;
    let at = |system, component| Identity { system, component };
    Some(match frame.id {
        HEARTBEAT_DATA::ID => (at(0, 0), Message::Heartbeat(Fields::<9>::new(payload).u8(4))),
        PING_DATA::ID => {
            let data: PING_DATA = read(payload)?;
            (at(data.target_system, data.target_component), Message::Ping(data))
        }
        TIMESYNC_DATA::ID => {
            let data: TIMESYNC_DATA = read(payload)?;
            (at(data.target_system, data.target_component), Message::TimeSync(data))
        }
        SET_MODE_DATA::ID => {
            let data: SET_MODE_DATA = read(payload)?;
            let is_custom = data.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED);
            let [_, _, main, sub] = data.custom_mode.to_le_bytes();
            (at(data.target_system, 0), Message::SetMode(SetMode { is_custom, main, sub }))
        }
        PARAM_REQUEST_READ_DATA::ID => {
            let data: PARAM_REQUEST_READ_DATA = read(payload)?;
            (at(data.target_system, data.target_component), Message::ParamRequestRead(data))
        }
        PARAM_REQUEST_LIST_DATA::ID => {
            let data: PARAM_REQUEST_LIST_DATA = read(payload)?;
            (at(data.target_system, data.target_component), Message::ParamRequestList)
        }
        PARAM_SET_DATA::ID => {
            let fields = Fields::<{ PARAM_SET_DATA::ENCODED_LEN }>::new(payload);
            let set = ParamSet { value: fields.bytes(0), id: fields.bytes(6), kind: fields.u8(22) };
            (fields.identity(4), Message::ParamSet(set))
        }
        COMMAND_LONG_DATA::ID => {
            let fields = Fields::<{ COMMAND_LONG_DATA::ENCODED_LEN }>::new(payload);
            let (id, params) = (fields.u16(28), fields.floats(0));
            let command = CommandMessage { id, params, frame: None, xy: None };
            (fields.identity(30), Message::Command(command))
        }
        COMMAND_INT_DATA::ID => {
            let fields = Fields::<{ COMMAND_INT_DATA::ENCODED_LEN }>::new(payload);
            let [p1, p2, p3, p4] = fields.floats(0);
            let params = [p1, p2, p3, p4, f32::NAN, f32::NAN, fields.f32(24)];
            let (frame, xy) = (Some(fields.u8(32)), Some([fields.i32(16), fields.i32(20)]));
            let command = CommandMessage { id: fields.u16(28), params, frame, xy };
            (fields.identity(30), Message::Command(command))
        }
        FILE_TRANSFER_PROTOCOL_DATA::ID => {
            let fields = Fields::<254>::new(payload);
            (fields.identity(1), Message::Ftp(Box::new(fields.bytes(3))))
        }
        REQUEST_DATA_STREAM_DATA::ID => {
            let fields = Fields::<6>::new(payload);
            let request = StreamRequest {
                rate_hz: fields.u16(0),
                stream: fields.u8(4),
                start: fields.u8(5) != 0,
            };
            (fields.identity(2), Message::RequestDataStream(request))
        }
        SERIAL_CONTROL_DATA::ID => {
            let fields = Fields::<{ SERIAL_CONTROL_DATA::ENCODED_LEN }>::new(payload);
            let control = SerialControl {
                device: fields.u8(6),
                flags: fields.u8(7),
                count: fields.u8(8),
                data: fields.bytes(9),
            };
            (fields.identity(79), Message::SerialControl(Box::new(control)))
        }
        SETUP_SIGNING_DATA::ID => {
            let f = Fields::<42>::new(payload);
            let initial_timestamp = u64::from_le_bytes(f.bytes(0));
            let setup = SetupSigning { key: Key::new(f.bytes(10)), initial_timestamp };
            (f.identity(8), Message::SetupSigning(setup))
        }
        id => {
            let other = reference(id, payload).or_else(|| mission(id, payload));
            return other.or_else(|| logs::decode(id, payload));
        }
    })
}

/// Setpoints and stick positions.
fn reference(id: u32, payload: &[u8]) -> Option<(Identity, Message)> {
    let at = |system, component| Identity { system, component };
    Some(match id {
        SET_ATTITUDE_TARGET_DATA::ID => {
            let data: SET_ATTITUDE_TARGET_DATA = read(payload)?;
            (at(data.target_system, data.target_component), Message::SetAttitudeTarget(data))
        }
        SET_POSITION_TARGET_GLOBAL_INT_DATA::ID => {
            let fields = Fields::<53>::new(payload);
            let target = position_target(&fields, fields.i32(4), fields.i32(8));
            (fields.identity(50), Message::SetPositionGlobal(target))
        }
        SET_POSITION_TARGET_LOCAL_NED_DATA::ID => {
            let fields = Fields::<53>::new(payload);
            let target = position_target(&fields, fields.f32(4), fields.f32(8));
            (fields.identity(50), Message::SetPositionLocal(target))
        }
        MANUAL_CONTROL_DATA::ID => {
            let fields = Fields::<11>::new(payload);
            let control = ManualControl {
                x: fields.i16(0),
                y: fields.i16(2),
                z: fields.i16(4),
                r: fields.i16(6),
                target: fields.u8(10),
            };
            (at(control.target, 0), Message::ManualControl(control))
        }
        RC_CHANNELS_OVERRIDE_DATA::ID => {
            let fields = Fields::<18>::new(payload);
            let channels = core::array::from_fn(|i| fields.u16(2 * i));
            (fields.identity(16), Message::RcOverride(channels))
        }
        _ => return None,
    })
}

fn position_target<P>(fields: &Fields<53>, x: P, y: P) -> PositionTarget<P> {
    PositionTarget {
        x,
        y,
        z: fields.f32(12),
        velocity: fields.floats(16),
        yaw: fields.f32(40),
        ignored: fields.u16(48),
        frame: fields.u8(52),
    }
}

fn mission(id: u32, payload: &[u8]) -> Option<(Identity, Message)> {
    let f = Fields::<38>::new(payload);
    Some(match id {
        MISSION_REQUEST_LIST_DATA::ID => {
            (f.identity(0), Message::MissionRequestList(ListKind(f.u8(2))))
        }
        MISSION_COUNT_DATA::ID => {
            (f.identity(2), Message::MissionCount(ListKind(f.u8(4)), f.u16(0)))
        }
        MISSION_REQUEST_INT_DATA::ID | MISSION_REQUEST_DATA::ID => {
            let as_int = id == MISSION_REQUEST_INT_DATA::ID;
            (f.identity(2), Message::MissionRequest(ListKind(f.u8(4)), f.u16(0), as_int))
        }
        MISSION_CLEAR_ALL_DATA::ID => (f.identity(0), Message::MissionClear(ListKind(f.u8(2)))),
        MISSION_SET_CURRENT_DATA::ID => (f.identity(2), Message::MissionSetCurrent(f.u16(0))),
        MISSION_ACK_DATA::ID => (f.identity(0), Message::MissionAck(ListKind(f.u8(3)), f.u8(2))),
        MISSION_WRITE_PARTIAL_LIST_DATA::ID | MISSION_REQUEST_PARTIAL_LIST_DATA::ID => {
            (f.identity(4), Message::MissionPartial(ListKind(f.u8(6))))
        }
        MISSION_ITEM_INT_DATA::ID => {
            let item = mission_item(&f, f.i32(16), f.i32(20));
            (f.identity(32), Message::MissionItemInt(item))
        }
        MISSION_ITEM_DATA::ID => {
            let item = mission_item(&f, f.f32(16), f.f32(20));
            (f.identity(32), Message::MissionItem(item))
        }
        _ => return None,
    })
}

fn mission_item<P>(fields: &Fields<38>, x: P, y: P) -> MissionItem<P> {
    MissionItem {
        params: fields.floats(0),
        x,
        y,
        z: fields.f32(24),
        words: ItemWords {
            seq: fields.u16(28),
            command: fields.u16(30),
            frame: fields.u8(34),
            current: fields.u8(35),
            autocontinue: fields.u8(36) != 0,
            list: ListKind(fields.u8(37)),
        },
    }
}

/// Reads a message whose definition contains no enum, so that every payload can be read.
fn read<D: MessageData>(payload: &[u8]) -> Option<D> {
    D::deser(MavlinkVersion::V2, payload).ok()
}
