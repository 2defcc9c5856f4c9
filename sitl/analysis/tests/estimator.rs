//! The estimator knows how wrong it is: the normalised estimation errors squared (NEES) of many flights lie in their 95 % band.

use core::ops::ControlFlow;

use flight_analysis::closed_loop::{Tick, watch};
use flight_analysis::configuration::AircraftArgs;
use flight_analysis::estimator::flights::Flown;
use flight_analysis::estimator::flights::{self, GROUPS};
use flight_analysis::estimator::{self, CASES, Options, band, mean_nees};
use flight_analysis::problem::Problem;
use flight_analysis::settings::Setting;
use flight_analysis::study::StudyOptions;
use flight_control::CompensatorMode;

const FLIGHTS: u32 = 12;

/// Seeds that chose no number of the estimator.
const SEED: u64 = 4_001;

fn options(aircraft: AircraftArgs) -> Options {
    let study = StudyOptions::of(aircraft);
    Options { study, flights: FLIGHTS, turbulence_m_s: 1.5, seed: SEED }
}

fn study(options: &Options) -> Result<Vec<Vec<Flown>>, Problem> {
    let sides = flights::sides(&options.study, CompensatorMode::Off, &[])?;
    estimator::study(options, &sides)
}

#[test]
fn the_errors_are_as_large_as_the_estimator_says() {
    let [low, high] = band(f64::from(FLIGHTS));
    let flown = study(&options(AircraftArgs::default())).expect("the flights begin");
    for (case, flights) in CASES.iter().zip(&flown) {
        for (group, (name, ..)) in GROUPS.iter().enumerate() {
            let mean = mean_nees(flights, group);
            assert!((low..=high).contains(&mean), "{}, {name}: {mean:.2}", case.name);
        }
        assert!(flights.iter().all(|flown| !flown.lost && flown.realigned == 0), "{}", case.name);
    }
}

/// What the study would say of an estimator that believes in better gyros, accelerometers and velocities than there are.
#[test]
fn an_estimator_that_trusts_its_sensors_too_much_is_outside_the_band() {
    let set = ["EST_GYR_N=0.0005", "EST_GYR_B=0.0009", "EST_ACC_B=0.003", "EST_GPS_V=0.02"];
    let settings = set.map(|text| Setting::parse(text).expect("a parameter")).into();
    let aircraft = AircraftArgs { settings, ..AircraftArgs::default() };
    let flown = study(&options(aircraft)).expect("the flights begin");
    let [_, high] = band(f64::from(FLIGHTS));
    for (group, (name, ..)) in GROUPS.iter().enumerate() {
        let is_of_these = ["velocity", "gyro bias", "accelerometer bias"].contains(name);
        let mean = mean_nees(&flown[0], group);
        assert!(!is_of_these || mean > high, "{name}: {mean:.2}");
    }
}

/// Places spread over the sphere, those where the field is steep among them; another heading at each.
#[test]
fn a_healthy_aircraft_is_kept_at_every_place_of_the_earth() {
    const PLACES: u32 = 24;
    let steep = [(82.0, -100.0), (78.0, -100.0), (-67.0, 140.0), (-62.0, 140.0), (89.0, 0.0)];
    let spread = (0..PLACES).map(|place| {
        let part = (f64::from(place) + 0.5) / f64::from(PLACES);
        (((1.0 - 2.0 * part).asin()).to_degrees(), (f64::from(place) * 137.508) % 360.0 - 180.0)
    });
    for (number, (latitude, longitude)) in (0_u32..).zip(steep.into_iter().chain(spread)) {
        let heading = (f64::from(number) * 77.0) % 360.0 - 180.0;
        let set = [("latitude", latitude), ("longitude", longitude), ("heading", heading)];
        let setting = |(key, value)| Setting::parse(&format!("plant.start.{key}_deg={value}"));
        let settings_of = set.map(|pair| setting(pair).expect("a key of the start")).into();
        let aircraft = AircraftArgs { settings: settings_of, ..AircraftArgs::default() };
        let study = StudyOptions::of(aircraft);
        let sides = flights::sides(&study, CompensatorMode::Off, &[]).expect("a place");
        for case in [&CASES[0], &CASES[2]] {
            let mut setup =
                flights::setup(&sides, case, 1.5, SEED + u64::from(number)).expect("a flight");
            setup.duration = icd::SimTime::from_micros(60_000_000);
            let mut is_lost = false;
            let look = |tick: &Tick<'_>| {
                let limits = &tick.plant.dynamics().airframe().limits;
                is_lost = limits.are_exceeded(&tick.plant.truth().into());
                if is_lost { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let _ = watch(&setup, look).expect("it begins");
            assert!(!is_lost, "{} at {latitude}, {longitude}, {heading} deg", case.name);
        }
    }
}

#[test]
fn the_flights_last_as_long_as_the_scenario_says() {
    let of = |text: &str| {
        let settings = vec![Setting::parse(text).expect("a key")];
        let aircraft = AircraftArgs { settings, ..AircraftArgs::default() };
        study(&Options { flights: 1, ..options(aircraft) })
    };
    let flown = of("plant.duration_s=25").expect("the flights begin");
    // Judged once a second, from the start on.
    assert!(flown.iter().all(|flights| flights[0].nees.len() == 26));
    let refused = of("plant.duration_s=20").expect_err("nothing is left to be judged").to_string();
    assert!(refused.contains("duration_s = 20") && refused.contains("21"), "{refused}");
}
