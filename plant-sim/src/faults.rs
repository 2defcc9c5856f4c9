//! What breaks. The only place where a fault acts: between the commands and the forces.
//!
//! ```text
//! commands -> told ──> servos ──> positions ──> what acts ──> air and jet
//!              ^          ^           ^             ^
//!           delayed    stuck      oscillating   partial loss
//!           flame-out  hard over  drifting
//!           limited    slow       biased
//! ```
//!
//! Healthy effectors pass through all of it unchanged, to the bit. "Here" is what acted of the effector until
//! the onset.
//!
//! What each kind does is told by its entry in [`icd::fault::CATALOGUE`] and done in `acting`.
//!
//! After the repair every effector moves on from where it is, as its healthy servo lets it; only what was lost
//! of its effect is there at once. Of two faults that follow each other on one effector, the second begins where
//! the first leaves it; two deviations in a row (oscillating, drifting, biased) are deviations of the same servo.
//!
//! Times are exact to the microsecond, between ticks and steps too: onset, end, end of the ramp, arrival, each
//! change of an intermittent fault, each delayed command. What changes smoothly in between (a ramp, a swing, a
//! drift) is held during each integration step at its value at the begin of the step.

use icd::fault::{
    FaultKind, FaultReply, FaultRequest, FaultState, Onset, PlantReport, Refusal, Target, Timing,
};
use icd::{Effector, EffectorList, PerEffector, SimTime};

mod acting;
mod delay;
mod effects;
mod entry;
mod plan;
mod scheduled;

pub use delay::COMMANDS_MAX;
pub use effects::Effects;
pub use scheduled::{ScheduledFault, check};

use crate::servos::Servo;
use acting::Acting;
use delay::Delayed;
use effects::Share;
use entry::{Fault, Present};
use plan::Plan;

/// Faults that can wait for their onset.
pub const SCHEDULE_MAX: usize = 64;

/// The aircraft at the instant at which something happens to it.
pub struct Scene<'a> {
    /// The time.
    pub now: SimTime,
    /// Where the servos are, rad and N; a fault that moves an effector at once changes them.
    pub positions: &'a mut PerEffector<f64>,
    /// Takes what begins, rests or ends.
    pub report: &'a mut dyn FnMut(PlantReport),
}

/// The faults of one aircraft, present and future.
#[derive(Debug, Clone)]
pub struct Faults {
    list: EffectorList,
    servos: PerEffector<Servo>,
    present: PerEffector<Option<Present>>,
    /// In the order in which they happen; of equal times in the order in which they were asked for.
    schedule: Vec<Fault>,
    effects: Effects,
    /// What the effectors are commanded, and what their servos are told.
    commands: PerEffector<f64>,
    told: PerEffector<f64>,
    delayed: PerEffector<Delayed>,
    /// Whether a fault changes commands.
    tells: bool,
    /// Whether a fault changes from step to step.
    varies: bool,
    next_event: Option<SimTime>,
    last_id: u32,
}

impl Faults {
    /// A healthy aircraft with these effectors, servos and commands (inside the travel, rad and N).
    #[must_use]
    pub fn none(
        list: &EffectorList,
        servos: &PerEffector<Servo>,
        commands: &PerEffector<f64>,
    ) -> Self {
        Self {
            list: *list,
            servos: *servos,
            present: PerEffector::default(),
            schedule: Vec::with_capacity(SCHEDULE_MAX),
            effects: Effects::none(),
            commands: *commands,
            told: *commands,
            delayed: PerEffector::from_fn(|_| Delayed::new()),
            tells: false,
            varies: false,
            next_event: None,
            last_id: 0,
        }
    }

    /// What they do just now.
    #[inline]
    #[must_use]
    pub fn effects(&self) -> &Effects {
        &self.effects
    }

    /// What the servos are told just now, rad and N.
    #[inline]
    #[must_use]
    pub fn told(&self) -> &PerEffector<f64> {
        &self.told
    }

    /// What the effectors were commanded last, rad and N.
    #[inline]
    #[must_use]
    pub fn commands(&self) -> &PerEffector<f64> {
        &self.commands
    }

    /// Whether a fault changes from step to step: then [`Faults::vary`] is due after each.
    #[inline]
    #[must_use]
    pub fn varies(&self) -> bool {
        self.varies
    }

    /// When the next thing happens that the integration must not step over.
    #[inline]
    #[must_use]
    pub fn next_event(&self) -> Option<SimTime> {
        self.next_event
    }

    /// The fault that acts on an effector, and since when.
    #[must_use]
    pub fn active(&self, effector: Effector) -> Option<(FaultKind, SimTime)> {
        let present = self.present[effector]?;
        Some((present.fault.kind, present.acting?.since()))
    }

    /// Reports every fault that acts, rests or is scheduled.
    pub fn list(&self, report: &mut dyn FnMut(PlantReport)) {
        for (_, present) in self.present.iter() {
            if let Some(present) = present {
                report(present.fault.entry(present.state()));
            }
        }
        for fault in &self.schedule {
            report(fault.entry(FaultState::Scheduled { at: fault.plan.onset(0) }));
        }
    }

    /// Takes a fault of the scenario, and reports it if it is still to come.
    ///
    /// # Errors
    /// [`Refusal`] as for a request.
    pub fn schedule(
        &mut self,
        fault: &ScheduledFault,
        report: &mut dyn FnMut(PlantReport),
    ) -> Result<(), Refusal> {
        let ScheduledFault { target, kind, timing } = *fault;
        let effector = check(&self.list, &self.servos, target, &kind, &timing)?;
        let fault = self.number(effector, kind, timing, SimTime::ZERO);
        self.insert(fault)?;
        self.look_ahead(SimTime::ZERO);
        let at = fault.plan.onset(0);
        if at > SimTime::ZERO {
            report(fault.entry(FaultState::Scheduled { at }));
        }
        Ok(())
    }

    /// Does what a ground station asks, and says truthfully what became of it.
    pub fn request(&mut self, request: &FaultRequest, scene: &mut Scene<'_>) -> FaultReply {
        let reply = match *request {
            FaultRequest::Clear { target } => {
                scheduled::effector_of(&self.list, target).map(|effector| {
                    self.clear(|e| e == effector, scene);
                    FaultReply::Cleared { at: scene.now }
                })
            }
            FaultRequest::ClearAll => {
                self.clear(|_| true, scene);
                Ok(FaultReply::Cleared { at: scene.now })
            }
            FaultRequest::Inject { target, kind, timing } => {
                self.inject(target, kind, timing, scene)
            }
        };
        self.look_ahead(scene.now);
        reply.unwrap_or_else(FaultReply::Refused)
    }

    fn inject(
        &mut self,
        target: Target,
        kind: FaultKind,
        timing: Timing,
        scene: &mut Scene<'_>,
    ) -> Result<FaultReply, Refusal> {
        let effector = check(&self.list, &self.servos, target, &kind, &timing)?;
        let now = scene.now;
        if let Onset::At(at) = timing.onset
            && at > now
        {
            return self.schedule_request(effector, kind, timing, scene);
        }
        let in_the_past = match timing.onset {
            Onset::At(onset) => Some(onset).filter(|onset| *onset < now),
            Onset::AtOnce => None,
        };
        if let Some(present) = self.present[effector]
            && present.fault.is_like(&kind, &timing)
            // Repeated after its onset, a scheduled fault is there already.
            && in_the_past.is_none_or(|onset| onset == present.fault.plan.onset(0))
        {
            return Ok(FaultReply::Unchanged { at: present.at() });
        }
        if let Some(onset) = in_the_past {
            return Err(Refusal::OnsetInThePast { onset, now });
        }
        let fault = self.number(effector, kind, timing, now);
        self.begin(fault, 0, scene);
        Ok(FaultReply::Applied { at: now })
    }

    fn schedule_request(
        &mut self,
        effector: Effector,
        kind: FaultKind,
        timing: Timing,
        scene: &mut Scene<'_>,
    ) -> Result<FaultReply, Refusal> {
        let same = |other: &&Fault| {
            other.effector == effector
                && other.is_like(&kind, &timing)
                && other.timing.onset == timing.onset
        };
        if let Some(other) = self.schedule.iter().find(same) {
            return Ok(FaultReply::Unchanged { at: other.plan.onset(0) });
        }
        let fault = self.number(effector, kind, timing, scene.now);
        let at = fault.plan.onset(0);
        self.insert(fault)?;
        (scene.report)(fault.entry(FaultState::Scheduled { at }));
        Ok(FaultReply::Scheduled { at })
    }

    fn clear(&mut self, is_meant: impl Fn(Effector) -> bool, scene: &mut Scene<'_>) {
        for effector in self.list.all().filter(|e| is_meant(*e)) {
            self.remove(effector, scene);
        }
        let at = scene.now;
        self.schedule.retain(|fault| {
            if is_meant(fault.effector) {
                (scene.report)(fault.entry(FaultState::Cancelled { at }));
            }
            !is_meant(fault.effector)
        });
    }

    /// Takes the commands (inside the travel, rad and N) that hold from `now` on.
    pub fn command(&mut self, commands: &PerEffector<f64>, now: SimTime) {
        self.commands = *commands;
        if !self.tells {
            self.told = *commands;
            return;
        }
        for effector in self.list.all() {
            if let Some(due) = self.acting(effector).and_then(|acting| acting.due(now)) {
                self.delayed[effector].push(due, commands[effector]);
            }
            self.tell(effector, now);
        }
        self.look_ahead(now);
    }

    /// Brings what changes smoothly up to `now`; call it after each step in which nothing happened.
    pub fn vary(&mut self, now: SimTime, positions: &mut PerEffector<f64>) {
        for effector in self.list.all() {
            self.refresh(effector, now, &mut positions[effector]);
        }
        self.varies = self.any(|acting| acting.varies(now));
    }

    /// Lets happen what is due at the scene's time; call it when the integration has reached that time.
    pub fn act(&mut self, scene: &mut Scene<'_>) {
        let now = scene.now;
        for effector in self.list.all() {
            self.refresh(effector, now, &mut scene.positions[effector]);
            if let Some(present) = self.present[effector]
                && present.acting.is_some()
                && present.turn().is_some_and(|end| end <= now)
            {
                self.rest_or_end(effector, &present, scene);
            }
            if let Some(Present { fault, cycle, acting: None }) = self.present[effector]
                && fault.plan.onset(cycle + 1) <= now
            {
                self.begin(fault, cycle + 1, scene);
            }
        }
        while self.schedule.first().is_some_and(|fault| fault.plan.onset(0) <= now) {
            let fault = self.schedule.remove(0);
            self.begin(fault, 0, scene);
        }
        self.look_ahead(now);
    }

    /// The fault number `cycle + 1` times acts; what the effector had is over.
    fn begin(&mut self, fault: Fault, cycle: u32, scene: &mut Scene<'_>) {
        let Fault { effector, kind, plan, .. } = fault;
        let now = scene.now;
        let before = self.present[effector];
        if let Some(before) = before.filter(|before| before.fault.id != fault.id) {
            (scene.report)(before.fault.entry(FaultState::Ended { at: now }));
        }
        let old = before.and_then(|before| before.acting);
        let servo = scene.positions[effector];
        let effective = self.effects.effective_deflection(effector, servo);
        let mut position = match old {
            // A servo that deviates does not know it, and goes on from where it believes to be.
            Some(old) if old.deviates() && acting::deviates(&kind) => servo,
            _ => self.effects.position(effector, servo),
        };
        if !old.is_some_and(|old| old.is_delayed()) {
            self.told[effector] = self.commands[effector];
        }
        let acting = Acting::begin(
            kind,
            plan.ramp_us,
            now,
            &self.servos[effector],
            effective,
            &mut position,
        );
        self.delayed[effector].clear();
        self.present[effector] = Some(Present { fault, cycle, acting: Some(acting) });
        self.refresh(effector, now, &mut position);
        scene.positions[effector] = position;
        (scene.report)(fault.entry(FaultState::Acting { since: now }));
    }

    /// The fault of an effector has acted its time.
    fn rest_or_end(&mut self, effector: Effector, present: &Present, scene: &mut Scene<'_>) {
        if !present.fault.plan.comes_again(present.cycle) {
            return self.remove(effector, scene);
        }
        self.mend(effector, scene.positions);
        let resting = Present { acting: None, ..*present };
        self.present[effector] = Some(resting);
        (scene.report)(resting.fault.entry(resting.state()));
    }

    /// The fault of an effector, if it has one, is over.
    fn remove(&mut self, effector: Effector, scene: &mut Scene<'_>) {
        if let Some(present) = self.present[effector].take() {
            self.mend(effector, scene.positions);
            (scene.report)(present.fault.entry(FaultState::Ended { at: scene.now }));
        }
    }

    /// A healthy servo takes over where the effector is.
    fn mend(&mut self, effector: Effector, positions: &mut PerEffector<f64>) {
        positions[effector] = self.effects.position(effector, positions[effector]);
        self.effects.set(effector, &Share::HEALTHY, 0);
        self.delayed[effector].clear();
        self.told[effector] = self.commands[effector];
    }

    /// Brings the effector's fault up to `now`.
    fn refresh(&mut self, effector: Effector, now: SimTime, position: &mut f64) {
        if let Some(Present { fault, acting: Some(acting), .. }) = &mut self.present[effector] {
            acting.arrive(now, position);
            self.effects.set(effector, &acting.share(now), fault.kind.code());
            self.tell(effector, now);
        }
    }

    /// Tells the servo of an effector what its fault lets through.
    fn tell(&mut self, effector: Effector, now: SimTime) {
        let command = self.commands[effector];
        self.told[effector] = match self.acting(effector) {
            None => command,
            Some(acting) if acting.is_delayed() => {
                self.delayed[effector].due(now).unwrap_or(self.told[effector])
            }
            Some(acting) => acting.command(command, now),
        };
    }

    fn acting(&self, effector: Effector) -> Option<&Acting> {
        self.present[effector].as_ref()?.acting.as_ref()
    }

    fn any(&self, is_so: impl Fn(&Acting) -> bool) -> bool {
        self.list.all().filter_map(|effector| self.acting(effector)).any(is_so)
    }

    /// What comes next, after something has changed at `now`.
    fn look_ahead(&mut self, now: SimTime) {
        self.tells = self.any(Acting::tells);
        self.varies = self.any(|acting| acting.varies(now));
        let of_effector = |effector: Effector| {
            let present = self.present[effector].as_ref()?;
            let within = present.acting.as_ref().and_then(|acting| acting.next_event(now));
            [within, present.turn(), self.delayed[effector].next()].into_iter().flatten().min()
        };
        let onset = self.schedule.first().map(|fault| fault.plan.onset(0));
        self.next_event = self.list.all().filter_map(of_effector).chain(onset).min();
    }

    fn number(
        &mut self,
        effector: Effector,
        kind: FaultKind,
        timing: Timing,
        now: SimTime,
    ) -> Fault {
        // Wraps after four thousand million faults; the list holds 72 of them.
        self.last_id = self.last_id.wrapping_add(1);
        let plan = Plan::new(&timing, now);
        let timing = Timing { onset: Onset::At(plan.onset(0)), ..timing };
        Fault { id: self.last_id, effector, kind, timing, plan }
    }

    fn insert(&mut self, fault: Fault) -> Result<(), Refusal> {
        if self.schedule.len() >= SCHEDULE_MAX {
            #[expect(clippy::cast_possible_truncation, reason = "64")]
            return Err(Refusal::ScheduleFull { capacity: SCHEDULE_MAX as u32 });
        }
        let at = fault.plan.onset(0);
        let place = self.schedule.partition_point(|other| other.plan.onset(0) <= at);
        self.schedule.insert(place, fault);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
