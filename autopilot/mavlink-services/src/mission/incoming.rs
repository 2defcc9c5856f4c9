//! What ground stations send: plans, item by item, and other commands.

use flight_management::command::VehicleCommand;
use std::sync::Arc;

use ::mavlink::dialects::common::MavMissionResult as R;

use super::draft::{Draft, Finished};
use super::notes::Notes;
use super::upload::Upload;
use super::waiting::What;
use super::wire::Stored;
use super::{EMPTY_LISTS, Ended, MissionService, Reply, guided, wire};
use crate::codec::{ListKind, MissionItem};
use crate::context::From;
use flight_management::vehicle::Place;
use flight_management::vehicle::plan::Plan;
use flight_management::vehicle::rules::Rules;

/// Why there is no upload to the lists that are always empty.
const NOT_THERE: &str = "there are no fence and no rally points";

impl MissionService {
    /// MISSION_COUNT: an upload begins, or begins anew.
    pub(super) fn begin(&mut self, list: ListKind, count: u16, reply: &mut Reply) {
        if count == 0 {
            return self.clear(list, reply);
        }
        if list != ListKind::MISSION {
            return reply.refuse_for(list, R::MAV_MISSION_UNSUPPORTED, NOT_THERE);
        }
        match &mut self.upload {
            Some(upload) if upload.from != reply.from => {
                let other = upload.from.sender.system;
                let reason = format!("ground station {other} is uploading");
                return reply.refuse_for(list, R::MAV_MISSION_DENIED, &reason);
            }
            Some(upload) if upload.draft.next() == 0 && upload.draft.count() == count => {
                // The request for the first item was lost.
                if let Some(request) = upload.request_again(reply.now) {
                    reply.out.answer(reply.from.peer, request);
                }
                return;
            }
            _ => {}
        }
        self.abandon(reply.from);
        let state = reply.ctx.aircraft.snapshot();
        let place = state.map(|state| Place::of(state.motion()));
        match Draft::new(count, place, state.map(|state| state.demand.airspeed_m_s)) {
            Ok(draft) => {
                let mut upload = Upload::new(reply.from, draft);
                reply.out.answer(reply.from.peer, upload.request_next(reply.now));
                self.upload = Some(upload);
            }
            Err(rejected) => reply.refuse(list, &rejected),
        }
    }

    /// What this ground station has begun is forgotten; nobody waits for its acknowledgement.
    fn abandon(&mut self, from: From) {
        self.upload.take_if(|upload| upload.from == from);
        self.ended.take_if(|ended| ended.from == from);
        while let Some(waiting) = self.waiting.plan_of(from) {
            waiting.list = None;
        }
    }

    /// MISSION_ITEM_INT or MISSION_ITEM.
    pub(super) fn take_item(&mut self, item: &MissionItem<i32>, reply: &mut Reply) {
        let list = item.words.list;
        if list != ListKind::MISSION {
            return reply.refuse_for(list, R::MAV_MISSION_UNSUPPORTED, NOT_THERE);
        }
        if guided::is_guided(item) {
            return match guided::command(item, &reply.ctx.parameters.limits) {
                Ok(command) => self.request(command, Some(list), What::Guided, reply),
                Err(rejected) => reply.refuse(list, &rejected),
            };
        }
        let Some(upload) = self.upload.as_mut().filter(|upload| upload.from == reply.from) else {
            return self.take_late_item(item.words.seq, reply);
        };
        if item.words.seq != upload.draft.next() {
            if let Some(request) = upload.request_again(reply.now) {
                reply.out.answer(reply.from.peer, request);
            }
            return;
        }
        let parameters = &reply.ctx.parameters;
        let rules = Rules::new(parameters.limits, parameters.navigation, &parameters.gains);
        if let Err(rejected) = upload.draft.take(item, &rules) {
            self.upload = None;
            let (from, seq) = (reply.from, item.words.seq);
            self.ended = Some(Ended { from, seq, result: rejected.result, id: 0 });
            return reply.refuse(list, &rejected);
        }
        if !upload.draft.is_complete() {
            let request = upload.request_next(reply.now);
            return reply.out.answer(reply.from.peer, request);
        }
        if let Some(upload) = self.upload.take() {
            let Finished { stored, plan, notes } = upload.draft.finish();
            self.replace(stored, plan, notes, list, reply);
        }
    }

    /// An item that no upload waits for: somebody did not hear how it ended, or a late copy.
    fn take_late_item(&mut self, seq: u16, reply: &mut Reply) {
        if self.waiting.plan_of(reply.from).is_some() {
            // The acknowledgement will come.
            return;
        }
        match self.ended.filter(|ended| ended.from == reply.from) {
            Some(ended) if ended.seq == seq => {
                let list = ListKind::MISSION;
                let ack = wire::ack(list, ended.result, ended.id, reply.from.sender);
                reply.out.answer(reply.from.peer, ack);
            }
            Some(ended) if seq < ended.seq => {}
            _ => reply.refuse_for(
                ListKind::MISSION,
                R::MAV_MISSION_ERROR,
                "an item came and no upload is under way",
            ),
        }
    }

    /// MISSION_CLEAR_ALL, or an upload of nothing.
    pub(super) fn clear(&mut self, list: ListKind, reply: &mut Reply) {
        if EMPTY_LISTS.contains(&list) {
            return reply.ack(list, R::MAV_MISSION_ACCEPTED);
        }
        if ![ListKind::MISSION, ListKind::ALL].contains(&list) {
            return reply.refuse_for(list, R::MAV_MISSION_UNSUPPORTED, "there is no such list");
        }
        self.abandon(reply.from);
        self.replace(Stored::default(), Plan::default(), Notes::default(), list, reply);
    }

    /// Asks the control side to take a plan.
    fn replace(
        &mut self,
        stored: Stored,
        plan: Plan,
        notes: Notes,
        list: ListKind,
        reply: &mut Reply,
    ) {
        let what = What::Plan { stored: Arc::new(stored), notes };
        self.request(VehicleCommand::Plan(Arc::new(plan)), Some(list), what, reply);
    }

    /// Asks the control side for something; its outcome is acknowledged for `list`.
    pub(super) fn request(
        &mut self,
        command: VehicleCommand,
        list: Option<ListKind>,
        what: What,
        reply: &mut Reply,
    ) {
        let number = if self.waiting.has_room() { reply.ctx.intents.push(command) } else { None };
        match (number, list) {
            (Some(number), _) => self.waiting.keep(number, reply.from, list, what, reply.now),
            (None, Some(list)) => {
                reply.refuse_for(list, R::MAV_MISSION_ERROR, "too many requests are waiting");
            }
            (None, None) => {
                let text = "Mission refused: too many requests are waiting";
                reply.ctx.texts.refuse(reply.now, text);
            }
        }
    }
}
