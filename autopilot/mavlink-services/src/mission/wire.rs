//! Messages of the mission protocol that the autopilot sends, and items as stored.

#![expect(deprecated, reason = "ground stations without integer items get MISSION_REQUEST")]

use ::mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_COUNT_DATA, MISSION_ITEM_INT_DATA, MISSION_ITEM_REACHED_DATA,
    MISSION_REQUEST_DATA, MISSION_REQUEST_INT_DATA, MavMissionResult,
};

use crate::codec::{Encoded, Identity, ListKind, MissionItem};
use crate::convert;

/// MAV_FRAME of places in degrees.
const GLOBAL_FRAMES: [u8; 6] = [0, 3, 5, 6, 10, 11];

/// A list of items as a ground station sent them, for downloads.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stored {
    /// Changes with every item; 0 only for an empty list.
    pub id: u32,
    /// The items in their order.
    pub items: Vec<MissionItem<i32>>,
}

impl Stored {
    /// Stores items; the same items have the same id, also after a restart of the autopilot.
    pub fn new(items: Vec<MissionItem<i32>>) -> Self {
        let id = if items.is_empty() { 0 } else { hash(&items).max(1) };
        Self { id, items }
    }

    pub fn count(&self) -> u16 {
        u16::try_from(self.items.len()).unwrap_or(u16::MAX)
    }
}

fn hash(items: &[MissionItem<i32>]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    for item in items {
        hasher.update(&body(item, 0));
    }
    hasher.finalize()
}

/// The older form with floats as the newer form with integers.
pub fn with_integers(item: &MissionItem<f32>) -> MissionItem<i32> {
    let whole = |value: f32| {
        if value.is_nan() {
            i32::MAX
        } else if GLOBAL_FRAMES.contains(&item.words.frame) {
            convert::degrees_e7(convert::radians(convert::decimal(value)))
        } else {
            convert::whole(f64::from(value))
        }
    };
    MissionItem {
        params: item.params,
        x: whole(item.x),
        y: whole(item.y),
        z: item.z,
        words: item.words,
    }
}

/// MISSION_REQUEST_INT, or MISSION_REQUEST.
pub fn request(seq: u16, as_int: bool, to: Identity) -> Encoded {
    let [low, high] = seq.to_le_bytes();
    let payload = vec![low, high, to.system, to.component, ListKind::MISSION.0];
    if as_int {
        Encoded::by_hand::<MISSION_REQUEST_INT_DATA>(payload)
    } else {
        Encoded::by_hand::<MISSION_REQUEST_DATA>(payload)
    }
}

/// MISSION_ACK; `id` identifies the new plan.
pub fn ack(list: ListKind, result: MavMissionResult, id: u32, to: Identity) -> Encoded {
    let mut payload = vec![to.system, to.component, result as u8, list.0];
    payload.extend_from_slice(&id.to_le_bytes());
    Encoded::by_hand::<MISSION_ACK_DATA>(payload)
}

/// MISSION_COUNT of a list with this id.
pub fn count(list: ListKind, count: u16, id: u32, to: Identity) -> Encoded {
    let mut payload = count.to_le_bytes().to_vec();
    payload.extend_from_slice(&[to.system, to.component, list.0]);
    payload.extend_from_slice(&id.to_le_bytes());
    Encoded::by_hand::<MISSION_COUNT_DATA>(payload)
}

/// MISSION_ITEM_INT; `is_current`: the aircraft flies to it, or would begin with it.
pub fn item(item: &MissionItem<i32>, is_current: bool, to: Identity) -> Encoded {
    let mut payload = body(item, u8::from(is_current));
    payload[32] = to.system;
    payload[33] = to.component;
    Encoded::by_hand::<MISSION_ITEM_INT_DATA>(payload)
}

pub fn reached(seq: u16) -> Encoded {
    Encoded::new(&MISSION_ITEM_REACHED_DATA { seq })
}

/// Payload of MISSION_ITEM_INT, without a target.
fn body(item: &MissionItem<i32>, current: u8) -> Vec<u8> {
    let mut payload = Vec::with_capacity(MISSION_ITEM_INT_DATA::ENCODED_LEN);
    for param in item.params {
        payload.extend_from_slice(&param.to_le_bytes());
    }
    payload.extend_from_slice(&item.x.to_le_bytes());
    payload.extend_from_slice(&item.y.to_le_bytes());
    payload.extend_from_slice(&item.z.to_le_bytes());
    let words = &item.words;
    payload.extend_from_slice(&words.seq.to_le_bytes());
    payload.extend_from_slice(&words.command.to_le_bytes());
    let autocontinue = u8::from(words.autocontinue);
    payload.extend_from_slice(&[0, 0, words.frame, current, autocontinue, words.list.0]);
    payload
}
