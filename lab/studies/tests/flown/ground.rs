//! Flights that begin on a ground, with the autopilot as in any other.

use host_io::problem::Problem;
use lab_engine::builder::SetupOptions;
use lab_engine::configuration::{AircraftArgs, Named};
use lab_judges::flown::{self, Keep};
use lab_judges::outcome::Outcome;

/// `start` is what `[plant.ground]` has besides the runway.
fn fly(
    airframe: &str,
    start: &str,
    altitude_m: f64,
    airspeed_m_s: f64,
) -> Result<Outcome, Problem> {
    let scenario = format!(
        "[plant]\nduration_s = 60.0\n[plant.ground]\nlatitude_deg = 34.9\nlongitude_deg = -117.9\nelevation_m = 0.0\n\
         heading_deg = 40.0\nlength_m = 3000.0\n{start}\n[[autopilot.reference]]\nat_s = 0.0\nroll_deg = 0.0\n\
         altitude_m = {altitude_m:?}\nairspeed_m_s = {airspeed_m_s:?}\n"
    );
    let aircraft = AircraftArgs { airframe: Some(airframe.into()), ..AircraftArgs::default() };
    let options = SetupOptions { aircraft, ..SetupOptions::default() };
    let setup = options.builder()?.setup(&Named::given("ground", scenario), &[])?;
    flown::fly(&setup, true, Keep::default()).map(|(outcome, _)| outcome)
}

#[test]
fn an_aircraft_launched_by_hand_climbs_to_its_altitude() {
    let launch = "start = \"launched\"\nheight_m = 1.8\nspeed_m_s = 22.0\npitch_deg = 8.0";
    let outcome = fly("aerosonde", launch, 100.0, 25.0).unwrap();
    assert!(outcome.is_kept() && (outcome.end_s - 60.0).abs() < 1.0e-9, "{outcome:?}");
    let low = launch.replace("height_m = 1.8", "height_m = 0.0");
    let refused = fly("aerosonde", &low, 100.0, 25.0).unwrap_err().to_string();
    assert!(refused.contains("height_m = 0 puts the"), "{refused}");
}

#[test]
fn a_launch_that_does_not_fly_ends_with_the_crash() {
    // Nose down and far below the stall.
    let launch = "start = \"launched\"\nheight_m = 30.0\nspeed_m_s = 5.0\npitch_deg = -45.0";
    let outcome = fly("aerosonde", launch, 100.0, 25.0).unwrap();
    assert!(!outcome.is_kept() && outcome.end_s < 10.0, "{outcome:?}");
}
