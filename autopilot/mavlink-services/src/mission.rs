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
//! There are three lists: the plan, the fence and the rally points. A new list replaces the old one when the control side has
//! accepted the whole of it; until then, and if anything fails, the old one stays. One ground station uploads at a time; the
//! service denies an upload of another one meanwhile. The lists in force are saved for the next start of the program.

#![expect(deprecated, reason = "ground stations without integer items get MISSION_REQUEST")]

use core::fmt::Display;
use core::time::Duration;
use std::sync::Arc;

use ::mavlink::dialects::common as wire;
use ::mavlink::dialects::common::MavMissionResult as R;
use ::mavlink::dialects::common::MavSeverity;

use crate::codec::{Encoded, Identity, ListKind, Message, MissionItem};
use crate::mission::draft::{Draft, Finished, Notes, PlanContext, Rejected};
use crate::mission::saved::{PlanStore, Restoring};
use crate::peers::From;
use crate::wall_time::WallTime;
use crate::{Caller, Service, Shared, convert, telemetry};
use flight_management::command::{Outcome, VehicleCommand};
use flight_management::event::EventKind;
use flight_management::parameters::Parameters;
use flight_management::vehicle::fence::{Fence, RALLY_MAX, VERTICES_MAX};
use flight_management::vehicle::plan::{ITEMS_MAX, Progress};
use flight_management::vehicle::rules::Rules;
use flight_management::vehicle::{Airspeed, Mode, Navigation, Place, VehicleEvent};

pub use crate::mission::saved::{SavedPlan, SavedPlanError};

mod commands;
mod draft;
mod fences;
pub mod file;
mod saved;

/// The lists, by the number of their kind.
const LISTS: [ListKind; 3] = [ListKind::MISSION, ListKind::FENCE, ListKind::RALLY];

/// Reason of a command without an outcome.
const NO_ANSWER: &str = "Mission not confirmed: the aircraft does not answer";

/// Result of an upload, for a ground station that did not receive it.
#[derive(Debug, Clone, Copy)]
struct Ended {
    from: From,
    list: ListKind,
    /// The last item received.
    seq: u16,
    result: R,
    id: u32,
}

const NO_LIST: &str = "there is no such list";

/// Items that a list may have; `None` if there is no such list.
fn most_items(list: ListKind) -> Option<usize> {
    match list {
        ListKind::MISSION => Some(ITEMS_MAX),
        ListKind::FENCE => Some(VERTICES_MAX),
        ListKind::RALLY => Some(RALLY_MAX),
        _ => None,
    }
}

/// The list in texts.
fn name(list: ListKind) -> &'static str {
    match list {
        ListKind::FENCE => "Fence",
        ListKind::RALLY => "Rally points",
        _ => "Mission",
    }
}

/// Handles uploads and downloads of lists.
#[derive(Debug, Default)]
pub struct MissionService {
    /// The lists in force.
    stored: [Arc<Stored>; LISTS.len()],
    fence: Arc<Fence>,
    upload: Option<ListUpload>,
    downloads: Downloads,
    waiting: WaitingList,
    ended: Option<Ended>,
    restoring: Restoring,
    /// The file of the lists; `None` where they are not saved.
    store: Option<PlanStore>,
}

impl Caller<'_> {
    fn refuse(&mut self, list: ListKind, result: R, reason: impl Display) {
        self.shared.texts.warn(self.now, format!("{} refused: {reason}", name(list)));
        self.answer(ack(list, result, 0, self.from.sender));
    }
}

impl Service for MissionService {
    fn handle(&mut self, from: From, message: &Message, now: WallTime, shared: &mut Shared) {
        let mut caller = Caller { from, now, shared };
        match *message {
            Message::MissionCount(list, count) => self.begin(list, count, &mut caller),
            Message::MissionItemInt(ref item) => self.take_item(item, &mut caller),
            Message::MissionItem(ref item) => self.take_item(&with_integers(item), &mut caller),
            Message::MissionClear(list) => self.clear(list, &mut caller),
            Message::MissionRequestList(list) => self.count(list, &mut caller),
            // By its definition the older request is answered with MISSION_ITEM_INT too.
            Message::MissionRequest(list, seq) => self.give_item(list, seq, &mut caller),
            Message::MissionAck(list, result) => self.take_ack(list, result, &mut caller),
            Message::MissionSetCurrent(seq) => {
                self.request(VehicleCommand::PlanItem(seq), None, What::Current(seq), &mut caller);
            }
            Message::MissionPartial(list) => {
                let reason = "a plan is only read and written as a whole";
                caller.refuse(list, R::MAV_MISSION_UNSUPPORTED, reason);
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
        // Other services have open intents too.
        let Some(waiting) = self.waiting.take(number) else {
            return self.take_restored(number, outcome, now, shared);
        };
        let result = match outcome {
            Outcome::Done => R::MAV_MISSION_ACCEPTED,
            Outcome::Refused(refusal) => {
                let list = name(waiting.what.list());
                shared.texts.warn(now, format!("{list} refused: {refusal}"));
                if refusal.is_temporary() { R::MAV_MISSION_ERROR } else { R::MAV_MISSION_INVALID }
            }
            Outcome::NoAnswer | Outcome::Plant(_) => {
                shared.texts.warn(now, NO_ANSWER);
                R::MAV_MISSION_ERROR
            }
        };
        // A plan steers only the mode that flies it: an upload does not take control from a running stream.
        let steers = matches!(waiting.what, What::Guided)
            || shared.aircraft.mode() == Mode::Mission && waiting.what.list() == ListKind::MISSION;
        if result == R::MAV_MISSION_ACCEPTED && steers {
            shared.control.take(waiting.from.sender);
        }
        // First, since the acknowledgement names the plan that is now in force.
        let id = self.settle(&waiting, result, now, shared);
        if let Some(list) = waiting.list {
            shared.peers.answer(waiting.from.peer, ack(list, result, id, waiting.from.sender));
        }
    }

    fn handle_event(&mut self, event: &EventKind, _: WallTime, shared: &mut Shared) {
        match *event {
            EventKind::Vehicle(VehicleEvent::ItemReached(item)) => {
                let reached = wire::MISSION_ITEM_REACHED_DATA { seq: item };
                shared.peers.announce(&Encoded::new(&reached));
            }
            EventKind::Vehicle(VehicleEvent::PlanItem(item)) => self.publish_current(item, shared),
            EventKind::Vehicle(VehicleEvent::ItemPassed(item)) => {
                if let Some(passed) = self.plan().items.get(usize::from(item)) {
                    let name = commands::named(passed.words.command);
                    let text = format!("Mission item {item} passed: {name}, not on board");
                    shared.texts.publish(MavSeverity::MAV_SEVERITY_INFO, text);
                }
            }
            _ => {}
        }
    }

    /// Requests the saved lists; answers commands without an outcome, and an upload whose next item is missing.
    fn poll(&mut self, now: WallTime, shared: &mut Shared) {
        self.restore(now, shared);
        while let Some((from, list)) = self.waiting.next_overdue(now) {
            shared.texts.warn(now, NO_ANSWER);
            if let Some(list) = list {
                let ack = ack(list, R::MAV_MISSION_ERROR, 0, from.sender);
                shared.peers.answer(from.peer, ack);
            }
        }
        let Some(upload) = self.upload.as_mut().filter(|upload| upload.deadline() <= now) else {
            return;
        };
        let from = upload.from;
        if upload.is_hopeless() {
            let (list, next) = (upload.list, upload.draft.next());
            let text = format!(
                "{} upload given up, nothing is changed: item {next} did not come",
                name(list)
            );
            shared.texts.warn(now, text);
            self.upload = None;
            let result = R::MAV_MISSION_OPERATION_CANCELLED;
            shared.peers.answer(from.peer, ack(list, result, 0, from.sender));
        } else {
            shared.peers.answer(from.peer, upload.request(now));
        }
    }

    fn next_deadline(&self, _: &Shared) -> Option<WallTime> {
        let upload = self.upload.as_ref().map(ListUpload::deadline);
        upload.into_iter().chain(self.waiting.next_deadline()).min()
    }
}

impl MissionService {
    /// Puts a list into force; `fence` is the same as a fence, if it is one.
    fn put_into_force(
        &mut self,
        list: ListKind,
        stored: &Arc<Stored>,
        fence: Option<&Arc<Fence>>,
        shared: &mut Shared,
    ) {
        if let Some(fence) = fence {
            self.fence = Arc::clone(fence);
        }
        if let Some(place) = self.stored.get_mut(usize::from(list.0)) {
            *place = Arc::clone(stored);
        }
        if list == ListKind::MISSION {
            shared.plan_items = stored.count();
        }
    }

    /// The list in force; `None` if there is no such list.
    fn list(&self, list: ListKind) -> Option<&Arc<Stored>> {
        self.stored.get(usize::from(list.0))
    }

    /// The plan in force.
    fn plan(&self) -> &Stored {
        let [plan, ..] = &self.stored;
        plan
    }

    fn count(&mut self, list: ListKind, caller: &mut Caller) {
        let Some(stored) = self.list(list).map(Arc::clone) else {
            let reason = "only one list at a time can be read";
            return caller.refuse(list, R::MAV_MISSION_UNSUPPORTED, reason);
        };
        let (items, id) = (stored.count(), stored.id);
        // The download keeps this list, even if another one replaces it meanwhile.
        self.downloads.begin(caller.from, list, stored, caller.now);
        let mut payload = items.to_le_bytes().to_vec();
        let Identity { system, component } = caller.from.sender;
        payload.extend_from_slice(&[system, component, list.0]);
        payload.extend_from_slice(&id.to_le_bytes());
        caller.answer(Encoded::by_hand::<wire::MISSION_COUNT_DATA>(payload));
    }

    fn give_item(&mut self, list: ListKind, seq: u16, caller: &mut Caller) {
        let plan = self.downloads.plan(caller.from, list, caller.now);
        let plan = plan.or_else(|| self.list(list).map(Arc::clone)).unwrap_or_default();
        match plan.items.get(usize::from(seq)) {
            Some(item) => {
                let state = caller.shared.aircraft.snapshot().map(|state| state.navigation);
                // A state from before this plan came into force shows an item of another one.
                let flown = state.filter(|navigation| navigation.plan_id == plan.id);
                let current = flown.map_or(0, |navigation| navigation.item);
                let is_current = list == ListKind::MISSION && seq == current;
                let mut payload = body(item, u8::from(is_current));
                payload[32] = caller.from.sender.system;
                payload[33] = caller.from.sender.component;
                caller.answer(Encoded::by_hand::<wire::MISSION_ITEM_INT_DATA>(payload));
            }
            _ => {
                let reason = format!("there is no item {seq}, the list has {}", plan.count());
                caller.refuse(list, R::MAV_MISSION_INVALID_SEQUENCE, reason);
            }
        }
    }

    /// MISSION_ACK: a download is complete, or an upload is cancelled or cannot continue.
    fn take_ack(&mut self, list: ListKind, result: u8, caller: &mut Caller) {
        if !LISTS.contains(&list) {
            return;
        }
        self.downloads.end(caller.from);
        let is_it = |upload: &&mut ListUpload| upload.from == caller.from && upload.list == list;
        let Some(upload) = self.upload.as_mut().filter(is_it) else { return };
        if result == R::MAV_MISSION_UNSUPPORTED as u8 && !upload.is_hopeless() {
            // The ground station does not know the request: use the other one of the two.
            upload.as_int = !upload.as_int;
            caller.answer(upload.request(caller.now));
        // ACCEPTED ends a download; during an upload it has no meaning and does no harm.
        } else if result != R::MAV_MISSION_ACCEPTED as u8 {
            self.upload = None;
            let text = format!("{} upload cancelled, nothing is changed", name(list));
            caller.shared.texts.inform(caller.now, text);
        }
    }

    /// MISSION_CURRENT to every peer. The latest state may still show the previous plan and item.
    fn publish_current(&self, item: u16, shared: &mut Shared) {
        let Some(mut state) = shared.aircraft.snapshot().copied() else { return };
        let before = state.navigation;
        let progress = match before.progress {
            _ if self.plan().items.is_empty() => Progress::NoPlan,
            Progress::NoPlan => Progress::NotStarted,
            progress => progress,
        };
        let (plan_id, items) = (self.plan().id, self.plan().count());
        state.navigation = Navigation { plan_id, items, item, progress, ..before };
        shared.peers.announce(&telemetry::mission_current(&state));
    }

    /// MISSION_COUNT: begins or restarts an upload.
    fn begin(&mut self, list: ListKind, count: u16, caller: &mut Caller) {
        if count == 0 {
            return self.clear(list, caller);
        }
        let Some(most) = most_items(list) else {
            return caller.refuse(list, R::MAV_MISSION_UNSUPPORTED, NO_LIST);
        };
        match &mut self.upload {
            Some(upload) if upload.from != caller.from => {
                let other = upload.from.sender.system;
                let reason = format!("ground station {other} is uploading");
                return caller.refuse(list, R::MAV_MISSION_DENIED, reason);
            }
            Some(upload)
                if (upload.list, upload.draft.next(), upload.draft.count) == (list, 0, count) =>
            {
                // The request for the first item was lost.
                return upload.request_again(caller);
            }
            _ => {}
        }
        self.abandon(caller.from);
        match Draft::new(count, most) {
            Ok(draft) => {
                let from = caller.from;
                let requested_at = caller.now;
                let upload = ListUpload { from, list, draft, requested_at, tries: 0, as_int: true };
                caller.answer(self.upload.insert(upload).request(caller.now));
            }
            Err(Rejected { result, reason }) => caller.refuse(list, result, reason),
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

    fn take_item(&mut self, item: &MissionItem<i32>, caller: &mut Caller) {
        let list = item.words.list;
        if !LISTS.contains(&list) {
            return caller.refuse(list, R::MAV_MISSION_UNSUPPORTED, NO_LIST);
        }
        if list == ListKind::MISSION && draft::is_guided(item) {
            return match draft::guided_command(item, &caller.shared.parameters.limits) {
                Ok(command) => self.request(command, Some(list), What::Guided, caller),
                Err(Rejected { result, reason }) => caller.refuse(list, result, reason),
            };
        }
        let is_it = |upload: &&mut ListUpload| upload.from == caller.from && upload.list == list;
        let Some(upload) = self.upload.as_mut().filter(is_it) else {
            return self.take_late_item(list, item.words.seq, caller);
        };
        if item.words.seq != upload.draft.next() {
            return upload.request_again(caller);
        }
        upload.draft.take(item);
        if !upload.draft.is_complete() {
            upload.tries = 0;
            return caller.answer(upload.request(caller.now));
        }
        let Some(upload) = self.upload.take() else { return };
        let items = upload.draft.finish();
        if let Err(problems) = self.replace(list, items, caller) {
            self.refuse_all(&problems, item.words.seq, list, caller);
        }
    }

    /// Checks a list and requests the control side to take it.
    fn replace(
        &mut self,
        list: ListKind,
        items: Vec<MissionItem<i32>>,
        caller: &mut Caller,
    ) -> Result<(), Vec<Rejected>> {
        let state = caller.shared.aircraft.snapshot();
        let place = state.map(|state| Place::of(state.motion()));
        let airspeed = state.map(|state| Airspeed::True(state.demand.airspeed_m_s));
        let present = PlanContext { place, airspeed, home_m: None };
        let parameters = &caller.shared.parameters;
        let beside = Beside { plan: &self.plan().items, fence: &self.fence };
        let rules = rules(parameters, caller.shared.aircraft.ground_m());
        let (command, what) = checked(list, items, &beside, present, &rules)?;
        self.request(command, Some(list), what, caller);
        Ok(())
    }

    /// Reports all that is wrong with a list; the acknowledgement has the result of the first problem.
    fn refuse_all(&mut self, problems: &[Rejected], seq: u16, list: ListKind, caller: &mut Caller) {
        for text in texts_of(problems) {
            caller.shared.texts.warn(caller.now, format!("{} refused: {text}", name(list)));
        }
        let result = problems.first().map_or(R::MAV_MISSION_INVALID, |problem| problem.result);
        // If the refusal gets lost the station sends its last item again, and gets the refusal again.
        self.ended = Some(Ended { from: caller.from, list, seq, result, id: 0 });
        caller.answer(ack(list, result, 0, caller.from.sender));
    }

    /// An item outside any upload: its sender missed the acknowledgement, or it is a late copy.
    fn take_late_item(&mut self, list: ListKind, seq: u16, caller: &mut Caller) {
        if self.waiting.plan_of(caller.from).is_some() {
            // The acknowledgement follows later.
            return;
        }
        match self.ended.filter(|ended| ended.from == caller.from && ended.list == list) {
            Some(Ended { seq: last, result, id, .. }) if last == seq => {
                caller.answer(ack(list, result, id, caller.from.sender));
            }
            // A copy of an item from before the end, which is answered.
            Some(ended) if seq < ended.seq => {}
            _ => {
                let reason = "an item came and no upload is under way";
                caller.refuse(list, R::MAV_MISSION_ERROR, reason);
            }
        }
    }

    /// MISSION_CLEAR_ALL, or an upload of no items.
    fn clear(&mut self, list: ListKind, caller: &mut Caller) {
        if list != ListKind::ALL && !LISTS.contains(&list) {
            return caller.refuse(list, R::MAV_MISSION_UNSUPPORTED, NO_LIST);
        }
        self.abandon(caller.from);
        let all = LISTS.into_iter().filter(|each| list == ListKind::ALL || *each == list);
        for each in all {
            let command = match each {
                ListKind::FENCE => VehicleCommand::Fence(Arc::default()),
                ListKind::RALLY => VehicleCommand::Rally(Arc::default()),
                _ => VehicleCommand::Plan(Arc::default()),
            };
            let fence = (each == ListKind::FENCE).then(Arc::default);
            let what =
                What::List { list: each, stored: Arc::default(), notes: Notes::default(), fence };
            // The last of several has the acknowledgement for all.
            let is_last = list != ListKind::ALL || each == ListKind::RALLY;
            self.request(command, is_last.then_some(list), what, caller);
        }
    }

    /// Sends a command to the control side; its outcome becomes the acknowledgement for `list`.
    fn request(
        &mut self,
        command: VehicleCommand,
        list: Option<ListKind>,
        what: What,
        caller: &mut Caller,
    ) {
        let number =
            if self.waiting.has_room() { caller.shared.intents.push(command) } else { None };
        let reason = "too many requests are waiting";
        match (number, list) {
            (Some(number), _) => self.waiting.keep(number, list, what, caller),
            (None, Some(list)) => caller.refuse(list, R::MAV_MISSION_ERROR, reason),
            (None, None) => {
                caller.shared.texts.warn(caller.now, format!("Mission refused: {reason}"));
            }
        }
    }

    /// Completes a command. Returns the id of the plan that it put into force.
    fn settle(&mut self, waiting: &Waiting, result: R, now: WallTime, shared: &mut Shared) -> u32 {
        let accepted = result == R::MAV_MISSION_ACCEPTED;
        match &waiting.what {
            What::List { list, stored, notes, fence } => {
                let (list, id) = (*list, if accepted { stored.id } else { 0 });
                // Nobody waits for the acknowledgement, so nobody can miss it.
                if let (Some(_), Some(seq)) = (waiting.list, stored.count().checked_sub(1)) {
                    self.ended = Some(Ended { from: waiting.from, list, seq, result, id });
                }
                if !accepted {
                    return id;
                }
                let was_empty = self.list(list).is_none_or(|before| before.items.is_empty());
                self.put_into_force(list, stored, fence.as_ref(), shared);
                if let Some(store) = &mut self.store {
                    store.save(list, &stored.items, shared.aircraft.ground_m());
                }
                let text = match (list, stored.count()) {
                    (ListKind::FENCE | ListKind::RALLY, 0) if was_empty => return id,
                    (list, 0) => format!("{} cleared", name(list)),
                    (list, 1) => format!("{} loaded: 1 item", name(list)),
                    (list, items) => format!("{} loaded: {items} items", name(list)),
                };
                for text in core::iter::once(text).chain(notes.texts()) {
                    shared.texts.inform(now, text);
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
}

/// The rules over ground at this altitude, m.
fn rules(parameters: &Parameters, ground_m: f64) -> Rules {
    Rules::new(parameters.limits, parameters.navigation, &parameters.gains).over(ground_m)
}

/// The lists beside one that is checked.
struct Beside<'a> {
    plan: &'a [MissionItem<i32>],
    fence: &'a Fence,
}

/// The command that replaces a list, or all that is wrong with it.
fn checked(
    list: ListKind,
    items: Vec<MissionItem<i32>>,
    beside: &Beside,
    present: PlanContext,
    rules: &Rules,
) -> Result<(VehicleCommand, What), Vec<Rejected>> {
    let (mut notes, mut fence) = (Notes::default(), None);
    let (command, stored) = match list {
        ListKind::FENCE => {
            let checked = Arc::new(fences::fence(&items)?);
            fence = Some(Arc::clone(&checked));
            (VehicleCommand::Fence(checked), Stored::new(items))
        }
        ListKind::RALLY => {
            let home_m = draft::home_altitude_m(beside.plan, rules);
            let points = fences::rally(&items, beside.fence, home_m, rules.ground_m)?;
            (VehicleCommand::Rally(points.into()), Stored::new(items))
        }
        _ => {
            let Finished { stored, plan, notes: differences } =
                draft::check(items, present, rules)?;
            notes = differences;
            (VehicleCommand::Plan(Arc::new(plan)), stored)
        }
    };
    Ok((command, What::List { list, stored: Arc::new(stored), notes, fence }))
}

/// Problems of a list that get texts of their own.
const PROBLEMS_MAX: usize = 8;

/// The problems of a list as texts.
fn texts_of(problems: &[Rejected]) -> impl Iterator<Item = String> + '_ {
    let more = problems.len().saturating_sub(PROBLEMS_MAX);
    let rest = (more > 0).then(|| format!("and {more} more"));
    problems.iter().take(PROBLEMS_MAX).map(|problem| problem.reason.clone()).chain(rest)
}

/// A missing item is requested again after this time. Ground stations wait half a second to one and
/// a half, and then repeat the previous item.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(1);
/// Requests for one item, including the first, before the upload is given up.
const TRIES_MAX: u32 = 5;
/// An item out of order leads to a new request, but not more often than this: otherwise every copy of an
/// item would lead to a copy of all that follow.
const AGAIN: Duration = Duration::from_millis(200);

#[derive(Debug)]
struct ListUpload {
    from: From,
    list: ListKind,
    draft: Draft,
    requested_at: WallTime,
    tries: u32,
    as_int: bool,
}

impl ListUpload {
    /// The request for the next item.
    fn request(&mut self, now: WallTime) -> Encoded {
        self.requested_at = now;
        self.tries += 1;
        self.requested()
    }

    /// Sends the request once more after another item has arrived, unless it has just been sent.
    fn request_again(&mut self, caller: &mut Caller) {
        if caller.now.since(self.requested_at) >= AGAIN {
            self.requested_at = caller.now;
            caller.answer(self.requested());
        }
    }

    /// MISSION_REQUEST_INT, or MISSION_REQUEST.
    fn requested(&self) -> Encoded {
        let [low, high] = self.draft.next().to_le_bytes();
        let Identity { system, component } = self.from.sender;
        let payload = vec![low, high, system, component, self.list.0];
        if self.as_int {
            Encoded::by_hand::<wire::MISSION_REQUEST_INT_DATA>(payload)
        } else {
            Encoded::by_hand::<wire::MISSION_REQUEST_DATA>(payload)
        }
    }

    /// When to repeat the request, or to give up the upload.
    fn deadline(&self) -> WallTime {
        self.requested_at + REQUEST_TIMEOUT
    }

    /// The next item was requested as often as allowed.
    fn is_hopeless(&self) -> bool {
        self.tries >= TRIES_MAX
    }
}

/// Downloads at the same time; the one with the oldest request makes room.
const DOWNLOADS_MAX: usize = 16;
/// A download is over after this long without a request.
const DOWNLOAD_TIMEOUT: Duration = Duration::from_secs(10);

#[derive(Debug)]
struct Download {
    from: From,
    list: ListKind,
    plan: Arc<Stored>,
    requested_at: WallTime,
}

/// The downloads under way.
#[derive(Debug, Default)]
struct Downloads(Vec<Download>);

impl Downloads {
    /// Records that a station requests the list.
    fn begin(&mut self, from: From, list: ListKind, plan: Arc<Stored>, now: WallTime) {
        self.end(from);
        if self.0.len() >= DOWNLOADS_MAX {
            let oldest =
                self.0.iter().enumerate().min_by_key(|(_, download)| download.requested_at);
            if let Some((place, _)) = oldest {
                self.0.swap_remove(place);
            }
        }
        self.0.push(Download { from, list, plan, requested_at: now });
    }

    /// The list that a station downloads; `None` if it has no download.
    fn plan(&mut self, from: From, list: ListKind, now: WallTime) -> Option<Arc<Stored>> {
        self.0.retain(|download| now.since(download.requested_at) < DOWNLOAD_TIMEOUT);
        let is_it = |download: &&mut Download| download.from == from && download.list == list;
        let download = self.0.iter_mut().find(is_it)?;
        download.requested_at = now;
        Some(Arc::clone(&download.plan))
    }

    /// The station has the whole list, or has cancelled.
    fn end(&mut self, from: From) {
        self.0.retain(|download| download.from != from);
    }
}

/// Commands that may be open at the same time.
const WAITING_MAX: usize = 32;
/// After this time the service answers that there was no outcome. It still handles an outcome that arrives later.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(3);

/// Request of an open command.
#[derive(Debug)]
enum What {
    /// A list as uploaded, and what to report when it takes effect.
    List {
        list: ListKind,
        stored: Arc<Stored>,
        notes: Notes,
        /// The same as a fence.
        fence: Option<Arc<Fence>>,
    },
    Current(u16),
    /// Another place or altitude, by an item.
    Guided,
}

impl What {
    /// The list that it is about.
    fn list(&self) -> ListKind {
        match self {
            Self::List { list, .. } => *list,
            Self::Current(_) | Self::Guided => ListKind::MISSION,
        }
    }
}

#[derive(Debug)]
struct Waiting {
    /// Number of the intent.
    number: u32,
    /// Station that requested it.
    from: From,
    /// List to acknowledge; `None`: no station waits for an acknowledgement.
    list: Option<ListKind>,
    what: What,
    since: WallTime,
    overdue: bool,
}

/// The open commands, oldest first.
#[derive(Debug, Default)]
struct WaitingList(Vec<Waiting>);

impl WaitingList {
    /// There is room for another command.
    fn has_room(&self) -> bool {
        self.0.iter().filter(|waiting| !waiting.overdue).count() < WAITING_MAX
    }

    /// Adds a command. One that never had an outcome makes room.
    fn keep(&mut self, number: u32, list: Option<ListKind>, what: What, caller: &Caller) {
        if self.0.len() >= WAITING_MAX
            && let Some(oldest) = self.0.iter().position(|waiting| waiting.overdue)
        {
            self.0.remove(oldest);
        }
        let Caller { from, now: since, .. } = *caller;
        self.0.push(Waiting { number, from, list, what, since, overdue: false });
    }

    /// The command with this number.
    fn take(&mut self, number: u32) -> Option<Waiting> {
        let place = self.0.iter().position(|waiting| waiting.number == number)?;
        Some(self.0.remove(place))
    }

    /// A station that waits for a plan to take effect.
    fn plan_of(&mut self, from: From) -> Option<&mut Waiting> {
        let mut plans =
            self.0.iter_mut().filter(|waiting| matches!(waiting.what, What::List { .. }));
        plans.find(|waiting| waiting.from == from && waiting.list.is_some())
    }

    /// The next overdue command: the waiting station, and the list to acknowledge.
    fn next_overdue(&mut self, now: WallTime) -> Option<(From, Option<ListKind>)> {
        let waiting = self
            .0
            .iter_mut()
            .find(|waiting| !waiting.overdue && now.since(waiting.since) >= ANSWER_TIMEOUT)?;
        waiting.overdue = true;
        Some((waiting.from, waiting.list.take()))
    }

    /// When the next command becomes overdue.
    fn next_deadline(&self) -> Option<WallTime> {
        let open = self.0.iter().filter(|waiting| !waiting.overdue);
        open.map(|waiting| waiting.since + ANSWER_TIMEOUT).min()
    }
}

/// A list of items as a ground station sent them, for downloads.
#[derive(Debug, Clone, PartialEq, Default)]
struct Stored {
    /// Changes with every item; 0 only for an empty list.
    id: u32,
    /// The items in their order.
    items: Vec<MissionItem<i32>>,
}

impl Stored {
    /// Stores items; the same items have the same id, also after a restart of the autopilot.
    fn new(items: Vec<MissionItem<i32>>) -> Self {
        let mut hasher = crc32fast::Hasher::new();
        // Without the mark of the current item, which moves in flight and makes no other plan of it.
        items.iter().for_each(|item| hasher.update(&body(item, 0)));
        let id = if items.is_empty() { 0 } else { hasher.finalize().max(1) };
        Self { id, items }
    }

    fn count(&self) -> u16 {
        u16::try_from(self.items.len()).unwrap_or(u16::MAX)
    }
}

/// The older form with floats as the newer form with integers.
fn with_integers(item: &MissionItem<f32>) -> MissionItem<i32> {
    let whole = |value: f32| {
        if value.is_nan() {
            i32::MAX
        } else if convert::GLOBAL_FRAMES.contains(&item.words.frame) {
            convert::degrees_e7(convert::radians(convert::decimal(value)))
        } else {
            convert::to_i32(f64::from(value))
        }
    };
    let MissionItem { params, x, y, z, words } = *item;
    MissionItem { params, x: whole(x), y: whole(y), z, words }
}

/// MISSION_ACK; `id` identifies the new plan.
fn ack(list: ListKind, result: R, id: u32, to: Identity) -> Encoded {
    let mut payload = vec![to.system, to.component, result as u8, list.0];
    payload.extend_from_slice(&id.to_le_bytes());
    Encoded::by_hand::<wire::MISSION_ACK_DATA>(payload)
}

/// Payload of MISSION_ITEM_INT, without a target.
fn body(item: &MissionItem<i32>, current: u8) -> Vec<u8> {
    let mut payload = Vec::with_capacity(wire::MISSION_ITEM_INT_DATA::ENCODED_LEN);
    for param in item.params {
        payload.extend_from_slice(&param.to_le_bytes());
    }
    payload.extend_from_slice(&item.x.to_le_bytes());
    payload.extend_from_slice(&item.y.to_le_bytes());
    payload.extend_from_slice(&item.z.to_le_bytes());
    let words = &item.words;
    payload.extend_from_slice(&words.seq.to_le_bytes());
    payload.extend_from_slice(&words.command.to_le_bytes());
    let autocontinue = u8::from(words.autocontinue);
    payload.extend_from_slice(&[0, 0, words.frame, current, autocontinue, words.list.0]);
    payload
}
