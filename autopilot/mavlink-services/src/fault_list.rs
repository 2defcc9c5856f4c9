//! The list of faults of the plant: as text, as DEBUG_FLOAT_ARRAY `FAULTS` once a second of wall time and soon after each
//! change, and when to request it from the plant: where reports can have been missed (the autopilot joins a flight, the
//! plant comes back after a silence, or events were lost).
//!
//! `FAULTS` shares its number with `WHY` of the table of telemetry, so requested intervals do not change it.

use core::time::Duration;

use ::mavlink::dialects::common::DEBUG_FLOAT_ARRAY_DATA;
use icd::EffectorList;
use icd::fault::{FaultEntry, PlantAction, Repeat};

use crate::codec::Encoded;
use crate::wall_time::WallTime;
use crate::{Service, Shared, convert};
use flight_management::command::Outcome;
use flight_management::event::{EventKind, Snapshot};
use flight_management::fault_list::FaultList;

/// The faults as text, one line for each: `Fault 3: servo 5 (rudder) stuck at 7.0 deg, since 12.000000 s`.
pub fn lines(list: &FaultList, effectors: &EffectorList) -> impl Iterator<Item = String> {
    list.entries().iter().map(|entry| {
        let FaultEntry { id, target, kind, timing, state } = entry;
        let ((_, unit), instance) = (target.unit(effectors), target.instance(effectors));
        let kind = kind.described(target.class(effectors));
        let name = target.name(effectors);
        format!("Fault {id}: {unit} {instance} ({name}) {kind}{timing}, {state}")
    })
}

/// Requests the list from the plant where reports can have been missed.
#[derive(Debug, Default)]
pub struct FaultListRequest {
    needs_list: bool,
    /// Number of the intent that is open.
    open: Option<u32>,
}

impl Service for FaultListRequest {
    fn handle_outcome(&mut self, number: u32, outcome: &Outcome, _: WallTime, _: &mut Shared) {
        if self.open == Some(number) {
            self.open = None;
            // Without a flight there is nothing to list.
            self.needs_list |= *outcome == Outcome::NoAnswer;
        }
    }

    fn handle_event(&mut self, event: &EventKind, _: WallTime, _: &mut Shared) {
        match *event {
            EventKind::FlightBegan { joined_in_flight } => self.needs_list = joined_in_flight,
            EventKind::PlantBack | EventKind::EventsLost(_) => self.needs_list = true,
            _ => {}
        }
    }

    /// Requests the list as soon as there is room for the intent.
    fn poll(&mut self, _: WallTime, shared: &mut Shared) {
        if self.needs_list && self.open.is_none() {
            self.open = shared.intents.push(PlantAction::ListFaults);
            self.needs_list = self.open.is_none();
        }
    }
}

/// Time between two lists.
const INTERVAL: Duration = Duration::from_secs(1);
/// The same while the list changes.
const SHORTEST: Duration = Duration::from_millis(100);
/// Identity of the array, beside its name.
pub const ARRAY_ID: u8 = 2;

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
            // So the first peer gets the list at once.
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

    /// When the service next has something to do.
    pub fn next_deadline(&self) -> Option<WallTime> {
        self.due
    }
}

/// One message for each fault, one with the count 0 if there is none; nothing without a flight.
/// docs/mavlink.md lists the content of `data`.
pub fn messages(shared: &Shared) -> Vec<Encoded> {
    let Some(state) = shared.aircraft.snapshot() else { return Vec::new() };
    let entries = shared.aircraft.faults().entries();
    let array = |numbers| float_array(state, ARRAY_ID.into(), "FAULTS", numbers);
    if entries.is_empty() {
        return vec![array(Vec::new())];
    }
    let count = u32::try_from(entries.len()).map_or(f64::NAN, f64::from);
    let messages = (1..).zip(entries).map(|(index, entry)| {
        let mut numbers = vec![count, f64::from(index)];
        numbers.extend(numbers_of(entry, shared.effectors()));
        array(numbers)
    });
    messages.collect()
}

fn numbers_of(entry: &FaultEntry, effectors: &EffectorList) -> [f64; 13] {
    let FaultEntry { id, target, kind, timing, state } = *entry;
    let [value, second] = kind.values();
    let Repeat { every_s, times } = timing.repeat.unwrap_or(Repeat { every_s: 0.0, times: None });
    [
        f64::from(id),
        f64::from(target.unit(effectors).0),
        f64::from(target.instance(effectors)),
        f64::from(kind.info().mavlink.failure_type.code()),
        f64::from(kind.code()),
        f64::from(state.code()),
        state.time().as_seconds(),
        value,
        second,
        timing.ramp_s,
        timing.duration_s.unwrap_or(0.0),
        every_s,
        f64::from(times.unwrap_or(0)),
    ]
}

/// DEBUG_FLOAT_ARRAY; numbers beyond its length are left out.
pub fn float_array(
    state: &Snapshot,
    array_id: u16,
    name: &str,
    numbers: impl IntoIterator<Item = f64>,
) -> Encoded {
    let mut data = [0.0; 58];
    for (place, value) in data.iter_mut().zip(numbers) {
        *place = convert::float(value);
    }
    let (time_usec, name) = (state.time.as_micros(), name.into());
    Encoded::new(&DEBUG_FLOAT_ARRAY_DATA { time_usec, array_id, name, data })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::world::World;
    use icd::SimTime;
    use icd::fault::{FaultKind, FaultState, Timing};
    use icd::tvc_jet;

    fn entry(id: u32, state: FaultState) -> EventKind {
        EventKind::Fault(FaultEntry {
            id,
            target: tvc_jet::RUDDER.into(),
            kind: FaultKind::StuckHere,
            timing: Timing::at(SimTime::from_micros(1_000_000)),
            state,
        })
    }

    fn at(seconds: u64) -> SimTime {
        SimTime::from_micros(seconds * 1_000_000)
    }

    #[test]
    fn a_line_names_the_fault_its_effector_and_since_when_it_acts() {
        let mut list = FaultList::default();
        assert!(list.handle_event(&entry(2, FaultState::Scheduled { at: at(5) })));
        assert!(list.handle_event(&entry(1, FaultState::Active { since: at(1) })));
        let lines: Vec<_> = lines(&list, &tvc_jet::effectors()).collect();
        assert_eq!(
            lines,
            [
                "Fault 1: servo 5 (rudder) stuck, since 1.000000 s",
                "Fault 2: servo 5 (rudder) stuck, from 5.000000 s on"
            ]
        );
    }

    #[test]
    fn the_list_is_requested_once_and_again_only_after_a_request_without_answer() {
        let mut shared = World::waiting().ground.shared;
        let now = WallTime::ZERO;
        let mut request = FaultListRequest::default();
        request.poll(now, &mut shared);
        assert!(shared.intents.is_empty());
        request.handle_event(&EventKind::FlightBegan { joined_in_flight: true }, now, &mut shared);
        request.poll(now, &mut shared);
        request.poll(now, &mut shared);
        let number = shared.intents.pop().unwrap().number;
        assert!(shared.intents.is_empty(), "requested once");
        request.handle_outcome(number, &Outcome::NoAnswer, now, &mut shared);
        request.poll(now, &mut shared);
        let number = shared.intents.pop().unwrap().number;
        request.handle_outcome(number, &Outcome::Done, now, &mut shared);
        request.poll(now, &mut shared);
        assert!(shared.intents.is_empty());
    }
}
