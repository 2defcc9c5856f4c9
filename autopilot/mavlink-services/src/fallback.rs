//! The change to another mode when the stream that a mode follows has stopped: reported once, requested until the mode changes.

use core::time::Duration;

use ::mavlink::dialects::common::MavSeverity;

use crate::Shared;
use crate::wall_time::WallTime;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Mode;

/// The request for the other mode is repeated after this time if the mode has not changed.
const REPEAT: Duration = Duration::from_millis(500);

/// When the other mode was requested last.
#[derive(Debug, Default)]
pub struct Fallback {
    requested: Option<WallTime>,
}

impl Fallback {
    /// The mode that follows the stream has begun.
    pub fn reset(&mut self) {
        self.requested = None;
    }

    /// Requests `mode` unless that was done a moment ago; the first time with a text. A full queue of intents is tried again.
    pub fn request(&mut self, mode: Mode, text: &str, now: WallTime, shared: &mut Shared) {
        if self.requested.is_some_and(|at| now.since(at) < REPEAT) {
            return;
        }
        if shared.intents.push(VehicleCommand::Mode(mode)).is_some() {
            if self.requested.is_none() {
                shared.texts.publish(MavSeverity::MAV_SEVERITY_WARNING, text);
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
