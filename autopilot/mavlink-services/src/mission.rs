//! The mission protocol (<https://mavlink.io/en/services/mission.html>).
//!
//! ```text
//!  COUNT ──> Draft <── items, requested one by one ── Upload
//!              │ complete
//!              v
//!        Command ──> control side ──> Done ──> Stored ──> downloads
//!                                          └────> MISSION_ACK
//! ```
//!
//! There is one plan. A new plan replaces it when the control side has accepted the whole of it; until then, and
//! if anything fails, the old one stays. One ground station uploads at a time; the service denies an upload of another one
//! meanwhile. The plan in force is saved for the next start of the program. Fence and rally points are not supported:
//! their lists are empty and accept nothing.

use std::sync::Arc;

use ::mavlink::dialects::common::MavMissionResult as R;

use crate::codec::{ListKind, Message};
use crate::mission::saved::{PlanKeeper, Restoring};
use crate::mission::wire::Stored;
use crate::peers::From;
use crate::wall_time::WallTime;
use crate::{Service, Shared};
use fields::Rejected;
use flight_management::command::{Outcome, VehicleCommand};
use flight_management::event::EventKind;
use flight_management::vehicle::plan::Progress;
use flight_management::vehicle::{Navigation, VehicleEvent};
use transfers::{Downloads, Upload, WaitingList, What};

pub use crate::mission::saved::{SavedPlan, SavedPlanError};

mod action;
mod draft;
mod fields;
mod requests;
mod saved;
mod transfers;
mod wire;

/// Lists without items here: fence and rally points.
const EMPTY_LISTS: [ListKind; 2] = [ListKind(1), ListKind(2)];

/// Result of an upload, for a ground station that did not receive it.
#[derive(Debug, Clone, Copy)]
struct Ended {
    from: From,
    /// The last item received.
    seq: u16,
    result: R,
    id: u32,
}

/// Handles uploads and downloads of plans.
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

/// The route to the ground station that has sent a message.
struct Reply<'a> {
    from: From,
    now: WallTime,
    shared: &'a mut Shared,
}

impl Reply<'_> {
    fn ack(&mut self, list: ListKind, result: R) {
        let ack = wire::ack(list, result, 0, self.from.sender);
        self.shared.peers.answer(self.from.peer, ack);
    }

    fn refuse(&mut self, list: ListKind, rejected: &Rejected) {
        self.shared.texts.warn(self.now, format!("Mission refused: {}", rejected.reason));
        self.ack(list, rejected.result);
    }

    fn refuse_for(&mut self, list: ListKind, result: R, reason: &str) {
        self.refuse(list, &Rejected { result, reason: reason.into() });
    }
}

impl Service for MissionService {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        let mut reply = Reply { from, now, shared };
        match *message {
            Message::MissionCount(list, count) => self.begin(list, count, &mut reply),
            Message::MissionItemInt(ref item) => self.take_item(item, &mut reply),
            Message::MissionItem(ref item) => {
                self.take_item(&wire::with_integers(item), &mut reply);
            }
            Message::MissionClear(list) => self.clear(list, &mut reply),
            Message::MissionRequestList(list) => self.count(list, &mut reply),
            // By its definition the older request is answered with MISSION_ITEM_INT too.
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

    fn handle_outcome(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        shared: &mut Shared,
    ) {
        self.resolve(number, outcome, now, shared);
    }

    fn handle_event(&mut self, event: &EventKind, _: WallTime, shared: &mut Shared) {
        match *event {
            EventKind::Vehicle(VehicleEvent::ItemReached(item)) => {
                shared.peers.announce(&wire::reached(item));
            }
            EventKind::Vehicle(VehicleEvent::PlanItem(item)) => self.publish_current(item, shared),
            _ => {}
        }
    }

    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        self.restore(now, shared);
        self.give_up_overdue(now, shared);
    }

    fn next_deadline(&self, _: &Shared) -> Option<WallTime> {
        let upload = self.upload.as_ref().map(Upload::deadline);
        upload.into_iter().chain(self.waiting.next_deadline()).min()
    }
}

impl MissionService {
    /// Puts a plan into force.
    fn store(&mut self, stored: &Arc<Stored>, shared: &mut Shared) {
        self.stored = Arc::clone(stored);
        shared.plan_items = stored.count();
    }

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
        reply.shared.peers.answer(reply.from.peer, wire::count(list, items, id, reply.from.sender));
    }

    fn give_item(&mut self, list: ListKind, seq: u16, reply: &mut Reply) {
        let plan = self.downloads.plan(reply.from, reply.now);
        let plan = plan.unwrap_or_else(|| Arc::clone(&self.stored));
        match plan.items.get(usize::from(seq)) {
            Some(item) if list == ListKind::MISSION => {
                let state = reply.shared.aircraft.snapshot().map(|state| state.navigation);
                let flown = state.filter(|navigation| navigation.plan_id == plan.id);
                let current = flown.map_or(0, |navigation| navigation.item);
                let message = wire::item(item, seq == current, reply.from.sender);
                reply.shared.peers.answer(reply.from.peer, message);
            }
            _ => {
                let reason = format!("there is no item {seq}, the list has {}", plan.count());
                reply.refuse_for(list, R::MAV_MISSION_INVALID_SEQUENCE, &reason);
            }
        }
    }

    /// MISSION_ACK: a download is complete, or an upload is cancelled or cannot continue.
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
            reply.shared.peers.answer(reply.from.peer, request);
        } else if result != R::MAV_MISSION_ACCEPTED as u8 {
            self.upload = None;
            let text = "Mission upload cancelled, the plan is unchanged";
            reply.shared.texts.inform(reply.now, text);
        }
    }

    /// MISSION_CURRENT to every peer. The latest state may still show the previous plan and item.
    fn publish_current(&self, item: u16, shared: &mut Shared) {
        let Some(mut state) = shared.aircraft.snapshot().copied() else { return };
        let before = state.navigation;
        let progress = match before.progress {
            _ if self.stored.items.is_empty() => Progress::NoPlan,
            Progress::NoPlan => Progress::NotStarted,
            progress => progress,
        };
        let (plan_id, items) = (self.stored.id, self.stored.count());
        state.navigation = Navigation { plan_id, items, item, progress, ..before };
        shared.peers.announce(&super::telemetry::mission_current(&state));
    }
}
