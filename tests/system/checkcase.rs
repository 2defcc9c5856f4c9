//! Check cases of NASA's Engineering and Safety Center, flown by the plant and compared with NASA's own simulators.
//!
//! A few reference points stand here. With the reference data (`TWO_STEP_REFERENCE_DATA`, whose folder `checkcases` has them) every
//! case is compared at every time, by the rule of the data's own checker.

mod law;
use crate::programs;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use lab_studies::checkcase::reference::References;
use lab_studies::checkcase::report::compare;
use lab_studies::checkcase::{CheckcaseArgs, Flight};
use plant_sim::scenario::case::CheckCase;
use programs::program;

/// Steps of the integration that every case passes with, ms.
const STEPS_MS: [f64; 2] = [1.0, 10.0];

/// The cases with reference data.
const CASES: [&str; 6] = [
    "01_dropped_sphere",
    "02_tumbling_brick",
    "03_tumbling_brick_with_damping",
    "06_sphere_with_drag",
    "07_sphere_in_wind",
    "11_f16_subsonic",
];

/// Columns of [`POINTS`] with the tolerance of each: a centimetre (1e-7 deg is 11 mm), 1 mm/s, a millidegree of attitude, 1e-5 rad/s.
/// The checker's own floors, and for the tumbling brick ten times its floor for the rates.
const COLUMNS: [(&str, f64); 12] = [
    ("lat_deg", 1.0e-7),
    ("lon_deg", 1.0e-7),
    ("alt_m", 0.01),
    ("vn_mps", 0.001),
    ("ve_mps", 0.001),
    ("vd_mps", 0.001),
    ("yaw_deg", 0.002),
    ("pitch_deg", 0.002),
    ("roll_deg", 0.002),
    ("p_rps", 1.0e-5),
    ("q_rps", 1.0e-5),
    ("r_rps", 1.0e-5),
];

/// Case, time in s and the values of [`COLUMNS`], from the trajectories of simulator 5 of the NESC check cases
/// (NASA/TM-2015-218675; public archive of the simupy-flight repository, in SI units).
#[rustfmt::skip]
const POINTS: [(&str, f64, [f64; 12]); 10] = [
    ("01", 30.0, [0.0, 5.745522184e-05, 4754.546047, 0.0, 0.64038818, 292.697326, 0.0, 0.0, -0.12539968, 0.0, 0.0, 0.0]),
    ("02", 10.0, [0.0, 2.126541507e-06, 8656.382201, 0.0, 0.0711180174, 97.5260413, -4.3213123, 3.7413421, -66.019038, -0.042217597, -0.41107001, 0.49093648]),
    ("02", 30.0, [0.0, 5.745522184e-05, 4754.546047, 0.0, 0.64038818, 292.697326, -4.2892885, -3.8196332, -56.151275, 0.22023304, -0.30364268, 0.54313953]),
    ("03", 10.0, [0.0, 2.126541507e-06, 8656.382201, 0.0, 0.0711180174, 97.5260413, -142.90993, -36.559914, 14.543391, -0.0021432189, -0.00076587523, 0.14707315]),
    ("03", 30.0, [0.0, 5.745522184e-05, 4754.546047, 0.0, 0.64038818, 292.697326, -111.35575, -38.699669, -5.1522478, -2.0724446e-05, 6.6148714e-05, 2.2942162e-05]),
    ("06", 30.0, [0.0, 5.337981987e-05, 4963.498759, 0.0, 0.561725209, 263.350479, 0.0, 0.0, -0.1253956, 0.0, 0.0, 0.0]),
    ("07", 10.0, [0.0, 4.777493155e-06, 8658.71682, 0.0, 0.158340045, 96.5897054, 0.0, 0.0, -0.041785519, 0.0, 0.0, 0.0]),
    ("07", 30.0, [0.0, 0.0001285418332, 4963.717446, 0.0, 1.43511413, 263.33709, 0.0, 0.0, -0.12547077, 0.0, 0.0, 0.0]),
    ("11", 60.0, [36.08490213, -75.59310169, 3051.961865, 121.373771, 122.463832, 7.12191165e-05, 45.254097, 2.6389021, -0.041941036, 3.3470924e-05, -6.8924009e-05, 2.8078359e-06]),
    ("11", 180.0, [36.21574214, -75.42944493, 3051.942458, 120.785814, 123.044492, 0.000246526993, 45.527321, 2.6388419, -0.073420921, 4.0105797e-05, -6.8998019e-05, -2.7759661e-05]),
];

/// An error put into a case.
type Change = fn(&mut CheckCase);

fn scenario(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../plant-sim/checkcases");
    folder.join(name).with_extension("toml")
}

/// The rows of a case by time in ms, each by column.
fn flown(name: &str, step_ms: f64) -> BTreeMap<u64, BTreeMap<String, f64>> {
    let case = CheckcaseArgs::of(scenario(name), Some(step_ms)).case().expect("a shipped case");
    let mut lines = Vec::new();
    let mut flight = Flight::new(name, &case).expect("it begins");
    flight
        .fly(&mut |line| {
            lines.push(line.to_owned());
            Ok(())
        })
        .expect("it comes to its end");
    let names: Vec<&str> = lines[0].split(',').collect();
    let row = |line: &String| {
        let values = line.split(',').map(|cell| cell.parse().expect("a number"));
        let row: BTreeMap<String, f64> =
            names.iter().map(|name| (*name).to_owned()).zip(values).collect();
        ((row["time_s"] * 1_000.0).round() as u64, row)
    };
    lines[1..].iter().map(row).collect()
}

#[test]
fn val_reference_points_of_nasas_finest_simulator_are_met_at_both_steps() {
    for name in CASES {
        let points: Vec<_> = POINTS.iter().filter(|point| name.starts_with(point.0)).collect();
        if points.is_empty() {
            continue;
        }
        for step_ms in STEPS_MS {
            let rows = flown(name, step_ms);
            for (_, time_s, values) in &points {
                let row = &rows[&((time_s * 1_000.0) as u64)];
                for ((column, tolerance), expected) in COLUMNS.into_iter().zip(values) {
                    let ours = row[column];
                    assert!(
                        (ours - expected).abs() <= tolerance,
                        "{name}, {step_ms} ms, {time_s} s: {column} {ours} instead of {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn val_every_case_is_inside_the_spread_of_nasas_simulators() {
    let Some(folder) = std::env::var_os("TWO_STEP_REFERENCE_DATA") else { return };
    let references =
        References::open(&Path::new(&folder).join("checkcases/data")).expect("the reference data");
    for name in CASES {
        for step_ms in STEPS_MS {
            let case = CheckcaseArgs::of(scenario(name), Some(step_ms)).case().expect("shipped");
            let compared = compare(name, &case, &references).expect("it can be compared");
            assert!(
                compared.deviations.len() >= 12,
                "{name}: {} quantities",
                compared.deviations.len()
            );
            for of in &compared.deviations {
                let what = format!("{name}, {step_ms} ms, {}: {of:?}", of.quantity.name);
                assert!(of.passes() && of.passes_tight(), "{what}");
            }
        }
    }
}

#[test]
fn a_plant_with_a_small_error_is_found_by_the_comparison() {
    // The comparison has to see an error that matters: 1 % of inertia, mass or wind, the sign of a product of inertia.
    let Some(folder) = std::env::var_os("TWO_STEP_REFERENCE_DATA") else { return };
    let references =
        References::open(&Path::new(&folder).join("checkcases/data")).expect("the reference data");
    let changes: [(&str, Change); 4] = [
        ("02_tumbling_brick", |case| case.setup.airframe.mass.iyy_kg_m2 *= 1.01),
        ("06_sphere_with_drag", |case| case.setup.airframe.mass.mass_kg *= 1.01),
        ("07_sphere_in_wind", |case| case.setup.wind.speed_m_s *= 1.01),
        ("11_f16_subsonic", |case| case.setup.airframe.mass.ixz_kg_m2 *= -1.0),
    ];
    for (name, change) in changes {
        let mut case = CheckcaseArgs::of(scenario(name), Some(10.0)).case().expect("shipped");
        change(&mut case);
        let compared = compare(name, &case, &references).expect("it can be compared");
        assert!(
            compared.deviations.iter().any(|of| !of.passes_tight()),
            "{name}: nothing is farther away than allowed"
        );
    }
}

fn sitl(words: &[&str]) -> Output {
    Command::new(program("sitl")).args(words).output().expect("the built program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn the_command_writes_the_trajectory_and_keeps_it_the_same_to_the_bit() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let out = folder.path().join("run.csv").display().to_string();
    let case = scenario("11_f16_subsonic").display().to_string();
    let words =
        ["checkcase", &case, "--step-ms", "10", "--set", "plant.duration_s=2", "--out", &out];
    let first = sitl(&words);
    assert!(first.status.success(), "{}", text(&first.stderr));
    let said = text(&first.stdout);
    assert!(said.contains("trim: pitch 2.63894 deg, elevator -3.23276 deg"), "{said}");
    let rows = fs::read_to_string(&out).expect("it was written");
    assert!(rows.starts_with("time_s,lat_deg,lon_deg,alt_m,vn_mps,ve_mps,vd_mps,"), "{rows}");
    assert_eq!(rows.lines().count(), 42, "a header and 20 rows a second for 2 s");
    // It may replace what it wrote, and nothing else.
    assert!(sitl(&words).status.success());
    assert_eq!(fs::read_to_string(&out).expect("it was written"), rows);
    fs::write(&out, "my notes").expect("a writable file");
    let refused = text(&sitl(&words).stderr);
    assert!(refused.contains("--out") && refused.contains("run.csv"), "{refused}");
    assert_eq!(fs::read_to_string(&out).expect("it is there"), "my notes");
}

#[test]
fn a_case_that_reaches_the_ground_keeps_its_rows_and_says_so() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let out = folder.path().join("run.csv").display().to_string();
    let case = scenario("01_dropped_sphere").display().to_string();
    let height = "plant.initial_state.altitude_m=30";
    let output = sitl(&["checkcase", &case, "--set", height, "--out", &out]);
    let said = text(&output.stderr);
    assert!(!output.status.success() && said.contains("ground contact after 2.4"), "{said}");
    let rows = fs::read_to_string(&out).expect("the rows until then");
    assert!(rows.lines().count() > 45, "{rows}");
}

#[test]
fn what_is_wrong_is_said_with_file_key_value_and_expectation() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let out = path("run.csv");
    let good = fs::read_to_string(scenario("06_sphere_with_drag")).expect("a shipped case");
    let write = |from: &str, to: &str| {
        assert!(good.contains(from), "the file has no {from}");
        let file = path("my.toml");
        fs::write(&file, good.replace(from, to)).expect("a writable folder");
        file
    };
    let sphere = scenario("sphere").display().to_string();
    fs::copy(&sphere, path("sphere.toml")).expect("a writable folder");
    for (from, to, problem) in [
        (
            "altitude_ft",
            "altitude_slug",
            "my.toml: plant.initial_state.altitude_slug: the unit slug does not fit, expected one of altitude_m",
        ),
        ("duration_s", "duration", "unknown field `duration`"),
        ("sphere.toml", "cube.toml", "cube.toml: No such file"),
        (
            "reference",
            "output_rate_hz = 7\nreference",
            "[checkcase] output_rate_hz = 7 is no whole number of steps of 1 ms",
        ),
    ] {
        let output = sitl(&["checkcase", &write(from, to), "--out", &out]);
        let said = text(&output.stderr);
        assert!(!output.status.success() && said.contains(problem), "{said}");
        assert!(!said.contains("panicked"), "{said}");
        assert!(!Path::new(&out).exists(), "nothing is written");
    }
    let case = scenario("06_sphere_with_drag").display().to_string();
    for (words, problem) in [
        (["--out", "/no/such/folder/run.csv"], "--out /no/such/folder/run.csv: No such file"),
        (["--out", "/"], "--out /: this is a folder"),
    ] {
        let said = text(&sitl(&[&["checkcase", &case][..], &words].concat()).stderr);
        assert!(said.contains(problem), "{said}");
    }
    for (option, value, problem) in [
        ("--step-ms", "-1", "step_ms = -1 is outside 0.1 to 100"),
        ("--step-ms", "nan", "step_ms = NaN is outside"),
        ("--rate-hz", "inf", "output_rate_hz = inf is outside"),
        (
            "--set",
            "checkcase.flat_gravity_m_s2=9.75",
            "flat_gravity_m_s2 has no meaning on this Earth",
        ),
        ("--set", "FTC_MODE=1", "--set FTC_MODE: a check case has no controller"),
        ("--set", "airframe.mass.mass_kg=-1", "mass_kg = -1 is outside 1 to 1000000"),
        ("--airframe", "/no/such.toml", "/no/such.toml: No such file"),
    ] {
        let said = text(&sitl(&["checkcase", &case, "--out", &out, option, value]).stderr);
        assert!(said.contains(problem), "{said}");
    }
    let fly = text(&sitl(&["fly", &case]).stderr);
    assert!(fly.contains("[checkcase] has no meaning beside an autopilot"), "{fly}");
}
