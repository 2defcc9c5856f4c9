//! The log folder and the log of traffic beside the link.

use std::path::PathBuf;

use tracing::warn;

use super::Link;
use crate::clock::WallTime;
use crate::io::log_folder::LogFolder;
use crate::io::recorder::folder::make_room;
use crate::io::tlog::{Tlog, share};
use mavlink_services::logs::LogDone;

/// Where logs are written, and offered to ground stations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Logs {
    /// The folder.
    pub folder: PathBuf,
    /// All logs together, bytes.
    pub limit_bytes: u64,
}

/// Without it the flight goes on.
pub(super) fn open_tlog(logs: &Logs, unix_start_us: Option<u64>) -> Option<Tlog> {
    let Logs { folder, limit_bytes } = logs;
    make_room(folder, *limit_bytes);
    let tlog = Tlog::open(folder, unix_start_us.unwrap_or_default(), share(*limit_bytes));
    tlog.inspect_err(|error| {
        warn!(folder = %folder.display(), %error, "there is no log of the MAVLink traffic");
    })
    .ok()
}

impl Link {
    /// Hands the log folder its next job.
    pub(super) fn begin_log_job(&mut self) {
        let Some(logs) = &mut self.logs else { return };
        if !logs.is_busy()
            && let Some(job) = self.ground.pop_log_job()
        {
            logs.begin(job);
        }
    }

    /// Writes down what was heard.
    pub(super) fn record_heard(&mut self, now: WallTime) {
        let Some(tlog) = &mut self.tlog else { return };
        let traffic = self.ground.traffic();
        while let Some(frame) = traffic.pop() {
            tlog.record(now, &frame);
        }
        tlog.left_out(traffic.take_dropped());
    }
}

/// What became of the job of the log folder; never, where there is none.
pub(super) async fn next_done(logs: &mut Option<LogFolder>) -> LogDone {
    match logs {
        Some(logs) => logs.outcome().await,
        None => core::future::pending().await,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_log_of_traffic_has_an_eighth_of_the_limit_of_all_logs() {
        let folder = tempfile::tempdir().unwrap();
        let logs = Logs { folder: folder.path().to_path_buf(), limit_bytes: 800 };
        let mut tlog = open_tlog(&logs, None).unwrap();
        for _ in 0..100 {
            tlog.record(WallTime::ZERO, b"frame");
        }
        drop(tlog);
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let bytes: u64 = entries.map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
        assert_eq!(bytes, 7 * 13, "whole frames in 100 bytes");
    }
}
