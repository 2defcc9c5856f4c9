//! Events of a flight as operators receive them, and their times.

use crate::flights;

use autopilot::event::{Axis, Event, EventKind, Limit};
use core::ops::ControlFlow;
use flights::{case_1, setup};
use icd::fault::{FaultEntry, FaultState};
use icd::{ControlPeriod, SimTime};
use lab_judges::closed_loop::{FlightSetup, watch};
use plant_sim::EarthModel;

/// The events of a flight, and the longest time without authority in roll.
fn fly(setup: &FlightSetup) -> (Vec<Event>, f64) {
    let (mut events, mut exhausted_s, mut longest_s) = (Vec::new(), 0.0, 0.0_f64);
    let end = watch(setup, |tick| {
        events.extend(tick.events);
        let is_exhausted = tick.log.authority.roll_pct < 1.0;
        let period_s = f64::from(ControlPeriod::DEFAULT.as_micros()) * 1.0e-6;
        exhausted_s = if is_exhausted { exhausted_s + period_s } else { 0.0 };
        longest_s = longest_s.max(exhausted_s);
        ControlFlow::Continue(())
    });
    let _ = end.expect("the shipped aircraft flies");
    (events, longest_s)
}

fn time_of(events: &[Event], is_it: impl Fn(&EventKind) -> bool) -> Option<SimTime> {
    events.iter().find(|event| is_it(&event.kind)).map(|event| event.time)
}

#[test]
fn healthy_banks_and_their_reversals_are_no_end_of_the_authority() {
    for bank_deg in [30, 45, 60] {
        let reference = |at_s: u32, roll_deg: i32| {
            format!("[[autopilot.reference]]\nat_s = {at_s}.0\nroll_deg = {roll_deg}.0\n")
        };
        let text = format!(
            "{}{}{}{}",
            scenarios::NOMINAL,
            reference(1, bank_deg),
            reference(11, -bank_deg),
            reference(21, bank_deg)
        );
        let mut setup = setup("reversal", &text, EarthModel::Wgs84);
        setup.duration = SimTime::from_micros(31_000_000);
        let (events, longest_s) = fly(&setup);
        println!("{bank_deg} deg: {longest_s:.3} s without authority");
        assert!(longest_s > 0.2, "the ailerons are at their limit for {longest_s:.3} s");
        let alarm = |kind: &EventKind| {
            matches!(
                kind,
                EventKind::AuthorityExhausted { .. } | EventKind::CompensatorActive { .. }
            )
        };
        assert_eq!(time_of(&events, alarm), None, "{bank_deg} deg");
    }
}

#[test]
fn a_fault_is_reported_with_its_onset_and_before_its_consequences() {
    let setup = case_1(EarthModel::Wgs84);
    let (events, _) = fly(&setup);
    let injected = events.iter().find_map(|event| match event.kind {
        EventKind::Fault(FaultEntry { state: FaultState::Active { since }, .. }) => {
            Some((event.time, since))
        }
        _ => None,
    });
    let (reported, since) = injected.expect("case 1 has a fault");
    assert_eq!(reported, since, "the event has the time of the fault");
    assert_eq!(since, SimTime::from_micros(3_000_000), "as the scenario has it");
    let woke = time_of(&events, |kind| matches!(kind, EventKind::CompensatorActive { .. }));
    assert!(woke.is_some_and(|woke| woke > reported), "{woke:?} after {reported}");
    let (axis, by) = (Axis::Roll, Limit::Aileron);
    let exhausted = EventKind::AuthorityExhausted { axis, by };
    let gone = time_of(&events, |kind| *kind == exhausted);
    assert!(gone > woke, "case 1 takes all that the ailerons have: {gone:?}, {woke:?}");
}
