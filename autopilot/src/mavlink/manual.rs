//! MANUAL_CONTROL and RC_CHANNELS_OVERRIDE: a pilot's sticks.

use super::aircraft::Aircraft;
use super::codec::Message;
use super::context::{Context, From};
use crate::clock::WallTime;

/// Follows the sticks.
#[derive(Debug, Default)]
pub struct Manual {}

impl Manual {
    /// Takes stick positions.
    pub fn handle(&mut self, _from: From, _message: &Message, _now: WallTime, _ctx: &mut Context) {}

    /// Does what is due.
    pub fn poll(&mut self, _now: WallTime, _ctx: &mut Context) {}

    /// Stick positions came a moment ago.
    #[must_use]
    pub fn is_fresh(&self, _now: WallTime) -> bool {
        false
    }

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(&self, _aircraft: &Aircraft) -> Option<WallTime> {
        None
    }
}
