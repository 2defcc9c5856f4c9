//! The queue of events from the control side, and which events it drops when it is full.

use std::collections::VecDeque;

use icd::SimTime;

use crate::event::{Event, EventKind};
use crate::script::ScriptEvent;

/// Events that wait to be fetched; the queue drops the oldest of the least important kind and reports how many.
pub(super) const EVENTS_MAX: usize = 256;

/// Events that wait to be fetched.
#[derive(Debug, Clone)]
pub(super) struct EventQueue {
    events: VecDeque<Event>,
    /// Dropped events that no event has reported yet.
    lost: u64,
}

impl EventQueue {
    pub(super) fn new() -> Self {
        Self { events: VecDeque::with_capacity(EVENTS_MAX + 1), lost: 0 }
    }

    /// When there is no room, the oldest event of the least important kind is dropped, the new one included.
    pub(super) fn push(&mut self, time: SimTime, kind: EventKind) {
        self.events.push_back(Event { time, kind });
        if self.events.len() > EVENTS_MAX {
            let ranks = self.events.iter().map(|event| rank(&event.kind)).enumerate();
            let victim = ranks.min_by_key(|(_, rank)| *rank).map_or(0, |(place, _)| place);
            self.events.remove(victim);
            self.lost += 1;
        }
    }

    /// The oldest event. After the last one, the number of lost events, if any.
    pub(super) fn pop(&mut self, now: SimTime) -> Option<Event> {
        self.events.pop_front().or_else(|| {
            let lost = std::mem::take(&mut self.lost);
            (lost > 0).then_some(Event { time: now, kind: EventKind::EventsLost(lost) })
        })
    }
}

/// How important an event is: the lower, the sooner it is dropped.
fn rank(kind: &EventKind) -> u8 {
    match kind {
        EventKind::Script { event: ScriptEvent::Line(_), .. } => 0,
        EventKind::Script { event: ScriptEvent::LineRefused { .. }, .. } => 1,
        // Events from which receivers maintain a state.
        EventKind::Fault(_)
        | EventKind::FlightBegan { .. }
        | EventKind::PlantLost
        | EventKind::PlantBack => 3,
        // A ground station waits for these.
        EventKind::Outcome { .. } => 4,
        _ => 2,
    }
}
