//! Events on their way out of the control side: what is dropped when nobody fetches them.

use std::collections::VecDeque;

use crate::event::{Event, EventKind};
use crate::script::ScriptEvent;

/// Events that wait to be fetched; the queue drops the oldest of the least important kind and reports how many.
pub(super) const EVENTS_MAX: usize = 256;

/// When there is no room, the oldest event of the least important kind is dropped, the new one included.
pub(super) fn push(events: &mut VecDeque<Event>, dropped: &mut u64, event: Event) {
    events.push_back(event);
    if events.len() > EVENTS_MAX {
        let ranks = events.iter().map(|event| rank(&event.kind)).enumerate();
        let victim = ranks.min_by_key(|(_, rank)| *rank).map_or(0, |(place, _)| place);
        events.remove(victim);
        *dropped += 1;
    }
}

/// How important an event is: the lower, the sooner it is dropped.
fn rank(kind: &EventKind) -> u8 {
    match kind {
        EventKind::Script { event: ScriptEvent::Line(_), .. } => 0,
        EventKind::Script { event: ScriptEvent::LineRefused { .. }, .. } => 1,
        // What others keep a state by.
        EventKind::Fault(_)
        | EventKind::FlightBegan { .. }
        | EventKind::PlantLost
        | EventKind::PlantBack => 3,
        // A ground station waits for these.
        EventKind::Outcome { .. } => 4,
        _ => 2,
    }
}
