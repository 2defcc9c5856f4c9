//! The folder of the logs: names, times of beginning, and room for new ones.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::process;

use tracing::{info, warn};

/// Extensions of the files that count towards the limit and may be removed.
const ENDINGS: [&str; 2] = ["ulg", "tlog"];
/// Characters of `yyyymmdd-hhmmss`.
const STAMP: usize = 15;

/// Creates the folder if needed, and writes to it once.
pub fn prepare(folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let probe = folder.join(format!(".two-step-{}", process::id()));
    File::create(&probe)?;
    fs::remove_file(probe)
}

/// Name of a log: UTC time of its beginning and the short form of the flight's session.
pub fn name(utc_s: u64, session: &str) -> String {
    format!("{}-{session}.ulg", stamp(utc_s))
}

/// `yyyymmdd-hhmmss`, UTC, of a time in seconds since 1970.
pub fn stamp(utc_s: u64) -> String {
    let (days, second) = (utc_s / 86_400, utc_s % 86_400);
    // Days from 1 March 0000, in eras of 400 years (Gregorian calendar).
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let year = era * 400 + year + next;
    let (hour, minute) = (second / 3_600, second / 60 % 60);
    format!("{year:04}{month:02}{day:02}-{hour:02}{minute:02}{:02}", second % 60)
}

/// Time at which a log with this name was begun, seconds since 1970, UTC; `None` if it is not the name of a flight
/// log: `yyyymmdd-hhmmss-<hash of the session, 8 hex digits>.ulg`.
pub fn flight_log_begun(name: &str) -> Option<u64> {
    let (stamp, rest) = name.split_at_checked(STAMP)?;
    let session = rest.strip_prefix('-')?.strip_suffix(".ulg")?;
    let is_hex = |byte: u8| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte);
    let is_session = session.len() == 8 && session.bytes().all(is_hex);
    if is_session { begun(stamp) } else { None }
}

fn begun(stamp: &str) -> Option<u64> {
    let digits = |from: usize, to: usize| -> Option<u64> {
        let text = stamp.get(from..to)?;
        text.bytes().all(|byte| byte.is_ascii_digit()).then(|| text.parse().ok())?
    };
    if stamp.len() != STAMP || stamp.get(8..9) != Some("-") {
        return None;
    }
    let (year, month, day) = (digits(0, 4)?, digits(4, 6)?, digits(6, 8)?);
    let (hour, minute, second) = (digits(9, 11)?, digits(11, 13)?, digits(13, 15)?);
    // Days from 1 March 0000, as in `stamp`, whose result is the same only for a date and a time that exist.
    let (year, month) =
        if month > 2 { (year, month - 3) } else { (year.checked_sub(1)?, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day;
    let days = days.checked_sub(719_469)?;
    let utc_s = days * 86_400 + hour * 3_600 + minute * 60 + second;
    (self::stamp(utc_s) == stamp).then_some(utc_s)
}

/// Removes the oldest logs until they have at most `limit` bytes together. It keeps logs that are being written, and
/// files whose names are not those of logs.
pub fn make_room(folder: &Path, limit: u64) {
    let mut logs = match logs(folder) {
        Ok(logs) => logs,
        Err(problem) => {
            warn!(%problem, folder = %folder.display(), "old flight logs cannot be looked at");
            return;
        }
    };
    // Names begin with the time.
    logs.sort();
    let mut all: u64 = logs.iter().map(|(_, _, bytes)| bytes).sum();
    for (name, path, bytes) in logs {
        if all <= limit {
            return;
        }
        let is_free = File::open(&path).is_ok_and(|file| file.try_lock().is_ok());
        if is_free {
            match fs::remove_file(&path) {
                Ok(()) => {
                    all -= bytes;
                    info!(log = name, "removed the oldest flight log to make room");
                }
                Err(problem) => warn!(%problem, log = name, "cannot remove an old flight log"),
            }
        }
    }
}

/// Name, path and bytes of each log.
fn logs(folder: &Path) -> io::Result<Vec<(String, PathBuf, u64)>> {
    let mut logs = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let Ok(name) = entry.file_name().into_string() else { continue };
        let metadata = entry.metadata()?;
        if metadata.is_file() && is_log(&name) {
            logs.push((name, entry.path(), metadata.len()));
        }
    }
    Ok(logs)
}

/// `yyyymmdd-hhmmss`, then anything, then one of the extensions.
fn is_log(name: &str) -> bool {
    let Some((stem, ending)) = name.rsplit_once('.') else { return false };
    let stamp = stem.as_bytes().get(..STAMP).unwrap_or_default();
    let is_stamp = stamp.len() == STAMP
        && stamp.iter().enumerate().all(|(at, byte)| match at {
            8 => *byte == b'-',
            _ => byte.is_ascii_digit(),
        });
    is_stamp && ENDINGS.contains(&ending)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_the_time_and_the_number_of_the_flight() {
        assert_eq!(stamp(0), "19700101-000000");
        assert_eq!(stamp(951_782_399), "20000228-235959");
        assert_eq!(stamp(951_782_400), "20000229-000000");
        assert_eq!(stamp(1_735_689_599), "20241231-235959");
        assert_eq!(stamp(4_107_542_400), "21000301-000000");
        assert_eq!(name(0, "000000ab"), "19700101-000000-000000ab.ulg");
        assert!(is_log(&name(0, "00000001")) && is_log("19700101-000000.tlog"));
    }

    #[test]
    fn the_oldest_logs_go_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["notes.txt", "diary.ulg", "19700101-000000.tlog"];
        let flights = [1, 2, 3, 4].map(|utc_s| name(utc_s, "0000000a"));
        for name in names.iter().copied().chain(flights.iter().map(String::as_str)) {
            fs::write(folder.path().join(name), [0; 100]).unwrap();
        }
        // The second one is being written.
        let open = File::open(folder.path().join(&flights[1])).unwrap();
        open.lock().unwrap();
        make_room(folder.path(), 250);
        let mut left: Vec<String> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        left.sort();
        let expected = [&flights[1], &flights[3], "diary.ulg", "notes.txt"];
        assert_eq!(left, expected);
    }

    #[test]
    fn a_folder_that_cannot_be_written_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        assert!(prepare(&file.join("logs")).is_err());
        prepare(&folder.path().join("a/b")).unwrap();
        assert_eq!(fs::read_dir(folder.path().join("a/b")).unwrap().count(), 0);
    }

    #[test]
    fn a_name_leads_back_to_its_second() {
        for utc_s in (0..4_102_444_800).step_by(86_400 * 3 + 4321) {
            assert_eq!(flight_log_begun(&name(utc_s, "0000000a")), Some(utc_s));
        }
    }

    #[test]
    fn only_names_that_the_program_gives_are_names_of_logs() {
        let good = "20261121-081257-0123abcf.ulg";
        assert_eq!(flight_log_begun(good), Some(1_795_248_777));
        for bad in [
            "",
            "notes.ulg",
            "20261121-081257.ulg",
            "20261121-081257-0123abcg.ulg",
            "20261121-081257-0123abcf.ulg.bak",
            "20261321-081257-0123abcf.ulg",
            "20260229-081257-0123abcf.ulg",
            "20261121-246057-0123abcf.ulg",
            "+0261121-081257-0123abcf.ulg",
            "../261121-081257-0123abcf.ulg",
            "ä0261121-08125-0123abcf.ulg",
            "20261121-081257.tlog",
        ] {
            assert_eq!(flight_log_begun(bad), None, "{bad}");
        }
    }
}
