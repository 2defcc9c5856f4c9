//! Another mode when the stream that a mode follows has ended: said once, asked for until the mode changes.

use core::time::Duration;
use flight_management::command::VehicleCommand;

use ::mavlink::dialects::common::MavSeverity;

use super::context::Context;
use crate::wall_time::WallTime;
use flight_management::vehicle::Mode;

/// The request for the other mode is repeated after this time if the mode has not changed.
const REPEAT: Duration = Duration::from_millis(500);

/// Whether the other mode has been asked for, and when.
#[derive(Debug, Default)]
pub struct FallBack {
    requested: Option<WallTime>,
}

impl FallBack {
    /// The mode that follows the stream has begun.
    pub fn forget(&mut self) {
        self.requested = None;
    }

    /// The other mode was asked for a moment ago.
    #[must_use]
    pub fn is_under_way(&self, now: WallTime) -> bool {
        self.requested.is_some_and(|at| now.since(at) < REPEAT)
    }

    /// Asks for `mode`, and the first time says why. A full queue of intents is tried again.
    pub fn to(&mut self, mode: Mode, text: &str, now: WallTime, ctx: &mut Context) {
        if ctx.intents.push(VehicleCommand::Mode(mode)).is_some() {
            if self.requested.is_none() {
                ctx.texts.say(MavSeverity::MAV_SEVERITY_WARNING, text);
            }
            self.requested = Some(now);
        }
    }

    /// When the request is repeated; `None` if there is none.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        self.requested.map(|at| at + REPEAT)
    }
}
