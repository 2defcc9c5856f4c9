//! The plant's list of faults as text, and when to request it from the plant: where reports can have been missed (the
//! autopilot joins a flight, the plant comes back after a silence, or events were lost).

use icd::EffectorList;
use icd::fault::{FaultEntry, PlantAction};

use crate::wall_time::WallTime;
use crate::{Service, Shared, failure};
use flight_management::command::Outcome;
use flight_management::event::EventKind;
use flight_management::fault_list::FaultList;

/// The faults as text, one line for each: `Fault 3: servo 5 (rudder) stuck at 7.0 deg, since 12.000000 s`.
pub fn lines(list: &FaultList, effectors: &EffectorList) -> impl Iterator<Item = String> {
    list.entries().iter().map(|entry| {
        let FaultEntry { id, target, kind, timing, state } = entry;
        let (unit, instance) = failure::unit_and_instance(*target, effectors);
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

    /// Requests it as soon as there is room for the intent.
    fn poll(&mut self, _: WallTime, shared: &mut Shared) {
        if self.needs_list && self.open.is_none() {
            self.open = shared.intents.push(PlantAction::ListFaults);
            self.needs_list = self.open.is_none();
        }
    }
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
