//! What the ground-station side knows about the aircraft: events and snapshots, nothing else.

use icd::{Effector, Ned, PerEffector, Sensors};

use crate::event::{EventKind, Snapshot};
use crate::vehicle::Mode;

/// Snapshots in a row that must contradict the events before they are believed: one of them can be a
/// leftover from before the last event.
const CONTRADICTIONS: u32 = 2;

/// Where the flight is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// No plant so far.
    NoFlight,
    /// In the air.
    Flying,
    /// On the ground; the flight is over.
    OnGround,
    /// The plant has gone silent.
    Lost,
}

/// The point on the ground, altitude zero, under the place where the flight was first seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Home {
    /// Geodetic latitude, rad.
    pub latitude_rad: f64,
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// In the local axes of the flight, m.
    pub position: Ned,
}

impl Home {
    fn under(sensors: &Sensors) -> Self {
        let at = sensors.position.0;
        Self {
            latitude_rad: sensors.latitude_rad,
            longitude_rad: sensors.longitude_rad,
            position: Ned::new(at.x, at.y, at.z + sensors.altitude_m),
        }
    }
}

/// The aircraft as the ground stations may know it.
#[derive(Debug, Clone)]
pub struct Aircraft {
    in_flight: bool,
    connected: bool,
    on_ground: bool,
    mode: Mode,
    faulty: PerEffector<bool>,
    contradictions: u32,
    snapshot: Option<Snapshot>,
    home: Option<Home>,
}

impl Default for Aircraft {
    fn default() -> Self {
        Self {
            in_flight: false,
            connected: false,
            on_ground: false,
            mode: Mode::Reference,
            faulty: PerEffector::default(),
            contradictions: 0,
            snapshot: None,
            home: None,
        }
    }
}

impl Aircraft {
    /// Takes what happened.
    pub fn handle_event(&mut self, kind: &EventKind) {
        match *kind {
            EventKind::FlightBegan { .. } => {
                *self = Self { in_flight: true, connected: true, ..Self::default() };
            }
            EventKind::Mode(mode) => {
                self.mode = mode;
                self.contradictions = 0;
            }
            EventKind::FaultActs { effector, .. } => self.faulty[effector] = true,
            EventKind::FaultEnded { effector } => self.faulty[effector] = false,
            EventKind::GroundContact => self.on_ground = true,
            EventKind::PlantLost => self.connected = false,
            EventKind::PlantBack => self.connected = true,
            _ => {}
        }
    }

    /// Takes the state at one tick.
    pub fn handle_snapshot(&mut self, snapshot: &Snapshot) {
        if (snapshot.mode, snapshot.on_ground) == (self.mode, self.on_ground) {
            self.contradictions = 0;
        } else {
            self.contradictions += 1;
            if self.contradictions >= CONTRADICTIONS {
                self.mode = snapshot.mode;
                self.on_ground = snapshot.on_ground;
                self.contradictions = 0;
            }
        }
        if self.home.is_none() {
            self.home = Some(Home::under(&snapshot.sensors));
        }
        self.snapshot = Some(*snapshot);
    }

    /// Where the flight is.
    #[must_use]
    pub fn phase(&self) -> Phase {
        match (self.in_flight, self.connected, self.on_ground) {
            (false, _, _) => Phase::NoFlight,
            (true, false, _) => Phase::Lost,
            (true, true, false) => Phase::Flying,
            (true, true, true) => Phase::OnGround,
        }
    }

    /// A fault of this effector acts, and its end has not been told yet.
    #[must_use]
    pub fn is_faulty(&self, effector: Effector) -> bool {
        self.faulty[effector]
    }

    /// A roll reference would be flown just now.
    #[must_use]
    pub fn flies_offboard(&self) -> bool {
        self.phase() == Phase::Flying && self.mode == Mode::Offboard
    }

    /// Mode.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Latest state of this flight.
    #[must_use]
    pub fn snapshot(&self) -> Option<&Snapshot> {
        self.snapshot.as_ref()
    }

    /// Home of this flight, once there was a state.
    #[must_use]
    pub fn home(&self) -> Option<&Home> {
        self.home.as_ref()
    }
}
