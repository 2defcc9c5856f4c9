//! When a tick is due by the wall clock, and whether one is due at all.
//!
//! ```text
//! requests (autopilot, parent process) ─> running or paused, speed, steps ─> when is the next tick due?
//!                                                └─> one report for each request
//! ```
//!
//! Nothing here reaches the plant: a flight has the same bits however often time was paused.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use icd::fault::PlantReport;
use icd::pace::Pace;
use icd::{ControlPeriod, SimTime};

use super::args::Speed;

/// A plant that is behind by more than this continues from now instead of catching up.
const BEHIND_MAX: Duration = Duration::from_millis(250);
/// Requests for steps that may wait for each other: twice the number that one autopilot may have open, so that all of its requests fit
/// besides those of the parent process, which can wait.
const STEPS_WAITING_MAX: usize = 64;
/// Of these, those of the parent process; as many reports may wait to be sent.
const ROOM: usize = STEPS_WAITING_MAX / 2;
/// Steps that are likely to need more wall time than this are confirmed when they begin: a ground station does not wait longer
/// for an answer.
const CONFIRMED_WITHIN: Duration = Duration::from_secs(1);
/// Assumed speed of a flight as fast as possible, to estimate how long steps will take. Real ones are faster.
const FACTOR_OF_MAX: f64 = 10.0;

/// A request for another pace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PaceRequest {
    /// Number of the request, if it came from the autopilot.
    pub(super) request: Option<u32>,
    pub(super) pace: Pace,
}

/// When the next tick is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Due {
    Now,
    /// After this wall time.
    In(Duration),
    Never,
}

/// Requested steps that are not all flown.
#[derive(Debug, Clone, Copy)]
struct Steps {
    request: Option<u32>,
    periods: u32,
    left: u32,
    confirmed: bool,
}

/// Determines by the wall clock when simulation time advances, or pauses it.
#[derive(Debug)]
pub(super) struct Pacer {
    period: ControlPeriod,
    speed: Speed,
    /// Time is paused unless there are steps to fly.
    paused: bool,
    steps: VecDeque<Steps>,
    /// The simulation time that was due at this instant; `None` since the pace changed.
    origin: Option<(Instant, SimTime)>,
    reports: VecDeque<PlantReport>,
    changed: bool,
}

impl Pacer {
    pub(super) fn new(period: ControlPeriod, speed: Speed, paused: bool) -> Self {
        Self {
            period,
            speed,
            paused,
            steps: VecDeque::new(),
            origin: None,
            reports: VecDeque::new(),
            changed: true,
        }
    }

    /// A flight begins. The pace is the operator's and stays; requests of the last flight have been answered.
    pub(super) fn begin_flight(&mut self) {
        self.origin = None;
        self.reports.clear();
        self.changed |= !self.steps.is_empty();
        self.steps.clear();
    }

    /// Executes a request; exactly one report answers it. `time` is now.
    pub(super) fn request(&mut self, request: PaceRequest, time: SimTime) {
        let PaceRequest { request, pace } = request;
        self.changed = true;
        match pace {
            Pace::Pause | Pace::Run => {
                self.paused = pace == Pace::Pause;
                self.interrupt(pace, time);
                self.origin = None;
                self.report(request, pace, time);
            }
            Pace::Step(periods) => self.request_steps(request, periods, time),
            Pace::Speed(factor) => {
                self.speed = Speed::Times(factor);
                self.origin = None;
                self.report(request, pace, time);
            }
        }
    }

    fn request_steps(&mut self, request: Option<u32>, periods: u32, time: SimTime) {
        if let Some(front) = self.steps.front().filter(|_| self.steps.len() >= STEPS_WAITING_MAX) {
            // Other steps are in progress, and these will not be flown.
            let pace = Pace::Step(front.periods);
            return self.report(request, pace, time);
        }
        if self.steps.is_empty() {
            self.origin = None;
        }
        self.paused = true;
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

    /// The flight has ended: the requested steps will not be flown.
    pub(super) fn end(&mut self, time: SimTime) {
        self.interrupt(Pace::Pause, time);
    }

    /// Reports the pace that replaced the open steps to all their senders.
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

    /// The next report to send.
    pub(super) fn pop_report(&mut self) -> Option<PlantReport> {
        self.reports.pop_front()
    }

    /// Whether reports wait to be sent.
    pub(super) fn has_reports(&self) -> bool {
        !self.reports.is_empty()
    }

    /// Whether there is room for a request of the parent process.
    pub(super) fn has_room(&self) -> bool {
        self.steps.len() < ROOM && self.reports.len() < ROOM
    }

    /// Whether time is paused, and the speed, if one of them has changed since the last call.
    pub(super) fn take_change(&mut self) -> Option<(bool, Speed)> {
        let is_paused = self.paused && self.steps.is_empty();
        std::mem::take(&mut self.changed).then_some((is_paused, self.speed))
    }

    /// When the tick at `next` is due. It is `time` now; the clock is read only if it matters.
    pub(super) fn due(
        &mut self,
        time: SimTime,
        next: SimTime,
        clock: impl FnOnce() -> Instant,
    ) -> Due {
        if self.paused && self.steps.is_empty() {
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
