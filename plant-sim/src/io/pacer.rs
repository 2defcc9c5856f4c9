//! When a tick is due by the wall clock, and whether one is due at all.
//!
//! ```text
//! requests (autopilot, parent process) ─> running or paused, speed, steps ─> when is the next tick due?
//!                                                └─> one report for each request
//! ```
//!
//! Nothing here reaches the plant: a flight has the same bits however often time was paused.
//!
//! The requests of the parent process come one per line (`pause`, `run`, `step 3`, `speed 0.5`); a line of JSON goes to it whenever the
//! pace changes.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::sync::mpsc::{Receiver, TrySendError, sync_channel};
use std::time::{Duration, Instant};

use host_io::problem::{Problem, problem};
use host_io::{Stop, console, process};
use icd::fault::PlantReport;
use icd::pace::Pace;
use icd::{ControlPeriod, SimTime};
use serde::{Deserialize, Serialize};
use tracing::warn;

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
            // So that the parent learns the pace of the start.
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
            Pace::Step(periods) => return self.request_steps(request, periods, time),
            Pace::Speed(factor) => self.speed = Speed::Times(factor),
            Pace::Pause | Pace::Run => {
                self.paused = pace == Pace::Pause;
                self.interrupt(pace, time);
            }
        }
        // What the old pace was behind by is not caught up.
        self.origin = None;
        self.report(request, pace, time);
    }

    fn request_steps(&mut self, request: Option<u32>, periods: u32, time: SimTime) {
        if let Some(front) = self.steps.front().filter(|_| self.steps.len() >= STEPS_WAITING_MAX) {
            // Other steps are in progress, and these will not be flown.
            let pace = Pace::Step(front.periods);
            return self.report(request, pace, time);
        }
        // After a pause they begin now; behind other steps they keep the rhythm.
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
            // Who was answered when the steps began learns here that they are flown.
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
        // As fast as possible needs no clock, whose reading would cost time in every tick.
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

/// Requests that wait until the plant reads them, at least 20 times a second.
const WAITING_MAX: usize = 64;

/// The parent process, if it takes part.
#[derive(Debug)]
pub(super) struct Parent {
    requests: Option<Receiver<Pace>>,
    /// Whether it reads the pace.
    reads: bool,
}

impl Parent {
    /// Reads its requests from now on; its end requests the end of the plant.
    pub(super) fn new(writes: bool, reads: bool, stop: &Stop) -> io::Result<Self> {
        let requests = writes.then(|| listen(stop.clone())).transpose()?;
        Ok(Self { requests, reads })
    }

    /// Sends its requests to the pacer, and prints a change of the pace. `time` is now.
    pub(super) fn update(&self, pacer: &mut Pacer, time: SimTime) {
        // What finds no room stays in the channel.
        if let Some(requests) = &self.requests {
            while pacer.has_room()
                && let Ok(pace) = requests.try_recv()
            {
                pacer.request(PaceRequest { request: None, pace }, time);
            }
        }
        if let Some((paused, speed)) = pacer.take_change()
            && self.reads
        {
            // A parent that no longer reads is about to close the input as well.
            let _ = PlantLine::pace(paused, speed, time).print();
        }
    }
}

fn listen(stop: Stop) -> io::Result<Receiver<Pace>> {
    let (sender, receiver) = sync_channel(WAITING_MAX);
    process::listen_to_parent(stop, move |line| match parse(line) {
        Ok(pace) => {
            // The other error is the end of the plant.
            if let Err(TrySendError::Full(pace)) = sender.try_send(pace) {
                warn!(?pace, "too many orders at once; this one is dropped");
            }
        }
        Err(error) => warn!("{error}"),
    })?;
    Ok(receiver)
}

fn parse(line: &str) -> Result<Pace, Problem> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (pace, (min, max)) = match words[..] {
        ["pause"] => return Ok(Pace::Pause),
        ["run"] => return Ok(Pace::Run),
        ["step"] => return Ok(Pace::Step(1)),
        ["step", periods] => {
            (periods.parse().ok().map(Pace::Step), (1.0, f64::from(Pace::STEPS_MAX)))
        }
        ["speed", factor] => (factor.parse().ok().map(Pace::Speed), Pace::SPEED),
        _ => {
            return Err(problem!("{line:?} is none of pause, run, step [PERIODS], speed FACTOR"));
        }
    };
    pace.filter(|pace| pace.is_valid())
        .ok_or_else(|| problem!("{line:?}: the number must be from {min} to {max}"))
}

/// One line about the pace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum PlantLine {
    /// How simulation time passes from here on.
    Pace {
        paused: bool,
        /// Speed while it runs, as a multiple of wall time; `None`: as fast as possible.
        speed: Option<f64>,
        /// Simulation time at which it stands or runs on, s.
        t_s: f64,
    },
}

impl PlantLine {
    pub(super) fn pace(paused: bool, speed: Speed, time: SimTime) -> Self {
        let speed = match speed {
            Speed::Max => None,
            Speed::Times(factor) => Some(factor),
        };
        Self::Pace { paused, speed, t_s: time.as_seconds() }
    }

    /// Writes it to the standard output.
    pub(super) fn print(&self) -> io::Result<()> {
        let mut out = console::out();
        writeln!(out, "{}", serde_json::to_string(self)?)?;
        out.flush()
    }
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod parent_tests {
    use super::*;

    #[test]
    fn a_line_is_a_word_and_a_number() {
        for (line, pace) in [
            ("pause", Pace::Pause),
            (" run ", Pace::Run),
            ("step", Pace::Step(1)),
            ("step 100000", Pace::Step(100_000)),
            ("speed  0.25", Pace::Speed(0.25)),
        ] {
            assert_eq!(parse(line), Ok(pace));
        }
    }

    #[test]
    fn another_line_is_refused_with_the_known_words_or_the_range() {
        for (line, words) in [
            ("", "none of pause, run"),
            ("halt", "\"halt\" is none of"),
            ("pause now", "none of"),
            ("step 0", "from 1 to 100000"),
            ("step -1", "from 1 to 100000"),
            ("step 1.5", "from 1 to 100000"),
            ("step 99999999999", "from 1 to 100000"),
            ("speed", "none of"),
            ("speed NaN", "from 0.01 to 1000"),
            ("speed 0", "from 0.01 to 1000"),
        ] {
            let error = parse(line).unwrap_err().to_string();
            assert!(error.contains(words), "{line:?}: {error}");
        }
    }

    #[test]
    fn a_line_has_its_kind_and_reads_back() {
        for (speed, text) in [
            (Speed::Max, r#"{"kind":"pace","paused":true,"speed":null,"t_s":0.5}"#),
            (Speed::Times(0.5), r#"{"kind":"pace","paused":true,"speed":0.5,"t_s":0.5}"#),
        ] {
            let line = PlantLine::pace(true, speed, SimTime::from_micros(500_000));
            assert_eq!(serde_json::to_string(&line).unwrap(), text);
            assert_eq!(serde_json::from_str::<PlantLine>(text).unwrap(), line);
        }
        let other = r#"{"kind":"flight","paused":true,"speed":0.5,"t_s":0.5}"#;
        assert!(serde_json::from_str::<PlantLine>(other).is_err());
    }
}
