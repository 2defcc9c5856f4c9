//! Both ends of a conversation, without sockets and without a clock.

use core::time::Duration;
use std::net::SocketAddr;

use ::mavlink::dialects::common::{MavMessage, MavResult, PARAM_VALUE_DATA, STATUSTEXT_DATA};
use ::mavlink::{MAVLinkV2MessageRaw, MavHeader, MavlinkVersion, MessageData};
use flight_control::Gains;
use icd::fault::{
    FaultEntry, FaultReply, FaultRequest, FaultState, Onset, PlantAction, PlantReport,
    PlantRequest, Timing,
};
use icd::{ControlPeriod, Sensors, SimTime};

use crate::Ground;
use crate::codec::{self, Identity, Skipped};
use crate::peers::Address;
use crate::wall_time::WallTime;
use aircraft::DEFAULT_MODEL;
use flight_management::autopilot::{Autopilot, Settings};
use flight_management::command::{Command, Intent};
use flight_management::configuration;
use flight_management::parameters::Parameters;
use flight_management::vehicle::schedule::ReferenceSchedule;

/// Reaction of the test's plant to a fault request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PlantManner {
    /// Executes the request.
    Willing,
    /// Answers with this.
    Answers(FaultReply),
    /// Does not answer.
    Silent,
}

/// A frame that the ground station received.
#[derive(Debug, Clone, PartialEq)]
pub struct Got {
    pub to: Address,
    pub id: u32,
    pub payload: Vec<u8>,
    pub sequence: u8,
    pub at: WallTime,
    /// The whole frame.
    pub bytes: Vec<u8>,
}

impl Got {
    pub fn read<D: MessageData>(&self) -> Option<D> {
        (self.id == D::ID).then(|| D::deser(MavlinkVersion::V2, &self.payload).unwrap())
    }
}

/// One COMMAND_ACK.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ack {
    pub command: u16,
    pub result: u8,
    pub to: Identity,
}

pub const STATION: Identity = Identity { system: 255, component: 190 };

pub fn ack(command: u16, result: MavResult) -> Ack {
    Ack { command, result: result as u8, to: STATION }
}

pub struct World {
    pub ground: Ground,
    pub autopilot: Autopilot,
    pub plant: PlantManner,
    pub now: WallTime,
    pub sim: SimTime,
    /// Every message sent to any peer.
    pub got: Vec<Got>,
    /// Every intent that reached the control side.
    pub intents: Vec<Intent>,
    pub sensors: Sensors,
    /// Peers that cannot receive for now.
    pub stuck: Vec<Address>,
    /// The plant's answer to a request for its faults.
    pub listed: Vec<PlantReport>,
    sequence: u8,
}

/// Time of one step of the world; simulation and wall time run together.
pub const STEP: Duration = Duration::from_millis(2);

/// An address on this machine, by the socket that calls ground stations.
pub fn address(port: u16) -> Address {
    Address::UdpClient(SocketAddr::from(([127, 0, 0, 1], port)))
}

pub fn level_flight() -> Sensors {
    let mut values = [0.0; Sensors::COUNT];
    values[6] = 1.0;
    values[10] = 264.0;
    let mut level = Sensors::at(SimTime::ZERO, &values);
    level.gnss.value.latitude_rad = 34.9_f64.to_radians();
    level.gnss.value.longitude_rad = -117.9_f64.to_radians();
    level.barometer.value.altitude_m = 5_000.0;
    level.barometer.value.pressure_pa = 54_020.0;
    level.gnss.value.altitude_m = 5_000.0;
    level.pitot.value.airspeed_m_s = 264.0;
    level.pitot.value.impact_pa = 30_350.0;
    level.engine_n.value = 27_000.0;
    level.fuel_gauge_pct.value = 100.0;
    // At zero it would fly in the short gusts just above the ground.
    level.radar_altimeter_m.value = 5_000.0;
    level
}

impl World {
    /// No aircraft yet.
    pub fn waiting() -> Self {
        Self::waiting_with(&Parameters::default())
    }

    /// The same, with these parameters at the start of the program.
    pub fn waiting_with(parameters: &Parameters) -> Self {
        let model = configuration::aircraft_model("model", DEFAULT_MODEL).unwrap();
        let endpoints = [address(14_550), address(14_540)];
        Self {
            ground: Ground::new(parameters, &model, &endpoints),
            autopilot: Autopilot::new(&Settings {
                model,
                gains: Gains::REFERENCE,
                limits: parameters.limits,
                navigation: parameters.navigation,
                references: ReferenceSchedule::default(),
                script: None,
                own_law: None,
                fault_injection: true,
            }),
            plant: PlantManner::Willing,
            now: WallTime::ZERO,
            sim: SimTime::ZERO,
            got: Vec::new(),
            intents: Vec::new(),
            sensors: level_flight(),
            stuck: Vec::new(),
            listed: Vec::new(),
            sequence: 0,
        }
    }

    /// In level flight for a while, earlier messages forgotten.
    pub fn flying() -> Self {
        Self::flying_with(&Parameters::default())
    }

    /// The same, with these parameters at the start of the program.
    pub fn flying_with(parameters: &Parameters) -> Self {
        let mut world = Self::waiting_with(parameters);
        world.autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
        world.run_ms(200);
        world.got.clear();
        world
    }

    /// Everything but the plant's clock: due messages, requests, events.
    pub fn settle(&mut self) {
        self.ground.poll(self.now);
        while let Some(intent) = self.ground.pop_intent() {
            self.intents.push(intent.clone());
            self.autopilot.handle_intent(intent);
        }
        while let Some(request) = self.autopilot.next_request() {
            for report in self.reports(&request) {
                self.autopilot.handle_report(&report);
            }
        }
        while let Some(event) = self.autopilot.pop_event() {
            self.ground.handle_event(&event, self.now);
        }
        self.collect();
    }

    /// One control period.
    pub fn step(&mut self) {
        self.now = self.now + STEP;
        self.settle();
        self.sim = self.sim + ControlPeriod::DEFAULT;
        self.autopilot.step(self.sim, &self.sensors);
        if self.ground.needs_snapshot()
            && let Some(snapshot) = self.autopilot.snapshot().copied()
        {
            self.ground.handle_snapshot(&snapshot, self.now);
        }
        self.settle();
    }

    pub fn run_ms(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds / 2 {
            self.step();
        }
    }

    fn reports(&mut self, request: &PlantRequest) -> Vec<PlantReport> {
        let at = self.sim;
        let fault = match request.action {
            PlantAction::Fault(fault) => fault,
            PlantAction::Restart => {
                self.autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
                self.sim = SimTime::ZERO;
                return Vec::new();
            }
            PlantAction::ListFaults => return self.listed.clone(),
            PlantAction::Pace(_) if self.plant == PlantManner::Silent => return Vec::new(),
            PlantAction::Pace(pace) => {
                return vec![PlantReport::Paced { request: Some(request.number), pace, at }];
            }
        };
        let target = fault.target().unwrap_or(icd::tvc_jet::ENGINE.into());
        let entry = |kind, state| {
            let timing = Timing::at(at);
            // One fault for each target.
            let id = 1 + u32::from(u8::from(target));
            PlantReport::Fault(FaultEntry { id, target, kind, timing, state })
        };
        let reply = |reply| PlantReport::FaultReply { request: request.number, reply };
        match (self.plant, fault) {
            (PlantManner::Silent, _) => Vec::new(),
            (PlantManner::Answers(has_text), _) => vec![reply(has_text)],
            (PlantManner::Willing, FaultRequest::Clear { .. } | FaultRequest::ClearAll) => {
                let ended = entry(icd::FaultKind::StuckHere, FaultState::Ended { at });
                vec![reply(FaultReply::Cleared { at }), ended]
            }
            (PlantManner::Willing, FaultRequest::Inject { kind, timing, .. }) => {
                match timing.onset {
                    Onset::AtOnce => vec![
                        reply(FaultReply::Applied { at }),
                        entry(kind, FaultState::Active { since: at }),
                    ],
                    Onset::At(at) => vec![
                        reply(FaultReply::Scheduled { at }),
                        entry(kind, FaultState::Scheduled { at }),
                    ],
                }
            }
        }
    }

    fn collect(&mut self) {
        let stuck = &self.stuck;
        while let Some((to, datagram)) = self.ground.pop_frame(|address| !stuck.contains(&address))
        {
            let (mut rest, mut skipped) = (&datagram[..], Skipped::default());
            let frame = codec::next_frame(&mut rest, &mut skipped).expect("a good frame");
            assert!(rest.is_empty() && skipped == Skipped::default(), "{datagram:?}");
            let payload = frame.payload.to_vec();
            let (id, sequence) = (frame.id, datagram[4]);
            let at = self.now;
            self.got.push(Got { to, id, payload, sequence, at, bytes: datagram });
        }
    }

    pub fn send_bytes(&mut self, from: Address, bytes: &[u8]) {
        match from {
            Address::Tcp(connection) => self.ground.handle_stream(connection, bytes, self.now),
            _ => self.ground.handle_datagram(from, bytes, self.now),
        }
        self.settle();
    }

    /// Sends a message from the station at 14550.
    pub fn send(&mut self, message: &MavMessage) {
        let bytes = self.encode(STATION, message);
        self.send_bytes(address(14_550), &bytes);
    }

    pub fn encode(&mut self, sender: Identity, message: &MavMessage) -> Vec<u8> {
        let Identity { system, component } = sender;
        let header = MavHeader {
            system_id: system.into(),
            component_id: component,
            sequence: self.sequence,
        };
        self.sequence = self.sequence.wrapping_add(1);
        let mut raw = MAVLinkV2MessageRaw::new();
        raw.serialize_message(header, message);
        raw.raw_bytes().to_vec()
    }

    /// COMMAND_LONG with any command number.
    pub fn send_command(&mut self, command: u16, params: [f32; 7]) {
        let bytes = command_long(command, params, Identity { system: 1, component: 1 });
        self.send_bytes(address(14_550), &bytes);
    }

    pub fn send_command_int(&mut self, command: u16, frame: u8, params: [f32; 4], z: f32) {
        self.send_command_at(command, frame, params, [0, 0], z);
    }

    /// COMMAND_INT with a place.
    pub fn send_command_at(
        &mut self,
        command: u16,
        frame: u8,
        params: [f32; 4],
        xy: [i32; 2],
        z: f32,
    ) {
        let bytes = command_int(command, frame, params, xy, z);
        self.send_bytes(address(14_550), &bytes);
    }

    /// Final acknowledgements to 14550 since the last call that took any.
    pub fn take_acks(&mut self) -> Vec<Ack> {
        let mut acks = self.take_all_acks();
        acks.retain(|ack| ack.result != MavResult::MAV_RESULT_IN_PROGRESS as u8);
        acks
    }

    /// The same with those of "in progress".
    pub fn take_all_acks(&mut self) -> Vec<Ack> {
        let acks = self.got.iter().filter(|got| got.id == 77 && got.to == address(14_550));
        let acks = acks
            .map(|got| {
                let mut p = [0; 10];
                p[..got.payload.len()].copy_from_slice(&got.payload);
                let to = Identity { system: p[8], component: p[9] };
                Ack { command: u16::from_le_bytes([p[0], p[1]]), result: p[2], to }
            })
            .collect();
        self.got.retain(|got| got.id != 77);
        acks
    }

    /// Texts to 14550 so far, long ones put together.
    pub fn texts(&self) -> Vec<String> {
        let mut texts: Vec<(u16, String)> = Vec::new();
        for text in self.got.iter().filter(|got| got.to == address(14_550)).filter_map(Got::read) {
            let STATUSTEXT_DATA { text, id, .. } = text;
            let part = text.to_str().unwrap();
            match texts.last_mut() {
                Some((last, whole)) if id != 0 && *last == id => whole.push_str(part),
                _ => texts.push((id, part.to_owned())),
            }
        }
        // The chunks of a long text are filled with blanks.
        let words = |text: String| text.split_whitespace().collect::<Vec<_>>().join(" ");
        texts.into_iter().map(|(_, text)| words(text)).collect()
    }

    pub fn has_text(&self, words: &str) -> bool {
        self.texts().iter().any(|text| text.contains(words))
    }

    /// PARAM_VALUE to `to` so far.
    pub fn values(&self, to: Address) -> Vec<PARAM_VALUE_DATA> {
        self.got.iter().filter(|got| got.to == to).filter_map(Got::read).collect()
    }

    /// The commands that reached the control side since the last call.
    pub fn take_commands(&mut self) -> Vec<Command> {
        self.intents.drain(..).map(|intent| intent.command).collect()
    }
}

/// A COMMAND_LONG frame assembled byte by byte, since the crate can only write the commands that it knows.
pub fn command_long(command: u16, params: [f32; 7], target: Identity) -> Vec<u8> {
    let mut payload: Vec<u8> = params.iter().flat_map(|value| value.to_le_bytes()).collect();
    payload.extend_from_slice(&command.to_le_bytes());
    payload.extend_from_slice(&[target.system, target.component, 0]);
    frame(76, 152, &payload)
}

/// A COMMAND_INT frame assembled byte by byte.
pub fn command_int(
    command: u16,
    frame_type: u8,
    params: [f32; 4],
    [x, y]: [i32; 2],
    z: f32,
) -> Vec<u8> {
    let mut payload: Vec<u8> = params.iter().flat_map(|value| value.to_le_bytes()).collect();
    payload.extend_from_slice(&x.to_le_bytes());
    payload.extend_from_slice(&y.to_le_bytes());
    payload.extend_from_slice(&z.to_le_bytes());
    payload.extend_from_slice(&command.to_le_bytes());
    payload.extend_from_slice(&[1, 1, frame_type, 0, 0]);
    frame(75, 158, &payload)
}

/// A MAVLink 2 frame of the ground station, trailing zeros cut off as the protocol requires.
pub fn frame(id: u8, extra_crc: u8, payload: &[u8]) -> Vec<u8> {
    let end = payload.iter().rposition(|byte| *byte != 0).map_or(1, |last| last + 1);
    let length = u8::try_from(end).unwrap();
    let mut frame = vec![0xFD, length, 0, 0, 0, STATION.system, STATION.component, id, 0, 0];
    frame.extend_from_slice(&payload[..end]);
    let crc = ::mavlink::calculate_crc(&frame[1..], extra_crc);
    frame.extend_from_slice(&crc.to_le_bytes());
    frame
}

/// The same frame of the ground station as sent by another system.
pub fn sent_by(sender: Identity, mut bytes: Vec<u8>, extra_crc: u8) -> Vec<u8> {
    bytes[5] = sender.system;
    bytes[6] = sender.component;
    let end = bytes.len() - 2;
    let crc = ::mavlink::calculate_crc(&bytes[1..end], extra_crc);
    bytes[end..].copy_from_slice(&crc.to_le_bytes());
    bytes
}
