//! Mission: the items of a plan, one after the other.

use std::sync::Arc;

use flight_control::Demand;
use flight_control::guidance::hold_course;

use super::VehicleRefusal;
use super::circle::{Flown, Orbit};
use super::geodesy::Site;
use super::plan::{Action, Item, Plan, Progress};
use super::report::Navigation;
use super::rules::Rules;
use super::situation::Situation;
use crate::vehicle::VehicleEvent;

mod begin;
mod leg;
mod loiter;

use begin::Otherwise;
use leg::Leg;
use loiter::{Circled, Loiter, Until};

/// Items that are begun in one tick, each with two events; further ones follow in the next tick.
const AT_ONCE_MAX: u32 = 4;
/// Shortest time between two jumps back, s: a loop that takes no time must not cause a flood of events.
const LOOP_MIN_S: f64 = 1.0;

/// The plan and its progress.
#[derive(Debug, Clone, Default)]
pub struct Mission {
    plan: Arc<Plan>,
    current: u16,
    progress: Progress,
    /// Number of jumps that each item has made.
    jumped: Vec<u16>,
    task: Option<Task>,
    /// The point that the aircraft has just passed: the next leg begins there.
    previous: Option<Site>,
    /// A jump has led back, and no item has been flown since.
    jumped_back: bool,
    /// Time until the next jump back, s.
    loop_wait_s: f64,
    /// The item flown last.
    flown: Option<Flown>,
}

/// The current item in flight.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Task {
    Leg(Leg),
    Loiter(Loiter),
    /// Straight on until the altitude is reached, on a course in rad.
    Climb(f64),
    /// Circles around the point, since the item does not continue by itself.
    Parked(Orbit),
}

/// Result of one tick of Mission.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Flight {
    Fly(Flown),
    /// The plan is complete: circle here.
    Complete(Orbit),
    /// The plan is complete: fly home.
    Home,
}

/// Input of a tick of Mission.
pub struct Tick<'a> {
    /// Position and motion of the aircraft.
    pub situation: &'a Situation,
    pub rules: &'a Rules,
    pub home: Option<Site>,
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
        self.flown = None;
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
            Some(Task::Loiter(loiter)) if loiter.is_begun() => loiter.resume(),
            Some(Task::Parked(_)) | None => {}
            Some(Task::Leg(_) | Task::Loiter(_) | Task::Climb(_)) => self.task = None,
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
        let progress = match self.progress {
            Progress::Complete => Progress::Paused,
            progress => progress,
        };
        self.rewind();
        self.current = item;
        self.progress = progress;
        Ok(())
    }

    /// The operator gave an altitude: it holds until the next item that sets one.
    pub fn release_altitude(&mut self) {
        match &mut self.task {
            Some(Task::Leg(leg)) => leg.ramp = None,
            Some(Task::Loiter(loiter)) => loiter.ramp = None,
            Some(Task::Climb(_) | Task::Parked(_)) | None => {}
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
        let plan = Arc::clone(&self.plan);
        self.loop_wait_s = (self.loop_wait_s - tick.situation.dt_s).max(0.0);
        for _ in 0..AT_ONCE_MAX {
            let Some(item) = plan.items.get(usize::from(self.current)) else {
                let around = self.last_circle(demand, tick);
                self.complete(tick);
                return Flight::Complete(around);
            };
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
        Flight::Fly(self.carry_on(tick))
    }

    /// Until the next item begins: continues as before, or straight on.
    fn carry_on(&mut self, tick: &Tick) -> Flown {
        let Tick { situation, rules, .. } = *tick;
        *self.flown.get_or_insert_with(|| Flown {
            steering: hold_course(situation.course_rad(), &situation.velocity, &rules.guidance()),
            target: None,
        })
    }

    fn complete(&mut self, tick: &mut Tick) {
        self.progress = Progress::Complete;
        self.current = self.plan.count().saturating_sub(1);
        self.task = None;
        (tick.publish)(VehicleEvent::PlanComplete);
    }

    /// Circles around the point where the last item has ended.
    fn last_circle(&self, demand: &Demand, tick: &Tick) -> Orbit {
        let last = self.plan.items.last().map(|item| item.action);
        let here = || Orbit::here(tick.situation, None, true, demand, tick.rules);
        match (last, self.previous) {
            (_, Some(centre)) => Orbit { centre, radius_m: None, clockwise: true },
            (
                Some(Action::LoiterTurns { circle, .. } | Action::LoiterTime { circle, .. }),
                None,
            )
            | (Some(Action::LoiterToAltitude(circle)), None) => {
                circle.centre.place.map_or_else(here, |place| Orbit {
                    centre: Site::at(place),
                    radius_m: circle.radius_m,
                    clockwise: circle.clockwise,
                })
            }
            _ => here(),
        }
    }

    /// One tick of a task; `None` when it is done.
    fn continue_task(
        &mut self,
        mut task: Task,
        demand: &mut Demand,
        tick: &mut Tick,
    ) -> Option<Flown> {
        let Tick { situation, rules, .. } = *tick;
        let flown = match &mut task {
            Task::Leg(leg) => leg.fly(situation, demand, rules),
            Task::Loiter(loiter) => match loiter.fly(situation, demand, rules) {
                Circled::On(flown) => Some(flown),
                Circled::Reached(flown) => {
                    if loiter.until == Until::ForGood {
                        (tick.publish)(VehicleEvent::ItemReached(self.current));
                    }
                    Some(flown)
                }
                Circled::Done => None,
            },
            Task::Climb(course_rad) => {
                let left = (situation.altitude_m - demand.altitude_m).abs();
                (left > rules.altitude_reached_m()).then(|| Flown {
                    steering: hold_course(*course_rad, &situation.velocity, &rules.guidance()),
                    target: None,
                })
            }
            Task::Parked(orbit) => Some(orbit.fly(situation, demand, rules)),
        };
        self.task = Some(task);
        flown
    }

    /// Ends the current item: begins the next one, or circles around the end of this one.
    fn finish(&mut self, item: &Item, task: Option<Task>, demand: &Demand, tick: &mut Tick) {
        (tick.publish)(VehicleEvent::ItemReached(self.current));
        let here = |rules| Orbit::here(tick.situation, None, true, demand, rules);
        let (previous, around) = match task {
            Some(Task::Leg(leg)) => {
                (Some(leg.to), Orbit { centre: leg.to, radius_m: None, clockwise: true })
            }
            Some(Task::Loiter(loiter)) => (None, loiter.orbit),
            // An item that is done at once does not end the leg before it.
            None => (self.previous, here(tick.rules)),
            Some(_) => (None, here(tick.rules)),
        };
        self.previous = previous;
        self.jumped_back &= task.is_none();
        if item.autocontinue {
            self.current = self.current.saturating_add(1);
            self.task = None;
        } else {
            self.task = Some(Task::Parked(around));
        }
    }
}
