use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::os::unix::net::UnixListener;
use std::path::PathBuf;

use tempfile::TempDir;

use super::*;

/// A folder with one entry of each type that is not a regular file, and their names.
fn not_ordinary() -> (TempDir, Vec<(PathBuf, &'static str)>) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("folder")).unwrap();
    UnixListener::bind(at("socket")).unwrap();
    let made = process::Command::new("mkfifo").arg(at("pipe")).status().unwrap();
    assert!(made.success());
    symlink("/dev/null", at("link to a device")).unwrap();
    let things = vec![
        (at("folder"), "a folder"),
        (at("socket"), "a socket"),
        (at("pipe"), "a pipe"),
        (PathBuf::from("/dev/zero"), "a device"),
        (at("link to a device"), "a device"),
    ];
    (folder, things)
}

fn begins_with_own(content: &[u8]) -> bool {
    content.starts_with(b"own")
}

#[test]
fn only_ordinary_files_are_read_and_nothing_is_waited_for() {
    let (folder, things) = not_ordinary();
    for (path, what) in things {
        let message = read(&path, 10).unwrap_err().to_string();
        assert_eq!(message, format!("this is {what}, and an ordinary file is needed"));
    }
    let missing = read(&folder.path().join("none"), 10).unwrap_err();
    assert!(missing.is_not_found(), "{missing}");
    let file = folder.path().join("file");
    fs::write(&file, "0123456789").unwrap();
    let link = folder.path().join("link");
    symlink(&file, &link).unwrap();
    assert_eq!(read(&link, 10).unwrap(), b"0123456789");
}

#[test]
fn a_file_that_is_too_long_is_refused_with_its_length_and_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("large");
    let file = File::create(&path).unwrap();
    file.set_len(100_000_000).unwrap();
    let message = read(&path, TEXT_MAX).unwrap_err().to_string();
    assert_eq!(message, "100000000 bytes long, the limit is 1048576 bytes");
    file.set_len(TEXT_MAX).unwrap();
    assert_eq!(read(&path, TEXT_MAX).unwrap().len(), 1 << 20);
    // A file of the kernel reports a length of zero, and has content.
    let message = read(Path::new("/proc/self/status"), 5).unwrap_err().to_string();
    assert_eq!(message, "6 bytes long, the limit is 5 bytes");
}

#[test]
fn a_byte_that_is_no_text_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bytes");
    fs::write(&path, b"abc\xFFdef").unwrap();
    let message = read_text(&path, 10).unwrap_err().to_string();
    assert_eq!(message, "no text: byte 3 (from 0) is not UTF-8");
}

#[test]
fn an_own_file_replaces_nothing_that_the_program_did_not_write() {
    let (folder, things) = not_ordinary();
    for (path, what) in things {
        let own = OwnFile::new(&path, 100, begins_with_own);
        for problem in [own.check(), own.replace(b"own 1"), own.remove()] {
            let message = problem.unwrap_err().to_string();
            assert_eq!(message, format!("this is {what}, and an ordinary file is needed"));
        }
        assert!(fs::symlink_metadata(&path).is_ok_and(|about| !about.is_file()), "{what}");
    }
    let path = folder.path().join("file");
    let own = OwnFile::new(&path, 100, begins_with_own);
    for foreign in ["my diary".to_owned(), format!("own{}", " ".repeat(98))] {
        fs::write(&path, &foreign).unwrap();
        for problem in [own.check(), own.replace(b"own 1"), own.remove()] {
            assert!(matches!(problem, Err(FileProblem::Foreign)), "{problem:?}");
        }
        assert_eq!(fs::read_to_string(&path).unwrap(), foreign);
    }
    symlink("nowhere", folder.path().join("lost")).unwrap();
    let lost = OwnFile::new(&folder.path().join("lost"), 100, begins_with_own);
    let message = lost.replace(b"own").unwrap_err().to_string();
    assert!(message.contains("a link that leads nowhere"), "{message}");
}

#[test]
fn an_own_file_is_made_replaced_and_removed_as_a_whole() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a/b/file");
    let own = OwnFile::new(&path, 100, begins_with_own).with_modes(0o600, 0o700);
    own.check().unwrap();
    own.remove().unwrap();
    own.replace(b"own 1").unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!((mode(&path), mode(path.parent().unwrap())), (0o600, 0o700));
    own.clone().without_sync().replace(b"own 2").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"own 2");
    // An empty file may be used by any program; a link keeps its target.
    fs::write(&path, "").unwrap();
    let link = folder.path().join("link");
    symlink(&path, &link).unwrap();
    OwnFile::new(&link, 100, begins_with_own).replace(b"own 3").unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(fs::read(&path).unwrap(), b"own 3");
    let left: Vec<_> = fs::read_dir(path.parent().unwrap()).unwrap().collect();
    assert_eq!(left.len(), 1, "{left:?}");
    own.remove().unwrap();
    assert!(!path.exists());
}

#[test]
fn a_file_that_is_written_from_its_beginning_is_new_empty_or_of_its_kind() {
    let (folder, things) = not_ordinary();
    for (path, what) in things {
        let message = write(&path, b"a,b\n1,2\n", b"a,b").unwrap_err().to_string();
        assert_eq!(message, format!("this is {what}, and an ordinary file is needed"));
    }
    let path = folder.path().join("table.csv");
    for table in ["a,b\n1,2\n3,4\n", "a,b\n5,6\n"] {
        write(&path, table.as_bytes(), beginning(table.as_bytes())).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), table);
    }
    for foreign in ["a,c\n1,2\n", "notes", "a"] {
        fs::write(&path, foreign).unwrap();
        assert!(matches!(write(&path, b"a,b\n", b"a,b"), Err(FileProblem::Foreign)), "{foreign}");
        assert_eq!(fs::read_to_string(&path).unwrap(), foreign);
    }
    let far = format!("{}a,b", " ".repeat(BEGINNING as usize));
    fs::write(&path, &far).unwrap();
    assert!(matches!(write(&path, b"a,b\n", b"a,b"), Err(FileProblem::Foreign)));
}

#[test]
fn a_file_that_cannot_be_finished_leaves_the_old_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.csv");
    write(&path, b"a,b\n1,2\n", b"a,b").unwrap();
    let mut new = NewFile::begin(&path, |_| true).unwrap();
    new.write_all(b"a,b\n3").unwrap();
    new.flush().unwrap();
    drop(new);
    assert_eq!(fs::read(&path).unwrap(), b"a,b\n1,2\n");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    symlink("nowhere", folder.path().join("lost")).unwrap();
    let message = write(&folder.path().join("lost"), b"x", b"x").unwrap_err().to_string();
    assert!(message.contains("a link that leads nowhere"), "{message}");
}

#[test]
fn of_several_writers_of_a_free_name_one_succeeds_and_each_has_a_file_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("head");
    let begin = |content: &[u8]| {
        let mut file = NewFile::begin(&path, |_| false).unwrap();
        file.write_all(content).unwrap();
        file
    };
    let [one, other] = [begin(b"one"), begin(b"other")];
    assert!(other.finish_if_free().unwrap());
    assert!(!one.finish_if_free().unwrap());
    assert_eq!(fs::read(&path).unwrap(), b"other");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_folder_that_is_none_has_no_file() {
    let missing = read(Path::new("/dev/null/file"), 10).unwrap_err();
    assert!(missing.is_not_found(), "{missing}");
}
