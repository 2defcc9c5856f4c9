//! `sitl fly` with the real binary: its output, files and exit status, and what it refuses.

use crate::programs;

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use aircraft::AIRFRAMES;
use autopilot::autopilot::Settings;
use autopilot::parameters::Parameters;
use host_io::file::names;
use icd::SimTime;
use lab_engine::builder::SetupOptions;
use lab_judges::closed_loop::FlightSetup;
use plant_sim::PlantSetup;
use programs::program;
use tempfile::TempDir;
use ulog::reader::Log;

fn sitl(words: &[&str]) -> Output {
    Command::new(program("sitl")).args(words).output().expect("the built program starts")
}

fn fly(words: &[&str]) -> Output {
    let all: Vec<&str> = ["fly"].iter().chain(words).copied().collect();
    sitl(&all)
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A refusal: exit status 2, and this text on the standard error.
fn assert_refused(words: &[&str], expected: &str) {
    let output = fly(words);
    let printed = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{words:?}: {printed}");
    assert!(printed.contains(expected), "{words:?} printed {printed}");
    assert_eq!(out(&output), "", "{words:?}");
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder for the test")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a readable path")
}

fn outcome(folder: &Path) -> serde_json::Value {
    let json = fs::read(folder.join("outcome.json")).expect("it was written");
    serde_json::from_slice(&json).expect("it is JSON")
}

#[test]
fn a_kept_aircraft_is_exit_status_0_and_a_lost_one_1_each_with_one_line() {
    for (words, status, line) in [
        (&["case2"][..], 0, "case2, seed 1: kept, 40.000 s flown"),
        (&["case1", "--ftc", "off"], 1, "case1, seed 1: lost at 5.710 s, roll angle 90.0 deg"),
        (&["case1", "--set", "FTC_MODE=0", "--seed", "4"], 1, "case1, seed 4: lost at 5.710 s"),
    ] {
        let output = fly(words);
        assert_eq!(output.status.code(), Some(status), "{words:?}");
        let printed = out(&output);
        assert!(
            printed.starts_with(line) && printed.lines().count() == 1,
            "{words:?} printed {printed}"
        );
    }
}

#[test]
fn a_scenario_without_a_start_begins_at_the_design_point_of_the_airframe() {
    let folder = folder();
    let airframe = folder.path().join("high.toml");
    let shipped = aircraft::DEFAULT_AIRFRAME;
    let at = "[design_point]\naltitude_m = 5000.0 ";
    assert!(shipped.contains(at), "the file has another design point");
    let high = shipped.replacen(at, "[design_point]\naltitude_m = 6500.0 ", 1);
    fs::write(&airframe, high).expect("a free path");
    let output = fly(&["nominal", "--airframe", text(&airframe), "--set", "plant.duration_s=2"]);
    assert_eq!(
        out(&output),
        "nominal, seed 1: kept, 2.000 s flown, altitude 6500 m, reference 6500 m\n"
    );
}

#[test]
fn an_aircraft_of_eleven_kilograms_flies_by_its_files_and_survives_a_jammed_aileron_without_a_nozzle()
 {
    const AIRFRAME: &str =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../aircraft/aerosonde/airframe.toml");
    const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../aircraft/aerosonde/model.toml");
    let folder = folder();
    let linearized = folder.path().join("model.toml");
    // Its parameters stay.
    fs::copy(MODEL, &linearized).expect("a free path");
    let status = sitl(&["linearize", "--airframe", AIRFRAME, "--out", text(&linearized)]).status;
    assert!(status.success());
    let [again, shipped] = [&linearized, Path::new(MODEL)].map(fs::read_to_string);
    assert_eq!(again.unwrap(), shipped.unwrap(), "the model is the linearised airframe");

    let jam = folder.path().join("jam.toml");
    let fault = "[plant]\nseed = 1\nearth = \"flat\"\nduration_s = 40.0\n[[plant.fault]]\neffector = \"left_aileron\"\nkind = \"stuck_at\"\nangle_deg = 12.0\n\
                 travel = \"jump\"\nonset_s = 1.0\n";
    fs::write(&jam, fault).expect("a free path");
    let [armed, off] = ["armed", "off"].map(|ftc| {
        let to = folder.path().join(ftc);
        let output = fly(&[
            text(&jam),
            "--airframe",
            AIRFRAME,
            "--model",
            MODEL,
            "--ftc",
            ftc,
            "--out",
            text(&to),
        ]);
        assert_eq!(output.status.code(), Some(0), "{ftc}: {}", out(&output));
        outcome(&to)["metrics"]["roll_rmse"]["value"].as_f64().expect("a number")
    });
    assert!(armed < 0.015, "{armed} rad");
    assert!(off > 10.0 * armed, "{off} rad without the compensator, {armed} rad with it");
}

#[test]
fn an_aircraft_that_comes_with_the_program_flies_by_its_name_with_its_model() {
    let by_name = fly(&["nominal", "--airframe", "f16", "--set", "plant.duration_s=2"]);
    let expected = "nominal, seed 1: kept, 2.000 s flown, altitude 4000 m, reference 4000 m\n";
    assert_eq!(out(&by_name), expected, "{}", err(&by_name));
    // The model of another aircraft is refused, whichever of the two is named.
    let mixed = fly(&["nominal", "--airframe", "f16", "--model", "aerosonde"]);
    assert!(err(&mixed).contains("aerosonde") && err(&mixed).contains("f16"), "{}", err(&mixed));
    let unknown = fly(&["nominal", "--airframe", "f15"]);
    let known = format!("the names that come with the program are {}", names(AIRFRAMES));
    assert!(err(&unknown).contains(&known), "{}", err(&unknown));
}

#[test]
fn one_key_of_a_start_can_be_set_where_the_scenario_has_none() {
    let output =
        fly(&["nominal", "--set", "plant.start.altitude_m=3000", "--set", "plant.duration_s=2"]);
    assert_eq!(
        out(&output),
        "nominal, seed 1: kept, 2.000 s flown, altitude 3000 m, reference 3000 m\n"
    );
}

#[test]
fn after_the_loss_the_flight_goes_on_only_if_requested() {
    let ends_s = |more: &[&str]| {
        let folder = folder();
        let words = ["case1", "--ftc", "off", "--out", text(folder.path())];
        let output = fly(&[&words[..], more].concat());
        assert_eq!(output.status.code(), Some(1));
        let outcome = outcome(folder.path());
        assert_eq!(outcome["lost_at_s"], 5.71);
        outcome["end_s"].as_f64().expect("a time")
    };
    assert_eq!(ends_s(&[]), 5.71);
    // To the ground, as `sitl study paper` follows it.
    let ground_s = ends_s(&["--no-stop-at-loss"]);
    assert!((20.0..60.0).contains(&ground_s), "{ground_s} s");
}

#[test]
fn the_page_of_a_flight_without_compensator_has_its_loss_and_nothing_that_wakes() {
    let folder = folder();
    let words = ["case1", "--ftc", "off", "--no-stop-at-loss", "--figures", "--out"];
    assert_eq!(fly(&[&words[..], &[text(folder.path())]].concat()).status.code(), Some(1));
    let page = fs::read_to_string(folder.path().join("flight.html")).expect("it was written");
    for word in [
        "<th>Aircraft</th><td>tvc_jet</td>",
        "<th>Main law</th><td>pid</td>",
        "<th>Compensator</th><td>off (FTC_MODE), neso, allocation paper</td>",
        "a fault is seen, the compensator is off: something acts about the roll axis",
        "fault seen, compensator off",
        "the aircraft is lost: roll angle 9",
    ] {
        assert!(page.contains(word), "{word}");
    }
    for word in ["awake", "wakes", "verdict good"] {
        assert!(!page.contains(word), "{word}");
    }
    for word in ["limit 90 deg (", "touches the ground ("] {
        assert!(page.matches(word).count() > 20, "on every chart: {word}");
    }
}

#[test]
fn the_limits_of_the_airframe_file_decide_when_the_aircraft_is_lost() {
    let output = fly(&["case2", "--set", "airframe.limits.roll_deg=8"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(out(&output).contains("roll angle 8.0 deg, limit 8 deg"), "{}", out(&output));
}

#[test]
fn the_table_is_that_of_the_paper_and_every_measure_has_its_unit() {
    let folder = folder();
    let output = fly(&["case1", "--no-stop-at-loss", "--out", text(folder.path())]);
    assert!(output.status.success());
    let table = fs::read_to_string(folder.path().join("flight.csv")).expect("it was written");
    let header = lab_judges::row::Row::NAMES.join(",");
    assert_eq!(table.lines().next(), Some(header.as_str()));
    assert_eq!(table.lines().count(), 1 + 9_001, "100 rows a second, both ends");
    let outcome = outcome(folder.path());
    let metrics = outcome["metrics"].as_object().expect("a map");
    assert!(metrics.len() > 80, "{} measures", metrics.len());
    assert!(metrics.values().all(|metric| metric["unit"].is_string()), "{metrics:?}");
    let value = |name: &str| metrics[name]["value"].as_f64().expect(name);
    assert_eq!(value("fault_at"), 3.0);
    assert!(value("detection_delay") < 0.1, "{}", value("detection_delay"));
    assert_eq!(value("fault_missed"), 0.0);
    assert!(value("steady_offset_altitude").abs() < 5.0);
    assert_eq!(metrics["time_to_loss"]["value"], serde_json::Value::Null);
    let files = fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(files, 2, "nothing else is left behind");
}

#[test]
fn the_flight_log_is_flown_again_to_the_same_hash() {
    let folder = folder();
    let scenario = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/chain.toml");
    let words = [scenario, "--set", "plant.wind.turbulence_m_s=2", "--out", text(folder.path())];
    assert!(fly(&[&words[..], &["--ulog", "--figures"]].concat()).status.success());
    let log = folder.path().join("flight.ulg");
    let replay = sitl(&["replay", text(&log)]);
    assert_eq!(replay.status.code(), Some(0), "{}", out(&replay));
    assert!(out(&replay).contains("same run hash"), "{}", out(&replay));
    let page = fs::read_to_string(folder.path().join("flight.html")).expect("it was written");
    assert!(page.contains("<svg") && page.ends_with("</html>"), "no page of figures");
}

#[test]
fn the_file_for_viewers_is_the_same_from_the_flight_and_from_its_log() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let words = ["case1", "--set", "plant.duration_s=4", "--out", text(folder.path())];
    assert!(fly(&[&words[..], &["--ulog", "--mcap"]].concat()).status.success());
    let (log, other) = (path("flight.ulg"), path("other.mcap"));
    let converted = sitl(&["log", "mcap", text(&log), "--out", text(&other)]);
    assert!(converted.status.success(), "{}", err(&converted));
    let [flown, converted] =
        [path("flight.mcap"), other].map(|file| fs::read(file).expect("written"));
    assert!(flown == converted, "{} and {} bytes", flown.len(), converted.len());
    // Needs a Python with tests/clients/requirements.txt.
    let Some(python) = std::env::var_os("TWO_STEP_PYTHON") else {
        return eprintln!(
            "skipped: TWO_STEP_PYTHON does not name a Python with the client libraries"
        );
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/clients/read_mcap.py");
    let file = path("flight.mcap");
    let read = Command::new(python).args([script, text(&file)]).output().expect("Python starts");
    assert!(read.status.success(), "{}", err(&read));
}

#[test]
fn the_shipped_flights_have_the_hashes_in_the_documentation() {
    let page = include_str!("../../docs/logs.md");
    let rows = page.lines().filter_map(|line| {
        let [flight, _, hash] = line.strip_prefix("| `")?.split("` | `").collect::<Vec<_>>()[..]
        else {
            return None;
        };
        Some((flight, hash.strip_suffix("` |")?))
    });
    let flights = rows.map(|(flight, hash)| {
        let out = folder();
        let words = flight.split(' ').chain(["--ulog", "--out", text(out.path())]);
        let output = fly(&words.collect::<Vec<_>>());
        assert_eq!(output.status.code(), Some(0), "{flight}: {}", err(&output));
        let log = Log::open(&out.path().join("flight.ulg")).expect("readable");
        let flown = log.info_text("run_hash").expect("a footer");
        assert_eq!(&flown[..16], hash, "{flight}");
    });
    assert_eq!(flights.count(), 6);
}

#[test]
fn a_range_of_seeds_is_the_same_on_any_number_of_threads_and_as_each_alone() {
    let words = [
        "fly",
        "case1",
        "--seed",
        "3..6",
        "--set",
        "plant.wind.turbulence_m_s=3",
        "--set",
        "plant.duration_s=8",
        "--out",
    ];
    let of = |threads: &str| {
        let folder = folder();
        let mut command = Command::new(program("sitl"));
        command.env("RAYON_NUM_THREADS", threads).args(words).arg(folder.path());
        let output = command.output().expect("it starts");
        assert_eq!(output.status.code(), Some(0));
        let table = fs::read_to_string(folder.path().join("seeds.csv")).expect("it was written");
        let parquet = fs::read(folder.path().join("seeds.parquet")).expect("it was written");
        (out(&output), table, parquet, outcome(folder.path()))
    };
    let (printed, table, parquet, many) = of("1");
    assert_eq!(of("3"), (printed.clone(), table.clone(), parquet, many.clone()));
    assert!(table.starts_with("seed,lost,lost_at_s,end_s,"), "{table}");
    assert_eq!(printed.lines().count(), 1 + 4 + 1, "{printed}");
    assert!(printed.contains("0 of 4 lost"), "{printed}");
    assert_eq!(table.lines().count(), 1 + 4);
    let alone = folder();
    let words = [
        "case1",
        "--seed",
        "5",
        "--set",
        "plant.wind.turbulence_m_s=3",
        "--set",
        "plant.duration_s=8",
        "--out",
        text(alone.path()),
    ];
    assert!(fly(&words).status.success());
    assert_eq!(outcome(alone.path())["metrics"], many["flights"][2]["metrics"]);
    assert_ne!(many["flights"][1]["metrics"], many["flights"][2]["metrics"], "seeds differ");
}

#[test]
fn a_range_with_a_lost_aircraft_is_exit_status_1() {
    let output = fly(&["case1", "--ftc", "off", "--seed", "1..2"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(out(&output).contains("2 of 2 lost"), "{}", out(&output));
}

#[test]
fn a_flight_that_cannot_be_flown_is_refused_with_key_value_and_expectation() {
    for (words, expected) in [
        (
            &["case9"][..],
            "case9: there is no such scenario and no such file; the scenarios are nominal, case1, case2, field, circuit",
        ),
        (&["case1", "--airframe", "no.toml"], "no.toml: "),
        (&["case1", "--model", "no.toml"], "no.toml: "),
        (&["case1", "--script", "no.txt"], "no.txt: "),
        (
            &["case1", "--set", "plant.wind.turbulense_m_s=1"],
            "plant.wind.turbulense_m_s: there is no such key; the nearest is plant.wind.turbulence_m_s",
        ),
        (
            &["case1", "--set", "FTC_MOD=1"],
            "FTC_MOD: there is no such key; the nearest is FTC_MODE",
        ),
        (&["case1", "--set", "FTC_MODE=7"], "FTC_MODE = 7 is outside 0 to 2"),
        (&["case1", "--set", "FTC_MODE=on"], "FTC_MODE=on: FTC_MODE is a number from 0 to 2"),
        (
            &["case1", "--set", "plant.wind.turbulence_m_s=99"],
            "turbulence_m_s = 99 is outside 0 to 20",
        ),
        (
            &["case1", "--set", "plant.wind.turbulence_m_s=much"],
            "--set plant.wind.turbulence_m_s=much: invalid type",
        ),
        (&["case1", "--set", "airframe.mass.mass_kg=-1"], "mass_kg = -1 is outside 1 to 1000000"),
        (&["case1", "--set", "airframe.mass.mass_kg=900000"], "steady level flight"),
        (&["case1", "--set", "model.mass.mass_kg=nan"], "mass_kg = NaN is outside"),
        (
            &["case1", "--set", "plant.fault.1.angle_deg=80"],
            "angle 80 deg is outside -30 to 30 deg",
        ),
        (&["case1", "--set", "plant.fault.3.angle_deg=8"], "entry 3 of fault is outside 1 to 2"),
        (&["case1", "--set", "nothing"], "nothing is not KEY=VALUE"),
        (&["case1", "--seed", "9..2"], "9 is above 2"),
        (&["case1", "--seed", "1..2", "--ulog", "--out", "x"], "--ulog is for one flight"),
        (&["case1", "--ulog"], "--out"),
        (&["case1", "--seed", "1..2", "--mcap", "--out", "x"], "--mcap is for one flight"),
        (&["case1", "--step-us", "300"], "300 us does not divide"),
        (&["case1", "--turbulence-m-s", "NaN"], "turbulence_m_s = NaN"),
        (&[], "SCENARIO"),
    ] {
        assert_refused(words, expected);
    }
}

#[test]
fn a_script_with_a_fault_that_the_aircraft_cannot_have_is_refused_before_the_flight() {
    let folder = folder();
    let script = folder.path().join("b.txt");
    for (line, expected) in [
        ("at 1 s: fail left elevator stuck at 31 deg", "angle 31 deg is outside -30 to 30 deg"),
        ("at 1 s: fail left elevator slow at 1000 deg/s", "line 1"),
        ("at 1 s: fail engine limited to 900 kN", "kN is outside"),
    ] {
        fs::write(&script, line).expect("the folder takes a file");
        assert_refused(&["nominal", "--script", text(&script)], expected);
        let seeds = ["nominal", "--seed", "1..2", "--script", text(&script)];
        assert_refused(&seeds, expected);
    }
}

#[test]
fn what_is_set_twice_is_refused() {
    for (words, expected) in [
        (&["--ftc", "armed", "--set", "FTC_MODE=0"][..], "the option --ftc for it"),
        (&["--law", "pid", "--set", "CTL_LAW=2"], "the option --law for it"),
        (&["--seed", "3", "--set", "plant.seed=4"], "the option --seed for it"),
        (&["--earth", "flat", "--set", "plant.earth=wgs84"], "the option --earth for it"),
        (&["--set", "FTC_MODE=0", "--set", "FTC_MODE=1"], "this key is set twice"),
    ] {
        assert_refused(&[&["nominal"], words].concat(), expected);
    }
}

#[test]
fn the_setup_in_the_outcome_is_enough_to_fly_the_flight_again() {
    let folder = folder();
    let options = "case1 --law ndi --compensator linear-eso --allocation wls --ftc always --turbulence-m-s 2 --seed 5 \
                   --set plant.sensors.grade=tactical --set plant.duration_s=8 --out";
    let words: Vec<&str> = options.split_whitespace().chain([text(folder.path())]).collect();
    let _ = fly(&words);
    let written = outcome(folder.path());
    for (key, expected) in
        [("law", "ndi"), ("compensator", "linear-eso"), ("allocation", "wls"), ("ftc", "always")]
    {
        assert_eq!(written[key].as_str(), Some(expected), "{key}");
    }
    assert_eq!(written["setup"]["plant"]["wind"]["turbulence_m_s"].as_f64(), Some(2.0));
    assert_flown_again(&written, &written);
    assert_eq!(written["control_steps"].as_u64(), Some(4_001));
}

/// Flies the setup that a file has, and compares the outcome.
fn assert_flown_again(of: &serde_json::Value, outcome: &serde_json::Value) {
    let part = |name: &str| of["setup"][name].clone();
    let plant: PlantSetup = serde_json::from_value(part("plant")).expect("a plant");
    let control: Settings = serde_json::from_value(part("control")).expect("a control side");
    let Settings { model, gains, limits, navigation, references, script, .. } = control;
    let duration = part("duration_s").as_f64().and_then(SimTime::from_seconds);
    let again = FlightSetup {
        plant,
        model,
        parameters: Parameters { gains, limits, navigation, ..Parameters::default() },
        references,
        script,
        duration: duration.expect("seconds"),
        knows_fault: of["fault_known"].as_bool().expect("a flag"),
        ..SetupOptions::default().setup("nominal").expect("it is shipped")
    };
    let flown = lab_judges::flown::outcome(&again, &[]).expect("it can start");
    let flown = serde_json::to_value(flown).expect("numbers");
    for (key, value) in flown.as_object().expect("a table") {
        assert_eq!(value, &outcome[key], "{key}");
    }
}

#[test]
fn the_setups_of_a_campaign_are_enough_to_fly_their_runs_again() {
    let folder = folder();
    let [campaign, alone] = ["campaign", "alone"].map(|name| folder.path().join(name));
    let run = sitl(&["campaign", "run", "smoke", "--out", text(&campaign)]);
    assert!(run.status.success(), "{}", err(&run));
    let json = fs::read(campaign.join("setup.json")).expect("it was written");
    let json: serde_json::Value = serde_json::from_slice(&json).expect("it is JSON");
    let flights = json["flights"].as_array().expect("a list");
    assert!(flights.len() > 1 && json["specification"].as_str().is_some());
    for flight in flights {
        let number = flight["run"].to_string();
        let words = ["campaign", "replay", "smoke", "--run", &number, "--out", text(&alone)];
        let replay = sitl(&words);
        assert!(replay.status.success(), "{}", err(&replay));
        assert_flown_again(flight, &outcome(&alone));
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_and_nothing_is_replaced_that_is_not_ours() {
    let folder = folder();
    let file = folder.path().join("file");
    fs::write(&file, "mine").expect("a free path");
    assert_refused(&["case1", "--out", text(&file)], "this is no folder");
    assert_refused(&["case1", "--out", text(&file.join("below"))], "cannot write");
    assert_refused(&["case1", "--out", "/proc/none"], "cannot write /proc/none");
    let foreign = folder.path().join("flight.csv");
    fs::write(&foreign, "my own table").expect("a free path");
    assert_refused(&["case1", "--out", text(folder.path())], "not written by this program");
    assert_eq!(fs::read_to_string(&foreign).expect("still there"), "my own table");
    fs::remove_file(&foreign).expect("ours");
    fs::write(folder.path().join("outcome.json"), "{\"mine\": 1}\n").expect("a free path");
    assert_refused(&["case1", "--out", text(folder.path())], "outcome.json: not empty");
    // A second flight replaces the first.
    fs::remove_file(folder.path().join("outcome.json")).expect("ours");
    for seed in ["1", "2"] {
        let words = ["case1", "--seed", seed, "--out", text(folder.path())];
        assert!(fly(&words).status.success());
        assert_eq!(outcome(folder.path())["seed"].to_string(), seed);
    }
}

#[test]
fn the_preset_of_the_estimator_follows_the_sensors_and_one_that_the_user_sets_stands_and_is_announced()
 {
    let folder = folder();
    let gains = folder.path().join("gains.toml");
    fs::write(&gains, "EST_PRESET = 0\n").expect("a free path");
    let flight = |words: &[&str]| {
        let flown = ["nominal", "--set", "plant.duration_s=1"];
        let all: Vec<&str> = flown.iter().chain(words).copied().collect();
        let output = fly(&all);
        assert_eq!(output.status.code(), Some(0), "{words:?}: {}", err(&output));
        err(&output)
    };
    let consumer = ["--set", "plant.sensors.grade=consumer"];
    let tactical = ["--set", "plant.sensors.grade=tactical"];
    let announced = "EST_PRESET is 0 as set; for consumer sensors it would be 1\n";
    for (words, note) in [
        (vec![], ""),
        (consumer.to_vec(), ""),
        (tactical.to_vec(), ""),
        ([&consumer[..], &["--set", "EST_PRESET=1"]].concat(), ""),
        ([&consumer[..], &["--set", "EST_PRESET=0"]].concat(), announced),
        ([&consumer[..], &["--gains", text(&gains)]].concat(), announced),
        (
            [&tactical[..], &["--set", "EST_PRESET=1"]].concat(),
            "EST_PRESET is 1 as set; for tactical sensors it would be 0\n",
        ),
    ] {
        assert_eq!(flight(&words), note, "{words:?}");
    }
}

#[test]
fn a_live_flight_ends_at_the_duration_of_its_scenario() {
    let folder = folder();
    let scenario = folder.path().join("short.toml");
    let text = scenarios::NOMINAL.replacen("[plant]\n", "[plant]\nduration_s = 1.5\n", 1);
    fs::write(&scenario, text).expect("a free path");
    let scenario = scenario.to_str().expect("a readable path");
    let words =
        ["--scenario", scenario, "--speed", "20", "--no-gcs", "--plant-link", "127.0.0.1:0"];
    let mut live = programs::Program::start("sitl", &words);
    assert_eq!(live.end(), Some(0), "{}", live.printed());
    assert!(live.printed().contains("the flight is complete"), "{}", live.printed());
}

#[test]
fn paper_and_mission_take_aircraft_and_settings_and_refuse_what_has_an_option() {
    for (command, setting, expected) in [
        ("paper", "plant.seed=2", "--set plant.seed: this command has the option --seed for it"),
        ("paper", "REF_ROL_MAX=2", "the nearest is REF_ROLL_MAX"),
        ("mission", "plant.wind.speed_m_s=9", "this command has the option --wind-m-s for it"),
        ("mission", "airframe.mass.mass_kg=900000", "steady level flight"),
    ] {
        let folder = folder();
        let output = sitl(&[command, "--out", text(folder.path()), "--set", setting]);
        let printed = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{command} {setting}: {printed}");
        assert!(printed.contains(expected), "{command} {setting}: {printed}");
    }
    let folder = folder();
    // Without the compensator its claims do not hold, and the page lists what was changed.
    let words = ["paper", "--out", text(folder.path()), "--set", "FTC_MODE=0", "--step-us", "2000"];
    assert_eq!(sitl(&words).status.code(), Some(1));
    let page = fs::read_to_string(folder.path().join("report.html")).expect("it was written");
    assert!(page.contains("<th>Set</th><td>FTC_MODE=0</td>"), "the page hides what was changed");
}

/// Results that no one got are no success; a reader who has seen enough is no failure.
#[test]
fn a_standard_output_that_cannot_be_written_is_a_failure() {
    let into = |output: std::process::Stdio| {
        let mut command = Command::new(program("sitl"));
        let command = command.args(["aircraft", "parameters"]).stdout(output);
        command.stderr(std::process::Stdio::piped()).output().expect("the built program starts")
    };
    let full = fs::File::options().write(true).open("/dev/full").expect("a device of the kernel");
    let refused = into(full.into());
    assert_eq!(refused.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("standard output: "), "{refused:?}");
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    assert!(into(writer.into()).status.success());
}
