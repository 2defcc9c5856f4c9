//! What only reports may be left out where no one reads it: the flight stays the same to the bit.

use lab_engine::{Flight, SetupOptions};

#[test]
fn a_flight_without_the_unread_verdict_has_the_same_truth_and_commands() {
    for allocation in [0.0, 2.0] {
        let mut options = SetupOptions::default();
        let _ = options.set("plant.duration_s", 12.0).set("FTC_ALLOC", allocation);
        let setup = options.setup("case1").expect("it is shipped");
        let [mut whole, mut bare] = [(); 2].map(|()| Flight::new(&setup).expect("it starts"));
        bare.skip_unread_verdict();
        let mut named = false;
        while let Some(tick) = whole.step([]) {
            let record = tick.record();
            let other = bare.step([]).expect("as long").record();
            assert_eq!(record.truth, other.truth);
            assert_eq!(record.log.commands, other.log.commands);
            assert_eq!(other.log.isolation.verdict, None);
            named |= record.log.isolation.verdict.is_some();
        }
        assert!(named && bare.step([]).is_none(), "the flight has a verdict to leave out");
    }
}

/// With the verdict in use it is read by the law.
#[test]
fn a_verdict_that_the_law_uses_is_never_left_out() {
    let mut options = SetupOptions::default();
    let _ = options.set("plant.duration_s", 12.0).set("FTC_ISO", 1.0);
    let mut flight =
        Flight::new(&options.setup("case1").expect("it is shipped")).expect("it starts");
    flight.skip_unread_verdict();
    let mut named = false;
    while let Some(tick) = flight.step([]) {
        named |= tick.log.isolation.verdict.is_some();
    }
    assert!(named);
}
