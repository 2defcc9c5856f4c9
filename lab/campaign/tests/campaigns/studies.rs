//! Studies that are specifications have the results of their pages.

use std::env;
use std::path::PathBuf;

use flight_control::estimator_status::SourceHealth;
use icd::fault::{CATALOGUE, SensorKind, TargetClass};
use lab_campaign::plan::{Plan, Run, Value};
use lab_campaign::spec::SpecFile;
use lab_judges::outcome::Outcome;
use lab_report::runner;
use studies::STUDIES;

/// How many flights, or what else costs time: as on the page where `TWO_STEP_LONG` is set, as every night; else a part of them.
pub fn long_or(long: u32, short: u32) -> u32 {
    if env::var_os("TWO_STEP_LONG").is_some() { long } else { short }
}

/// A study with a change in its text.
fn study(name: &str, change: impl Fn(&str) -> String) -> Plan {
    let text = STUDIES.iter().find(|(known, _)| *known == name).expect("it is shipped").1;
    let file = SpecFile::parse(name, change(text), PathBuf::new()).expect("a specification");
    Plan::new(file).expect("a plan")
}

fn with(text: &str, replaced: &[(&str, &str)]) -> String {
    replaced.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// The value of a variable, as tables show it.
fn value(plan: &Plan, run: &Run, key: &str) -> String {
    let place = plan.variables().iter().position(|variable| variable.key == key);
    match &run.values[place.expect("a variable")] {
        Value::Text(text) => text.clone(),
        Value::Number(number) => number.to_string(),
    }
}

/// Flies the runs that are meant.
fn fly(plan: &Plan, is_meant: impl Fn(&Run) -> bool) -> Vec<(Run, Outcome)> {
    let runs: Vec<Run> =
        (0..plan.runs()).map(|n| plan.run(n).expect("a run")).filter(is_meant).collect();
    assert!(!runs.is_empty());
    let flown = runner::map(&plan.file.name, &runs, |run| plan.fly(run).expect("it flies"));
    runs.into_iter().zip(flown).collect()
}

fn metric(outcome: &Outcome, name: &str) -> f64 {
    outcome.metric(name).unwrap_or_else(|| panic!("{name} of {outcome}"))
}

fn rms(flown: &[&Outcome], name: &str) -> f64 {
    let squares: f64 = flown.iter().map(|outcome| metric(outcome, name).powi(2)).sum();
    (squares / flown.len() as f64).sqrt()
}

fn mean(flown: &[&Outcome], name: &str) -> f64 {
    flown.iter().map(|outcome| metric(outcome, name)).sum::<f64>() / flown.len() as f64
}

fn in_envelope(airspeed: &str, altitude: &str, bank: &str) -> Outcome {
    let plan = study("envelope", str::to_owned);
    let flown = fly(&plan, |run| {
        value(&plan, run, "airspeed") == airspeed
            && value(&plan, run, "altitude") == altitude
            && value(&plan, run, "autopilot.reference.2.roll_deg") == bank
    });
    flown.into_iter().next().expect("one").1
}

/// Corners of the sweep, with the flights that were the worst before the law had a trim for each flight condition: 2195 m, 1381 m and
/// 1204 m off for good.
#[test]
fn with_a_tenth_of_elevator_and_thrust_left_the_altitude_is_held_within_10_m() {
    for (airspeed, altitude, bank) in [
        ("180 m/s", "600 m", "60"),
        ("285 m/s", "600 m", "60"),
        ("180 m/s", "12000 m", "0"),
        ("180 m/s", "12000 m", "45"),
        ("215 m/s", "12000 m", "60"),
        ("320 m/s", "12000 m", "60"),
        ("180 m/s", "9000 m", "60"),
        ("180 m/s", "7000 to 12000 m", "0"),
        ("320 m/s", "7000 to 12000 m", "0"),
        ("180 m/s", "5600 to 600 m", "0"),
    ] {
        let flown = in_envelope(airspeed, altitude, bank);
        assert_eq!(metric(&flown, "steady_reserve"), 1.0, "{airspeed}, {altitude}, {bank} deg");
        let error_m = metric(&flown, "end_altitude_error");
        assert!(error_m <= 10.0, "{airspeed}, {altitude}, {bank} deg: {error_m} m");
        assert_eq!(metric(&flown, "altitude_limit"), 0.0, "{airspeed}, {altitude}, {bank} deg");
    }
}

#[test]
fn a_turn_that_the_wing_cannot_lift_is_named_and_not_stalled() {
    let flown = in_envelope("180 m/s", "12000 m", "60");
    assert_eq!(metric(&flown, "steady_reserve"), 0.0);
    assert!(metric(&flown, "end_altitude_error") > 10.0);
    // The elevator or the wing; beyond 25 deg the aircraft counts as lost.
    assert!(metric(&flown, "altitude_limit") >= 2.0);
    assert!(metric(&flown, "largest_angle_of_attack").to_degrees() < 20.0);
}

#[test]
fn a_level_turn_that_the_engine_cannot_sustain_keeps_the_altitude_and_gives_up_airspeed() {
    let flown = in_envelope("320 m/s", "600 m", "60");
    assert_eq!(metric(&flown, "steady_reserve"), 0.0);
    assert_eq!(metric(&flown, "thrust_saturated"), 1.0);
    assert!(metric(&flown, "end_altitude_error") <= 10.0);
    assert!(metric(&flown, "end_airspeed_error") < -1.0);
}

const GROUPS: [&str; 6] =
    ["attitude", "velocity", "position", "gyro_bias", "accelerometer_bias", "wind"];
const SENSORS: [&str; 4] =
    ["tactical", "tactical without vanes", "consumer", "consumer without vanes"];
/// Flights of each row, with seeds that chose no number of the estimator.
const FLIGHTS: u32 = 12;

fn estimator(change: impl Fn(&str) -> String) -> Plan {
    let seeds = [("samples = 50", "samples = 12"), ("\nseed = 1\n", "\nseed = 4001\n")];
    study("estimator", |text| change(&with(text, &seeds)))
}

/// Band in which the mean NEES of so many flights lies with 95 % probability: χ² with 3 N degrees of freedom over N, by the
/// approximation of Wilson and Hilferty (1931), which is good to a thousandth here.
fn band(flights: u32) -> [f64; 2] {
    let freedom = 3.0 * f64::from(flights);
    [-1.96, 1.96].map(|deviations: f64| {
        let part = 2.0 / (9.0 * freedom);
        let root = 1.0 - part + deviations * part.sqrt();
        3.0 * root * root * root
    })
}

#[test]
fn the_errors_are_as_large_as_the_estimator_says() {
    // χ² with 150 degrees of freedom: 117.985 and 185.800 (tables).
    for (ours, table) in band(50).into_iter().zip([117.985, 185.800]) {
        assert!((ours - table / 50.0).abs() < 2.0e-3, "{ours}");
    }
    let plan = estimator(str::to_owned);
    let flown = fly(&plan, |_| true);
    let [low, high] = band(FLIGHTS);
    for sensors in SENSORS {
        let of = flown.iter().filter(|(run, _)| value(&plan, run, "sensors") == sensors);
        let of: Vec<&Outcome> = of.map(|(_, outcome)| outcome).collect();
        assert_eq!(of.len(), FLIGHTS as usize);
        for group in GROUPS {
            let nees = mean(&of, &format!("nees_{group}"));
            assert!((low..=high).contains(&nees), "{sensors}, {group}: {nees:.2}");
        }
        assert!(of.iter().all(|o| o.is_kept() && metric(o, "realigned") == 0.0), "{sensors}");
    }
}

/// What the study would say of an estimator that believes in better gyros, accelerometers and velocities than there are.
#[test]
fn an_estimator_that_trusts_its_sensors_too_much_is_outside_the_band() {
    let trusting = "set = { FTC_MODE = 0, EST_GYR_N = 0.0005, EST_GYR_B = 0.0009, EST_ACC_B = 0.003, EST_GPS_V = 0.02 }";
    let plan = estimator(|text| with(text, &[("set = { FTC_MODE = 0 }", trusting)]));
    let flown = fly(&plan, |run| value(&plan, run, "sensors") == "tactical");
    let of: Vec<&Outcome> = flown.iter().map(|(_, outcome)| outcome).collect();
    for group in ["velocity", "gyro_bias", "accelerometer_bias"] {
        let nees = mean(&of, &format!("nees_{group}"));
        assert!(nees > band(FLIGHTS)[1], "{group}: {nees:.2}");
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
    let case = |(number, (latitude, longitude)): (u32, (f64, f64))| {
        let heading = (f64::from(number) * 77.0) % 360.0 - 180.0;
        format!(
            "[[joint.case]]\nname = \"{latitude:.1}, {longitude:.1}, {heading} deg\"\n\"plant.start.latitude_deg\" = {latitude:?}\n\
             \"plant.start.longitude_deg\" = {longitude:?}\n\"plant.start.heading_deg\" = {heading:?}\n"
        )
    };
    let places: String = (0..).zip(steep.into_iter().chain(spread)).map(case).collect();
    let plan = estimator(|text| {
        let short = [("samples = 12", "samples = 1"), ("duration_s = 180.0", "duration_s = 60.0")];
        format!("{}[[joint]]\nname = \"place\"\n{places}", with(text, &short))
    });
    for (run, outcome) in fly(&plan, |run| !value(&plan, run, "sensors").contains("vanes")) {
        assert!(outcome.is_kept(), "{}: {outcome}", value(&plan, &run, "place"));
    }
}

/// The study of lost sensors with another seed and number of flights in each row.
fn losses(text: &str, seed: u32, flights: u32) -> String {
    let [seed, samples] = [format!("\nseed = {seed}\n"), format!("samples = {flights}\n")];
    with(text, &[("\nseed = 1\n", seed.as_str()), ("samples = 4\n", &samples)])
}

/// Straight flights and turns, in still air and in turbulence, for 600 s without a pitot tube.
#[test]
fn without_a_pitot_tube_the_airspeed_stays_that_of_ground_speed_and_the_last_wind() {
    for airframe in &["tvc_jet", "f16"][..long_or(2, 1) as usize] {
        let aircraft = format!("[[airframe]]\nname = \"{airframe}\"\nfile = \"{airframe}\"\n");
        let plan = study("sensor-losses", |text| losses(text, 70001, 4) + &aircraft);
        let flown = fly(&plan, |run| {
            value(&plan, run, "sensors") == "tactical" && value(&plan, run, "sensor") == "pitot"
        });
        for turbulence in ["0", "1.5", "3"] {
            for flight in ["straight", "turns"] {
                let is_it = |(run, _): &&(Run, Outcome)| {
                    value(&plan, run, "plant.wind.turbulence_m_s") == turbulence
                        && value(&plan, run, "flight") == flight
                };
                let of: Vec<&Outcome> = flown.iter().filter(is_it).map(|(_, o)| o).collect();
                let what = format!("{airframe}, {turbulence} m/s, {flight}");
                assert!(of.len() == 4 && of.iter().all(|outcome| outcome.is_kept()), "{what}");
                let lost = |outcome: &&Outcome| {
                    let lost = &outcome.sensors_lost;
                    lost.iter().any(|l| l.sensor == "pitot" && l.why == "no valid samples")
                };
                assert!(of.iter().all(lost), "{what}");
                let largest_m = of.iter().map(|o| metric(o, "altitude_deviation_largest"));
                assert!(largest_m.fold(0.0, f64::max) < 100.0, "altitude, {what}");
                let error = rms(&of, "airspeed_estimate_rms");
                let stated = rms(&of, "airspeed_estimate_stated_rms");
                let rms: f64 = turbulence.parse().expect("a number");
                // Gusts along the flight, which nothing shows any more, and what the wind was not known by before.
                assert!(error < 1.0 + 1.2 * rms, "{error} m/s, {what}");
                assert!(
                    stated > error && stated < 1.5 + 1.5 * rms,
                    "{error}, {stated} m/s, {what}"
                );
                let nees = mean(&of, "wind_nees");
                assert!(nees < 6.0, "{nees}, {what}");
            }
        }
    }
}

const AEROSONDE: &str = "[[airframe]]\nname = \"aerosonde\"\nfile = \"aerosonde\"\n";

/// It flies at 25 m/s: gusts turn the flow by 20 deg, and errors that last are large against what the sensors show.
#[test]
fn an_aerosonde_is_kept_in_3_m_s_with_and_without_a_pitot_tube() {
    let plan = study("sensor-losses", |text| losses(text, 1, long_or(4, 1)) + AEROSONDE);
    let flown = fly(&plan, |run| {
        let sensor = value(&plan, run, "sensor");
        sensor == "pitot" || (sensor == "none" && value(&plan, run, "flight") == "straight")
    });
    for sensors in ["tactical", "consumer"] {
        for sensor in ["none", "pitot"] {
            for turbulence in ["0", "1.5", "3"] {
                let is_it = |(run, _): &&(Run, Outcome)| {
                    value(&plan, run, "sensors") == sensors
                        && value(&plan, run, "sensor") == sensor
                        && value(&plan, run, "plant.wind.turbulence_m_s") == turbulence
                };
                let of: Vec<&Outcome> = flown.iter().filter(is_it).map(|(_, o)| o).collect();
                let what = format!("{sensors}, {sensor}, {turbulence} m/s");
                assert!(of.iter().all(|outcome| outcome.is_kept()), "{what}");
                let error = rms(&of, "airspeed_estimate_rms");
                assert!(error < 2.5, "{error} m/s, {what}");
                // What the pitot tube is wrong by is known too well in straight flight: docs/estimation.md.
                if sensor == "pitot" {
                    let stated = rms(&of, "airspeed_estimate_stated_rms");
                    let is_fit = stated > 0.75 * error && stated < 3.0 * error;
                    assert!(is_fit, "{error}, {stated} m/s, {what}");
                }
            }
        }
    }
}

/// Wind and gusts follow a drift of 0.1 m/s² unseen; lift does not.
#[test]
fn a_slow_drift_of_the_pitot_tube_is_found_by_the_lift() {
    for rate in ["3.0", "-3.0"] {
        let drift = format!(
            "\"plant.fault.1.kind\" = \"drifting\"\n\"plant.fault.1.rate_pa_s\" = {rate}\n"
        );
        let plan = study("sensor-losses", |text| {
            let off = ("\"plant.fault.1.kind\" = \"off\"\n", drift.as_str());
            let others = SensorKind::ALL.into_iter().filter(|s| *s != SensorKind::Pitot);
            let only = others.fold(text.to_owned(), |text, sensor| {
                let (name, key) = (sensor.name(), sensor.key());
                let case = format!(
                    "[[joint.case]]\nname = \"{name}\"\n\"plant.fault.1.sensor\" = \"{key}\"\n"
                );
                text.replace(&case, "")
            });
            losses(&with(&only, &[off]), 70001, long_or(4, 1)) + AEROSONDE
        });
        let flown = fly(&plan, |run| {
            value(&plan, run, "sensors") == "tactical"
                && value(&plan, run, "sensor") == "pitot"
                && value(&plan, run, "flight") == "straight"
                && value(&plan, run, "plant.wind.turbulence_m_s") == "1.5"
        });
        for (_, outcome) in &flown {
            let found = outcome.sensors_lost.iter().any(|lost| lost.sensor == "pitot");
            assert!(outcome.is_kept() && found, "{rate} Pa/s: {outcome:?}");
            let largest = metric(outcome, "airspeed_estimate_largest");
            assert!(largest < 3.0 + 3.0 * 1.5, "{rate} Pa/s: {largest} m/s");
        }
    }
}

#[test]
fn each_fault_of_each_sensor_has_the_outcome_of_the_document() {
    let plan = study("sensor-faults", str::to_owned);
    let flown = fly(&plan, |run| value(&plan, run, "sensors") == "tactical");
    let kinds = |sensor| {
        let class = TargetClass::Sensor(sensor);
        CATALOGUE.iter().filter(|info| info.targets.allow(class)).count()
    };
    // All but the attitude unit and those of ground and tank, which these aircraft have not.
    let lacking = [
        SensorKind::Attitude,
        SensorKind::RadarAltimeter,
        SensorKind::WeightOnWheels,
        SensorKind::FuelGauge,
    ];
    let all = SensorKind::ALL.into_iter().filter(|sensor| !lacking.contains(sensor));
    assert_eq!(flown.len(), all.map(kinds).sum::<usize>());
    let of = |sensor: &str| {
        let of = flown.iter().filter(|(run, _)| value(&plan, run, "fault").starts_with(sensor));
        of.map(|(_, outcome)| outcome).collect::<Vec<_>>()
    };
    for (run, outcome) in &flown {
        let fault = value(&plan, run, "fault");
        // Nothing stands in for rates; a slow error of the vanes is taken for sideslip.
        let is_lost = ["gyro off", "gyro stuck", "gyro delayed", "gyro there", "vanes drifting"];
        let is_lost = is_lost.iter().any(|lost| fault.starts_with(lost));
        assert_eq!(!outcome.is_kept(), is_lost, "{fault}: {outcome}");
        if is_lost {
            continue;
        }
        let attitude = metric(outcome, "attitude_error_end").to_degrees();
        let airspeed = metric(outcome, "airspeed_error_end");
        let altitude = metric(outcome, "altitude_error_end");
        let is_right = attitude < 7.0 && airspeed < 3.0 && altitude < 3.0;
        assert!(
            is_right,
            "after the repair of {fault}: {attitude} deg, {airspeed} m/s, {altitude} m"
        );
        // The estimator reads all but the engine monitor, and sees what is not there or does not change.
        let expected = match fault.as_str() {
            fault if fault.starts_with("engine monitor") => SourceHealth::Unused,
            fault if fault.ends_with("off") || fault.contains("there") => SourceHealth::Lost,
            fault if fault.ends_with("stuck") => SourceHealth::Stuck,
            _ => continue,
        };
        assert_eq!(metric(outcome, "sensor_health"), f64::from(expected as u8), "{fault}");
    }
    // Faults that the estimator cannot see are felt.
    let felt = |sensor: &str, name: &str, least: f64| {
        let worst = of(sensor).iter().filter_map(|o| o.metric(name)).fold(0.0, f64::max);
        assert!(worst > least, "{sensor}: {worst}");
    };
    felt("gyro", "attitude_error", 10.0_f64.to_radians());
    felt("accelerometer", "attitude_error", 10.0_f64.to_radians());
    felt("gnss", "altitude_error", 100.0);
    felt("barometer", "airspeed_error", 6.0);
    felt("pitot", "airspeed_error", 11.0);
    felt("magnetometer", "attitude_error", 0.2_f64.to_radians());
    // A wrong sideslip looks like a fault of an effector, also where the aircraft is kept.
    let of_vanes = of("vanes").into_iter().filter(|outcome| outcome.is_kept());
    let awake = of_vanes.map(|o| metric(o, "compensator_active")).fold(0.0, f64::max);
    assert!(awake > 0.4, "the compensator is active for {awake} of the flight");
}

fn sum(flown: &[&Outcome], name: &str) -> f64 {
    flown.iter().map(|outcome| metric(outcome, name)).sum()
}

/// Healthy flights of these laws and sensors, three hours with `samples` of 4.
fn healthy(
    change: &[(&str, &str)],
    laws: &[usize],
    sensors: &[&str],
) -> (Plan, Vec<(Run, Outcome)>) {
    let plan = study("false-alarms", |text| with(text, change));
    let flown = fly(&plan, |run| {
        laws.contains(&run.law) && sensors.contains(&value(&plan, run, "sensors").as_str())
    });
    (plan, flown)
}

#[test]
fn healthy_flight_in_moderate_turbulence_has_no_more_alarms_than_the_stated_rate() {
    let samples = long_or(4, 1);
    let of_each = format!("samples = {samples}");
    let change = [("samples = 2", of_each.as_str()), ("\nseed = 1\n", "\nseed = 1000\n")];
    let (plan, flown) = healthy(&change, &[0], &["ideal", "tactical"]);
    for sensors in ["ideal", "tactical"] {
        let of = flown.iter().filter(|(run, _)| value(&plan, run, "sensors") == sensors);
        let of: Vec<&Outcome> = of.map(|(_, outcome)| outcome).collect();
        assert!(
            of.iter().all(|outcome| outcome.is_kept()),
            "{sensors}: a healthy aircraft was lost"
        );
        // The air reaches the detector: a study of calm air would show nothing.
        let least = ["roll", "pitch", "yaw"].map(|axis| rms(&of, &format!("z2_{axis}_rms")));
        assert!(least.iter().all(|rms| *rms > 0.03), "{sensors}: z2 over its level {least:?}");
        let hours = sum(&of, "healthy_s") / 3_600.0;
        assert!(hours >= 0.75 * f64::from(samples), "{hours} h");
        let alarms = sum(&of, "alarms_at_1");
        assert!(alarms <= hours, "{sensors}: {alarms} alarms in {hours} h");
    }
}

/// Below the design Mach number the model explains too much of the flow angles, which are largest there.
#[test]
fn the_rate_holds_at_the_slowest_condition_alone() {
    let samples = long_or(18, 3);
    let of_each = format!("samples = {samples}");
    let change = [("samples = 2", of_each.as_str()), ("\nseed = 1\n", "\nseed = 31000\n")];
    let plan = study("false-alarms", |text| with(text, &change));
    let flown = fly(&plan, |run| {
        run.law == 0
            && value(&plan, run, "sensors") == "tactical"
            && value(&plan, run, "condition") == "200 m/s at 2000 m"
    });
    let of: Vec<&Outcome> = flown.iter().map(|(_, outcome)| outcome).collect();
    let (alarms, hours) = (sum(&of, "alarms_at_1"), sum(&of, "healthy_s") / 3_600.0);
    assert!(hours >= f64::from(samples) / 6.0 && alarms <= hours, "{alarms} alarms in {hours} h");
}

/// The rate is not that of a deaf detector.
#[test]
fn with_tactical_sensors_faults_are_noticed_nearly_as_soon_as_with_the_levels_of_ideal_ones() {
    let plan = study("detection", |text| with(text, &[("\nseed = 1\n", "\nseed = 1000\n")]));
    let flown = fly(&plan, |run| value(&plan, run, "sensors") == "tactical");
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
        let of = flown.iter().filter(|(run, _)| value(&plan, run, "fault") == name);
        let mut delays: Vec<f64> = of.map(|(_, o)| metric(o, "detection_delay")).collect();
        delays.sort_by(f64::total_cmp);
        assert_eq!(delays.len(), 5, "{name}");
        assert!(delays[2] <= 1.5 * before_s, "{name}: {} s, before {before_s} s", delays[2]);
    }
}

/// The aircraft of the paper, whose derivatives are those of the model.
const PAPER: [(&str, &str); 1] = [("file = \"tvc_jet_mach\"", "file = \"tvc_jet\"")];

/// Air that wakes the detector is compensated late by the nozzle, and z2 follows the command of the nozzle as it would
/// with a part of its effect gone. Without the hypothesis of the air, dozens of names come in half an hour of each law.
#[test]
fn no_effector_is_named_in_turbulence_that_wakes_the_detector() {
    let rough = ("\"plant.wind.turbulence_m_s\" = 3.0", "\"plant.wind.turbulence_m_s\" = 6.0");
    let change =
        [PAPER[0], rough, ("samples = 2", "samples = 1"), ("\nseed = 1\n", "\nseed = 20\n")];
    let laws = &[1, 2, 3][..long_or(3, 1) as usize];
    let (_, flown) = healthy(&change, laws, &["ideal"]);
    for &law in laws {
        let of = flown.iter().filter(|(run, _)| run.law == law);
        let of: Vec<&Outcome> = of.map(|(_, outcome)| outcome).collect();
        assert!(sum(&of, "woken") >= 2.0, "the detector wakes in this air: law {law}");
        assert!(sum(&of, "alarms_at_1") >= 20.0, "and again: law {law}");
        let is_kept = of.iter().all(|outcome| outcome.is_kept());
        assert!(is_kept && sum(&of, "names") == 0.0, "law {law}");
    }
}

/// What the errors of the sensors do to the estimate wanders; without the hypothesis of it effectors are named in these flights.
#[test]
fn no_effector_is_named_because_of_the_errors_of_sensors() {
    let change = [PAPER[0], ("samples = 2", "samples = 1"), ("\nseed = 1\n", "\nseed = 20\n")];
    let laws = &[3, 2, 1][..long_or(3, 1) as usize];
    let (plan, flown) = healthy(&change, laws, &["tactical", "consumer"]);
    for (run, outcome) in &flown {
        let sensors = value(&plan, run, "sensors");
        let is_right = outcome.is_kept() && metric(outcome, "names") == 0.0;
        assert!(is_right, "{sensors}, law {}: {outcome}", run.law);
    }
}

/// A sample of `sitl study isolation-pairs`: every two effectors, jammed where the use of the verdict is good for something.
#[test]
fn the_use_of_the_verdict_loses_no_pair_that_is_kept_without_it() {
    const ANGLES: [&str; 3] = ["-0.8 and 0.8", "0.3 and 0.8", "0.3 and -0.8"];
    let angles_flown = &ANGLES[..long_or(3, 1) as usize];
    let plan = study("isolation-pairs", str::to_owned);
    let flown = fly(&plan, |run| {
        let angles = value(&plan, run, "angles");
        run.airframe == 0 && angles_flown.iter().any(|two| angles.starts_with(two))
    });
    assert_eq!(flown.len(), 2 * 21 * 2 * angles_flown.len());
    let mut saved = 0;
    for pair in flown.chunks(2) {
        let [without, with] = [0, 1].map(|law| pair[law].1.is_kept());
        assert!(with || !without, "{}: {}", pair[1].0.number, pair[1].1);
        saved += u32::from(with && !without);
    }
    assert!(saved as usize >= angles_flown.len().min(2), "{saved}: it is good for something");
}

#[test]
fn what_a_study_cannot_have_is_named_with_what_it_can() {
    let refused = |name: &str, from: &str, to: &str| {
        let text = STUDIES.iter().find(|(known, _)| *known == name).expect("it is shipped").1;
        assert!(text.contains(from), "{name}: {from}");
        let text = text.replacen(from, to, 1);
        let file = SpecFile::parse(name, text, PathBuf::new());
        file.and_then(Plan::new).map(drop).expect_err(to).to_string()
    };
    for (name, from, to, expected) in [
        (
            "estimator",
            "rows = [\"sensors\"]",
            "rows = [\"sensor\"]",
            "airframe, law, or a variable",
        ),
        ("estimator", "of = \"nees_wind\"", "of = \"nees_air\"", "no measure nees_air"),
        ("estimator", "as = \"mean\"", "as = \"average\"", "unknown variant `average`"),
        ("estimator", "turn_s = 15.0", "turn_s = 0.0", "manoeuvres.turn_s = 0: expected 1 to"),
        (
            "estimator",
            "altitude_part = 0.06",
            "altitude_part = nan",
            "altitude_part = NaN: expected 0",
        ),
        ("estimator", "roll_deg = [10.0, 40.0]", "roll_deg = [40.0, 10.0]", "rising order"),
        ("estimator", "seeds = \"samples\"", "seeds = \"sample\"", "unknown variant `sample`"),
        ("estimator", "name = \"consumer\"\n", "name = \"tactical\"\n", "each name once"),
        (
            "estimator",
            "grade\" = \"tactical\"",
            "grad\" = \"tactical\"",
            "nearest is plant.sensors.grade",
        ),
        ("false-alarms", "law = \"detector alone\"", "law = \"none\"", "the name of a [[law]]"),
        ("envelope", "as = \"factor\"", "as = \"error\"", "[[joint.case]] or each alone"),
        ("isolation-pairs", "each = \"two_angles\"", "each = \"two\"", "unknown variant `two`"),
        (
            "isolation",
            "\"plant.fault.1.angle_deg\" = -1.0",
            "\"plant.fault.1.angle_deg\" = -1.5",
            "expected -1 to 1",
        ),
    ] {
        let message = refused(name, from, to);
        assert!(message.contains(expected), "{name}, {to}: {message}");
    }
}
