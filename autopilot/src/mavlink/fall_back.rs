//! Back to Hold when the stream that a mode follows has ended: said once, wished for until the mode changes.

use core::time::Duration;

use ::mavlink::dialects::common::MavSeverity;

use super::context::Context;
use crate::clock::WallTime;
use crate::event::Wish;
use crate::vehicle::Mode;

/// The wish to go back to Hold is repeated after this time if the mode has not changed.
const REPEAT: Duration = Duration::from_millis(500);

/// Whether Hold has been wished for, and when.
#[derive(Debug, Default)]
pub struct FallBack {
    wished: Option<WallTime>,
}

impl FallBack {
    /// The mode that follows the stream has begun.
    pub fn forget(&mut self) {
        self.wished = None;
    }

    /// Hold was wished for a moment ago.
    #[must_use]
    pub fn is_under_way(&self, now: WallTime) -> bool {
        self.wished.is_some_and(|at| now.since(at) < REPEAT)
    }

    /// Wishes for Hold, and the first time says why. A full queue of wishes is tried again.
    pub fn to_hold(&mut self, text: &str, now: WallTime, ctx: &mut Context) {
        if ctx.intents.push(Wish::Mode(Mode::Hold)).is_some() {
            if self.wished.is_none() {
                ctx.texts.say(MavSeverity::MAV_SEVERITY_WARNING, text);
            }
            self.wished = Some(now);
        }
    }

    /// When the wish is repeated; `None` if there is none.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        self.wished.map(|at| at + REPEAT)
    }
}
