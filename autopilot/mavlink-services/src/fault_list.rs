//! The plant's list of faults in words, and when to ask the plant for it: where reports can have been missed (the
//! autopilot joins a flight, the plant comes back after a silence, or events were lost).

use icd::EffectorList;
use icd::fault::FaultEntry;
use icd::fault::PlantAction;

use super::failure;
use super::intents::Intents;
use flight_management::command::Outcome;
use flight_management::event::EventKind;
use flight_management::fault_list::FaultList;

/// The faults in words, one line for each: `Fault 3: servo 5 (rudder) stuck at 7.0 deg, since 12.000000 s`.
pub fn lines(list: &FaultList, effectors: &EffectorList) -> impl Iterator<Item = String> {
    list.entries().iter().map(|entry| {
        let FaultEntry { id, target, kind, timing, state } = entry;
        let (unit, instance) = failure::unit_and_instance(*target, effectors);
        let kind = kind.described(target.class(effectors));
        let name = target.name(effectors);
        format!("Fault {id}: {unit} {instance} ({name}) {kind}{timing}, {state}")
    })
}

/// Asks the plant for its list where reports can have been missed.
#[derive(Debug, Default)]
pub struct ListRequest {
    is_wanted: bool,
    /// Number of the intent that is on its way.
    asked: Option<u32>,
}

impl ListRequest {
    /// Takes what happened.
    pub fn handle_event(&mut self, kind: &EventKind) {
        match *kind {
            EventKind::FlightBegan { joined_in_flight } => self.is_wanted = joined_in_flight,
            EventKind::PlantBack | EventKind::EventsLost(_) => self.is_wanted = true,
            EventKind::Outcome { number, outcome } if self.asked == Some(number) => {
                self.asked = None;
                // Without a flight there is nothing to list.
                self.is_wanted |= outcome == Outcome::NoAnswer;
            }
            _ => {}
        }
    }

    /// Asks, as soon as there is room.
    pub fn poll(&mut self, intents: &mut Intents) {
        if self.is_wanted && self.asked.is_none() {
            self.asked = intents.push(PlantAction::ListFaults);
            self.is_wanted = self.asked.is_none();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
    fn the_plant_is_asked_once_and_again_only_where_it_gave_no_answer() {
        let (mut request, mut intents) = (ListRequest::default(), Intents::default());
        request.poll(&mut intents);
        assert!(intents.is_empty());
        request.handle_event(&EventKind::FlightBegan { joined_in_flight: true });
        request.poll(&mut intents);
        request.poll(&mut intents);
        let number = intents.pop().unwrap().number;
        assert!(intents.is_empty(), "asked once");
        request.handle_event(&EventKind::Outcome { number, outcome: Outcome::NoAnswer });
        request.poll(&mut intents);
        let number = intents.pop().unwrap().number;
        request.handle_event(&EventKind::Outcome { number, outcome: Outcome::Done });
        request.poll(&mut intents);
        assert!(intents.is_empty());
    }
}
