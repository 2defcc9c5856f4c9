//! The three lists saved for the next start of the program, as TOML, and their restoration: like an upload, and not started.
//! `autopilot::io::store` writes the file.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::Shared;
use crate::codec::{ItemWords, ListKind, MissionItem};
use crate::mission::draft::PlanContext;
use crate::mission::{
    Beside, LISTS, MissionService, What, checked, most_items, name, rules, texts_of,
};
use crate::param::{Save, SaveQueue, Saved};
use crate::wall_time::WallTime;
use flight_management::command::Outcome;

/// Header of the file, above the items.
const HEADER: &str = "\
# The plan, the fence and the rally points that a ground station has uploaded: their items as MISSION_ITEM_INT has them.
# Written anew, comments and all, whenever one of them changes.
";

/// Altitudes that a ground can have, m.
const GROUND_M: core::ops::RangeInclusive<f64> = -1_000.0..=20_000.0;

/// Why the saved plan cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{file}: {problem}; mend or delete the file, or start with --parameter-file none")]
pub struct SavedPlanError {
    pub file: String,
    /// The error in it.
    pub problem: String,
}

/// The file: the numbers of items, and the items. The numbers reveal a truncated file.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedPlanFile {
    count: usize,
    #[serde(default)]
    fence_count: usize,
    #[serde(default)]
    rally_count: usize,
    /// Altitude of the ground to which they were uploaded, m: relative altitudes count from it.
    #[serde(default)]
    ground_m: f64,
    #[serde(default)]
    item: Vec<SavedItem>,
    #[serde(default)]
    fence: Vec<SavedItem>,
    #[serde(default)]
    rally: Vec<SavedItem>,
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

/// The lists that were uploaded in an earlier run of the program. They have not been checked against the aircraft yet.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SavedPlan {
    lists: [Vec<MissionItem<i32>>; LISTS.len()],
    /// Altitude of the ground, m.
    ground_m: f64,
}

impl SavedPlan {
    /// Numbers of items of plan, fence and rally points.
    pub fn counts(&self) -> [usize; LISTS.len()] {
        self.lists.each_ref().map(Vec::len)
    }

    /// The lists in `text`, which comes from `file`.
    pub fn from_text(file: &str, text: &str) -> Result<Self, SavedPlanError> {
        let refuse = |problem| SavedPlanError { file: file.to_owned(), problem };
        let file: SavedPlanFile = toml::from_str(text)
            .map_err(|error| refuse(error.to_string().trim_end().replace('\n', " ")))?;
        let ground_m = file.ground_m;
        if !GROUND_M.contains(&ground_m) {
            let [low, high] = [GROUND_M.start(), GROUND_M.end()];
            return Err(refuse(format!("ground_m = {ground_m} is outside {low} to {high}")));
        }
        let mut saved = Self { ground_m, ..Self::default() };
        for (list, key, count, items) in [
            (ListKind::MISSION, "count", file.count, file.item),
            (ListKind::FENCE, "fence_count", file.fence_count, file.fence),
            (ListKind::RALLY, "rally_count", file.rally_count, file.rally),
        ] {
            if items.len() != count {
                return Err(refuse(format!(
                    "{key} = {count}, but there are {} items",
                    items.len()
                )));
            }
            let most = most_items(list).unwrap_or(0);
            if count > most {
                return Err(refuse(format!("{key} = {count} is outside 0 to {most}")));
            }
            let restored = |(seq, item)| {
                let SavedItem { command, frame, autocontinue, params, x, y, z } = item;
                let words = ItemWords { seq, command, frame, current: 0, autocontinue, list };
                MissionItem { params, x, y, z, words }
            };
            saved.replace(list, (0..).zip(items).map(restored).collect());
        }
        Ok(saved)
    }

    pub(crate) fn to_text(&self) -> String {
        let [item, fence, rally] = self.lists.each_ref().map(|items| {
            let saved = items.iter().map(|item| SavedItem {
                command: item.words.command,
                frame: item.words.frame,
                autocontinue: item.words.autocontinue,
                params: item.params,
                x: item.x,
                y: item.y,
                z: item.z,
            });
            saved.collect::<Vec<_>>()
        });
        let [count, fence_count, rally_count] = self.counts();
        let ground_m = self.ground_m;
        let file = SavedPlanFile { count, fence_count, rally_count, ground_m, item, fence, rally };
        let items = toml::to_string(&file).expect("numbers and booleans are TOML");
        format!("{HEADER}{items}")
    }

    fn replace(&mut self, list: ListKind, items: Vec<MissionItem<i32>>) {
        if let Some(place) = self.lists.get_mut(usize::from(list.0)) {
            *place = items;
        }
    }
}

/// The file of the lists.
#[derive(Debug, Default)]
pub(super) struct PlanStore {
    /// Its content; a list that was refused at the start stays in it.
    lists: SavedPlan,
    saves: SaveQueue,
}

impl PlanStore {
    /// Saves a list that is in force over ground at this altitude, m.
    pub(super) fn save(&mut self, list: ListKind, items: &[MissionItem<i32>], ground_m: f64) {
        self.lists.ground_m = ground_m;
        self.lists.replace(list, items.to_vec());
        self.saves.push(self.lists.to_text(), true);
    }
}

/// State of the restoration.
#[derive(Debug, Default)]
pub(super) struct Restoring {
    /// The control side has not received them yet.
    waiting: Option<SavedPlan>,
    /// The intents with these numbers request them.
    requested: Vec<(u32, What)>,
}

impl MissionService {
    /// Saves the lists for the next start from now on; `saved` are the saved ones.
    pub fn keep(&mut self, saved: SavedPlan) {
        self.restoring.waiting = Some(saved.clone());
        self.store = Some(PlanStore { lists: saved, saves: SaveQueue::default() });
    }

    /// Requests the control side, once, to take the saved lists.
    pub(super) fn restore(&mut self, now: WallTime, shared: &mut Shared) {
        // The room is checked before, because lists that are taken out here cannot be put back.
        if shared.intents.room() < LISTS.len() {
            return;
        }
        let Some(saved) = self.restoring.waiting.take() else { return };
        let [plan, ..] = saved.lists.clone();
        let mut fence = None;
        let ground_m = shared.aircraft.snapshot().map(|state| state.navigation.ground_m);
        let rules = rules(&shared.parameters, ground_m.unwrap_or(saved.ground_m));
        for (list, items) in LISTS.into_iter().zip(saved.lists) {
            if items.is_empty() {
                continue;
            }
            let beside = Beside { plan: &plan, fence: fence.as_deref().unwrap_or(&self.fence) };
            // The present place of the aircraft does not matter yet.
            match checked(list, items, &beside, PlanContext::default(), &rules) {
                Ok((command, what)) => {
                    if let What::List { fence: Some(saved), .. } = &what {
                        fence = Some(Arc::clone(saved));
                    }
                    if let Some(number) = shared.intents.push(command) {
                        self.restoring.requested.push((number, what));
                    }
                }
                Err(problems) => {
                    for text in texts_of(&problems) {
                        report_refusal(list, &text, now, shared);
                    }
                }
            }
        }
    }

    /// Handles the outcome of an intent, if it is one with a saved list.
    pub(super) fn take_restored(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        shared: &mut Shared,
    ) {
        let requested = &mut self.restoring.requested;
        let Some(place) = requested.iter().position(|(requested, _)| *requested == number) else {
            return;
        };
        let (_, what) = requested.remove(place);
        let What::List { list, stored, notes, fence } = what else { return };
        match outcome {
            Outcome::Done => {
                let count = stored.count();
                self.put_into_force(list, &stored, fence.as_ref(), shared);
                let plural = if count == 1 { "item" } else { "items" };
                let text = format!("{} of the last run: {count} {plural}", name(list));
                for text in core::iter::once(text).chain(notes.texts()) {
                    shared.texts.inform(now, text);
                }
            }
            Outcome::Refused(refusal) => report_refusal(list, &refusal.to_string(), now, shared),
            Outcome::NoAnswer | Outcome::Plant(_) => {
                report_refusal(list, "the aircraft does not answer", now, shared);
            }
        }
    }

    /// Next content of the plan file.
    pub fn pop_save(&mut self) -> Option<Save> {
        self.store.as_mut()?.saves.pop()
    }

    /// Handles the result of a save.
    pub fn handle_saved(&mut self, saved: &Saved, now: WallTime, shared: &mut Shared) {
        if let Err(reason) = &saved.result {
            shared.texts.warn(now, format!("The plan is not saved: {reason}"));
        }
    }
}

fn report_refusal(list: ListKind, reason: &str, now: WallTime, shared: &mut Shared) {
    shared.texts.warn(now, format!("{} of the last run refused: {reason}", name(list)));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::Stored;

    fn plan() -> SavedPlan {
        let item = |list, seq, params, x, y, z| MissionItem {
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
                list,
            },
        };
        let mission = vec![
            item(
                ListKind::MISSION,
                0,
                [0.1, -0.0, f32::NAN, f32::MAX],
                i32::MIN,
                i32::MAX,
                5_000.3,
            ),
            item(
                ListKind::MISSION,
                1,
                [1.0e-40, f32::INFINITY, 264.7, 3.0],
                351_704_001,
                -1_179_000_003,
                f32::NAN,
            ),
        ];
        let one = |list| vec![item(list, 0, [3.0, f32::NAN, 0.0, 0.1], 1, -1, 0.3)];
        let lists = [mission, one(ListKind::FENCE), one(ListKind::RALLY)];
        SavedPlan { lists, ground_m: 700.0 }
    }

    #[test]
    fn the_lists_come_back_to_the_bit_with_the_same_ids() {
        let ids = |saved: SavedPlan| saved.lists.map(|items| Stored::new(items).id);
        let back = SavedPlan::from_text("f", &plan().to_text()).unwrap();
        assert_eq!(back.counts(), [2, 1, 1]);
        assert_eq!(back.ground_m, 700.0);
        assert_eq!(ids(back), ids(plan()), "the id is a hash of every byte");
        let none = SavedPlan::from_text("f", &SavedPlan::default().to_text()).unwrap();
        assert_eq!(none, SavedPlan::default());
        assert_eq!(SavedPlan::from_text("f", "count = 0").unwrap(), none, "from before the fence");
    }

    #[test]
    fn a_damaged_text_is_refused_with_file_and_reason() {
        let whole = plan().to_text();
        let second = whole.rfind("[[item]]").unwrap();
        let (fence, rally) = (whole.find("[[fence]]").unwrap(), whole.find("[[rally]]").unwrap());
        for (text, words) in [
            (whole[..second].to_owned(), "count = 2, but there are 1 items"),
            (whole[..fence].to_owned(), "fence_count = 1, but there are 0 items"),
            (whole[..rally].to_owned(), "rally_count = 1, but there are 0 items"),
            (whole[..whole.len() - 2].to_owned(), "line"),
            (whole.replace("frame = 3", "frame = 300"), "u8"),
            (whole.replace("frame = 3\n", ""), "missing field `frame`"),
            (whole.replace("frame", "fraem"), "unknown field `fraem`"),
            (whole.replace("command = 16", "command = \"16\""), "u16"),
            (whole.replace("ground_m = 700.0", "ground_m = nan"), "ground_m = NaN is outside"),
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
