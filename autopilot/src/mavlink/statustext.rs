//! STATUSTEXT: what happened, in words, once.

use core::cmp::Reverse;
use core::time::Duration;
use std::collections::VecDeque;

use ::mavlink::dialects::common::{MavSeverity, STATUSTEXT_DATA};
use flight_control::CompensatorMode;
use icd::fault::{FaultEntry, FaultState};
use icd::pace::Pace;

use super::codec::Encoded;
use super::failure;
use super::peers::Peers;
use crate::clock::WallTime;
use crate::event::{EventKind, Limit, Limits};
use crate::parameters::Parameters;
use crate::vehicle::LinkLossAction;

/// Texts that may wait for room at a peer; of more than these the least important ones are not shown.
const TEXTS_MAX: usize = 32;
/// Texts in reply to requests, in a burst.
const REPLIES_BURST: u32 = 20;
/// After a burst, one of them in this time: a flood of bad requests must not hide what matters.
const REPLY_INTERVAL: Duration = Duration::from_millis(200);
/// Characters of one message.
const CHUNK: usize = 50;
/// Chunks of one text; what is longer is cut.
const CHUNKS_MAX: usize = 5;

/// The texts that wait.
#[derive(Debug)]
pub struct StatusTexts {
    queue: VecDeque<(MavSeverity, String)>,
    replies: u32,
    refilled: WallTime,
    unsaid: u64,
    dropped: u64,
    /// Of these, the ones that nobody was told of.
    unshown: u64,
    next_id: u16,
    for_log: VecDeque<LogText>,
}

/// A text for the flight log: importance (number of syslog), words.
pub type LogText = (u8, String);

impl Default for StatusTexts {
    fn default() -> Self {
        Self {
            queue: VecDeque::with_capacity(TEXTS_MAX + 1),
            replies: REPLIES_BURST,
            refilled: WallTime::ZERO,
            unsaid: 0,
            dropped: 0,
            unshown: 0,
            next_id: 1,
            for_log: VecDeque::new(),
        }
    }
}

impl StatusTexts {
    /// Something worth telling that only this side knows; the flight log gets it as well.
    pub fn say(&mut self, severity: MavSeverity, text: impl Into<String>) {
        let text = text.into();
        self.note(severity, text.clone());
        self.tell(severity, text);
    }

    /// Something for the flight log only: it is told in another way.
    pub fn note(&mut self, severity: MavSeverity, text: impl Into<String>) {
        if self.for_log.len() >= TEXTS_MAX {
            self.for_log.pop_front();
        }
        self.for_log.push_back((severity as u8, text.into()));
    }

    /// Next text for the flight log.
    pub fn pop_for_log(&mut self) -> Option<LogText> {
        self.for_log.pop_front()
    }

    /// What an event says; the flight log has the event, and its words from there.
    pub fn tell(&mut self, severity: MavSeverity, text: impl Into<String>) {
        self.queue.push_back((severity, text.into()));
        if self.queue.len() > TEXTS_MAX {
            let severities = self.queue.iter().map(|(severity, _)| *severity as u8).enumerate();
            // The larger the number, the less it matters; the oldest of them.
            let victim = severities.min_by_key(|(_, severity)| Reverse(*severity));
            self.queue.remove(victim.map_or(0, |(place, _)| place));
            self.dropped += 1;
            self.unshown += 1;
        }
    }

    /// Why a request was refused.
    pub fn refuse(&mut self, now: WallTime, text: impl Into<String>) {
        self.reply(MavSeverity::MAV_SEVERITY_WARNING, now, text);
    }

    /// Something that a request causes; limited in rate, since requests are not.
    pub fn reply(&mut self, severity: MavSeverity, now: WallTime, text: impl Into<String>) {
        let refill = now.since(self.refilled).as_micros() / REPLY_INTERVAL.as_micros();
        if refill > 0 {
            let refill = u32::try_from(refill).unwrap_or(u32::MAX);
            self.replies = self.replies.saturating_add(refill).min(REPLIES_BURST);
            self.refilled = now;
        }
        if self.replies == 0 {
            self.unsaid += 1;
            return;
        }
        self.replies -= 1;
        let mut text = text.into();
        if self.unsaid > 0 {
            text = format!("{text} ({} more were not shown)", self.unsaid);
            self.unsaid = 0;
        }
        self.say(severity, text);
    }

    /// Tells an event.
    pub fn handle_event(&mut self, kind: &EventKind, parameters: &Parameters) {
        if let Some((severity, text)) = text_of(kind, parameters) {
            self.tell(severity, text);
        }
    }

    /// Sends what waits, as far as any peer has room; then how many texts found no room.
    pub fn poll(&mut self, peers: &mut Peers) {
        while peers.can_announce(CHUNKS_MAX)
            && let Some((severity, text)) = self.queue.pop_front().or_else(|| self.take_unshown())
        {
            for message in self.chunks(severity, &text) {
                peers.announce(&message);
            }
        }
    }

    fn take_unshown(&mut self) -> Option<(MavSeverity, String)> {
        let count = core::mem::take(&mut self.unshown);
        let text = format!("{count} texts were not shown");
        (count > 0).then_some((MavSeverity::MAV_SEVERITY_WARNING, text))
    }

    /// Something waits.
    #[must_use]
    pub fn is_due(&self) -> bool {
        !self.queue.is_empty()
    }

    /// Texts dropped so far.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    fn chunks(&mut self, severity: MavSeverity, text: &str) -> Vec<Encoded> {
        // One byte a character, so that no character is cut in two.
        let bytes: Vec<u8> = text
            .chars()
            .map(|c| u8::try_from(c).ok().filter(u8::is_ascii).unwrap_or(b'?'))
            .take(CHUNK * CHUNKS_MAX - 1)
            .collect();
        let id = if bytes.len() <= CHUNK { 0 } else { self.take_id() };
        let mut parts: Vec<&[u8]> = bytes.chunks(CHUNK).collect();
        if id != 0 && parts.last().is_some_and(|part| part.len() == CHUNK) {
            // The end of a long text is a NUL, and here there was no room for it.
            parts.push(&[]);
        }
        parts
            .into_iter()
            .zip(0..)
            .map(|(part, chunk_seq)| {
                let mut text = [0; CHUNK];
                text[..part.len()].copy_from_slice(part);
                Encoded::new(&STATUSTEXT_DATA { severity, text: text.into(), id, chunk_seq })
            })
            .collect()
    }

    fn take_id(&mut self) -> u16 {
        let id = self.next_id;
        self.next_id = self.next_id.checked_add(1).unwrap_or(1);
        id
    }
}

/// Importance (number of syslog) and words of an event, for the flight log; `None` if it is not told.
#[must_use]
pub fn words(kind: &EventKind, parameters: &Parameters) -> Option<(u8, String)> {
    text_of(kind, parameters).map(|(severity, text)| (severity as u8, text))
}

fn text_of(kind: &EventKind, parameters: &Parameters) -> Option<(MavSeverity, String)> {
    use MavSeverity as S;
    let compensator_off = parameters.gains.selection.compensator == CompensatorMode::Off;
    Some(match *kind {
        // Those of scripts need the script: [`super::scripts`].
        EventKind::Outcome { .. } | EventKind::Script { .. } => return None,
        EventKind::FlightBegan { joined_in_flight: false } => {
            (S::MAV_SEVERITY_INFO, "Flight began".into())
        }
        EventKind::FlightBegan { joined_in_flight: true } => {
            (S::MAV_SEVERITY_NOTICE, "Joined a flight under way".into())
        }
        EventKind::Mode(mode) => (S::MAV_SEVERITY_INFO, format!("Mode {mode}")),
        EventKind::CompensatorActive { axis, .. } if compensator_off => {
            (S::MAV_SEVERITY_WARNING, format!("Fault detected: {} (compensator off)", axis.name()))
        }
        EventKind::CompensatorActive { axis, at_limit } => {
            let text = format!("Compensator active: {}{}", axis.name(), limits_text(at_limit));
            (S::MAV_SEVERITY_WARNING, text)
        }
        EventKind::CompensatorReleased { .. } if compensator_off => {
            (S::MAV_SEVERITY_NOTICE, "Fault no longer detected".into())
        }
        EventKind::CompensatorReleased { after } => {
            let text = format!("Compensator released after {:.1} s", after.as_secs_f64());
            (S::MAV_SEVERITY_NOTICE, text)
        }
        EventKind::AuthorityExhausted { axis, by } => {
            let by = match by {
                Limit::Thrust => "too little thrust for the nozzle".into(),
                limit => format!("{} at its limit", limit.name()),
            };
            (S::MAV_SEVERITY_WARNING, format!("No authority left: {}, {by}", axis.name()))
        }
        EventKind::AuthorityRestored(axis) => {
            (S::MAV_SEVERITY_INFO, format!("Authority restored: {}", axis.name()))
        }
        EventKind::Saturated(limit) => {
            (S::MAV_SEVERITY_WARNING, format!("Saturated: {}", limit.name()))
        }
        EventKind::SaturationEnded(limit) => {
            (S::MAV_SEVERITY_INFO, format!("No longer saturated: {}", limit.name()))
        }
        EventKind::Fault(ref entry) => return fault_text(entry),
        EventKind::GroundContact => {
            (S::MAV_SEVERITY_EMERGENCY, "Ground contact: the flight is over".into())
        }
        EventKind::PlantLost => {
            (S::MAV_SEVERITY_CRITICAL, "Aircraft lost: no packet for a second".into())
        }
        EventKind::PlantBack => (S::MAV_SEVERITY_NOTICE, "Aircraft is back".into()),
        EventKind::EventsLost(lost) => (
            S::MAV_SEVERITY_WARNING,
            format!("{lost} events were lost: the faults are listed anew"),
        ),
        EventKind::PlanItem(_) | EventKind::ItemReached(_) | EventKind::Home(_) => return None,
        EventKind::PlanComplete => (S::MAV_SEVERITY_INFO, "Mission complete".into()),
        EventKind::Terminated => {
            (S::MAV_SEVERITY_EMERGENCY, "Flight terminated: engine off, surfaces hard over".into())
        }
        EventKind::LinkLost(action) => {
            let action = match action {
                LinkLossAction::Continue => "the flight goes on",
                LinkLossAction::Hold => "Hold",
                LinkLossAction::Return => "Return",
            };
            (S::MAV_SEVERITY_WARNING, format!("Ground station lost: {action}"))
        }
        EventKind::LinkBack(mode) => {
            (S::MAV_SEVERITY_NOTICE, format!("Ground station is back: {mode}"))
        }
        EventKind::Paced(pace) => match pace {
            Pace::Pause => (S::MAV_SEVERITY_INFO, "Simulation paused".into()),
            Pace::Run => (S::MAV_SEVERITY_INFO, "Simulation runs".into()),
            Pace::Step(periods) => (S::MAV_SEVERITY_INFO, format!("Simulation steps: {periods}")),
            Pace::Speed(speed) => (S::MAV_SEVERITY_INFO, format!("Simulation speed: x{speed}")),
        },
    })
}

/// `, nozzle yaw at its limit`; nothing where nothing is.
fn limits_text(limits: Limits) -> String {
    let names: Vec<&str> = limits.iter().map(Limit::name).collect();
    match &names[..] {
        [] => String::new(),
        [name] => format!(", {name} at its limit"),
        [first @ .., last] => format!(", {} and {last} at their limits", first.join(", ")),
    }
}

/// A fault that begins or ends to act. What is scheduled or cancelled is told with the answer to the order.
fn fault_text(entry: &FaultEntry) -> Option<(MavSeverity, String)> {
    let FaultEntry { effector, kind, timing, state, .. } = *entry;
    let (unit, instance) = failure::unit_and_instance(effector);
    let kind = kind.described(effector.is_angle());
    Some(match state {
        FaultState::Acting { .. } => (
            MavSeverity::MAV_SEVERITY_WARNING,
            format!("Injected: {unit} {kind}, instance {instance}{timing}"),
        ),
        FaultState::Ended { .. } => (
            MavSeverity::MAV_SEVERITY_NOTICE,
            format!("Cleared: {unit} {kind}, instance {instance}"),
        ),
        FaultState::Resting { next, .. } => (
            MavSeverity::MAV_SEVERITY_NOTICE,
            format!("Cleared: {unit} {kind}, instance {instance}, again at {next}"),
        ),
        FaultState::Scheduled { .. } | FaultState::Cancelled { .. } => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Axis;

    fn text(kind: EventKind) -> String {
        text_of(&kind, &Parameters::default()).unwrap().1
    }

    #[test]
    fn the_compensators_texts_name_the_axis_and_what_is_at_its_limit() {
        let active = |limits: &[Limit]| {
            let at_limit = Limits::from_fn(|limit| limits.contains(&limit));
            text(EventKind::CompensatorActive { axis: Axis::Yaw, at_limit })
        };
        assert_eq!(active(&[Limit::NozzleYaw]), "Compensator active: yaw, nozzle yaw at its limit");
        assert_eq!(
            active(&[Limit::Aileron, Limit::Rudder, Limit::NozzleYaw]),
            "Compensator active: yaw, aileron, rudder and nozzle yaw at their limits"
        );
        let exhausted = |by| text(EventKind::AuthorityExhausted { axis: Axis::Pitch, by });
        assert_eq!(
            exhausted(Limit::NozzlePitch),
            "No authority left: pitch, nozzle pitch at its limit"
        );
        assert_eq!(
            exhausted(Limit::Thrust),
            "No authority left: pitch, too little thrust for the nozzle"
        );
        let after = Duration::from_millis(12_340);
        let released = text(EventKind::CompensatorReleased { after });
        assert_eq!(released, "Compensator released after 12.3 s");
    }

    fn lengths(text: &str) -> usize {
        StatusTexts::default().chunks(MavSeverity::MAV_SEVERITY_INFO, text).len()
    }

    #[test]
    fn long_texts_come_in_chunks_that_end_with_a_nul() {
        assert_eq!(lengths("short"), 1);
        assert_eq!(lengths(&"x".repeat(50)), 1);
        assert_eq!(lengths(&"x".repeat(51)), 2);
        assert_eq!(
            lengths(&"x".repeat(100)),
            3,
            "an empty chunk ends a text that fills its chunks"
        );
        assert_eq!(lengths(&"x".repeat(10_000)), CHUNKS_MAX);
    }

    #[test]
    fn a_flood_of_refusals_is_limited_and_counted_and_leaves_room_for_events() {
        let mut texts = StatusTexts::default();
        for _ in 0..1000 {
            texts.refuse(WallTime::ZERO, "no");
        }
        assert_eq!(texts.queue.len(), REPLIES_BURST as usize);
        texts.refuse(WallTime::from_micros(1_000_000), "no");
        assert_eq!(texts.queue.back().unwrap().1, "no (980 more were not shown)");
    }

    #[test]
    fn what_matters_least_is_not_shown_when_there_are_too_many_texts() {
        let mut texts = StatusTexts::default();
        texts.say(MavSeverity::MAV_SEVERITY_EMERGENCY, "ground");
        for number in 0..100 {
            texts.say(MavSeverity::MAV_SEVERITY_INFO, number.to_string());
        }
        texts.say(MavSeverity::MAV_SEVERITY_WARNING, "fault");
        let shown: Vec<&str> = texts.queue.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(shown.len(), TEXTS_MAX);
        assert_eq!((shown[0], shown[1], shown[TEXTS_MAX - 1]), ("ground", "70", "fault"));
        assert_eq!(texts.take_unshown().map(|(_, text)| text).unwrap(), "70 texts were not shown");
        assert_eq!(texts.take_unshown(), None, "said once");
    }

    #[test]
    fn with_the_compensator_off_the_text_does_not_claim_that_it_acts() {
        let mut parameters = Parameters::default();
        let at_limit = Limits::default();
        let kind = EventKind::CompensatorActive { axis: Axis::Yaw, at_limit };
        assert_eq!(text_of(&kind, &parameters).unwrap().1, "Compensator active: yaw");
        parameters.gains.selection.compensator = CompensatorMode::Off;
        assert_eq!(text_of(&kind, &parameters).unwrap().1, "Fault detected: yaw (compensator off)");
    }
}
