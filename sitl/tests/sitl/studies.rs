//! Every study flies every aircraft, refuses what it sets itself, and finds a place that cannot be written before it flies.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use sitl::cli::{self, Cli};

fn sitl(words: &[&str]) -> Result<u8, String> {
    let words = ["sitl"].iter().chain(words).map(OsString::from);
    let cli = Cli::read(words).map_err(|error| error.to_string())?;
    cli::run(&cli, Path::new("sitl"), &[]).map_err(|error| error.to_string())
}

/// Short forms of the studies, with the options that make them so.
const STUDIES: [&[&str]; 8] = [
    &["false-alarms", "--samples", "1", "--set", "plant.duration_s=15"],
    &["isolation", "--set", "plant.duration_s=2"],
    &["estimator", "--samples", "1", "--set", "plant.duration_s=25"],
    &["sensors", "--grade", "tactical", "--seconds", "5"],
    &["envelope", "--set", "plant.duration_s=2"],
    &["sensor-faults", "--set", "plant.duration_s=2"],
    &["jam-table", "--set", "plant.duration_s=2"],
    &["detection-jams", "--samples", "1", "--set", "plant.duration_s=21"],
];

#[test]
fn a_study_flies_an_aircraft_that_is_not_the_jet_and_says_all_that_it_flew() {
    let home = tempfile::tempdir().expect("a folder");
    for study in STUDIES {
        let out = home.path().join(study[0]);
        let words = ["--airframe", "aerosonde", "--out", out.to_str().expect("a name")];
        let words = [&["study"], study, &words].concat();
        assert_eq!(sitl(&words), Ok(0), "{words:?}");
        let paths =
            || fs::read_dir(&out).expect("it is there").map(|entry| entry.expect("it").path());
        assert!(paths().count() >= 3, "{words:?}");
        let tables = paths().filter(|path| path.extension().is_some_and(|ending| ending == "csv"));
        let alone = |path: &PathBuf| !path.with_extension("parquet").is_file();
        assert_eq!(
            tables.filter(alone).collect::<Vec<_>>(),
            [""; 0].map(PathBuf::from),
            "{words:?}"
        );
        // The sensors are those of a flight without a law.
        if study[0] != "sensors" {
            let setup = fs::read_to_string(out.join("setup.json")).expect("it is there");
            assert!(setup.contains("\"aerosonde\"") && setup.contains("\"duration_s\""), "{setup}");
        }
    }
}

#[test]
fn what_a_study_sets_itself_is_refused_and_not_silently_replaced() {
    let refused = |study: &[&str], more: &[&str]| {
        let words = [&["study"], study, more, &["--out", "/nowhere/at/all"]].concat();
        sitl(&words).expect_err("it has no effect")
    };
    for (study, option) in [
        (0, ["--set", "plant.start.airspeed_m_s=400"]),
        (0, ["--set", "plant.sensors.grade=tactical"]),
        (1, ["--set", "FTC_ALLOC=1"]),
        (1, ["--set", "plant.seed=4"]),
        (2, ["--set", "plant.wind.speed_m_s=5"]),
        (2, ["--set", "autopilot.reference.1.altitude_m=9"]),
        (4, ["--set", "autopilot.reference.1.altitude_m=9"]),
        (5, ["--set", "plant.fault.1.kind=off"]),
    ] {
        let error = refused(STUDIES[study], &option);
        let is_refused = error.contains("has no effect") || error.contains("sets this one");
        assert!(is_refused, "{study} {option:?}: {error}");
    }
}

#[test]
fn a_place_that_cannot_be_written_is_named_before_the_work() {
    for study in STUDIES.into_iter().chain([&["mission"][..]]) {
        let error = sitl(&[&["study"], study, &["--out", "/proc/self/x"]].concat());
        let error = error.expect_err("the kernel takes no folder");
        assert!(error.contains("cannot write /proc/self/x"), "{study:?}: {error}");
    }
    let error = sitl(&["study", "jams", "--out", "/proc/self/x"]).expect_err("no file either");
    assert!(error.contains("/proc/self/x"), "{error}");
}

/// The finished flights of a folder are those of one specification with its options.
#[test]
fn a_study_with_other_options_needs_a_folder_of_its_own() {
    let home = tempfile::tempdir().expect("a folder");
    let out = home.path().join("estimator");
    let words = [&["study"], STUDIES[2], &["--out", out.to_str().expect("a name")]].concat();
    assert_eq!(sitl(&words), Ok(0));
    assert_eq!(sitl(&words), Ok(0), "the same again");
    for other in [["--seed", "7"], ["--airframe", "f16"], ["--set", "plant.earth=flat"]] {
        let refused = sitl(&[&words[..], &other].concat()).expect_err("of something else");
        assert!(refused.contains("take another folder"), "{other:?}: {refused}");
    }
}

/// A sensor's number that is set stays set in the flights of a study.
#[test]
fn a_number_of_a_sensor_has_an_effect_in_a_study() {
    let home = tempfile::tempdir().expect("a folder");
    let table = |name: &str, more: &[&str]| {
        let out = home.path().join(name);
        let words =
            ["study", "estimator", "--samples", "1", "--set", "plant.duration_s=25", "--out"];
        let words = [&words, &[out.to_str().expect("a name")][..], more].concat();
        assert_eq!(sitl(&words), Ok(0));
        fs::read_to_string(out.join("tables.md")).expect("it is there")
    };
    let set = ["--set", "plant.sensors.gnss.noise_m=30"];
    assert_ne!(table("as shipped", &[]), table("changed", &set));
}
