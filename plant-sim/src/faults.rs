//! What breaks. The only place where a fault acts: between the servos and the forces.
//!
//! A fault changes two things: how the effector moves ([`Effects::rates`]) and how much of its position has an
//! effect ([`Effects::effective_deflection`]). Healthy effectors pass through both unchanged, to the bit.
//!
//! | kind | the servo | the effect | after the repair |
//! |---|---|---|---|
//! | stuck here | stands still | that of its position | moves on from there |
//! | stuck at, jump | is at the angle at once | that of the angle | moves back from there |
//! | stuck at, travelling | runs to the angle at its rate limit | that of its position | moves back from where it is |
//! | partial loss | follows the commands | the remaining fraction | all of it at once |
//! | float | is at zero at once | none | moves on from zero |

use icd::fault::{
    FaultEntry, FaultKind, FaultReply, FaultRequest, FaultState, Onset, PlantReport, Quantity,
    Refusal, Timing, Travel,
};
use icd::{Effector, PerEffector, SimTime};
use serde::{Deserialize, Serialize};

use crate::servos::Servo;

/// Events that can wait: each future fault is one, its end another.
pub const SCHEDULE_MAX: usize = 64;

/// A fault of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScheduledFault {
    /// Which effector.
    pub effector: Effector,
    /// How it fails.
    pub kind: FaultKind,
    /// When.
    pub at: SimTime,
    /// When it is mended; `None` for never.
    pub until: Option<SimTime>,
}

/// What the faults do to the effectors just now, in the form that the derivative reads without a branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effects {
    /// 1 while the servo follows its command, 0 while the fault moves it.
    following: PerEffector<f64>,
    /// Speed that the fault gives the effector, rad/s or N/s.
    runaway: PerEffector<f64>,
    /// Fraction of the position that has an effect.
    remaining: PerEffector<f64>,
    /// What acts on each effector, for the record.
    codes: PerEffector<u8>,
}

impl Effects {
    /// None.
    #[must_use]
    pub fn none() -> Self {
        Self {
            following: PerEffector::from_fn(|_| 1.0),
            runaway: PerEffector::default(),
            remaining: PerEffector::from_fn(|_| 1.0),
            codes: PerEffector::default(),
        }
    }

    /// Where the effectors really are when their servos are at `servos`, rad or N.
    #[must_use]
    pub fn positions(&self, servos: &PerEffector<f64>) -> PerEffector<f64> {
        *servos
    }

    /// [`FaultKind::code`] of what acts on each effector; 0 for none.
    #[must_use]
    pub fn codes(&self) -> &PerEffector<u8> {
        &self.codes
    }

    /// Speeds of the effectors whose healthy servos would move at `healthy`.
    #[inline]
    #[must_use]
    pub fn rates(&self, healthy: &PerEffector<f64>) -> PerEffector<f64> {
        PerEffector::from_fn(|e| self.following[e] * healthy[e] + self.runaway[e])
    }

    /// What the air and the jet see of an effector at `position`, rad or N.
    ///
    /// Implements Eq. (12) in what faults add to it, u = u1 + u_f: what acts is the healthy deflection plus
    /// u_f, for every kind in the table at the top of this file.
    #[inline]
    #[must_use]
    pub fn effective_deflection(&self, effector: Effector, position: f64) -> f64 {
        self.remaining[effector] * position
    }
}

/// The fault that an effector has.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Active {
    kind: FaultKind,
    since: SimTime,
    /// Ends with the event of the same number.
    number: u32,
    /// Where a travelling effector will stop, and when.
    arrival: Option<(SimTime, f64)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Action {
    Begin(FaultKind),
    End,
}

/// Something that will happen.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Event {
    at: SimTime,
    effector: Effector,
    number: u32,
    action: Action,
}

/// The faults of one aircraft, present and future.
#[derive(Debug, Clone)]
pub struct Faults {
    active: PerEffector<Option<Active>>,
    /// In the order in which they happen; of equal times in the order in which they were asked for.
    schedule: Vec<Event>,
    effects: Effects,
    next_number: u32,
}

impl Faults {
    /// A healthy aircraft.
    #[must_use]
    pub fn none() -> Self {
        Self {
            active: PerEffector::default(),
            schedule: Vec::with_capacity(SCHEDULE_MAX),
            effects: Effects::none(),
            next_number: 0,
        }
    }

    /// What they do just now.
    #[inline]
    #[must_use]
    pub fn effects(&self) -> &Effects {
        &self.effects
    }

    /// The fault that an effector has, and since when.
    #[must_use]
    pub fn active(&self, effector: Effector) -> Option<(FaultKind, SimTime)> {
        self.active[effector].map(|active| (active.kind, active.since))
    }

    /// Reports every fault that acts, rests or is scheduled.
    pub fn list(&self, report: &mut impl FnMut(PlantReport)) {
        for (effector, active) in self.active.iter() {
            if let Some(Active { kind, since, number, .. }) = *active {
                let state = FaultState::Acting { since };
                report(PlantReport::Fault(entry(number, effector, kind, state)));
            }
        }
        for event in &self.schedule {
            if let Action::Begin(kind) = event.action {
                let state = FaultState::Scheduled { at: event.at };
                report(PlantReport::Fault(entry(event.number, event.effector, kind, state)));
            }
        }
    }

    /// When the next thing happens that the integration must not step over.
    #[must_use]
    pub fn next_event(&self) -> Option<SimTime> {
        let arrival =
            self.active.iter().filter_map(|(_, active)| active.as_ref()?.arrival).map(|(at, _)| at);
        self.schedule.first().map(|event| event.at).into_iter().chain(arrival).min()
    }

    /// Takes a fault of the scenario.
    ///
    /// # Errors
    /// [`Refusal`] as for a request.
    pub fn schedule(
        &mut self,
        fault: &ScheduledFault,
        servos: &PerEffector<Servo>,
    ) -> Result<(), Refusal> {
        allowed(fault.effector, &fault.kind, &servos[fault.effector])?;
        let events = 1 + usize::from(fault.until.is_some());
        if self.schedule.len() + events > SCHEDULE_MAX {
            return Err(schedule_full());
        }
        let number = self.number();
        let ScheduledFault { effector, kind, at, until } = *fault;
        self.insert(Event { at, effector, number, action: Action::Begin(kind) });
        if let Some(at) = until {
            self.insert(Event { at, effector, number, action: Action::End });
        }
        Ok(())
    }

    /// Does what a ground station asks, and says truthfully what became of it.
    ///
    /// `positions` are those of the servos at `now`; a fault that moves an effector at once changes them.
    /// What begins or ends is also handed to `report`.
    pub fn request(
        &mut self,
        request: &FaultRequest,
        now: SimTime,
        positions: &mut PerEffector<f64>,
        servos: &PerEffector<Servo>,
        report: &mut impl FnMut(PlantReport),
    ) -> FaultReply {
        match *request {
            FaultRequest::Clear { effector } => {
                self.schedule.retain(|event| event.effector != effector);
                self.end(effector, now, report);
                FaultReply::Cleared { at: now }
            }
            FaultRequest::ClearAll => {
                self.schedule.clear();
                for effector in Effector::ALL {
                    self.end(effector, now, report);
                }
                FaultReply::Cleared { at: now }
            }
            FaultRequest::Inject { effector, kind, timing: Timing { onset, .. } } => {
                if let Err(refusal) = allowed(effector, &kind, &servos[effector]) {
                    return FaultReply::Refused(refusal);
                }
                match onset {
                    Onset::At(at) if at > now => self.schedule_request(effector, kind, at),
                    // Repeated after its onset, a scheduled fault is there already.
                    Onset::At(at) if at < now && self.active(effector) == Some((kind, at)) => {
                        FaultReply::Unchanged { at }
                    }
                    Onset::At(onset) if onset < now => {
                        FaultReply::Refused(Refusal::OnsetInThePast { onset, now })
                    }
                    Onset::At(_) | Onset::AtOnce => {
                        if let Some(active) = self.active[effector].filter(|a| a.kind == kind) {
                            return FaultReply::Unchanged { at: active.since };
                        }
                        let number = self.number();
                        self.begin(effector, kind, number, now, positions, servos, report);
                        FaultReply::Applied { at: now }
                    }
                }
            }
        }
    }

    fn schedule_request(&mut self, effector: Effector, kind: FaultKind, at: SimTime) -> FaultReply {
        let same = |event: &Event| {
            event.at == at && event.effector == effector && event.action == Action::Begin(kind)
        };
        if self.schedule.iter().any(same) {
            return FaultReply::Unchanged { at };
        }
        if self.schedule.len() >= SCHEDULE_MAX {
            return FaultReply::Refused(schedule_full());
        }
        let number = self.number();
        self.insert(Event { at, effector, number, action: Action::Begin(kind) });
        FaultReply::Scheduled { at }
    }

    /// Lets happen what is due at `now`; call it when the integration has reached that time.
    pub fn act(
        &mut self,
        now: SimTime,
        positions: &mut PerEffector<f64>,
        servos: &PerEffector<Servo>,
        report: &mut impl FnMut(PlantReport),
    ) {
        for effector in Effector::ALL {
            if let Some(active) = &mut self.active[effector]
                && let Some((at, angle)) = active.arrival
                && at <= now
            {
                active.arrival = None;
                positions[effector] = angle;
                self.effects.runaway[effector] = 0.0;
            }
        }
        while self.schedule.first().is_some_and(|event| event.at <= now) {
            let event = self.schedule.remove(0);
            match event.action {
                Action::Begin(kind) => {
                    self.begin(event.effector, kind, event.number, now, positions, servos, report);
                }
                // The end belongs to its own fault: not to one that replaced it.
                Action::End
                    if self.active[event.effector].is_some_and(|a| a.number == event.number) =>
                {
                    self.end(event.effector, now, report);
                }
                Action::End => {}
            }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "the two callers already hold each of them")]
    fn begin(
        &mut self,
        effector: Effector,
        kind: FaultKind,
        number: u32,
        now: SimTime,
        positions: &mut PerEffector<f64>,
        servos: &PerEffector<Servo>,
        report: &mut impl FnMut(PlantReport),
    ) {
        if let Some(active) = &mut self.active[effector]
            && active.kind == kind
        {
            // Nothing latches twice; only the end, if there is one, is now that of the later order.
            active.number = number;
            return;
        }
        let here = self.effects.effective_deflection(effector, positions[effector]);
        let mut arrival = None;
        let (mut following, mut runaway, mut remaining) = (0.0, 0.0, 1.0);
        match kind {
            FaultKind::StuckHere => positions[effector] = here,
            FaultKind::StuckAt { angle_rad, travel: Travel::Jump } => {
                positions[effector] = angle_rad;
            }
            FaultKind::StuckAt { angle_rad, travel: Travel::AtActuatorRate } => {
                positions[effector] = here;
                let rate = servos[effector].rate_limit;
                runaway = libm::copysign(rate, angle_rad - here);
                arrival = Some((arrival_time(now, (angle_rad - here).abs() / rate), angle_rad));
            }
            FaultKind::PartialLoss { remaining: left } => (following, remaining) = (1.0, left),
            FaultKind::Float => positions[effector] = 0.0,
            // Refused by `allowed`.
            _ => return,
        }
        self.effects.following[effector] = following;
        self.effects.runaway[effector] = runaway;
        self.effects.remaining[effector] = remaining;
        self.effects.codes[effector] = kind.code();
        self.active[effector] = Some(Active { kind, since: now, number, arrival });
        report(PlantReport::Fault(entry(
            number,
            effector,
            kind,
            FaultState::Acting { since: now },
        )));
    }

    fn end(&mut self, effector: Effector, now: SimTime, report: &mut impl FnMut(PlantReport)) {
        if let Some(active) = self.active[effector].take() {
            self.effects.following[effector] = 1.0;
            self.effects.runaway[effector] = 0.0;
            self.effects.remaining[effector] = 1.0;
            self.effects.codes[effector] = 0;
            let state = FaultState::Ended { at: now };
            report(PlantReport::Fault(entry(active.number, effector, active.kind, state)));
        }
    }

    fn number(&mut self) -> u32 {
        // Wraps after four thousand million requests; the schedule holds 64 of them.
        self.next_number = self.next_number.wrapping_add(1);
        self.next_number
    }

    fn insert(&mut self, event: Event) {
        let place = self.schedule.partition_point(|other| other.at <= event.at);
        self.schedule.insert(place, event);
    }
}

fn entry(id: u32, effector: Effector, kind: FaultKind, state: FaultState) -> FaultEntry {
    FaultEntry { id, effector, kind, timing: Timing::at(state.time()), state }
}

/// First whole microsecond at which a travel of `seconds` is over; at once if there is no way to go.
fn arrival_time(now: SimTime, seconds: f64) -> SimTime {
    let micros = libm::ceil(seconds.min(SimTime::MAX_SECONDS) * 1.0e6);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative, and limited to 30 days"
    )]
    SimTime::from_micros(now.as_micros() + micros as u64)
}

fn schedule_full() -> Refusal {
    #[expect(clippy::cast_possible_truncation, reason = "64")]
    Refusal::ScheduleFull { capacity: SCHEDULE_MAX as u32 }
}

/// Whether the effector can have this fault.
fn allowed(effector: Effector, kind: &FaultKind, servo: &Servo) -> Result<(), Refusal> {
    match *kind {
        FaultKind::StuckHere | FaultKind::Float => Ok(()),
        FaultKind::StuckAt { .. } if !effector.is_angle() => Err(Refusal::NotForThisEffector),
        FaultKind::StuckAt { angle_rad, .. } => {
            if (servo.min..=servo.max).contains(&angle_rad) {
                Ok(())
            } else {
                Err(Refusal::AngleOutOfTravel { angle_rad, limit_rad: servo.max })
            }
        }
        FaultKind::PartialLoss { remaining } => {
            if (0.0..=1.0).contains(&remaining) {
                Ok(())
            } else {
                Err(Refusal::OutOfRange {
                    what: Quantity::Remaining,
                    value: remaining,
                    min: 0.0,
                    max: 1.0,
                })
            }
        }
        _ => Err(Refusal::NotForThisEffector),
    }
}

#[cfg(test)]
mod tests;
