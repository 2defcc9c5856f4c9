//! A ground station that follows the mission protocol, over a link that may lose datagrams.

use ::mavlink::dialects::common::{
    MISSION_ACK_DATA, MISSION_CLEAR_ALL_DATA, MISSION_COUNT_DATA, MISSION_ITEM_INT_DATA,
    MISSION_REQUEST_INT_DATA, MISSION_REQUEST_LIST_DATA, MavCmd, MavFrame, MavMessage,
    MavMissionResult, MavMissionType,
};

use crate::codec::Identity;
use crate::peers::Address;
use crate::tests::world::*;

/// The result of success.
pub const ACCEPTED: MavMissionResult = MavMissionResult::MAV_MISSION_ACCEPTED;

/// Timing of a ground station.
#[derive(Debug, Clone, Copy)]
pub struct Manner {
    /// It repeats its last message after this, ms.
    pub timeout_ms: u32,
    /// How often it sends one message.
    pub tries: u32,
    /// It ends a download with an acknowledgement.
    pub acknowledges: bool,
}

/// MAVSDK: half a second, five times.
pub const MAVSDK: Manner = Manner { timeout_ms: 500, tries: 5, acknowledges: true };
/// QGroundControl: one and a half seconds, five times.
pub const QGC: Manner = Manner { timeout_ms: 1_500, tries: 5, acknowledges: true };
/// MAVProxy: a second; it does not end a download.
pub const MAVPROXY: Manner = Manner { timeout_ms: 1_000, tries: 10, acknowledges: false };

/// A link that loses the datagram of one number, both directions counted, and a ground station behind it.
pub struct Client {
    pub world: World,
    pub address: Address,
    pub identity: Identity,
    pub manner: Manner,
    /// The list that it uploads, downloads and clears.
    pub list: MavMissionType,
    /// Number of the datagram that is lost, from 1; 0 for none.
    pub lost: u32,
    pub count: u32,
}

impl Client {
    /// Behind the port of 14550, in level flight.
    pub fn new(manner: Manner) -> Self {
        Self::losing(manner, 0)
    }

    pub fn losing(manner: Manner, lost: u32) -> Self {
        let world = World::flying();
        let list = MavMissionType::MAV_MISSION_TYPE_MISSION;
        Self { world, address: address(14_550), identity: STATION, manner, list, lost, count: 0 }
    }

    fn passes(&mut self) -> bool {
        self.count += 1;
        self.count != self.lost
    }

    /// Sends a message, unless it is lost.
    pub fn send(&mut self, message: &MavMessage) {
        if self.passes() {
            let bytes = self.world.encode(self.identity, message);
            self.world.send_bytes(self.address, &bytes);
        }
    }

    /// Messages of the mission protocol that arrived for this station.
    pub fn receive(&mut self) -> Vec<Got> {
        let got = core::mem::take(&mut self.world.got);
        let (mine, others): (Vec<Got>, Vec<Got>) =
            got.into_iter().partition(|got| got.to == self.address && PROTOCOL.contains(&got.id));
        self.world.got = others;
        mine.into_iter().filter(|_| self.passes()).collect()
    }

    /// Sends until `answer` accepts a received message, and returns its result.
    pub fn exchange<T>(
        &mut self,
        message: &MavMessage,
        answer: impl Fn(&Got) -> Option<T>,
    ) -> Option<T> {
        for _ in 0..self.manner.tries {
            self.send(message);
            for _ in 0..self.manner.timeout_ms / 2 {
                if let Some(answer) = self.receive().iter().find_map(&answer) {
                    return Some(answer);
                }
                self.world.step();
            }
        }
        None
    }

    /// Uploads; the result and id of the acknowledgement, `None` if none came.
    pub fn upload(&mut self, items: &[MISSION_ITEM_INT_DATA]) -> Option<(MavMissionResult, u32)> {
        let mut last = count_of(items.len(), self.list);
        let mut tries = 0;
        'again: while tries < self.manner.tries {
            tries += 1;
            self.send(&last);
            for _ in 0..self.manner.timeout_ms / 2 {
                let received = self.receive();
                for got in &received {
                    if let Some(ack) = got.read::<MISSION_ACK_DATA>() {
                        return Some((ack.mavtype, ack.opaque_id));
                    }
                }
                let request = received.iter().find_map(requested);
                if let Some(item) = request.and_then(|seq| items.get(usize::from(seq))) {
                    last = MavMessage::MISSION_ITEM_INT(item.clone());
                    tries = 0;
                    continue 'again;
                }
                self.world.step();
            }
        }
        None
    }

    /// Downloads the items and the id of the plan.
    pub fn download(&mut self) -> Option<(Vec<MISSION_ITEM_INT_DATA>, u32)> {
        let list = MavMessage::MISSION_REQUEST_LIST(MISSION_REQUEST_LIST_DATA {
            target_system: 1,
            target_component: 1,
            mission_type: self.list,
        });
        let counted = |got: &Got| got.read::<MISSION_COUNT_DATA>();
        let MISSION_COUNT_DATA { count, opaque_id, .. } = self.exchange(&list, counted)?;
        let mut items = Vec::new();
        for seq in 0..count {
            let item = self.exchange(&request_of(seq, self.list), |got| {
                got.read::<MISSION_ITEM_INT_DATA>().filter(|item| item.seq == seq)
            })?;
            items.push(item);
        }
        if self.manner.acknowledges {
            self.send(&mission_ack_of(ACCEPTED, self.list));
        }
        Some((items, opaque_id))
    }

    /// Clears the plan; the result.
    pub fn clear(&mut self) -> Option<MavMissionResult> {
        let clear = MavMessage::MISSION_CLEAR_ALL(MISSION_CLEAR_ALL_DATA {
            target_system: 1,
            target_component: 1,
            mission_type: self.list,
        });
        self.exchange(&clear, |got| Some(got.read::<MISSION_ACK_DATA>()?.mavtype))
    }
}

/// MISSION_REQUEST, _COUNT, _ACK, _REQUEST_INT, _ITEM_INT.
const PROTOCOL: [u32; 5] = [40, 44, 47, 51, 73];

/// The item that MISSION_REQUEST_INT or MISSION_REQUEST requests.
pub fn requested(got: &Got) -> Option<u16> {
    [40, 51].contains(&got.id).then(|| {
        let mut seq = [0; 2];
        seq.copy_from_slice(&got.payload[..2]);
        u16::from_le_bytes(seq)
    })
}

pub fn count(items: usize) -> MavMessage {
    count_of(items, MavMissionType::MAV_MISSION_TYPE_MISSION)
}

pub fn count_of(items: usize, mission_type: MavMissionType) -> MavMessage {
    MavMessage::MISSION_COUNT(MISSION_COUNT_DATA {
        count: u16::try_from(items).unwrap(),
        target_system: 1,
        target_component: 1,
        mission_type,
        ..Default::default()
    })
}

pub fn request(seq: u16) -> MavMessage {
    request_of(seq, MavMissionType::MAV_MISSION_TYPE_MISSION)
}

pub fn request_of(seq: u16, mission_type: MavMissionType) -> MavMessage {
    MavMessage::MISSION_REQUEST_INT(MISSION_REQUEST_INT_DATA {
        seq,
        target_system: 1,
        target_component: 1,
        mission_type,
    })
}

pub fn mission_ack(result: MavMissionResult) -> MavMessage {
    mission_ack_of(result, MavMissionType::MAV_MISSION_TYPE_MISSION)
}

pub fn mission_ack_of(result: MavMissionResult, mission_type: MavMissionType) -> MavMessage {
    MavMessage::MISSION_ACK(MISSION_ACK_DATA {
        target_system: 1,
        target_component: 1,
        mavtype: result,
        mission_type,
        ..Default::default()
    })
}

/// An item above home, somewhere near the aircraft.
pub fn item(seq: u16, command: MavCmd, params: [f32; 4]) -> MISSION_ITEM_INT_DATA {
    let [param1, param2, param3, param4] = params;
    MISSION_ITEM_INT_DATA {
        param1,
        param2,
        param3,
        param4,
        x: 350_000_000 + 1_000_000 * i32::from(seq),
        y: -1_179_000_000,
        z: 5_000.0 + 100.0 * f32::from(seq),
        seq,
        command,
        target_system: 1,
        target_component: 1,
        frame: MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
        current: u8::from(seq == 0),
        autocontinue: 1,
        mission_type: MavMissionType::MAV_MISSION_TYPE_MISSION,
    }
}

pub fn waypoint(seq: u16) -> MISSION_ITEM_INT_DATA {
    item(seq, MavCmd::MAV_CMD_NAV_WAYPOINT, [0.0, 0.0, 0.0, f32::NAN])
}

pub fn waypoints(count: u16) -> Vec<MISSION_ITEM_INT_DATA> {
    (0..count).map(waypoint).collect()
}

/// Items as bytes, so that NaN equals NaN; without a target.
pub fn bytes(items: &[MISSION_ITEM_INT_DATA]) -> Vec<Vec<u8>> {
    items
        .iter()
        .map(|item| {
            let item =
                MISSION_ITEM_INT_DATA { target_system: 0, target_component: 0, ..item.clone() };
            let mut bytes = [0; 64];
            let length =
                ::mavlink::MessageData::ser(&item, ::mavlink::MavlinkVersion::V2, &mut bytes);
            bytes[..length].to_vec()
        })
        .collect()
}
