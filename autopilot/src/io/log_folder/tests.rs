use super::*;
use std::os::unix::fs::symlink;

const FIRST: &str = "20261121-080000-000000aa.ulg";
const SECOND: &str = "20261121-090000-000000bb.ulg";

fn put(folder: &Path, name: &str, size: usize) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, vec![7; size]).unwrap();
    path
}

#[test]
fn logs_are_listed_by_age_and_other_files_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let (folder, outside) = (folder.path().join("logs"), folder.path().join("outside.ulg"));
    assert_eq!(list(&folder).unwrap(), [], "no folder, no logs");
    fs::create_dir(&folder).unwrap();
    put(&folder, SECOND, 20);
    put(&folder, FIRST, 10);
    put(&folder, "20261121-080000.tlog", 5);
    put(&folder, "notes.ulg", 5);
    fs::create_dir(folder.join("20261121-100000-000000cc.ulg")).unwrap();
    fs::write(&outside, "precious").unwrap();
    symlink(&outside, folder.join("20261121-110000-000000dd.ulg")).unwrap();
    let logs = list(&folder).unwrap();
    let of = |log: &LogFile| (log.name.clone(), log.size, log.utc_s);
    let logs: Vec<_> = logs.iter().map(of).collect();
    let expected = [(FIRST.to_owned(), 10, 1_795_248_000), (SECOND.to_owned(), 20, 1_795_251_600)];
    assert_eq!(logs, expected);
}

#[test]
fn only_logs_of_the_folder_are_read_and_a_read_ends_with_the_file() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("logs");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join(FIRST), b"0123456789").unwrap();
    assert_eq!(read(&folder, FIRST, 3, 4).unwrap(), b"3456");
    assert_eq!(read(&folder, FIRST, 8, 100).unwrap(), b"89");
    assert_eq!(read(&folder, FIRST, 100, 100).unwrap(), b"");
    put(outer.path(), SECOND, 10);
    symlink(outer.path().join(SECOND), folder.join(SECOND)).unwrap();
    for name in [SECOND, "../logs", "none.ulg", "20261121-100000-000000cc.ulg"] {
        assert!(read(&folder, name, 0, 10).is_err(), "{name}");
    }
    let big = put(&folder, "20261121-100000-000000cc.ulg", READ_MAX + 10);
    let name = big.file_name().unwrap().to_str().unwrap();
    assert_eq!(read(&folder, name, 0, usize::MAX).unwrap().len(), READ_MAX, "bounded");
}

#[test]
fn erasing_leaves_logs_that_are_written_and_other_files() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("logs");
    fs::create_dir(&folder).unwrap();
    put(outer.path(), SECOND, 10);
    let open = File::create(folder.join(FIRST)).unwrap();
    open.lock().unwrap();
    put(&folder, "20261121-100000-000000cc.ulg", 10);
    put(&folder, "20261121-100000.tlog", 10);
    put(&folder, "notes.txt", 10);
    symlink(outer.path().join(SECOND), folder.join(SECOND)).unwrap();
    assert_eq!(erase(&folder).unwrap(), Erased { removed: 1, in_use: 1, failed: 0 });
    let mut left: Vec<_> =
        fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, [FIRST, "20261121-090000-000000bb.ulg", "20261121-100000.tlog", "notes.txt"]);
    assert!(outer.path().join(SECOND).exists());
    drop(open);
    assert_eq!(erase(&folder).unwrap().removed, 1, "once its writer has closed it");
}

#[test]
fn jobs_are_done_by_the_thread_and_their_outcomes_have_their_numbers() {
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    let folder = tempfile::tempdir().unwrap();
    put(folder.path(), FIRST, 10);
    let mut logs = LogFolder::open(folder.path()).unwrap();
    let mut run = |number, task| {
        assert!(!logs.is_busy());
        logs.begin(LogJob { number, task });
        assert!(logs.is_busy());
        runtime.block_on(logs.outcome())
    };
    let read = |name: &str| LogTask::Read { name: name.to_owned(), offset: 0, length: 3 };
    let done = run(7, read(FIRST));
    assert_eq!(done, LogDone { number: 7, result: Ok(LogOutcome::Read(vec![7; 3])) });
    assert!(run(8, read(SECOND)).result.is_err());
    let erased = Erased { removed: 1, in_use: 0, failed: 0 };
    assert_eq!(run(9, LogTask::Erase).result, Ok(LogOutcome::Erased(erased)));
    assert_eq!(run(10, LogTask::List).result, Ok(LogOutcome::Listed(Vec::new())));
}

#[test]
fn a_log_that_is_being_fetched_is_not_removed_to_make_room_until_no_station_requests_it() {
    use crate::io::log_folder::make_room;
    let folder = tempfile::tempdir().unwrap();
    let (first, second) = (put(folder.path(), FIRST, 100), put(folder.path(), SECOND, 100));
    let mut held = HeldLog::default();
    let read = LogTask::Read { name: FIRST.to_owned(), offset: 0, length: 10 };
    held.prepare(folder.path(), &read);
    held.prepare(folder.path(), &read);
    make_room(folder.path(), 100);
    assert!(first.exists() && !second.exists(), "the oldest is being fetched");
    let (jobs, theirs) = sync_channel(1);
    jobs.send(LogJob { number: 1, task: LogTask::List }).unwrap();
    assert!(held.next_job(&theirs, Duration::from_millis(1)).is_some());
    make_room(folder.path(), 0);
    assert!(first.exists(), "it is still requested");
    let late =
        thread::spawn(move || held.next_job(&theirs, Duration::from_millis(1)).map(|_| held));
    while first.exists() {
        make_room(folder.path(), 0);
        thread::yield_now();
    }
    drop(jobs);
    assert!(late.join().unwrap().is_none());
}

#[test]
fn logs_that_are_held_are_few_and_may_be_erased() {
    let folder = tempfile::tempdir().unwrap();
    let mut held = HeldLog::default();
    for second in 10..30 {
        let name = format!("20261121-0800{second}-000000aa.ulg");
        put(folder.path(), &name, 1);
        held.prepare(folder.path(), &LogTask::Read { name, offset: 0, length: 1 });
    }
    assert_eq!(held.0.len(), HELD_MAX);
    held.prepare(folder.path(), &LogTask::Erase);
    assert_eq!(erase(folder.path()).unwrap(), Erased { removed: 20, in_use: 0, failed: 0 });
}
