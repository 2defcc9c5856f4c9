//! Mission messages of ground stations, item by item or as other commands, and their completion: by the answer of the control side, or
//! by a timeout.

use std::sync::Arc;

use ::mavlink::dialects::common::MavMissionResult as R;

use crate::Shared;
use crate::codec::{ListKind, MissionItem};
use crate::mission::draft::{Draft, Finished};
use crate::mission::fields::Notes;
use crate::mission::transfers::{Upload, Waiting, What};
use crate::mission::wire::Stored;
use crate::mission::{EMPTY_LISTS, Ended, MissionService, Reply, action, wire};
use crate::peers::From;
use crate::wall_time::WallTime;
use flight_management::command::{Outcome, VehicleCommand};
use flight_management::vehicle::plan::Plan;
use flight_management::vehicle::rules::Rules;
use flight_management::vehicle::{Airspeed, Mode, Place};

/// Reason for refusing an upload to one of the lists that are always empty.
const NOT_THERE: &str = "there are no fence and no rally points";

impl MissionService {
    /// MISSION_COUNT: begins or restarts an upload.
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
                    reply.shared.peers.answer(reply.from.peer, request);
                }
                return;
            }
            _ => {}
        }
        self.abandon(reply.from);
        let state = reply.shared.aircraft.snapshot();
        let place = state.map(|state| Place::of(state.motion()));
        match Draft::new(count, place, state.map(|state| Airspeed::True(state.demand.airspeed_m_s)))
        {
            Ok(draft) => {
                let mut upload = Upload::new(reply.from, draft);
                reply.shared.peers.answer(reply.from.peer, upload.request_next(reply.now));
                self.upload = Some(upload);
            }
            Err(rejected) => reply.refuse(list, &rejected),
        }
    }

    /// Forgets what this ground station has begun; it no longer waits for an acknowledgement.
    fn abandon(&mut self, from: From) {
        self.upload.take_if(|upload| upload.from == from);
        self.ended.take_if(|ended| ended.from == from);
        while let Some(waiting) = self.waiting.plan_of(from) {
            waiting.list = None;
        }
    }

    pub(super) fn take_item(&mut self, item: &MissionItem<i32>, reply: &mut Reply) {
        let list = item.words.list;
        if list != ListKind::MISSION {
            return reply.refuse_for(list, R::MAV_MISSION_UNSUPPORTED, NOT_THERE);
        }
        if action::is_guided(item) {
            return match action::guided_command(item, &reply.shared.parameters.limits) {
                Ok(command) => self.request(command, Some(list), What::Guided, reply),
                Err(rejected) => reply.refuse(list, &rejected),
            };
        }
        let Some(upload) = self.upload.as_mut().filter(|upload| upload.from == reply.from) else {
            return self.take_late_item(item.words.seq, reply);
        };
        if item.words.seq != upload.draft.next() {
            if let Some(request) = upload.request_again(reply.now) {
                reply.shared.peers.answer(reply.from.peer, request);
            }
            return;
        }
        let parameters = &reply.shared.parameters;
        let rules = Rules::new(parameters.limits, parameters.navigation, &parameters.gains);
        if let Err(rejected) = upload.draft.take(item, &rules) {
            self.upload = None;
            let (from, seq) = (reply.from, item.words.seq);
            self.ended = Some(Ended { from, seq, result: rejected.result, id: 0 });
            return reply.refuse(list, &rejected);
        }
        if !upload.draft.is_complete() {
            let request = upload.request_next(reply.now);
            return reply.shared.peers.answer(reply.from.peer, request);
        }
        if let Some(upload) = self.upload.take() {
            let Finished { stored, plan, notes } = upload.draft.finish();
            self.replace(stored, plan, notes, list, reply);
        }
    }

    /// An item outside any upload: its sender missed the acknowledgement, or it is a late copy.
    fn take_late_item(&mut self, seq: u16, reply: &mut Reply) {
        if self.waiting.plan_of(reply.from).is_some() {
            // The acknowledgement follows later.
            return;
        }
        match self.ended.filter(|ended| ended.from == reply.from) {
            Some(ended) if ended.seq == seq => {
                let list = ListKind::MISSION;
                let ack = wire::ack(list, ended.result, ended.id, reply.from.sender);
                reply.shared.peers.answer(reply.from.peer, ack);
            }
            Some(ended) if seq < ended.seq => {}
            _ => reply.refuse_for(
                ListKind::MISSION,
                R::MAV_MISSION_ERROR,
                "an item came and no upload is under way",
            ),
        }
    }

    /// MISSION_CLEAR_ALL, or an upload of no items.
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

    /// Requests the control side to take a plan.
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

    /// Sends a command to the control side; its outcome becomes the acknowledgement for `list`.
    pub(super) fn request(
        &mut self,
        command: VehicleCommand,
        list: Option<ListKind>,
        what: What,
        reply: &mut Reply,
    ) {
        let number =
            if self.waiting.has_room() { reply.shared.intents.push(command) } else { None };
        match (number, list) {
            (Some(number), _) => self.waiting.keep(number, reply.from, list, what, reply.now),
            (None, Some(list)) => {
                reply.refuse_for(list, R::MAV_MISSION_ERROR, "too many requests are waiting");
            }
            (None, None) => {
                let text = "Mission refused: too many requests are waiting";
                reply.shared.texts.warn(reply.now, text);
            }
        }
    }
}

/// Reason of a command without an outcome.
const NO_ANSWER: &str = "Mission not confirmed: the aircraft does not answer";

impl MissionService {
    /// Handles the outcome of an intent.
    pub(super) fn resolve(
        &mut self,
        number: u32,
        outcome: &Outcome,
        now: WallTime,
        shared: &mut Shared,
    ) {
        // Other services have open intents too.
        let Some(waiting) = self.waiting.take(number) else {
            return self.take_restored(number, outcome, now, shared);
        };
        let result = match outcome {
            Outcome::Done => R::MAV_MISSION_ACCEPTED,
            Outcome::Refused(refusal) => {
                shared.texts.warn(now, format!("Mission refused: {refusal}"));
                if refusal.is_temporary() { R::MAV_MISSION_ERROR } else { R::MAV_MISSION_INVALID }
            }
            Outcome::NoAnswer | Outcome::Plant(_) => {
                shared.texts.warn(now, NO_ANSWER);
                R::MAV_MISSION_ERROR
            }
        };
        // A plan steers only the mode that flies it: an upload does not take control from a running stream.
        let steers =
            matches!(waiting.what, What::Guided) || shared.aircraft.mode() == Mode::Mission;
        if result == R::MAV_MISSION_ACCEPTED && steers {
            shared.control.take(waiting.from.sender);
        }
        let id = self.settle(&waiting, result, now, shared);
        if let Some(list) = waiting.list {
            let ack = wire::ack(list, result, id, waiting.from.sender);
            shared.peers.answer(waiting.from.peer, ack);
        }
    }

    /// Completes a command. Returns the id of the plan that it put into force.
    fn settle(&mut self, waiting: &Waiting, result: R, now: WallTime, shared: &mut Shared) -> u32 {
        let accepted = result == R::MAV_MISSION_ACCEPTED;
        match &waiting.what {
            What::Plan { stored, notes } => {
                let id = if accepted { stored.id } else { 0 };
                if let (Some(_), Some(seq)) = (waiting.list, stored.count().checked_sub(1)) {
                    self.ended = Some(Ended { from: waiting.from, seq, result, id });
                }
                if accepted {
                    self.store(stored, shared);
                    self.keeper.keep(stored);
                    let text = match stored.count() {
                        0 => "Mission cleared".into(),
                        1 => "Mission loaded: 1 item".into(),
                        items => format!("Mission loaded: {items} items"),
                    };
                    for text in core::iter::once(text).chain(notes.texts()) {
                        shared.texts.inform(now, text);
                    }
                }
                id
            }
            What::Current(item) => {
                if accepted {
                    self.publish_current(*item, shared);
                }
                0
            }
            What::Guided => 0,
        }
    }

    /// Answers commands without an outcome, and an upload whose next item is missing.
    pub(super) fn give_up_overdue(&mut self, now: WallTime, shared: &mut Shared) {
        while let Some((from, list)) = self.waiting.next_overdue(now) {
            shared.texts.warn(now, NO_ANSWER);
            if let Some(list) = list {
                answer(from, list, R::MAV_MISSION_ERROR, shared);
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
            shared.texts.warn(now, text);
            self.upload = None;
            answer(from, ListKind::MISSION, R::MAV_MISSION_OPERATION_CANCELLED, shared);
        } else {
            shared.peers.answer(from.peer, upload.request(now));
        }
    }
}

fn answer(from: From, list: ListKind, result: R, shared: &mut Shared) {
    shared.peers.answer(from.peer, wire::ack(list, result, 0, from.sender));
}
