//! A point mass that flies what the vehicle demands: enough of an aircraft for modes and plans.

use std::sync::Arc;

use flight_control::NavigationState;
use flight_control::guidance::Horizontal;
use flight_control::navigation::Validity;
use icd::units::STANDARD_GRAVITY_M_S2;
use icd::{Attitude, EulerAngles, Ned, SimTime};

use super::rules;
use crate::vehicle::VehicleEvent;
use crate::vehicle::failsafe::Powerplant;
use crate::vehicle::geodesy::{Horizon, Site};
use crate::vehicle::plan::{Action, Circle, Item, Plan, Point};
use crate::vehicle::schedule::ReferenceSchedule;
use crate::vehicle::{Mode, Place, Rules, Vehicle, VehicleRefusal};

const TICK_US: u64 = 50_000;
/// Lag of the climb behind its command, s.
const CLIMB_LAG_S: f64 = 0.5;
/// Fastest climb and change of speed.
const CLIMB_M_S: f64 = 40.0;
const ACCELERATION_M_S2: f64 = 3.0;

pub struct Plane {
    pub vehicle: Vehicle,
    pub rules: Rules,
    pub place: Place,
    pub heading: f64,
    pub roll: f64,
    /// What its roll is beside the demanded one.
    pub roll_error_rad: f64,
    pub altitude_m: f64,
    pub airspeed_m_s: f64,
    pub climb_m_s: f64,
    pub now: SimTime,
    pub events: Vec<VehicleEvent>,
    pub valid: Validity,
    pub on_wheels: bool,
    /// Measured thrust, N.
    pub thrust_n: f64,
    pub propulsion: Powerplant,
}

pub fn start() -> Place {
    Place { latitude_rad: 0.6, longitude_rad: -2.0 }
}

/// A place this many km north and east of the start.
pub fn at(north_km: f64, east_km: f64) -> Place {
    Horizon::at(start()).place_at(&(Horizontal::new(north_km, east_km) * 1.0e3))
}

pub fn point(north_km: f64, east_km: f64, altitude_m: f64) -> Point {
    Point { place: Some(at(north_km, east_km)), altitude_m: Some(altitude_m) }
}

pub fn waypoint(north_km: f64, east_km: f64, altitude_m: f64) -> Item {
    item(Action::Waypoint { point: point(north_km, east_km, altitude_m), acceptance_m: None })
}

pub fn circle(north_km: f64, east_km: f64, altitude_m: f64) -> Circle {
    Circle { centre: point(north_km, east_km, altitude_m), radius_m: None, clockwise: true }
}

pub fn item(action: Action) -> Item {
    Item { action, autocontinue: true }
}

pub fn plan(items: Vec<Item>) -> Arc<Plan> {
    Arc::new(Plan { id: 7, items })
}

impl Plane {
    /// North at 264 m/s and 5000 m, after its first tick.
    pub fn flying() -> Self {
        let mut plane = Self {
            vehicle: Vehicle::new(ReferenceSchedule::default()),
            rules: rules(),
            place: start(),
            heading: 0.0,
            roll: 0.0,
            roll_error_rad: 0.0,
            altitude_m: 5_000.0,
            airspeed_m_s: 264.0,
            climb_m_s: 0.0,
            now: SimTime::ZERO,
            events: Vec::new(),
            valid: Validity::COMPLETE,
            on_wheels: false,
            thrust_n: 0.0,
            propulsion: Powerplant::default(),
        };
        plane.tick();
        plane
    }

    pub fn state(&self) -> NavigationState {
        let (sin, cos) = libm::sincos(self.heading);
        let v = self.airspeed_m_s;
        let angles = EulerAngles { phi: self.roll, theta: 0.0, psi: self.heading };
        let offset = Horizon::at(start()).offset(&Site::at(self.place));
        NavigationState {
            time: self.now,
            attitude: angles,
            orientation: Attitude::from_euler(angles),
            velocity: Ned::new(v * cos, v * sin, -self.climb_m_s),
            position: Ned::new(offset.x, offset.y, -self.altitude_m),
            latitude_rad: self.place.latitude_rad,
            longitude_rad: self.place.longitude_rad,
            altitude_m: self.altitude_m,
            airspeed_m_s: v,
            thrust_n: self.thrust_n,
            valid: self.valid,
            on_wheels: self.on_wheels,
            ..NavigationState::at_rest()
        }
    }

    pub fn tick(&mut self) {
        let state = self.state();
        let events = &mut self.events;
        let demand = self.vehicle.track(&state, &self.rules, &self.propulsion, &mut |kind| {
            events.push(kind);
        });
        // A small number.
        let dt = TICK_US as f64 * 1.0e-6;
        self.roll = demand.roll_rad + self.roll_error_rad;
        self.heading += STANDARD_GRAVITY_M_S2 * libm::tan(self.roll) / self.airspeed_m_s * dt;
        let wanted_m_s = (0.1 * (demand.altitude_m - self.altitude_m)).clamp(-CLIMB_M_S, CLIMB_M_S);
        self.climb_m_s += (wanted_m_s - self.climb_m_s) * dt / (CLIMB_LAG_S + dt);
        self.altitude_m += self.climb_m_s * dt;
        let most = ACCELERATION_M_S2 * dt;
        self.airspeed_m_s += (demand.airspeed_m_s - self.airspeed_m_s).clamp(-most, most);
        let (sin, cos) = libm::sincos(self.heading);
        let way = Horizontal::new(cos, sin) * (self.airspeed_m_s * dt);
        self.place = Horizon::at(self.place).place_at(&way);
        self.now = SimTime::from_micros(self.now.as_micros() + TICK_US);
    }

    pub fn fly(&mut self, seconds: f64) {
        let ticks = (seconds * 1.0e6 / TICK_US as f64) as u32;
        for _ in 0..ticks {
            self.tick();
        }
    }

    /// Flies until an event, or until the time is over.
    pub fn fly_until(&mut self, seconds: f64, kind: VehicleEvent) {
        let end = self.now.as_seconds() + seconds;
        while !self.events.contains(&kind) {
            assert!(self.now.as_seconds() < end, "no {kind:?}: {:?}", self.events);
            self.tick();
        }
    }

    pub fn change(&mut self, mode: Mode) -> Result<(), VehicleRefusal> {
        let events = &mut self.events;
        self.vehicle.change_mode(mode, &self.rules, &mut |kind| events.push(kind))
    }

    pub fn load(&mut self, plan: &Arc<Plan>) -> Result<(), VehicleRefusal> {
        let events = &mut self.events;
        self.vehicle.replace_plan(plan, &self.rules, &mut |kind| events.push(kind))
    }

    pub fn select(&mut self, item: u16) -> Result<(), VehicleRefusal> {
        let events = &mut self.events;
        self.vehicle.select_item(item, &mut |kind| events.push(kind))
    }

    /// Flies a plan from its first item.
    pub fn begin(items: Vec<Item>) -> Self {
        let mut plane = Self::flying();
        plane.load(&plan(items)).unwrap();
        plane.change(Mode::Mission).unwrap();
        plane
    }

    /// Distance to a place, m.
    pub fn distance_m(&self, place: Place) -> f64 {
        Horizon::at(self.place).offset(&Site::at(place)).norm()
    }

    /// Items in the order in which they began.
    pub fn begun(&self) -> Vec<u16> {
        let begun = |kind: &VehicleEvent| match kind {
            VehicleEvent::PlanItem(item) => Some(*item),
            _ => None,
        };
        self.events.iter().filter_map(begun).collect()
    }

    /// Items in the order in which they were reached.
    pub fn reached(&self) -> Vec<u16> {
        let reached = |kind: &VehicleEvent| match kind {
            VehicleEvent::ItemReached(item) => Some(*item),
            _ => None,
        };
        self.events.iter().filter_map(reached).collect()
    }

    pub fn demand(&self) -> flight_control::Demand {
        *self.vehicle.demand().unwrap()
    }
}
