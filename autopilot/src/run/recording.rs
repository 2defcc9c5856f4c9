//! Options of the flight logs.

use std::path::PathBuf;
use std::str::FromStr;

use crate::io::store::{NoPath, path_or_none, user_data_folder};
use ::recorder::LogRate;

/// The folder inside the user's data folder.
const FOLDER: &str = "two-step/logs";

/// Where flight logs are written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogFolder {
    /// Nowhere.
    None,
    /// In this folder.
    At(PathBuf),
}

impl FromStr for LogFolder {
    type Err = NoPath;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Ok(path_or_none(text)?.map_or(Self::None, Self::At))
    }
}

/// Options of the flight logs.
#[derive(Debug, Clone, clap::Args)]
pub struct RecordingArgs {
    /// Folder for flight logs, or none [default: two-step/logs in the user's data folder]
    #[arg(long, value_name = "DIR|none")]
    pub log_dir: Option<LogFolder>,
    /// Size of all flight logs in that folder together, MB; the oldest are removed when a flight begins
    #[arg(long, allow_negative_numbers = true, value_name = "MB", default_value_t = 4000, value_parser = parse_limit)]
    pub log_limit_mb: u64,
    /// How many control steps a flight log has rows of
    #[arg(long, value_name = "RATE", value_enum, default_value_t)]
    pub log_rate: LogRate,
}

impl RecordingArgs {
    /// The folder, if there are to be logs. A flight of record writes them only where they are asked for.
    #[must_use]
    pub fn folder(&self, is_of_record: bool) -> Option<PathBuf> {
        match &self.log_dir {
            Some(LogFolder::At(folder)) => Some(folder.clone()),
            Some(LogFolder::None) => None,
            None if is_of_record => None,
            None => Some(user_data_folder()?.join(FOLDER)),
        }
    }

    /// Size of all logs together, bytes.
    #[must_use]
    pub fn limit_bytes(&self) -> u64 {
        self.log_limit_mb.saturating_mul(1_000_000)
    }
}

/// Largest size of all flight logs, MB.
const LIMIT_MAX_MB: u64 = 1_000_000;

fn parse_limit(text: &str) -> Result<u64, String> {
    let limit = text.parse().ok().filter(|limit| (1..=LIMIT_MAX_MB).contains(limit));
    limit.ok_or_else(|| format!("{text} is not a whole number from 1 to {LIMIT_MAX_MB}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flight_of_record_writes_a_log_only_where_it_is_asked_for() {
        let args =
            |log_dir| RecordingArgs { log_dir, log_limit_mb: 1, log_rate: LogRate::default() };
        assert_eq!(args(None).folder(true), None);
        let here = LogFolder::At(PathBuf::from("here"));
        assert_eq!(args(Some(here.clone())).folder(true), Some(PathBuf::from("here")));
        assert_eq!(args(Some(here)).folder(false), Some(PathBuf::from("here")));
        assert_eq!(args("none".parse().ok()).folder(false), None);
        assert_eq!(args(None).limit_bytes(), 1_000_000);
    }
}
