//! What is kept for the next start: parameters, plan and signing key, each handed to the writer of its file.

use tracing::{info, warn};

use super::Link;
use crate::clock::WallTime;
use mavlink_services::signing::LogLine;

impl Link {
    /// Hands changed parameters and a changed plan to their files, and takes what became of it.
    pub(super) fn keep_files(&mut self, now: WallTime) {
        if let Some(store) = &self.store {
            if let Some(save) = self.ground.pop_save() {
                store.save(save);
            }
            if let Some(saved) = store.outcome() {
                self.ground.handle_saved(&saved, now);
            }
        }
        if let Some(store) = &self.plan_store {
            if let Some(save) = self.ground.pop_plan_save() {
                store.save(save);
            }
            if let Some(saved) = store.outcome() {
                self.ground.handle_plan_saved(&saved, now);
            }
        }
    }

    /// Hands a changed signing key or its time to the key file, and says what signing has refused.
    pub(super) fn keep_key(&mut self, now: WallTime) {
        while let Some(line) = self.ground.report_signing(now) {
            match line {
                LogLine::Turned(line) => info!("{line}"),
                LogLine::Refused(line) => warn!("{line}"),
            }
        }
        let Some(store) = &self.key_store else { return };
        if let Some(change) = self.ground.pop_key_change() {
            store.change(change);
        }
        if let Some(why) = store.failure() {
            self.ground.handle_key_unsaved(&why, now);
        }
    }

    /// Nothing more is sent or taken: the time in the key file is the last one.
    pub(super) fn close_key(&mut self) {
        if let (Some(store), Some(change)) = (&self.key_store, self.ground.last_key_change()) {
            store.change(change);
        }
    }
}
