//! A circle of a plan, and the condition for leaving it.

use core::f64::consts::TAU;

use flight_control::Demand;
use flight_control::guidance::Horizontal;

use super::leg::Ramp;
use crate::vehicle::circle::{Flown, Orbit};
use crate::vehicle::geodesy::Site;
use crate::vehicle::rules::Rules;
use crate::vehicle::situation::Situation;

/// The aircraft is on the circle within this fraction of its radius, or the acceptance radius.
const ON_CIRCLE_SHARE: f64 = 0.05;
/// And when its track is within this cosine (30 deg) of the circle's direction.
const ON_CIRCLE_COS: f64 = 0.866;
/// The aircraft leaves a circle when the next point is ahead within this sine (4 deg).
const LEAVE_SIN: f64 = 0.07;
/// A point this far outside the circle can be reached by leaving along a tangent.
const OUTSIDE: f64 = 1.05;

/// Condition that completes a circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Until {
    ForGood,
    /// After this angle, rad.
    Turned(f64),
    /// After this simulation time on the circle, s.
    Held(f64),
    /// At the altitude reference.
    Altitude,
}

/// A circle being flown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loiter {
    pub orbit: Orbit,
    /// Condition that completes it.
    pub until: Until,
    /// Continuation of the path.
    pub next: Option<Site>,
    /// Altitude on the way to the circle.
    pub ramp: Option<Ramp>,
    /// Altitude of the circle, m, commanded again after a pause.
    altitude_m: Option<f64>,
    resumed: bool,
    /// The aircraft is or was on the circle since the item began or was resumed.
    on_circle: bool,
    /// It was on it before.
    reached: bool,
    bearing: Option<f64>,
    turned_rad: f64,
    held_s: f64,
    /// Angle turned since its altitude and radius were reached, rad.
    leaving_rad: Option<f64>,
}

/// Result of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Circled {
    On(Flown),
    /// The circle has just been reached; continue.
    Reached(Flown),
    /// Done, and the next point is ahead.
    Done,
}

impl Loiter {
    /// Not yet on the circle.
    pub fn new(orbit: Orbit, until: Until, next: Option<Site>, altitude_m: Option<f64>) -> Self {
        Self {
            orbit,
            until,
            next,
            ramp: None,
            altitude_m,
            resumed: false,
            on_circle: false,
            reached: false,
            bearing: None,
            turned_rad: 0.0,
            held_s: 0.0,
            leaving_rad: None,
        }
    }

    /// The aircraft has been on the circle.
    pub fn is_begun(&self) -> bool {
        self.reached
    }

    /// The aircraft returns to it from elsewhere; turns and time already flown count.
    pub fn resume(&mut self) {
        self.on_circle = false;
        self.bearing = None;
        self.resumed = true;
    }

    pub fn fly(&mut self, situation: &Situation, demand: &mut Demand, rules: &Rules) -> Circled {
        let offset = situation.horizon().offset(&self.orbit.centre);
        let radius_m = self.orbit.flown_radius_m(situation, demand, rules);
        if core::mem::take(&mut self.resumed)
            && let Some(altitude_m) = self.altitude_m
        {
            demand.altitude_m = rules.nearest_altitude_m(altitude_m);
        }
        if let Some(ramp) = &mut self.ramp {
            let altitude_m = ramp.altitude_m(offset.norm(), radius_m);
            demand.altitude_m = rules.nearest_altitude_m(altitude_m);
        }
        let flown = self.orbit.fly(situation, demand, rules);
        self.on_circle = self.on_circle || self.is_on(&offset, radius_m, situation, rules);
        if !self.on_circle {
            return Circled::On(flown);
        }
        if let Some(ramp) = self.ramp.take() {
            demand.altitude_m = rules.nearest_altitude_m(ramp.end_m());
        }
        let turned_rad = self.count(&offset, situation);
        let newly = !core::mem::replace(&mut self.reached, true);
        if self.is_done(situation, demand, rules)
            && self.is_left(turned_rad, &offset, radius_m, situation)
        {
            return Circled::Done;
        }
        if newly { Circled::Reached(flown) } else { Circled::On(flown) }
    }

    fn is_on(
        &self,
        offset: &Horizontal,
        radius_m: f64,
        situation: &Situation,
        rules: &Rules,
    ) -> bool {
        let r = offset.norm();
        let near = rules.navigation.acceptance_m.max(ON_CIRCLE_SHARE * radius_m);
        // Positive for a track that has the centre to its right.
        let around = situation.velocity.x * offset.y - situation.velocity.y * offset.x;
        let around = if self.orbit.clockwise { around } else { -around };
        (r - radius_m).abs() <= near && around >= ON_CIRCLE_COS * r * situation.speed_m_s
    }

    /// Counts angle and time; the angle of this tick, rad.
    fn count(&mut self, offset: &Horizontal, situation: &Situation) -> f64 {
        let bearing = libm::atan2(offset.y, offset.x);
        let before = self.bearing.replace(bearing).unwrap_or(bearing);
        let change = libm::remainder(bearing - before, TAU);
        let change = if self.orbit.clockwise { change } else { -change };
        self.turned_rad += change;
        self.held_s += situation.dt_s;
        change
    }

    fn is_done(&self, situation: &Situation, demand: &Demand, rules: &Rules) -> bool {
        match self.until {
            Until::ForGood => false,
            Until::Turned(angle) => self.turned_rad >= angle,
            Until::Held(seconds) => self.held_s >= seconds,
            Until::Altitude => {
                (situation.altitude_m - demand.altitude_m).abs() < rules.altitude_reached_m()
            }
        }
    }

    /// Leaves where the tangent leads to the next point, or at once if no tangent does, and after one more turn
    /// in any case.
    fn is_left(
        &mut self,
        turned_rad: f64,
        offset: &Horizontal,
        radius_m: f64,
        situation: &Situation,
    ) -> bool {
        let leaving_rad = self.leaving_rad.get_or_insert(0.0);
        *leaving_rad += turned_rad;
        let Some(next) = &self.next else { return true };
        let to_next = situation.horizon().offset(next);
        if (to_next - offset).norm() < OUTSIDE * radius_m || *leaving_rad > TAU {
            return true;
        }
        let (v, size) = (situation.velocity, situation.speed_m_s * to_next.norm());
        let across = v.x * to_next.y - v.y * to_next.x;
        v.dot(&to_next) > 0.0 && across.abs() < LEAVE_SIN * size
    }
}
