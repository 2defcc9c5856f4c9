//! A straight leg to a waypoint: where it ends, and the altitude along it.

use super::Mission;
use crate::vehicle::circle::{Flown, target};
use crate::vehicle::geodesy::Site;
use crate::vehicle::plan::Action;
use crate::vehicle::rules::Rules;
use crate::vehicle::situation::Situation;
use flight_control::Demand;
use flight_control::guidance::approach::planned_radius_m;
use flight_control::guidance::{Horizontal, follow_line, hold_course};

/// Turns begin early as if they were no more than a right angle: the rest of a sharper one is flown
/// beyond the point.
const ANTICIPATED_MAX_RAD: f64 = core::f64::consts::FRAC_PI_2;
/// A turn begins within this fraction of the shorter of its two legs.
const LEG_SHARE: f64 = 0.5;
/// The bisector of an almost reversed course has no direction; below this length it is ignored.
const BISECTOR_MIN: f64 = 0.2;

/// To return to a point the aircraft flies this many turn radii away from it: it must turn around and find
/// the line to the point again.
const AWAY_RADII: f64 = 4.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    pub from: Site,
    pub to: Site,
    /// Acceptance radius of the item, m.
    pub acceptance_m: Option<f64>,
    /// Continuation of the path.
    pub next: Option<Site>,
    pub ramp: Option<Ramp>,
    /// Part of the leg being flown.
    pub phase: LegPhase,
}

/// Part of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LegPhase {
    ToWaypoint,
    /// The same in the first tick after a jump back: a waypoint that is reached already is flown to again.
    Revisit,
    /// First away from the waypoint, on a course in rad.
    Away(f64),
}

/// An altitude that changes linearly with the distance, reached where the leg ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ramp {
    from_m: f64,
    to_m: f64,
    length_m: f64,
    /// The largest fraction of the way so far: the reference never goes back.
    share: f64,
}

impl Ramp {
    /// From one altitude to another over this length, m.
    pub fn new(from_m: f64, to_m: f64, length_m: f64) -> Self {
        Self { from_m, to_m, length_m, share: 0.0 }
    }

    /// Altitude with this distance left, m; it is complete when `early_m` is left.
    pub fn altitude_m(&mut self, left_m: f64, early_m: f64) -> f64 {
        let length_m = self.length_m - early_m;
        let share = if length_m > 1.0 { 1.0 - (left_m - early_m) / length_m } else { 1.0 };
        self.share = self.share.max(share).min(1.0);
        self.from_m + self.share * (self.to_m - self.from_m)
    }

    /// Final altitude, m.
    pub fn end_m(&self) -> f64 {
        self.to_m
    }
}

/// The leg as seen from the aircraft.
struct View {
    from: Horizontal,
    to: Horizontal,
    along: Horizontal,
    /// Along the next one, and its length, m.
    onwards: Option<(Horizontal, f64)>,
    length_m: f64,
}

impl View {
    fn new(leg: &Leg, situation: &Situation) -> Self {
        let seen = |site: &Site| situation.horizon().offset(site);
        let (from, to) = (seen(&leg.from), seen(&leg.to));
        let along = to - from;
        let length_m = along.norm();
        let along = if length_m > 1.0 { along / length_m } else { Horizontal::zeros() };
        let onwards = leg.next.as_ref().and_then(|next| {
            let way = seen(next) - to;
            let length_m = way.norm();
            (length_m > 1.0).then(|| (way / length_m, length_m))
        });
        Self { from, to, along, onwards, length_m }
    }

    /// How far before the point the turn into the next leg begins, m: R tan(Δχ/2) and the way of rolling in.
    fn anticipation_m(&self, situation: &Situation, rules: &Rules) -> f64 {
        let Some((onwards, next_m)) = self.onwards else { return 0.0 };
        let turn = libm::acos(self.along.dot(&onwards).clamp(-1.0, 1.0)).min(ANTICIPATED_MAX_RAD);
        let v = situation.speed_m_s;
        let radius_m = planned_radius_m(v, &rules.guidance());
        let roll_in_m = v * rules.roll_in_s() * turn / ANTICIPATED_MAX_RAD;
        let lead_m = radius_m * libm::tan(0.5 * turn) + roll_in_m;
        lead_m.min(LEG_SHARE * self.length_m).min(LEG_SHARE * next_m)
    }

    /// Beyond the end of the leg, or beyond the bisector of the turn.
    fn is_passed(&self) -> bool {
        let bisector = self.onwards.map(|(onwards, _)| self.along + onwards);
        let beyond = |normal: &Horizontal| self.to.dot(normal) <= 0.0;
        beyond(&self.along)
            || bisector.filter(|b| b.norm() > BISECTOR_MIN).is_some_and(|b| beyond(&b))
    }
}

impl Leg {
    /// One tick: the command, or `None` when the waypoint is reached.
    pub fn fly(
        &mut self,
        situation: &Situation,
        demand: &mut Demand,
        rules: &Rules,
    ) -> Option<Flown> {
        let mut view = View::new(self, situation);
        let acceptance_m = self.acceptance_m.unwrap_or_else(|| {
            rules.navigation.acceptance_m.max(view.anticipation_m(situation, rules))
        });
        let distance_m = view.to.norm();
        if let Some(ramp) = &mut self.ramp {
            let altitude_m = ramp.altitude_m(distance_m, acceptance_m);
            demand.altitude_m = rules.nearest_altitude_m(altitude_m);
        }
        let is_reached = distance_m <= acceptance_m || view.is_passed();
        match self.phase {
            LegPhase::Revisit if is_reached => self.phase = LegPhase::Away(situation.course_rad()),
            LegPhase::Revisit => self.phase = LegPhase::ToWaypoint,
            LegPhase::ToWaypoint | LegPhase::Away(_) => {}
        }
        let target = target(&self.to, &view.to, demand.altitude_m, None);
        if let LegPhase::Away(course_rad) = self.phase {
            let guidance = rules.guidance();
            let turn_m = AWAY_RADII * planned_radius_m(situation.speed_m_s, &guidance);
            if distance_m < acceptance_m + turn_m {
                let steering = hold_course(course_rad, &situation.velocity, &guidance);
                return Some(Flown { steering, target: Some(target) });
            }
            self.phase = LegPhase::ToWaypoint;
            self.from = *situation.horizon().site();
            view = View::new(self, situation);
        } else if is_reached {
            if let Some(ramp) = &self.ramp {
                demand.altitude_m = rules.nearest_altitude_m(ramp.end_m());
            }
            return None;
        }
        let steering = follow_line(&view.from, &view.to, &situation.velocity, &rules.guidance());
        Some(Flown { steering, target: Some(target) })
    }
}

/// Items without a place that are skipped in the search.
const STEPS_MAX: usize = 32;

impl Mission {
    /// The point that the aircraft flies to after the current item, if there is one and the item continues by itself.
    pub(super) fn next_point(&self, home: Option<Site>) -> Option<Site> {
        let current = self.plan.items.get(usize::from(self.current))?;
        if !current.autocontinue {
            return None;
        }
        let mut at = self.current.saturating_add(1);
        for _ in 0..STEPS_MAX {
            let item = self.plan.items.get(usize::from(at))?;
            match item.action {
                Action::Waypoint { point, .. } => return point.place.map(Site::at),
                Action::LoiterUnlimited(circle)
                | Action::LoiterToAltitude(circle)
                | Action::LoiterTurns { circle, .. }
                | Action::LoiterTime { circle, .. } => return circle.centre.place.map(Site::at),
                Action::Return => return home,
                Action::ChangeAltitude { .. } => return None,
                Action::ChangeSpeed { .. } if item.autocontinue => at = at.saturating_add(1),
                Action::ChangeSpeed { .. } => return None,
                Action::Jump { to, times } => {
                    let jumped = self.jumped.get(usize::from(at)).copied().unwrap_or(0);
                    let leads_on = times.is_none_or(|times| jumped < times);
                    at = if leads_on { to } else { at.saturating_add(1) };
                }
            }
        }
        None
    }
}
