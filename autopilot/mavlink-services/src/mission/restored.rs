//! The plan of an earlier run of the program: taken as an upload is, and not started.

use flight_management::command::VehicleCommand;
use std::sync::Arc;

use ::mavlink::dialects::common::MavSeverity;

use super::draft::{Draft, Finished};
use super::notes::Notes;
use super::rejected::Rejected;
use super::saved::SavedPlan;
use super::wire::Stored;
use super::{MissionService, Save, Saved};
use crate::context::Context;
use crate::wall_time::WallTime;
use flight_management::command::Outcome;
use flight_management::vehicle::rules::Rules;

/// What becomes of a saved plan.
#[derive(Debug, Default)]
pub(super) enum Restoring {
    /// There is none, or it is in force, or it was refused.
    #[default]
    Nothing,
    /// The control side has not been asked.
    Waiting(SavedPlan),
    /// It was asked by the intent with this number.
    Asked(u32, Arc<Stored>, Notes),
}

impl MissionService {
    /// From now on plans are kept for the next start; `saved` is what is kept already.
    pub fn keep(&mut self, saved: SavedPlan) {
        self.keeper.begin();
        if saved.count() > 0 {
            self.restoring = Restoring::Waiting(saved);
        }
    }

    /// Asks the control side to take the saved plan, once.
    pub(super) fn restore(&mut self, now: WallTime, ctx: &mut Context) {
        if !matches!(self.restoring, Restoring::Waiting(_)) || ctx.intents.room() == 0 {
            return;
        }
        let Restoring::Waiting(saved) = std::mem::take(&mut self.restoring) else { return };
        let parameters = &ctx.parameters;
        let rules = Rules::new(parameters.limits, parameters.navigation, &parameters.gains);
        match checked(&saved, &rules) {
            Ok(Finished { stored, plan, notes }) => {
                if let Some(number) = ctx.intents.push(VehicleCommand::Plan(Arc::new(plan))) {
                    self.restoring = Restoring::Asked(number, Arc::new(stored), notes);
                }
            }
            Err(rejected) => refuse(&rejected.reason, now, ctx),
        }
    }

    /// Takes the outcome of an intent, if it is the one of the saved plan.
    pub(super) fn take_restored(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        ctx: &mut Context,
    ) {
        self.restoring = match std::mem::take(&mut self.restoring) {
            Restoring::Asked(asked, stored, notes) if asked == number => {
                match outcome {
                    Outcome::Done => {
                        let text = format!("Mission of the last run: {} items", stored.count());
                        self.stored = stored;
                        for text in core::iter::once(text).chain(notes.texts()) {
                            ctx.texts.reply(MavSeverity::MAV_SEVERITY_INFO, now, text);
                        }
                    }
                    Outcome::Refused(refusal) => refuse(&refusal.to_string(), now, ctx),
                    Outcome::NoAnswer | Outcome::Plant(_) => {
                        refuse("the aircraft does not answer", now, ctx);
                    }
                }
                Restoring::Nothing
            }
            other => other,
        };
    }

    /// Next text of the plan file.
    pub fn pop_save(&mut self) -> Option<Save> {
        self.keeper.pop()
    }

    /// Takes what became of a save.
    pub fn handle_saved(&mut self, saved: &Saved, now: WallTime, ctx: &mut Context) {
        if let Some(text) = self.keeper.failure(saved) {
            ctx.texts.refuse(now, text);
        }
    }
}

/// The items one after the other, as an upload takes them. Where the aircraft is does not matter yet.
fn checked(saved: &SavedPlan, rules: &Rules) -> Result<Finished, Rejected> {
    let count = u16::try_from(saved.count()).unwrap_or(u16::MAX);
    let mut draft = Draft::new(count, None, None)?;
    for item in &saved.0 {
        draft.take(item, rules)?;
    }
    Ok(draft.finish())
}

fn refuse(reason: &str, now: WallTime, ctx: &mut Context) {
    ctx.texts.refuse(now, format!("Mission of the last run refused: {reason}"));
}
