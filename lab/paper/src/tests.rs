//! Every limit can fail: the real flights pass, and each one spoilt in one way fails the one limit meant for it.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use super::cases::{Conditions, Run};
use super::*;
use flight_control::gains::{ActivationGains, Gains};
use icd::units::DEG;
use lab_engine::configuration::AircraftArgs;
use lab_judges::trace::{Sample, Trace};

const PERIOD: ControlPeriod = ControlPeriod::DEFAULT;
const LEVELS: ActivationGains = Gains::REFERENCE.activation;

fn options(out: &Path) -> Options {
    Options {
        earth: EarthModel::Flat,
        period: PERIOD,
        // One step a period: these tests are about the judges, not about the last digit of the flight.
        step_us: Some(PERIOD.as_micros()),
        gyro_noise_deg_s: 0.0,
        turbulence_m_s: 0.0,
        seed: 1,
        full: false,
        out: out.to_path_buf(),
        link: Link::InProcess,
        aircraft: AircraftArgs::default(),
    }
}

fn conditions() -> Conditions {
    options(Path::new("")).conditions()
}

static CASE_1: LazyLock<Flown> = LazyLock::new(|| fly_case(1));
static CASE_2: LazyLock<Flown> = LazyLock::new(|| fly_case(2));

fn fly_case(number: u32) -> Flown {
    Case::new(number, &conditions()).unwrap().fly_all(&in_process, true).unwrap()
}

/// Changes every tick between two times.
fn edit(trace: &mut Trace, from_s: f64, to_s: f64, change: impl Fn(&mut Sample)) {
    let mut samples = trace.samples().to_vec();
    let inside = |s: &&mut Sample| (from_s..=to_s).contains(&s.row.t_s);
    samples.iter_mut().filter(inside).for_each(change);
    *trace = Trace::new(samples, PERIOD, trace.on_ground(), trace.limits());
}

type Spoil = fn(&mut Flown);

/// Spoils a copy of the flights and checks that the limit named by `measure` does not survive it.
fn assert_fails(
    flown: &Flown,
    claims: fn(&Flown) -> Vec<ClaimResult>,
    spoilt: &[(&str, &str, Spoil)],
) {
    let good = claims(flown);
    for result in &good {
        assert!(result.pass, "{} {}: {} {}", result.id, result.measure, result.value, result.limit);
    }
    for (id, measure, spoil) in spoilt {
        let mut flown = flown.clone();
        spoil(&mut flown);
        let results = claims(&flown);
        let mut meant = results.iter().filter(|r| r.id == *id && r.measure == *measure).peekable();
        assert!(meant.peek().is_some(), "no limit {id} {measure}");
        assert!(meant.any(|r| !r.pass), "{id} {measure} holds for a spoilt flight");
    }
    let all: BTreeSet<_> = good.iter().map(|r| (r.id, r.measure.as_str())).collect();
    let tried: BTreeSet<_> = spoilt.iter().map(|(id, measure, _)| (*id, *measure)).collect();
    let untried: Vec<_> = all.difference(&tried).collect();
    assert!(untried.is_empty(), "limits that no spoilt flight was tried on: {untried:?}");
}

#[test]
fn every_limit_of_claims_1a_and_1b_fails_for_a_flight_spoilt_in_its_sense() {
    let claims = |f: &Flown| [claims::claim_1a(&f.runs()), claims::claim_1b(&f.runs())].concat();
    assert_fails(
        &CASE_1,
        claims,
        &[
            ("1a", "altitude overshoot", |f| {
                edit(&mut f.no_fault, 40.0, 40.0, |s| s.row.altitude_m = 6_020.1);
            }),
            ("1a", "distance from 6000 m from 60 s on", |f| {
                edit(&mut f.no_fault, 60.0, 60.0, |s| s.row.altitude_m = 5_979.9);
            }),
            ("1a", "drop below the running maximum of altitude in the first 60 s", |f| {
                edit(&mut f.no_fault, 30.0, 30.0, |s| s.row.altitude_m -= 30.0);
            }),
            ("1a", "change of the load factor", |f| {
                edit(&mut f.no_fault, 30.0, 30.0, |s| s.row.nz_g = -0.01);
            }),
            ("1a", "largest elevator", |f| {
                edit(&mut f.no_fault, 0.0, 3.0, |s| {
                    s.row.left_elevator_rad *= 0.1;
                    s.row.right_elevator_rad *= 0.1;
                });
            }),
            ("1a", "largest aileron", |f| {
                edit(&mut f.no_fault, 1.0, 1.0, |s| s.row.left_aileron_rad = -0.06 * DEG);
            }),
            ("1a", "largest rudder", |f| {
                edit(&mut f.no_fault, 1.0, 1.0, |s| s.row.rudder_rad = -0.06 * DEG);
            }),
            ("1a", "largest nozzle angle", |f| {
                edit(&mut f.no_fault, 1.0, 1.0, |s| s.row.nozzle_yaw_rad = -0.06 * DEG);
            }),
            ("1b", "time from the fault to the loss", |f| f.pid_only = f.compensated.clone()),
            ("1b", "largest roll rate 0.5 to 4 s after the fault", |f| {
                edit(&mut f.pid_only, 3.5, 7.0, |s| s.row.p_rad_s *= 0.4);
            }),
            ("1b", "largest yaw rate within 10 s of the fault", |f| {
                edit(&mut f.pid_only, 3.0, 13.0, |s| s.row.r_rad_s *= 0.4);
            }),
            ("1b", "altitude below the no-fault run 10 s after the fault", |f| {
                edit(&mut f.pid_only, 13.0, 13.0, |s| s.row.altitude_m += 500.0);
            }),
            ("1b", "sink rate 10 s after the fault", |f| {
                edit(&mut f.pid_only, 13.0, 13.0, |s| s.climb_rate_m_s = -29.9);
            }),
        ],
    );
}

#[test]
fn every_limit_of_claims_1c_and_1d_fails_for_a_flight_spoilt_in_its_sense() {
    let claims = |f: &Flown| [claims::claim_1c(&f.runs()), claims::claim_1d(&f.runs())].concat();
    assert_fails(
        &CASE_1,
        claims,
        &[
            ("1c", "aircraft lost", |f| {
                edit(&mut f.compensated, 20.0, 20.0, |s| s.row.beta_rad = -20.1 * DEG);
            }),
            ("1c", "roll rate apart from the no-fault run, from 3 s after the fault on", |f| {
                edit(&mut f.compensated, 6.0, 6.0, |s| s.row.p_rad_s += 1.2 * DEG);
            }),
            ("1c", "pitch rate apart from the no-fault run, from 3 s after the fault on", |f| {
                edit(&mut f.compensated, 89.0, 89.0, |s| s.row.q_rad_s -= 1.2 * DEG);
            }),
            ("1c", "yaw rate apart from the no-fault run, from 3 s after the fault on", |f| {
                edit(&mut f.compensated, 30.0, 30.0, |s| s.row.r_rad_s += 1.2 * DEG);
            }),
            ("1c", "largest roll angle", |f| {
                edit(&mut f.compensated, 3.5, 3.5, |s| s.row.phi_rad = -30.1 * DEG);
            }),
            ("1c", "altitude apart from the no-fault run", |f| {
                edit(&mut f.compensated, 20.0, 20.0, |s| s.row.altitude_m -= 70.0);
            }),
            ("1c", "distance from 6000 m at the end", |f| {
                edit(&mut f.compensated, 89.9, 91.0, |s| s.row.altitude_m = 5_979.0);
            }),
            ("1d", "largest z2 in roll before the fault, over its level", |f| {
                edit(&mut f.compensated, 2.0, 2.0, |s| {
                    s.row.z2_p_rad_s2 = -0.11 * LEVELS.level_roll;
                });
            }),
            ("1d", "largest z2 in pitch before the fault, over its level", |f| {
                edit(&mut f.compensated, 2.0, 2.0, |s| {
                    s.row.z2_q_rad_s2 = -0.11 * LEVELS.level_pitch;
                });
            }),
            ("1d", "largest z2 in yaw before the fault, over its level", |f| {
                edit(&mut f.compensated, 2.0, 2.0, |s| {
                    s.row.z2_r_rad_s2 = -0.11 * LEVELS.level_yaw;
                });
            }),
            ("1d", "time until z2 in roll has 90 % of F", |f| {
                edit(&mut f.compensated, 3.0, 3.21, |s| s.row.z2_p_rad_s2 *= 0.5);
            }),
            ("1d", "rms of z2 - F in roll from 1 s after the fault on, over the jump", |f| {
                edit(&mut f.compensated, 4.0, 91.0, |s| s.row.z2_p_rad_s2 += 0.1);
            }),
            ("1d", "rms of z2 - F in pitch from 1 s after the fault on, over the jump", |f| {
                edit(&mut f.compensated, 4.0, 91.0, |s| s.row.z2_q_rad_s2 += 0.02);
            }),
            ("1d", "rms of z2 - F in yaw from 1 s after the fault on, over the jump", |f| {
                edit(&mut f.compensated, 4.0, 91.0, |s| s.row.z2_r_rad_s2 += 0.01);
            }),
        ],
    );
}

#[test]
fn every_limit_of_claim_1e_fails_for_a_flight_spoilt_in_its_sense() {
    assert_fails(
        &CASE_1,
        |f| claims::claim_1e(&f.runs()),
        &[
            ("1e", "F in roll just after the fault", |f| {
                edit(&mut f.compensated, 3.4, 3.6, |s| s.row.fault_p_rad_s2 *= -1.0);
            }),
            ("1e", "F in pitch just after the fault", |f| {
                edit(&mut f.compensated, 3.4, 3.6, |s| s.row.fault_q_rad_s2 *= -1.0);
            }),
            ("1e", "F in yaw just after the fault", |f| {
                edit(&mut f.compensated, 3.4, 3.6, |s| s.row.fault_r_rad_s2 *= -1.0);
            }),
            ("1e", "compensating aileron 0.5 s after the fault", |f| {
                edit(&mut f.compensated, 3.4, 3.6, |s| s.row.ucf_aileron_rad *= -1.0);
            }),
            ("1e", "right aileron 0.3 s after the fault", |f| {
                edit(&mut f.compensated, 3.2, 3.4, |s| s.row.right_aileron_rad = 9.9 * DEG);
            }),
            ("1e", "mean right aileron of the last 10 s", |f| {
                edit(&mut f.compensated, 80.0, 91.0, |s| s.row.right_aileron_rad += 7.0 * DEG);
            }),
            (
                "1e",
                "yaw moment of fault and aileron together, over that of the fault, at 10 s",
                |f| {
                    edit(&mut f.compensated, 9.9, 10.1, |s| s.row.right_aileron_rad *= 0.9);
                },
            ),
            ("1e", "largest lateral nozzle angle", |f| {
                edit(&mut f.compensated, 50.0, 50.0, |s| s.row.nozzle_yaw_rad = -1.6 * DEG);
            }),
            ("1e", "smallest nozzle pitch from 0.5 s after the fault on", |f| {
                edit(&mut f.compensated, 50.0, 50.0, |s| s.row.nozzle_pitch_rad = 0.9 * DEG);
            }),
            ("1e", "largest demanded nozzle pitch from 1 s after the fault on", |f| {
                edit(&mut f.compensated, 50.0, 50.0, |s| s.row.ucf_nozzle_pitch_rad = 15.1 * DEG);
            }),
            (
                "1e",
                "pitch moment of fault and nozzle together, over that of the fault, at 10 s",
                |f| {
                    edit(&mut f.compensated, 9.9, 10.1, |s| s.row.nozzle_pitch_rad *= 0.9);
                },
            ),
        ],
    );
}

#[test]
fn every_limit_of_claims_2a_to_2c_fails_for_a_flight_spoilt_in_its_sense() {
    let claims = |f: &Flown| {
        let runs = f.runs();
        [claims::claim_2a(&runs), claims::claim_2b(&runs), claims::claim_2c(&runs)].concat()
    };
    assert_fails(
        &CASE_2,
        claims,
        &[
            ("2a", "roll overshoot", |f| {
                edit(&mut f.no_fault, 5.0, 5.0, |s| s.row.phi_rad = 16.1 * DEG);
            }),
            ("2a", "mean roll of the last 10 s, distance from 15 deg", |f| {
                edit(&mut f.no_fault, 30.0, 41.0, |s| s.row.phi_rad -= 0.5 * DEG);
            }),
            ("2a", "time to 90 % of 15 deg", |f| {
                edit(&mut f.no_fault, 0.0, 3.1, |s| s.row.phi_rad *= 0.5);
            }),
            ("2a", "distance from 5000 m", |f| {
                edit(&mut f.no_fault, 5.0, 5.0, |s| s.row.altitude_m = 4_984.0);
            }),
            ("2a", "mean turn rate of the last 10 s, apart from g tan(phi) / V", |f| {
                edit(&mut f.no_fault, 30.0, 41.0, |s| s.row.psi_rad = 0.0);
            }),
            ("2b", "time from the fault to the loss", |f| f.pid_only = f.compensated.clone()),
            ("2c", "aircraft lost", |f| {
                edit(&mut f.compensated, 20.0, 20.0, |s| s.row.theta_rad = 74.6 * DEG);
            }),
            // The mean has a limit on either side; this one and the next try one each.
            ("2c", "mean roll of the last 10 s", |f| {
                edit(&mut f.compensated, 30.0, 41.0, |s| s.row.phi_rad -= 2.0 * DEG);
            }),
            ("2c", "mean roll of the last 10 s", |f| {
                edit(&mut f.compensated, 30.0, 41.0, |s| s.row.phi_rad += 2.0 * DEG);
            }),
            ("2c", "roll peak to peak over the last 10 s", |f| {
                edit(&mut f.compensated, 35.0, 35.0, |s| s.row.phi_rad += 0.6 * DEG);
            }),
            ("2c", "distance from 5000 m", |f| {
                edit(&mut f.compensated, 5.0, 5.0, |s| s.row.altitude_m = 5_016.0);
            }),
        ],
    );
}

#[test]
fn every_limit_of_claims_2d_and_2e_fails_for_a_flight_spoilt_in_its_sense() {
    let claims = |f: &Flown| [claims::claim_2d(&f.runs()), claims::claim_2e(&f.runs())].concat();
    assert_fails(
        &CASE_2,
        claims,
        &[
            ("2d", "largest z2 in roll before the fault, over its level", |f| {
                edit(&mut f.compensated, 0.5, 0.5, |s| {
                    s.row.z2_p_rad_s2 = 0.11 * LEVELS.level_roll;
                });
            }),
            ("2d", "largest z2 in pitch before the fault, over its level", |f| {
                edit(&mut f.compensated, 0.5, 0.5, |s| {
                    s.row.z2_q_rad_s2 = 0.11 * LEVELS.level_pitch;
                });
            }),
            ("2d", "largest z2 in yaw before the fault, over its level", |f| {
                edit(&mut f.compensated, 0.5, 0.5, |s| s.row.z2_r_rad_s2 = 0.11 * LEVELS.level_yaw);
            }),
            ("2d", "time until z2 in roll has 90 % of F", |f| {
                edit(&mut f.compensated, 1.0, 1.21, |s| s.row.z2_p_rad_s2 *= 0.5);
            }),
            ("2d", "time until z2 in yaw has 90 % of F", |f| {
                edit(&mut f.compensated, 1.0, 1.21, |s| s.row.z2_r_rad_s2 *= -1.0);
            }),
            ("2d", "rms of z2 - F in roll from 1 s after the fault on, over the jump", |f| {
                edit(&mut f.compensated, 2.0, 41.0, |s| s.row.z2_p_rad_s2 += 0.1);
            }),
            ("2d", "rms of z2 - F in yaw from 1 s after the fault on, over the jump", |f| {
                edit(&mut f.compensated, 2.0, 41.0, |s| s.row.z2_r_rad_s2 += 0.05);
            }),
            ("2d", "rms of z2 - F in pitch from 1 s after the fault on", |f| {
                edit(&mut f.compensated, 2.0, 41.0, |s| s.row.z2_q_rad_s2 += 0.011);
            }),
            ("2e", "F in roll just after the fault", |f| {
                edit(&mut f.compensated, 1.2, 1.4, |s| s.row.fault_p_rad_s2 *= -1.0);
            }),
            ("2e", "F in yaw just after the fault", |f| {
                edit(&mut f.compensated, 1.2, 1.4, |s| s.row.fault_r_rad_s2 *= -1.0);
            }),
            ("2e", "compensating aileron at the end", |f| {
                edit(&mut f.compensated, 39.9, 41.0, |s| s.row.ucf_aileron_rad *= -1.0);
            }),
            ("2e", "smallest lateral nozzle angle from 0.6 s after the fault on", |f| {
                edit(&mut f.compensated, 20.0, 20.0, |s| s.row.nozzle_yaw_rad = 14.4 * DEG);
            }),
            ("2e", "smallest demanded lateral nozzle angle over the last 5 s", |f| {
                edit(&mut f.compensated, 36.0, 36.0, |s| s.row.ucf_nozzle_yaw_rad = 15.9 * DEG);
            }),
            ("2e", "largest vertical nozzle angle", |f| {
                edit(&mut f.compensated, 20.0, 20.0, |s| s.row.nozzle_pitch_rad = -1.1 * DEG);
            }),
        ],
    );
}

#[test]
fn every_limit_of_claim_3_fails_for_a_flight_spoilt_in_its_sense() {
    assert_fails(
        &CASE_2,
        both::claim_3,
        &[
            ("3", "case 2: ticks with the compensator active", |f| {
                edit(&mut f.no_fault, 5.0, 5.0, |s| s.row.compensator_active = 1.0);
            }),
            ("3", "case 2: largest compensation", |f| {
                edit(&mut f.no_fault, 5.0, 5.0, |s| s.applied.nozzle_yaw_rad = -1.0e-300);
            }),
            ("3", "case 2: ticks at which armed and off differ in a bit", |f| {
                edit(&mut f.no_fault_off, 5.0, 5.0, |s| {
                    s.row.p_rad_s = f64::from_bits(s.row.p_rad_s.to_bits() ^ 1);
                });
            }),
        ],
    );
}

#[test]
fn every_limit_of_claim_4_fails_for_a_flight_spoilt_in_its_sense() {
    let both_cases = |turn: &Flown| {
        let climb = Noisy::new("case 1".to_owned(), &CASE_1.runs());
        both::claim_4(&[climb, Noisy::new("case 2".to_owned(), &turn.runs())])
    };
    assert_fails(
        &CASE_2,
        both_cases,
        &[
            ("4", "lost without fault", |f| f.no_fault = f.pid_only.clone()),
            ("4", "not lost with PID only", |f| f.pid_only = f.compensated.clone()),
            ("4", "lost with the compensator", |f| f.compensated = f.pid_only.clone()),
            ("4", "with a sign other than in 1e and 2e", |f| {
                edit(&mut f.compensated, 1.2, 1.4, |s| s.row.fault_r_rad_s2 *= -1.0);
            }),
            ("4", "activated without a fault", |f| {
                edit(&mut f.compensated, 0.5, 0.5, |s| s.row.compensator_active = 1.0);
            }),
            ("4", "largest healthy z2, over its level", |f| {
                edit(&mut f.no_fault, 5.0, 5.0, |s| s.row.z2_r_rad_s2 = -0.91 * LEVELS.level_yaw);
            }),
            ("4", "case 2: smallest mean roll of the last 10 s", |f| {
                edit(&mut f.compensated, 30.0, 41.0, |s| s.row.phi_rad -= 3.0 * DEG);
            }),
            ("4", "case 2: largest mean roll of the last 10 s", |f| {
                edit(&mut f.compensated, 30.0, 41.0, |s| s.row.phi_rad += 3.0 * DEG);
            }),
            ("4", "largest rms of z2 - F from 1 s after the fault on, over the jump", |f| {
                edit(&mut f.compensated, 2.0, 41.0, |s| s.row.z2_r_rad_s2 += 0.2);
            }),
            ("4", "case 2: smallest share of the time with the lateral nozzle at its limit", |f| {
                edit(&mut f.compensated, 20.0, 22.5, |s| s.row.nozzle_yaw_rad = 14.0 * DEG);
            }),
        ],
    );
}

#[test]
fn a_lost_aircraft_is_followed_to_the_ground() {
    for flown in [&*CASE_1, &*CASE_2] {
        let run = &flown.pid_only;
        let last = run.samples().last().unwrap();
        assert!(
            run.on_ground(),
            "case {}: ends at {} s in the air",
            flown.case.number,
            run.end_s()
        );
        // At 300 m/s one tick of 2 ms is less than a metre.
        assert!(last.row.altitude_m < 1.0, "last tick at {} m", last.row.altitude_m);
    }
}

#[test]
fn the_runs_differ_only_in_fault_and_compensator() {
    let case = &CASE_1.case;
    assert!(case.run(Run::NoFault).plant.faults.is_empty());
    assert_eq!(case.run(Run::PidOnly).plant, case.run(Run::Compensated).plant);
    assert_ne!(
        case.run(Run::PidOnly).parameters.gains,
        case.run(Run::Compensated).parameters.gains
    );
    assert_eq!(
        case.run(Run::NoFault).parameters.gains,
        case.run(Run::Compensated).parameters.gains
    );
    assert_eq!(case.run(Run::NoFaultOff).parameters.gains, case.run(Run::PidOnly).parameters.gains);
}

#[test]
fn a_run_leaves_tables_claims_figures_and_a_report_that_needs_no_network() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("new/folder");
    let outcome = run(&options(&out), &in_process).unwrap();
    assert!(outcome.all_hold(), "{}", report::text_table(&outcome.results));
    for case in ["case1", "case2"] {
        for name in ["nofault", "pid", "rftc"] {
            let text = fs::read_to_string(out.join(format!("{case}_{name}.csv"))).unwrap();
            let mut lines = text.lines();
            assert_eq!(lines.next().unwrap(), lab_judges::row::Row::NAMES.join(","));
            let times: Vec<f64> =
                lines.map(|line| line.split(',').next().unwrap().parse().unwrap()).collect();
            assert_eq!(times[..3], [0.0, 0.01, 0.02], "{case} {name}");
        }
    }
    for number in 4..=9 {
        let svg = fs::read_to_string(out.join(format!("fig{number}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains(&format!("Figure {number}")));
        let png = fs::read(out.join(format!("fig{number}.png"))).unwrap();
        assert_eq!(&png[..4], b"\x89PNG");
    }
    let claims: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("claims.json")).unwrap()).unwrap();
    assert_eq!(claims.as_array().unwrap().len(), outcome.results.len());
    for entry in claims.as_array().unwrap() {
        for key in ["id", "claim", "value", "limit", "unit", "pass"] {
            assert!(!entry[key].is_null(), "{key} of {entry}");
        }
    }
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    // The one address is the name of the SVG language, which is never fetched.
    let addresses = page.replace("http://www.w3.org/2000/svg", "");
    for fetched in ["http:", "https:", "src=", "href=", "@import", "url("] {
        assert!(!addresses.contains(fetched), "the report has {fetched}");
    }
    assert_eq!(page.matches("<svg").count(), 6);
}

#[test]
fn with_noise_the_limits_of_claim_4_stand_in() {
    let noisy = Options { gyro_noise_deg_s: 0.1, turbulence_m_s: 1.5, ..options(Path::new("")) };
    let ids: BTreeSet<_> = evaluate(&noisy).unwrap().iter().map(|r| r.id).collect();
    assert_eq!(ids, BTreeSet::from(["3", "4"]));
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "in the way").unwrap();
    let out = file.join("out");
    let error = run(&options(&out), &in_process).unwrap_err().to_string();
    assert!(
        error.starts_with("--out: cannot write ") && error.contains(out.to_str().unwrap()),
        "{error}"
    );
}

#[test]
fn noise_that_cannot_be_is_refused_with_its_range() {
    let bad = Options { turbulence_m_s: f64::NAN, ..options(Path::new("")) };
    let error = evaluate(&bad).unwrap_err().to_string();
    assert!(error.contains("turbulence_m_s") && error.contains("outside 0 to 20"), "{error}");
}
