//! The ends of commands and uploads: what the control side says, and what nobody says in time.

use ::mavlink::dialects::common::{MavMissionResult as R, MavSeverity};

use super::waiting::{Waiting, What};
use super::{Ended, MissionService, wire};
use crate::codec::ListKind;
use crate::context::{Context, From};
use crate::peers::Peers;
use crate::wall_time::WallTime;
use flight_management::command::Outcome;
use flight_management::vehicle::Mode;

/// Reason of a command without an outcome.
const NO_ANSWER: &str = "Mission not confirmed: the aircraft does not answer";

impl MissionService {
    /// Takes the outcome of an intent.
    pub fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        // Other services ask too.
        let Some(waiting) = self.waiting.take(number) else {
            return self.take_restored(number, outcome, now, ctx);
        };
        let result = match outcome {
            Outcome::Done => R::MAV_MISSION_ACCEPTED,
            Outcome::Refused(refusal) => {
                ctx.texts.refuse(now, format!("Mission refused: {refusal}"));
                if refusal.is_temporary() { R::MAV_MISSION_ERROR } else { R::MAV_MISSION_INVALID }
            }
            Outcome::NoAnswer | Outcome::Plant(_) => {
                ctx.texts.refuse(now, NO_ANSWER);
                R::MAV_MISSION_ERROR
            }
        };
        // A plan steers only the mode that flies it: uploading one takes no running stream its control.
        let steers = matches!(waiting.what, What::Guided) || ctx.aircraft.mode() == Mode::Mission;
        if result == R::MAV_MISSION_ACCEPTED && steers {
            ctx.control.take(waiting.from.sender);
        }
        let id = self.settle(&waiting, result, now, ctx, out);
        if let Some(list) = waiting.list {
            let ack = wire::ack(list, result, id, waiting.from.sender);
            out.answer(waiting.from.peer, ack);
        }
    }

    /// Does what follows from the end of a command. Returns the id of the plan that came into force by it.
    fn settle(
        &mut self,
        waiting: &Waiting,
        result: R,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) -> u32 {
        let accepted = result == R::MAV_MISSION_ACCEPTED;
        match &waiting.what {
            What::Plan { stored, notes } => {
                let id = if accepted { stored.id } else { 0 };
                if let (Some(_), Some(seq)) = (waiting.list, stored.count().checked_sub(1)) {
                    self.ended = Some(Ended { from: waiting.from, seq, result, id });
                }
                if accepted {
                    self.stored = stored.clone();
                    self.keeper.keep(stored);
                    let text = match stored.count() {
                        0 => "Mission cleared".into(),
                        1 => "Mission loaded: 1 item".into(),
                        items => format!("Mission loaded: {items} items"),
                    };
                    for text in core::iter::once(text).chain(notes.texts()) {
                        ctx.texts.reply(MavSeverity::MAV_SEVERITY_INFO, now, text);
                    }
                }
                id
            }
            What::Current(item) => {
                if accepted {
                    self.publish_current(*item, ctx, out);
                }
                0
            }
            What::Guided => 0,
        }
    }

    /// Does what is due.
    pub fn poll(&mut self, now: WallTime, ctx: &mut Context, out: &mut Peers) {
        self.restore(now, ctx);
        while let Some((from, list)) = self.waiting.next_overdue(now) {
            ctx.texts.refuse(now, NO_ANSWER);
            if let Some(list) = list {
                answer(from, list, R::MAV_MISSION_ERROR, out);
            }
        }
        let Some(upload) = self.upload.as_mut().filter(|upload| upload.deadline() <= now) else {
            return;
        };
        let from = upload.from;
        if upload.is_hopeless() {
            let text = format!(
                "Mission upload given up, the plan is unchanged: item {} did not come",
                upload.draft.next()
            );
            ctx.texts.refuse(now, text);
            self.upload = None;
            answer(from, ListKind::MISSION, R::MAV_MISSION_OPERATION_CANCELLED, out);
        } else {
            out.answer(from.peer, upload.request(now));
        }
    }
}

fn answer(from: From, list: ListKind, result: R, out: &mut Peers) {
    out.answer(from.peer, wire::ack(list, result, 0, from.sender));
}
