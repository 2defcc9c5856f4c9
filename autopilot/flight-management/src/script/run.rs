//! A script on its way: which lines are due at a tick.

use std::sync::Arc;

use flight_control::NavigationState;
use icd::SimTime;

use super::{Action, Script, Trigger};

/// A script that runs. It begins with the first tick at which it is stepped.
#[derive(Debug, Clone)]
pub struct Run {
    script: Arc<Script>,
    began: Option<SimTime>,
    /// One for each sequence.
    places: Vec<Place>,
}

/// Where a sequence stands.
#[derive(Debug, Clone, Copy, Default)]
struct Place {
    /// Index of the line that is next.
    next: usize,
    /// When the line before was executed, or the script began.
    since: SimTime,
    /// What the condition of the line had as its excess at the latest tick.
    excess: Option<f64>,
    /// Its trigger has come, and it waits for room on the way to the plant.
    due: bool,
}

/// A line that is to be executed now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Due {
    /// Its number in the text.
    pub line: u16,
    /// What it does.
    pub action: Action,
}

impl Run {
    /// At its start.
    #[must_use]
    pub fn new(script: Arc<Script>) -> Self {
        let places = vec![Place::default(); script.sequences().len()];
        Self { script, began: None, places }
    }

    /// Which script.
    #[must_use]
    pub fn script(&self) -> &Arc<Script> {
        &self.script
    }

    /// The first line that is due at this tick and not executed yet; to be called until there is none or enough
    /// were executed. The sequences come in the order of the text. While `can_ask` is false a line that asks the
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

    /// Looks whether the triggers of the lines that are next have come. What has come at a tick stays so, also when
    /// the line is executed later; looking again at the same tick changes nothing.
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

    /// Nothing is left to do.
    #[must_use]
    pub fn is_over(&self) -> bool {
        let mut sequences = self.script.sequences().iter().zip(&self.places);
        sequences.all(|(sequence, place)| place.next >= sequence.lines.len())
    }
}
