//! Campaigns as a user runs them: whole, in shards, interrupted, refused.

use std::fs;
use std::path::{Path, PathBuf};

use autopilot::own_law::OwnLaw;
use flight_control::main_controller::pid::Pid;
use flight_control::{Gains, MainLaw};
use lab_campaign::plan::{Plan, Value};
use lab_campaign::spec::SpecFile;
use lab_campaign::store::{RunEnd, RunStore};
use lab_campaign::{Command, compare, fly, run};
use lab_engine::configuration::AircraftArgs;
use lab_engine::settings::Setting;
use sha2::{Digest, Sha256};
use studies::{STUDIES, SUITE};

/// Files of a finished campaign that must be the same to the byte.
const FILES: [&str; 6] = [
    "runs.parquet",
    "summary.csv",
    "summary.parquet",
    "columns.csv",
    "columns.parquet",
    "campaign.toml",
];

fn smoke() -> &'static str {
    STUDIES.iter().find(|(name, _)| *name == "smoke").expect("it is shipped").1
}

fn parse(text: &str) -> Result<Plan, String> {
    let file = SpecFile::parse("test.toml", text.to_owned(), PathBuf::new())
        .map_err(|error| error.to_string())?;
    Plan::new(file).map_err(|error| error.to_string())
}

fn whole(folder: &Path) {
    command(&["run", "smoke", "--out", &folder.display().to_string()]);
}

/// Carries out a command line.
fn try_command(words: &[&str]) -> Result<(), String> {
    #[derive(clap::Parser)]
    struct Line {
        #[command(subcommand)]
        command: Command,
    }
    let words = std::iter::once("campaign").chain(words.iter().copied());
    let line = <Line as clap::Parser>::try_parse_from(words).map_err(|error| error.to_string())?;
    run(&line.command, &[]).map_err(|error| error.to_string())
}

fn command(words: &[&str]) {
    assert_eq!(try_command(words), Ok(()), "{words:?}");
}

fn assert_same(one: &Path, other: &Path) {
    for name in FILES {
        let read = |folder: &Path| fs::read(folder.join(name)).expect("a finished campaign");
        assert!(read(one) == read(other), "{name} differs");
    }
}

#[test]
fn shards_in_folders_of_their_own_give_the_bytes_of_one_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    whole(&at("whole"));
    // With parts of 125 runs the smoke test would be one part only.
    let text = smoke()
        .replace("samples = 8", "samples = 64")
        .replace("duration_s = 8.0", "duration_s = 20.0");
    let spec = at("spec.toml");
    fs::write(&spec, text).expect("a file");
    let spec = spec.display().to_string();
    let out = |name: &str| at(name).display().to_string();
    command(&["run", &spec, "--out", &out("one")]);
    for shard in ["1/3", "2/3", "3/3"] {
        let folder = out(&format!("shard {}", &shard[..1]));
        command(&["run", &spec, "--out", &folder, "--shard", shard]);
    }
    let refused = try_command(&["merge", &spec, "--out", &out("some"), &out("shard 1")]);
    assert!(refused.as_ref().is_err_and(|e| e.contains("parts are missing")), "{refused:?}");
    command(&[
        "merge",
        &spec,
        "--out",
        &out("all"),
        &out("shard 3"),
        &out("shard 1"),
        &out("shard 2"),
    ]);
    assert_same(&at("one"), &at("all"));
    let other = try_command(&["merge", &spec, "--out", &out("x"), &out("whole")]);
    assert!(other.as_ref().is_err_and(|e| e.contains("fingerprint")), "{other:?}");
}

#[test]
fn a_setting_of_the_command_line_is_flown_and_makes_another_campaign() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = |name: &str| folder.path().join(name).display().to_string();
    let tactical = ["--set", "plant.sensors.grade=tactical"];
    let run = |name: &str, more: &[&str]| {
        try_command(&[&["run", "smoke", "--out", &out(name)][..], more].concat())
    };
    assert_eq!(run("ideal", &[]), Ok(()));
    assert_eq!(run("real", &tactical), Ok(()));
    let table = |name: &str| fs::read(folder.path().join(name).join("runs.parquet")).expect("it");
    assert!(table("ideal") != table("real"));
    let page = fs::read_to_string(folder.path().join("real/report.html")).expect("a page");
    let command =
        "sitl campaign replay smoke --set plant.sensors.grade=tactical --run 0 --out run0";
    assert!(page.contains(command), "the command flies a run of this campaign");
    let refused = run("ideal", &tactical);
    assert!(refused.as_ref().is_err_and(|e| e.contains("take another folder")), "{refused:?}");
    let unknown = run("x", &["--set", "plant.sensors.grad=tactical"]);
    assert!(unknown.as_ref().is_err_and(|e| e.contains("plant.sensors.grade")), "{unknown:?}");
}

#[test]
fn what_an_interrupted_campaign_lost_or_damaged_is_flown_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let [one, other] = ["one", "other"].map(|name| folder.path().join(name));
    for folder in [&one, &other] {
        whole(folder);
    }
    let part = other.join("parts/00000000.part");
    let bytes = fs::read(&part).expect("a part");
    for damaged in [&bytes[..0], &bytes[..bytes.len() / 2], b"Two-Step campaign part 2\n\xff"] {
        fs::write(&part, damaged).expect("a file");
        fs::remove_file(other.join("runs.parquet")).expect("a table");
        whole(&other);
        assert_same(&one, &other);
        assert_eq!(fs::read(&part).expect("a part"), bytes);
    }
}

#[test]
fn a_finished_campaign_writes_its_tables_again_only_where_one_is_missing() {
    let folder = tempfile::tempdir().expect("a folder");
    whole(folder.path());
    let written = |name: &str| {
        let about = fs::metadata(folder.path().join(name)).expect("a finished campaign");
        about.modified().expect("a time")
    };
    let before = ["report.html", "runs.parquet"].map(written);
    whole(folder.path());
    assert_eq!(["report.html", "runs.parquet"].map(written), before);
    fs::remove_file(folder.path().join("summary.csv")).expect("a table");
    whole(folder.path());
    assert!(written("summary.csv") > before[0] && written("report.html") > before[0]);
}

#[test]
fn a_run_alone_is_the_run_among_all() {
    let folder = tempfile::tempdir().expect("a folder");
    let plan = parse(smoke()).expect("the shipped campaign");
    let store = RunStore::open(&plan, folder.path()).expect("a new folder");
    let _ = fly::fly(&plan, &store, None).expect("it can be written");
    let rows = store.read(0).expect("a file").expect("a whole part");
    assert_eq!(rows.len() as u64, plan.runs());
    for number in [31, 0, 17] {
        let again = fly::run(&parse(smoke()).expect("the shipped campaign"), number);
        assert_eq!(again, rows[usize::try_from(number).expect("small")]);
    }
    // Something happens in this campaign, and not the same to every flight.
    assert!(rows.iter().any(|row| row.end == RunEnd::Lost));
    assert!(rows.iter().any(|row| row.end == RunEnd::Kept));
}

/// Needs a Python with tests/clients/requirements.txt, named by TWO_STEP_PYTHON; prints a note and passes without.
#[test]
fn pandas_and_polars_read_the_table_of_runs() {
    let Some(python) = std::env::var_os("TWO_STEP_PYTHON") else {
        eprintln!("skipped: TWO_STEP_PYTHON does not name a Python with pandas and polars");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    whole(folder.path());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/clients/read_runs.py");
    let done = std::process::Command::new(python)
        .args([script.as_os_str(), folder.path().as_os_str(), "32".as_ref()])
        .output()
        .expect("TWO_STEP_PYTHON runs");
    let errors = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{errors}");
}

#[test]
fn every_law_flies_the_same_flights() {
    let plan = parse(smoke()).expect("the shipped campaign");
    for number in (0..plan.runs()).step_by(2) {
        let [one, other] = [number, number + 1].map(|n| plan.run(n).expect("a run"));
        assert_eq!((one.flight, one.seed, &one.values), (other.flight, other.seed, &other.values));
        assert_eq!((one.law, other.law), (0, 1));
    }
}

#[test]
fn variables_mean_values_factors_and_parts_of_a_travel() {
    let plan = parse(smoke()).expect("the shipped campaign");
    let run = plan.run(5).expect("a run");
    let setup = plan.setup(&run).expect("a flight");
    let [turbulence, angle, onset, mass] =
        [0, 1, 2, 3].map(|place: usize| match &run.values[place] {
            Value::Number(number) => *number,
            Value::Text(text) => panic!("{text}"),
        });
    assert_eq!(setup.plant.wind.turbulence_m_s.to_bits(), turbulence.to_bits());
    assert!((-30.0..=30.0).contains(&angle) && (0.5..=2.0).contains(&onset));
    let nominal_kg = plan.aircraft[0].airframe.mass.mass_kg;
    assert_eq!(setup.plant.airframe.mass.mass_kg.to_bits(), mass.to_bits());
    assert!((0.9..=1.1).contains(&(mass / nominal_kg)), "{mass} of {nominal_kg}");
    // The controller's model is not that of the aircraft of this flight.
    assert_eq!(setup.model, plan.setup(&plan.run(0).expect("a run")).expect("a flight").model);
    let all: Vec<f64> = (0..plan.runs())
        .filter_map(|number| plan.run(number).expect("a run").values[1].number())
        .collect();
    assert!(all.iter().any(|deg| *deg > 20.0) && all.iter().any(|deg| *deg < -20.0));
}

#[test]
fn a_specification_that_cannot_be_flown_names_what_is_wrong() {
    let with = |from: &str, to: &str| {
        assert!(smoke().contains(from), "{from}");
        parse(&smoke().replacen(from, to, 1)).map(drop).expect_err(to)
    };
    for (from, to, expected) in [
        ("samples = 8", "samples = 0", "samples = 0: expected 1 to 65536"),
        ("duration_s = 8.0", "duration_s = nan", "duration_s = NaN: expected more than 0"),
        ("duration_s = 8.0", "durations = 8.0", "unknown field `durations`"),
        ("seed = 7", "seed = -7", "seed"),
        (
            "seed = 7",
            "seed = 9007199254740990\nseeds = \"samples\"",
            "expected 0 to 9007199254740984",
        ),
        ("FTC_MODE = 0", "FTC_MODES = 0", "nearest is FTC_MODE"),
        ("FTC_MODE = 0", "FTC_MODE = 77", "FTC_MODE"),
        ("FTC_MODE = 0", "FTC_MODE = nan", "FTC_MODE = nan: expected a finite number"),
        ("FTC_MODE = 0", "FTC_MODE = \"nan\"", "expected a finite number"),
        ("FTC_MODE = 0", "FTC_MODE = { a = 1 }", "expected a finite number"),
        ("FTC_MODE = 0", "FTC_MODE = \"{ a = 1 }\"", "expected a finite number"),
        ("values = [0.0, 3.0]", "values = [\"nan\"]", "finite numbers, or texts"),
        ("set = { FTC_MODE = 1 }", "fault_known = true", "fault_known = true needs FTC_MODE = 0"),
        (
            "\"plant.wind.turbulence_m_s\"\n",
            "\"plant.wind.turbulence_ms\"\n",
            "nearest is plant.wind.turbulence_m_s",
        ),
        ("values = [0.0, 3.0]", "values = []", "expected 1 to"),
        ("values = [0.0, 3.0]", "values = [0.0, 300.0]", "turbulence_m_s"),
        ("values = [0.0, 3.0]", "grid = { from = 0.0, to = inf, count = 3 }", "finite ends"),
        ("values = [0.0, 3.0]", "values = [0.0]\nuniform = [0.0, 1.0]", "exactly one of"),
        ("uniform = [0.5, 2.0]", "uniform = [2.0, 2.0]", "two numbers in rising order"),
        ("deviation = 0.05", "deviation = 0.0", "a deviation above 0"),
        ("name = \"paper (PID, NESO)\"", "name = \"PID alone\"", "each name once"),
        ("\"rudder\"", "\"canard\"", "has no effector canard"),
        ("scenario = \"nominal\"", "scenario = \"nominale\"", "no such scenario"),
        ("\"peak_roll_rate\"", "\"peak_rolls\"", "no measure peak_rolls"),
        ("as = \"factor\"", "as = \"travel\"", "is for these keys of a fault: angle_deg, "),
        ("[[vary]]", "[[airframe]]\nname = \"a\"\nfile = \"none.toml\"\n\n[[vary]]", "none.toml"),
    ] {
        let message = with(from, to);
        assert!(message.contains(expected), "{to}: {message}");
        // It begins with where the mistake is: a file, a law, or the scenario with its settings.
        let places = ["test.toml:", "law ", "nominal --set ", "nominale: ", "none.toml: "];
        assert!(places.iter().any(|place| message.starts_with(place)), "{to}: {message}");
    }
    let plan = parse(smoke()).expect("the shipped campaign");
    let error = plan.run(32).expect_err("a run that is not there");
    assert_eq!(error.to_string(), "--run 32: test.toml has the runs 0 to 31");
}

#[test]
fn a_setting_that_is_no_single_finite_value_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().display().to_string();
    for value in ["nan", "inf", "{a=1}", "[1]"] {
        let set = format!("plant.wind.speed_m_s={value}");
        let message = try_command(&["run", "smoke", "--out", &out, "--set", &set]).unwrap_err();
        assert!(message.contains("expected a finite number"), "{value}: {message}");
    }
}

#[test]
fn one_value_of_a_listed_variable_is_flown_alone_and_another_one_is_named_with_those_there_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().display().to_string();
    let run = |only: &str| try_command(&["run", "smoke", "--only", only, "--out", &out]);
    let key = "plant.wind.turbulence_m_s";
    let refused = run(&format!("{key}=4")).expect_err("no such value");
    assert!(refused.contains("expected one of 0.0, 3.0"), "{refused}");
    let refused = run("plant.wind.speed_m_s=1").expect_err("no variable");
    assert!(refused.contains(&format!("expected one of {key}")), "{refused}");
    assert_eq!(run(&format!("{key}=3")), Ok(()));
    let head = fs::read_to_string(folder.path().join("campaign.toml")).expect("a head");
    assert!(head.contains("runs = 16"), "{head}");
}

#[test]
fn a_setting_without_an_effect_is_refused() {
    let with = |key: &str| {
        let set = Setting::new(key, 1.0);
        SpecFile::read("smoke").expect("it is shipped").with(&[set]).map(drop)
    };
    for (key, place) in [
        ("FTC_MODE", "[[law]]"),
        ("plant.wind.turbulence_m_s", "[[vary]]"),
        ("plant.fault.1.onset_s", "[[vary]]"),
        ("plant.seed", "seed"),
    ] {
        let message = with(key).expect_err("it has no effect").to_string();
        assert!(message.contains(&format!("{place} sets this one")), "{message}");
    }
    for key in ["airframe.mass.mass_kg", "plant.wind.speed_m_s", "CTL_LAW", "plant.duration_s"] {
        assert!(with(key).is_ok(), "{key}");
    }
    // Some of the aircraft of that campaign set it, and the others would fly alone with the option.
    let some = Setting::new("plant.start.airspeed_m_s", 100.0);
    let refused = SpecFile::read("jam-table").expect("it is shipped").with(&[some]);
    let refused = refused.expect_err("set later").to_string();
    assert!(refused.contains("[[airframe]] sets this one"), "{refused}");
    let forever = Setting::new("plant.duration_s", 1.0e9);
    let refused = SpecFile::read("smoke").expect("it is shipped").with(&[forever]);
    let refused = refused.expect_err("too long").to_string();
    assert!(refused.contains("--set: duration_s = 1000000000: expected more than 0"), "{refused}");
}

#[test]
fn the_suite_keeps_its_step_and_its_bits() {
    for own in [vec![], vec![own_law()]] {
        let file = SpecFile::read_with("ftc-01", &own, &AircraftArgs::default()).expect("shipped");
        assert_eq!(file.spec.step_us, Some(1_000), "{} laws", own.len());
    }
    // As the first version of the suite flew it: the values of its table come from such flights.
    let mut file =
        SpecFile::read_with("ftc-01", &[], &AircraftArgs::default()).expect("it is shipped");
    file.spec.samples = 1;
    let plan = Plan::new(file).expect("it can be flown");
    for (number, altitude_iae) in [(0, 17_370.814_097_070_277), (1, 17_035.589_677_623_797)] {
        let outcome = plan.fly(&plan.run(number).expect("a run")).expect("it can be flown");
        let metrics = serde_json::to_value(&outcome).expect("plain values");
        let flown = metrics["metrics"]["altitude_iae"]["value"].as_f64();
        assert_eq!(flown, Some(altitude_iae), "{}", plan.laws()[number as usize]);
    }
}

/// The PID, under another name.
fn own_law() -> OwnLaw {
    OwnLaw::new("my \"law\"", || Pid::new(&Gains::REFERENCE.pid))
}

#[test]
fn a_law_of_the_program_flies_beside_the_others_or_where_the_specification_selects_it() {
    let plan = |text: &str| {
        let file = SpecFile::parse("test.toml", text.to_owned(), PathBuf::new()).expect("above");
        Plan::new(file.with_own_laws(&[own_law()]).expect("a free name")).expect("it can be flown")
    };
    let beside = plan(smoke());
    assert_eq!(beside.laws(), ["PID alone", "paper (PID, NESO)", "my \"law\""]);
    let selected = plan(&smoke().replacen("FTC_MODE = 0", "FTC_MODE = 0, CTL_LAW = 9", 1));
    assert_eq!(selected.laws().len(), 2);
    // The flight of a law does not depend on how many laws there are.
    for (plan, law) in [(&beside, 2), (&selected, 0)] {
        let setup = plan.setup(&plan.run(law).expect("a run")).expect("a flight");
        assert_eq!(setup.own_law.as_ref().map(OwnLaw::name), Some("my \"law\""));
        assert_eq!(setup.parameters.gains.selection.main, MainLaw::Own);
        assert_eq!(setup.plant.seed, beside.run(0).expect("a run").seed);
    }
    let outcomes = [(&beside, 1), (&beside, 2)].map(|(plan, number)| {
        let outcome = plan.fly(&plan.run(number).expect("a run")).expect("it can be flown");
        format!("{outcome:?}")
    });
    assert_eq!(outcomes[0], outcomes[1], "both are the PID with the paper's compensator");
    let fingerprint = |name: &str| {
        let own = OwnLaw::new(name, || Pid::new(&Gains::REFERENCE.pid));
        let file =
            SpecFile::read_with("smoke", &[own], &AircraftArgs::default()).expect("it is shipped");
        Plan::new(file).expect("it can be flown").fingerprint
    };
    assert_ne!(fingerprint("one"), fingerprint("other"));
    for (name, _) in STUDIES.iter().chain(&SUITE) {
        let file = SpecFile::read_with(name, &[own_law()], &AircraftArgs::default())
            .expect("they are shipped");
        assert_eq!(file.spec.law.last().map(|law| law.name.as_str()), Some("my \"law\""), "{name}");
    }
    let taken = OwnLaw::new("PID alone", || Pid::new(&Gains::REFERENCE.pid));
    let refused =
        SpecFile::read_with("smoke", &[taken], &AircraftArgs::default()).expect_err("a taken name");
    assert!(refused.to_string().contains("each name once"), "{refused}");
}

#[test]
fn results_of_another_campaign_or_version_are_left_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    whole(folder.path());
    let out = folder.path().display().to_string();
    let refused = try_command(&["run", "jams", "--out", &out]).expect_err("another campaign");
    assert!(refused.contains("results of campaign smoke"), "{refused}");
    let head = folder.path().join("campaign.toml");
    let text = fs::read_to_string(&head).expect("a file");
    let other = text.replace(env!("CARGO_PKG_VERSION"), "0.0.7");
    fs::write(&head, other).expect("a file");
    let refused = try_command(&["run", "smoke", "--out", &out]).expect_err("another version");
    assert!(refused.contains("program version 0.0.7"), "{refused}");
    fs::write(&head, "nonsense").expect("a file");
    let refused = try_command(&["run", "smoke", "--out", &out]).expect_err("a damaged file");
    assert!(refused.contains("campaign.toml"), "{refused}");
    // A table that the program did not write stays.
    fs::write(&head, text).expect("a file");
    fs::write(folder.path().join("summary.csv"), "mine").expect("a file");
    let refused = try_command(&["run", "smoke", "--out", &out]).expect_err("a foreign file");
    assert!(refused.contains("summary.csv"), "{refused}");
    assert_eq!(fs::read_to_string(folder.path().join("summary.csv")).expect("a file"), "mine");
}

#[test]
fn a_shard_that_does_not_exist_is_refused() {
    for bad in ["0/3", "4/3", "1/0", "1", "a/b", "-1/2"] {
        let refused = try_command(&["run", "smoke", "--out", "x", "--shard", bad]);
        assert!(
            refused
                .is_err_and(|error| error.contains("K from 1 to N") || error.contains("--shard")),
            "{bad}"
        );
    }
}

/// A small aircraft without a nozzle whose effectors have names of their own: airframe and model in a folder.
fn newcomer(folder: &Path) -> AircraftArgs {
    let names = [("left elevator", "port tail"), ("right elevator", "starboard tail")];
    let names = names.into_iter().chain([("left aileron", "port flaperon")]);
    let names = names.chain([("right aileron", "starboard flaperon")]);
    let write = |name: &str, text: &str| {
        let text = text.replace("name = \"rudder\"", "name = \"fin flap\"");
        let text = names.clone().fold(text, |text, (old, new)| text.replace(old, new));
        fs::write(folder.join(name), text).expect("a file");
        Some(folder.join(name))
    };
    AircraftArgs {
        airframe: write("gull.toml", aircraft::AEROSONDE_AIRFRAME),
        model: write("gull_model.toml", aircraft::AEROSONDE_MODEL),
        settings: Vec::new(),
    }
}

/// Every value that the flights of a campaign set a key to.
fn values_of(plan: &Plan, key: &str) -> Vec<String> {
    let laws = plan.laws().len() as u64;
    let settings = (0..plan.flights()).map(|flight| {
        let run = plan.run(flight * laws).expect("a run");
        plan.settings(&run).expect("settings")
    });
    let mut all: Vec<String> = settings
        .flatten()
        .filter(|setting| setting.key == key)
        .map(|setting| setting.value.to_string().trim_matches('"').to_owned())
        .collect();
    all.sort();
    all.dedup();
    all
}

#[test]
fn campaigns_of_the_jet_fly_an_aircraft_with_other_names_and_leave_out_what_it_lacks() {
    let folder = tempfile::tempdir().expect("a folder");
    let args = newcomer(folder.path());
    let plan = |name: &str| {
        Plan::new(SpecFile::read_with(name, &[], &args).expect("it is shipped")).expect(name)
    };
    for name in ["smoke", "gust", "detection", "engine-fade", "sensor-faults", "ftc-08"] {
        assert!(plan(name).flights() > 0, "{name}");
    }
    for (name, lacking, effectors) in [
        ("delay", "nozzle_pitch, nozzle_yaw", ["left_elevator", "right_aileron", "rudder"]),
        (
            "robustness",
            "model.nozzle.arm_m, nozzle_yaw",
            ["left_elevator", "right_aileron", "rudder"],
        ),
        ("tuning", "nozzle_yaw", ["left_aileron", "right_elevator", "rudder"]),
    ] {
        let plan = plan(name);
        let notes = plan.notes().join("\n");
        assert!(notes.contains(&format!("has no {lacking}: what names it is left out")), "{notes}");
        let ganged = "has no nozzle: PID, ganged nozzle flies as its PID alone";
        assert_eq!(notes.matches(ganged).count(), 1, "{notes}");
        assert_eq!(values_of(&plan, "plant.fault.1.effector"), effectors, "{name}");
    }
    // A fault of a nozzle in every flight is left out where it is the last one; before another one it would leave a gap.
    let both = |nozzle: u8, rudder: u8| {
        let more = format!(
            "\"plant.fault.{nozzle}.effector\" = \"nozzle_pitch\"\n\"plant.fault.{nozzle}.kind\" = \"stuck_here\"\n\
             \"plant.fault.{nozzle}.onset_s\" = 1.0\n"
        );
        let text = RUDDER.replace("plant.fault.1", &format!("plant.fault.{rudder}"));
        let text = text.replace("[set]\n", &format!("[set]\n{more}"));
        let path = folder.path().join("both.toml");
        fs::write(&path, text).expect("a file");
        let file = SpecFile::read_with(path.to_str().expect("a path"), &[], &args);
        Plan::new(file.expect("a specification")).map_err(|problem| problem.to_string())
    };
    let left_out = both(2, 1).expect("the nozzle is the last one").notes().join("\n");
    assert!(left_out.contains("has no nozzle_pitch: what names it is left out"), "{left_out}");
    let refused = both(1, 2).map(drop).expect_err("a gap");
    assert!(refused.contains("has no effector nozzle_pitch"), "{refused}");
    let typo = RUDDER.replace("effector\" = \"rudder\"", "effector\" = \"ruder\"");
    assert!(parse(&typo).expect_err("a typing error").contains("ruder"));
}

#[test]
fn parts_of_travel_and_thrust_are_the_numbers_of_the_jet() {
    let plan = |name| Plan::new(SpecFile::read(name).expect("it is shipped")).expect("a plan");
    let sensors = plan("sensor-faults");
    assert_eq!(values_of(&sensors, "plant.fault.1.bias_kn"), ["5.0"]);
    assert_eq!(values_of(&sensors, "plant.fault.1.rate_kn_s"), ["0.5"]);
    assert_eq!(values_of(&sensors, "plant.fault.1.noise_kn"), ["5.0"]);
    let angles =
        ["-3.0", "-30.0", "-8.0", "12.0", "15.0", "20.0", "25.0", "3.0", "30.0", "7.0", "8.0"];
    assert_eq!(values_of(&plan("detection"), "plant.fault.1.angle_deg"), angles);
}

/// SHA-256 of each scenario of the suite with its laws. They are frozen: results of different versions are compared. A scenario
/// or law that changes is a new suite, with a record in docs/decisions/.
const SUITE_SHA256: [&str; 12] = [
    "9e7ae81d863ae7a72e9211e8a8bb87f6a70ff7d99da7e8f3c0a6c73a5b490432",
    "08cb4d8b655426ac4a9d7730dedd1b6d6396e38196d9040c5a9cd14168f3ad34",
    "5228a92cd6ba43176088087d9db1e06b8ad0987c33a824cf38105f00dcbe5a78",
    "f67dfd6b8289569f96d2c578c2247ec3a416c4a56b163c25cc67ac42c40581d6",
    "7e80da318a3b35ca47ea95d722f06836037a5e8d70c1c158fc14cb8181feaad8",
    "d50e43798c1f9f1b1da48c7cd032e440f5788884cd4f22771fa54107b7111658",
    "0e3b96cc643b90fd500dc4f3f56d1b5bc691c4566eeca306881f242a3b675805",
    "4a3a1fb876ac8ef45ef316b59e6dc04e5029063c4476f0b33cfa8af911ea94a6",
    "29e560919c65de44bdc947f39642ffb38f4632d636540e1e9abbea95945d529a",
    "21d3727f0e0bb1c379ce344d6f9b80cbd2fe9600783e62bfbc77493a0122e346",
    "ead43c6817d4f5f65b4cf123d4516125538f18c4c3c669ae0a755e0d4a0ce63b",
    "4c87ff253ca6252a4884fc5d16a45ee50bf61b99f1ff465c59c1db315f68caf1",
];

#[test]
fn the_suite_never_changes_silently() {
    for ((name, text), expected) in SUITE.iter().zip(SUITE_SHA256) {
        let digest = Sha256::digest(text.as_bytes());
        let found: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(found, expected, "{name} is frozen (docs/campaigns.md)");
        let plan = Plan::new(SpecFile::read(name).expect("a scenario")).expect("a plan");
        assert!(plan.flights() >= 12 && plan.laws().len() == 10, "{name}");
    }
}

/// A jammed rudder and its angle, for two laws.
const RUDDER: &str = r#"
name = "rudder"
duration_s = 12.0
scenario = "nominal"
samples = 8
design = "sobol"

[set]
"plant.fault.1.kind" = "stuck_at"
"plant.fault.1.effector" = "rudder"

[[vary]]
key = "plant.fault.1.angle_deg"
uniform = [0.0, 20.0]

[[vary]]
key = "plant.fault.1.onset_s"
uniform = [1.0, 2.0]

[[law]]
name = "PID alone"
set = { FTC_MODE = 0 }

[[law]]
name = "paper"
set = { FTC_MODE = 1 }
"#;

#[test]
fn the_smallest_fault_that_a_law_does_not_survive_is_found_and_written_as_a_scenario() {
    let folder = tempfile::tempdir().expect("a folder");
    let spec = folder.path().join("rudder.toml");
    fs::write(&spec, RUDDER).expect("a file");
    let spec = spec.display().to_string();
    let out = |name: &str| folder.path().join(name).display().to_string();
    command(&["worst", &spec, "--over", "plant.fault.1.angle_deg", "--out", &out("over")]);
    let table = fs::read_to_string(folder.path().join("over/worst.csv")).expect("a table");
    let cell = |line: &str, place: usize| {
        line.split(',').nth(place).and_then(|cell| cell.parse::<f64>().ok()).expect("a number")
    };
    let rows: Vec<&str> = table.lines().skip(1).collect();
    let lost_deg: Vec<f64> = rows.iter().map(|row| cell(row, 3)).collect();
    // The compensator of the paper survives about twice the angle of the PID alone.
    assert!((3.0..9.0).contains(&lost_deg[0]) && (11.0..16.0).contains(&lost_deg[1]), "{table}");
    for (row, lost_deg) in rows.iter().zip(&lost_deg) {
        let kept_deg = cell(row, 6);
        assert!(kept_deg < *lost_deg && lost_deg - kept_deg < 0.02, "{table}");
    }
    // Table and scenario have all digits.
    let scenario = fs::read_to_string(folder.path().join("over/worst-001.toml")).expect("a file");
    let angle = scenario.lines().find_map(|line| line.strip_prefix("angle_deg = "));
    let angle: f64 = angle.and_then(|angle| angle.parse().ok()).expect("an angle");
    assert_eq!(angle, lost_deg[1], "{scenario}");
    // All variables together: the draw that is nearest to the medians, 10 deg here, which the paper's law does not survive.
    command(&["worst", &spec, "--out", &out("all")]);
    let table = fs::read_to_string(folder.path().join("all/worst.csv")).expect("a table");
    let row = table.lines().nth(2).expect("the second law");
    assert!((0.1..0.5).contains(&cell(row, 7)), "{table}");
    for (words, expected) in [
        (vec!["--over", "plant.fault.1.effector"], "no such variable"),
        (vec!["--over", "plant.fault.1.angle_deg", "--from", "31"], "expected 0 to 20"),
        (vec!["--over", "plant.fault.1.angle_deg", "--from", "nan"], "expected 0 to 20"),
    ] {
        let mut line = vec!["worst", &spec, "--out", folder.path().to_str().expect("a path")];
        line.extend(words);
        let refused = try_command(&line).expect_err(expected);
        assert!(refused.contains(expected), "{refused}");
    }
}

#[test]
fn a_search_without_a_loss_or_without_a_mild_value_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let spec = folder.path().join("rudder.toml");
    fs::write(&spec, RUDDER.replace("[0.0, 20.0]", "[14.0, 20.0]")).expect("a file");
    let out = folder.path().join("out");
    let rows = |over: &[&str]| -> Vec<Vec<String>> {
        let [spec, out] = [&spec, &out].map(|path| path.display().to_string());
        let words = ["worst", &spec, "--out", &out, "--over"];
        command(&words.iter().chain(over).copied().collect::<Vec<_>>());
        let table = fs::read_to_string(Path::new(&out).join("worst.csv")).expect("a table");
        let cells = |row: &str| row.split(',').map(str::to_owned).collect();
        table.lines().skip(1).map(cells).collect()
    };
    // airframe, law, towards, angle, onset, lost at, kept to, distance, scenario
    for row in rows(&["plant.fault.1.angle_deg"]) {
        // Not even the mildest angle was survived: nothing is known of what would be.
        assert!(row[3] == "14" && !row[5].is_empty() && row[6].is_empty(), "{row:?}");
        assert!(row[4] == "1.5", "the onset is that of the median: {row:?}");
    }
    fs::write(&spec, RUDDER.replace("[0.0, 20.0]", "[1.0, 2.0]")).expect("a file");
    for row in rows(&["plant.fault.1.angle_deg"]) {
        // The end of the range was survived. Only what was searched has no value.
        assert!(row[3].is_empty() && row[4] == "1.5" && row[5].is_empty(), "{row:?}");
        assert!(row[6] == "2" && row[7].is_empty() && row[8].is_empty(), "{row:?}");
    }
}

#[test]
fn a_scenario_of_the_program_comes_before_a_file_of_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("nominal"), "no TOML").expect("a file");
    fs::write(folder.path().join("mine"), "no TOML").expect("a file");
    let plan = |text: &str| {
        let file = SpecFile::parse("test.toml", text.to_owned(), folder.path().to_path_buf());
        Plan::new(file.expect("a specification")).map(drop).map_err(|error| error.to_string())
    };
    assert_eq!(plan(RUDDER), Ok(()));
    let refused = plan(&RUDDER.replace("\"nominal\"", "\"mine\"")).expect_err("no scenario");
    assert!(refused.contains("mine"), "{refused}");
}

#[test]
fn a_run_that_is_not_there_is_refused_with_the_range() {
    for run in ["-1", "32", "18446744073709551616"] {
        let refused = try_command(&["replay", "smoke", "--run", run]).expect_err("no such run");
        assert_eq!(refused, format!("--run {run}: smoke has the runs 0 to 31"));
    }
}

#[test]
fn two_campaigns_are_compared_run_by_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let spec = folder.path().join(format!("{name}.toml"));
        fs::write(&spec, text).expect("a file");
        let out = folder.path().join(name);
        command(&["run", &spec.display().to_string(), "--out", &out.display().to_string()]);
        out
    };
    let one = write("one", RUDDER);
    let same = write("same", RUDDER);
    let other = write("other", &RUDDER.replace("FTC_MODE = 1", "FTC_MODE = 0"));
    let text = compare::folders(&one, &same).expect("two tables");
    assert_eq!(text.matches("8 of 8 runs are the same to the bit").count(), 2, "{text}");
    let text = compare::folders(&one, &other).expect("two tables");
    assert!(text.contains("PID alone: 8 of 8 runs") && text.contains("lost in B only"), "{text}");
    let law = "\n[[law]]\nname = \"NDI\"\nset = { FTC_MODE = 0, CTL_LAW = 2 }\n";
    let more = write("more", &format!("{RUDDER}{law}"));
    for (a, b, folder) in [(&one, &more, "B"), (&more, &one, "A")] {
        let text = compare::folders(a, b).expect("two tables");
        assert_eq!(text.matches("8 of 8 runs are the same to the bit").count(), 2, "{text}");
        assert!(text.contains(&format!("laws in {folder} only, left out: NDI")), "{text}");
    }
    let renamed = RUDDER.replace("PID alone", "a").replace("\"paper\"", "\"b\"");
    let refused = compare::folders(&one, &write("renamed", &renamed)).expect_err("other laws");
    assert!(refused.to_string().contains("it has no law of the first folder"), "{refused}");
    let longer = write("longer", &RUDDER.replace("samples = 8", "samples = 9"));
    let refused = compare::folders(&one, &longer).expect_err("another number of runs").to_string();
    assert!(refused.contains("18 runs, and the first folder has 16"), "{refused}");
    let seeds = write("seeds", &RUDDER.replace("samples = 8", "samples = 8\nseed = 2"));
    let refused = compare::folders(&one, &seeds).expect_err("other flights").to_string();
    assert!(refused.contains("run 0 is another flight"), "{refused}");
    fs::write(same.join("runs.parquet"), "PAR1 nonsense").expect("a file");
    let refused = compare::folders(&one, &same).expect_err("a damaged table").to_string();
    assert!(refused.contains("runs.parquet"), "{refused}");
}
