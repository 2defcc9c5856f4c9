//! A sample of the study of false alarms; the whole one is `sitl study false-alarms --hours 100` (docs/false-alarms.md).

use flight_control::CompensatorMode;
use plant_sim::GradeName;
use sitl::false_alarms::flights::{CONDITIONS, measure_delays};
use sitl::false_alarms::{ALLOWED_PER_H, Options, Shipped, fly_healthy};
use sitl::study::{Sides, StudyOptions};

fn options() -> Options {
    Options {
        grades: Vec::new(),
        hours: 3.0,
        conditions: CONDITIONS.to_vec(),
        straight: false,
        turbulence_m_s: 3.0,
        gyro_noise_deg_s: 0.1,
        seed: 1_000,
        study: StudyOptions::default(),
    }
}

fn sides() -> Sides {
    StudyOptions::default().random_sides(CompensatorMode::Off, &[]).expect("a shipped aircraft")
}

#[test]
fn healthy_flight_in_moderate_turbulence_has_no_more_alarms_than_the_stated_rate() {
    let Shipped { kind, index } = Shipped::find();
    for grade in [GradeName::Ideal, GradeName::Tactical] {
        let conditions =
            fly_healthy(&options(), grade, &sides()).expect("the shipped aircraft flies");
        let (mut alarms, mut hours) = (0, 0.0);
        for at in &conditions {
            assert_eq!(at.lost, 0, "{grade:?}: a healthy aircraft was lost");
            // The air reaches the detector: a study of calm air would show nothing.
            assert!(at.rms().min() > 0.03, "{grade:?}: z2 over its level {:?}", at.rms());
            // Half of the flight is manoeuvres, less the ten seconds at the start.
            assert!((at.manoeuvring_s / at.seconds - 0.5).abs() < 0.02, "{} s", at.manoeuvring_s);
            alarms += at.alarms[kind][index];
            hours += at.seconds / 3_600.0;
        }
        assert!(hours >= 3.0, "{hours} h");
        let rate = f64::from(alarms) / hours;
        assert!(rate <= ALLOWED_PER_H, "{grade:?}: {alarms} alarms in {hours} h");
    }
}

/// Below the design Mach number the model explains too much of the flow angles, which are largest there.
#[test]
fn the_rate_holds_at_the_slowest_condition_alone() {
    let Shipped { kind, index } = Shipped::find();
    let options = Options { conditions: vec![CONDITIONS[0]], seed: 31_000, ..options() };
    let flown =
        fly_healthy(&options, GradeName::Tactical, &sides()).expect("the shipped aircraft flies");
    let alarms: u32 = flown.iter().map(|at| at.alarms[kind][index]).sum();
    let hours: f64 = flown.iter().map(|at| at.seconds / 3_600.0).sum();
    assert!(f64::from(alarms) <= ALLOWED_PER_H * hours, "{alarms} alarms in {hours} h");
}

/// The rate is not that of a deaf detector.
#[test]
fn with_tactical_sensors_faults_are_noticed_nearly_as_soon_as_with_the_levels_of_ideal_ones() {
    let Shipped { kind, index } = Shipped::find();
    let delays = measure_delays(&options(), GradeName::Tactical, &sides()).expect("it flies");
    // Medians with the levels of the gains alone, s; half as long again is allowed.
    let before = [
        ("case 1: left elevator at +30 deg, in a climb", 0.046),
        ("case 2: rudder at +7 deg, in a turn", 0.040),
        ("left elevator at +15 deg", 0.102),
        ("rudder at +3 deg", 0.064),
        ("right aileron at +25 deg", 0.050),
        ("nozzle in pitch at +15 deg", 0.052),
    ];
    for (name, before_s) in before {
        let found = delays.iter().find(|delays| delays.fault.name == name).expect(name);
        let median_s = found.median_s[kind][index];
        assert!(median_s <= 1.5 * before_s, "{name}: {median_s} s, before {before_s} s");
    }
}
