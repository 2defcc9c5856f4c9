//! Beginning of an item: from the item to a task.

use flight_control::Demand;

use super::leg::{Leg, LegPhase, Ramp};
use super::loiter::{Loiter, Until};
use super::{LOOP_MIN_S, Mission, Task, Tick};
use crate::vehicle::VehicleEvent;
use crate::vehicle::circle::Orbit;
use crate::vehicle::geodesy::Site;
use crate::vehicle::plan::{Action, Circle, Item, Point};

/// An item without a task.
pub enum Otherwise {
    AtOnce,
    /// Replaced by another item.
    Jump(u16),
    Later,
    Home,
}

impl Mission {
    /// Begins an item; changes that it makes at once are made.
    pub(super) fn begin(
        &mut self,
        item: &Item,
        demand: &mut Demand,
        tick: &mut Tick,
    ) -> Result<Task, Otherwise> {
        if !matches!(item.action, Action::Jump { .. }) {
            (tick.publish)(VehicleEvent::PlanItem(self.current));
        }
        let (circle, until) = match item.action {
            Action::Waypoint { point, acceptance_m } => {
                return Ok(Task::Leg(self.leg(&point, acceptance_m, demand, tick)));
            }
            Action::LoiterUnlimited(circle) => (circle, Until::ForGood),
            Action::LoiterTurns { circle, turns } => {
                (circle, Until::Turned(turns * core::f64::consts::TAU))
            }
            Action::LoiterTime { circle, seconds } => (circle, Until::Held(seconds)),
            Action::LoiterToAltitude(circle) => (circle, Until::Altitude),
            Action::ChangeSpeed { airspeed } => {
                demand.airspeed_m_s = tick.rules.nearest_airspeed_m_s(airspeed, demand.altitude_m);
                return Err(Otherwise::AtOnce);
            }
            Action::ChangeAltitude { altitude_m } => {
                demand.altitude_m = tick.rules.nearest_altitude_m(altitude_m);
                return Ok(Task::Climb(tick.situation.course_rad()));
            }
            Action::Jump { to, times } => return Err(self.jump(to, times)),
            Action::Return => return Err(Otherwise::Home),
        };
        Ok(Task::Loiter(self.circle(&circle, until, demand, tick)))
    }

    fn leg(
        &mut self,
        point: &Point,
        acceptance_m: Option<f64>,
        demand: &Demand,
        tick: &Tick,
    ) -> Leg {
        let here = *tick.situation.horizon().site();
        let to = point.place.map_or(here, Site::at);
        let length_m = tick.situation.horizon().offset(&to).norm();
        let ramp = point.altitude_m.map(|end| Ramp::new(demand.altitude_m, end, length_m));
        let from = self.previous.unwrap_or(here);
        let jumped_back = core::mem::take(&mut self.jumped_back);
        let phase = if jumped_back { LegPhase::Revisit } else { LegPhase::ToWaypoint };
        Leg { from, to, acceptance_m, next: self.next_point(tick.home), ramp, phase }
    }

    fn circle(&self, circle: &Circle, until: Until, demand: &mut Demand, tick: &Tick) -> Loiter {
        let Tick { situation, rules, .. } = *tick;
        let orbit = match circle.centre.place {
            Some(place) => Orbit {
                centre: Site::at(place),
                radius_m: circle.radius_m,
                clockwise: circle.clockwise,
            },
            None => Orbit::here(situation, circle.radius_m, circle.clockwise, demand, rules),
        };
        let length_m = situation.horizon().offset(&orbit.centre).norm();
        let altitude_m = circle.centre.altitude_m;
        let mut loiter = Loiter::new(orbit, until, self.next_point(tick.home), altitude_m);
        match altitude_m {
            // The purpose of the item is the climb: it begins at once.
            Some(end) if until == Until::Altitude => {
                demand.altitude_m = rules.nearest_altitude_m(end);
            }
            end => loiter.ramp = end.map(|end| Ramp::new(demand.altitude_m, end, length_m)),
        }
        loiter
    }

    /// Target of a jump, which it counts. A jump back may have to wait.
    fn jump(&mut self, to: u16, times: Option<u16>) -> Otherwise {
        let onwards = Otherwise::Jump(self.current.saturating_add(1));
        let Some(jumped) = self.jumped.get_mut(usize::from(self.current)) else {
            return onwards;
        };
        if times.is_some_and(|times| *jumped >= times) {
            return onwards;
        }
        if to <= self.current {
            if self.loop_wait_s > 0.0 {
                return Otherwise::Later;
            }
            self.loop_wait_s = LOOP_MIN_S;
            self.jumped_back = true;
        }
        *jumped = jumped.saturating_add(1);
        Otherwise::Jump(to)
    }
}
