//! State of the vehicle: mode and references. Accepts or refuses commands of the operator.
//!
//! In the modes that follow a path the guidance computes the roll reference ([`flight_control::guidance`]), one
//! tick at a time, from position and motion of the aircraft. No state here depends on
//! wall time, and a tick does not allocate.

use std::sync::Arc;

use flight_control::guidance::Steering;
use flight_control::{Demand, NavigationState};
use icd::SimTime;

mod altitude;
mod circle;
mod commands;
pub mod geodesy;
pub mod limits;
mod link;
mod mission;
mod offboard;
pub mod plan;
mod position;
pub mod report;
pub mod request;
pub mod rules;
pub mod schedule;
mod situation;

use altitude::{AltitudeDemand, Pilot};
use circle::{Flown, Hold, Orbit};
use geodesy::{LocalAxes, Site};
pub use limits::{NavigationParameters, ReferenceLimits};
use link::Link;
use mission::{Flight, Mission};
use offboard::Offboard;
use plan::Plan;
use position::Position;
pub use report::{Mode, Navigation, VehicleEvent};
pub use request::{
    Airspeed, LinkLossAction, Place, Reference, Reposition, Setpoint, Sticks, VehicleRefusal,
};
pub use rules::Rules;
use schedule::ReferenceSchedule;
use situation::{Situation, WindEstimate};

/// Longest time between two ticks that counts, s.
const DT_MAX_S: f64 = 0.1;

#[derive(Debug, Clone)]
pub struct Vehicle {
    mode: Mode,
    demand: Option<Demand>,
    schedule: ReferenceSchedule,
    scheduled: usize,
    position: Position,
    hold: Hold,
    mission: Mission,
    offboard: Offboard,
    pilot: Pilot,
    link: Link,
    home: Option<Site>,
    axes: Option<LocalAxes>,
    wind: WindEstimate,
    altitude: AltitudeDemand,
    time: Option<SimTime>,
    terminated: bool,
    /// Without plan and home.
    navigation: Navigation,
}

impl Vehicle {
    /// In Position, with references by time and without a plan.
    pub fn new(schedule: ReferenceSchedule) -> Self {
        Self {
            mode: Mode::Position,
            demand: None,
            schedule,
            scheduled: 0,
            position: Position::default(),
            hold: Hold::default(),
            mission: Mission::default(),
            offboard: Offboard::default(),
            pilot: Pilot::default(),
            link: Link::default(),
            home: None,
            axes: None,
            wind: WindEstimate::default(),
            altitude: AltitudeDemand::default(),
            time: None,
            terminated: false,
            navigation: Navigation::default(),
        }
    }

    /// Begins a flight, or joins one in progress: in Position, with references that start from
    /// the first sample and home below it. The plan stays loaded and starts from its beginning.
    pub fn begin_flight(&mut self) {
        let schedule = core::mem::take(&mut self.schedule);
        let mut mission = core::mem::take(&mut self.mission);
        mission.rewind();
        *self = Self { mission, ..Self::new(schedule) };
    }

    pub fn references(&self) -> &ReferenceSchedule {
        &self.schedule
    }

    /// The loaded plan; empty if there is none.
    pub fn plan(&self) -> Arc<Plan> {
        Arc::clone(self.mission.plan())
    }

    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Present references, once there was a first sample.
    pub fn demand(&self) -> Option<&Demand> {
        self.demand.as_ref()
    }

    /// The guidance of the last tick, with plan and home of the present.
    pub fn navigation(&self) -> Navigation {
        let home = self.home.map(|home| home.place());
        let mut navigation = Navigation { home, ..self.navigation };
        self.mission.describe(&mut navigation);
        navigation
    }

    /// The flight was terminated.
    pub fn is_terminated(&self) -> bool {
        self.terminated
    }

    /// Takes references, home and local axes from the first known state, if there are none yet, so that commands can change
    /// them before the first tick of [`Vehicle::track`].
    pub fn see(&mut self, state: &NavigationState) {
        let valid = &state.valid;
        if self.demand.is_some() || !(valid.altitude && valid.airspeed && valid.position) {
            return;
        }
        self.demand = Some(present(state));
        let place = Place::of(state);
        if rules::check_place(place).is_ok() {
            self.home = Some(Site::at(place));
            self.axes = Some(LocalAxes::of(place, state.altitude_m, state.position));
        }
    }

    /// The demand to the laws at this tick: the references, corrected for a persistent altitude error.
    ///
    /// The references are altitude, airspeed and course of the first known state, then what the schedule,
    /// the operator and the mode have set since. Before it they are the state's own.
    pub fn track(
        &mut self,
        state: &NavigationState,
        rules: &Rules,
        publish: &mut dyn FnMut(VehicleEvent),
    ) -> Demand {
        let time = state.time;
        let before = self.time.replace(time).unwrap_or(time);
        #[expect(clippy::cast_precision_loss, reason = "microseconds between two ticks")]
        let dt_s = (time.micros_since(before) as f64 * 1.0e-6).min(DT_MAX_S);
        self.see(state);
        let Some(mut demand) = self.demand else { return present(state) };
        self.follow_schedule(time, &mut demand);
        let mut altitude_m = None;
        let mut flown = None;
        if self.is_guided() {
            self.wind.step(state, dt_s);
            let situation = Situation::new(state, &self.wind, dt_s);
            flown = self.fly(&situation, &mut demand, rules, publish);
            if let Some(Flown { steering, .. }) = flown {
                let most = rules.roll_slew_rad_s() * dt_s;
                demand.roll_rad += (steering.bank_rad - demand.roll_rad).clamp(-most, most);
            }
            altitude_m = Some(self.altitude.step(demand.altitude_m, &situation, rules));
        } else {
            self.altitude.reset();
        }
        self.demand = Some(demand);
        self.describe(flown.as_ref());
        Demand { altitude_m: altitude_m.unwrap_or(demand.altitude_m), ..demand }
    }

    /// Whether the guidance or a pilot computes a reference: the laws get more than the given references.
    fn is_guided(&self) -> bool {
        self.mode != Mode::Position || !self.position.is_as_given()
    }

    /// A scheduled roll angle is flown in Position and replaces the course; altitude and airspeed count in every
    /// mode, until the mode sets others.
    fn follow_schedule(&mut self, time: SimTime, demand: &mut Demand) {
        while let Some(entry) = self.schedule.entry(self.scheduled).filter(|entry| entry.at <= time)
        {
            demand.altitude_m = entry.altitude_m.unwrap_or(demand.altitude_m);
            demand.airspeed_m_s = entry.airspeed_m_s.unwrap_or(demand.airspeed_m_s);
            if let (Some(roll_rad), Mode::Position) = (entry.roll_rad, self.mode) {
                demand.roll_rad = roll_rad;
                self.position.release_roll();
            }
            self.scheduled += 1;
        }
    }

    /// One tick of the mode; `None` if it leaves the roll reference unchanged.
    fn fly(
        &mut self,
        situation: &Situation,
        demand: &mut Demand,
        rules: &Rules,
        publish: &mut dyn FnMut(VehicleEvent),
    ) -> Option<Flown> {
        if self.mode == Mode::Mission
            && let Some(flown) = self.fly_mission(situation, demand, rules, publish)
        {
            return Some(flown);
        }
        match self.mode {
            // A plan that has just ended has changed the mode.
            Mode::Mission => None,
            Mode::Position => self.position.fly(situation, demand, rules),
            Mode::Hold => Some(self.hold.fly(situation, demand, rules)),
            Mode::Return => self.home.map(|centre| {
                let home = Orbit { centre, radius_m: None, clockwise: true };
                home.fly(situation, demand, rules)
            }),
            Mode::Offboard => self.offboard.fly(situation, demand, rules),
            Mode::Altitude => {
                self.pilot.fly(situation, demand, rules);
                None
            }
        }
    }

    /// One tick of the plan. At its end the mode changes and there is no more command.
    fn fly_mission(
        &mut self,
        situation: &Situation,
        demand: &mut Demand,
        rules: &Rules,
        publish: &mut dyn FnMut(VehicleEvent),
    ) -> Option<Flown> {
        let mut tick = mission::Tick { situation, rules, home: self.home, publish };
        match self.mission.fly(demand, &mut tick) {
            Flight::Fly(flown) => return Some(flown),
            Flight::Complete(around) => {
                self.mode = Mode::Hold;
                self.hold = Hold::around(around);
            }
            Flight::Home => {
                self.mode = Mode::Return;
                demand.altitude_m = rules.nearest_altitude_m(rules.navigation.return_altitude_m);
            }
        }
        self.link.forget();
        publish(VehicleEvent::Mode(self.mode));
        None
    }

    fn describe(&mut self, flown: Option<&Flown>) {
        let steering = flown.map(|flown| flown.steering);
        self.navigation = Navigation {
            target: flown.and_then(|flown| flown.target),
            course_rad: steering.map(|steering: Steering| steering.course_rad),
            cross_track_m: steering.map_or(0.0, |steering| steering.cross_track_m),
            ..Navigation::default()
        };
    }
}

/// A demand that keeps altitude and airspeed, with wings level.
fn present(state: &NavigationState) -> Demand {
    Demand { altitude_m: state.altitude_m, roll_rad: 0.0, airspeed_m_s: state.airspeed_m_s }
}

#[cfg(test)]
mod tests;
