//! Which control steps get rows in a log: 50 each second, and all of them around events.
//!
//! ```text
//! entries ──> [ the last half second, in order ] ──> rows of every n-th step, and of all steps that are near an event
//! ```
//!
//! An entry is written half a second of simulation time after it came, so that an event can still select the steps before it.
//! Entries of all kinds are written in the order in which they came; only rows of control steps are ever left out.

use std::collections::VecDeque;
use std::time::Duration;

use icd::SimTime;
use icd::fault::{PlantAction, Target};

use super::entry::is_stream;
use super::{Entry, Recorded, Step};
use flight_management::command::{Command, Configuration};
use flight_management::event::{Axis, EventKind};
use flight_management::fault_list::FaultList;
use flight_management::vehicle::{Mode, VehicleEvent};

/// Selection of the control steps that get rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum LogRate {
    /// 50 each second, and all of them from half a second before to two seconds after each event
    #[default]
    Events,
    /// All of them
    Full,
}

/// Before an event all steps of this time get rows, us of simulation time: half a second, and some steps in which the plant
/// has a fault and has not reported it yet.
pub const BEFORE_US: u64 = 510_000;
/// After an event all steps of this time get rows.
pub const AFTER: Duration = Duration::from_secs(2);
/// Away from events, the longest time between two rows, us.
const EVERY_US: u32 = 20_000;
/// Entries that wait: the steps of half a second at the shortest period, and as many entries of other kinds. If there are
/// more, the oldest are written early, with their rows.
const WAITING_MAX: usize = 1_024;
/// Events of one kind within [`RECURRING`] around which all steps get rows; so an event that recurs without end
/// (an intermittent fault) does not fill the disk.
const RECURRING_MAX: usize = 5;
/// Simulation time over which [`RECURRING_MAX`] counts.
const RECURRING: Duration = Duration::from_secs(60);
/// Changes of a reference in one step that count as an event: altitude, m; roll, rad; airspeed, m/s.
const REFERENCE_STEPS: [f64; 3] = [1.0, 0.017_453_292_519_943_295, 0.5];

impl LogRate {
    /// Interval of rows away from events, control steps.
    pub fn row_every(self, period_us: u32) -> u32 {
        match self {
            Self::Full => 1,
            Self::Events => (EVERY_US / period_us.max(1)).max(1),
        }
    }
}

/// Kinds of events that are counted separately.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cause {
    /// A fault of this target begins, pauses or ends.
    Fault(Target),
    /// The compensator wakes or sleeps.
    Compensator,
    /// An axis has no authority left, or has regained some.
    Authority(Axis),
    /// A change of mode.
    Mode,
    /// A reference jumps.
    Reference,
    /// A command of an operator or a script.
    Input,
    /// The flight is terminated, the aircraft touches the ground, a link is lost or restored.
    Flight,
}

impl Cause {
    const COUNT: usize = Target::MAX + 8;

    const fn index(self) -> usize {
        const NEXT: usize = Target::MAX;
        match self {
            Self::Fault(target) => target.slot(),
            Self::Compensator => NEXT,
            Self::Authority(Axis::Roll) => NEXT + 1,
            Self::Authority(Axis::Pitch) => NEXT + 2,
            Self::Authority(Axis::Yaw) => NEXT + 3,
            Self::Mode => NEXT + 4,
            Self::Reference => NEXT + 5,
            Self::Input => NEXT + 6,
            Self::Flight => NEXT + 7,
        }
    }

    const fn of_event(kind: &EventKind) -> Option<Self> {
        match kind {
            EventKind::AuthorityExhausted { axis, .. } | EventKind::AuthorityRestored(axis) => {
                Some(Self::Authority(*axis))
            }
            EventKind::CompensatorActive { .. } => Some(Self::Compensator),
            EventKind::GroundContact
            | EventKind::PlantLost
            | EventKind::PlantBack
            | EventKind::Vehicle(VehicleEvent::Terminated)
            | EventKind::Vehicle(VehicleEvent::LinkLost(_))
            | EventKind::Vehicle(VehicleEvent::LinkBack(_)) => Some(Self::Flight),
            _ => None,
        }
    }

    /// Streams are not events, and neither are commands without an effect on the flight.
    fn of_input(what: &Recorded) -> Option<Self> {
        match what {
            Recorded::Intent(intent) => match &intent.command {
                Command::Plant(PlantAction::ListFaults)
                | Command::Plant(PlantAction::Pace(_))
                | Command::Configuration(Configuration::FaultInjection(_)) => None,
                command => (!is_stream(command)).then_some(Self::Input),
            },
            Recorded::PlantLost | Recorded::PlantBack => Some(Self::Flight),
            Recorded::Request(_) => None,
        }
    }
}

/// State of a step that reveals a change in the next one: compensator active, mode, terminated, references.
type Seen = (bool, Mode, bool, [f64; 3]);

/// The latest events of one cause.
#[derive(Debug, Clone, Copy, Default)]
struct Recent {
    /// Their times, the latest one at `next - 1`.
    at: [Option<SimTime>; RECURRING_MAX],
    next: usize,
}

impl Recent {
    /// Whether an event at this time gets all its rows; one within the rows of the last one needs none of its own.
    fn admits(&mut self, time: SimTime) -> bool {
        let since =
            |at: SimTime| Duration::from_micros(time.as_micros().saturating_sub(at.as_micros()));
        let last = self.at[(self.next + RECURRING_MAX - 1) % RECURRING_MAX];
        if last.is_some_and(|last| since(last) < AFTER)
            || self.at[self.next].is_some_and(|oldest| since(oldest) < RECURRING)
        {
            return false;
        }
        self.at[self.next] = Some(time);
        self.next = (self.next + 1) % RECURRING_MAX;
        true
    }
}

/// Waiting entries, and the state that decides about their rows.
#[derive(Debug)]
pub struct Selection {
    rate: LogRate,
    every: u64,
    waiting: VecDeque<Entry>,
    /// Time of the latest control step.
    newest: SimTime,
    /// Steps up to here get their rows.
    full_until: SimTime,
    /// Control steps that have been passed on.
    left: u64,
    seen: Option<Seen>,
    faults: FaultList,
    recent: [Recent; Cause::COUNT],
    /// Everything that waits is passed on with its rows.
    settles: bool,
}

impl Selection {
    /// For a flight that begins at this time; its first two seconds get all rows.
    pub fn new(rate: LogRate, period_us: u32, begin: SimTime) -> Self {
        let room = if rate == LogRate::Full { 1 } else { WAITING_MAX };
        Self {
            rate,
            every: rate.row_every(period_us).into(),
            waiting: VecDeque::with_capacity(room),
            newest: begin,
            full_until: after(begin),
            left: 0,
            seen: None,
            faults: FaultList::default(),
            recent: [Recent::default(); Cause::COUNT],
            settles: false,
        }
    }

    /// Adds the next entry.
    pub fn push(&mut self, entry: Entry) {
        self.settles = false;
        if self.rate == LogRate::Events {
            self.look_at(&entry);
        }
        self.waiting.push_back(entry);
    }

    /// The next entry to write, and whether its rows are written.
    pub fn pop(&mut self) -> Option<(Entry, bool)> {
        let is_early = self.settles || self.waiting.len() >= WAITING_MAX;
        let mut has_rows = true;
        if let Entry::Step(step) = self.waiting.front()? {
            let age_us = self.newest.as_micros().saturating_sub(step.time.as_micros());
            let is_full = step.time <= self.full_until;
            // A step whose rows are written whatever happens next does not wait: so a process that is killed in its first second
            // leaves a log.
            if self.rate == LogRate::Events && age_us < BEFORE_US && !is_early && !is_full {
                return None;
            }
            has_rows = is_early || is_full || self.left.is_multiple_of(self.every);
            self.left += 1;
        }
        Some((self.waiting.pop_front()?, has_rows))
    }

    /// Marks all waiting entries for the next calls of [`Selection::pop`], with their rows: the simulation is paused, or the
    /// flight is over.
    pub fn settle(&mut self) {
        self.settles = true;
    }

    fn look_at(&mut self, entry: &Entry) {
        match entry {
            Entry::Step(step) => {
                self.newest = step.time;
                let Step { mode, terminated, references, .. } = *step;
                let active = step.log.compensator_active;
                let seen = self.seen.replace((active, mode, terminated, references));
                let Some((was_active, mode_before, was_terminated, before)) = seen else { return };
                let steps = before.iter().zip(&references).zip(REFERENCE_STEPS);
                let jumps = steps.into_iter().any(|((before, now), by)| (now - before).abs() >= by);
                for (cause, has_changed) in [
                    (Cause::Compensator, was_active != active),
                    (Cause::Mode, mode_before != mode),
                    (Cause::Flight, was_terminated != terminated),
                    (Cause::Reference, jumps),
                ] {
                    if has_changed {
                        self.happens(cause, step.time);
                    }
                }
            }
            Entry::Fault { time, entry } => {
                // Repeated reports of the plant's list are not events.
                if self.faults.handle_event(&EventKind::Fault(*entry)) {
                    self.happens(Cause::Fault(entry.target), *time);
                }
            }
            other => {
                let cause = match other {
                    Entry::Event(event) => Cause::of_event(&event.kind).zip(Some(event.time)),
                    Entry::Recorded { time, what, .. } => Cause::of_input(what).zip(Some(*time)),
                    Entry::Ground { time, .. } => Some((Cause::Flight, *time)),
                    _ => None,
                };
                if let Some((cause, time)) = cause {
                    self.happens(cause, time);
                }
            }
        }
    }

    fn happens(&mut self, cause: Cause, time: SimTime) {
        if self.recent[cause.index()].admits(time) {
            self.full_until = self.full_until.max(after(time));
        }
    }
}

/// The end of an event's rows.
fn after(time: SimTime) -> SimTime {
    let after = u64::try_from(AFTER.as_micros()).unwrap_or(u64::MAX);
    SimTime::from_micros(time.as_micros().saturating_add(after))
}

#[cfg(test)]
mod tests;
