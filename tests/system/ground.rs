//! A ground station of a few lines: enough MAVLink to fly and to inject faults.

use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use mavlink::dialects::common::{
    COMMAND_LONG_DATA, MISSION_COUNT_DATA, MISSION_ITEM_INT_DATA, MISSION_REQUEST_LIST_DATA,
    MavCmd, MavFrame, MavMessage, MavMissionResult, MavResult,
};
use mavlink::{MAVLinkV2MessageRaw, MavHeader, MavlinkVersion, Message};

use super::programs::TIMEOUT;

/// The ground station and what it has received.
pub struct Ground {
    socket: UdpSocket,
    vehicle: Option<SocketAddr>,
    sequence: u8,
    /// Texts of the vehicle, in order.
    pub texts: Vec<String>,
    /// Every acknowledgement: command and result.
    pub acknowledgements: Vec<(MavCmd, MavResult)>,
    /// Latest simulation time, s.
    pub time_s: f64,
    /// Latest altitude, m.
    pub altitude_m: f64,
    /// Latest roll angle, deg.
    pub roll_deg: f64,
    /// Largest roll angle either way, deg.
    pub roll_max_deg: f64,
    /// Heartbeats received.
    pub heartbeats: u32,
    /// Latest place: latitude and longitude, 1e-7 deg.
    pub place_e7: [i32; 2],
    /// Item of a plan that the vehicle requests next.
    requested_item: Option<u16>,
    /// The result of an upload.
    plan_answer: Option<MavMissionResult>,
    plan_count: Option<u16>,
}

impl Ground {
    /// Listens on a free port of loopback.
    pub fn new() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").expect("loopback has free ports");
        socket.set_read_timeout(Some(Duration::from_millis(50))).expect("a timeout above zero");
        Self {
            socket,
            vehicle: None,
            sequence: 0,
            texts: Vec::new(),
            acknowledgements: Vec::new(),
            time_s: 0.0,
            altitude_m: f64::NAN,
            roll_deg: 0.0,
            roll_max_deg: 0.0,
            heartbeats: 0,
            place_e7: [0; 2],
            requested_item: None,
            plan_answer: None,
            plan_count: None,
        }
    }

    /// Address for the vehicle's messages.
    pub fn address(&self) -> SocketAddr {
        self.socket.local_addr().expect("a bound socket")
    }

    /// Receives until `done`, at most [`TIMEOUT`].
    pub fn listen_until(&mut self, what: &str, mut done: impl FnMut(&Self) -> bool) {
        let until = Instant::now() + TIMEOUT;
        let mut datagram = [0; 2048];
        while !done(self) {
            assert!(Instant::now() < until, "waited for {what}; texts so far: {:?}", self.texts);
            if let Ok((length, from)) = self.socket.recv_from(&mut datagram) {
                self.vehicle = Some(from);
                self.take(&datagram[..length]);
            }
        }
    }

    /// Receives for this wall time.
    pub fn listen_for(&mut self, wall: Duration) {
        let until = Instant::now() + wall;
        self.listen_until("the end of a time", |_| Instant::now() >= until);
    }

    /// Sends a command.
    pub fn send_command(&mut self, command: MavCmd, params: [f32; 7]) {
        let [param1, param2, param3, param4, param5, param6, param7] = params;
        let data = COMMAND_LONG_DATA {
            param1,
            param2,
            param3,
            param4,
            param5,
            param6,
            param7,
            command,
            target_system: 1,
            target_component: 1,
            confirmation: 0,
        };
        self.send(&MavMessage::COMMAND_LONG(data));
    }

    /// Sends a command and waits for its acknowledgement.
    pub fn command(&mut self, command: MavCmd, params: [f32; 7]) -> MavResult {
        self.listen_until("the vehicle", |ground| ground.vehicle.is_some());
        let before = self.acknowledgements.len();
        self.send_command(command, params);
        let mut result = None;
        self.listen_until("an acknowledgement", |ground| {
            let mut new = ground.acknowledgements[before..].iter();
            result = new.find(|(of, _)| *of == command).map(|(_, result)| *result);
            result.is_some()
        });
        result.expect("waited for it")
    }

    /// Sends a message.
    pub fn send(&mut self, message: &MavMessage) {
        let header = MavHeader { system_id: 255, component_id: 190, sequence: self.sequence };
        self.sequence = self.sequence.wrapping_add(1);
        let mut frame = MAVLinkV2MessageRaw::new();
        frame.serialize_message(header, message);
        let vehicle = self.vehicle.expect("received from the vehicle");
        self.socket.send_to(frame.raw_bytes(), vehicle).expect("loopback takes datagrams");
    }

    /// Uploads a plan of waypoints (latitude, longitude, 1e-7 deg, altitude above the sea, m), and waits until it is accepted.
    pub fn upload(&mut self, waypoints: &[(i32, i32, f32)]) -> MavMissionResult {
        let command = MavCmd::MAV_CMD_NAV_WAYPOINT;
        let item = |&(x, y, z)| MISSION_ITEM_INT_DATA { x, y, z, command, ..Default::default() };
        self.upload_items(&waypoints.iter().map(item).collect::<Vec<_>>())
    }

    /// The same with items of any command; number, frame and target are filled in.
    pub fn upload_items(&mut self, items: &[MISSION_ITEM_INT_DATA]) -> MavMissionResult {
        (self.requested_item, self.plan_answer) = (None, None);
        let count = u16::try_from(items.len()).expect("a short plan");
        let to = (1, 1);
        self.send(&MavMessage::MISSION_COUNT(MISSION_COUNT_DATA {
            count,
            target_system: to.0,
            target_component: to.1,
            ..Default::default()
        }));
        loop {
            self.listen_until("a request for an item, or the end", |ground| {
                ground.requested_item.is_some() || ground.plan_answer.is_some()
            });
            if let Some(answer) = self.plan_answer {
                return answer;
            }
            let seq = self.requested_item.take().expect("waited for it");
            self.send(&MavMessage::MISSION_ITEM_INT(MISSION_ITEM_INT_DATA {
                seq,
                frame: MavFrame::MAV_FRAME_GLOBAL,
                autocontinue: 1,
                target_system: to.0,
                target_component: to.1,
                ..items[usize::from(seq)].clone()
            }));
        }
    }

    /// Items of the plan that the vehicle offers.
    pub fn plan_items(&mut self) -> u16 {
        self.plan_count = None;
        let (target_system, target_component) = (1, 1);
        let list =
            MISSION_REQUEST_LIST_DATA { target_system, target_component, ..Default::default() };
        self.send(&MavMessage::MISSION_REQUEST_LIST(list));
        self.listen_until("the length of the plan", |ground| ground.plan_count.is_some());
        self.plan_count.expect("waited for it")
    }

    /// The vehicle sends one frame a datagram.
    fn take(&mut self, frame: &[u8]) {
        assert_eq!(frame[0], 0xFD, "MAVLink 2");
        let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
        let payload = &frame[10..10 + usize::from(frame[1])];
        match MavMessage::parse(MavlinkVersion::V2, id, payload) {
            Ok(MavMessage::HEARTBEAT(_)) => self.heartbeats += 1,
            Ok(MavMessage::ATTITUDE(attitude)) => {
                self.time_s = f64::from(attitude.time_boot_ms) / 1.0e3;
                self.roll_deg = f64::from(attitude.roll).to_degrees();
                self.roll_max_deg = self.roll_max_deg.max(self.roll_deg.abs());
            }
            Ok(MavMessage::GLOBAL_POSITION_INT(position)) => {
                self.altitude_m = f64::from(position.alt) / 1.0e3;
                self.place_e7 = [position.lat, position.lon];
            }
            Ok(MavMessage::STATUSTEXT(text)) => {
                let piece = text.text.to_str().unwrap_or_default();
                match self.texts.last_mut().filter(|_| text.chunk_seq > 0) {
                    Some(begun) => begun.push_str(piece),
                    None => self.texts.push(piece.to_owned()),
                }
            }
            Ok(MavMessage::COMMAND_ACK(ack)) => {
                self.acknowledgements.push((ack.command, ack.result))
            }
            Ok(MavMessage::MISSION_REQUEST_INT(request)) => self.requested_item = Some(request.seq),
            Ok(MavMessage::MISSION_COUNT(answer)) => self.plan_count = Some(answer.count),
            Ok(MavMessage::MISSION_ACK(answer)) => self.plan_answer = Some(answer.mavtype),
            Ok(_) => {}
            Err(error) => panic!("message {id} cannot be read: {error}"),
        }
    }

    /// Whether a text was received that contains `part`.
    pub fn has_text(&self, part: &str) -> bool {
        self.texts.iter().any(|text| text.contains(part))
    }
}
