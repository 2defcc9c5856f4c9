//! The list of faults: DEBUG_FLOAT_ARRAY `FAULTS`, once a second of wall time and soon after each change.
//!
//! It shares its number with `WHY` of the table, so requested intervals do not change it.

use core::time::Duration;

use ::mavlink::dialects::common::DEBUG_FLOAT_ARRAY_DATA;
use icd::EffectorList;
use icd::fault::{FaultEntry, FaultState, Repeat};

use crate::codec::Encoded;
use crate::failure::command::Unit;
use crate::wall_time::WallTime;
use crate::{Shared, convert, failure};
use flight_management::event::Snapshot;

/// Time between two lists.
const INTERVAL: Duration = Duration::from_secs(1);
/// The same while the list changes.
const SHORTEST: Duration = Duration::from_millis(100);
/// Identity of the array, beside its name.
pub const FAULTS_ID: u8 = 2;

/// When the list is sent next.
#[derive(Debug, Default)]
pub struct FaultStream {
    sent: WallTime,
    due: Option<WallTime>,
}

impl FaultStream {
    /// The list has changed.
    pub fn hurry(&mut self, now: WallTime) {
        let soon = now.max(self.sent + SHORTEST);
        self.due = Some(self.due.map_or(soon, |due| due.min(soon)));
    }

    /// Sends the list to every peer if it is due.
    pub fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        if shared.aircraft.snapshot().is_none() || shared.peers.all().next().is_none() {
            self.due = None;
            return;
        }
        if self.due.is_some_and(|due| now < due) {
            return;
        }
        (self.sent, self.due) = (now, Some(now + INTERVAL));
        for message in messages(shared) {
            shared.peers.stream(&message);
        }
    }

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        self.due
    }
}

/// One message for each fault, one with the count 0 if there is none; nothing without a flight.
/// docs/mavlink.md lists the content of `data`.
#[must_use]
pub fn messages(shared: &Shared) -> Vec<Encoded> {
    let Some(state) = shared.aircraft.snapshot() else { return Vec::new() };
    let entries = shared.aircraft.faults().entries();
    if entries.is_empty() {
        return vec![message(state, &[])];
    }
    let count = number(entries.len());
    let messages = (1..).zip(entries).map(|(index, entry)| {
        let mut numbers = vec![count, f64::from(index)];
        numbers.extend(numbers_of(entry, shared.effectors()));
        message(state, &numbers)
    });
    messages.collect()
}

fn numbers_of(entry: &FaultEntry, effectors: &EffectorList) -> [f64; 13] {
    let FaultEntry { id, target, kind, timing, state } = *entry;
    let step = match state {
        FaultState::Scheduled { .. } => 1.0,
        FaultState::Active { .. } => 2.0,
        FaultState::Resting { .. } => 3.0,
        FaultState::Ended { .. } | FaultState::Cancelled { .. } => 0.0,
    };
    let [value, second] = kind.values();
    let Repeat { every_s, times } = timing.repeat.unwrap_or(Repeat { every_s: 0.0, times: None });
    [
        f64::from(id),
        f64::from(Unit::of(target, effectors).code()),
        f64::from(failure::unit_and_instance(target, effectors).1),
        f64::from(kind.info().mavlink.failure_type.code()),
        f64::from(kind.code()),
        step,
        state.time().as_seconds(),
        value,
        second,
        timing.ramp_s,
        timing.duration_s.unwrap_or(0.0),
        every_s,
        f64::from(times.unwrap_or(0)),
    ]
}

fn number(count: usize) -> f64 {
    u32::try_from(count).map_or(f64::NAN, f64::from)
}

fn message(state: &Snapshot, numbers: &[f64]) -> Encoded {
    let mut data = [0.0; 58];
    for (place, value) in data.iter_mut().zip(numbers) {
        *place = convert::float(*value);
    }
    Encoded::new(&DEBUG_FLOAT_ARRAY_DATA {
        time_usec: state.time.as_micros(),
        array_id: u16::from(FAULTS_ID),
        name: "FAULTS".into(),
        data,
    })
}
