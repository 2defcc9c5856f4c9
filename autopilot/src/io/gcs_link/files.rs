//! Files next to the link: those saved for the next start, the log folder, the log of traffic.

use std::path::PathBuf;

use tracing::{info, warn};

use super::{GcsConfig, GcsError, GcsLink};
use crate::clock::WallTime;
use crate::io::log_folder::LogFolder;
use crate::io::recorder::folder::make_room;
use crate::io::store::Store;
use crate::io::tlog::{Tlog, share};
use mavlink_services::Ground;
use mavlink_services::logs::LogDone;
use mavlink_services::signing::LogLine;

/// Folder in which the autopilot writes logs and offers them to ground stations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Logs {
    pub folder: PathBuf,
    /// All logs together, bytes.
    pub limit_bytes: u64,
}

impl Logs {
    /// Begins the log of traffic; if it cannot, the flight continues without.
    pub(super) fn open_tlog(&self, unix_start_us: Option<u64>) -> Option<Tlog> {
        let Self { folder, limit_bytes } = self;
        make_room(folder, *limit_bytes);
        let tlog = Tlog::open(folder, unix_start_us.unwrap_or_default(), share(*limit_bytes));
        tlog.inspect_err(|error| {
            warn!(folder = %folder.display(), %error, "there is no log of the MAVLink traffic");
        })
        .ok()
    }
}

/// The writers of the files saved for the next start. Dropping one waits until everything is written.
#[derive(Debug)]
pub(super) struct Stores {
    parameters: Option<Store>,
    plan: Option<Store>,
    key: Option<Store>,
}

impl Stores {
    pub(super) fn open(config: &GcsConfig) -> Result<Self, GcsError> {
        let open = |file, name| {
            Store::open(file, name)
                .map_err(|error| GcsError::Start(format!("cannot keep the {name}: {error}")))
        };
        let GcsConfig { kept, kept_plan, kept_key, .. } = config;
        Ok(Self {
            parameters: kept
                .as_ref()
                .map(|kept| open(kept.own_file(), "parameter file"))
                .transpose()?,
            plan: kept_plan.as_ref().map(|kept| open(kept.own_file(), "plan file")).transpose()?,
            key: kept_key.as_ref().map(|kept| open(kept.own_file(), "signing key")).transpose()?,
        })
    }

    /// Passes changed contents to the writers, and reports their results.
    pub(super) fn poll(&self, ground: &mut Ground, now: WallTime) {
        if let Some(store) = &self.parameters {
            if let Some(save) = ground.pop_save() {
                store.change(save);
            }
            if let Some(saved) = store.outcome() {
                ground.handle_saved(&saved);
            }
        }
        if let Some(store) = &self.plan {
            if let Some(save) = ground.pop_plan_save() {
                store.change(save);
            }
            if let Some(saved) = store.outcome() {
                ground.handle_plan_saved(&saved, now);
            }
        }
        while let Some(line) = ground.report_signing(now) {
            match line {
                LogLine::Turned(line) => info!("{line}"),
                LogLine::Refused(line) => warn!("{line}"),
            }
        }
        if let Some(store) = &self.key {
            if let Some(change) = ground.pop_key_change() {
                store.change(change);
            }
            if let Some(why) = store.outcome().and_then(|saved| saved.result.err()) {
                ground.handle_key_unsaved(&why, now);
            }
        }
    }

    /// Writes the final key file: no more frames are sent or accepted, so its time is the last one.
    pub(super) fn finish(&self, ground: &mut Ground) {
        if let (Some(store), Some(change)) = (&self.key, ground.last_key_change()) {
            store.change(change);
        }
    }
}

impl GcsLink {
    /// Passes the next job to the log folder.
    pub(super) fn begin_log_job(&mut self) {
        let Some(logs) = &mut self.logs else { return };
        if !logs.is_busy()
            && let Some(job) = self.ground.pop_log_job()
        {
            logs.begin(job);
        }
    }

    /// Writes the frames received and sent to the log of traffic.
    pub(super) fn record_traffic(&mut self, now: WallTime) {
        let Some(tlog) = &mut self.tlog else { return };
        let traffic = self.ground.traffic();
        while let Some(frame) = traffic.pop() {
            tlog.record(now, frame);
        }
        tlog.left_out(traffic.take_dropped());
    }
}

/// Outcome of the job of the log folder; never completes without a folder.
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
        let mut tlog = logs.open_tlog(None).unwrap();
        for _ in 0..100 {
            tlog.record(WallTime::ZERO, b"frame".to_vec());
        }
        drop(tlog);
        let entries = std::fs::read_dir(folder.path()).unwrap();
        let bytes: u64 = entries.map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
        assert_eq!(bytes, 7 * 13, "whole frames in 100 bytes");
    }
}
