//! Mission: the items of a plan, one after the other. An item becomes a task: a straight leg to a waypoint, a circle with the
//! condition for leaving it, a climb.

use core::f64::consts::TAU;
use std::sync::Arc;

use flight_control::Demand;
use flight_control::guidance::approach::planned_radius_m;
use flight_control::guidance::{Horizontal, follow_line};

use super::Situation;
use super::fence::FenceWatch;
use super::geodesy::{Horizon, Site};
use super::landing::Approach;
use super::modes::{Flown, Orbit, target};
use super::plan::{Action, Circle, Item, Plan, Point, Progress, WaitCondition};
use super::request::{Navigation, Place, VehicleEvent, VehicleRefusal};
use super::rules::{LEG_SHARE, Rules, turn_rad};

/// Items that are begun in one tick, each with two events; further ones follow in the next tick.
const AT_ONCE_MAX: u32 = 4;
/// Shortest time between two jumps back, s: a loop that takes no time must not cause a flood of events.
const LOOP_MIN_S: f64 = 1.0;
/// Items without a place that are skipped in the search.
const STEPS_MAX: usize = 32;
/// After so many unstable approaches the next one is flown to the ground.
const GO_AROUNDS_MAX: u8 = 2;

/// The plan and its progress.
#[derive(Debug, Clone, Default)]
pub struct Mission {
    plan: Arc<Plan>,
    current: u16,
    progress: Progress,
    /// Number of jumps that each item has made, and of times that one without equipment was passed.
    jumped: Vec<u16>,
    task: Option<Task>,
    waiting: Option<HeldItems>,
    /// The current item may be below the altitude limit.
    near_ground: bool,
    /// The point that the aircraft has just passed: the next leg begins there.
    previous: Option<Site>,
    /// A jump has led back, and no item has been flown since.
    jumped_back: bool,
    /// Time until the next jump back, s.
    loop_wait_s: f64,
    /// The item flown last.
    flown: Option<Flown>,
    /// Approaches given up because they were not stable.
    go_arounds: u8,
}

/// The current item in flight.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Task {
    Leg(Leg),
    Loiter(Loiter),
    /// Straight on until the altitude is reached, on a course in rad.
    Climb(f64),
    Approach(Approach),
    /// Circles around the point, since the item does not continue by itself.
    Parked(Orbit),
}

/// Items that wait for a condition while the aircraft flies on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct HeldItems {
    /// The first of them, and the item behind the last, which is flown meanwhile.
    next: u16,
    end: u16,
    until: WaitCondition,
    waited_s: f64,
}

/// An item without a task.
enum Otherwise {
    AtOnce,
    /// Replaced by another item.
    Jump(u16),
    Later,
    Home,
}

/// Result of one tick of Mission.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Flight {
    Fly(Flown),
    /// The plan is complete: circle here.
    Complete(Orbit),
    /// The plan is complete: Return.
    Home,
}

/// Input of a tick of Mission.
pub struct Tick<'a> {
    /// Position and motion of the aircraft.
    pub situation: &'a Situation<'a>,
    pub home: &'a mut Option<Site>,
    pub fence: &'a mut FenceWatch,
    pub publish: &'a mut dyn FnMut(VehicleEvent),
}

impl Mission {
    /// Replaces the plan, which is already checked and does not begin yet.
    pub fn replace(&mut self, plan: Arc<Plan>) {
        self.jumped.clear();
        self.jumped.resize(plan.items.len(), 0);
        self.plan = plan;
        self.rewind();
    }

    /// Back to the beginning of the plan.
    pub fn rewind(&mut self) {
        self.jumped.fill(0);
        self.current = 0;
        self.task = None;
        self.previous = None;
        self.jumped_back = false;
        self.waiting = None;
        self.flown = None;
        self.go_arounds = 0;
        self.progress = if self.is_empty() { Progress::NoPlan } else { Progress::NotStarted };
    }

    /// The plan; empty if there is none.
    pub fn plan(&self) -> &Arc<Plan> {
        &self.plan
    }

    /// There is no plan.
    pub fn is_empty(&self) -> bool {
        self.plan.items.is_empty()
    }

    /// Begins, continues, or begins again after the end.
    pub fn start(&mut self) {
        if self.progress == Progress::Complete {
            self.rewind();
        }
        // From the present position: a leg begins again, a circle keeps its count.
        self.previous = None;
        self.flown = None;
        match &mut self.task {
            // The aircraft returns to the circle from elsewhere; turns and time already flown count.
            Some(Task::Loiter(loiter)) if loiter.reached => {
                (loiter.on_circle, loiter.bearing, loiter.resumed) = (false, None, true);
                loiter.around_rad = 0.0;
            }
            Some(Task::Parked(_)) | None => {}
            Some(Task::Leg(_) | Task::Loiter(_) | Task::Climb(_) | Task::Approach(_)) => {
                self.task = None;
            }
        }
        self.progress = Progress::Active;
    }

    /// Another mode takes over.
    pub fn pause(&mut self) {
        if self.progress == Progress::Active {
            self.progress = Progress::Paused;
        }
    }

    /// Makes an item the current one; jumps count from zero again.
    pub fn select(&mut self, item: u16) -> Result<(), VehicleRefusal> {
        let items = self.plan.count();
        if item >= items {
            return Err(VehicleRefusal::NoSuchItem { item, items });
        }
        // `rewind` forgets that the plan is under way.
        let progress = self.progress;
        self.rewind();
        self.current = item;
        // So that a plan that was complete can be continued with this item.
        self.progress = if progress == Progress::Complete { Progress::Paused } else { progress };
        Ok(())
    }

    /// The operator gave an altitude: it holds until the next item that sets one.
    pub fn release_altitude(&mut self) {
        match &mut self.task {
            Some(Task::Leg(leg)) => leg.ramp = None,
            Some(Task::Loiter(loiter)) => loiter.ramp = None,
            Some(Task::Climb(_) | Task::Approach(_) | Task::Parked(_)) | None => {}
        }
    }

    /// The item under way takes off or lands.
    pub fn is_near_ground(&self) -> bool {
        self.near_ground
    }

    /// The item with which the landing of the plan begins, that whose point is the nearest if there are several.
    pub fn landing(&self, from: Place) -> Option<u16> {
        let starts = |action: &Action| matches!(action, Action::LandStart);
        let lands = |action: &Action| matches!(action, Action::Land { .. });
        let distance_m = |number: u16| {
            let behind = self.plan.items.iter().skip(usize::from(number));
            let place = behind.filter_map(|item| item.action.place()).next();
            place.map_or(f64::INFINITY, |place| Horizon::at(from).offset(&Site::at(place)).norm())
        };
        let nearest = |kind: &dyn Fn(&Action) -> bool| {
            let items = (0_u16..).zip(&self.plan.items).filter(|(_, item)| kind(&item.action));
            items.map(|(number, _)| number).min_by(|a, b| distance_m(*a).total_cmp(&distance_m(*b)))
        };
        // The line of an approach begins at the point before.
        let before = |land: u16| {
            let point = land.checked_sub(1).filter(|number| {
                let item = self.plan.items.get(usize::from(*number));
                item.is_some_and(|item| item.action.place().is_some())
            });
            point.unwrap_or(land)
        };
        nearest(&starts).or_else(|| nearest(&lands).map(before))
    }

    /// Ends an approach and climbs to this altitude, m, to fly it again.
    pub fn go_around(&mut self, altitude_m: Option<f64>) -> Result<(), VehicleRefusal> {
        match &mut self.task {
            Some(Task::Approach(approach)) => {
                approach.go_around(altitude_m);
                Ok(())
            }
            _ => Err(VehicleRefusal::NoApproach),
        }
    }

    /// The approach under way.
    pub fn approach(&self) -> Option<&Approach> {
        match &self.task {
            Some(Task::Approach(approach)) => Some(approach),
            _ => None,
        }
    }

    /// A flare is under way.
    pub fn is_flaring(&self) -> bool {
        self.approach().is_some_and(Approach::is_flaring)
    }

    /// The aircraft is on the ground: the landing under way is complete.
    pub fn touch_down(&mut self, publish: &mut dyn FnMut(VehicleEvent)) {
        if let Some(Task::Approach(_)) = self.task {
            publish(VehicleEvent::ItemReached(self.current));
            if self.current.saturating_add(1) >= self.plan.count() {
                self.progress = Progress::Complete;
                publish(VehicleEvent::PlanComplete);
            } else {
                self.current += 1;
            }
            self.task = None;
        }
    }

    /// Adds the plan to the guidance for telemetry.
    pub fn describe(&self, navigation: &mut Navigation) {
        navigation.plan_id = self.plan.id;
        navigation.items = self.plan.count();
        navigation.item = self.current;
        navigation.progress = self.progress;
    }

    /// Progress of the plan.
    pub fn progress(&self) -> Progress {
        self.progress
    }

    /// One tick of Mission.
    pub fn fly(&mut self, demand: &mut Demand, tick: &mut Tick) -> Flight {
        // Only the pointer, so that items can be read while the progress changes.
        let plan = Arc::clone(&self.plan);
        self.loop_wait_s = (self.loop_wait_s - tick.situation.dt_s).max(0.0);
        self.run_waiting(demand, tick);
        for _ in 0..AT_ONCE_MAX {
            let Some(item) = plan.items.get(usize::from(self.current)) else {
                let around = self.last_circle(demand, tick);
                self.complete(tick);
                return Flight::Complete(around);
            };
            if self.task.is_none() {
                self.near_ground = plan.is_near_ground(self.current, tick.situation.rules);
            }
            let rules = tick.situation.rules;
            let rules = if self.near_ground { rules.near_ground() } else { *rules };
            let situation = Situation { rules: &rules, ..*tick.situation };
            let Tick { home, fence, publish, .. } = tick;
            let tick = &mut Tick { situation: &situation, home, fence, publish };
            let task = match self.task {
                Some(task) => task,
                None => match self.begin(item, demand, tick) {
                    Ok(task) => task,
                    Err(Otherwise::AtOnce) => {
                        self.finish(item, None, demand, tick);
                        continue;
                    }
                    Err(Otherwise::Jump(to)) => {
                        self.current = to;
                        continue;
                    }
                    Err(Otherwise::Later) => break,
                    Err(Otherwise::Home) => {
                        self.complete(tick);
                        return Flight::Home;
                    }
                },
            };
            if let Some(flown) = self.continue_task(task, demand, tick) {
                self.flown = Some(flown);
                return Flight::Fly(flown);
            }
            self.finish(item, Some(task), demand, tick);
        }
        // Until the next item begins: continues as before, or straight on.
        let straight_on = || tick.situation.hold_course(tick.situation.course_rad());
        Flight::Fly(*self.flown.get_or_insert_with(straight_on))
    }

    fn complete(&mut self, tick: &mut Tick) {
        self.progress = Progress::Complete;
        // Behind the last item there is none that telemetry could show.
        self.current = self.plan.count().saturating_sub(1);
        self.task = None;
        (tick.publish)(VehicleEvent::PlanComplete);
    }

    /// Circles around the point where the last item has ended.
    fn last_circle(&self, demand: &Demand, tick: &Tick) -> Orbit {
        let last = self.plan.items.last().and_then(|item| item.action.circle());
        match (self.previous, last) {
            (Some(centre), _) => Orbit::around(centre),
            (None, Some(circle)) if circle.centre.place.is_some() => {
                Orbit::of(circle, tick.situation, demand)
            }
            (None, _) => Orbit::here(tick.situation, None, true, demand),
        }
    }

    /// One tick of a task; `None` when it is done.
    fn continue_task(
        &mut self,
        mut task: Task,
        demand: &mut Demand,
        tick: &mut Tick,
    ) -> Option<Flown> {
        let situation = tick.situation;
        let flown = match &mut task {
            Task::Leg(leg) => leg.fly(situation, demand),
            Task::Approach(approach) => {
                let may_climb = self.go_arounds < GO_AROUNDS_MAX && situation.may_climb;
                if may_climb && approach.is_unstable(situation) {
                    self.go_arounds += 1;
                    approach.go_around(None);
                    (tick.publish)(VehicleEvent::GoAround);
                }
                let flown = approach.fly(situation, demand);
                if flown.is_none() {
                    // The landing begins again.
                    let again = self.landing(situation.place).unwrap_or(self.current);
                    (self.current, self.task, self.previous) = (again, None, None);
                    return Some(situation.hold_course(situation.course_rad()));
                }
                flown
            }
            Task::Loiter(loiter) => {
                let was_reached = loiter.reached;
                let flown = loiter.fly(situation, demand);
                // It never ends, so it reports when it is reached.
                if loiter.reached && !was_reached && loiter.until == Until::ForGood {
                    (tick.publish)(VehicleEvent::ItemReached(self.current));
                }
                flown
            }
            Task::Climb(course_rad) => {
                let left = (situation.altitude_m - demand.altitude_m).abs();
                let is_under_way = left > situation.rules.altitude_reached_m();
                is_under_way.then(|| situation.hold_course(*course_rad))
            }
            Task::Parked(orbit) => Some(orbit.fly(situation, demand)),
        };
        self.task = Some(task);
        flown
    }

    /// Ends the current item: begins the next one, or circles around the end of this one.
    fn finish(&mut self, item: &Item, task: Option<Task>, demand: &Demand, tick: &mut Tick) {
        (tick.publish)(VehicleEvent::ItemReached(self.current));
        let here = || Orbit::here(tick.situation, None, true, demand);
        let (previous, around) = match task {
            Some(Task::Leg(leg)) => (Some(leg.to), Orbit::around(leg.to)),
            Some(Task::Loiter(loiter)) => (None, loiter.orbit),
            // An item that is done at once does not end the leg before it.
            None => (self.previous, here()),
            Some(_) => (None, here()),
        };
        self.previous = previous;
        // Only an item that is flown ends the loop of a jump back, and the wait of others.
        self.jumped_back &= task.is_none();
        self.waiting = self.waiting.filter(|_| task.is_none());
        if item.autocontinue {
            self.current = self.current.saturating_add(1);
            self.task = None;
        } else {
            self.task = Some(Task::Parked(around));
        }
    }

    /// Begins an item; changes that it makes at once are made.
    fn begin(
        &mut self,
        item: &Item,
        demand: &mut Demand,
        tick: &mut Tick,
    ) -> Result<Task, Otherwise> {
        let rules = tick.situation.rules;
        // A jump is never the item under way.
        if !matches!(item.action, Action::Jump { .. }) {
            (tick.publish)(VehicleEvent::PlanItem(self.current));
        }
        let (circle, until) = match item.action {
            Action::Waypoint { point, acceptance_m } => {
                self.slow_for_landing(rules, false, demand);
                return Ok(Task::Leg(self.leg(&point, acceptance_m, demand, tick)));
            }
            Action::LoiterUnlimited(circle) => (circle, Until::ForGood),
            Action::LoiterTurns { circle, turns } => (circle, Until::Turned(turns * TAU)),
            Action::LoiterTime { circle, seconds } => (circle, Until::Held(seconds)),
            Action::LoiterToAltitude(circle) => (circle, Until::Altitude),
            Action::Takeoff { altitude_m } => {
                let altitude_m = rules.nearest_altitude_m(altitude_m);
                if tick.situation.altitude_m >= altitude_m - rules.altitude_reached_m() {
                    return Err(Otherwise::AtOnce);
                }
                demand.altitude_m = altitude_m;
                return Ok(Task::Climb(tick.situation.course_rad()));
            }
            Action::Land { place, altitude_m, abort_m } => {
                let from = self.previous.unwrap_or(tick.situation.horizon().site);
                let approach =
                    Approach::new(from, place, (altitude_m, abort_m), tick.situation, demand);
                return Ok(Task::Approach(approach));
            }
            Action::Wait(until) => {
                let immediate = |at: &u16| {
                    let item = self.plan.items.get(usize::from(*at));
                    item.is_some_and(|item| item.action.is_immediate() && item.autocontinue)
                };
                let next = self.current.saturating_add(1);
                let end = (next..).find(|at| !immediate(at)).unwrap_or(next);
                self.waiting = Some(HeldItems { next, end, until, waited_s: 0.0 });
                return Err(Otherwise::Jump(end));
            }
            Action::ChangeSpeed { .. }
            | Action::LandStart
            | Action::Nothing
            | Action::Pass
            | Action::SetHome { .. }
            | Action::EnableFence(_) => {
                self.act(self.current, demand, tick);
                return Err(Otherwise::AtOnce);
            }
            Action::ChangeAltitude { altitude_m } => {
                // The limits may have changed since the plan was checked.
                demand.altitude_m = rules.nearest_altitude_m(altitude_m);
                return Ok(Task::Climb(tick.situation.course_rad()));
            }
            Action::Jump { to, times } => return Err(self.jump(to, times)),
            Action::Return => return Err(Otherwise::Home),
        };
        self.slow_for_landing(rules, true, demand);
        Ok(Task::Loiter(self.circle(&circle, until, demand, tick)))
    }

    /// Does what an item without a place does.
    fn act(&mut self, number: u16, demand: &mut Demand, tick: &mut Tick) {
        let at = usize::from(number);
        match self.plan.items.get(at).map(|item| item.action) {
            Some(Action::ChangeSpeed { airspeed }) => {
                // The check of the plan did not know the altitude.
                let rules = tick.situation.rules;
                demand.airspeed_m_s = rules.nearest_airspeed_m_s(airspeed, demand.altitude_m);
            }
            Some(Action::SetHome { place }) => {
                let place = place.unwrap_or(tick.situation.place);
                *tick.home = Some(Site::at(place));
                (tick.publish)(VehicleEvent::Home(place));
            }
            Some(Action::EnableFence(enabled)) => tick.fence.is_off = !enabled,
            Some(Action::Pass) => {
                if let Some(times @ 0) = self.jumped.get_mut(at) {
                    *times = 1;
                    (tick.publish)(VehicleEvent::ItemPassed(number));
                }
            }
            _ => {}
        }
    }

    /// Begins the items whose condition has come true.
    fn run_waiting(&mut self, demand: &mut Demand, tick: &mut Tick) {
        let Some(mut waiting) = self.waiting else { return };
        waiting.waited_s += tick.situation.dt_s;
        let target = self.flown.and_then(|flown| flown.target);
        let is_over = match waiting.until {
            WaitCondition::Seconds(seconds) => waiting.waited_s >= seconds,
            WaitCondition::Within(metres) => {
                target.is_some_and(|target| target.distance_m <= metres)
            }
        };
        self.waiting = Some(waiting).filter(|_| !is_over);
        for number in waiting.next..if is_over { waiting.end } else { waiting.next } {
            let item = self.plan.items.get(usize::from(number));
            if let Some(Action::Wait(until)) = item.map(|item| item.action) {
                let next = number.saturating_add(1);
                self.waiting = Some(HeldItems { next, until, waited_s: 0.0, ..waiting });
                return;
            }
            self.act(number, demand, tick);
        }
    }

    fn leg(
        &mut self,
        point: &Point,
        acceptance_m: Option<f64>,
        demand: &Demand,
        tick: &Tick,
    ) -> Leg {
        let here = tick.situation.horizon().site;
        let to = point.place.map_or(here, Site::at);
        let length_m = tick.situation.horizon().offset(&to).norm();
        let ramp = point.altitude_m.map(|end| Ramp::new(demand.altitude_m, end, length_m));
        let from = self.previous.unwrap_or(here);
        let jumped_back = core::mem::take(&mut self.jumped_back);
        let phase = if jumped_back { LegPhase::Revisit } else { LegPhase::ToWaypoint };
        Leg { from, to, acceptance_m, next: self.next_point(*tick.home), ramp, phase }
    }

    fn circle(&self, circle: &Circle, until: Until, demand: &mut Demand, tick: &Tick) -> Loiter {
        let situation = tick.situation;
        let orbit = Orbit::of(circle, situation, demand);
        let length_m = situation.horizon().offset(&orbit.centre).norm();
        let altitude_m = circle.centre.altitude_m;
        let mut ramp = None;
        match altitude_m {
            // The purpose of the item is the climb: it begins at once.
            Some(end) if until == Until::Altitude => {
                demand.altitude_m = situation.rules.nearest_altitude_m(end);
            }
            end => ramp = end.map(|end| Ramp::new(demand.altitude_m, end, length_m)),
        }
        Loiter {
            orbit,
            until,
            next: self.next_point(*tick.home),
            ramp,
            altitude_m,
            resumed: false,
            on_circle: false,
            reached: false,
            around_rad: 0.0,
            bearing: None,
            turned_rad: 0.0,
            held_s: 0.0,
            leaving_rad: None,
        }
    }

    /// Target of a jump, which it counts. A jump back may have to wait.
    fn jump(&mut self, to: u16, times: Option<u16>) -> Otherwise {
        let onwards = Otherwise::Jump(self.current.saturating_add(1));
        let jumped = self.jumped.get_mut(usize::from(self.current));
        let left = |jumped: &&mut u16| times.is_none_or(|times| **jumped < times);
        let Some(jumped) = jumped.filter(left) else { return onwards };
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

    /// The item that is flown after this one, with its number, if there is one and this one continues by itself.
    fn next_action(&self, number: u16) -> Option<(u16, Action)> {
        let current = self.plan.items.get(usize::from(number))?;
        if !current.autocontinue {
            return None;
        }
        let mut at = number.saturating_add(1);
        for _ in 0..STEPS_MAX {
            let item = self.plan.items.get(usize::from(at))?;
            match item.action {
                action if action.is_immediate() && item.autocontinue => at = at.saturating_add(1),
                Action::Jump { to, times } => {
                    let jumped = self.jumped.get(usize::from(at)).copied().unwrap_or(0);
                    let leads_on = times.is_none_or(|times| jumped < times);
                    at = if leads_on { to } else { at.saturating_add(1) };
                }
                action => return Some((at, action)),
            }
        }
        None
    }

    /// The point that the aircraft flies to after the current item.
    fn next_point(&self, home: Option<Site>) -> Option<Site> {
        match self.next_action(self.current)? {
            (_, Action::Return) => home,
            (_, action) => action.place().map(Site::at),
        }
    }

    /// On the way to where a landing begins the aircraft becomes as slow as the approach; a circle may have one more point behind
    /// it.
    fn slow_for_landing(&self, rules: &Rules, is_circle: bool, demand: &mut Demand) {
        let mut next = self.next_action(self.current);
        if let (true, Some((number, Action::Waypoint { .. }))) = (is_circle, next) {
            next = self.next_action(number);
        }
        if matches!(next, Some((_, Action::Land { .. }))) {
            demand.airspeed_m_s = rules.approach_m_s(demand.altitude_m);
        }
    }
}

/// The bisector of an almost reversed course has no direction; below this length it is ignored.
const BISECTOR_MIN: f64 = 0.2;

/// To return to a point the aircraft flies this many turn radii away from it: it must turn around and find
/// the line to the point again.
const AWAY_RADII: f64 = 4.0;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Leg {
    from: Site,
    to: Site,
    /// Acceptance radius of the item, m.
    acceptance_m: Option<f64>,
    /// Continuation of the path.
    next: Option<Site>,
    ramp: Option<Ramp>,
    /// Part of the leg being flown.
    phase: LegPhase,
}

/// Part of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
enum LegPhase {
    ToWaypoint,
    /// The same in the first tick after a jump back: a waypoint that is reached already is flown to again.
    Revisit,
    /// First away from the waypoint, on a course in rad.
    Away(f64),
}

/// An altitude that changes linearly with the distance, reached where the leg ends.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ramp {
    from_m: f64,
    to_m: f64,
    length_m: f64,
    /// The largest fraction of the way so far: the reference never goes back.
    share: f64,
}

impl Ramp {
    /// From one altitude to another over this length, m.
    fn new(from_m: f64, to_m: f64, length_m: f64) -> Self {
        Self { from_m, to_m, length_m, share: 0.0 }
    }

    /// Altitude with this distance left, m; it is complete when `early_m` is left.
    fn altitude_m(&mut self, left_m: f64, early_m: f64) -> f64 {
        let length_m = self.length_m - early_m;
        // A leg that is shorter than its early end leaves no way to climb on.
        let share = if length_m > 1.0 { 1.0 - (left_m - early_m) / length_m } else { 1.0 };
        self.share = self.share.max(share).min(1.0);
        self.from_m + self.share * (self.to_m - self.from_m)
    }
}

/// The leg as seen from the aircraft.
struct MissionView {
    from: Horizontal,
    to: Horizontal,
    along: Horizontal,
    /// Along the next one, and its length, m.
    onwards: Option<(Horizontal, f64)>,
    length_m: f64,
}

impl MissionView {
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

    /// How far before the point the turn into the next leg begins, m.
    fn anticipation_m(&self, situation: &Situation) -> f64 {
        let Some((onwards, next_m)) = self.onwards else { return 0.0 };
        let turn_rad = turn_rad(&self.along, &onwards);
        let lead_m = situation.rules.turn_lead_m(turn_rad, situation.speed_m_s);
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
    fn fly(&mut self, situation: &Situation, demand: &mut Demand) -> Option<Flown> {
        let (rules, guidance) = (situation.rules, situation.rules.guidance());
        let mut view = MissionView::new(self, situation);
        let wide = || rules.navigation.acceptance_m.max(view.anticipation_m(situation));
        let acceptance_m = self.acceptance_m.unwrap_or_else(wide);
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
        let target = Some(target(&self.to, &view.to, demand.altitude_m, None));
        if let LegPhase::Away(course_rad) = self.phase {
            let turn_m = AWAY_RADII * planned_radius_m(situation.speed_m_s, &guidance);
            if distance_m < acceptance_m + turn_m {
                return Some(Flown { target, ..situation.hold_course(course_rad) });
            }
            self.phase = LegPhase::ToWaypoint;
            // The line back to the point begins here.
            self.from = situation.horizon().site;
            view = MissionView::new(self, situation);
        } else if is_reached {
            // The rest of the ramp: a waypoint may be passed outside of its acceptance radius.
            if let Some(ramp) = &self.ramp {
                demand.altitude_m = rules.nearest_altitude_m(ramp.to_m);
            }
            return None;
        }
        let steering = follow_line(&view.from, &view.to, &situation.velocity, &guidance);
        Some(Flown { steering, target })
    }
}

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
enum Until {
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
struct Loiter {
    orbit: Orbit,
    /// Condition that completes it.
    until: Until,
    /// Continuation of the path.
    next: Option<Site>,
    /// Altitude on the way to the circle.
    ramp: Option<Ramp>,
    /// Altitude of the circle, m, commanded again after a pause.
    altitude_m: Option<f64>,
    resumed: bool,
    /// The aircraft is or was on the circle since the item began or was resumed.
    on_circle: bool,
    /// It was on it before.
    reached: bool,
    /// Angle flown around the centre since the item began or was resumed, rad.
    around_rad: f64,
    bearing: Option<f64>,
    turned_rad: f64,
    held_s: f64,
    /// Angle turned since its altitude and radius were reached, rad.
    leaving_rad: Option<f64>,
}

impl Loiter {
    /// One tick; `None` when it is done, and the next point is ahead.
    fn fly(&mut self, situation: &Situation, demand: &mut Demand) -> Option<Flown> {
        let rules = situation.rules;
        let offset = situation.horizon().offset(&self.orbit.centre);
        let radius_m = self.orbit.flown_radius_m(situation, demand);
        if core::mem::take(&mut self.resumed)
            && let Some(altitude_m) = self.altitude_m
        {
            demand.altitude_m = rules.nearest_altitude_m(altitude_m);
        }
        if let Some(ramp) = &mut self.ramp {
            let altitude_m = ramp.altitude_m(offset.norm(), radius_m);
            demand.altitude_m = rules.nearest_altitude_m(altitude_m);
        }
        let flown = self.orbit.fly(situation, demand);
        let change_rad = self.change_rad(&offset);
        self.around_rad += change_rad;
        // After a turn around its centre this is as near as the aircraft comes, with a fault or in strong wind.
        self.on_circle =
            self.on_circle || self.around_rad >= TAU || self.is_on(&offset, radius_m, situation);
        if !self.on_circle {
            return Some(flown);
        }
        // Only once, so that a later altitude of the operator holds.
        if let Some(ramp) = self.ramp.take() {
            demand.altitude_m = rules.nearest_altitude_m(ramp.to_m);
        }
        // It counts from the tick behind the one that reaches the circle.
        let turned_rad = if self.reached { change_rad } else { 0.0 };
        self.turned_rad += turned_rad;
        self.held_s += situation.dt_s;
        self.reached = true;
        let is_done = match self.until {
            Until::ForGood => false,
            Until::Turned(angle) => self.turned_rad >= angle,
            Until::Held(seconds) => self.held_s >= seconds,
            Until::Altitude => {
                (situation.altitude_m - demand.altitude_m).abs() < rules.altitude_reached_m()
            }
        };
        let is_left = is_done && self.is_left(turned_rad, &offset, radius_m, situation);
        (!is_left).then_some(flown)
    }

    fn is_on(&self, offset: &Horizontal, radius_m: f64, situation: &Situation) -> bool {
        let r = offset.norm();
        let near = situation.rules.navigation.acceptance_m.max(ON_CIRCLE_SHARE * radius_m);
        // Positive for a track that has the centre to its right.
        let around = situation.velocity.x * offset.y - situation.velocity.y * offset.x;
        let around = if self.orbit.clockwise { around } else { -around };
        (r - radius_m).abs() <= near && around >= ON_CIRCLE_COS * r * situation.speed_m_s
    }

    /// Angle around the centre in this tick, rad.
    fn change_rad(&mut self, offset: &Horizontal) -> f64 {
        let bearing = libm::atan2(offset.y, offset.x);
        let before = self.bearing.replace(bearing).unwrap_or(bearing);
        let change = libm::remainder(bearing - before, TAU);
        if self.orbit.clockwise { change } else { -change }
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
