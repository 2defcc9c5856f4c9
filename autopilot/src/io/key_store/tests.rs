use std::fs;
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _, symlink};

use super::*;
use mavlink_services::signing::{Key, Timestamp};

fn record(units: u64) -> KeyRecord {
    let timestamp = Timestamp::new(units).unwrap();
    KeyRecord { key: Key::new([7; 32]).unwrap(), timestamp, accepted: timestamp, is_final: true }
}

/// Writes a file of its owner alone, whatever is there.
fn put(path: &Path, text: &str) {
    use std::io::Write as _;
    let mut options = fs::OpenOptions::new();
    let file = options.write(true).create(true).truncate(true).mode(MODE).open(path);
    file.unwrap().write_all(text.as_bytes()).unwrap();
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).unwrap().mode() & 0o7777
}

fn refusal(path: &Path) -> String {
    KeyFile::At(path.to_path_buf()).read().unwrap_err().to_string()
}

#[test]
fn the_latest_key_is_in_a_file_and_folders_of_its_owner_alone_when_the_store_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("not/there/signing.key");
    let store = KeyStore::open(&path).unwrap();
    for units in 1..=100 {
        store.change(KeyChange::Keep(record(units)));
    }
    drop(store);
    let kept = KeyFile::At(path.clone()).read().unwrap().unwrap();
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
        let store = KeyStore::open(&path).unwrap();
        store.change(KeyChange::Forget);
        drop(store);
        assert!(!path.exists());
        put(&path, &record(1).to_text());
    }
    let none = KeyFile::At(folder.path().join("other")).read().unwrap().unwrap();
    assert_eq!((none.record, none.summary()), (None, None));
    assert_eq!(KeyFile::None.read().unwrap(), None);
}

#[test]
fn a_file_that_others_may_use_is_refused_with_both_modes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("signing.key");
    fs::write(&path, record(1).to_text()).unwrap();
    for (bits, shown) in [(0o644, "0644"), (0o640, "0640"), (0o602, "0602"), (0o610, "0610")] {
        fs::set_permissions(&path, fs::Permissions::from_mode(bits)).unwrap();
        let refusal = refusal(&path);
        let words =
            format!("signing.key: others may use it: its mode is {shown} and has to be 0600");
        assert!(refusal.contains(&words), "{refusal}");
    }
    for bits in [0o600, 0o400] {
        fs::set_permissions(&path, fs::Permissions::from_mode(bits)).unwrap();
        assert!(KeyFile::At(path.clone()).read().is_ok(), "{bits:o}");
    }
}

#[test]
fn a_file_of_somebody_else_a_folder_and_other_text_are_refused() {
    // Every Linux has this one, and it belongs to root.
    if !geteuid().is_root() {
        assert!(refusal(Path::new("/etc/passwd")).contains("it belongs to user 0"));
    }
    let folder = tempfile::tempdir().unwrap();
    assert!(refusal(folder.path()).contains("this is a folder, and an ordinary file is needed"));
    let path = folder.path().join("signing.key");
    let long = "#".repeat(5_000);
    for (text, words) in [
        ("OBS_W0 = 40", "not a signing key file"),
        ("key = \"12\"", "64 hex"),
        (&long, "5000 bytes long, the limit is 4096 bytes"),
    ] {
        put(&path, text);
        let refusal = refusal(&path);
        assert!(refusal.contains(words) && refusal.contains("--signing-key none"), "{refusal}");
    }
    let bytes: &[u8] = &[0xFF; 40];
    fs::write(&path, bytes).unwrap();
    assert!(refusal(&path).contains("not a signing key file"));
}

#[test]
fn what_cannot_be_written_is_told_once_and_the_old_file_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("signing.key");
    // A folder with content cannot be replaced by a file.
    fs::create_dir_all(path.join("content")).unwrap();
    let store = KeyStore::open(&path).unwrap();
    store.change(KeyChange::Keep(record(1)));
    let failure = loop {
        match store.failure() {
            Some(failure) => break failure,
            None => thread::yield_now(),
        }
    };
    assert!(!failure.is_empty());
    assert_eq!(store.failure(), None);
    drop(store);
    assert!(path.join("content").exists());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left over");
}

#[test]
fn a_file_of_somebody_else_is_neither_replaced_nor_removed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("signing.key");
    put(&path, "my diary\n");
    for change in [KeyChange::Keep(record(1)), KeyChange::Forget] {
        let store = KeyStore::open(&path).unwrap();
        store.change(change);
        drop(store);
        assert_eq!(fs::read_to_string(&path).unwrap(), "my diary\n");
    }
}

#[test]
fn of_a_link_the_file_behind_it_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let (file, link) = (folder.path().join("real.key"), folder.path().join("signing.key"));
    put(&file, &record(1).to_text());
    symlink(&file, &link).unwrap();
    let store = KeyStore::open(&link).unwrap();
    store.change(KeyChange::Keep(record(2)));
    drop(store);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(read(&file).unwrap(), record(2));
}
