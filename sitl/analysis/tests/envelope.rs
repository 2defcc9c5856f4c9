//! The healthy aircraft holds its altitude over its whole envelope, and says what it lacks elsewhere.

use flight_analysis::envelope::{self, Case, Flown};
use flight_analysis::study::StudyOptions;
use flight_control::{AltitudeLimit, CompensatorMode};

fn fly(airspeed_m_s: f64, from_m: f64, to_m: f64, bank_deg: f64) -> Flown {
    let case = Case { airspeed_m_s, from_m, to_m, bank_deg };
    let sides =
        StudyOptions::default().sides(CompensatorMode::Armed, &[]).expect("the shipped files");
    envelope::fly(&sides, &case).expect("a steady flight to start from")
}

/// Corners of the sweep of `sitl study envelope`, with the flights that were the worst before the law had a trim for
/// each flight condition: 2195 m, 1381 m and 1204 m off for good.
#[test]
fn with_a_tenth_of_elevator_and_thrust_left_the_altitude_is_held_within_10_m() {
    for (airspeed_m_s, from_m, to_m, bank_deg) in [
        (180.0, 600.0, 600.0, 60.0),
        (285.0, 600.0, 600.0, 60.0),
        (180.0, 12_000.0, 12_000.0, 0.0),
        (180.0, 12_000.0, 12_000.0, 45.0),
        (215.0, 12_000.0, 12_000.0, -60.0),
        (320.0, 12_000.0, 12_000.0, 60.0),
        (180.0, 9_000.0, 9_000.0, 60.0),
        (180.0, 7_000.0, 12_000.0, 0.0),
        (320.0, 7_000.0, 12_000.0, 0.0),
        (180.0, 5_600.0, 600.0, 0.0),
    ] {
        let flown = fly(airspeed_m_s, from_m, to_m, bank_deg);
        assert!(flown.has_reserve(), "{flown:?}");
        assert!(flown.is_held(), "{flown:?}");
        assert_eq!(flown.limit, None, "{flown:?}");
    }
}

#[test]
fn a_turn_that_the_wing_cannot_lift_is_named_and_not_stalled() {
    let flown = fly(180.0, 12_000.0, 12_000.0, 60.0);
    assert!(!flown.has_reserve() && !flown.is_held(), "{flown:?}");
    assert!(
        matches!(flown.limit, Some(AltitudeLimit::Wing | AltitudeLimit::Elevator)),
        "{flown:?}"
    );
    // Beyond 25 deg the aircraft counts as lost.
    assert!(flown.alpha_max_rad.to_degrees() < 20.0, "{flown:?}");
}

#[test]
fn a_level_turn_that_the_engine_cannot_sustain_keeps_the_altitude_and_gives_up_airspeed() {
    let flown = fly(320.0, 600.0, 600.0, 60.0);
    assert!(!flown.has_reserve() && flown.thrust_saturated, "{flown:?}");
    assert!(flown.is_held() && flown.airspeed_error_m_s < -1.0, "{flown:?}");
}
