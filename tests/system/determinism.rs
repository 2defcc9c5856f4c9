//! Same inputs and seed, same bits.

use crate::flights;

use flights::{bytes, case_1, case_2, fly};
use icd::{ControlPeriod, SimTime};
use lab_judges::closed_loop::FlightSetup;
use plant_sim::EarthModel;

/// Ten noisy, gusty seconds of case 2.
fn noisy(seed: u64) -> FlightSetup {
    let mut setup = case_2(EarthModel::Wgs84);
    setup.plant.seed = seed;
    setup.plant.sensors.gyro_noise_rad_s = 0.1_f64.to_radians();
    setup.plant.wind.turbulence_m_s = 1.5;
    setup.duration = SimTime::from_micros(10_000_000);
    setup
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    assert_eq!(bytes(&fly(&noisy(7))), bytes(&fly(&noisy(7))));
}

#[test]
fn another_seed_gives_other_bytes() {
    assert_ne!(bytes(&fly(&noisy(7))), bytes(&fly(&noisy(8))));
}

#[test]
fn the_seed_is_without_meaning_where_nothing_is_random() {
    let at = |seed| {
        let mut setup = case_1(EarthModel::Wgs84);
        setup.plant.seed = seed;
        setup.duration = SimTime::from_micros(10_000_000);
        bytes(&fly(&setup))
    };
    assert_eq!(at(1), at(2));
}

#[test]
fn gyro_noise_does_not_change_the_gusts() {
    let mut quiet = noisy(7);
    quiet.plant.sensors.gyro_noise_rad_s = 0.0;
    // The trajectories diverge, but the air moves alike at the first ticks: the streams are separate.
    let (a, b) = (fly(&noisy(7)), fly(&quiet));
    assert_ne!(bytes(&a[..100]), bytes(&b[..100]), "the noise is there");
    let first = |records: &[lab_judges::closed_loop::Record]| records[1].truth.beta_rad;
    assert!((first(&a) - first(&b)).abs() < 1.0e-6, "{} and {} rad", first(&a), first(&b));
}

#[test]
fn flights_on_many_threads_are_those_on_one() {
    let alone: Vec<Vec<u8>> = (0..4).map(|seed| bytes(&fly(&noisy(seed)))).collect();
    let together: Vec<Vec<u8>> = std::thread::scope(|scope| {
        let flights: Vec<_> =
            (0..4).map(|seed| scope.spawn(move || bytes(&fly(&noisy(seed))))).collect();
        flights.into_iter().map(|flight| flight.join().expect("no panic")).collect()
    });
    assert!(alone == together, "a flight depends on its neighbours");
}

#[test]
fn every_allowed_period_flies_and_only_divisors_are_plant_steps() {
    for micros in [1_000, 2_000, 2_500, 4_000] {
        let mut setup = case_1(EarthModel::Wgs84);
        setup.plant.period = ControlPeriod::from_micros(micros).expect("in range");
        setup.plant.step_us = micros;
        setup.duration = SimTime::from_micros(8_000_000);
        let records = fly(&setup);
        assert!(records.iter().all(|record| record.truth.euler().phi.abs() < 0.6), "{micros} us");
        setup.plant.step_us = micros - 1;
        assert!(plant_sim::Plant::new(&setup.plant).is_err(), "{micros} us");
    }
}
