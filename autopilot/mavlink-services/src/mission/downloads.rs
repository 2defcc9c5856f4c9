//! Downloads under way. Every ground station gets the plan that was in force when it asked for the list,
//! also if another one replaces it meanwhile.

use core::time::Duration;
use std::sync::Arc;

use super::wire::Stored;
use crate::context::From;
use crate::wall_time::WallTime;

/// Downloads at the same time; the one that asked least recently makes room.
const DOWNLOADS_MAX: usize = 16;
/// Without a request for this long a download is over.
const SILENCE: Duration = Duration::from_secs(10);

#[derive(Debug)]
struct Download {
    from: From,
    plan: Arc<Stored>,
    asked: WallTime,
}

/// The downloads under way.
#[derive(Debug, Default)]
pub struct Downloads(Vec<Download>);

impl Downloads {
    /// Somebody wants the list.
    pub fn begin(&mut self, from: From, plan: &Arc<Stored>, now: WallTime) {
        self.end(from);
        if self.0.len() >= DOWNLOADS_MAX {
            let oldest = self.0.iter().enumerate().min_by_key(|(_, download)| download.asked);
            if let Some((place, _)) = oldest {
                self.0.swap_remove(place);
            }
        }
        self.0.push(Download { from, plan: Arc::clone(plan), asked: now });
    }

    /// The plan that somebody downloads; `None` if nothing is under way.
    pub fn plan(&mut self, from: From, now: WallTime) -> Option<Arc<Stored>> {
        self.0.retain(|download| now.since(download.asked) < SILENCE);
        let download = self.0.iter_mut().find(|download| download.from == from)?;
        download.asked = now;
        Some(Arc::clone(&download.plan))
    }

    /// Somebody has the whole list, or wants no more of it.
    pub fn end(&mut self, from: From) {
        self.0.retain(|download| download.from != from);
    }
}
