//! Silence of the controlling ground station.

use super::context::{Context, From};
use crate::clock::WallTime;

/// Listens to the heartbeats of ground stations.
#[derive(Debug, Default)]
pub struct LinkLoss {}

impl LinkLoss {
    /// Takes a heartbeat: who sent it and its MAV_TYPE.
    pub fn hear(&mut self, _from: From, _mav_type: u8, _now: WallTime, _ctx: &mut Context) {}

    /// Does what is due.
    pub fn poll(&mut self, _now: WallTime, _ctx: &mut Context) {}

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        None
    }
}
