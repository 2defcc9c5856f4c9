//! Parts and folders of other campaigns, other files and other builds, and campaigns that are started at once.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Barrier;
use std::thread;

use lab_campaign::plan::Plan;
use lab_campaign::spec::SpecFile;
use lab_campaign::store::{RunEnd, RunStore};
use lab_campaign::{Command, fly, run};
use studies::STUDIES;

fn smoke() -> &'static str {
    STUDIES.iter().find(|(name, _)| *name == "smoke").expect("it is shipped").1
}

fn plan(text: &str, folder: &Path) -> Plan {
    let file = SpecFile::parse("test.toml", text.to_owned(), folder.to_path_buf());
    Plan::new(file.expect("a specification")).expect("a plan")
}

/// Carries out a command line.
fn command(words: &[&str]) -> Result<(), String> {
    #[derive(clap::Parser)]
    struct Line {
        #[command(subcommand)]
        command: Command,
    }
    let words = std::iter::once("campaign").chain(words.iter().copied());
    let line = <Line as clap::Parser>::try_parse_from(words).map_err(|error| error.to_string())?;
    run(&line.command, &[]).map_err(|error| error.to_string())
}

/// The specification in a file of the folder, flown into a folder of that name.
fn flown(folder: &Path, name: &str, text: &str) -> (String, PathBuf) {
    let spec = folder.join(format!("{name}.toml"));
    fs::write(&spec, text).expect("a file");
    let (spec, out) = (spec.display().to_string(), folder.join(name));
    assert_eq!(command(&["run", &spec, "--out", &out.display().to_string()]), Ok(()));
    (spec, out)
}

const PART: &str = "parts/00000000.part";

/// `run`, `--shard` and `merge` of a campaign all refuse the part that lies in its folder, by name, and leave no table of it.
fn refused(spec: &str, folder: &Path, expected: &str) {
    let _ = fs::remove_file(folder.join("runs.parquet"));
    let out = folder.display().to_string();
    let merged = format!("{out} merged");
    for words in [
        vec!["run", spec, "--out", &out],
        vec!["run", spec, "--out", &out, "--shard", "1/1"],
        vec!["merge", spec, "--out", &merged, &out],
    ] {
        let error = command(&words).expect_err(expected);
        assert!(error.contains(PART) && error.contains(expected), "{words:?}: {error}");
    }
    assert!(!folder.join("runs.parquet").exists());
}

#[test]
fn a_part_of_another_campaign_or_build_is_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let airframe = folder.path().join("jet.toml");
    let tables = |text: &str| {
        fs::write(&airframe, text).expect("a file");
        let with = "\n[[airframe]]\nname = \"jet\"\nfile = \"jet.toml\"\n\n[[law]]";
        smoke().replacen("\n[[law]]", with, 1)
    };
    let jet = aircraft::DEFAULT_AIRFRAME;
    let (_, other_jet) =
        flown(folder.path(), "other jet", &tables(&jet.replacen("mass_kg = ", "mass_kg = 1", 1)));
    let (spec, mine) = flown(folder.path(), "mine", &tables(jet));
    let whole = fs::read(mine.join(PART)).expect("a part");
    let (_, other_seed) =
        flown(folder.path(), "seed", &tables(jet).replace("seed = 7", "seed = 8"));
    let (_, fewer) = flown(folder.path(), "fewer", &tables(jet).replace("\"peak_roll_rate\"", ""));
    for other in [&other_jet, &other_seed, &fewer] {
        fs::copy(other.join(PART), mine.join(PART)).expect("a part");
        refused(&spec, &mine, "fingerprint");
    }
    // The same version of the program with other sources: its name stands in the part, with the checksum of the content before.
    let head = whole.iter().position(|byte| *byte == b'\n').expect("a line") + 1;
    let mut built = whole.clone();
    let at = built.windows(8).position(|text| text == b"sources ").expect("it is named") + 8;
    built[at] = if built[at] == b'0' { b'1' } else { b'0' };
    let crc = crc32fast::hash(&built[head + 12..]);
    built[head + 8..head + 12].copy_from_slice(&crc.to_le_bytes());
    fs::write(mine.join(PART), built).expect("a file");
    refused(&spec, &mine, "program version");
    fs::write(mine.join(PART), whole).expect("a file");
    assert_eq!(command(&["run", &spec, "--out", &mine.display().to_string()]), Ok(()));
}

#[test]
fn a_part_with_what_no_flight_gives_is_refused_by_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let (spec, out) = flown(folder.path(), "smoke", smoke());
    let plan = plan(smoke(), folder.path());
    let store = RunStore::open(&plan, &out).expect("its folder");
    let rows = store.read(0).expect("a file").expect("a part");
    let kept = rows.iter().position(|row| row.end == RunEnd::Kept).expect("one is kept");
    let with = |change: &dyn Fn(&mut Vec<lab_campaign::store::Row>), expected: &str| {
        let mut rows = rows.clone();
        change(&mut rows);
        store.write(0, &rows).expect("it can be written");
        refused(&spec, &out, expected);
    };
    with(&|rows| rows[kept].measures.clear(), "0 measures");
    with(&|rows| rows[kept].measures[3] = Some(f64::NAN), "is NaN; it must be finite");
    with(&|rows| rows[kept].end_s = f64::INFINITY, "end_s is inf");
    with(&|rows| rows[kept].lost_at_s = Some(1.0), "kept with lost_at_s");
    with(&|rows| rows.truncate(5), "it has 5 runs from 0 on; it must have 0 to 31");
    with(&|rows| rows.swap(0, 1), "it must have 0 to 31");
}

#[test]
fn a_file_that_changes_while_its_campaign_is_flown_ends_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let jet = aircraft::DEFAULT_AIRFRAME;
    fs::write(folder.path().join("jet.toml"), jet).expect("a file");
    let airframe = "\n[[airframe]]\nname = \"jet\"\nfile = \"jet.toml\"\n\n[[law]]";
    let plan = plan(&smoke().replacen("\n[[law]]", airframe, 1), folder.path());
    let store = RunStore::open(&plan, &folder.path().join("out")).expect("a new folder");
    let other = jet.replacen("mass_kg = ", "mass_kg = 1", 1);
    fs::write(folder.path().join("jet.toml"), other).expect("a file");
    let error = fly::fly(&plan, &store, None).expect_err("another aircraft").to_string();
    assert!(error.contains("jet.toml") && error.contains("has changed"), "{error}");
    assert!(!store.has(0).expect("a folder"));
}

#[test]
fn of_two_campaigns_that_begin_at_once_in_one_folder_one_is_refused() {
    let plans = ["seed = 7", "seed = 8"]
        .map(|seed| plan(&smoke().replace("seed = 7", seed), Path::new("")));
    for _ in 0..50 {
        let folder = tempfile::tempdir().expect("a folder");
        let barrier = Barrier::new(plans.len());
        let opened = thread::scope(|scope| {
            let open = |plan| {
                let barrier = &barrier;
                let folder = folder.path();
                scope.spawn(move || {
                    barrier.wait();
                    RunStore::open(plan, folder).map(drop).map_err(|error| error.to_string())
                })
            };
            let both = plans.each_ref().map(open);
            both.map(|one| one.join().expect("no panic"))
        });
        let refused: Vec<&String> =
            opened.iter().filter_map(|result| result.as_ref().err()).collect();
        assert!(refused.len() == 1 && refused[0].contains("take another folder"), "{opened:?}");
        let left = fs::read_dir(folder.path()).expect("a folder").count();
        assert_eq!(left, 2, "campaign.toml and parts");
    }
}

#[test]
fn one_campaign_that_is_started_twice_at_once_has_the_bytes_of_one() {
    let folder = tempfile::tempdir().expect("a folder");
    let (spec, alone) = flown(folder.path(), "alone", smoke());
    let both = folder.path().join("both");
    thread::scope(|scope| {
        for _ in 0..2 {
            let words = ["run", &spec, "--out", both.to_str().expect("a path")];
            scope.spawn(move || assert_eq!(command(&words), Ok(())));
        }
    });
    for name in [PART, "runs.parquet", "summary.csv", "summary.parquet", "campaign.toml"] {
        let read = |folder: &Path| fs::read(folder.join(name)).expect("a finished campaign");
        assert!(read(&alone) == read(&both), "{name} differs");
    }
    let count = |folder: &Path| fs::read_dir(folder).expect("a folder").count();
    assert_eq!((count(&both), count(&both.join("parts"))), (count(&alone), 1));
}
