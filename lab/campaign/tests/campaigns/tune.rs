//! Gains tuned by one procedure, on flights that the suite does not have.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use autopilot::config;
use icd::ControlPeriod;
use lab_campaign::plan::Plan;
use lab_campaign::spec::SpecFile;
use lab_campaign::tune;
use lab_studies::design;
use studies::SUITE;

const SPEC: &str = r#"
name = "small tuning"
duration_s = 4.0
scenario = "nominal"
samples = 2

[set]
"autopilot.reference.1.at_s" = 0.0
"plant.fault.1.kind" = "stuck_at"
"plant.fault.1.effector" = "left_aileron"
"plant.fault.1.onset_s" = 1.0
"plant.fault.1.angle_deg" = 5.0

[[vary]]
key = "autopilot.reference.1.roll_deg"
uniform = [5.0, 20.0]

[[law]]
name = "PID alone"
set = { FTC_MODE = 0, ROL_KPHI = 0.4 }
tune = ["ROL_KPHI", "ROL_KP"]

[[law]]
name = "paper"
set = { FTC_MODE = 1 }
"#;

fn parse(text: &str) -> SpecFile {
    SpecFile::parse("small.toml", text.to_owned(), Path::new("").to_path_buf()).expect("above")
}

#[test]
fn tuning_is_the_same_every_time_and_finds_what_was_detuned() {
    let folder = tempfile::tempdir().expect("a folder");
    let [one, other] = ["one", "other"].map(|name| folder.path().join(name));
    for out in [&one, &other] {
        tune::run(&parse(SPEC), out).expect("it can be written");
    }
    let read = |folder: &Path, name: &str| fs::read_to_string(folder.join(name)).expect("a file");
    for name in ["pid-alone.toml", "tuning.csv"] {
        assert_eq!(read(&one, name), read(&other, name), "{name}");
    }
    // The law without a list is not tuned.
    let table = read(&one, "tuning.csv");
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 2, "{table}");
    let of = |name: &str| -> f64 {
        let place = rows[0].iter().position(|column| *column == name).expect(name);
        rows[1][place].parse().expect("a number")
    };
    assert!(of("cost_after") < 0.9 * of("cost_before"), "{table}");
    assert!(of("validation_cost_after") < of("validation_cost_before"), "{table}");
    // The roll gain was a fifth of the default.
    let gains: toml::Table = toml::from_str(&read(&one, "pid-alone.toml")).expect("TOML");
    assert!(gains["ROL_KPHI"].as_float().expect("a number") > 0.6, "{gains}");
    // A finished law is not flown again. One of other flights, of another build, or a damaged one is not taken.
    let text = read(&one, "pid-alone.toml");
    fs::write(one.join("pid-alone.toml"), text.replace("ROL_KP =", "# mine\nROL_KP ="))
        .expect("a file");
    tune::run(&parse(SPEC), &one).expect("it can be written");
    assert!(read(&one, "pid-alone.toml").contains("# mine"));
    let refused = |spec: &str, text: &str, expected: &str| {
        fs::write(one.join("pid-alone.toml"), text).expect("a file");
        let error = tune::run(&parse(spec), &one).expect_err(expected).to_string();
        assert!(error.contains("pid-alone.toml") && error.contains(expected), "{error}");
        assert_eq!(read(&one, "pid-alone.toml"), text);
    };
    refused(&SPEC.replace("= 5.0\n", "= 6.0\n"), &text, "take another folder");
    refused(SPEC, &text.replace("sources ", "sources 0"), "take another folder");
    refused(SPEC, &text.replace("ROL_KP =", "# mine\nROL_KX ="), "damaged");
    refused(SPEC, &text.replace("# row: 2,", "# row: 2,NaN,"), "damaged");
    refused(SPEC, &text[..text.rfind("ROL_").expect("a gain")], "damaged");
    fs::write(one.join("pid-alone.toml"), &text).expect("a file");
    // The file is one that `gains` takes.
    let mut tuned = parse(SPEC);
    tuned.spec.law[0].gains = Some(one.join("pid-alone.toml"));
    tuned.spec.law[0].set.remove("ROL_KPHI");
    let plan = Plan::new(tuned).expect("a plan");
    let _ = plan.setup(&plan.run(0).expect("a run")).expect("a flight");
}

#[test]
fn what_cannot_be_tuned_is_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    for (from, to, expected) in [
        ("\"ROL_KP\"]", "\"ROL_KX\"]", "tune: ROL_KX: expected a parameter"),
        ("\"ROL_KP\"]", "\"FTC_MODE\"]", "tune: FTC_MODE: expected a parameter"),
        ("tune = [", "# tune = [", "no law has parameters to tune"),
    ] {
        let refused = tune::run(&parse(&SPEC.replacen(from, to, 1)), folder.path());
        let message = refused.expect_err(to).to_string();
        assert!(message.contains(expected), "{to}: {message}");
    }
}

#[test]
fn laws_whose_gains_would_share_a_file_are_refused_by_both_names() {
    let law = |name: &str| format!("\n[[law]]\nname = \"{name}\"\ntune = [\"ROL_KP\"]\n");
    let text = SPEC.to_owned() + &law("PID, x") + &law("PID x");
    let refused = SpecFile::parse("small.toml", text, Path::new("").to_path_buf());
    let message = refused.expect_err("one file").to_string();
    assert!(message.contains("PID x: expected") || message.contains("\"PID x\""), "{message}");
    assert!(message.contains("pid-x.toml, as those of \"PID, x\""), "{message}");
}

/// Everything that a flight is but for the law: its settings, and with them its seed.
fn flights(name: &str) -> (BTreeSet<String>, BTreeSet<u64>) {
    let plan = Plan::new(SpecFile::read(name).expect("a campaign")).expect("a plan");
    let laws = plan.laws().len() as u64;
    let mut conditions = BTreeSet::new();
    let mut seeds = BTreeSet::new();
    for flight in 0..plan.flights() {
        let run = plan.run(flight * laws).expect("a run");
        let settings = plan.settings(&run).expect("they are");
        let is_of_plant = |key: &str| key.starts_with("plant.") || key.starts_with("autopilot.");
        let settings = settings.iter().filter(|setting| is_of_plant(&setting.key));
        let all: BTreeSet<String> = settings.map(ToString::to_string).collect();
        conditions.insert(format!("{} {all:?}", plan.file.spec.scenario));
        seeds.insert(run.seed);
    }
    assert_eq!(seeds.len() as u64, plan.flights(), "{name}: each flight has a seed of its own");
    (conditions, seeds)
}

#[test]
fn no_flight_of_the_tuning_set_is_in_the_suite_or_in_the_map() {
    let (conditions, seeds) = flights("tuning");
    assert_eq!(conditions.len(), 20);
    for name in SUITE.iter().map(|(name, _)| *name).chain([
        "jams",
        "jams-tuned",
        "combinations",
        "aircraft",
        "robustness",
        "delay",
    ]) {
        let (others, other_seeds) = flights(name);
        assert!(conditions.is_disjoint(&others), "{name} has a flight of the tuning set");
        assert!(seeds.is_disjoint(&other_seeds), "{name} has a seed of the tuning set");
    }
}

/// The regulator of each aircraft in the campaign over aircraft has the gains that `sitl aircraft design lqr` finds for it.
#[test]
fn the_regulators_of_the_campaign_over_aircraft_are_those_of_the_design() {
    let spec = SpecFile::read("aircraft").expect("it comes with the program").spec;
    for airframe in spec.airframe.iter().filter(|airframe| airframe.name != "tvc_jet") {
        let model = config::named_model(Path::new(&airframe.name)).expect("a shipped model");
        let gains = design::design(&model.aircraft, ControlPeriod::DEFAULT, &design::Weights::JET)
            .expect("a solution");
        let designed: toml::Table = design::to_toml(&gains).parse().expect("TOML");
        assert_eq!(airframe.set, designed, "{}", airframe.name);
    }
}
