//! The mission protocol.

use super::codec::Message;
use super::context::{Context, From};
use super::peers::Peers;
use crate::clock::WallTime;
use crate::event::{EventKind, Outcome};

/// Takes and gives plans.
#[derive(Debug, Default)]
pub struct MissionService {}

impl MissionService {
    /// Takes one message of the mission protocol.
    pub fn handle(
        &mut self,
        _from: From,
        _message: &Message,
        _now: WallTime,
        _ctx: &mut Context,
        _out: &mut Peers,
    ) {
    }

    /// Takes the outcome of an intent.
    pub fn handle_outcome(
        &mut self,
        _number: u32,
        _outcome: &Outcome,
        _now: WallTime,
        _ctx: &mut Context,
        _out: &mut Peers,
    ) {
    }

    /// Takes what happened.
    pub fn handle_event(&mut self, _kind: &EventKind, _ctx: &mut Context, _out: &mut Peers) {}

    /// Does what is due.
    pub fn poll(&mut self, _now: WallTime, _ctx: &mut Context, _out: &mut Peers) {}

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        None
    }
}
