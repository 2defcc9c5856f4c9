use std::fs;
use std::io::Write as _;
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _, symlink};
use std::process::{Command, Stdio};

use super::*;
use flight_management::parameters::to_text;
use mavlink_services::signing::{Key, Timestamp};

fn text(bandwidth: f64) -> String {
    let mut parameters = Parameters::default();
    parameters.set("OBS_W0", bandwidth).unwrap();
    to_text(&parameters, &Parameters::default())
}

fn kept(path: &Path) -> KeptParameters {
    KeptParameters::read(path.to_path_buf(), &Parameters::default()).unwrap()
}

fn bandwidth(path: &Path) -> f64 {
    kept(path).parameters.gains.neso.bandwidth
}

/// The parameter file, with any content.
fn own_file(path: &Path) -> OwnFile {
    let (parameters, defaults) = (Parameters::default(), Parameters::default());
    KeptParameters { path: path.to_path_buf(), parameters, defaults }.own_file()
}

fn replace(path: &Path, text: &str) -> Result<(), FileProblem> {
    own_file(path).replace(text.as_bytes())
}

fn open(path: &Path) -> Store {
    Store::open(own_file(path), "parameter file").unwrap()
}

fn save(number: u64, bandwidth: f64) -> Save {
    Save { number, text: text(bandwidth), at_once: false }
}

#[test]
fn the_latest_text_is_in_the_file_when_the_store_is_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("not/there/yet/parameters.toml");
    let store = open(&path);
    for number in 1..=200_u32 {
        store.change(save(number.into(), f64::from(number)));
    }
    drop(store);
    assert_eq!(bandwidth(&path), 200.0);
    let files = fs::read_dir(path.parent().unwrap()).unwrap().count();
    assert_eq!(files, 1, "no new file is left over");
}

#[test]
fn a_save_that_a_client_waits_for_is_reported_by_its_number() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parameters.toml");
    let store = open(&path);
    store.change(Save { at_once: true, ..save(7, 40.0) });
    let outcome = (0..10_000).find_map(|_| {
        thread::yield_now();
        let outcome = store.outcome();
        if outcome.is_none() {
            // Sleeping is for io only, and waiting for the disk is the subject of this test.
            let (lock, wake) = (Mutex::new(()), Condvar::new());
            drop(wake.wait_timeout(lock.lock().unwrap(), Duration::from_millis(1)));
        }
        outcome
    });
    assert_eq!(outcome, Some(Saved { number: 7, result: Ok(()) }));
    assert_eq!(bandwidth(&path), 40.0);
    assert_eq!(store.outcome(), None, "reported once");
}

#[test]
fn a_write_that_fails_leaves_the_old_file() {
    let folder = tempfile::tempdir().unwrap();
    // The new file, whose name is longer, cannot be created beside it.
    let path = folder.path().join("p".repeat(250));
    fs::write(&path, text(40.0)).unwrap();
    assert!(replace(&path, &text(50.0)).is_err());
    assert_eq!(bandwidth(&path), 40.0);
}

#[test]
fn a_file_with_other_content_is_not_replaced_and_the_outcome_has_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("parameters.toml");
    let store = open(&path);
    for (number, foreign) in [(1, "my = \"diary\"\n"), (2, "not even TOML")] {
        fs::write(&path, foreign).unwrap();
        store.change(Save { at_once: true, ..save(number, 40.0) });
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
    symlink(&file, &link).unwrap();
    let store = open(&link);
    store.change(save(1, 50.0));
    drop(store);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(bandwidth(&file), 50.0);
}

#[test]
fn a_file_that_is_not_there_keeps_defaults_and_one_that_cannot_be_read_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let missing = kept(&folder.path().join("no.toml"));
    assert_eq!(missing.parameters, Parameters::default());
    assert_eq!(missing.summary(), None);
    let refusal = |path: &Path| {
        let read = KeptParameters::read(path.to_path_buf(), &Parameters::default());
        read.unwrap_err().to_string()
    };
    let message = refusal(folder.path());
    assert!(message.contains("cannot be read"), "{message}");
    let path = folder.path().join("parameters.toml");
    fs::write(&path, [0xFF, 0xFE]).unwrap();
    let message = refusal(&path);
    assert!(message.contains("parameters.toml: cannot be read"), "{message}");
}

#[test]
fn the_summary_names_file_and_values() {
    let mut parameters = Parameters::default();
    parameters.set_all([("OBS_W0", 40.0), ("FTC_MODE", 0.0)]).unwrap();
    let defaults = Parameters::default();
    let kept = KeptParameters { path: PathBuf::from("p.toml"), parameters, defaults };
    let summary = kept.summary().unwrap();
    assert_eq!(summary, "parameters: 2 saved values from p.toml: FTC_MODE = 0, OBS_W0 = 40");
}

#[test]
fn files_are_in_the_data_folder_of_the_user_unless_an_option_names_another_place() {
    let folder = |data: Option<&str>, home: Option<&str>| {
        data_folder(data.map(Into::into), home.map(Into::into))
    };
    assert_eq!(folder(Some("/d"), Some("/h")), Some("/d".into()));
    assert_eq!(folder(None, Some("/h")), Some("/h/.local/share".into()));
    assert_eq!(folder(Some("d"), Some("/h")), Some("/h/.local/share".into()));
    assert_eq!(folder(None, None), None);
    let at = PathOption::At("p.toml".into());
    assert_eq!("none".parse(), Ok(PathOption::None));
    assert_eq!("p.toml".parse(), Ok(at.clone()));
    assert_eq!("".parse::<PathOption>(), Err(EmptyPath));
    assert_eq!(PathOption::path(Some(&at), "name"), Some("p.toml".into()));
    assert_eq!(PathOption::path(Some(&PathOption::None), "name"), None);
}

/// Not a test by itself: the process that the test below kills.
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
fn the_plan_file_is_beside_the_parameters_and_a_file_of_another_program_stays() {
    let folder = tempfile::tempdir().unwrap();
    let parameters = folder.path().join("parameters.toml");
    let kept = KeptPlan::read_beside(&parameters).unwrap();
    assert_eq!((kept.plan.counts(), kept.summary()), ([0; 3], None), "not there yet");
    assert_eq!(kept.path, folder.path().join("parameters.plan.toml"));

    fs::write(&kept.path, "count = 0\n").unwrap();
    kept.own_file().replace(b"count = 0\nitem = []\n").unwrap();
    fs::write(&kept.path, "notes of another program").unwrap();
    let message = KeptPlan::read_beside(&parameters).unwrap_err().to_string();
    assert!(message.contains("parameters.plan.toml: "), "{message}");
    assert!(kept.own_file().replace(b"count = 0\n").is_err());
    assert_eq!(fs::read_to_string(&kept.path).unwrap(), "notes of another program");
}

fn record(units: u64) -> KeyRecord {
    let timestamp = Timestamp::new(units).unwrap();
    KeyRecord { key: Key::new([7; 32]).unwrap(), timestamp, accepted: timestamp, is_final: true }
}

fn open_key(path: &Path) -> Store {
    let kept = KeptKey { path: path.to_path_buf(), record: None };
    Store::open(kept.own_file(), "signing key").unwrap()
}

/// Writes a file of its owner alone, over any existing one.
fn put(path: &Path, text: &str) {
    let mut options = fs::OpenOptions::new();
    let file = options.write(true).create(true).truncate(true).mode(KEY_MODE).open(path);
    file.unwrap().write_all(text.as_bytes()).unwrap();
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().mode() & 0o7777
}

fn key_refusal(path: &Path) -> String {
    KeptKey::read(path.to_path_buf()).unwrap_err().to_string()
}

#[test]
fn the_latest_key_is_in_a_file_and_folders_of_its_owner_alone_when_the_store_is_dropped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("not/there/signing.key");
    let store = open_key(&path);
    for units in 1..=100 {
        store.change(KeyChange::Keep(record(units)));
    }
    drop(store);
    let kept = KeptKey::read(path.clone()).unwrap();
    assert_eq!(kept.record, Some(record(100)));
    assert_eq!(mode(&path), 0o600);
    assert_eq!(mode(path.parent().unwrap()), 0o700);
    assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1, "nothing is left over");
}

#[test]
fn a_key_that_is_forgotten_leaves_no_file_also_where_there_was_none() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("signing.key");
    for _ in 0..2 {
        let store = open_key(&path);
        store.change(KeyChange::Forget);
        drop(store);
        assert!(!path.exists());
        put(&path, &record(1).to_text());
    }
    let none = KeptKey::read(folder.path().join("other")).unwrap();
    assert_eq!((none.record, none.summary()), (None, None));
}

#[test]
fn a_key_file_that_others_may_use_is_refused_with_both_modes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("signing.key");
    fs::write(&path, record(1).to_text()).unwrap();
    for (bits, shown) in [(0o644, "0644"), (0o640, "0640"), (0o602, "0602"), (0o610, "0610")] {
        fs::set_permissions(&path, fs::Permissions::from_mode(bits)).unwrap();
        let refusal = key_refusal(&path);
        let words =
            format!("signing.key: others may use it: its mode is {shown} and has to be 0600");
        assert!(refusal.contains(&words), "{refusal}");
    }
    for bits in [0o600, 0o400] {
        fs::set_permissions(&path, fs::Permissions::from_mode(bits)).unwrap();
        assert!(KeptKey::read(path.clone()).is_ok(), "{bits:o}");
    }
}

#[test]
fn a_key_file_of_another_user_a_folder_and_other_text_are_refused() {
    // Every Linux has this one, and it belongs to root.
    if !geteuid().is_root() {
        assert!(key_refusal(Path::new("/etc/passwd")).contains("it belongs to user 0"));
    }
    let folder = tempfile::tempdir().unwrap();
    assert!(
        key_refusal(folder.path()).contains("this is a folder, and an ordinary file is needed")
    );
    let path = folder.path().join("signing.key");
    let long = "#".repeat(5_000);
    for (text, words) in [
        ("OBS_W0 = 40", "not a signing key file"),
        ("key = \"12\"", "64 hex"),
        (&long, "5000 bytes long, the limit is 4096 bytes"),
    ] {
        put(&path, text);
        let refusal = key_refusal(&path);
        assert!(refusal.contains(words) && refusal.contains("--signing-key none"), "{refusal}");
    }
    let bytes: &[u8] = &[0xFF; 40];
    fs::write(&path, bytes).unwrap();
    assert!(key_refusal(&path).contains("not a signing key file"));
}

#[test]
fn a_key_that_cannot_be_written_is_reported_once_and_the_old_file_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("signing.key");
    // A folder with content cannot be replaced by a file.
    fs::create_dir_all(path.join("content")).unwrap();
    let store = open_key(&path);
    store.change(KeyChange::Keep(record(1)));
    let failure = loop {
        match store.outcome() {
            Some(outcome) => break outcome.result.unwrap_err(),
            None => thread::yield_now(),
        }
    };
    assert!(!failure.is_empty());
    assert_eq!(store.outcome(), None);
    drop(store);
    assert!(path.join("content").exists());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left over");
}

#[test]
fn a_file_without_a_key_is_neither_replaced_nor_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("signing.key");
    put(&path, "my diary\n");
    for change in [KeyChange::Keep(record(1)), KeyChange::Forget] {
        let store = open_key(&path);
        store.change(change);
        drop(store);
        assert_eq!(fs::read_to_string(&path).unwrap(), "my diary\n");
    }
}

#[test]
fn a_link_to_a_key_file_stays_and_its_file_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("real.key"), folder.path().join("signing.key"));
    put(&file, &record(1).to_text());
    symlink(&file, &link).unwrap();
    let store = open_key(&link);
    store.change(KeyChange::Keep(record(2)));
    drop(store);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(read_key(&file).unwrap(), Some(record(2)));
}
