//! The plan saved for the next start of the program, as TOML, and its restoration: like an upload, and not started.
//! `autopilot::io::store` writes the file.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::Shared;
use crate::codec::{ItemWords, ListKind, MissionItem};
use crate::mission::draft::{self, Finished, Notes, PlanContext};
use crate::mission::{MissionService, Stored, texts_of};
use crate::param::{Save, SaveQueue, Saved};
use crate::wall_time::WallTime;
use flight_management::command::{Outcome, VehicleCommand};
use flight_management::vehicle::plan::ITEMS_MAX;
use flight_management::vehicle::rules::Rules;

/// Header of the file, above the items.
const HEADER: &str = "\
# The plan that a ground station has uploaded: its items as MISSION_ITEM_INT has them.
# Written anew, comments and all, whenever the plan changes.
";

/// Why the saved plan cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {problem}; mend or delete the file, or start with --parameter-file none")]
pub struct SavedPlanError {
    pub file: String,
    /// The error in it.
    pub problem: String,
}

/// The file: the number of items, and the items. The number reveals a truncated file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedPlanFile {
    count: usize,
    #[serde(default)]
    item: Vec<SavedItem>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedItem {
    command: u16,
    frame: u8,
    autocontinue: bool,
    params: [f32; 4],
    x: i32,
    y: i32,
    z: f32,
}

/// A plan that was uploaded in an earlier run of the program. It has not been checked against the aircraft yet.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SavedPlan(pub(super) Vec<MissionItem<i32>>);

impl SavedPlan {
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The plan in `text`, which comes from `file`.
    pub fn from_text(file: &str, text: &str) -> Result<Self, SavedPlanError> {
        let refuse = |problem| SavedPlanError { file: file.to_owned(), problem };
        let SavedPlanFile { count, item } = toml::from_str(text)
            .map_err(|error| refuse(error.to_string().trim_end().replace('\n', " ")))?;
        if item.len() != count {
            return Err(refuse(format!("count = {count}, but there are {} items", item.len())));
        }
        if count > ITEMS_MAX {
            return Err(refuse(format!("count = {count} is outside 0 to {ITEMS_MAX}")));
        }
        let restored = |(seq, item)| {
            let SavedItem { command, frame, autocontinue, params, x, y, z } = item;
            let list = ListKind::MISSION;
            let words = ItemWords { seq, command, frame, current: 0, autocontinue, list };
            MissionItem { params, x, y, z, words }
        };
        Ok(Self((0..).zip(item).map(restored).collect()))
    }
}

/// The text for a plan.
pub(super) fn to_text(plan: &Stored) -> String {
    let item = plan.items.iter().map(|item| SavedItem {
        command: item.words.command,
        frame: item.words.frame,
        autocontinue: item.words.autocontinue,
        params: item.params,
        x: item.x,
        y: item.y,
        z: item.z,
    });
    let file = SavedPlanFile { count: plan.items.len(), item: item.collect() };
    let items = toml::to_string(&file).expect("numbers and booleans are TOML");
    format!("{HEADER}{items}")
}

/// State of the restoration.
#[derive(Debug, Default)]
pub(super) enum Restoring {
    /// There is no saved plan, or it is in force, or it was refused.
    #[default]
    Nothing,
    /// The control side has not received it yet.
    Waiting(SavedPlan),
    /// The intent with this number requests it.
    Requested(u32, Arc<Stored>, Notes),
}

impl MissionService {
    /// Saves plans for the next start from now on; `saved` is the saved plan.
    pub fn keep(&mut self, saved: SavedPlan) {
        self.saves = Some(SaveQueue::default());
        if saved.count() > 0 {
            self.restoring = Restoring::Waiting(saved);
        }
    }

    /// Requests the control side, once, to take the saved plan.
    pub(super) fn restore(&mut self, now: WallTime, shared: &mut Shared) {
        if !matches!(self.restoring, Restoring::Waiting(_)) || shared.intents.room() == 0 {
            return;
        }
        // The room is checked before, because a plan that is taken out here cannot be put back.
        let Restoring::Waiting(saved) = std::mem::take(&mut self.restoring) else { return };
        let parameters = &shared.parameters;
        let rules = Rules::new(parameters.limits, parameters.navigation, &parameters.gains);
        // The present place of the aircraft does not matter yet.
        match draft::check(saved.0, PlanContext::default(), &rules) {
            Ok(Finished { stored, plan, notes }) => {
                if let Some(number) = shared.intents.push(VehicleCommand::Plan(Arc::new(plan))) {
                    self.restoring = Restoring::Requested(number, Arc::new(stored), notes);
                }
            }
            Err(problems) => {
                for text in texts_of(&problems) {
                    report_refusal(&text, now, shared);
                }
            }
        }
    }

    /// Handles the outcome of an intent, if it is the one with the saved plan.
    pub(super) fn take_restored(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        shared: &mut Shared,
    ) {
        self.restoring = match std::mem::take(&mut self.restoring) {
            Restoring::Requested(requested, stored, notes) if requested == number => {
                match outcome {
                    Outcome::Done => {
                        let text = format!("Mission of the last run: {} items", stored.count());
                        self.store(ListKind::MISSION, &stored, shared);
                        for text in core::iter::once(text).chain(notes.texts()) {
                            shared.texts.inform(now, text);
                        }
                    }
                    Outcome::Refused(refusal) => report_refusal(&refusal.to_string(), now, shared),
                    Outcome::NoAnswer | Outcome::Plant(_) => {
                        report_refusal("the aircraft does not answer", now, shared);
                    }
                }
                Restoring::Nothing
            }
            other => other,
        };
    }

    /// Next content of the plan file.
    pub fn pop_save(&mut self) -> Option<Save> {
        self.saves.as_mut()?.pop()
    }

    /// Handles the result of a save.
    pub fn handle_saved(&mut self, saved: &Saved, now: WallTime, shared: &mut Shared) {
        if let Err(reason) = &saved.result {
            shared.texts.warn(now, format!("The plan is not saved: {reason}"));
        }
    }
}

fn report_refusal(reason: &str, now: WallTime, shared: &mut Shared) {
    shared.texts.warn(now, format!("Mission of the last run refused: {reason}"));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> Stored {
        let item = |seq, params, x, y, z| MissionItem {
            params,
            x,
            y,
            z,
            words: ItemWords {
                seq,
                command: 16 + seq,
                frame: 3,
                current: 0,
                autocontinue: seq == 0,
                list: ListKind::MISSION,
            },
        };
        Stored::new(vec![
            item(0, [0.1, -0.0, f32::NAN, f32::MAX], i32::MIN, i32::MAX, 5_000.3),
            item(1, [1.0e-40, f32::INFINITY, 264.7, 3.0], 351_704_001, -1_179_000_003, f32::NAN),
        ])
    }

    #[test]
    fn a_plan_comes_back_to_the_bit_with_the_same_id() {
        let stored = plan();
        let back = SavedPlan::from_text("f", &to_text(&stored)).unwrap();
        assert_eq!(Stored::new(back.0).id, stored.id, "the id is a hash of every byte");
        let none = SavedPlan::from_text("f", &to_text(&Stored::default())).unwrap();
        assert_eq!(none, SavedPlan::default());
    }

    #[test]
    fn a_damaged_text_is_refused_with_file_and_reason() {
        let whole = to_text(&plan());
        let second = whole.rfind("[[item]]").unwrap();
        for (text, words) in [
            (whole[..second].to_owned(), "count = 2, but there are 1 items"),
            (whole[..whole.len() - 2].to_owned(), "line"),
            (whole.replace("frame = 3", "frame = 300"), "u8"),
            (whole.replace("frame = 3\n", ""), "missing field `frame`"),
            (whole.replace("frame", "fraem"), "unknown field `fraem`"),
            (whole.replace("command = 16", "command = \"16\""), "u16"),
            (String::new(), "missing field `count`"),
            ("count = 1000000".to_owned(), "but there are 0 items"),
        ] {
            let message = SavedPlan::from_text("p.toml", &text).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
            assert!(message.starts_with("p.toml: ") && message.contains("delete the file"));
            assert!(!message.contains('\n'), "{message}");
        }
    }
}
