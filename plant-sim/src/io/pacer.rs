//! When a tick is due by the wall clock, and whether one is due at all.
//!
//! ```text
//! orders (autopilot, parent process) ─> running or standing, speed, steps ─> when is the next tick due?
//!                                              └─> one report for each order
//! ```
//!
//! Nothing here reaches the plant: a flight has the same bits however often time stood still.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use icd::fault::PlantReport;
use icd::pace::Pace;
use icd::{ControlPeriod, SimTime};

use super::args::Speed;

/// A plant that is behind by more than this goes on from now instead of catching up in a sprint.
const BEHIND_MAX: Duration = Duration::from_millis(250);
/// Orders for steps that may wait for each other: twice what one autopilot may have open, so that all of its
/// requests fit beside those of somebody who can wait.
const STEPS_WAITING_MAX: usize = 64;
/// Of these, those of somebody who can wait; as many reports may wait to be heard.
const ROOM: usize = STEPS_WAITING_MAX / 2;
/// Steps that are likely to need more wall time than this are confirmed when they begin: somebody who asks
/// over MAVLink does not wait longer for an answer.
const CONFIRMED_WITHIN: Duration = Duration::from_secs(1);
/// Assumed of a flight as fast as possible, to tell how long steps will take. Real ones are faster.
const FACTOR_OF_MAX: f64 = 10.0;

/// Somebody wants time to pass in another way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Order {
    /// Number of the request, if it came from the autopilot.
    pub(super) request: Option<u32>,
    /// What.
    pub(super) pace: Pace,
}

/// When the next tick is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Due {
    /// Now.
    Now,
    /// After this wall time.
    In(Duration),
    /// Time stands still.
    Never,
}

/// Steps that were asked for and are not all flown.
#[derive(Debug, Clone, Copy)]
struct Steps {
    request: Option<u32>,
    periods: u32,
    left: u32,
    confirmed: bool,
}

/// Holds simulation time to the wall clock, or holds it still.
#[derive(Debug)]
pub(super) struct Pacer {
    period: ControlPeriod,
    speed: Speed,
    /// Time stands still unless there are steps to fly.
    standing: bool,
    steps: VecDeque<Steps>,
    /// This simulation time was due at this instant; `None` since the pace changed.
    origin: Option<(Instant, SimTime)>,
    reports: VecDeque<PlantReport>,
    changed: bool,
}

impl Pacer {
    pub(super) fn new(period: ControlPeriod, speed: Speed, standing: bool) -> Self {
        Self {
            period,
            speed,
            standing,
            steps: VecDeque::new(),
            origin: None,
            reports: VecDeque::new(),
            changed: true,
        }
    }

    /// A flight begins. How time passes is up to the operator and stays; who asked in the last flight has
    /// had its answer.
    pub(super) fn begin_flight(&mut self) {
        self.origin = None;
        self.reports.clear();
        self.changed |= !self.steps.is_empty();
        self.steps.clear();
    }

    /// Takes an order; exactly one report answers it. `time` is now.
    pub(super) fn order(&mut self, order: Order, time: SimTime) {
        let Order { request, pace } = order;
        self.changed = true;
        match pace {
            Pace::Pause | Pace::Run => {
                self.standing = pace == Pace::Pause;
                self.interrupt(pace, time);
                self.origin = None;
                self.report(request, pace, time);
            }
            Pace::Step(periods) => self.order_steps(request, periods, time),
            Pace::Speed(factor) => {
                self.speed = Speed::Times(factor);
                self.origin = None;
                self.report(request, pace, time);
            }
        }
    }

    fn order_steps(&mut self, request: Option<u32>, periods: u32, time: SimTime) {
        if let Some(front) = self.steps.front().filter(|_| self.steps.len() >= STEPS_WAITING_MAX) {
            // The truth: other steps are under way, and these will not be flown.
            let pace = Pace::Step(front.periods);
            return self.report(request, pace, time);
        }
        if self.steps.is_empty() {
            self.origin = None;
        }
        self.standing = true;
        let factor = match self.speed {
            Speed::Max => FACTOR_OF_MAX,
            Speed::Times(factor) => factor,
        };
        let waiting: u64 = self.steps.iter().map(|steps| u64::from(steps.left)).sum();
        let micros = (waiting + u64::from(periods)) * u64::from(self.period.as_micros());
        let confirmed = Duration::from_micros(micros).div_f64(factor) > CONFIRMED_WITHIN;
        if confirmed {
            self.report(request, Pace::Step(periods), time);
        }
        self.steps.push_back(Steps { request, periods, left: periods, confirmed });
    }

    /// Time has ended, at least for this flight: steps that were asked for will not be flown.
    pub(super) fn end(&mut self, time: SimTime) {
        self.interrupt(Pace::Pause, time);
    }

    /// Who waits for steps is told what came in between.
    fn interrupt(&mut self, pace: Pace, time: SimTime) {
        while let Some(steps) = self.steps.pop_front() {
            self.changed = true;
            if !steps.confirmed {
                self.report(steps.request, pace, time);
            }
        }
    }

    /// A control period has been flown, and it is `time` now.
    pub(super) fn advanced(&mut self, time: SimTime) {
        let Some(steps) = self.steps.front_mut() else { return };
        steps.left = steps.left.saturating_sub(1);
        if steps.left > 0 {
            return;
        }
        let Steps { request, periods, confirmed, .. } = *steps;
        self.steps.pop_front();
        self.changed |= self.steps.is_empty();
        match confirmed {
            false => self.report(request, Pace::Step(periods), time),
            true if self.steps.is_empty() => self.report(None, Pace::Pause, time),
            true => {}
        }
    }

    fn report(&mut self, request: Option<u32>, pace: Pace, at: SimTime) {
        self.reports.push_back(PlantReport::Paced { request, pace, at });
    }

    /// Next report that nobody has heard yet.
    pub(super) fn pop_report(&mut self) -> Option<PlantReport> {
        self.reports.pop_front()
    }

    /// Whether reports wait to be heard.
    pub(super) fn has_reports(&self) -> bool {
        !self.reports.is_empty()
    }

    /// Whether an order from somebody who can wait may be taken now.
    pub(super) fn has_room(&self) -> bool {
        self.steps.len() < ROOM && self.reports.len() < ROOM
    }

    /// Standing still, and speed, if one of them has changed since the last call.
    pub(super) fn take_change(&mut self) -> Option<(bool, Speed)> {
        let stands = self.standing && self.steps.is_empty();
        std::mem::take(&mut self.changed).then_some((stands, self.speed))
    }

    /// When the tick at `next` is due. It is `time` now; the clock is read only if it matters.
    pub(super) fn due(
        &mut self,
        time: SimTime,
        next: SimTime,
        clock: impl FnOnce() -> Instant,
    ) -> Due {
        if self.standing && self.steps.is_empty() {
            return Due::Never;
        }
        let Speed::Times(factor) = self.speed else { return Due::Now };
        let now = clock();
        let (origin, origin_time) = *self.origin.get_or_insert((now, time));
        let since_origin = Duration::from_micros(next.micros_since(origin_time));
        let due = origin + since_origin.div_f64(factor);
        if due > now {
            return Due::In(due - now);
        }
        if now - due > BEHIND_MAX {
            self.origin = Some((now, next));
        }
        Due::Now
    }
}

#[cfg(test)]
mod tests;
