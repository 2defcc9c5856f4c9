//! Payloads to messages that the autopilot reacts to.

#![expect(deprecated, reason = "ground stations still send PING, SET_MODE and MISSION_ITEM")]

use ::mavlink::dialects::common as wire;
use ::mavlink::{MavlinkVersion, MessageData};

use super::{Frame, Identity, PAYLOAD_MAX};
use crate::signing::Key;

/// A message that the autopilot reacts to.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// HEARTBEAT of a ground station or another vehicle: its MAV_TYPE.
    Heartbeat(u8),
    Ping(wire::PING_DATA),
    TimeSync(wire::TIMESYNC_DATA),
    SetMode(SetMode),
    ParamRequestRead(wire::PARAM_REQUEST_READ_DATA),
    ParamRequestList,
    ParamSet(ParamSet),
    Command(CommandMessage),
    SetAttitudeTarget(wire::SET_ATTITUDE_TARGET_DATA),
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
    /// MISSION_REQUEST_INT or MISSION_REQUEST for one item.
    MissionRequest(ListKind, u16),
    MissionClear(ListKind),
    MissionSetCurrent(u16),
    /// MISSION_ACK: its MAV_MISSION_RESULT.
    MissionAck(ListKind, u8),
    MissionPartial(ListKind),
    /// FILE_TRANSFER_PROTOCOL: the 251 bytes.
    Ftp(Box<[u8; 251]>),
    RequestDataStream(StreamRequest),
    SerialControl(SerialControl),
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
    pub const FENCE: Self = Self(1);
    pub const RALLY: Self = Self(2);
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
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SerialControl {
    pub device: u8,
    pub flags: u8,
    /// The valid bytes: a number of them beyond the field means all.
    pub typed: Vec<u8>,
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

/// A request of a ground station to the log service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogRequest {
    /// The entries with these numbers.
    List {
        first: u16,
        /// The last; may be beyond the end.
        last: u16,
    },
    /// Part of one log.
    Data {
        id: u16,
        offset: u32,
        /// Bytes; may be beyond the end.
        count: u32,
    },
    /// End of all requests.
    End,
    /// Removal of all logs.
    Erase,
}

/// Reads a payload, zero-extended.
struct MessageFields([u8; PAYLOAD_MAX]);

impl MessageFields {
    fn new(payload: &[u8]) -> Self {
        let mut fields = [0; PAYLOAD_MAX];
        fields[..payload.len()].copy_from_slice(payload);
        Self(fields)
    }

    fn bytes<const K: usize>(&self, at: usize) -> [u8; K] {
        core::array::from_fn(|i| self.0[at + i])
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

    fn list(&self, at: usize) -> ListKind {
        ListKind(self.u8(at))
    }

    /// Target system and component.
    fn target(&self, at: usize) -> Identity {
        Identity { system: self.u8(at), component: self.u8(at + 1) }
    }

    /// Target system; the message names no component.
    fn system(&self, at: usize) -> Identity {
        Identity { system: self.u8(at), component: 0 }
    }
}

/// The message in a frame and its target; `None` if the autopilot does not handle it.
pub fn decode(frame: &Frame) -> Option<(Identity, Message)> {
    let f = MessageFields::new(frame.payload);
    /// A message whose definition contains no enum, so that the library can read every payload.
    macro_rules! by_library {
        ($message:ident, $definition:ident) => {{
            let data = wire::$definition::deser(MavlinkVersion::V2, frame.payload).ok()?;
            let (system, component) = (data.target_system, data.target_component);
            (Identity { system, component }, Message::$message(data))
        }};
    }
    Some(match frame.id {
        wire::HEARTBEAT_DATA::ID => {
            (Identity { system: 0, component: 0 }, Message::Heartbeat(f.u8(4)))
        }
        wire::PING_DATA::ID => by_library!(Ping, PING_DATA),
        wire::TIMESYNC_DATA::ID => by_library!(TimeSync, TIMESYNC_DATA),
        wire::SET_MODE_DATA::ID => {
            // PX4 has the main mode in the third byte of custom_mode and the sub mode in the fourth.
            let custom = wire::MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED.bits();
            let is_custom = f.u8(5) & custom != 0;
            (f.system(4), Message::SetMode(SetMode { is_custom, main: f.u8(2), sub: f.u8(3) }))
        }
        wire::PARAM_REQUEST_READ_DATA::ID => {
            by_library!(ParamRequestRead, PARAM_REQUEST_READ_DATA)
        }
        wire::PARAM_REQUEST_LIST_DATA::ID => (f.target(0), Message::ParamRequestList),
        wire::PARAM_SET_DATA::ID => {
            let set = ParamSet { value: f.bytes(0), id: f.bytes(6), kind: f.u8(22) };
            (f.target(4), Message::ParamSet(set))
        }
        wire::COMMAND_LONG_DATA::ID => {
            let (id, params) = (f.u16(28), f.floats(0));
            let command = CommandMessage { id, params, frame: None, xy: None };
            (f.target(30), Message::Command(command))
        }
        wire::COMMAND_INT_DATA::ID => {
            let [p1, p2, p3, p4] = f.floats(0);
            let params = [p1, p2, p3, p4, f32::NAN, f32::NAN, f.f32(24)];
            let (frame, xy) = (Some(f.u8(32)), Some([f.i32(16), f.i32(20)]));
            let command = CommandMessage { id: f.u16(28), params, frame, xy };
            (f.target(30), Message::Command(command))
        }
        wire::FILE_TRANSFER_PROTOCOL_DATA::ID => (f.target(1), Message::Ftp(Box::new(f.bytes(3)))),
        wire::REQUEST_DATA_STREAM_DATA::ID => {
            let (rate_hz, stream, start) = (f.u16(0), f.u8(4), f.u8(5) != 0);
            (f.target(2), Message::RequestDataStream(StreamRequest { rate_hz, stream, start }))
        }
        wire::SERIAL_CONTROL_DATA::ID => {
            let data: [u8; 70] = f.bytes(9);
            let typed = data[..usize::from(f.u8(8)).min(data.len())].to_vec();
            let control = SerialControl { device: f.u8(6), flags: f.u8(7), typed };
            (f.target(79), Message::SerialControl(control))
        }
        wire::SETUP_SIGNING_DATA::ID => {
            let initial_timestamp = u64::from_le_bytes(f.bytes(0));
            let setup = SetupSigning { key: Key::new(f.bytes(10)), initial_timestamp };
            (f.target(8), Message::SetupSigning(setup))
        }
        wire::SET_ATTITUDE_TARGET_DATA::ID => {
            by_library!(SetAttitudeTarget, SET_ATTITUDE_TARGET_DATA)
        }
        id => return reference(id, &f).or_else(|| mission(id, &f)).or_else(|| log(id, &f)),
    })
}

/// Setpoints and stick positions.
fn reference(id: u32, f: &MessageFields) -> Option<(Identity, Message)> {
    Some(match id {
        wire::SET_POSITION_TARGET_GLOBAL_INT_DATA::ID => {
            (f.target(50), Message::SetPositionGlobal(position_target(f, f.i32(4), f.i32(8))))
        }
        wire::SET_POSITION_TARGET_LOCAL_NED_DATA::ID => {
            (f.target(50), Message::SetPositionLocal(position_target(f, f.f32(4), f.f32(8))))
        }
        wire::MANUAL_CONTROL_DATA::ID => {
            let [x, y, z, r] = [0, 2, 4, 6].map(|at| f.i16(at));
            let control = ManualControl { x, y, z, r, target: f.u8(10) };
            (f.system(10), Message::ManualControl(control))
        }
        wire::RC_CHANNELS_OVERRIDE_DATA::ID => {
            (f.target(16), Message::RcOverride(core::array::from_fn(|i| f.u16(2 * i))))
        }
        _ => return None,
    })
}

fn position_target<P>(f: &MessageFields, x: P, y: P) -> PositionTarget<P> {
    let (velocity, yaw) = (f.floats(16), f.f32(40));
    PositionTarget { x, y, z: f.f32(12), velocity, yaw, ignored: f.u16(48), frame: f.u8(52) }
}

fn mission(id: u32, f: &MessageFields) -> Option<(Identity, Message)> {
    Some(match id {
        wire::MISSION_REQUEST_LIST_DATA::ID => {
            (f.target(0), Message::MissionRequestList(f.list(2)))
        }
        wire::MISSION_COUNT_DATA::ID => (f.target(2), Message::MissionCount(f.list(4), f.u16(0))),
        // The old request has the same fields, and gets the same item.
        wire::MISSION_REQUEST_INT_DATA::ID | wire::MISSION_REQUEST_DATA::ID => {
            (f.target(2), Message::MissionRequest(f.list(4), f.u16(0)))
        }
        wire::MISSION_CLEAR_ALL_DATA::ID => (f.target(0), Message::MissionClear(f.list(2))),
        wire::MISSION_SET_CURRENT_DATA::ID => (f.target(2), Message::MissionSetCurrent(f.u16(0))),
        wire::MISSION_ACK_DATA::ID => (f.target(0), Message::MissionAck(f.list(3), f.u8(2))),
        wire::MISSION_WRITE_PARTIAL_LIST_DATA::ID | wire::MISSION_REQUEST_PARTIAL_LIST_DATA::ID => {
            (f.target(4), Message::MissionPartial(f.list(6)))
        }
        wire::MISSION_ITEM_INT_DATA::ID => {
            (f.target(32), Message::MissionItemInt(mission_item(f, f.i32(16), f.i32(20))))
        }
        wire::MISSION_ITEM_DATA::ID => {
            (f.target(32), Message::MissionItem(mission_item(f, f.f32(16), f.f32(20))))
        }
        _ => return None,
    })
}

fn mission_item<P>(f: &MessageFields, x: P, y: P) -> MissionItem<P> {
    let words = ItemWords {
        seq: f.u16(28),
        command: f.u16(30),
        frame: f.u8(34),
        current: f.u8(35),
        autocontinue: f.u8(36) != 0,
        list: f.list(37),
    };
    MissionItem { params: f.floats(0), x, y, z: f.f32(24), words }
}

fn log(id: u32, f: &MessageFields) -> Option<(Identity, Message)> {
    let (target, request) = match id {
        wire::LOG_REQUEST_LIST_DATA::ID => {
            (f.target(4), LogRequest::List { first: f.u16(0), last: f.u16(2) })
        }
        wire::LOG_REQUEST_DATA_DATA::ID => {
            let (id, offset, count) = (f.u16(8), f.u32(0), f.u32(4));
            (f.target(10), LogRequest::Data { id, offset, count })
        }
        wire::LOG_REQUEST_END_DATA::ID => (f.target(0), LogRequest::End),
        wire::LOG_ERASE_DATA::ID => (f.target(0), LogRequest::Erase),
        _ => return None,
    };
    Some((target, Message::Log(request)))
}
