//! The mission protocol (<https://mavlink.io/en/services/mission.html>).
//!
//! ```text
//!  COUNT ──> Draft <── items, asked for one by one ── Upload
//!              │ complete
//!              v
//!        Command::Vehicle(VehicleCommand::Plan) ──> control side ──> Done ──> Stored ──> downloads
//!                                          └────> MISSION_ACK
//! ```
//!
//! There is one plan. It is replaced when the control side has taken the whole of a new one; until then, and
//! if anything fails, the old one stays. One ground station uploads at a time; another one that tries is
//! denied. The plan in force is kept for the next start of the program. Fence and rally points are not there: their lists are empty and take nothing.

use flight_management::command::VehicleCommand;
use std::sync::Arc;

use ::mavlink::dialects::common::{MavMissionResult as R, MavSeverity};

use super::codec::{ListKind, Message};
use super::context::{Context, From};
use super::param::{Save, Saved};
use super::peers::Peers;
use crate::wall_time::WallTime;
use flight_management::event::EventKind;
use flight_management::vehicle::plan::Progress;
use flight_management::vehicle::{Navigation, VehicleEvent};

mod action;
mod downloads;
mod draft;
mod fields;
mod guided;
mod incoming;
mod notes;
mod outcomes;
mod rejected;
mod restored;
mod saved;
mod upload;
mod waiting;
mod wire;

use downloads::Downloads;
use rejected::Rejected;
use restored::Restoring;
use saved::PlanKeeper;
use upload::Upload;
use waiting::{WaitingList, What};
use wire::Stored;

pub use saved::{SavedPlan, SavedPlanError};

/// Lists without items here: fence and rally points.
const EMPTY_LISTS: [ListKind; 2] = [ListKind(1), ListKind(2)];

/// How an upload ended, for a ground station that did not hear it.
#[derive(Debug, Clone, Copy)]
struct Ended {
    from: From,
    /// The last item that came.
    seq: u16,
    result: R,
    id: u32,
}

/// Takes and gives plans.
#[derive(Debug, Default)]
pub struct MissionService {
    /// The plan in force.
    stored: Arc<Stored>,
    upload: Option<Upload>,
    downloads: Downloads,
    waiting: WaitingList,
    ended: Option<Ended>,
    restoring: Restoring,
    keeper: PlanKeeper,
}

/// The way to the ground station that has sent a message.
struct Reply<'a, 'b> {
    from: From,
    now: WallTime,
    ctx: &'a mut Context<'b>,
    out: &'a mut Peers,
}

impl Reply<'_, '_> {
    fn ack(&mut self, list: ListKind, result: R) {
        let ack = wire::ack(list, result, 0, self.from.sender);
        self.out.answer(self.from.peer, ack);
    }

    fn refuse(&mut self, list: ListKind, rejected: &Rejected) {
        self.ctx.texts.refuse(self.now, format!("Mission refused: {}", rejected.reason));
        self.ack(list, rejected.result);
    }

    fn refuse_for(&mut self, list: ListKind, result: R, reason: &str) {
        self.refuse(list, &Rejected { result, reason: reason.into() });
    }
}

impl MissionService {
    /// Takes one message of the mission protocol.
    pub fn handle(
        &mut self,
        from: From,
        message: &Message,
        now: WallTime,
        ctx: &mut Context,
        out: &mut Peers,
    ) {
        let mut reply = Reply { from, now, ctx, out };
        match *message {
            Message::MissionCount(list, count) => self.begin(list, count, &mut reply),
            Message::MissionItemInt(ref item) => self.take_item(item, &mut reply),
            Message::MissionItem(ref item) => {
                self.take_item(&wire::with_integers(item), &mut reply);
            }
            Message::MissionClear(list) => self.clear(list, &mut reply),
            Message::MissionRequestList(list) => self.count(list, &mut reply),
            // Also the old request is answered with MISSION_ITEM_INT, as its definition says.
            Message::MissionRequest(list, seq, _) => self.give_item(list, seq, &mut reply),
            Message::MissionAck(list, result) => self.take_ack(list, result, &mut reply),
            Message::MissionSetCurrent(seq) => {
                self.request(VehicleCommand::PlanItem(seq), None, What::Current(seq), &mut reply);
            }
            Message::MissionPartial(list) => {
                let reason = "a plan is only read and written as a whole";
                reply.refuse_for(list, R::MAV_MISSION_UNSUPPORTED, reason);
            }
            _ => {}
        }
    }

    /// MISSION_REQUEST_LIST.
    fn count(&mut self, list: ListKind, reply: &mut Reply) {
        let (items, id) = match list {
            ListKind::MISSION => {
                self.downloads.begin(reply.from, &self.stored, reply.now);
                (self.stored.count(), self.stored.id)
            }
            list if EMPTY_LISTS.contains(&list) => (0, 0),
            _ => {
                let reason = "only one list at a time can be read";
                return reply.refuse_for(list, R::MAV_MISSION_UNSUPPORTED, reason);
            }
        };
        reply.out.answer(reply.from.peer, wire::count(list, items, id, reply.from.sender));
    }

    /// MISSION_REQUEST_INT or MISSION_REQUEST.
    fn give_item(&mut self, list: ListKind, seq: u16, reply: &mut Reply) {
        let plan = self.downloads.plan(reply.from, reply.now);
        let plan = plan.unwrap_or_else(|| Arc::clone(&self.stored));
        match plan.items.get(usize::from(seq)) {
            Some(item) if list == ListKind::MISSION => {
                let state = reply.ctx.aircraft.snapshot().map(|state| state.navigation);
                let flown = state.filter(|navigation| navigation.plan_id == plan.id);
                let current = flown.map_or(0, |navigation| navigation.item);
                let message = wire::item(item, seq == current, reply.from.sender);
                reply.out.answer(reply.from.peer, message);
            }
            _ => {
                let reason = format!("there is no item {seq}, the list has {}", plan.count());
                reply.refuse_for(list, R::MAV_MISSION_INVALID_SEQUENCE, &reason);
            }
        }
    }

    /// MISSION_ACK: a download is over, an upload is given up or cannot go on like this.
    fn take_ack(&mut self, list: ListKind, result: u8, reply: &mut Reply) {
        if list != ListKind::MISSION {
            return;
        }
        self.downloads.end(reply.from);
        let Some(upload) = self.upload.as_mut().filter(|upload| upload.from == reply.from) else {
            return;
        };
        if result == R::MAV_MISSION_UNSUPPORTED as u8 && !upload.is_hopeless() {
            let request = upload.request_otherwise(reply.now);
            reply.out.answer(reply.from.peer, request);
        } else if result != R::MAV_MISSION_ACCEPTED as u8 {
            self.upload = None;
            let text = "Mission upload cancelled, the plan is unchanged";
            reply.ctx.texts.reply(MavSeverity::MAV_SEVERITY_INFO, reply.now, text);
        }
    }

    /// Takes what happened.
    pub fn handle_event(&mut self, kind: &EventKind, ctx: &mut Context, out: &mut Peers) {
        match *kind {
            EventKind::Vehicle(VehicleEvent::ItemReached(item)) => {
                out.announce(&wire::reached(item));
            }
            EventKind::Vehicle(VehicleEvent::PlanItem(item)) => {
                self.publish_current(item, ctx, out);
            }
            _ => {}
        }
    }

    /// MISSION_CURRENT to everybody. The latest state may still show the plan and the item before.
    fn publish_current(&self, item: u16, ctx: &Context, out: &mut Peers) {
        let Some(mut state) = ctx.aircraft.snapshot().copied() else { return };
        let before = state.navigation;
        let progress = match before.progress {
            _ if self.stored.items.is_empty() => Progress::NoPlan,
            Progress::NoPlan => Progress::NotStarted,
            progress => progress,
        };
        let (plan_id, items) = (self.stored.id, self.stored.count());
        state.navigation = Navigation { plan_id, items, item, progress, ..before };
        out.announce(&super::telemetry::mission_current(&state));
    }

    /// Items of the plan that the aircraft has taken.
    #[must_use]
    pub fn plan_items(&self) -> u16 {
        self.stored.count()
    }

    /// When there is something to do.
    #[must_use]
    pub fn next_deadline(&self) -> Option<WallTime> {
        let upload = self.upload.as_ref().map(Upload::deadline);
        upload.into_iter().chain(self.waiting.next_deadline()).min()
    }
}
