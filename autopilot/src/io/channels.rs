//! Bounded channels between the control thread and the ground-station side.
//!
//! The control thread never waits on them: it sends with `try_send` and receives with `try_recv`.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use tokio::sync::mpsc::error::TrySendError;
use tokio::sync::mpsc::{Receiver, Sender, channel};

use flight_management::command::Intent;
use flight_management::event::{Event, Snapshot};

/// Intents for the control thread, which takes all of them each tick.
const INTENTS_MAX: usize = 64;
/// Events for the ground stations. Those without room wait in [`flight_management::autopilot::Autopilot`].
const EVENTS_MAX: usize = 256;
/// Snapshots: a request for one is fulfilled once, so a second one would be stale.
const SNAPSHOTS_MAX: usize = 1;

#[derive(Debug)]
pub struct GroundChannels {
    /// To the control thread.
    pub intents: Sender<Intent>,
    /// From the control thread.
    pub events: Receiver<Event>,
    /// From the control thread, one for each request.
    pub snapshots: Receiver<Snapshot>,
    /// Set it to get a snapshot of the next tick.
    pub snapshot_wanted: Arc<AtomicBool>,
}

/// The end on the control thread.
#[derive(Debug)]
pub struct ControlChannels {
    intents: Receiver<Intent>,
    events: Sender<Event>,
    snapshots: Sender<Snapshot>,
    snapshot_wanted: Arc<AtomicBool>,
}

pub fn channels() -> (GroundChannels, ControlChannels) {
    let (intent_sender, intent_receiver) = channel(INTENTS_MAX);
    let (event_sender, event_receiver) = channel(EVENTS_MAX);
    let (snapshot_sender, snapshot_receiver) = channel(SNAPSHOTS_MAX);
    let snapshot_wanted = Arc::new(AtomicBool::new(false));
    let ground = GroundChannels {
        intents: intent_sender,
        events: event_receiver,
        snapshots: snapshot_receiver,
        snapshot_wanted: Arc::clone(&snapshot_wanted),
    };
    let control = ControlChannels {
        intents: intent_receiver,
        events: event_sender,
        snapshots: snapshot_sender,
        snapshot_wanted,
    };
    (ground, control)
}

impl ControlChannels {
    /// Next intent, if there is one. Never waits.
    pub fn next_intent(&mut self) -> Option<Intent> {
        // A ground-station side that has ended sends no more intents; the flight continues.
        self.intents.try_recv().ok()
    }

    /// Whether there is room for at least one event; fetch the event only then, so that none gets lost.
    pub fn has_room_for_event(&self) -> bool {
        self.events.capacity() > 0 || self.events.is_closed()
    }

    /// Sends an event. Never waits; drops it if the receiver is gone.
    pub fn send_event(&self, event: Event) -> Result<(), Event> {
        match self.events.try_send(event) {
            Ok(()) | Err(TrySendError::Closed(_)) => Ok(()),
            Err(TrySendError::Full(event)) => Err(event),
        }
    }

    /// Whether a snapshot is requested: one relaxed load, cheap enough for each tick.
    pub fn snapshot_wanted(&self) -> bool {
        self.snapshot_wanted.load(Ordering::Relaxed)
    }

    /// Sends a snapshot and fulfils the request.
    pub fn show(&self, snapshot: &Snapshot) {
        self.snapshot_wanted.store(false, Ordering::Relaxed);
        // A full channel holds an unread snapshot, a closed one has no reader: both are fine.
        let _ = self.snapshots.try_send(*snapshot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use flight_management::event::EventKind;
    use icd::SimTime;

    #[test]
    fn a_full_channel_gives_the_event_back_and_an_ended_listener_swallows_it() {
        let (ground, control) = channels();
        let event = Event { time: SimTime::ZERO, kind: EventKind::PlantLost };
        for _ in 0..EVENTS_MAX {
            assert_eq!(control.send_event(event), Ok(()));
        }
        assert!(!control.has_room_for_event());
        assert_eq!(control.send_event(event), Err(event));
        drop(ground);
        assert!(control.has_room_for_event());
        assert_eq!(control.send_event(event), Ok(()));
    }
}
