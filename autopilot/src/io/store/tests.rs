use std::fs;
use std::process::{self, Command, Stdio};

use super::*;
use flight_management::parameters::to_text;

fn text(bandwidth: f64) -> String {
    let mut parameters = Parameters::default();
    parameters.set("OBS_W0", bandwidth).unwrap();
    to_text(&parameters, &Parameters::default())
}

fn bandwidth(path: &Path) -> f64 {
    let kept = ParameterFile::At(path.to_path_buf()).read(&Parameters::default()).unwrap().unwrap();
    kept.parameters.gains.neso.bandwidth
}

fn replace(path: &Path, text: &str) -> Result<(), FileProblem> {
    own_file(path).replace(text.as_bytes())
}

fn save(number: u64, bandwidth: f64) -> Save {
    Save { number, text: text(bandwidth), at_once: false }
}

#[test]
fn what_was_handed_over_last_is_in_the_file_when_the_store_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("not/there/yet/parameters.toml");
    let store = Store::open(own_file(&path), "parameter file").unwrap();
    for number in 1..=200_u32 {
        store.save(save(number.into(), f64::from(number)));
    }
    drop(store);
    assert_eq!(bandwidth(&path), 200.0);
    let files = fs::read_dir(path.parent().unwrap()).unwrap().count();
    assert_eq!(files, 1, "no new file is left over");
}

#[test]
fn somebody_who_waits_gets_the_number_of_the_save() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parameters.toml");
    let store = Store::open(own_file(&path), "parameter file").unwrap();
    store.save(Save { at_once: true, ..save(7, 40.0) });
    let outcome = (0..10_000).find_map(|_| {
        thread::yield_now();
        let outcome = store.outcome();
        if outcome.is_none() {
            // Sleeping is for io only, and waiting for the disk is what this is about.
            let (lock, wake) = (Mutex::new(()), Condvar::new());
            drop(wake.wait_timeout(lock.lock().unwrap(), Duration::from_millis(1)));
        }
        outcome
    });
    assert_eq!(outcome, Some(Saved { number: 7, result: Ok(()) }));
    assert_eq!(bandwidth(&path), 40.0);
    assert_eq!(store.outcome(), None, "told once");
}

#[test]
fn a_write_that_fails_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parameters.toml");
    replace(&path, &text(40.0)).unwrap();
    // A folder has the name that the new file would take.
    let taken = folder.path().join(format!("parameters.toml.{}.new", process::id()));
    fs::create_dir(taken).unwrap();
    assert!(replace(&path, &text(50.0)).is_err());
    assert_eq!(bandwidth(&path), 40.0);
}

#[test]
fn a_file_of_somebody_else_is_not_replaced_and_the_save_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parameters.toml");
    let store = Store::open(own_file(&path), "parameter file").unwrap();
    for (number, foreign) in [(1, "my = \"diary\"\n"), (2, "not even TOML")] {
        fs::write(&path, foreign).unwrap();
        store.save(Save { at_once: true, ..save(number, 40.0) });
        let outcome = loop {
            match store.outcome() {
                Some(outcome) => break outcome,
                None => thread::yield_now(),
            }
        };
        let problem = outcome.result.unwrap_err();
        assert!(problem.contains("not written by this program"), "{problem}");
        assert_eq!(fs::read_to_string(&path).unwrap(), foreign);
    }
}

#[test]
fn a_link_stays_a_link_and_its_file_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("real.toml"), folder.path().join("parameters.toml"));
    fs::write(&file, text(40.0)).unwrap();
    std::os::unix::fs::symlink(&file, &link).unwrap();
    let store = Store::open(own_file(&link), "parameter file").unwrap();
    store.save(save(1, 50.0));
    drop(store);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(bandwidth(&file), 50.0);
}

#[test]
fn a_file_that_is_not_there_keeps_defaults_and_one_that_cannot_be_read_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let missing = ParameterFile::At(folder.path().join("no.toml"))
        .read(&Parameters::default())
        .unwrap()
        .unwrap();
    assert_eq!(missing.parameters, Parameters::default());
    assert_eq!(missing.summary(), None);
    assert_eq!(ParameterFile::None.read(&Parameters::default()), Ok(None));
    let message = ParameterFile::At(folder.path().to_path_buf())
        .read(&Parameters::default())
        .unwrap_err()
        .to_string();
    assert!(message.contains("cannot be read"), "{message}");
    let path = folder.path().join("parameters.toml");
    fs::write(&path, [0xFF, 0xFE]).unwrap();
    let message = ParameterFile::At(path).read(&Parameters::default()).unwrap_err().to_string();
    assert!(message.contains("parameters.toml: cannot be read"), "{message}");
}

#[test]
fn the_summary_names_file_and_values() {
    let mut parameters = Parameters::default();
    parameters.set_all([("OBS_W0", 40.0), ("FTC_MODE", 0.0)]).unwrap();
    let kept = Kept { path: PathBuf::from("p.toml"), parameters, defaults: Parameters::default() };
    let summary = kept.summary().unwrap();
    assert_eq!(summary, "parameters: 2 saved values from p.toml: FTC_MODE = 0, OBS_W0 = 40");
}

#[test]
fn the_file_is_in_the_data_folder_of_the_user() {
    let place = |data: Option<&str>, home: Option<&str>| {
        ParameterFile::in_data_folder(data.map(Into::into), home.map(Into::into))
    };
    let at = |path: &str| ParameterFile::At(PathBuf::from(path));
    assert_eq!(place(Some("/d"), Some("/h")), at("/d/two-step/parameters.toml"));
    assert_eq!(place(None, Some("/h")), at("/h/.local/share/two-step/parameters.toml"));
    assert_eq!(place(Some("d"), Some("/h")), at("/h/.local/share/two-step/parameters.toml"));
    assert_eq!(place(None, None), ParameterFile::None);
    assert_eq!("none".parse(), Ok(ParameterFile::None));
    assert_eq!("p.toml".parse(), Ok(at("p.toml")));
}

/// Not a test of its own: the process that is killed below.
#[test]
#[ignore = "runs until it is killed"]
fn writes_without_end() {
    let Some(path) = env::var_os("PARAMETER_FILE_TO_WRITE").map(PathBuf::from) else { return };
    for round in 0_u32.. {
        replace(&path, &text(if round % 2 == 0 { 40.0 } else { 50.0 })).unwrap();
    }
}

#[test]
fn a_writer_that_is_killed_leaves_the_old_file_or_the_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parameters.toml");
    for round in 0..20_u32 {
        replace(&path, &text(30.0)).unwrap();
        let mut writer = Command::new(env::current_exe().unwrap())
            .args(["--ignored", "--exact", "io::store::tests::writes_without_end"])
            .env("PARAMETER_FILE_TO_WRITE", &path)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        while bandwidth(&path) == 30.0 {
            thread::yield_now();
        }
        // Later with each round, so that it is not always the same moment of a write.
        let mut reads = 0;
        while reads < 50 * round {
            assert!([40.0, 50.0].contains(&bandwidth(&path)));
            reads += 1;
        }
        writer.kill().unwrap();
        writer.wait().unwrap();
        assert!([40.0, 50.0].contains(&bandwidth(&path)), "round {round}");
    }
}

#[test]
fn the_plan_file_stands_beside_the_parameters_and_a_file_of_another_program_stays() {
    let folder = tempfile::tempdir().unwrap();
    let parameters = ParameterFile::At(folder.path().join("parameters.toml"));
    let kept = parameters.read_plan().unwrap().unwrap();
    assert_eq!((kept.plan.count(), kept.summary()), (0, None), "not there yet");
    assert_eq!(kept.path, folder.path().join("parameters.plan.toml"));
    assert_eq!(ParameterFile::None.read_plan().unwrap(), None);

    fs::write(&kept.path, "count = 0\n").unwrap();
    kept.own_file().replace(b"count = 0\nitem = []\n").unwrap();
    fs::write(&kept.path, "notes of another program").unwrap();
    let message = parameters.read_plan().unwrap_err().to_string();
    assert!(message.contains("parameters.plan.toml: "), "{message}");
    assert!(kept.own_file().replace(b"count = 0\n").is_err());
    assert_eq!(fs::read_to_string(&kept.path).unwrap(), "notes of another program");
}
