//! The faults. Those of effectors act here and nowhere else, between commands and forces; [`SensorEffect`] is what others do.
//!
//! ```text
//! commands -> received ─> servos ──> positions ──> effective deflections ──> air and jet
//!              ^            ^           ^             ^
//!           delayed      stuck      oscillating   partial loss
//!           flame-out    hard over  drifting
//!           limited      slow       biased
//! ```
//!
//! A healthy effector passes every stage unchanged, to the bit. "Here" in the name of a fault kind is the effective
//! deflection at the onset.
//!
//! The entries of [`icd::fault::CATALOGUE`] describe the kinds; the module `active` implements them.
//!
//! After a repair the healthy servo moves the effector on from its present position; only effectiveness that a partial
//! loss took away returns at once. When one fault replaces another on the same effector, the second begins at the
//! position where the first left the effector; consecutive deviations (oscillating, drifting, biased) refer to the
//! same servo position.
//!
//! All times are exact to the microsecond, also between ticks and integration steps: onset, end, end of the ramp,
//! arrival, each change of an intermittent fault, each delayed command. Quantities that change smoothly (a ramp, an
//! oscillation, a drift) keep their value from the start of an integration step throughout that step.

use icd::fault::{
    self, AirframePart, FaultEntry, FaultKind, FaultReply, FaultRequest, FaultState, Onset,
    PlantReport, Reach, Refusal, SensorKind, Target, Timing,
};
use icd::{Effector, EffectorList, PerEffector, Sensors, SimTime};
use serde::{Deserialize, Serialize};

use crate::servos::{self, Delayed, Servo};

mod active;
mod effects;

pub use active::SensorEffect;
pub use effects::{Effects, FaultEffect};

use active::ActiveFault;

/// Longest delay of a sensor or an effector, s. The buffer of a late effector holds it.
pub(crate) const DELAY_MAX_S: f64 = FaultKind::DELAY_MAX_S;
const _: () = assert!(DELAY_MAX_S <= servos::DELAY_MAX_S);

/// Faults that can wait for their onset.
pub const SCHEDULE_MAX: usize = 64;

/// The state of the aircraft that a change of a fault needs and modifies.
pub struct FaultContext<'a> {
    pub now: SimTime,
    /// Positions of the servos, rad and N; a fault that moves an effector at once changes them.
    pub positions: &'a mut PerEffector<f64>,
    /// Receives a report when a fault begins, pauses or ends.
    pub report: &'a mut dyn FnMut(PlantReport),
}

/// The faults of one aircraft, present and future.
#[derive(Debug, Clone)]
pub struct Faults {
    list: EffectorList,
    servos: PerEffector<Servo>,
    /// Ends of the travel that the hinge moments leave now, rad and N.
    travel: PerEffector<[f64; 2]>,
    /// By the place of the target ([`slot`]).
    current: [Option<CurrentFault>; Target::MAX],
    /// Which sensors and parts the aircraft has.
    has: Fitted,
    /// Ordered by onset; faults with the same onset in the order of their requests.
    schedule: Vec<Fault>,
    effects: Effects,
    /// The commands to the effectors, and what the servos receive of them; rad and N.
    commands: PerEffector<f64>,
    received: PerEffector<f64>,
    delayed: PerEffector<Delayed>,
    /// Whether a fault changes commands.
    alters_commands: bool,
    /// Whether a fault changes from step to step.
    varies: bool,
    /// Whether a sensor has a fault.
    alters_sensors: bool,
    next_event: Option<SimTime>,
    last_id: u32,
}

impl Faults {
    /// A healthy aircraft with these effectors, servos, commands (inside the travel, rad and N) and sensors.
    pub fn none(
        list: &EffectorList,
        servos: &PerEffector<Servo>,
        commands: &PerEffector<f64>,
        has: &Fitted,
    ) -> Self {
        Self {
            list: *list,
            servos: *servos,
            travel: PerEffector::from_fn(|e| [servos[e].min, servos[e].max]),
            current: [None; Target::MAX],
            has: *has,
            // All that it will ever hold, so no request in flight allocates.
            schedule: Vec::with_capacity(SCHEDULE_MAX),
            effects: Effects::none(),
            commands: *commands,
            received: *commands,
            delayed: PerEffector::from_fn(|_| Delayed::new()),
            alters_commands: false,
            varies: false,
            alters_sensors: false,
            next_event: None,
            last_id: 0,
        }
    }

    /// The present effects of all faults.
    #[inline]
    pub fn effects(&self) -> &Effects {
        &self.effects
    }

    /// The commands that the servos receive at present, rad and N.
    #[inline]
    pub fn received(&self) -> &PerEffector<f64> {
        &self.received
    }

    /// The latest commands to the effectors, rad and N.
    #[inline]
    pub fn commands(&self) -> &PerEffector<f64> {
        &self.commands
    }

    /// Whether a fault changes from step to step: then the plant calls [`Faults::vary`] after each step.
    #[inline]
    pub fn varies(&self) -> bool {
        self.varies
    }

    /// Time of the next event, which the integration must not step over.
    #[inline]
    pub fn next_event(&self) -> Option<SimTime> {
        self.next_event
    }

    /// The fault that acts on a target, and since when.
    pub fn active(&self, target: impl Into<Target>) -> Option<(FaultKind, SimTime)> {
        let current = self.current[slot(target)]?;
        Some((current.fault.kind, current.active?.since()))
    }

    /// Reports every fault that acts, rests or is scheduled.
    pub fn list(&self, report: &mut dyn FnMut(PlantReport)) {
        self.current.iter().flatten().for_each(|one| report(one.fault.entry(one.state())));
        for fault in &self.schedule {
            report(fault.entry(FaultState::Scheduled { at: fault.plan.onset(0) }));
        }
    }

    /// Adds a fault of the scenario, and reports it if its onset is still to come.
    pub fn schedule(
        &mut self,
        fault: &ScheduledFault,
        report: &mut dyn FnMut(PlantReport),
    ) -> Result<(), Refusal> {
        check(&self.list, &self.servos, &self.has, fault)?;
        let fault = self.number(fault, SimTime::ZERO);
        self.insert(fault)?;
        self.look_ahead(SimTime::ZERO);
        let at = fault.plan.onset(0);
        // A fault that acts from the start is reported as active instead.
        if at > SimTime::ZERO {
            report(fault.entry(FaultState::Scheduled { at }));
        }
        Ok(())
    }

    /// Executes the request of a ground station, and answers what the plant did.
    pub fn request(
        &mut self,
        request: &FaultRequest,
        context: &mut FaultContext<'_>,
    ) -> FaultReply {
        let reply = match *request {
            FaultRequest::Clear { target } => {
                check_target(&self.list, &self.has, target).map(|()| {
                    self.clear(|other| other == target, context);
                    FaultReply::Cleared { at: context.now }
                })
            }
            FaultRequest::ClearAll => {
                self.clear(|_| true, context);
                Ok(FaultReply::Cleared { at: context.now })
            }
            FaultRequest::Inject { target, kind, timing } => {
                self.inject(&ScheduledFault { target, kind, timing }, context)
            }
        };
        self.look_ahead(context.now);
        reply.unwrap_or_else(FaultReply::Refused)
    }

    fn inject(
        &mut self,
        request: &ScheduledFault,
        context: &mut FaultContext<'_>,
    ) -> Result<FaultReply, Refusal> {
        check(&self.list, &self.servos, &self.has, request)?;
        let now = context.now;
        if matches!(request.timing.onset, Onset::At(at) if at > now) {
            return self.schedule_request(request, context);
        }
        let in_the_past = match request.timing.onset {
            Onset::At(onset) => Some(onset).filter(|onset| *onset < now),
            Onset::AtOnce => None,
        };
        if let Some(current) = self.current[slot(request.target)]
            && current.fault.is_like(request)
            // A request repeated after its onset finds the scheduled fault already active.
            && in_the_past.is_none_or(|onset| onset == current.fault.plan.onset(0))
        {
            return Ok(FaultReply::Unchanged { at: current.at() });
        }
        if let Some(onset) = in_the_past {
            return Err(Refusal::OnsetInThePast { onset, now });
        }
        let fault = self.number(request, now);
        self.begin(fault, 0, context);
        Ok(FaultReply::Applied { at: now })
    }

    fn schedule_request(
        &mut self,
        request: &ScheduledFault,
        context: &mut FaultContext<'_>,
    ) -> Result<FaultReply, Refusal> {
        let same = |other: &&Fault| {
            other.target == request.target
                && other.is_like(request)
                && other.timing.onset == request.timing.onset
        };
        // Ground stations repeat a command whose answer was lost.
        if let Some(other) = self.schedule.iter().find(same) {
            return Ok(FaultReply::Unchanged { at: other.plan.onset(0) });
        }
        let fault = self.number(request, context.now);
        let at = fault.plan.onset(0);
        self.insert(fault)?;
        (context.report)(fault.entry(FaultState::Scheduled { at }));
        Ok(FaultReply::Scheduled { at })
    }

    fn clear(&mut self, is_meant: impl Fn(Target) -> bool, context: &mut FaultContext<'_>) {
        for index in 0..Target::MAX {
            if self.current[index].is_some_and(|current| is_meant(current.fault.target)) {
                self.remove(index, context);
            }
        }
        let at = context.now;
        self.schedule.retain(|fault| {
            if is_meant(fault.target) {
                (context.report)(fault.entry(FaultState::Cancelled { at }));
            }
            !is_meant(fault.target)
        });
    }

    /// Updates the faults that change smoothly to `now`; the plant calls it after each step without an event.
    pub fn vary(&mut self, now: SimTime, positions: &mut PerEffector<f64>) {
        for effector in self.list.all() {
            self.refresh(effector, now, &mut positions[effector]);
        }
        self.varies = self.vary_after(now);
    }

    /// Applies every event that is due at the context's time; the plant calls it when the integration has reached
    /// that time.
    pub fn apply_due(&mut self, context: &mut FaultContext<'_>) {
        // First of all to where the faults have brought the effectors by now: a repair goes on from
        // there.
        let now = context.now;
        for effector in self.list.all() {
            self.refresh(effector, now, &mut context.positions[effector]);
        }
        // Ends come before onsets: of two faults that meet at one time the first is repaired before
        // the second begins.
        for index in 0..Target::MAX {
            if let Some(current) = self.current[index]
                && current.active.is_some()
                && current.next_change().is_some_and(|end| end <= now)
            {
                self.pause_or_end(index, &current, context);
            }
            // Read again, since the lines above may have ended or paused it.
            if let Some(CurrentFault { fault, cycle, active: None }) = self.current[index]
                && fault.plan.onset(cycle + 1) <= now
            {
                self.begin(fault, cycle + 1, context);
            }
        }
        while self.schedule.first().is_some_and(|fault| fault.plan.onset(0) <= now) {
            let fault = self.schedule.remove(0);
            self.begin(fault, 0, context);
        }
        self.look_ahead(now);
    }

    /// Starts a fault for the time number `cycle`, from 0, and ends the fault that the target had.
    fn begin(&mut self, fault: Fault, cycle: u32, context: &mut FaultContext<'_>) {
        let now = context.now;
        let before = self.current[slot(fault.target)];
        // A repetition begins the same fault once more, which ends nothing.
        if let Some(before) = before.filter(|before| before.fault.id != fault.id) {
            (context.report)(before.fault.entry(FaultState::Ended { at: now }));
        }
        match fault.target {
            Target::Effector(effector) => self.begin_on(effector, &fault, cycle, context),
            Target::Sensor(_) | Target::Part(_) => {
                let active = ActiveFault::of_others(fault.kind, fault.plan.ramp_us, now);
                let current = CurrentFault { fault, cycle, active: Some(active) };
                self.current[slot(fault.target)] = Some(current);
            }
        }
        (context.report)(fault.entry(FaultState::Active { since: now }));
    }

    fn begin_on(
        &mut self,
        effector: Effector,
        fault: &Fault,
        cycle: u32,
        context: &mut FaultContext<'_>,
    ) {
        let Fault { kind, plan, .. } = *fault;
        let now = context.now;
        let old = self.current[slot(effector)].and_then(|before| before.active);
        let servo = context.positions[effector];
        // What the kinds call "here": taken before anything changes.
        let effective = self.effects.effective_deflection(effector, servo);
        let mut position = match old {
            // The servo does not sense such a deviation, and continues from its own position.
            Some(old) if active::deviates(&old.kind) && active::deviates(&kind) => servo,
            _ => self.effects.position(effector, servo),
        };
        // A late effector goes on with the command that it has received; any other starts from the
        // latest one.
        if !old.is_some_and(|old| old.is_delayed()) {
            self.received[effector] = self.commands[effector];
        }
        let active = ActiveFault::begin(
            kind,
            plan.ramp_us,
            now,
            &self.servos[effector],
            self.travel[effector],
            effective,
            &mut position,
        );
        // What is on its way belongs to the fault before.
        self.delayed[effector].clear();
        self.current[slot(effector)] =
            Some(CurrentFault { fault: *fault, cycle, active: Some(active) });
        // At once: the step that begins now flies with the fault.
        self.refresh(effector, now, &mut position);
        context.positions[effector] = position;
    }

    /// The duration of a fault is over: it pauses until its repetition, or ends.
    fn pause_or_end(
        &mut self,
        index: usize,
        current: &CurrentFault,
        context: &mut FaultContext<'_>,
    ) {
        if !current.fault.plan.repeats_after(current.cycle) {
            return self.remove(index, context);
        }
        self.repair(current.fault.target, context.positions);
        let resting = CurrentFault { active: None, ..*current };
        self.current[index] = Some(resting);
        (context.report)(resting.fault.entry(resting.state()));
    }

    /// Ends the fault of a target, if it has one.
    fn remove(&mut self, index: usize, context: &mut FaultContext<'_>) {
        if let Some(current) = self.current[index].take() {
            self.repair(current.fault.target, context.positions);
            (context.report)(current.fault.entry(FaultState::Ended { at: context.now }));
        }
    }

    /// Gives an effector back to its healthy servo, at its present position; a sensor is repaired at once.
    fn repair(&mut self, target: Target, positions: &mut PerEffector<f64>) {
        // Effects on sensors and parts are asked for anew at each use, and leave nothing to undo.
        let Some(effector) = target.effector() else { return };
        positions[effector] = self.effects.position(effector, positions[effector]);
        self.effects.set(effector, &FaultEffect::HEALTHY, 0);
        self.delayed[effector].clear();
        self.received[effector] = self.commands[effector];
    }

    /// Updates the effector's fault to `now`.
    fn refresh(&mut self, effector: Effector, now: SimTime, position: &mut f64) {
        if let Some(CurrentFault { fault, active: Some(active), .. }) =
            &mut self.current[slot(effector)]
        {
            active.arrive(now, position);
            self.effects.set(effector, &active.effect(now), fault.kind.code());
            self.update_received(effector, now);
        }
    }

    fn active_fault(&self, effector: Effector) -> Option<&ActiveFault> {
        self.current[slot(effector)].as_ref()?.active.as_ref()
    }

    fn any(&self, is_so: impl Fn(&ActiveFault) -> bool) -> bool {
        self.list.all().filter_map(|effector| self.active_fault(effector)).any(is_so)
    }

    /// Finds the next event after a change at `now`, and whether faults alter commands or vary with time.
    fn look_ahead(&mut self, now: SimTime) {
        self.alters_commands = self.any(ActiveFault::alters_commands);
        self.varies = self.vary_after(now);
        let has_fault = |sensor: SensorKind| self.current[slot(sensor)].is_some();
        self.alters_sensors = SensorKind::ALL.into_iter().any(has_fault);
        let of_effector = |effector: Effector| {
            let current = self.current[slot(effector)].as_ref()?;
            let within = current.active.as_ref().and_then(|active| active.next_event(now));
            [within, current.next_change(), self.delayed[effector].next()]
                .into_iter()
                .flatten()
                .min()
        };
        let onset = self.schedule.first().map(|fault| fault.plan.onset(0));
        // Of the faults of sensors and parts only onset and end are events.
        let of_others =
            self.current[Effector::MAX..].iter().flatten().filter_map(CurrentFault::next_change);
        let of_effectors = self.list.all().filter_map(of_effector);
        self.next_event = of_effectors.chain(of_others).chain(onset).min();
    }

    /// Sets the commands (inside the travel, rad and N) that apply from `now` on.
    pub fn command(&mut self, commands: &PerEffector<f64>, now: SimTime) {
        self.commands = *commands;
        if !self.alters_commands {
            self.received = *commands;
            return;
        }
        for effector in self.list.all() {
            self.receive(effector, now);
        }
        // The arrival of a late command is an event too.
        self.look_ahead(now);
    }

    /// The same for one effector, whose command arrives between those of the others.
    pub fn command_one(&mut self, effector: Effector, command: f64, now: SimTime) {
        self.commands[effector] = command;
        self.receive(effector, now);
        self.look_ahead(now);
    }

    /// Sets the ends of the travel that the hinge moment leaves an effector, rad or N.
    pub fn limit_travel(&mut self, effector: Effector, travel: [f64; 2]) {
        self.travel[effector] = travel;
    }

    fn receive(&mut self, effector: Effector, now: SimTime) {
        if let Some(due) = self.active_fault(effector).and_then(|active| active.due(now)) {
            self.delayed[effector].push(due, self.commands[effector]);
        }
        self.update_received(effector, now);
    }

    /// Sets the command that an effector's servo receives in spite of its fault.
    fn update_received(&mut self, effector: Effector, now: SimTime) {
        let command = self.commands[effector];
        self.received[effector] = match self.active_fault(effector) {
            None => command,
            Some(active) if active.is_delayed() => {
                // Until the first command has arrived the servo keeps what it had.
                self.delayed[effector].due(now).unwrap_or(self.received[effector])
            }
            Some(active) => active.command(command, now),
        };
    }

    /// Whether a sensor has a fault.
    #[inline]
    pub fn has_sensor_faults(&self) -> bool {
        self.alters_sensors
    }

    /// How much of each part of the airframe is torn off at `now`: the fraction of its span from the tip.
    pub fn torn_off(&self, now: SimTime) -> [f64; AirframePart::ALL.len()] {
        AirframePart::ALL.map(|part| {
            let active = self.current[slot(part)].as_ref().and_then(|one| one.active.as_ref());
            active.map_or(0.0, |active| active.torn_off(now))
        })
    }

    /// The effect on a sensor at `now`, and the time of its onset.
    pub fn on_sensor(&self, sensor: SensorKind, now: SimTime) -> Option<(SimTime, SensorEffect)> {
        let active = self.current[slot(sensor)].as_ref()?.active.as_ref()?;
        Some((active.since(), active.on_sensor(now)))
    }

    /// The engine gets no fuel any more: it is out, and no repair brings it back.
    pub fn starve(&mut self, engine: Effector, context: &mut FaultContext<'_>) {
        // An empty tank asks in every period.
        if self.active(engine).is_none_or(|(kind, _)| kind != active::STARVED) {
            let (target, kind, timing) = (engine.into(), active::STARVED, Timing::NOW);
            // No station has asked; the report of the onset tells it.
            let _reply = self.inject(&ScheduledFault { target, kind, timing }, context);
            self.look_ahead(context.now);
        }
    }

    /// Whether an effect that acts on effectors or the airframe changes from step to step.
    fn vary_after(&self, now: SimTime) -> bool {
        let parts = || AirframePart::ALL.into_iter().filter_map(|part| self.current[slot(part)]);
        self.any(|active| active.varies(now))
            || parts().any(|current| current.active.is_some_and(|active| active.varies(now)))
    }

    fn number(&mut self, request: &ScheduledFault, now: SimTime) -> Fault {
        let ScheduledFault { target, kind, timing } = *request;
        // Wraps after four billion faults; the list holds at most 94.
        self.last_id = self.last_id.wrapping_add(1);
        let plan = FaultPlan::new(&timing, now);
        let timing = Timing { onset: Onset::At(plan.onset(0)), ..timing };
        Fault { id: self.last_id, target, kind, timing, plan }
    }

    fn insert(&mut self, fault: Fault) -> Result<(), Refusal> {
        if self.schedule.len() >= SCHEDULE_MAX {
            // 64 fits.
            return Err(Refusal::ScheduleFull { capacity: SCHEDULE_MAX as u32 });
        }
        let at = fault.plan.onset(0);
        // Behind those of the same onset, which act in the order of their requests.
        let place = self.schedule.partition_point(|other| other.plan.onset(0) <= at);
        self.schedule.insert(place, fault);
        Ok(())
    }
}

/// A fault of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScheduledFault {
    /// The effector, sensor or part that fails.
    pub target: Target,
    pub kind: FaultKind,
    /// When, how fast, for how long, how often; at once means at the start of the flight.
    pub timing: Timing,
}

impl ScheduledFault {
    /// In words: `rudder, stuck at 7.0 deg`.
    pub fn described(&self, effectors: &EffectorList) -> String {
        let Self { target, kind, .. } = *self;
        format!("{}, {}", target.name(effectors), kind.described(target.class(effectors)))
    }

    /// When it first acts.
    pub fn onset(&self) -> SimTime {
        FaultPlan::new(&self.timing, SimTime::ZERO).onset(0)
    }
}

/// What an aircraft has besides its effectors, in the order of the kinds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fitted {
    pub sensors: [bool; Sensors::SENSORS],
    /// Parts of the airframe whose loss its file describes.
    pub parts: [bool; AirframePart::ALL.len()],
}

/// Whether this aircraft can have the fault.
pub fn check(
    list: &EffectorList,
    servos: &PerEffector<Servo>,
    has: &Fitted,
    request: &ScheduledFault,
) -> Result<(), Refusal> {
    let ScheduledFault { target, kind, timing } = request;
    check_target(list, has, *target)?;
    let reach = match *target {
        Target::Effector(effector) => servos[effector].reach(target.class(list)),
        Target::Sensor(sensor) => Reach::of_sensor(sensor),
        Target::Part(_) => Reach::PART,
    };
    fault::check(kind, timing, &reach)
}

/// Whether this aircraft has the target.
fn check_target(list: &EffectorList, has: &Fitted, target: Target) -> Result<(), Refusal> {
    // At most 16.
    let count = list.len() as u8;
    match target {
        Target::Effector(effector) if !list.contains(effector) => {
            Err(Refusal::NoSuchEffector { count })
        }
        Target::Sensor(sensor) if !has.sensors[sensor as usize] => Err(Refusal::NoSuchSensor),
        Target::Part(part) if !has.parts[part as usize] => Err(Refusal::NoSuchPart),
        Target::Effector(_) | Target::Sensor(_) | Target::Part(_) => Ok(()),
    }
}

/// Place of a target in a list of all of them.
fn slot(target: impl Into<Target>) -> usize {
    target.into().slot()
}

/// A fault of the list.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Fault {
    pub id: u32,
    pub target: Target,
    pub kind: FaultKind,
    /// Its onset is a time, never "at once".
    pub timing: Timing,
    pub plan: FaultPlan,
}

/// The present fault of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CurrentFault {
    pub fault: Fault,
    /// Number of the repetition, from 0.
    pub cycle: u32,
    /// `None` during the pause between two repetitions.
    pub active: Option<ActiveFault>,
}

impl Fault {
    pub fn entry(&self, state: FaultState) -> PlantReport {
        let Self { id, target, kind, timing, .. } = *self;
        PlantReport::Fault(FaultEntry { id, target, kind, timing, state })
    }

    /// Whether the request was the same, apart from the onset.
    pub fn is_like(&self, request: &ScheduledFault) -> bool {
        // The onset is a time by now, also where the request said "at once".
        let timing = Timing { onset: self.timing.onset, ..request.timing };
        self.kind == request.kind && timing == self.timing
    }
}

impl CurrentFault {
    pub fn state(&self) -> FaultState {
        let Self { fault: Fault { plan, .. }, cycle, .. } = *self;
        match &self.active {
            Some(active) => FaultState::Active { since: active.since() },
            None => {
                // Only a fault with an end rests.
                let since = plan.end(cycle).unwrap_or_default();
                FaultState::Resting { since, next: plan.onset(cycle + 1) }
            }
        }
    }

    /// The time since which it acts, or the next time at which it will.
    pub fn at(&self) -> SimTime {
        match self.state() {
            FaultState::Resting { next, .. } => next,
            state => state.time(),
        }
    }

    /// When it changes between active and pausing, or ends.
    pub fn next_change(&self) -> Option<SimTime> {
        let plan = &self.fault.plan;
        if self.active.is_some() { plan.end(self.cycle) } else { Some(plan.onset(self.cycle + 1)) }
    }
}

/// A [`Timing`] in absolute times. The onset of every repetition is exact: rounding errors do not accumulate.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FaultPlan {
    onset: SimTime,
    /// Time from no effect to the full fault, µs.
    pub ramp_us: u64,
    duration_us: Option<u64>,
    every_us: u64,
    /// Number of times that it acts; `None` without end.
    times: Option<u32>,
}

impl FaultPlan {
    /// From a checked timing; "at once" means `now`.
    pub fn new(timing: &Timing, now: SimTime) -> Self {
        Self {
            onset: match timing.onset {
                Onset::AtOnce => now,
                Onset::At(at) => at,
            },
            ramp_us: micros(timing.ramp_s),
            duration_us: timing.duration_s.map(micros),
            every_us: timing.repeat.map_or(0, |repeat| micros(repeat.every_s)),
            times: timing.repeat.map_or(Some(1), |repeat| repeat.times),
        }
    }

    /// Onset of repetition `cycle`, from 0.
    pub fn onset(&self, cycle: u32) -> SimTime {
        SimTime::from_micros(
            self.onset.as_micros().saturating_add(self.every_us * u64::from(cycle)),
        )
    }

    /// End of repetition `cycle`; `None` for a fault without end.
    pub fn end(&self, cycle: u32) -> Option<SimTime> {
        let duration_us = self.duration_us?;
        Some(SimTime::from_micros(self.onset(cycle).as_micros().saturating_add(duration_us)))
    }

    /// Whether another repetition follows repetition `cycle`.
    pub fn repeats_after(&self, cycle: u32) -> bool {
        self.times.is_none_or(|times| cycle + 1 < times)
    }
}

/// Seconds, rounded to the nearest microsecond; the caller has checked their range.
pub(crate) fn micros(seconds: f64) -> u64 {
    // Only NaN fails here, which no checked value is.
    SimTime::from_seconds(seconds.clamp(0.0, SimTime::MAX_SECONDS)).unwrap_or_default().as_micros()
}

#[cfg(test)]
mod tests;
