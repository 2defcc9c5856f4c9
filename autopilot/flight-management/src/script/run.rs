//! A running script: which lines are due at a tick.

use std::sync::Arc;

use flight_control::NavigationState;
use icd::SimTime;

use super::{Action, Script, Trigger};

/// A running script. It begins with the first tick at which it is stepped.
#[derive(Debug, Clone)]
pub struct Run {
    script: Arc<Script>,
    began: Option<SimTime>,
    /// One for each sequence.
    places: Vec<Place>,
}

/// State of a sequence.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    /// Index of the next line.
    next: usize,
    /// When the line before was executed, or the script began.
    since: SimTime,
    /// The excess of the line's condition at the latest tick.
    excess: Option<f64>,
    /// It was triggered, and waits for room in the queue to the plant.
    due: bool,
}

/// A line to execute now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Due {
    /// Its number in the text.
    pub line: u16,
    pub action: Action,
}

impl Run {
    pub fn new(script: Arc<Script>) -> Self {
        let places = vec![Place::default(); script.sequences().len()];
        Self { script, began: None, places }
    }

    pub fn script(&self) -> &Arc<Script> {
        &self.script
    }

    /// The first line that is due at this tick and not executed yet; call it until there is none or enough
    /// were executed. The sequences follow in the order of the text. While `can_ask` is false, a line with a request to the
    /// plant waits, and its sequence with it.
    pub fn next(&mut self, state: &NavigationState, can_ask: bool) -> Option<Due> {
        self.look(state);
        for (sequence, place) in self.script.sequences().iter().zip(&mut self.places) {
            let Some(line) = sequence.lines.get(place.next) else { continue };
            if !place.due || matches!(line.action, Action::Fault(_)) && !can_ask {
                continue;
            }
            *place = Place { next: place.next + 1, since: state.time, excess: None, due: false };
            let due = Due { line: line.number, action: line.action };
            if due.action == Action::End {
                self.end();
            }
            return Some(due);
        }
        None
    }

    /// Evaluates the triggers of the next lines. A trigger at a tick is kept even if
    /// the line is executed later; a second evaluation at the same tick changes nothing.
    pub fn look(&mut self, state: &NavigationState) {
        let time = state.time;
        let began = *self.began.get_or_insert_with(|| {
            for place in &mut self.places {
                place.since = time;
            }
            time
        });
        for (sequence, place) in self.script.sequences().iter().zip(&mut self.places) {
            let Some(line) = sequence.lines.get(place.next) else { continue };
            place.due |= match line.trigger {
                Trigger::AtOnce => true,
                Trigger::At(micros) => time.micros_since(began) >= micros,
                Trigger::After(micros) => time.micros_since(place.since) >= micros,
                Trigger::When(condition) => {
                    let now = condition.excess(state);
                    let before = place.excess.unwrap_or(now);
                    place.excess = Some(condition.remembered(before, now));
                    condition.is_crossed(before, now)
                }
            };
        }
    }

    fn end(&mut self) {
        for (sequence, place) in self.script.sequences().iter().zip(&mut self.places) {
            place.next = sequence.lines.len();
        }
    }

    /// All lines are done.
    pub fn is_over(&self) -> bool {
        let mut sequences = self.script.sequences().iter().zip(&self.places);
        sequences.all(|(sequence, place)| place.next >= sequence.lines.len())
    }
}
