//! What ground stations stream, setpoints and stick positions: the latest of each system, how long it counts, and the
//! change to another mode when the stream that a mode follows has stopped.

use core::time::Duration;

use ::mavlink::dialects::common::MavSeverity;

use crate::Shared;
use crate::wall_time::WallTime;
use flight_management::command::VehicleCommand;
use flight_management::vehicle::Mode;

/// Systems whose streams are followed; the one silent for the longest makes room.
const SYSTEMS_MAX: usize = 4;
/// Least interval between two values that the vehicle receives, whatever the rate of the messages.
const INTERVAL: Duration = Duration::from_millis(10);

/// What each system has sent last; that of the latest sender is the last.
#[derive(Debug)]
pub struct Latest<T>(Vec<(u8, T)>);

impl<T> Default for Latest<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Latest<T> {
    pub fn of(&self, system: Option<u8>) -> Option<&T> {
        self.0.iter().find(|(known, _)| Some(*known) == system).map(|(_, latest)| latest)
    }

    pub fn of_mut(&mut self, system: Option<u8>) -> Option<&mut T> {
        self.0.iter_mut().find(|(known, _)| Some(*known) == system).map(|(_, latest)| latest)
    }

    pub fn all_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.0.iter_mut().map(|(_, latest)| latest)
    }

    pub fn remove(&mut self, system: u8) -> Option<T> {
        let place = self.0.iter().position(|(known, _)| *known == system)?;
        Some(self.0.remove(place).1)
    }

    /// Takes what a system has just sent; returns what it had sent before.
    pub fn replace(&mut self, system: u8, latest: T) -> Option<T> {
        let before = self.remove(system);
        if self.0.len() >= SYSTEMS_MAX {
            self.0.remove(0);
        }
        self.0.push((system, latest));
        before
    }
}

/// Streams that a ground station is sending.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Streams {
    pub setpoints: bool,
    pub sticks: bool,
}

/// The time limits of one stream.
#[derive(Debug, Default)]
pub struct Forwarding {
    /// When the vehicle received the latest value.
    pub passed_on: Option<WallTime>,
}

impl Forwarding {
    /// The vehicle has just received a value.
    pub fn is_early(&self, now: WallTime) -> bool {
        self.passed_on.is_some_and(|at| now.since(at) < INTERVAL)
    }

    /// When to act next on a value: when one held back may be forwarded, or one microsecond beyond the last instant at
    /// which it counts.
    pub fn deadline(&self, received: WallTime, timeout: Duration, is_new: bool) -> WallTime {
        let stale = received + timeout + Duration::from_micros(1);
        let early = self.passed_on.filter(|_| is_new).map(|at| at + INTERVAL);
        early.map_or(stale, |early| early.min(stale))
    }
}

/// The request for the other mode is repeated after this time if the mode has not changed.
const REPEAT: Duration = Duration::from_millis(500);

/// The change to another mode when the stream that a mode follows has stopped: reported once, requested until the mode
/// changes.
#[derive(Debug, Default)]
pub struct Fallback {
    /// Time of the latest request for the other mode.
    requested: Option<WallTime>,
}

impl Fallback {
    /// The mode that follows the stream has begun.
    pub fn reset(&mut self) {
        self.requested = None;
    }

    /// Requests `mode` unless it did so a moment ago; the first time with a text. If the queue of intents is full, it tries again.
    pub fn request(&mut self, mode: Mode, text: &str, now: WallTime, shared: &mut Shared) {
        if self.requested.is_some_and(|at| now.since(at) < REPEAT) {
            return;
        }
        // A full queue leaves `requested` as it is, and the next poll tries again.
        if shared.intents.push(VehicleCommand::Mode(mode)).is_some() {
            if self.requested.is_none() {
                shared.texts.publish(MavSeverity::MAV_SEVERITY_WARNING, text);
            }
            self.requested = Some(now);
        }
    }

    /// When the request is repeated; `None` if there is none.
    pub fn next_deadline(&self) -> Option<WallTime> {
        self.requested.map(|at| at + REPEAT)
    }
}
