//! The ground-station side and the control side of an aircraft in flight, without sockets.

use std::net::SocketAddr;
use std::time::Duration;

use aircraft::DEFAULT_MODEL;
use autopilot::autopilot::{Autopilot, Settings};
use autopilot::clock::WallTime;
use autopilot::config;
use autopilot::mavlink::Ground;
use autopilot::mavlink::peers::{Address, Connection};
use autopilot::parameters::Parameters;
use autopilot::vehicle::schedule::ReferenceSchedule;
use flight_control::Gains;
use icd::{ControlPeriod, Sensors, SimTime};
use mavlink::dialects::common::MavMessage;
use mavlink::{Message, calculate_crc};

/// Time of one step.
const STEP: Duration = Duration::from_millis(2);
/// Frames sent to all peers in one step, at most: all queues of all peers.
const FRAMES_MAX: usize = 100_000;
/// The connection by TCP.
pub const TCP: Connection = Connection(0);

pub struct World {
    pub ground: Ground,
    autopilot: Autopilot,
    now: WallTime,
    sim: SimTime,
    sensors: Sensors,
}

pub fn station(port: u16) -> Address {
    Address::UdpServer(SocketAddr::from(([127, 0, 0, 1], port)))
}

impl World {
    pub fn flying() -> Self {
        let parameters = Parameters::default();
        let model = config::aircraft_model("model", DEFAULT_MODEL).unwrap();
        let mut autopilot = Autopilot::new(&Settings {
            model,
            gains: Gains::REFERENCE,
            limits: parameters.limits,
            navigation: parameters.navigation,
            references: ReferenceSchedule::default(),
            script: None,
            own_law: None,
            fault_injection: true,
        });
        autopilot.begin_flight(ControlPeriod::DEFAULT, SimTime::ZERO, false);
        let mut values = [0.0; Sensors::COUNT];
        values[6] = 1.0;
        values[10] = 264.0;
        (values[21], values[23], values[26]) = (5_000.0, 264.0, 27_000.0);
        let sensors = Sensors::at(SimTime::ZERO, &values);
        let mut ground = Ground::new(&parameters, &model, &[station(14_550)]);
        assert!(ground.open(TCP, true, WallTime::ZERO));
        let (now, sim) = (WallTime::ZERO, SimTime::ZERO);
        let mut world = Self { ground, autopilot, now, sim, sensors };
        world.step();
        world
    }

    pub fn datagram(&mut self, from: Address, bytes: &[u8]) {
        self.ground.handle_datagram(from, bytes, self.now);
    }

    pub fn stream(&mut self, bytes: &[u8]) {
        if self.ground.accepts_input(TCP) {
            self.ground.handle_stream(TCP, bytes, self.now);
        }
    }

    /// One control period.
    pub fn step(&mut self) {
        self.now = self.now + STEP;
        self.sim = self.sim + ControlPeriod::DEFAULT;
        self.ground.poll(self.now);
        while let Some(intent) = self.ground.pop_intent() {
            self.autopilot.handle_intent(intent);
        }
        self.autopilot.step(self.sim, &self.sensors);
        // There is no plant, so there are no answers.
        while self.autopilot.next_request().is_some() {}
        while let Some(event) = self.autopilot.pop_event() {
            self.ground.handle_event(&event, self.now);
        }
        if let Some(snapshot) = self.autopilot.snapshot().copied() {
            self.ground.handle_snapshot(&snapshot, self.now);
        }
        let mut frames = 0;
        while self.ground.pop_frame(|_| true).is_some() {
            frames += 1;
            assert!(frames < FRAMES_MAX, "frames without end");
        }
    }
}

/// A frame of MAVLink 2 with a good checksum, if its message is known.
pub fn frame(id: u32, payload: &[u8]) -> Vec<u8> {
    let [low, middle, high, _] = id.to_le_bytes();
    let payload = &payload[..payload.len().min(255)];
    let length = u8::try_from(payload.len()).unwrap();
    let mut frame = vec![0xFD, length, 0, 0, 0, 255, 190, low, middle, high];
    frame.extend_from_slice(payload);
    let checksum = calculate_crc(&frame[1..], MavMessage::extra_crc(id));
    frame.extend_from_slice(&checksum.to_le_bytes());
    frame
}
