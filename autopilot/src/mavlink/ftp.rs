//! MAVLink FTP: files that describe the autopilot.

use super::context::{Context, From};
use super::peers::Peers;
use crate::clock::WallTime;

/// Gives files.
#[derive(Debug, Default)]
pub struct FtpService {}

impl FtpService {
    /// Takes one request: the 251 bytes of FILE_TRANSFER_PROTOCOL.
    pub fn handle(
        &mut self,
        _from: From,
        _request: &[u8; 251],
        _now: WallTime,
        _ctx: &mut Context,
        _out: &mut Peers,
    ) {
    }

    /// Does what is due.
    pub fn poll(&mut self, _now: WallTime, _ctx: &mut Context, _out: &mut Peers) {}

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        None
    }
}
