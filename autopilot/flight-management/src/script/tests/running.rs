use std::sync::Arc;

use super::script;
use crate::script::{Action, Due, Run};
use flight_control::NavigationState;
use icd::frames::EulerAngles;
use icd::{ControlPeriod, SimTime};

fn rolled(roll_deg: f64) -> NavigationState {
    let attitude = EulerAngles { phi: roll_deg.to_radians(), theta: 0.0, psi: 0.0 };
    NavigationState { attitude, altitude_m: 5_000.0, ..NavigationState::at_rest() }
}

/// Ticks of 2 ms: those at which each line was executed, by its number.
fn executed(text: &str, flight: &[NavigationState]) -> Vec<(usize, u16)> {
    let mut run = Run::new(Arc::new(script(text)));
    let mut time = SimTime::from_micros(10_000_000);
    let mut all = Vec::new();
    for (tick, state) in flight.iter().enumerate() {
        let state = NavigationState { time, ..*state };
        while let Some(Due { line, .. }) = run.next(&state, true) {
            all.push((tick, line));
        }
        time = time + ControlPeriod::DEFAULT;
    }
    all
}

fn level(ticks: usize) -> Vec<NavigationState> {
    vec![rolled(0.0); ticks]
}

fn rolls(degrees: &[f64]) -> Vec<NavigationState> {
    degrees.iter().map(|roll| rolled(*roll)).collect()
}

#[test]
fn lines_run_one_after_the_other_from_the_start_of_the_script() {
    let text = "say 1\nat 4 ms: say 2\nafter 6 ms: say 3\nsay 4\nafter 2 ms: say 5\n";
    assert_eq!(executed(text, &level(20)), [(0, 1), (2, 2), (5, 3), (5, 4), (6, 5)]);
}

#[test]
fn a_time_that_is_over_acts_at_once() {
    assert_eq!(executed("at 10 ms: say 1\nat 2 ms: say 2\n", &level(10)), [(5, 1), (5, 2)]);
}

#[test]
fn a_quantity_passes_a_value_in_either_direction_once() {
    let text = "when roll passes 10 deg: say 1\n";
    assert_eq!(executed(text, &rolls(&[0.0, 9.0, 11.0, 9.0, 11.0])), [(2, 1)]);
    assert_eq!(executed(text, &rolls(&[20.0, 11.0, 9.0, 11.0])), [(2, 1)]);
}

#[test]
fn a_quantity_beyond_the_value_already_does_not_pass_it() {
    let text = "when roll passes 10 deg: say 1\n";
    assert_eq!(executed(text, &rolls(&[20.0, 20.0, 30.0])), []);
    let above = "when roll rises above 10 deg: say 1\n";
    assert_eq!(executed(above, &rolls(&[20.0, 30.0, 15.0])), []);
    assert_eq!(executed(above, &rolls(&[20.0, 5.0, 15.0])), [(2, 1)]);
    let below = "when roll falls below 10 deg: say 1\n";
    assert_eq!(executed(below, &rolls(&[5.0, 15.0, 16.0, 9.0])), [(3, 1)]);
}

#[test]
fn a_crossing_counts_only_after_the_line_has_become_the_next_one() {
    let text = "at 8 ms: say 1\nwhen roll passes 10 deg: say 2\n";
    // Crossed at tick 1, before, and between the ticks 4 and 5, after.
    assert_eq!(executed(text, &rolls(&[0.0, 20.0, 20.0, 20.0, 20.0, 5.0])), [(4, 1), (5, 2)]);
    assert_eq!(executed(text, &rolls(&[0.0, 20.0, 20.0, 20.0, 20.0, 25.0])), [(4, 1)]);
}

#[test]
fn standing_on_the_value_is_not_passing_it_and_leaving_it_upwards_is_rising() {
    let altitudes = |metres: &[f64]| {
        metres.iter().map(|m| NavigationState { altitude_m: *m, ..rolled(0.0) }).collect::<Vec<_>>()
    };
    let passes = "when altitude passes 5000 m: say 1\n";
    assert_eq!(executed(passes, &altitudes(&[4_999.0, 5_000.0, 5_000.0, 5_001.0])), [(3, 1)]);
    assert_eq!(executed(passes, &altitudes(&[4_999.0, 5_000.0, 4_999.0])), []);
    assert_eq!(executed(passes, &altitudes(&[5_000.0, 5_001.0, 5_002.0])), []);
    let rises = "when altitude rises above 5000 m: say 1\n";
    assert_eq!(executed(rises, &altitudes(&[5_000.0, 5_000.0, 5_001.0])), [(2, 1)]);
}

#[test]
fn an_angle_does_not_pass_a_value_by_going_through_the_far_side() {
    let text = "when roll passes 10 deg: say 1\n";
    assert_eq!(executed(text, &rolls(&[175.0, -175.0, -171.0, -169.0, -100.0])), []);
    assert_eq!(executed("when roll passes 180 deg: say 1", &rolls(&[175.0, -175.0])), [(1, 1)]);
}

#[test]
fn sequences_run_beside_each_other_and_end_ends_them_all() {
    let text =
        "at 4 ms: say 1\nsequence b\nat 2 ms: say 3\nat 6 ms: end\nsequence c\nat 20 ms: say 6\n";
    assert_eq!(executed(text, &level(20)), [(1, 3), (2, 1), (3, 4)]);
}

#[test]
fn a_line_that_asks_the_plant_waits_for_room_and_its_sequence_with_it() {
    let text = "when roll passes 10 deg: fail rudder stuck\nsay 2\nsequence b\nat 2 ms: say 4\n";
    let mut run = Run::new(Arc::new(script(text)));
    let at = |micros, roll_deg| NavigationState {
        time: SimTime::from_micros(micros),
        ..rolled(roll_deg)
    };
    assert_eq!(run.next(&at(0, 0.0), false), None);
    // The crossing comes while there is no room, and is not lost.
    let due = run.next(&at(2_000, 20.0), false).map(|due| due.line);
    assert_eq!(due, Some(4));
    assert_eq!(run.next(&at(4_000, 20.0), false), None);
    assert!(!run.is_over());
    let due = run.next(&at(6_000, 20.0), true).unwrap();
    assert!(matches!(due.action, Action::Fault(_)), "{due:?}");
    assert_eq!(run.next(&at(6_000, 20.0), true).map(|due| due.line), Some(2));
    assert_eq!(run.next(&at(6_000, 20.0), true), None);
    assert!(run.is_over());
}
