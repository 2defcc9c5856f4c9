//! Every option that names a file, with a path of another kind of file: the programs name file and reason, end at once,
//! and change nothing.

use crate::ground;
use crate::programs;

use std::fs::{self, File};
use std::os::unix::fs::FileTypeExt as _;
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::Duration;

use ground::Ground;
use programs::{Program, autopilot};

/// Longer than any file that is read as a whole except a flight log, bytes.
const LARGE: u64 = 100_000_000;

/// A way to start a program up to the option that takes the file.
type Start = (&'static str, &'static [&'static str]);

/// Options that read a file, which must exist.
const READERS: [Start; 13] = [
    ("autopilot", &["--plant-link=127.0.0.1:0", "--no-gcs", "--scenario"]),
    ("autopilot", &["--plant-link=127.0.0.1:0", "--no-gcs", "--model"]),
    ("autopilot", &["--plant-link=127.0.0.1:0", "--no-gcs", "--script"]),
    ("autopilot", &["--plant-link=127.0.0.1:0", "--no-gcs", "--config"]),
    ("autopilot", &["--plant-link=127.0.0.1:0", "--no-gcs", "--setup"]),
    ("plant-sim", &["--scenario"]),
    ("plant-sim", &["--airframe"]),
    ("plant-sim", &["--setup"]),
    ("sitl", &["--plant-link=127.0.0.1:0", "--no-gcs", "--scenario"]),
    ("sitl", &["--plant-link=127.0.0.1:0", "--no-gcs", "--airframe"]),
    ("sitl", &["linearize", "--out=/nowhere/model.toml", "--airframe"]),
    ("sitl", &["plot"]),
    ("sitl", &["replay"]),
];

/// Options that read a file and write it again; it may be missing.
const KEEPERS: [Start; 3] = [
    ("autopilot", &["--plant-link=127.0.0.1:0", "--no-gcs", "--parameter-file"]),
    ("autopilot", &["--plant-link=127.0.0.1:0", "--no-gcs", "--signing-key"]),
    ("sitl", &["--plant-link=127.0.0.1:0", "--no-gcs", "--parameter-file"]),
];

/// Options that write a file.
const WRITERS: [Start; 5] = [
    ("autopilot", &["--plant-link=127.0.0.1:0", "--no-gcs", "--step-log"]),
    ("autopilot", &["--plant-link=127.0.0.1:0", "--no-gcs", "--health-file"]),
    ("plant-sim", &["--truth-log"]),
    ("plant-sim", &["--health-file"]),
    ("sitl", &["linearize", "--out"]),
];

/// Starts it with this file, expects it to end with an error that has the path and one of `words`.
fn refused(start: Start, path: &str, words: &[&str]) {
    let (name, options) = start;
    let arguments: Vec<&str> = options.iter().copied().chain([path]).collect();
    let mut program = Program::start(name, &arguments);
    let code = program.end();
    // Its output may arrive a moment after its end.
    let is_complete = |printed: &str| {
        printed.contains(path)
            && (words.is_empty() || words.iter().any(|word| printed.contains(word)))
    };
    for _ in 0..100 {
        if is_complete(&program.printed()) {
            break;
        }
        thread::sleep(Duration::from_millis(50));
    }
    let printed = program.printed();
    assert!(!matches!(code, Some(0 | 101) | None), "{start:?} {path}: {code:?}, {printed}");
    assert!(printed.contains(path), "{start:?} does not name {path}: {printed}");
    assert!(is_complete(&printed), "{start:?} {path}: none of {words:?} in {printed}");
}

/// A pipe, a folder and a device; their paths.
fn not_ordinary(folder: &Path) -> [String; 3] {
    let at = |name: &str| folder.join(name).to_str().expect("plain path").to_owned();
    let (pipe, inner) = (at("pipe"), at("folder"));
    let made = Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs");
    assert!(made.success());
    fs::create_dir(&inner).expect("a writable folder");
    [pipe, inner, "/dev/zero".to_owned()]
}

fn file(folder: &Path, name: &str, content: &[u8]) -> String {
    let path = folder.join(name);
    fs::write(&path, content).expect("a writable folder");
    path.to_str().expect("plain path").to_owned()
}

#[test]
fn pipes_devices_and_huge_files_are_refused_without_waiting() {
    let folder = tempfile::tempdir().expect("a folder");
    let not_ordinary = not_ordinary(folder.path());
    let large = file(folder.path(), "large", b"");
    File::create(&large).and_then(|file| file.set_len(LARGE)).expect("room for nothing");
    let bytes = file(folder.path(), "bytes", b"\xFF\xFE\x00");
    let missing = folder.path().join("missing").to_str().expect("plain path").to_owned();
    for start in READERS.into_iter().chain(KEEPERS) {
        // A setup is binary: any wrong content is an invalid setup.
        let setup = "setup of this version";
        for path in &not_ordinary {
            refused(start, path, &["an ordinary file is needed", setup]);
        }
        refused(start, &large, &["the limit is", "are allowed", setup, "no ULog file", "mode is"]);
        refused(start, &bytes, &["no text", setup, "no ULog file", "mode is"]);
    }
    for start in READERS {
        refused(start, &missing, &[]);
    }
}

#[test]
fn files_of_others_are_neither_replaced_nor_removed() {
    let folder = tempfile::tempdir().expect("a folder");
    let not_ordinary = not_ordinary(folder.path());
    let diary = file(folder.path(), "diary", b"my diary\n");
    for start in WRITERS {
        for path in &not_ordinary {
            refused(start, path, &["an ordinary file is needed"]);
        }
        refused(start, &diary, &["not written by this program"]);
        assert_eq!(fs::read(&diary).expect("it is there"), b"my diary\n", "{start:?}");
    }
    // For a file that it reads and rewrites, the program has refused to start on content that it cannot read.
    for start in KEEPERS {
        refused(start, &diary, &[]);
        assert_eq!(fs::read(&diary).expect("it is there"), b"my diary\n", "{start:?}");
    }
    let is_pipe = fs::metadata(&not_ordinary[0]).expect("it is there").file_type().is_fifo();
    assert!(is_pipe, "the pipe was replaced");
    assert!(fs::metadata("/dev/zero").expect("it is there").file_type().is_char_device());
}

#[test]
fn a_log_folder_that_is_deleted_in_flight_is_noticed_and_made_again_for_the_next_flight() {
    let mut ground = Ground::new();
    let folder = tempfile::tempdir().expect("a folder");
    let logs = folder.path().join("logs");
    let option = logs.to_str().expect("plain path");
    let (autopilot, link) = autopilot(ground.address(), &["--log-dir", option]);
    let plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("a flying aircraft", |ground| ground.time_s > 0.5);
    let is_log = |path: &Path| path.extension().is_some_and(|ending| ending == "ulg");
    let count = || {
        let entries = fs::read_dir(&logs).into_iter().flatten().flatten();
        entries.filter(|entry| is_log(&entry.path())).count()
    };
    assert_eq!(count(), 1);
    fs::remove_dir_all(&logs).expect("it is there");
    autopilot.wait_for("the flight log was removed");
    ground.listen_until("the text", |ground| ground.has_text("Flight log was removed"));
    let removed_s = ground.time_s;
    ground.listen_until("the flight to go on", |ground| ground.time_s > removed_s + 2.0);
    let texts = ground.texts.iter().filter(|text| text.contains("log was removed")).count();
    assert_eq!(texts, 1, "reported once: {:?}", ground.texts);
    drop(plant);
    let _plant = Program::start("plant-sim", &["--autopilot", &link]);
    ground.listen_until("a new flight", |ground| ground.time_s < 0.5);
    ground.listen_until("the new flight", |ground| ground.time_s > 0.6);
    assert_eq!(count(), 1, "the next flight has a log");
}
