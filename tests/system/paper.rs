//! The paper's claims, one test each. Their limits are in `lab_paper`; docs/paper.md lists them.

use std::path::PathBuf;
use std::sync::LazyLock;

use icd::ControlPeriod;
use lab_engine::configuration::AircraftArgs;
use lab_paper::both::{self, Noisy};
use lab_paper::cases::Case;
use lab_paper::claim::ClaimResult;
use lab_paper::estimated::{self, FITS, Flown};
use lab_paper::model_error::{self, Extent};
use lab_paper::{self, Link, Options};
use plant_sim::EarthModel;

fn options(earth: EarthModel, period_us: u32) -> Options {
    Options {
        earth,
        period: ControlPeriod::from_micros(period_us).expect("in range"),
        step_us: Some(1_000),
        gyro_noise_deg_s: 0.0,
        turbulence_m_s: 0.0,
        seed: 1,
        full: false,
        out: PathBuf::new(),
        link: Link::InProcess,
        aircraft: AircraftArgs::default(),
    }
}

fn evaluate(options: &Options) -> Vec<ClaimResult> {
    lab_paper::evaluate(options).expect("the shipped cases fly")
}

/// Asserts every measured value of the claims with this number; there must be at least one.
fn assert_claim(results: &[ClaimResult], id: &str) {
    let of_claim: Vec<&ClaimResult> = results.iter().filter(|result| result.id == id).collect();
    assert!(!of_claim.is_empty(), "claim {id} was not checked");
    for result in of_claim {
        let ClaimResult { claim, measure, value, limit, unit, .. } = result;
        assert!(result.pass, "{id} {claim}: {measure} is {value} {unit}, must be {limit}");
    }
}

/// The default: WGS-84, 2 ms.
static DEFAULT: LazyLock<Vec<ClaimResult>> =
    LazyLock::new(|| evaluate(&options(EarthModel::Wgs84, 2_000)));

macro_rules! claims {
    ($($name:ident: $id:literal;)*) => {
        $(#[test] fn $name() { assert_claim(&DEFAULT, $id); })*

        /// The claims above.
        const IDS: &[&str] = &[$($id),*];
    };
}

claims! {
    paper_1a_without_fault_the_climb_is_smooth_and_only_the_elevator_moves: "1a";
    paper_1b_pid_alone_loses_the_aircraft_after_the_elevator_jam: "1b";
    paper_1c_compensated_rates_and_altitude_are_almost_those_without_fault: "1c";
    paper_1d_the_estimates_are_zero_then_equal_the_elevator_fault: "1d";
    paper_1e_aileron_and_vertical_nozzle_answer_and_the_lateral_nozzle_stays_idle: "1e";
    paper_2a_without_fault_the_turn_holds_its_altitude: "2a";
    paper_2b_pid_alone_loses_the_aircraft_after_the_rudder_jam: "2b";
    paper_2c_compensated_roll_settles_around_ten_degrees: "2c";
    paper_2d_the_estimates_are_zero_then_equal_the_rudder_fault: "2d";
    paper_2e_the_lateral_nozzle_is_at_its_limit_and_the_vertical_one_idle: "2e";
    paper_3_without_a_fault_the_compensator_is_inactive_to_the_bit: "3";
}

#[test]
fn every_checked_claim_has_its_test() {
    for result in DEFAULT.iter() {
        assert!(IDS.contains(&result.id), "claim {} has no test", result.id);
    }
}

#[test]
fn the_claims_hold_at_one_and_four_milliseconds_and_on_the_flat_earth() {
    for (earth, period_us) in [
        (EarthModel::Wgs84, 1_000),
        (EarthModel::Wgs84, 4_000),
        (EarthModel::Flat, 2_000),
        (EarthModel::Flat, 2_500),
    ] {
        let mut options = options(earth, period_us);
        options.step_us = Some(if period_us == 2_500 { 500 } else { 1_000 });
        let results = evaluate(&options);
        for id in IDS {
            assert_claim(&results, id);
        }
    }
}

#[test]
fn the_claims_hold_with_one_plant_step_a_period() {
    let options = Options { step_us: Some(2_000), ..options(EarthModel::Wgs84, 2_000) };
    let results = evaluate(&options);
    for id in IDS {
        assert_claim(&results, id);
    }
}

#[test]
fn paper_4_the_outcomes_survive_noise_and_air_in_three_seeds() {
    for seed in [1, 2, 3] {
        let noisy = Options {
            gyro_noise_deg_s: 0.1,
            turbulence_m_s: 1.5,
            seed,
            ..options(EarthModel::Wgs84, 2_000)
        };
        assert_claim(&evaluate(&noisy), "4");
    }
}

#[test]
fn paper_5_the_outcomes_survive_model_error_in_a_sample() {
    let conditions = options(EarthModel::Wgs84, 2_000).conditions();
    let cases = [1, 2].map(|number| Case::new(number, &conditions).expect("a shipped case"));
    let sample = model_error::campaign(&cases, 1, &Extent::SAMPLE).expect("the aircraft fly");
    assert_claim(&sample.claims, "5");
}

/// docs/paper.md has more seeds, the limits that degrade, and consumer sensors.
#[test]
fn the_outcomes_hold_on_estimated_states_with_tactical_sensors_in_light_turbulence() {
    let fit = FITS.iter().find(|fit| fit.name == "tactical").expect("one of the fits");
    let flown: Vec<Flown> =
        [1, 2, 3].map(|seed| estimated::fly(fit, 1.5, seed).expect("the aircraft flies")).into();
    let outcomes: Vec<Noisy> = flown.iter().flat_map(|flown| flown.outcomes.clone()).collect();
    let results = both::claim_4(&outcomes);
    for measure in [
        "lost without fault",
        "not lost with PID only",
        "lost with the compensator",
        "with a sign other than in 1e and 2e",
        "activated without a fault",
    ] {
        let result = results.iter().find(|result| result.measure == measure).expect(measure);
        assert!(result.pass, "{measure}: {:?}", result.failed_runs);
    }
    for flown in &flown {
        let strict = ["1b", "2b"];
        for ClaimResult { id, measure, value, limit, unit, pass, .. } in &flown.limits {
            assert!(*pass || !strict.contains(id), "{id} {measure}: {value} {unit}, {limit}");
        }
    }
}
