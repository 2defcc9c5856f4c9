//! The aircraft as the ground-station side knows it, from events and snapshots only.

use core::f64::consts::TAU;

use icd::{Body, Ned};

use flight_management::event::{EventKind, Snapshot};
use flight_management::fault_list::FaultList;
use flight_management::parameters::Parameters;
use flight_management::vehicle::geodesy::{Horizon, Site};
use flight_management::vehicle::{Mode, Place, Rules, VehicleEvent, VehicleRefusal};

/// Snapshots in a row that must contradict the events before the mirror takes them: one of them can be a
/// leftover from before the last event.
const CONTRADICTIONS: u32 = 2;

/// A heading within this of that of the runway is on it, rad.
const ON_RUNWAY_RAD: f64 = 0.1;

/// QGroundControl offers this command as *Reboot Vehicle*.
pub const RESTART: &str = "reboot the vehicle";

/// State of the flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// No plant has connected yet.
    NoFlight,
    Flying,
    /// On the ground; the flight is over.
    OnGround,
    /// The plant has stopped sending.
    Lost,
}

/// A point on the ground. At first it is below the aircraft's first known position, until a command moves it.
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
    fn at(place: Place, snapshot: &Snapshot) -> Self {
        let motion = snapshot.motion();
        let offset = Horizon::at(Place::of(motion)).offset(&Site::at(place));
        let at = motion.position.0;
        let height_m = motion.altitude_m - snapshot.navigation.ground_m;
        Self {
            latitude_rad: place.latitude_rad,
            longitude_rad: place.longitude_rad,
            position: Ned::new(at.x + offset.x, at.y + offset.y, at.z + height_m),
        }
    }

    fn is_at(&self, place: Place) -> bool {
        place == Place { latitude_rad: self.latitude_rad, longitude_rad: self.longitude_rad }
    }
}

/// The aircraft as the ground-station side knows it.
#[derive(Debug, Clone)]
pub struct Aircraft {
    in_flight: bool,
    connected: bool,
    on_ground: bool,
    terminated: bool,
    mode: Mode,
    faults: FaultList,
    contradictions: u32,
    snapshot: Option<Snapshot>,
    home: Option<Home>,
    /// An event has moved home, and no later snapshot has arrived.
    home_reported: bool,
}

impl Default for Aircraft {
    fn default() -> Self {
        Self {
            in_flight: false,
            connected: false,
            on_ground: false,
            terminated: false,
            mode: Mode::Position,
            faults: FaultList::default(),
            contradictions: 0,
            snapshot: None,
            home: None,
            home_reported: false,
        }
    }
}

/// After ground contact the plant stands still at the state of that moment: there is no motion to show any more.
fn come_to_rest(snapshot: &mut Snapshot) {
    let Snapshot { sensors, log, .. } = snapshot;
    (log.state.velocity, sensors.gnss.value.velocity) = (Ned::zero(), Ned::zero());
    (log.state.rates, sensors.gyro.value) = (Body::zero().0, Body::zero());
    (log.state.airspeed_m_s, sensors.pitot.value.impact_pa) = (0.0, 0.0);
}

impl Aircraft {
    /// Applies an event; false if it changes nothing.
    pub fn handle_event(&mut self, kind: &EventKind) -> bool {
        let is_news = self.faults.handle_event(kind);
        match *kind {
            EventKind::FlightBegan { .. } => {
                *self = Self { in_flight: true, connected: true, ..Self::default() };
            }
            EventKind::Vehicle(VehicleEvent::Mode(mode)) => {
                self.mode = mode;
                self.contradictions = 0;
            }
            EventKind::GroundContact => {
                self.on_ground = true;
                self.snapshot.iter_mut().for_each(come_to_rest);
            }
            EventKind::Vehicle(VehicleEvent::Home(place)) => {
                // Before the first snapshot there are no local axes; that snapshot also sets home.
                if let Some(snapshot) = &self.snapshot {
                    self.home = Some(Home::at(place, snapshot));
                    self.home_reported = true;
                }
            }
            EventKind::Vehicle(VehicleEvent::Terminated) => self.terminated = true,
            EventKind::Vehicle(VehicleEvent::Armed(armed)) => {
                self.snapshot.iter_mut().for_each(|snapshot| snapshot.is_armed = armed);
            }
            EventKind::PlantLost => self.connected = false,
            EventKind::PlantBack => self.connected = true,
            _ => {}
        }
        is_news
    }

    /// Applies the state at one tick.
    pub fn handle_snapshot(&mut self, snapshot: &Snapshot) {
        let shown = (snapshot.mode, snapshot.on_ground, snapshot.terminated);
        if shown == (self.mode, self.on_ground, self.terminated) {
            self.contradictions = 0;
        } else {
            self.contradictions += 1;
            if self.contradictions >= CONTRADICTIONS {
                (self.mode, self.on_ground, self.terminated) = shown;
                self.contradictions = 0;
            }
        }
        let is_seen = self.home.is_none() && snapshot.motion().valid.position;
        let first_seen = is_seen.then(|| Place::of(snapshot.motion()));
        if let Some(place) = snapshot.navigation.home.or(first_seen)
            && !self.home.is_some_and(|home| home.is_at(place))
            && !self.home_reported
        {
            self.home = Some(Home::at(place, snapshot));
        }
        // A snapshot that contradicts the event may predate it; the mirror takes the next one.
        self.home_reported = false;
        let mut snapshot = *snapshot;
        if self.on_ground {
            come_to_rest(&mut snapshot);
        }
        self.snapshot = Some(snapshot);
    }

    /// State of the flight.
    pub fn phase(&self) -> Phase {
        match (self.in_flight, self.connected, self.on_ground) {
            (false, _, _) => Phase::NoFlight,
            (true, false, _) => Phase::Lost,
            (true, true, false) => Phase::Flying,
            (true, true, true) => Phase::OnGround,
        }
    }

    /// The flight was terminated: engine off, surfaces at their stops.
    pub fn is_terminated(&self) -> bool {
        self.terminated
    }

    /// The engine may run, as far as is known: the aircraft will fly when the plant calls, too, since QGroundControl takes a moment
    /// without the flag for the end of the mission.
    pub fn is_armed(&self) -> bool {
        let known = self.snapshot.as_ref().is_none_or(|snapshot| snapshot.is_armed);
        known && self.phase() != Phase::OnGround && !self.terminated
    }

    /// Obstacle to arming and flying; with the heading of the runway, rad, where it is known.
    pub fn not_ready(&self, runway_rad: Option<f64>) -> Option<String> {
        match self.phase() {
            Phase::Flying if self.terminated => Some(format!("flight terminated, {RESTART}")),
            Phase::Flying if self.is_on_wheels() => self.not_ready_to_take_off(runway_rad),
            Phase::Flying => None,
            Phase::OnGround => Some(VehicleRefusal::FlightOver.to_string()),
            Phase::NoFlight => Some("no aircraft is connected".into()),
            Phase::Lost => Some("the plant link is lost".into()),
        }
    }

    /// What the navigation lacks for a takeoff: in the air the flight goes on without it.
    fn not_ready_to_take_off(&self, runway_rad: Option<f64>) -> Option<String> {
        let snapshot = self.snapshot.as_ref()?;
        let motion = snapshot.motion();
        let alive = motion.alive(&snapshot.sensors);
        let dead = snapshot.sensors.present().find(|sensor| !alive[*sensor as usize]);
        let valid = &motion.valid;
        match dead {
            Some(sensor) => Some(format!("{} gives no valid sample", sensor.name())),
            None if !valid.attitude => {
                Some("attitude is not known; GND_RWY_HDG sets the heading".into())
            }
            None if !(valid.position && valid.altitude) => Some("position is not known yet".into()),
            None => runway_rad.and_then(|runway_rad| {
                let psi = motion.attitude.psi;
                let deg = |rad: f64| rad.to_degrees().rem_euclid(360.0).round();
                let is_on_it = libm::remainder(psi - runway_rad, TAU).abs() <= ON_RUNWAY_RAD;
                let text =
                    || format!("heading is {} deg, GND_RWY_HDG {}", deg(psi), deg(runway_rad));
                (!is_on_it).then(text)
            }),
        }
    }

    /// The wheels carry the aircraft.
    pub fn is_on_wheels(&self) -> bool {
        self.snapshot.as_ref().is_some_and(|snapshot| snapshot.motion().on_wheels)
    }

    /// Altitude of the ground, m.
    pub fn ground_m(&self) -> f64 {
        self.snapshot.as_ref().map_or(0.0, |snapshot| snapshot.navigation.ground_m)
    }

    /// The faults as the plant has reported them.
    pub fn faults(&self) -> &FaultList {
        &self.faults
    }

    /// The aircraft would follow a roll reference now.
    pub fn flies_offboard(&self) -> bool {
        self.phase() == Phase::Flying && self.mode == Mode::Offboard
    }

    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Latest state of this flight.
    pub fn snapshot(&self) -> Option<&Snapshot> {
        self.snapshot.as_ref()
    }

    /// Altitude at which the airspeeds of ground stations count, m: that of the reference.
    pub fn altitude_reference_m(&self) -> f64 {
        self.snapshot.as_ref().map_or(0.0, |state| state.demand.altitude_m)
    }

    /// Says that a circle is too small for an airspeed, by default the present reference. Wind widens it further.
    pub fn widened(
        &self,
        radius_m: f64,
        airspeed_m_s: Option<f64>,
        parameters: &Parameters,
    ) -> Option<String> {
        let Parameters { limits, navigation, gains, .. } = parameters;
        let now_m_s = self.snapshot.as_ref().map(|state| state.demand.airspeed_m_s);
        let least_m =
            Rules::new(*limits, *navigation, gains).smallest_circle_m(airspeed_m_s.or(now_m_s)?);
        (radius_m < least_m).then(|| format!("Radius {radius_m:.0} m is flown as {least_m:.0} m"))
    }

    /// Home of this flight, once a state is known.
    pub fn home(&self) -> Option<&Home> {
        self.home.as_ref()
    }
}
