//! Names of flight logs, read: when they were begun.

/// End of the name of a flight log.
const FLIGHT: &str = ".ulg";
/// `yyyymmdd-hhmmss`.
const STAMP: usize = 15;
const DAY_S: u64 = 86_400;

/// When a log with this name was begun, seconds since 1970, UTC; `None` if it is not the name of a flight
/// log: `yyyymmdd-hhmmss-<hash of the session, 8 hex digits>.ulg`.
#[must_use]
pub fn flight_log_begun(name: &str) -> Option<u64> {
    let (stamp, rest) = name.split_at_checked(STAMP)?;
    let session = rest.strip_prefix('-')?.strip_suffix(FLIGHT)?;
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
    let is_date = year >= 1970
        && (1..=12).contains(&month)
        && (1..=days_of_month(year, month)).contains(&day);
    if !is_date || hour > 23 || minute > 59 || second > 59 {
        return None;
    }
    let years: u64 = (1970..year).map(days_of_year).sum();
    let months: u64 = (1..month).map(|month| days_of_month(year, month)).sum();
    Some((years + months + day - 1) * DAY_S + hour * 3600 + minute * 60 + second)
}

fn is_leap(year: u64) -> bool {
    (year.is_multiple_of(4) && !year.is_multiple_of(100)) || year.is_multiple_of(400)
}

fn days_of_year(year: u64) -> u64 {
    if is_leap(year) { 366 } else { 365 }
}

fn days_of_month(year: u64, month: u64) -> u64 {
    match month {
        2 if is_leap(year) => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::recorder::folder::name;

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
